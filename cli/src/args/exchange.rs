//! Arguments of `export`, `import` and `view`.

use std::path::PathBuf;

use clap::Parser;
use clap::builder::{PathBufValueParser, PossibleValue, PossibleValuesParser, TypedValueParser};
use sdf_core::grid::Precision;
use sdf_field::export::ExportFormat;

use super::contacts::{Elements, PoseArgs};
use super::values::{Numbers, finite, grid_file, page_file, positive, precisions, whole};
use super::{Json, Threads};

/// Write a field as a file of another program.
///
/// NanoVDB is for Warp, Newton, Omniverse and Houdini, and holds a level set: distances within a band. The arrays hold a sample for
/// every node, f32, x fastest. Values are negative inside and stay as they are. A blob is the grid itself, dense or sparse, in one file
/// that firmware, engines and `sdftool contacts` read where it lies; c and rust are the same as a table.
#[derive(Debug, Parser)]
pub struct ExportArgs {
    /// The field: a baked grid or shapes in TOML.
    pub sdf: PathBuf,
    /// Format of the file [default: by the ending of --output].
    #[arg(long, value_parser = formats(), required_unless_present = "output")]
    pub format: Option<ExportFormat>,
    /// Where to write the file; - is standard output, with --format [default: the field's name with the format's ending, in the
    /// current folder].
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Number of cells along the longest side [default: the grid's own nodes; 128 for shapes in closed form].
    #[arg(long, value_name = "N", value_parser = whole(1..=4096), allow_negative_numbers = true)]
    pub res: Option<u32>,
    /// Half width of a NanoVDB level set's band, in cells; of a sparse grid at most its own [default: the band of a sparse grid; 4].
    #[arg(long, value_name = "VOXELS", value_parser = whole(1..=1000), allow_negative_numbers = true)]
    pub band: Option<u32>,
    /// Type of the samples of a blob or table [default: the grid's own]. u16 and u8 are steps of each block of 8 × 8 × 8 nodes, or of the
    /// whole range of a dense grid of f32; rounding widens the certified bounds.
    #[arg(long, value_parser = precisions())]
    pub precision: Option<Precision>,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}

fn formats() -> impl TypedValueParser<Value = ExportFormat> {
    let help = |format| match format {
        ExportFormat::Nvdb => "NanoVDB level set",
        ExportFormat::Raw => "Samples alone, and FILE.json that describes them",
        ExportFormat::Npy => "NumPy array of shape (z, y, x)",
        ExportFormat::Nrrd => "NRRD, for 3D Slicer and ITK",
        ExportFormat::VtkHdf => "VTKHDF image data, for ParaView and VTK",
        ExportFormat::Glb => "The surface as binary glTF",
        ExportFormat::Blob => "The grid as one file that firmware and other programs read where it lies",
        ExportFormat::C => "A blob as a table in C, for flash",
        ExportFormat::Rust => "A blob as a table in Rust",
    };
    let values = ExportFormat::ALL.map(|format| PossibleValue::new(format.name()).help(help(format)));
    PossibleValuesParser::new(values).map(|name| ExportFormat::from_name(&name).expect("clap has checked the name"))
}

/// Make a grid of a field of another program: a NanoVDB level set or a NumPy array.
///
/// Values must be distances, negative inside. Their slope is measured. No error is certified, and signs are taken as they are: the file
/// and `info` say so.
#[derive(Debug, Parser)]
pub struct ImportArgs {
    /// The file: .nvdb (float, not packed) or .npy (three axes, in the order z, y, x), which its first bytes show, too. A dash
    /// reads standard input, as .npy with --spacing, else as .nvdb, and needs -o.
    pub file: PathBuf,
    /// Where to write the grid; - is standard output [default: the file's name with .sdf.h5, in the current
    /// folder, if there is no such file yet].
    #[arg(short, long, value_name = "OUT.sdf.h5", value_parser = PathBufValueParser::new().try_map(grid_file))]
    pub output: Option<PathBuf>,
    /// Distance between neighbouring nodes of a NumPy array.
    #[arg(long, value_name = "H", value_parser = positive, allow_negative_numbers = true)]
    pub spacing: Option<f64>,
    /// Position of the first node of a NumPy array [default: 0,0,0].
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub origin: Option<Numbers<3>>,
    #[command(flatten)]
    pub json: Json,
}

/// Write a field, a mesh and their contacts as a page to look at.
///
/// One HTML file for any browser with WebGL2, without a network: the surface, the mesh, contacts coloured by depth with their normals, a
/// slice along any axis with contour lines, bricks. Drag to turn, pinch or scroll to zoom, tap a contact for its numbers.
#[derive(Debug, Parser)]
pub struct ViewArgs {
    /// The field: a baked grid or shapes in TOML. Moved by --rotate, then --translate. A dash reads standard input, and needs -o.
    pub sdf: PathBuf,
    /// A mesh whose contacts with the field are found: OBJ, PLY, STL or OFF.
    pub mesh: Option<PathBuf>,
    /// Where to write the page [default: the field's name with .html, in the current folder].
    #[arg(short, long, value_name = "PAGE.html", value_parser = PathBufValueParser::new().try_map(page_file))]
    pub output: Option<PathBuf>,
    /// Elements whose contacts are found; it needs a mesh [default: faces; of a mesh without faces its line elements, or else its vertices].
    #[arg(long, requires = "mesh")]
    pub elements: Option<Elements>,
    /// Show elements that come within this distance of the surface, in the mesh's unit; it needs a mesh [default: 0].
    #[arg(long, value_name = "D", value_parser = finite, allow_hyphen_values = true, requires = "mesh")]
    pub margin: Option<f64>,
    #[command(flatten)]
    pub pose: PoseArgs,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}
