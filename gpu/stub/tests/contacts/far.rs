//! Scenes far from the origin, where a step of f32 is a fraction of their size: does the card find the contacts that there are?

use sdf_core::contact::Contact;
use sdf_core::placed::{Rigid, Similarity};
use sdf_core::shapes::{Capsule, Cuboid, Sphere};
use sdf_core::{AnyField, Sdf};
use sdf_field::cuda::{Cuda, CudaError, CudaFaces, CudaMesh, CudaPoints};
use sdf_field::{BakeOptions, ContactOptions, Elements, Field, GridSize, MeshView, Method};
use sdf_gpu::Ready;
use sdf_procedural::SpikedBall;

use crate::lent::Other;
use crate::scenes::scene;
use crate::with_stub;

/// 1.5 to 3 million sizes away: a step of f32 is half a unit there.
const FAR: [f64; 3] = [4_194_304.0, -2_097_152.0, 3_145_728.0];

fn moved(points: &[[f32; 3]], by: [f64; 3]) -> Vec<[f64; 3]> {
    points.iter().map(|point| [0, 1, 2].map(|axis| f64::from(point[axis]) + by[axis])).collect()
}

fn there() -> Option<Rigid> {
    Rigid::new(FAR, [0.0, 0.0, 0.0, 1.0])
}

/// Compares what does not depend on the place bit for bit; rounding in f64 far away may change points, and bounds are lowered for it.
fn check_same(near: &[Contact<f64>], far: &[Contact<f64>], kind: &str) {
    assert!(near.len() > 20, "{kind}");
    assert_eq!(near.len(), far.len(), "{kind}");
    for (near, far) in near.iter().zip(far) {
        let place = |contact: &Contact<f64>| (contact.element, contact.distance, contact.normal, contact.weights);
        assert_eq!(place(near), place(far), "{kind}");
        let below = near.lower_bound - far.lower_bound;
        // 16 ε of the largest coordinate, of each corner, times the slope.
        assert!((0.0..1e-7).contains(&below), "{kind}: {below}");
        for axis in 0..3 {
            let off = far.point[axis] - FAR[axis] - near.point[axis];
            assert!(off.abs() < 1e-9, "{kind}: a point is off by {off}");
        }
    }
}

#[test]
fn a_body_has_the_same_contacts_wherever_it_is_moved() {
    with_stub("far::a_body_has_the_same_contacts_wherever_it_is_moved", &[], |folder| {
        let cuda = Cuda::open(&folder.join("kernels.ptx")).unwrap();
        for kind in ["dense", "sparse_u16", "shapes"] {
            let scene = scene(kind);
            let field = Field::new(scene.field.clone());
            let options =
                ContactOptions { margin: scene.margin.into(), method: Method::FrankWolfe, ..Default::default() };
            let [near_points, far_points] = [[0.0; 3], FAR].map(|place| moved(&scene.points, place));
            let mesh = |points| MeshView { points, faces: &scene.faces };
            let mut query = field.query_on(&cuda, mesh(&near_points), &options).unwrap();
            let near = query.contacts().unwrap().contacts;
            // There and back: points first, or the body first.
            query.set_points(CudaPoints::Slice(&far_points)).unwrap();
            query.set_pose(there()).unwrap();
            check_same(&near, &query.contacts().unwrap().contacts, kind);
            assert!(matches!(query.contacts_on_card(), Err(CudaError::FarFromOrigin)), "{kind}");
            query.set_pose(None).unwrap();
            query.set_points(CudaPoints::Slice(&near_points)).unwrap();
            assert_eq!(near, query.contacts().unwrap().contacts, "{kind}");
            let options = ContactOptions { pose: there(), ..options };
            let mut query = field.query_on(&cuda, mesh(&far_points), &options).unwrap();
            check_same(&near, &query.contacts().unwrap().contacts, kind);
        }
    });
}

/// A ball with spikes, or shapes, that stand far away in their own frame.
fn far_field(kind: &str) -> Field {
    let at = |x: f64, y: f64| [FAR[0] + x, FAR[1] + y, FAR[2]];
    if kind == "shapes" {
        let place = Similarity::new(at(0.5, 0.1), [0.1, 0.7, -0.2, 0.6], 0.75).unwrap();
        let ball = Similarity::new(at(-0.3, 0.2), [0.0, 0.0, 0.0, 1.0], 1.0).unwrap();
        let parts = vec![
            AnyField::from(Sphere::new(0.4).unwrap()).placed(ball),
            AnyField::from(Cuboid::new([0.3, 0.4, 0.5]).unwrap()).placed(place),
            AnyField::from(Capsule::new(at(-0.5, -0.5), at(0.6, -0.3), 0.2).unwrap()),
        ];
        return Field::new(AnyField::union(parts).unwrap());
    }
    let mesh = SpikedBall { levels: 1, radius: 0.5 }.mesh();
    let points: Vec<_> = mesh.points.iter().map(|point| [0, 1, 2].map(|axis| point[axis] + FAR[axis])).collect();
    let options = BakeOptions { size: GridSize::Cells(24), ..BakeOptions::default() };
    Field::bake(MeshView { points: &points, faces: &mesh.triangles }, &options).unwrap().field
}

