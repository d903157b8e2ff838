//! How a mesh is baked: [`BakeOptions`], and the words that stand for them in a file.

use sdf_bake::Repairs;
use sdf_bake::sparse::Certify;
use sdf_core::Aabb;
use sdf_core::grid::owned::{Layout, Precision};

use super::BakeError;
use crate::Threads;
use crate::info::{SignMethod, Source};

/// How fine a grid is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GridSize {
    /// So many cells along the longest side of the mesh's box, padding not counted.
    Cells(u32),
    /// The side of a cell, in the unit of the mesh.
    VoxelSize(f64),
    /// The largest voxels and the coarsest precision with which a sparse grid certifies at most this error in its band.
    MaxError(MaxError),
}

impl GridSize {
    /// The side of a cell for a mesh with these bounds, or the error that chooses it.
    pub(super) fn spacing(self, bounds: &Aabb) -> Result<f64, MaxError> {
        match self {
            Self::Cells(cells) => Ok(bounds.longest_side() / f64::from(cells)),
            Self::VoxelSize(spacing) => Ok(spacing),
            Self::MaxError(max_error) => Err(max_error),
        }
    }
}

/// A length, or a fraction of the mesh's size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MaxError {
    /// In the unit of the mesh.
    Length(f64),
    /// Fraction of the diagonal of the mesh's box.
    Fraction(f64),
}

impl MaxError {
    /// The shortest number of percent that is this fraction: 0.0001 of what was read from 0.0001 %.
    pub fn percent(fraction: f64) -> f64 {
        let product = fraction * 100.0;
        let rounded = |digits: usize| format!("{product:.digits$e}").parse().ok();
        (0..17).filter_map(rounded).find(|percent: &f64| percent / 100.0 == fraction).unwrap_or(product)
    }
}

/// Treatment of faces that lie inside of the solid, such as those of a cube in a cube that is wound alike.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum InnerFaces {
    /// Faces, and parts of faces, with the solid at both sides are dropped where winding numbers are whole, as in closed meshes:
    /// distances are those to the surface of the solid. See `TriangleMesh::without_inner_faces` of `sdf-bake`. With
    /// [`SignMethod::PseudoNormal`] only whole shells that meet no other.
    #[default]
    Drop,
    /// Distances are those to the nearest of all faces.
    Keep,
}

/// How a mesh is baked.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// How fine the grid is.
    pub size: GridSize,
    /// Dense or sparse; [`GridSize::MaxError`] makes a sparse grid in any case.
    pub layout: Layout,
    /// The type of a sample; `None` stands for u16 of a sparse grid, and for f32 of a dense one. [`GridSize::MaxError`] picks its own.
    pub precision: Option<Precision>,
    /// Half width of a sparse grid's band, in cells, 1 to 1000: within it values are distances, beyond it coarse ones inside and lower
    /// bounds outside.
    pub band: u32,
    /// Cells around the mesh's box on each side.
    pub padding: u32,
    /// How the error of a sparse grid's bricks is bounded; [`GridSize::MaxError`] takes the tight bound in any case.
    pub certify: Certify,
    /// How inside and outside are told apart; `None` lets the mesh decide, and so does [`SignMethod::Given`].
    pub sign: Option<SignMethod>,
    /// Treatment of faces inside of the solid.
    pub inner_faces: InnerFaces,
    /// Keep the mesh beside the grid, for [`ContactOptions::exact`](crate::ContactOptions::exact).
    pub keep_mesh: bool,
    /// Vertices at most this far from each other become one: closes cracks. `None` leaves all as they are. See [`Repairs`].
    pub weld: Option<f64>,
    /// Boundary loops are capped whose bounding box has a diagonal of at most this: closes holes. `None` caps none.
    pub close: Option<f64>,
    /// How many threads work.
    pub threads: Threads,
    /// Where the mesh comes from, for the record; its count of triangles is filled in.
    pub source: Source,
}

impl Default for BakeOptions {
    /// A dense grid of 64 cells, padding of 4.
    fn default() -> Self {
        Self {
            size: GridSize::Cells(64),
            layout: Layout::Dense,
            precision: None,
            band: 3,
            padding: 4,
            certify: Certify::Fast,
            sign: None,
            inner_faces: InnerFaces::Drop,
            keep_mesh: false,
            weld: None,
            close: None,
            threads: Threads::ALL,
            source: Source::default(),
        }
    }
}

impl BakeOptions {
    /// Refuses a size or a band that no grid has.
    pub(super) fn check(&self) -> Result<(), BakeError> {
        match self.size {
            GridSize::Cells(0) => return Err(BakeError::NoCells),
            GridSize::VoxelSize(size) if !(size > 0.0 && size.is_finite()) => {
                return Err(BakeError::InvalidVoxel { size });
            }
            _ => {}
        }
        if (1..=1000).contains(&self.band) { Ok(()) } else { Err(BakeError::BandOutOfRange { band: self.band }) }
    }

    pub(super) fn repairs(&self) -> Result<Repairs, BakeError> {
        let is_valid = |length: &f64| *length > 0.0 && length.is_finite();
        match self.weld.iter().chain(&self.close).find(|length| !is_valid(length)) {
            Some(length) => Err(BakeError::InvalidRepair { length: *length }),
            None => Ok(Repairs { weld: self.weld, close: self.close }),
        }
    }

    /// The options that shape the result, as the command line has them: [`GridInfo::options`](crate::GridInfo::options).
    pub fn words(&self) -> String {
        let size = match self.size {
            GridSize::Cells(cells) => format!("--res {cells}"),
            GridSize::VoxelSize(size) => format!("--voxel-size {size}"),
            GridSize::MaxError(MaxError::Fraction(fraction)) => format!("--max-error {}%", MaxError::percent(fraction)),
            GridSize::MaxError(MaxError::Length(length)) => format!("--max-error {length}"),
        };
        let sign = match self.sign {
            None | Some(SignMethod::Given) => "auto",
            Some(SignMethod::PseudoNormal) => "pseudo-normal",
            Some(SignMethod::Winding) => "winding",
        };
        let sparse = match (self.size, self.layout, self.precision) {
            (GridSize::Cells(_) | GridSize::VoxelSize(_), Layout::Dense, None | Some(Precision::F32)) => String::new(),
            (GridSize::Cells(_) | GridSize::VoxelSize(_), Layout::Dense, Some(precision)) => {
                format!(" --precision {}", precision.name())
            }
            (GridSize::MaxError(_), ..) | (.., None) => format!(" --layout sparse --band {}", self.band),
            (.., Some(precision)) => format!(" --layout sparse --band {} --precision {}", self.band, precision.name()),
        };
        let is_tight = self.layout == Layout::Sparse && self.certify == Certify::Tight;
        let certify = if is_tight && !matches!(self.size, GridSize::MaxError(_)) { " --certify tight" } else { "" };
        let inner = if self.inner_faces == InnerFaces::Keep { " --inner-faces keep" } else { "" };
        let keep = if self.keep_mesh { " --keep-mesh" } else { "" };
        let repairs = Repairs { weld: self.weld, close: self.close }.words();
        format!("{size} --padding {} --sign {sign}{inner}{repairs}{keep}{sparse}{certify}", self.padding)
    }
}
