//! Makes a grid of a field of another program.

use anyhow::{Context, Result, bail};
use sdf_core::grid::owned::OwnedGrid;
use sdf_core::nalgebra::Vector3;
use sdf_core::{EnclosedSdf, Sdf};
use sdf_field::file::Compression;
use sdf_field::import::ImportFormat;
use sdf_field::{Field, Source, Threads};
use serde_json::json;
use sha2::{Digest, Sha256};

use crate::args::ImportArgs;
use crate::commands::export::named_after;
use crate::failure::misuse;
use crate::mesh_input::{bytes, is_standard_input, shown};
use crate::output;
use crate::report::{Report, counts, number};
use crate::standard_output;

pub fn run(args: &ImportArgs) -> Result<()> {
    let shown = shown(&args.file);
    if args.file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("npz")) {
        misuse!("{shown}: an archive of arrays is not read: import one of its .npy");
    }
    let output = match &args.output {
        Some(output) => output.clone(),
        None if is_standard_input(&args.file) => misuse!("a field from standard input has no name: add -o"),
        None => named_after(&args.file, "sdf.h5"),
    };
    output::ensure_writable(&output, &[&args.file])?;
    output::ensure_alone(&output, args.json)?;
    let bytes = bytes(&args.file)?;
    // Of standard input --spacing tells what is in it, which a NumPy array needs.
    let is_npy = ImportFormat::is_npy(&args.file, &bytes) || is_standard_input(&args.file) && args.spacing.is_some();
    let format = match (is_npy, args.spacing) {
        (true, Some(spacing)) => ImportFormat::Npy { origin: args.origin.map_or([0.0; 3], |origin| origin.0), spacing },
        (true, None) => misuse!("{shown}: a NumPy array does not say how far its nodes are apart: add --spacing"),
        (false, None) if args.origin.is_none() => ImportFormat::Nvdb,
        (false, _) => misuse!("{shown}: a NanoVDB file has its own place: remove --spacing and --origin"),
    };
    // The array may have been exported from that grid, which holds more.
    if args.output.is_none() && output.exists() {
        bail!("{}: is there already: name the grid with -o, this name to replace it", output.display());
    }
    let name = args.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let source = Source { name, sha256: Sha256::digest(&bytes).into(), triangles: 0 };
    let field = Field::import(&bytes, format, source).with_context(|| shown.clone())?;
    drop(bytes);
    let file = output::save(&field, &output, Compression::Deflate)?;
    let (Some(grid), Some(info)) = (field.grid(), field.info()) else {
        bail!("{shown}: made no grid: please report this")
    };
    let lattice = grid.lattice();
    let warning = warning(&field, grid);
    let mut rows = vec![
        ("grid", format!("{} nodes, spacing {}", counts(lattice.nodes()), number(lattice.spacing()))),
        ("slope", slope_row(grid)),
        ("error", "unknown: nothing is certified of samples that were not baked here".to_owned()),
        ("padding", format!("{}: margins of contacts up to it", number(info.padding))),
    ];
    rows.extend(warning.iter().map(|warning| ("warning", warning.clone())));
    rows.push(("file", format!("{}, {file} bytes", standard_output::shown(&output))));
    let json = json!({
        "schema": "sdftool.import/1",
        "output": output.display().to_string(),
        "counts": lattice.nodes(),
        "origin": lattice.origin(),
        "spacing": lattice.spacing(),
        "slope_bound": grid.slope_bound(),
        "error_bound": null,
        "padding": info.padding,
        "warning": warning,
        "file_bytes": file,
    });
    Report { rows, json }.print_beside(Some(&output), args.json)
}

/// The slope bound counts how φ goes on outside of the box, at a slope of 1 or more: what was measured is that within.
fn slope_row(grid: &OwnedGrid) -> String {
    let measured = grid.enclose_box(&grid.lattice().bounds()).slope_bound;
    format!("at most {}; {} in the box, as measured", number(grid.slope_bound()), number(measured))
}

/// Reason to think that the samples are no signed distances of a solid in the box.
fn warning(field: &Field, grid: &OwnedGrid) -> Option<String> {
    if !field.has_inside() {
        return Some("no node is inside the solid: no sample is negative".to_owned());
    }
    if field.range_on_faces(grid.lattice(), Threads::ALL).upper < 0.0 {
        return Some("the solid reaches or lies outside the box on all sides: are the signs flipped?".to_owned());
    }
    let slope = slope_at_surface(grid).filter(|slope| !(1.0 / FARTHEST_SLOPE..FARTHEST_SLOPE).contains(slope))?;
    let slope = number(slope);
    Some(format!(
        "at the surface the samples change by {slope} over a length of 1: are they distances in another unit?"
    ))
}

/// Slope at the surface up to which samples pass for distances, whose slope is 1.
const FARTHEST_SLOPE: f64 = 1.5;

/// Most cells that are looked at, evenly spread.
const MOST_CELLS: usize = 1 << 20;

/// The prime of Knuth's multiplicative hashing.
const PRIME: u128 = 2_654_435_761;

/// Median of |∇φ| in the middle of cells that the surface passes. `None` if none was seen.
fn slope_at_surface(grid: &OwnedGrid) -> Option<f64> {
    let (lattice, spacing) = (grid.lattice(), grid.lattice().spacing());
    let [row, rows, layers] = lattice.cells().map(|cells| cells as usize);
    let count = row * rows * layers;
    let slopes = (0..count.min(MOST_CELLS)).filter_map(|step| {
        // Steps by a prime meet all cells, and no row or layer more than others.
        let index = (step as u128 * PRIME % count as u128) as usize;
        let cell = [index % row, index / row % rows, index / row / rows];
        let first = Vector3::from(lattice.node(cell.map(|along| along as u32)));
        let sample = grid.evaluate(first.add_scalar(0.5 * spacing));
        let slope = sample.gradient.norm();
        (sample.value.abs() <= 0.5 * spacing * slope).then_some(slope)
    });
    let mut slopes: Vec<f64> = slopes.collect();
    let middle = slopes.len() / 2;
    (!slopes.is_empty()).then(|| *slopes.select_nth_unstable_by(middle, f64::total_cmp).1)
}
