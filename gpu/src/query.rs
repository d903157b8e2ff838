//! Queries: which kernels find the contacts of a mesh, and how are they read back?

use cudarc::driver::{CudaFunction, DevicePtr, PushKernelArg};
use sdf_core::contact::Contact;

use crate::abi::{FieldBlob, Frame, SearchParams};
use crate::device::blocks;
use crate::record::contact;
use crate::{Gpu, GpuError, GpuField, GpuMesh};

/// A method of `sdf_core::minimize`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// `FrankWolfe`.
    FrankWolfe,
    /// `ProjectedGradient`.
    ProjectedGradient,
    /// `Newton`.
    Newton,
    /// `GoldenSection`, on edges.
    GoldenSection,
    /// `PointSampling`.
    PointSampling,
}

impl Method {
    /// As the names of kernels have it.
    fn name(self) -> &'static str {
        match self {
            Self::FrankWolfe => "frank_wolfe",
            Self::ProjectedGradient => "projected_gradient",
            Self::Newton => "newton",
            Self::GoldenSection => "golden_section",
            Self::PointSampling => "point_sampling",
        }
    }
}

/// Method, limits and form of a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QueryOptions {
    /// The method of the search.
    pub method: Method,
    /// Contacts are reported where φ is at most this.
    pub margin: f32,
    /// Largest number of steps, or the number of samples.
    pub iterations: u32,
    /// How the work is cut into kernels.
    pub stages: Stages,
}

/// How a query is cut into kernels. The contacts are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stages {
    /// Cull, search and report are a kernel each. What is left after each moves together, so that no thread waits.
    Separate,
    /// One kernel. It saves two launches, which on meshes of some ten thousand elements cost more than threads that wait.
    Fused,
}

/// The contacts of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct GpuContacts {
    /// In the order of their elements.
    pub contacts: Vec<Contact<f32>>,
    /// Elements that were searched; 0 of a fused query, which does not count them.
    pub searched_count: u32,
    /// Elements with coordinates or answers that are not finite.
    pub skipped_count: u32,
}

/// A query whose kernels are looked up.
pub(crate) struct Query {
    kernels: Vec<CudaFunction>,
    /// Index of the kernel that has a method.
    search_kernel: usize,
    field: FieldBlob,
    frame: Frame,
    search: SearchParams,
}

impl Gpu {
    /// The contacts of a mesh: those of `sdf_core::contact::contact::<f32, …>`, bit for bit, in the order of elements.
    pub fn contacts(
        &self,
        field: &GpuField,
        mesh: &mut GpuMesh,
        options: &QueryOptions,
    ) -> Result<GpuContacts, GpuError> {
        let query = Query::new(self, field, mesh, options)?;
        for stage in 0..query.stage_count() {
            query.launch(self, mesh, stage)?;
        }
        self.read_contacts(mesh)
    }

    /// The contacts that the last query of a mesh left in the card's memory.
    fn read_contacts(&self, mesh: &GpuMesh) -> Result<GpuContacts, GpuError> {
        let counters = self.stream.clone_dtoh(&mesh.counters)?;
        let (searched_count, hit_count) = (counters[0], counters[1] as usize);
        let records =
            if hit_count == 0 { vec![] } else { self.stream.clone_dtoh(&mesh.contacts.slice(0..hit_count))? };
        let mut contacts: Vec<_> = records.iter().filter_map(contact).collect();
        contacts.sort_unstable_by_key(|contact| contact.element);
        Ok(GpuContacts { contacts, searched_count, skipped_count: counters[2] })
    }
}

impl Query {
    pub fn new(gpu: &Gpu, field: &GpuField, mesh: &GpuMesh, options: &QueryOptions) -> Result<Self, GpuError> {
        let (elements, kind, method) = (mesh.kind, field.kind, options.method.name());
        let names = match options.stages {
            Stages::Fused => vec![format!("contact_{elements}_{kind}_{method}")],
            Stages::Separate => vec![
                format!("cull_{elements}_{kind}"),
                format!("search_{elements}_{kind}_{method}"),
                format!("report_{elements}_{kind}"),
            ],
        };
        let missing = GpuError::Unsupported("this method on this field and kind of element");
        let kernels: Result<Vec<_>, _> = names.iter().map(|name| gpu.kernel(name)).collect();
        let stream = &gpu.stream;
        Ok(Self {
            search_kernel: names.len() / 2,
            kernels: kernels.map_err(|_| missing)?,
            field: field.blob,
            frame: Frame {
                points: mesh.points.device_ptr(stream).0,
                elements: mesh.elements.device_ptr(stream).0,
                survivors: mesh.survivors.device_ptr(stream).0,
                hits: mesh.hits.device_ptr(stream).0,
                contacts: mesh.contacts.device_ptr(stream).0,
                counters: mesh.counters.device_ptr(stream).0,
                element_count: mesh.element_count,
                margin: options.margin,
            },
            search: SearchParams { tolerance: 1e-6, step: 0.5, iterations: options.iterations, unused: 0 },
        })
    }

    /// Clearing the counters, and the kernels.
    pub fn stage_count(&self) -> usize {
        1 + self.kernels.len()
    }

    /// Starts one of the stages, which waits for those before it.
    pub fn launch(&self, gpu: &Gpu, mesh: &mut GpuMesh, stage: usize) -> Result<(), GpuError> {
        let Some(kernel) = stage.checked_sub(1) else {
            return Ok(gpu.stream.memset_zeros(&mut mesh.counters)?);
        };
        let mut launch = gpu.stream.launch_builder(&self.kernels[kernel]);
        launch.arg(&self.field).arg(&self.frame);
        if kernel == self.search_kernel {
            launch.arg(&self.search);
        }
        // SAFETY: the frame has the addresses of the mesh's own buffers, which have room for every element.
        unsafe { launch.launch(blocks(mesh.element_count))? };
        Ok(())
    }
}
