//! Contacts on an NVIDIA GPU, by `sdf-gpu`: the same contacts in f32, and the mesh and the field stay on the card.
//!
//! | method | on the card | then on the CPU |
//! |---|---|---|
//! | [`Auto`](Method::Auto) | Frank-Wolfe | what that does not settle, by the certified search in f64 |
//! | [`Certified`](Method::Certified) | the certified search, of faces and dense grids | nothing |
//! | others | the same method | nothing |
//!
//! `Auto` therefore misses no element that it finds on the CPU, except by the rounding of the points to f32. What it finds at once keeps
//! the minimum of Frank-Wolfe, which on an element with several minima need not be the lowest.
//!
//! The driver is loaded when [`Cuda::open`] asks for it. The kernels come from a file: docs/gpu.md says how it is made.

use std::path::{Path, PathBuf};

use sdf_core::AnyField;
use sdf_core::contact::{Contact, Feature, one_per_feature};
use sdf_core::placed::Rigid;
use sdf_gpu::{Elements as CardElements, Gpu, GpuError, GpuField, GpuMesh, GpuQuery, QueryOptions, Stages, Unsettled};

use crate::compare::{Comparison, Guest};
use crate::{ContactOptions, Contacts, Elements, Field, MeshView, Method, QueryError, contacts};

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

    /// The card's name.
    pub fn name(&self) -> Result<String, CudaError> {
        Ok(self.gpu.name()?)
    }
}

/// A mesh and a field on a card, for a query a frame.
#[derive(Debug)]
pub struct CudaQuery<'a> {
    query: GpuQuery,
    field: &'a Field,
    points: Vec<[f64; 3]>,
    elements: Owned,
    options: ContactOptions,
}

/// Elements as the search on the CPU wants them.
#[derive(Debug)]
enum Owned {
    Faces(Vec<[u32; 3]>),
    Edges(Vec<[u32; 2]>),
    Vertices,
}

impl Owned {
    fn count(&self, points: usize) -> usize {
        match self {
            Self::Faces(faces) => faces.len(),
            Self::Edges(edges) => edges.len(),
            Self::Vertices => points,
        }
    }
}

impl Field {
    /// [`contacts`](Self::contacts) on a card, once. Who asks frame after frame keeps a [`query_on`](Self::query_on).
    pub fn contacts_on(&self, cuda: &Cuda, mesh: MeshView, options: &ContactOptions) -> Result<Contacts, CudaError> {
        self.query_on(cuda, mesh, options)?.contacts()
    }

    /// Copies the field and a mesh to a card.
    pub fn query_on(&self, cuda: &Cuda, mesh: MeshView, options: &ContactOptions) -> Result<CudaQuery<'_>, CudaError> {
        let elements = match options.elements {
            Elements::Faces => Owned::Faces(mesh.faces.to_vec()),
            Elements::Edges => Owned::Edges(mesh.edges()),
            Elements::Vertices => Owned::Vertices,
        };
        CudaQuery::new(self, cuda, mesh.points, elements, options)
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
    ) -> Result<CudaQuery<'_>, CudaError> {
        CudaQuery::new(self, cuda, points, Owned::Edges(edges.to_vec()), options)
    }
}

impl<'a> CudaQuery<'a> {
    fn new(
        field: &'a Field,
        cuda: &Cuda,
        points: &[[f64; 3]],
        elements: Owned,
        options: &ContactOptions,
    ) -> Result<Self, CudaError> {
        let card_options = card_options(&elements, options)?;
        let on_card = GpuField::new(&cuda.gpu, field.as_any())?;
        let card_elements = match &elements {
            Owned::Faces(faces) => CardElements::Faces(faces),
            Owned::Edges(edges) => CardElements::Edges(edges),
            Owned::Vertices => CardElements::Vertices,
        };
        let mesh = GpuMesh::new(&cuda.gpu, &rounded(points), card_elements)?;
        let query = GpuQuery::new(&cuda.gpu, &on_card, mesh, &card_options)?;
        let mut new = Self { query, field, points: points.to_vec(), elements, options: *options };
        new.set_pose(options.pose)?;
        Ok(new)
    }

    /// Replaces the points of the mesh.
    pub fn set_points(&mut self, points: &[[f64; 3]]) -> Result<(), CudaError> {
        self.query.set_points(&rounded(points))?;
        self.points.copy_from_slice(points);
        Ok(())
    }

    /// Moves the field.
    pub fn set_pose(&mut self, pose: Option<Rigid>) -> Result<(), CudaError> {
        self.options.pose = pose;
        Ok(self.query.set_pose(pose.as_ref())?)
    }

