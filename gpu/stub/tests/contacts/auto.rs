//! Searches that are certified on the card, and what is left to the CPU: is no element missed, and does every bound hold on the elements
//! as they were given, in f64?

use sdf_core::contact::{Contact, Outcome, contact_at, cull};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placement, Rigid};
use sdf_field::cuda::{Cuda, CudaError};
use sdf_field::{ContactOptions, Field, MeshView, Method, Threads};
use sdf_gpu::{Elements, GpuField, GpuMesh, GpuQuery, QueryOptions, Unsettled};

use crate::scenes::{assert_equal, scene};
use crate::{gpu, with_stub};

#[test]
fn what_the_second_launch_leaves_open_is_listed() {
    with_stub("auto::what_the_second_launch_leaves_open_is_listed", &[], |folder| {
        let (gpu, scene) = (gpu(folder), scene("dense"));
        let first = FrankWolfe::default();
        // By a coarse tolerance a minimum is known, and above the margin, where its bound is below: that decides nothing.
        for (evaluations, tolerance) in [(1, 1e-3), (2, 1e-3), (256, 1e-3), (256, 0.1)] {
            let second = Certified { evaluations, tolerance, ..Certified::default() };
            let (mut expected, mut open, mut proven, mut undecided) = (vec![], vec![], 0, 0);
            for element in scene.elements(&scene.faces) {
                let lower_bound = match cull(&scene.field, scene.margin, &element) {
                    Ok(lower_bound) => lower_bound,
                    Err(Outcome::NotFinite | Outcome::Culled) => continue,
                    Err(outcome) => panic!("{outcome:?}"),
                };
                let mut minimum = first.minimize_below(&scene.field, &element.simplex, scene.margin);
                if !(minimum.converged && minimum.sample.value <= scene.margin) {
                    minimum = second.minimize_below(&scene.field, &element.simplex, scene.margin);
                    let is_contact = minimum.converged && minimum.sample.value <= scene.margin;
                    if !is_contact && minimum.lower_bound <= scene.margin {
                        undecided += usize::from(minimum.converged);
                        open.push(element.id);
                        continue;
                    }
                    proven += usize::from(scene.margin < minimum.sample.value);
                }
                if minimum.sample.value <= scene.margin {
                    expected.push(contact_at(&scene.field, &element, &minimum, lower_bound).unwrap());
                }
            }
            let field = GpuField::new(&gpu, &scene.field).unwrap();
            let unsettled = Unsettled::CertifyThenList { evaluations };
            let options = QueryOptions { margin: scene.margin, tolerance, unsettled, ..QueryOptions::default() };
            let mesh = GpuMesh::new(&gpu, &scene.points, Elements::Faces(&scene.faces)).unwrap();
            let mut query = GpuQuery::new(&gpu, &field, mesh, &options).unwrap();
            for _ in 0..2 {
                let found = query.contacts().unwrap();
                assert_equal(&found.contacts, &expected, &format!("{evaluations} evaluations"));
                assert_eq!(found.unsettled, open, "{evaluations} evaluations");
            }
            assert_eq!(query.contacts_on_card().unwrap().is_none(), !open.is_empty());
            assert_eq!(undecided > 0, tolerance > 1e-3, "{evaluations} evaluations: {undecided} undecided");
            assert!(proven > 20 && (evaluations == 256 || !open.is_empty()), "{proven} proven, {} open", open.len());
        }
    });
}

#[test]
fn a_card_without_room_for_the_certified_kernel_leaves_it_to_the_cpu() {
    without_room("a_card_without_room_for_the_certified_kernel_leaves_it_to_the_cpu", "SDF_STUB_LOCAL_MEMORY");
}

#[test]
fn a_card_without_room_for_the_code_of_the_certified_kernel_leaves_it_to_the_cpu() {
    without_room(
        "a_card_without_room_for_the_code_of_the_certified_kernel_leaves_it_to_the_cpu",
        "SDF_STUB_CODE_MEMORY",
    );
}

