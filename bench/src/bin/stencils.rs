//! How far are normals off that are computed from a grid's samples by different stencils? The table of docs/methods.md.
//!
//! Each body is sampled from its closed form, in f32, on 64 cells over [−1, 1]³. The points are random, within half a cell of the
//! surface. A stencil is a product of one weight function w per axis: φ(x) = Σ f_i w(x/h − i), and its derivative along an axis has
//! w′ there. Differences over ± d cells are w′(t) = (w(t + d) − w(t − d)) / 2d of the linear w, with w for the other axes.
//!
//! `cargo run --release -p sdf-bench --bin stencils` prints the table and takes seconds.

use std::ops::Range;

use sdf_core::Sdf;
use sdf_core::nalgebra::Vector3;
use sdf_core::shapes::{Cuboid, RoundedBox, Sphere, Torus};
use sdf_procedural::random::Random;

const CELLS: i32 = 64;
const SPACING: f64 = 2.0 / CELLS as f64;
const POINTS: usize = 2000;

/// Weight functions of a node at the offset t from the point, in cells: of the value and of its derivative.
struct Stencil {
    name: &'static str,
    /// Nodes with a weight, along all axes together.
    samples: usize,
    weight: fn(f64) -> f64,
    slope: fn(f64) -> f64,
}

/// Samples of a field on the lattice.
struct Samples(Vec<f32>);

impl Samples {
    fn new(field: &impl Sdf) -> Self {
        let axis = 0..=CELLS;
        let nodes = axis.clone().flat_map(|z| axis.clone().flat_map(move |y| (0..=CELLS).map(move |x| [x, y, z])));
        Self(nodes.map(|node| field.value(position(node)) as f32).collect())
    }

    fn gradient(&self, point: Vector3<f64>, stencil: &Stencil) -> Vector3<f64> {
        let steps = point.map(|x| (x + 1.0) / SPACING);
        let near = |axis: usize| -> Range<i32> { steps[axis].floor() as i32 - 4..steps[axis].floor() as i32 + 6 };
        let mut gradient = Vector3::zeros();
        for z in near(2) {
            for y in near(1) {
                for x in near(0) {
                    let offset = Vector3::new(x, y, z).map(f64::from) - steps;
                    let (w, d) = (offset.map(stencil.weight), offset.map(stencil.slope));
                    let row = (z.clamp(0, CELLS) * (CELLS + 1) + y.clamp(0, CELLS)) * (CELLS + 1) + x.clamp(0, CELLS);
                    let sample = f64::from(self.0[row as usize]);
                    gradient += Vector3::new(d.x * w.y * w.z, w.x * d.y * w.z, w.x * w.y * d.z) * sample;
                }
            }
        }
        gradient
    }
}

fn main() {
    let stencils = [
        Stencil {
            name: "differences of φ over ± half a cell",
            samples: 48,
            weight: hat,
            slope: |t| hat(t - 0.5) - hat(t + 0.5),
        },
        Stencil {
            name: "differences of φ over ± one cell",
            samples: 48,
            weight: hat,
            slope: |t| (hat(t - 1.0) - hat(t + 1.0)) / 2.0,
        },
        Stencil {
            name: "quadratic B-spline, filtered",
            samples: 125,
            weight: |t| filtered(quadratic, t, 8.0),
            slope: |t| filtered(quadratic_slope, t, 8.0),
        },
        Stencil { name: "cubic B-spline, not filtered", samples: 64, weight: cubic, slope: cubic_slope },
        Stencil {
            name: "cubic B-spline, filtered",
            samples: 216,
            weight: |t| filtered(cubic, t, 6.0),
            slope: |t| filtered(cubic_slope, t, 6.0),
        },
    ];
    println!("| stencil | samples | sphere | torus | rounded box | box, two to three cells from an edge, worst |");
    println!("|---|---|---|---|---|---|");
    let (flat, block) = ([0.3, 0.4, 0.2], [0.6, 0.7, 0.5]);
    for stencil in &stencils {
        let columns = [
            summary(errors(&valid(Sphere::new(0.7)), stencil, |_| true)),
            summary(errors(&valid(Torus::new(0.6, 0.25)), stencil, |_| true)),
            summary(errors(&valid(RoundedBox::new(flat, 0.3)), stencil, |point| {
                (0..3).all(|axis| (point[axis].abs() - flat[axis]).abs() > 3.0 * SPACING)
            })),
            format!(
                "{:.1}",
                errors(&valid(Cuboid::new(block)), stencil, |p| is_near_edge(p, block)).last().unwrap_or(&0.0)
            ),
        ];
        println!("| {} | {} | {} |", stencil.name, stencil.samples, columns.join(" | "));
    }
}

