//! The table of fields that every law runs over: [`scenes`] names each field and says what is known of it independently.
//!
//! | fields | file |
//! |---|---|
//! | closed forms and bent bars | `shapes` |
//! | unions, offsets, shells; placements | `combinations` |
//! | dense and sparse grids | `grids`, made by `sampling` |
//! | a slope above one | `steep` |
//! | membership without φ: the oracle of sign and magnitude | `membership` |

mod combinations;
mod grids;
mod membership;
mod sampling;
mod shapes;
mod steep;

use std::ops::Deref;

use nalgebra::Vector3;
use sdf_core::EnclosedSdf;
use sdf_core::placed::{Placed, Rigid};

pub use membership::{distance_to_bowl, is_in_horseshoe};
pub use sampling::{
    cube_lattice, dense_grid, measured_grid, node_indices, noise, sampled, sampled_in_bricks, with_block_bounds,
};
pub use steep::Steep;

use crate::random::Random;
use crate::scene_field::SceneField;

type Point = Vector3<f64>;

/// Relation of φ to the true distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// φ is the distance, everywhere.
    Exact,
    /// φ has the sign of the distance and at most its magnitude.
    Bound,
    /// φ interpolates samples: neither holds.
    Samples,
}

/// A field, and what is known of it independently.
pub struct Scene {
    pub name: &'static str,
    pub field: SceneField,
    pub meaning: Meaning,
    /// φ is a convex function.
    pub convex: bool,
    /// Membership in the solid, written down without φ. `None` for samples.
    membership: Option<Box<dyn Fn(Point) -> bool>>,
    /// The surface, where bounded, lies in the cube [−size, size]³.
    pub size: f64,
    /// Coordinates of the shape's centres, axes, faces and corners, as far as they are exact in floating point.
    pub creases: Vec<f64>,
}

/// Laws take the field itself: generic methods then compile once for one type of field.
impl Deref for Scene {
    type Target = SceneField;

    fn deref(&self) -> &SceneField {
        &self.field
    }
}

impl Scene {
    fn new(name: &'static str, size: f64, meaning: Meaning, field: Option<impl EnclosedSdf + 'static>) -> Self {
        let field = SceneField::new(field.unwrap_or_else(|| panic!("invalid parameters for {name}")));
        Self { name, field, meaning, convex: false, membership: None, size, creases: vec![] }
    }

    fn convex(self) -> Self {
        Self { convex: true, ..self }
    }

    fn inside(self, membership: impl Fn(Point) -> bool + 'static) -> Self {
        Self { membership: Some(Box::new(membership)), ..self }
    }

    /// Sets the creases to 0 and ± each of `magnitudes`.
    fn creases(self, magnitudes: &[f64]) -> Self {
        let creases = magnitudes.iter().flat_map(|x| [-x, *x]).chain([0.0]).collect();
        Self { creases, ..self }
    }

    /// Is the point inside the solid? `None` where there is no oracle.
    pub fn contains(&self, point: Point) -> Option<bool> {
        self.membership.as_ref().map(|membership| membership(point))
    }

    /// Points all around: seven of eight near the shape, the others up to 20 sizes away.
    pub fn random_points(&self, random: &mut Random, count: usize) -> Vec<Point> {
        (0..count).map(|i| random.in_cube(self.size * if i % 8 == 0 { 20.0 } else { 1.5 })).collect()
    }

    /// Every point whose coordinates are creases.
    pub fn crease_points(&self) -> Vec<Point> {
        let at = &self.creases;
        at.iter().flat_map(|x| at.iter().flat_map(|y| at.iter().map(|z| Vector3::new(*x, *y, *z)))).collect()
    }
}

/// Every field, with all its lengths multiplied by `scale`.
pub fn scenes(scale: f64) -> Vec<Scene> {
    [
        shapes::shapes(scale),
        shapes::bent_shapes(scale),
        combinations::combinations(scale),
        combinations::placements(scale),
        grids::grids(scale),
    ]
    .into_iter()
    .flatten()
    .collect()
}

pub const IDENTITY: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// The field, moved by `translation`.
pub fn shifted<F>(field: F, translation: [f64; 3]) -> Placed<F, Rigid> {
    Placed { field, placement: Rigid::new(translation, IDENTITY).unwrap() }
}
