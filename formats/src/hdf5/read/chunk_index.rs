//! Addresses of a dataset's chunks, from its header messages and its version 1 B-tree.
//!
//! Whatever a file declares is checked before memory is taken for it: the tree must have room for an entry a chunk, and
//! each chunk must store at least 1/1032 of its bytes, the limit of deflate.

use super::ReadError;
use super::fields::Fields;
use super::object::Object;
use super::source::ByteSource;
use crate::hdf5::element::Element;
use crate::hdf5::tiling::Tiling;

const DATASPACE: u16 = 0x01;
const DATATYPE: u16 = 0x03;
const EXTERNAL_FILES: u16 = 0x07;
const LAYOUT: u16 = 0x08;
const FILTERS: u16 = 0x0b;

const SHUFFLE: u16 = 2;
const DEFLATE: u16 = 1;

/// Largest expansion by deflate: 2 bits stand for 258 bytes.
const MAX_EXPANSION: u64 = 1032;

/// Highest level of a tree's root. A tree of HDF5's default rank, half filled, then has 10⁹ chunks.
const MAX_LEVEL: u8 = 5;

/// Packing of chunks, as the file states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Packing {
    pub is_shuffled: bool,
    pub is_deflated: bool,
}

/// Location and form of a dataset's chunks.
pub(super) struct ChunkIndex {
    pub tiling: Tiling,
    pub packing: Packing,
    /// In the order of [`Tiling::tile`].
    pub chunks: Vec<Chunk>,
    /// Sum over all chunks.
    pub stored_bytes: u64,
}

#[derive(Clone, Copy)]
pub(super) struct Chunk {
    pub address: u64,
    pub stored_bytes: usize,
}

impl ChunkIndex {
    /// Reads the index of a dataset; an error unless it has this type and shape and every chunk lies in the file.
    pub(super) fn read<T: Element>(
        source: &ByteSource,
        object: &Object,
        name: &'static str,
        shape: &[usize],
    ) -> Result<Self, ReadError> {
        let (Some(space), Some(datatype), Some(layout), None) =
            (object.only(DATASPACE), object.only(DATATYPE), object.only(LAYOUT), object.all(EXTERNAL_FILES).next())
        else {
            return Err(ReadError::unexpected(format!("its {name} is not a chunked dataset")));
        };
        expect_type::<T>(datatype, name)?;
        expect_shape(space, name, shape)?;
        let packing = packing::<T>(object, name)?;
        let (tiling, tree) = tiling::<T>(layout, name, shape)?;
        let max_count = usize::try_from(source.length()).unwrap_or(usize::MAX) / entry_bytes(shape.len());
        let count = tiling.count().filter(|count| *count <= max_count).ok_or_else(|| declared_too_large(name))?;
        let chunk_bytes = tiling.sides().iter().map(|side| *side as u64).product::<u64>() * T::BYTES as u64;
        let mut walk =
            TreeWalk { source, name, tiling, rank: shape.len(), chunk_bytes, packing, chunks: vec![None; count] };
        walk.visit(tree, None)?;
        let (chunks, stored_bytes) = walk.finish()?;
        Ok(Self { tiling, packing, chunks, stored_bytes })
    }
}

/// Bytes of an entry in the chunk tree: stored size, filter mask, an offset for each axis and one for bytes within the
/// element; then the address.
fn entry_bytes(rank: usize) -> usize {
    8 + 8 * (rank + 1) + 8
}

/// A walk through the tree, with the chunks found so far.
struct TreeWalk<'a> {
    source: &'a ByteSource<'a>,
    name: &'static str,
    tiling: Tiling,
    rank: usize,
    /// Uncompressed.
    chunk_bytes: u64,
    packing: Packing,
    chunks: Vec<Option<Chunk>>,
}

