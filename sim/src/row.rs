//! The bridge from contacts to a solver: a row says how far apart two sides are along a normal, and whom a push moves.

use crate::V3;

/// One side of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Side {
    /// Nothing that a push moves; it goes with this velocity.
    Fixed(V3),
    /// A weighted mean of particles: `count` entries of [`Rows::terms`] from `first` on.
    Particles {
        /// Index of the first term.
        first: u32,
        /// How many terms.
        count: u32,
    },
    /// A point of a rigid body.
    Body {
        /// Index of the body.
        id: u32,
        /// The point in the body's frame.
        arm: V3,
    },
}

/// A contact as a constraint: gap = n · (a − b) + offset ≥ 0, with Coulomb friction across n.
///
/// A fixed side stands at the origin when the row is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The side that n pushes.
    pub a: Side,
    /// The side that −n pushes.
    pub b: Side,
    /// Unit vector out of b.
    pub normal: V3,
    /// The distance found, less n · (a − b) at that time, and less the thickness.
    pub offset: f64,
    /// Coulomb's coefficient.
    pub friction: f64,
}

/// Rows, and the particles that they name.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// In the order in which a pass goes there.
    pub rows: Vec<Row>,
    /// Particles and their weights.
    pub terms: Vec<(u32, f64)>,
    /// Time since the rows were made.
    pub age: f64,
    /// For each row the push along n and across it in this step: mass · length.
    pub(crate) pushes: Vec<(f64, V3)>,
}

impl Rows {
    /// Forgets all rows.
    pub fn clear(&mut self) {
        self.rows.clear();
        self.terms.clear();
        self.age = 0.0;
    }

    /// A side of particles with weights.
    pub fn particles(&mut self, terms: impl IntoIterator<Item = (u32, f64)>) -> Side {
        let first = self.terms.len();
        self.terms.extend(terms);
        Side::Particles { first: first as u32, count: (self.terms.len() - first) as u32 }
    }

    /// The terms of a side of particles.
    pub fn terms_of(&self, first: u32, count: u32) -> &[(u32, f64)] {
        &self.terms[first as usize..(first + count) as usize]
    }
}
