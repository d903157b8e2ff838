//! Distances in bricks near the surface, and a coarse grid elsewhere.
//!
//! With h the spacing and B the band: nodes within W = B + √3 h of the surface hold their exact distance, as do all corners
//! of a cell that the band enters, and such a cell interpolates what a dense grid would. All other nodes hold the distance
//! or what the coarse grid interpolates there, whichever is less; and those farther than W + √3/2 h that share no brick with
//! a nearer one are not kept: the coarse grid stands for them.
//!
//! The coarse grid's magnitude at a node is the least bound of the places around it, or a value that rises slowly with the
//! node's distance, whichever is more (`places`). A place's bound is the distance at its middle less the way to its corners,
//! and no less than W. So at nodes without a brick the coarse grid is no more than the distance; it changes by no more than
//! the way along each axis, as the distance does; and so does the lesser of both.
//! A point x beyond the band whose nearest of the surface is q claims no more than Σ wᵢ |xᵢ − q| ≤ |x − q| + 3h²/(8B), with
//! |xᵢ − q| ≤ (|xᵢ − q|² + r²)/(2r) at r = |x − q|.

mod brick_map;
mod quantize;

use std::cmp::Ordering;

use rayon::prelude::*;
use sdf_core::Interval;
use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, BrickSlices, Bricks, Code, NO_BRICK, Scale, Sparse};
use sdf_core::grid::{BlockBounds, Lattice, cell_slope, slope_bound_with_outside};
use sdf_core::nalgebra::Vector3;

pub use quantize::Quantize;

use crate::bvh::hilbert::hilbert_index;
use crate::error::block::{ErrorBlock, Query};
use crate::error::node_bounds::{HaloBlock, inside_reaches_box, round_up};
use crate::error::normal_cones::MAX_ERROR;
use crate::error::{BoundedBlock, BrickErrors};
use crate::mesh_distance::AdjacentTriangles;
use crate::nearest::{Nodes, Packet};
use crate::rounding::COARSE_DIFFERENCE_ROUNDING;
use crate::sign::flood_fill::NodeBlock;
use crate::simd::LANES;
use crate::{MeshDistance, SignMethod};
use brick_map::{BrickMap, middle};

/// A baked sparse grid, and what is certain of it. Bricks stand in the order of a Hilbert curve; after them, in the same
/// order, those that only close an open mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseGrid<C> {
    /// For each place of a brick, x fastest, which of the bricks it is.
    pub table: Vec<u32>,
    /// Of each brick its place, counted in bricks from the first node.
    pub places: Vec<[u32; 3]>,
    pub scales: Vec<Scale>,
    /// By brick, then by node, x fastest.
    pub samples: Vec<C>,
    /// Of each brick's nodes.
    pub bounds: Vec<BlockBounds>,
    /// Of each brick, over the cells whose first corner it holds: the most by which the interpolant differs from the signed
    /// distance where that is within the band. Proven of closed meshes. Of an open one, a patch of the surface that closes
    /// its holes, so small that it cuts no edge of a cell, goes unseen.
    pub errors: Vec<f32>,
    /// Every eighth node and one more along each axis, x fastest. Zero where only bricks are around.
    pub coarse: Vec<f32>,
    /// Of all cells the steepest. [`Self::bounds`] says more of a place.
    pub slope_bound: f64,
    /// The largest of [`Self::errors`].
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
    fn bounds(&self) -> &[BlockBounds] {
        &self.bounds
    }
    fn coarse(&self) -> &[f32] {
        &self.coarse
    }
}

/// Bakes to bricks: [`Plan::new`] and [`Plan::bake`] in one.
pub fn bake<C: Quantize>(
    mesh: &MeshDistance,
    lattice: &Lattice,
    band: f64,
    on_places_done: &(dyn Fn(usize) + Sync),
) -> SparseGrid<C> {
    Plan::new(mesh, lattice, band).bake(on_places_done)
}

/// What a sparse grid will be, as far as that is known without baking it.
pub struct Plan<'a> {
    mesh: &'a MeshDistance<'a>,
    lattice: Lattice,
    places: BrickMap,
}

/// Places whose bricks are made side by side before they join the rest: so many that threads seldom wait, so few that the
/// samples hardly ever stand in memory twice.
const PLACES_AT_A_TIME: usize = 1024;

