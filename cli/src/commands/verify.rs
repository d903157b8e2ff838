use std::time::Instant;

use anyhow::{Result, bail};
use rayon::prelude::*;
use sdf_bake::{MeshDistance, TriangleMesh};
use sdf_core::Sdf;
use sdf_core::grid::Storage;
use sdf_core::nalgebra::Vector3;
use sdf_formats::field_file::{self, Field, OwnedGrid};
use serde::Serialize;

use crate::args::VerifyArgs;
use crate::mesh_input::{self, at};
use crate::progress;
use crate::report::{Report, number, seconds};

/// A node is right when it is off by no more than this share of the mesh's diagonal, and what f32 cannot hold of a node
/// far from the mesh.
const NODE_TOLERANCE: f64 = 1e-6;

pub fn run(args: &VerifyArgs) -> Result<()> {
    let started = Instant::now();
    let input = mesh_input::read(&args.mesh)?;
    input.mesh.require_triangles(&args.mesh.display().to_string())?;
    let mesh = at(&args.mesh, TriangleMesh::new(&input.mesh.points, &input.mesh.triangles))?;
    let field = field_file::read(&args.sdf)?;
    let findings = progress::on_threads(args.threads, || {
        // By winding numbers, asked at every point: so a file signed by pseudo-normals is judged by another method, and
        // one signed by winding numbers by what its signs were spread from. The distances come from the baker's own tree;
        // what judges that are the brute force and parry3d of bake's tests.
        let truth = MeshDistance::new(&mesh, Some(sdf_bake::SignMethod::Winding));
        match &field {
            Field::Grid { grid, about } => {
                let nodes = Some(nodes(args, grid, &truth));
                let points = points(args, grid, &truth, grid.lattice().bounds(), about.error_bound);
                Findings { nodes, points, bound: Some(about.error_bound) }
            }
            Field::Analytic(node) => {
                let bounds = mesh.bounds().inflate(0.1 * mesh.bounds().diagonal());
                Findings { nodes: None, points: points(args, node, &truth, bounds, 0.0), bound: None }
            }
        }
    })?;
    let diagonal = mesh.bounds().diagonal();
    let same_mesh = match &field {
        Field::Grid { about, .. } => Some(about.source.sha256 == input.sha256),
        Field::Analytic(_) => None,
    };
    let faults = faults(&findings, diagonal);
    print(args, &findings, diagonal, same_mesh, &faults, started.elapsed().as_secs_f64())?;
    if !faults.is_empty() {
        bail!("{} is not of {}: {}", args.sdf.display(), args.mesh.display(), faults.join("; "));
    }
    Ok(())
}

struct Findings {
    /// Of a grid alone.
    nodes: Option<Errors>,
    points: Errors,
    bound: Option<f64>,
}

/// How far from the truth, over all that was asked.
#[derive(Serialize)]
struct Errors {
    asked: usize,
    mean: f64,
    p95: f64,
    p99_9: f64,
    max: f64,
    /// What the largest of the true distances loses when it is rounded to a sample.
    #[serde(skip)]
    rounding: f64,
    /// Points where the sign is wrong and the true distance is more than the certified bound.
    wrong_signs: usize,
}

impl Errors {
    /// From pairs of an answer and the truth.
    fn new(pairs: Vec<[f64; 2]>, sign_tolerance: f64) -> Self {
        let is_wrong = |[answer, truth]: &[f64; 2]| (*answer < 0.0) != (*truth < 0.0) && truth.abs() > sign_tolerance;
        let wrong_signs = pairs.iter().filter(|pair| is_wrong(pair)).count();
        let largest = pairs.iter().fold(0.0_f64, |largest, [_, truth]| largest.max(truth.abs()));
        let mut errors: Vec<f64> = pairs.iter().map(|[answer, truth]| (answer - truth).abs()).collect();
        errors.sort_unstable_by(f64::total_cmp);
        let share = |share: f64| errors[((errors.len() - 1) as f64 * share) as usize];
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        Self {
            asked: errors.len(),
            mean,
            p95: share(0.95),
            p99_9: share(0.999),
            max: share(1.0),
            rounding: largest * f64::from(f32::EPSILON),
            wrong_signs,
        }
    }
}

