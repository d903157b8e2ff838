//! Which slots does the surface cross, and which have nodes near it? Each triangle marks its slots, 4 × 4 at a time, by
//! its box, its plane and its distance from a slot's middle.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::BRICK;
use sdf_core::nalgebra::Vector3;

use crate::bvh::Bvh;
use crate::sparse::splat::frame::{PlaneFrame, TriangleFrame, planar_distance_sq};
use crate::triangle::nearest_on_triangle;

/// Nodes along a side of a slot.
const SIDE: f64 = BRICK as f64;

/// Slots along a side of a tile, and in it.
const TILE: usize = 4;
const TILE_SLOTS: usize = TILE * TILE;

/// Half side of the box of a slot's nodes, and half diagonal, rounded up.
const HALF_NODES: f32 = 3.5;
const NODES_RADIUS: f32 = 6.0622;

/// Half side of a slot's cells, and distance of their farthest corner from the middle of the nodes, rounded up.
const HALF_CELLS: f32 = 4.0;
const CELLS_RADIUS: f32 = 7.7943;

/// Added to all lengths, in voxels: more than rounding takes.
const MARGIN: f32 = 0.01;

/// Triangles that one thread marks at a time.
const CHUNK: usize = 4096;

/// Marks of all slots, x fastest.
pub(super) struct SurfaceSlots {
    /// May a triangle meet a cell of the slot?
    pub crossed: Vec<AtomicBool>,
    /// May a node of the slot be within the reach of a triangle?
    pub near: Vec<AtomicBool>,
    /// For slots that are near: a triangle near the middle, below the bits of its distance in f32: where to begin a search.
    nearest: Vec<AtomicU64>,
}

impl SurfaceSlots {
    /// `reach` is in voxels, and no triangle is larger than fits f32 at the scale of a voxel.
    pub fn new(tree: &Bvh, frames: &[PlaneFrame], lattice: &Lattice, counts: [u32; 3], reach: f64) -> Self {
        let count = counts.iter().map(|n| *n as usize).product();
        let all = |_| AtomicBool::new(false);
        let slots = Self {
            crossed: (0..count).map(all).collect(),
            near: (0..count).map(all).collect(),
            nearest: (0..count).map(|_| AtomicU64::new(u64::MAX)).collect(),
        };
        sdf_parallel::for_each_index(tree.corners.len().div_ceil(CHUNK), &|chunk| {
            let range = chunk * CHUNK..tree.corners.len().min((chunk + 1) * CHUNK);
            tree.arch.dispatch(Mark { slots: &slots, tree, frames, lattice, counts, reach, range });
        });
        slots
    }

    /// Distance of a point from one of the triangles near some slots, or from `guess`, which becomes that triangle.
    pub fn nearest_around(
        &self,
        tree: &Bvh,
        slots: impl Iterator<Item = usize>,
        point: Vector3<f64>,
        guess: &mut usize,
    ) -> f64 {
        let distance_sq = |triangle: usize| nearest_on_triangle(point, tree.corners[triangle]).distance_sq;
        let mut least = distance_sq(*guess);
        let mut last = u32::MAX;
        for slot in slots {
            let triangle = self.nearest[slot].load(Ordering::Relaxed) as u32;
            if triangle != last && triangle != u32::MAX {
                let now = distance_sq(triangle as usize);
                (least, *guess) = if now < least { (now, triangle as usize) } else { (least, *guess) };
            }
            last = triangle;
        }
        least.sqrt()
    }
}

struct Mark<'a> {
    slots: &'a SurfaceSlots,
    tree: &'a Bvh,
    frames: &'a [PlaneFrame],
    lattice: &'a Lattice,
    counts: [u32; 3],
    reach: f64,
    range: Range<usize>,
}

impl pulp::NullaryFnOnce for Mark<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for triangle in self.range.clone() {
            self.mark(triangle);
        }
    }
}

/// Slots of one triangle along one axis: with nodes in its widened box, and with cells in its box.
#[derive(Clone, Copy)]
struct Along {
    near: [usize; 2],
    crossed: [usize; 2],
}

