//! What the machine itself can do, on one thread, by loops that do nothing else.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

use anyhow::{Context, Result};
use pulp::{Arch, NullaryFnOnce};
use sdf_core::grid::{Dense, Grid, Lattice};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Lanes, Real, Sdf};

use super::row::Row;
use super::turns::{Done, Turns, Work};

/// Seconds that one of each takes.
pub struct Limits {
    copied_byte: f64,
    coherent_value: f64,
    point_triangle: f64,
}

impl Limits {
    /// A distance at a node takes at least one distance of a point from a triangle, and four bytes that are written.
    pub fn of_nodes(&self, nodes: f64) -> f64 {
        nodes * (self.point_triangle + 4.0 * self.copied_byte)
    }

    /// The field asked so often, neighbours one after another.
    pub fn of_values(&self, values: f64) -> f64 {
        values * self.coherent_value
    }

    pub fn of_copied(&self, bytes: f64) -> f64 {
        bytes * self.copied_byte
    }
}

const GROUP: &str = "limits";
const COPY: &str = "copy memory";
const TRIANGLES: &str = "point to triangle, side by side, f32";
const LANES: usize = 16;

/// Measures all, adds their rows, and keeps what rows of work are held against.
pub fn measure(quick: bool, turns: &mut Turns) -> Result<Limits> {
    let megabytes = if quick { 32 } else { 256 };
    let (from, mut to) = (vec![1_u8; megabytes << 20], vec![2_u8; megabytes << 20]);
    let copy = move || {
        to.copy_from_slice(&from);
        black_box(&mut to);
    };
    let touch = move || {
        black_box(vec![3_u8; megabytes << 20]);
    };
    let bytes = (megabytes << 20) as f64;
    turns.take(vec![one(COPY, bytes, "bytes", copy), one("write memory that is new", bytes, "bytes", touch)])?;

    let ball = Ball::new(if quick { 64 } else { 256 })?;
    let coherent = ball.points_along_surface();
    let random = ball.random_points(coherent.len());
    let asked = coherent.len() as f64;
    turns.take(vec![
        one("trilinear value, neighbours, f64", asked, "values", || ball.one_by_one::<f64>(&coherent)),
        one("trilinear value, neighbours, f32", asked, "values", || ball.one_by_one::<f32>(&coherent)),
        one("trilinear value, neighbours, 16 at a time, f32", asked, "values", || ball.side_by_side(&coherent)),
        one("trilinear value, anywhere, f32", asked, "values", || ball.one_by_one::<f32>(&random)),
        one("trilinear value, anywhere, 16 at a time, f32", asked, "values", || ball.side_by_side(&random)),
    ])?;

    let triangles = PreparedTriangles::new(1024);
    let distances = (triangles.all.len() * triangles.all.len()) as f64;
    turns.take(vec![one(TRIANGLES, distances, "distances", || triangles.all_distances())])?;

    let of_rows = |name: &str| {
        let rows = turns.rows.iter().filter(|row| row.group == GROUP && row.work.starts_with(name));
        rows.map(|row| row.least / row.units).fold(f64::INFINITY, f64::min)
    };
    Ok(Limits {
        copied_byte: of_rows(COPY),
        coherent_value: of_rows("trilinear value, neighbours"),
        point_triangle: of_rows(TRIANGLES),
    })
}

fn one<'a>(work: &str, units: f64, unit: &'static str, mut run: impl FnMut() + 'a) -> Work<'a> {
    let row = Row { group: GROUP, work: work.to_owned(), threads: 1, units, unit, ..Row::default() };
    let run = move || {
        let started = Instant::now();
        run();
        Ok(Done::in_seconds(started.elapsed().as_secs_f64()))
    };
    Work { row, size: 1.0, run: Box::new(run) }
}

/// A dense grid of a ball in the unit cube.
struct Ball {
    grid: Grid<Dense<Vec<f32>>>,
}

