//! The second launch: what a local search does not settle, searched again by the certified method, on the card or elsewhere.

use sdf_core::contact::{Contact, Element, Outcome, contact_at, cull};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer};
use sdf_gpu::{Elements, GpuContacts, GpuError, GpuField, GpuMesh, GpuQuery, QueryOptions, Stages, Unsettled};

use crate::scenes::{Scene, assert_equal, scene};
use crate::{gpu, with_stub};

/// So few that many searches end before their condition holds.
const STEPS: u32 = 3;

const EVALUATIONS: u32 = 256;

/// Result of the two searches on an element: a contact of the first, or what the second makes of it.
enum Settled {
    Not(Option<Contact<f32>>),
    First(Contact<f32>),
    Neither,
}

fn settle(scene: &Scene, element: &Element<f32, 3>) -> Settled {
    let Scene { field, margin, .. } = scene;
    let lower_bound = match cull(field, *margin, element) {
        Ok(lower_bound) => lower_bound,
        Err(Outcome::NotFinite | Outcome::Culled) => return Settled::Neither,
        Err(outcome) => panic!("{outcome:?}"),
    };
    let first = FrankWolfe { iterations: STEPS, ..FrankWolfe::default() };
    let minimum = first.minimize_below(field, &element.simplex, *margin);
    if minimum.sample.value <= *margin && minimum.converged {
        return Settled::First(contact_at(field, element, &minimum, lower_bound).unwrap());
    }
    let second = Certified { evaluations: EVALUATIONS, ..Certified::default() };
    let minimum = second.minimize_below(field, &element.simplex, *margin);
    let is_contact = minimum.sample.value <= *margin;
    Settled::Not(if is_contact { contact_at(field, element, &minimum, lower_bound) } else { None })
}

fn found(gpu: &sdf_gpu::Gpu, scene: &Scene, options: QueryOptions) -> Result<GpuContacts, GpuError> {
    let field = GpuField::new(gpu, &scene.field)?;
    let mesh = GpuMesh::new(gpu, &scene.points, Elements::Faces(&scene.faces))?;
    GpuQuery::new(gpu, &field, mesh, &QueryOptions { margin: scene.margin, iterations: STEPS, ..options })?.contacts()
}

#[test]
fn what_the_first_launch_leaves_open_the_second_settles() {
    with_stub("second::what_the_first_launch_leaves_open_the_second_settles", &[], |folder| {
        let (gpu, scene) = (gpu(folder), scene("dense"));
        let (mut expected, mut unsettled, mut missed) = (vec![], 0, 0);
        for element in scene.elements(&scene.faces) {
            match settle(&scene, &element) {
                Settled::First(contact) => expected.push(contact),
                Settled::Not(contact) => {
                    unsettled += 1;
                    missed += usize::from(contact.is_some());
                    expected.extend(contact);
                }
                Settled::Neither => {}
            }
        }
        assert!(unsettled > 20 && missed > 20, "{unsettled} not settled, {missed} of them contacts");
        let twice = Unsettled::Certify { evaluations: EVALUATIONS };
        let certified = found(&gpu, &scene, QueryOptions { unsettled: twice, ..QueryOptions::default() }).unwrap();
        assert_equal(&certified.contacts, &expected, "two launches");
        assert_eq!(certified.unsettled_count, unsettled);
        assert!(certified.unsettled.is_empty());

        // No element within the margin is missed: those that the certified method finds by itself.
        let alone = Certified { evaluations: EVALUATIONS, ..Certified::default() };
        let (complete, _) = scene.expected(&scene.faces, &alone);
        let ids = |contacts: &[Contact<f32>]| contacts.iter().map(|contact| contact.element).collect::<Vec<_>>();
        assert_eq!(ids(&certified.contacts), ids(&complete));
        // The first launch alone misses some.
        let once = found(&gpu, &scene, QueryOptions::default()).unwrap();
        assert!(once.contacts.len() < complete.len(), "{} of {}", once.contacts.len(), complete.len());
        assert_eq!((once.unsettled_count, once.unsettled), (0, vec![]));
    });
}

#[test]
fn what_is_left_open_is_listed_for_a_search_elsewhere() {
    with_stub("second::what_is_left_open_is_listed_for_a_search_elsewhere", &[], |folder| {
        let gpu = gpu(folder);
        for kind in ["dense", "sparse_u16", "shapes"] {
            let scene = scene(kind);
            let (mut expected, mut unsettled) = (vec![], vec![]);
            for element in scene.elements(&scene.faces) {
                match settle(&scene, &element) {
                    Settled::First(contact) => expected.push(contact),
                    Settled::Not(_) => unsettled.push(element.id),
                    Settled::Neither => {}
                }
            }
            let listed =
                found(&gpu, &scene, QueryOptions { unsettled: Unsettled::List, ..QueryOptions::default() }).unwrap();
            assert_equal(&listed.contacts, &expected, kind);
            assert_eq!(listed.unsettled, unsettled, "{kind}");
            assert!(!unsettled.is_empty() && listed.unsettled_count as usize == unsettled.len());
        }
    });
}

#[test]
fn a_second_launch_that_no_kernel_makes_is_refused() {
    with_stub("second::a_second_launch_that_no_kernel_makes_is_refused", &[], |folder| {
        let gpu = gpu(folder);
        let twice = Unsettled::Certify { evaluations: EVALUATIONS };
        let fused = QueryOptions { stages: Stages::Fused, unsettled: twice, ..QueryOptions::default() };
        let shapes = QueryOptions { unsettled: twice, ..QueryOptions::default() };
        for (kind, options) in [("dense", fused), ("shapes", shapes)] {
            let found = found(&gpu, &scene(kind), options);
            assert!(matches!(found, Err(GpuError::Unsupported(_))), "{kind}: {found:?}");
        }
    });
}
