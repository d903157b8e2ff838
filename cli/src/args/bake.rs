//! Arguments of `bake`, and the library's options that they stand for.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::builder::{OsStringValueParser, PathBufValueParser, TypedValueParser};
use clap::{ArgGroup, Parser, ValueEnum};
use sdf_core::grid::owned::{Layout, Precision};
use sdf_field::file::Compression;
use sdf_field::{BakeOptions, BrickShard, GridSize, SignMethod, Source};

use super::values::{
    ErrorLimit, Shard, bytes, compressions, grid_file, layouts, max_error, page_file, positive, precisions, whole,
};
use super::{Json, Threads};

/// Bake a mesh into a grid of exact signed distances.
///
/// The grid's size is given by --res, by --voxel-size, or by --max-error, which chooses voxel size and precision by the
/// certified error. Prints which inside/outside test was used and why, and a certified bound on the interpolation error.
#[derive(Clone, Debug, Parser)]
#[command(group(ArgGroup::new("size").required(true).args(["res", "voxel_size", "max_error"])))]
pub struct BakeArgs {
    /// The mesh to bake: OBJ, PLY, STL or OFF. A dash reads standard input, and needs -o.
    // Empty where --list names the meshes.
    #[arg(default_value = "", hide_default_value = true, value_parser = OsStringValueParser::new().map(PathBuf::from))]
    pub mesh: PathBuf,
    #[command(flatten)]
    pub fleet: FleetArgs,
    /// Where to write the grid; - is standard output [default: the mesh's name with .sdf.h5, in the current folder].
    #[arg(short, long, value_name = "OUT.sdf.h5", value_parser = PathBufValueParser::new().try_map(grid_file))]
    pub output: Option<PathBuf>,
    /// Number of cells along the longest side of the mesh's box, padding not counted.
    #[arg(long, value_name = "N", value_parser = whole(1..=u32::MAX), allow_negative_numbers = true)]
    pub res: Option<u32>,
    /// Side of a cell, in the mesh's unit.
    #[arg(long, value_name = "H", value_parser = positive, allow_negative_numbers = true)]
    pub voxel_size: Option<f64>,
    /// Largest certified error within the band, in the mesh's unit, or as 0.1% of the diagonal of its box: chooses voxel size
    /// and precision of a sparse grid.
    #[arg(long, value_name = "E", value_parser = max_error, allow_hyphen_values = true)]
    pub max_error: Option<ErrorLimit>,
    /// Which nodes have a sample [default: dense; sparse with --max-error].
    #[arg(long, value_parser = layouts())]
    pub layout: Option<Layout>,
    /// Half width of a sparse grid's band, in cells: within it values are distances, beyond it coarse ones inside and, to 3/8 of a cell, lower bounds outside [default: 3].
    #[arg(long, value_name = "VOXELS", value_parser = whole(1..=1000), allow_negative_numbers = true)]
    pub band: Option<u32>,
    /// Type of a sample; u16 and u8 round, which the certified error includes [default: f32; u16 of a sparse grid; --max-error chooses u16 or u8, whichever takes less memory].
    #[arg(long, value_parser = precisions())]
    pub precision: Option<Precision>,
    /// Bounds of the error of a sparse grid's bricks; --max-error takes the tight ones in any case.
    #[arg(long, value_enum, default_value_t = Certify::Fast)]
    pub certify: Certify,
    /// Pack the file's chunks, or write them as they are: larger, but written and read faster.
    #[arg(long, value_parser = compressions(), default_value = Compression::Deflate.name())]
    pub compress: Compression,
    /// Memory that the grid may take, beside the mesh and its tree, such as 2GiB or 500MB: a sparse grid that takes more is streamed into its file, brick by brick, as is any large one [default: what is free].
    #[arg(long, value_name = "SIZE", value_parser = bytes, allow_hyphen_values = true)]
    pub memory: Option<u64>,
    /// Cells added around the mesh's box, on each side; limits the --margin of contacts.
    #[arg(long, value_name = "VOXELS", default_value_t = 4, allow_negative_numbers = true)]
    pub padding: u32,
    /// Inside/outside test.
    #[arg(long, value_enum, default_value_t = Sign::Auto)]
    pub sign: Sign,
    /// Treatment of faces inside of the solid, as where parts cross or nest.
    #[arg(long, value_enum, default_value_t = InnerFaces::Drop)]
    pub inner_faces: InnerFaces,
    /// Keep the mesh in the file, for contacts --exact.
    #[arg(long)]
    pub keep_mesh: bool,
    /// Where to write a page to look at the field, as `view` does [default: nowhere].
    #[arg(long, value_name = "PAGE.html", value_parser = PathBufValueParser::new().try_map(page_file))]
    pub view: Option<PathBuf>,
    /// Merge vertices at most this far from each other, in the mesh's unit: closes cracks. Choose less than the shortest edge that
    /// shall stay.
    #[arg(long, value_name = "DISTANCE", value_parser = positive, allow_negative_numbers = true)]
    pub weld: Option<f64>,
    /// Cap boundary loops up to this size, the diagonal of the loop's bounding box in the mesh's unit: closes holes, after welding.
    #[arg(long, value_name = "SIZE", value_parser = positive, allow_negative_numbers = true)]
    pub close: Option<f64>,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}

