//! Contacts on an NVIDIA GPU, by `sdf-gpu`: the same contacts in f32, and the mesh and the field stay on the card.
//!
//! | method | on the card | then on the CPU |
//! |---|---|---|
//! | [`Auto`](Method::Auto) | Frank-Wolfe; what that does not settle by the certified search | what is open then, by the certified search in f64 |
//! | [`Certified`](Method::Certified) | the certified search | what is open then, by the same search in f64 |
//! | others | the same method | nothing |
//!
//! `Auto` therefore misses no element that it finds on the CPU, except by the rounding of the points to f32: that of their distance from a
//! point near the field, wherever the scene is, but of points that the card alone has. What it finds at once keeps
//! the minimum of Frank-Wolfe, which on an element with several minima need not be the lowest.
//!
//! Lean contacts ([`ContactOptions::lean`]) take one kernel in place of three, and are of local methods alone.
//!
//! The driver is loaded when [`Cuda::open`] asks for it. The kernels come from a file: docs/gpu.md says how it is made.
//!
//! Points and faces that are on the card already are lent by [`Gpu::lend`] and read where they are: [`CudaMesh`].

mod origins;
mod query;

use std::path::{Path, PathBuf};

pub use query::CudaQuery;
pub use sdf_gpu::{CardColumn, CardContacts, Gpu, GpuError, LentRows, Ready};

use crate::compare::{Comparison, Guest};
use crate::{ContactOptions, Contacts, Elements, Field, MeshView, Method, QueryError};

/// An NVIDIA GPU with the kernels loaded.
#[derive(Clone, Debug)]
pub struct Cuda {
    gpu: Gpu,
}

/// Why a query on a card cannot be answered.
#[derive(Debug)]
#[non_exhaustive]
pub enum CudaError {
    /// No file of kernels was given, and none stands in the folder.
    NoKernels(PathBuf),
    /// The card or its driver is at fault, or does not know the field or the method.
    Card(GpuError),
    /// The query would be refused on the CPU, too.
    Query(QueryError),
    /// An option that only the CPU has.
    OnlyOnCpu(&'static str),
    /// Contacts were to stay on the card, but `Auto` or `Certified` leaves some of the elements to the CPU.
    LeftToCpu,
    /// Contacts were to stay on the card, where f32 has no room for their positions.
    FarFromOrigin,
}

impl std::fmt::Display for CudaError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoKernels(folder) => write!(
                f,
                "no GPU kernels: {} has no kernels.ptx; build it by .ci/gpu.sh --out FOLDER and name it, as docs/gpu.md says",
                folder.display()
            ),
            Self::Card(error) => error.fmt(f),
            Self::Query(error) => error.fmt(f),
            Self::OnlyOnCpu(what) => write!(f, "{what}: not on a GPU; query on the CPU"),
            Self::LeftToCpu => {
                write!(
                    f,
                    "elements are left to the CPU here: take contacts from there, more iterations, or another method"
                )
            }
            Self::FarFromOrigin => write!(
                f,
                "the scene is far from the origin, where f32 has no room for positions: take contacts from the CPU, or move the scene"
            ),
        }
    }
}

impl std::error::Error for CudaError {}

impl From<GpuError> for CudaError {
    fn from(error: GpuError) -> Self {
        Self::Card(error)
    }
}

impl From<QueryError> for CudaError {
    fn from(error: QueryError) -> Self {
        Self::Query(error)
    }
}

impl Cuda {
    /// The first card, with the kernels in this file: PTX, which any card's driver compiles, or the machine code of its generation.
    pub fn open(kernels: &Path) -> Result<Self, CudaError> {
        Ok(Self { gpu: Gpu::new(kernels)? })
    }

    /// The first card, with the kernels that stand in this folder as `.ci/gpu.sh --out FOLDER` writes them: the card's machine code if
    /// it is there, else `kernels.ptx`.
    pub fn open_in(folder: &Path) -> Result<Self, CudaError> {
        let (major, _) = Gpu::capability()?;
        let names = [format!("kernels.sm_{major}0.cubin"), "kernels.ptx".to_owned()];
        match names.map(|name| folder.join(name)).into_iter().find(|path| path.is_file()) {
            Some(kernels) => Self::open(&kernels),
            None => Err(CudaError::NoKernels(folder.to_owned())),
        }
    }

