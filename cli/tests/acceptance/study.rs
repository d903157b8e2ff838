//! What `study --short` writes.

use std::sync::OnceLock;

use serde_json::Value;

use crate::folder::{Folder, says};
use crate::meshes::Model;

/// One run for all tests that only look at it.
fn studied() -> &'static Folder {
    static STUDIED: OnceLock<Folder> = OnceLock::new();
    STUDIED.get_or_init(|| {
        let folder = Folder::new();
        folder.done("study --short -o report --docs docs");
        folder
    })
}

fn text(name: &str) -> String {
    String::from_utf8(studied().read(name)).unwrap()
}

fn json(folder: &Folder) -> Value {
    serde_json::from_slice(&folder.read("report/study.json")).unwrap()
}

/// Each set of problems, that of the apexes last.
fn sets(study: &Value) -> Vec<&Value> {
    study["sets"].as_array().unwrap().iter().chain([&study["apexes"]]).collect()
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

/// Every tag is closed, in the right order. Returns the names of all elements.
fn elements(markup: &str) -> Vec<String> {
    let mut open = vec![];
    let mut names = vec![];
    for part in markup.split('<').skip(1) {
        let (tag, rest) = part.split_once('>').unwrap_or_else(|| panic!("not closed: <{part}"));
        assert!(!rest.contains('>'), "not escaped: {part}");
        let is_entity = |name: &str| ["amp", "lt", "gt", "quot", "apos"].contains(&name);
        assert!(rest.split('&').skip(1).all(|entity| entity.split(';').next().is_some_and(is_entity)), "{rest}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "</{name}> closes another");
        } else if !tag.starts_with('!') {
            let name = tag.split([' ', '\n', '/']).next().unwrap().to_owned();
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
            names.push(name.clone());
            if !tag.ends_with('/') {
                open.push(name);
            }
        }
    }
    assert_eq!(open, [] as [String; 0]);
    names
}

fn needs_no_network(markup: &str) {
    let markup = markup.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for word in ["http:", "https:", "src=", "href", "url(", "@import", "<script", "<link", "<iframe", "<object"] {
        assert!(!markup.contains(word), "{word} in a page that must stand alone");
    }
}

#[test]
fn the_report_is_one_well_formed_page_that_needs_no_network() {
    let page = text("report/index.html");
    assert!(page.starts_with("<!DOCTYPE html>\n<html"));
    needs_no_network(&page);
    let names = elements(&page);
    let count = |wanted: &str| names.iter().filter(|name| *name == wanted).count();
    // Two pictures of each set, and three more.
    assert_eq!(count("svg"), 2 * 7 + 3);
    assert!(count("table") > 8);
    assert!(!page.contains("NaN") && !page.contains("inf"), "a number that is none");
}

#[test]
fn the_docs_show_every_picture_and_each_stands_alone() {
    let page = text("docs/study.md");
    let pictures: Vec<&str> = page
        .split("](")
        .skip(1)
        .map(|rest| rest.split(')').next().unwrap())
        .filter(|name| name.ends_with(".svg"))
        .collect();
    let mut written: Vec<String> = std::fs::read_dir(studied().at("docs/pictures/study"))
        .unwrap()
        .map(|entry| format!("pictures/study/{}", entry.unwrap().file_name().to_string_lossy()))
        .collect();
    written.sort();
    let mut shown = pictures.clone();
    shown.sort_unstable();
    assert_eq!(shown, written);
    for picture in pictures {
        let svg = text(&format!("docs/{picture}"));
        assert!(svg.starts_with("<svg ") && svg.contains("xmlns=\"http://www.w3.org/2000/svg\""), "{picture}");
        let paper = svg.lines().nth(1).unwrap();
        assert!(paper.starts_with("<rect x=\"0\" y=\"0\"") && paper.contains("fill=\"#FFFFFF\""), "{picture}: {paper}");
        needs_no_network(&svg);
        assert!(
            elements(&svg).iter().any(|name| name == "polyline" || name == "circle" || name == "rect"),
            "{picture}"
        );
    }
}

/// The rows of a CSV file, by the names of its columns.
fn rows(name: &str) -> Vec<std::collections::HashMap<String, String>> {
    let text = text(name);
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), head.len(), "{name}: {line}");
        head.iter().zip(cells).map(|(name, cell)| ((*name).to_owned(), cell.to_owned())).collect()
    };
    lines.map(row).collect()
}

/// That a row says the same as an object, under each of the names.
#[track_caller]
fn agree(row: &std::collections::HashMap<String, String>, object: &Value, names: &[(&str, &str)]) {
    for (column, key) in names {
        let (cell, value) = (&row[*column], &object[*key]);
        let same = match value.as_str() {
            Some(text) => cell == text,
            None => cell.parse::<f64>().is_ok_and(|cell| Some(cell) == value.as_f64()),
        };
        assert!(same, "{column}: {cell} in the table, {value} in the JSON");
    }
}

