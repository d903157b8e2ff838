//! Cloths that start intersecting a body: does a method push them out, or do they stay stuck?
//!
//! A flat square cloth starts through a closed body at one of several heights and tilts, with whole regions inside. In each of
//! [`ROUNDS`] rounds the method finds contacts. Each contact moves the corners of its face so that the contact point reaches the
//! surface (a projection with equal masses, averaged over a corner's contacts). Then every edge is pulled back to its length. Both
//! methods get the same rounds, projection and start. A cloth is freed if at the end a certified search finds no face deeper than
//! a hundredth of the body's size.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use parry3d::shape::TriMeshFlags;
use sdf_bake::{MeshDistance, TriangleMesh, dense, lattice_around};
use sdf_core::contact::{Element, Outcome, contact};
use sdf_core::grid::{BlockBounds, Dense, Grid, WithBlockBounds};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Sdf, Simplex};

use crate::pairs::{manifolds, trimesh};

type Field = Grid<WithBlockBounds<Dense<Vec<f32>>, Vec<BlockBounds>>>;

const ROUNDS: usize = 100;
/// Edges along the cloth's side.
const CELLS: usize = 24;
/// Largest depth of a freed cloth, in the body's size.
const MAX_DEPTH: f64 = 0.01;
const HEIGHTS: [f64; 7] = [0.9, 0.75, 0.6, 0.45, 0.3, 0.15, 0.0];
const TILTS: [f64; 3] = [0.0, 0.3, 0.7];

