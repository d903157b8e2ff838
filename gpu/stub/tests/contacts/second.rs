//! The second launch: what a local search does not settle, searched again by the certified method, on the card or elsewhere.

use sdf_core::contact::{Contact, Element, Outcome, contact_at, cull};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer};
use sdf_gpu::{
    Elements, Gpu, GpuContacts, GpuError, GpuField, GpuMesh, GpuQuery, Method, QueryOptions, Stages, Unsettled,
};

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

fn settle<const N: usize>(scene: &Scene, element: &Element<f32, N>, evaluations: u32) -> Settled {
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
    let second = Certified { evaluations, ..Certified::default() };
    let minimum = second.minimize_below(field, &element.simplex, *margin);
    let is_contact = minimum.sample.value <= *margin;
    Settled::Not(if is_contact { contact_at(field, element, &minimum, lower_bound) } else { None })
}

fn found(gpu: &Gpu, scene: &Scene, options: QueryOptions) -> Result<GpuContacts, GpuError> {
    found_on(gpu, scene, Elements::Faces(&scene.faces), options)
}

fn found_on(gpu: &Gpu, scene: &Scene, elements: Elements, options: QueryOptions) -> Result<GpuContacts, GpuError> {
    let field = GpuField::new(gpu, &scene.field)?;
    let mesh = GpuMesh::new(gpu, &scene.points, elements)?;
    GpuQuery::new(gpu, &field, mesh, &QueryOptions { margin: scene.margin, iterations: STEPS, ..options })?.contacts()
}

#[test]
fn what_the_first_launch_leaves_open_the_second_settles() {
    with_stub("second::what_the_first_launch_leaves_open_the_second_settles", &[], |folder| {
        let gpu = gpu(folder);
        for kind in ["dense", "sparse_u16", "sparse_f32", "shapes"] {
            let scene = scene(kind);
            the_second_launch_settles(&gpu, &scene, Elements::Faces(&scene.faces), &scene.faces);
            the_second_launch_settles(&gpu, &scene, Elements::Edges(&scene.edges), &scene.edges);
        }
    });
}

fn the_second_launch_settles<const N: usize>(gpu: &Gpu, scene: &Scene, on_card: Elements, elements: &[[u32; N]]) {
    let (mut expected, mut unsettled, mut missed) = (vec![], 0, 0);
    for element in scene.elements(elements) {
        match settle(scene, &element, EVALUATIONS) {
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
    let by = |options| found_on(gpu, scene, on_card, options).unwrap();
    let certified = by(QueryOptions { unsettled: twice, ..QueryOptions::default() });
    assert_equal(&certified.contacts, &expected, &format!("{}, two launches, {N} corners", scene.kind));
    assert_eq!(certified.unsettled_count, unsettled);
    assert!(certified.unsettled.is_empty());

    // No element within the margin is missed: those that the certified method finds by itself.
    let alone = Certified { evaluations: EVALUATIONS, ..Certified::default() };
    let (complete, _) = scene.expected(elements, &alone);
    let ids = |contacts: &[Contact<f32>]| contacts.iter().map(|contact| contact.element).collect::<Vec<_>>();
    assert_eq!(ids(&certified.contacts), ids(&complete));
    // The first launch alone misses some.
    let once = by(QueryOptions::default());
    assert!(once.contacts.len() < complete.len(), "{} of {}", once.contacts.len(), complete.len());
    assert_eq!((once.unsettled_count, once.unsettled), (0, vec![]));
}

#[test]
fn what_is_left_open_is_listed_for_a_search_elsewhere() {
    with_stub("second::what_is_left_open_is_listed_for_a_search_elsewhere", &[], |folder| {
        let gpu = gpu(folder);
        for kind in ["dense", "sparse_u16", "shapes"] {
            let scene = scene(kind);
            let (mut expected, mut unsettled) = (vec![], vec![]);
            for element in scene.elements(&scene.faces) {
                match settle(&scene, &element, EVALUATIONS) {
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
        let (gpu, scene) = (gpu(folder), scene("dense"));
        let twice =
            QueryOptions { unsettled: Unsettled::Certify { evaluations: EVALUATIONS }, ..QueryOptions::default() };
        let fused = QueryOptions { stages: Stages::Fused, ..twice };
        let points = QueryOptions { method: Method::PointSampling, ..twice };
        for (elements, options) in [(Elements::Faces(&scene.faces), fused), (Elements::Vertices, points)] {
            let found = found_on(&gpu, &scene, elements, options);
            assert!(matches!(found, Err(GpuError::Unsupported(_))), "{elements:?}: {found:?}");
        }
    });
}

#[test]
fn what_a_certified_search_leaves_open_is_counted() {
    with_stub("second::what_a_certified_search_leaves_open_is_counted", &[], |folder| {
        let (gpu, scene) = (gpu(folder), scene("dense"));
        let by = |options| found(&gpu, &scene, options).unwrap();
        for evaluations in [1, EVALUATIONS] {
            let options = |unsettled| QueryOptions { unsettled, ..QueryOptions::default() };
            let listed = by(options(Unsettled::CertifyThenList { evaluations }));
            let kept = by(options(Unsettled::Certify { evaluations }));
            assert_eq!((kept.open_count, kept.unsettled), (listed.unsettled.len() as u32, vec![]));
            assert_eq!((kept.open_count, kept.unsettled_count), (listed.open_count, listed.unsettled_count));
            assert_eq!(kept.open_count > 20, evaluations == 1, "{} open", kept.open_count);
            // Its answers are kept all the same.
            let mut expected = vec![];
            for element in scene.elements(&scene.faces) {
                match settle(&scene, &element, evaluations) {
                    Settled::First(contact) => expected.push(contact),
                    Settled::Not(contact) => expected.extend(contact),
                    Settled::Neither => {}
                }
            }
            assert_equal(&kept.contacts, &expected, "kept");
        }
        // Of a search that is certified at once.
        let certified = QueryOptions { method: Method::Certified, ..QueryOptions::default() };
        let listed = by(QueryOptions { unsettled: Unsettled::List, ..certified });
        let count = listed.unsettled.len() as u32;
        assert!(count > 0 && (listed.unsettled_count, listed.open_count) == (count, count), "{listed:?}");
        let kept = by(certified);
        assert_eq!((kept.unsettled_count, kept.open_count, kept.unsettled), (count, count, vec![]));
    });
}

#[test]
fn a_certified_search_is_not_certified_again() {
    with_stub("second::a_certified_search_is_not_certified_again", &[], |folder| {
        let (gpu, scene) = (gpu(folder), scene("dense"));
        let certified = QueryOptions { method: Method::Certified, margin: scene.margin, ..QueryOptions::default() };
        let field = GpuField::new(&gpu, &scene.field).unwrap();
        let mesh = GpuMesh::new(&gpu, &scene.points, Elements::Faces(&scene.faces)).unwrap();
        let mut query = GpuQuery::new(&gpu, &field, mesh, &certified).unwrap();
        let before = query.contacts().unwrap();
        for evaluations in [1, EVALUATIONS] {
            for unsettled in [Unsettled::Certify { evaluations }, Unsettled::CertifyThenList { evaluations }] {
                let refused = found(&gpu, &scene, QueryOptions { unsettled, ..certified });
                assert!(matches!(refused, Err(GpuError::Options(text)) if text.contains("certified already")));
                // What is refused changes nothing.
                query.set_unsettled(unsettled).unwrap_err();
                assert_eq!(query.contacts().unwrap(), before);
            }
        }
    });
}