impl TreeWalk<'_> {
    /// Section III.A.1, node type 1. Levels fall by one from at most [`MAX_LEVEL`], every node leads to a chunk, and no
    /// chunk may come twice: this bounds depth and visits.
    fn visit(&mut self, node: u64, parent_level: Option<u8>) -> Result<(), ReadError> {
        let head = self.source.read(node, 24)?;
        let mut head = Fields(&head);
        head.expect(b"TREE")?;
        let [kind, level] = [head.u8()?, head.u8()?];
        let count = usize::from(head.u16()?);
        let is_below_parent = parent_level.is_none_or(|parent| level.checked_add(1) == Some(parent));
        if kind != 1 || level > MAX_LEVEL || !is_below_parent || count == 0 {
            return Err(ReadError::damaged("the tree of chunks is not a tree"));
        }
        let entry_bytes = entry_bytes(self.rank);
        let entries = self.source.read(node + 24, count * entry_bytes)?;
        for entry in entries.chunks_exact(entry_bytes) {
            if level > 0 {
                self.visit(Fields(&entry[entry_bytes - 8..]).u64()?, Some(level))?;
            } else {
                self.add(Fields(entry))?;
            }
        }
        Ok(())
    }

    fn add(&mut self, mut entry: Fields) -> Result<(), ReadError> {
        let stored_bytes = entry.u32()?;
        let filter_mask = entry.u32()?;
        let (shape, sides, counts) = (self.tiling.shape(), self.tiling.sides(), self.tiling.counts());
        let mut index = 0;
        for axis in 3 - self.rank..3 {
            let offset = usize::try_from(entry.u64()?).unwrap_or(usize::MAX);
            if offset >= shape[axis] || !offset.is_multiple_of(sides[axis]) {
                return Err(ReadError::damaged(format!("a chunk of {} lies outside of it", self.name)));
            }
            index = index * counts[axis] + offset / sides[axis];
        }
        let offset_in_element = entry.u64()?;
        let address = entry.u64()?;
        let is_in_file = self.source.contains(address, u64::from(stored_bytes));
        if filter_mask != 0 || offset_in_element != 0 || !is_in_file {
            return Err(ReadError::damaged(format!("a chunk of {} lies outside the file", self.name)));
        }
        let fits = if self.packing.is_deflated {
            self.chunk_bytes.div_ceil(MAX_EXPANSION) <= u64::from(stored_bytes)
        } else {
            self.chunk_bytes == u64::from(stored_bytes)
        };
        if !fits {
            return Err(declared_too_large(self.name));
        }
        let chunk = Chunk { address, stored_bytes: stored_bytes as usize };
        match self.chunks[index].replace(chunk) {
            None => Ok(()),
            Some(_) => Err(ReadError::damaged(format!("a chunk of {} is there twice", self.name))),
        }
    }

    /// All chunks, and the sum of their stored bytes.
    fn finish(self) -> Result<(Vec<Chunk>, u64), ReadError> {
        let all: Option<Vec<Chunk>> = self.chunks.into_iter().collect();
        let chunks = all.ok_or_else(|| ReadError::damaged(format!("a chunk of {} is missing", self.name)))?;
        let stored_bytes = chunks.iter().map(|chunk| chunk.stored_bytes as u64).sum::<u64>();
        // Chunks that share bytes would inflate to more than the file could hold.
        if stored_bytes > self.source.length() {
            return Err(declared_too_large(self.name));
        }
        let mut extents: Vec<[u64; 2]> = chunks
            .iter()
            .map(|chunk| [chunk.address, chunk.address.saturating_add(chunk.stored_bytes as u64)])
            .collect();
        extents.sort_unstable();
        if extents.windows(2).any(|two| two[0][1] > two[1][0]) {
            return Err(ReadError::damaged(format!("chunks of {} share bytes", self.name)));
        }
        Ok((chunks, stored_bytes))
    }
}

pub(super) fn declared_too_large(name: &str) -> ReadError {
    ReadError::damaged(format!("more of {name} is declared than it holds"))
}

