//! The shape that a table describes.

use sdf_core::AnyField;
use sdf_core::combine::{Difference, Intersection, Offset, Shell, SmoothUnion};
use sdf_core::shapes::{
    Bowl, Capsule, Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Horseshoe, Octahedron, RoundedBox, Sphere, Torus,
};

use super::pose::Pose;
use super::table::Table;
use super::{FieldError, Grids};

const SHAPES: &str = "sphere, half_space, box, rounded_box, capsule, cylinder, cone, torus, octahedron, ellipsoid, bowl, \
    horseshoe, grid, union, intersection, difference, smooth_union, offset or shell";

/// The shape of a table, placed by its `pose`. `max_depth` bounds the nesting of shapes.
pub(super) fn node(mut table: Table, grids: &mut Grids, max_depth: usize) -> Result<AnyField, FieldError> {
    let Some(depth) = max_depth.checked_sub(1) else {
        return Err(table.refuse("is nested too deep"));
    };
    let pose = table.optional_table("pose")?.map(Pose::read).transpose()?;
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
        "cone" => {
            Cone::new(table.angle("half_angle_deg", "half_angle_rad")?, table.number("height")?).map(AnyField::Cone)
        }
        "torus" => Torus::new(table.number("major_radius")?, table.number("minor_radius")?).map(AnyField::Torus),
        "octahedron" => Octahedron::new(table.number("size")?).map(AnyField::Octahedron),
        "ellipsoid" => Ellipsoid::new(table.numbers("radii")?).map(AnyField::Ellipsoid),
        "bowl" => Bowl::new(table.number("radius")?, table.number("cut_height")?, table.number("thickness")?)
            .map(AnyField::Bowl),
        "horseshoe" => Horseshoe::new(
            table.number("radius")?,
            table.number("thickness")?,
            table.angle("bend_deg", "bend_rad")?,
            table.number("leg")?,
            table.number("half_depth")?,
        )
        .map(AnyField::Horseshoe),
        "grid" => {
            let name = table.text("file")?;
            Some(AnyField::Grid(grids.read(name).map_err(|what| table.refuse(what))?))
        }
        "union" => union(parts(&mut table, grids, depth)?),
        "intersection" => join_all(parts(&mut table, grids, depth)?, |a, b| {
            Some(AnyField::Intersection(Box::new(Intersection(a, b))))
        }),
        "difference" => difference(parts(&mut table, grids, depth)?),
        "smooth_union" => {
            let blend = table.number("blend")?;
            let join = |a, b| SmoothUnion::new(a, b, blend).map(|union| AnyField::SmoothUnion(Box::new(union)));
            let parts = parts(&mut table, grids, depth)?;
            // One part alone is not joined.
            if blend > 0.0 { join_all(parts, join) } else { None }
        }
        "offset" => {
            let part = node(table.table("of")?, grids, depth)?;
            Offset::new(part, table.number("distance")?).map(|offset| AnyField::Offset(Box::new(offset)))
        }
        "shell" => {
            let part = node(table.table("of")?, grids, depth)?;
            Shell::new(part, table.number("thickness")?).map(|shell| AnyField::Shell(Box::new(shell)))
        }
        unknown => return Err(table.refuse(format!("unknown shape {unknown:.40?}; known shapes: {SHAPES}"))),
    };
    let node = node.ok_or_else(|| {
        let out_of_range = "out of range: give lengths between 1e-150 and 1e150";
        let why = if table.is_out_of_range() { out_of_range } else { requirement(shape) };
        table.refuse(format!("not a valid {shape}: {why}"))
    })?;
    table.finish()?;
    Ok(match pose {
        Some(pose) => pose.place(node),
        None => node,
    })
}

/// Condition on the numbers of a shape.
fn requirement(shape: &str) -> &'static str {
    match shape {
        "half_space" => "normal must not be zero",
        "smooth_union" => "blend must be more than 0",
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

fn parts(table: &mut Table, grids: &mut Grids, depth: usize) -> Result<Vec<AnyField>, FieldError> {
    table.tables("of")?.into_iter().map(|part| node(part, grids, depth)).collect()
}

/// All parts, joined in a balanced tree of neighbours, so that n parts nest only log₂ n deep.
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

/// The first part without all others.
fn difference(mut parts: Vec<AnyField>) -> Option<AnyField> {
    let others = union(parts.split_off(1));
    let first = parts.pop();
    match (first, others) {
        (Some(first), Some(others)) => Some(AnyField::Difference(Box::new(Difference(first, others)))),
        (first, _) => first,
    }
}