impl Ball {
    const RADIUS: f64 = 0.4;

    fn new(cells: u32) -> Result<Self> {
        let lattice =
            Lattice::new([-0.5; 3], 1.0 / f64::from(cells), [cells + 1; 3]).context("a lattice of the unit cube")?;
        let [x, y, z] = lattice.nodes();
        let nodes = (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k])));
        let distance = |node| (Vector3::from(lattice.node(node)).norm() - Self::RADIUS) as f32;
        let samples = Dense::new(&lattice, nodes.map(distance).collect()).context("samples of the unit cube")?;
        Ok(Self { grid: Grid::new(lattice, samples, 2.0).context("a grid of the unit cube")? })
    }

    /// In a spiral from pole to pole, less than a cell from one to the next.
    fn points_along_surface(&self) -> Vec<[f32; 3]> {
        let cells = f64::from(self.grid.lattice().cells()[0]);
        let turns = 1.6 * cells;
        let count = (TAU * turns * 0.8 * cells) as usize;
        let point = |index: usize| {
            let share = (index as f64 + 0.5) / count as f64;
            let z = 1.0 - 2.0 * share;
            let around = (1.0 - z * z).sqrt();
            let (sin, cos) = (TAU * turns * share).sin_cos();
            [around * cos, around * sin, z].map(|x| (Self::RADIUS * x) as f32)
        };
        (0..count).map(point).collect()
    }

    fn random_points(&self, count: usize) -> Vec<[f32; 3]> {
        let mut state = 1_u64;
        let mut coordinate = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (0.98 * ((state >> 40) as f32 / (1 << 24) as f32) - 0.49).clamp(-0.49, 0.49)
        };
        (0..count).map(|_| std::array::from_fn(|_| coordinate())).collect()
    }

    fn one_by_one<R: Real>(&self, points: &[[f32; 3]]) {
        let value = |sum: R, point: &[f32; 3]| {
            let point = Vector3::from(point.map(|x| R::from_f64(f64::from(x))));
            sum + self.grid.value(point)
        };
        black_box(points.iter().fold(R::zero(), value));
    }

    fn side_by_side(&self, points: &[[f32; 3]]) {
        black_box(Arch::new().dispatch(InLanes { ball: self, points }));
    }
}

struct InLanes<'a> {
    ball: &'a Ball,
    points: &'a [[f32; 3]],
}

impl NullaryFnOnce for InLanes<'_> {
    type Output = Lanes<f32, LANES>;
    #[inline(always)]
    fn call(self) -> Self::Output {
        let mut sum = Lanes([0.0; LANES]);
        for points in self.points.as_chunks::<LANES>().0 {
            let along = |axis: usize| Lanes(points.map(|point| point[axis]));
            sum += self.ball.grid.value(Vector3::new(along(0), along(1), along(2)));
        }
        sum
    }
}

/// Triangles with what a distance from them needs, the first corner at the origin of its numbers.
struct PreparedTriangles {
    all: Vec<Prepared>,
}

#[derive(Clone, Copy)]
struct Prepared {
    corners: [[f32; 3]; 3],
    /// From each corner to the next, over the square of its length where it divides.
    edges: [[f32; 3]; 3],
    inv_length_sq: [f32; 3],
    /// In the plane, inward from each edge.
    inward: [[f32; 3]; 3],
    /// Of length one.
    normal: [f32; 3],
}

impl PreparedTriangles {
    fn new(count: usize) -> Self {
        let prepared = |index: usize| {
            let turn = TAU * index as f64 / count as f64;
            let corner = |more: f64| {
                let (sin, cos) = (turn + more).sin_cos();
                Vector3::new(cos, sin, 0.3 * more.sin()).cast::<f32>()
            };
            Prepared::new([corner(0.0), corner(0.4), corner(1.7)])
        };
        Self { all: (0..count).map(prepared).collect() }
    }

