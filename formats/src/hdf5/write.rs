//! How is an HDF5 file made, on disk or in memory? Data first, as it comes; then, when all of it is known, what describes it.
//!
//! The file has the classic form that every reader knows, and no times: equal contents give equal bytes. Blocks lie one after the
//! other, each at a multiple of 8, what an object refers to before the object. [`records`] encodes them.

mod records;
#[cfg(test)]
mod tests;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{self, BufWriter, Cursor, Seek, SeekFrom, Write};
use std::path::Path;

use super::Compression;
use super::checksum::crc32;
use super::element::Element;
use super::packing::{Elements, packed_chunks};
use super::tiling::Tiling;
use records::{Attribute, AttributeValue, ChunkEntry, ChunkTree, Heap};

/// Creates a file and lets `fill` put objects into its root. Nothing is synced to the disk.
pub(crate) fn create(path: &Path, fill: impl FnOnce(&Group) -> io::Result<()>) -> io::Result<()> {
    let out = Output::Disk(BufWriter::new(std::fs::File::create(path)?));
    write(out, fill).map(|_| ())
}

/// The bytes of the file that [`create`] would make.
pub(crate) fn to_bytes(fill: impl FnOnce(&Group) -> io::Result<()>) -> io::Result<Vec<u8>> {
    write(Output::Memory(Cursor::new(Vec::new())), fill)
}

fn write(out: Output, fill: impl FnOnce(&Group) -> io::Result<()>) -> io::Result<Vec<u8>> {
    let mut file = File { out, position: 0, end: 0, objects: vec![Object::default()] };
    // Room for the superblock, which is known at the end.
    file.put(&[0; records::SUPERBLOCK_BYTES])?;
    let file = RefCell::new(file);
    fill(&Group { file: &file, object: 0 })?;
    file.into_inner().finish()
}

/// Where a file's bytes go.
enum Output {
    Disk(BufWriter<std::fs::File>),
    Memory(Cursor<Vec<u8>>),
}

/// The file so far.
struct File {
    out: Output,
    /// Where the next byte would go.
    position: u64,
    /// Bytes given out so far.
    end: u64,
    /// The root comes first.
    objects: Vec<Object>,
}

/// A group or a dataset, of which nothing but data is written yet.
#[derive(Default)]
struct Object {
    attributes: Vec<Attribute>,
    /// Members by name, as a symbol table has them.
    members: BTreeMap<String, usize>,
    dataset: Option<DatasetParts>,
}

struct DatasetParts {
    datatype: Vec<u8>,
    shape: Vec<u64>,
    storage: DatasetStorage,
}

enum DatasetStorage {
    /// One block.
    Contiguous { address: u64, bytes: u64 },
    /// Chunks in the order of [`Tiling::tile`], and what was done to their bytes.
    Chunked { sides: Vec<u64>, element_bytes: usize, compression: Compression, chunks: Vec<ChunkEntry> },
}

/// A group to put attributes, datasets and groups into.
pub(crate) struct Group<'f> {
    file: &'f RefCell<File>,
    object: usize,
}

impl<'f> Group<'f> {
    /// Adds a group.
    pub(crate) fn group(&self, name: &str) -> Self {
        self.member(name, None)
    }

    /// Sets an attribute to a text of variable length.
    pub(crate) fn set_text(&self, name: &str, text: &str) {
        self.set(name, AttributeValue::Text(text.to_owned()));
    }

    /// Sets an attribute to an ASCII text of fixed length.
    pub(crate) fn set_ascii(&self, name: &str, text: &str) {
        let datatype = records::ascii_type(text.len());
        self.set(name, AttributeValue::Fixed { datatype, count: None, data: text.into() });
    }

    /// Sets an attribute to a number.
    pub(crate) fn set_number<T: Element>(&self, name: &str, number: T) {
        self.set(name, AttributeValue::numbers(&[number], None));
    }

