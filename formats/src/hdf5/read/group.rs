//! Members of a group, by name: sections III.A.1, III.B, III.C and III.D.
//!
//! A group's symbol table message names a B-tree, whose leaf lists symbol table nodes, and a local heap, which holds
//! the names. A group that fills more than one leaf is far larger than ours and is refused.

use super::ReadError;
use super::fields::Fields;
use super::object::Object;
use super::source::ByteSource;

const SYMBOL_TABLE: u16 = 0x11;

/// Largest heap of names, in bytes; those of our groups take less than 100.
const MAX_NAMES_BYTES: u64 = 1 << 16;

/// Most entries of a node: twice what HDF5's default ranks leave room for.
const MAX_ENTRIES: u16 = 64;

/// Cache type of a soft link, whose address means nothing.
const SOFT_LINK: u32 = 2;

/// The object that a group has under a name.
pub(super) fn member(source: &ByteSource, group: &Object, name: &str) -> Result<Object, ReadError> {
    let absent = || ReadError::unexpected(format!("it has no {name}"));
    let mut table = Fields(group.only(SYMBOL_TABLE).ok_or_else(absent)?);
    let [tree, heap] = [table.u64()?, table.u64()?];
    let names = names(source, heap)?;
    for node in symbol_nodes(source, tree)? {
        let head = source.read(node, 8)?;
        let mut head = Fields(&head);
        head.expect(b"SNOD")?;
        head.skip(2)?;
        let count = checked_count(head.u16()?)?;
        let entries = source.read(node + 8, count * 40)?;
        for entry in entries.chunks_exact(40) {
            let mut entry = Fields(entry);
            let [name_offset, address] = [entry.u64()?, entry.u64()?];
            if is_name_at(&names, name_offset, name) {
                let is_soft_link = entry.u32()? == SOFT_LINK;
                return if is_soft_link { Err(absent()) } else { Object::read(source, address) };
            }
        }
    }
    Err(absent())
}

/// Contents of the local heap.
fn names(source: &ByteSource, heap: u64) -> Result<Vec<u8>, ReadError> {
    let head = source.read(heap, 32)?;
    let mut head = Fields(&head);
    head.expect(b"HEAP")?;
    head.skip(4)?;
    let size = head.u64()?;
    head.skip(8)?;
    if size > MAX_NAMES_BYTES {
        return Err(ReadError::damaged(format!("the names of a group take {size} bytes")));
    }
    source.read(head.u64()?, size as usize)
}

/// Addresses of the symbol table nodes, from a tree that is a single leaf.
fn symbol_nodes(source: &ByteSource, tree: u64) -> Result<Vec<u64>, ReadError> {
    let head = source.read(tree, 24)?;
    let mut head = Fields(&head);
    head.expect(b"TREE")?;
    if [head.u8()?, head.u8()?] != [0, 0] {
        return Err(ReadError::unexpected("it has a group with too many members"));
    }
    let count = checked_count(head.u16()?)?;
    let entries = source.read(tree + 24, count * 16)?;
    entries.chunks_exact(16).map(|entry| Fields(&entry[8..]).u64()).collect()
}

fn checked_count(count: u16) -> Result<usize, ReadError> {
    if count > MAX_ENTRIES {
        return Err(ReadError::damaged(format!("a node of a group has {count} entries")));
    }
    Ok(usize::from(count))
}

fn is_name_at(names: &[u8], offset: u64, name: &str) -> bool {
    let text = usize::try_from(offset).ok().and_then(|offset| names.get(offset..)).unwrap_or_default();
    text.strip_prefix(name.as_bytes()).is_some_and(|rest| rest.first() == Some(&0))
}
