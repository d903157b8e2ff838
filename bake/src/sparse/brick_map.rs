use std::collections::BTreeSet;

use rayon::prelude::*;
use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::{BRICK, NO_BRICK, brick_counts};
use sdf_core::nalgebra::Vector3;

use crate::nearest::{Nodes, Packet, SIDE, rows_of_packets};
use crate::rounding::COARSE_DISTANCE_ROUNDING;
use crate::sign::flood_fill::{NodeBlock, Seed, Winding};
use crate::triangle::nearest_on_triangle;
use crate::{MeshDistance, SignMethod};

/// The places of bricks, each with the signed distance at its middle, and what follows from that before any brick is made.
pub(super) struct BrickMap {
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

/// Nodes of the coarse grid so many spacings from the surface have a free way to those of their neighbours that are too.
const FREE: f64 = 0.51 * BRICK as f64;

impl BrickMap {
    pub fn measure(mesh: &MeshDistance, lattice: &Lattice, band: f64) -> Self {
        let counts = brick_counts(lattice);
        let along = counts.map(|n| n as usize);
        let block = NodeBlock {
            counts: along,
            spacing: lattice.spacing() * f64::from(BRICK),
            position: |place| middle(lattice, place),
        };
        let (mut distances, slots): (Vec<f32>, Vec<u32>) = nearest_to_middles(mesh, &block).into_iter().unzip();
        let is_winding = mesh.sign_method() == SignMethod::Winding;
        let of_middles = is_winding.then(|| sign_by_slabs(mesh, &block, &mut distances));
        let mut places = Self { counts, distances, magnitudes: vec![], sides: None, spacing: lattice.spacing(), band };
        let position = |node: [usize; 3]| Vector3::from(lattice.node(node.map(|n| n as u32 * BRICK)));
        let of_nodes = places
            .coarse_nodes()
            .map(|node| places.of_coarse_node(mesh, node, position(node.map(|n| n as usize)), &slots));
        let (magnitudes, mut distances_of_nodes): (Vec<f32>, Vec<f32>) = of_nodes.unzip();
        places.magnitudes = magnitudes;
        if let Some(of_middles) = of_middles {
            let block = NodeBlock { counts: along.map(|n| n + 1), spacing: block.spacing, position };
            let of_nodes = sign_by_slabs(mesh, &block, &mut distances_of_nodes);
            places.sides = Some(Sides { of_middles, of_nodes, distances_of_nodes });
        }
        places
    }

    /// Its magnitude, and its distance or a bound of it from below. It is only searched for where either needs it: the
    /// triangle that is nearest to the middle of a place beside it, one of `slots`, bounds it from above.
    fn of_coarse_node(&self, mesh: &MeshDistance, node: [u32; 3], at: Vector3<f64>, slots: &[u32]) -> (f32, f32) {
        let of_middle = |index: &usize| self.distances[*index].abs();
        let nearest = self.around(node).min_by(|a, b| of_middle(a).total_cmp(&of_middle(b)));
        let guess = nearest.map_or(0, |index| slots[index] as usize);
        let most = nearest_on_triangle(at, mesh.tree().corners[guess]).distance_sq.sqrt() as f32;
        let farthest = self.around(node).map(|index| of_middle(&index)).fold(0.0, f32::max);
        let least = (f64::from(farthest) - self.reach()) * (1.0 - COARSE_DISTANCE_ROUNDING);
        let is_too_near = mesh.sign_method() == SignMethod::Winding && least < FREE * self.spacing;
        let flat = self.magnitude(node, 0.0);
        if !is_too_near && self.magnitude(node, most) == flat {
            return (flat, least as f32);
        }
        let distance = mesh.nearest(at, guess).distance as f32;
        (self.magnitude(node, distance), distance)
    }

