use flate2::{Decompress, FlushDecompress, Status};

use super::bytes::{Bytes, Fields};
use super::object::Object;
use crate::grid_file::Fault;

const DATASPACE: u16 = 0x01;
const DATATYPE: u16 = 0x03;
const EXTERNAL_FILES: u16 = 0x07;
const LAYOUT: u16 = 0x08;
const FILTERS: u16 = 0x0b;

/// The head of a filter's description, its name left out.
const SHUFFLE: u16 = 2;
const DEFLATE: u16 = 1;

/// What one byte of deflate makes at most: 258 bytes of 2 bits.
const MOST_EXPANSION: u64 = 1032;

/// A tree of HDF5's default rank, half filled, has 10⁹ chunks at this level.
const MOST_LEVEL: u8 = 5;

/// The bytes of an entry in the chunk tree: stored size, filter mask, four offsets; then the address.
const KEY_BYTES: usize = 40;
const ENTRY_BYTES: usize = KEY_BYTES + 8;

/// A three-dimensional dataset of f32, chunked, shuffled and deflated, all its chunks known to lie in the file.
pub(in crate::grid_file) struct Dataset {
    /// Along z, y and x.
    shape: [usize; 3],
    chunk_shape: [usize; 3],
    /// Chunks along z, y and x.
    chunk_counts: [usize; 3],
    /// The chunk along x runs fastest.
    chunks: Vec<Chunk>,
}

#[derive(Clone, Copy)]
struct Chunk {
    address: u64,
    stored_bytes: usize,
}

impl Dataset {
    /// Reads where the chunks are. Whatever is declared, the file has stored at least 1/1032 of it.
    pub(super) fn open(bytes: &mut Bytes, object: &Object) -> Result<Self, Fault> {
        let (Some(space), Some(kind), Some(layout), Some(filters), None) = (
            object.only(DATASPACE),
            object.only(DATATYPE),
            object.only(LAYOUT),
            object.only(FILTERS),
            object.all(EXTERNAL_FILES).next(),
        ) else {
            return Err(Fault::not_a_grid("its samples are not a chunked, shuffled and deflated dataset"));
        };
        expect_f32(kind)?;
        expect_filters(filters)?;
        let shape = shape(space)?;
        let (chunk_shape, tree) = layout_of(layout, shape)?;
        let chunk_counts = std::array::from_fn(|axis| shape[axis].div_ceil(chunk_shape[axis]));
        let declared = chunk_counts.iter().try_fold(1_usize, |total, count| total.checked_mul(*count));
        let room = usize::try_from(bytes.length()).unwrap_or(usize::MAX) / ENTRY_BYTES;
        let count = declared.filter(|count| *count <= room).ok_or_else(|| more_than_it_holds(shape))?;
        let mut index = Index { shape, chunk_shape, chunk_counts, chunks: vec![None; count] };
        index.visit(bytes, tree, None)?;
        let chunks = index.finish(bytes.length())?;
        Ok(Self { shape, chunk_shape, chunk_counts, chunks })
    }

    pub(in crate::grid_file) fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// x runs fastest.
    pub(super) fn read(&self, bytes: &mut Bytes) -> Result<Vec<f32>, Fault> {
        let [nz, ny, nx] = self.shape;
        let [sz, sy, sx] = self.chunk_shape;
        let [_, cy, cx] = self.chunk_counts;
        let mut samples = Vec::new();
        samples.try_reserve_exact(nz * ny * nx).map_err(|_| more_than_it_holds(self.shape))?;
        samples.resize(nz * ny * nx, 0.0);
        let per_chunk = sz * sy * sx;
        let mut shuffled = vec![0; per_chunk * 4];
        let mut inflater = Decompress::new(true);
        for (at, chunk) in self.chunks.iter().enumerate() {
            let stored = bytes.at(chunk.address, chunk.stored_bytes)?;
            inflate(&mut inflater, &stored, &mut shuffled)?;
            // Shuffled: all first bytes, then all second bytes.
            let planes: [&[u8]; 4] = std::array::from_fn(|plane| &shuffled[plane * per_chunk..][..per_chunk]);
            let [z0, y0, x0] = [at / cx / cy * sz, at / cx % cy * sy, at % cx * sx];
            let width = sx.min(nx - x0);
            for z in z0..nz.min(z0 + sz) {
                for y in y0..ny.min(y0 + sy) {
                    let row = &mut samples[(z * ny + y) * nx + x0..][..width];
                    let from = ((z - z0) * sy + (y - y0)) * sx;
                    let [a, b, c, d] = planes.map(|plane| &plane[from..][..width]);
                    for (x, sample) in row.iter_mut().enumerate() {
                        *sample = f32::from_le_bytes([a[x], b[x], c[x], d[x]]);
                    }
                }
            }
        }
        Ok(samples)
    }
}

