use serde::Serialize;

/// One line of the table: a work and its time.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    pub group: &'static str,
    pub work: String,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Cells along the longest side of the grid; 0 without a grid.
    pub resolution: u32,
    pub threads: usize,
    /// Amount of work, in `unit`: nodes, faces, bytes.
    pub units: f64,
    pub unit: &'static str,
    /// Median time.
    pub seconds: f64,
    #[serde(rename = "least")]
    pub min_seconds: f64,
    pub rounds: usize,
    /// Time over that of the first row of the series.
    pub ratio: f64,
    #[serde(rename = "found")]
    pub contacts: Option<usize>,
    /// Time at the machine's limit, from limits measured in the same run. For a whole command, the time of the work itself.
    #[serde(rename = "floor")]
    pub floor_seconds: Option<f64>,
    /// Time of writing the grid, of a whole command.
    #[serde(rename = "write")]
    pub write_seconds: Option<f64>,
    /// Peak memory of the process.
    pub peak_mib: Option<f64>,
    /// Memory of the input and the result.
    pub result_mib: Option<f64>,
}

impl Row {
    pub fn fraction_of_limit(&self) -> Option<f64> {
        self.floor_seconds.map(|floor| floor / self.seconds)
    }

    pub fn nanoseconds_per_unit(&self) -> f64 {
        1e9 * self.seconds / self.units
    }
}
