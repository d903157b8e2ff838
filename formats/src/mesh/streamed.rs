//! An OBJ file read a little at a time: memory that is new costs more than parsing what is put in it.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use memchr::memrchr_iter;

use super::error::Fault;
use super::sniff::{self, Kind};
use super::text::Text;
use super::{Mesh, MeshError, checked, obj, parse, stl};

/// Bytes that are read at a time: what a processor's second cache holds, and enough that a call to the system is cheap.
const AT_A_TIME: usize = 256 << 10;

/// As [`parse`] would read the whole file. The error is that of the system.
pub(super) fn read(path: &Path, name: &str) -> io::Result<Result<Mesh, MeshError>> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut bytes = Vec::with_capacity(AT_A_TIME);
    let more = read_some(&mut file, &mut bytes)?;
    let may_be_lines = more && sniff::is_text(&bytes) && !stl::is_binary(&bytes, length);
    if may_be_lines && matches!(sniff::kind(&bytes[..whole_lines(&bytes)], name), Ok(Kind::Obj)) {
        return Ok(checked(read_obj(&mut file, bytes)?, name));
    }
    file.read_to_end(&mut bytes)?;
    Ok(parse(&bytes, name))
}

/// `bytes` is the beginning of the file, of which there is more.
fn read_obj(file: &mut File, mut bytes: Vec<u8>) -> io::Result<Result<Mesh, Fault>> {
    let mut found = obj::Found::default();
    let mut line = None;
    let mut more = true;
    while more {
        let whole = whole_lines(&bytes);
        if let Err(fault) = read_lines(&mut found, &bytes[..whole], &mut line) {
            return Ok(Err(fault));
        }
        bytes.drain(..whole);
        more = read_some(file, &mut bytes)?;
    }
    Ok(read_lines(&mut found, &bytes, &mut line).and_then(|()| found.mesh()))
}

/// `line` is the number of the first, after any have been read.
fn read_lines(found: &mut obj::Found, bytes: &[u8], line: &mut Option<usize>) -> Result<(), Fault> {
    if bytes.is_empty() {
        return Ok(());
    }
    let mut text = line.map_or_else(|| Text::new(bytes), |line| Text::from_line(bytes, line));
    found.read(&mut text)?;
    *line = Some(text.line);
    Ok(())
}

/// Appends until as much is there as is read at a time; false at the end of the file.
fn read_some(file: &mut File, bytes: &mut Vec<u8>) -> io::Result<bool> {
    // Of a line that does not end, twice as much each time.
    let wanted = AT_A_TIME.max(2 * bytes.len()) - bytes.len();
    Ok(file.take(wanted as u64).read_to_end(bytes)? == wanted)
}

/// How many bytes are surely whole lines. A line that a backslash joins to the next is not, nor one that ends with CR alone:
/// LF may follow.
fn whole_lines(bytes: &[u8]) -> usize {
    let joins = |end: usize| bytes[..end].ends_with(b"\\") || bytes[..end].ends_with(b"\\\r");
    memrchr_iter(b'\n', bytes).find(|end| !joins(*end)).map_or(0, |end| end + 1)
}