/// Fills `out` or fails: nothing is written past it, whatever the stream would unfold to.
fn inflate(inflater: &mut Decompress, stored: &[u8], out: &mut [u8]) -> Result<(), Fault> {
    inflater.reset(true);
    let status = inflater.decompress(stored, out, FlushDecompress::Finish);
    let full = inflater.total_out() == out.len() as u64;
    match status {
        Ok(Status::StreamEnd) if full => Ok(()),
        _ => Err(Fault::damaged("a chunk of samples does not inflate to its size")),
    }
}

/// The chunks found so far.
struct Index {
    shape: [usize; 3],
    chunk_shape: [usize; 3],
    chunk_counts: [usize; 3],
    chunks: Vec<Option<Chunk>>,
}

impl Index {
    /// Section III.A.1, node type 1. Levels fall strictly from at most [`MOST_LEVEL`], every node leads to a chunk, and
    /// no chunk may come twice: that bounds depth and visits.
    fn visit(&mut self, bytes: &mut Bytes, node: u64, above: Option<u8>) -> Result<(), Fault> {
        let head = bytes.at(node, 24)?;
        let mut head = Fields(&head);
        head.expect(b"TREE")?;
        let [kind, level] = [head.u8()?, head.u8()?];
        let count = usize::from(head.u16()?);
        let falls = above.is_none_or(|above| level.checked_add(1) == Some(above));
        if kind != 1 || level > MOST_LEVEL || !falls || count == 0 {
            return Err(Fault::damaged("the tree of chunks is no tree"));
        }
        let entries = bytes.at(node + 24, count * ENTRY_BYTES)?;
        for entry in entries.chunks_exact(ENTRY_BYTES) {
            if level > 0 {
                self.visit(bytes, Fields(&entry[KEY_BYTES..]).u64()?, Some(level))?;
            } else {
                self.add(bytes, Fields(entry))?;
            }
        }
        Ok(())
    }

    fn add(&mut self, bytes: &Bytes, mut entry: Fields) -> Result<(), Fault> {
        let stored_bytes = entry.u32()?;
        let filter_mask = entry.u32()?;
        let offsets = [entry.u64()?, entry.u64()?, entry.u64()?, entry.u64()?];
        let address = entry.u64()?;
        let mut at = 0;
        for axis in 0..3 {
            let offset = usize::try_from(offsets[axis]).unwrap_or(usize::MAX);
            let side = self.chunk_shape[axis];
            if offset >= self.shape[axis] || !offset.is_multiple_of(side) {
                return Err(Fault::damaged("a chunk of samples lies outside the grid"));
            }
            at = at * self.chunk_counts[axis] + offset / side;
        }
        let unpacked = self.chunk_shape.iter().map(|side| *side as u64).product::<u64>() * 4;
        if filter_mask != 0 || offsets[3] != 0 || !bytes.holds(address, u64::from(stored_bytes)) {
            return Err(Fault::damaged("a chunk of samples lies outside the file"));
        }
        if unpacked.div_ceil(MOST_EXPANSION) > u64::from(stored_bytes) {
            return Err(more_than_it_holds(self.shape));
        }
        let chunk = Chunk { address, stored_bytes: stored_bytes as usize };
        match self.chunks[at].replace(chunk) {
            None => Ok(()),
            Some(_) => Err(Fault::damaged("a chunk of samples is there twice")),
        }
    }