/// A bound this many times as wide as that of cells already looked at is not worth a closer look. From 1 to this, a tenth of
/// the time is saved.
const NEARLY: f64 = 1.05;

/// A block that waits to be looked at cell by cell.
#[derive(Clone, Copy)]
struct Waiting {
    block: usize,
    /// Not less than it is.
    error: f64,
    /// Nor more.
    is_sure: bool,
}

impl Waiting {
    /// Greater is what has its turn before: of equal errors what is not sure yet, and then the first.
    fn before(&self, other: &Self) -> Ordering {
        let by_error = self.error.total_cmp(&other.error);
        by_error.then(other.is_sure.cmp(&self.is_sure)).then(other.block.cmp(&self.block))
    }
}

/// One brick under way.
struct Brick<C> {
    place: [u32; 3],
    scale: Scale,
    samples: Vec<C>,
    /// The most by which a sample is off from what it is to hold.
    rounding: f64,
    /// The most by which the interpolant of exact distances is off within the band, but for jumps of the sign.
    interpolation: f64,
}

/// The bricks so far, each field by brick.
struct Parts<C> {
    places: Vec<[u32; 3]>,
    scales: Vec<Scale>,
    samples: Vec<C>,
    roundings: Vec<f64>,
    interpolations: Vec<f64>,
}

impl<'a> Plan<'a> {
    /// Measures the distance at the middle of each place of a brick. `band` is a length.
    pub fn new(mesh: &'a MeshDistance<'a>, lattice: &Lattice, band: f64) -> Self {
        Self { mesh, lattice: *lattice, places: BrickMap::measure(mesh, lattice, band) }
    }

    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// How many places of bricks there are.
    pub fn places(&self) -> usize {
        self.places.count()
    }

    /// There will be no more bricks than this.
    pub fn most_bricks(&self) -> usize {
        self.places.most_bricks()
    }

    /// About the most bytes that will be in memory while it is baked, beside the mesh's own.
    pub fn most_bytes<C>(&self) -> usize {
        let of_brick = BRICK_SAMPLES * size_of::<C>() + size_of::<([u32; 3], Scale, [f64; 2], [BlockBounds; 2], f32)>();
        let under_way = self.places().min(PLACES_AT_A_TIME) * (BRICK_SAMPLES * size_of::<C>() + size_of::<Brick<C>>());
        let bricks = self.most_bricks().saturating_mul(of_brick);
        bricks.saturating_add(under_way).saturating_add(self.places.bytes())
    }

    /// The most by which the interpolant of exact distances is off within the band, in the grid that [`Self::bake`] makes.
    /// `None` where that is more than `most`, which is found sooner; or where the sign jumps.
    pub fn interpolation_error(&self, most: f64) -> Option<f64> {
        if !self.mesh.is_continuous() {
            return None;
        }
        let of_place = |index: usize| {
            let place = self.places.place(index);
            let mut guess = 0;
            let error = self.interpolation_error_in(place, |step| {
                let node = std::array::from_fn(|axis| place[axis] * BRICK + step[axis] as u32);
                let nearest = self.mesh.nearest(self.lattice.node(node).into(), guess);
                guess = nearest.guess;
                (nearest.distance, nearest.guess)
            });
            (error <= most).then_some(error)
        };
        let wanted = (0..self.places.count()).into_par_iter().filter(|index| self.places.may_need_brick(*index));
        wanted.map(of_place).try_reduce(|| 0.0, |a, b| Some(a.max(b)))
    }

