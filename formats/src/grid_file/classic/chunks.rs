use std::marker::PhantomData;

use flate2::{Decompress, FlushDecompress, Status};
use rayon::prelude::*;

use super::bytes::{Bytes, Fields};
use super::object::Object;
use crate::grid_file::Fault;
use crate::grid_file::element::Element;
use crate::grid_file::tiling::{Tile, Tiling};

const DATASPACE: u16 = 0x01;
const DATATYPE: u16 = 0x03;
const EXTERNAL_FILES: u16 = 0x07;
const LAYOUT: u16 = 0x08;
const FILTERS: u16 = 0x0b;

/// The head of a filter's description, its name left out.
const SHUFFLE: u16 = 2;
const DEFLATE: u16 = 1;

/// What one byte of deflate makes at most: 258 bytes of 2 bits.
const MAX_EXPANSION: u64 = 1032;

/// A tree of HDF5's default rank, half filled, has 10⁹ chunks at this level.
const MAX_LEVEL: u8 = 5;

/// A dataset of one to three axes, chunked and deflated, all its chunks known to lie in the file.
pub(in crate::grid_file) struct Dataset<T> {
    name: &'static str,
    tiling: Tiling,
    shuffled: bool,
    /// As [`Tiling::tile`] counts them.
    chunks: Vec<Chunk>,
    stored_bytes: u64,
    of: PhantomData<T>,
}

#[derive(Clone, Copy)]
struct Chunk {
    address: u64,
    stored_bytes: usize,
}

impl<T: Element> Dataset<T> {
    /// Reads where the chunks are. Whatever is declared, the file has stored at least 1/1032 of it.
    pub(super) fn open(bytes: &mut Bytes, object: &Object, name: &'static str, shape: &[usize]) -> Result<Self, Fault> {
        let (Some(space), Some(kind), Some(layout), Some(filters), None) = (
            object.only(DATASPACE),
            object.only(DATATYPE),
            object.only(LAYOUT),
            object.only(FILTERS),
            object.all(EXTERNAL_FILES).next(),
        ) else {
            return Err(Fault::not_a_grid(format!("its {name} is not a chunked and deflated dataset")));
        };
        expect_type::<T>(kind, name)?;
        expect_shape(space, name, shape)?;
        let shuffled = is_shuffled::<T>(filters, name)?;
        let (tiling, tree) = tiling::<T>(layout, name, shape)?;
        let room = usize::try_from(bytes.length()).unwrap_or(usize::MAX) / entry_bytes(shape.len());
        let count = tiling.count().filter(|count| *count <= room).ok_or_else(|| more_than_it_holds(name))?;
        let mut index = Index { name, tiling, rank: shape.len(), element_bytes: T::BYTES, chunks: vec![None; count] };
        index.visit(bytes, tree, None)?;
        let (chunks, stored_bytes) = index.finish(bytes.length())?;
        Ok(Self { name, tiling, shuffled, chunks, stored_bytes, of: PhantomData })
    }