fn same<'a>(names: &[&'a str]) -> Vec<(&'a str, &'a str)> {
    names.iter().map(|name| (*name, *name)).collect()
}

#[test]
fn the_tables_hold_the_numbers_of_the_json() {
    let study = json(studied());
    let mut table = rows("report/curves.csv").into_iter();
    for set in sets(&study) {
        for curve in list(&set["curves"]) {
            for point in list(&curve["points"]) {
                let row = table.next().expect("a row of each point");
                agree(&row, set, &same(&["set", "elements"]));
                agree(&row, curve, &same(&["method", "unit"]));
                agree(&row, point, &same(&["budget", "evaluations", "missed", "nanoseconds"]));
                agree(&row, &point["errors"], &same(&["q1", "median", "q3", "p95", "worst"]));
            }
        }
    }
    assert!(table.next().is_none());
    let mut table = rows("report/scenes.csv").into_iter();
    for scene in list(&study["scenes"]) {
        for method in list(&scene["methods"]) {
            let row = table.next().expect("a row of each method");
            agree(&row, scene, &same(&["scene", "points", "elements", "passed_cull", "contacts", "undecided"]));
            agree(&row, method, &same(&["method", "budget", "unit", "missed", "evaluations", "microseconds"]));
            agree(&row, method, &[("contacts_found", "contacts")]);
        }
    }
    assert!(table.next().is_none());
    let mut table = rows("report/advice.csv").into_iter();
    for advice in list(&study["advice"]) {
        let names = same(&["set", "elements", "cost", "limit", "method", "budget", "unit", "p95", "missed"]);
        agree(&table.next().expect("a row of each advice"), advice, &names);
    }
    assert!(table.next().is_none());
}

/// Without what a clock says.
fn timeless(value: &mut Value) {
    match value {
        Value::Object(members) => {
            members.retain(|name, _| !["seconds", "microseconds", "nanoseconds"].contains(&name.as_str()));
            members.values_mut().for_each(timeless);
        }
        Value::Array(values) => {
            values.retain(|value| value["cost"] != "nanoseconds");
            values.iter_mut().for_each(timeless);
        }
        _ => {}
    }
}

#[test]
fn all_but_the_times_is_the_same_from_run_to_run_and_on_any_number_of_threads() {
    let mut first = json(studied());
    let again = Folder::new();
    again.done("study --short -o report --threads 1");
    let mut second = json(&again);
    timeless(&mut first);
    timeless(&mut second);
    assert_eq!(first, second);
    assert!(sets(&first).len() == 8 && list(&first["scenes"]).len() == 6);
}

#[test]
fn quartiles_are_in_order() {
    let study = json(studied());
    for set in sets(&study) {
        let points = list(&set["curves"]).iter().flat_map(|curve| list(&curve["points"]));
        for spread in points.map(|point| &point["errors"]).chain([&set["reference"]["gap"]]) {
            let rising = ["q1", "median", "q3", "p95", "worst"].map(|name| number(&spread[name]));
            assert!(rising.is_sorted(), "{}: {spread}", set["set"]);
        }
    }
}

/// Sampling takes other points of an edge when it takes more.
#[test]
fn a_larger_budget_never_makes_the_worst_error_or_the_misses_more() {
    let study = json(studied());
    for set in sets(&study) {
        for curve in list(&set["curves"]) {
            if set["elements"] == "edges" && curve["method"] == "sampling" {
                continue;
            }
            for two in list(&curve["points"]).windows(2) {
                let [before, after] = [&two[0], &two[1]];
                let told = format!("{} {} by {}", set["set"], set["elements"], curve["method"]);
                assert!(number(&before["budget"]) < number(&after["budget"]), "{told}");
                assert!(number(&before["evaluations"]) <= number(&after["evaluations"]), "{told}");
                for name in ["q1", "median", "q3", "p95", "worst"] {
                    assert!(
                        number(&before["errors"][name]) >= number(&after["errors"][name]),
                        "{told}: {before} {after}"
                    );
                }
                assert!(number(&before["missed"]) >= number(&after["missed"]), "{told}");
            }
        }
    }
}

