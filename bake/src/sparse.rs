//! Distances in bricks near the surface, and a coarse grid elsewhere.
//!
//! A brick is kept when one of its nodes lies within band + √3 · spacing of the surface: a cell that the band enters has
//! all its corners within that. So every such cell has all its corners in bricks, and interpolates what a dense grid
//! would. A place without a brick is farther than the band from the surface as a whole, and the coarse grid's value there
//! is no more than the distance in magnitude: at each of its nodes the least of the bounds of the places around it.

use std::collections::BTreeSet;

use rayon::prelude::*;
use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, BrickSlices, Bricks, Code, NO_BRICK, Scale, Sparse, brick_counts};
use sdf_core::grid::{Lattice, Storage, cell_slope, slope_bound_with_outside};
use sdf_core::nalgebra::Vector3;

use crate::hilbert::hilbert_index;
use crate::signs::sign_block;
use crate::{MeshDistance, SignMethod};

/// A baked sparse grid, and what is certain of it. Bricks stand in the order of a Hilbert curve.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseGrid<C> {
    /// For each place of a brick, x fastest, which of the bricks it is.
    pub table: Vec<u32>,
    /// Of each brick its place, counted in bricks from the first node.
    pub places: Vec<[u32; 3]>,
    pub scales: Vec<Scale>,
    /// By brick, then by node, x fastest.
    pub samples: Vec<C>,
    /// Every eighth node and one more along each axis, x fastest. Zero where only bricks are around.
    pub coarse: Vec<f32>,
    /// Of each brick, over the cells whose first corner it holds.
    pub cells: Vec<CellBounds>,
    /// Of all cells the steepest: those at the edge of the bricks, where the value steps down to the coarse grid's, have
    /// slopes of twenty and more. [`Self::cells`] says more of a place.
    pub slope_bound: f64,
    /// Of a closed mesh: the most by which the interpolant differs from the signed distance where that is within the band.
    /// Not proven yet across the surface that closes the holes of an open one.
    pub error_bound: f64,
}

impl<C: Code> Bricks for SparseGrid<C> {
    type Code = C;
    fn table(&self) -> &[u32] {
        &self.table
    }
    fn scales(&self) -> &[Scale] {
        &self.scales
    }
    fn samples(&self) -> &[C] {
        &self.samples
    }
    fn coarse(&self) -> &[f32] {
        &self.coarse
    }
}

/// What the interpolant stays within in a brick's cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellBounds {
    pub least: f32,
    pub greatest: f32,
    /// The most that it changes over a unit of distance.
    pub slope: f32,
}

/// How samples are kept.
pub trait Quantize: Code + Send + Sync {
    /// The scale for a brick's samples.
    fn scale(least: f32, greatest: f32) -> Scale;
    /// The code that decodes nearest to the sample.
    fn encode(sample: f32, scale: Scale) -> Self;
}

impl Quantize for f32 {
    fn scale(_least: f32, _greatest: f32) -> Scale {
        Scale { base: 0.0, step: 1.0 }
    }
    fn encode(sample: f32, _scale: Scale) -> Self {
        sample
    }
}

macro_rules! quantize {
    ($code:ident) => {
        impl Quantize for $code {
            fn scale(least: f32, greatest: f32) -> Scale {
                Scale { base: least, step: (greatest - least) / f32::from($code::MAX) }
            }
            fn encode(sample: f32, scale: Scale) -> Self {
                if scale.step > 0.0 { ((sample - scale.base) / scale.step).round() as $code } else { 0 }
            }
        }
    };
}

quantize!(u16);
quantize!(u8);

/// One brick under way.
struct Brick<C> {
    place: [u32; 3],
    scale: Scale,
    samples: Vec<C>,
    /// The most by which a sample is off from the exact distance.
    error: f64,
}

