//! Contacts with unions of many parts, of which each element looks at those that can be lowest on it.

use sdf_field::core::contact::{Contact, Element, Feature, Outcome, contact, lean_contact};
use sdf_field::core::grid::PlainNormals;
use sdf_field::core::minimize::{FrankWolfe, Minimizer, ProjectedGradient};
use sdf_field::core::nalgebra::Vector3;
use sdf_field::core::placed::{Posed, Rigid, Similarity};
use sdf_field::core::shapes::{Capsule, Cuboid, Ellipsoid, Sphere, Torus};
use sdf_field::core::{Aabb, AnyField, EnclosedSdf, Sample, Sdf, Simplex};
use sdf_field::{BakeOptions, ContactOptions, Field, GridSize, MeshInMotion, MeshView, Method, Threads};
use sdf_procedural::random::{Random, test_seed};
use sdf_procedural::{Mesh, Sheet, SpikedBall};

const MARGIN: f64 = 0.05;

/// A sheet whose faces follow each other in no order.
fn sheet(cells: u32, random: &mut Random) -> Mesh {
    let sheet =
        Sheet { cells: [cells; 2], size: [3.0; 2], height: 0.1, bend: 0.3, floor: -1.0, holes: None, faces: None };
    let mut mesh = sheet.mesh();
    // Half of it stays in order.
    let half = mesh.triangles.len() / 2;
    random.shuffle(&mut mesh.triangles[half..]);
    mesh
}

fn view(mesh: &Mesh) -> MeshView<'_> {
    MeshView { points: &mesh.points, faces: &mesh.triangles }
}

/// Shapes of all kinds about `center`, some of them twice, and grids so coarse that their bodies may be nearer than finer ones.
fn union(count: usize, center: Vector3<f64>, random: &mut Random) -> Field {
    let body = SpikedBall { levels: 1, radius: 0.4 }.mesh();
    let options = BakeOptions { size: GridSize::Cells(6), ..BakeOptions::default() };
    let coarse = Field::bake(view(&body), &options).unwrap().field;
    let mut parts: Vec<Field> = vec![];
    for index in 0..count {
        if let Some(part) = parts.last().filter(|_| index % 9 == 8) {
            parts.push(part.clone());
            continue;
        }
        let size = random.between(0.05, 0.3);
        let part = match index % 6 {
            0 => Field::new(Sphere::new(size).unwrap()),
            1 => Field::new(Cuboid::new([size, 0.5 * size, 0.3]).unwrap()),
            2 => Field::new(Torus::new(size, 0.3 * size).unwrap()),
            3 => Field::new(Capsule::new([0.0; 3], [size, 0.1, 0.2], 0.1).unwrap()),
            4 => Field::new(Ellipsoid::new([size, 0.1, 0.2]).unwrap()),
            _ => coarse.clone(),
        };
        let [x, y, z] = random.point_in_cube(1.5);
        let rotation = [(); 4].map(|()| random.between(-1.0, 1.0));
        let translation = center + Vector3::new(x, y, 0.1 * z);
        parts.push(
            part.placed(Similarity::new(translation.into(), rotation, random.between(0.5, 1.5)).unwrap()).unwrap(),
        );
    }
    Field::union(&parts).unwrap()
}

/// Unions, and where they stand: also one that is made far from the origin, and brought back.
fn scenes(random: &mut Random) -> Vec<(Field, Option<Rigid>)> {
    let far = Vector3::new(3e5, -1e5, 2e5);
    let back = Rigid::new((-far).into(), [0.0, 0.0, 0.0, 1.0]).unwrap();
    let turned = Rigid::new([0.1, -0.05, 0.2], [0.1, 0.2, -0.3, 0.9]);
    vec![
        (union(9, Vector3::zeros(), random), None),
        (union(25, Vector3::zeros(), random), turned),
        (union(70, Vector3::zeros(), random), None),
        (union(70, far, random), Some(back)),
    ]
}

/// Every number of a contact, in digits that tell all f64 apart.
fn bits(contact: &Contact<f64>) -> String {
    format!("{contact:?}")
}

fn options(method: Method, pose: Option<Rigid>, lean: bool) -> ContactOptions {
    ContactOptions { method, pose, lean, margin: MARGIN, ..ContactOptions::default() }
}

