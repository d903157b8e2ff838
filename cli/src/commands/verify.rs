use std::time::Instant;

use anyhow::{Result, bail};
use rayon::prelude::*;
use sdf_bake::{MeshDistance, TriangleMesh};
use sdf_core::grid::owned::OwnedGrid;
use sdf_core::grid::sparse::BRICK;
use sdf_core::grid::{Lattice, Storage};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, EnclosedSdf};
use sdf_formats::field_file::{self, Field, OpenField};
use sdf_formats::grid_file::StoredGrid;
use sdf_procedural::random::unit_at;
use serde::Serialize;

use crate::args::VerifyArgs;
use crate::histogram::Histogram;
use crate::mesh_input::{self, at};
use crate::read_summary::bytes_of;
use crate::report::{Report, number, seconds};
use crate::{output, progress};

/// A node is right when it is off by no more than this share of the mesh's diagonal, and what its precision cannot hold.
const NODE_TOLERANCE: f64 = 1e-6;

pub fn run(args: &VerifyArgs) -> Result<()> {
    let started = Instant::now();
    if let Some(path) = &args.histogram {
        output::require(path, &[&args.sdf, &args.mesh])?;
    }
    let input = mesh_input::read(&args.mesh)?;
    input.mesh.require_triangles(&args.mesh.display().to_string())?;
    let mesh = at(&args.mesh, TriangleMesh::new(&input.mesh.points, &input.mesh.triangles))?;
    let (field, parts) = match field_file::open(&args.sdf)? {
        OpenField::Grid(reader) => {
            let parts = bytes_of(&reader.summary().parts);
            (Field::Grid(reader.read()?), Some(parts))
        }
        OpenField::Analytic(node) => (Field::Analytic(node), None),
    };
    // As it was baked: without faces that lie inside of the solid.
    let keeps_all = matches!(&field, Field::Grid(stored) if stored.about.options.contains("--inner-faces keep"));
    let mesh = if keeps_all { mesh } else { mesh.without_inner_shells() };
    let surface = Surface::new(&mesh);
    let (findings, errors) = progress::on_threads(args.threads, || {
        // By winding numbers, asked at every point: so a file signed by pseudo-normals is judged by another method, and
        // one signed by winding numbers by what its signs were spread from. The distances come from the baker's own tree;
        // what judges that are the brute force and parry3d of bake's tests.
        let truth = MeshDistance::new(&mesh, Some(sdf_bake::SignMethod::Winding));
        match &field {
            Field::Grid(stored) => of_grid(args, stored, &truth, &surface),
            Field::Analytic(node) => {
                let bounds = mesh.bounds().inflate(0.1 * mesh.bounds().diagonal());
                let asked = ask(args, node, &truth, |number| in_box(args.seed, number, &bounds));
                (Findings::of_points(Errors::new(&asked, 0.0, None)), asked)
            }
        }
    })?;
    let diagonal = mesh.bounds().diagonal();
    let (same_mesh, spacing) = match &field {
        Field::Grid(stored) => {
            let same = stored.about.source.sha256 == input.facts.sha256;
            (Some(same), Some(stored.grid.lattice().spacing()))
        }
        Field::Analytic(_) => (None, None),
    };
    let faults = faults(&findings, diagonal);
    if let Some(path) = &args.histogram {
        let (unit, length) = spacing.map_or(("of the diagonal", diagonal), |spacing| ("in voxels", spacing));
        let errors: Vec<f64> = errors.iter().map(|asked| asked.error() / length).collect();
        let title = format!("{} against {}", args.sdf.display(), args.mesh.display());
        Histogram { title, unit, errors: &errors, bound: findings.bound.map(|bound| bound / length) }.write(path)?;
    }
    let elapsed = started.elapsed().as_secs_f64();
    print(args, &findings, Context { diagonal, spacing, same_mesh, parts, faults: &faults, elapsed })?;
    if !faults.is_empty() {
        bail!("{} does not match {}: {}", args.sdf.display(), args.mesh.display(), faults.join("; "));
    }
    Ok(())
}

