//! Arguments of the commands that read one field: `eval`, `info`, `verify`, `slice` and `surface`.

use std::path::PathBuf;

use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Parser, ValueEnum};

use super::values::{finite, histogram_file, mesh_file, picture_file, whole};
use super::{Json, Threads};

/// Print distances and gradients at points, as lines of x,y,z,distance,gx,gy,gz,status.
///
/// The gradient is the derivative of the distance and not normalized. The status is "good", or "outside_grid" (the distance is a
/// lower bound), "beyond_band" (of a sparse grid: it is coarse), "degenerate_gradient" (the gradient is zero or a choice) or
/// "not_finite" (the point is too far off to tell).
#[derive(Debug, Parser)]
pub struct EvalArgs {
    /// The field: a baked grid or shapes in TOML.
    pub sdf: PathBuf,
    /// Lines of three numbers with commas, semicolons or blanks between them; a header line and columns after the third are
    /// skipped. A dash reads standard input.
    #[arg(long, value_name = "FILE.csv")]
    pub points: PathBuf,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}

/// Print what a field file contains.
#[derive(Debug, Parser)]
pub struct InfoArgs {
    /// The field: a baked grid, whose samples are not read, or shapes in TOML. A dash reads standard input.
    pub sdf: PathBuf,
    #[command(flatten)]
    pub json: Json,
}

/// Check a grid against its mesh. Exits with status 1 if they do not match.
///
/// A grid matches if no sampled node is off by more than its rounding, no point by more than the file certifies, and no sign is
/// wrong. Rounding is half a step of u16 and u8 and, in a dense grid, 1e-6 of the mesh's diagonal; in a sparse grid what a bake
/// in f32 rounds at most, about 5e-6 of the diagonal plus 1e-4 of a cell. Points are sampled in the whole box of a dense grid;
/// for a sparse grid within its band and, as many again each, in the whole box and beside nodes of its coarse grid: there a value
/// may be less than the distance, more by 3h²/(8B) at most, with cells of h and a band of B, and inside by no more than the file states.
/// Nodes of its bricks beyond the band are no nearer than the band. No cell may be missing on the surface. At the points, the bounds of values and slopes that blocks state must
/// hold, and the padding must be no more than the mesh is from the box's faces, by its box or by the samples there. The mesh that a grid keeps
/// must be the one that was baked. For shapes in TOML, which certify nothing, the errors are only
/// printed.
#[derive(Debug, Parser)]
pub struct VerifyArgs {
    /// The field: a baked grid or shapes in TOML.
    pub sdf: PathBuf,
    /// The mesh: OBJ, PLY, STL or OFF.
    pub mesh: PathBuf,
    /// Number of random points, and of random nodes of a grid.
    #[arg(long, value_name = "N", default_value_t = 100_000, allow_negative_numbers = true)]
    #[arg(value_parser = whole(1..=u32::MAX))]
    pub points: u32,
    /// Check every node of the grid; of a sparse grid, those in bricks and those of its coarse grid.
    #[arg(long)]
    pub all_nodes: bool,
    /// Compute tight error bounds of a sparse grid's bricks, as bake --certify tight does. Of a mesh that is closed, and one shell; not of blobs.
    #[arg(long)]
    pub tight: bool,
    /// Where to draw a histogram of the errors, an SVG [default: nowhere].
    #[arg(long, value_name = "OUT.svg", value_parser = PathBufValueParser::new().try_map(histogram_file))]
    pub histogram: Option<PathBuf>,
    /// Seed of the random sample points.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}

/// Draw a plane through a field: blue inside, orange outside, the surface black.
///
/// For a sparse grid, bricks are outlined in grey, the ends of the band are green, and regions without bricks are pale.
#[derive(Debug, Parser)]
pub struct SliceArgs {
    /// The field: a baked grid or shapes in TOML.
    pub sdf: PathBuf,
    /// Where to write the picture, a PNG; - is standard output.
    #[arg(short, long, value_name = "OUT.png", value_parser = PathBufValueParser::new().try_map(picture_file))]
    pub output: PathBuf,
    /// Axis perpendicular to the plane. The other two run right and up.
    #[arg(long, value_enum, default_value_t = Axis::Z)]
    pub axis: Axis,
    /// Position of the plane on the axis, within the field's box [default: its middle].
    #[arg(long, value_name = "X", value_parser = finite, allow_hyphen_values = true)]
    pub at: Option<f64>,
    /// Pixels along the picture's longer side.
    #[arg(long, value_name = "N", default_value_t = 1024, allow_negative_numbers = true)]
    #[arg(value_parser = whole(16..=16384))]
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
    /// Where to write the mesh; the extension decides: .obj, .ply, .stl or .off; - is OBJ on standard output.
    #[arg(short, long, value_name = "OUT.obj", value_parser = PathBufValueParser::new().try_map(mesh_file))]
    pub output: PathBuf,
    /// Number of cells along the longest side [default: the grid's own; 128 for shapes in closed form].
    #[arg(long, value_name = "N", value_parser = whole(1..=4096), allow_negative_numbers = true)]
    pub res: Option<u32>,
    /// Extract the level set of this distance. Where it leaves the box of the grid, the surface is open: a warning says so.
    #[arg(long, value_name = "D", default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    pub level: f64,
    #[command(flatten)]
    pub json: Json,
}
