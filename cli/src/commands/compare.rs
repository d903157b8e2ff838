//! Which method suits this mesh and this field? Error against run time of all methods, as a table, JSON or a page.

mod page;

use std::time::Instant;

use anyhow::Result;
use sdf_core::Real;
use sdf_field::compare::{Comparison, MethodReport};
use sdf_field::{ContactOptions, Elements as FieldElements, Field, MeshView, Method, Threads};
use sdf_formats::field_file::OpenField;
use serde::Serialize;

use crate::args::{CompareArgs, Elements};
use crate::commands::contacts::skipped;
use crate::device::{Search, Searcher};
use crate::failure::misuse;
use crate::read_summary::require_distances;
use crate::report::{Report, number, seconds};
use crate::standard_output::to_stdout;
use crate::{field_input, mesh_input, output, progress};

pub fn run(args: &CompareArgs) -> Result<()> {
    if let Some(path) = &args.output {
        output::ensure_writable(path, &[&args.mesh, &args.sdf])?;
    }
    let searcher = Searcher::open(&args.device)?;
    let mesh = mesh_input::read_mesh(&args.mesh)?;
    mesh.require_triangles(&mesh_input::shown(&args.mesh))?;
    let options = options(args)?;
    let started = Instant::now();
    let comparison = progress::on_threads(args.threads, || {
        let field = read_field(args)?;
        let bar = progress::bar("comparing", Method::ALL.len() as u64 * u64::from(args.rounds));
        let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
        let search = Search { mesh: view, edges: None, options: &options };
        let comparison = searcher.compare(&field, search, args.rounds as usize, &|runs| bar.inc(runs as u64));
        bar.finish_and_clear();
        anyhow::Ok(comparison?)
    })??;
    if let Some(path) = &args.output {
        page::write(path, args, &comparison)?;
    }
    let elapsed = started.elapsed().as_secs_f64();
    if args.json.wanted {
        return Report { rows: vec![], json: Document::new(&comparison) }.print(args.json);
    }
    to_stdout(|out| {
        use std::io::Write;
        writeln!(
            out,
            "{} elements, {} contacts, {} of them proven",
            comparison.elements, comparison.contacts, comparison.proven
        )?;
        if comparison.not_finite > 0 {
            writeln!(out, "skipped: {}", skipped(comparison.not_finite, f64::MAX_COORDINATE))?;
        }
        for row in table(&comparison) {
            writeln!(out, "{row}")?;
        }
        writeln!(out, "{}", advice(&comparison))?;
        if let Some(path) = &args.output {
            writeln!(out, "page: {}", path.display())?;
        }
        writeln!(out, "time: {}", seconds(elapsed))
    })
}

fn read_field(args: &CompareArgs) -> Result<Field> {
    Ok(match field_input::open(&args.sdf)? {
        OpenField::Blob(blob) => field_input::from_blob(&args.sdf, blob, args.margin)?,
        OpenField::Analytic(field) => field_input::from_shapes(&args.sdf, field, &options(args)?)?,
        OpenField::Grid(reader) => {
            require_distances(&args.sdf, args.margin, &reader.summary())?;
            Field::from_stored(reader.read()?)
        }
    })
}

fn options(args: &CompareArgs) -> Result<ContactOptions> {
    Ok(ContactOptions {
        elements: match args.elements {
            Elements::Faces => FieldElements::Faces,
            Elements::Edges => FieldElements::Edges,
            Elements::Vertices => {
                misuse!("--elements vertices: every method is the same on vertices: use faces or edges")
            }
        },
        margin: args.margin,
        pose: args.pose.motion()?,
        tolerance: args.tolerance,
        lean: args.lean,
        threads: Threads::ALL,
        ..ContactOptions::default()
    })
}

#[derive(Serialize)]
struct Document {
    schema: &'static str,
    elements: usize,
    not_finite: usize,
    contacts: usize,
    proven: usize,
    recommended: String,
    methods: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    method: String,
    device: &'static str,
    seconds: f64,
    evaluations: u64,
    contacts: usize,
    missed: usize,
    error_95: f64,
    error_worst: f64,
}

impl Document {
    fn new(comparison: &Comparison) -> Self {
        let row = |(device, report): (&'static str, &MethodReport)| Row {
            method: report.method.to_string(),
            device,
            seconds: report.seconds,
            evaluations: report.evaluations,
            contacts: report.contacts,
            missed: report.missed,
            error_95: report.error_95,
            error_worst: report.error_worst,
        };
        Self {
            schema: "sdftool.compare/1",
            elements: comparison.elements,
            not_finite: comparison.not_finite,
            contacts: comparison.contacts,
            proven: comparison.proven,
            recommended: comparison.recommended.to_string(),
            methods: by_device(comparison).map(row).collect(),
        }
    }
}

/// The methods of the processor, then those of the card.
fn by_device(comparison: &Comparison) -> impl Iterator<Item = (&'static str, &MethodReport)> + Clone {
    let on_card = comparison.on_card.iter().map(|report| ("cuda", report));
    comparison.methods.iter().map(|report| ("cpu", report)).chain(on_card)
}

fn name(device: &str, report: &MethodReport) -> String {
    let method = report.method;
    if device == "cpu" { method.to_string() } else { format!("{method} on {device}") }
}

/// Names of the columns, then a line per method.
fn table(comparison: &Comparison) -> Vec<String> {
    let head = ["method", "time", "evaluations", "contacts", "missed", "error 95 %", "worst error"].map(str::to_owned);
    let row = |(device, report): (&str, &MethodReport)| {
        [
            name(device, report),
            seconds(report.seconds),
            report.evaluations.to_string(),
            report.contacts.to_string(),
            report.missed.to_string(),
            number(report.error_95),
            number(report.error_worst),
        ]
    };
    let rows: Vec<[String; 7]> = std::iter::once(head).chain(by_device(comparison).map(row)).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; 7] = std::array::from_fn(width);
    let line = |row: &[String; 7]| {
        let cells = row.iter().zip(widths).map(|(cell, width)| format!("{cell:>width$}"));
        cells.collect::<Vec<_>>().join("  ")
    };
    rows.iter().map(line).collect()
}

/// Recommends a method and gives the reason, in one sentence.
pub fn advice(comparison: &Comparison) -> String {
    let report = |method| comparison.methods.iter().find(|report| report.method == method);
    let recommended = comparison.recommended.to_string();
    let (Some(best), Some(auto)) = (report(comparison.recommended), report(Method::Auto)) else {
        return format!("recommended: {recommended}");
    };
    if comparison.contacts == 0 {
        return format!("recommended: {recommended}: there are no contacts here to compare the methods by");
    }
    if comparison.recommended == Method::Auto {
        return "recommended: auto: every method that is a quarter faster misses contacts or is off by more than the tolerance here"
            .to_owned();
    }
    let faster = auto.seconds / best.seconds;
    format!(
        "recommended: {recommended}: misses none of the {} contacts here, {faster:.1} times as fast as auto; only auto and \
         certified prove it, and another pose may differ",
        comparison.contacts
    )
}
