//! `contacts A B` of two fields: reads what is needed of both files, and prints where they touch.
//!
//! The blocks at the faces of a grid's box are read first: they give its bounds. Then the blocks in the box in which
//! the fields may touch. The search is that of [`Field::overlap_in`].

use std::path::Path;
use std::time::Instant;

use anyhow::{Result, bail};
use sdf_core::Aabb;
use sdf_core::grid::Lattice;
use sdf_core::overlap::{DeepestPoint, LocalMinima, Patch};
use sdf_core::placed::{Placement, Rigid};
use sdf_field::{ContactOptions, Field, Overlap, OverlapError, OverlapOptions, OverlapVerdict};
use sdf_formats::contact_file::{OverlapKind, OverlapRecord, OverlapStatus};
use sdf_formats::field_file::OpenField;
use serde::Serialize;

use crate::args::ContactsArgs;
use crate::failure::misuse;
use crate::mesh_input::is_standard_input;
use crate::read_summary::{ReadSummary, require_distances};
use crate::report::{Report, line_of_json, number, point_at, seconds};
use crate::{field_input, output, standard_output};

/// Runs `contacts` on two fields.
pub fn run(args: &ContactsArgs) -> Result<()> {
    if let Some(path) = &args.output {
        output::ensure_writable(path, &[&args.mesh, &args.sdf])?;
        output::ensure_alone(path, args.json)?;
    }
    args.refuse_options_of_meshes()?;
    if is_standard_input(&args.sdf) {
        misuse!("two fields are read twice, and standard input once: name a file for each");
    }
    let started = Instant::now();
    let sides =
        [Side { path: &args.mesh, pose: args.first_pose()? }, Side { path: &args.sdf, pose: args.pose.rigid()? }];
    let options = OverlapOptions {
        poses: sides.each_ref().map(|side| Some(side.pose)),
        margin: args.margin,
        tolerance: args.tolerance.unwrap_or(OverlapOptions::default().tolerance),
        resolution: args.resolution,
        ..OverlapOptions::default()
    };
    let bodies = Bodies::read(&options, &sides)?;
    let read = started.elapsed().as_secs_f64();
    let found = match &bodies {
        None => Overlap::default(),
        Some(Bodies { fields: [a, b], region, .. }) => a.overlap_in(b, &options, region)?,
    };
    let meetings: Vec<OverlapRecord> =
        found.points.iter().map(OverlapRecord::from).chain(found.pieces.iter().map(OverlapRecord::from)).collect();
    let query = started.elapsed().as_secs_f64() - read;

    let document = Document {
        schema: "sdftool.overlap/1",
        verdict: verdict_name(found.verdict),
        margin: args.margin,
        deepest: found.deepest.as_ref().map(certificate),
        minima: found.minima.as_ref().map(minima_summary),
        patch: found.patch.as_ref().map(patch_summary),
        meetings: &meetings,
        beyond_band: meetings.iter().filter(|meeting| meeting.status == OverlapStatus::BeyondBand).count(),
        read: bodies.map_or([None, None], |bodies| bodies.read),
        seconds: Seconds { read, query },
    };
    if let Some(path) = &args.output {
        output::write_contacts(path, meetings.iter().cloned(), |out| line_of_json(&document, out))?;
    }
    Report { rows: rows(args, &document, found.verdict), json: document }
        .print_beside(args.output.as_deref(), args.json)
}

#[derive(Serialize)]
struct Document<'a> {
    schema: &'static str,
    verdict: &'static str,
    margin: f64,
    /// The minimum of max(φ_A, φ_B), and its lower bound.
    deepest: Option<Certificate>,
    minima: Option<MinimaSummary>,
    patch: Option<PatchSummary>,
    /// The deepest points first, then those of the patch.
    meetings: &'a [OverlapRecord],
    /// Number of the meetings whose distance is coarse, as it is beyond a sparse grid's band.
    beyond_band: usize,
    /// `None` for a closed form.
    read: [Option<ReadSummary>; 2],
    seconds: Seconds,
}

