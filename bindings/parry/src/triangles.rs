//! Which triangles stand for a shape, in its own frame?
//!
//! | shape | triangles |
//! |---|---|
//! | ball, capsule | 16 around, inscribed; points of contact are then moved onto the true surface |
//! | cuboid | each side in up to 4 × 4 squares, so that a wide side can rest on several bumps |
//! | cylinder, cone | 32 around, inscribed |
//! | convex polyhedron, mesh, height field, voxels, triangle | its own |
//! | segment, polyline, ball or capsule without a radius | triangles without area |
//! | rounded shape | those of the shape within, and a border around them |
//! | compound | those of its parts |
//! | field | the mesh that it was given |

use std::sync::Arc;

use parry3d::bounding_volume::{Aabb, BoundingVolume};
use parry3d::math::Vector;
use parry3d::shape::{Capsule, Cuboid, Shape, TriMeshFlags, Triangle, TypedShape};
use sdf_core::nalgebra::Vector3;

use crate::convert::to_core;
use crate::shape::SdfShape;
use crate::surface::{Part, Rounding, Surface};

/// Squares along the sides of a cuboid's faces.
const CUBOID_SQUARES: u32 = 4;

/// Triangles around round shapes.
const AROUND: u32 = 16;

/// The surface of a shape; `None` if it has none that is finite and known.
pub(crate) fn surface_of(shape: &dyn Shape) -> Option<Arc<Surface>> {
    match shape.as_typed_shape() {
        TypedShape::Custom(_) => shape.as_shape::<SdfShape>()?.mesh().cloned(),
        TypedShape::HalfSpace(_) => None,
        TypedShape::TriMesh(mesh) if mesh.flags().contains(TriMeshFlags::DEFORMABLE) => None,
        TypedShape::Compound(compound) => {
            let mut all = Surface::default();
            for (pose, part) in compound.shapes() {
                all.parts.extend(surface_of(&**part)?.parts.iter().map(|part| part.placed(pose)));
            }
            Some(Arc::new(all))
        }
        simple => Some(Arc::new(Surface { parts: vec![part_of(simple)?] })),
    }
}

/// Faces from which on a cast sorts them into clusters.
const MANY_FACES: usize = 64;

/// The triangles of a large surface that may meet a box, and all of a small one. `None` as by [`surface_of`].
pub(crate) fn surface_near(shape: &dyn Shape, region: &Aabb) -> Option<Arc<Surface>> {
    let surface = parts_near(shape, region)?;
    let is_large = surface.parts.iter().any(|part| part.faces.len() >= MANY_FACES);
    Some(Arc::new(if is_large { surface.with_clusters() } else { surface }))
}

fn parts_near(shape: &dyn Shape, region: &Aabb) -> Option<Surface> {
    let of_one = |triangles: Vec<Triangle>| {
        let corners = triangles.iter().flat_map(|triangle| triangle.vertices().map(|corner| to_core(corner).into()));
        let part = Part::from_corners(corners.collect());
        part.points.as_flattened().iter().all(|x| x.is_finite()).then(|| Surface { parts: vec![part] })
    };
    match shape.as_typed_shape() {
        TypedShape::TriMesh(mesh) if !mesh.flags().contains(TriMeshFlags::DEFORMABLE) => {
            of_one(mesh.bvh().intersect_aabb(region).map(|face| mesh.triangle(face)).collect())
        }
        TypedShape::HeightField(heights) => {
            let mut triangles = vec![];
            heights.map_elements_in_local_aabb(region, &mut |_, triangle| triangles.push(*triangle));
            of_one(triangles)
        }
        TypedShape::Custom(_) => {
            let mesh = shape.as_shape::<SdfShape>()?.mesh()?;
            let region = sdf_core::Aabb { min: to_core(region.mins).into(), max: to_core(region.maxs).into() };
            Some(Surface { parts: mesh.parts.iter().map(|part| part.near(&region)).collect() })
        }
        TypedShape::Compound(compound) => {
            let mut all = Surface::default();
            for (pose, part) in compound.shapes() {
                let region = region.transform_by(&pose.inverse());
                if part.compute_local_aabb().intersects(&region) {
                    all.parts.extend(parts_near(&**part, &region)?.parts.iter().map(|part| part.placed(pose)));
                }
            }
            Some(all)
        }
        _ => surface_of(shape).map(Arc::unwrap_or_clone),
    }
}