    /// The card and its kernels, for what a program wants of them beyond contacts of a field.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The card's name.
    pub fn name(&self) -> Result<String, CudaError> {
        Ok(self.gpu.name()?)
    }
}

/// A triangle mesh for a card. Points and faces are each in a slice or on the card.
#[derive(Clone, Copy, Debug)]
pub struct CudaMesh<'a> {
    /// Coordinates of the vertices.
    pub points: CudaPoints<'a>,
    /// For each face the indices of its three vertices.
    pub faces: CudaFaces<'a>,
}

/// Points in a slice or on the card.
#[derive(Clone, Copy, Debug)]
pub enum CudaPoints<'a> {
    /// They are rounded to f32, about a point near the field, and copied to the card.
    Slice(&'a [[f64; 3]]),
    /// Rows of f32, which are read where they are.
    Lent(LentRows),
}

/// Faces in a slice or on the card.
#[derive(Clone, Copy, Debug)]
pub enum CudaFaces<'a> {
    /// They are copied to the card.
    Slice(&'a [[u32; 3]]),
    /// Rows of u32: copied on the card, and read once to check them.
    Lent(LentRows),
}

impl<'a> From<MeshView<'a>> for CudaMesh<'a> {
    fn from(mesh: MeshView<'a>) -> Self {
        Self { points: CudaPoints::Slice(mesh.points), faces: CudaFaces::Slice(mesh.faces) }
    }
}

impl Field {
    /// [`contacts`](Self::contacts) on a card, once. Who asks frame after frame keeps a [`query_on`](Self::query_on).
    pub fn contacts_on<'a>(
        &self,
        cuda: &Cuda,
        mesh: impl Into<CudaMesh<'a>>,
        options: &ContactOptions,
    ) -> Result<Contacts, CudaError> {
        self.query_on(cuda, mesh, options)?.contacts()
    }

    /// Copies the field and a mesh to a card.
    pub fn query_on<'a>(
        &self,
        cuda: &Cuda,
        mesh: impl Into<CudaMesh<'a>>,
        options: &ContactOptions,
    ) -> Result<CudaQuery, CudaError> {
        let CudaMesh { points, faces } = mesh.into();
        CudaQuery::of_mesh(self, cuda, points, faces, options)
    }

    /// [`compare`](Self::compare), and those of the methods that the card has run there, too: [`Comparison::on_card`].
    pub fn compare_on(
        &self,
        cuda: &Cuda,
        mesh: MeshView,
        options: &ContactOptions,
        rounds: usize,
        on_done: &dyn Fn(usize),
    ) -> Result<Comparison, CudaError> {
        let failed = std::cell::RefCell::new(None);
        let mut guests: Vec<Guest> = vec![];
        let faces = ContactOptions { elements: Elements::Faces, ..*options };
        let base = if options.elements == Elements::Edges { options } else { &faces };
        for method in Method::ALL.into_iter().filter(|method| !method.is_baseline()) {
            let options = ContactOptions { method, budget: None, ..*base };
            match self.query_on(cuda, mesh, &options) {
                Err(CudaError::Card(GpuError::Unsupported(_)) | CudaError::Query(_)) => {}
                query => {
                    let (mut query, failed) = (query?, &failed);
                    let run = move || query.contacts().map_err(|error| *failed.borrow_mut() = Some(error)).ok();
                    guests.push((method, Box::new(run)));
                }
            }
        }
        let compared = self.compare_with(mesh, options, rounds, on_done, guests)?;
        match failed.into_inner() {
            Some(error) => Err(error),
            None => Ok(compared),
        }
    }

    /// [`query_on`](Self::query_on) for edges that are given, such as the line elements of a file.
    pub fn query_edges_on(
        &self,
        cuda: &Cuda,
        points: &[[f64; 3]],
        edges: &[[u32; 2]],
        options: &ContactOptions,
    ) -> Result<CudaQuery, CudaError> {
        CudaQuery::of_edges(self, cuda, CudaPoints::Slice(points), edges.to_vec(), options)
    }
}
