use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Result, bail};
use sdf_core::grid::Lattice;
use sdf_core::overlap::{BoxNode, DeepestPoint, DepthSearch, MortonLeaf, NoRegion, OverlapPoint, Pair, Patch};
use sdf_core::placed::{Placed, Placement, Rigid};
use sdf_core::{Aabb, AnyField, EnclosedSdf};
use sdf_formats::contact_file::{self, OverlapRecord};
use sdf_formats::field_file::{self, OpenField};
use serde::Serialize;

use crate::args::{ContactsArgs, rigid};
use crate::read_summary::{FromFile, require_distances};
use crate::report::{Report, line_of_json, number, seconds};
use crate::{mesh_input, output};

/// Where two fields touch.
pub fn run(args: &ContactsArgs) -> Result<()> {
    if let Some(path) = &args.output {
        output::require(path, &[&args.mesh, &args.sdf])?;
    }
    args.refuse_options_of_meshes()?;
    let started = Instant::now();
    let sides = [
        Side { path: &args.mesh, pose: rigid("--rotate-first", args.translate_first, args.rotate_first)? },
        Side { path: &args.sdf, pose: args.pose.rigid()? },
    ];
    let bodies = Bodies::read(args, &sides)?;
    let read = started.elapsed().as_secs_f64();
    let found = bodies.as_ref().map(|bodies| find(args, bodies)).transpose()?;
    let query = started.elapsed().as_secs_f64() - read;

    let found = found.unwrap_or_default();
    let document = Document {
        schema: "sdftool.overlap/1",
        verdict: found.verdict,
        margin: args.margin,
        deepest: found.certificate,
        minima: found.minima,
        patch: found.patch,
        meetings: &found.meetings,
        read: bodies.map_or([None, None], |bodies| bodies.read),
        seconds: Seconds { read, query },
    };
    if let (Some(path), Some(format)) = (&args.output, args.format()) {
        mesh_input::at(path, contact_file::write(path, format, &found.meetings, || line_of_json(&document)))?;
    }
    Report { rows: rows(args, &document), json: document }.print(args.json)
}

#[derive(Serialize)]
struct Document<'a> {
    schema: &'static str,
    verdict: Verdict,
    margin: f64,
    /// The least of max(φ_A, φ_B), and what is certain of it.
    deepest: Option<Certificate>,
    minima: Option<MinimaSummary>,
    patch: Option<PatchSummary>,
    /// The deepest points first, then those of the patch.
    meetings: &'a [OverlapRecord],
    /// Of grids alone.
    read: [Option<FromFile>; 2],
    seconds: Seconds,
}

#[derive(Clone, Copy, Default, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Verdict {
    /// There is a point that is within the margin of both.
    Contact,
    /// It is certain that there is none.
    #[default]
    #[serde(rename = "apart")]
    Separated,
    /// None was found, and one may be there.
    Undecided,
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
    /// All of the patch is in so many cubes, and in the box around them.
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

#[derive(Default)]
struct Found {
    verdict: Verdict,
    certificate: Option<Certificate>,
    minima: Option<MinimaSummary>,
    patch: Option<PatchSummary>,
    meetings: Vec<OverlapRecord>,
}

/// What is named as first or second argument.
struct Side<'a> {
    path: &'a Path,
    pose: Rigid,
}

