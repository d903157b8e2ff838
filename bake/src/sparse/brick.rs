//! Samples of one brick.

use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, Scale};
use sdf_core::nalgebra::Vector3;

use super::brick_map::middle;
use super::splat::{BrickRecord, position_rounding};
use super::{CodesMut, Quantize, SparseBaker};
use crate::SignMethod;
use crate::mesh_distance::MeasuredPoint;
use crate::nearest::{PacketNodes, PacketSearch};
use crate::sign::flood_fill::NodeBlock;

const SIDE: usize = BRICK as usize;

/// Values of a brick's nodes before they are rounded, x fastest.
struct BrickValues {
    /// Exact distances; infinite where only a lower bound was needed.
    distances: [f64; BRICK_SAMPLES],
    /// Values to store, negative inside if pseudo-normals give the sign.
    values: [f64; BRICK_SAMPLES],
}

impl SparseBaker<'_> {
    /// Computes the brick of a slot and writes its codes. `None` if none of its nodes lies within `required` of the surface.
    pub(super) fn brick(
        &self,
        search: &mut PacketSearch,
        slot: [u32; 3],
        required: f64,
        codes: CodesMut,
    ) -> Option<BrickRecord> {
        let BrickValues { distances, values } = self.brick_values(search, slot, required)?;
        let mut rounded = values.map(|value| value as f32);
        if self.mesh.sign_method() == SignMethod::Winding {
            let position = &|step: [usize; 3]| self.node(slot, step);
            let block = NodeBlock { counts: [SIDE; 3], spacing: self.lattice.spacing(), position };
            block.sign(self.mesh, &self.map.seeds(&self.lattice, slot), &mut rounded);
        }
        let (scale, rounding) = match codes {
            CodesMut::F32(codes) => encode(&values, &rounded, codes),
            CodesMut::U16(codes) => encode(&values, &rounded, codes),
            CodesMut::U8(codes) => encode(&values, &rounded, codes),
        };
        let rounding = rounding + position_rounding(self.mesh, &self.lattice);
        let interpolation = self.slot_error(slot, 0.0, |[x, y, z]| {
            let triangle = search.nearest([x, y, z]).slot.map_or(search.guess(), |triangle| triangle as usize);
            (distances[(z * SIDE + y) * SIDE + x], triangle)
        });
        Some(BrickRecord { slot, scale, rounding, interpolation })
    }

    fn brick_values(&self, search: &mut PacketSearch, slot: [u32; 3], required: f64) -> Option<BrickValues> {
        let Self { mesh, lattice, map, .. } = self;
        // Across a jump of the sign, the coarse grid's values inside and outside have nothing in common.
        let is_at_jump = required == f64::INFINITY || !(mesh.is_continuous() || map.is_on_one_side(slot));
        let coarse = (!is_at_jump).then(|| map.corner_magnitudes(slot));
        let exact_within = map.exact_within();
        // Beyond this the coarse grid's value is stored, so a lower bound of the distance will do.
        let max_distance = coarse.map_or(f64::INFINITY, |coarse| coarse.into_iter().fold(map.kept_within(), f64::max));
        let mut distances = [f64::INFINITY; BRICK_SAMPLES];
        let mut values = [0.0_f64; BRICK_SAMPLES];
        let nodes = PacketNodes::new(lattice, slot.map(|n| (n * BRICK) as usize), [SIDE; 3]);
        if !search.find(&nodes, required, mesh.search_distance(max_distance)) {
            return None;
        }
        let point = middle(lattice, slot.map(|n| n as usize));
        let mut last = MeasuredPoint { point, nearest: mesh.nearest(point, search.guess()) };
        for row in 0..SIDE * SIDE {
            for x in 0..SIDE {
                // Boustrophedon: the next node is a neighbour.
                let x = if row % 2 == 0 { x } else { SIDE - 1 - x };
                let step = [x, row % SIDE, row / SIDE];
                let index = row * SIDE + x;
                let node = self.node(slot, step);
                let mut magnitude = f64::INFINITY;
                // Otherwise the ball around the last point contains this node, which so is on the same side, and far.
                if last.nearest.distance - (node - last.point).norm() <= max_distance {
                    let nearest = mesh.nearest_to_node(search, &nodes, step, Some(last));
                    last = MeasuredPoint { point: node, nearest };
                    distances[index] = nearest.distance;
                    magnitude = nearest.distance;
                }
                if let Some(coarse) = coarse.filter(|_| magnitude > exact_within) {
                    magnitude = magnitude.min(interpolate(coarse, step).max(exact_within));
                }
                values[index] = if last.nearest.is_inside { -magnitude } else { magnitude };
            }
        }
        let has_near_node = || distances.iter().any(|distance| *distance <= required);
        (required == f64::INFINITY || has_near_node()).then_some(BrickValues { distances, values })
    }

    pub(super) fn node(&self, slot: [u32; 3], step: [usize; 3]) -> Vector3<f64> {
        self.lattice.node(std::array::from_fn(|axis| slot[axis] * BRICK + step[axis] as u32)).into()
    }
}

/// Writes the codes of signed values. Returns how to decode them, and the largest difference of a decoded sample from the value
/// before it was rounded to f32.
fn encode<C: Quantize>(values: &[f64], rounded: &[f32], codes: &mut [C]) -> (Scale, f64) {
    let lower = rounded.iter().copied().fold(f32::INFINITY, f32::min);
    let upper = rounded.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let scale = C::scale(lower, upper);
    let mut rounding = 0.0;
    for (code, (value, rounded)) in codes.iter_mut().zip(values.iter().zip(rounded)) {
        *code = C::encode(*rounded, scale);
        let error = (f64::from(code.decode(scale)) - value.abs().copysign(f64::from(*rounded))).abs();
        rounding = f64::max(rounding, error);
    }
    (scale, rounding)
}

/// Trilinear interpolant of the coarse grid at a node of a slot, from the values at the slot's corners.
fn interpolate(corners: [f64; 8], step: [usize; 3]) -> f64 {
    let mix = |a: f64, b: f64, axis: usize| a + (b - a) * (step[axis] as f64 / f64::from(BRICK));
    let along_x: [f64; 4] = std::array::from_fn(|edge| mix(corners[2 * edge], corners[2 * edge + 1], 0));
    mix(mix(along_x[0], along_x[1], 1), mix(along_x[2], along_x[3], 1), 2)
}
