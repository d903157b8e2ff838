//! Which bytes stand for a group, a dataset, an attribute? Blocks and messages of the classic form, by section of the "HDF5 File
//! Format Specification, version 3.0" (The HDF Group). All numbers are little-endian, addresses and lengths have 8 bytes.

use std::io;

use super::DatasetStorage;
use crate::hdf5::deflate;
use crate::hdf5::element::Element;
use crate::hdf5::{Compression, SIGNATURE, UNDEFINED};

/// Section II.A, with the root's entry.
pub(super) const SUPERBLOCK_BYTES: usize = 96;

/// Members of a symbol table node: twice the rank that the superblock states.
pub(super) const NODE_MEMBERS: usize = 8;
/// Symbol table nodes of a group: twice the rank of its tree.
const GROUP_NODES: usize = 32;
/// Children of a node in a tree of chunks: twice HDF5's own rank.
const CHUNK_CHILDREN: usize = 64;

/// Type and body of a header message.
pub(super) type Message = (u16, Vec<u8>);

/// Bytes of several numbers.
macro_rules! bytes {
    ($($number:expr),+ $(,)?) => {
        [$(&$number.to_le_bytes()[..]),+].concat()
    };
}

fn padded(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// Section II.A, version 0.
pub(super) fn superblock(root: u64, group: Option<[u64; 2]>, end: u64) -> Vec<u8> {
    let ranks = bytes![(NODE_MEMBERS / 2) as u16, (GROUP_NODES / 2) as u16, 0_u32];
    let head = [&SIGNATURE[..], &[0, 0, 0, 0, 0, 8, 8, 0], &ranks].concat();
    [head, bytes![0_u64, UNDEFINED, end, UNDEFINED], symbol_entry(0, root, group)].concat()
}

/// Section III.C: an entry of 40 bytes.
fn symbol_entry(name: u64, header: u64, group: Option<[u64; 2]>) -> Vec<u8> {
    let [tree, heap] = group.unwrap_or_default();
    bytes![name, header, u32::from(group.is_some()), 0_u32, tree, heap]
}

/// Section IV.A.1.a, version 1. Errors: a message of more than 64 KiB.
pub(super) fn object_header(messages: &[Message]) -> io::Result<Vec<u8>> {
    let mut all = Vec::new();
    for (kind, body) in messages {
        let body = padded(body.clone());
        let size = u16::try_from(body.len()).map_err(|_| io::Error::other("an attribute has more than 64 KiB"))?;
        all.extend(bytes![*kind, size, 0_u32]);
        all.extend(body);
    }
    let count = messages.len() as u16;
    Ok([bytes![1_u8, 0_u8, count, 1_u32, all.len() as u32, 0_u32], all].concat())
}

/// A member of a group that is written.
pub(super) struct Member<'a> {
    pub name: &'a str,
    pub header: u64,
    pub group: Option<[u64; 2]>,
}

/// Section III.D: the names of a group, each ended by a NUL, after an empty one; and where each begins.
pub(super) fn names(members: &[Member]) -> (Vec<u8>, Vec<u64>) {
    let mut names = vec![0; 8];
    let offsets = members.iter().map(|member| {
        let offset = names.len() as u64;
        names.extend(padded([member.name.as_bytes(), &[0]].concat()));
        offset
    });
    let offsets = offsets.collect();
    (names, offsets)
}

/// Section III.D. The list of free blocks is empty, for which HDF5 writes 1.
pub(super) fn local_heap(bytes: u64, data: u64) -> Vec<u8> {
    [b"HEAP".to_vec(), bytes![0_u32, bytes, 1_u64, data]].concat()
}

/// Section III.B: the members in the order of their names, with room for [`NODE_MEMBERS`].
pub(super) fn symbol_node(members: &[Member], offsets: &[u64]) -> Vec<u8> {
    let mut node = [b"SNOD".to_vec(), bytes![1_u8, 0_u8, members.len() as u16]].concat();
    for (member, offset) in members.iter().zip(offsets) {
        node.extend(symbol_entry(*offset, member.header, member.group));
    }
    node.resize(8 + 40 * NODE_MEMBERS, 0);
    node
}

/// Section III.A.1, node type 0, of one level. `nodes`: the address of each symbol table node and the name of its last member.
/// Errors: more members than a level has room for.
pub(super) fn group_tree(nodes: &[(u64, u64)]) -> io::Result<Vec<u8>> {
    if nodes.len() > GROUP_NODES {
        return Err(io::Error::other(format!("a group has more than {} members", GROUP_NODES * NODE_MEMBERS)));
    }
    let mut tree = [b"TREE".to_vec(), bytes![0_u8, 0_u8, nodes.len() as u16, UNDEFINED, UNDEFINED, 0_u64]].concat();
    for (address, last_name) in nodes {
        tree.extend(bytes![*address, *last_name]);
    }
    tree.resize(24 + 8 * (2 * GROUP_NODES + 1), 0);
    Ok(tree)
}

