//! Which Rust types are the structs of the header? Plain numbers, so that no pattern of bits that C hands over is invalid.

use std::fmt::Display;
use std::num::NonZeroUsize;

use sdf_field::core::grid::owned::{Layout, Precision};
use sdf_field::core::overlap::{OverlapPoint, Patch};
use sdf_field::core::placed::Rigid;
use sdf_field::{
    BakeOptions, ContactOptions, ContactRow, Elements, Field, GridSize, MeshClusters, Method, SignMethod, Threads,
    TimedContact,
};

/// A field behind the header's opaque handle.
pub struct SdfField(pub Field);

/// Clusters of a mesh behind the header's opaque handle.
pub struct SdfClusters(pub MeshClusters);

/// The header's `SdfResult`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum SdfResult {
    Ok,
    InvalidArgument,
    File,
    TooSmall,
    Stopped,
    Bug,
}

/// The header's `SdfError`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct SdfError {
    pub text: [u8; 512],
}

/// The header's `SdfBakeOptions`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct SdfBakeOptions {
    pub voxel_size: f64,
    pub resolution: u32,
    pub layout: u32,
    pub precision: u32,
    pub sign: u32,
    pub band: u32,
    pub padding: u32,
    pub threads: u32,
    pub keep_mesh: u32,
}

/// The header's `SdfQuery`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct SdfQuery {
    pub margin: f64,
    pub translation: [f64; 3],
    pub rotation: [f64; 4],
    pub elements: u32,
    pub method: u32,
    pub all_minima: u32,
    pub budget: u32,
    pub threads: u32,
    pub lean: u32,
    pub complete: u32,
    pub exact: u32,
    pub clusters: *const SdfClusters,
    pub mesh_pose: *const f64,
    pub margins: *const f64,
}

/// The header's `SdfInfo`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct SdfInfo {
    pub min: [f64; 3],
    pub max: [f64; 3],
    pub spacing: f64,
    pub error_bound: f64,
    pub max_margin: f64,
    pub slope_bound: f64,
    pub nodes: [u32; 3],
    pub layout: u32,
}

impl From<&Field> for SdfInfo {
    fn from(field: &Field) -> Self {
        let lattice = field.grid().map(|grid| grid.lattice());
        let bounds = field.domain();
        Self {
            min: bounds.min,
            max: bounds.max,
            spacing: lattice.map_or(0.0, |lattice| lattice.spacing()),
            error_bound: field.info().map_or(f64::INFINITY, |info| info.error_bound),
            max_margin: field.max_margin().unwrap_or(f64::INFINITY),
            slope_bound: field.slope_bound(),
            nodes: lattice.map_or([0; 3], |lattice| lattice.nodes()),
            layout: match field.grid().map(|grid| grid.storage().layout()) {
                Some(Layout::Dense) => 0,
                Some(Layout::Sparse) => 1,
                None => 2,
            },
        }
    }
}

/// The header's `SdfOverlapPoint`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct SdfOverlapPoint {
    pub point: [f64; 3],
    pub normal: [f64; 3],
    pub distances: [f64; 2],
}

impl From<&OverlapPoint<f64>> for SdfOverlapPoint {
    fn from(found: &OverlapPoint<f64>) -> Self {
        let distances = [found.a.value, found.b.value];
        Self { point: found.point.into(), normal: found.normal.into(), distances }
    }
}

/// The header's `SdfPatch`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct SdfPatch {
    pub area: f64,
    pub unknown: u32,
    pub complete: u32,
}

impl From<Option<Patch<f64>>> for SdfPatch {
    /// `None` of fields that are proven to be apart: there is no more.
    fn from(patch: Option<Patch<f64>>) -> Self {
        match patch {
            Some(Patch { area, undefined_count: unknown, is_complete, .. }) => {
                Self { area, unknown, complete: is_complete.into() }
            }
            None => Self { complete: 1, ..Self::default() },
        }
    }
}

/// The header's `SdfTouch`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct SdfTouch {
    pub time: f64,
    pub contact: ContactRow,
}

impl From<&TimedContact> for SdfTouch {
    fn from(touch: &TimedContact) -> Self {
        Self { time: touch.time, contact: ContactRow::from(&touch.contact) }
    }
}

/// A result other than `Ok`, and why.
#[derive(Debug)]
pub struct Failure {
    pub result: SdfResult,
    pub text: String,
}

impl Failure {
    pub fn new(result: SdfResult, text: impl Display) -> Self {
        Self { result, text: text.to_string() }
    }

    pub fn invalid(text: impl Display) -> Self {
        Self::new(SdfResult::InvalidArgument, text)
    }
}

