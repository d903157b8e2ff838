//! How is a file made where there are no files, as in a browser? In memory, in the classic form, by rust-hdf5's encoders of each record:
//! its own writer needs a path.
//!
//! Objects are kept as a tree and laid out one after the other: what an object refers to comes before it, the superblock first.
//! Texts have a fixed length here, a variable one in files; readers take either.

#[cfg(test)]
mod tests;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use rust_hdf5::format::btree_v1::{BTreeV1Config, BTreeV1Node, ChunkBTreeV1Tree, ChunkKey};
use rust_hdf5::format::local_heap::{LOCAL_HEAP_FREE_NULL, LocalHeapHeader, LocalHeapImage};
use rust_hdf5::format::messages::attribute::AttributeMessage;
use rust_hdf5::format::messages::data_layout::DataLayoutMessage;
use rust_hdf5::format::messages::dataspace::DataspaceMessage;
use rust_hdf5::format::messages::fill_value::{ALLOC_TIME_INCR, FillValueMessage};
use rust_hdf5::format::messages::filter::FilterPipeline;
use rust_hdf5::format::messages::{
    MSG_ATTRIBUTE, MSG_DATA_LAYOUT, MSG_DATASPACE, MSG_DATATYPE, MSG_FILL_VALUE, MSG_FILTER_PIPELINE, MSG_SYMBOL_TABLE,
};
use rust_hdf5::format::object_header::ObjectHeader;
use rust_hdf5::format::superblock::{SuperblockV0V1, SymbolTableCache, SymbolTableEntry};
use rust_hdf5::format::symbol_table::SymbolTableNode;
use rust_hdf5::format::{FormatContext, FormatResult, LibverBound, ObjectFormat, UNDEF_ADDR};
use rust_hdf5::{DatatypeMessage, Hdf5Error};

use super::element::Element;
use super::group::{ChunkedDataset, Group, Number, fixed_ascii};
use super::packing::filters;

/// Bytes of an address, and of a length.
const WIDTH: usize = 8;

const CONTEXT: FormatContext = FormatContext { sizeof_addr: WIDTH as u8, sizeof_size: WIDTH as u8 };

/// The bytes of a file whose objects `fill` puts into its root.
pub(crate) fn to_bytes<E: From<Hdf5Error>>(fill: impl FnOnce(&Object) -> Result<(), E>) -> Result<Vec<u8>, E> {
    let root = Object::default();
    fill(&root)?;
    Layout::of(&root).map_err(|error| E::from(Hdf5Error::Format(error)))
}

/// A group or a dataset.
#[derive(Clone, Default)]
pub(crate) struct Object(Rc<RefCell<Parts>>);

#[derive(Default)]
struct Parts {
    attributes: Vec<AttributeMessage>,
    /// By name, as a symbol table has them.
    members: BTreeMap<String, Object>,
    /// Of a dataset.
    chunks: Option<Chunks>,
}

struct Chunks {
    datatype: DatatypeMessage,
    filters: FilterPipeline,
    shape: Vec<u64>,
    /// Elements of a chunk along each axis, then bytes of an element.
    sides: Vec<u64>,
    /// As they stand in the file, the last axis fastest.
    packed: Vec<Vec<u8>>,
}

impl Object {
    fn add(&self, attribute: AttributeMessage) -> Result<(), Hdf5Error> {
        self.0.borrow_mut().attributes.push(attribute);
        Ok(())
    }

    fn add_member(&self, name: &str, member: Self) -> Self {
        self.0.borrow_mut().members.insert(name.to_owned(), member.clone());
        member
    }
}

impl Group for Object {
    type Dataset = Self;

    fn add_group(&self, name: &str) -> Result<Self, Hdf5Error> {
        Ok(self.add_member(name, Self::default()))
    }

    fn set_text(&self, name: &str, text: &str) -> Result<(), Hdf5Error> {
        self.add(AttributeMessage::scalar_string(name, text))
    }

    fn set_ascii(&self, name: &str, text: &str) -> Result<(), Hdf5Error> {
        self.add(AttributeMessage::scalar_numeric(name, fixed_ascii(text), text.into()))
    }

