//! Against what does a surface move? A list of obstacles, each asked for itself: a union would lose what a grid knows of itself.

use sdf_core::contact::Contact;
use sdf_core::placed::Rigid;
use sdf_field::{ContactOptions, Contacts, Elements, Field, MeshView, QueryError, Threads};

use crate::row::{Rows, Side};
use crate::{Body, V3};

/// A thing that surfaces must stay out of.
pub trait Obstacle: Sync {
    /// Contacts of elements of one kind: those with φ ≤ margin. `edges` are taken where the kind is edges.
    fn contacts(&self, mesh: MeshView, edges: &[[u32; 2]], options: &ContactOptions) -> Result<Contacts, QueryError>;

    /// The side of a row that a contact presses on. `rows` takes the particles that it names.
    fn side(&self, contact: &Contact<f64>, rows: &mut Rows) -> Side;
}

/// A field that stands still.
impl Obstacle for Field {
    fn contacts(&self, mesh: MeshView, edges: &[[u32; 2]], options: &ContactOptions) -> Result<Contacts, QueryError> {
        match options.elements {
            Elements::Edges => self.contacts_of_edges(mesh.points, edges, options),
            _ => Field::contacts(self, mesh, options),
        }
    }

    fn side(&self, _: &Contact<f64>, _: &mut Rows) -> Side {
        Side::Fixed(V3::zeros())
    }
}

/// A field that stands still somewhere else.
#[derive(Clone, Copy, Debug)]
pub struct Placed<'a> {
    /// The field in its own frame.
    pub field: &'a Field,
    /// Where it stands.
    pub pose: Rigid,
}

impl Obstacle for Placed<'_> {
    fn contacts(&self, mesh: MeshView, edges: &[[u32; 2]], options: &ContactOptions) -> Result<Contacts, QueryError> {
        Obstacle::contacts(self.field, mesh, edges, &ContactOptions { pose: Some(self.pose), ..*options })
    }

    fn side(&self, _: &Contact<f64>, _: &mut Rows) -> Side {
        Side::Fixed(V3::zeros())
    }
}

/// The field of a rigid body.
#[derive(Clone, Copy, Debug)]
pub struct Carried<'a> {
    /// The field in the body's frame.
    pub field: &'a Field,
    /// Index of the body.
    pub id: u32,
    /// The body.
    pub body: &'a Body,
}

impl Obstacle for Carried<'_> {
    fn contacts(&self, mesh: MeshView, edges: &[[u32; 2]], options: &ContactOptions) -> Result<Contacts, QueryError> {
        Obstacle::contacts(self.field, mesh, edges, &ContactOptions { pose: self.body.pose(), ..*options })
    }

    fn side(&self, contact: &Contact<f64>, _: &mut Rows) -> Side {
        Side::Body { id: self.id, arm: self.body.local_point(&contact.surface_point) }
    }
}

/// A field that changes: its surface moves along its normal with the velocity −(φ(later) − φ(now)) / time.
#[derive(Clone, Copy, Debug)]
pub struct Moving<'a> {
    /// The field at the beginning of the step.
    pub now: &'a Field,
    /// The field `time` later.
    pub later: &'a Field,
    /// Time between the two.
    pub time: f64,
}

impl Obstacle for Moving<'_> {
    fn contacts(&self, mesh: MeshView, edges: &[[u32; 2]], options: &ContactOptions) -> Result<Contacts, QueryError> {
        Obstacle::contacts(self.now, mesh, edges, options)
    }

    fn side(&self, contact: &Contact<f64>, _: &mut Rows) -> Side {
        let value = |field: &Field| field.sample(&[contact.point.into()], Threads::ONE)[0].value;
        Side::Fixed(contact.normal * (-(value(self.later) - value(self.now)) / self.time))
    }
}
