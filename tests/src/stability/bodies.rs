//! Fields that are asked about in stiff and extreme cases, and elements around them.

use nalgebra::Vector3;
use sdf_core::EnclosedSdf;
use sdf_core::placed::{Placed, Placement, Rigid, Similarity, Stretch};

use crate::any_field::AnyField;
use crate::oracle::random_simplex;
use crate::random::Random;
use crate::scenes::{Scene, Steep, scenes};

type Point = Vector3<f64>;

/// A field and elements that are asked of it: triangles, whose first edges and first corners are asked too.
pub struct Body {
    pub name: &'static str,
    pub field: AnyField,
    pub elements: Vec<[Point; 3]>,
    /// The largest length in the field's definition, in world units.
    pub largest_length: f64,
    /// φ is a convex function.
    pub convex: bool,
}

impl Body {
    pub fn new(name: &'static str, field: impl EnclosedSdf + 'static, largest_length: f64) -> Self {
        Self { name, field: AnyField::new(field), elements: vec![], largest_length, convex: false }
    }

    pub fn of_scene(scene: Scene, elements: Vec<[Point; 3]>) -> Self {
        let (name, largest_length, convex) = (scene.name, scene.size, scene.convex);
        Self { elements, convex, ..Self::new(name, scene, largest_length) }
    }

    pub fn convex(self) -> Self {
        Self { convex: true, ..self }
    }

    pub fn with(self, elements: Vec<[Point; 3]>) -> Self {
        Self { elements, ..self }
    }

    /// Moved, with its elements.
    pub fn moved(self, away: Point) -> Self {
        let placement = Rigid::new(away.into(), [0.0, 0.0, 0.0, 1.0]).unwrap();
        let elements = self.elements.iter().map(|corners| corners.map(|corner| corner + away)).collect();
        Self {
            largest_length: self.largest_length + away.amax(),
            field: AnyField::new(Placed { field: self.field, placement }),
            elements,
            ..self
        }
    }

    /// Placed, with its elements, by a map whose inverse the placement's `pull` is.
    pub fn placed(self, placement: impl Placement + 'static, push: impl Fn(Point) -> Point, largest: f64) -> Self {
        let elements = self.elements.iter().map(|corners| corners.map(&push)).collect();
        let field = AnyField::new(Placed { field: self.field, placement });
        Self { field, elements, largest_length: self.largest_length * largest, ..self }
    }

    pub fn stretched(self, factors: [f64; 3]) -> Self {
        let largest = factors.iter().fold(0.0_f64, |most, factor| most.max(factor.abs()));
        self.placed(Stretch::new(factors).unwrap(), |point| point.component_mul(&Vector3::from(factors)), largest)
    }

    pub fn turned(self, placement: Similarity) -> Self {
        let largest = placement.scale().max(1.0) * 2.0;
        self.placed(placement, |point| placement.push(point), largest)
    }

    /// With values that are so many times as large; the elements stay.
    pub fn steep(self, steepness: f64) -> Self {
        Self { field: AnyField::new(Steep { field: self.field, steepness }), ..self }
    }
}

/// Every field of the table at a scale, each with random elements of all shapes, slivers and pointlike ones among them.
pub fn all_bodies(scale: f64, elements: usize, random: &mut Random) -> Vec<Body> {
    let with_elements = |scene: Scene| {
        let elements = (0..elements).map(|_| random_simplex::<3>(random, scene.size).corners).collect();
        Body::of_scene(scene, elements)
    };
    scenes(scale).into_iter().map(with_elements).collect()
}