impl Mark<'_> {
    #[inline(always)]
    fn along(&self, axis: usize, [a, b, c]: &[Vector3<f64>; 3]) -> Along {
        let inv_spacing = 1.0 / self.lattice.spacing();
        let position = |point: &Vector3<f64>| (point[axis] - self.lattice.origin()[axis]) * inv_spacing;
        let [a, b, c] = [position(a), position(b), position(c)];
        let (lower, upper) = (a.min(b).min(c) - f64::from(MARGIN), a.max(b).max(c) + f64::from(MARGIN));
        let count = self.counts[axis] as usize;
        // The first slot that ends after a position, and the first that begins after one.
        let ends = |position: f64, side: f64| ((position - side) / SIDE).ceil().max(0.0) as usize;
        let begins = |position: f64| ((position / SIDE).floor() + 1.0).max(0.0) as usize;
        Along {
            near: [ends(lower - self.reach, SIDE - 1.0), begins(upper + self.reach).min(count)],
            crossed: [ends(lower, SIDE), begins(upper).min(count)],
        }
    }

    #[inline(always)]
    fn mark(&self, triangle: usize) {
        let Self { slots, tree, frames, lattice, counts, .. } = self;
        let corners = &tree.corners[triangle];
        let ranges = [self.along(0, corners), self.along(1, corners), self.along(2, corners)];
        if ranges.iter().any(|range| range.near[0] >= range.near[1]) {
            return;
        }
        let first = ranges.map(|range| range.near[0]);
        let spacing = lattice.spacing();
        let middle = [0, 1, 2]
            .map(|axis: usize| lattice.origin()[axis] + spacing * (SIDE * first[axis] as f64 + f64::from(HALF_NODES)));
        let frame = TriangleFrame::new(triangle as u32, &frames[triangle], corners, middle, 1.0 / spacing);
        let PlaneFrame { axes: [u_axis, v_axis, n_axis], shape, .. } = frame.plane;
        let size = frame.middle.iter().map(|x| x.abs()).sum::<f32>() + shape.b;
        let margin = MARGIN + 1e-5 * size;
        let reach = self.reach as f32 + margin;
        let support = n_axis[0].abs() + n_axis[1].abs() + n_axis[2].abs();
        let (plane_reach, ball) = (reach + HALF_NODES * support, reach + NODES_RADIUS);
        let (plane_crossed, ball_crossed) = (margin + HALF_CELLS * support, margin + CELLS_RADIUS);
        // From the middle of the nodes to that of the cells.
        let to_cells = 0.5 * (n_axis[0] + n_axis[1] + n_axis[2]);
        let [columns, rows, layers] = ranges;
        for layer in layers.near[0]..layers.near[1] {
            let z = SIDE as f32 * (layer - first[2]) as f32;
            for row in (rows.near[0]..rows.near[1]).step_by(TILE) {
                for column in (columns.near[0]..columns.near[1]).step_by(TILE) {
                    let (x0, y0) = (SIDE as f32 * (column - first[0]) as f32, SIDE as f32 * (row - first[1]) as f32);
                    let (mut is_near, mut is_crossed) = ([0_u8; TILE_SLOTS], [0_u8; TILE_SLOTS]);
                    let mut distances_sq = [0.0_f32; TILE_SLOTS];
                    for lane in 0..TILE_SLOTS {
                        let (x, y) = (x0 + SIDE as f32 * (lane % TILE) as f32, y0 + SIDE as f32 * (lane / TILE) as f32);
                        let along = |axis: usize, of: [f32; 3]| {
                            x.mul_add(of[0], y.mul_add(of[1], z.mul_add(of[2], frame.middle[axis])))
                        };
                        let (u, v, w) = (along(0, u_axis), along(1, v_axis), along(2, n_axis));
                        let distance_sq = w.mul_add(w, planar_distance_sq(u, v, &shape));
                        distances_sq[lane] = distance_sq;
                        is_near[lane] = u8::from((w.abs() <= plane_reach) & (distance_sq <= ball * ball));
                        let is_in_ball = distance_sq <= ball_crossed * ball_crossed;
                        is_crossed[lane] = u8::from(((w + to_cells).abs() <= plane_crossed) & is_in_ball);
                    }
                    for lane in 0..TILE_SLOTS {
                        let at = [column + lane % TILE, row + lane / TILE, layer];
                        if is_near[lane] == 0 || at[0] >= columns.near[1] || at[1] >= rows.near[1] {
                            continue;
                        }
                        let index = (at[2] * counts[1] as usize + at[1]) * counts[0] as usize + at[0];
                        slots.near[index].store(true, Ordering::Relaxed);
                        let key = u64::from(distances_sq[lane].to_bits()) << 32 | triangle as u64;
                        if key < slots.nearest[index].load(Ordering::Relaxed) {
                            slots.nearest[index].fetch_min(key, Ordering::Relaxed);
                        }
                        let is_in_box =
                            (0..3).all(|axis| (ranges[axis].crossed[0]..ranges[axis].crossed[1]).contains(&at[axis]));
                        if is_crossed[lane] != 0 && is_in_box {
                            slots.crossed[index].store(true, Ordering::Relaxed);
                        }
                    }
                }
            }
        }
    }
}