    /// Wherever the surface is no farther than the band, the grid interpolates the same samples as a dense one of the same
    /// lattice, which never exists. `on_places_done` is told, from any thread, how many more of [`Self::places`] are done.
    /// The result does not depend on the number of threads. Beside the result there is little in memory.
    pub fn bake<C: Quantize>(&self, on_places_done: &(dyn Fn(usize) + Sync)) -> SparseGrid<C> {
        let Self { mesh, lattice, places } = self;
        let mut wanted: Vec<usize> = (0..places.count()).filter(|index| places.may_need_brick(*index)).collect();
        wanted.par_sort_by_cached_key(|index| hilbert_index(places.place(*index)));
        on_places_done(places.count() - wanted.len());
        let mut parts = Parts::with_room_for(self.most_bricks());
        for some in wanted.chunks(PLACES_AT_A_TIME) {
            parts.extend(mesh, some, |packet, index| {
                on_places_done(1);
                self.brick(packet, places.place(index), places.kept_within())
            });
        }
        let mut unpaired_at_boundary: Vec<usize> =
            places.unpaired_at_boundary(&parts.table(places)).into_iter().collect();
        unpaired_at_boundary.sort_unstable_by_key(|index| hilbert_index(places.place(*index)));
        for some in unpaired_at_boundary.chunks(PLACES_AT_A_TIME) {
            parts.extend(mesh, some, |packet, index| self.brick(packet, places.place(index), f64::INFINITY));
        }
        parts.samples.shrink_to_fit();
        let table = parts.table(places);
        let coarse = places.coarse(&table);

        let Parts { places: brick_places, scales, samples, roundings, interpolations } = parts;
        // Not asked for until they are there.
        let no_bounds =
            vec![BlockBounds { range: Interval { lower: 0.0, upper: 0.0 }, slope_bound: 0.0 }; scales.len()];
        let slices =
            BrickSlices { table: &table, scales: &scales, samples: &samples, bounds: &no_bounds, coarse: &coarse };
        let Some(storage) = Sparse::new(lattice, slices) else {
            unreachable!("the table names the bricks that there are")
        };
        let of_brick = |(brick, place): (usize, &[u32; 3])| {
            let around = HaloBlock::new(lattice, *place, |node, row| row_of(&storage, node, row));
            let upper = (0..8_u32).map(|corner| std::array::from_fn(|axis| place[axis] + (corner >> axis & 1)));
            let roundings = upper.filter_map(|place| storage.brick_at(place)).map(|brick| roundings[brick]);
            let rounding = roundings.fold(0.0, f64::max);
            let unpaired_at_boundary =
                if mesh.is_continuous() { 0.0 } else { self.largest_at_sign_change(&around, rounding) };
            // As in `dense`.
            (around.bounds(), round_up(interpolations[brick] + rounding + 2.0 * unpaired_at_boundary))
        };
        let (bounds, errors): (Vec<BlockBounds>, Vec<f32>) = brick_places.par_iter().enumerate().map(of_brick).unzip();
        let slope_bound = slope_bound(lattice, &storage, places, &table, &bounds);
        let error_bound = errors.iter().copied().fold(0.0, f32::max).into();
        SparseGrid { table, places: brick_places, scales, samples, bounds, errors, coarse, slope_bound, error_bound }
    }

    /// The brick at a place, if one of its nodes lies `within` so much of the surface.
    fn brick<C: Quantize>(&self, packet: &mut Packet, place: [u32; 3], within: f64) -> Option<Brick<C>> {
        const SIDE: usize = BRICK as usize;
        let Self { mesh, lattice, places } = self;
        let node = |[x, y, z]: [usize; 3]| {
            let step = [x, y, z].map(|n| n as u32);
            Vector3::from(lattice.node(std::array::from_fn(|axis| place[axis] * BRICK + step[axis])))
        };
        let coarse = places.magnitudes(place);
        let exact_within = places.exact_within();
        // Farther than this, it only matters that it is.
        let far = coarse.iter().copied().fold(places.kept_within(), f64::max);
        let mut exact = [f64::INFINITY; BRICK_SAMPLES];
        let mut wanted = [0.0_f64; BRICK_SAMPLES];
        let nodes = Nodes::of_lattice(lattice, place.map(|n| (n * BRICK) as usize), [SIDE; 3]);
        if !packet.measure(&nodes, within, mesh.measured_within(far)) {
            return None;
        }
        let point = middle(lattice, place.map(|n| n as usize));
        let mut last = AdjacentTriangles { point, nearest: mesh.nearest(point, packet.guess()) };
        for row in 0..SIDE * SIDE {
            for x in 0..SIDE {
                // To and fro, so that the next node is a neighbour.
                let x = if row % 2 == 0 { x } else { SIDE - 1 - x };
                let step = [x, row % SIDE, row / SIDE];
                let index = row * SIDE + x;
                let at = node(step);
                let mut magnitude = f64::INFINITY;
                // The surface lies no nearer than that, so the node is on the same side.
                if last.nearest.distance - (at - last.point).norm() <= far {
                    let nearest = mesh.nearest_in(packet, &nodes, step, Some(last));
                    last = AdjacentTriangles { point: at, nearest };
                    exact[index] = nearest.distance;
                    magnitude = nearest.distance;
                }
                if magnitude > exact_within {
                    magnitude = magnitude.min(interpolate(coarse, step).max(exact_within));
                }
                wanted[index] = if last.nearest.is_inside { -magnitude } else { magnitude };
            }
        }
        if !exact.iter().any(|distance| *distance <= within) && within < f64::INFINITY {
            return None;
        }
        let mut rounded = wanted.map(|distance| distance as f32);
        if mesh.sign_method() == SignMethod::Winding {
            NodeBlock { counts: [SIDE; 3], spacing: lattice.spacing(), position: node }.sign(
                mesh,
                &places.known_around(lattice, place),
                &mut rounded,
            );
        }
        let least = rounded.iter().copied().fold(f32::INFINITY, f32::min);
        let greatest = rounded.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let scale = C::scale(least, greatest);
        let samples: Vec<C> = rounded.iter().map(|sample| C::encode(*sample, scale)).collect();
        let off = |(code, (wanted, rounded)): (&C, (&f64, &f32))| {
            (f64::from(code.decode(scale)) - wanted.abs().copysign(f64::from(*rounded))).abs()
        };
        let rounding = samples.iter().zip(wanted.iter().zip(&rounded)).map(off).fold(0.0, f64::max);
        let interpolation = self.interpolation_error_in(place, |[x, y, z]| {
            let slot = packet.nearest([x, y, z]).slot.map_or(packet.guess(), |slot| slot as usize);
            (exact[(z * SIDE + y) * SIDE + x], slot)
        });
        Some(Brick { place, scale, samples, rounding, interpolation })
    }

