//! The device that `--device` names, ready to search.

use anyhow::Result;
use sdf_field::compare::Comparison;
use sdf_field::{ContactOptions, Contacts, Field, MeshView};

use crate::args::{Device, DeviceArgs};
use crate::failure::misuse;

/// The processor, or a card with the kernels loaded.
pub struct Searcher {
    #[cfg(feature = "cuda")]
    cuda: Option<sdf_field::cuda::Cuda>,
}

/// Elements to search, and how.
#[derive(Clone, Copy)]
pub struct Search<'a> {
    pub mesh: MeshView<'a>,
    /// In place of the edges of the faces.
    pub edges: Option<&'a [[u32; 2]]>,
    pub options: &'a ContactOptions,
}

impl Searcher {
    /// Opens the card for `--device cuda`, before any file is read.
    pub fn open(args: &DeviceArgs) -> Result<Self> {
        match (args.device, &args.kernels) {
            (Device::Cpu, None) => Ok(Self {
                #[cfg(feature = "cuda")]
                cuda: None,
            }),
            (Device::Cpu, Some(_)) => misuse!("--kernels is for a GPU: add --device cuda, or remove it"),
            (Device::Cuda, kernels) => Self::open_cuda(kernels.as_deref()),
        }
    }

    #[cfg(feature = "cuda")]
    fn open_cuda(kernels: Option<&std::path::Path>) -> Result<Self> {
        use anyhow::Context;
        use sdf_field::cuda::Cuda;
        let cuda = match kernels {
            Some(kernels) => Cuda::open(kernels),
            None => {
                let program = std::env::current_exe().context("the program's own folder, for its GPU kernels")?;
                Cuda::open_in(program.parent().unwrap_or(&program))
            }
        };
        Ok(Self { cuda: Some(cuda?) })
    }

    #[cfg(not(feature = "cuda"))]
    fn open_cuda(_kernels: Option<&std::path::Path>) -> Result<Self> {
        anyhow::bail!("this program was built without GPUs: build it with the feature cuda, or remove --device")
    }

    /// `cpu` or `cuda`.
    pub fn name(&self) -> &'static str {
        if self.is_card() { "cuda" } else { "cpu" }
    }

    #[cfg(feature = "cuda")]
    pub fn is_card(&self) -> bool {
        self.cuda.is_some()
    }

    #[cfg(not(feature = "cuda"))]
    pub fn is_card(&self) -> bool {
        false
    }

    /// The card's name; `None` of the processor.
    pub fn card(&self) -> Result<Option<String>> {
        #[cfg(feature = "cuda")]
        if let Some(cuda) = &self.cuda {
            return Ok(Some(cuda.name()?));
        }
        Ok(None)
    }

    /// All contacts at once, by the card; `None` of the processor, which visits them one by one.
    #[cfg_attr(not(feature = "cuda"), expect(unused_variables, reason = "there is no card"))]
    pub fn contacts(&self, field: &Field, search: Search) -> Result<Option<Contacts>> {
        #[cfg(feature = "cuda")]
        if let Some(cuda) = &self.cuda {
            let Search { mesh, edges, options } = search;
            let query = match edges {
                Some(edges) => field.query_edges_on(cuda, mesh.points, edges, options),
                None => field.query_on(cuda, mesh, options),
            };
            return Ok(Some(query?.contacts()?));
        }
        Ok(None)
    }

    /// All methods on the processor, and on the card those that it has.
    pub fn compare(&self, field: &Field, search: Search, rounds: usize, on_done: &dyn Fn(usize)) -> Result<Comparison> {
        let Search { mesh, options, .. } = search;
        #[cfg(feature = "cuda")]
        if let Some(cuda) = &self.cuda {
            return Ok(field.compare_on(cuda, mesh, options, rounds, on_done)?);
        }
        Ok(field.compare(mesh, options, rounds, on_done)?)
    }
}
