//! Fields of other programs: NanoVDB level sets and NumPy arrays, as grids whose slope is measured and whose error nobody certifies.

use std::fmt;
use std::path::Path;

use sdf_bake::DenseGrid;
pub use sdf_formats::import::ImportError;
use sdf_formats::import::{self, Volume};

use crate::info::{GridInfo, SignMethod, Source};
use crate::{Field, memory};

/// A file format that can be imported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImportFormat {
    /// A NanoVDB level set of f32, which knows its own place.
    Nvdb,
    /// A NumPy array of shape (z, y, x).
    Npy {
        /// Position of node (0, 0, 0).
        origin: [f64; 3],
        /// Distance between neighbouring nodes.
        spacing: f64,
    },
}

impl fmt::Display for ImportFormat {
    /// The options of the command line that say the same.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nvdb => f.write_str("import"),
            Self::Npy { origin: [x, y, z], spacing } => {
                write!(f, "import --spacing {spacing:?} --origin {x:?},{y:?},{z:?}")
            }
        }
    }
}

impl ImportFormat {
    /// `true` of a file whose name ends in npy, or whose bytes begin as those of NumPy do.
    pub fn is_npy(path: &Path, bytes: &[u8]) -> bool {
        import::is_npy(bytes) || path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("npy"))
    }
}

impl Field {
    /// A dense grid of the samples in the bytes of a file, negative inside. Its slope bound is measured. Nothing is known of its error:
    /// [`GridInfo::error_bound`] is infinite, and the sign method [`SignMethod::Given`].
    ///
    /// Beyond the band of a level set values are its background, in its leaves a cell's diagonal more at most.
    /// [`GridInfo::padding`] is such that all margins up to it see distances:
    /// the lowest sample on the faces of the box, and no more than the background.
    pub fn import(bytes: &[u8], format: ImportFormat, source: Source) -> Result<Self, ImportError> {
        let free = memory::free_bytes().unwrap_or(memory::ASSUMED_BYTES);
        let Volume { lattice, samples, background } = match format {
            ImportFormat::Nvdb => import::nvdb(bytes, free)?,
            ImportFormat::Npy { origin, spacing } => import::npy(bytes, origin, spacing, free)?,
        };
        let steep = "its values change too fast from node to node for a slope to be told".to_owned();
        let dense = DenseGrid::from_samples(&lattice, samples).ok_or_else(|| ImportError::new(steep))?;
        let grid = dense.into_grid(&lattice).grid;
        let padding = grid.lowest_boundary_sample().min(background.map_or(f64::INFINITY, f64::from)).max(0.0);
        let info = GridInfo {
            sign_method: SignMethod::Given,
            sign_reason: "given: samples of another program, with their signs; no error is certified".to_owned(),
            error_bound: f64::INFINITY,
            error_regions: None,
            padding,
            band: None,
            source,
            tool: concat!("sdftool ", env!("CARGO_PKG_VERSION")).to_owned(),
            options: format.to_string(),
        };
        Ok(Self::from_grid(grid, info))
    }
}