    /// In the cells of a place, as far as the band reaches. `nearest` is asked of nodes in the middle of 2 × 2 × 2 cells for the
    /// distance and the triangle of the tree, and may answer anything more than the band and a cell's diagonal where it is that.
    fn interpolation_error_in(&self, place: [u32; 3], mut nearest: impl FnMut([usize; 3]) -> (f64, usize)) -> f64 {
        let spacing = self.lattice.spacing();
        if self.mesh.normals_of_one_solid().is_none() {
            return MAX_ERROR * spacing;
        }
        let mut asked = vec![];
        for step in (0..64).map(|index| [index % 4, index / 4 % 4, index / 16].map(|n: usize| 2 * n + 1)) {
            let node: [u32; 3] = std::array::from_fn(|axis| place[axis] * BRICK + step[axis] as u32);
            // Blocks beyond the last node hold no cell.
            let is_there = (0..3).all(|axis| node[axis] < self.lattice.nodes()[axis]);
            let (distance, slot) = nearest(step);
            if is_there && distance <= self.places.exact_within() {
                let block = ErrorBlock { center: self.lattice.node(node).into(), half_side: spacing };
                asked.push(Query { block, distance, slot });
            }
        }
        let farthest = asked.iter().map(|asked| asked.distance).fold(0.0, f64::max);
        // Their centers are a spacing inside the place.
        let half_side = (0.5 * f64::from(BRICK) - 1.0) * spacing;
        let place = ErrorBlock { center: middle(&self.lattice, place.map(|n| n as usize)), half_side };
        let mut blocks = BrickErrors::new(self.mesh, place, spacing, farthest);
        let measured: Vec<BoundedBlock> = asked.chunks(LANES).flat_map(|asked| blocks.bound_blocks(asked)).collect();
        // The worst first, until it is hardly worse than cells that were looked at one by one. How bad a block is is only found out
        // where it may be the worst.
        let waiting =
            |(block, measured): (usize, &BoundedBlock)| Waiting { block, error: measured.error_bound, is_sure: false };
        let mut waiting: Vec<Waiting> = measured.iter().enumerate().map(waiting).collect();
        let mut of_cells = 0.0_f64;
        while let Some(worst) = waiting.iter_mut().max_by(|a, b| a.before(b)) {
            let block = &measured[worst.block];
            if worst.error <= of_cells {
                break;
            } else if !worst.is_sure {
                *worst = Waiting { error: blocks.block_error(block), is_sure: true, ..*worst };
            } else if worst.error <= NEARLY * of_cells {
                return spacing * worst.error;
            } else {
                of_cells = blocks.cell_error(block, self.places.band(), of_cells);
                worst.error = f64::NEG_INFINITY;
            }
        }
        spacing * of_cells
    }

