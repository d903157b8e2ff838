//! Sides of a marked map by winding numbers: of middles and nodes that are far from the surface, and so in few floods.

use sdf_core::grid::sparse::BRICK;
use sdf_core::nalgebra::Vector3;

use super::marked::{Marked, MarkedNode};
use super::middles::sign_by_slabs;
use super::{BrickMap, Windings, middle};
use crate::sign::flood_fill::NodeBlock;
use crate::sparse::slot_bits::SlotBits;

/// Distance of the middle of a slot's cells from the sides of the box of its nodes, in voxels.
const FROM_NODES: f64 = 3.0;

/// A node of the coarse grid, before its side is known.
#[derive(Clone, Copy)]
struct SearchedNode {
    /// Lower bound of its distance.
    lower: f32,
    /// A triangle near it.
    triangle: usize,
    /// The distance from that triangle, and by how much it may exceed the node's, if it was searched.
    found: Option<(f64, f64)>,
}

impl BrickMap {
    /// Fills in the sides and magnitudes of a mesh that winding numbers sign.
    pub(super) fn with_sides_of_windings(mut self, mut marked: Marked) -> Self {
        let slot_counts = self.counts().map(|n| n as usize);
        marked.look_at(&self, 0..slot_counts[2] + 1);
        let marked = &marked;
        let (mesh, lattice, spacing) = (marked.mesh, marked.lattice, self.spacing);
        let slot_side = spacing * f64::from(BRICK);
        let middles = NodeBlock { counts: slot_counts, spacing: slot_side, position: &|slot| middle(lattice, slot) };
        let mut distances = self.middle_distances(marked);
        let middle_windings = sign_by_slabs(mesh, &middles, &mut distances);
        self.distances = distances;

        let nodes: Vec<[u32; 3]> = self.map_coarse_nodes(|node| node);
        let row = slot_counts[0] + 1;
        let rows = sdf_parallel::map(nodes.len() / row, |line| {
            let mut guess = 0;
            let nodes = nodes[line * row..(line + 1) * row].iter();
            let found = nodes.map(|node| self.searched_node(marked, &marked.node(&self, *node), &mut guess));
            found.collect::<Vec<_>>()
        });
        let searched = rows.concat();
        let mut node_distances: Vec<f32> = searched.iter().map(|node| node.lower).collect();
        let position = |node: [usize; 3]| Vector3::from(lattice.node(node.map(|n| n as u32 * BRICK)));
        let block = NodeBlock { counts: slot_counts.map(|n| n + 1), spacing: slot_side, position: &position };
        let node_windings = sign_by_slabs(mesh, &block, &mut node_distances);

        let found = sdf_parallel::map(nodes.len() / row, |line| {
            let range = line * row..(line + 1) * row;
            let (nodes, distances, searched) =
                (&nodes[range.clone()], &node_distances[range.clone()], &searched[range]);
            let mut last = None;
            let value = |((node, distance), searched): ((&[u32; 3], &f32), &SearchedNode)| {
                let at = marked.node(&self, *node);
                if distance.is_sign_positive() {
                    last = None;
                    return marked.outside_magnitude(&self, &at, f64::from(*distance));
                }
                let tolerance = marked.tolerance_inside(&self, &at);
                if let Some((depth, found_within)) = searched.found
                    && found_within <= tolerance
                {
                    // Another search from that triangle would find no other.
                    last = Some(searched.triangle);
                    return self.inside_magnitude(depth as f32);
                }
                // Of nodes inside, the one before is nearer than what was found outside.
                let guess = if at.is_beside_deep { last.unwrap_or(searched.triangle) } else { searched.triangle };
                let (depth, triangle) = mesh.distance_within(at.position, guess, tolerance);
                last = Some(triangle);
                self.inside_magnitude(depth as f32)
            };
            nodes.iter().zip(distances).zip(searched).map(value).collect::<Vec<_>>()
        });
        let magnitudes = found.concat();
        let inside: Vec<bool> = node_distances.iter().map(|distance| distance.is_sign_negative()).collect();
        self.set_magnitudes(mesh, magnitudes, &inside);
        self.near = SlotBits::of(self.distances.len(), |slot| marked.is_near(slot));
        self.windings = Some(Windings { middles: middle_windings, nodes: node_windings, node_distances });
        self
    }

    /// Distance at the middle of each slot: exact in those that may need a brick, a lower bound in others.
    fn middle_distances(&self, marked: &Marked) -> Vec<f32> {
        let gaps = marked.middle_gaps(self);
        let mut distances = vec![0.0; gaps.len()];
        let row = self.counts()[0] as usize;
        sdf_parallel::for_each(distances.chunks_mut(row).enumerate().collect(), |(line, distances)| {
            let mut guess = 0;
            for (x, distance) in distances.iter_mut().enumerate() {
                let slot = line * row + x;
                if !marked.is_near(slot) || marked.mesh.is_cancelled() {
                    let lower = (marked.reach + FROM_NODES).max(f64::from(gaps[slot]));
                    *distance = (lower * self.spacing) as f32 * (1.0 - f32::EPSILON);
                    continue;
                }
                let at = middle(marked.lattice, self.slot(slot).map(|n| n as usize));
                marked.nearest_around(std::iter::once(slot), at, &mut guess);
                let nearest = marked.mesh.nearest(at, guess);
                (*distance, guess) = (nearest.distance as f32, nearest.guess);
            }
        });
        distances
    }

    /// Searches a node of the coarse grid: its distance is exact near the surface.
    fn searched_node(&self, marked: &Marked, at: &MarkedNode, guess: &mut usize) -> SearchedNode {
        let mesh = marked.mesh;
        let from_crossed = (f64::from(at.gap) * self.spacing) as f32 * (1.0 - f32::EPSILON);
        if mesh.is_cancelled() || at.is_beside_deep {
            return SearchedNode { lower: from_crossed, triangle: *guess, found: None };
        }
        let upper = marked.nearest_around(self.slots_around(at.node), at.position, guess);
        let tolerance = marked.tolerance_outside(self, upper);
        let distance;
        (distance, *guess) = mesh.distance_within(at.position, *guess, tolerance);
        let lower = from_crossed.max((distance - tolerance) as f32 * (1.0 - f32::EPSILON));
        SearchedNode { lower, triangle: *guess, found: Some((distance, tolerance)) }
    }
}