    pub(in crate::grid_file) fn name(&self) -> &'static str {
        self.name
    }

    pub(in crate::grid_file) fn tiling(&self) -> &Tiling {
        &self.tiling
    }

    pub(in crate::grid_file) fn chunk_count(&self) -> usize {
        self.chunks.len()
    }

    /// Of all chunks.
    pub(in crate::grid_file) fn stored_bytes(&self) -> u64 {
        self.stored_bytes
    }

    /// All elements, the last axis fastest. Chunks of which nothing is wanted are not read, and of the others the wanted
    /// pieces alone are put in: elsewhere elements are zero, in memory that the system need not provide before it is
    /// written to. A piece has at most `piece` elements along each axis. Chunks of several slabs are read side by side; of
    /// several faults the answer is that of the first slab.
    ///
    /// `check` is given each chunk that is read, packing undone and cut to the dataset.
    pub(super) fn read(
        &self,
        bytes: &Bytes,
        piece: [usize; 3],
        is_wanted: impl Fn(Tile) -> bool + Sync,
        check: impl Fn(usize, &[u8]) -> Result<(), Fault> + Sync,
    ) -> Result<Vec<T>, Fault> {
        let mut elements = zeros(self.tiling.shape(), self.name)?;
        let read_slab = |unpacker: &mut Unpacker, (slab, elements): (usize, &mut [T])| {
            let first = slab * self.tiling.slab_elements();
            self.tiling.slab(slab).filter(|at| is_wanted(self.tiling.tile(*at))).try_for_each(|at| {
                self.unpack(bytes, at, unpacker)?;
                check(at, &unpacker.unpacked)?;
                let tile = self.tiling.tile(at);
                let mut wanted = tile.pieces(piece).filter(|piece| is_wanted(*piece));
                wanted.try_for_each(|piece| self.place(tile, piece, &unpacker.unpacked, first, elements))
            })
        };
        if self.chunks.len() == 1 {
            // Not worth the way to another thread.
            read_slab(&mut Unpacker::new(), (0, &mut elements))?;
            return Ok(elements);
        }
        let slabs = elements.par_chunks_mut(self.tiling.slab_elements()).enumerate();
        let read: Vec<Result<(), Fault>> = slabs.map_init(Unpacker::new, read_slab).collect();
        read.into_iter().collect::<Result<(), Fault>>()?;
        Ok(elements)
    }

    /// Leaves the chunk's little-endian elements in `unpacked`, cut to the dataset.
    fn unpack(&self, bytes: &Bytes, at: usize, unpacker: &mut Unpacker) -> Result<(), Fault> {
        let Unpacker { inflater, stored, packed, unpacked } = unpacker;
        let chunk = &self.chunks[at];
        bytes.read_into(chunk.address, chunk.stored_bytes, stored)?;
        let [sz, sy, sx] = self.tiling.sides();
        packed.resize(sz * sy * sx * T::BYTES, 0);
        self.inflate(inflater, stored, packed)?;
        let [size_z, size_y, size_x] = self.tiling.tile(at).size;
        unpacked.resize(size_z * size_y * size_x * T::BYTES, 0);
        let rows = (0..size_z).flat_map(|z| (0..size_y).map(move |y| (z * sy + y) * sx));
        for (first, row) in rows.zip(unpacked.chunks_exact_mut(size_x * T::BYTES)) {
            if self.shuffled {
                unshuffle::<T>(packed, first, row);
            } else {
                row.copy_from_slice(&packed[first * T::BYTES..][..size_x * T::BYTES]);
            }
        }
        Ok(())
    }

    /// Puts a piece of a tile where it belongs among elements of which the first is the dataset's `first`.
    fn place(&self, tile: Tile, piece: Tile, unpacked: &[u8], first: usize, elements: &mut [T]) -> Result<(), Fault> {
        let count = piece.size[2];
        let mut sound = true;
        for (from, to) in tile.rows(piece).zip(self.tiling.whole().rows(piece)) {
            let stored = &unpacked[from * T::BYTES..][..count * T::BYTES];
            for (element, stored) in elements[to - first..][..count].iter_mut().zip(stored.chunks_exact(T::BYTES)) {
                *element = T::from_le(stored);
                sound &= element.is_valid();
            }
        }
        if sound { Ok(()) } else { Err(Fault::damaged(format!("a number of {} is not finite", self.name))) }
    }

    /// Fills `out` or fails: nothing is written past it, whatever the stream would unfold to.
    fn inflate(&self, inflater: &mut Decompress, stored: &[u8], out: &mut [u8]) -> Result<(), Fault> {
        inflater.reset(true);
        let status = inflater.decompress(stored, out, FlushDecompress::Finish);
        let full = inflater.total_out() == out.len() as u64;
        match status {
            Ok(Status::StreamEnd) if full => Ok(()),
            _ => Err(Fault::damaged(format!("a chunk of {} does not inflate to its size", self.name))),
        }
    }
}

/// The room that reading a chunk needs, kept from one to the next.
struct Unpacker {
    inflater: Decompress,
    stored: Vec<u8>,
    packed: Vec<u8>,
    unpacked: Vec<u8>,
}

impl Unpacker {
    fn new() -> Self {
        Self { inflater: Decompress::new(true), stored: Vec::new(), packed: Vec::new(), unpacked: Vec::new() }
    }
}

fn zeros<T: Element>(shape: [usize; 3], name: &str) -> Result<Vec<T>, Fault> {
    let count = shape.iter().product();
    // Tried first, for `vec!` would abort; it alone takes zeroed memory from the system.
    Vec::<T>::new().try_reserve_exact(count).map_err(|_| more_than_it_holds(name))?;
    Ok(vec![T::default(); count])
}

