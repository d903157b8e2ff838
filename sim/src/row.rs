//! The rows that a world steps with: core's [`Row`]s, the one bridge between contacts and any solver, and what a pass keeps beside each.

use sdf_core::contact::{Row, RowSide};

use crate::touch::Touch;

/// The shape of two rigid sides near a contact, which tells where they touch after they have rolled.
///
/// A body that rolls touches at another point: on a surface with the radius of curvature ρ at that which is ρ along the normal beyond a
/// center that turns with it. A point that stays in the body lets a ball pivot on it, and sink by ρ (1 − cos θ).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rounding {
    /// ρ of the field's surface; 0 of what does not roll: an edge, a plane.
    pub radius: f64,
    /// Does the element touch with the inside of a face? The normal then turns with the element.
    pub is_flat: bool,
}

impl Rounding {
    /// Shape of the two sides of a row. The curvature costs four evaluations of the field. It is computed only if one side can roll on the
    /// other: if the field is a body's, or if the element is a body's flat face.
    pub(crate) fn of(row: &Row<f64>, is_flat: bool, radius: impl FnOnce() -> f64) -> Self {
        let is_body = |side: &RowSide<f64>| matches!(side, RowSide::Body { .. });
        let is_asked = is_body(&row.field) || is_flat && is_body(&row.element);
        Self { radius: if is_asked { radius() } else { 0.0 }, is_flat }
    }
}

/// Rows of a frame, and what its steps keep beside them.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    rows: Vec<Row<f64>>,
    roundings: Vec<Rounding>,
    /// The rows as passes take them, made by the first step.
    pub(crate) touches: Vec<Touch>,
    /// Particles that touches name, and their weights.
    pub(crate) terms: Vec<(u32, f64)>,
    /// Time since the rows were made.
    pub(crate) age: f64,
}

impl Rows {
    /// Forgets all rows.
    pub fn clear(&mut self) {
        let Self { rows, roundings, terms, .. } = std::mem::take(self);
        *self = Self { rows, roundings, terms, ..Self::default() };
        self.rows.clear();
        self.roundings.clear();
        self.terms.clear();
    }

    /// Adds a row. Indices of particles, bodies and tetrahedra are those of the world that steps with it, and its points are where the
    /// world has them now.
    pub fn push(&mut self, row: Row<f64>) {
        self.push_round(row, Rounding::default());
    }

    /// Adds a row of sides that roll on each other.
    pub fn push_round(&mut self, row: Row<f64>, rounding: Rounding) {
        self.rows.push(row);
        self.roundings.push(rounding);
    }

    pub(crate) fn rounding(&self, index: usize) -> Rounding {
        self.roundings[index]
    }

    /// The rows, in the order in which a pass goes there.
    pub fn as_slice(&self) -> &[Row<f64>] {
        &self.rows
    }

    /// Keeps the rows with these indices, in this order.
    pub(crate) fn pick(&mut self, indices: &[usize]) {
        self.rows = indices.iter().map(|index| self.rows[*index]).collect();
        self.roundings = indices.iter().map(|index| self.roundings[*index]).collect();
    }
}
