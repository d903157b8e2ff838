//! Limits of the machine on one thread, measured by loops that do nothing else: copying memory, interpolating a grid,
//! distances of points from triangles.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

use anyhow::{Context, Result};
use pulp::{Arch, NullaryFnOnce};
use sdf_core::grid::{Dense, Grid, Lattice};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Lanes, Real, Sdf};
use sdf_procedural::random::Random;

use super::round_robin::{RoundRobin, RunResult, Work};
use super::row::Row;

/// Seconds per operation.
pub struct MachineLimits {
    copied_byte: f64,
    coherent_value: f64,
    point_triangle: f64,
}

impl MachineLimits {
    /// Least time for this number of nodes: one distance of a point from a triangle and four bytes written for each.
    pub fn bake_seconds(&self, nodes: f64) -> f64 {
        nodes * (self.point_triangle + 4.0 * self.copied_byte)
    }

    /// Least time for this number of evaluations, each near the one before.
    pub fn evaluation_seconds(&self, values: f64) -> f64 {
        values * self.coherent_value
    }

    pub fn copy_seconds(&self, bytes: f64) -> f64 {
        bytes * self.copied_byte
    }
}

const GROUP: &str = "limits";
const COPY: &str = "copy memory";
const TRIANGLES: &str = "point to triangle, side by side, f32";
const LANES: usize = 16;

/// Measures all limits and appends their rows.
pub fn measure(quick: bool, turns: &mut RoundRobin) -> Result<MachineLimits> {
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
    turns.measure(vec![work(COPY, bytes, "bytes", copy), work("write memory that is new", bytes, "bytes", touch)])?;

    let ball = Ball::new(if quick { 64 } else { 256 })?;
    let coherent = ball.points_along_surface();
    let random = ball.random_points(coherent.len());
    let evaluations = coherent.len() as f64;
    turns.measure(vec![
        work("trilinear value, neighbours, f64", evaluations, "values", || ball.sum_one_by_one::<f64>(&coherent)),
        work("trilinear value, neighbours, f32", evaluations, "values", || ball.sum_one_by_one::<f32>(&coherent)),
        work("trilinear value, neighbours, 16 at a time, f32", evaluations, "values", || ball.sum_in_lanes(&coherent)),
        work("trilinear value, anywhere, f32", evaluations, "values", || ball.sum_one_by_one::<f32>(&random)),
        work("trilinear value, anywhere, 16 at a time, f32", evaluations, "values", || ball.sum_in_lanes(&random)),
    ])?;

    let triangles = PreparedTriangles::new(1024);
    let distances = (triangles.all.len() * triangles.all.len()) as f64;
    turns.measure(vec![work(TRIANGLES, distances, "distances", || triangles.all_distances())])?;

    let seconds_per_unit = |name: &str| {
        let rows = turns.rows.iter().filter(|row| row.group == GROUP && row.work.starts_with(name));
        rows.map(|row| row.min_seconds / row.units).fold(f64::INFINITY, f64::min)
    };
    Ok(MachineLimits {
        copied_byte: seconds_per_unit(COPY),
        coherent_value: seconds_per_unit("trilinear value, neighbours"),
        point_triangle: seconds_per_unit(TRIANGLES),
    })
}

fn work<'a>(name: &str, units: f64, unit: &'static str, mut run: impl FnMut() + 'a) -> Work<'a> {
    let row = Row { group: GROUP, work: name.to_owned(), threads: 1, units, unit, ..Row::default() };
    let run = move || {
        let started = Instant::now();
        run();
        Ok(RunResult::timed(started.elapsed().as_secs_f64()))
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

    /// Points on a spiral from pole to pole, less than a cell apart.
    fn points_along_surface(&self) -> Vec<[f32; 3]> {
        let cells = f64::from(self.grid.lattice().cells()[0]);
        let turns = 1.6 * cells;
        let count = (TAU * turns * 0.8 * cells) as usize;
        let point = |index: usize| {
            let t = (index as f64 + 0.5) / count as f64;
            let z = 1.0 - 2.0 * t;
            let around = (1.0 - z * z).sqrt();
            let (sin, cos) = (TAU * turns * t).sin_cos();
            [around * cos, around * sin, z].map(|x| (Self::RADIUS * x) as f32)
        };
        (0..count).map(point).collect()
    }

    fn random_points(&self, count: usize) -> Vec<[f32; 3]> {
        let mut random = Random::new(1);
        (0..count).map(|_| random.point_in_cube(0.49).map(|x| x as f32)).collect()
    }

    fn sum_one_by_one<R: Real>(&self, points: &[[f32; 3]]) {
        let value = |sum: R, point: &[f32; 3]| {
            let point = Vector3::from(point.map(|x| R::from_f64(f64::from(x))));
            sum + self.grid.value(point)
        };
        black_box(points.iter().fold(R::zero(), value));
    }

    fn sum_in_lanes(&self, points: &[[f32; 3]]) {
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
            let coordinates = |axis: usize| Lanes(points.map(|point| point[axis]));
            sum += self.ball.grid.value(Vector3::new(coordinates(0), coordinates(1), coordinates(2)));
        }
        sum
    }
}