impl Default for SdfBakeOptions {
    fn default() -> Self {
        let BakeOptions { band, padding, .. } = BakeOptions::default();
        Self {
            voxel_size: 0.0,
            resolution: 64,
            layout: 0,
            precision: 0,
            sign: 0,
            band,
            padding,
            threads: 1,
            keep_mesh: 0,
        }
    }
}

impl SdfBakeOptions {
    /// The options of the library. As many threads work as the caller installs.
    pub fn to_rust(self) -> Result<BakeOptions, Failure> {
        let size = match (self.voxel_size, self.resolution) {
            (size, _) if size > 0.0 && size.is_finite() => GridSize::VoxelSize(size),
            (0.0, 0) => {
                return Err(Failure::invalid("resolution is 0: give cells along the longest side, or voxel_size"));
            }
            (0.0, cells) => GridSize::Cells(cells),
            (size, _) => return Err(Failure::invalid(format!("voxel_size {size} is not a positive length"))),
        };
        let layout = choice("layout", self.layout, &[Layout::Dense, Layout::Sparse])?;
        let precisions = [None, Some(Precision::F32), Some(Precision::U8), Some(Precision::U16)];
        let precision = choice("precision", self.precision, &precisions)?;
        Ok(BakeOptions {
            size,
            layout,
            precision,
            band: self.band,
            padding: self.padding,
            sign: sign_method(self.sign)?,
            keep_mesh: self.keep_mesh != 0,
            threads: Threads::ALL,
            ..BakeOptions::default()
        })
    }
}

impl Default for SdfQuery {
    fn default() -> Self {
        Self {
            margin: 0.0,
            translation: [0.0; 3],
            rotation: [0.0, 0.0, 0.0, 1.0],
            elements: 0,
            method: 0,
            all_minima: 0,
            budget: 0,
            threads: 1,
            lean: 0,
            complete: 0,
            exact: 0,
            clusters: std::ptr::null(),
            mesh_pose: std::ptr::null(),
            margins: std::ptr::null(),
        }
    }
}

impl SdfQuery {
    /// The options of the library.
    pub fn to_rust(self) -> Result<ContactOptions, Failure> {
        if !self.margin.is_finite() {
            return Err(Failure::invalid(format!("margin {} is not a finite length", self.margin)));
        }
        let (translation, rotation) = (self.translation, self.rotation);
        let is_moved = translation != [0.0; 3] || rotation != [0.0, 0.0, 0.0, 1.0];
        let pose = pose("pose", "; start from sdf_query()", translation, rotation)?;
        let methods = [Method::Auto, Method::Certified, Method::FrankWolfe, Method::ProjectedGradient, Method::Newton];
        Ok(ContactOptions {
            elements: choice("elements", self.elements, &[Elements::Faces, Elements::Edges, Elements::Vertices])?,
            method: choice("method", self.method, &methods)?,
            margin: self.margin,
            pose: is_moved.then_some(pose),
            budget: (self.budget > 0).then_some(self.budget),
            all_minima: self.all_minima != 0,
            lean: self.lean != 0,
            complete: self.complete != 0,
            exact: self.exact != 0,
            threads: Threads::new(thread_count(self.threads)?),
            ..ContactOptions::default()
        })
    }
}

/// A pose of these numbers.
pub fn pose(what: &str, advice: &str, translation: [f64; 3], rotation: [f64; 4]) -> Result<Rigid, Failure> {
    Rigid::new(translation, rotation).ok_or_else(|| {
        Failure::invalid(format!("{what}: a zero quaternion is not a rotation, and numbers must be finite{advice}"))
    })
}

/// As many threads as asked for; 0 stands for all cores. Never the pool of the whole process, whose threads would not end.
pub fn thread_count(threads: u32) -> Result<usize, Failure> {
    match threads as usize {
        0 => Ok(std::thread::available_parallelism().map_or(1, NonZeroUsize::get)),
        count if count <= Threads::MOST => Ok(count),
        count => Err(Failure::invalid(format!("threads {count}: give 1 to {}, or 0 for all cores", Threads::MOST))),
    }
}

/// The sign method of a code; `None` lets the mesh decide.
pub fn sign_method(code: u32) -> Result<Option<SignMethod>, Failure> {
    choice("sign", code, &[None, Some(SignMethod::PseudoNormal), Some(SignMethod::Winding)])
}

fn choice<T: Copy>(what: &str, code: u32, choices: &[T]) -> Result<T, Failure> {
    let known = || Failure::invalid(format!("{what} {code} is unknown: give 0 to {}", choices.len() - 1));
    choices.get(code as usize).copied().ok_or_else(known)
}
