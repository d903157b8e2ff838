use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::{PathBufValueParser, PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{ArgGroup, Parser, Subcommand, ValueEnum};
use sdf_core::grid::owned::{Layout, Precision};
use sdf_field::{BakeOptions, GridSize, MaxError, SignMethod, Source};
use sdf_formats::contact_file::ContactFormat;
use sdf_formats::mesh::MeshFormat;

/// Signed distance fields of meshes, and the contacts of other meshes with them.
///
/// MESH is an OBJ, PLY or STL file. SDF is a baked grid (.sdf.h5) or shapes in closed form (.sdf.toml). Distances are
/// negative inside and in the mesh's own unit.
///
/// Exit status: 0 done, 1 the input or the disk is at fault, 2 wrong usage.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 110)]
pub struct Args {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    Bake(BakeArgs),
    Contacts(ContactsArgs),
    Compare(CompareArgs),
    Eval(EvalArgs),
    Info(InfoArgs),
    Verify(VerifyArgs),
    Slice(SliceArgs),
    Surface(SurfaceArgs),
    Demo(DemoArgs),
    Completions(CompletionsArgs),
    Man(ManArgs),
}

impl Command {
    /// What no single argument shows to be wrong.
    pub fn check(&self) -> Result<(), &'static str> {
        match self {
            Self::Bake(args)
                if args.layout() == Layout::Dense && args.precision.is_some_and(|kept| kept != Precision::F32) =>
            {
                Err("a dense grid keeps f32 alone: add --layout sparse, or leave --precision out")
            }
            Self::Bake(args) if args.layout() == Layout::Dense && args.band.is_some() => {
                Err("a dense grid has no band: add --layout sparse, or leave --band out")
            }
            Self::Bake(args) if args.max_error.is_some() && args.layout() == Layout::Dense => {
                Err("--max-error picks a sparse grid: leave --layout dense out")
            }
            Self::Bake(args) if args.max_error.is_some() && args.precision.is_some() => {
                Err("--max-error picks the precision: leave --precision out")
            }
            Self::Contacts(args) if args.all_minima && !matches!(args.method, Method::Auto | Method::Certified) => {
                Err("--all-minima is a certified search: leave --method out")
            }
            Self::Contacts(args) if args.method == Method::Gss && args.elements != Elements::Edges => {
                Err("--method gss searches along edges: add --elements edges, or take another method")
            }
            _ => Ok(()),
        }
    }
}

/// Bake a mesh into a grid of exact signed distances.
///
/// Takes the mesh and how fine the grid is to be: --res, --voxel-size, or --max-error, which picks the rest by the error
/// that is certified. Says how inside was told from outside, and how far the values between the nodes may be off.
#[derive(Debug, Parser)]
#[command(group(ArgGroup::new("size").required(true).args(["res", "voxel_size", "max_error"])))]
pub struct BakeArgs {
    /// The mesh to bake: OBJ, PLY or STL.
    pub mesh: PathBuf,
    /// Where to write the grid [default: the mesh's name with .sdf.h5, in the current folder].
    #[arg(short, long, value_name = "OUT.sdf.h5")]
    pub output: Option<PathBuf>,
    /// How many cells along the longest side of the mesh's box, padding not counted.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub res: Option<u32>,
    /// The side of a cell, in the mesh's unit.
    #[arg(long, value_name = "H", value_parser = positive, allow_negative_numbers = true)]
    pub voxel_size: Option<f64>,
    /// The most that the grid may be off within its band, in the mesh's unit, or as 0.1% of the diagonal of its box: picks
    /// the side of a cell and the precision of a sparse grid.
    #[arg(long, value_name = "E", value_parser = max_error, allow_hyphen_values = true)]
    pub max_error: Option<ErrorLimit>,
    /// Every node, or bricks near the surface and a coarse grid for the rest [default: dense; sparse with --max-error].
    #[arg(long, value_parser = layouts())]
    pub layout: Option<Layout>,
    /// How far from the surface a sparse grid keeps distances exactly, in cells; farther away it has lower bounds
    /// [default: 3].
    #[arg(long, value_name = "VOXELS", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub band: Option<u32>,
    /// How a sparse grid keeps its samples [default: u16; --max-error picks u16 or u8, whichever takes less].
    #[arg(long, value_parser = precisions())]
    pub precision: Option<Precision>,
    /// How many cells more around the mesh's box, on each side; contacts are found within this --margin.
    #[arg(long, value_name = "VOXELS", default_value_t = 4)]
    pub padding: u32,
    /// How inside is told from outside.
    #[arg(long, value_enum, default_value_t = Sign::Auto)]
    pub sign: Sign,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}