/// Angles in degrees between the stencil's gradient and the field's own, ascending, at points that `is_wanted` takes.
fn errors(field: &impl Sdf, stencil: &Stencil, is_wanted: impl Fn(Vector3<f64>) -> bool) -> Vec<f64> {
    let samples = Samples::new(field);
    let mut random = Random::new(64);
    let mut errors = Vec::with_capacity(POINTS);
    while errors.len() < POINTS {
        let point = Vector3::from([(); 3].map(|()| random.between(-0.95, 0.95)));
        let exact = field.evaluate(point);
        if exact.value.abs() <= SPACING / 2.0 && is_wanted(point) {
            let gradient = samples.gradient(point, stencil);
            errors.push(exact.gradient.cross(&gradient).norm().atan2(exact.gradient.dot(&gradient)).to_degrees());
        }
    }
    errors.sort_by(f64::total_cmp);
    errors
}

/// Median, 99 % and worst of an ascending list.
fn summary(errors: Vec<f64>) -> String {
    let quantile = |fraction: f64| errors[((errors.len() - 1) as f64 * fraction) as usize];
    format!("{:.3}, {:.3}, {:.3}", quantile(0.5), quantile(0.99), quantile(1.0))
}

/// Is the point two to three cells from the edge of a box that is nearest to it?
fn is_near_edge(point: Vector3<f64>, half_extents: [f64; 3]) -> bool {
    let mut to_face: [f64; 3] = std::array::from_fn(|axis| (half_extents[axis] - point[axis].abs()) / SPACING);
    to_face.sort_by(f64::total_cmp);
    (2.0..3.0).contains(&to_face[1])
}

fn position(node: [i32; 3]) -> Vector3<f64> {
    Vector3::from(node).map(|i| f64::from(i) * SPACING - 1.0)
}

/// The bodies' sizes are constants that make a shape.
fn valid<T>(shape: Option<T>) -> T {
    shape.expect("the sizes of a body are positive")
}

/// Linear B-spline: the weight of trilinear interpolation.
fn hat(t: f64) -> f64 {
    (1.0 - t.abs()).max(0.0)
}

/// Quadratic B-spline, ¾ − t² up to ½ and (3/2 − |t|)² / 2 up to 3/2.
fn quadratic(t: f64) -> f64 {
    let t = t.abs();
    if t < 0.5 { 0.75 - t * t } else { (1.5 - t).max(0.0).powi(2) / 2.0 }
}

/// Derivative by the point, which has the sign opposite to that by the offset t.
fn quadratic_slope(t: f64) -> f64 {
    if t.abs() < 0.5 { 2.0 * t } else { (1.5 - t.abs()).max(0.0) * t.signum() }
}

/// Cubic B-spline, ⅔ − t² + |t|³/2 up to 1 and (2 − |t|)³/6 up to 2.
fn cubic(t: f64) -> f64 {
    let t = t.abs();
    if t < 1.0 { 2.0 / 3.0 - t * t + t * t * t / 2.0 } else { (2.0 - t).max(0.0).powi(3) / 6.0 }
}

/// Derivative by the point, as [`quadratic_slope`].
fn cubic_slope(t: f64) -> f64 {
    let length = t.abs();
    let slope = if length < 1.0 { 2.0 * length - 1.5 * length * length } else { (2.0 - length).max(0.0).powi(2) / 2.0 };
    slope * t.signum()
}

/// Quasi-interpolation: the coefficients are ((k + 2) f_j − f_{j−1} − f_{j+1}) / k of the samples f.
fn filtered(spline: fn(f64) -> f64, t: f64, k: f64) -> f64 {
    ((k + 2.0) * spline(t) - spline(t - 1.0) - spline(t + 1.0)) / k
}