    /// Of a node of the coarse grid at a distance from the surface. It rises with that.
    fn magnitude(&self, node: [u32; 3], distance: f32) -> f32 {
        let least = self.around(node).map(|index| self.bound(index)).fold(f64::INFINITY, f64::min);
        // Towards zero, whatever the rounding.
        let tilted = self.tilted(f64::from(distance) * (1.0 - COARSE_DISTANCE_ROUNDING));
        (least.max(tilted) * (1.0 - COARSE_DISTANCE_ROUNDING)) as f32
    }

    pub fn count(&self) -> usize {
        self.distances.len()
    }

    /// Of its own numbers, a table, a list of places and a coarse grid.
    pub fn bytes(&self) -> usize {
        let of_sides = self.sides.as_ref().map_or(0, |sides| {
            (sides.of_middles.len() + sides.of_nodes.len()) * size_of::<Winding>()
                + size_of_val(&sides.distances_of_nodes[..])
        });
        self.distances.len() * size_of::<(f32, u32, usize)>() + self.magnitudes.len() * size_of::<[f32; 3]>() + of_sides
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
        f64::from(self.distances[index].abs()) * (1.0 - COARSE_DISTANCE_ROUNDING) <= self.kept_within() + self.reach()
    }

    /// No node of a place without a brick is nearer to the surface than this.
    fn bound(&self, index: usize) -> f64 {
        (f64::from(self.distances[index].abs()) * (1.0 - COARSE_DISTANCE_ROUNDING) - self.reach())
            .max(self.exact_within())
    }