#[derive(Clone, Copy, Serialize)]
struct Certificate {
    value: Option<f64>,
    lower_bound: f64,
    converged: bool,
    evaluations: u32,
}

#[derive(Clone, Copy, Serialize)]
struct MinimaSummary {
    count: usize,
    barrier: f64,
    complete: bool,
    evaluations: u32,
}

#[derive(Clone, Copy, Serialize)]
struct PatchSummary {
    area: f64,
    points: u32,
    resolution: f64,
    /// Number of cubes that hold the whole patch, and the box around them.
    leaves: u32,
    bounds: Option<[[f64; 3]; 2]>,
    unknown: u32,
    complete: bool,
    evaluations: u32,
}

#[derive(Serialize)]
struct Seconds {
    read: f64,
    query: f64,
}

/// The file of the first or second argument, and where it stands.
struct Side<'a> {
    path: &'a Path,
    pose: Rigid,
}

impl Side<'_> {
    /// The field, and what of its file was read: of a grid the blocks in a box of the world, or without one only those
    /// that tell its bounds.
    fn field(&self, margin: f64, region: Option<Aabb>) -> Result<(Field, Option<ReadSummary>)> {
        match field_input::open(self.path)? {
            OpenField::Blob(blob) => Ok((field_input::from_blob(self.path, blob, margin)?, None)),
            OpenField::Analytic(field) => {
                let options = ContactOptions { margin, ..ContactOptions::default() };
                Ok((field_input::from_shapes(self.path, field, &options)?, None))
            }
            OpenField::Grid(reader) => {
                let summary = reader.summary();
                require_distances(self.path, margin, &summary)?;
                let stored = match region {
                    // Where the inside reaches a face of the box, the field is negative beyond it.
                    None => reader.read_needed(faces(&summary.lattice), 0.0)?,
                    Some(world) => reader.read_needed([self.pose.pull_bounds(world)], f64::INFINITY)?,
                };
                let read_summary = ReadSummary::new(&stored, summary.file_bytes);
                Ok((Field::from_stored(stored), Some(read_summary)))
            }
        }
    }
}

/// The faces of a grid's box, in squares of a few cells.
fn faces(lattice: &Lattice) -> Vec<Aabb> {
    const CELLS: usize = 8;
    let mut squares = vec![];
    let last = lattice.cells();
    for (axis, beside, above) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        for at in [0, last[axis]] {
            for i in (0..last[beside]).step_by(CELLS) {
                for j in (0..last[above]).step_by(CELLS) {
                    let node = |cells: u32| {
                        let mut node = [at; 3];
                        (node[beside], node[above]) = ((i + cells).min(last[beside]), (j + cells).min(last[above]));
                        lattice.node(node)
                    };
                    squares.push(Aabb { min: node(0), max: node(CELLS as u32) });
                }
            }
        }
    }
    squares
}

/// Two fields, read as far as they may touch.
struct Bodies {
    fields: [Field; 2],
    read: [Option<ReadSummary>; 2],
    region: Aabb,
}

impl Bodies {
    /// `None` if the fields are separated by bounds, without the samples in between.
    fn read(options: &OverlapOptions, sides: &[Side; 2]) -> Result<Option<Self>> {
        let margin = options.margin;
        let [(a, read_a), (b, read_b)] = [sides[0].field(margin, None)?, sides[1].field(margin, None)?];
        let names = format!("{} and {}", sides[0].path.display(), sides[1].path.display());
        let is_whole = [read_a.is_none(), read_b.is_none()];
        let region = match a.overlap_region(&b, options, is_whole) {
            Ok(Some(region)) => region,
            Ok(None) => return Ok(None),
            Err(error @ OverlapError::TooFine) => {
                bail!("{names}: --resolution {}: {error}", options.resolution.map_or_else(String::new, number))
            }
            Err(error) => bail!("{names}: {error}"),
        };
        let [(a, read_a), (b, read_b)] = [sides[0].field(margin, Some(region))?, sides[1].field(margin, Some(region))?];
        Ok(Some(Self { fields: [a, b], read: [read_a, read_b], region }))
    }
}

