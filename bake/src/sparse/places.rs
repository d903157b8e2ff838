use std::collections::BTreeSet;

use rayon::prelude::*;
use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::{BRICK, NO_BRICK, brick_counts};
use sdf_core::nalgebra::Vector3;

use crate::mesh_distance::Nearest;
use crate::signs::{Known, NodeBlock, Winding};
use crate::{MeshDistance, SignMethod};

/// The places of bricks, each with the signed distance at its middle, and what follows from that before any brick is made.
pub(super) struct Places {
    counts: [u32; 3],
    distances: Vec<f32>,
    /// At each node of the coarse grid the least bound of all places around it, with a brick or without, or
    /// [`Self::tilted`], whichever is more. From node to node both change by no more than the way.
    magnitudes: Vec<f32>,
    /// Where the winding number tells the sides.
    sides: Option<Sides>,
    spacing: f64,
    band: f64,
}

/// The winding numbers at the middles of places, and at the nodes of the coarse grid, and the distances there.
struct Sides {
    of_middles: Vec<Winding>,
    of_nodes: Vec<Winding>,
    distances_of_nodes: Vec<f32>,
}

/// How fast the coarse grid rises at least, away from the surface, so that a search beyond the band sees which way it is.
/// With more, more bricks are kept: a sixteenth costs 0.87 voxels around the band.
const TILT: f64 = 1.0 / 16.0;

/// More than f32's own rounding, twice.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

impl Places {
    pub fn measure(mesh: &MeshDistance, lattice: &Lattice, band: f64) -> Self {
        let counts = brick_counts(lattice);
        let [row, rows, layers] = counts.map(|n| n as usize);
        let mut distances =
            at_nodes(mesh, [row, rows, layers], |place| middle(lattice, place), |nearest| nearest.signed());
        let is_winding = mesh.sign_method() == SignMethod::Winding;
        let spacing = lattice.spacing() * f64::from(BRICK);
        let of_middles = is_winding.then(|| {
            let position = |place| middle(lattice, place);
            NodeBlock { counts: [row, rows, layers], spacing, position }.sign(mesh, &[], &mut distances)
        });
        let mut places = Self { counts, distances, magnitudes: vec![], sides: None, spacing: lattice.spacing(), band };
        let position = |node: [usize; 3]| Vector3::from(lattice.node(node.map(|n| n as u32 * BRICK)));
        let mut at_nodes = at_nodes(mesh, [row, rows, layers].map(|n| n + 1), position, |nearest| nearest.distance);
        let magnitude = |(node, distance): ([u32; 3], &f32)| {
            let least = places.around(node).map(|index| places.bound(index)).fold(f64::INFINITY, f64::min);
            // Towards zero, whatever the rounding.
            let tilted = places.tilted(f64::from(*distance) * (1.0 - ROUNDING));
            (least.max(tilted) * (1.0 - ROUNDING)) as f32
        };
        places.magnitudes = places.coarse_nodes().zip(&at_nodes).map(magnitude).collect();
        if let Some(of_middles) = of_middles {
            let block = NodeBlock { counts: [row, rows, layers].map(|n| n + 1), spacing, position };
            let of_nodes = block.sign(mesh, &[], &mut at_nodes);
            places.sides = Some(Sides { of_middles, of_nodes, distances_of_nodes: at_nodes });
        }
        places
    }

    pub fn count(&self) -> usize {
        self.distances.len()
    }

    /// Of its own numbers, a table, a list of places and a coarse grid.
    pub fn bytes(&self) -> usize {
        self.distances.len() * size_of::<(f32, u32, usize)>() + self.magnitudes.len() * size_of::<[f32; 3]>()
    }

    pub fn band(&self) -> f64 {
        self.band
    }

