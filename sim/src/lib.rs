//! Cloth, rigid and soft bodies against signed distance fields, after Macklin et al. 2020, §5 and §8: *geometry in core, motion
//! outside*.
//!
//! | question | file |
//! |---|---|
//! | Which elements of which body touch which obstacle? | [`query`](Query), [`obstacle`](Obstacle), [`surface`](Surface); soft bodies as obstacles: `caged`, `halo` |
//! | How far does it get until the next search? What need not be searched again? | [`motion`](Motion), [`memory`](Memory) |
//! | Which way is a sheet pushed by what is thinner than a cell? | `sheet_normal` |
//! | Which way do two bodies push each other beside an edge? | `opposed` |
//! | What does a contact push, and how far? Core's [`Row`] | [`row`](Rows), `world/touch` |
//! | How does everything move? XPBD (Macklin et al. 2016) in substeps, each pass there and back | [`World`] |
//! | Sheets and nets, rigid bodies, soft bodies | `cloth`, `rigid`, `soft` |
//! | How is a scene described, built, run and judged? | [`scene`] |
//! | How is it kept and looked at? | [`record`] |
//!
//! Why a pass goes there and back: docs/simulation.md.
//!
//! ```
//! use sdf_sim::{Contacts, Elements, Motion, Obstacle, Query, Surface, World, cloth};
//! use sdf_field::{Field, core::shapes::{HalfSpace, Sphere}};
//!
//! let sheet = sdf_procedural::Sheet { cells: [8, 8], size: [1.0, 1.0], height: 0.52, bend: 0.0, floor: -1.0, holes: None, faces: None };
//! let mesh = sheet.mesh();
//! let mut world = World::new([0.0, 0.0, -9.81]);
//! let surface = cloth::add(&mut world, &mesh.points, &mesh.triangles, &cloth::Fabric::default());
//! let (ball, floor) = (Field::new(Sphere::new(0.5).unwrap()), Field::new(HalfSpace::new([0.0, 0.0, 1.0], -0.5).unwrap()));
//! let scene: [&dyn Obstacle; 2] = [&ball, &floor];
//!
//! let query = Query { thickness: 0.01, ..Query::default() };
//! let mut contacts = Contacts::default(); // Buffers, kept from frame to frame.
//! let (dt, substeps) = (1.0 / 600.0, 10);
//! for _frame in 0..30 {
//!     let motion = Motion::of(&world, dt * f64::from(substeps)); // A margin by how far each element gets.
//!     contacts.clear();
//!     for obstacle in &scene {
//!         query.find(*obstacle, &surface, &world, &motion, &mut contacts)?;
//!     }
//!     for _ in 0..substeps {
//!         world.step(dt, contacts.rows());
//!     }
//! }
//! let lowest = surface.points(&world).iter().map(|point| point[0].hypot(point[1]).hypot(point[2])).fold(f64::INFINITY, f64::min);
//! assert!(lowest > 0.5, "{lowest}");
//! # Ok::<(), sdf_field::QueryError>(())
//! ```

#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod caged;
pub mod cloth;
mod halo;
mod memory;
mod motion;
mod obstacle;
mod opposed;
mod query;
pub mod record;
mod rigid;
mod row;
pub mod scene;
mod sheet_normal;
pub mod soft;
mod surface;
mod touch;
mod world;

pub use caged::{CageAtRest, CageRoom, CagedBody};
pub use motion::Motion;
pub use obstacle::{Carried, Moving, Obstacle, Placed};
pub use query::{Contacts, Elements, Memory, Query};
pub use rigid::Body;
pub use row::{Rounding, Rows};
pub use sdf_core::contact::{Row, RowSide};
pub use surface::{Carrier, Surface};
pub use world::{Passes, Stretch, Tet, World};

pub(crate) type V3 = sdf_core::nalgebra::Vector3<f64>;
