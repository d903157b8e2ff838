//! Stiff and extreme cases: a table of queries, what is promised of the answers, and the report on them.
//!
//! The tests assert the promises, and docs/stability.md shows the measurements, by the same code.
//!
//! | step | file |
//! |---|---|
//! | 1. fields with elements around them | `bodies`, grouped into `cases` |
//! | 2. one element against one field: its true minimum, and the errors that are allowed | `problem` |
//! | 3. one query in f32 or f64 | `answer` |
//! | 4. every promise checked, every outcome counted | `tally` |
//! | 5. how far contacts move when a body hardly does | `jitter` |
//! | 6. docs/stability.md and docs/stability.csv | `report` |

pub mod answer;
pub mod bodies;
pub mod cases;
pub mod jitter;
pub mod normals;
pub mod problem;
pub mod report;
pub mod tally;
