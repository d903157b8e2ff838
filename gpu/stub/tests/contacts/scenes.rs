//! Fields of all kinds that the card knows, and what `sdf-core` finds in them on the CPU.

use sdf_core::contact::{Contact, Element, Feature, Outcome, contact, lean_contact};
use sdf_core::grid::PlainNormals;
use sdf_core::grid::owned::{Layout, Precision};
use sdf_core::minimize::Minimizer;
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placement, Rigid, Similarity};
use sdf_core::shapes::{Capsule, Cone, Cuboid, Cylinder, Sphere, Torus};
use sdf_core::{AnyField, Simplex};
use sdf_field::{BakeOptions, Field, GridSize, MeshView};
use sdf_procedural::SpikedBall;

/// A field and a mesh about it.
pub struct Scene {
    pub kind: &'static str,
    pub field: AnyField,
    pub points: Vec<[f32; 3]>,
    pub faces: Vec<[u32; 3]>,
    pub edges: Vec<[u32; 2]>,
    pub margin: f32,
}

/// Fields by the names that kernels have for them.
pub fn scenes() -> Vec<Scene> {
    ["dense", "sparse_f32", "sparse_u16", "shapes"].map(scene).into()
}

pub fn scene(kind: &'static str) -> Scene {
    let field = match kind {
        "dense" => baked(Layout::Dense, None),
        "sparse_f32" => baked(Layout::Sparse, Some(Precision::F32)),
        "sparse_u16" => baked(Layout::Sparse, Some(Precision::U16)),
        "sparse_u8" => baked(Layout::Sparse, Some(Precision::U8)),
        "dense_u16" => baked(Layout::Dense, Some(Precision::U16)),
        "dense_u8" => baked(Layout::Dense, Some(Precision::U8)),
        _ => shapes(),
    };
    let (points, faces) = triangles();
    let edges = faces.iter().map(|[a, b, _]| [*a, *b]).collect();
    Scene { kind, field, points, faces, edges, margin: 0.02 }
}

fn baked(layout: Layout, precision: Option<Precision>) -> AnyField {
    let mesh = SpikedBall { levels: 1, radius: 0.5 }.mesh();
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let options = BakeOptions { size: GridSize::Cells(24), layout, precision, ..BakeOptions::default() };
    Field::bake(view, &options).unwrap().field.into_any()
}

/// One of each, some of them placed.
fn shapes() -> AnyField {
    let at = |translation, scale| Similarity::new(translation, [0.1, 0.7, -0.2, 0.6], scale).unwrap();
    let parts = vec![
        AnyField::from(Sphere::new(0.4).unwrap()),
        AnyField::from(Cuboid::new([0.1, 0.2, 0.3]).unwrap()).placed(at([0.5, 0.0, 0.1], 0.75)),
        AnyField::from(Capsule::new([-0.5, -0.5, 0.0], [-0.2, 0.6, 0.3], 0.1).unwrap()),
        AnyField::from(Cylinder::new(0.2, 0.3).unwrap()).placed(at([-0.4, 0.3, -0.5], 1.25)),
        AnyField::from(Cone::new(0.3, 0.6).unwrap()).placed(at([0.2, -0.6, 0.4], 1.0)),
        AnyField::from(Torus::new(0.8, 0.1).unwrap()),
    ];
    AnyField::union(parts).unwrap()
}

/// Triangles of all sizes in and around the cube from −1 to 1, one without area, and some that are refused: 517, no multiple of a block.
fn triangles() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let at = |step: u32, stride: f32| (step as f32 * stride).fract() * 2.4 - 1.2;
    let (mut points, mut faces) = (vec![], vec![]);
    for face in 0..517_u32 {
        let first = [0.618_034, 0.754_878, 0.569_840].map(|stride| at(face, stride));
        let size = [0.02, 0.2, 1.0][face as usize % 3];
        for corner in 0..3_u32 {
            let offset = [0.347, 0.871, 0.229].map(|stride| at(3 * face + corner, stride) * size);
            points.push([0, 1, 2].map(|axis| first[axis] + offset[axis]));
        }
        faces.push([3 * face, 3 * face + 1, 3 * face + 2]);
    }
    faces[7] = [30, 30, 31];
    points[60] = [f32::NAN, 0.0, 0.0];
    points[90] = [0.0, f32::INFINITY, 0.0];
    (points, faces)
}

