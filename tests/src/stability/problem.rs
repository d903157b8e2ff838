//! One element against one field: its true minimum, and the errors that an answer in a number type may have.

use nalgebra::Vector3;
use sdf_core::{EnclosedSdf, Sdf, Simplex};

use super::answer::{FoundMinimum, Number, query};
use super::bodies::Body;
use crate::methods::{Method, methods};
use crate::oracle::{convex_minimum, lattice_minimum};

type Point = Vector3<f64>;

/// Steps of each method: as many as in the paper.
pub const BUDGET: u32 = 32;

/// Allowed error of a value, in roundings: as many as core's own bounds allow for.
pub const ROUNDINGS: f64 = 32.0;

/// Allowed gap of a converged certified search besides its tolerance, in multiples of [`ROUNDINGS`]; one of them is between
/// the field's values and the truth.
pub const ROUNDINGS_OF_GAP: f64 = 9.0;

/// Tolerance of a certified search.
pub const TOLERANCE: f64 = 1e-3;

pub struct Problem<'a> {
    pub body: &'a Body,
    pub corners: Vec<Point>,
    /// The minimum over the element, from above: some point has at most this value.
    pub truth: f64,
    /// The minimum over the element, from below: no point has a lower value.
    pub floor: f64,
    /// Longest edge · slope bound: values on the element differ by at most this.
    pub range: f64,
    /// The minimum that each method finds in f64, in the order of [`methods`].
    in_f64: Vec<FoundMinimum>,
}

impl<'a> Problem<'a> {
    /// The first `corners` corners of a triangle against the body.
    pub fn new(body: &'a Body, triangle: &[Point; 3], corners: usize) -> Self {
        let corners = triangle[..corners].to_vec();
        let field = &body.field;
        let (minimum, edge, parts) = match *corners.as_slice() {
            [a] => (field.value(a), 0.0, 1),
            [a, b] => known_minimum(field, body.convex, [a, b], 128),
            [a, b, c] => known_minimum(field, body.convex, [a, b, c], 24),
            _ => unreachable!("an element has one to three corners"),
        };
        let range = edge * field.slope_bound();
        let mut problem = Self { body, corners, truth: minimum, floor: 0.0, range, in_f64: vec![] };
        let lower = if body.convex { minimum - 1e-9 * range } else { minimum - range / f64::from(parts) };
        problem.floor = lower - problem.rounding(Number::Double, minimum);
        let methods = methods(problem.corners.len(), BUDGET);
        problem.in_f64 = methods.iter().map(|method| problem.minimum(method, Number::Double)).collect();
        // A value that a method finds in f64 is attained too.
        problem.truth = problem.in_f64.iter().fold(minimum, |truth, found| truth.min(found.value));
        problem
    }

    /// Each method with the minimum that it finds in f64.
    pub fn methods_in_f64(&self) -> impl Iterator<Item = (Method, &FoundMinimum)> {
        methods(self.corners.len(), BUDGET).into_iter().zip(&self.in_f64)
    }

    /// The promised error of a value in this number type: [`ROUNDINGS`] · ε · max(slope bound · largest length, |value|).
    pub fn rounding(&self, number: Number, value: f64) -> f64 {
        ROUNDINGS * number.epsilon() * (self.body.field.slope_bound() * self.largest_length()).max(value.abs())
    }

    /// The largest of the element's coordinates and the lengths in the field's definition.
    fn largest_length(&self) -> f64 {
        self.corners.iter().fold(self.body.largest_length, |max, corner| max.max(corner.amax()))
    }

    /// The allowed distance of a converged certified search from the truth: its tolerance, and roundings as core counts them,
    /// with the slope bound taken as at least 1.
    pub fn gap(&self, number: Number, value: f64) -> f64 {
        let largest = self.largest_length().max(value.abs()) * self.body.field.slope_bound().max(1.0);
        TOLERANCE * self.range + ROUNDINGS_OF_GAP * ROUNDINGS * number.epsilon() * largest
    }

    /// The minimum that the method finds.
    pub fn minimum(&self, method: &Method, number: Number) -> FoundMinimum {
        let answer = query(&self.body.field, method, f64::INFINITY, &self.corners, number);
        answer.minimum.unwrap_or_else(|| panic!("{} on {:?}: {:?}", self.body.name, self.corners, answer.fate))
    }

    /// φ in f64 at any point.
    pub fn value(&self, point: Point) -> f64 {
        self.body.field.value(point)
    }

    /// The point with these weights, in f64.
    pub fn point(&self, weights: &[f64]) -> Point {
        let first = self.corners[0];
        self.corners
            .iter()
            .zip(weights)
            .skip(1)
            .fold(first, |point, (corner, weight)| point + (corner - first) * *weight)
    }
}

/// The lowest value on a lattice of the element or, on a convex field, by ternary search; the longest edge; and the parts of
/// the lattice.
fn known_minimum<const N: usize>(
    field: &impl EnclosedSdf,
    convex: bool,
    corners: [Point; N],
    parts: u32,
) -> (f64, f64, u32) {
    let simplex = Simplex { corners };
    let on_lattice = lattice_minimum(field, &simplex, parts as usize);
    let minimum = if convex { on_lattice.min(convex_minimum(field, &simplex)) } else { on_lattice };
    (minimum, simplex.longest_edge(), parts)
}

/// Does "converged" of this method certify its value to within its tolerance of the element's minimum?
pub fn certifies(method: &Method) -> bool {
    matches!(method, Method::Certified(_))
}

/// The method's name in code.
pub fn name(method: &Method) -> String {
    format!("{method:?}").split(['(', ' ']).next().unwrap_or_default().to_owned()
}
