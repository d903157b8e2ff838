//! How far a contact moves when the body does, hardly: on elements that cross an edge of the body, or a rounded one, where the
//! true contact moves smoothly (Fig. 2 and Fig. 4 of Macklin et al. 2020).

use nalgebra::Vector3;
use sdf_core::EnclosedSdf;
use sdf_core::placed::{Placed, Rigid};
use sdf_core::shapes::{Capsule, Cuboid, RoundedBox};

use super::answer::{Number, ask};
use super::problem::{BUDGET, name};
use crate::any_field::AnyField;
use crate::methods::methods;
use crate::random::Random;
use crate::scenes::{cube_lattice, sampled, sampled_in_bricks};

type Point = Vector3<f64>;

/// How far the body moves, and turns in radians. The element's crossing edge is one long.
pub const MOVE: f64 = 1e-5;

/// How far a contact may move then, in edges.
pub const ALLOWED: f64 = 1e-3;

/// How far the body moves on the way on which the largest jump is looked for: thousands of small moves.
const WAY: f64 = 0.05;

/// A body with an edge, sharp or round, along x through the origin, and the rest of it below.
pub struct Ridge {
    pub name: &'static str,
    /// Stored as samples.
    pub is_grid: bool,
    field: AnyField,
}

/// Half of the sides of the boxes across their edge.
const HALF: f64 = 0.5;

/// Turned by an eighth about x, so that an edge is on top, and shifted down to the origin.
fn on_edge(field: impl EnclosedSdf + 'static) -> AnyField {
    let down = [0.0, 0.0, -HALF * std::f64::consts::SQRT_2];
    let (sin, cos) = (std::f64::consts::PI / 8.0).sin_cos();
    AnyField::new(Placed { field, placement: Rigid::new(down, [sin, 0.0, 0.0, cos]).unwrap() })
}

/// The bodies, analytic and stored.
pub fn ridges() -> Vec<Ridge> {
    let ridge = |name, is_grid, field| Ridge { name, is_grid, field };
    let cuboid = Cuboid::new([1.0, HALF, HALF]).unwrap();
    let rounded = RoundedBox::new([0.95, HALF - 0.05, HALF - 0.05], 0.05).unwrap();
    let capsule = Capsule::new([-1.0, 0.0, -0.1], [1.0, 0.0, -0.1], 0.1).unwrap();
    let lattice = cube_lattice(1.25, 40);
    vec![
        ridge("box", false, on_edge(cuboid)),
        ridge("rounded box", false, on_edge(rounded)),
        ridge("capsule", false, AnyField::new(capsule)),
        ridge("box in a dense grid", true, on_edge(sampled(&cuboid, lattice, 1.0))),
        ridge("box in a sparse grid", true, on_edge(sampled_in_bricks::<f32>(&cuboid, lattice, 0.125))),
    ]
}

/// What is moved against a ridge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crossing {
    Edge,
    /// A face whose edge it is, the rest of it above.
    Face,
}

/// How far the contacts of one method move, in edges, rising.
#[derive(Clone, Debug)]
pub struct Jitter {
    pub method: String,
    /// At one small move of the body.
    pub moves: Vec<f64>,
    /// At the small move, of all on a long way, at which the contact jumps the most.
    pub jumps: Vec<f64>,
}

/// That which the given share is not above.
pub fn quantile(rising: &[f64], share: f64) -> f64 {
    rising[((rising.len() - 1) as f64 * share).round() as usize]
}

/// A unit edge across the ridge at more than 30°, its contact well inside, and a third corner above.
fn crossing(random: &mut Random) -> [Point; 3] {
    let angle = random.between(0.55, 2.6);
    let along = Vector3::new(angle.cos(), angle.sin(), random.between(-0.2, 0.2)).normalize();
    let middle = Vector3::new(random.between(-0.4, 0.4), random.between(-0.01, 0.01), random.between(-0.05, 0.05));
    let share = random.between(0.3, 0.7);
    let up = Vector3::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3), 1.0);
    [middle - along * share, middle + along * (1.0 - share), middle + up]
}

/// A straight way of the body, and a turn, at most half as far at the ends of the crossing edge.
struct Way {
    direction: Point,
    axis: Point,
}

impl Way {
    fn random(random: &mut Random) -> Self {
        Self { direction: random.direction(), axis: random.direction() * 0.5 }
    }

    fn body_at(&self, field: &AnyField, length: f64) -> AnyField {
        let (way, turn) = (self.direction * length, self.axis * (0.5 * length));
        let placement = Rigid::new(way.into(), [turn.x, turn.y, turn.z, 1.0]).unwrap();
        AnyField::new(Placed { field: field.clone(), placement })
    }
}

/// The most that a point moves over a small move of the way: of two halves the one over which it moves more, again and
/// again. A jump is not lost, for the half with it moves by at least as much.
fn largest_jump(at: impl Fn(f64) -> Point) -> f64 {
    const PARTS: u32 = 16;
    let part = |k: u32| WAY * f64::from(k) / f64::from(PARTS);
    let points: Vec<Point> = (0..=PARTS).map(|k| at(part(k))).collect();
    let moved = |k: u32| (points[k as usize + 1] - points[k as usize]).norm();
    let most = (0..PARTS).max_by(|a, b| moved(*a).total_cmp(&moved(*b))).unwrap();
    let (mut from, mut to) = (part(most), part(most + 1));
    let (mut before, mut after) = (points[most as usize], points[most as usize + 1]);
    while to - from > MOVE {
        let middle = 0.5 * (from + to);
        let between = at(middle);
        if (between - before).norm() < (after - between).norm() {
            (from, before) = (middle, between);
        } else {
            (to, after) = (middle, between);
        }
    }
    (after - before).norm()
}

/// Of the methods that are wanted by name, over `rounds` elements for each ridge, analytic or stored.
pub fn jitters(
    is_grid: bool,
    crossing: Crossing,
    number: Number,
    rounds: usize,
    wanted: impl Fn(&str) -> bool,
) -> Vec<Jitter> {
    let mut random = Random::with_seed(20_201_121);
    let corners = if crossing == Crossing::Edge { 2 } else { 3 };
    let mut methods = methods(corners, BUDGET);
    methods.retain(|method| wanted(&name(method)));
    let new = |method| Jitter { method: name(method), moves: vec![], jumps: vec![] };
    let mut jitters: Vec<Jitter> = methods.iter().map(new).collect();
    for ridge in ridges().iter().filter(|ridge| ridge.is_grid == is_grid) {
        for _ in 0..rounds {
            let element = self::crossing(&mut random);
            let way = Way::random(&mut random);
            for (method, jitter) in methods.iter().zip(&mut jitters) {
                let at = |length: f64| {
                    let body = way.body_at(&ridge.field, length);
                    ask(&body, method, f64::INFINITY, &element[..corners], number).found.unwrap().point
                };
                jitter.moves.push((at(MOVE) - at(0.0)).norm());
                jitter.jumps.push(largest_jump(at));
            }
        }
    }
    for jitter in &mut jitters {
        jitter.moves.sort_by(f64::total_cmp);
        jitter.jumps.sort_by(f64::total_cmp);
    }
    jitters
}
