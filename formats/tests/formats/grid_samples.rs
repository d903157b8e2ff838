//! Grids to write and read.

use sdf_core::Interval;
use std::path::Path;

use sdf_core::grid::owned::{Blocks, DenseBlocks, OwnedBricks, OwnedGrid, OwnedStorage, Precision};
use sdf_core::grid::sparse::{Code, NO_BRICK, Scale, brick_counts};
use sdf_core::grid::{BlockBounds, Dense, Lattice, Storage, WithBlockBounds, cell_slope};
use sdf_formats::grid_file::{
    self, About, DeepValues, DenseBlockSamples, Samples, SignMethod, Source, SparseInfo, SparseSamples,
};

/// A grid to be written.
#[derive(Clone)]
pub struct Made {
    pub lattice: Lattice,
    pub content: Content,
}

#[derive(Clone)]
pub enum Content {
    Dense { distances: Vec<f32>, bounds: Vec<BlockBounds> },
    DenseU16(DenseBlocks<u16>),
    DenseU8(DenseBlocks<u8>),
    F32(OwnedBricks<f32>),
    U16(OwnedBricks<u16>),
    U8(OwnedBricks<u8>),
}

pub const BAND: f64 = 0.25;
pub const DEEP: DeepValues = DeepValues::Distances;

/// Layout and precision of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Dense(Precision),
    Sparse(Precision),
}

pub const DENSE: Kind = Kind::Dense(Precision::F32);
pub const SPARSE_U16: Kind = Kind::Sparse(Precision::U16);

pub const KINDS: [Kind; 6] = [
    DENSE,
    Kind::Dense(Precision::U16),
    Kind::Dense(Precision::U8),
    Kind::Sparse(Precision::F32),
    SPARSE_U16,
    Kind::Sparse(Precision::U8),
];

impl Made {
    /// A lumpy sphere.
    pub fn new(nodes: [u32; 3], kind: Kind) -> Self {
        let (lattice, distances) = lumpy_sphere(nodes);
        let u16_scale = |least, greatest| Scale { base: least, step: (greatest - least) / 65535.0 };
        let u8_scale = |least, greatest| Scale { base: least, step: (greatest - least) / 255.0 };
        let as_u16 = |x, scale| encode(x, scale) as u16;
        let as_u8 = |x, scale| encode(x, scale) as u8;
        let (band, all) = (BAND, f64::INFINITY);
        let content = match kind {
            Kind::Dense(Precision::F32) => dense(&lattice, distances),
            Kind::Dense(Precision::U16) => {
                Content::DenseU16(blocks(sparse(&lattice, &distances, all, u16_scale, as_u16)))
            }
            Kind::Dense(Precision::U8) => Content::DenseU8(blocks(sparse(&lattice, &distances, all, u8_scale, as_u8))),
            Kind::Sparse(Precision::F32) => {
                Content::F32(sparse(&lattice, &distances, band, |_, _| Scale { base: 0.0, step: 1.0 }, |x, _| x))
            }
            Kind::Sparse(Precision::U16) => Content::U16(sparse(&lattice, &distances, band, u16_scale, as_u16)),
            Kind::Sparse(Precision::U8) => Content::U8(sparse(&lattice, &distances, band, u8_scale, as_u8)),
        };
        Self { lattice, content }
    }