fn part_of(shape: TypedShape) -> Option<Part> {
    let part = match shape {
        TypedShape::Ball(ball) if ball.radius <= 0.0 => of_triangles((vec![Vector::ZERO], vec![[0; 3]])),
        TypedShape::Ball(ball) => {
            swept(of_triangles(ball.to_trimesh(AROUND, AROUND / 2)), [Vector::ZERO; 2], ball.radius)
        }
        TypedShape::Capsule(Capsule { segment, radius }) if *radius <= 0.0 => {
            of_triangles((vec![segment.a, segment.b], vec![[0, 1, 1]]))
        }
        TypedShape::Capsule(capsule) => of_capsule(capsule),
        TypedShape::Cuboid(cuboid) => of_cuboid(cuboid),
        TypedShape::Cylinder(cylinder) => of_triangles(cylinder.to_trimesh(2 * AROUND)),
        TypedShape::Cone(cone) => of_triangles(cone.to_trimesh(2 * AROUND)),
        TypedShape::ConvexPolyhedron(hull) => of_triangles(hull.to_trimesh()),
        TypedShape::HeightField(heights) => of_triangles(heights.to_trimesh()),
        TypedShape::Voxels(voxels) => of_triangles(voxels.to_trimesh()),
        TypedShape::TriMesh(mesh) => of_triangles((mesh.vertices().to_vec(), mesh.indices().to_vec())),
        TypedShape::Triangle(triangle) => of_triangles((triangle.vertices().to_vec(), vec![[0, 1, 2]])),
        TypedShape::Segment(segment) => of_triangles((vec![segment.a, segment.b], vec![[0, 1, 1]])),
        TypedShape::Polyline(line) => {
            let faces = line.indices().iter().map(|[a, b]| [*a, *b, *b]).collect();
            of_triangles((line.vertices().to_vec(), faces))
        }
        TypedShape::RoundCuboid(round) => with_border(of_cuboid(&round.inner_shape), round.border_radius),
        TypedShape::RoundTriangle(round) => {
            with_border(part_of(TypedShape::Triangle(&round.inner_shape))?, round.border_radius)
        }
        TypedShape::RoundCylinder(round) => {
            with_border(part_of(TypedShape::Cylinder(&round.inner_shape))?, round.border_radius)
        }
        TypedShape::RoundCone(round) => {
            with_border(part_of(TypedShape::Cone(&round.inner_shape))?, round.border_radius)
        }
        TypedShape::RoundConvexPolyhedron(round) => {
            with_border(part_of(TypedShape::ConvexPolyhedron(&round.inner_shape))?, round.border_radius)
        }
        _ => return None,
    };
    let is_finite = part.points.as_flattened().iter().all(|x| x.is_finite()) && part.border().is_finite();
    is_finite.then_some(part)
}

fn of_triangles((points, faces): (Vec<Vector>, Vec<[u32; 3]>)) -> Part {
    Part::new(points.into_iter().map(|point| to_core(point).into()).collect(), faces)
}

fn of_capsule(capsule: &Capsule) -> Part {
    let triangles = of_triangles(capsule.to_trimesh(AROUND, AROUND / 2));
    swept(triangles, [capsule.segment.a, capsule.segment.b], capsule.radius)
}

fn of_cuboid(cuboid: &Cuboid) -> Part {
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
    Part::new(points, faces)
}

fn swept(part: Part, segment: [Vector; 2], radius: f32) -> Part {
    part.with_rounding(Rounding::Swept { segment: segment.map(to_core), radius: f64::from(radius) })
}

fn with_border(part: Part, radius: f32) -> Part {
    part.with_rounding(Rounding::Border(f64::from(radius)))
}
