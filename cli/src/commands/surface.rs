//! Extracts the level set of a field as a mesh.

use anyhow::{Context, Result, bail, ensure};
use sdf_bake::lattice_around;
use sdf_core::grid::Lattice;
use sdf_core::{Aabb, Interval};
use sdf_field::{Field, SurfaceMesh, Threads};
use sdf_formats::mesh::{self, MeshFormat};
use serde_json::json;

use crate::args::SurfaceArgs;
use crate::mesh_input::{self, with_path};
use crate::report::{Report, counted, counts, number, warn};
use crate::{field_input, memory, output, standard_output};

/// Default of --res for shapes in closed form, which have no cells of their own.
const DEFAULT_RES: u32 = 128;

pub fn run(args: &SurfaceArgs) -> Result<()> {
    output::ensure_writable(&args.output, &[&args.sdf])?;
    output::ensure_alone(&args.output, args.json)?;
    let field = field_input::read_whole(&args.sdf)?;
    refuse_unknown_level(args, &field)?;
    let lattice = match (field.grid().map(|grid| *grid.lattice()), args.res) {
        (Some(own), None) => own,
        (Some(own), Some(res)) => lattice(args, &own.bounds(), res, 0)?,
        (None, res) => {
            let bounds = field.bounds(args.level);
            if !bounds.extents().iter().all(|extent| extent.is_finite()) {
                bail!("{}: the field is unbounded: intersect it with a box", mesh_input::shown(&args.sdf));
            }
            lattice(args, &bounds, res.unwrap_or(DEFAULT_RES), PADDING)?
        }
    };
    let surface = field.surface(args.level, &lattice, Threads::ALL);
    if surface.triangles.is_empty() {
        let (shown, level) = (mesh_input::shown(&args.sdf), number(args.level));
        // Shapes and other nodes than a grid's own may be thinner than a cell.
        if field.grid().is_some() && args.res.is_none() {
            bail!("{shown}: the surface is empty: the distance is nowhere {level}, use another --level");
        }
        bail!("{shown}: {}, use a larger --res or another --level", empty_between(lattice.nodes(), args.level));
    }
    let format = MeshFormat::from_extension(&args.output);
    let warnings = [open_at_box(&field, args.level, &lattice), format.and_then(|format| flattened(format, &surface))];
    let warnings: Vec<String> = warnings.into_iter().flatten().collect();
    let warning = (!warnings.is_empty()).then(|| warnings.join("; "));
    match format {
        Some(format) => {
            with_path(&args.output, mesh::write(&args.output, format, &surface.points, &surface.triangles))?
        }
        None => standard_output::print_bytes(&mesh::to_bytes(MeshFormat::Obj, &surface.points, &surface.triangles)?)?,
    }
    if let Some(warning) = &warning {
        warn(&format!("{}: {warning}", mesh_input::shown(&args.sdf)));
    }
    let [points, triangles] = [surface.points.len(), surface.triangles.len()];
    let mut json = json!({
        "schema": "sdftool.surface/1",
        "points": points,
        "triangles": triangles,
        "output": args.output.display().to_string(),
    });
    if let Some(warning) = warning {
        json["warning"] = warning.into();
    }
    Report {
        rows: vec![
            ("surface", format!("{}, {}", counted(points, "point"), counted(triangles, "triangle"))),
            ("file", standard_output::shown(&args.output)),
        ],
        json,
    }
    .print_beside(Some(&args.output), args.json)
}

/// Refuses a level at which values are no distances: beyond the band of a sparse grid, or outside of the box of one in a combination.
/// The surface of a grid alone ends at its box.
fn refuse_unknown_level(args: &SurfaceArgs, field: &Field) -> Result<()> {
    let (shown, level) = (mesh_input::shown(&args.sdf), number(args.level));
    match field.grid().map(|grid| grid.band()) {
        Some(band) if args.level.abs() > band => bail!(
            "{shown}: --level {level} lies beyond the band of {} in which the grid has distances: bake with a larger --band",
            number(band)
        ),
        Some(_) => Ok(()),
        None => {
            let Interval { lower, upper } = field.known_levels();
            let is_known = (lower..=upper).contains(&args.level);
            ensure!(
                is_known,
                "{shown}: --level {level} lies beyond the band or the box in which a grid of this combination has distances: bake it with a larger --padding, and dense or with a larger --band"
            );
            Ok(())
        }
    }
}

/// Says that no surface passes between nodes.
pub fn empty_between(nodes: [u32; 3], level: f64) -> String {
    format!("the surface is empty: between {} nodes the distance is nowhere {}", counts(nodes), number(level))
}

/// Says that the surface leaves the box of its lattice and is open there, and which levels close.
pub fn open_at_box(field: &Field, level: f64, lattice: &Lattice) -> Option<String> {
    let Interval { lower, upper } = field.range_on_faces(lattice, Threads::ALL);
    let is_open = lower < level && level <= upper;
    // In all digits: a level that is rounded up is open again.
    is_open.then(|| {
        format!(
            "the surface is open where it leaves the box: levels up to {lower:?} close, or bake with a larger --padding"
        )
    })
}

/// Says that many triangles have no area in the file: some are so small anyway.
fn flattened(format: MeshFormat, surface: &SurfaceMesh) -> Option<String> {
    let (count, all) = (mesh::flattened(format, &surface.points, &surface.triangles), surface.triangles.len());
    let is_much = count * 100 > all;
    is_much.then(|| {
        format!("STL rounds coordinates to f32: {count} of {all} triangles have no area left, write .ply, .obj or .off")
    })
}

/// Cells of padding around a field that is not a grid, so that its surface is closed.
const PADDING: u32 = 2;

/// The lattice to sample on.
fn lattice(args: &SurfaceArgs, bounds: &Aabb, res: u32, padding: u32) -> Result<Lattice> {
    let spacing = bounds.longest_side() / f64::from(res);
    let cells = bounds.extents().map(|extent| extent / spacing);
    memory::require(
        SurfaceMesh::estimated_bytes(cells),
        &format!("--res {res}: a surface of about {:.0} cells", SurfaceMesh::estimated_cells(cells)),
        "use a smaller --res",
    )?;
    lattice_around(bounds, spacing, padding).with_context(|| {
        format!("{}: its box cannot be cut into cells: use another --res", mesh_input::shown(&args.sdf))
    })
}
