//! The surface of another shape as triangles, in its own frame.
//!
//! | shape | triangles |
//! |---|---|
//! | ball, capsule | 16 around, inscribed; points of contact are then moved onto the true surface |
//! | cuboid | each side in up to 4 × 4 squares, so that a wide side can rest on several bumps |
//! | cylinder, cone | 32 around, inscribed |
//! | convex polyhedron, mesh, height field, voxels, triangle | its own |
//! | segment, polyline | triangles without area |
//! | rounded shape | those of the shape within, and a border around them |
//! | compound | those of its parts |
//! | field | the mesh that it was given |

use std::sync::Arc;

use parry3d::math::{Pose, Vector};
use parry3d::shape::{Capsule, Cuboid, Shape, TriMeshFlags, TypedShape};
use sdf_core::Aabb;
use sdf_core::contact::{ClusterKey, Clusters, cluster_count};
use sdf_core::nalgebra::Vector3;

use crate::convert::{to_core, to_parry};
use crate::shape::SdfShape;

/// The parts of a surface.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surface {
    pub parts: Vec<Part>,
}

/// Triangles, and how the true surface lies to them.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub points: Vec<[f64; 3]>,
    pub faces: Vec<[u32; 3]>,
    pub rounding: Rounding,
    /// The faces in clusters; empty if they were not made.
    order: Vec<u32>,
    boxes: Vec<Aabb>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rounding {
    /// The triangles are the surface.
    Sharp,
    /// The surface is at this distance outside of the triangles.
    Border(f64),
    /// The triangles are inscribed in a ball of this radius that is swept along a segment.
    Swept { segment: [Vector3<f64>; 2], radius: f64 },
}

/// Squares along the sides of a cuboid's faces.
const CUBOID_SQUARES: u32 = 4;

/// Triangles around round shapes.
const AROUND: u32 = 16;

