//! Errors of mesh files: which file, where in it, what was expected, what was found.

use std::fmt::{self, Display, Formatter};
use std::io;

/// Why a mesh file was refused. Prints as one line, without bytes of the file that a terminal could act on.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// The file cannot be opened or read.
    #[error("{}: {source}", printable(.file))]
    Unreadable {
        /// Name of the file.
        file: String,
        /// The system's error.
        source: io::Error,
    },

    /// The content has none of the formats.
    #[error("{}: not an OBJ, PLY, STL or OFF mesh{}{hint}", printable(.file), if .hint.is_empty() { "" } else { ": " })]
    NotAMesh {
        /// Name of the file.
        file: String,
        /// The kind of the content and what to do, or nothing.
        hint: &'static str,
    },

    /// The file is valid, but contains none of `what`.
    #[error("no {what} in {}", printable(.file))]
    Empty {
        /// Name of the file.
        file: String,
        /// The missing elements, such as `triangles`.
        what: &'static str,
    },

    /// The file breaks its format.
    #[error("{}{}: expected {}, found {}", printable(.file), .fault.location_suffix(), .fault.expected, .fault.found)]
    Malformed {
        /// Name of the file.
        file: String,
        /// Location and fault.
        fault: MeshFault,
    },
}

/// Fault in a mesh file: its location, and what was expected and found there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeshFault {
    /// `None` for the whole file, such as its length.
    pub location: Option<Location>,
    /// The text or value that the format requires there.
    pub expected: String,
    /// Printable: quoted bytes are escaped and cut short.
    pub found: String,
}

/// A location in a mesh file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Location {
    /// Line number, counted from 1.
    Line(usize),
    /// Kind of an element of a binary file ("face"), and its index, counted from 0.
    Element(String, usize),
}

impl MeshFault {
    pub(super) fn new(location: Location, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self { location: Some(location), expected: expected.into(), found: found.into() }
    }

    pub(super) fn line(line: usize, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::new(Location::Line(line), expected, found)
    }

    pub(super) fn whole_file(expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self { location: None, expected: expected.into(), found: found.into() }
    }

    fn location_suffix(&self) -> String {
        self.location.as_ref().map_or_else(String::new, |location| format!(", {location}"))
    }
}

impl Display for Location {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Element(kind, index) => write!(f, "{kind} {index}"),
        }
    }
}

/// Longest quotation of a file's bytes in a message, in characters: enough for any sensible number, and the message
/// stays on one line.
const MAX_QUOTE: usize = 40;

/// Bytes of the file for a message: escaped, in quotes, cut at [`MAX_QUOTE`].
pub(super) fn quote(token: &[u8]) -> String {
    if token.is_empty() {
        return "nothing".into();
    }
    let mut text: String = token.escape_ascii().take(MAX_QUOTE).map(char::from).collect();
    if token.escape_ascii().nth(MAX_QUOTE).is_some() {
        text.push('…');
    }
    format!("`{text}`")
}

/// A number for a message, without hundreds of digits.
pub(super) fn spell(value: f64) -> String {
    if value != 0.0 && !(1e-9..1e18).contains(&value.abs()) { format!("{value:e}") } else { value.to_string() }
}

/// A file's name without control characters.
fn printable(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}
