//! NanoVDB level sets of f32 (grid type float), versions 32.3 to 32.9, not packed. Every offset is checked before it is followed.
//!
//! The lattice spans all leaves. Nodes outside of them have the value of the tile that covers them, or the background. Leaves of a level set
//! may hold larger values, as ours do: they end a cell's diagonal beyond the background, so that cells in the band keep their values, and the
//! field is not steep where the leaves end.

use std::collections::HashSet;

use super::{ImportError, Volume, refused, require_finite, room};
use crate::export::nvdb::{FLOAT, LEVEL_SET, MAGIC, size};

/// Magic numbers of a file; of later versions with a number of its own.
const FILE_MAGICS: [&[u8; 8]; 2] = [&MAGIC, b"NanoVDB2"];

/// Most bytes of samples for a byte of the file: hostile files have two leaves far apart.
const MAX_EXPANSION: f64 = 1000.0;

/// Reads the first grid of a file. Takes at most `max_bytes` for the samples.
pub fn nvdb(bytes: &[u8], max_bytes: f64) -> Result<Volume, ImportError> {
    let grid = first_grid(bytes)?;
    let type_and_class = [grid.u32(636)?, grid.u32(632)?];
    if type_and_class[0] != FLOAT {
        return refused(format!("its grid type is {}: only float grids (type 1) are read", type_and_class[0]));
    }
    let matrix: Vec<f64> = (0..9).map(|index| grid.f64(296 + 88 + 8 * index)).collect::<Result<_, _>>()?;
    let spacing = matrix[0];
    let is_uniform = (0..9).all(|index| matrix[index] == if index % 4 == 0 { spacing } else { 0.0 });
    if !(is_uniform && spacing.is_finite() && spacing > 0.0) {
        return refused("its voxels are not cubes along the axes: resample it first");
    }
    let shift = [0, 1, 2].map(|axis| grid.f64(296 + 88 + 144 + 8 * axis));
    let shift = [shift[0].clone()?, shift[1].clone()?, shift[2].clone()?];
    let root = size::GRID.saturating_add(grid.offset(size::GRID + 24)?);
    let tiles = grid.u32(root.saturating_add(24))? as usize;
    let background = grid.f32(root.saturating_add(28))?.abs();
    let (mut tree, mut blocks) = (Parts::default(), HashSet::new());
    for tile in 0..tiles {
        let at = root.saturating_add(size::ROOT).saturating_add(tile.saturating_mul(size::TILE));
        let (key, child) = (grid.u64(at)?, grid.offset(at.saturating_add(8))?);
        // 21 bits an axis, of which each is a signed number of blocks of 4096.
        let block = |shift: u32| ((key >> shift & 0x1f_ffff) as i64) << 43 >> 43 << 12;
        if child != 0 {
            let place = [block(42), block(21), block(0)];
            // What lies there is filled once.
            if !blocks.insert(place) {
                return refused("two of its blocks are at one place");
            }
            tree.node(&grid, root.saturating_add(child), place, Level::Upper)?;
        }
    }
    let Some((first, last)) = tree.bounds() else { return refused("it has no leaves") };
    let counts = std::array::from_fn(|axis| (last[axis] - first[axis] + 1) as u64);
    let origin = std::array::from_fn(|axis| shift[axis] + spacing * first[axis] as f64);
    // A narrow band fills a small part of its box, but no file of a mesh fills a thousandth of it.
    let lattice = room(origin, spacing, counts, max_bytes.min(MAX_EXPANSION * bytes.len() as f64))?;
    let mut samples = vec![background; lattice.node_count()];
    let [nx, ny, nz] = lattice.nodes().map(|n| n as usize);
    for (place, side, value) in &tree.tiles {
        let range = |axis: usize, count: usize| {
            let from = (place[axis] - first[axis]).clamp(0, count as i64) as usize;
            from..(place[axis] + side - first[axis]).clamp(0, count as i64) as usize
        };
        for z in range(2, nz) {
            for y in range(1, ny) {
                let row = (z * ny + y) * nx;
                samples[row..row + nx][range(0, nx)].fill(*value);
            }
        }
    }
    let most = match type_and_class[1] {
        LEVEL_SET => background + (3_f64.sqrt() * spacing) as f32,
        _ => f32::INFINITY,
    };
    for (place, at) in &tree.leaves {
        let values = grid.part(at + 96, 4 * 512)?;
        let corner: [usize; 3] = std::array::from_fn(|axis| (place[axis] - first[axis]) as usize);
        for (index, value) in values.as_chunks::<4>().0.iter().enumerate() {
            let node = [corner[0] + (index >> 6), corner[1] + (index >> 3 & 7), corner[2] + (index & 7)];
            let value = f32::from_le_bytes(*value);
            let is_far = value.is_finite() && value.abs() > most;
            samples[(node[2] * ny + node[1]) * nx + node[0]] = if is_far { most.copysign(value) } else { value };
        }
    }
    require_finite(&samples)?;
    Ok(Volume { lattice, samples, background: Some(background) })
}