    pub fn samples(&self) -> Samples<'_> {
        match &self.content {
            Content::Dense { distances, bounds } => Samples::Dense { distances, bounds },
            Content::DenseU16(blocks) => Samples::DenseU16(lent_blocks(blocks)),
            Content::DenseU8(blocks) => Samples::DenseU8(lent_blocks(blocks)),
            Content::F32(bricks) => lent(bricks).into(),
            Content::U16(bricks) => lent(bricks).into(),
            Content::U8(bricks) => lent(bricks).into(),
        }
    }

    /// The grid that reading must return.
    pub fn grid(&self) -> OwnedGrid {
        let lattice = &self.lattice;
        let samples = match self.content.clone() {
            Content::Dense { distances, bounds } => {
                let dense = Dense::new(lattice, distances).unwrap();
                OwnedStorage::Dense(WithBlockBounds::new(lattice, dense, bounds).unwrap())
            }
            Content::DenseU16(blocks) => OwnedStorage::dense_blocks(lattice, blocks).unwrap(),
            Content::DenseU8(blocks) => OwnedStorage::dense_blocks(lattice, blocks).unwrap(),
            Content::F32(bricks) => OwnedStorage::SparseF32(bricks.into_storage(lattice).unwrap()),
            Content::U16(bricks) => OwnedStorage::SparseU16(bricks.into_storage(lattice).unwrap()),
            Content::U8(bricks) => OwnedStorage::SparseU8(bricks.into_storage(lattice).unwrap()),
        };
        let band = self.sparse().map_or(f64::INFINITY, |sparse| sparse.band);
        let grid = OwnedGrid::new(*lattice, samples, about().slope_bound).unwrap();
        let deep_error = self.sparse().map_or(f64::INFINITY, |sparse| sparse.deep_values.deep_error(lattice.spacing()));
        grid.with_band(band).with_error_bound(about().error_bound).with_deep_error(deep_error)
    }

    pub fn sparse(&self) -> Option<SparseInfo> {
        let sparse = |precision, bricks| Some(SparseInfo { band: BAND, precision, bricks, deep_values: DEEP });
        match &self.content {
            Content::Dense { .. } | Content::DenseU16(_) | Content::DenseU8(_) => None,
            Content::F32(bricks) => sparse(Precision::F32, bricks.slots.len()),
            Content::U16(bricks) => sparse(Precision::U16, bricks.slots.len()),
            Content::U8(bricks) => sparse(Precision::U8, bricks.slots.len()),
        }
    }

    /// The bricks of a grid in u16.
    pub fn u16_bricks(&self) -> SparseSamples<'_, u16> {
        match &self.content {
            Content::U16(bricks) => lent(bricks),
            _ => panic!("another precision"),
        }
    }

    pub fn write(&self, path: &Path) {
        grid_file::write(path, &self.lattice, self.samples(), &about()).unwrap();
    }
}

pub fn lent_blocks<C>(blocks: &DenseBlocks<C>) -> DenseBlockSamples<'_, C> {
    let DenseBlocks { slots, scales, samples, bounds } = blocks;
    DenseBlockSamples { slots, scales, samples, bounds }
}

/// Bricks that are in all slots.
fn blocks<C>(bricks: OwnedBricks<C>) -> DenseBlocks<C> {
    let OwnedBricks { slots, scales, samples, bounds, .. } = bricks;
    DenseBlocks { slots, scales, samples, bounds }
}

pub fn lent<C>(bricks: &OwnedBricks<C>) -> SparseSamples<'_, C> {
    let OwnedBricks { slots, scales, samples, bounds, errors, coarse, .. } = bricks;
    // A test may leak what lives as long as it does.
    let coarse = coarse.to_vec().leak();
    SparseSamples { band: BAND, deep_values: DEEP, slots, scales, samples, bounds, errors, coarse }
}

fn dense(lattice: &Lattice, distances: Vec<f32>) -> Content {
    let bounds = {
        let storage = Dense::new(lattice, &distances[..]).unwrap();
        let [px, py, pz] = brick_counts(lattice);
        slots([px, py, pz]).map(|slot| slot_bounds(lattice, &storage, slot)).collect()
    };
    Content::Dense { distances, bounds }
}

