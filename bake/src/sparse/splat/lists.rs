//! Which triangles matter to which brick: triangles are written into the lists of the bricks that they come near.
//!
//! Bricks are worked on in blocks of 4³ slots, contiguous along the Hilbert curve. The tree gives the triangles around a
//! block; each is tested against 16 slots at a time, by its box, its plane and its distance from the slot's middle. So
//! lists are never in memory for more than one block a thread.

use std::ops::ControlFlow;

use sdf_core::grid::Lattice;
use sdf_core::nalgebra::Vector3;

use super::frame::{PlaneFrame, PlaneFrames, TriangleFrame, planar_distance_sq};
use super::packed::WIDTH;
use crate::MeshDistance;
use crate::rounding::BRICK_DISTANCE_ROUNDING;
use crate::simd::{LANES, Lanes, VectorX8, bits_of_bytes, max, min};

/// Slots along a side of a block.
pub(super) const BLOCK: u32 = 4;
const BLOCK_SLOTS: usize = (BLOCK * BLOCK * BLOCK) as usize;

/// Nodes along a side of a slot, and distance of its middle from its corners, rounded up.
const SLOT_SIDE: f64 = 8.0;
const SLOT_RADIUS: f32 = 6.9283;

/// Added to the reach of each slot, in voxels, beside what rounding asks.
const MARGIN: f32 = 0.01;

/// Triangles around one block of slots, and their lists.
pub(super) struct SlotLists {
    pub triangles: Vec<TriangleFrame>,
    lists: Vec<Vec<u32>>,
    base: [u32; 3],
    /// Slots of the triangles in the tree.
    near: Vec<u32>,
    /// For each triangle the slots of the block that its box is near.
    rows: Vec<u64>,
}

/// A slot that is to be measured.
#[derive(Clone, Copy)]
pub(super) struct WantedSlot {
    pub slot: [u32; 3],
    /// Distance from the cells of the slot up to which triangles matter, in voxels.
    pub reach: f32,
}

impl SlotLists {
    pub fn new() -> Self {
        Self { triangles: vec![], lists: vec![vec![]; BLOCK_SLOTS], base: [0; 3], near: vec![], rows: vec![] }
    }

    /// Fills the lists of some slots of one block. Returns false, and fills nothing, if more than `max_triangles` are
    /// near them.
    pub fn fill(
        &mut self,
        mesh: &MeshDistance,
        lattice: &Lattice,
        frames: &PlaneFrames,
        wanted: &[WantedSlot],
        max_triangles: usize,
    ) -> bool {
        let (spacing, inv_spacing) = (lattice.spacing(), 1.0 / lattice.spacing());
        self.base = wanted[0].slot.map(|n| n / BLOCK * BLOCK);
        let mut reaches = [f32::NEG_INFINITY; BLOCK_SLOTS];
        let mut max_reach = 0.0_f32;
        let (mut lower, mut upper) = ([u32::MAX; 3], [0; 3]);
        for WantedSlot { slot, reach } in wanted {
            reaches[self.index(*slot)] = *reach;
            max_reach = max_reach.max(*reach);
            lower = std::array::from_fn(|axis| lower[axis].min(slot[axis]));
            upper = std::array::from_fn(|axis| upper[axis].max(slot[axis] + 1));
        }
        let corner = |slot: [u32; 3]| {
            Vector3::from_fn(|axis, _| lattice.origin()[axis] + f64::from(slot[axis]) * SLOT_SIDE * spacing)
        };
        let around = Vector3::repeat(f64::from(max_reach + MARGIN) * spacing);
        let tree = mesh.tree();
        self.near.clear();
        let mut is_too_many = false;
        tree.visit_overlapping(corner(lower) - around, corner(upper) + around, |slot| {
            is_too_many = self.near.len() == max_triangles;
            if is_too_many {
                return ControlFlow::Break(());
            }
            self.near.push(slot as u32);
            ControlFlow::Continue(())
        });
        if is_too_many {
            return false;
        }
        self.lists.iter_mut().for_each(Vec::clear);
        let base = corner(self.base);
        tree.arch.dispatch(Splat { lists: self, frames, reaches: &reaches, max_reach, base, inv_spacing });
        true
    }

    /// Middle of a slot's nodes, from the middle of the block.
    pub fn offset(&self, slot: [u32; 3]) -> [f32; 3] {
        let half_block = 0.5 * SLOT_SIDE as f32 * BLOCK as f32;
        [0, 1, 2].map(|axis: usize| SLOT_SIDE as f32 * (slot[axis] - self.base[axis]) as f32 + 3.5 - half_block)
    }

    /// Indices of the triangles near a slot of the block.
    pub fn list(&self, slot: [u32; 3]) -> &[u32] {
        &self.lists[self.index(slot)]
    }

    fn index(&self, slot: [u32; 3]) -> usize {
        let [x, y, z] = [0, 1, 2].map(|axis: usize| slot[axis] - self.base[axis]);
        ((z * BLOCK + y) * BLOCK + x) as usize
    }
}

/// Writes all triangles into lists.
struct Splat<'a> {
    lists: &'a mut SlotLists,
    frames: &'a PlaneFrames<'a>,
    reaches: &'a [f32; BLOCK_SLOTS],
    max_reach: f32,
    /// First node of the block.
    base: Vector3<f64>,
    inv_spacing: f64,
}