/// A row of elements from all first bytes of a chunk, all second bytes and so on.
fn unshuffle<T: Element>(shuffled: &[u8], first: usize, row: &mut [u8]) {
    let count = row.len() / T::BYTES;
    let mut planes = shuffled.chunks_exact(shuffled.len() / T::BYTES).map(|plane| &plane[first..][..count]);
    let mut plane = || planes.next().unwrap_or_default();
    // As sums of words, so that they become a few wide instructions.
    match T::BYTES {
        4 => {
            let planes = plane().iter().zip(plane()).zip(plane()).zip(plane());
            for (element, (((a, b), c), d)) in row.as_chunks_mut().0.iter_mut().zip(planes) {
                let [a, b, c, d] = [*a, *b, *c, *d].map(u32::from);
                *element = (a | b << 8 | c << 16 | d << 24).to_le_bytes();
            }
        }
        2 => {
            for (element, (a, b)) in row.as_chunks_mut().0.iter_mut().zip(plane().iter().zip(plane())) {
                let [a, b] = [*a, *b].map(u16::from);
                *element = (a | b << 8).to_le_bytes();
            }
        }
        _ => row.copy_from_slice(plane()),
    }
}

/// The bytes of an entry in the chunk tree: stored size, filter mask, an offset for each axis and one for bytes within the
/// element; then the address.
fn entry_bytes(rank: usize) -> usize {
    8 + 8 * (rank + 1) + 8
}

/// The chunks found so far.
struct Index {
    name: &'static str,
    tiling: Tiling,
    rank: usize,
    element_bytes: usize,
    chunks: Vec<Option<Chunk>>,
}

impl Index {
    /// Section III.A.1, node type 1. Levels fall strictly from at most [`MAX_LEVEL`], every node leads to a chunk, and
    /// no chunk may come twice: that bounds depth and visits.
    fn visit(&mut self, bytes: &mut Bytes, node: u64, above: Option<u8>) -> Result<(), Fault> {
        let head = bytes.at(node, 24)?;
        let mut head = Fields(&head);
        head.expect(b"TREE")?;
        let [kind, level] = [head.u8()?, head.u8()?];
        let count = usize::from(head.u16()?);
        let falls = above.is_none_or(|above| level.checked_add(1) == Some(above));
        if kind != 1 || level > MAX_LEVEL || !falls || count == 0 {
            return Err(Fault::damaged("the tree of chunks is no tree"));
        }
        let entry_bytes = entry_bytes(self.rank);
        let entries = bytes.at(node + 24, count * entry_bytes)?;
        for entry in entries.chunks_exact(entry_bytes) {
            if level > 0 {
                self.visit(bytes, Fields(&entry[entry_bytes - 8..]).u64()?, Some(level))?;
            } else {
                self.add(bytes, Fields(entry))?;
            }
        }
        Ok(())
    }

    fn add(&mut self, bytes: &Bytes, mut entry: Fields) -> Result<(), Fault> {
        let stored_bytes = entry.u32()?;
        let filter_mask = entry.u32()?;
        let (shape, sides, counts) = (self.tiling.shape(), self.tiling.sides(), self.tiling.counts());
        let mut at = 0;
        for axis in 3 - self.rank..3 {
            let offset = usize::try_from(entry.u64()?).unwrap_or(usize::MAX);
            if offset >= shape[axis] || !offset.is_multiple_of(sides[axis]) {
                return Err(Fault::damaged(format!("a chunk of {} lies outside of it", self.name)));
            }
            at = at * counts[axis] + offset / sides[axis];
        }
        let within_element = entry.u64()?;
        let address = entry.u64()?;
        let unpacked = sides.iter().map(|side| *side as u64).product::<u64>() * self.element_bytes as u64;
        if filter_mask != 0 || within_element != 0 || !bytes.holds(address, u64::from(stored_bytes)) {
            return Err(Fault::damaged(format!("a chunk of {} lies outside the file", self.name)));
        }
        if unpacked.div_ceil(MAX_EXPANSION) > u64::from(stored_bytes) {
            return Err(more_than_it_holds(self.name));
        }
        let chunk = Chunk { address, stored_bytes: stored_bytes as usize };
        match self.chunks[at].replace(chunk) {
            None => Ok(()),
            Some(_) => Err(Fault::damaged(format!("a chunk of {} is there twice", self.name))),
        }
    }

