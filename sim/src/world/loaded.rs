//! How does a sheet hang on a needle without tearing? Edges that carry much are relaxed more often (Southwell 1940), with all contacts,
//! at both ends of a step.
//!
//! A pass leaves an edge that carries the force f stretched by about f · dt² · (w_a + w_b), with w the inverse masses: the last constraint
//! at its end moved it by so much. Under a thousand points on a needle that is more than its length. Those edges are few, and two more
//! rounds over them cost little. Rounds at both ends keep the pass symmetric, as docs/simulation.md needs it.

use super::{Stretch, World};
use crate::row::Rows;

/// An edge is loaded if one pass would leave it stretched by more than this share of its length.
const LOADED: f64 = 0.1;

/// A loaded edge remains one down to this share: edges that come and go shake a sheet at rest.
const STILL_LOADED: f64 = 0.03;

/// Masses that differ by more than this get no such rounds: a push of a light corner, again and again, throws it over its sheet.
const MAX_RATIO: f64 = 2.0;

impl World {
    /// Goes over all rows and the edges that were loaded in the step before. Depth is not undone: that is for whole passes.
    pub(super) fn relax_loaded(&mut self, rows: &mut Rows, soft: f64, dt: f64) {
        if self.loaded.is_empty() {
            return;
        }
        let loaded = std::mem::take(&mut self.loaded);
        let count = rows.touches.len();
        for _ in 0..self.loaded_rounds {
            loaded.iter().for_each(|index| self.stretch(*index as usize, soft));
            (0..count).chain((0..count).rev()).for_each(|index| self.touch(rows, index, dt, 0.0));
            loaded.iter().rev().for_each(|index| self.stretch(*index as usize, soft));
        }
        self.loaded = loaded;
    }

    /// Notes which edges carried much in this step: a multiplier is force · dt². None where masses differ.
    pub(super) fn note_loaded(&mut self) {
        let weights = |stretch: &Stretch| stretch.ends.map(|end| self.inv_mass[end as usize]);
        let is_uneven = |[a, b]: [f64; 2]| a.min(b) > 0.0 && a.max(b) > MAX_RATIO * a.min(b);
        if self.loaded_rounds == 0 || self.stretches.iter().map(weights).any(is_uneven) {
            self.loaded.clear();
            return;
        }
        let is_loaded = |(index, (stretch, multiplier)): (u32, (&Stretch, &f64))| {
            let share = if self.loaded.binary_search(&index).is_ok() { STILL_LOADED } else { LOADED };
            let weight: f64 = weights(stretch).iter().sum();
            (multiplier.abs() * weight > share * stretch.rest).then_some(index)
        };
        let edges = (0..).zip(self.stretches.iter().zip(&self.stretch_multipliers));
        let loaded = edges.filter_map(is_loaded).collect();
        self.loaded = loaded;
    }
}
