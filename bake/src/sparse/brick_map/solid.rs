//! Sides of a marked map of a closed mesh whose faces have known sides.
//!
//! Slots without nodes near the surface are on one side with their neighbours, so one search tells the side of each
//! connected part of them, and of the nodes beside them.

use std::ops::Range;

use sdf_core::grid::sparse::BRICK;

use super::marked::Marked;
use super::{BrickMap, middle};
use crate::sparse::coarse_map::with_side;
use crate::sparse::slot_bits::SlotBits;
use crate::union_find::UnionFind;

/// Distance of a slot's middle from its corners, in voxels, rounded up.
const HALF_DIAGONAL: f32 = 6.9283;

/// Slots around the layers of nodes that are computed at a time.
const WINDOW_SLOTS: usize = 1 << 23;

impl BrickMap {
    /// Fills in the sides and magnitudes.
    pub(super) fn with_sides_of_solid(mut self, mut marked: Marked) -> Self {
        let nodes = self.solid_nodes(&mut marked, WINDOW_SLOTS);
        let mesh = marked.mesh;
        self.near = marked.into_near();
        self.is_solid = true;
        self.set_solid_nodes(mesh, nodes);
        self
    }

    /// Magnitudes of nodes before they are lowered, with the signs of their sides; some layers at a time, of so many slots.
    pub(super) fn solid_nodes(&self, marked: &mut Marked, window_slots: usize) -> Vec<f32> {
        let slots_inside = self.far_slots_inside(marked);
        let [row, rows, layers] = self.counts().map(|n| n as usize + 1);
        let at_a_time = (window_slots / (row * rows)).clamp(1, layers);
        let mut values = Vec::with_capacity(row * rows * layers);
        for first in (0..layers).step_by(at_a_time) {
            let window = first..layers.min(first + at_a_time);
            marked.look_at(self, window.clone());
            let lines = sdf_parallel::map(window.len() * rows, |line| {
                let mut guess = 0;
                let node = |x| [x, line % rows, first + line / rows].map(|n: usize| n as u32);
                let value = |x| {
                    let (magnitude, is_inside) = self.solid_node(marked, &slots_inside, node(x), &mut guess);
                    with_side(magnitude, is_inside)
                };
                (0..row).map(value).collect::<Vec<_>>()
            });
            lines.into_iter().for_each(|line| values.extend(line));
        }
        values
    }

    /// Sides of the slots that are not near.
    ///
    /// Rows are cut into runs of such slots; runs that touch are joined, and one search tells the side of all that are.
    fn far_slots_inside(&self, marked: &Marked) -> SlotBits {
        let [row, rows, layers] = self.counts().map(|n| n as usize);
        let mut runs = Runs::default();
        for line in 0..rows * layers {
            runs.add_line(row, |x| !marked.is_near(line * row + x));
            if line % rows > 0 {
                runs.join_lines(line - 1, line);
            }
            if line >= rows {
                runs.join_lines(line - rows, line);
            }
        }
        let inside = SlotBits::new(row * rows * layers);
        let mut sides = vec![false; runs.runs.len()];
        for line in 0..rows * layers {
            for run in runs.of_line(line) {
                let root = runs.sets.root(run as u32) as usize;
                let slots = runs.runs[run].start as usize..runs.runs[run].end as usize;
                if root == run {
                    // The first of all that are joined.
                    let at = middle(marked.lattice, self.slot(line * row + slots.start).map(|n| n as usize));
                    sides[run] = marked.mesh.signed_nearest(at, 0).is_inside;
                }
                if sides[root] {
                    inside.insert_range(line * row + slots.start..line * row + slots.end);
                }
            }
        }
        inside
    }

    /// Magnitude and side of a node of the coarse grid. `guess` is a triangle, and becomes one near this node.
    fn solid_node(&self, marked: &Marked, slots_inside: &SlotBits, node: [u32; 3], guess: &mut usize) -> (f32, bool) {
        let mesh = marked.mesh;
        if mesh.is_cancelled() {
            return (0.0, false);
        }
        let at = marked.node(self, node);
        let is_far = |index: &usize| !marked.is_near(*index);
        let own = (0..3).all(|axis| node[axis] < self.counts()[axis]).then(|| self.index(node)).filter(is_far);
        // The segment from the middle of such a slot to the node is clear.
        let is_clear = |index: &usize| is_far(index) && marked.gap(*index) + 0.5 * BRICK as f32 > HALF_DIAGONAL;
        let side = own.or_else(|| self.slots_around(node).find(is_clear)).map(|index| slots_inside.contains(index));
        if at.is_beside_deep && side == Some(false) {
            return (marked.outside_magnitude(self, &at, 0.0), false);
        }
        let upper = marked.nearest_around(self.slots_around(node), at.position, guess);
        if upper <= self.exact_within() - self.spacing {
            // All slots around have bricks, whose sides do not ask for that of the node, and its magnitude is W on
            // either side: a slot without a brick has its last node beyond K = W + √3/2 h, and this one is within
            // √3 h of it.
            return (self.inside_magnitude(0.0), false);
        }
        let (tolerance, distance, is_inside);
        if let Some(side) = side {
            is_inside = side;
            tolerance = if side { marked.tolerance_inside(self, &at) } else { marked.tolerance_outside(self, upper) };
            (distance, *guess) = mesh.distance_within(at.position, *guess, tolerance);
        } else {
            let nearest = mesh.signed_nearest(at.position, *guess);
            (tolerance, distance, is_inside, *guess) = (0.0, nearest.distance, nearest.is_inside, nearest.guess);
        }
        let outside = || marked.outside_magnitude(self, &at, distance - tolerance);
        (if is_inside { self.inside_magnitude(distance as f32) } else { outside() }, is_inside)
    }
}

/// Runs of slots along rows, joined to sets that are named by their first run.
#[derive(Default)]
struct Runs {
    runs: Vec<Range<u32>>,
    sets: UnionFind,
    /// For each line the number of runs before its end.
    ends: Vec<usize>,
}

impl Runs {
    /// Adds the runs of the next line.
    fn add_line(&mut self, row: usize, is_in_run: impl Fn(usize) -> bool) {
        let mut start = None;
        for x in 0..=row {
            match (start, x < row && is_in_run(x)) {
                (None, true) => start = Some(x),
                (Some(first), false) => {
                    self.sets.push();
                    self.runs.push(first as u32..x as u32);
                    start = None;
                }
                _ => (),
            }
        }
        self.ends.push(self.runs.len());
    }

    fn of_line(&self, line: usize) -> Range<usize> {
        line.checked_sub(1).map_or(0, |before| self.ends[before])..self.ends[line]
    }

    /// Joins the runs of two lines that have a place along the line in common.
    fn join_lines(&mut self, before: usize, after: usize) {
        let (mut other, others) = (self.of_line(before).start, self.of_line(before).end);
        for run in self.of_line(after) {
            while other < others && self.runs[other].end <= self.runs[run].start {
                other += 1;
            }
            let mut touching = other;
            while touching < others && self.runs[touching].start < self.runs[run].end {
                self.sets.join(touching as u32, run as u32);
                touching += 1;
            }
        }
    }
}
