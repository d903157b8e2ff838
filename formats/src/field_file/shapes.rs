//! From a table of the file to the shape that it describes.

use std::path::Path;
use std::sync::Arc;

use sdf_core::AnyField;
use sdf_core::combine::{Difference, Intersection, Offset, Shell, SmoothUnion};
use sdf_core::grid::owned::OwnedGrid;
use sdf_core::placed::{Placed, Similarity, Stretch};
use sdf_core::shapes::{
    Bowl, Capsule, Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Horseshoe, Octahedron, RoundedBox, Sphere, Torus,
};

use super::table::Table;
use super::{FieldError, Grids};

const SHAPES: &str = "sphere, half_space, box, rounded_box, capsule, cylinder, cone, torus, octahedron, ellipsoid, bowl, \
    horseshoe, grid, union, intersection, difference, smooth_union, offset or shell";

/// The shape of a table, placed by its `pose`. `may_nest`: how many levels deeper it may go.
pub(super) fn node(mut table: Table, grids: &mut Grids, may_nest: usize) -> Result<AnyField, FieldError> {
    let Some(may_nest) = may_nest.checked_sub(1) else {
        return Err(table.refuse("is nested too deep"));
    };
    let pose = table.table_if_there("pose")?.map(pose).transpose()?;
    let shape = table.text("shape")?;
    let node = match shape {
        "sphere" => Sphere::new(table.number("radius")?).map(AnyField::Sphere),
        "half_space" => HalfSpace::new(table.numbers("normal")?, table.number("offset")?).map(AnyField::HalfSpace),
        "box" => Cuboid::new(table.numbers("half_extents")?).map(AnyField::Cuboid),
        "rounded_box" => {
            RoundedBox::new(table.numbers("half_extents")?, table.number("radius")?).map(AnyField::RoundedBox)
        }
        "capsule" => {
            Capsule::new(table.numbers("a")?, table.numbers("b")?, table.number("radius")?).map(AnyField::Capsule)
        }
        "cylinder" => Cylinder::new(table.number("radius")?, table.number("half_height")?).map(AnyField::Cylinder),
        "cone" => Cone::new(table.number("half_angle_deg")?.to_radians(), table.number("height")?).map(AnyField::Cone),
        "torus" => Torus::new(table.number("major_radius")?, table.number("minor_radius")?).map(AnyField::Torus),
        "octahedron" => Octahedron::new(table.number("size")?).map(AnyField::Octahedron),
        "ellipsoid" => Ellipsoid::new(table.numbers("radii")?).map(AnyField::Ellipsoid),
        "bowl" => Bowl::new(table.number("radius")?, table.number("cut_height")?, table.number("thickness")?)
            .map(AnyField::Bowl),
        "horseshoe" => Horseshoe::new(
            table.number("radius")?,
            table.number("thickness")?,
            table.number("bend_deg")?.to_radians(),
            table.number("leg")?,
            table.number("half_depth")?,
        )
        .map(AnyField::Horseshoe),
        "grid" => Some(AnyField::Grid(grid(&mut table, grids)?)),
        "union" => union(parts(&mut table, grids, may_nest)?),
        "intersection" => {
            joined(&mut table, grids, may_nest, |a, b| Some(AnyField::Intersection(Box::new(Intersection(a, b)))))?
        }
        "difference" => difference(&mut table, grids, may_nest)?,
        "smooth_union" => {
            let blend = table.number("blend")?;
            let blended = |a, b| SmoothUnion::new(a, b, blend).map(|union| AnyField::SmoothUnion(Box::new(union)));
            joined(&mut table, grids, may_nest, blended)?
        }
        "offset" => {
            let of = node(table.table("of")?, grids, may_nest)?;
            Offset::new(of, table.number("distance")?).map(|offset| AnyField::Offset(Box::new(offset)))
        }
        "shell" => {
            let of = node(table.table("of")?, grids, may_nest)?;
            Shell::new(of, table.number("thickness")?).map(|shell| AnyField::Shell(Box::new(shell)))
        }
        unknown => return Err(table.refuse(format!("shape {unknown:.40?} is unknown; take {SHAPES}"))),
    };
    let node = node.ok_or_else(|| table.refuse(format!("these numbers make no {shape}: {}", wanted(shape))))?;
    table.finish()?;
    Ok(match pose {
        Some(pose) => pose.of(node),
        None => node,
    })
}

