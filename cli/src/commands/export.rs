//! Writes a field as a file of another program.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::Result;
use sdf_core::Real;
use sdf_core::grid::Lattice;
use sdf_field::export::{ExportError, ExportFormat, ExportOptions, Exported, Written, description_path};
use serde_json::json;

use crate::args::ExportArgs;
use crate::commands::surface::{empty_between, open_at_box};
use crate::failure::misuse;
use crate::mesh_input::is_standard_input;
use crate::report::{Report, counts, number, warn};
use crate::{field_input, mesh_input, output, progress, standard_output};

pub fn run(args: &ExportArgs) -> Result<()> {
    let format = format(args)?;
    let output = match &args.output {
        Some(output) => output.clone(),
        None if is_standard_input(&args.sdf) => misuse!("a field from standard input has no name: add -o"),
        None => named_after(&args.sdf, format.extension()),
    };
    if args.band.is_some() && format != ExportFormat::Nvdb {
        misuse!("--band is for --format nvdb: remove it");
    }
    let is_blob = matches!(format, ExportFormat::Blob | ExportFormat::C | ExportFormat::Rust);
    if args.precision.is_some() && !is_blob {
        misuse!("--precision is for --format blob, c and rust: remove it");
    }
    output::ensure_writable(&output, &[&args.sdf])?;
    if format == ExportFormat::Raw {
        output::ensure_writable(&description_path(&output), &[&args.sdf])?;
    }
    let to_stdout = standard_output::is_standard_output(&output);
    if to_stdout {
        if format == ExportFormat::Raw {
            misuse!("--format raw writes two files: name one by --output");
        }
        output::ensure_alone(&output, args.json)?;
    }
    let field = field_input::read_whole(&args.sdf)?;
    let options = ExportOptions {
        cells: args.res,
        band: args.band,
        name: stem(&args.sdf),
        precision: args.precision,
        ..ExportOptions::default()
    };
    let exported = progress::on_threads(args.threads, || {
        if to_stdout {
            let Exported { lattice, band, has_lost_surface, bytes, .. } = field.export(format, &options)?;
            return Ok((Written { lattice, band, has_lost_surface, files: vec![] }, bytes));
        }
        Ok((field.export_to(&output, format, &options)?, vec![]))
    })?;
    let (Written { lattice, band, has_lost_surface, files }, printed) = exported.map_err(|error| match error {
        ExportError::Unwritable(path, error) => anyhow::Error::new(error).context(path.display().to_string()),
        ExportError::NoSurface { nodes } => {
            let finer = if field.grid().is_some() && args.res.is_none() { "bake with" } else { "use" };
            let open = match format {
                ExportFormat::Glb => ", or take `surface --level`: an open mesh without an inside has a surface at distances above 0 alone",
                _ => "",
            };
            anyhow::anyhow!("{}: {}, {finer} a larger --res{open}", mesh_input::shown(&args.sdf), empty_between(nodes, 0.0))
        }
        error => anyhow::anyhow!("{}: {error}", mesh_input::shown(&args.sdf)),
    })?;
    if to_stdout {
        standard_output::print_bytes(&printed)?;
    }
    let warning = match format {
        ExportFormat::Glb => open_at_box(&field, 0.0, &lattice),
        ExportFormat::Blob | ExportFormat::C | ExportFormat::Rust if !has_lost_surface => rounds_in_f32(&lattice),
        _ => has_lost_surface.then(|| {
            format!(
                "{}: the shape is thinner than these cells, use a larger --res",
                empty_between(lattice.nodes(), 0.0)
            )
        }),
    };
    if let Some(warning) = &warning {
        warn(&format!("{}: {warning}", mesh_input::shown(&args.sdf)));
    }
    let bytes: Vec<u64> = files.iter().map(|file| std::fs::metadata(file).map_or(0, |file| file.len())).collect();
    let row = |(file, bytes): (&PathBuf, &u64)| ("file", format!("{}, {bytes} bytes", file.display()));
    let mut rows = vec![
        ("format", format.name().to_owned()),
        ("nodes", format!("{}, spacing {}", counts(lattice.nodes()), number(lattice.spacing()))),
    ];
    rows.extend(band.map(|band| ("band", format!("{}, {} voxels", number(band), number(band / lattice.spacing())))));
    rows.extend(files.iter().zip(&bytes).map(row));
    let mut json = json!({
        "schema": "sdftool.export/1",
        "format": format.name(),
        "counts": lattice.nodes(),
        "origin": lattice.origin(),
        "spacing": lattice.spacing(),
        "files": files.iter().zip(&bytes).map(|(file, bytes)| json!({"path": file.display().to_string(), "bytes": bytes})).collect::<Vec<_>>(),
    });
    if let Some(band) = band {
        json["band"] = band.into();
    }
    if let Some(warning) = warning {
        json["warning"] = warning.into();
    }
    Report { rows, json }.print_beside(Some(&output), args.json)
}

/// Why firmware, which counts in f32, cannot tell places in this lattice apart: more than a hundredth of a voxel is rounded.
fn rounds_in_f32(lattice: &Lattice) -> Option<String> {
    let bounds = lattice.bounds();
    let largest = bounds.min.iter().chain(&bounds.max).fold(0.0_f64, |largest, x| largest.max(x.abs()));
    let rounded = 0.5 * f64::from(f32::EPSILON) * largest / lattice.spacing();
    let most = <f32 as Real>::MAX_COORDINATE;
    match () {
        () if largest > most => Some(format!(
            "firmware counts in f32 and answers to nothing beyond {most:e}: bake the mesh in a larger unit"
        )),
        () if rounded > 0.01 => Some(format!(
            "firmware counts in f32, in which coordinates here are off by up to {} voxels: bake the mesh nearer to the origin",
            number(rounded)
        )),
        () => None,
    }
}

fn format(args: &ExportArgs) -> Result<ExportFormat> {
    let by_ending = args.output.as_deref().and_then(ExportFormat::from_extension);
    let endings = || ExportFormat::ALL.map(|format| format!(".{}", format.extension())).join(", ");
    match args.format.or(by_ending) {
        Some(format) => Ok(format),
        None => misuse!("--output: use a name that ends in one of {}, or add --format", endings()),
    }
}

/// The file's name without .sdf.h5 or .sdf.toml.
pub fn stem(path: &Path) -> String {
    os_stem(path).to_string_lossy().into_owned()
}

/// As [`stem`], in the system's own characters.
fn os_stem(path: &Path) -> &OsStr {
    let stem = Path::new(path.file_stem().unwrap_or_default());
    let is_twofold = stem.extension().is_some_and(|extension| extension == "sdf");
    stem.file_stem().filter(|_| is_twofold).unwrap_or(stem.as_os_str())
}

/// The file's stem with another ending, in the current folder.
pub fn named_after(path: &Path, ending: &str) -> PathBuf {
    let mut name = os_stem(path).to_owned();
    name.push(".");
    name.push(ending);
    name.into()
}