    /// Sets an attribute to several numbers.
    pub(crate) fn set_numbers<T: Element>(&self, name: &str, numbers: &[T]) {
        self.set(name, AttributeValue::numbers(numbers, Some(numbers.len() as u64)));
    }

    /// Adds a dataset of chunks, deflated or not. `transform` changes the elements of each chunk before they are stored; the
    /// CRC-32 of each transformed chunk is appended to `checksums`.
    pub(crate) fn chunked<T: Element>(
        &self,
        name: &str,
        [shape, chunk_shape]: [&[usize]; 2],
        compression: Compression,
        elements: &[T],
        transform: impl Fn(&mut [T]) + Sync,
        checksums: &mut Vec<u32>,
    ) -> io::Result<Self> {
        self.chunked_from(name, [shape, chunk_shape], compression, &elements, transform, checksums)
    }

    /// [`chunked`](Self::chunked) of elements that need not be in memory: of few chunks at a time.
    pub(crate) fn chunked_from<T: Element>(
        &self,
        name: &str,
        [shape, chunk_shape]: [&[usize]; 2],
        compression: Compression,
        elements: &(dyn Elements<T> + '_),
        transform: impl Fn(&mut [T]) + Sync,
        checksums: &mut Vec<u32>,
    ) -> io::Result<Self> {
        let tiling = Tiling::new(shape, chunk_shape);
        let mut chunks = Vec::with_capacity(tiling.count().unwrap_or(0));
        packed_chunks(elements, &tiling, compression, transform, |packed| {
            let address = self.file.borrow_mut().put(&packed.packed)?;
            chunks.push(ChunkEntry { address, stored_bytes: packed.packed.len() as u32 });
            checksums.push(packed.checksum);
            Ok(())
        })?;
        let sides = widened(chunk_shape);
        let storage = DatasetStorage::Chunked { sides, element_bytes: T::BYTES, compression, chunks };
        let parts = DatasetParts { datatype: records::datatype::<T>(), shape: widened(shape), storage };
        Ok(self.member(name, Some(parts)))
    }

    /// Begins a dataset of rows that are appended as they come, in chunks of so many, not deflated.
    pub(crate) fn appended<T: Element>(&self, columns: usize, chunk_rows: usize) -> Appended<'f, T> {
        let pending = Vec::with_capacity(columns * chunk_rows);
        Appended { file: self.file, columns, chunk_rows, pending, rows: 0, chunks: vec![], checksums: vec![] }
    }

    /// Adds a dataset whose rows are all appended, if there are any, and the CRC-32 of its chunks to `checksums`.
    pub(crate) fn end_appended<T: Element>(
        &self,
        name: &str,
        mut appended: Appended<'f, T>,
        checksums: &mut Vec<u32>,
    ) -> io::Result<()> {
        let rows = appended.rows + appended.pending.len() / appended.columns;
        if rows == 0 {
            return Ok(());
        }
        // Chunks are no larger than the dataset, and all of one size.
        let chunk_rows = appended.chunk_rows.min(rows);
        if !appended.pending.is_empty() {
            appended.put(chunk_rows)?;
        }
        checksums.append(&mut appended.checksums);
        let storage = DatasetStorage::Chunked {
            sides: widened(&[chunk_rows, appended.columns]),
            element_bytes: T::BYTES,
            compression: Compression::None,
            chunks: appended.chunks,
        };
        let shape = widened(&[rows, appended.columns]);
        self.member(name, Some(DatasetParts { datatype: records::datatype::<T>(), shape, storage }));
        Ok(())
    }