#[test]
fn a_face_has_the_contact_with_a_union_that_it_has_alone() {
    let mut random = Random::new(test_seed(5));
    let mesh = sheet(40, &mut random);
    for (field, pose) in scenes(&mut random) {
        for (method, lean) in [(Method::Auto, false), (Method::FrankWolfe, false), (Method::Newton, true)] {
            let options = options(method, pose, lean);
            let all = field.contacts(view(&mesh), &options).unwrap();
            let mut contacts = all.contacts.iter().peekable();
            let (mut found, mut searched) = (0, 0);
            for (id, face) in (0..).zip(&mesh.triangles) {
                let mesh = MeshView { points: &mesh.points, faces: std::slice::from_ref(face) };
                let alone = field.contacts(mesh, &options).unwrap();
                searched += alone.searched_count;
                for contact in &alone.contacts {
                    let feature =
                        if let Feature::Face(_) = contact.feature { Feature::Face(id) } else { contact.feature };
                    let expected = Contact { element: id, feature, ..*contact };
                    assert_eq!(contacts.next().map(bits), Some(bits(&expected)), "by {method}");
                    found += 1;
                }
            }
            assert!(contacts.next().is_none());
            assert_eq!(searched, all.searched_count);
            assert!(found > 50, "{found}");
        }
    }
}

#[test]
fn margins_of_single_faces_leave_out_no_contact_with_a_union() {
    let mut random = Random::new(test_seed(6));
    let mesh = sheet(40, &mut random);
    let margins: Vec<_> = mesh.triangles.iter().map(|_| random.pick(&[0.0, 0.01, MARGIN])).collect();
    for (field, pose) in scenes(&mut random) {
        let options = options(Method::FrankWolfe, pose, false);
        let all = field.contacts(view(&mesh), &options).unwrap().contacts;
        let expected = all.iter().filter(|contact| contact.distance <= margins[contact.element as usize]);
        let moving = MeshInMotion { margins: Some(&margins), ..MeshInMotion::new(view(&mesh)) };
        let found = field.contacts_in_motion(&moving, &options).unwrap().contacts;
        assert!(found.iter().map(|contact| contact.element).eq(expected.map(|contact| contact.element)));
        assert!(found.len() > 20 && found.len() < all.len());
    }
}

/// Core's contacts with all parts of a union, one face at a time.
fn with_all_parts<M: Minimizer<3>>(field: &Posed<&AnyField>, method: &M, lean: bool, mesh: &Mesh) -> Vec<Contact<f64>> {
    let find = |(id, vertices): (u32, &[u32; 3])| {
        let corners = vertices.map(|vertex| Vector3::from(mesh.points[vertex as usize]));
        let element = Element { id, vertices: *vertices, simplex: Simplex { corners } };
        let outcome = match lean {
            true => lean_contact(&PlainNormals(field), method, MARGIN, &element),
            false => contact(field, method, MARGIN, &element),
        };
        if let Outcome::Contact(contact) = outcome { Some(contact) } else { None }
    };
    (0..).zip(&mesh.triangles).filter_map(find).collect()
}

#[test]
fn a_contact_with_a_union_is_that_with_all_of_its_parts() {
    let mut random = Random::new(test_seed(7));
    let mesh = sheet(40, &mut random);
    for (union, pose) in scenes(&mut random) {
        let field = Posed { field: union.as_any(), pose };
        let check = |method, lean, expected: Vec<Contact<f64>>| {
            let found = union.contacts(view(&mesh), &options(method, pose, lean)).unwrap().contacts;
            assert_eq!(found.len(), expected.len(), "{method}");
            assert!(found.len() > 50, "{}", found.len());
            for (found, expected) in found.iter().zip(&expected) {
                // Bounds in a face's box are those of the parts near it, and so are higher.
                assert!(expected.lower_bound <= found.lower_bound && found.lower_bound <= found.distance);
                assert!(expected.shape_lower_bound <= found.shape_lower_bound);
                // The bodies may be nearer by the error of any part.
                let corners = mesh.triangles[found.element as usize].map(|vertex| mesh.points[vertex as usize]);
                let error = field.error_bound(&Aabb::from_points(corners).unwrap());
                assert!(lean || error.reach(found.shape_lower_bound) <= found.lower_bound + 1e-9);
                let Contact { lower_bound, shape_lower_bound, .. } = *found;
                let expected = Contact { lower_bound, shape_lower_bound, ..*expected };
                assert_eq!(bits(found), bits(&expected), "{method}");
            }
        };
        for lean in [false, true] {
            let steps = FrankWolfe::default();
            check(Method::FrankWolfe, lean, with_all_parts(&field, &steps, lean, &mesh));
            let steps = ProjectedGradient::default();
            check(Method::ProjectedGradient, lean, with_all_parts(&field, &steps, lean, &mesh));
        }
    }
}

#[test]
fn no_point_of_a_face_is_below_its_certified_bound_in_any_part_of_a_union() {
    let mut random = Random::new(test_seed(8));
    let mesh = sheet(40, &mut random);
    for (union, pose) in scenes(&mut random) {
        let field = Posed { field: union.as_any(), pose };
        let contacts = union.contacts(view(&mesh), &options(Method::Auto, pose, false)).unwrap().contacts;
        assert!(contacts.len() > 50);
        for contact in &contacts {
            let corners = mesh.triangles[contact.element as usize].map(|v| Vector3::from(mesh.points[v as usize]));
            let simplex = Simplex { corners };
            for _ in 0..200 {
                let mut weights = [(); 3].map(|()| -random.unit().max(1e-300).ln());
                let sum: f64 = weights.iter().sum();
                weights = weights.map(|weight| weight / sum);
                let value = field.value(simplex.point(weights));
                assert!(contact.lower_bound <= value + 1e-9, "{contact:?}: {value}");
            }
        }
    }
}

