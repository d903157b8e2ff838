//! Stiff and extreme cases: what is asked, what was promised of the answers, and how they come out. The tests assert it and
//! docs/stability.md shows it, from the same code.

pub mod answer;
pub mod bodies;
pub mod cases;
pub mod jitter;
pub mod problem;
pub mod report;
pub mod tally;