impl Side<'_> {
    /// With no samples of a grid but those that tell its bounds; else what the samples in a box of the world answer.
    fn field(&self, margin: f64, region: Option<Aabb>) -> Result<(Placed<AnyField, Rigid>, Option<FromFile>)> {
        let place = |field| Placed { field, placement: self.pose };
        match field_file::open(self.path)? {
            OpenField::Analytic(node) => Ok((place(node), None)),
            OpenField::Grid(reader) => {
                let summary = reader.summary();
                require_distances(self.path, margin, &summary)?;
                let stored = match region {
                    // Where the inside reaches the box, the field is negative for as far beyond.
                    None => reader.read_needed(faces(&summary.lattice), 0.0)?,
                    Some(world) => reader.read_needed([self.pose.pull_bounds(world)], f64::INFINITY)?,
                };
                let from_file = FromFile::of(&stored, summary.file_bytes);
                Ok((place(AnyField::Grid(Arc::new(stored.grid))), Some(from_file)))
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

/// Two fields in the world, as much of them as they can touch in.
struct Bodies {
    fields: [Placed<AnyField, Rigid>; 2],
    read: [Option<FromFile>; 2],
    region: Aabb,
}

/// How many pieces the box in which two fields may touch is looked at in, along its longest side, before and after its
/// samples are read.
const PIECES: u32 = 64;

impl Bodies {
    /// `None` where the files say without a sample that there is nothing to read.
    fn read(args: &ContactsArgs, sides: &[Side; 2]) -> Result<Option<Self>> {
        let [(a, of_a), (b, of_b)] = [sides[0].field(args.margin, None)?, sides[1].field(args.margin, None)?];
        let is_whole = [of_a.is_none(), of_b.is_none()];
        let shrunk = Pair::new(&a, &b, args.margin).and_then(|pair| pair.shrink_evaluating(PIECES, is_whole));
        let region = match shrunk {
            Ok(pair) => pair.region(),
            Err(NoRegion::Separated) => return Ok(None),
            Err(NoRegion::Unbounded) => bail!(
                "{} and {}: the box in which they may touch has no end: intersect one with a box",
                sides[0].path.display(),
                sides[1].path.display()
            ),
        };
        let [(a, read_a), (b, read_b)] =
            [sides[0].field(args.margin, Some(region))?, sides[1].field(args.margin, Some(region))?];
        Ok(Some(Self { fields: [a, b], read: [read_a, read_b], region }))
    }
}

/// How often both fields are asked at most, in each of the three searches.
const EVALUATIONS: u32 = 1 << 24;

/// Boxes that wait in the search for the deepest point.
const WAITING: usize = 1 << 16;

/// Deepest points that are reported.
const MAX_MINIMA: usize = 256;

/// Of the longest side of the box in which the fields touch.
const LEAVES: f64 = 64.0;

fn find(args: &ContactsArgs, bodies: &Bodies) -> Result<Found> {
    let [a, b] = &bodies.fields;
    let pair = Pair::new(a, b, args.margin).and_then(|pair| pair.restrict(&bodies.region));
    let Ok(pair) = pair.and_then(|pair| pair.shrink::<f64>(PIECES)) else { return Ok(Found::default()) };
    let search = DepthSearch { evaluations: EVALUATIONS, tolerance: args.tolerance };
    let deepest = pair.deepest::<f64>(&search, &mut vec![BoxNode::EMPTY; WAITING]);
    let verdict = match deepest.point {
        Some(at) if at.value <= args.margin => Verdict::Contact,
        _ if args.margin < deepest.lower_bound => Verdict::Separated,
        _ => Verdict::Undecided,
    };
    let certificate = |value| {
        let DeepestPoint { lower_bound, converged, evaluations, .. } = deepest;
        Some(Certificate { value, lower_bound, converged, evaluations })
    };
    if verdict == Verdict::Separated {
        return Ok(Found { certificate: certificate(deepest.point.map(|at| at.value)), ..Found::default() });
    }
    let resolution = args.resolution.unwrap_or(pair.region().longest_side() / LEAVES);
    let (minima, mut points) = minima(&pair, resolution);
    put_first(&mut points, &deepest);
    let certificate = certificate(points.first().map(|at| at.value));
    let mut meetings: Vec<OverlapRecord> = points.iter().map(OverlapRecord::from).collect();
    let patch = pair.patch(resolution, EVALUATIONS, |piece| meetings.push(OverlapRecord::from(&piece)));
    Ok(Found { verdict, certificate, minima: Some(minima), patch: Some(summary(&patch)), meetings })
}

fn minima<A: EnclosedSdf, B: EnclosedSdf>(
    pair: &Pair<A, B>,
    resolution: f64,
) -> (MinimaSummary, Vec<OverlapPoint<f64>>) {
    let mut room = 1 << 16;
    loop {
        let mut found = vec![None; MAX_MINIMA];
        let minima = pair.minima(resolution, EVALUATIONS, &mut vec![MortonLeaf::empty(); room], &mut found);
        if minima.leaf_count <= room {
            let summary = MinimaSummary {
                count: minima.count,
                barrier: minima.barrier,
                complete: minima.is_complete,
                evaluations: minima.evaluations,
            };
            return (summary, found.into_iter().flatten().collect());
        }
        room = minima.leaf_count;
    }
}

/// The proven deepest point takes the place of the minimum that it is nearest to.
fn put_first(minima: &mut Vec<OverlapPoint<f64>>, deepest: &DeepestPoint<f64>) {
    let Some(at) = deepest.point else { return };
    let distance = |other: &OverlapPoint<f64>| (other.point - at.point).norm();
    let nearest = (0..minima.len()).min_by(|a, b| distance(&minima[*a]).total_cmp(&distance(&minima[*b])));
    match nearest {
        Some(nearest) if at.value <= minima[nearest].value => minima[nearest] = at,
        Some(_) => {}
        None => minima.push(at),
    }
    minima.sort_by(|a, b| a.value.total_cmp(&b.value));
}

fn summary(patch: &Patch<f64>) -> PatchSummary {
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

fn rows(args: &ContactsArgs, document: &Document) -> Vec<(&'static str, String)> {
    let verdict = match document.verdict {
        Verdict::Contact => "contact",
        Verdict::Separated => "apart for certain: no point is within the margin of both",
        Verdict::Undecided => "undecided: no point within the margin of both was found, and one may be there",
    };
    let mut rows = vec![("verdict", verdict.to_owned())];
    if let Some(first) = document.meetings.first() {
        let [x, y, z] = first.point.map(number);
        rows.push(("deepest", format!("{} at ({x}, {y}, {z})", number(first.distance))));
        rows.push(("separation", number(first.separation)));
    }
    if let Some(certificate) = &document.deepest {
        let proven = if certificate.converged { "" } else { ", short of the tolerance" };
        rows.push(("nothing below", format!("{}{proven}", number(certificate.lower_bound))));
    }
    if let Some(minima) = &document.minima {
        let shown = minima.count.min(MAX_MINIMA);
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
    rows.push((
        "time",
        format!("{} to read, {} to find", seconds(document.seconds.read), seconds(document.seconds.query)),
    ));
    for (name, read) in ["read of first", "read of second"].into_iter().zip(&document.read) {
        rows.extend(read.map(|read| (name, read.in_words())));
    }
    rows.extend(args.output.as_ref().map(|path| ("file", path.display().to_string())));
    rows
}

fn cut_short(complete: bool) -> &'static str {
    if complete { "" } else { ", and maybe more: take a larger --resolution" }
}