/// Bakes to bricks; a dense grid never exists. `band` is a length: wherever the surface is no farther than that, the grid
/// interpolates the same samples as a dense one of the same lattice. `on_places_done` is told, from any thread, how many
/// more of the places for bricks are done, of which there are as many as [`brick_counts`] says. The result does not depend
/// on the number of threads.
pub fn bake<C: Quantize>(
    mesh: &MeshDistance,
    lattice: &Lattice,
    band: f64,
    on_places_done: &(dyn Fn(usize) + Sync),
) -> SparseGrid<C> {
    let places = Places::measure(mesh, lattice, band);
    let mut bricks: Vec<Brick<C>> = (0..places.distances.len())
        .into_par_iter()
        .filter_map(|index| {
            on_places_done(1);
            let may_need = places.may_need_brick(index);
            may_need.then(|| brick(mesh, lattice, places.place(index), places.wanted_within()))?
        })
        .collect();
    let torn = places.torn(&places.table(&bricks));
    let closing = torn.par_iter().filter_map(|index| brick(mesh, lattice, places.place(*index), f64::INFINITY));
    bricks.extend(closing.collect::<Vec<_>>());
    bricks.par_sort_unstable_by_key(|brick| hilbert_index(brick.place));
    let table = places.table(&bricks);
    let coarse = places.coarse(&table);
    let error = bricks.iter().map(|brick| brick.error).fold(0.0, f64::max);
    let scales: Vec<Scale> = bricks.iter().map(|brick| brick.scale).collect();
    let brick_places: Vec<[u32; 3]> = bricks.iter().map(|brick| brick.place).collect();
    let mut samples = Vec::with_capacity(bricks.len() * BRICK_SAMPLES);
    // One by one, so that at no time both copies are whole.
    bricks.into_iter().for_each(|brick| samples.extend(brick.samples));

    let slices = BrickSlices { table: &table, scales: &scales, samples: &samples, coarse: &coarse };
    let Some(storage) = Sparse::new(lattice, slices) else { unreachable!("the table names the bricks that there are") };
    let cells: Vec<CellBounds> = brick_places.par_iter().map(|place| cell_bounds(lattice, &storage, *place)).collect();
    let slope_bound = slope_bound(lattice, &storage, &places, &table, &cells);
    // A signed distance changes by at most the way: see `dense`.
    let error_bound = 0.75_f64.sqrt() * lattice.spacing() + error;
    SparseGrid { table, places: brick_places, scales, samples, coarse, cells, slope_bound, error_bound }
}

/// The places of bricks, each with the signed distance at its middle.
struct Places {
    counts: [u32; 3],
    distances: Vec<f32>,
    spacing: f64,
    band: f64,
}

impl Places {
    fn measure(mesh: &MeshDistance, lattice: &Lattice, band: f64) -> Self {
        let counts = brick_counts(lattice);
        let [row, rows, layers] = counts.map(|n| n as usize);
        let mut distances = vec![0.0_f32; row * rows * layers];
        distances.par_chunks_mut(row * rows).enumerate().for_each(|(z, layer)| {
            let mut guess = 0;
            for (index, distance) in layer.iter_mut().enumerate() {
                let nearest = mesh.nearest(middle(lattice, [index % row, index / row, z]), guess);
                guess = nearest.guess;
                *distance = nearest.signed() as f32;
            }
        });
        if mesh.sign_method() == SignMethod::Winding {
            let spacing = lattice.spacing() * f64::from(BRICK);
            sign_block(mesh, spacing, [row, rows, layers], |place| middle(lattice, place), &mut distances);
        }
        Self { counts, distances, spacing: lattice.spacing(), band }
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        (z as usize * self.counts[1] as usize + y as usize) * self.counts[0] as usize + x as usize
    }

    fn place(&self, index: usize) -> [u32; 3] {
        let [row, rows, _] = self.counts.map(|n| n as usize);
        [index % row, index / row % rows, index / row / rows].map(|n| n as u32)
    }

    /// From the middle of a place to its corners.
    fn reach(&self) -> f64 {
        0.5 * f64::from(BRICK) * 3.0_f64.sqrt() * self.spacing
    }

    /// Nodes within this of the surface are wanted.
    fn wanted_within(&self) -> f64 {
        self.band + 3.0_f64.sqrt() * self.spacing
    }

