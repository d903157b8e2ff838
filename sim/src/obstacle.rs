//! Against what does a surface move? A list of obstacles, each asked for itself: a union would lose what a grid knows of itself.

use sdf_core::Sdf;
use sdf_core::contact::{Row, RowSide};
use sdf_core::nalgebra::Isometry3;
use sdf_core::placed::Rigid;
use sdf_field::{ContactOptions, Contacts, Elements, Field, MeshInMotion, MeshView, QueryError, Threads};

use crate::{Body, V3};

/// A thing that surfaces must stay out of.
pub trait Obstacle: Sync {
    /// Contacts of elements of one kind: those with φ ≤ margin. `edges` are taken where the kind is edges.
    fn contacts(&self, mesh: MeshView, edges: &[[u32; 2]], options: &ContactOptions) -> Result<Contacts, QueryError>;

    /// Contacts of faces that may have a pose, clusters, and a margin each: by [`contacts`](Self::contacts) with the largest margin,
    /// where the obstacle has no better way.
    fn contacts_in_motion(&self, mesh: &MeshInMotion, options: &ContactOptions) -> Result<Contacts, QueryError> {
        let MeshInMotion { mesh: MeshView { points, faces }, pose, margins, .. } = *mesh;
        let moved = |pose: Rigid| points.iter().map(|x| pose.push((*x).into()).into()).collect();
        let moved: Option<Vec<[f64; 3]>> = pose.map(moved);
        let mesh = MeshView { points: moved.as_deref().unwrap_or(points), faces };
        let widest = |margins: &[f64]| margins.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
        let options = ContactOptions { margin: margins.map_or(options.margin, widest), ..*options };
        let mut found = self.contacts(mesh, &[], &options)?;
        if let Some(margins) = margins {
            found.contacts.retain(|contact| contact.distance <= margins[contact.element as usize]);
        }
        Ok(found)
    }

    /// Completes a row: who carries its surface point, and how fast the surface moves by itself. Unless told otherwise it stands still.
    fn complete(&self, row: Row<f64>) -> Row<f64> {
        row
    }

    /// The smallest radius of curvature of the surface where a row touches it, if it is round there; 0 of what does not roll: an edge, a
    /// plane, a hollow. For rows of rigid bodies: see [`Rounding`](crate::Rounding).
    fn radius_of_curvature(&self, _: &Row<f64>) -> f64 {
        0.0
    }

    /// Is it a body that moves? Another body then pushes against the sides of both: see [`Query::opposed`](crate::Query::opposed).
    fn is_body(&self) -> bool {
        false
    }

    /// How fast it turns, in radians per unit of time. For [`Contacts::shortfall`](crate::Contacts::shortfall).
    fn angular_speed(&self) -> f64 {
        0.0
    }

    /// The field, and a frame in which it stands still: there a [`Memory`](crate::Memory) holds from frame to frame, and rigid surfaces
    /// are searched. `None` of a field that changes.
    fn still(&self) -> Option<(&Field, Isometry3<f64>)> {
        None
    }
}

/// A field that stands still.
impl Obstacle for Field {
    fn contacts(&self, mesh: MeshView, edges: &[[u32; 2]], options: &ContactOptions) -> Result<Contacts, QueryError> {
        match options.elements {
            Elements::Edges => self.contacts_of_edges(mesh.points, edges, options),
            _ => Field::contacts(self, mesh, options),
        }
    }

    fn contacts_in_motion(&self, mesh: &MeshInMotion, options: &ContactOptions) -> Result<Contacts, QueryError> {
        Field::contacts_in_motion(self, mesh, options)
    }

    fn radius_of_curvature(&self, row: &Row<f64>) -> f64 {
        radius_of_curvature(self, &Isometry3::identity(), row)
    }

    fn still(&self) -> Option<(&Field, Isometry3<f64>)> {
        Some((self, Isometry3::identity()))
    }
}

/// Points of the surface at which its normals are compared lie this share of the body's size apart from the contact.
const SPREAD: f64 = 1.0 / 64.0;

/// A surface that curves less than a ball of so many times the body's size is flat.
const MAX_RADIUS: f64 = 2.0;

/// 1 / κ, where κ is the largest principal curvature: the largest eigenvalue of tᵢ · ∂n/∂tⱼ over two tangents t. n is the direction of the
/// smooth gradient, differenced over ± a share of the size of the field's body, or a cell.
fn radius_of_curvature(field: &Field, frame: &Isometry3<f64>, row: &Row<f64>) -> f64 {
    let (bounds, cell) = match field.grid().map(|grid| grid.lattice()) {
        Some(lattice) => (lattice.bounds(), lattice.spacing()),
        None => (field.bounds(0.0), 0.0),
    };
    let size = 0.5 * bounds.longest_side();
    if !size.is_finite() {
        return 0.0;
    }
    let at = frame.inverse_transform_point(&row.surface_point.into()).coords;
    let tangents = row.tangents().map(|tangent| frame.inverse_transform_vector(&tangent));
    let step = cell.max(SPREAD * size);
    let normal = |point: V3| field.as_any().evaluate_smooth(point).gradient.try_normalize(0.0).unwrap_or_default();
    let turns = tangents.map(|tangent| (normal(at + tangent * step) - normal(at - tangent * step)) / (2.0 * step));
    let [a, b, c] =
        [(0, 0), (0, 1), (1, 1)].map(|(i, j)| 0.5 * (tangents[i].dot(&turns[j]) + tangents[j].dot(&turns[i])));
    let curvature = 0.5 * (a + c) + (0.25 * (a - c) * (a - c) + b * b).sqrt();
    if curvature * MAX_RADIUS * size > 1.0 { 1.0 / curvature } else { 0.0 }
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

    fn contacts_in_motion(&self, mesh: &MeshInMotion, options: &ContactOptions) -> Result<Contacts, QueryError> {
        self.field.contacts_in_motion(mesh, &ContactOptions { pose: Some(self.pose), ..*options })
    }

    fn radius_of_curvature(&self, row: &Row<f64>) -> f64 {
        radius_of_curvature(self.field, &self.pose.isometry(), row)
    }

    fn still(&self) -> Option<(&Field, Isometry3<f64>)> {
        Some((self.field, self.pose.isometry()))
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

    fn contacts_in_motion(&self, mesh: &MeshInMotion, options: &ContactOptions) -> Result<Contacts, QueryError> {
        self.field.contacts_in_motion(mesh, &ContactOptions { pose: self.body.pose(), ..*options })
    }

    fn complete(&self, row: Row<f64>) -> Row<f64> {
        row.with_field(RowSide::body(self.id, self.body.position, row.surface_point))
    }

    fn is_body(&self) -> bool {
        true
    }

    fn angular_speed(&self) -> f64 {
        self.body.angular_velocity().norm()
    }

    fn radius_of_curvature(&self, row: &Row<f64>) -> f64 {
        radius_of_curvature(self.field, &self.body.isometry(), row)
    }

    fn still(&self) -> Option<(&Field, Isometry3<f64>)> {
        Some((self.field, self.body.isometry()))
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

    fn contacts_in_motion(&self, mesh: &MeshInMotion, options: &ContactOptions) -> Result<Contacts, QueryError> {
        self.now.contacts_in_motion(mesh, options)
    }

    fn complete(&self, row: Row<f64>) -> Row<f64> {
        let value = |field: &Field| field.sample(&[row.point.into()], Threads::ONE)[0].value;
        row.with_surface_velocity(row.normal * (-(value(self.later) - value(self.now)) / self.time))
    }
}
