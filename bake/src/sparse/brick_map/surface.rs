//! Which slots does the surface cross, and which have nodes near it? Each triangle marks its slots, 4 × 4 at a time, by
//! its box, its plane and its distance from a slot's middle.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::BRICK;
use sdf_core::nalgebra::Vector3;

use crate::MeshDistance;
use crate::bvh::Bvh;
use crate::simd::{LANES, VectorX8};
use crate::sparse::slot_bits::SlotBits;
use crate::sparse::splat::frame::{PlaneFrame, PlaneFrames, TriangleFrame, planar_distance_sq};
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

/// Number of slots above which triangles mark twice, so that nearest triangles are kept for slots near the surface alone.
pub(super) const MAX_LISTED: usize = 1 << 22;

/// Marks of all slots, x fastest.
pub(super) struct SurfaceSlots {
    /// May a triangle meet a cell of the slot?
    pub crossed: SlotBits,
    /// May a node of the slot be within the reach of a triangle?
    pub near: SlotBits,
    nearest: NearestTriangles,
}

/// For slots that are near: a triangle near the middle, below the bits of its distance in f32: where to begin a search.
struct NearestTriangles {
    keys: Vec<AtomicU64>,
    /// [`SlotBits::ranks`] of the slots that are near, where these alone have keys.
    ranks: Option<Vec<u32>>,
}

impl NearestTriangles {
    fn new(count: usize, ranks: Option<Vec<u32>>) -> Self {
        Self { keys: (0..count).map(|_| AtomicU64::new(u64::MAX)).collect(), ranks }
    }

    /// The key of a slot that is near; of others meaningless.
    #[inline(always)]
    fn key(&self, near: &SlotBits, slot: usize) -> Option<&AtomicU64> {
        match &self.ranks {
            None => self.keys.get(slot),
            Some(ranks) => self.keys.get(near.rank(ranks, slot)).filter(|_| near.contains(slot)),
        }
    }
}

impl SurfaceSlots {
    /// `reach` is in voxels, and no triangle is larger than fits f32 at the scale of a voxel. `max_listed`: [`MAX_LISTED`].
    pub fn new(
        mesh: &MeshDistance,
        frames: &PlaneFrames,
        lattice: &Lattice,
        counts: [u32; 3],
        reach: f64,
        max_listed: usize,
    ) -> Self {
        let tree = mesh.tree();
        let count: usize = counts.iter().map(|n| *n as usize).product();
        let is_listed = count <= max_listed;
        let listed = NearestTriangles::new(if is_listed { count } else { 0 }, None);
        let mut slots = Self { crossed: SlotBits::new(count), near: SlotBits::new(count), nearest: listed };
        let mark_all = |slots: &Self, stage: Stage| {
            sdf_parallel::for_each_index(tree.corners.len().div_ceil(CHUNK), &|chunk| {
                if mesh.is_cancelled() {
                    return;
                }
                let range = chunk * CHUNK..tree.corners.len().min((chunk + 1) * CHUNK);
                tree.arch.dispatch(Mark { slots, tree, frames, lattice, counts, reach, range, stage });
            });
        };
        mark_all(&slots, if is_listed { Stage::Both } else { Stage::Marks });
        if !is_listed {
            slots.nearest = NearestTriangles::new(slots.near.count(), Some(slots.near.ranks()));
            mark_all(&slots, Stage::Triangles);
        }
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
            let key = self.nearest.key(&self.near, slot).map_or(u64::MAX, |key| key.load(Ordering::Relaxed));
            let triangle = key as u32;
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
    frames: &'a PlaneFrames<'a>,
    lattice: &'a Lattice,
    counts: [u32; 3],
    reach: f64,
    range: Range<usize>,
    stage: Stage,
}

/// Marks that are written at a time.
#[derive(Clone, Copy, PartialEq)]
enum Stage {
    Both,
    Marks,
    Triangles,
}

impl pulp::NullaryFnOnce for Mark<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for first in self.range.clone().step_by(LANES) {
            self.mark_eight(first..self.range.end.min(first + LANES));
        }
    }
}

/// Slots of one triangle along one axis: with nodes in its widened box, and with cells in its box.
#[derive(Clone, Copy, Default)]
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

    /// Marks the slots of up to eight triangles.
    #[inline(always)]
    fn mark_eight(&self, triangles: Range<usize>) {
        let Self { tree, frames, lattice, .. } = *self;
        let slots = std::array::from_fn(|lane| (triangles.start + lane).min(triangles.end - 1) as u32);
        let mut ranges = [[Along::default(); 3]; LANES];
        let mut middles: VectorX8<f64> = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let corners = &tree.corners[slots[lane] as usize];
            ranges[lane] = [self.along(0, corners), self.along(1, corners), self.along(2, corners)];
            for axis in 0..3 {
                let first = SIDE * ranges[lane][axis].near[0] as f64;
                middles[axis][lane] = lattice.origin()[axis] + lattice.spacing() * (first + f64::from(HALF_NODES));
            }
        }
        let seen = frames.eight(&slots, &frames.corners(&slots), &middles);
        for (lane, triangle) in triangles.enumerate() {
            if ranges[lane].iter().all(|range| range.near[0] < range.near[1]) {
                self.mark(triangle, ranges[lane], &seen[lane]);
            }
        }
    }

    /// `frame` is seen from the middle of the nodes of the first slot in `ranges`.
    #[inline(always)]
    fn mark(&self, triangle: usize, ranges: [Along; 3], frame: &TriangleFrame) {
        let Self { slots, counts, stage, .. } = *self;
        let first = ranges.map(|range| range.near[0]);
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
                        if stage != Stage::Marks {
                            let key = u64::from(distances_sq[lane].to_bits()) << 32 | triangle as u64;
                            let least = slots.nearest.key(&slots.near, index);
                            if let Some(least) = least.filter(|least| key < least.load(Ordering::Relaxed)) {
                                least.fetch_min(key, Ordering::Relaxed);
                            }
                        }
                        if stage == Stage::Triangles {
                            continue;
                        }
                        slots.near.insert(index);
                        let is_in_box =
                            (0..3).all(|axis| (ranges[axis].crossed[0]..ranges[axis].crossed[1]).contains(&at[axis]));
                        if is_crossed[lane] != 0 && is_in_box {
                            slots.crossed.insert(index);
                        }
                    }
                }
            }
        }
    }
}
