//! Arguments of `contacts` and `compare`, and the library's options that they stand for.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::builder::{PathBufValueParser, PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Parser, ValueEnum};
use sdf_core::placed::Rigid;
use sdf_field::Method;

use super::values::{Numbers, contact_file, finite, page_file, positive, quaternion, reduced_count};
use super::{Device, DeviceArgs, Json, Threads};
use crate::failure::misuse;

/// Find where a mesh touches a field, or where two fields touch.
///
/// For each element of the mesh that comes within --margin of the surface, or into it, one contact: where it comes nearest or
/// deepest, with a lower bound for the whole element. By default the global minimum is searched; status `converged` means it
/// is proven. Elements that cannot touch are culled without a search.
///
/// With a field in place of the mesh: the points that are deepest in both fields, the first of them proven, and the patch on
/// which both are equally deep, as points with an area each.
#[derive(Debug, Parser)]
pub struct ContactsArgs {
    /// The mesh, in world coordinates: OBJ, PLY, STL or OFF; or a field, moved by --rotate-first, then
    /// --translate-first. A dash reads a mesh from standard input.
    pub mesh: PathBuf,
    /// The field: a baked grid or shapes in TOML. Moved by --rotate, then --translate.
    pub sdf: PathBuf,
    /// Elements of the mesh to search. Edges are those of the triangles, each once, then the file's own line elements.
    #[arg(long, value_enum, default_value_t = Elements::Faces)]
    pub elements: Elements,
    /// Search for the lowest distance on an element.
    #[arg(long, value_parser = method_parser(), default_value_t = Method::Auto)]
    pub method: Method,
    /// Budget per element: evaluations of auto (256) and certified (1024), at least one and never exceeded; iterations of other
    /// methods (32). The cull's evaluation comes on top, and so do those that tell the minima of --all-minima apart.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub iterations: Option<u32>,
    /// Auto and certified stop within this fraction of the element's longest edge, or of the longest side of the field's box if that is
    /// shorter, times the field's slope bound, of the minimum; for two fields, of the longest side of the box in which they may touch
    /// [default: 0.001].
    #[arg(long, value_name = "FRACTION", value_parser = positive, allow_negative_numbers = true)]
    pub tolerance: Option<f64>,
    /// Report every isolated minimum of an element, not only the lowest: a triangle on three bumps touches three times. Minima
    /// separated by less than a hundredth of the longest edge count as one.
    #[arg(long)]
    pub all_minima: bool,
    /// Leave out no element that comes within --margin of the mesh that the grid was baked from. What the grid's error leaves open
    /// is reported with the status `possible`. Of an open mesh, points inside by their winding number alone, with no node
    /// inside around them, count as outside.
    #[arg(long)]
    pub complete: bool,
    /// Measure by the triangles of the mesh that the grid was baked from: distances, normals and surface points are the mesh's own, and
    /// nothing within --margin is left out. Needs a grid of bake --keep-mesh, and no other method.
    #[arg(long)]
    pub exact: bool,
    /// Report one contact for each vertex, edge or face that is touched, the deepest: neighbouring faces that touch with the edge or
    /// vertex they share report it each.
    #[arg(long)]
    pub one_per_feature: bool,
    /// The mesh is a rigid body: report at most so many contacts, 1 to 64, those that hold it as all of them do, and how far the others can
    /// sink nevertheless.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = reduced_count)]
    pub reduce: Option<usize>,
    /// How far the body of --reduce moves until its contacts are searched again [default: --margin and the depth of the deepest
    /// contact].
    #[arg(long, value_name = "D", requires = "reduce", value_parser = positive, allow_negative_numbers = true)]
    pub movement: Option<f64>,
    /// Leave out smooth normals and error bounds, which takes less time: points and distances are the same; normals are those of a grid's
    /// cells, and jump between them. On a GPU one kernel in place of three, and not by auto and certified.
    #[arg(long)]
    pub lean: bool,
    /// Report elements that come within this distance of the surface, in the mesh's unit; negative: report only contacts at
    /// least this deep. For two fields: points within it of both, which exist if the gap is at most twice as wide.
    #[arg(long, value_name = "D", default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    pub margin: f64,
    #[command(flatten)]
    pub pose: PoseArgs,
    /// Two fields: shift the first by this [default: 0,0,0].
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub translate_first: Option<Numbers<3>>,
    /// Two fields: rotate the first about its origin by this quaternion [default: 0,0,0,1].
    #[arg(long, value_name = "X,Y,Z,W", allow_hyphen_values = true, value_parser = quaternion)]
    pub rotate_first: Option<Numbers<4>>,
    /// Two fields: edge of the cubes that the patch is cut into [default: 1/64 of the longest side of the box in which they touch; less
    /// than 1/4096 is refused]. The search for minima takes the same cubes, but none smaller than 1/128.
    #[arg(long, value_name = "D", value_parser = positive, allow_negative_numbers = true)]
    pub resolution: Option<f64>,
    /// Where to write the contacts; the extension decides: .csv, .json, .ply or .h5; - is CSV on standard output [default: nowhere].
    #[arg(short, long, value_name = "OUT", value_parser = PathBufValueParser::new().try_map(contact_file))]
    pub output: Option<PathBuf>,
    /// Where to write a page to look at field, mesh and contacts, as `view` does [default: nowhere].
    #[arg(long, value_name = "PAGE.html", value_parser = PathBufValueParser::new().try_map(page_file))]
    pub view: Option<PathBuf>,
    #[command(flatten)]
    pub device: DeviceArgs,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}

