//! One element against one field: what is true of it, and what may be said of that in a number type.

use nalgebra::Vector3;
use sdf_core::{EnclosedSdf, Sdf, Simplex};

use super::answer::{Found, Number, ask};
use super::bodies::Body;
use crate::methods::{Method, methods};
use crate::oracle::{least_of_convex, least_on_lattice};

type Point = Vector3<f64>;

/// The steps that each method has: as many as in the paper.
pub const BUDGET: u32 = 32;

/// How many roundings a value may be off by: those that core's own bounds allow for.
pub const ROUNDINGS: f64 = 32.0;

/// How many such a gap of a converged certified search may hold besides its tolerance, and one more between the field's
/// values and the truth.
pub const ROUNDINGS_OF_GAP: f64 = 9.0;

/// The tolerance of a certified search, and of one that may be one.
pub const TOLERANCE: f64 = 1e-3;

pub struct Problem<'a> {
    pub body: &'a Body,
    pub corners: Vec<Point>,
    /// Some point of the element has a value of at most this, and few have less.
    pub truth: f64,
    /// No point of the element has a value below this.
    pub floor: f64,
    /// Longest edge · slope bound: the most that values on the element can differ by.
    pub range: f64,
}

impl<'a> Problem<'a> {
    /// Of the first `corners` corners of a triangle.
    pub fn new(body: &'a Body, triangle: &[Point; 3], corners: usize) -> Self {
        let corners = triangle[..corners].to_vec();
        let field = &body.field;
        let (least, edge, parts) = match *corners.as_slice() {
            [a] => (field.value(a), 0.0, 1),
            [a, b] => of(field, body.convex, [a, b], 128),
            [a, b, c] => of(field, body.convex, [a, b, c], 24),
            _ => unreachable!("an element has one to three corners"),
        };
        let range = edge * field.slope_bound();
        let mut problem = Self { body, corners, truth: least, floor: 0.0, range };
        let none_below = if body.convex { least - 1e-9 * range } else { least - range / f64::from(parts) };
        problem.floor = none_below - problem.rounding(Number::Double, least);
        // What any method finds in double precision is attained too.
        for method in methods(problem.corners.len(), BUDGET) {
            problem.truth = problem.truth.min(problem.least(&method, Number::Double).value);
        }
        problem
    }

    /// The promise: by how much at most a value is off that is asked in this type.
    ///
    /// [`ROUNDINGS`] of slope bound · largest length, or of the value where that is larger.
    pub fn rounding(&self, number: Number, value: f64) -> f64 {
        ROUNDINGS * number.epsilon() * (self.body.field.slope_bound() * self.largest_length()).max(value.abs())
    }

    /// Of the element's coordinates and the field's definition.
    fn largest_length(&self) -> f64 {
        self.corners.iter().fold(self.body.largest_length, |most, corner| most.max(corner.amax()))
    }

    /// How much a certified search that converged may leave between its value and the truth: its tolerance, and roundings as
    /// core counts them, which takes a slope bound below one for one.
    pub fn gap(&self, number: Number, value: f64) -> f64 {
        let largest = self.largest_length().max(value.abs()) * self.body.field.slope_bound().max(1.0);
        TOLERANCE * self.range + ROUNDINGS_OF_GAP * ROUNDINGS * number.epsilon() * largest
    }

    /// The least value that the method finds.
    pub fn least(&self, method: &Method, number: Number) -> Found {
        let answer = ask(&self.body.field, method, f64::INFINITY, &self.corners, number);
        answer.found.unwrap_or_else(|| panic!("{} on {:?}: {:?}", self.body.name, self.corners, answer.fate))
    }

    /// φ in double precision at a point of any origin.
    pub fn value(&self, point: Point) -> f64 {
        self.body.field.value(point)
    }

    /// The point of the weights in double precision.
    pub fn point(&self, weights: &[f64]) -> Point {
        let first = self.corners[0];
        self.corners
            .iter()
            .zip(weights)
            .skip(1)
            .fold(first, |point, (corner, weight)| point + (corner - first) * *weight)
    }
}

/// The least value known, the longest edge and the parts of the lattice.
fn of<const N: usize>(field: &impl EnclosedSdf, convex: bool, corners: [Point; N], parts: u32) -> (f64, f64, u32) {
    let simplex = Simplex { corners };
    let on_lattice = least_on_lattice(field, &simplex, parts as usize);
    let least = if convex { on_lattice.min(least_of_convex(field, &simplex)) } else { on_lattice };
    (least, simplex.longest_edge(), parts)
}

/// Whether the method's "converged" says that nothing on the element is lower than its value by more than its tolerance.
pub fn certifies(method: &Method) -> bool {
    matches!(method, Method::Certified(_))
}

/// As the code calls it.
pub fn name(method: &Method) -> String {
    format!("{method:?}").split(['(', ' ']).next().unwrap_or_default().to_owned()
}
