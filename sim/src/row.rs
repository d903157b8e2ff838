//! The rows that a world steps with: core's [`Row`]s, the one bridge between contacts and any solver, and what a pass keeps beside each.

use sdf_core::contact::Row;

use crate::world::Touch;

/// Rows of a frame, and what its steps keep beside them.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    rows: Vec<Row<f64>>,
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
        *self =
            Self { rows: std::mem::take(&mut self.rows), terms: std::mem::take(&mut self.terms), ..Self::default() };
        self.rows.clear();
        self.terms.clear();
    }

    /// Adds a row. Indices of particles, bodies and tetrahedra are those of the world that steps with it, and its points are where the
    /// world has them now.
    pub fn push(&mut self, row: Row<f64>) {
        self.rows.push(row);
    }

    /// The rows, in the order in which a pass goes there.
    pub fn as_slice(&self) -> &[Row<f64>] {
        &self.rows
    }

    /// Puts the rows in another order: the first is the one with the index `order[0]`.
    pub(crate) fn reorder(&mut self, order: &[usize]) {
        self.rows = order.iter().map(|index| self.rows[*index]).collect();
    }
}
