//! Output of `speed`. No test depends on a time.

use serde_json::Value;

use crate::program::{Folder, SPEED};

#[test]
fn every_row_has_its_time_and_the_first_of_a_series_is_what_ratios_refer_to() {
    let folder = Folder::new(SPEED);
    let printed: Value =
        serde_json::from_str(&folder.done("--quick --only reading,threads --rounds 1 --json")).unwrap();
    let rows = printed["rows"].as_array().unwrap();
    assert!(rows.iter().any(|row| row["group"] == "reading") && rows.iter().any(|row| row["group"] == "threads"));
    let mut first = 0.0;
    let mut work = String::new();
    for row in rows {
        let [seconds, least, ratio] = ["seconds", "least", "ratio"].map(|name| row[name].as_f64().unwrap());
        assert!(0.0 < least && least <= seconds, "{row}");
        if row["work"] != work {
            (first, work) = (seconds, row["work"].as_str().unwrap().to_owned());
        }
        assert!((ratio - seconds / first).abs() < 1e-9 * ratio, "{row}");
    }
}

#[test]
fn every_number_type_finds_as_many_contacts_in_lanes_as_the_field_does() {
    let printed = Folder::new(SPEED).done("--quick --only lanes,contacts --method fw --rounds 1 --json");
    let printed: Value = serde_json::from_str(&printed).unwrap();
    let found = |group: &str| -> Vec<u64> {
        let rows = printed["rows"].as_array().unwrap().iter().filter(|row| row["group"] == group);
        rows.map(|row| row["found"].as_u64().unwrap()).collect()
    };
    let ([expected], [in_f64, in_f32 @ ..]) = (&found("contacts")[..], &found("lanes")[..]) else {
        panic!("{printed}");
    };
    assert!(*expected > 100 && in_f64 == expected, "{printed}");
    assert!(in_f32.len() == 2 && in_f32.iter().all(|count| count.abs_diff(*expected) <= expected / 100), "{printed}");
}

#[test]
fn the_set_up_of_a_mesh_is_measured_for_either_method_of_signs() {
    let printed = Folder::new(SPEED).done("--quick --only set-up --rounds 1 --json");
    let printed: Value = serde_json::from_str(&printed).unwrap();
    let rows = printed["rows"].as_array().unwrap();
    let works: Vec<_> = rows.iter().map(|row| row["work"].as_str().unwrap()).collect();
    assert_eq!(works, ["set up pot", "set up pot", "set up bowl", "set up bowl"]);
    let is_timed =
        |row: &Value| row["units"].as_f64() == row["triangles"].as_f64() && row["seconds"].as_f64() > Some(0.0);
    assert!(rows.iter().all(is_timed), "{printed}");
}

#[test]
fn the_page_written_anew_from_its_numbers_is_the_same_page() {
    let folder = Folder::new(SPEED);
    folder.done("--quick --only reading,contacts --rounds 1 --docs docs");
    let page = folder.read("docs/performance.md");
    let numbers = folder.read("docs/performance/bench.csv");
    folder.done("--docs docs --rewrite");
    assert_eq!(folder.read("docs/performance.md"), page);
    assert_eq!(folder.read("docs/performance/bench.csv"), numbers);
}

#[test]
fn numbers_of_other_groups_stay_and_those_of_the_same_are_replaced() {
    let folder = Folder::new(SPEED);
    folder.done("--quick --only reading --rounds 1 --docs docs");
    let lines = |word: &str| {
        let numbers = folder.read("docs/performance/bench.csv");
        numbers.lines().filter(|line| line.contains(word)).map(str::to_owned).collect::<Vec<_>>()
    };
    let reading = lines(",reading,");
    folder.done("--quick --only contacts --method fw --rounds 1 --docs docs");
    folder.done("--quick --only contacts --method fw --rounds 2 --docs docs");
    assert_eq!(lines(",reading,"), reading);
    assert_eq!(lines(",contacts,contacts of ").len(), 1);
}

#[test]
fn works_beyond_the_limit_are_left_out_and_said_to_be() {
    let folder = Folder::new(SPEED);
    let printed = folder.done("--quick --only triangles --rounds 1 --limit 1e-9 --json");
    let printed: Value = serde_json::from_str(&printed).unwrap();
    // The first work of each series has no prediction.
    assert_eq!((printed["rows"].as_array().unwrap().len(), printed["left_out"].as_array().unwrap().len()), (2, 2));
}

#[test]
fn every_kernel_of_the_instruction_counts_is_there() {
    let counts = concat!(env!("CARGO_MANIFEST_DIR"), "/../.ci/instructions.txt");
    let counts = std::fs::read_to_string(counts).unwrap();
    let kernels = counts.lines().filter(|line| !line.starts_with('#')).filter_map(|line| line.split_once(' '));
    let mut found = 0;
    for (kernel, count) in kernels {
        Folder::new(SPEED).done(&format!("--kernel {kernel} --times 0"));
        assert!(count.parse::<u64>().unwrap() > 1);
        found += 1;
    }
    assert!(found >= 6);
}
