use anyhow::{Result, bail};
use sdf_core::{Aabb, Sdf};
use sdf_formats::field_file::{self, Field};
use serde_json::json;

use crate::args::{Axis, SliceArgs};
use crate::output;
use crate::pictures::{Picture, Plane};
use crate::report::{Report, number};

pub fn run(args: &SliceArgs) -> Result<()> {
    output::require(&args.output, &[&args.sdf])?;
    match field_file::read(&args.sdf)? {
        Field::Grid { grid, .. } => draw(args, &grid, grid.lattice().bounds()),
        Field::Analytic(node) => {
            let bounds = node.bounds(0.0);
            if !bounds.extents().iter().all(|extent| extent.is_finite()) {
                bail!("{}: the field has no end: intersect it with a box", args.sdf.display());
            }
            draw(args, &node, bounds.inflate(0.1 * bounds.longest_side()))
        }
    }
}

fn draw<F: Sdf>(args: &SliceArgs, field: &F, window: Aabb) -> Result<()> {
    let axis = match args.axis {
        Axis::X => 0,
        Axis::Y => 1,
        Axis::Z => 2,
    };
    let at = args.at.unwrap_or(0.5 * (window.min[axis] + window.max[axis]));
    let picture = Picture::of(field, Plane { axis, at, window }, args.pixels);
    picture.write(&args.output)?;
    let [width, height] = picture.size();
    let name = ["x", "y", "z"][axis];
    Report {
        rows: vec![
            ("plane", format!("{name} = {}", number(at))),
            ("picture", format!("{}, {width} × {height} pixels", args.output.display())),
        ],
        json: json!({
            "schema": "sdftool.slice/1",
            "axis": name,
            "at": at,
            "window": {"min": window.min, "max": window.max},
            "pixels": [width, height],
            "output": args.output.display().to_string(),
        }),
    }
    .print(args.json)
}
