//! OBJ files read in blocks: filling fresh memory with a whole file costs more than parsing it.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use memchr::memrchr_iter;

use super::error::MeshFault;
use super::sniff::{self, FileKind};
use super::text::Text;
use super::{Mesh, MeshError, checked, obj, read_bytes, stl};

/// Bytes read at a time: they fit a processor's second-level cache, and system calls stay cheap.
const BLOCK_BYTES: usize = 256 << 10;

/// Same result as [`read_bytes`] of the whole file. The outer error is the system's.
pub(super) fn read(path: &Path, name: &str) -> io::Result<Result<Mesh, MeshError>> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut bytes = Vec::with_capacity(BLOCK_BYTES);
    let has_more = append_block(&mut file, &mut bytes)?;
    let may_be_lines = has_more && sniff::is_text(&bytes) && !stl::is_binary(&bytes, length);
    if may_be_lines && matches!(sniff::kind(&bytes[..whole_lines(&bytes)], name), Ok(FileKind::Obj)) {
        return Ok(checked(read_obj(&mut file, bytes)?, name));
    }
    file.read_to_end(&mut bytes)?;
    Ok(read_bytes(&bytes, name))
}

/// `bytes` is the beginning of a file that has more.
fn read_obj(file: &mut File, mut bytes: Vec<u8>) -> io::Result<Result<Mesh, MeshFault>> {
    let mut reader = obj::ObjReader::default();
    let mut line = None;
    let mut has_more = true;
    while has_more {
        let length = whole_lines(&bytes);
        if let Err(fault) = read_lines(&mut reader, &bytes[..length], &mut line) {
            return Ok(Err(fault));
        }
        bytes.drain(..length);
        has_more = append_block(file, &mut bytes)?;
    }
    Ok(read_lines(&mut reader, &bytes, &mut line).and_then(|()| reader.finish()))
}

/// `line` is the number of the first line; `None` at the beginning of the file.
fn read_lines(reader: &mut obj::ObjReader, bytes: &[u8], line: &mut Option<usize>) -> Result<(), MeshFault> {
    if bytes.is_empty() {
        return Ok(());
    }
    let mut text = line.map_or_else(|| Text::new(bytes), |line| Text::from_line(bytes, line));
    reader.read(&mut text)?;
    *line = Some(text.line);
    Ok(())
}

/// Appends until `bytes` holds a block; `false` at the end of the file.
fn append_block(file: &mut File, bytes: &mut Vec<u8>) -> io::Result<bool> {
    // A line longer than a block doubles the block each time.
    let count = BLOCK_BYTES.max(2 * bytes.len()) - bytes.len();
    Ok(file.take(count as u64).read_to_end(bytes)? == count)
}

/// Number of bytes that certainly are whole lines. A line joined to the next by a backslash is not whole. Nor is a line
/// that ends with CR at the end of the block: LF may follow.
fn whole_lines(bytes: &[u8]) -> usize {
    let is_joined = |end: usize| bytes[..end].ends_with(b"\\") || bytes[..end].ends_with(b"\\\r");
    memrchr_iter(b'\n', bytes).find(|end| !is_joined(*end)).map_or(0, |end| end + 1)
}