    fn may_need_brick(&self, index: usize) -> bool {
        f64::from(self.distances[index].abs()) * (1.0 - ROUNDING) <= self.wanted_within() + self.reach()
    }

    /// No point of a place without a brick is nearer to the surface than this.
    fn bound(&self, index: usize) -> f64 {
        (f64::from(self.distances[index].abs()) * (1.0 - ROUNDING) - self.reach()).max(self.band)
    }

    /// For each place which of the bricks it is.
    fn table<C>(&self, bricks: &[Brick<C>]) -> Vec<u32> {
        let mut table = vec![NO_BRICK; self.distances.len()];
        for (number, brick) in (0..).zip(bricks) {
            table[self.index(brick.place)] = number;
        }
        table
    }

    /// The places around a node of the coarse grid, at most eight.
    fn around(&self, node: [u32; 3]) -> impl Iterator<Item = usize> + '_ {
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

    /// Places without a brick that touch another one on the other side. Between them lies no triangle, so the mesh is open
    /// there: the surface that closes it needs bricks too.
    fn torn(&self, table: &[u32]) -> BTreeSet<usize> {
        let torn_at = |node: [u32; 3]| {
            let absent: Vec<usize> = self.around(node).filter(|index| table[*index] == NO_BRICK).collect();
            let inside = absent.iter().filter(|index| self.is_inside(**index)).count();
            if inside % absent.len().max(1) == 0 { Vec::new() } else { absent }
        };
        self.coarse_nodes().flat_map_iter(torn_at).collect()
    }

    fn is_inside(&self, index: usize) -> bool {
        self.distances[index].is_sign_negative()
    }

    /// At each node the least bound of the places around it that have no brick, so that what is interpolated in such a
    /// place is nowhere more than its own.
    fn coarse(&self, table: &[u32]) -> Vec<f32> {
        let value = |node: [u32; 3]| {
            let absent = self.around(node).filter(|index| table[*index] == NO_BRICK);
            let signed = |index: usize| (self.bound(index), self.is_inside(index));
            let least = absent.map(signed).min_by(|a, b| a.0.total_cmp(&b.0));
            let (bound, is_inside) = least.unwrap_or((0.0, false));
            // Towards zero, whatever the rounding.
            let bound = (bound * (1.0 - ROUNDING)) as f32;
            if is_inside { -bound } else { bound }
        };
        self.coarse_nodes().map(value).collect()
    }
}

/// More than f32's own rounding, twice.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

/// The middle of a place: of the cells whose first corners it holds.
fn middle(lattice: &Lattice, place: [usize; 3]) -> Vector3<f64> {
    let steps = |axis: usize| f64::from(BRICK) * (place[axis] as f64 + 0.5);
    Vector3::from_fn(|axis, _| lattice.origin()[axis] + lattice.spacing() * steps(axis))
}

/// The brick at a place, if one of its nodes lies `within` so much of the surface.
fn brick<C: Quantize>(mesh: &MeshDistance, lattice: &Lattice, place: [u32; 3], within: f64) -> Option<Brick<C>> {
    const SIDE: usize = BRICK as usize;
    let node = |[x, y, z]: [usize; 3]| {
        let step = [x, y, z].map(|n| n as u32);
        Vector3::from(lattice.node(std::array::from_fn(|axis| place[axis] * BRICK + step[axis])))
    };
    let mut exact = [0.0_f64; BRICK_SAMPLES];
    let mut guess = mesh.nearest(middle(lattice, place.map(|n| n as usize)), 0).guess;
    for (index, distance) in exact.iter_mut().enumerate() {
        // To and fro, so that the next node is a neighbour and its nearest triangle a good guess.
        let [x, y, z] = [index % SIDE, index / SIDE % SIDE, index / SIDE / SIDE];
        let nearest = mesh.nearest(node([x, y, z]), guess);
        guess = nearest.guess;
        *distance = nearest.signed();
    }
    if !exact.iter().any(|distance| distance.abs() <= within) {
        return None;
    }
    let mut rounded = exact.map(|distance| distance as f32);
    if mesh.sign_method() == SignMethod::Winding {
        sign_block(mesh, lattice.spacing(), [SIDE; 3], node, &mut rounded);
    }
    let least = rounded.iter().copied().fold(f32::INFINITY, f32::min);
    let greatest = rounded.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let scale = C::scale(least, greatest);
    let samples: Vec<C> = rounded.iter().map(|sample| C::encode(*sample, scale)).collect();
    let off = |(code, (exact, rounded)): (&C, (&f64, &f32))| {
        (f64::from(code.decode(scale)) - exact.abs().copysign(f64::from(*rounded))).abs()
    };
    let error = samples.iter().zip(exact.iter().zip(&rounded)).map(off).fold(0.0, f64::max);
    Some(Brick { place, scale, samples, error })
}