/// Section IV.A.2.d.
fn expect_type<T: Element>(body: &[u8], name: &str) -> Result<(), ReadError> {
    let (class, rest) = T::DATATYPE;
    let mut fields = Fields(body);
    if fields.u8()? & 0xf == class && fields.0.starts_with(rest) {
        return Ok(());
    }
    Err(ReadError::unexpected(format!("its {name} is not little-endian {}", T::NAME)))
}

/// Section IV.A.2.b.
fn expect_shape(body: &[u8], name: &str, expected: &[usize]) -> Result<(), ReadError> {
    let mut fields = Fields(body);
    let [version, rank] = [fields.u8()?, fields.u8()?];
    if version != 1 || usize::from(rank) != expected.len() {
        return Err(ReadError::unexpected(format!("its {name} does not have {} axes", expected.len())));
    }
    fields.skip(6)?;
    let mut count = Some(1_usize);
    for expected in expected {
        let found = fields.u64()?;
        if found != *expected as u64 {
            return Err(ReadError::damaged(format!("{name} has {found} where {expected} are declared")));
        }
        count = count.and_then(|count| count.checked_mul(*expected));
    }
    // The number of bytes must not overflow either; no element has more than 8.
    match count.and_then(|count| count.checked_mul(8)) {
        Some(1..) => Ok(()),
        _ => Err(declared_too_large(name)),
    }
}

/// Section IV.A.2.i, version 3: the shape of a chunk and the address of the tree.
fn tiling<T: Element>(body: &[u8], name: &str, shape: &[usize]) -> Result<(Tiling, u64), ReadError> {
    let mut fields = Fields(body);
    if fields.array()? != [3, 2, shape.len() as u8 + 1] {
        return Err(ReadError::unexpected(format!("its {name} is not in chunks of the classic form")));
    }
    let tree = fields.u64()?;
    let sides = shape.iter().map(|_| fields.u32().map(|side| side as usize)).collect::<Result<Vec<_>, _>>()?;
    let element_bytes = fields.u32()?;
    // No larger than the dataset, so that a chunk takes no more memory than the dataset does.
    let fits = sides.iter().zip(shape).all(|(side, n)| (1..=*n).contains(side));
    if !fits || element_bytes as usize != T::BYTES {
        return Err(ReadError::damaged(format!("chunks of {sides:?} are declared for {name}")));
    }
    Ok((Tiling::new(shape, &sides), tree))
}

/// Section IV.A.2.l, version 1: shuffling, then deflate, or one of both, or no filters.
fn packing<T: Element>(object: &Object, name: &str) -> Result<Packing, ReadError> {
    let refused = || ReadError::unexpected(format!("its {name} has filters other than shuffling and then deflate"));
    let mut packing = Packing { is_shuffled: false, is_deflated: false };
    let Some(body) = object.only(FILTERS) else {
        return if object.all(FILTERS).next().is_none() { Ok(packing) } else { Err(refused()) };
    };
    let mut fields = Fields(body);
    let [version, count] = [fields.u8()?, fields.u8()?];
    if version != 1 || !(1..=2).contains(&count) {
        return Err(refused());
    }
    fields.skip(6)?;
    for _ in 0..count {
        let id = fields.u16()?;
        let name_bytes = usize::from(fields.u16()?);
        fields.skip(2)?;
        let value_count = usize::from(fields.u16()?);
        fields.skip(name_bytes.next_multiple_of(8))?;
        let values = fields.bytes(value_count.next_multiple_of(2) * 4)?;
        packing = match (id, packing) {
            (DEFLATE, Packing { is_deflated: false, .. }) => Packing { is_deflated: true, ..packing },
            (SHUFFLE, Packing { is_shuffled: false, is_deflated: false })
                if Fields(values).u32()? as usize == T::BYTES =>
            {
                Packing { is_shuffled: true, ..packing }
            }
            _ => return Err(refused()),
        };
    }
    Ok(packing)
}
