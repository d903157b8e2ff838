//! Files that `accuracy --short` writes.

use std::sync::OnceLock;

use sdf_formats::mesh::{self, MeshFormat};
use sdf_procedural::SpikedBall;
use serde_json::Value;

use crate::program::{ACCURACY, Folder};

/// The run that all tests share.
fn measured() -> &'static Folder {
    static MEASURED: OnceLock<Folder> = OnceLock::new();
    MEASURED.get_or_init(|| {
        let folder = Folder::new(ACCURACY);
        folder.done("--short -o report --docs docs");
        folder
    })
}

fn text(name: &str) -> String {
    measured().read(name)
}

fn json(folder: &Folder) -> Value {
    serde_json::from_str(&folder.read("report/study.json")).unwrap()
}

/// All sets of problems, the apexes last.
fn sets(study: &Value) -> Vec<&Value> {
    study["sets"].as_array().unwrap().iter().chain([&study["apexes"]]).collect()
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("not a number: {value}"))
}

/// The names of all elements. Panics unless every tag is closed, in the right order.
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

fn assert_no_network(markup: &str) {
    let markup = markup.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for word in ["http:", "https:", "src=", "href", "url(", "@import", "<script", "<link", "<iframe", "<object"] {
        assert!(!markup.contains(word), "{word} in a page that must stand alone");
    }
}

#[test]
fn the_report_is_one_well_formed_page_that_needs_no_network() {
    let page = text("report/index.html");
    assert!(page.starts_with("<!DOCTYPE html>\n<html"));
    assert_no_network(&page);
    let names = elements(&page);
    let count = |wanted: &str| names.iter().filter(|name| *name == wanted).count();
    // Two pictures for each set, and three more.
    assert_eq!(count("svg"), 2 * 7 + 3);
    assert!(count("table") > 8);
    assert!(!page.contains("NaN") && !page.contains("inf"), "NaN or infinity in the report");
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
    let mut written: Vec<String> = std::fs::read_dir(measured().path("docs/pictures/study"))
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
        assert_no_network(&svg);
        assert!(
            elements(&svg).iter().any(|name| name == "polyline" || name == "circle" || name == "rect"),
            "{picture}"
        );
    }
}

/// The rows of a CSV file, keyed by column.
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

/// Asserts that a row and an object have the same values under each pair of names.
#[track_caller]
fn assert_same(row: &std::collections::HashMap<String, String>, object: &Value, names: &[(&str, &str)]) {
    for (column, key) in names {
        let (cell, value) = (&row[*column], &object[*key]);
        let is_same = match value.as_str() {
            Some(text) => cell == text,
            None => cell.parse::<f64>().is_ok_and(|cell| Some(cell) == value.as_f64()),
        };
        assert!(is_same, "{column}: {cell} in the table, {value} in the JSON");
    }
}

fn pairs<'a>(names: &[&'a str]) -> Vec<(&'a str, &'a str)> {
    names.iter().map(|name| (*name, *name)).collect()
}

#[test]
fn the_tables_hold_the_numbers_of_the_json() {
    let study = json(measured());
    let mut table = rows("report/curves.csv").into_iter();
    for set in sets(&study) {
        for curve in list(&set["curves"]) {
            for point in list(&curve["points"]) {
                let row = table.next().expect("a row for each point");
                assert_same(&row, set, &pairs(&["set", "elements"]));
                assert_same(&row, curve, &pairs(&["method", "unit"]));
                assert_same(&row, point, &pairs(&["budget", "evaluations", "missed", "nanoseconds"]));
                assert_same(&row, &point["errors"], &pairs(&["q1", "median", "q3", "p95", "worst"]));
            }
        }
    }
    assert!(table.next().is_none());
    let mut table = rows("report/scenes.csv").into_iter();
    for scene in list(&study["scenes"]) {
        for method in list(&scene["methods"]) {
            let row = table.next().expect("a row for each method");
            assert_same(&row, scene, &pairs(&["scene", "points", "elements", "passed_cull", "contacts", "undecided"]));
            assert_same(&row, method, &pairs(&["method", "budget", "unit", "missed", "evaluations", "microseconds"]));
            assert_same(&row, method, &[("contacts_found", "contacts")]);
        }
    }
    assert!(table.next().is_none());
    let mut table = rows("report/advice.csv").into_iter();
    for advice in list(&study["advice"]) {
        let names = pairs(&["set", "elements", "cost", "limit", "method", "budget", "unit", "p95", "missed"]);
        assert_same(&table.next().expect("a row for each advice"), advice, &names);
    }
    assert!(table.next().is_none());
}