#[test]
fn no_method_finds_less_than_the_reference_and_the_reference_is_near() {
    let study = json(studied());
    for set in sets(&study) {
        let reference = &set["reference"];
        assert!(number(&reference["least_error"]) >= -1e-12, "{}: {reference}", set["set"]);
        // A field that is flat over an element leaves branch and bound too much to look at.
        assert!(number(&reference["not_converged"]) * 10.0 <= number(&set["problems"]), "{}", set["set"]);
        let most = if set["elements"] == "edges" { 2e-6 } else { 3e-4 };
        assert!((0.0..most).contains(&number(&reference["gap"]["worst"])), "{}: {reference}", set["set"]);
        // Someone comes near: the reference is not far below what there is.
        let best = list(&set["curves"]).iter().flat_map(|curve| list(&curve["points"]));
        let best = best.map(|point| number(&point["errors"]["worst"])).fold(f64::INFINITY, f64::min);
        assert!(best < 5e-3, "{} {}: {best}", set["set"], set["elements"]);
    }
}

#[test]
fn what_a_scene_counts_adds_up() {
    let study = json(studied());
    for scene in list(&study["scenes"]) {
        let count = |name: &str| number(&scene[name]);
        let name = &scene["scene"];
        assert!(count("contacts") > 0.0, "{name}: nothing to see");
        assert!(count("contacts") + count("undecided") <= count("passed_cull"), "{name}");
        assert!(count("passed_cull") < count("elements"), "{name}: nothing is culled");
        for method in list(&scene["methods"]) {
            let (found, missed) = (number(&method["contacts"]), number(&method["missed"]));
            assert!(missed <= count("contacts"), "{name}: {method}");
            if method["method"] != "vertices alone" {
                assert!(found >= count("contacts") - missed, "{name}: {method}");
                assert!(found <= count("contacts") - missed + count("undecided"), "{name}: {method}");
                assert!(number(&method["evaluations"]) >= count("elements"), "{name}: {method}");
            }
        }
    }
}

#[test]
fn advice_is_what_misses_least_for_the_budget() {
    let study = json(studied());
    let sets = sets(&study);
    for advice in list(&study["advice"]) {
        let set = sets.iter().find(|set| set["set"] == advice["set"] && set["elements"] == advice["elements"]).unwrap();
        let cost = advice["cost"].as_str().unwrap();
        let mut seen = false;
        for curve in list(&set["curves"]) {
            for point in list(&curve["points"]).iter().filter(|point| number(&point[cost]) <= number(&advice["limit"]))
            {
                let better = |name: &str| number(&point[name]) < number(&advice[name]);
                let p95 = number(&point["errors"]["p95"]);
                assert!(!better("missed"), "{advice}: {point}");
                assert!(point["missed"] != advice["missed"] || p95 >= number(&advice["p95"]), "{advice}: {point}");
                seen |= curve["method"] == advice["method"] && point["budget"] == advice["budget"];
            }
        }
        assert!(seen, "{advice}: dearer than the limit");
    }
}

#[test]
fn scenes_of_ones_own_are_measured_too() {
    let folder = Folder::new();
    folder.write("body.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    folder.write("within.obj", Model::ball([0.0; 3], 0.5, 2).obj());
    folder.write("ball.sdf.toml", "[field]\nshape = \"sphere\"\nradius = 1.0\n");
    let scene = |name: &str, body: &str| {
        format!(
            "name = \"{name}\"\nabout = \"a ball in a ball\"\nelements = \"faces\"\nmargin = 0.0\n{body}\
             [mesh]\nfile = \"within.obj\"\n"
        )
    };
    let grid = "[body]\nfile = \"body.obj\"\n[grid]\nresolution = 16\nlayout = \"dense\"\n";
    folder.write("baked.toml", scene("Baked", grid));
    folder.write("closed.toml", scene("Closed", "[body]\nfile = \"ball.sdf.toml\"\n"));
    folder.done("study --short -o report --scene baked.toml --scene closed.toml");
    let study = json(&folder);
    let [.., baked, closed] = list(&study["scenes"]) else { panic!("no scenes") };
    assert_eq!((&baked["scene"], &closed["scene"]), (&Value::from("Baked"), &Value::from("Closed")));
    for scene in [baked, closed] {
        assert_eq!(scene["elements"], 128);
        assert_eq!(scene["contacts"], 128, "all of it is inside");
        assert!(list(&scene["methods"]).iter().all(|method| method["missed"] == 0));
    }
    assert_eq!((&baked["resolution"], &closed["resolution"]), (&Value::from(16), &Value::Null));
}

#[test]
fn what_cannot_be_written_or_read_is_refused_in_one_line() {
    let folder = Folder::new();
    folder.write("file", "no folder");
    says(&folder.refused("study --short -o file/below"), &["file/below"]);
    says(&folder.refused("study --short -o file"), &["file"]);
    says(&folder.refused("study --short --scene none.toml"), &["none.toml"]);
    folder.write("bad.toml", "name = \"Bad\"\nelements = \"corners\"\n");
    says(&folder.refused("study --short --scene bad.toml"), &["bad.toml", "line 2"]);
}