/// Section IV.A.2.r.
pub(super) fn symbol_table([tree, heap]: [u64; 2]) -> Message {
    (0x11, bytes![tree, heap])
}

/// A chunk in the file.
#[derive(Clone, Copy)]
pub(super) struct ChunkEntry {
    pub address: u64,
    pub stored_bytes: u32,
}

/// Section III.A.1, node type 1: the tree of a dataset's chunks.
pub(super) struct ChunkTree<'a> {
    pub shape: &'a [u64],
    /// Elements of a chunk along each axis.
    pub sides: &'a [u64],
    pub element_bytes: usize,
    /// The last axis fastest.
    pub chunks: &'a [ChunkEntry],
}

/// The key before a child, and the child's address.
type TreeEntry = (Vec<u8>, u64);

impl ChunkTree<'_> {
    /// The chunks as entries of the lowest level.
    pub fn entries(&self) -> Vec<TreeEntry> {
        let chunks = self.chunks.iter().enumerate();
        chunks.map(|(index, chunk)| (self.key(index, chunk.stored_bytes, 0), chunk.address)).collect()
    }

    /// The nodes of a level, the first of which will lie at `first`; and an entry for each.
    pub fn level(&self, level: u8, first: u64, entries: &[TreeEntry]) -> (Vec<u8>, Vec<TreeEntry>) {
        let last = self.key(self.chunks.len().saturating_sub(1), 0, self.element_bytes as u64);
        let node_bytes = 24 + (CHUNK_CHILDREN + 1) * last.len() + CHUNK_CHILDREN * 8;
        let count = entries.len().div_ceil(CHUNK_CHILDREN);
        let address = |node: usize| if node < count { first + (node * node_bytes) as u64 } else { UNDEFINED };
        let (mut nodes, mut parents) = (Vec::with_capacity(count * node_bytes), vec![]);
        for (index, children) in entries.chunks(CHUNK_CHILDREN).enumerate() {
            parents.push((children[0].0.clone(), address(index)));
            let siblings = bytes![address(index.wrapping_sub(1)), address(index + 1)];
            nodes.extend([b"TREE".to_vec(), bytes![1_u8, level, children.len() as u16], siblings].concat());
            for (key, child) in children {
                nodes.extend(key);
                nodes.extend(child.to_le_bytes());
            }
            let next = entries.get((index + 1) * CHUNK_CHILDREN);
            nodes.extend(next.map_or(&last, |(key, _)| key));
            nodes.resize((index + 1) * node_bytes, 0);
        }
        (nodes, parents)
    }

    /// Stored bytes, no filter left out, the first element of a chunk, and an offset in an element, which bounds the tree at its end.
    fn key(&self, chunk: usize, stored_bytes: u32, end: u64) -> Vec<u8> {
        let mut rest = chunk as u64;
        let mut firsts = vec![0; self.shape.len()];
        for axis in (0..self.shape.len()).rev() {
            let count = self.shape[axis].div_ceil(self.sides[axis]);
            firsts[axis] = rest % count * self.sides[axis];
            rest /= count;
        }
        let firsts = firsts.into_iter().chain([end]).flat_map(u64::to_le_bytes);
        bytes![stored_bytes, 0_u32].into_iter().chain(firsts).collect()
    }
}

/// Section IV.A.2.b, version 1, without largest sizes.
pub(super) fn dataspace(shape: &[u64]) -> Message {
    (0x01, dataspace_body(shape))
}

fn dataspace_body(shape: &[u64]) -> Vec<u8> {
    let head = [1, shape.len() as u8, 0, 0, 0, 0, 0, 0];
    head.into_iter().chain(shape.iter().flat_map(|side| side.to_le_bytes())).collect()
}

/// Section IV.A.2.d, version 1: the type of an element.
pub(super) fn datatype<T: Element>() -> Vec<u8> {
    let (class, rest) = T::DATATYPE;
    [&[0x10 | class], rest].concat()
}

pub(super) fn datatype_message(datatype: &[u8]) -> Message {
    (0x03, datatype.to_vec())
}

/// An ASCII text of fixed length, padded with NUL.
pub(super) fn ascii_type(bytes: usize) -> Vec<u8> {
    [vec![0x13, 1, 0, 0], bytes![bytes as u32]].concat()
}

/// A text of variable length in UTF-8: a sequence of bytes.
fn text_type() -> Vec<u8> {
    [vec![0x19, 1, 1, 0], bytes![16_u32], datatype::<u8>()].concat()
}

/// Section IV.A.2.f, version 2: the default, zero; when its room is taken, as HDF5 has it for this storage.
pub(super) fn fill_value(storage: &DatasetStorage) -> Message {
    let allocated = match storage {
        DatasetStorage::Contiguous { .. } => 2,
        DatasetStorage::Chunked { .. } => 3,
    };
    (0x05, vec![2, allocated, 2, 1, 0, 0, 0, 0])
}