/// Small bodies within a unit cube.
fn crowd(count: usize, random: &mut Random) -> Vec<Field> {
    let part = |index: usize, random: &mut Random| {
        let shape = match index % 3 {
            0 => Field::new(Sphere::new(0.05).unwrap()),
            1 => Field::new(Torus::new(0.06, 0.02).unwrap()),
            _ => Field::new(Cuboid::new([0.05, 0.03, 0.08]).unwrap()),
        };
        let rotation = [(); 4].map(|()| random.between(-1.0, 1.0));
        shape.placed(Similarity::new(random.point_in_cube(1.0), rotation, 1.0).unwrap()).unwrap()
    };
    (0..count).map(|index| part(index, random)).collect()
}

#[test]
fn no_deep_contact_with_many_parts_is_missed_in_any_order() {
    let mut random = Random::new(test_seed(9));
    for (count, size) in [(30, 2.0), (100, 2.0), (300, 0.5), (300, 2.0)] {
        let parts = crowd(count, &mut random);
        let mut others = parts.clone();
        random.shuffle(&mut others);
        let mut mesh = Mesh::default();
        for first in (0..300).step_by(3) {
            let middle = Vector3::from(random.point_in_cube(1.0));
            let corner =
                |random: &mut Random| -> [f64; 3] { (middle + Vector3::from(random.point_in_cube(size))).into() };
            mesh.points.extend([(); 3].map(|()| corner(&mut random)));
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        let deepest = |parts: &[Field], method| {
            let contacts = Field::union(parts).unwrap().contacts(view(&mesh), &options(method, None, false)).unwrap();
            let mut deepest = vec![f64::INFINITY; mesh.triangles.len()];
            contacts.contacts.iter().for_each(|contact| deepest[contact.element as usize] = contact.distance);
            deepest
        };
        let sampled = deepest(&parts, Method::SamplingWithCorners(1000));
        let touching = sampled.iter().filter(|distance| **distance < -1e-3).count();
        assert!(touching > 5, "{touching}");
        for parts in [&parts, &others] {
            for (found, sampled) in deepest(parts, Method::Auto).iter().zip(&sampled) {
                assert!(
                    *sampled >= -1e-3 || *found < 0.0,
                    "{count} parts, faces of {size}: {found}, sampled {sampled}"
                );
            }
        }
    }
}

/// Points that follow each other are evaluated in the parts that can be lowest about them: with the bits of all parts. Of rows of points, of
/// points in no order, and with some that are not finite among them.
#[test]
fn samples_of_a_union_are_those_of_all_its_parts() {
    let seed = test_seed(1123);
    let mut random = Random::new(seed);
    for (count, center) in [(1, 0.0), (2, 0.0), (40, 0.0), (120, 1e6)] {
        let center = Vector3::repeat(center);
        let field = union(count, center, &mut random);
        let mut points: Vec<[f64; 3]> = vec![];
        for _ in 0..30 {
            let (start, way) = (Vector3::from(random.point_in_cube(2.0)), Vector3::from(random.point_in_cube(0.02)));
            points.extend((0..70).map(|step| <[f64; 3]>::from(center + start + way * f64::from(step))));
        }
        points.extend((0..1000).map(|_| <[f64; 3]>::from(center + Vector3::from(random.point_in_cube(3.0)))));
        for bad in [f64::NAN, f64::INFINITY, 1e200] {
            let index = random.below(points.len());
            points[index][1] = bad;
        }
        let alone = |point: &[f64; 3]| field.as_any().sample(Vector3::from(*point));
        let bits = |samples: Vec<Sample<f64>>| -> Vec<_> {
            let bits =
                |sample: Sample<f64>| ([sample.value.to_bits()], sample.gradient.map(f64::to_bits), sample.status);
            samples.into_iter().map(bits).collect()
        };
        let wanted: Vec<Sample<f64>> = points.iter().map(alone).collect();
        let values: Vec<u64> = field.values(&points, Threads::ONE).into_iter().map(f64::to_bits).collect();
        let of_sample = |sample: &Sample<f64>| if sample.status.not_finite { f64::NAN } else { sample.value }.to_bits();
        assert_eq!(values, wanted.iter().map(of_sample).collect::<Vec<_>>(), "{count} parts, seed {seed}");
        assert_eq!(bits(field.sample(&points, Threads::ALL)), bits(wanted), "{count} parts, seed {seed}");
    }
}