impl Surface {
    /// `None` if a face names a vertex that is not there.
    pub fn of_mesh(points: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Option<Self> {
        let is_valid = faces.as_flattened().iter().all(|vertex| (*vertex as usize) < points.len());
        is_valid.then(|| Self { parts: vec![Part::new(points, faces)] })
    }

    /// The surface of a shape; `None` if it has none that is finite and known.
    pub fn of_shape(shape: &dyn Shape) -> Option<Arc<Self>> {
        match shape.as_typed_shape() {
            TypedShape::Custom(_) => shape.as_shape::<SdfShape>()?.mesh().cloned(),
            TypedShape::HalfSpace(_) => None,
            TypedShape::TriMesh(mesh) if mesh.flags().contains(TriMeshFlags::DEFORMABLE) => None,
            TypedShape::Compound(compound) => {
                let mut all = Self::default();
                for (pose, part) in compound.shapes() {
                    all.parts.extend(Self::of_shape(&**part)?.parts.iter().map(|part| part.placed(pose)));
                }
                Some(Arc::new(all))
            }
            simple => Some(Arc::new(Self { parts: vec![Part::of_shape(simple)?] })),
        }
    }

    /// Sorts the faces into clusters, for a surface that is asked again and again.
    pub fn with_clusters(mut self) -> Self {
        self.parts.iter_mut().for_each(Part::make_clusters);
        self
    }

    /// The same, unless it has clusters already.
    pub fn shared_with_clusters(this: Arc<Self>) -> Arc<Self> {
        let has_clusters = this.parts.iter().all(|part| part.clusters().is_some());
        if has_clusters { this } else { Arc::new(Arc::unwrap_or_clone(this).with_clusters()) }
    }

    /// Radius of a ball about a point that holds the surface.
    pub fn radius_about(&self, centre: Vector3<f64>) -> f64 {
        let distances = self.parts.iter().flat_map(|part| {
            let border = part.border();
            part.points.iter().map(move |point| (Vector3::from(*point) - centre).norm() + border)
        });
        distances.fold(0.0, f64::max)
    }
}

impl Part {
    fn new(points: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Self {
        Self { points, faces, rounding: Rounding::Sharp, order: vec![], boxes: vec![] }
    }

    fn of_shape(shape: TypedShape) -> Option<Self> {
        let part = match shape {
            TypedShape::Ball(ball) => {
                Self::of_triangles(ball.to_trimesh(AROUND, AROUND / 2)).swept([Vector::ZERO; 2], ball.radius)
            }
            TypedShape::Capsule(capsule) => Self::of_capsule(capsule),
            TypedShape::Cuboid(cuboid) => Self::of_cuboid(cuboid),
            TypedShape::Cylinder(cylinder) => Self::of_triangles(cylinder.to_trimesh(2 * AROUND)),
            TypedShape::Cone(cone) => Self::of_triangles(cone.to_trimesh(2 * AROUND)),
            TypedShape::ConvexPolyhedron(hull) => Self::of_triangles(hull.to_trimesh()),
            TypedShape::HeightField(heights) => Self::of_triangles(heights.to_trimesh()),
            TypedShape::Voxels(voxels) => Self::of_triangles(voxels.to_trimesh()),
            TypedShape::TriMesh(mesh) => Self::of_triangles((mesh.vertices().to_vec(), mesh.indices().to_vec())),
            TypedShape::Triangle(triangle) => Self::of_triangles((triangle.vertices().to_vec(), vec![[0, 1, 2]])),
            TypedShape::Segment(segment) => Self::of_triangles((vec![segment.a, segment.b], vec![[0, 1, 1]])),
            TypedShape::Polyline(line) => {
                let faces = line.indices().iter().map(|[a, b]| [*a, *b, *b]).collect();
                Self::of_triangles((line.vertices().to_vec(), faces))
            }
            TypedShape::RoundCuboid(round) => Self::of_cuboid(&round.inner_shape).with_border(round.border_radius),
            TypedShape::RoundTriangle(round) => {
                Self::of_shape(TypedShape::Triangle(&round.inner_shape))?.with_border(round.border_radius)
            }
            TypedShape::RoundCylinder(round) => {
                Self::of_shape(TypedShape::Cylinder(&round.inner_shape))?.with_border(round.border_radius)
            }
            TypedShape::RoundCone(round) => {
                Self::of_shape(TypedShape::Cone(&round.inner_shape))?.with_border(round.border_radius)
            }
            TypedShape::RoundConvexPolyhedron(round) => {
                Self::of_shape(TypedShape::ConvexPolyhedron(&round.inner_shape))?.with_border(round.border_radius)
            }
            _ => return None,
        };
        Some(part)
    }

    fn of_triangles((points, faces): (Vec<Vector>, Vec<[u32; 3]>)) -> Self {
        Self::new(points.into_iter().map(|point| to_core(point).into()).collect(), faces)
    }

    fn of_capsule(capsule: &Capsule) -> Self {
        let triangles = Self::of_triangles(capsule.to_trimesh(AROUND, AROUND / 2));
        triangles.swept([capsule.segment.a, capsule.segment.b], capsule.radius)
    }

    fn of_cuboid(cuboid: &Cuboid) -> Self {
        let (mut points, mut faces) = (vec![], vec![]);
        let count = CUBOID_SQUARES;
        for (axis, side) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
            let first = points.len() as u32;
            let step = |index: u32| 2.0 * f64::from(index) / f64::from(count) - 1.0;
            for (i, j) in (0..=count).flat_map(|i| (0..=count).map(move |j| (i, j))) {
                let mut point = [0.0; 3];
                (point[axis], point[(axis + 1) % 3], point[(axis + 2) % 3]) = (side, step(i), step(j));
                points.push(Vector3::from(point).component_mul(&to_core(cuboid.half_extents)).into());
            }
            for (i, j) in (0..count).flat_map(|i| (0..count).map(move |j| (i, j))) {
                let corner = |i, j| first + i * (count + 1) + j;
                let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        Self::new(points, faces)
    }

    fn swept(self, segment: [Vector; 2], radius: f32) -> Self {
        Self { rounding: Rounding::Swept { segment: segment.map(to_core), radius: f64::from(radius) }, ..self }
    }

    fn with_border(self, radius: f32) -> Self {
        Self { rounding: Rounding::Border(f64::from(radius)), ..self }
    }

    /// How far the true surface can be outside of the triangles.
    pub fn border(&self) -> f64 {
        match self.rounding {
            Rounding::Sharp => 0.0,
            Rounding::Border(radius) => radius,
            // Half an angle between vertices, in either direction: 1 − cos²(π/16) and what is lost at poles.
            Rounding::Swept { radius, .. } => 0.05 * radius,
        }
    }

    fn placed(&self, pose: &Pose) -> Self {
        let place = |point: Vector3<f64>| to_core(pose.transform_point(to_parry(point)));
        let rounding = match self.rounding {
            Rounding::Swept { segment, radius } => Rounding::Swept { segment: segment.map(place), radius },
            other => other,
        };
        let points = self.points.iter().map(|point| place(Vector3::from(*point)).into()).collect();
        Self { rounding, ..Self::new(points, self.faces.clone()) }
    }

    fn make_clusters(&mut self) {
        let count = self.faces.len();
        let (mut order, mut boxes) = (vec![0; count], vec![Aabb::EVERYWHERE; cluster_count(count)]);
        let mut scratch = vec![ClusterKey::default(); count];
        if Clusters::build(&self.points, &self.faces, &mut scratch, &mut order, &mut boxes).is_some() {
            (self.order, self.boxes) = (order, boxes);
        }
    }

    /// `None` if they were not made.
    pub fn clusters(&self) -> Option<Clusters<'_>> {
        Clusters::from_parts(&self.order, &self.boxes).filter(|clusters| !clusters.order().is_empty())
    }
}