/// Contacts by `auto` where the card has no memory of this kind.
fn without_room(test: &str, memory: &str) {
    with_stub(&format!("auto::{test}"), &[(memory, "0")], |folder| {
        let (cuda, scene) = (Cuda::open(&folder.join("kernels.ptx")).unwrap(), scene("dense"));
        let field = Field::new(scene.field.clone());
        let points: Vec<[f64; 3]> = scene.points.iter().map(|point| point.map(f64::from)).collect();
        let mesh = MeshView { points: &points, faces: &scene.faces };
        let options = ContactOptions { margin: f64::from(scene.margin), ..Default::default() };
        let mut query = field.query_on(&cuda, mesh, &options).unwrap();
        let ids = |contacts: &[Contact<f64>]| contacts.iter().map(|contact| contact.element).collect::<Vec<_>>();
        let by_cpu = field.contacts(mesh, &options).unwrap();
        for _ in 0..2 {
            assert_eq!(ids(&query.contacts().unwrap().contacts), ids(&by_cpu.contacts));
        }
        let certified = ContactOptions { method: Method::Certified, ..options };
        let error = field.contacts_on(&cuda, mesh, &certified).unwrap_err();
        assert!(error.to_string().contains("memory"), "{error}");
    });
}

#[test]
fn certified_on_a_card_counts_what_stays_undecided_as_the_cpu_does() {
    with_stub("auto::certified_on_a_card_counts_what_stays_undecided_as_the_cpu_does", &[], |folder| {
        let (cuda, scene) = (Cuda::open(&folder.join("kernels.ptx")).unwrap(), scene("dense"));
        let field = Field::new(scene.field.clone());
        let points: Vec<[f64; 3]> = scene.points.iter().map(|point| point.map(f64::from)).collect();
        let mesh = MeshView { points: &points, faces: &scene.faces };
        let ids = |contacts: &[Contact<f64>]| contacts.iter().map(|contact| contact.element).collect::<Vec<_>>();
        for (budget, tolerance) in [(1, 1e-3), (2, 1e-3), (256, 1e-3), (256, 0.1)] {
            let margin = f64::from(scene.margin);
            let budget = Some(budget);
            let options = ContactOptions { method: Method::Certified, margin, budget, tolerance, ..Default::default() };
            let by_cpu = field.contacts(mesh, &options).unwrap();
            let mut query = field.query_on(&cuda, mesh, &options).unwrap();
            let by_card = query.contacts().unwrap();
            assert_eq!(by_card.undecided_count, by_cpu.undecided_count, "{options:?}");
            assert_eq!(ids(&by_card.contacts), ids(&by_cpu.contacts), "{options:?}");
            let has_budget = budget == Some(256);
            assert_eq!(by_cpu.undecided_count == 0, has_budget, "{options:?}: {}", by_cpu.undecided_count);
            // The CPU searches on where a tolerance leaves an element open, a card does not.
            let is_decided = has_budget && tolerance < 0.1;
            // Without the CPU they would be left out unsaid.
            let is_left_to_cpu = matches!(query.contacts_on_card(), Err(CudaError::LeftToCpu));
            assert_eq!(is_left_to_cpu, !is_decided, "{options:?}");
        }
    });
}

/// Points on a triangle, its corners among them.
fn lattice(corners: [Vector3<f64>; 3]) -> impl Iterator<Item = Vector3<f64>> {
    const STEPS: u32 = 24;
    let [a, b, c] = corners;
    (0..=STEPS).flat_map(move |i| {
        (0..=STEPS - i).map(move |j| {
            let [u, v] = [i, j].map(|step| f64::from(step) / f64::from(STEPS));
            a * (1.0 - u - v) + b * u + c * v
        })
    })
}

