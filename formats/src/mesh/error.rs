use std::fmt::{self, Display, Formatter};
use std::io;

/// Why a mesh file was refused. One line, with no byte of the file that a terminal could act on.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// The file cannot be opened or read.
    #[error("{}: {source}", plain(.file))]
    Unreadable { file: String, source: io::Error },

    /// The content is none of the three formats. `likely` says what it is instead and what to do, or is empty.
    #[error("{}: not an OBJ, PLY or STL mesh{}{likely}", plain(.file), if .likely.is_empty() { "" } else { ": " })]
    NotAMesh { file: String, likely: &'static str },

    /// The file is in order, but holds none of `what`.
    #[error("no {what} in {}", plain(.file))]
    Nothing { file: String, what: &'static str },

    /// The file breaks its format.
    #[error("{}{}: expected {}, found {}", plain(.file), .fault.comma_place(), .fault.wanted, .fault.found)]
    Malformed { file: String, fault: Fault },
}

/// What is wrong at one place of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// `None` where the whole file is meant, such as its length.
    pub place: Option<Place>,
    pub wanted: String,
    /// Printable: quoted bytes are escaped and cut short.
    pub found: String,
}

/// A place in a mesh file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// Counted from 1, as editors do.
    Line(usize),
    /// One of the elements of a binary file by their kind ("face"), counted from 0 as the file's own indices.
    Element(String, usize),
}

impl Fault {
    pub(super) fn at(place: Place, wanted: impl Into<String>, found: impl Into<String>) -> Self {
        Self { place: Some(place), wanted: wanted.into(), found: found.into() }
    }

    pub(super) fn on_line(line: usize, wanted: impl Into<String>, found: impl Into<String>) -> Self {
        Self::at(Place::Line(line), wanted, found)
    }

    pub(super) fn of_file(wanted: impl Into<String>, found: impl Into<String>) -> Self {
        Self { place: None, wanted: wanted.into(), found: found.into() }
    }

    fn comma_place(&self) -> String {
        self.place.as_ref().map_or_else(String::new, |place| format!(", {place}"))
    }
}

impl Display for Place {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Element(kind, index) => write!(f, "{kind} {index}"),
        }
    }
}

/// The longest quotation of a file's bytes in a message, in characters: room for any sensible number, and the message
/// stays on one line.
const QUOTE: usize = 40;

/// Bytes of the file as a message may show them: escaped, in quotes, cut at [`QUOTE`].
pub(super) fn quote(token: &[u8]) -> String {
    if token.is_empty() {
        return "nothing".into();
    }
    let mut text: String = token.escape_ascii().take(QUOTE).map(char::from).collect();
    if token.escape_ascii().nth(QUOTE).is_some() {
        text.push('…');
    }
    format!("`{text}`")
}

/// A number as a message may show it: never hundreds of digits.
pub(super) fn spell(value: f64) -> String {
    if value != 0.0 && !(1e-9..1e18).contains(&value.abs()) { format!("{value:e}") } else { value.to_string() }
}

/// A file's name without the control characters that a name may hold.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}
