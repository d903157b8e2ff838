//! Map of a mesh whose slots cannot be marked by triangles: the distance D at the middle of each slot is measured, and so
//! D − R ≤ distance ≤ D + R at its nodes, R = 4√3 h half the diagonal of a slot. A slot with D > K + R has no brick, and the
//! magnitude of a node outside is the greater of T(d) and the least max(D − R, W) of the slots around it.

use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::{BRICK, brick_counts};
use sdf_core::nalgebra::Vector3;

use super::{BrickMap, Windings, middle};
use crate::nearest::{PacketNodes, PacketSearch, SIDE, packet_rows};
use crate::rounding::COARSE_DISTANCE_ROUNDING;
use crate::sign::flood_fill::{NodeBlock, Winding};
use crate::sparse::coarse_map::with_side;
use crate::sparse::slot_bits::SlotBits;
use crate::triangle::nearest_on_triangle;
use crate::{MeshDistance, SignMethod};

impl BrickMap {
    /// Measures the middles of all slots.
    pub(super) fn by_middles(mesh: &MeshDistance, lattice: &Lattice, band: f64) -> Self {
        let counts = brick_counts(lattice);
        let slot_counts = counts.map(|n| n as usize);
        let middles = NodeBlock {
            counts: slot_counts,
            spacing: lattice.spacing() * f64::from(BRICK),
            position: &|slot| middle(lattice, slot),
        };
        let (mut distances, triangles): (Vec<f32>, Vec<u32>) = nearest_to_middles(mesh, &middles).into_iter().unzip();
        let is_winding = mesh.sign_method() == SignMethod::Winding;
        let middle_windings = is_winding.then(|| sign_by_slabs(mesh, &middles, &mut distances));
        let spacing = lattice.spacing();
        let mut map = Self { distances, ..Self::empty(counts, spacing, band) };
        // D ≤ K + R.
        let may_need_brick = |distance: &f32| {
            let lower = f64::from(distance.abs()) * (1.0 - COARSE_DISTANCE_ROUNDING);
            lower <= map.kept_within() + map.half_diagonal()
        };
        map.near = SlotBits::of(map.distances.len(), |slot| may_need_brick(&map.distances[slot]));
        let position = |node: [usize; 3]| Vector3::from(lattice.node(node.map(|n| n as u32 * BRICK)));
        let nodes = map.map_coarse_nodes(|node| {
            map.measure_coarse_node(mesh, node, position(node.map(|n| n as usize)), &triangles)
        });
        let (mut magnitudes, mut node_distances): (Vec<f32>, Vec<f32>) = nodes.into_iter().unzip();
        let nodes = middle_windings.as_ref().map(|_| {
            let spacing = spacing * f64::from(BRICK);
            let block = NodeBlock { counts: slot_counts.map(|n| n + 1), spacing, position: &position };
            sign_by_slabs(mesh, &block, &mut node_distances)
        });
        for (magnitude, distance) in magnitudes.iter_mut().zip(&node_distances) {
            *magnitude = if distance.is_sign_negative() { map.inside_magnitude(distance.abs()) } else { *magnitude };
        }
        let nodes_and_sides = magnitudes.into_iter().zip(&node_distances);
        map.coarse.nodes =
            nodes_and_sides.map(|(node, distance)| with_side(node, distance.is_sign_negative())).collect();
        map.windings = middle_windings.zip(nodes).map(|(middles, nodes)| Windings { middles, nodes, node_distances });
        map
    }