/// Bricks where a sample is within the band, last slot first to differ from any other order, over a coarse grid of
/// every eighth sample.
fn sparse<C: Code>(
    lattice: &Lattice,
    distances: &[f32],
    band: f64,
    scale: impl Fn(f32, f32) -> Scale,
    encode: impl Fn(f32, Scale) -> C,
) -> OwnedBricks<C> {
    let nodes = lattice.nodes();
    let [px, py, pz] = brick_counts(lattice);
    let sample = |node: [u32; 3]| distances[lattice.index(std::array::from_fn(|axis| node[axis].min(nodes[axis] - 1)))];
    let mut coarse = Vec::new();
    for [x, y, z] in slots([px + 1, py + 1, pz + 1]) {
        coarse.push(0.75 * sample([8 * x, 8 * y, 8 * z]));
    }
    let mut bricks = OwnedBricks {
        table: Blocks::new([px, py, pz], NO_BRICK).unwrap(),
        slots: Vec::new(),
        scales: Vec::new(),
        samples: Vec::new(),
        bounds: Vec::new(),
        errors: Vec::new(),
        coarse: OwnedBricks::<C>::coarse_of([px, py, pz], &coarse).unwrap(),
    };
    let all: Vec<[u32; 3]> = slots([px, py, pz]).collect();
    for slot in all.into_iter().rev() {
        let [x, y, z] = slot.map(|index| 8 * index);
        let samples: Vec<f32> = slots([8; 3]).map(|[i, j, k]| sample([x + i, y + j, z + k])).collect();
        if samples.iter().all(|sample| f64::from(sample.abs()) > band) {
            continue;
        }
        let [least, greatest] =
            [f32::min, f32::max].map(|pick: fn(f32, f32) -> f32| samples.iter().copied().reduce(pick).unwrap());
        let scale = scale(least, greatest);
        bricks.table.set(slot, bricks.slots.len() as u32);
        bricks.slots.push(slot);
        bricks.scales.push(scale);
        bricks.samples.extend(samples.iter().map(|sample| encode(*sample, scale)));
        bricks.errors.push(scale.step / 2.0);
    }
    let nothing = BlockBounds { range: Interval { lower: 0.0, upper: 0.0 }, slope_bound: 0.0 };
    bricks.bounds = vec![nothing; bricks.slots.len()];
    let sparse = bricks.into_storage(lattice).unwrap();
    let bounds = sparse.bricks().slots.iter().map(|slot| slot_bounds(lattice, &sparse, *slot)).collect();
    OwnedBricks { bounds, ..sparse.bricks().clone() }
}

fn encode(sample: f32, scale: Scale) -> f32 {
    if scale.step > 0.0 { ((sample - scale.base) / scale.step).round() } else { 0.0 }
}

/// All indices below the counts, x fastest.
fn slots([px, py, pz]: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    (0..pz).flat_map(move |z| (0..py).flat_map(move |y| (0..px).map(move |x| [x, y, z])))
}

/// Bounds over all cells with a corner in the brick slot: wider than necessary.
fn slot_bounds(lattice: &Lattice, storage: &impl Storage, slot: [u32; 3]) -> BlockBounds {
    let first = slot.map(|index| (8 * index).saturating_sub(1));
    let cells = lattice.cells();
    let last: [u32; 3] = std::array::from_fn(|axis| (8 * slot[axis] + 7).min(cells[axis] - 1));
    let counts = std::array::from_fn(|axis| last[axis] + 1 - first[axis].min(last[axis]));
    let nothing = BlockBounds::EMPTY;
    slots(counts).fold(nothing, |bounds, step| {
        let cell = std::array::from_fn(|axis| first[axis].min(last[axis]) + step[axis]);
        let corners = storage.corners(cell);
        bounds.union(BlockBounds {
            range: Interval {
                lower: corners.into_iter().fold(f32::INFINITY, f32::min),
                upper: corners.into_iter().fold(f32::NEG_INFINITY, f32::max),
            },
            slope_bound: cell_slope(corners, lattice.spacing()) as f32 * 1.000001,
        })
    })
}

/// The distance to a lumpy sphere of radius 1.5, in a box around it.
pub fn lumpy_sphere(nodes: [u32; 3]) -> (Lattice, Vec<f32>) {
    let spacing = 4.0 / f64::from(nodes.into_iter().max().unwrap() - 1);
    let lattice = Lattice::new([-2.0, -2.1, -1.9], spacing, nodes).unwrap();
    let mut distances = Vec::with_capacity(lattice.node_count());
    for k in 0..nodes[2] {
        for j in 0..nodes[1] {
            for i in 0..nodes[0] {
                let [x, y, z] = lattice.node([i, j, k]);
                let lumps = 0.05 * (7.0 * x).sin() * (5.0 * y).cos() * (6.0 * z + 1.0).sin();
                distances.push(((x * x + y * y + z * z).sqrt() - 1.5 + lumps) as f32);
            }
        }
    }
    (lattice, distances)
}

pub fn about() -> About {
    About {
        sign_method: SignMethod::Winding,
        sign_reason: "2 open edges, so the winding number decides; größer als ½".into(),
        slope_bound: 3.5,
        error_bound: 0.0625 + 1e-9,
        inside_reaches_box: false,
        error_regions: None,
        padding: 0.4375,
        source: Source {
            name: "lumpy sphere.obj".into(),
            sha256: std::array::from_fn(|i| i as u8 * 7),
            triangles: 69451,
        },
        tool: "sdftool 0.1.0".into(),
        options: String::new(),
    }
}