impl BakeArgs {
    pub fn layout(&self) -> Layout {
        self.layout.unwrap_or(if self.max_error.is_some() { Layout::Sparse } else { Layout::Dense })
    }

    /// In cells.
    pub fn band(&self) -> u32 {
        self.band.unwrap_or(BakeOptions::default().band)
    }

    /// The options of the library.
    pub fn options(&self, source: Source) -> anyhow::Result<BakeOptions> {
        let size = match (self.res, self.voxel_size, self.max_error) {
            (Some(res), ..) => GridSize::Cells(res),
            (None, Some(size), _) => GridSize::VoxelSize(size),
            (None, None, Some(error)) => GridSize::MaxError(error.0),
            (None, None, None) => anyhow::bail!("--res, --voxel-size or --max-error is needed"),
        };
        Ok(BakeOptions {
            size,
            layout: self.layout(),
            precision: self.precision,
            band: self.band(),
            padding: self.padding,
            sign: match self.sign {
                Sign::Auto => None,
                Sign::PseudoNormal => Some(SignMethod::PseudoNormal),
                Sign::Winding => Some(SignMethod::Winding),
            },
            threads: sdf_field::Threads::ALL,
            source,
        })
    }
}

/// The value of --max-error, shown as it is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorLimit(pub MaxError);

impl fmt::Display for ErrorLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            MaxError::Length(length) => write!(f, "{length}"),
            MaxError::Fraction(fraction) => write!(f, "{}%", fraction * 100.0),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Sign {
    /// Looks at the mesh: pseudo-normal where they are sure, else winding.
    Auto,
    /// Angle-weighted pseudo-normals, for one closed surface.
    PseudoNormal,
    /// Generalized winding numbers, for open, doubled or self-intersecting meshes.
    Winding,
}

/// Find where a mesh touches a field, or where two fields touch.
///
/// Of each element of the mesh that comes within --margin of the surface, or into it, one contact: where it comes
/// nearest or deepest, with a lower bound for all of the element. Unasked, the search is for the least of all minima, and its
/// status converged where that is proven. Elements that cannot touch are culled without a search.
///
/// With a field in place of the mesh, no mesh is needed on either side: the points that are deepest in both, the first of
/// them proven, and the patch in which both are equally deep, as points with an area each.
#[derive(Debug, Parser)]
pub struct ContactsArgs {
    /// The mesh, in the world: OBJ, PLY or STL; or a field, put into the world by --rotate-first, then --translate-first.
    pub mesh: PathBuf,
    /// The field that it may touch: a baked grid or shapes in TOML. Put into the world by --rotate, then --translate.
    pub sdf: PathBuf,
    /// What of the mesh is tested. Edges are those of the triangles, each once, then the file's own line elements.
    #[arg(long, value_enum, default_value_t = Elements::Faces)]
    pub elements: Elements,
    /// How the least distance of an element is found.
    #[arg(long, value_enum, default_value_t = Method::Auto)]
    pub method: Method,
    /// Steps of the method at most; of auto and certified, how many times the field is asked of one element at most [default:
    /// 32, of auto 256, of certified 1024].
    #[arg(long, value_name = "N")]
    pub iterations: Option<u32>,
    /// How near auto and certified come to the least value before they stop, as a share of the element's longest edge, of two
    /// fields of the longest side of the box in which they may touch.
    #[arg(long, value_name = "SHARE", default_value_t = 1e-3, value_parser = positive)]
    pub tolerance: f64,
    /// Report every isolated minimum of an element, not the lowest alone: a triangle that rests on three bumps touches thrice.
    /// Dents less deep than a hundredth of the longest edge count as one.
    #[arg(long)]
    pub all_minima: bool,
    /// Report elements that come within this distance of the surface, in the mesh's unit; less than 0: only so deep. Of two
    /// fields: points that come within it of both, which are there if the gap is at most twice as wide.
    #[arg(long, value_name = "D", default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true)]
    pub margin: f64,
    /// Shift the field by this.
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,0", allow_hyphen_values = true)]
    pub translate: Numbers<3>,
    /// Turn the field about its origin by this quaternion, of any length but zero.
    #[arg(long, value_name = "X,Y,Z,W", default_value = "0,0,0,1", allow_hyphen_values = true, value_parser = turn)]
    pub rotate: Numbers<4>,
    /// Of two fields: shift the first by this.
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,0", allow_hyphen_values = true)]
    pub translate_first: Numbers<3>,
    /// Of two fields: turn the first about its origin by this quaternion.
    #[arg(long, value_name = "X,Y,Z,W", default_value = "0,0,0,1", allow_hyphen_values = true, value_parser = turn)]
    pub rotate_first: Numbers<4>,
    /// Of two fields: the edge of the cubes that the patch is cut into [default: 1/64 of the longest side of the box in which
    /// they touch].
    #[arg(long, value_name = "D", value_parser = positive, allow_negative_numbers = true)]
    pub resolution: Option<f64>,
    /// Where to write the contacts, as the name's end says: .csv, .json, .ply or .h5 [default: nowhere].
    #[arg(short, long, value_name = "OUT", value_parser = PathBufValueParser::new().try_map(contact_file))]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}

impl ContactsArgs {
    /// Refuses options that need a mesh, when the first argument is a field.
    pub fn refuse_options_of_meshes(&self) -> anyhow::Result<()> {
        let given = [
            ("--elements", self.elements != Elements::Faces),
            ("--method", self.method != Method::Auto),
            ("--iterations", self.iterations.is_some()),
            ("--all-minima", self.all_minima),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((option, _)) => {
                anyhow::bail!("{option} needs a mesh, but {} is a field: leave it out", self.mesh.display())
            }
            None => Ok(()),
        }
    }