/// The cells whose first corner is in a place.
fn cells_of(lattice: &Lattice, place: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    let last = lattice.cells();
    let first = place.map(|n| n * BRICK);
    let cell = move |index: u32| {
        let step = [index % BRICK, index / BRICK % BRICK, index / BRICK / BRICK];
        std::array::from_fn(|axis| first[axis] + step[axis])
    };
    (0..BRICK * BRICK * BRICK).map(cell).filter(move |cell: &[u32; 3]| (0..3).all(|axis| cell[axis] < last[axis]))
}

fn cell_bounds<S: Storage>(lattice: &Lattice, storage: &S, place: [u32; 3]) -> CellBounds {
    let nothing = CellBounds { least: f32::INFINITY, greatest: f32::NEG_INFINITY, slope: 0.0 };
    let mut bounds: CellBounds = cells_of(lattice, place).fold(nothing, |bounds, cell| {
        let corners = storage.corners(cell);
        CellBounds {
            least: corners.into_iter().fold(bounds.least, f32::min),
            greatest: corners.into_iter().fold(bounds.greatest, f32::max),
            slope: bounds.slope.max(round_up(cell_slope(corners, lattice.spacing()))),
        }
    });
    if bounds.least > bounds.greatest {
        // Nodes of the box's last face alone: no cell begins at them.
        bounds = CellBounds { least: 0.0, greatest: 0.0, slope: 0.0 };
    }
    bounds
}

/// Over all cells. Those of a place without a brick lie in one cell of the coarse grid and are no steeper, but for those
/// that reach over into a brick.
fn slope_bound<C: Quantize>(
    lattice: &Lattice,
    storage: &Sparse<BrickSlices<C>>,
    places: &Places,
    table: &[u32],
    bricks: &[CellBounds],
) -> f64 {
    let coarse_spacing = lattice.spacing() * f64::from(BRICK);
    let of_place = |index: usize| {
        let place = places.place(index);
        if table[index] != NO_BRICK {
            return 0.0;
        }
        let reaches_a_brick = places.around(place.map(|n| n + 1)).any(|index| table[index] != NO_BRICK);
        if reaches_a_brick {
            f64::from(cell_bounds(lattice, storage, place).slope)
        } else {
            cell_slope(storage.coarse_corners(place), coarse_spacing)
        }
    };
    let of_absent = (0..table.len()).into_par_iter().map(of_place).reduce(|| 0.0, f64::max);
    let inside = bricks.iter().map(|cells| f64::from(cells.slope)).fold(of_absent, f64::max);
    slope_bound_with_outside(inside, inside_reaches_box(lattice, storage))
}

/// A node on a face of the box is negative.
fn inside_reaches_box<C: Quantize>(lattice: &Lattice, storage: &Sparse<BrickSlices<C>>) -> bool {
    let nodes = lattice.nodes();
    let on_face = |axis: usize, layer: u32| {
        let [beside, above] = [(axis + 1) % 3, (axis + 2) % 3];
        let is_negative = |index: u32| {
            let mut node = [layer; 3];
            (node[beside], node[above]) = (index % nodes[beside], index / nodes[beside]);
            storage.node(node) < 0.0
        };
        (0..nodes[beside] * nodes[above]).into_par_iter().any(is_negative)
    };
    (0..3).any(|axis| on_face(axis, 0) || on_face(axis, nodes[axis] - 1))
}

fn round_up(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) < x { rounded.next_up() } else { rounded }
}