    /// Adds a dataset in one block, whose rows are written later.
    pub(crate) fn contiguous<T: Element>(&self, name: &str, shape: &[usize]) -> Contiguous<'f> {
        let bytes = shape.iter().product::<usize>() as u64 * T::BYTES as u64;
        let address = self.file.borrow_mut().reserve(bytes);
        let storage = DatasetStorage::Contiguous { address, bytes };
        self.member(name, Some(DatasetParts { datatype: records::datatype::<T>(), shape: widened(shape), storage }));
        Contiguous { file: self.file, address, bytes }
    }

    fn set(&self, name: &str, value: AttributeValue) {
        let attribute = Attribute { name: name.to_owned(), value };
        self.file.borrow_mut().objects[self.object].attributes.push(attribute);
    }

    fn member(&self, name: &str, dataset: Option<DatasetParts>) -> Self {
        let mut file = self.file.borrow_mut();
        let object = file.objects.len();
        file.objects.push(Object { dataset, ..Object::default() });
        file.objects[self.object].members.insert(name.to_owned(), object);
        Self { file: self.file, object }
    }
}

/// A dataset of rows so far.
pub(crate) struct Appended<'f, T> {
    file: &'f RefCell<File>,
    columns: usize,
    chunk_rows: usize,
    /// Elements of the chunk that is not full yet.
    pending: Vec<T>,
    /// Rows in chunks that are written.
    rows: usize,
    chunks: Vec<ChunkEntry>,
    checksums: Vec<u32>,
}

impl<T: Element> Appended<'_, T> {
    /// Appends elements of whole rows.
    pub(crate) fn append(&mut self, mut elements: &[T]) -> io::Result<()> {
        let full = self.columns * self.chunk_rows;
        while !elements.is_empty() {
            let (some, rest) = elements.split_at(elements.len().min(full - self.pending.len()));
            self.pending.extend_from_slice(some);
            elements = rest;
            if self.pending.len() == full {
                self.put(self.chunk_rows)?;
            }
        }
        Ok(())
    }

    /// Writes the pending elements as a chunk of so many rows, filled up with zeros.
    fn put(&mut self, chunk_rows: usize) -> io::Result<()> {
        let mut bytes = vec![0; self.columns * chunk_rows * T::BYTES];
        let used = self.pending.len() * T::BYTES;
        T::copy_to_le(&self.pending, &mut bytes[..used]);
        self.checksums.push(crc32(&bytes[..used]));
        let address = self.file.borrow_mut().put(&bytes)?;
        self.chunks.push(ChunkEntry { address, stored_bytes: bytes.len() as u32 });
        self.rows += self.pending.len() / self.columns;
        self.pending.clear();
        Ok(())
    }
}

/// A dataset in one block.
pub(crate) struct Contiguous<'f> {
    file: &'f RefCell<File>,
    address: u64,
    bytes: u64,
}

impl Contiguous<'_> {
    /// Writes bytes at an offset. Errors: the disk's, and bytes that would stick out.
    pub(crate) fn write(&self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        if offset + bytes.len() as u64 > self.bytes {
            return Err(io::Error::other("rows stick out of their dataset"));
        }
        self.file.borrow_mut().write_at(self.address + offset, bytes)
    }
}

impl File {
    /// Room for a block at the end; its address.
    fn reserve(&mut self, bytes: u64) -> u64 {
        let address = self.end.next_multiple_of(8);
        self.end = address + bytes;
        address
    }

    fn put(&mut self, block: &[u8]) -> io::Result<u64> {
        let address = self.reserve(block.len() as u64);
        self.write_at(address, block)?;
        Ok(address)
    }

    fn write_at(&mut self, address: u64, bytes: &[u8]) -> io::Result<()> {
        // Zeros up to the next multiple of 8 keep what is buffered together.
        if let gap @ 1..8 = address.wrapping_sub(self.position) {
            self.write(&[0; 8][..gap as usize])?;
        }
        if address != self.position {
            match &mut self.out {
                Output::Disk(out) => out.seek(SeekFrom::Start(address))?,
                Output::Memory(out) => out.seek(SeekFrom::Start(address))?,
            };
            self.position = address;
        }
        self.write(bytes)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match &mut self.out {
            Output::Disk(out) => out.write_all(bytes)?,
            Output::Memory(out) => out.write_all(bytes)?,
        }
        self.position += bytes.len() as u64;
        Ok(())
    }