impl pulp::NullaryFnOnce for Splat<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { lists, frames, reaches, max_reach, base, inv_spacing } = self;
        let half_side = 0.5 * SLOT_SIDE as f32;
        let middle = base + Vector3::repeat(0.5 * f64::from(BLOCK) * SLOT_SIDE / inv_spacing);
        let SlotLists { triangles, lists, near, rows, .. } = lists;
        triangles.clear();
        triangles.reserve(near.len());
        let middles = [0, 1, 2].map(|axis: usize| [middle[axis]; LANES]);
        rows.clear();
        for slots in near.chunks(LANES) {
            let all = std::array::from_fn(|lane| slots[lane.min(slots.len() - 1)]);
            let corners = frames.corners(&all);
            let seen = frames.eight(&all, &corners, &middles);
            let reaches = seen.map(|triangle| f64::from(max_reach + margin(&triangle)));
            let near = slots_near_boxes(&corners, base.into(), inv_spacing, &reaches);
            triangles.extend_from_slice(&seen[..slots.len()]);
            rows.extend_from_slice(&near[..slots.len()]);
        }
        for (index, (triangle, rows)) in (0..).zip(triangles.iter().zip(rows.iter())) {
            let (TriangleFrame { middle: [u, v, w], plane, .. }, margin) = (*triangle, margin(triangle));
            let PlaneFrame { axes: [u_axis, v_axis, n_axis], shape, .. } = plane;
            let plane_reach = half_side * (n_axis[0].abs() + n_axis[1].abs() + n_axis[2].abs()) + margin;
            for layer in 0..BLOCK as usize {
                let in_layer = rows >> (WIDTH * layer) & 0xffff;
                if in_layer == 0 {
                    continue;
                }
                let z = half_side * (2 * layer as i32 - 3) as f32;
                let mut bits = [0_u8; WIDTH];
                for lane in 0..WIDTH {
                    let x = half_side * (2 * (lane % 4) as i32 - 3) as f32;
                    let y = half_side * (2 * (lane / 4) as i32 - 3) as f32;
                    let along =
                        |axis: [f32; 3], from: f32| x.mul_add(axis[0], y.mul_add(axis[1], z.mul_add(axis[2], from)));
                    let (u, v, w) = (along(u_axis, u), along(v_axis, v), along(n_axis, w));
                    let distance_sq = w.mul_add(w, planar_distance_sq(u, v, &shape));
                    let reach = reaches[WIDTH * layer + lane];
                    let ball = reach + SLOT_RADIUS + margin;
                    let is_near = (w.abs() <= reach + plane_reach) & (distance_sq <= ball * ball) & (reach >= 0.0);
                    bits[lane] = u8::from(is_near);
                }
                let mut mask = bits_of_bytes(&bits) & in_layer;
                while mask != 0 {
                    lists[WIDTH * layer + mask.trailing_zeros() as usize].push(index);
                    mask &= mask - 1;
                }
            }
        }
    }
}

/// Added to the reach of each slot for one triangle, in voxels.
#[inline(always)]
fn margin(triangle: &TriangleFrame) -> f32 {
    let [u, v, w] = triangle.middle;
    let rounding = BRICK_DISTANCE_ROUNDING * (u.abs() + v.abs() + w.abs() + triangle.plane.shape.b + 32.0);
    MARGIN + 2.0 * rounding
}

/// Bits of the slots of a block that the boxes of eight triangles come within `reaches` of.
#[inline(always)]
fn slots_near_boxes(
    corners: &[VectorX8<f64>; 3],
    base: [f64; 3],
    inv_spacing: f64,
    reaches: &Lanes<f64>,
) -> Lanes<u64> {
    // A bit for each slot of a row, then for each row of a layer, and for each layer.
    let mut bits = [[0_u64; LANES]; 3];
    for axis in 0..3 {
        for lane in 0..LANES {
            let [a, b, c] = [corners[0][axis][lane], corners[1][axis][lane], corners[2][axis][lane]];
            let lower = (min(min(a, b), c) - base[axis]) * inv_spacing - reaches[lane];
            let upper = (max(max(a, b), c) - base[axis]) * inv_spacing + reaches[lane];
            let mut near = 0;
            for slot in 0..BLOCK as usize {
                let start = slot as f64 * SLOT_SIDE;
                near |= u64::from((lower <= start + SLOT_SIDE) & (upper >= start)) << (slot << (2 * axis));
            }
            bits[axis][lane] = near;
        }
    }
    let mut slots = [0; LANES];
    for lane in 0..LANES {
        slots[lane] = bits[0][lane] * bits[1][lane] * bits[2][lane];
    }
    slots
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_is_near_a_box_up_to_the_reach_and_not_beyond() {
        let (base, spacing, reach) = (Vector3::new(3.0, -1.0, 2.0), 0.25, 5.0);
        for axis in 0..3 {
            for slot in 0..BLOCK as usize {
                for (is_before, gap, is_near) in
                    [(true, 4.9, true), (true, 5.1, false), (false, 4.9, true), (false, 5.1, false), (true, 1.1, true)]
                {
                    let mut at = Vector3::repeat(4.0);
                    let start = SLOT_SIDE * slot as f64;
                    at[axis] = if is_before { start - gap } else { start + SLOT_SIDE + gap };
                    let corner = base + at * spacing;
                    let corners = [[[corner.x; LANES], [corner.y; LANES], [corner.z; LANES]]; 3];
                    let [bits, ..] = slots_near_boxes(&corners, base.into(), 1.0 / spacing, &[reach; LANES]);
                    let index = slot << (2 * axis);
                    assert_eq!(bits >> index & 1 == 1, is_near, "slot {slot} along {axis}, {gap} away");
                }
            }
        }
    }
}
