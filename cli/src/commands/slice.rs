//! Draws a plane through a field. Of a grid, only the samples near the plane are read.

use anyhow::{Result, bail};
use sdf_core::grid::owned::{Layout, OwnedGrid};
use sdf_core::grid::sparse::BRICK;
use sdf_core::{Aabb, Sdf};
use sdf_field::Field;
use sdf_formats::field_file::OpenField;
use serde_json::json;

use crate::args::{Axis, SliceArgs};
use crate::pictures::{Picture, Plane};
use crate::report::{Report, place, warn};
use crate::{field_input, memory, mesh_input, output, standard_output};

pub fn run(args: &SliceArgs) -> Result<()> {
    output::ensure_writable(&args.output, &[&args.sdf])?;
    output::ensure_alone(&args.output, args.json)?;
    // Three bytes a pixel, and those of the file.
    let bytes = 6.0 * f64::from(args.pixels).powi(2);
    memory::require(bytes, &format!("a picture of --pixels {}", args.pixels), "use fewer")?;
    match field_input::open(&args.sdf)? {
        OpenField::Grid(reader) => {
            let bounds = reader.summary().lattice.bounds();
            let plane = plane(args, bounds)?;
            let mut region = bounds;
            (region.min[plane.axis], region.max[plane.axis]) = (plane.at, plane.at);
            let stored = reader.read_needed([region], f64::INFINITY)?;
            draw(args, &stored.grid, plane)
        }
        OpenField::Blob(blob) => draw(args, &blob.grid, plane(args, blob.grid.lattice().bounds())?),
        OpenField::Analytic(node) => {
            let bounds = node.bounds(0.0);
            if !bounds.extents().iter().all(|extent| extent.is_finite()) {
                bail!("{}: the field is unbounded: intersect it with a box", mesh_input::shown(&args.sdf));
            }
            let window = bounds.inflate(0.1 * bounds.longest_side());
            let field = Field::new(node);
            let picture = Picture::new(field.as_any(), plane(args, window)?, args.pixels, None);
            write(args, &picture, Some(NO_SURFACE).filter(|_| !field.knows_surface()))
        }
    }
}

fn draw(args: &SliceArgs, grid: &OwnedGrid, plane: Plane) -> Result<()> {
    let band = Some(grid.band()).filter(|band| band.is_finite());
    let mut picture = Picture::new(grid, plane, args.pixels, band);
    if grid.storage().layout() == Layout::Sparse {
        let side = grid.lattice().spacing() * f64::from(BRICK);
        picture.bricks(grid.lattice().origin(), side, |slot| grid.storage().brick_at(slot).is_some());
    }
    write(args, &picture, None)
}

const NO_SURFACE: &str =
    "the line of distance 0 is no surface beyond the band or the box in which a grid of this combination has distances";

const NAMES: [&str; 3] = ["x", "y", "z"];

fn plane(args: &SliceArgs, window: Aabb) -> Result<Plane> {
    let axis = match args.axis {
        Axis::X => 0,
        Axis::Y => 1,
        Axis::Z => 2,
    };
    let (first, last) = (window.min[axis], window.max[axis]);
    let at = args.at.unwrap_or(0.5 * (first + last));
    if !(first..=last).contains(&at) {
        let name = NAMES[axis];
        // In all digits: an end that is rounded may be outside again.
        bail!(
            "{}: --at {at:?} is outside the field's box: use {name} from {first:?} to {last:?}",
            mesh_input::shown(&args.sdf)
        );
    }
    Ok(Plane { axis, at, window })
}

fn write(args: &SliceArgs, picture: &Picture, warning: Option<&str>) -> Result<()> {
    if standard_output::is_standard_output(&args.output) {
        standard_output::print_bytes(&picture.png()?)?;
    } else {
        picture.write(&args.output)?;
    }
    let [width, height] = picture.size();
    let Plane { axis, at, window } = *picture.plane();
    let name = NAMES[axis];
    if let Some(warning) = warning {
        warn(&format!("{}: {warning}", mesh_input::shown(&args.sdf)));
    }
    let mut report = Report {
        rows: vec![
            ("plane", format!("{name} = {}", place(at, 1e-3 * window.longest_side()))),
            ("picture", format!("{}, {width} × {height} pixels", standard_output::shown(&args.output))),
        ],
        json: json!({
            "schema": "sdftool.slice/1",
            "axis": name,
            "at": at,
            "window": {"min": window.min, "max": window.max},
            "pixels": [width, height],
            "output": args.output.display().to_string(),
        }),
    };
    if let Some(warning) = warning {
        report.json["warning"] = warning.into();
    }
    report.print_beside(Some(&args.output), args.json)
}