/// The bytes of the first grid.
fn first_grid(bytes: &[u8]) -> Result<Bytes<'_>, ImportError> {
    let file = Bytes(bytes);
    if !FILE_MAGICS.iter().any(|magic| bytes.starts_with(*magic)) {
        return refused("not a NanoVDB file");
    }
    let codec = file.u32(12)? >> 16;
    if codec != 0 {
        return refused(
            "it is packed: unpack it by `nanovdb_convert packed.nvdb t.vdb` and `nanovdb_convert t.vdb unpacked.nvdb`",
        );
    }
    // The metadata of all grids, each with its name, stand before the first grid.
    let grids = file.u32(12)? & 0xffff;
    let mut at = size::FILE;
    for _ in 0..grids {
        at = at.saturating_add(size::META).saturating_add(file.u32(at.saturating_add(136))? as usize);
    }
    let grid = Bytes(bytes.get(at..).unwrap_or_default());
    let length = grid.offset(32)?;
    Ok(Bytes(grid.part(0, length)?))
}

/// Bytes with a length that every access is held against.
#[derive(Clone, Copy)]
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn part(&self, at: usize, length: usize) -> Result<&'a [u8], ImportError> {
        let found = self.0.get(at..).and_then(|rest| rest.get(..length));
        found.ok_or_else(|| ImportError("cut off, or an offset leads out of it".to_owned()))
    }

    fn array<const N: usize>(&self, at: usize) -> Result<[u8; N], ImportError> {
        let mut array = [0; N];
        array.copy_from_slice(self.part(at, N)?);
        Ok(array)
    }

    fn u32(&self, at: usize) -> Result<u32, ImportError> {
        self.array(at).map(u32::from_le_bytes)
    }

    fn u64(&self, at: usize) -> Result<u64, ImportError> {
        self.array(at).map(u64::from_le_bytes)
    }

    fn f32(&self, at: usize) -> Result<f32, ImportError> {
        self.array(at).map(f32::from_le_bytes)
    }

    fn f64(&self, at: usize) -> Result<f64, ImportError> {
        self.array(at).map(f64::from_le_bytes)
    }

    /// An offset that lies within.
    fn offset(&self, at: usize) -> Result<usize, ImportError> {
        match usize::try_from(self.u64(at)?) {
            Ok(offset) if offset <= self.0.len() => Ok(offset),
            _ => refused("an offset leads out of it"),
        }
    }
}

/// Kinds of internal nodes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Level {
    Upper,
    Lower,
}

/// Leaves with their bytes' offset, and tiles with their side and value. Places are their first nodes.
#[derive(Default)]
struct Parts {
    /// Bytes of the nodes and leaves that were visited.
    bytes: usize,
    leaves: Vec<([i64; 3], usize)>,
    tiles: Vec<([i64; 3], i64, f32)>,
}

impl Parts {
    /// Collects the children of an internal node at an offset.
    fn node(&mut self, grid: &Bytes, at: usize, place: [i64; 3], level: Level) -> Result<(), ImportError> {
        self.take(grid, if level == Level::Upper { size::UPPER } else { size::LOWER })?;
        // Children along a side as a power of two, the side of a child in nodes, bytes of a mask, offset of the table.
        let (log, side, mask_bytes, table) = match level {
            Level::Upper => (5, 128, 4096, 8256),
            Level::Lower => (4, 8, 512, 1088),
        };
        let mask = grid.part(at.saturating_add(32 + mask_bytes), mask_bytes)?;
        let table = grid.part(at.saturating_add(table), 64 * mask_bytes)?;
        for (index, entry) in table.as_chunks::<8>().0.iter().enumerate() {
            let step = |shift: usize| side * (index >> shift & ((1 << log) - 1)) as i64;
            let child = [place[0] + step(2 * log), place[1] + step(log), place[2] + step(0)];
            if mask[index / 8] >> (index % 8) & 1 == 0 {
                let value = f32::from_le_bytes([entry[0], entry[1], entry[2], entry[3]]);
                if value < 0.0 {
                    self.tiles.push((child, side, value));
                }
                continue;
            }
            let offset = usize::try_from(i64::from_le_bytes(*entry)).unwrap_or(usize::MAX);
            // Nodes of the next level stand behind: a tree cannot lead in circles.
            let at = at.saturating_add(offset);
            match level {
                _ if offset == 0 => return refused("a node of its tree is its own child"),
                Level::Upper => self.node(grid, at, child, Level::Lower)?,
                Level::Lower => {
                    self.take(grid, size::LEAF)?;
                    grid.part(at, size::LEAF)?;
                    self.leaves.push((child, at));
                }
            }
        }
        Ok(())
    }

    /// Counts the bytes of a node or leaf, each of which has its own.
    fn take(&mut self, grid: &Bytes, bytes: usize) -> Result<(), ImportError> {
        self.bytes = self.bytes.saturating_add(bytes);
        if self.bytes <= grid.0.len() { Ok(()) } else { refused("its nodes overlap") }
    }

    /// First and last node of all leaves.
    fn bounds(&self) -> Option<([i64; 3], [i64; 3])> {
        let first = |axis: usize| self.leaves.iter().map(|(place, _)| place[axis]).min();
        let last = |axis: usize| self.leaves.iter().map(|(place, _)| place[axis] + 7).max();
        Some(([first(0)?, first(1)?, first(2)?], [last(0)?, last(1)?, last(2)?]))
    }
}