    /// All chunks, and the bytes that they take in the file.
    fn finish(self, file_bytes: u64) -> Result<(Vec<Chunk>, u64), Fault> {
        let all: Option<Vec<Chunk>> = self.chunks.into_iter().collect();
        let chunks = all.ok_or_else(|| Fault::damaged(format!("a chunk of {} is missing", self.name)))?;
        let stored_bytes = chunks.iter().map(|chunk| chunk.stored_bytes as u64).sum::<u64>();
        // Chunks that share their bytes would unfold to more than the file could hold.
        if stored_bytes > file_bytes {
            return Err(more_than_it_holds(self.name));
        }
        Ok((chunks, stored_bytes))
    }
}

fn more_than_it_holds(name: &str) -> Fault {
    Fault::damaged(format!("more of {name} is declared than it holds"))
}

/// Section IV.A.2.d.
fn expect_type<T: Element>(body: &[u8], name: &str) -> Result<(), Fault> {
    let (class, rest) = T::DATATYPE;
    let mut fields = Fields(body);
    if fields.u8()? & 0xf == class && fields.0.starts_with(rest) {
        return Ok(());
    }
    Err(Fault::not_a_grid(format!("its {name} is not little-endian {}", T::NAME)))
}

/// Section IV.A.2.b.
fn expect_shape(body: &[u8], name: &str, wanted: &[usize]) -> Result<(), Fault> {
    let mut fields = Fields(body);
    let [version, rank] = [fields.u8()?, fields.u8()?];
    if version != 1 || usize::from(rank) != wanted.len() {
        return Err(Fault::not_a_grid(format!("its {name} does not have {} axes", wanted.len())));
    }
    fields.skip(6)?;
    let mut whole = Some(1_usize);
    for wanted in wanted {
        let found = fields.u64()?;
        if found != *wanted as u64 {
            return Err(Fault::damaged(format!("{name} has {found} where {wanted} are declared")));
        }
        whole = whole.and_then(|whole| whole.checked_mul(*wanted));
    }
    // Of bytes too, however wide the element.
    match whole.and_then(|whole| whole.checked_mul(8)) {
        Some(1..) => Ok(()),
        _ => Err(more_than_it_holds(name)),
    }
}

/// Section IV.A.2.i, version 3: the shape of a chunk and the address of the tree.
fn tiling<T: Element>(body: &[u8], name: &str, shape: &[usize]) -> Result<(Tiling, u64), Fault> {
    let mut fields = Fields(body);
    if fields.array()? != [3, 2, shape.len() as u8 + 1] {
        return Err(Fault::not_a_grid(format!("its {name} is not in chunks of the classic form")));
    }
    let tree = fields.u64()?;
    let sides = shape.iter().map(|_| fields.u32().map(|side| side as usize)).collect::<Result<Vec<_>, _>>()?;
    let element_bytes = fields.u32()?;
    // Within the dataset, so that a chunk takes no more memory than that does.
    let within = sides.iter().zip(shape).all(|(side, n)| (1..=*n).contains(side));
    if !within || element_bytes as usize != T::BYTES {
        return Err(Fault::damaged(format!("chunks of {sides:?} are declared for {name}")));
    }
    Ok((Tiling::new(shape, &sides), tree))
}

/// Section IV.A.2.l, version 1: deflated last, and nothing but shuffled before.
fn is_shuffled<T: Element>(body: &[u8], name: &str) -> Result<bool, Fault> {
    let other = || Fault::not_a_grid(format!("its {name} is not shuffled and deflated"));
    let mut fields = Fields(body);
    let [version, count] = [fields.u8()?, fields.u8()?];
    let wanted = match count {
        1 => &[DEFLATE][..],
        2 => &[SHUFFLE, DEFLATE],
        _ => return Err(other()),
    };
    if version != 1 {
        return Err(other());
    }
    fields.skip(6)?;
    for wanted in wanted {
        let id = fields.u16()?;
        let name_bytes = usize::from(fields.u16()?);
        fields.skip(2)?;
        let values = usize::from(fields.u16()?);
        fields.skip(name_bytes.next_multiple_of(8))?;
        let values = fields.take(values.next_multiple_of(2) * 4)?;
        if id != *wanted || (id == SHUFFLE && Fields(values).u32()? as usize != T::BYTES) {
            return Err(other());
        }
    }
    Ok(count == 2)
}