struct Body {
    name: &'static str,
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

struct Cloth {
    points: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// Two corners and their distance at rest.
    edges: Vec<([usize; 2], f64)>,
}

/// A point of a face, by its weights, and the offset that moves it to the surface.
struct Push {
    face: [u32; 3],
    weights: [f64; 3],
    offset: Vector3<f64>,
}

pub fn run(file: &Path) -> Result<()> {
    let mut table = "body,method,cloths,freed,deepest_left,deepest_left_median,ms_a_round\n".to_owned();
    for body in [ball(), torus()] {
        let field = bake(&body)?;
        let shape = trimesh(&body.points, &body.triangles, TriMeshFlags::FIX_INTERNAL_EDGES | TriMeshFlags::ORIENTED)?;
        let frank_wolfe = FrankWolfe::default();
        let mut from_field = |cloth: &Cloth| Ok(field_pushes(cloth, &field, &frank_wolfe));
        let mut from_pairs = |cloth: &Cloth| pair_pushes(cloth, &shape);
        let methods: [(&str, &mut dyn FnMut(&Cloth) -> Result<Vec<Push>>); 2] =
            [("signed distance field: Frank-Wolfe", &mut from_field), ("triangle pairs: parry3d", &mut from_pairs)];
        for (name, find) in methods {
            let mut depths = vec![];
            let started = Instant::now();
            for height in HEIGHTS {
                for tilt in TILTS {
                    let mut cloth = Cloth::through(height, tilt);
                    for _ in 0..ROUNDS {
                        let pushes = find(&cloth)?;
                        cloth.push(&pushes);
                        cloth.pull_edges();
                    }
                    depths.push(-deepest(&cloth, &field).min(0.0));
                }
            }
            let milliseconds = started.elapsed().as_secs_f64() * 1e3 / (depths.len() * ROUNDS) as f64;
            depths.sort_by(f64::total_cmp);
            let freed = depths.iter().filter(|depth| **depth <= MAX_DEPTH).count();
            let (worst, median) = (depths[depths.len() - 1], depths[depths.len() / 2]);
            writeln!(table, "{},{name},{},{freed},{worst:.4},{median:.4},{milliseconds:.3}", body.name, depths.len())?;
        }
    }
    print!("{table}");
    std::fs::write(file, table).with_context(|| file.display().to_string())
}

/// Surface of revolution about z, closed both ways.
fn revolved(name: &'static str, around: usize, along: usize, at: impl Fn(f64, f64) -> [f64; 3]) -> Body {
    let angle = |index: usize, count: usize| std::f64::consts::TAU * index as f64 / count as f64;
    let mut points = vec![];
    let mut triangles = vec![];
    for i in 0..around {
        for j in 0..along {
            points.push(at(angle(i, around), angle(j, along)));
            let corner = |di: usize, dj: usize| ((i + di) % around * along + (j + dj) % along) as u32;
            triangles.extend([[corner(0, 0), corner(1, 0), corner(1, 1)], [corner(0, 0), corner(1, 1), corner(0, 1)]]);
        }
    }
    Body { name, points, triangles }
}

fn torus() -> Body {
    revolved("torus", 64, 32, |u, v| {
        let radius = 0.65 + 0.35 * v.cos();
        [radius * u.cos(), radius * u.sin(), 0.35 * v.sin()]
    })
}

/// A unit sphere of rings between two poles.
fn ball() -> Body {
    let (around, along) = (48_u32, 24_u32);
    let mut points = vec![[0.0, 0.0, -1.0]];
    for ring in 1..along {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(along);
        for step in 0..around {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(step) / f64::from(around)).sin_cos();
            points.push([polar.sin() * cos, polar.sin() * sin, -polar.cos()]);
        }
    }
    points.push([0.0, 0.0, 1.0]);
    let last = points.len() as u32 - 1;
    let corner = |ring: u32, step: u32| 1 + ring * around + step % around;
    let mut triangles = vec![];
    for step in 0..around {
        triangles.push([0, corner(0, step + 1), corner(0, step)]);
        for ring in 0..along - 2 {
            let [a, b] = [corner(ring, step), corner(ring, step + 1)];
            let [c, d] = [corner(ring + 1, step + 1), corner(ring + 1, step)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        triangles.push([corner(along - 2, step), corner(along - 2, step + 1), last]);
    }
    Body { name: "ball", points, triangles }
}

fn bake(body: &Body) -> Result<Field> {
    let mesh = TriangleMesh::new(&body.points, &body.triangles)?;
    let distance = MeshDistance::new(&mesh, None);
    let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / 96.0, 8).context("a lattice")?;
    let baked = dense::bake(&distance, &lattice, &|_| ());
    let samples = Dense::new(&lattice, baked.distances).context("samples")?;
    let samples = WithBlockBounds::new(&lattice, samples, baked.bounds).context("bounds")?;
    Grid::new(lattice, samples, baked.slope_bound).context("a grid")
}

impl Cloth {
    /// A flat cloth as wide as the body, at a height, tilted about the x axis.
    fn through(height: f64, tilt: f64) -> Self {
        let mut points = vec![];
        for row in 0..=CELLS {
            for column in 0..=CELLS {
                // Shifted from the middle, so that nothing is symmetric.
                let [x, y] =
                    [(column, 0.031), (row, 0.017)].map(|(i, shift)| 2.4 * (i as f64 / CELLS as f64 - 0.5) + shift);
                points.push(Vector3::new(x, y * tilt.cos(), height + y * tilt.sin()));
            }
        }
        let corner = |row: usize, column: usize| (row * (CELLS + 1) + column) as u32;
        let mut triangles = vec![];
        for row in 0..CELLS {
            for column in 0..CELLS {
                let [a, b] = [corner(row, column), corner(row, column + 1)];
                let [c, d] = [corner(row + 1, column + 1), corner(row + 1, column)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        let mut ends: Vec<[usize; 2]> = triangles
            .iter()
            .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| [*a.min(b) as usize, *a.max(b) as usize])
            .collect();
        ends.sort_unstable();
        ends.dedup();
        let edges = ends.into_iter().map(|[a, b]| ([a, b], (points[a] - points[b]).norm())).collect();
        Self { points, triangles, edges }
    }

    fn corners(&self, face: [u32; 3]) -> [Vector3<f64>; 3] {
        face.map(|corner| self.points[corner as usize])
    }

    fn push(&mut self, pushes: &[Push]) {
        let mut moved = vec![(Vector3::zeros(), 0_u32); self.points.len()];
        for Push { face, weights, offset } in pushes {
            let norm_sq: f64 = weights.iter().map(|weight| weight * weight).sum();
            for (corner, weight) in face.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
                let (sum, count) = &mut moved[*corner as usize];
                *sum += offset * (weight / norm_sq);
                *count += 1;
            }
        }
        for (point, (sum, count)) in self.points.iter_mut().zip(moved) {
            *point += sum / f64::from(count.max(1));
        }
    }

    /// One pass of position based dynamics, edge after edge.
    fn pull_edges(&mut self) {
        for ([a, b], length) in &self.edges {
            let edge = self.points[*b] - self.points[*a];
            let stretched = edge.norm();
            if stretched > 0.0 {
                let correction = edge * (0.5 * (stretched - length) / stretched);
                self.points[*a] += correction;
                self.points[*b] -= correction;
            }
        }
    }
}

fn search<M: Minimizer<3>>(cloth: &Cloth, field: &Field, minimizer: &M, mut visit: impl FnMut(usize, Outcome<f64, 3>)) {
    for (id, vertices) in cloth.triangles.iter().enumerate() {
        let simplex = Simplex { corners: cloth.corners(*vertices) };
        visit(id, contact(field, minimizer, 0.0, &Element { id: id as u32, vertices: *vertices, simplex }));
    }
}

fn field_pushes(cloth: &Cloth, field: &Field, minimizer: &impl Minimizer<3>) -> Vec<Push> {
    let mut pushes = vec![];
    search(cloth, field, minimizer, |id, outcome| {
        if let Outcome::Contact(found) = outcome {
            let offset = found.normal * -found.distance;
            pushes.push(Push { face: cloth.triangles[id], weights: found.weights, offset });
        }
    });
    pushes
}

/// The lowest value on any face.
fn deepest(cloth: &Cloth, field: &Field) -> f64 {
    let search_all = Certified { evaluations: 1024, ..Certified::default() };
    let at_corners = cloth.points.iter().map(|point| field.sample(*point).value).fold(f64::INFINITY, f64::min);
    let mut deepest = at_corners;
    search(cloth, field, &search_all, |_, outcome| {
        if let Outcome::Contact(found) = outcome {
            deepest = deepest.min(found.distance);
        }
    });
    deepest
}

fn pair_pushes(cloth: &Cloth, body: &parry3d::shape::TriMesh) -> Result<Vec<Push>> {
    let points: Vec<[f64; 3]> = cloth.points.iter().map(|point| (*point).into()).collect();
    let shape = trimesh(&points, &cloth.triangles, TriMeshFlags::empty())?;
    let mut pushes = vec![];
    for manifold in manifolds(&shape, body, 0.0)? {
        let face = cloth.triangles[manifold.subshape1 as usize];
        // Points from the cloth to the body: the cloth moves back along it.
        let normal = Vector3::from(manifold.local_n1.to_array().map(f64::from));
        for point in manifold.points.iter().filter(|point| point.dist < 0.0) {
            let at = Vector3::from(point.local_p1.to_array().map(f64::from));
            let offset = normal * f64::from(point.dist);
            pushes.push(Push { face, weights: weights(cloth.corners(face), at), offset });
        }
    }
    Ok(pushes)
}

/// Barycentric weights of a point of a triangle's plane, clamped to the triangle.
fn weights([a, b, c]: [Vector3<f64>; 3], point: Vector3<f64>) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let (bb, bc, cc) = (ab.dot(&ab), ab.dot(&ac), ac.dot(&ac));
    let (pb, pc) = (ap.dot(&ab), ap.dot(&ac));
    let area = bb * cc - bc * bc;
    let [second, third] = [(cc * pb - bc * pc) / area, (bb * pc - bc * pb) / area].map(|x| x.clamp(0.0, 1.0));
    let first = (1.0 - second - third).max(0.0);
    let sum = first + second + third;
    [first / sum, second / sum, third / sum]
}
