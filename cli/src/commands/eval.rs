//! Distances and gradients at points, as CSV or JSON. Of a grid, only the blocks around the points are read.

use std::io::Write;

use anyhow::Result;
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, EnclosedSdf, Sample, Status};
use sdf_formats::field_file::OpenField;
use serde::{Serialize, Serializer};

use crate::args::EvalArgs;
use crate::failure::misuse;
use crate::mesh_input::{is_standard_input, require_end};
use crate::read_summary::ReadSummary;
use crate::report::print_json;
use crate::standard_output::to_stdout;
use crate::{csv_points, field_input};

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
            print(args, &stored.grid, &points, Some(ReadSummary::new(&stored, file_bytes)))
        }
        OpenField::Blob(blob) => print(args, &blob.grid, &points, None),
        OpenField::Analytic(node) => print(args, &node, &points, None),
    }
}

fn print<F: EnclosedSdf>(args: &EvalArgs, field: &F, points: &[[f64; 3]], read: Option<ReadSummary>) -> Result<()> {
    if args.json.wanted {
        let read = serde_json::to_value(read)?;
        return print_json(&Document { read, samples: Samples { field, points }, schema: "sdftool.eval/1" });
    }
    let samples = points.iter().map(|point| (point, field.sample(Vector3::from(*point))));
    to_stdout(|out| {
        writeln!(out, "x,y,z,distance,gx,gy,gz,status")?;
        for ([x, y, z], sample) in samples {
            let [gx, gy, gz]: [f64; 3] = sample.gradient.into();
            // The shortest text that reads back as the same number.
            writeln!(out, "{x:?},{y:?},{z:?},{:?},{gx:?},{gy:?},{gz:?},{}", sample.value, name(&sample.status))?;
        }
        Ok(())
    })
}

#[derive(Serialize)]
struct Document<S> {
    read: serde_json::Value,
    samples: S,
    schema: &'static str,
}

/// Samples that are taken as they are written: there may be millions.
struct Samples<'a, F> {
    field: &'a F,
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

impl<F: EnclosedSdf> Serialize for Samples<'_, F> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.points.iter().map(|point| {
            let Sample { value, gradient, status } = self.field.sample::<f64>(Vector3::from(*point));
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