/// Several meshes.
#[derive(Clone, Debug, Parser)]
pub struct FleetArgs {
    /// More meshes. Each grid has its mesh's name, and a failure does not stop the others.
    #[arg(value_name = "MORE")]
    pub more: Vec<PathBuf>,
    /// Bake the meshes that this text file names, one on each line, relative to the current folder; a dash reads standard input.
    #[arg(long, value_name = "FILE", help_heading = MANY)]
    pub list: Option<PathBuf>,
    /// The folder for the grids of several meshes; it is made if missing [default: the current folder].
    #[arg(long, value_name = "FOLDER", help_heading = MANY, value_parser = super::folder())]
    pub out_dir: Option<PathBuf>,
    /// Number of meshes to bake at a time; the threads are shared out among them.
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = MANY, allow_negative_numbers = true)]
    #[arg(value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: u16,
    /// Bake the I-th of N shares of the work, counted from 0: with 0/3, 1/3 and 2/3 three machines share it. Of one mesh, a share is a
    /// part of its bricks, for `merge`, as MESH.part-I-of-N.h5 without -o, and takes neither --resume nor --jobs; with --list, --out-dir
    /// or more meshes, every N-th mesh from the I-th on.
    #[arg(long, value_name = "I/N", allow_hyphen_values = true, help_heading = "Sharing the work")]
    pub shard: Option<Shard>,
    /// Keep grids that are there already and undamaged, of the same mesh by its SHA-256, with the same options and version, however
    /// they are packed.
    #[arg(long, help_heading = MANY)]
    pub resume: bool,
}

const MANY: &str = "Several meshes";

impl FleetArgs {
    /// Is this about several meshes?
    pub fn is_wanted(&self) -> bool {
        let Self { more, list, out_dir, jobs, shard: _, resume } = self;
        !more.is_empty() || list.is_some() || out_dir.is_some() || *jobs > 1 || *resume
    }

    /// Is there one mesh, and no option that names more or a folder for the grids of more?
    pub fn has_one_mesh_alone(&self) -> bool {
        self.more.is_empty() && self.list.is_none() && self.out_dir.is_none()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Sign {
    /// Chosen by the mesh: pseudo-normal if that is certain to be right, else winding.
    Auto,
    /// Angle-weighted pseudo-normals: for one closed surface that is not folded shut, nor far from the origin. Of other meshes whole
    /// regions may have the wrong sign, and no error is proven.
    PseudoNormal,
    /// Generalized winding numbers: for open, doubled or self-intersecting meshes.
    Winding,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Certify {
    /// Bound by the cap of the normals near 4 × 4 × 4 cells: at no cost.
    Fast,
    /// Bound by the normals near single cells where those say less: a bake of a closed mesh takes two to four times as long.
    Tight,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum InnerFaces {
    /// Measure distances to the surface of the solid: faces and parts of faces inside of it are left out. Those of open meshes
    /// are kept.
    Drop,
    /// Measure distances to all faces.
    Keep,
}

impl BakeArgs {
    pub fn layout(&self) -> Layout {
        self.layout.unwrap_or(if self.max_error.is_some() { Layout::Sparse } else { Layout::Dense })
    }

    /// Half width of the band, in cells.
    pub fn band(&self) -> u32 {
        self.band.unwrap_or(BakeOptions::default().band)
    }

    /// The part of one mesh's bricks to bake; `None` without --shard, and where --shard shares out whole meshes.
    pub fn shard_of_bricks(&self) -> Option<BrickShard> {
        let shard = self.fleet.shard.filter(|_| !self.fleet.is_wanted())?;
        Some(BrickShard { index: shard.index, count: shard.count })
    }

    /// The options of the library.
    pub fn options(&self, source: Source) -> Result<BakeOptions> {
        let size = match (self.res, self.voxel_size, self.max_error) {
            (Some(res), ..) => GridSize::Cells(res),
            (None, Some(size), _) => GridSize::VoxelSize(size),
            (None, None, Some(error)) => GridSize::MaxError(error.0),
            (None, None, None) => bail!("--res, --voxel-size or --max-error is needed"),
        };
        Ok(BakeOptions {
            size,
            layout: self.layout(),
            precision: self.precision,
            band: self.band(),
            padding: self.padding,
            certify: match self.certify {
                Certify::Fast => sdf_field::Certify::Fast,
                Certify::Tight => sdf_field::Certify::Tight,
            },
            sign: match self.sign {
                Sign::Auto => None,
                Sign::PseudoNormal => Some(SignMethod::PseudoNormal),
                Sign::Winding => Some(SignMethod::Winding),
            },
            inner_faces: match self.inner_faces {
                InnerFaces::Drop => sdf_field::InnerFaces::Drop,
                InnerFaces::Keep => sdf_field::InnerFaces::Keep,
            },
            keep_mesh: self.keep_mesh,
            weld: self.weld,
            close: self.close,
            threads: sdf_field::Threads::ALL,
            source,
        })
    }
}