/// In f32 from the origin all points of a scene would be the corners of a few cubes of 0.5.
#[test]
fn a_field_far_away_in_its_own_frame_has_the_contacts_of_the_cpu() {
    with_stub("far::a_field_far_away_in_its_own_frame_has_the_contacts_of_the_cpu", &[], |folder| {
        let cuda = Cuda::open(&folder.join("kernels.ptx")).unwrap();
        let turned = Rigid::new([-FAR[1], 10.0, FAR[2]], [0.5, 0.5, 0.5, 0.5]).unwrap();
        for (kind, pose) in [("dense", None), ("shapes", None), ("dense", Some(turned)), ("shapes", Some(turned))] {
            let (scene, field) = (scene("shapes"), far_field(kind));
            let place = |point: [f64; 3]| pose.map_or(point, |pose| pose.push(point.into()).into());
            let points: Vec<[f64; 3]> = moved(&scene.points, FAR).into_iter().map(place).collect();
            let mesh = MeshView { points: &points, faces: &scene.faces };
            for elements in [Elements::Vertices, Elements::Faces] {
                let options = ContactOptions { margin: 0.02, pose, elements, ..ContactOptions::default() };
                let by_cpu = field.contacts(mesh, &options).unwrap().contacts;
                let by_card = field.contacts_on(&cuda, mesh, &options).unwrap().contacts;
                assert!(by_cpu.len() > 20, "{kind}: {}", by_cpu.len());
                // f32 rounds positions of up to 32 sizes from the point that the card counts from, twice at most: 2 · 64 · 6e-8 and room.
                let tolerance = 2e-5;
                let is_clear = |contact: &&Contact<f64>| contact.distance < 0.02 - tolerance;
                let ids = |contacts: &[Contact<f64>]| contacts.iter().filter(is_clear).map(|c| c.element).collect();
                let [cpu_ids, card_ids]: [Vec<u32>; 2] = [&by_cpu, &by_card].map(|contacts| ids(contacts));
                let all = |contacts: &[Contact<f64>]| contacts.iter().map(|c| c.element).collect::<Vec<_>>();
                assert!(card_ids.iter().all(|id| all(&by_cpu).contains(id)), "{kind}: a contact that the CPU lacks");
                assert!(cpu_ids.iter().all(|id| all(&by_card).contains(id)), "{kind}: a contact is missing");
                for contact in &by_card {
                    let local = pose.map_or(contact.point, |pose| {
                        pose.isometry().inverse_transform_vector(
                            &(contact.point - sdf_core::nalgebra::Vector3::from(pose.translation())),
                        )
                    });
                    let value = field.as_any().value(local);
                    assert!((value - contact.distance).abs() < tolerance, "{kind}: {contact:?}, φ {value}");
                    assert!(contact.lower_bound <= value, "{kind}: {contact:?}, φ {value}");
                }
            }
        }
    });
}

/// Points of the card are in the world's coordinates: what f32 has of them counts, and the field is moved to them.
#[test]
fn lent_points_count_where_they_are() {
    with_stub("far::lent_points_count_where_they_are", &[], |folder| {
        let cuda = Cuda::open(&folder.join("kernels.ptx")).unwrap();
        for kind in ["dense", "shapes"] {
            let (scene, field) = (scene("shapes"), far_field(kind));
            let on_card: Vec<[f32; 3]> = moved(&scene.points, FAR).iter().map(|p| p.map(|x| x as f32)).collect();
            let points: Vec<[f64; 3]> = on_card.iter().map(|point| point.map(f64::from)).collect();
            let options = ContactOptions { margin: 0.02, elements: Elements::Vertices, ..ContactOptions::default() };
            let by_cpu = field.contacts(MeshView { points: &points, faces: &[] }, &options).unwrap().contacts;
            let other = Other::new(on_card.as_flattened());
            let lent = CudaPoints::Lent(other.lend(cuda.gpu(), Ready::AfterAll));
            let mesh = CudaMesh { points: lent, faces: CudaFaces::Slice(&[]) };
            let mut query = field.query_on(&cuda, mesh, &options).unwrap();
            let by_card = query.contacts().unwrap().contacts;
            let key = |contact: &Contact<f64>| (contact.element, (contact.distance * 1e4).round());
            let [by_cpu, by_card] = [by_cpu, by_card].map(|found| found.iter().map(key).collect::<Vec<_>>());
            assert!(by_cpu.len() > 20, "{kind}: {}", by_cpu.len());
            assert_eq!(by_cpu, by_card, "{kind}");
            // Those of a slice are from another point.
            query.set_points(CudaPoints::Slice(&points)).unwrap();
            let again: Vec<_> = query.contacts().unwrap().contacts.iter().map(key).collect();
            assert_eq!(by_cpu, again, "{kind}");
        }
    });
}