/// Removes everything that a clock measures.
fn remove_times(value: &mut Value) {
    match value {
        Value::Object(members) => {
            members.retain(|name, _| !["seconds", "microseconds", "nanoseconds"].contains(&name.as_str()));
            members.values_mut().for_each(remove_times);
        }
        Value::Array(values) => {
            values.retain(|value| value["cost"] != "nanoseconds");
            values.iter_mut().for_each(remove_times);
        }
        _ => {}
    }
}

#[test]
fn all_but_the_times_is_the_same_from_run_to_run_and_on_any_number_of_threads() {
    let mut first = json(measured());
    let again = Folder::new(ACCURACY);
    again.done("--short -o report --threads 1");
    let mut second = json(&again);
    remove_times(&mut first);
    remove_times(&mut second);
    assert_eq!(first, second);
    assert!(sets(&first).len() == 8 && list(&first["scenes"]).len() == 6);
}

#[test]
fn quartiles_are_in_order() {
    let study = json(measured());
    for set in sets(&study) {
        let points = list(&set["curves"]).iter().flat_map(|curve| list(&curve["points"]));
        for spread in points.map(|point| &point["errors"]).chain([&set["reference"]["gap"]]) {
            let rising = ["q1", "median", "q3", "p95", "worst"].map(|name| number(&spread[name]));
            assert!(rising.is_sorted(), "{}: {spread}", set["set"]);
        }
    }
}

/// Sampling of edges is exempt: more samples are at other points.
#[test]
fn a_larger_budget_never_makes_the_worst_error_or_the_misses_more() {
    let study = json(measured());
    for set in sets(&study) {
        for curve in list(&set["curves"]) {
            if set["elements"] == "edges" && curve["unit"] == "samples" {
                continue;
            }
            for two in list(&curve["points"]).windows(2) {
                let [before, after] = [&two[0], &two[1]];
                let what = format!("{} {} by {}", set["set"], set["elements"], curve["method"]);
                assert!(number(&before["budget"]) < number(&after["budget"]), "{what}");
                assert!(number(&before["evaluations"]) <= number(&after["evaluations"]), "{what}");
                for name in ["q1", "median", "q3", "p95", "worst"] {
                    assert!(
                        number(&before["errors"][name]) >= number(&after["errors"][name]),
                        "{what}: {before} {after}"
                    );
                }
                assert!(number(&before["missed"]) >= number(&after["missed"]), "{what}");
            }
        }
    }
}

#[test]
fn no_method_finds_less_than_the_reference_and_the_reference_is_near() {
    let study = json(measured());
    for set in sets(&study) {
        let reference = &set["reference"];
        assert!(number(&reference["least_error"]) >= -1e-12, "{}: {reference}", set["set"]);
        // Branch and bound does not converge if the field is flat over an element.
        assert!(number(&reference["not_converged"]) * 10.0 <= number(&set["problems"]), "{}", set["set"]);
        let max = if set["elements"] == "edges" { 2e-6 } else { 3e-4 };
        assert!((0.0..max).contains(&number(&reference["gap"]["worst"])), "{}: {reference}", set["set"]);
        // Some method comes near, so the reference is not far below the minimum.
        let best = list(&set["curves"]).iter().flat_map(|curve| list(&curve["points"]));
        let best = best.map(|point| number(&point["errors"]["worst"])).fold(f64::INFINITY, f64::min);
        assert!(best < 5e-3, "{} {}: {best}", set["set"], set["elements"]);
    }
}