    /// The largest distance at a corner of a cell that the band may enter and that may have corners of both signs, of the
    /// cells whose first corner is in a place. Samples are off by `rounding` at most.
    fn largest_at_sign_change(&self, around: &HaloBlock, rounding: f64) -> f64 {
        let rounding = round_up(rounding);
        let exact_within = round_up(self.places.exact_within()) + rounding;
        around.largest_at_sign_change(rounding, exact_within.next_up()).into()
    }
}

/// Nodes of one place from the given one on, along x.
fn row_of<C: Quantize>(storage: &Sparse<BrickSlices<C>>, node: [u32; 3], row: &mut [f32]) {
    let Some(brick) = storage.brick_at(node.map(|n| n / BRICK)) else {
        for (x, value) in (node[0]..).zip(row) {
            *value = storage.node([x, node[1], node[2]]);
        }
        return;
    };
    let [x, y, z] = node.map(|n| (n % BRICK) as usize);
    let from = brick * BRICK_SAMPLES + (z * BRICK as usize + y) * BRICK as usize + x;
    let bricks = storage.bricks();
    for (value, code) in row.iter_mut().zip(&bricks.samples[from..]) {
        *value = code.decode(bricks.scales[brick]);
    }
}

impl<C: Quantize> Parts<C> {
    fn with_room_for(bricks: usize) -> Self {
        Self {
            places: Vec::with_capacity(bricks),
            scales: Vec::with_capacity(bricks),
            samples: Vec::with_capacity(bricks * BRICK_SAMPLES),
            roundings: Vec::with_capacity(bricks),
            interpolations: Vec::with_capacity(bricks),
        }
    }

    fn extend(
        &mut self,
        mesh: &MeshDistance,
        places: &[usize],
        brick: impl Fn(&mut Packet, usize) -> Option<Brick<C>> + Sync,
    ) {
        let bricks = places.par_iter().map_init(|| Packet::new(mesh.tree()), |packet, index| brick(packet, *index));
        let bricks: Vec<Brick<C>> = bricks.flatten().collect();
        for brick in bricks {
            self.places.push(brick.place);
            self.scales.push(brick.scale);
            self.samples.extend(brick.samples);
            self.roundings.push(brick.rounding);
            self.interpolations.push(brick.interpolation);
        }
    }

    /// For each place which of the bricks it is.
    fn table(&self, places: &BrickMap) -> Vec<u32> {
        let mut table = vec![NO_BRICK; places.count()];
        for (number, place) in (0..).zip(&self.places) {
            table[places.index(*place)] = number;
        }
        table
    }
}

/// What the coarse grid gives at a node of a place.
fn interpolate(corners: [f64; 8], step: [usize; 3]) -> f64 {
    let mix = |a: f64, b: f64, axis: usize| a + (b - a) * (step[axis] as f64 / f64::from(BRICK));
    let along_x: [f64; 4] = std::array::from_fn(|edge| mix(corners[2 * edge], corners[2 * edge + 1], 0));
    mix(mix(along_x[0], along_x[1], 1), mix(along_x[2], along_x[3], 1), 2)
}

/// Over all cells: those with a corner in a brick, and those that lie in one cell of the coarse grid and are no steeper, but
/// for the rounding of what is interpolated there in f32.
fn slope_bound<C: Quantize>(
    lattice: &Lattice,
    storage: &Sparse<BrickSlices<C>>,
    places: &BrickMap,
    table: &[u32],
    bricks: &[BlockBounds],
) -> f64 {
    let of_absent = |index: usize| {
        let corners = storage.coarse_corners(places.place(index));
        let largest = corners.iter().fold(0.0_f32, |most, corner| most.max(corner.abs()));
        let rounding = COARSE_DIFFERENCE_ROUNDING * f64::from(largest) / lattice.spacing();
        cell_slope(corners, lattice.spacing() * f64::from(BRICK)) + 3.0_f64.sqrt() * rounding
    };
    let absent = (0..table.len()).into_par_iter().filter(|index| table[*index] == NO_BRICK);
    let of_absent = absent.map(of_absent).reduce(|| 0.0, f64::max);
    let inside = bricks.iter().map(|nodes| f64::from(nodes.slope_bound)).fold(of_absent, f64::max);
    slope_bound_with_outside(inside, inside_reaches_box(lattice, |node| storage.node(node)))
}