    /// Writes what describes the data, then the superblock. Returns the bytes of a file in memory.
    fn finish(mut self) -> io::Result<Vec<u8>> {
        let objects = std::mem::take(&mut self.objects);
        let texts = objects.iter().flat_map(|object| &object.attributes).filter_map(Attribute::text);
        let mut heap = Heap::new(texts)?;
        if !heap.is_empty() {
            heap.address = self.put(&heap.encode())?;
        }
        let (header, group) = self.put_object(&objects, 0, &heap)?;
        let superblock = records::superblock(header, group, self.end);
        self.write_at(0, &superblock)?;
        match self.out {
            Output::Disk(mut out) => out.flush().map(|()| Vec::new()),
            Output::Memory(out) => Ok(out.into_inner()),
        }
    }

    /// Puts an object, what it holds first. Returns the address of its header, and of a group those of its tree and its names.
    fn put_object(&mut self, objects: &[Object], index: usize, heap: &Heap) -> io::Result<(u64, Option<[u64; 2]>)> {
        let object = &objects[index];
        let mut messages = Vec::new();
        let mut group = None;
        match &object.dataset {
            Some(parts) => self.describe_dataset(parts, &mut messages)?,
            None => {
                let members = object.members.iter().map(|(name, member)| {
                    let (header, group) = self.put_object(objects, *member, heap)?;
                    Ok(records::Member { name, header, group })
                });
                let members = members.collect::<io::Result<Vec<_>>>()?;
                let addresses = self.put_members(&members)?;
                messages.push(records::symbol_table(addresses));
                group = Some(addresses);
            }
        }
        messages.extend(object.attributes.iter().map(|attribute| attribute.encode(heap)));
        Ok((self.put(&records::object_header(&messages)?)?, group))
    }

    fn describe_dataset(&mut self, parts: &DatasetParts, messages: &mut Vec<records::Message>) -> io::Result<()> {
        let DatasetParts { datatype, shape, storage } = parts;
        messages.extend([records::dataspace(shape), records::datatype_message(datatype), records::fill_value(storage)]);
        match storage {
            DatasetStorage::Contiguous { address, bytes } => {
                messages.push(records::contiguous_layout(*address, *bytes))
            }
            DatasetStorage::Chunked { sides, element_bytes, compression, chunks } => {
                let tree = self.put_chunk_tree(&ChunkTree { shape, sides, element_bytes: *element_bytes, chunks })?;
                messages.push(records::chunked_layout(tree, sides, *element_bytes));
                messages.extend(records::filters(*compression, *element_bytes));
            }
        }
        Ok(())
    }

    /// Puts the nodes of a tree of chunks, level by level; returns the root's address.
    fn put_chunk_tree(&mut self, tree: &ChunkTree) -> io::Result<u64> {
        let mut entries = tree.entries();
        for level in 0.. {
            let first = self.end.next_multiple_of(8);
            let (nodes, parents) = tree.level(level, first, &entries);
            self.put(&nodes)?;
            entries = parents;
            if let [(_, root)] = entries[..] {
                return Ok(root);
            }
        }
        unreachable!("a level has at most a 64th of the nodes of the level below, rounded up")
    }

    /// Puts the names of a group's members and the tree of their addresses; returns the addresses of tree and names.
    fn put_members(&mut self, members: &[records::Member]) -> io::Result<[u64; 2]> {
        let (names, offsets) = records::names(members);
        let data = self.put(&names)?;
        let heap = self.put(&records::local_heap(names.len() as u64, data))?;
        let mut nodes = vec![];
        for (members, offsets) in members.chunks(records::NODE_MEMBERS).zip(offsets.chunks(records::NODE_MEMBERS)) {
            let address = self.put(&records::symbol_node(members, offsets))?;
            nodes.push((address, offsets[offsets.len() - 1]));
        }
        let tree = self.put(&records::group_tree(&nodes)?)?;
        Ok([tree, heap])
    }
}

fn widened(counts: &[usize]) -> Vec<u64> {
    counts.iter().map(|count| *count as u64).collect()
}
