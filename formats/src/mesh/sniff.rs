//! Which format a file has, by its content.

use super::stl;
use super::text::{Text, is};

pub(super) enum Kind {
    Obj,
    Ply,
    StlText,
    StlBinary,
}

/// The kind, or what the file looks like instead and what to do: empty where there is no telling.
pub(super) fn kind(bytes: &[u8], name: &str) -> Result<Kind, &'static str> {
    if matches!(bytes, [b'p', b'l', b'y', b'\n' | b'\r' | b' ' | b'\t', ..]) {
        return Ok(Kind::Ply);
    }
    if stl::is_binary(bytes, bytes.len() as u64) {
        return Ok(Kind::StlBinary);
    }
    if let Some(likely) = other_kind(bytes) {
        return Err(likely);
    }
    let is_text = is_text(bytes);
    if is_text && is_stl_text(bytes) {
        return Ok(Kind::StlText);
    }
    if is_text && is_obj(bytes) {
        return Ok(Kind::Obj);
    }
    // Cut short or grown, a binary file keeps nothing but its name.
    let named_stl = name.len() >= 4 && name.as_bytes()[name.len() - 4..].eq_ignore_ascii_case(b".stl");
    if named_stl && !is_text {
        return Ok(Kind::StlBinary);
    }
    Err("")
}

/// The bytes at the beginning that must be free of NUL in a text. Binary headers are full of it.
const TEXT: usize = 1024;

/// Whether a file that begins so may be a text.
pub(super) fn is_text(beginning: &[u8]) -> bool {
    !beginning[..beginning.len().min(TEXT)].contains(&0)
}

fn other_kind(bytes: &[u8]) -> Option<&'static str> {
    let signatures: [(&[u8], &str); 9] = [
        (b"version https://git-lfs", "a git-lfs pointer, fetch the file itself with `git lfs pull`"),
        (b"\x89PNG", "a PNG image"),
        (b"\xff\xd8\xff", "a JPEG image"),
        (b"glTF", "a binary glTF file, export it as OBJ, PLY or STL"),
        (b"\x1f\x8b", "gzip-compressed, unpack it first"),
        (b"PK\x03\x04", "a zip archive, unpack it first"),
        (b"\x89HDF\r\n", "an HDF5 file"),
        (b"\xff\xfe", "UTF-16 text, save it as UTF-8"),
        (b"\xfe\xff", "UTF-16 text, save it as UTF-8"),
    ];
    if bytes.is_empty() {
        return Some("an empty file");
    }
    let begin = bytes.trim_ascii_start();
    if begin.starts_with(b"<") {
        return Some("an HTML or XML page");
    }
    signatures.iter().find(|(signature, _)| bytes.starts_with(signature)).map(|&(_, likely)| likely)
}

/// Begins with "solid", and goes on with a facet or the end of it.
fn is_stl_text(bytes: &[u8]) -> bool {
    let mut text = Text::<false>::new(bytes);
    let mut solid = false;
    loop {
        match text.token() {
            b"" => {}
            token if !solid && is(token, "solid") => solid = true,
            token if solid => return is(token, "facet") || is(token, "endsolid") || is(token, "color"),
            _ => return false,
        }
        if !text.next_line() {
            return false;
        }
    }
}

/// Has a line of points, polygons or polylines.
fn is_obj(bytes: &[u8]) -> bool {
    let mut text = Text::<true>::new(bytes);
    loop {
        if matches!(text.token(), b"v" | b"f" | b"l") {
            return true;
        }
        if !text.next_line() {
            return false;
        }
    }
}
