//! Baked grids on disk: HDF5 that ParaView, VTK, h5py and h5dump open as it is. docs/format.md describes the file.
//!
//! ```no_run
//! let grid = sdf_formats::grid_file::read("dragon.sdf.h5".as_ref())?;
//! println!("{:?} nodes, within {} of the mesh", grid.lattice.nodes(), grid.about.error_bound);
//! # Ok::<(), sdf_formats::grid_file::GridFileError>(())
//! ```

mod atomic_write;
mod classic;
mod error;
mod hdf5_writer;
mod layout;
mod reader;

use std::path::Path;

use sdf_core::grid::Lattice;

pub use atomic_write::{Removed, atomic_write, remove_temporaries};
pub use error::{Fault, GridFileError};
pub use reader::{read, read_summary};

/// A baked dense grid and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct GridFile {
    pub lattice: Lattice,
    /// One for every node, x fastest: negative inside, in the unit of the mesh, all finite.
    pub distances: Vec<f32>,
    pub about: About,
}

/// What the file says without its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    pub lattice: Lattice,
    pub about: About,
    /// The size of the file. Its samples alone, not packed, are `4 · lattice.node_count()`.
    pub file_bytes: u64,
}

/// All that the file says beside the samples.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// `pseudo-normal` or `winding`.
    pub sign_method: String,
    /// In words: what the mesh looked like, and why this method.
    pub sign_verdict: String,
    /// The most that the interpolated value changes over a unit of distance.
    pub slope_bound: f64,
    /// Certified: the interpolated value is nowhere in the box further from the true distance. In the unit of the mesh.
    pub error_bound: f64,
    pub source: Source,
    /// The program and its version, `sdftool 0.1.0`.
    pub tool: String,
    /// The options that shaped the result, `--res 256 --padding 2 --sign auto`.
    pub options: String,
}

/// The mesh that was baked.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    pub name: String,
    /// Of the mesh file's bytes.
    pub sha256: [u8; 32],
    pub triangles: u64,
}

/// Writes a grid whole or not at all, see [`atomic_write`]. The same input gives the same bytes.
///
/// What [`read`] would refuse is refused here: a number of distances that is not the number of nodes, a value that is
/// not finite, a bound below zero, an unknown sign method, a text with a NUL or of more than 64 KiB.
pub fn write(path: &Path, lattice: &Lattice, distances: &[f32], about: &About) -> Result<(), GridFileError> {
    check(lattice, distances, about).map_err(|fault| fault.at(path))?;
    atomic_write(path, |temporary| hdf5_writer::write(temporary, lattice, distances, about))
        .map_err(|fault| fault.at(path))
}

fn check(lattice: &Lattice, distances: &[f32], about: &About) -> Result<(), Fault> {
    let refuse = |what: String| Err(Fault::Refused(what));
    if distances.len() != lattice.node_count() {
        return refuse(format!("{} distances for {} nodes", distances.len(), lattice.node_count()));
    }
    if let Some(at) = distances.iter().position(|distance| !distance.is_finite()) {
        return refuse(format!("sample {at} is {}", distances[at]));
    }
    if let Some(what) = about.flaw() {
        return refuse(what);
    }
    let texts = [&about.sign_verdict, &about.source.name, &about.tool, &about.options];
    if let Some(text) = texts.iter().find(|text| text.len() > layout::MOST_TEXT || text.contains('\0')) {
        return refuse(format!("a text of {} bytes is longer than 65536 or holds a NUL", text.len()));
    }
    Ok(())
}

impl About {
    /// What no file may say.
    fn flaw(&self) -> Option<String> {
        if !layout::SIGN_METHODS.contains(&self.sign_method.as_str()) {
            return Some(format!("sign_method is none of {:?}", layout::SIGN_METHODS));
        }
        let bounds = [("slope_bound", self.slope_bound), ("error_bound", self.error_bound)];
        let bad = bounds.into_iter().find(|(_, bound)| !(bound.is_finite() && *bound >= 0.0));
        bad.map(|(name, bound)| format!("{name} is {bound}"))
    }
}
