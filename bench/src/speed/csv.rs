//! The table as CSV, without commas in cells, and CSV files read back.

use super::SpeedReport;
use super::row::Row;
use crate::table::Table;

const HEAD: [&str; 19] = [
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
    "write_seconds",
    "peak_mib",
    "result_mib",
];

pub fn text(report: &SpeedReport) -> String {
    let machine = &report.machine;
    let origin = [machine.date.clone(), machine.description(), machine.version.to_owned()];
    let rows = report.rows.iter().map(|row| origin.iter().cloned().chain(cells(row)).collect());
    Table { head: HEAD.to_vec(), rows: rows.collect() }.csv()
}

fn cells(row: &Row) -> Vec<String> {
    let rounded = |number: f64| format!("{number:.6e}").parse::<f64>().unwrap_or(number).to_string();
    let optional = |number: Option<f64>| number.map_or(String::new(), rounded);
    vec![
        row.group.to_owned(),
        row.work.replace(',', ";"),
        row.triangles.to_string(),
        row.resolution.to_string(),
        row.threads.to_string(),
        row.units.to_string(),
        row.unit.to_owned(),
        rounded(row.seconds),
        rounded(row.min_seconds),
        row.rounds.to_string(),
        rounded(row.ratio),
        row.contacts.map_or(String::new(), |count| count.to_string()),
        optional(row.floor_seconds),
        optional(row.write_seconds),
        optional(row.peak_mib),
        optional(row.result_mib),
    ]
}

/// A CSV file: rows of cells, named by the first line.
#[derive(Clone, Debug, Default)]
pub struct CsvTable {
    head: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl CsvTable {
    pub fn parse(text: &str) -> Self {
        let split = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut lines = text.lines().filter(|line| !line.is_empty()).map(split);
        Self { head: lines.next().unwrap_or_default(), rows: lines.collect() }
    }

    /// The cell of a column, empty if there is no such column.
    pub fn cell<'a>(&self, row: &'a [String], name: &str) -> &'a str {
        let column = self.head.iter().position(|head| head == name);
        column.and_then(|column| row.get(column)).map_or("", String::as_str)
    }

    pub fn number(&self, row: &[String], name: &str) -> Option<f64> {
        self.cell(row, name).parse().ok()
    }

    /// The rows that have these values in these columns.
    pub fn filtered(&self, cells: &[(&str, &str)]) -> Self {
        let matches = |row: &&Vec<String>| cells.iter().all(|(name, wanted)| self.cell(row, name) == *wanted);
        Self { head: self.head.clone(), rows: self.rows.iter().filter(matches).cloned().collect() }
    }

    /// The distinct values of a column, in order of appearance.
    pub fn distinct(&self, name: &str) -> Vec<String> {
        let mut values: Vec<String> = vec![];
        for row in &self.rows {
            let value = self.cell(row, name);
            if !values.iter().any(|known| known == value) {
                values.push(value.to_owned());
            }
        }
        values
    }

    /// Replaces the rows of each group that `new` has; the rows of other groups stay, in the columns of `new`.
    pub fn with_groups_replaced(self, new: Self) -> Self {
        let groups = new.distinct("group");
        let stays = |row: &&Vec<String>| !groups.iter().any(|group| group == self.cell(row, "group"));
        let in_new_columns = |row: &Vec<String>| new.head.iter().map(|name| self.cell(row, name).to_owned()).collect();
        let former: Vec<Vec<String>> = self.rows.iter().filter(stays).map(in_new_columns).collect();
        Self { head: new.head, rows: former.into_iter().chain(new.rows).collect() }
    }

    pub fn text(&self) -> String {
        let lines = std::iter::once(&self.head).chain(&self.rows);
        lines.map(|cells| cells.join(",") + "\n").collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_other_groups_stay_where_there_is_a_new_column() {
        let stored = CsvTable::parse("group,work,seconds\nreading,read OBJ,1\ncommands,bake,2\n");
        let new = CsvTable::parse("group,work,seconds,write\ncommands,bake,3,4\n");
        let both = stored.with_groups_replaced(new);
        assert_eq!(both.text(), "group,work,seconds,write\nreading,read OBJ,1,\ncommands,bake,3,4\n");
    }
}
