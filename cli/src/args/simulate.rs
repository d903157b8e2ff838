//! Arguments of `simulate`.

use std::path::PathBuf;

use clap::Parser;
use clap::builder::{PathBufValueParser, TypedValueParser};
use sdf_sim::scene::ElementMethod;

use super::values::not_standard_output;
use super::{Json, Threads};

/// Move cloth, rigid and soft bodies against signed distance fields, and measure how well contacts hold.
///
/// SCENE is a TOML file (docs/scenes.md); the folder scenes has examples. Without -o only the measurements are printed. A figure
/// that the scene asks for and that is missed is listed; the exit status is 0 all the same.
#[derive(Debug, Parser)]
pub struct SimulateArgs {
    /// The scene; with --suite the folder of all scenes [default: scenes].
    #[arg(required_unless_present = "suite")]
    pub scene: Option<PathBuf>,
    /// Where to write: OUT.vtkhdf, all frames for ParaView; OUT.html, a page with a slider; OUT.png, an animated picture; or a folder
    /// of OBJ files, one a frame. Ctrl-C ends the run and keeps its frames. With --suite a folder for a report and pictures
    /// [default: nowhere].
    #[arg(short, long, value_name = "OUT", value_parser = recording())]
    pub output: Option<PathBuf>,
    /// Number of frames [default: as many as the scene asks for].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000), allow_negative_numbers = true)]
    pub frames: Option<u32>,
    /// How contacts are found: auto, certified, fw, pgd or newton on faces; vertices alone; or 4, 16 or 64 points a face: samples4,
    /// samples16, samples64. With --suite several, with commas between them.
    #[arg(long = "method", visible_alias = "methods", value_name = "M", value_delimiter = ',', default_value = "auto")]
    pub methods: Vec<MethodWord>,
    /// Run every scene of the folder; with --json, print one JSON object a line for each. The exit status is 1 where a scene misses a
    /// figure by the first method, a method that must fail does not, or a scene cannot be run; the others are run all the same.
    #[arg(long)]
    pub suite: bool,
    /// About an eighth of the work: half of the frames, unless --frames says how many; half of the cells of sheets, bowls and ropes along
    /// each side, with pins at the nearest vertices, and of the grids of obstacles; every eighth of many runs. Other meshes and the grids
    /// of bodies stay as they are. With --suite the exit status is 0 whatever is missed: a smaller scene is another one.
    #[arg(long)]
    pub small: bool,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}

fn recording() -> impl TypedValueParser<Value = PathBuf> {
    let why = "a recording does not go to standard output: name OUT.vtkhdf, OUT.html, OUT.png or a folder";
    PathBufValueParser::new().try_map(not_standard_output(why))
}

/// A method and its name.
#[derive(Clone, Debug)]
pub struct MethodWord {
    pub word: String,
    pub method: ElementMethod,
}

impl std::str::FromStr for MethodWord {
    type Err = sdf_sim::scene::UnknownMethod;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        Ok(Self { word: word.to_owned(), method: word.parse()? })
    }
}
