//! A field that is known only at run time: an enum of all shapes. Each method is passed on to the shape in the node.

use std::sync::Arc;

use sdf_core::combine::{Difference, Intersection, Offset, Shell, SmoothUnion, Union};
use sdf_core::grid::{SegmentMinimum, TriangleMinimum};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placed, Similarity, Stretch};
use sdf_core::shapes::{
    Bowl, Capsule, Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Horseshoe, Octahedron, RoundedBox, Sphere, Torus,
};
use sdf_core::{Aabb, BoxEnclosure, Enclosure, Float, Real, Sample, Sdf};

use crate::grid_file::OwnedGrid;

/// A field that is known only at run time: a tree of shapes.
#[derive(Clone, Debug)]
pub enum Node {
    Sphere(Sphere),
    HalfSpace(HalfSpace),
    Cuboid(Cuboid),
    RoundedBox(RoundedBox),
    Capsule(Capsule),
    Cylinder(Cylinder),
    Cone(Cone),
    Torus(Torus),
    Octahedron(Octahedron),
    Ellipsoid(Ellipsoid),
    Bowl(Bowl),
    Horseshoe(Horseshoe),
    Grid(Arc<OwnedGrid>),
    Union(Box<Union<Node, Node>>),
    Intersection(Box<Intersection<Node, Node>>),
    Difference(Box<Difference<Node, Node>>),
    SmoothUnion(Box<SmoothUnion<Node, Node>>),
    Offset(Box<Offset<Node>>),
    Shell(Box<Shell<Node>>),
    Placed(Box<Placed<Node, Similarity>>),
    Stretched(Box<Placed<Node, Stretch>>),
}

/// Calls a method of the shape in a node.
macro_rules! delegate {
    ($node:expr, $field:ident => $call:expr) => {
        match $node {
            Node::Sphere($field) => $call,
            Node::HalfSpace($field) => $call,
            Node::Cuboid($field) => $call,
            Node::RoundedBox($field) => $call,
            Node::Capsule($field) => $call,
            Node::Cylinder($field) => $call,
            Node::Cone($field) => $call,
            Node::Torus($field) => $call,
            Node::Octahedron($field) => $call,
            Node::Ellipsoid($field) => $call,
            Node::Bowl($field) => $call,
            Node::Horseshoe($field) => $call,
            Node::Grid($field) => $call,
            Node::Union($field) => $call,
            Node::Intersection($field) => $call,
            Node::Difference($field) => $call,
            Node::SmoothUnion($field) => $call,
            Node::Offset($field) => $call,
            Node::Shell($field) => $call,
            Node::Placed($field) => $call,
            Node::Stretched($field) => $call,
        }
    };
}

impl Sdf for Node {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        delegate!(self, field => field.evaluate(point))
    }

    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        delegate!(self, field => field.value(point))
    }

    fn bounds(&self, level: f64) -> Aabb {
        delegate!(self, field => field.bounds(level))
    }

    fn slope_bound(&self) -> f64 {
        delegate!(self, field => field.slope_bound())
    }

    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        delegate!(self, field => field.enclose_box(region))
    }

    fn minimum_on_segment<R: Float>(&self, ends: [Vector3<R>; 2]) -> Option<SegmentMinimum<R>> {
        delegate!(self, field => field.minimum_on_segment(ends))
    }
    fn minimum_on_triangle<R: Float>(&self, corners: [Vector3<R>; 3], enough: [R; 2]) -> Option<TriangleMinimum<R>> {
        delegate!(self, field => field.minimum_on_triangle(corners, enough))
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        delegate!(self, field => field.enclosure(about, corners))
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        delegate!(self, field => field.is_convex_on(corners))
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        delegate!(self, field => field.max_rise_to_corners(corners))
    }

    fn linearization_error(&self, region: &Aabb) -> f64 {
        delegate!(self, field => field.linearization_error(region))
    }
}
