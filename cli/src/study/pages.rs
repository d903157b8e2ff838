//! The study as files: a report to open, the numbers behind it, and a shorter page for docs.

use anyhow::Result;

use super::advice::Cost;
use super::curves::{SHALLOW, SetReport};
use super::table::Table;
use super::{Study, csv, plots, tables};
use crate::histogram::escaped;

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

/// All that `study` writes into its own folder.
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

/// The short version: a page, and pictures in a folder beside it.
pub fn docs(study: &Study) -> Result<Vec<Page>> {
    let mut pages = vec![Page::new("study.md", markdown(study))];
    for set in &study.sets {
        pages.push(Page::new(format!("{PICTURES}/{}", picture("steps", set)), plots::convergence(set)?));
        pages.push(Page::new(format!("{PICTURES}/{}", picture("cost", set)), plots::against_cost(set)?));
    }
    pages.push(Page::new(format!("{PICTURES}/apexes.svg"), plots::found(&study.apexes)?));
    pages.push(Page::new(format!("{PICTURES}/culls.svg"), plots::culls(&study.scenes)?));
    pages.push(Page::new(format!("{PICTURES}/misses.svg"), plots::misses(&study.scenes)?));
    Ok(pages)
}

fn picture(what: &str, set: &SetReport) -> String {
    format!("{what}-{}-{}.svg", set.set, set.elements)
}

/// Grids before shapes.
fn sets_of_summary(study: &Study) -> Vec<&SetReport> {
    let of = |name: &'static str| study.sets.iter().filter(move |set| set.set == name);
    of("dense").chain(of("shapes")).collect()
}

fn about_problems(study: &Study) -> String {
    let count = study.apexes.problems;
    format!(
        "Each set has {count} random problems with fixed seeds: an edge or a face somewhere in or around a body, from a \
         twentieth of the body to as large as it, kept only where its least value is at none of its corners, where every \
         method looks first (how many were drawn for that stands under References). An error is the value that was found \
         less the lower bound that branch and bound proves of the whole element, in lengths of its longest edge; so it is \
         never less than the true error, and more by at most the gap that the reference leaves, whose median is the grey \
         line in the plots. \
         Problems whose reference did not converge are left \
         out and counted under References. A contact counts as missed where the value \
         found is more than {SHALLOW} edges above the reference: a method then does not see a contact that is {SHALLOW} edges \
         deep. Times are what one thread has run, for one element after another, medians of {} rounds in which all methods \
         take turns; all other numbers are the same from run to run.",
        super::rounds(study.short)
    )
}

const ABOUT_CURVES: &str = "The band holds the middle half of the errors, the thick line is the median, 95 of 100 are below the \
    dashed line, the dotted one is the worst. A step of the line search asks the field up to four times; see the evaluations.";

const ABOUT_ADVICE: &str = "The method that misses fewest contacts among those whose cost is on average no more than the column says, \
    and of equal ones that with the least error that 95 of 100 problems keep below; in brackets that error and the share missed.";

const ABOUT_APEXES: &str = "The apex stands above the face by a hundredth of a unit or less, and faces are about half a unit large. \
    Counted are the apexes whose depth is found to within what counts as missed else; it is known without a search.";

const ABOUT_SCENES: &str = "As many elements and cells as in the paper's table 1, bodies and meshes of our own (scenes/). The \
    paper's times are of a graphics processor, an RTX 2080 Ti, with other bodies, and stand beside ours for their order alone. Its \
    simple approach asks at vertices. A contact is an element proven to come within the scene's margin, by branch and bound with \
    20,000 evaluations; undecided elements count as neither.";

fn html(study: &Study) -> Result<String> {
    let mut page = Html { text: HTML_HEAD.to_owned() };
    page.tag("h1", "Error against run time of every minimizer");
    page.tag("p", &about_problems(study));
    page.tag("h2", "Which method for which budget");
    page.tag("p", ABOUT_ADVICE);
    page.table("By evaluations of the field for one element", &tables::advice(&study.advice, Cost::Evaluations));
    page.table("By time for one element", &tables::advice(&study.advice, Cost::Nanoseconds));
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
    page.tag("p", &format!("The study took {:.0} s.", study.seconds));
    Ok(page.text + "</body>\n</html>\n")
}

const HTML_HEAD: &str = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<title>sdftool study</title>\n<style>\n\
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
        self.text.push_str(&format!("<{tag}>{}</{tag}>\n", escaped(words)));
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
        "# Error against run time of every minimizer\n\nMade by `sdftool study --docs docs` in {:.0} s on {} threads; \
         `index.html`, which it writes too, is the whole report.\n\n",
        study.seconds,
        std::thread::available_parallelism().map_or(1, usize::from)
    );
    let mut add = |words: &str| {
        page.push_str(words);
        page.push('\n');
    };
    for set in sets_of_summary(study) {
        add(&format!("{}, {}:\n\n{}", set.about, set.elements, tables::summary(set, &study.apexes).markdown()));
    }
    add(&about_problems(study));
    add("\n## Which method for which budget\n");
    add(ABOUT_ADVICE);
    add(&format!(
        "\nBy evaluations for one element:\n\n{}",
        tables::advice(&study.advice, Cost::Evaluations).markdown()
    ));
    add(&format!("By time for one element:\n\n{}", tables::advice(&study.advice, Cost::Nanoseconds).markdown()));
    add("## Error against steps (Fig. 12 of the paper)\n");
    add(ABOUT_CURVES);
    study.sets.iter().for_each(|set| add(&linked("steps", set)));
    add("\n## Error and missed contacts against evaluations and time");
    study.sets.iter().for_each(|set| add(&linked("cost", set)));
    add(&format!(
        "\n## The apex of a cone through a face\n\n{ABOUT_APEXES}\n\n![Share of apexes found]({PICTURES}/apexes.svg)\n"
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

fn linked(what: &str, set: &SetReport) -> String {
    format!("\n![{}, {}]({PICTURES}/{})", set.about, set.elements, picture(what, set))
}