    pub fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        (z as usize * self.counts[1] as usize + y as usize) * self.counts[0] as usize + x as usize
    }

    pub fn place(&self, index: usize) -> [u32; 3] {
        let [row, rows, _] = self.counts.map(|n| n as usize);
        [index % row, index / row % rows, index / row / rows].map(|n| n as u32)
    }

    /// From the middle of a place to its corners.
    fn reach(&self) -> f64 {
        0.5 * f64::from(BRICK) * 3.0_f64.sqrt() * self.spacing
    }

    /// Nodes within this of the surface hold their exact distances: the corners of all cells that the band enters do.
    pub fn exact_within(&self) -> f64 {
        self.band + 3.0_f64.sqrt() * self.spacing
    }

    /// A node within this of the surface has a brick. It is more than [`Self::exact_within`] by as much as
    /// [`Self::tilted`] may claim too much at other distances from a node of the coarse grid.
    pub fn kept_within(&self) -> f64 {
        self.exact_within() + TILT * 2.0 * self.reach()
    }

    /// At a node of the coarse grid, a value that rises with its distance from the surface. Interpolated at a node that has
    /// no brick, at a distance d ≥ K = [`Self::kept_within`] in a place of diagonal D = 2 · reach, it is at most
    /// W + [`TILT`] (d + D − K) = d − (1 − TILT) (d − K), so no more than d.
    fn tilted(&self, distance: f64) -> f64 {
        self.exact_within() + TILT * (distance - self.kept_within())
    }

    pub fn may_need_brick(&self, index: usize) -> bool {
        f64::from(self.distances[index].abs()) * (1.0 - ROUNDING) <= self.kept_within() + self.reach()
    }

    /// No node of a place without a brick is nearer to the surface than this.
    fn bound(&self, index: usize) -> f64 {
        (f64::from(self.distances[index].abs()) * (1.0 - ROUNDING) - self.reach()).max(self.exact_within())
    }

    /// How many bricks there can be: those of places that may need one, and those that may have to close a mesh.
    pub fn most_bricks(&self) -> usize {
        // The middle of a place is one of its nodes.
        let may_be_absent =
            |index: usize| f64::from(self.distances[index].abs()) * (1.0 + ROUNDING) >= self.kept_within();
        let may_be_torn = |index: usize| {
            let place = self.place(index);
            let nodes = (0..8_u32).map(|corner| std::array::from_fn(|axis| place[axis] + (corner >> axis & 1)));
            let side = self.is_inside(index);
            nodes.flat_map(|node| self.around(node)).any(|other| self.is_inside(other) != side && may_be_absent(other))
                || self.sides.as_ref().is_some_and(|sides| {
                    let mut around = (0..8_u32).map(|corner| place_node(self.counts, place, corner));
                    may_be_absent(index) && around.any(|node| sides.is_node_inside(node) != side)
                })
        };
        let all = (0..self.count()).into_par_iter();
        all.filter(|index| self.may_need_brick(*index) || may_be_torn(*index)).count()
    }

    /// The places around a node of the coarse grid, at most eight.
    pub fn around(&self, node: [u32; 3]) -> impl Iterator<Item = usize> + '_ {
        (0..8_u32).filter_map(move |corner| {
            let place: [Option<u32>; 3] = std::array::from_fn(|axis| {
                let place = node[axis].checked_sub(corner >> axis & 1)?;
                (place < self.counts[axis]).then_some(place)
            });
            let [Some(x), Some(y), Some(z)] = place else { return None };
            Some(self.index([x, y, z]))
        })
    }

    fn coarse_nodes(&self) -> impl IndexedParallelIterator<Item = [u32; 3]> + use<> {
        let [row, rows, layers] = self.counts.map(|n| n as usize + 1);
        let node = move |index: usize| [index % row, index / row % rows, index / row / rows].map(|n| n as u32);
        (0..row * rows * layers).into_par_iter().map(node)
    }

    /// The coarse grid's magnitudes at the corners of a place, x fastest.
    pub fn magnitudes(&self, place: [u32; 3]) -> [f64; 8] {
        std::array::from_fn(|corner| f64::from(self.magnitudes[place_node(self.counts, place, corner as u32)]))
    }

    /// Places without a brick whose middles, and the node of the coarse grid between them, are not all on one side. No
    /// triangle lies between those, so the mesh is open there: the surface that closes it needs bricks too.
    pub fn torn(&self, table: &[u32]) -> BTreeSet<usize> {
        let torn_at = |(number, node): (usize, [u32; 3])| {
            let absent: Vec<usize> = self.around(node).filter(|index| table[*index] == NO_BRICK).collect();
            let of_node = self.sides.as_ref().map(|sides| sides.is_node_inside(number));
            let mut sides = absent.iter().map(|index| self.is_inside(*index)).chain(of_node);
            let first = sides.next();
            if sides.all(|side| Some(side) == first) { Vec::new() } else { absent }
        };
        self.coarse_nodes().enumerate().flat_map_iter(torn_at).collect()
    }

    /// The points around a place whose winding numbers are known: its middle and its corners.
    pub fn known_around(&self, lattice: &Lattice, place: [u32; 3]) -> Vec<Known> {
        let Some(sides) = &self.sides else { return vec![] };
        let index = self.index(place);
        let middle = Known {
            node: [BRICK as usize / 2; 3],
            position: middle(lattice, place.map(|n| n as usize)),
            way: 0.0,
            distance: self.distances[index].abs(),
            winding: sides.of_middles[index],
        };
        let at_corner = |corner: u32| {
            // The last of the place's nodes is one short of the next place's first.
            let steps: [usize; 3] = std::array::from_fn(|axis| (corner >> axis & 1) as usize);
            let node = place_node(self.counts, place, corner);
            Known {
                node: steps.map(|step| step * (BRICK as usize - 1)),
                position: lattice.node(std::array::from_fn(|axis| (place[axis] + steps[axis] as u32) * BRICK)).into(),
                way: (steps.iter().sum::<usize>() as f64).sqrt(),
                distance: sides.distances_of_nodes[node].abs(),
                winding: sides.of_nodes[node],
            }
        };
        [middle].into_iter().chain((0..8).map(at_corner)).collect()
    }

    fn is_inside(&self, index: usize) -> bool {
        self.distances[index].is_sign_negative()
    }

    /// Each node on the side of the places around it that have no brick.
    pub fn coarse(&self, table: &[u32]) -> Vec<f32> {
        let value = |(node, magnitude): ([u32; 3], &f32)| {
            let absent = self.around(node).find(|index| table[*index] == NO_BRICK);
            absent.map_or(0.0, |index| if self.is_inside(index) { -magnitude } else { *magnitude })
        };
        self.coarse_nodes().zip(&self.magnitudes).map(value).collect()
    }
}