    fn finish(self, file_bytes: u64) -> Result<Vec<Chunk>, Fault> {
        let all: Option<Vec<Chunk>> = self.chunks.into_iter().collect();
        let chunks = all.ok_or_else(|| Fault::damaged("a chunk of samples is missing"))?;
        // Chunks that share their bytes would unfold to more than the file could hold.
        if chunks.iter().map(|chunk| chunk.stored_bytes as u64).sum::<u64>() > file_bytes {
            return Err(more_than_it_holds(self.shape));
        }
        Ok(chunks)
    }
}

fn more_than_it_holds([nz, ny, nx]: [usize; 3]) -> Fault {
    Fault::damaged(format!("{nx} × {ny} × {nz} samples are declared, which is more than it holds"))
}

/// Section IV.A.2.d.
fn expect_f32(body: &[u8]) -> Result<(), Fault> {
    let mut fields = Fields(body);
    let class = fields.u8()? & 0xf;
    let rest = [0x20, 0x1f, 0, 4, 0, 0, 0, 0, 0, 32, 0, 23, 8, 0, 23, 127, 0, 0, 0];
    if class == 1 && fields.0.starts_with(&rest) {
        return Ok(());
    }
    Err(Fault::not_a_grid("its samples are not little-endian f32"))
}

/// Section IV.A.2.b.
fn shape(body: &[u8]) -> Result<[usize; 3], Fault> {
    let mut fields = Fields(body);
    let [version, rank] = [fields.u8()?, fields.u8()?];
    if [version, rank] != [1, 3] {
        return Err(Fault::not_a_grid("its samples do not have three axes"));
    }
    fields.skip(6)?;
    let shape = [fields.u64()?, fields.u64()?, fields.u64()?];
    let whole = shape.iter().try_fold(4_usize, |bytes, n| bytes.checked_mul(usize::try_from(*n).ok()?));
    match whole {
        Some(1..) => Ok(shape.map(|n| n as usize)),
        _ => Err(Fault::damaged(format!("a shape of {shape:?} is declared"))),
    }
}

/// Section IV.A.2.i, version 3: the shape of a chunk and the address of the tree.
fn layout_of(body: &[u8], shape: [usize; 3]) -> Result<([usize; 3], u64), Fault> {
    let mut fields = Fields(body);
    if fields.array()? != [3, 2, 4] {
        return Err(Fault::not_a_grid("its samples are not in chunks of the classic form"));
    }
    let tree = fields.u64()?;
    let sides = [fields.u32()?, fields.u32()?, fields.u32()?].map(|side| side as usize);
    let element_bytes = fields.u32()?;
    // Within the grid, so that a chunk takes no more memory than the grid does.
    let within = sides.iter().zip(shape).all(|(side, n)| (1..=n).contains(side));
    if !within || element_bytes != 4 {
        return Err(Fault::damaged(format!("chunks of {sides:?} are declared")));
    }
    Ok((sides, tree))
}

/// Section IV.A.2.l, version 1.
fn expect_filters(body: &[u8]) -> Result<(), Fault> {
    let other = || Fault::not_a_grid("its samples are not shuffled and deflated");
    let mut fields = Fields(body);
    if [fields.u8()?, fields.u8()?] != [1, 2] {
        return Err(other());
    }
    fields.skip(6)?;
    for wanted in [SHUFFLE, DEFLATE] {
        let id = fields.u16()?;
        let name_bytes = usize::from(fields.u16()?);
        fields.skip(2)?;
        let values = usize::from(fields.u16()?);
        fields.skip(name_bytes.next_multiple_of(8))?;
        let first = Fields(fields.take(values.next_multiple_of(2) * 4)?).u32()?;
        if id != wanted || (id == SHUFFLE && first != 4) {
            return Err(other());
        }
    }
    Ok(())
}
