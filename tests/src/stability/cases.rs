//! The stiff and extreme cases: one table, for the tests and for the report.

mod elements;
mod fields;
mod sizes;

use nalgebra::Vector3;

use super::bodies::{Body, all_bodies};
use crate::random::Random;

type Point = Vector3<f64>;

pub struct Case {
    pub name: &'static str,
    /// What it is, for the report.
    pub about: &'static str,
    /// Makes them, the same each time.
    pub bodies: fn() -> Vec<Body>,
}

/// All cases.
pub static CASES: [Case; 17] = [
    Case { name: "1e-6", about: "every field and its elements with lengths of 1e-6", bodies: sizes::micrometres },
    Case { name: "1e6", about: "every field and its elements with lengths of 1e6", bodies: sizes::megametres },
    Case {
        name: "1e3 away",
        about: "every field and its elements a thousand diagonals from the origin",
        bodies: sizes::thousand_diagonals_away,
    },
    Case {
        name: "1e7 away",
        about: "the same at ten million diagonals, where f32 counts in steps of two",
        bodies: sizes::ten_million_diagonals_away,
    },
    Case { name: "slivers", about: "triangles 1e-3 to 1e-12 high, at every field", bodies: elements::slivers },
    Case {
        name: "points and lines",
        about: "triangles and edges whose corners coincide or lie on a line, at every field",
        bodies: elements::points_and_lines,
    },
    Case {
        name: "1e-5 of a body",
        about: "elements of 1e-5 of the body's size near its surface, at every field",
        bodies: sizes::small_elements,
    },
    Case {
        name: "1e-5 at the origin",
        about: "the same, moved to the origin, so that the element's numbers are far smaller than the field's",
        bodies: sizes::small_elements_at_the_origin,
    },
    Case {
        name: "1e3 bodies",
        about: "elements a thousand times as large as the body that they lie on, at every field",
        bodies: sizes::large_elements,
    },
    Case {
        name: "needles",
        about: "cones of 1° (half and whole angle) through faces and edges, turned, and in a grid",
        bodies: elements::needles,
    },
    Case {
        name: "creases",
        about: "elements with corners or middles on centres, axes and medial surfaces, of every field",
        bodies: elements::creases,
    },
    Case { name: "steep", about: "values of 1e3, 1e6 and 1e9 times the distance", bodies: fields::steep },
    Case {
        name: "flat",
        about: "values of 1e-6 times the distance, and a grid that is constant",
        bodies: fields::flat,
    },
    Case {
        name: "no distances",
        about: "ellipsoids of 1 : 100, smooth unions of any blend, values scaled by 0.1 and 10",
        bodies: fields::no_distances,
    },
    Case { name: "stretched", about: "every field by 0.1, 1 and 7 along x, y and z", bodies: sizes::stretched },
    Case { name: "mirrored", about: "every field by -1, 1 and -2 along x, y and z", bodies: sizes::mirrored },
    Case {
        name: "one cell",
        about: "grids of one cell, dense, bounded and sparse, with elements within and beyond",
        bodies: fields::one_cell,
    },
];

fn random() -> Random {
    Random::with_seed(20_201_121)
}

/// Triangles around the origin, each changed.
fn triangles(
    count: usize,
    spread: f64,
    random: &mut Random,
    change: impl Fn(&mut [Point; 3], &mut Random),
) -> Vec<[Point; 3]> {
    let mut all = vec![];
    for _ in 0..count {
        let first = random.in_cube(1.2);
        let mut corners = [first, first + random.in_cube(spread), first + random.in_cube(spread)];
        change(&mut corners, random);
        all.push(corners);
    }
    all
}

/// Every field of the table at scale 1, each with triangles that are changed so.
fn all_with(spread: f64, change: impl Fn(&mut [Point; 3], &mut Random)) -> Vec<Body> {
    let mut random = random();
    let bodies = all_bodies(1.0, 1, &mut random);
    bodies.into_iter().map(|body| body.with(triangles(3, spread, &mut random, &change))).collect()
}
