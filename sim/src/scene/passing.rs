//! Which bodies pass by? A contact that is found within the margin is a plane without an end: beside an edge it would stop what falls past.
//! A rigid body that touches nothing on its free way through a frame moves freely, and its contacts are forgotten.

use sdf_core::Aabb;
use sdf_core::contact::{Row, RowSide};
use sdf_field::{Field, FirstTouchOptions, MeshPath, MeshView, QueryError, Threads};

use super::run::body_of;
use crate::query::Contacts;
use crate::row::Rows;
use crate::surface::{Carrier, Surface};
use crate::world::World;

/// Most evaluations of a field for a face on its way.
const BUDGET: u32 = 1024;

/// A frame of rigid bodies and of obstacles that stand still.
pub(super) struct Passing<'a> {
    pub world: &'a World,
    pub surfaces: &'a [Surface],
    pub obstacles: &'a [Field],
    /// For each body its field.
    pub fields: &'a [Field],
    pub thickness: f64,
    /// Contacts that are nearer than the thickness and this are held, and not asked.
    pub near: f64,
    pub substeps: u32,
    pub dt: f64,
    pub threads: Threads,
}

impl Passing<'_> {
    /// Forgets the contacts of bodies that touch nothing on their free way.
    pub fn forget(&self, contacts: &mut Contacts) -> Result<(), QueryError> {
        let rows = contacts.rows().as_slice();
        let mut is_free = vec![false; self.world.bodies.len()];
        rows.iter().flat_map(bodies).for_each(|id| is_free[id] = true);
        rows.iter()
            .filter(|row| row.gap <= self.near || is_soft(row))
            .flat_map(bodies)
            .for_each(|id| is_free[id] = false);
        hold_together(rows, &mut is_free);
        if !is_free.contains(&true) {
            return Ok(());
        }
        let mut later = World::new(self.world.gravity.into());
        (later.drag, later.bodies) = (self.world.drag, self.world.bodies.clone());
        (0..self.substeps).for_each(|_| later.step(self.dt, &mut Rows::default()));
        for surface in self.surfaces {
            let Carrier::Body { id, .. } = surface.carrier else { continue };
            if is_free[id as usize] && self.touches(surface, &later)? {
                is_free[id as usize] = false;
            }
        }
        hold_together(rows, &mut is_free);
        let kept: Vec<usize> = (0..rows.len()).filter(|index| bodies(&rows[*index]).all(|id| !is_free[id])).collect();
        contacts.pick(&kept);
        Ok(())
    }

    /// May a body touch something on its way to where it is later, if nothing else holds it?
    fn touches(&self, surface: &Surface, later: &World) -> Result<bool, QueryError> {
        let (start, end) = (surface.points(self.world), surface.points(later));
        let path = MeshPath { start: MeshView { points: &start, faces: &surface.faces }, end: &end };
        let Some(swept) = Aabb::from_points(start.iter().chain(&end).copied()) else { return Ok(false) };
        // What is left open may touch.
        let touches = |field: &Field, options: FirstTouchOptions| {
            let options = FirstTouchOptions { threads: self.threads, budget: BUDGET, ..options };
            let found = field.first_touches(&path, &options)?;
            Ok(!found.touches.is_empty() || found.not_finite_count > 0)
        };
        let bend = self.bend(surface);
        for field in self.obstacles {
            let thickness = self.thickness + bend;
            if swept.intersection(&field.bounds(thickness)).is_some()
                && touches(field, FirstTouchOptions { thickness, ..FirstTouchOptions::default() })?
            {
                return Ok(true);
            }
        }
        let own = body_of(surface);
        for (other, id) in self.surfaces.iter().filter_map(|other| Some((other, body_of(other)?))) {
            let thickness = self.thickness + bend + self.bend(other);
            let boxes = other.bounds(self.world).zip(other.bounds(later));
            let is_near =
                boxes.is_some_and(|(now, then)| swept.intersection(&now.union(&then).inflate(thickness)).is_some());
            let [pose, end_pose] = [self.world, later].map(|world| world.bodies[id as usize].pose());
            let options = FirstTouchOptions { thickness, pose, end_pose, ..FirstTouchOptions::default() };
            if Some(id) != own && is_near && touches(&self.fields[id as usize], options)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Most that points of a body get off a straight line: t²/8 of their acceleration, by gravity, drag, and ω² and dω/dt of its turn.
    fn bend(&self, surface: &Surface) -> f64 {
        let Some(body) = body_of(surface).map(|id| &self.world.bodies[id as usize]) else { return 0.0 };
        let time = self.dt * f64::from(self.substeps);
        let turn = 3.0 * body.angular_velocity().norm_squared() * surface.radius();
        let straight = self.world.gravity.norm() + self.world.drag * body.velocity.norm();
        0.125 * time * time * (straight + turn)
    }
}

/// Bodies that a row joins to one that is not free are not free.
fn hold_together(rows: &[Row<f64>], is_free: &mut [bool]) {
    let mut is_changed = true;
    while is_changed {
        is_changed = false;
        for row in rows {
            if bodies(row).any(|id| is_free[id]) && bodies(row).any(|id| !is_free[id]) {
                bodies(row).for_each(|id| is_free[id] = false);
                is_changed = true;
            }
        }
    }
}

/// The bodies of a row.
fn bodies(row: &Row<f64>) -> impl Iterator<Item = usize> {
    [row.element, row.field].into_iter().filter_map(|side| match side {
        RowSide::Body { body, .. } => Some(body as usize),
        _ => None,
    })
}

/// Is a side of a row not rigid?
fn is_soft(row: &Row<f64>) -> bool {
    [row.element, row.field].iter().any(|side| !matches!(side, RowSide::Body { .. } | RowSide::Fixed))
}