    fn set_number<T: Number>(&self, name: &str, number: T) -> Result<(), Hdf5Error> {
        self.add(AttributeMessage::scalar_numeric(name, T::hdf5_type(), number.little_endian().to_vec()))
    }

    fn set_numbers<T: Number>(&self, name: &str, numbers: &[T]) -> Result<(), Hdf5Error> {
        let bytes = numbers.iter().flat_map(|number| number.little_endian()).collect();
        self.add(AttributeMessage::array_numeric(name, T::hdf5_type(), &[numbers.len() as u64], bytes))
    }

    fn dataset<T: Element>(&self, name: &str, [shape, chunk_shape]: [&[usize]; 2]) -> Result<Self, Hdf5Error> {
        let widened = |counts: &[usize]| counts.iter().map(|count| *count as u64).collect::<Vec<_>>();
        let sides = [widened(chunk_shape), vec![T::BYTES as u64]].concat();
        let chunks =
            Chunks { datatype: T::hdf5_type(), filters: filters::<T>(), shape: widened(shape), sides, packed: vec![] };
        let parts = Parts { chunks: Some(chunks), ..Parts::default() };
        Ok(self.add_member(name, Self(Rc::new(RefCell::new(parts)))))
    }
}

impl ChunkedDataset for Object {
    fn put_chunk(&self, index: usize, packed: Vec<u8>) -> Result<(), Hdf5Error> {
        match &mut self.0.borrow_mut().chunks {
            Some(chunks) if chunks.packed.len() == index => chunks.packed.push(packed),
            _ => return Err(Hdf5Error::InvalidState(format!("chunk {index} is not the next one"))),
        }
        Ok(())
    }

    fn label(&self, name: &str, text: &str) -> Result<(), Hdf5Error> {
        self.set_ascii(name, text)
    }
}

/// The file so far.
struct Layout {
    bytes: Vec<u8>,
    ranks: BTreeV1Config,
}

impl Layout {
    fn of(root: &Object) -> FormatResult<Vec<u8>> {
        let mut file = Self { bytes: vec![], ranks: BTreeV1Config::default() };
        // Room for the superblock, which is known at the end.
        let entry = |obj_header_addr, cache| SymbolTableEntry { name_offset: 0, obj_header_addr, cache };
        file.bytes = file.superblock(entry(0, SymbolTableCache::Nothing));
        let (address, cache) = file.object(root)?;
        let superblock = file.superblock(entry(address, cache));
        file.bytes[..superblock.len()].copy_from_slice(&superblock);
        Ok(file.bytes)
    }

    fn superblock(&self, root_symbol_table_entry: SymbolTableEntry) -> Vec<u8> {
        let superblock = SuperblockV0V1 {
            version: 0,
            sizeof_offsets: WIDTH as u8,
            sizeof_lengths: WIDTH as u8,
            file_consistency_flags: 0,
            sym_leaf_k: self.ranks.sym_leaf_k,
            btree_internal_k: self.ranks.snode_internal_k,
            indexed_storage_k: None,
            base_address: 0,
            superblock_extension_address: UNDEF_ADDR,
            end_of_file_address: self.bytes.len() as u64,
            driver_info_address: UNDEF_ADDR,
            root_symbol_table_entry,
        };
        superblock.encode()
    }

    /// Where the next block will lie: records begin at multiples of 8.
    fn next(&self) -> u64 {
        self.bytes.len().next_multiple_of(8) as u64
    }

    fn put(&mut self, block: &[u8]) -> u64 {
        let address = self.next();
        self.bytes.resize(address as usize, 0);
        self.bytes.extend_from_slice(block);
        self.bytes.resize(self.next() as usize, 0);
        address
    }

    /// Puts an object, what it holds first. Returns the address of its header, and of a group what its parent keeps of it.
    fn object(&mut self, object: &Object) -> FormatResult<(u64, SymbolTableCache)> {
        let object = object.0.borrow();
        let mut header = ObjectHeader::new();
        let cache = match &object.chunks {
            Some(chunks) => self.dataset(chunks, &mut header)?,
            None => self.group(&object.members, &mut header)?,
        };
        for attribute in &object.attributes {
            let message = attribute.encode_for(&CONTEXT, LibverBound::Earliest, ObjectFormat::Legacy);
            header.add_message(MSG_ATTRIBUTE, 0, message);
        }
        Ok((self.put(&header.encode_v1(1)?), cache))
    }

