//! Cloths that already pass through a body: does a method push them out, or do they stay stuck?
//!
//! A square cloth is laid flat through a closed body at one of several heights and turns, with whole regions of it inside. In
//! each of a fixed number of rounds the method finds contacts; each moves the corners of its face so that the point of
//! contact comes to lie on the surface (a projection with equal masses, averaged over a corner's contacts); then every edge is
//! pulled back to its length. Both methods get the same rounds, the same projection and the same start. Freed is a cloth
//! none of whose faces reaches more than a hundredth of the body's size into the body, by a certified search, at the end.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use parry3d::shape::TriMeshFlags;
use sdf_bake::{MeshDistance, TriangleMesh, dense, lattice_around};
use sdf_core::contact::{Element, Outcome, contact};
use sdf_core::grid::{WithBlockBounds, Dense, Grid, BlockBounds};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Sdf, Simplex};

use crate::pairs::{manifolds, trimesh};

type Field = Grid<WithBlockBounds<Dense<Vec<f32>>, Vec<BlockBounds>>>;

const ROUNDS: usize = 100;
/// Edges along the cloth's side.
const CELLS: usize = 24;
/// So deep a cloth may be left and counts as free, in the body's size.
const FREE: f64 = 0.01;
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
    /// Two corners, and how far apart they are at rest.
    edges: Vec<([usize; 2], f64)>,
}

/// A point of a face, by its weights, and the way that takes it to the surface.
struct Push {
    face: [u32; 3],
    weights: [f64; 3],
    way: Vector3<f64>,
}

pub fn run(file: &Path) -> Result<()> {
    let mut table = "body,method,cloths,freed,deepest_left,deepest_left_median,ms_a_round\n".to_owned();
    for body in [ball(), torus()] {
        let field = bake(&body)?;
        let shape = trimesh(&body.points, &body.triangles, TriMeshFlags::FIX_INTERNAL_EDGES | TriMeshFlags::ORIENTED)?;
        let frank_wolfe = FrankWolfe::default();
        let mut by_field = |cloth: &Cloth| Ok(pushes_of_field(cloth, &field, &frank_wolfe));
        let mut by_pairs = |cloth: &Cloth| pushes_of_pairs(cloth, &shape);
        let methods: [(&str, &mut dyn FnMut(&Cloth) -> Result<Vec<Push>>); 2] =
            [("signed distance field: Frank-Wolfe", &mut by_field), ("triangle pairs: parry3d", &mut by_pairs)];
        for (name, find) in methods {
            let mut left = vec![];
            let started = Instant::now();
            for height in HEIGHTS {
                for tilt in TILTS {
                    let mut cloth = Cloth::through(height, tilt);
                    for _ in 0..ROUNDS {
                        let pushes = find(&cloth)?;
                        cloth.push(&pushes);
                        cloth.pull_edges();
                    }
                    left.push(-deepest(&cloth, &field).min(0.0));
                }
            }
            let milliseconds = started.elapsed().as_secs_f64() * 1e3 / (left.len() * ROUNDS) as f64;
            left.sort_by(f64::total_cmp);
            let freed = left.iter().filter(|depth| **depth <= FREE).count();
            let (worst, median) = (left[left.len() - 1], left[left.len() / 2]);
            writeln!(table, "{},{name},{},{freed},{worst:.4},{median:.4},{milliseconds:.3}", body.name, left.len())?;
        }
    }
    print!("{table}");
    std::fs::write(file, table).with_context(|| file.display().to_string())
}

/// Rows of points turned around z.
fn turned(name: &'static str, around: usize, along: usize, at: impl Fn(f64, f64) -> [f64; 3]) -> Body {
    let angle = |index: usize, of: usize| std::f64::consts::TAU * index as f64 / of as f64;
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
    turned("torus", 64, 32, |u, v| {
        let radius = 0.65 + 0.35 * v.cos();
        [radius * u.cos(), radius * u.sin(), 0.35 * v.sin()]
    })
}

/// Of radius one, its points in rings between two poles.
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
    /// As wide as the body, flat at a height, tilted about the x axis.
    fn through(height: f64, tilt: f64) -> Self {
        let mut points = vec![];
        for row in 0..=CELLS {
            for column in 0..=CELLS {
                // Off the middle, so that nothing is symmetric.
                let [x, y] =
                    [(column, 0.031), (row, 0.017)].map(|(i, off)| 2.4 * (i as f64 / CELLS as f64 - 0.5) + off);
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
        for Push { face, weights, way } in pushes {
            let share: f64 = weights.iter().map(|weight| weight * weight).sum();
            for (corner, weight) in face.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
                let (sum, count) = &mut moved[*corner as usize];
                *sum += way * (weight / share);
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
            let between = self.points[*b] - self.points[*a];
            let stretched = between.norm();
            if stretched > 0.0 {
                let way = between * (0.5 * (stretched - length) / stretched);
                self.points[*a] += way;
                self.points[*b] -= way;
            }
        }
    }
}

fn search<M: Minimizer<3>>(cloth: &Cloth, field: &Field, minimizer: &M, mut take: impl FnMut(usize, Outcome<f64, 3>)) {
    for (id, vertices) in cloth.triangles.iter().enumerate() {
        let simplex = Simplex { corners: cloth.corners(*vertices) };
        take(id, contact(field, minimizer, 0.0, &Element { id: id as u32, vertices: *vertices, simplex }));
    }
}

fn pushes_of_field(cloth: &Cloth, field: &Field, minimizer: &impl Minimizer<3>) -> Vec<Push> {
    let mut pushes = vec![];
    search(cloth, field, minimizer, |id, outcome| {
        if let Outcome::Contact(found) = outcome {
            let way = found.normal * -found.distance;
            pushes.push(Push { face: cloth.triangles[id], weights: found.weights, way });
        }
    });
    pushes
}

/// The deepest value of any face.
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

fn pushes_of_pairs(cloth: &Cloth, body: &parry3d::shape::TriMesh) -> Result<Vec<Push>> {
    let points: Vec<[f64; 3]> = cloth.points.iter().map(|point| (*point).into()).collect();
    let shape = trimesh(&points, &cloth.triangles, TriMeshFlags::empty())?;
    let mut pushes = vec![];
    for manifold in manifolds(&shape, body, 0.0)? {
        let face = cloth.triangles[manifold.subshape1 as usize];
        // From the cloth towards the body: the cloth goes back along it.
        let normal = Vector3::from(manifold.local_n1.to_array().map(f64::from));
        for point in manifold.points.iter().filter(|point| point.dist < 0.0) {
            let at = Vector3::from(point.local_p1.to_array().map(f64::from));
            let way = normal * f64::from(point.dist);
            pushes.push(Push { face, weights: weights(cloth.corners(face), at), way });
        }
    }
    Ok(pushes)
}

/// Of a point of a triangle's plane, put into the triangle.
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
