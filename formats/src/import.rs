//! Volumes of other programs: NanoVDB level sets and NumPy arrays, read as samples on a lattice.
//!
//! Nothing is known of how they were made: no error is certified, and signs are taken as they are.

mod npy;
mod nvdb;

use sdf_core::Aabb;
use sdf_core::grid::Lattice;
use thiserror::Error;

pub use npy::{is_npy, npy};
pub use nvdb::nvdb;

/// As of meshes that are baked: distances in f32 end at 3e38.
const MAX_COORDINATE: f64 = 1e30;

/// Samples on a lattice, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    /// Positions of the nodes.
    pub lattice: Lattice,
    /// A sample for every node, finite.
    pub samples: Vec<f32>,
    /// Value that stands for all greater distances, such as a level set's background.
    pub background: Option<f32>,
}

/// Why bytes are not a volume, in words: what is wrong, and what to do.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{0}")]
pub struct ImportError(pub(crate) String);

impl ImportError {
    /// An error of these words.
    pub fn new(what: impl Into<String>) -> Self {
        Self(what.into())
    }
}

/// A refusal.
fn refused<T>(what: impl Into<String>) -> Result<T, ImportError> {
    Err(ImportError(what.into()))
}

/// The lattice, and memory for its samples, if so many bytes are allowed.
fn room(origin: [f64; 3], spacing: f64, counts: [u64; 3], max_bytes: f64) -> Result<Lattice, ImportError> {
    let nodes = counts.map(|count| u32::try_from(count).unwrap_or(u32::MAX));
    let bytes = counts.iter().map(|count| *count as f64).product::<f64>() * size_of::<f32>() as f64;
    let [x, y, z] = counts;
    if counts.iter().any(|count| *count < 2) {
        return refused(format!("{x} × {y} × {z} nodes: two nodes along each axis are needed"));
    }
    if bytes > max_bytes {
        return refused(format!("{x} × {y} × {z} nodes need {bytes:.0} bytes, and {max_bytes:.0} are free"));
    }
    let lattice = Lattice::new(origin, spacing, nodes).filter(|lattice| {
        let Aabb { min, max } = lattice.bounds();
        let farthest = min.iter().chain(&max).fold(0.0, |farthest: f64, x| farthest.max(x.abs()));
        // Rounding would put neighbouring nodes into one place.
        farthest <= MAX_COORDINATE && spacing > 4.0 * f64::EPSILON * farthest
    });
    match lattice {
        Some(lattice) => Ok(lattice),
        None => refused(format!(
            "{x} × {y} × {z} nodes {spacing:?} apart from {origin:?} on are not a grid: f64 must tell \
             neighbours apart, and no coordinate may be beyond ±1e30"
        )),
    }
}

/// Refuses NaN and infinities.
fn require_finite(samples: &[f32]) -> Result<(), ImportError> {
    match samples.iter().position(|sample| !sample.is_finite()) {
        Some(index) => refused(format!("sample {index} is {}: only finite distances make a field", samples[index])),
        None => Ok(()),
    }
}
