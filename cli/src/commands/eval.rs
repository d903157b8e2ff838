//! Distances and gradients at points, as CSV or JSON. Of a grid, only the blocks around the points are read.

use std::io::Write;

use anyhow::Result;
use sdf_core::{Aabb, Sample, Status};
use sdf_field::{Field, Threads};
use sdf_formats::field_file::OpenField;
use serde::{Serialize, Serializer};

use crate::args::EvalArgs;
use crate::failure::misuse;
use crate::mesh_input::{is_standard_input, require_end};
use crate::progress::on_threads;
use crate::read_summary::ReadSummary;
use crate::report::print_json;
use crate::standard_output::to_stdout;
use crate::{csv_points, field_input};

/// Points that are evaluated before they are written.
const BLOCK: usize = 1 << 16;

pub fn run(args: &EvalArgs) -> Result<()> {
    if is_standard_input(&args.sdf) && is_standard_input(&args.points) {
        misuse!("the field and the points cannot both be standard input: name a file for one");
    }
    let field = field_input::open(&args.sdf)?;
    require_end(&args.points)?;
    let points = csv_points::read(&args.points)?;
    match field {
        OpenField::Grid(reader) => {
            let file_bytes = reader.summary().file_bytes;
            let regions = points.iter().map(|point| Aabb { min: *point, max: *point });
            let stored = reader.read_needed(regions, f64::INFINITY)?;
            let summary = ReadSummary::new(&stored, file_bytes);
            print(args, stored.grid, &points, Some(summary))
        }
        OpenField::Blob(blob) => print(args, blob.grid, &points, None),
        OpenField::Analytic(field) => print(args, field, &points, None),
    }
}

fn print(args: &EvalArgs, field: impl Into<Field>, points: &[[f64; 3]], read: Option<ReadSummary>) -> Result<()> {
    let field = field.into();
    on_threads(args.threads, || print_samples(args, &field, points, read))?
}

fn print_samples(args: &EvalArgs, field: &Field, points: &[[f64; 3]], read: Option<ReadSummary>) -> Result<()> {
    if args.json.wanted {
        let read = serde_json::to_value(read)?;
        return print_json(&Document { read, samples: Samples { field, points }, schema: "sdftool.eval/1" });
    }
    to_stdout(|out| {
        writeln!(out, "x,y,z,distance,gx,gy,gz,status")?;
        for ([x, y, z], sample) in samples(field, points) {
            let [gx, gy, gz]: [f64; 3] = sample.gradient.into();
            // The shortest text that reads back as the same number.
            writeln!(out, "{x:?},{y:?},{z:?},{:?},{gx:?},{gy:?},{gz:?},{}", sample.value, name(&sample.status))?;
        }
        Ok(())
    })
}

/// Each point with its sample.
fn samples<'a>(field: &'a Field, points: &'a [[f64; 3]]) -> impl Iterator<Item = (&'a [f64; 3], Sample<f64>)> {
    points.chunks(BLOCK).flat_map(|block| block.iter().zip(field.sample(block, Threads::ALL)))
}

#[derive(Serialize)]
struct Document<'a> {
    read: serde_json::Value,
    samples: Samples<'a>,
    schema: &'static str,
}

/// Samples that are taken as they are written: there may be millions.
struct Samples<'a> {
    field: &'a Field,
    points: &'a [[f64; 3]],
}

#[derive(Serialize)]
struct SampleRecord {
    beyond_band: bool,
    degenerate_gradient: bool,
    distance: f64,
    gradient: [f64; 3],
    not_finite: bool,
    outside_grid: bool,
    point: [f64; 3],
}

impl Serialize for Samples<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(samples(self.field, self.points).map(|(point, Sample { value, gradient, status })| {
            SampleRecord {
                beyond_band: status.beyond_band,
                degenerate_gradient: status.degenerate_gradient,
                distance: value,
                gradient: gradient.into(),
                not_finite: status.not_finite,
                outside_grid: status.outside_grid,
                point: *point,
            }
        }))
    }
}

/// The worst of what is wrong with a sample: as in files of contacts, where one column has room for one word.
fn name(status: &Status<bool>) -> &'static str {
    match status {
        status if status.not_finite => "not_finite",
        status if status.degenerate_gradient => "degenerate_gradient",
        status if status.outside_grid => "outside_grid",
        status if status.beyond_band => "beyond_band",
        _ => "good",
    }
}
