//! The results as files: a report to open, the numbers behind it, and a shorter page for docs.

use anyhow::Result;

use super::advice::Cost;
use super::curves::SetReport;
use super::problems::MISS_DEPTH;
use super::{Study, csv, plots, tables};
use crate::table::{Table, escape_html};

/// A file to write.
pub struct Page {
    pub name: String,
    pub content: String,
}

impl Page {
    fn new(name: impl Into<String>, content: String) -> Self {
        Self { name: name.into(), content }
    }
}

/// The full report and the numbers behind it.
pub fn folder(study: &Study) -> Result<Vec<Page>> {
    let mut json = serde_json::to_string_pretty(study)?;
    json.push('\n');
    Ok(vec![
        Page::new("index.html", html(study)?),
        Page::new("study.json", json),
        Page::new("curves.csv", csv::curves(study).csv()),
        Page::new("scenes.csv", csv::scenes(&study.scenes).csv()),
        Page::new("advice.csv", csv::advice(&study.advice).csv()),
    ])
}

const PICTURES: &str = "pictures/study";

/// The short version: docs/study.md and its pictures.
pub fn docs(study: &Study) -> Result<Vec<Page>> {
    let mut pages = vec![Page::new("study.md", markdown(study))];
    for set in &study.sets {
        pages.push(Page::new(format!("{PICTURES}/{}", picture_name("steps", set)), plots::convergence(set)?));
        pages.push(Page::new(format!("{PICTURES}/{}", picture_name("cost", set)), plots::against_cost(set)?));
    }
    pages.push(Page::new(format!("{PICTURES}/apexes.svg"), plots::found(&study.apexes)?));
    pages.push(Page::new(format!("{PICTURES}/culls.svg"), plots::culls(&study.scenes)?));
    pages.push(Page::new(format!("{PICTURES}/misses.svg"), plots::misses(&study.scenes)?));
    Ok(pages)
}

fn picture_name(what: &str, set: &SetReport) -> String {
    format!("{what}-{}-{}.svg", set.set, set.elements)
}

/// The sets of the summary: grids before shapes.
fn summary_sets(study: &Study) -> Vec<&SetReport> {
    let named = |name: &'static str| study.sets.iter().filter(move |set| set.set == name);
    named("dense").chain(named("shapes")).collect()
}

fn about_problems(study: &Study) -> String {
    let count = study.apexes.problems;
    format!(
        "Each set has {count} random problems with fixed seeds. A problem is an edge or a face in or around a body, between a \
         twentieth of the body's size and all of it. Elements with the minimum at a corner are rejected, because the minimizers \
         evaluate the corners first; References has the number drawn. \
         The error is the value found minus a lower bound that branch and bound proves for the whole element, in lengths of its \
         longest edge. It is at least the true error, and exceeds it by at most the gap of the reference; the grey line in the \
         plots is the median gap. Problems whose reference did not converge are left out and counted under References. \
         A contact counts as missed if the value found is more than {MISS_DEPTH} edges above the reference: the method then \
         misses a contact {MISS_DEPTH} edges deep. \
         Times are the processor time of one thread for one element after another, medians of {} rounds in which all methods \
         take turns. All other numbers are the same in every run.",
        study.rounds
    )
}

const ABOUT_CURVES: &str = "The band is the middle half of the errors, the thick line their median, the dashed line the 95th \
    percentile, the dotted line the maximum.";

const ABOUT_ADVICE: &str = "The method and budget with the fewest missed contacts among those whose mean cost is within the column's \
    limit; ties are decided by the 95th percentile of errors. In brackets: that percentile, and the fraction missed.";

const ABOUT_APEXES: &str = "Faces are about half a unit large, and the apex of a cone pierces each by a hundredth of a unit or less. \
    The minimum is known without a search. An apex is found if the value is within the depth at which contacts count as missed.";

const ABOUT_SCENES: &str = "As many elements and cells as in the paper's table 1, with bodies and meshes of our own (bench/scenes/). The \
    paper's times are of an RTX 2080 Ti and of other bodies: compare orders of magnitude only. Its simple approach evaluates the \
    vertices. A contact is an element proven to come within the scene's margin, by branch and bound with 20,000 evaluations; undecided \
    elements count neither as contacts nor as missed.";