impl Sides {
    fn is_node_inside(&self, node: usize) -> bool {
        self.of_nodes[node].is_inside()
    }
}

/// A number for each node of a lattice, x fastest, from what is nearest to it.
fn at_nodes(
    mesh: &MeshDistance,
    [row, rows, layers]: [usize; 3],
    position: impl Fn([usize; 3]) -> Vector3<f64> + Sync,
    value: impl Fn(Nearest) -> f64 + Sync,
) -> Vec<f32> {
    let mut values = vec![0.0_f32; row * rows * layers];
    values.par_chunks_mut(row * rows).enumerate().for_each(|(z, layer)| {
        let mut guess = 0;
        for (y, values) in layer.chunks_mut(row).enumerate() {
            for step in 0..row {
                // To and fro, so that the next node is a neighbour and its nearest triangle a good guess.
                let x = if y % 2 == 0 { step } else { row - 1 - step };
                let nearest = mesh.nearest(position([x, y, z]), guess);
                guess = nearest.guess;
                values[x] = value(nearest) as f32;
            }
        }
    });
    values
}

/// The middle of a place: of the cells whose first corners it holds.
pub(super) fn middle(lattice: &Lattice, place: [usize; 3]) -> Vector3<f64> {
    let steps = |axis: usize| f64::from(BRICK) * (place[axis] as f64 + 0.5);
    Vector3::from_fn(|axis, _| lattice.origin()[axis] + lattice.spacing() * steps(axis))
}

/// The number of the coarse grid's node at a corner of a place.
fn place_node(counts: [u32; 3], place: [u32; 3], corner: u32) -> usize {
    let [row, rows, _] = counts.map(|n| n as usize + 1);
    let [x, y, z]: [usize; 3] = std::array::from_fn(|axis| (place[axis] + (corner >> axis & 1)) as usize);
    (z * rows + y) * row + x
}