#[test]
fn what_a_scene_counts_adds_up() {
    let study = json(measured());
    for scene in list(&study["scenes"]) {
        let count = |name: &str| number(&scene[name]);
        let name = &scene["scene"];
        assert!(count("contacts") > 0.0, "{name}: no contacts");
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
    let study = json(measured());
    let sets = sets(&study);
    for advice in list(&study["advice"]) {
        let set = sets.iter().find(|set| set["set"] == advice["set"] && set["elements"] == advice["elements"]).unwrap();
        let cost = advice["cost"].as_str().unwrap();
        let mut is_found = false;
        for curve in list(&set["curves"]) {
            for point in list(&curve["points"]).iter().filter(|point| number(&point[cost]) <= number(&advice["limit"]))
            {
                let is_better = |name: &str| number(&point[name]) < number(&advice[name]);
                let p95 = number(&point["errors"]["p95"]);
                assert!(!is_better("missed"), "{advice}: {point}");
                assert!(point["missed"] != advice["missed"] || p95 >= number(&advice["p95"]), "{advice}: {point}");
                is_found |= curve["method"] == advice["method"] && point["budget"] == advice["budget"];
            }
        }
        assert!(is_found, "{advice}: exceeds the limit");
    }
}

#[test]
fn scenes_of_ones_own_are_measured_too() {
    let folder = Folder::new(ACCURACY);
    let write_ball = |name: &str, scale: f64| {
        let ball = SpikedBall { levels: 1, radius: 0.9 }.mesh().transformed(|point| point.map(|x| scale * x));
        mesh::write(&folder.path(name), MeshFormat::Obj, &ball.points, &ball.triangles).unwrap();
    };
    write_ball("body.obj", 1.0);
    write_ball("within.obj", 0.5);
    folder.write("ball.sdf.toml", "[field]\nshape = \"sphere\"\nradius = 1.0\n");
    let scene = |name: &str, body: &str| {
        format!(
            "name = \"{name}\"\nabout = \"a ball in a ball\"\nelements = \"faces\"\nmargin = 0.0\n{body}\
             [mesh]\nfile = \"within.obj\"\n"
        )
    };
    let grid = "[body]\nfile = \"body.obj\"\n[grid]\nresolution = 16\nlayout = \"dense\"\n";
    folder.write("baked.toml", &scene("Baked", grid));
    folder.write("closed.toml", &scene("Closed", "[body]\nfile = \"ball.sdf.toml\"\n"));
    folder.done("--short -o report --scene baked.toml --scene closed.toml");
    let study = json(&folder);
    let [.., baked, closed] = list(&study["scenes"]) else { panic!("no scenes") };
    assert_eq!((&baked["scene"], &closed["scene"]), (&Value::from("Baked"), &Value::from("Closed")));
    for scene in [baked, closed] {
        assert_eq!(scene["elements"], 120);
        assert_eq!(scene["contacts"], 120, "the whole mesh is inside");
        assert!(list(&scene["methods"]).iter().all(|method| method["missed"] == 0));
    }
    assert_eq!((&baked["resolution"], &closed["resolution"]), (&Value::from(16), &Value::Null));
}

#[test]
fn what_cannot_be_written_or_read_is_refused_in_one_line() {
    let folder = Folder::new(ACCURACY);
    folder.write("file", "not a folder");
    folder.refuses("--short -o file/below", &["file/below"]);
    folder.refuses("--short -o file", &["file"]);
    folder.refuses("--short --scene none.toml", &["none.toml"]);
    folder.write("bad.toml", "name = \"Bad\"\nelements = \"corners\"\n");
    folder.refuses("--short --scene bad.toml", &["bad.toml", "line 2"]);
}