fn html(study: &Study) -> Result<String> {
    let mut page = Html { text: HTML_HEAD.to_owned() };
    page.tag("h1", "Error against run time of every minimizer");
    page.tag("p", &about_problems(study));
    page.tag("h2", "Which method for which budget");
    page.tag("p", ABOUT_ADVICE);
    page.table("By evaluations per element", &tables::advice(&study.advice, Cost::Evaluations));
    page.table("By time per element", &tables::advice(&study.advice, Cost::Nanoseconds));
    page.tag("h2", "Every method with its usual budget");
    for set in &study.sets {
        page.table(&format!("{}, {}", set.about, set.elements), &tables::summary(set, &study.apexes));
    }
    page.tag("h2", "Error against steps (Fig. 12 of the paper)");
    page.tag("p", ABOUT_CURVES);
    study.sets.iter().try_for_each(|set| page.picture(plots::convergence(set)))?;
    page.tag("h2", "Error and missed contacts against evaluations and time");
    study.sets.iter().try_for_each(|set| page.picture(plots::against_cost(set)))?;
    page.tag("h2", "The apex of a cone through a face");
    page.tag("p", ABOUT_APEXES);
    page.picture(plots::found(&study.apexes))?;
    page.tag("h2", "Scenes (table 1, Fig. 13 and §8.3 of the paper)");
    page.tag("p", ABOUT_SCENES);
    page.picture(plots::culls(&study.scenes))?;
    page.table("Elements, passed the cull, contacts", &tables::culls(&study.scenes));
    page.picture(plots::misses(&study.scenes))?;
    page.table("Times, contacts found and missed", &tables::scenes(&study.scenes));
    page.tag("h2", "References");
    page.table("Branch and bound, gaps in edges", &tables::references(&study.sets));
    page.tag("p", &format!("All measurements took {:.0} s.", study.seconds));
    Ok(page.text + "</body>\n</html>\n")
}

const HTML_HEAD: &str = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<title>Accuracy of sdftool</title>\n<style>\n\
    body { font-family: sans-serif; max-width: 1180px; margin: 2em auto; color: #111; background: #fff; line-height: 1.45; }\n\
    table { border-collapse: collapse; margin: 0.5em 0 1.5em; font-size: 14px; }\n\
    th, td { padding: 3px 9px; text-align: left; border-bottom: 1px solid #ddd; }\n\
    svg { display: block; margin: 1em 0; max-width: 100%; height: auto; }\n\
    </style>\n</head>\n<body>\n";

struct Html {
    text: String,
}

impl Html {
    fn tag(&mut self, tag: &str, words: &str) {
        self.text.push_str(&format!("<{tag}>{}</{tag}>\n", escape_html(words)));
    }

    fn table(&mut self, title: &str, table: &Table) {
        self.tag("h3", title);
        self.text.push_str(&table.html());
    }

    fn picture(&mut self, svg: Result<String>) -> Result<()> {
        self.text.push_str(&svg?);
        Ok(())
    }
}

fn markdown(study: &Study) -> String {
    let mut page = format!(
        "# Error against run time of every minimizer\n\nWritten by `cargo run --release -p sdf-bench --bin accuracy -- --docs docs` \
         in {:.0} s on {} threads. The same command writes the full report, `index.html`.\n\n",
        study.seconds,
        crate::machine::cores()
    );
    let mut add = |words: &str| {
        page.push_str(words);
        page.push('\n');
    };
    for set in summary_sets(study) {
        add(&format!("{}, {}:\n\n{}", set.about, set.elements, tables::summary(set, &study.apexes).markdown()));
    }
    add(&about_problems(study));
    add("\n## Which method for which budget\n");
    add(ABOUT_ADVICE);
    let advice = |cost| tables::advice(&study.advice, cost).markdown();
    add(&format!("\nBy evaluations per element:\n\n{}", advice(Cost::Evaluations)));
    add(&format!("By time per element:\n\n{}", advice(Cost::Nanoseconds)));
    add("## Error against steps (Fig. 12 of the paper)\n");
    add(ABOUT_CURVES);
    study.sets.iter().for_each(|set| add(&picture_link("steps", set)));
    add("\n## Error and missed contacts against evaluations and time");
    study.sets.iter().for_each(|set| add(&picture_link("cost", set)));
    add(&format!(
        "\n## The apex of a cone through a face\n\n{ABOUT_APEXES}\n\n![Fraction of apexes found]({PICTURES}/apexes.svg)\n"
    ));
    add("## Scenes (table 1, Fig. 13 and §8.3 of the paper)\n");
    add(ABOUT_SCENES);
    add(&format!("\n![Elements, passed the cull, contacts]({PICTURES}/culls.svg)\n"));
    add(&tables::culls(&study.scenes).markdown());
    add(&format!("![Missed contacts]({PICTURES}/misses.svg)\n"));
    add(&tables::scenes(&study.scenes).markdown());
    add("## References\n");
    add(&tables::references(&study.sets).markdown());
    page
}

fn picture_link(what: &str, set: &SetReport) -> String {
    format!("\n![{}, {}]({PICTURES}/{})", set.about, set.elements, picture_name(what, set))
}