impl Scene {
    /// The contacts of elements by `contact::<f32, …>`, and how many elements are refused.
    pub fn expected<M: Minimizer<N>, const N: usize>(
        &self,
        elements: &[[u32; N]],
        method: &M,
    ) -> (Vec<Contact<f32>>, u32) {
        self.found(elements, |element| contact(&self.field, method, self.margin, element))
    }

    /// The same by `lean_contact` and plain normals.
    pub fn expected_lean<M: Minimizer<N>, const N: usize>(
        &self,
        elements: &[[u32; N]],
        method: &M,
    ) -> (Vec<Contact<f32>>, u32) {
        let field = PlainNormals(&self.field);
        self.found(elements, |element| lean_contact(&field, method, self.margin, element))
    }

    fn found<const N: usize>(
        &self,
        elements: &[[u32; N]],
        outcome: impl Fn(&Element<f32, N>) -> Outcome<f32, N>,
    ) -> (Vec<Contact<f32>>, u32) {
        let (mut contacts, mut skipped) = (vec![], 0);
        for element in self.elements(elements) {
            match outcome(&element) {
                Outcome::Contact(contact) => contacts.push(contact),
                Outcome::NotFinite => skipped += 1,
                Outcome::Culled | Outcome::Separated(_) => {}
            }
        }
        assert!(contacts.len() > 20, "{}: {} contacts", self.kind, contacts.len());
        (contacts, skipped)
    }

    pub fn elements<const N: usize>(&self, elements: &[[u32; N]]) -> Vec<Element<f32, N>> {
        let element = |(id, vertices): (u32, &[u32; N])| Element {
            id,
            vertices: *vertices,
            simplex: Simplex { corners: vertices.map(|vertex| Vector3::from(self.points[vertex as usize])) },
        };
        (0..).zip(elements).map(element).collect()
    }

    pub fn vertices(&self) -> Vec<[u32; 1]> {
        (0..self.points.len() as u32).map(|vertex| [vertex]).collect()
    }
}

/// Points of the world in the frame of a field that stands there.
pub fn pulled(points: &[[f32; 3]], pose: &Rigid) -> Vec<[f32; 3]> {
    points.iter().map(|point| pose.pull(Vector3::from(*point).map(f64::from)).point.map(|x| x as f32).into()).collect()
}

/// A contact of the field's frame in the world.
pub fn pushed(contact: &Contact<f32>, pose: &Rigid) -> Contact<f32> {
    let push = |point: Vector3<f32>| pose.push(point.map(f64::from)).map(|x| x as f32);
    let turn = Rigid::new([0.0; 3], pose.rotation()).unwrap();
    Contact {
        point: push(contact.point),
        surface_point: push(contact.surface_point),
        normal: turn.push(contact.normal.map(f64::from)).map(|x| x as f32),
        ..*contact
    }
}

/// Every number of a contact.
pub fn bits(contact: &Contact<f32>) -> Vec<u32> {
    let feature = match contact.feature {
        Feature::Vertex(vertex) => [0, vertex, 0],
        Feature::Edge([a, b]) => [1, a, b],
        Feature::Face(face) => [2, face, 0],
    };
    let mut bits = vec![contact.kind as u32, contact.element, contact.rank, contact.evaluations, contact.status as u32];
    bits.extend(contact.vertices.iter().chain(&feature));
    let vectors = [contact.point, contact.surface_point, contact.normal];
    let numbers =
        [contact.slope, contact.distance, contact.lower_bound, contact.error_bound, contact.shape_lower_bound];
    let all = contact.weights.iter().chain(vectors.iter().flatten()).chain(&numbers);
    bits.extend(all.map(|number| number.to_bits()));
    bits
}

/// Fails at the first contact that is not the expected one.
pub fn assert_equal(found: &[Contact<f32>], expected: &[Contact<f32>], what: &str) {
    for (found, expected) in found.iter().zip(expected) {
        assert!(bits(found) == bits(expected), "{what}: {found:#?} in place of {expected:#?}");
    }
    assert_eq!(found.len(), expected.len(), "{what}");
}