    /// Magnitude of a coarse node if it is outside, and its distance or a lower bound of it, signed if pseudo-normals
    /// give the sign.
    ///
    /// The nearest triangle is searched only if it matters. `triangles` are those nearest to the middles of the slots;
    /// one of a slot around the node gives an upper bound of the distance. A node that is not searched is on the side
    /// of the middles around it, outside: the segments to them, of length R, are clear.
    fn measure_coarse_node(
        &self,
        mesh: &MeshDistance,
        node: [u32; 3],
        position: Vector3<f64>,
        triangles: &[u32],
    ) -> (f32, f32) {
        if mesh.is_cancelled() {
            return (0.0, 0.0);
        }
        let middle_distance = |index: &usize| self.distances[*index].abs();
        let nearest_slot = self.slots_around(node).min_by(|a, b| middle_distance(a).total_cmp(&middle_distance(b)));
        let guess = nearest_slot.map_or(0, |index| triangles[index] as usize);
        let upper = nearest_on_triangle(position, mesh.tree().corners[guess]).distance_sq.sqrt() as f32;
        let farthest = self.slots_around(node).map(|index| middle_distance(&index)).fold(0.0, f32::max);
        let lower = (f64::from(farthest) - self.half_diagonal()) * (1.0 - COARSE_DISTANCE_ROUNDING);
        let may_be_inside = lower < self.half_diagonal() || self.slots_around(node).any(|index| self.is_inside(index));
        let flat = self.magnitude(node, 0.0);
        if !may_be_inside && self.magnitude(node, upper) == flat {
            return (flat, lower as f32);
        }
        let nearest = mesh.nearest(position, guess);
        (self.magnitude(node, nearest.distance as f32), nearest.signed() as f32)
    }
}

/// Layers of nodes per slab. Slabs are signed in parallel.
const SLAB: usize = 8;

/// [`NodeBlock::sign`] without seeds, in parallel. Returns the winding numbers.
pub(super) fn sign_by_slabs(mesh: &MeshDistance, block: &NodeBlock, distances: &mut [f32]) -> Vec<Winding> {
    let [row, rows, _] = block.counts;
    let sign_slab = |(slab, distances): (usize, &mut [f32])| -> Vec<Winding> {
        let counts = [row, rows, distances.len() / (row * rows)];
        let position = &|[x, y, z]: [usize; 3]| (block.position)([x, y, z + slab * SLAB]);
        let block = NodeBlock { counts, spacing: block.spacing, position };
        let signed = block.sign_rows(mesh, &[], &mut distances.chunks_mut(row).collect::<Vec<_>>());
        (0..distances.len())
            .map(|index| signed.winding([index % row, index / row % rows, index / row / rows]))
            .collect()
    };
    let slabs = distances.chunks_mut(row * rows * SLAB).enumerate().collect();
    sdf_parallel::map_items(slabs, || (), |(), slab| sign_slab(slab)).concat()
}

/// Distance at the middle of each slot, signed if pseudo-normals give the sign, and the nearest triangle of the tree.
fn nearest_to_middles(mesh: &MeshDistance, middles: &NodeBlock) -> Vec<(f32, u32)> {
    let [row, rows, layers] = middles.counts;
    let mut nearest = vec![(0.0, 0); row * rows * layers];
    mesh.tree().prepare_packets();
    sdf_parallel::for_each(packet_rows(&mut nearest, middles.counts), |([y, z], mut group_rows)| {
        let counts_above = [rows - y, layers - z].map(|count| count.min(SIDE));
        let mut search = PacketSearch::new(mesh.tree());
        for x in (0..row).step_by(SIDE) {
            if mesh.is_cancelled() {
                return;
            }
            let coordinates =
                |axis: usize| std::array::from_fn(|step| (middles.position)([x + step, y + step, z + step])[axis]);
            let counts = [(row - x).min(SIDE), counts_above[0], counts_above[1]];
            let nodes = PacketNodes { axes: std::array::from_fn(coordinates), spacing: middles.spacing, counts };
            search.find(&nodes, f64::INFINITY, f64::INFINITY);
            for (above, nearest_in_row) in group_rows.iter_mut().enumerate() {
                for i in 0..counts[0] {
                    let step = [i, above % counts[1], above / counts[1]];
                    let nearest = mesh.nearest_to_node(&search, &nodes, step, None);
                    nearest_in_row[x + i] = (nearest.signed() as f32, nearest.guess as u32);
                }
            }
        }
    });
    nearest
}