#[derive(Serialize)]
struct Findings {
    /// Of a grid alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    nodes: Option<Errors>,
    points: Errors,
    /// Of a sparse grid, beyond its band.
    #[serde(skip_serializing_if = "Option::is_none")]
    far: Option<Far>,
    /// Points of the surface, and those of them in a cell with a corner in no brick.
    #[serde(skip_serializing_if = "Option::is_none")]
    surface_points: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    missing_cells: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    slope: Option<Slope>,
    #[serde(skip)]
    bound: Option<f64>,
    /// Points that are off by more than their own brick certifies.
    #[serde(skip_serializing_if = "Option::is_none")]
    beyond_their_brick: Option<usize>,
}

impl Findings {
    fn of_points(points: Errors) -> Self {
        Self {
            nodes: None,
            points,
            far: None,
            surface_points: None,
            missing_cells: None,
            slope: None,
            bound: None,
            beyond_their_brick: None,
        }
    }
}

/// What a sparse grid says where it has no distances.
#[derive(Serialize)]
struct Far {
    asked: usize,
    /// The most by which it is less than the distance in size.
    falls_short: f64,
    /// The most by which it is more than the distance in size.
    over: f64,
    /// The same outside, where it is a lower bound.
    #[serde(skip)]
    over_outside: f64,
    wrong_signs: usize,
}

/// The steepest gradient at any point, and the most that the file allows.
#[derive(Serialize)]
struct Slope {
    steepest: f64,
    bound: f64,
}

/// How far from the truth, over all that was asked.
#[derive(Serialize)]
struct Errors {
    asked: usize,
    mean: f64,
    p95: f64,
    p99_9: f64,
    max: f64,
    /// The same in voxels.
    #[serde(skip_serializing_if = "Option::is_none")]
    voxels: Option<[f64; 4]>,
    /// The most that is left of an error when what the precision rounds is taken from it.
    #[serde(skip)]
    beyond_rounding: f64,
    /// Points where the sign is wrong and the true distance is more than the certified bound.
    wrong_signs: usize,
}

/// An answer and the truth at a point.
struct Asked {
    point: [f64; 3],
    answer: f64,
    slope: f64,
    truth: f64,
    /// What storing the answer may have taken from it.
    rounding: f64,
}

impl Asked {
    fn error(&self) -> f64 {
        (self.answer - self.truth).abs()
    }

    fn has_wrong_sign(&self, tolerance: f64) -> bool {
        (self.answer < 0.0) != (self.truth < 0.0) && self.truth.abs() > tolerance
    }
}

impl Errors {
    fn new(asked: &[Asked], sign_tolerance: f64, spacing: Option<f64>) -> Self {
        let mut errors: Vec<f64> = asked.iter().map(Asked::error).collect();
        errors.sort_unstable_by(f64::total_cmp);
        let last = errors.len().saturating_sub(1);
        let share = |share: f64| errors.get((last as f64 * share) as usize).copied().unwrap_or(0.0);
        let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
        let [p95, p99_9, max] = [0.95, 0.999, 1.0].map(share);
        Self {
            asked: errors.len(),
            mean,
            p95,
            p99_9,
            max,
            voxels: spacing.map(|spacing| [mean, p95, p99_9, max].map(|error| error / spacing)),
            beyond_rounding: asked.iter().map(|asked| asked.error() - asked.rounding).fold(0.0, f64::max),
            wrong_signs: asked.iter().filter(|asked| asked.has_wrong_sign(sign_tolerance)).count(),
        }
    }
}

