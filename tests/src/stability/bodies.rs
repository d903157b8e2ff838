//! Fields for stiff and extreme cases, and elements around them.

use nalgebra::Vector3;
use sdf_core::EnclosedSdf;
use sdf_core::placed::{Placed, Placement, Similarity, Stretch};

use crate::oracle::random_simplex;
use crate::random::Random;
use crate::scene_field::SceneField;
use crate::scenes::{Scene, Steep, scenes, shifted};

type Point = Vector3<f64>;

/// A field and triangles. Queries use each triangle, its first edge and its first corner.
pub struct Body {
    pub name: &'static str,
    pub field: SceneField,
    pub elements: Vec<[Point; 3]>,
    /// The largest length in the field's definition, in world units.
    pub largest_length: f64,
    /// φ is a convex function.
    pub convex: bool,
}

impl Body {
    pub fn new(name: &'static str, field: impl EnclosedSdf + 'static, largest_length: f64) -> Self {
        Self { name, field: SceneField::new(field), elements: vec![], largest_length, convex: false }
    }

    pub fn from_scene(scene: Scene, elements: Vec<[Point; 3]>) -> Self {
        Self { name: scene.name, field: scene.field, elements, largest_length: scene.size, convex: scene.convex }
    }

    pub fn convex(self) -> Self {
        Self { convex: true, ..self }
    }

    pub fn with(self, elements: Vec<[Point; 3]>) -> Self {
        Self { elements, ..self }
    }

    /// Moves the field with its elements.
    pub fn moved(self, offset: Point) -> Self {
        let elements = self.elements.iter().map(|corners| corners.map(|corner| corner + offset)).collect();
        Self {
            largest_length: self.largest_length + offset.amax(),
            field: SceneField::new(shifted(self.field, offset.into())),
            elements,
            ..self
        }
    }

    /// Places the field by `placement`, and its elements by `push`, the inverse of `placement.pull`. Lengths grow by `scale`
    /// at most.
    pub fn placed(self, placement: impl Placement + 'static, push: impl Fn(Point) -> Point, scale: f64) -> Self {
        let elements = self.elements.iter().map(|corners| corners.map(&push)).collect();
        let field = SceneField::new(Placed { field: self.field, placement });
        Self { field, elements, largest_length: self.largest_length * scale, ..self }
    }

    pub fn stretched(self, factors: [f64; 3]) -> Self {
        let largest = factors.iter().fold(0.0_f64, |max, factor| max.max(factor.abs()));
        self.placed(Stretch::new(factors).unwrap(), |point| point.component_mul(&Vector3::from(factors)), largest)
    }

    pub fn turned(self, placement: Similarity) -> Self {
        let largest = placement.scale().max(1.0) * 2.0;
        self.placed(placement, |point| placement.push(point), largest)
    }

    /// Multiplies the values by `steepness`. The elements stay.
    pub fn steep(self, steepness: f64) -> Self {
        Self { field: SceneField::new(Steep { field: self.field, steepness }), ..self }
    }
}

/// Every field of the table at a scale, each with random triangles, slivers and degenerate ones among them.
pub fn all_bodies(scale: f64, elements: usize, random: &mut Random) -> Vec<Body> {
    let with_elements = |scene: Scene| {
        let elements = (0..elements).map(|_| random_simplex::<3>(random, scene.size).corners).collect();
        Body::from_scene(scene, elements)
    };
    scenes(scale).into_iter().map(with_elements).collect()
}