    fn dataset(&mut self, chunks: &Chunks, header: &mut ObjectHeader) -> FormatResult<SymbolTableCache> {
        let counts: Vec<u64> =
            std::iter::zip(&chunks.shape, &chunks.sides).map(|(n, side)| n.div_ceil(*side)).collect();
        let place = |index: usize| {
            let mut rest = index as u64;
            let mut place = vec![0; counts.len()];
            for axis in (0..counts.len()).rev() {
                (place[axis], rest) = (rest % counts[axis], rest / counts[axis]);
            }
            place
        };
        let mut entries = vec![];
        for (index, packed) in chunks.packed.iter().enumerate() {
            let key = ChunkKey::for_chunk(&place(index), &chunks.sides, packed.len() as u32, 0);
            entries.push((key, self.put(packed)));
        }
        let end = ChunkKey::right_bound(&place(chunks.packed.len().saturating_sub(1)), &chunks.sides);
        let tree = ChunkBTreeV1Tree::build(&entries, end, &self.ranks, WIDTH);
        let first = self.next();
        let addresses: Vec<u64> = (0..tree.node_count()).map(|node| first + (node * tree.node_size()) as u64).collect();
        for node in tree.encode(&addresses)? {
            self.put(&node);
        }
        let form = ObjectFormat::Legacy;
        let fill = FillValueMessage { alloc_time: ALLOC_TIME_INCR, ..FillValueMessage::default() };
        let layout = DataLayoutMessage::chunked_v3_btree_v1(chunks.sides.clone(), tree.root_address(&addresses));
        header.add_message(MSG_DATASPACE, 0, DataspaceMessage::simple(&chunks.shape).encode_for(&CONTEXT, form));
        header.add_message(MSG_DATATYPE, 0, chunks.datatype.encode_at(&CONTEXT, LibverBound::Earliest));
        header.add_message(MSG_FILL_VALUE, 0, fill.encode_for(form));
        header.add_message(MSG_DATA_LAYOUT, 0, layout.encode(&CONTEXT));
        header.add_message(MSG_FILTER_PIPELINE, 0, chunks.filters.encode_for(form));
        Ok(SymbolTableCache::Nothing)
    }

    fn group(
        &mut self,
        members: &BTreeMap<String, Object>,
        header: &mut ObjectHeader,
    ) -> FormatResult<SymbolTableCache> {
        let mut names = LocalHeapImage::with_empty_string();
        let mut entries = vec![];
        for (name, member) in members {
            let (obj_header_addr, cache) = self.object(member)?;
            entries.push(SymbolTableEntry { name_offset: names.insert_str(name), obj_header_addr, cache });
        }
        let data_addr = self.put(names.as_bytes());
        let heap = LocalHeapHeader {
            data_size: names.as_bytes().len() as u64,
            free_list_offset: LOCAL_HEAP_FREE_NULL,
            data_addr,
        };
        let heap_addr = self.put(&heap.encode(WIDTH, WIDTH));
        // Bounds of each node's names: that before it is the last name of the node before.
        let (mut keys, mut children) = (vec![0], vec![]);
        let node_size = self.ranks.symbol_table_node_size(WIDTH, WIDTH);
        for entries in entries.chunks(usize::from(self.ranks.sym_leaf_max_entries())) {
            let node = SymbolTableNode { entries: entries.to_vec() };
            children.push(self.put(&node.encode(node_size, WIDTH, WIDTH)?));
            keys.extend(entries.last().map(|entry| entry.name_offset));
        }
        let tree = BTreeV1Node {
            node_type: 0,
            level: 0,
            entries_used: children.len() as u16,
            left_sibling: UNDEF_ADDR,
            right_sibling: UNDEF_ADDR,
            keys,
            children,
        };
        let node_size = self.ranks.snode_btree_node_size(WIDTH, WIDTH);
        let btree_addr = self.put(&tree.encode(node_size, WIDTH, WIDTH)?);
        header.add_message(MSG_SYMBOL_TABLE, 0, [btree_addr.to_le_bytes(), heap_addr.to_le_bytes()].concat());
        Ok(SymbolTableCache::SymbolTable { btree_addr, heap_addr })
    }
}