fn of_grid(args: &VerifyArgs, stored: &StoredGrid, truth: &MeshDistance, surface: &Surface) -> (Findings, Vec<Asked>) {
    let StoredGrid { grid, sparse, about, .. } = stored;
    let lattice = grid.lattice();
    let (bounds, spacing) = (lattice.bounds(), lattice.spacing());
    let bound = about.error_bound;
    let everywhere = |seed: u64| move |number: u64| in_box(seed, number, &bounds);
    let (asked, far, missing, beyond) = match sparse.map(|sparse| sparse.band) {
        Some(band) => {
            let brick_errors = grid.storage().brick_errors();
            let near = |number: u64| {
                let offset: [f64; 3] =
                    std::array::from_fn(|axis| 2.0 * unit_at(!args.seed, 8 * number + 3 + axis as u64) - 1.0);
                let point = surface.point(!args.seed, 8 * number);
                std::array::from_fn(|axis| point[axis] + band * offset[axis])
            };
            let holds = |point: [f64; 3]| bounds.encloses(&Aabb { min: point, max: point });
            let mut asked = ask(args, grid, truth, near);
            asked.retain(|asked| asked.truth.abs() <= band && holds(asked.point));
            let mut far = ask(args, grid, truth, everywhere(args.seed));
            far.retain(|asked| asked.truth.abs() > band);
            let own = |point: [f64; 3]| grid.storage().brick_at(cell_at(lattice, point).map(|n| n / BRICK));
            let is_beyond =
                |asked: &&Asked| own(asked.point).is_none_or(|brick| asked.error() > f64::from(brick_errors[brick]));
            let is_whole = |point: [f64; 3]| {
                let cell = cell_at(lattice, point);
                let corner = |corner: u32| std::array::from_fn(|axis| (cell[axis] + (corner >> axis & 1)) / BRICK);
                (0..8).all(|index| grid.storage().brick_at(corner(index)).is_some())
            };
            let on_surface =
                (0..u64::from(args.points)).into_par_iter().map(|number| surface.point(args.seed, 8 * number));
            let missing = on_surface.filter(|point| !is_whole(*point)).count();
            let missing_near = asked.iter().filter(|asked| !is_whole(asked.point)).count();
            let beyond = asked.iter().filter(is_beyond).count();
            (asked, Some(Far::new(&far, bound)), Some(missing + missing_near), Some(beyond))
        }
        None => (ask(args, grid, truth, everywhere(!args.seed)), None, None, None),
    };
    let steepest = asked.iter().map(|asked| asked.slope).fold(0.0, f64::max);
    let findings = Findings {
        nodes: Some(nodes(args, grid, sparse.map(|sparse| sparse.band), truth)),
        points: Errors::new(&asked, bound, Some(spacing)),
        far,
        surface_points: missing.map(|_| args.points as usize),
        missing_cells: missing,
        slope: Some(Slope { steepest, bound: about.slope_bound }),
        bound: Some(bound),
        beyond_their_brick: beyond,
    };
    (findings, asked)
}

impl Far {
    fn new(asked: &[Asked], error_bound: f64) -> Self {
        let over = |asked: &Asked| asked.answer.abs() - asked.truth.abs();
        Self {
            asked: asked.len(),
            falls_short: asked.iter().map(|asked| -over(asked)).fold(0.0, f64::max),
            over: asked.iter().map(over).fold(0.0, f64::max),
            over_outside: asked.iter().filter(|asked| asked.truth > 0.0).map(over).fold(0.0, f64::max),
            wrong_signs: asked.iter().filter(|asked| asked.has_wrong_sign(error_bound)).count(),
        }
    }
}

/// At as many points as were asked for.
fn ask<F: EnclosedSdf + Sync>(
    args: &VerifyArgs,
    field: &F,
    truth: &MeshDistance,
    point: impl Fn(u64) -> [f64; 3] + Sync,
) -> Vec<Asked> {
    let ask = |number: u64| {
        let point = point(number);
        let sample = field.sample(Vector3::from(point));
        let truth = truth.signed_distance(point);
        Asked { point, answer: sample.value, slope: sample.gradient.norm(), truth, rounding: 0.0 }
    };
    (0..u64::from(args.points)).into_par_iter().map(ask).collect()
}

/// Of a sparse grid those in bricks that have their own distance: within the band, and a cell's diagonal.
fn nodes(args: &VerifyArgs, grid: &OwnedGrid, band: Option<f64>, truth: &MeshDistance) -> Errors {
    let lattice = grid.lattice();
    let count = grid.storage().brick_count().map_or(lattice.node_count(), |bricks| bricks * NODES_OF_A_BRICK);
    let check = |index: usize| {
        let (node, step) = node(grid, index)?;
        let truth = truth.signed_distance(lattice.node(node));
        let is_exact = band.is_none_or(|band| truth.abs() <= band + 3.0_f64.sqrt() * lattice.spacing());
        let rounding = 0.5 * step + truth.abs() * f64::from(f32::EPSILON);
        let answer = stored_at(grid, node);
        is_exact.then_some(Asked { point: lattice.node(node), answer, slope: 0.0, truth, rounding })
    };
    let asked: Vec<Asked> = if args.all_nodes {
        (0..count).into_par_iter().filter_map(check).collect()
    } else {
        let draw = |number: u32| (unit_at(args.seed, u64::from(number)) * count as f64) as usize;
        (0..args.points).into_par_iter().map(draw).filter_map(check).collect()
    };
    // Nodes are exact: only where a distance is rounded to nothing may the sign be lost.
    let coarsest = grid.storage().scales().iter().map(|scale| f64::from(scale.step)).fold(0.0, f64::max);
    Errors::new(&asked, lattice.spacing() * 1e-6 + coarsest, Some(lattice.spacing()))
}