    /// As many points as triangles, each against all.
    fn all_distances(&self) {
        let along = |axis: usize| (0..self.all.len()).map(|index| 0.001 * (index * (axis + 1)) as f32 - 0.5).collect();
        let points: [Vec<f32>; 3] = std::array::from_fn(along);
        let mut nearest = vec![f32::INFINITY; self.all.len()];
        Arch::new().dispatch(EachAgainstAll { triangles: &self.all, points: &points, nearest: &mut nearest });
        black_box(nearest);
    }
}

struct EachAgainstAll<'a> {
    triangles: &'a [Prepared],
    points: &'a [Vec<f32>; 3],
    nearest: &'a mut [f32],
}

impl NullaryFnOnce for EachAgainstAll<'_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        for triangle in self.triangles {
            triangle.nearer(self.points, self.nearest);
        }
    }
}

impl Prepared {
    fn new(corners: [Vector3<f32>; 3]) -> Self {
        let edges: [Vector3<f32>; 3] = std::array::from_fn(|i| corners[(i + 1) % 3] - corners[i]);
        let normal = edges[0].cross(&-edges[2]).normalize();
        Self {
            corners: corners.map(Into::into),
            edges: edges.map(Into::into),
            inv_length_sq: edges.map(|edge| 1.0 / edge.norm_squared()),
            inward: edges.map(|edge| normal.cross(&edge).into()),
            normal: normal.into(),
        }
    }

    /// Takes the squared distances of points, their coordinates each in a row, where they are less: from the plane where the
    /// point lies over the triangle, else from the nearest edge.
    #[inline(always)]
    fn nearer(&self, [xs, ys, zs]: &[Vec<f32>; 3], nearest: &mut [f32]) {
        for (((x, y), z), nearest) in xs.iter().zip(ys).zip(zs).zip(nearest) {
            let mut of_edges = f32::INFINITY;
            let mut innermost = f32::INFINITY;
            let mut height = 0.0;
            for side in 0..3 {
                let (corner, edge, inward) = (self.corners[side], self.edges[side], self.inward[side]);
                let from = [x - corner[0], y - corner[1], z - corner[2]];
                let share = least(greatest(dot(from, edge) * self.inv_length_sq[side], 0.0), 1.0);
                let off = [from[0] - edge[0] * share, from[1] - edge[1] * share, from[2] - edge[2] * share];
                of_edges = least(of_edges, dot(off, off));
                innermost = least(innermost, dot(from, inward));
                height = dot(from, self.normal);
            }
            let distance_sq = if innermost >= 0.0 { height * height } else { of_edges };
            *nearest = least(*nearest, distance_sq);
        }
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// One instruction each; f32's own also mind what is no number.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greatest(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The work that the limit counts is the work: a distance is the least over many points of the triangle.
    #[test]
    fn the_distance_from_a_triangle_is_the_least_over_its_points() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, 0.9, -0.2]].map(Vector3::<f32>::from);
        let points: [Vec<f32>; 3] = std::array::from_fn(|axis| {
            (0..100).map(|index| ((7 * index + 5 * axis) % 16) as f32 / 4.0 - 2.0).collect()
        });
        let mut nearest = vec![f32::INFINITY; 100];
        Prepared::new(corners).nearer(&points, &mut nearest);
        for (index, found) in nearest.into_iter().enumerate() {
            let point = Vector3::from_fn(|axis, _| points[axis][index]);
            let mut least = f32::INFINITY;
            for i in 0..=100_u8 {
                for j in 0..=100 - i {
                    let [u, v] = [i, j].map(|share| f32::from(share) / 100.0);
                    let on = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
                    least = least.min((point - on).norm_squared());
                }
            }
            assert!((found.sqrt() - least.sqrt()).abs() < 0.02, "{point}: {} and {}", found.sqrt(), least.sqrt());
            assert!(found <= least + 1e-5);
        }
    }
}