impl ContactsArgs {
    /// Refuses options that need a mesh, when the first argument is a field.
    pub fn refuse_options_of_meshes(&self) -> Result<()> {
        let given = [
            ("--elements", self.elements != Elements::Faces),
            ("--method", self.method != Method::Auto),
            ("--iterations", self.iterations.is_some()),
            ("--all-minima", self.all_minima),
            ("--complete", self.complete),
            ("--exact", self.exact),
            ("--one-per-feature", self.one_per_feature),
            ("--reduce", self.reduce.is_some()),
            ("--lean", self.lean),
            ("--view", self.view.is_some()),
            ("--device", self.device.device != Device::Cpu),
            ("--kernels", self.device.kernels.is_some()),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((option, _)) => misuse!("{option} needs a mesh, but {} is a field: remove it", self.mesh.display()),
            None => Ok(()),
        }
    }

    /// The pose of the first of two fields.
    pub fn first_pose(&self) -> Result<Rigid> {
        let translate = self.translate_first.unwrap_or(Numbers([0.0; 3]));
        rigid("--rotate-first", translate, self.rotate_first.unwrap_or(Numbers([0.0, 0.0, 0.0, 1.0])))
    }

    /// Refuses options that need two fields, when the first argument is a mesh.
    pub fn refuse_options_of_fields(&self) -> Result<()> {
        let given = [
            ("--translate-first", self.translate_first.is_some()),
            ("--rotate-first", self.rotate_first.is_some()),
            ("--resolution", self.resolution.is_some()),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((option, _)) => misuse!("{option} needs two fields, but {} is a mesh: remove it", self.mesh.display()),
            None => Ok(()),
        }
    }

    /// Refuses options that need what --lean leaves out.
    pub fn refuse_what_lean_leaves_out(&self) -> Result<()> {
        let given = [("--all-minima", self.all_minima), ("--complete", self.complete), ("--exact", self.exact)];
        match given.iter().find(|(_, given)| self.lean && *given) {
            Some((option, _)) => {
                misuse!("--lean leaves out error bounds and all minima but the lowest: remove it, or {option}")
            }
            None => Ok(()),
        }
    }

    /// Refuses options that say how to search, when --exact does.
    pub fn refuse_methods_of_exact(&self) -> Result<()> {
        let given = [
            ("--method", self.method != Method::Auto),
            ("--iterations", self.iterations.is_some()),
            ("--tolerance", self.tolerance.is_some()),
            ("--all-minima", self.all_minima),
        ];
        match given.iter().find(|(_, given)| self.exact && *given) {
            Some((option, _)) => {
                misuse!("--exact has its own method and finds one minimum of each element: remove {option}")
            }
            None => Ok(()),
        }
    }
}

