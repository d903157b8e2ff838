/// Rows of text under a head, written as HTML, Markdown or CSV.
pub struct Table {
    pub head: Vec<&'static str>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub fn html(&self) -> String {
        let row = |cell: &str, cells: &mut dyn Iterator<Item = &str>| {
            let cells: String = cells.map(|text| format!("<{cell}>{}</{cell}>", escape_html(text))).collect();
            format!("<tr>{cells}</tr>\n")
        };
        let head = row("th", &mut self.head.iter().copied());
        let rows: String = self.rows.iter().map(|cells| row("td", &mut cells.iter().map(String::as_str))).collect();
        format!("<table>\n<thead>{head}</thead>\n<tbody>\n{rows}</tbody>\n</table>\n")
    }

    pub fn markdown(&self) -> String {
        let rows: String = self.rows.iter().map(|cells| format!("| {} |\n", cells.join(" | "))).collect();
        format!("| {} |\n|{}\n{rows}", self.head.join(" | "), "---|".repeat(self.head.len()))
    }

    /// No cell may hold a comma, a quote or an end of line.
    pub fn csv(&self) -> String {
        debug_assert!(self.rows.iter().flatten().all(|cell| !cell.contains([',', '"', '\n'])));
        let rows: String = self.rows.iter().map(|cells| cells.join(",") + "\n").collect();
        format!("{}\n{rows}", self.head.join(","))
    }
}

pub fn escape_html(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