    /// Refuses options that need two fields, when the first argument is a mesh.
    pub fn refuse_options_of_fields(&self) -> anyhow::Result<()> {
        let given = [
            ("--translate-first", self.translate_first.0 != [0.0; 3]),
            ("--rotate-first", self.rotate_first.0 != [0.0, 0.0, 0.0, 1.0]),
            ("--resolution", self.resolution.is_some()),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((option, _)) => {
                anyhow::bail!("{option} needs two fields, but {} is a mesh: leave it out", self.mesh.display())
            }
            None => Ok(()),
        }
    }

    /// The format of the output.
    pub fn format(&self) -> Option<ContactFormat> {
        self.output.as_deref().and_then(ContactFormat::of)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Elements {
    Faces,
    Edges,
    Vertices,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Certified, within 256 evaluations.
    Auto,
    /// Projected gradient descent.
    Pgd,
    /// Frank-Wolfe.
    Fw,
    /// Golden-section search, on edges alone.
    Gss,
    /// Frank-Wolfe with a line search.
    Ls,
    /// Newton's method between cutting planes.
    Newton,
    /// Branch and bound: the least of all minima, and proof of how near.
    Certified,
    /// The least of 4 fixed points, to compare with.
    Sample4,
    /// The least of 16 fixed points, to compare with.
    Sample16,
    /// The least of 64 fixed points, to compare with.
    Sample64,
}

impl From<Method> for sdf_field::Method {
    fn from(method: Method) -> Self {
        match method {
            Method::Auto => Self::Auto,
            Method::Certified => Self::Certified,
            Method::Pgd => Self::ProjectedGradient,
            Method::Fw => Self::FrankWolfe,
            Method::Gss => Self::GoldenSection,
            Method::Ls => Self::LineSearch,
            Method::Newton => Self::Newton,
            Method::Sample4 => Self::Sampling(4),
            Method::Sample16 => Self::Sampling(16),
            Method::Sample64 => Self::Sampling(64),
        }
    }
}

/// Compare all methods on one mesh and one field: error against run time, missed contacts, and which method to take.
///
/// The reference is the certified search with 16,384 evaluations per element. A method's error on an element is its lowest
/// distance minus the reference's. Every method runs --rounds times, in turns; times are medians.
#[derive(Debug, Parser)]
pub struct CompareArgs {
    /// The mesh: OBJ, PLY or STL.
    pub mesh: PathBuf,
    /// The field: a baked grid or shapes in TOML.
    pub sdf: PathBuf,
    /// Search faces or edges.
    #[arg(long, value_enum, default_value_t = Elements::Faces)]
    pub elements: Elements,
    /// Report elements that come within this distance of the surface, in the mesh's unit.
    #[arg(long, value_name = "D", default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true)]
    pub margin: f64,
    /// Recommend only methods whose error is within this fraction of an edge's length for 95 % of the contacts.
    #[arg(long, value_name = "FRACTION", default_value_t = 1e-3, value_parser = positive)]
    pub tolerance: f64,
    /// Shift the field by this.
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,0", allow_hyphen_values = true)]
    pub translate: Numbers<3>,
    /// Rotate the field about its origin by this quaternion, of any length but zero.
    #[arg(long, value_name = "X,Y,Z,W", default_value = "0,0,0,1", allow_hyphen_values = true, value_parser = turn)]
    pub rotate: Numbers<4>,
    /// Times that each method runs.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: u32,
    /// Where to write a page with a plot [default: nowhere].
    #[arg(short, long, value_name = "OUT.html")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}

/// Print distances and gradients at points, as lines of x,y,z,distance,gx,gy,gz.
///
/// The gradient is the derivative of the distance and not normalized. Outside of a grid the distance is a lower bound;
/// --json says of each point whether it is.
#[derive(Debug, Parser)]
pub struct EvalArgs {
    /// The field: a baked grid or shapes in TOML.
    pub sdf: PathBuf,
    /// Lines of x,y,z; a first line of names is passed over, and columns after the third. A dash reads standard input.
    #[arg(long, value_name = "FILE.csv")]
    pub points: PathBuf,
    #[command(flatten)]
    pub json: Json,
}

/// Say what a field file holds.
#[derive(Debug, Parser)]
pub struct InfoArgs {
    /// The field: a baked grid, whose samples are not read, or shapes in TOML.
    pub sdf: PathBuf,
    #[command(flatten)]
    pub json: Json,
}

/// Compare a field with the mesh it is said to be of; exit status 1 where a grid is not.
///
/// A grid is right when no node asked is off by more than 1e-6 of the mesh's diagonal and what its precision rounds, no
/// point by more than the file certifies, and no sign is wrong. Points are asked in all of a dense grid's box, and of a
/// sparse grid within its band and, as many again, in all of the box: there it may say less than the distance and never
/// more. No cell may be missing on the surface. Of shapes in TOML, which certify nothing, the errors are only printed.
#[derive(Debug, Parser)]
pub struct VerifyArgs {
    /// The field: a baked grid or shapes in TOML.
    pub sdf: PathBuf,
    /// The mesh: OBJ, PLY or STL.
    pub mesh: PathBuf,
    /// How many random points, and how many random nodes of a grid, are asked.
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..))]
    pub points: u32,
    /// Ask every node of the grid, of a sparse one those in bricks.
    #[arg(long)]
    pub all_nodes: bool,
    /// Where to draw how many points are off by how much, an SVG [default: nowhere].
    #[arg(long, value_name = "OUT.svg")]
    pub histogram: Option<PathBuf>,
    /// Other points and nodes for another number.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}

/// Draw a plane through a field: blue inside, orange outside, the surface black.
///
/// Of a sparse grid the bricks are outlined in grey, the ends of the band are green, and what lies in no brick is pale.
#[derive(Debug, Parser)]
pub struct SliceArgs {
    /// The field: a baked grid or shapes in TOML.
    pub sdf: PathBuf,
    /// Where to write the picture, a PNG.
    #[arg(short, long, value_name = "OUT.png")]
    pub output: PathBuf,
    /// The axis that the plane stands across. The other two run to the right and up.
    #[arg(long, value_enum, default_value_t = Axis::Z)]
    pub axis: Axis,
    /// Where on the axis [default: the middle of the field's box].
    #[arg(long, value_name = "X", value_parser = finite, allow_negative_numbers = true)]
    pub at: Option<f64>,
    /// Pixels along the picture's longer side.
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(16..=16384))]
    pub pixels: u32,
    #[command(flatten)]
    pub json: Json,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    X,
    Y,
    Z,
}

