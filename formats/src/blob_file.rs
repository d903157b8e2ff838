//! Blobs: grids as one little-endian file that is read where it lies. The format is described at [`sdf_core::grid::blob`].

use std::borrow::Cow;

use sdf_core::grid::blob::{
    BlobBricks, BlobCode, BlobDense, BlobError, BlobStorage, CHECKSUM_AT, HEAD_BYTES, MAGIC, VERSION, checksum,
};
use sdf_core::grid::owned::{BlockCode, OwnedBricks, OwnedCode, OwnedGrid, OwnedStorage};
use sdf_core::grid::sparse::{BrickData, NO_BRICK, Scale, Sparse, brick_counts};
use sdf_core::grid::{Blob, BlockBounds, Grid, Precision};
use sdf_core::{Parameter, Sdf};

/// A grid from a blob.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredBlob {
    /// The grid, with the bits of the one that was written; samples of a dense one with a scale for all are decoded.
    pub grid: OwnedGrid,
    /// Type of the samples in the blob.
    pub precision: Precision,
    /// The shape lies at least this far inside the box, on every side.
    pub padding: f64,
}

/// `true` of bytes that begin as a blob does.
pub fn is_blob(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// The grid in the bytes of a blob. It takes at most four times their memory.
pub fn read(bytes: &[u8]) -> Result<StoredBlob, BlobError> {
    let blob = Blob::open(bytes)?;
    let grid = blob.grid();
    let lattice = grid.lattice();
    let storage = match grid.storage() {
        BlobStorage::DenseF32(dense) => owned_dense(&grid, dense),
        BlobStorage::DenseU16(dense) => owned_dense(&grid, dense),
        BlobStorage::DenseU8(dense) => owned_dense(&grid, dense),
        BlobStorage::SparseF32(sparse) => {
            owned_bricks(&grid, sparse, f32::from_le_bytes).and_then(|bricks| OwnedStorage::sparse(lattice, bricks))
        }
        BlobStorage::SparseU16(sparse) => owned_codes(&grid, owned_bricks(&grid, sparse, u16::from_le_bytes)),
        BlobStorage::SparseU8(sparse) => owned_codes(&grid, owned_bricks(&grid, sparse, |code: u8| code)),
    };
    // Numbers that only f64 can be wrong in: f32 was checked.
    let owned = storage.and_then(|storage| OwnedGrid::new(*lattice, storage, grid.slope_bound()));
    let owned = owned.ok_or(BlobError::Brick)?;
    let owned =
        owned.with_band(grid.band()).with_error_bound(grid.global_error_bound()).with_deep_error(grid.deep_error());
    Ok(StoredBlob { grid: owned, precision: blob.precision(), padding: blob.padding() })
}

fn owned_dense<C: BlobCode>(grid: &Grid<BlobStorage>, dense: &BlobDense<C>) -> Option<OwnedStorage> {
    OwnedStorage::dense(grid.lattice(), dense.samples().collect(), dense.bounds().collect())
}

/// A grid of codes: dense where all slots have a brick and there is no band.
fn owned_codes<C: BlockCode>(grid: &Grid<BlobStorage>, bricks: Option<OwnedBricks<C>>) -> Option<OwnedStorage> {
    let bricks = bricks?.into_storage(grid.lattice())?;
    let is_dense = grid.band() == f64::INFINITY && bricks.bricks().table.iter().all(|brick| brick != NO_BRICK);
    if is_dense { OwnedStorage::dense_bricks(bricks) } else { Some(C::storage(bricks)) }
}

/// `None` unless each brick stands in exactly one slot.
fn owned_bricks<B: BlobCode, C: OwnedCode>(
    grid: &Grid<BlobStorage>,
    sparse: &Sparse<BlobBricks<B>>,
    decode: impl Fn(B) -> C,
) -> Option<OwnedBricks<C>> {
    let bricks = sparse.bricks();
    let counts = brick_counts(grid.lattice());
    let table: Vec<u32> = bricks.table().collect();
    let mut slots = vec![[NO_BRICK; 3]; bricks.count()];
    for (slot, brick) in (0_u32..).zip(&table).filter(|(_, brick)| **brick != NO_BRICK) {
        let row = slot / counts[0];
        let place =
            std::mem::replace(&mut slots[*brick as usize], [slot % counts[0], row % counts[1], row / counts[1]]);
        if place != [NO_BRICK; 3] {
            return None;
        }
    }
    if slots.contains(&[NO_BRICK; 3]) {
        return None;
    }
    let each = 0..bricks.count();
    let errors: Vec<f32> = each.clone().map_while(|brick| bricks.error_of_brick(brick)).collect();
    let owned = OwnedBricks {
        table: OwnedBricks::<C>::table_of(counts, &slots)?,
        slots,
        scales: each.clone().map_while(|brick| bricks.scale(brick)).collect(),
        samples: bricks.codes().iter().map(|code| decode(*code)).collect(),
        bounds: each.map_while(|brick| bricks.bounds_of_brick(brick)).collect(),
        errors: if errors.len() == bricks.count() { errors } else { vec![] },
        coarse: OwnedBricks::<C>::coarse_of(counts, &bricks.coarse().collect::<Vec<_>>())?,
    };
    Some(owned)
}

/// Codes that stand for the samples of a dense grid: u16 or u8, with one scale for all.
#[derive(Clone, Debug, PartialEq)]
pub enum DenseCodes {
    /// 65,536 steps.
    U16(Vec<u16>, Scale),
    /// 256 steps.
    U8(Vec<u8>, Scale),
}

/// The bytes of a blob. `codes` replace the samples of a dense grid, whose bounds then hold for them. `None` if a number is too large
/// for f32 or not finite, or the blob too large for its counts: whatever [`read`] would refuse.
pub fn write(grid: &OwnedGrid, codes: Option<&DenseCodes>, padding: f64) -> Option<Vec<u8>> {
    let lattice = grid.lattice();
    let precision = match codes {
        None => grid.storage().precision(),
        Some(DenseCodes::U16(..)) => Precision::U16,
        Some(DenseCodes::U8(..)) => Precision::U8,
    };
    let scale = match codes {
        None => Scale { base: 0.0, step: 1.0 },
        Some(DenseCodes::U16(_, scale) | DenseCodes::U8(_, scale)) => *scale,
    };
    // A dense grid of codes is written as it is held: as bricks in all slots.
    let bricks = grid.storage().scales().len();
    let layout = u8::from(bricks > 0);
    let sample_bytes = match precision {
        Precision::F32 => 4,
        Precision::U16 => 2,
        Precision::U8 => 1,
    };
    let bricks = u32::try_from(bricks).ok()?;
    let (spacing, inv_spacing) = (lattice.spacing(), lattice.inv_spacing());
    let [x, y, z] = lattice.origin();
    let numbers = [x, y, z, spacing, inv_spacing, grid.slope_bound(), grid.band()].map(Parameter::from);

    let mut bytes = Vec::new();
    bytes.extend(MAGIC);
    bytes.extend([VERSION, layout, sample_bytes, 0]);
    words(&mut bytes, lattice.nodes());
    words(&mut bytes, [bricks]);
    floats(&mut bytes, numbers.map(|number| number.single));
    floats(&mut bytes, [scale.base, scale.step]);
    words(&mut bytes, [0]);
    debug_assert_eq!(bytes.len(), HEAD_BYTES);
    let double = numbers.map(|number| number.double).into_iter();
    // A blob has no place for what is not known outside alone.
    let error_bound = if grid.inside_reaches_box() { f64::INFINITY } else { grid.global_error_bound() };
    let errors = [error_bound, grid.deep_error(), padding];
    bytes.extend(double.chain(errors).flat_map(f64::to_le_bytes));
    match (grid.storage(), codes) {
        (OwnedStorage::Dense(dense), codes) => {
            write_bounds(&mut bytes, dense.bounds());
            match codes {
                None => floats(&mut bytes, dense.storage().samples().iter().copied()),
                Some(DenseCodes::U16(codes, _)) => bytes.extend(codes.iter().flat_map(|code| code.to_le_bytes())),
                Some(DenseCodes::U8(codes, _)) => bytes.extend(codes),
            }
        }
        (OwnedStorage::SparseF32(sparse), _) => write_bricks(&mut bytes, sparse.bricks(), f32::to_le_bytes),
        (OwnedStorage::DenseU16(bricks) | OwnedStorage::SparseU16(bricks), _) => {
            write_bricks(&mut bytes, bricks.bricks(), u16::to_le_bytes);
        }
        (OwnedStorage::DenseU8(bricks) | OwnedStorage::SparseU8(bricks), _) => {
            write_bricks(&mut bytes, bricks.bricks(), u8::to_le_bytes);
        }
    }
    let checksum = checksum(&bytes);
    bytes[CHECKSUM_AT..HEAD_BYTES].copy_from_slice(&checksum.to_le_bytes());
    Blob::open(&bytes).is_ok().then_some(bytes)
}

fn write_bricks<C: Copy, const N: usize>(bytes: &mut Vec<u8>, bricks: &OwnedBricks<C>, encode: impl Fn(C) -> [u8; N]) {
    let OwnedBricks { table, scales, samples, bounds, errors, coarse, .. } = bricks;
    words(bytes, table.iter());
    floats(bytes, scales.iter().flat_map(|scale| [scale.base, scale.step]));
    write_bounds(bytes, bounds);
    let unknown = || Cow::Owned(vec![f32::INFINITY; scales.len()]);
    let errors = if errors.len() == scales.len() { Cow::Borrowed(errors) } else { unknown() };
    floats(bytes, errors.iter().copied());
    floats(bytes, coarse.iter());
    bytes.extend(samples.iter().flat_map(|code| encode(*code)));
}

fn write_bounds(bytes: &mut Vec<u8>, bounds: &[BlockBounds]) {
    floats(bytes, bounds.iter().flat_map(|block| [block.range.lower, block.range.upper, block.slope_bound]));
}

fn words(bytes: &mut Vec<u8>, words: impl IntoIterator<Item = u32>) {
    bytes.extend(words.into_iter().flat_map(u32::to_le_bytes));
}

fn floats(bytes: &mut Vec<u8>, floats: impl IntoIterator<Item = f32>) {
    bytes.extend(floats.into_iter().flat_map(f32::to_le_bytes));
}