/// Section IV.A.2.i, version 3.
pub(super) fn contiguous_layout(address: u64, bytes: u64) -> Message {
    let address = if bytes == 0 { UNDEFINED } else { address };
    (0x08, [vec![3, 1], bytes![address, bytes]].concat())
}

/// Section IV.A.2.i, version 3.
pub(super) fn chunked_layout(tree: u64, sides: &[u64], element_bytes: usize) -> Message {
    let mut body = [vec![3, 2, sides.len() as u8 + 1], bytes![tree]].concat();
    sides.iter().for_each(|side| body.extend((*side as u32).to_le_bytes()));
    body.extend((element_bytes as u32).to_le_bytes());
    (0x08, body)
}

/// Section IV.A.2.l, version 1: shuffling of elements of several bytes, then deflate. None without compression.
pub(super) fn filters(compression: Compression, element_bytes: usize) -> Option<Message> {
    // Number, no name, optional or not, one value, padded to two.
    let filter = |id: u16, value: u32| bytes![id, 0_u16, 0_u16, 1_u16, value, 0_u32];
    let shuffle = (element_bytes > 1).then(|| filter(2, element_bytes as u32));
    let filters: Vec<_> = shuffle.into_iter().chain([filter(1, deflate::LEVEL)]).collect();
    let head = vec![1, filters.len() as u8, 0, 0, 0, 0, 0, 0];
    match compression {
        Compression::Deflate => Some((0x0b, [head, filters.concat()].concat())),
        Compression::None => None,
    }
}

/// An attribute of an object.
pub(super) struct Attribute {
    pub name: String,
    pub value: AttributeValue,
}

pub(super) enum AttributeValue {
    /// Kept in the heap of texts.
    Text(String),
    /// A scalar, or `count` values.
    Fixed { datatype: Vec<u8>, count: Option<u64>, data: Vec<u8> },
}

impl AttributeValue {
    pub fn numbers<T: Element>(numbers: &[T], count: Option<u64>) -> Self {
        let mut data = Vec::with_capacity(numbers.len() * T::BYTES);
        numbers.iter().for_each(|number| number.append_le(&mut data));
        Self::Fixed { datatype: datatype::<T>(), count, data }
    }
}

impl Attribute {
    pub fn text(&self) -> Option<&str> {
        match &self.value {
            AttributeValue::Text(text) => Some(text),
            AttributeValue::Fixed { .. } => None,
        }
    }

    /// Section IV.A.2.m, version 1, whose parts are padded.
    pub fn encode(&self, heap: &Heap) -> Message {
        let (datatype, space, data) = match &self.value {
            AttributeValue::Text(text) => (text_type(), dataspace_body(&[]), heap.reference(text)),
            AttributeValue::Fixed { datatype, count, data } => {
                (datatype.clone(), dataspace_body(count.as_slice()), data.clone())
            }
        };
        let name = [self.name.as_bytes(), &[0]].concat();
        let sizes = bytes![1_u8, 0_u8, name.len() as u16, datatype.len() as u16, space.len() as u16];
        (0x0c, [sizes, padded(name), padded(datatype), padded(space), data].concat())
    }
}

/// Section III.E: all texts of the file, each once.
pub(super) struct Heap<'a> {
    pub address: u64,
    texts: Vec<&'a str>,
}

impl<'a> Heap<'a> {
    /// Errors: more texts than a heap can number.
    pub fn new(all: impl Iterator<Item = &'a str>) -> io::Result<Self> {
        let mut texts: Vec<&str> = all.filter(|text| !text.is_empty()).collect();
        texts.sort_unstable();
        texts.dedup();
        if texts.len() >= usize::from(u16::MAX) {
            return Err(io::Error::other("there are more than 65534 texts"));
        }
        Ok(Self { address: 0, texts })
    }

    pub fn is_empty(&self) -> bool {
        self.texts.is_empty()
    }

    /// HDF5 wants at least 4096 bytes, of which the last object, number 0, is the free rest.
    pub fn encode(&self) -> Vec<u8> {
        let mut objects = Vec::new();
        for (index, text) in self.texts.iter().enumerate() {
            objects.extend(bytes![index as u16 + 1, 1_u16, 0_u32, text.len() as u64]);
            objects.extend(padded(text.as_bytes().to_vec()));
        }
        let size = (16 + objects.len() + 16).max(4096);
        let free = size - 16 - objects.len();
        objects.extend(bytes![0_u16, 0_u16, 0_u32, free as u64]);
        objects.resize(size - 16, 0);
        [b"GCOL".to_vec(), bytes![1_u32, size as u64], objects].concat()
    }

    /// Length, heap and number of a text.
    fn reference(&self, text: &str) -> Vec<u8> {
        match self.texts.binary_search(&text) {
            Ok(index) => bytes![text.len() as u32, self.address, index as u32 + 1],
            Err(_) => bytes![0_u32, 0_u64, 0_u32],
        }
    }
}
