//! sdftool for Python. Every function stands on the crate `sdf-field`; here are only its arguments, arrays and exceptions.
//!
//! | question | file |
//! |---|---|
//! | How is a query asked on a card? How do arrays that are there come in and go out? | `cuda`, `card_arrays` |
//! | How do arrays and meshes of other packages become slices? | `arrays`, `mesh` |
//! | How does Ctrl-C end a bake? | `bake` |
//! | What can be asked of a field? Which contacts are enough for a rigid body? | `sdf`, `queries`, `contacts`, `overlap`; `reduce` |
//! | How is a mesh queried that moves? | `motion` |
//! | Which closed forms are there? | `shapes` |
//! | Which files are read and written? Those of other programs? | `files`, `export`, `import` |
//! | On which threads does it run, also after a fork? | `pools` |
//! | Which exception has an error? Which integers are taken? | `errors`, `integers` |

mod arrays;
mod bake;
mod card_arrays;
mod contacts;
mod cuda;
mod errors;
mod export;
mod files;
mod import;
mod integers;
mod mesh;
mod motion;
mod overlap;
mod pools;
mod pose;
mod queries;
mod reduce;
mod sdf;
mod shapes;

use pyo3::prelude::*;
use sdf_field::ContactRow;

#[pymodule]
fn _sdftool(module: &Bound<PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("contact_dtype", contacts::own_dtype(contacts::contact_dtype(module.py())?))?;
    module.add("STATUS_NAMES", ContactRow::STATUS_NAMES.to_vec())?;
    module.add("ELEMENT_NAMES", ContactRow::ELEMENT_NAMES.to_vec())?;
    module.add_class::<sdf::Sdf>()?;
    module.add_class::<motion::MeshClusters>()?;
    module.add_class::<overlap::Overlap>()?;
    module.add_class::<cuda::CudaQuery>()?;
    module.add_class::<card_arrays::CudaContacts>()?;
    module.add_class::<card_arrays::CudaColumn>()?;
    module.add_function(wrap_pyfunction!(bake::bake, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::signed_distance, module)?)?;
    module.add_function(wrap_pyfunction!(files::load, module)?)?;
    module.add_function(wrap_pyfunction!(files::from_bytes, module)?)?;
    module.add_function(wrap_pyfunction!(files::clear_leftovers, module)?)?;
    module.add_function(wrap_pyfunction!(import::import_grid, module)?)?;
    module.add_function(wrap_pyfunction!(reduce::reduce, module)?)?;
    shapes::add(module)
}
