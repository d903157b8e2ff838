//! Scenes: what a TOML file describes, how it is built and run, and what is measured of it. docs/scenes.md lists every key.
//!
//! | question | file |
//! |---|---|
//! | Which keys does a file have? | `scene/spec`, `scene/mesh_spec` |
//! | Which numbers are refused? | `scene/check` |
//! | How does it become a world and obstacles? | `scene/build` |
//! | Which shape has a closed form at a time? | `scene/animation` |
//! | What does a smaller scene have fewer of? | `scene/shrink` |
//! | How is it run, once or in many variants? | `scene/run`, `scene/vary` |
//! | Who may strike whom within a frame, and who passes by? | `scene/struck`, `scene/passing` |
//! | What is measured, and is it reached? | `scene/figures` |
//! | Which bodies begin in one place, with faces that coincide? | `scene/coinciding` |
//! | Which things touch, and how far do normals turn? | `scene/touching` |
//! | Which side does an entangled patch leave on? | `scene/entangled` |
//! | Which way do bodies part that start inside of each other? | `scene/separate` |

mod animation;
mod budget;
mod build;
mod check;
mod coinciding;
mod entangled;
mod figures;
mod mesh_spec;
mod passing;
mod run;
mod separate;
mod shrink;
mod spec;
mod struck;
mod touching;
mod vary;

pub use animation::Animation;
pub use build::{Obstacles, Stage};
pub use figures::{Figures, Seconds};
pub use mesh_spec::MeshSpec;
pub use run::{ElementMethod, RunError, UnknownMethod, run};
pub use spec::{Beyond, CageMapSpec, ClothSpec, ObstacleSpec, Reach, RigidSpec, SceneSpec, SoftSpec, Vary};
pub use vary::{Outcome, run_all, variants};

use std::path::{Path, PathBuf};

/// Why a scene cannot be run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The text is not a scene.
    #[error("{name}: {message}")]
    Invalid {
        /// The file.
        name: String,
        /// The fault, its place, and a remedy.
        message: String,
    },
}

pub(crate) fn invalid(name: &str, message: impl ToString) -> SceneError {
    SceneError::Invalid { name: name.to_owned(), message: message.to_string() }
}

/// Largest scene file that is read, in bytes.
const MAX_BYTES: u64 = 1 << 20;

/// Reads a scene file.
// Inlined, as `parse` is: what serde derives is so compiled where a scene is read. In the program that is for size.
#[inline]
pub fn read(path: &Path) -> Result<SceneSpec, SceneError> {
    use std::io::Read;
    let unreadable = |source| SceneError::Unreadable { path: path.to_owned(), source };
    let name = path.display().to_string();
    let mut bytes = vec![];
    std::fs::File::open(path).and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(invalid(&name, format!("a scene has at most {MAX_BYTES} bytes (1 MiB): shorten it")));
    }
    let text = String::from_utf8(bytes).map_err(|error| invalid(&name, format!("it is not a text: {error}")))?;
    parse(&text, &name)
}

/// Reads a scene from its text. Errors show `name` in place of a path.
#[inline]
pub fn parse(text: &str, name: &str) -> Result<SceneSpec, SceneError> {
    let at_line = |(place, message): (usize, String)| {
        let line = text[..place.min(text.len())].matches('\n').count() + 1;
        invalid(name, format!("line {line}: {message}"))
    };
    let at_span = |error: toml::de::Error| {
        at_line((error.span().map_or(0, |span| span.start), error.message().replace('\n', " ")))
    };
    let mut spec: SceneSpec = toml::from_str(text).map_err(at_span)?;
    let table = toml::de::DeTable::parse(text).map_err(at_span)?;
    let mut numbers = table.get_ref().iter();
    numbers.try_for_each(|(key, value)| check::check_numbers(key.get_ref(), value)).map_err(at_line)?;
    table.get_ref().get("vary").map_or(Ok(()), check::check_lists).map_err(at_line)?;
    spec.check().map_err(|message| invalid(name, message))?;
    name.clone_into(&mut spec.name);
    Ok(spec)
}