    /// The contacts of this frame, in the order of elements.
    pub fn contacts(&mut self) -> Result<Contacts, CudaError> {
        let found = self.query.contacts()?;
        let mut all = Contacts {
            contacts: found.contacts.iter().map(widened).collect(),
            element_count: self.elements.count(self.points.len()),
            searched_count: found.searched_count as usize,
            possible_count: 0,
            not_finite_count: found.skipped_count as usize,
        };
        if !found.unsettled.is_empty() {
            let second = self.search_again(&found.unsettled)?;
            all.not_finite_count += second.not_finite_count;
            all.contacts.extend(second.contacts);
            all.contacts.sort_by_key(|contact| contact.element);
        }
        if self.options.one_per_feature {
            let count = one_per_feature(&mut all.contacts);
            all.contacts.truncate(count);
        }
        Ok(all)
    }

    /// Contacts of these elements by the search on the CPU.
    fn search_again(&self, ids: &[u32]) -> Result<Contacts, CudaError> {
        let options = ContactOptions { one_per_feature: false, ..self.options };
        let field: &AnyField = self.field.as_any();
        let mut found = match &self.elements {
            Owned::Faces(faces) => {
                let faces: Vec<_> = ids.iter().map(|id| faces[*id as usize]).collect();
                contacts::find(field, MeshView { points: &self.points, faces: &faces }, &options)?
            }
            Owned::Edges(edges) => {
                let edges: Vec<_> = ids.iter().map(|id| edges[*id as usize]).collect();
                contacts::find_edges(field, &self.points, &edges, &options)?
            }
            Owned::Vertices => {
                let vertices: Vec<_> = ids.iter().map(|id| [*id]).collect();
                contacts::find_vertices(field, &self.points, &vertices, &options)?
            }
        };
        for contact in &mut found.contacts {
            contact.element = ids[contact.element as usize];
            if let Feature::Face(face) = &mut contact.feature {
                *face = contact.element;
            }
        }
        Ok(found)
    }
}

/// How the card searches; an error where only the CPU can.
fn card_options(elements: &Owned, options: &ContactOptions) -> Result<QueryOptions, CudaError> {
    let refused = [
        ("all minima", options.all_minima),
        ("a complete search", options.complete),
        ("an exact search", options.exact),
        ("samples with the corners", matches!(options.method, Method::SamplingWithCorners(_))),
    ];
    if let Some((what, _)) = refused.into_iter().find(|(_, asked)| *asked) {
        return Err(CudaError::OnlyOnCpu(what));
    }
    let is_edges = matches!(elements, Owned::Edges(_));
    if options.method == Method::GoldenSection && !is_edges {
        return Err(QueryError::GoldenSectionNeedsEdges.into());
    }
    let (method, iterations, unsettled) = match options.method {
        // A point has one minimum, found by one evaluation.
        _ if matches!(elements, Owned::Vertices) => (sdf_gpu::Method::PointSampling, 1, Unsettled::Keep),
        Method::Auto => (sdf_gpu::Method::FrankWolfe, Method::FrankWolfe.default_budget(), Unsettled::List),
        Method::Certified => (sdf_gpu::Method::Certified, options.budget(), Unsettled::Keep),
        Method::FrankWolfe => (sdf_gpu::Method::FrankWolfe, options.budget(), Unsettled::Keep),
        Method::ProjectedGradient => (sdf_gpu::Method::ProjectedGradient, options.budget(), Unsettled::Keep),
        Method::Newton => (sdf_gpu::Method::Newton, options.budget(), Unsettled::Keep),
        Method::GoldenSection => (sdf_gpu::Method::GoldenSection, options.budget(), Unsettled::Keep),
        Method::Sampling(samples) | Method::SamplingWithCorners(samples) => {
            (sdf_gpu::Method::PointSampling, samples, Unsettled::Keep)
        }
    };
    let (margin, tolerance) = (options.margin as f32, options.tolerance);
    Ok(QueryOptions { method, margin, iterations, tolerance, stages: Stages::Separate, unsettled })
}

fn rounded(points: &[[f64; 3]]) -> Vec<[f32; 3]> {
    points.iter().map(|point| point.map(|x| x as f32)).collect()
}

/// The same contact in f64, whose weights sum to one there.
fn widened(contact: &Contact<f32>) -> Contact<f64> {
    let weights = contact.weights.map(f64::from);
    let sum: f64 = weights.iter().sum();
    Contact {
        kind: contact.kind,
        element: contact.element,
        vertices: contact.vertices,
        rank: contact.rank,
        feature: contact.feature,
        weights: weights.map(|weight| weight / sum),
        point: contact.point.map(f64::from),
        surface_point: contact.surface_point.map(f64::from),
        normal: contact.normal.map(f64::from),
        slope: contact.slope.into(),
        distance: contact.distance.into(),
        lower_bound: contact.lower_bound.into(),
        error_bound: contact.error_bound.into(),
        shape_lower_bound: contact.shape_lower_bound.into(),
        evaluations: contact.evaluations,
        status: contact.status,
    }
}