/// The lowest φ that is found on each face by trying points.
fn lowest(field: &Field, points: &[[f64; 3]], faces: &[[u32; 3]], pose: Option<Rigid>) -> Vec<f64> {
    let at = |vertex: u32| Vector3::from(points[vertex as usize]);
    let local = |point: Vector3<f64>| pose.map_or(point, |pose| pose.pull(point).point).into();
    let lowest = |face: &[u32; 3]| {
        let tried: Vec<[f64; 3]> = lattice(face.map(at)).map(local).collect();
        field.values(&tried, Threads::ONE).into_iter().fold(f64::INFINITY, f64::min)
    };
    faces.iter().map(lowest).collect()
}

#[test]
fn auto_on_a_card_misses_no_element_and_its_bounds_hold() {
    with_stub("auto::auto_on_a_card_misses_no_element_and_its_bounds_hold", &[], |folder| {
        let cuda = Cuda::open(&folder.join("kernels.ptx")).unwrap();
        let far = Rigid::new([1000.0, 0.0, -3000.0], [0.0, 0.3, 1.0, 0.1]).unwrap();
        for kind in ["dense", "sparse_u16", "shapes"] {
            let scene = scene(kind);
            let field = Field::new(scene.field.clone());
            for (pose, budget) in [(None, None), (Some(far), None), (None, Some(1)), (Some(far), Some(1))] {
                let what = format!("{kind}, pose {}, {budget:?}", pose.is_some());
                // Numbers that f32 does not have.
                let place = |(point, step): (&[f32; 3], u32)| {
                    let own = Vector3::from(point.map(|x| f64::from(x) + 1e-8 * f64::from(step % 97)));
                    pose.map_or(own, |pose| pose.push(own)).into()
                };
                let points: Vec<[f64; 3]> = scene.points.iter().zip(0..).map(place).collect();
                let faces = &scene.faces;
                let options = ContactOptions { margin: f64::from(scene.margin), pose, budget, ..Default::default() };
                let mesh = MeshView { points: &points, faces };
                let mut query = field.query_on(&cuda, mesh, &options).unwrap();
                let found = query.contacts().unwrap();
                let tried = lowest(&field, &points, faces, pose);

                // Positions are rounded at up to 32 sizes from the point that the card counts from: a coordinate of 80 is off by 4e-6.
                let rounding = 1e-5;
                let is_found = |face: usize| found.contacts.iter().any(|contact| contact.element as usize == face);
                let complete = ContactOptions { budget: Some(4096), method: Method::Certified, ..options };
                let by_cpu = field.contacts(mesh, &complete).unwrap();
                for contact in by_cpu.contacts.iter().filter(|contact| contact.distance < options.margin - rounding) {
                    let is_missed = budget.is_none() && !is_found(contact.element as usize);
                    assert!(!is_missed, "{what}: {contact:?} is missed");
                }
                assert!(found.contacts.len() > 30, "{what}: {}", found.contacts.len());
                assert!(found.contacts.is_sorted_by_key(|contact| contact.element));
                for contact in &found.contacts {
                    let Contact { element, distance, lower_bound, shape_lower_bound, .. } = *contact;
                    let lowest = tried[element as usize];
                    assert!(lower_bound <= lowest + 1e-12, "{what}: {contact:?}, φ {lowest}");
                    assert!(lower_bound <= distance && shape_lower_bound <= lower_bound, "{what}: {contact:?}");
                    // Never below the truth, and within the margin.
                    let mine =
                        field.contacts(MeshView { faces: &[faces[element as usize]], ..mesh }, &complete).unwrap();
                    let minimum = mine.contacts.first().map_or(options.margin, |contact| contact.lower_bound);
                    assert!(
                        minimum - rounding <= distance && distance <= options.margin + rounding,
                        "{what}: {contact:?}"
                    );
                }
                let left = query.contacts_on_card();
                let is_right = match (pose, budget) {
                    (Some(_), _) => matches!(left, Err(CudaError::FarFromOrigin)),
                    (None, Some(_)) => matches!(left, Err(CudaError::LeftToCpu)),
                    (None, None) => left.is_ok(),
                };
                assert!(is_right, "{what}");
            }
        }
    });
}
