//! Pictures of the results, each an SVG that stands alone.

mod scenes;
mod sets;

pub use scenes::{culls, misses};
pub use sets::{against_cost, convergence, found};