    /// How many bricks there can be: those of places that may need one, and those that may have to close a mesh.
    pub fn most_bricks(&self) -> usize {
        // The middle of a place is one of its nodes.
        let may_be_absent = |index: usize| {
            f64::from(self.distances[index].abs()) * (1.0 + COARSE_DISTANCE_ROUNDING) >= self.kept_within()
        };
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
    pub fn unpaired_at_boundary(&self, table: &[u32]) -> BTreeSet<usize> {
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
    pub fn known_around(&self, lattice: &Lattice, place: [u32; 3]) -> Vec<Seed> {
        let Some(sides) = &self.sides else { return vec![] };
        let index = self.index(place);
        let middle = Seed {
            node: [BRICK as usize / 2; 3],
            position: middle(lattice, place.map(|n| n as usize)),
            length: 0.0,
            distance: self.distances[index].abs(),
            winding: sides.of_middles[index],
        };
        let at_corner = |corner: u32| {
            // The last of the place's nodes is one short of the next place's first.
            let steps: [usize; 3] = std::array::from_fn(|axis| (corner >> axis & 1) as usize);
            let node = place_node(self.counts, place, corner);
            Seed {
                node: steps.map(|step| step * (BRICK as usize - 1)),
                position: lattice.node(std::array::from_fn(|axis| (place[axis] + steps[axis] as u32) * BRICK)).into(),
                length: (steps.iter().sum::<usize>() as f64).sqrt(),
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

/// Layers of nodes that are given their sides side by side with others.
const SLAB: usize = 8;

/// As [`NodeBlock::sign`], with nothing known.
fn sign_by_slabs<P>(mesh: &MeshDistance, block: &NodeBlock<P>, distances: &mut [f32]) -> Vec<Winding>
where
    P: Fn([usize; 3]) -> Vector3<f64> + Sync,
{
    let [row, rows, _] = block.counts;
    let of_slab = |(slab, distances): (usize, &mut [f32])| -> Vec<Winding> {
        let counts = [row, rows, distances.len() / (row * rows)];
        let position = |[x, y, z]: [usize; 3]| (block.position)([x, y, z + slab * SLAB]);
        let block = NodeBlock { counts, spacing: block.spacing, position };
        let signed = block.sign_rows(mesh, &[], &mut distances.chunks_mut(row).collect::<Vec<_>>());
        (0..distances.len())
            .map(|index| signed.winding([index % row, index / row % rows, index / row / rows]))
            .collect()
    };
    distances.par_chunks_mut(row * rows * SLAB).enumerate().map(of_slab).collect::<Vec<_>>().concat()
}

/// The signed distance at the middle of each place, and which triangle of the tree is nearest.
fn nearest_to_middles<P>(mesh: &MeshDistance, block: &NodeBlock<P>) -> Vec<(f32, u32)>
where
    P: Fn([usize; 3]) -> Vector3<f64> + Sync,
{
    let [row, rows, layers] = block.counts;
    let mut nearest = vec![(0.0, 0); row * rows * layers];
    rows_of_packets(&mut nearest, block.counts).into_par_iter().for_each(|([y, z], mut tile_rows)| {
        let counts_above = [rows - y, layers - z].map(|count| count.min(SIDE));
        let mut packet = Packet::new(mesh.tree());
        for x in (0..row).step_by(SIDE) {
            let along =
                |axis: usize| std::array::from_fn(|step| (block.position)([x + step, y + step, z + step])[axis]);
            let counts = [(row - x).min(SIDE), counts_above[0], counts_above[1]];
            let nodes = Nodes { axes: std::array::from_fn(along), spacing: block.spacing, counts };
            packet.measure(&nodes, f64::INFINITY, f64::INFINITY);
            for (above, middles) in tile_rows.iter_mut().enumerate() {
                for i in 0..counts[0] {
                    let step = [i, above % counts[1], above / counts[1]];
                    let nearest = mesh.nearest_in(&packet, &nodes, step, None);
                    middles[x + i] = (nearest.signed() as f32, nearest.guess as u32);
                }
            }
        }
    });
    nearest
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{random, random_vector};
    use crate::{TriangleMesh, lattice_around};

    /// Some tetrahedra, and some triangles that make the mesh open.
    fn mesh(tetrahedra: u32, triangles: u32, state: &mut u64) -> TriangleMesh {
        let (mut points, mut corners) = (vec![], vec![]);
        for part in 0..tetrahedra + triangles {
            let (middle, size) = (random_vector(state), 0.02 + 0.3 * random(state).abs());
            let first = 4 * part;
            points.extend((0..4).map(|_| <[f64; 3]>::from(middle + random_vector(state) * size)));
            let of_part = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|of: [u32; 3]| of.map(|c| first + c));
            corners.extend(&of_part[..if part < tetrahedra { 4 } else { 1 }]);
        }
        TriangleMesh::new(&points, &corners).unwrap()
    }

    #[test]
    fn distances_and_magnitudes_are_those_of_every_node_searched_by_itself() {
        let mut state = 47;
        println!("seed {state}");
        for (tetrahedra, triangles, cells) in [(1, 0, 20.0), (1, 0, 150.0), (9, 0, 150.0), (0, 40, 90.0), (3, 1, 200.0)]
        {
            let mesh = mesh(tetrahedra, triangles, &mut state);
            let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / cells, 2).unwrap();
            let mesh = MeshDistance::new(&mesh, None);
            let places = BrickMap::measure(&mesh, &lattice, 3.0 * lattice.spacing());
            for index in 0..places.count() {
                let at = middle(&lattice, places.place(index).map(|n| n as usize));
                let wanted = mesh.nearest(at, 0).distance as f32;
                assert_eq!(places.distances[index].abs(), wanted, "place {index}");
            }
            let mut rises = 0;
            let nodes: Vec<[u32; 3]> = places.coarse_nodes().collect();
            for (number, node) in nodes.into_iter().enumerate() {
                let at = Vector3::from(lattice.node(node.map(|n| n * BRICK)));
                let distance = mesh.nearest(at, 0).distance as f32;
                assert_eq!(places.magnitudes[number], places.magnitude(node, distance), "{node:?}");
                rises += usize::from(places.magnitudes[number] > places.magnitude(node, 0.0));
                if let Some(sides) = &places.sides {
                    assert!(sides.distances_of_nodes[number].abs() <= distance * (1.0 + f32::EPSILON), "{node:?}");
                }
            }
            assert!(rises > 0, "{tetrahedra} {triangles}");
        }
    }
}