fn verdict_name(verdict: OverlapVerdict) -> &'static str {
    match verdict {
        OverlapVerdict::Contact => "contact",
        OverlapVerdict::Separated => "apart",
        OverlapVerdict::Undecided => "undecided",
    }
}

fn certificate(deepest: &DeepestPoint<f64>) -> Certificate {
    let DeepestPoint { point, lower_bound, converged, evaluations } = *deepest;
    Certificate { value: point.map(|at| at.value), lower_bound, converged, evaluations }
}

fn minima_summary(minima: &LocalMinima) -> MinimaSummary {
    let LocalMinima { count, barrier, evaluations, is_complete, .. } = *minima;
    MinimaSummary { count, barrier, complete: is_complete, evaluations }
}

fn patch_summary(patch: &Patch<f64>) -> PatchSummary {
    let Patch { point_count, area, resolution, leaf_count, bounds, undefined_count, evaluations, is_complete } = *patch;
    PatchSummary {
        area,
        points: point_count,
        resolution,
        leaves: leaf_count,
        bounds: bounds.map(|bounds| [bounds.min, bounds.max]),
        unknown: undefined_count,
        complete: is_complete,
        evaluations,
    }
}

fn rows(args: &ContactsArgs, document: &Document, verdict: OverlapVerdict) -> Vec<(&'static str, String)> {
    let words = match verdict {
        OverlapVerdict::Contact => "contact",
        OverlapVerdict::Separated => "apart for certain: no point is within the margin of both",
        OverlapVerdict::Undecided => "undecided: no point within the margin of both was found, and one may be there",
    };
    // A search that spent its evaluations ends no nearer to the minimum with a smaller tolerance.
    let is_open = verdict == OverlapVerdict::Undecided && document.deepest.is_some_and(|deepest| deepest.converged);
    let advice = if is_open { "; give a smaller --tolerance" } else { "" };
    let mut rows = vec![("verdict", format!("{words}{advice}"))];
    if let Some(first) = document.meetings.first() {
        let point = point_at(first.point, first.distance);
        rows.push(("deepest", format!("{} at {point}", number(first.distance))));
        rows.push(("separation", number(first.separation)));
    }
    if let Some(certificate) = &document.deepest {
        let proven = if certificate.converged { "" } else { ", short of the tolerance" };
        rows.push(("nothing below", format!("{}{proven}", number(certificate.lower_bound))));
    }
    if let Some(minima) = &document.minima {
        let shown = document.meetings.iter().filter(|meeting| meeting.kind == OverlapKind::Deepest).count();
        let rest = if shown < minima.count { format!(", the deepest {shown} reported") } else { String::new() };
        rows.push(("deepest points", format!("{}{rest}{}", minima.count, cut_short(minima.complete))));
    }
    if let Some(patch) = &document.patch {
        let pieces =
            format!("{} in {} pieces of at most {}", number(patch.area), patch.points, number(patch.resolution));
        rows.push(("patch area", pieces + cut_short(patch.complete)));
        if patch.unknown > 0 {
            rows.push((
                "no surface",
                format!("in {} cubes the fields have no number, or the same slope", patch.unknown),
            ));
        }
    }
    if document.beyond_band > 0 {
        let count = format!("{} of {} points", document.beyond_band, document.meetings.len());
        let advice = "there a sparse grid has coarse distances, less than the depth; bake with a larger --band, or --layout dense";
        rows.push(("beyond the band", format!("{count}: {advice}")));
    }
    rows.push((
        "time",
        format!("{} to read, {} to find", seconds(document.seconds.read), seconds(document.seconds.query)),
    ));
    for (name, read) in ["read of first", "read of second"].into_iter().zip(&document.read) {
        rows.extend(read.map(|read| (name, read.in_words())));
    }
    rows.extend(args.output.as_ref().map(|path| ("file", standard_output::shown(path))));
    rows
}

fn cut_short(complete: bool) -> &'static str {
    if complete { "" } else { ", and maybe more: take a larger --resolution" }
}