/// Pose of the field.
#[derive(Clone, Copy, Debug, Parser)]
pub struct PoseArgs {
    /// Shift the field by this.
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,0", allow_hyphen_values = true)]
    pub translate: Numbers<3>,
    /// Rotate the field about its origin by this quaternion, of any length but zero.
    #[arg(long, value_name = "X,Y,Z,W", default_value = "0,0,0,1", allow_hyphen_values = true, value_parser = quaternion)]
    pub rotate: Numbers<4>,
}

impl PoseArgs {
    /// Is the field moved at all?
    pub fn is_moved(&self) -> bool {
        self.translate.0 != [0.0; 3] || self.rotate.0 != [0.0, 0.0, 0.0, 1.0]
    }

    pub fn rigid(&self) -> Result<Rigid> {
        rigid("--rotate", self.translate, self.rotate)
    }

    /// `None` if the field is not moved.
    pub fn motion(&self) -> Result<Option<Rigid>> {
        Ok(if self.is_moved() { Some(self.rigid()?) } else { None })
    }
}

/// The motion of a translation and a quaternion, which `option` names in the error.
fn rigid(option: &str, translate: Numbers<3>, rotate: Numbers<4>) -> Result<Rigid> {
    let motion = Rigid::new(translate.0, rotate.0);
    motion.with_context(|| format!("{option}: a zero quaternion is not a rotation; use 0,0,0,1 for none"))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Elements {
    Faces,
    Edges,
    Vertices,
}

impl From<Elements> for sdf_field::Elements {
    fn from(elements: Elements) -> Self {
        match elements {
            Elements::Faces => Self::Faces,
            Elements::Edges => Self::Edges,
            Elements::Vertices => Self::Vertices,
        }
    }
}

/// Parses the value of --method, and tells of each method what it does.
fn method_parser() -> impl TypedValueParser<Value = Method> {
    let choices = Method::ALL.map(|method| PossibleValue::new(method.to_string()).help(method.summary()));
    PossibleValuesParser::new(choices).try_map(|name| name.parse())
}

/// Parses the value of --elements of a comparison. That vertices need none is said by the command.
fn compared_elements() -> impl TypedValueParser<Value = Elements> {
    let values = [PossibleValue::new("faces"), PossibleValue::new("edges"), PossibleValue::new("vertices").hide(true)];
    PossibleValuesParser::new(values).map(|name| match name.as_str() {
        "faces" => Elements::Faces,
        "edges" => Elements::Edges,
        _ => Elements::Vertices,
    })
}

/// Compare all methods on one mesh and one field: error against run time, missed contacts, and which method to take.
///
/// The reference is the certified search with 16,384 evaluations per element. A method's error on an element is its lowest
/// distance minus the reference's. Every method runs --rounds times, in turns; times are medians. With --device cuda those that the
/// GPU has run there, too.
#[derive(Debug, Parser)]
pub struct CompareArgs {
    /// The mesh: OBJ, PLY, STL or OFF.
    pub mesh: PathBuf,
    /// The field: a baked grid or shapes in TOML. Moved by --rotate, then --translate.
    pub sdf: PathBuf,
    /// Elements of the mesh to search: faces or edges.
    #[arg(long, default_value = "faces", value_parser = compared_elements())]
    pub elements: Elements,
    /// Compare on elements that come within this distance of the surface, in the mesh's unit.
    #[arg(long, value_name = "D", default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    pub margin: f64,
    /// Recommend only methods whose error is within this fraction of an edge's length for 95 % of the contacts.
    #[arg(long, value_name = "FRACTION", default_value_t = 1e-3, value_parser = positive, allow_negative_numbers = true)]
    pub tolerance: f64,
    #[command(flatten)]
    pub pose: PoseArgs,
    /// Number of runs of each method.
    #[arg(long, value_name = "N", default_value_t = 3, allow_negative_numbers = true)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: u32,
    /// Compare times of lean contacts: see contacts --lean.
    #[arg(long)]
    pub lean: bool,
    /// Where to write a page with a plot [default: nowhere].
    #[arg(short, long, value_name = "OUT.html", value_parser = PathBufValueParser::new().try_map(page_file))]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub device: DeviceArgs,
    #[command(flatten)]
    pub threads: Threads,
    #[command(flatten)]
    pub json: Json,
}
