//! Format of a file, from its content.
//!
//! Binary STL is tested before text: its header may contain anything, but its length must match its triangle count.

use super::MeshFormat;
use super::text::{Text, is_keyword};
use super::{off, stl};
use std::fs::File;
use std::io::Read;
use std::path::Path;

pub(super) enum FileKind {
    Obj,
    Ply,
    StlText,
    StlBinary,
    Off,
}

/// The kind of a file, or a hint what it is instead and what to do; empty if unknown.
pub(super) fn kind(bytes: &[u8], name: &str) -> Result<FileKind, &'static str> {
    if matches!(bytes, [b'p', b'l', b'y', b'\n' | b'\r' | b' ' | b'\t', ..]) {
        return Ok(FileKind::Ply);
    }
    if stl::is_binary(bytes, bytes.len() as u64) {
        return Ok(FileKind::StlBinary);
    }
    if let Some(hint) = foreign_kind(bytes) {
        return Err(hint);
    }
    if off::is_off(bytes) {
        return Ok(FileKind::Off);
    }
    let is_text = is_text(bytes);
    if is_text && is_stl_text(bytes) {
        return Ok(FileKind::StlText);
    }
    if is_text && is_obj(bytes) {
        return Ok(FileKind::Obj);
    }
    // A binary file cut short or extended is recognized by its name only.
    let is_named =
        |ending: &[u8]| name.as_bytes().last_chunk::<4>().is_some_and(|end| end.eq_ignore_ascii_case(ending));
    if is_named(b".stl") && !is_text {
        return Ok(FileKind::StlBinary);
    }
    if is_named(b".off") && is_text {
        return Ok(FileKind::Off);
    }
    Err("")
}

/// Bytes of a file that [`format_of`] looks at.
const BEGINNING_BYTES: u64 = 64 << 10;

/// The format of a mesh file, from its beginning; `None` for other files, and for those that cannot be read. TOML that names
/// a field is not a mesh, though its keys may be the letters of an OBJ file.
pub fn format_of(path: &Path) -> Option<MeshFormat> {
    // Checked before opening, because opening a pipe waits for its writer.
    let file = if path.is_file() { File::open(path).ok()? } else { return None };
    let length = file.metadata().ok()?.len();
    let mut beginning = Vec::new();
    file.take(BEGINNING_BYTES).read_to_end(&mut beginning).ok()?;
    if stl::is_binary(&beginning, length) {
        return Some(MeshFormat::Stl);
    }
    match kind(&beginning, "").ok()? {
        FileKind::Obj if memchr::memmem::find(&beginning, b"[field").is_some() => None,
        FileKind::Obj => Some(MeshFormat::Obj),
        FileKind::Ply => Some(MeshFormat::Ply),
        FileKind::StlText | FileKind::StlBinary => Some(MeshFormat::Stl),
        FileKind::Off => Some(MeshFormat::Off),
    }
}

/// Bytes at the beginning of a text that must not contain NUL. Binary headers are full of it.
const TEXT_BYTES: usize = 1024;

/// `true` if a file that begins so may be a text.
pub(super) fn is_text(beginning: &[u8]) -> bool {
    !beginning[..beginning.len().min(TEXT_BYTES)].contains(&0)
}

fn foreign_kind(bytes: &[u8]) -> Option<&'static str> {
    let signatures: [(&[u8], &str); 9] = [
        (b"version https://git-lfs", "a git-lfs pointer, fetch the file itself with `git lfs pull`"),
        (b"\x89PNG", "a PNG image"),
        (b"\xff\xd8\xff", "a JPEG image"),
        (b"glTF", "a binary glTF file, export it as OBJ, PLY, STL or OFF"),
        (b"\x1f\x8b", "gzip-compressed, unpack it first"),
        (b"PK\x03\x04", "a zip archive, unpack it first"),
        (b"\x89HDF\r\n", "an HDF5 file"),
        (b"\xff\xfe", "UTF-16 text, save it as UTF-8"),
        (b"\xfe\xff", "UTF-16 text, save it as UTF-8"),
    ];
    if bytes.is_empty() {
        return Some("an empty file");
    }
    let trimmed = bytes.trim_ascii_start();
    if trimmed.starts_with(b"<") {
        return Some("an HTML or XML page");
    }
    signatures.iter().find(|(signature, _)| bytes.starts_with(signature)).map(|&(_, hint)| hint)
}

/// `true` if the text begins with "solid" and goes on with a facet or the end of the solid.
fn is_stl_text(bytes: &[u8]) -> bool {
    let mut text = Text::<false>::new(bytes);
    let mut is_in_solid = false;
    loop {
        match text.token() {
            b"" => {}
            token if !is_in_solid && is_keyword(token, "solid") => is_in_solid = true,
            token if is_in_solid => return ["facet", "endsolid", "color"].iter().any(|word| is_keyword(token, word)),
            _ => return false,
        }
        if !text.next_line() {
            return false;
        }
    }
}

/// `true` if some line has a point, a polygon or a polyline.
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
