//! Contacts of meshes with signed distance fields on NVIDIA GPUs.
//!
//! The kernels are `sdf-core` itself, compiled to PTX (`gpu/kernels`): a contact has the bits that
//! [`contact::<f32, …>`](sdf_core::contact::contact) has on a CPU. The driver is loaded at run time; without one
//! [`Gpu::new`] returns [`GpuError::NoDriver`], and everything else of the workspace works as before.
//!
//! | file | holds |
//! |---|---|
//! | `device` | [`Gpu`]: a card with the kernels loaded |
//! | `field` | [`GpuField`]: a grid or a union of closed forms in the card's memory |
//! | `shapes` | closed forms as plain numbers |
//! | `mesh` | [`GpuMesh`]: points, elements and scratch buffers, kept from frame to frame |
//! | `lent` | [`LentRows`]: points and faces of other programs that are on the card already, read where they are |
//! | `options` | [`QueryOptions`]: method, limits, and what becomes of elements that the search does not settle |
//! | `query` | [`GpuQuery`]: a mesh and a field that stay on the card, and the kernels between them |
//! | `timing` | [`GpuQuery::time`]: the same, measured by the card's own clock |
//! | `record` | a contact as the card writes it |
//! | `card_contacts` | [`CardContacts`]: contacts that stay on the card |
//! | `abi` | plain numbers that host and kernels exchange |

#![warn(missing_docs)]

#[allow(missing_docs, dead_code, reason = "described at the types; some of it is for the kernels alone")]
mod abi;
mod card_contacts;
mod device;
mod field;
mod lent;
mod mesh;
mod options;
mod query;
mod record;
mod shapes;
mod timing;

pub use card_contacts::{CardColumn, CardContacts};
pub use device::{Gpu, GpuError};
pub use field::GpuField;
pub use lent::{LentRow, LentRows, Ready};
pub use mesh::{Elements, GpuMesh};
pub use options::{Method, QueryOptions, Stages, Unsettled};
pub use query::{GpuContacts, GpuQuery};
pub use timing::Times;
