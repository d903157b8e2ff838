//! The table as CSV: no cell holds a comma.

use super::Bench;
use super::row::Row;
use crate::study::table::Table;

const HEAD: [&str; 18] = [
    "date",
    "machine",
    "version",
    "group",
    "work",
    "triangles",
    "resolution",
    "threads",
    "units",
    "unit",
    "seconds",
    "least",
    "rounds",
    "ratio",
    "contacts",
    "floor_seconds",
    "peak_mib",
    "result_mib",
];

pub fn text(bench: &Bench) -> String {
    table(bench).csv()
}

pub fn table(bench: &Bench) -> Table {
    let machine = &bench.machine;
    let about = [machine.date.clone(), machine.in_words(), machine.version.to_owned()];
    let rows = bench.rows.iter().map(|row| about.iter().cloned().chain(cells(row)).collect());
    Table { head: HEAD.to_vec(), rows: rows.collect() }
}

fn cells(row: &Row) -> Vec<String> {
    let rounded = |number: f64| format!("{number:.6e}").parse::<f64>().unwrap_or(number).to_string();
    let if_there = |number: Option<f64>| number.map_or(String::new(), rounded);
    vec![
        row.group.to_owned(),
        row.work.replace(',', ";"),
        row.triangles.to_string(),
        row.resolution.to_string(),
        row.threads.to_string(),
        row.units.to_string(),
        row.unit.to_owned(),
        rounded(row.seconds),
        rounded(row.least),
        row.rounds.to_string(),
        rounded(row.ratio),
        row.found.map_or(String::new(), |found| found.to_string()),
        if_there(row.floor),
        if_there(row.peak_mib),
        if_there(row.result_mib),
    ]
}

/// A CSV file as it was written: rows of cells by the names of the first line.
#[derive(Clone, Debug, Default)]
pub struct Kept {
    head: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Kept {
    pub fn parse(text: &str) -> Self {
        let split = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut lines = text.lines().filter(|line| !line.is_empty()).map(split);
        Self { head: lines.next().unwrap_or_default(), rows: lines.collect() }
    }

    /// An empty word where there is no such column.
    pub fn cell<'a>(&self, row: &'a [String], name: &str) -> &'a str {
        let column = self.head.iter().position(|head| head == name);
        column.and_then(|column| row.get(column)).map_or("", String::as_str)
    }

    pub fn number(&self, row: &[String], name: &str) -> Option<f64> {
        self.cell(row, name).parse().ok()
    }

    /// The rows with these cells.
    pub fn with(&self, cells: &[(&str, &str)]) -> Self {
        let fits = |row: &&Vec<String>| cells.iter().all(|(name, wanted)| self.cell(row, name) == *wanted);
        Self { head: self.head.clone(), rows: self.rows.iter().filter(fits).cloned().collect() }
    }

    /// Of a column, each word once, in order.
    pub fn words(&self, name: &str) -> Vec<String> {
        let mut words: Vec<String> = vec![];
        for row in &self.rows {
            let word = self.cell(row, name);
            if !words.iter().any(|there| there == word) {
                words.push(word.to_owned());
            }
        }
        words
    }

    /// Rows of these groups are replaced by the new ones, the others stay.
    pub fn replaced(mut self, new: Self) -> Self {
        let groups = new.words("group");
        if self.head != new.head {
            return new;
        }
        let column = self.head.iter().position(|head| head == "group").unwrap_or(0);
        self.rows.retain(|row| !groups.contains(&row[column]));
        self.rows.extend(new.rows);
        self
    }

    pub fn text(&self) -> String {
        let lines = std::iter::once(&self.head).chain(&self.rows);
        lines.map(|cells| cells.join(",") + "\n").collect()
    }
}
