//! docs/performance/peers.csv as tables: other programs beside ours, by tests/peers.

use super::csv::Kept;
use crate::study::table::Table;

const HEAD: [&str; 8] =
    ["", "program", "seconds", "times ours", "error of the distance", "wrong signs", "peak MiB", "what it gives"];

/// One table for each work.
pub fn tables(peers: &Kept) -> String {
    peers
        .words("work")
        .iter()
        .map(|work| format!("\n### {}\n\n{}", heading(work), of_work(&peers.with(&[("work", work)]))))
        .collect()
}

fn heading(work: &str) -> &str {
    match work {
        "dense" => "Dense grids",
        "sparse ±3" => "Sparse grids, three voxels to either side",
        "contacts" => "Contacts",
        other => other,
    }
}

fn of_work(peers: &Kept) -> String {
    let mut rows = vec![];
    let mut last = String::new();
    for row in &peers.rows {
        let resolution = peers.cell(row, "resolution");
        let size = if resolution.is_empty() { String::new() } else { format!(", {resolution}") };
        let what = format!("{}{size}", peers.cell(row, "mesh"));
        let shown = if what == last { String::new() } else { what.clone() };
        last = what;
        let wrong = match (peers.number(row, "wrong_signs"), peers.number(row, "nodes")) {
            (Some(wrong), Some(nodes)) => format!("{wrong:.0} of {nodes:.0}"),
            _ => String::new(),
        };
        rows.push(vec![
            shown,
            peers.cell(row, "program").to_owned(),
            peers.number(row, "seconds").map_or("not measured".to_owned(), |seconds| in_seconds(Some(seconds))),
            peers.cell(row, "ratio").to_owned(),
            peers.cell(row, "error").to_owned(),
            wrong,
            peers.number(row, "peak_mib").map_or(String::new(), |peak| format!("{peak:.0}")),
            peers.cell(row, "facts").to_owned(),
        ]);
    }
    // Columns in which nothing stands are left out.
    let kept: Vec<usize> = (0..HEAD.len()).filter(|column| rows.iter().any(|row| !row[*column].is_empty())).collect();
    let head = kept.iter().map(|column| HEAD[*column]).collect();
    let rows = rows.iter().map(|row| kept.iter().map(|column| row[*column].clone()).collect()).collect();
    Table { head, rows }.markdown()
}

pub fn in_seconds(seconds: Option<f64>) -> String {
    seconds.map_or(String::new(), |seconds| {
        if seconds < 0.1 { format!("{:.1} ms", 1e3 * seconds) } else { format!("{seconds:.2} s") }
    })
}