/// Of the numbers of a shape that is not made of just any.
fn wanted(shape: &str) -> &'static str {
    match shape {
        "half_space" => "normal must not be zero",
        "rounded_box" => "half_extents must be more than 0, radius 0 or more",
        "cone" => "half_angle_deg must be between 0 and 90, height more than 0",
        "torus" => "minor_radius must be more than 0, major_radius no less than minor_radius",
        "bowl" => "all but cut_height must be more than 0, and cut_height between -radius and radius",
        "horseshoe" => {
            "radius, thickness and half_depth must be more than 0, bend_deg between 0 and 180, leg 0 or more, thickness \
             less than twice the radius, and the legs must not meet"
        }
        _ => "lengths must be more than 0",
    }
}

/// First stretched, where each axis has a scale of its own, then put where it belongs.
struct Pose {
    stretch: Option<Stretch>,
    placement: Similarity,
}

impl Pose {
    fn of(self, node: AnyField) -> AnyField {
        let field = match self.stretch {
            Some(placement) => AnyField::Stretched(Box::new(Placed { field: node, placement })),
            None => node,
        };
        AnyField::Placed(Box::new(Placed { field, placement: self.placement }))
    }
}

fn pose(mut table: Table) -> Result<Pose, FieldError> {
    let translation = table.numbers_if_there("translation")?.unwrap_or([0.0; 3]);
    let rotation = table.numbers_if_there("rotation")?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let (stretch, scale) = if table.is_list("scale") {
        let stretch = Stretch::new(table.numbers("scale")?);
        (Some(stretch.ok_or_else(|| table.refuse("no scale of an axis may be zero"))?), 1.0)
    } else {
        (None, table.number_if_there("scale")?.unwrap_or(1.0))
    };
    let placement = Similarity::new(translation, rotation, scale);
    let placement = placement.ok_or_else(|| table.refuse("rotation must not be zero and scale must be positive"))?;
    table.finish()?;
    Ok(Pose { stretch, placement })
}

/// The file is named as seen from the folder of this one.
fn grid(table: &mut Table, grids: &mut Grids) -> Result<Arc<OwnedGrid>, FieldError> {
    let folder = table.file.parent().unwrap_or(Path::new("."));
    let file = folder.join(table.text("file")?);
    grids.read(&file).map_err(|error| table.refuse(error.to_string()))
}

fn parts(table: &mut Table, grids: &mut Grids, may_nest: usize) -> Result<Vec<AnyField>, FieldError> {
    table.tables("of")?.into_iter().map(|part| node(part, grids, may_nest)).collect()
}

/// All of `of`, joined by pairs of neighbours, pairs of pairs and so on, so that many parts nest but little.
fn joined(
    table: &mut Table,
    grids: &mut Grids,
    may_nest: usize,
    join: impl Fn(AnyField, AnyField) -> Option<AnyField>,
) -> Result<Option<AnyField>, FieldError> {
    Ok(join_all(parts(table, grids, may_nest)?, join))
}

fn join_all(mut parts: Vec<AnyField>, join: impl Fn(AnyField, AnyField) -> Option<AnyField>) -> Option<AnyField> {
    while parts.len() > 1 {
        let mut halved = Vec::with_capacity(parts.len().div_ceil(2));
        let mut rest = parts.into_iter();
        while let Some(first) = rest.next() {
            halved.push(match rest.next() {
                Some(second) => join(first, second)?,
                None => first,
            });
        }
        parts = halved;
    }
    parts.pop()
}

/// The union of all parts; of one alone, that part.
fn union(mut parts: Vec<AnyField>) -> Option<AnyField> {
    if parts.len() == 1 { parts.pop() } else { AnyField::union(parts) }
}

/// The first of `of` without all the others.
fn difference(table: &mut Table, grids: &mut Grids, may_nest: usize) -> Result<Option<AnyField>, FieldError> {
    let mut parts = parts(table, grids, may_nest)?;
    let others = parts.split_off(1);
    let taken = union(others);
    let first = parts.pop();
    Ok(match (first, taken) {
        (Some(first), Some(taken)) => Some(AnyField::Difference(Box::new(Difference(first, taken)))),
        (first, _) => first,
    })
}