fn nodes(args: &VerifyArgs, grid: &OwnedGrid, truth: &MeshDistance) -> Errors {
    let lattice = grid.lattice();
    let [row, rows, _] = lattice.nodes().map(|n| n as usize);
    let node = |index: usize| [index % row, index / row % rows, index / row / rows].map(|i| i as u32);
    let check = |index: usize| [stored(grid, node(index)), truth.signed_distance(lattice.node(node(index)))];
    let pairs = if args.all_nodes {
        (0..lattice.node_count()).into_par_iter().map(check).collect()
    } else {
        let draw = |number: u32| (random(args.seed, u64::from(number)) * lattice.node_count() as f64) as usize;
        (0..args.points).into_par_iter().map(draw).map(check).collect()
    };
    // Nodes are exact: only where f32 rounds a distance to nothing may the sign be lost.
    Errors::new(pairs, lattice.spacing() * 1e-6)
}

fn stored(grid: &OwnedGrid, node: [u32; 3]) -> f64 {
    let cell = std::array::from_fn(|axis| node[axis].min(grid.lattice().cells()[axis] - 1));
    let corner = (0..3).fold(0, |corner, axis| corner | ((node[axis] - cell[axis]) as usize) << axis);
    f64::from(grid.storage().corners(cell)[corner])
}

fn points<F: Sdf + Sync>(
    args: &VerifyArgs,
    field: &F,
    truth: &MeshDistance,
    bounds: sdf_core::Aabb,
    sign_tolerance: f64,
) -> Errors {
    let draw = |number: u32| {
        let share = |axis: u64| random(!args.seed, 3 * u64::from(number) + axis);
        let share = [share(0), share(1), share(2)];
        std::array::from_fn(|axis| bounds.min[axis] + share[axis] * (bounds.max[axis] - bounds.min[axis]))
    };
    let check = |point: [f64; 3]| [field.value(Vector3::from(point)), truth.signed_distance(point)];
    Errors::new((0..args.points).into_par_iter().map(draw).map(check).collect(), sign_tolerance)
}

/// The number of a sequence, in 0 to 1: any can be had without the others. (Steele et al. 2014, SplitMix64.)
fn random(seed: u64, number: u64) -> f64 {
    let mut bits = seed.wrapping_add(number.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    (bits ^ bits >> 31) as f64 / u64::MAX as f64 * (1.0 - f64::EPSILON)
}

fn faults(findings: &Findings, diagonal: f64) -> Vec<String> {
    let mut faults = Vec::new();
    if let Some(nodes) = &findings.nodes {
        if nodes.max > NODE_TOLERANCE * diagonal + nodes.rounding {
            faults.push(format!("a node is wrong by {}", number(nodes.max)));
        }
        if nodes.wrong_signs > 0 {
            faults.push(format!("{} nodes have the wrong sign", nodes.wrong_signs));
        }
    }
    if let Some(bound) = findings.bound {
        if findings.points.max > bound {
            faults.push(format!(
                "a point is wrong by {}, more than the certified {}",
                number(findings.points.max),
                number(bound)
            ));
        }
        if findings.points.wrong_signs > 0 {
            faults.push(format!("{} points have the wrong sign", findings.points.wrong_signs));
        }
    }
    faults
}

fn print(
    args: &VerifyArgs,
    findings: &Findings,
    diagonal: f64,
    same_mesh: Option<bool>,
    faults: &[String],
    elapsed: f64,
) -> Result<()> {
    let row = |errors: &Errors| {
        format!(
            "{} asked: mean {}, 95 % {}, 99.9 % {}, max {} ({:.2e} of the diagonal), {} wrong signs",
            errors.asked,
            number(errors.mean),
            number(errors.p95),
            number(errors.p99_9),
            number(errors.max),
            errors.max / diagonal,
            errors.wrong_signs,
        )
    };
    let mut rows = Vec::new();
    if let Some(same) = same_mesh {
        rows.push((
            "mesh",
            if same { "the very file that was baked" } else { "another file than was baked" }.to_owned(),
        ));
    }
    if let Some(nodes) = &findings.nodes {
        rows.push(("nodes", row(nodes)));
    }
    rows.push(("points", row(&findings.points)));
    if let Some(bound) = findings.bound {
        rows.push(("certified", format!("at most {} ({:.2e} of the diagonal)", number(bound), bound / diagonal)));
    }
    rows.push(("time", seconds(elapsed)));
    let json = serde_json::json!({
        "schema": "sdftool.verify/1",
        "same_mesh": same_mesh,
        "diagonal": diagonal,
        "nodes": findings.nodes,
        "points": findings.points,
        "error_bound": findings.bound,
        "faults": faults,
        "seconds": elapsed,
    });
    Report { rows, json }.print(args.json)
}
