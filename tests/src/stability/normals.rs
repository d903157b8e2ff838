//! Normals of contacts on grids: how far they are off, and how far they turn when the body moves a little.

use nalgebra::Vector3;
use sdf_core::contact::{Contact, Outcome, contact};
use sdf_core::placed::{Placed, Rigid};
use sdf_core::shapes::{RoundedBox, Sphere, Torus};
use sdf_core::{EnclosedSdf, Sdf, Simplex};

use crate::methods::Method;
use crate::oracle::element;
use crate::random::Random;
use crate::scene_field::SceneField;
use crate::scenes::{IDENTITY, cube_lattice, sampled, sampled_in_bricks};

type Point = Vector3<f64>;

const CELLS: u32 = 64;

/// Spacing of a lattice over the cube [−1, 1]³.
const SPACING: f64 = 2.0 / CELLS as f64;

/// The body's translation between two contacts.
pub const SHIFT: f64 = 1e-3 * SPACING;

/// A contact point that moves farther than this by a shift of [`SHIFT`] is another minimum.
const MAX_MOVE: f64 = SPACING;

/// A smooth body in closed form and in grids.
pub struct SmoothBody {
    pub name: &'static str,
    exact: SceneField,
    /// Dense, and sparse with a band of three cells.
    pub grids: [(&'static str, SceneField); 2],
    /// Half extents of the flat faces, at whose borders the curvature jumps.
    flat: Option<[f64; 3]>,
}

/// A sphere, a torus and a rounded box on 64 cells.
pub fn smooth_bodies() -> Vec<SmoothBody> {
    fn body(name: &'static str, field: impl EnclosedSdf + Clone + 'static, flat: Option<[f64; 3]>) -> SmoothBody {
        let lattice = cube_lattice(1.0, CELLS);
        let grids = [
            ("dense", SceneField::new(sampled(&field, lattice, 1.0))),
            ("sparse", SceneField::new(sampled_in_bricks::<f32>(&field, lattice, 3.0 * SPACING))),
        ];
        SmoothBody { name, exact: SceneField::new(field), grids, flat }
    }
    let flat = [0.3, 0.4, 0.2];
    vec![
        body("sphere", Sphere::new(0.7).unwrap(), None),
        body("torus", Torus::new(0.6, 0.3).unwrap(), None),
        body("rounded box", RoundedBox::new(flat, 0.3).unwrap(), Some(flat)),
    ]
}

/// Angles in degrees, ascending.
#[derive(Clone, Debug, Default)]
pub struct NormalErrors {
    /// Between the reported normal and the body's own at the contact's point.
    pub off: Vec<f64>,
    /// Between the normals before and after the body moves by [`SHIFT`], where it is the same minimum.
    pub turns: Vec<f64>,
    /// Contacts that became another minimum, on a curved part of the body.
    pub jumps: usize,
}

impl SmoothBody {
    /// A triangle whose plane is tangent to the body, or up to half a cell above or below, at a point inside it.
    fn touching(&self, random: &mut Random) -> [Point; 3] {
        let mut point = random.in_cube(0.9);
        for _ in 0..8 {
            let sample = self.exact.sample(point);
            point -= sample.gradient * sample.value;
        }
        let normal = self.exact.sample(point).gradient.normalize();
        let across = normal.cross(&random.direction()).normalize();
        let other = normal.cross(&across);
        let (size, turn) = (SPACING * random.between(2.0, 8.0), random.between(0.0, std::f64::consts::TAU));
        let middle = point + normal * (SPACING * random.between(-0.5, 0.5));
        [0.0, 1.0, 2.0].map(|corner| {
            let angle: f64 = turn + corner * std::f64::consts::TAU / 3.0 + random.between(-0.4, 0.4);
            middle + (across * angle.cos() + other * angle.sin()) * size
        })
    }

    /// Is the point three cells or more from where the body's curvature jumps?
    fn is_far_from_curvature_edges(&self, point: Point) -> bool {
        let distance = |axis: usize, flat: f64| (point[axis].abs() - flat).abs();
        self.flat.is_none_or(|flat| (0..3).all(|axis| distance(axis, flat[axis]) > 3.0 * SPACING))
    }

    /// The errors of the contacts of `rounds` triangles by one method. The body moves to and fro in random directions.
    pub fn normal_errors(&self, grid: &SceneField, method: &Method, rounds: usize) -> NormalErrors {
        let mut random = Random::with_seed(20_201_122);
        let mut errors = NormalErrors::default();
        for _ in 0..rounds {
            let corners = self.touching(&mut random);
            let shift = random.direction() * SHIFT;
            let moved = Placed { field: grid.clone(), placement: Rigid::new(shift.into(), IDENTITY).unwrap() };
            let (before, after) =
                (contact_of(grid, method, corners), contact_of(&SceneField::new(moved), method, corners));
            if ![before.point, after.point].into_iter().all(|point| self.is_far_from_curvature_edges(point)) {
                continue;
            }
            errors.off.push(angle(before.normal, self.exact.sample(before.point).gradient));
            let turn = angle(before.normal, after.normal);
            match (before.point - after.point).norm() < MAX_MOVE {
                true => errors.turns.push(turn),
                // Two points of a flat face have one normal.
                false => errors.jumps += usize::from(turn > 0.05),
            }
        }
        errors.off.sort_by(f64::total_cmp);
        errors.turns.sort_by(f64::total_cmp);
        errors
    }
}

fn contact_of(field: &SceneField, method: &Method, corners: [Point; 3]) -> Contact<f64> {
    match contact(field, method, f64::INFINITY, &element(0, Simplex { corners })) {
        Outcome::Contact(contact) => contact,
        other => panic!("expected a contact, found {other:?}"),
    }
}

/// The angle between two vectors in degrees.
fn angle(a: Point, b: Point) -> f64 {
    a.cross(&b).norm().atan2(a.dot(&b)).to_degrees()
}