/// Extract the surface of a field as a mesh.
#[derive(Debug, Parser)]
pub struct SurfaceArgs {
    /// The field: a baked grid or shapes in TOML.
    pub sdf: PathBuf,
    /// Where to write the mesh, as the name's end says: .obj, .ply or .stl.
    #[arg(short, long, value_name = "OUT.obj", value_parser = PathBufValueParser::new().try_map(mesh_file))]
    pub output: PathBuf,
    /// How many cells along the longest side [default: the grid's own; 128 for shapes in closed form].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub res: Option<u32>,
    /// Extract where the distance is this.
    #[arg(long, value_name = "D", default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true)]
    pub level: f64,
    #[command(flatten)]
    pub json: Json,
}

/// Make a spiky body and a cloth over it, bake, find contacts and draw them.
#[derive(Debug, Parser)]
pub struct DemoArgs {
    /// The folder to write into; it is made where it is not there.
    #[arg(short, long, value_name = "FOLDER", default_value = "sdftool-demo")]
    pub output: PathBuf,
    #[command(flatten)]
    pub json: Json,
}

/// Print a completion script for a shell.
#[derive(Debug, Parser)]
pub struct CompletionsArgs {
    /// The shell; for bash: sdftool completions bash > ~/.local/share/bash-completion/completions/sdftool
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// Print the manual page, or write one for each command.
#[derive(Debug, Parser)]
pub struct ManArgs {
    /// The folder to write a page for each command into; it is made if missing [default: one page to standard output].
    #[arg(short, long, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, Parser)]
pub struct Threads {
    /// Threads to work with; the result does not depend on it [default: as many as the machine has].
    #[arg(long = "threads", value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub count: Option<u16>,
}

#[derive(Clone, Copy, Debug, Parser)]
pub struct Json {
    /// Print one JSON object, alone, on standard output.
    #[arg(long = "json")]
    pub wanted: bool,
}

/// Numbers in a row with commas between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers<const N: usize>(pub [f64; N]);

impl<const N: usize> FromStr for Numbers<N> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, String> = text.split(',').map(|word| finite(word.trim())).collect();
        let numbers = numbers?;
        let found = numbers.len();
        numbers.try_into().map(Self).map_err(|_| format!("expected {N} numbers with commas between, found {found}"))
    }
}

fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("{text:?} is not a finite number")),
    }
}

fn turn(text: &str) -> Result<Numbers<4>, String> {
    let numbers: Numbers<4> = text.parse()?;
    if numbers.0 == [0.0; 4] { Err("all zero is no turn; 0,0,0,1 turns nothing".to_owned()) } else { Ok(numbers) }
}

fn contact_file(path: PathBuf) -> Result<PathBuf, &'static str> {
    ContactFormat::of(&path).map(|_| path).ok_or("take a name that ends in .csv, .json, .ply or .h5")
}

fn mesh_file(path: PathBuf) -> Result<PathBuf, &'static str> {
    MeshFormat::of(&path).map(|_| path).ok_or("take a name that ends in .obj, .ply or .stl")
}

fn max_error(text: &str) -> Result<ErrorLimit, String> {
    let error = match text.strip_suffix('%') {
        Some(percent) => positive(percent.trim_end()).map(|percent| MaxError::Fraction(percent / 100.0)),
        None => positive(text).map(MaxError::Length),
    };
    error.map(ErrorLimit)
}

fn layouts() -> impl TypedValueParser<Value = Layout> {
    let help = |layout| match layout {
        Layout::Dense => "a sample at every node of the box",
        Layout::Sparse => "bricks of 8 × 8 × 8 samples near the surface, and every eighth node elsewhere",
    };
    let values = Layout::ALL.map(|layout| PossibleValue::new(layout.name()).help(help(layout)));
    PossibleValuesParser::new(values).map(|name| Layout::from_name(&name).expect("clap has checked the name"))
}

fn precisions() -> impl TypedValueParser<Value = Precision> {
    let help = |precision| match precision {
        Precision::F32 => "exact to half a unit in the last place",
        Precision::U16 => "65,536 steps between the lowest and the highest sample of a brick",
        Precision::U8 => "256 steps",
    };
    let values = Precision::ALL.map(|precision| PossibleValue::new(precision.name()).help(help(precision)));
    PossibleValuesParser::new(values).map(|name| Precision::from_name(&name).expect("clap has checked the name"))
}

fn positive(text: &str) -> Result<f64, String> {
    finite(text).and_then(|number| if number > 0.0 { Ok(number) } else { Err("must be more than 0".to_owned()) })
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Args::command().debug_assert();
    }
}