/// Triangles with everything precomputed that a distance from them needs.
struct PreparedTriangles {
    all: Vec<Prepared>,
}

#[derive(Clone, Copy)]
struct Prepared {
    corners: [[f32; 3]; 3],
    /// Vector from each corner to the next.
    edges: [[f32; 3]; 3],
    inv_length_sq: [f32; 3],
    /// In-plane normal of each edge, towards the inside.
    inward: [[f32; 3]; 3],
    /// Unit normal.
    normal: [f32; 3],
}

impl PreparedTriangles {
    fn new(count: usize) -> Self {
        let prepared = |index: usize| {
            let angle = TAU * index as f64 / count as f64;
            let corner = |offset: f64| {
                let (sin, cos) = (angle + offset).sin_cos();
                Vector3::new(cos, sin, 0.3 * offset.sin()).cast::<f32>()
            };
            Prepared::new([corner(0.0), corner(0.4), corner(1.7)])
        };
        Self { all: (0..count).map(prepared).collect() }
    }

    /// Distances of as many points as there are triangles, each from all triangles.
    fn all_distances(&self) {
        let coordinates =
            |axis: usize| (0..self.all.len()).map(|index| 0.001 * (index * (axis + 1)) as f32 - 0.5).collect();
        let points: [Vec<f32>; 3] = std::array::from_fn(coordinates);
        let mut nearest = vec![f32::INFINITY; self.all.len()];
        Arch::new().dispatch(AllPairs { triangles: &self.all, points: &points, nearest: &mut nearest });
        black_box(nearest);
    }
}

struct AllPairs<'a> {
    triangles: &'a [Prepared],
    points: &'a [Vec<f32>; 3],
    nearest: &'a mut [f32],
}

impl NullaryFnOnce for AllPairs<'_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        for triangle in self.triangles {
            triangle.min_distances_sq(self.points, self.nearest);
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

    /// Lowers `nearest` to the squared distances of points from this triangle: from its plane if the point projects into the
    /// triangle, otherwise from the nearest edge.
    #[inline(always)]
    fn min_distances_sq(&self, [xs, ys, zs]: &[Vec<f32>; 3], nearest: &mut [f32]) {
        for (((x, y), z), nearest) in xs.iter().zip(ys).zip(zs).zip(nearest) {
            let mut edge_distance_sq = f32::INFINITY;
            let mut innermost = f32::INFINITY;
            let mut height = 0.0;
            for side in 0..3 {
                let (corner, edge, inward) = (self.corners[side], self.edges[side], self.inward[side]);
                let from = [x - corner[0], y - corner[1], z - corner[2]];
                let t = min(max(dot(from, edge) * self.inv_length_sq[side], 0.0), 1.0);
                let off = [from[0] - edge[0] * t, from[1] - edge[1] * t, from[2] - edge[2] * t];
                edge_distance_sq = min(edge_distance_sq, dot(off, off));
                innermost = min(innermost, dot(from, inward));
                height = dot(from, self.normal);
            }
            let distance_sq = if innermost >= 0.0 { height * height } else { edge_distance_sq };
            *nearest = min(*nearest, distance_sq);
        }
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// One instruction. `f32::min` takes more, because it handles NaN.
#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The measured loop computes distances: each is the minimum over many points of the triangle.
    #[test]
    fn the_distance_from_a_triangle_is_the_minimum_over_its_points() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, 0.9, -0.2]].map(Vector3::<f32>::from);
        let points: [Vec<f32>; 3] = std::array::from_fn(|axis| {
            (0..100).map(|index| ((7 * index + 5 * axis) % 16) as f32 / 4.0 - 2.0).collect()
        });
        let mut nearest = vec![f32::INFINITY; 100];
        Prepared::new(corners).min_distances_sq(&points, &mut nearest);
        for (index, found) in nearest.into_iter().enumerate() {
            let point = Vector3::from_fn(|axis, _| points[axis][index]);
            let mut lowest = f32::INFINITY;
            for i in 0..=100_u8 {
                for j in 0..=100 - i {
                    let [u, v] = [i, j].map(|step| f32::from(step) / 100.0);
                    let on = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
                    lowest = lowest.min((point - on).norm_squared());
                }
            }
            assert!((found.sqrt() - lowest.sqrt()).abs() < 0.02, "{point}: {} and {}", found.sqrt(), lowest.sqrt());
            assert!(found <= lowest + 1e-5);
        }
    }
}
