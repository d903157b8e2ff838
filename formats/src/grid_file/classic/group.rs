use super::bytes::{Bytes, Fields};
use super::object::Object;
use crate::grid_file::Fault;

const SYMBOL_TABLE: u16 = 0x11;

/// The names of a group of ours take less than 100 bytes.
const MAX_NAME_BYTES: u64 = 1 << 16;

/// Twice what a node of HDF5's default ranks has room for. A group of that many members is far from ours.
const MAX_ENTRIES: u16 = 64;

/// The object that a group has under a name: sections III.A.1, III.B, III.C and III.D.
pub(super) fn member(bytes: &mut Bytes, group: &Object, name: &str) -> Result<Object, Fault> {
    let absent = || Fault::not_a_grid(format!("it has no {name}"));
    let mut table = Fields(group.only(SYMBOL_TABLE).ok_or_else(absent)?);
    let [tree, heap] = [table.u64()?, table.u64()?];
    let names = names(bytes, heap)?;
    for node in nodes(bytes, tree)? {
        let head = bytes.at(node, 8)?;
        let mut head = Fields(&head);
        head.expect(b"SNOD")?;
        head.skip(2)?;
        let count = plausible(head.u16()?)?;
        let entries = bytes.at(node + 8, count * 40)?;
        for entry in entries.chunks_exact(40) {
            let mut entry = Fields(entry);
            let [name_at, address] = [entry.u64()?, entry.u64()?];
            if starts_with_text(&names, name_at, name) {
                // Of a soft link the address says nothing.
                let is_link = entry.u32()? == 2;
                return if is_link { Err(absent()) } else { Object::read(bytes, address) };
            }
        }
    }
    Err(absent())
}

/// The local heap's bytes.
fn names(bytes: &mut Bytes, heap: u64) -> Result<Vec<u8>, Fault> {
    let head = bytes.at(heap, 32)?;
    let mut head = Fields(&head);
    head.expect(b"HEAP")?;
    head.skip(4)?;
    let size = head.u64()?;
    head.skip(8)?;
    if size > MAX_NAME_BYTES {
        return Err(Fault::damaged(format!("the names of a group take {size} bytes")));
    }
    bytes.at(head.u64()?, size as usize)
}

/// The addresses of the symbol table nodes, from a tree that is a single leaf.
fn nodes(bytes: &mut Bytes, tree: u64) -> Result<Vec<u64>, Fault> {
    let head = bytes.at(tree, 24)?;
    let mut head = Fields(&head);
    head.expect(b"TREE")?;
    if [head.u8()?, head.u8()?] != [0, 0] {
        return Err(Fault::not_a_grid("it has a group of very many members"));
    }
    let count = plausible(head.u16()?)?;
    let entries = bytes.at(tree + 24, count * 16)?;
    entries.chunks_exact(16).map(|entry| Fields(&entry[8..]).u64()).collect()
}

fn plausible(count: u16) -> Result<usize, Fault> {
    if count > MAX_ENTRIES {
        return Err(Fault::damaged(format!("a node of a group has {count} entries")));
    }
    Ok(usize::from(count))
}

fn starts_with_text(names: &[u8], at: u64, name: &str) -> bool {
    let here = usize::try_from(at).ok().and_then(|at| names.get(at..)).unwrap_or_default();
    here.strip_prefix(name.as_bytes()).is_some_and(|rest| rest.first() == Some(&0))
}