const NODES_OF_A_BRICK: usize = (BRICK * BRICK * BRICK) as usize;

/// The node that is meant by an index, and the step between the values that its sample can have. `None` of one in a brick
/// that reaches beyond the lattice.
fn node(grid: &OwnedGrid, index: usize) -> Option<([u32; 3], f64)> {
    let (lattice, storage) = (grid.lattice(), grid.storage());
    if storage.brick_count().is_none() {
        let [row, rows, _] = lattice.nodes().map(|n| n as usize);
        return Some(([index % row, index / row % rows, index / row / rows].map(|i| i as u32), 0.0));
    }
    let (brick, within) = (index / NODES_OF_A_BRICK, (index % NODES_OF_A_BRICK) as u32);
    let step = [within % BRICK, within / BRICK % BRICK, within / BRICK / BRICK];
    let node: [u32; 3] = std::array::from_fn(|axis| storage.slots()[brick][axis] * BRICK + step[axis]);
    let is_there = (0..3).all(|axis| node[axis] < lattice.nodes()[axis]);
    is_there.then_some((node, f64::from(storage.scales()[brick].step)))
}

fn stored_at(grid: &OwnedGrid, node: [u32; 3]) -> f64 {
    let cell = std::array::from_fn(|axis| node[axis].min(grid.lattice().cells()[axis] - 1));
    let corner = (0..3).fold(0, |corner, axis| corner | ((node[axis] - cell[axis]) as usize) << axis);
    f64::from(grid.storage().corners(cell)[corner])
}

/// The cell that a point of the box lies in.
fn cell_at(lattice: &Lattice, point: [f64; 3]) -> [u32; 3] {
    lattice.nodes_around(&Aabb { min: point, max: point }).map_or([0; 3], |[first, _]| first)
}

/// A mesh to draw points from, evenly by area.
struct Surface<'a> {
    mesh: &'a TriangleMesh,
    /// For each triangle the area of all up to it.
    areas: Vec<f64>,
}

impl<'a> Surface<'a> {
    fn new(mesh: &'a TriangleMesh) -> Self {
        let mut sum = 0.0;
        let area = |triangle: usize| {
            let [a, b, c] = mesh.corners(triangle).map(Vector3::from);
            sum += (b - a).cross(&(c - a)).norm();
            sum
        };
        Self { mesh, areas: (0..mesh.triangle_count()).map(area).collect() }
    }

    fn point(&self, seed: u64, number: u64) -> [f64; 3] {
        let share = unit_at(seed, number) * self.areas.last().copied().unwrap_or(0.0);
        let triangle = self.areas.partition_point(|area| *area <= share).min(self.areas.len() - 1);
        let [a, b, c] = self.mesh.corners(triangle).map(Vector3::from);
        let (u, v) = (unit_at(seed, number + 1), unit_at(seed, number + 2));
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        (a + (b - a) * u + (c - a) * v).into()
    }
}

fn in_box(seed: u64, number: u64, bounds: &Aabb) -> [f64; 3] {
    std::array::from_fn(|axis| {
        bounds.min[axis] + unit_at(seed, 3 * number + axis as u64) * (bounds.max[axis] - bounds.min[axis])
    })
}

