use serde::Serialize;

/// One line of the table: a work and what it took.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    pub group: &'static str,
    pub work: String,
    /// Of the mesh.
    pub triangles: usize,
    /// Cells along the longest side of the grid; 0 where there is none.
    pub resolution: u32,
    pub threads: usize,
    /// How many units of work: nodes, faces, bytes.
    pub units: f64,
    pub unit: &'static str,
    /// Median.
    pub seconds: f64,
    pub least: f64,
    pub rounds: usize,
    /// Times the seconds of the first row of its series.
    pub ratio: f64,
    /// Contacts.
    pub found: Option<usize>,
    /// What the machine needs at least, by the limits measured in the same run; of a whole command what the work itself took.
    pub floor: Option<f64>,
    /// The most that the process held, in MiB.
    pub peak_mib: Option<f64>,
    /// What its input and its result take in memory, in MiB.
    pub result_mib: Option<f64>,
}

impl Row {
    /// Of the machine's limit, what is reached.
    pub fn share(&self) -> Option<f64> {
        self.floor.map(|floor| floor / self.seconds)
    }

    pub fn nanoseconds_a_unit(&self) -> f64 {
        1e9 * self.seconds / self.units
    }
}
