//! Jitter: motion of a contact when the body moves a little (Fig. 2 and Fig. 4 of Macklin et al. 2020).
//!
//! Elements cross a sharp or rounded edge of the body, where the true contact moves as smoothly as the body.

use nalgebra::Vector3;
use sdf_core::EnclosedSdf;
use sdf_core::placed::{Placed, Rigid};
use sdf_core::shapes::{Capsule, Cuboid, RoundedBox};

use super::answer::{Number, query};
use super::problem::{BUDGET, name};
use crate::methods::methods;
use crate::random::Random;
use crate::scene_field::SceneField;
use crate::scenes::{cube_lattice, sampled, sampled_in_bricks};

type Point = Vector3<f64>;

/// The body's translation in one step, in lengths of the crossing edge, which is 1; and twice its rotation in radians.
pub const STEP: f64 = 1e-5;

/// A contact that moves farther than this in one step, in edges, jumps.
pub const MAX_SMOOTH: f64 = 1e-3;

/// The body's path on which the largest jump is searched: thousands of steps.
const PATH: f64 = 0.05;

/// A body with a sharp or round edge along x through the origin, and the rest of it below.
pub struct Ridge {
    pub name: &'static str,
    /// Stored as samples, not in closed form.
    pub is_grid: bool,
    field: SceneField,
}

/// Half the side of a box's cross-section.
const HALF: f64 = 0.5;

/// Rotated by 45° about x, so that an edge is on top, and shifted down so that it meets the origin.
fn on_edge(field: impl EnclosedSdf + 'static) -> SceneField {
    let down = [0.0, 0.0, -HALF * std::f64::consts::SQRT_2];
    let (sin, cos) = (std::f64::consts::PI / 8.0).sin_cos();
    SceneField::new(Placed {
        field: SceneField::new(field),
        placement: Rigid::new(down, [sin, 0.0, 0.0, cos]).unwrap(),
    })
}

/// Ridges in closed form and in grids.
pub fn ridges() -> Vec<Ridge> {
    let ridge = |name, is_grid, field| Ridge { name, is_grid, field };
    let cuboid = Cuboid::new([1.0, HALF, HALF]).unwrap();
    let rounded = RoundedBox::new([0.95, HALF - 0.05, HALF - 0.05], 0.05).unwrap();
    let capsule = Capsule::new([-1.0, 0.0, -0.1], [1.0, 0.0, -0.1], 0.1).unwrap();
    let lattice = cube_lattice(1.25, 40);
    vec![
        ridge("box", false, on_edge(cuboid)),
        ridge("rounded box", false, on_edge(rounded)),
        ridge("capsule", false, SceneField::new(capsule)),
        ridge("box in a dense grid", true, on_edge(sampled(&cuboid, lattice, 1.0))),
        ridge("box in a sparse grid", true, on_edge(sampled_in_bricks::<f32>(&cuboid, lattice, 0.125))),
    ]
}

/// The element that crosses a ridge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crossing {
    Edge,
    /// A face with the crossing edge as its lowest, the rest of it above.
    Face,
}

/// Distances that the contacts of one method move, in edges, ascending.
#[derive(Clone, Debug)]
pub struct Jitter {
    pub method: String,
    /// Distances moved in one step of the body.
    pub moves: Vec<f64>,
    /// Distances moved in that step of a long path in which the contact moves farthest.
    pub jumps: Vec<f64>,
}

/// The quantile of ascending numbers: `fraction` of them are at most as large.
pub fn quantile(ascending: &[f64], fraction: f64) -> f64 {
    ascending[((ascending.len() - 1) as f64 * fraction).round() as usize]
}

/// A unit edge across the ridge at more than 30°, with the contact away from its ends, and a third corner above.
fn crossing(random: &mut Random) -> [Point; 3] {
    let angle = random.between(0.55, 2.6);
    let along = Vector3::new(angle.cos(), angle.sin(), random.between(-0.2, 0.2)).normalize();
    let middle = Vector3::new(random.between(-0.4, 0.4), random.between(-0.01, 0.01), random.between(-0.05, 0.05));
    let t = random.between(0.3, 0.7);
    let up = Vector3::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3), 1.0);
    [middle - along * t, middle + along * (1.0 - t), middle + up]
}

/// A translation of the body together with a rotation by half as much.
struct Motion {
    direction: Point,
    axis: Point,
}

impl Motion {
    fn random(random: &mut Random) -> Self {
        Self { direction: random.direction(), axis: random.direction() * 0.5 }
    }

    fn moved_field(&self, field: &SceneField, length: f64) -> SceneField {
        let (translation, half_turn) = (self.direction * length, self.axis * (0.5 * length));
        let placement = Rigid::new(translation.into(), [half_turn.x, half_turn.y, half_turn.z, 1.0]).unwrap();
        SceneField::new(Placed { field: field.clone(), placement })
    }
}

/// The farthest that a point moves in one step of the path, by bisection.
///
/// Each bisection keeps the half over which the point moves farther. A jump is not lost: the half that contains it moves by at
/// least as much.
fn largest_jump(point: impl Fn(f64) -> Point) -> f64 {
    const PARTS: u32 = 16;
    let part = |k: u32| PATH * f64::from(k) / f64::from(PARTS);
    let points: Vec<Point> = (0..=PARTS).map(|k| point(part(k))).collect();
    let moved = |k: u32| (points[k as usize + 1] - points[k as usize]).norm();
    let farthest = (0..PARTS).max_by(|a, b| moved(*a).total_cmp(&moved(*b))).unwrap();
    let (mut from, mut to) = (part(farthest), part(farthest + 1));
    let (mut before, mut after) = (points[farthest as usize], points[farthest as usize + 1]);
    while to - from > STEP {
        let middle = 0.5 * (from + to);
        let between = point(middle);
        if (between - before).norm() < (after - between).norm() {
            (from, before) = (middle, between);
        } else {
            (to, after) = (middle, between);
        }
    }
    (after - before).norm()
}

/// The jitter of the methods that `is_wanted` selects by name, over `rounds` elements for each ridge in a grid, or in closed
/// form.
pub fn jitters(
    is_grid: bool,
    crossing: Crossing,
    number: Number,
    rounds: usize,
    is_wanted: impl Fn(&str) -> bool,
) -> Vec<Jitter> {
    let mut random = Random::with_seed(20_201_121);
    let corners = if crossing == Crossing::Edge { 2 } else { 3 };
    let mut methods = methods(corners, BUDGET);
    methods.retain(|method| is_wanted(&name(method)));
    let empty = |method| Jitter { method: name(method), moves: vec![], jumps: vec![] };
    let mut jitters: Vec<Jitter> = methods.iter().map(empty).collect();
    for ridge in ridges().iter().filter(|ridge| ridge.is_grid == is_grid) {
        for _ in 0..rounds {
            let element = self::crossing(&mut random);
            let motion = Motion::random(&mut random);
            for (method, jitter) in methods.iter().zip(&mut jitters) {
                let contact_point = |length: f64| {
                    let field = motion.moved_field(&ridge.field, length);
                    query(&field, method, f64::INFINITY, &element[..corners], number).minimum.unwrap().point
                };
                jitter.moves.push((contact_point(STEP) - contact_point(0.0)).norm());
                jitter.jumps.push(largest_jump(contact_point));
            }
        }
    }
    for jitter in &mut jitters {
        jitter.moves.sort_by(f64::total_cmp);
        jitter.jumps.sort_by(f64::total_cmp);
    }
    jitters
}