fn faults(findings: &Findings, diagonal: f64) -> Vec<String> {
    let mut faults = Vec::new();
    if let Some(nodes) = &findings.nodes {
        if nodes.beyond_rounding > NODE_TOLERANCE * diagonal {
            faults.push(format!("a node is wrong by {}", number(nodes.max)));
        }
        if nodes.wrong_signs > 0 {
            faults.push(format!("{} nodes have the wrong sign", nodes.wrong_signs));
        }
    }
    let Some(bound) = findings.bound else { return faults };
    let points = &findings.points;
    if points.max > bound {
        faults.push(format!("a point is wrong by {}, more than the certified {}", number(points.max), number(bound)));
    }
    if points.wrong_signs > 0 {
        faults.push(format!("{} points have the wrong sign", points.wrong_signs));
    }
    if let Some(count) = findings.beyond_their_brick.filter(|count| *count > 0) {
        faults.push(format!("{count} points are wrong by more than their brick certifies"));
    }
    if let Some(far) = &findings.far {
        if far.over_outside > bound {
            let over = number(far.over_outside);
            faults.push(format!("a point beyond the band claims {over} more than its distance"));
        }
        if far.wrong_signs > 0 {
            faults.push(format!("{} points beyond the band have the wrong sign", far.wrong_signs));
        }
    }
    if let Some(count) = findings.missing_cells.filter(|count| *count > 0) {
        faults.push(format!("{count} cells of the band are missing"));
    }
    if let Some(slope) = findings.slope.as_ref().filter(|slope| slope.steepest > slope.bound * (1.0 + NODE_TOLERANCE)) {
        faults.push(format!(
            "a gradient is {}, more than the certified {}",
            number(slope.steepest),
            number(slope.bound)
        ));
    }
    faults
}

/// What else is told.
struct Context<'a> {
    diagonal: f64,
    spacing: Option<f64>,
    same_mesh: Option<bool>,
    parts: Option<serde_json::Map<String, serde_json::Value>>,
    faults: &'a [String],
    elapsed: f64,
}

fn print(args: &VerifyArgs, findings: &Findings, context: Context) -> Result<()> {
    let Context { diagonal, spacing, same_mesh, parts, faults, elapsed } = context;
    let length = |length: f64| match spacing {
        Some(spacing) => format!("{} ({:.3} voxels)", number(length), length / spacing),
        None => format!("{} ({:.2e} of the diagonal)", number(length), length / diagonal),
    };
    let row = |errors: &Errors| {
        let Errors { asked, mean, p95, p99_9, max, wrong_signs, .. } = errors;
        let [mean, p95, p99_9, max] = [mean, p95, p99_9, max].map(|error| length(*error));
        format!("{asked} asked: mean {mean}, 95 % {p95}, 99.9 % {p99_9}, max {max}, {wrong_signs} wrong signs")
    };
    let mut rows = Vec::new();
    if let Some(same) = same_mesh {
        let told = if same { "the very file that was baked" } else { "another file than was baked" };
        rows.push(("mesh", told.to_owned()));
    }
    if let Some(nodes) = &findings.nodes {
        rows.push(("nodes", row(nodes)));
    }
    rows.push((if findings.far.is_some() { "band" } else { "points" }, row(&findings.points)));
    if let Some(Far { asked, falls_short, over, wrong_signs, .. }) = &findings.far {
        let [falls_short, over] = [falls_short, over].map(|error| length(*error));
        rows.push((
            "beyond",
            format!(
                "{asked} asked: {falls_short} short of the distance at most, {over} over, {wrong_signs} wrong signs"
            ),
        ));
    }
    if let Some(bound) = findings.bound {
        rows.push(("certified", format!("at most {}", length(bound))));
    }
    if let (Some(points), Some(missing)) = (findings.surface_points, findings.missing_cells) {
        rows.push(("cells", format!("{missing} missing, at {points} points of the surface and those of the band")));
    }
    if let Some(Slope { steepest, bound }) = &findings.slope {
        rows.push(("slope", format!("{} at most, certified {}", number(*steepest), number(*bound))));
    }
    if let Some(parts) = &parts {
        let parts: Vec<String> = parts.iter().map(|(name, bytes)| format!("{name} {bytes}")).collect();
        rows.push(("bytes", parts.join(", ")));
    }
    if let Some(path) = &args.histogram {
        rows.push(("picture", path.display().to_string()));
    }
    rows.push(("time", seconds(elapsed)));
    let mut json = serde_json::json!({
        "schema": "sdftool.verify/1",
        "same_mesh": same_mesh,
        "diagonal": diagonal,
        "spacing": spacing,
        "error_bound": findings.bound,
        "bytes": parts,
        "faults": faults,
        "seconds": elapsed,
    });
    if let (Some(all), serde_json::Value::Object(found)) = (json.as_object_mut(), serde_json::to_value(findings)?) {
        all.extend(found);
    }
    Report { rows, json }.print(args.json)
}
