//! The stiff and extreme cases: one table, for the tests and for the report.
//!
//! `elements` has degenerate and sharp contacts, `fields` steep, flat and inexact fields, `sizes` extreme lengths and places.

mod elements;
mod fields;
mod sizes;

use nalgebra::Vector3;

use super::bodies::{Body, all_bodies};
use crate::oracle::random_triangle;
use crate::random::Random;

type Point = Vector3<f64>;

pub struct Case {
    pub name: &'static str,
    /// Its description in the report.
    pub description: &'static str,
    /// Makes the same bodies on every call.
    pub bodies: fn() -> Vec<Body>,
}

pub static CASES: [Case; 17] = [
    Case { name: "1e-6", description: "every field and its elements with lengths of 1e-6", bodies: sizes::micrometres },
    Case { name: "1e6", description: "every field and its elements with lengths of 1e6", bodies: sizes::megametres },
    Case {
        name: "1e3 away",
        description: "every field and its elements a thousand diagonals from the origin",
        bodies: sizes::thousand_diagonals_away,
    },
    Case {
        name: "1e7 away",
        description: "the same at ten million diagonals, where f32 counts in steps of two",
        bodies: sizes::ten_million_diagonals_away,
    },
    Case { name: "slivers", description: "triangles 1e-3 to 1e-12 high, at every field", bodies: elements::slivers },
    Case {
        name: "points and lines",
        description: "triangles and edges whose corners coincide or lie on a line, at every field",
        bodies: elements::points_and_lines,
    },
    Case {
        name: "1e-5 of a body",
        description: "elements of 1e-5 of the body's size near its surface, at every field",
        bodies: sizes::small_elements,
    },
    Case {
        name: "1e-5 at the origin",
        description: "the same, moved to the origin, so that the element's numbers are far smaller than the field's",
        bodies: sizes::small_elements_at_the_origin,
    },
    Case {
        name: "1e3 bodies",
        description: "elements a thousand times as large as the body that they lie on, at every field",
        bodies: sizes::large_elements,
    },
    Case {
        name: "needles",
        description: "cones of 1° (half and whole angle) through faces and edges, turned, and in a grid",
        bodies: elements::needles,
    },
    Case {
        name: "creases",
        description: "elements with corners or middles on centres, axes and medial surfaces, of every field",
        bodies: elements::creases,
    },
    Case { name: "steep", description: "values of 1e3, 1e6 and 1e9 times the distance", bodies: fields::steep },
    Case {
        name: "flat",
        description: "values of 1e-6 times the distance, and a grid that is constant",
        bodies: fields::flat,
    },
    Case {
        name: "no distances",
        description: "ellipsoids of 1 : 100, smooth unions of any blend, values scaled by 0.1 and 10",
        bodies: fields::no_distances,
    },
    Case { name: "stretched", description: "every field by 0.1, 1 and 7 along x, y and z", bodies: sizes::stretched },
    Case { name: "mirrored", description: "every field by -1, 1 and -2 along x, y and z", bodies: sizes::mirrored },
    Case {
        name: "one cell",
        description: "grids of one cell, dense, bounded and sparse, with elements within and beyond",
        bodies: fields::one_cell,
    },
];

fn random() -> Random {
    Random::with_seed(20_201_121)
}

/// Random triangles around the origin, each changed by `change`.
fn triangles(
    count: usize,
    spread: f64,
    random: &mut Random,
    change: impl Fn(&mut [Point; 3], &mut Random),
) -> Vec<[Point; 3]> {
    let one = |_| {
        let first = random.in_cube(1.2);
        let mut corners = random_triangle(first, spread, random);
        change(&mut corners, random);
        corners
    };
    (0..count).map(one).collect()
}

/// Every field of the table at scale 1, each with three random triangles changed by `change`.
fn all_with(spread: f64, change: impl Fn(&mut [Point; 3], &mut Random)) -> Vec<Body> {
    let mut random = random();
    let bodies = all_bodies(1.0, 1, &mut random);
    bodies.into_iter().map(|body| body.with(triangles(3, spread, &mut random, &change))).collect()
}
