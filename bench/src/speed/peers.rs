//! docs/performance/peers.csv, which tests/peers writes, as tables: other programs beside sdftool.

use super::csv::CsvTable;
use crate::duration_text;
use crate::table::Table;

const HEAD: [&str; 8] =
    ["", "program", "seconds", "relative to sdftool", "error of the distance", "wrong signs", "peak MiB", "details"];

/// One table for each work.
pub fn tables(peers: &CsvTable) -> String {
    peers
        .distinct("work")
        .iter()
        .map(|work| format!("\n### {}\n\n{}", heading(work), work_table(&peers.filtered(&[("work", work)]))))
        .collect()
}

fn heading(work: &str) -> &str {
    match work {
        "dense" => "Dense grids",
        "sparse ±3" => "Sparse grids, three voxels on either side",
        "sparse ±3 fine" => "Sparse grids of meshes with sixteen times the triangles",
        "contacts" => "Contacts",
        other => other,
    }
}

fn work_table(peers: &CsvTable) -> String {
    let mut rows = vec![];
    let mut previous = String::new();
    for row in &peers.rows {
        let resolution = peers.cell(row, "resolution");
        let size = if resolution.is_empty() { String::new() } else { format!(", {resolution}") };
        let name = format!("{}{size}", peers.cell(row, "mesh"));
        let shown = if name == previous { String::new() } else { name.clone() };
        previous = name;
        let wrong = match (peers.number(row, "wrong_signs"), peers.number(row, "nodes")) {
            (Some(wrong), Some(nodes)) => format!("{wrong:.0} of {nodes:.0}"),
            _ => String::new(),
        };
        rows.push(vec![
            shown,
            peers.cell(row, "program").to_owned(),
            peers.number(row, "seconds").map_or("not measured".to_owned(), duration_text),
            peers.cell(row, "ratio").to_owned(),
            peers.cell(row, "error").to_owned(),
            wrong,
            peers.number(row, "peak_mib").map_or(String::new(), |peak| format!("{peak:.0}")),
            peers.cell(row, "facts").to_owned(),
        ]);
    }
    // Empty columns are left out.
    let kept: Vec<usize> = (0..HEAD.len()).filter(|column| rows.iter().any(|row| !row[*column].is_empty())).collect();
    let head = kept.iter().map(|column| HEAD[*column]).collect();
    let rows = rows.iter().map(|row| kept.iter().map(|column| row[*column].clone()).collect()).collect();
    Table { head, rows }.markdown()
}
