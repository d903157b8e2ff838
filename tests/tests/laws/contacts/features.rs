//! One contact for each touched feature of a mesh: none is lost, for any order of the contacts.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;
use sdf_core::Simplex;
use sdf_core::contact::{
    Contact, Element, ElementKind, Feature, FeatureOwners, FeatureUse, NO_VERTEX, Outcome, contact, one_per_feature,
};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer};
use sdf_core::shapes::RoundedBox;
use sdf_tests::random::Random;

/// A rough sheet of 2 · 12² faces, some left out, so that it has borders.
fn sheet(random: &mut Random) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    const SIDE: u32 = 12;
    let points = (0..=SIDE).flat_map(|j| (0..=SIDE).map(move |i| [i, j]));
    let points = points.map(|[i, j]| {
        let at = |n: u32| 2.4 * f64::from(n) / f64::from(SIDE) - 1.2;
        Vector3::new(at(i), at(j), random.pick(&[0.45, 0.5, 0.55]))
    });
    let points = points.collect();
    let mut faces = vec![];
    for j in 0..SIDE {
        for i in 0..SIDE {
            let node = |i: u32, j: u32| j * (SIDE + 1) + i;
            let (a, b, c, d) = (node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1));
            for face in [[a, b, c], [c, d, a]] {
                if random.below(8) > 0 {
                    let turn = random.below(3);
                    faces.push([face[turn], face[(turn + 1) % 3], face[(turn + 2) % 3]]);
                }
            }
        }
    }
    (points, faces)
}

fn contacts(points: &[Vector3<f64>], faces: &[[u32; 3]], method: &impl Minimizer<3>) -> Vec<Contact<f64>> {
    let body = RoundedBox::new([0.7, 0.6, 0.4], 0.1).unwrap();
    let found = faces.iter().zip(0..).filter_map(|(face, id)| {
        let simplex = Simplex { corners: face.map(|vertex| points[vertex as usize]) };
        match contact(&body, method, 0.04, &Element { id, vertices: *face, simplex }) {
            Outcome::Contact(contact) => Some(contact),
            _ => None,
        }
    });
    found.collect()
}

fn shuffle<T>(items: &mut [T], random: &mut Random) {
    for last in (1..items.len()).rev() {
        items.swap(last, random.below(last + 1));
    }
}

/// The feature that each contact rests on, and its key.
fn names(contacts: &[Contact<f64>]) -> Vec<(Feature, u64)> {
    contacts.iter().map(|contact| (contact.feature, contact.key())).collect()
}

#[test]
fn every_touched_feature_keeps_one_contact_for_any_order() {
    let mut random = Random::seeded();
    for round in 0..20 {
        let (points, faces) = sheet(&mut random);
        let all = match round % 2 {
            0 => contacts(&points, &faces, &FrankWolfe::default()),
            _ => contacts(&points, &faces, &Certified::default()),
        };
        let (mut scratch, mut bits) = (vec![FeatureUse::default(); 6 * faces.len()], vec![0; faces.len()]);
        let owners = FeatureOwners::assign(&faces, &mut scratch, &mut bits).unwrap();
        let touched: BTreeSet<Feature> = all.iter().map(|contact| contact.feature).collect();
        assert!(touched.len() * 10 < all.len() * 9, "{} features of {} contacts", touched.len(), all.len());
        let mut expected = [None, None];
        for _ in 0..4 {
            for (with_owners, expected) in [false, true].into_iter().zip(&mut expected) {
                let mut some = all.clone();
                shuffle(&mut some, &mut random);
                let count = if with_owners { owners.one_per_feature(&mut some) } else { one_per_feature(&mut some) };
                let kept = names(&some[..count]);
                assert_eq!(*expected.get_or_insert(kept.clone()), kept, "the order of contacts matters");
                assert_eq!(kept.iter().map(|(feature, _)| *feature).collect::<BTreeSet<_>>(), touched);
                assert_eq!(count, touched.len(), "a feature keeps two contacts");
                assert!(some[..count].windows(2).all(|pair| pair[0].element < pair[1].element));
                // Nothing is lost from the slice.
                let keys = |contacts: &[Contact<f64>]| contacts.iter().map(Contact::key).collect::<BTreeSet<_>>();
                assert_eq!(keys(&some), keys(&all));
                for one in &some[..count] {
                    let rivals = || all.iter().filter(|other| other.feature == one.feature);
                    if with_owners && !owners.owns(one) {
                        assert!(rivals().all(|other| !owners.owns(other)), "an owner's contact was dropped");
                    }
                    if !with_owners || !owners.owns(one) {
                        assert!(rivals().all(|other| one.distance <= other.distance), "a deeper contact was dropped");
                    }
                }
            }
        }
    }
}

#[test]
fn every_vertex_and_edge_has_the_first_of_its_faces_as_owner() {
    let mut random = Random::seeded();
    let (_, faces) = sheet(&mut random);
    let (mut scratch, mut bits) = (vec![FeatureUse::default(); 6 * faces.len()], vec![0xff; faces.len()]);
    let owners = FeatureOwners::assign(&faces, &mut scratch, &mut bits).unwrap();
    let mut first = BTreeMap::new();
    for (face, [a, b, c]) in faces.iter().enumerate() {
        for feature in [vec![*a], vec![*b], vec![*c], vec![*b, *c], vec![*c, *a], vec![*a, *b]] {
            let mut sorted = feature;
            sorted.sort_unstable();
            first.entry(sorted).or_insert(face);
        }
    }
    for (face, corners) in faces.iter().enumerate() {
        for (bit, missing) in (0..6).map(|bit| (bit, bit % 3)) {
            let mut feature = match bit {
                0..3 => vec![corners[bit]],
                _ => (0..3).filter(|corner| *corner != missing).map(|corner| corners[corner]).collect(),
            };
            feature.sort_unstable();
            assert_eq!(owners.bits()[face] >> bit & 1 == 1, first[&feature] == face, "face {face}, bit {bit}");
        }
    }
}

#[test]
fn owners_refuse_buffers_of_other_sizes_and_own_no_other_elements() {
    let faces = [[0, 1, 2], [2, 1, 3]];
    let (mut scratch, mut bits) = (vec![FeatureUse::default(); 11], vec![0; 2]);
    assert_eq!(FeatureOwners::assign(&faces, &mut scratch, &mut bits), None);
    scratch.push(FeatureUse::default());
    assert_eq!(FeatureOwners::assign(&faces, &mut scratch, &mut bits[..1]), None);
    let owners = FeatureOwners::assign(&faces, &mut scratch, &mut bits).unwrap();
    let mut random = Random::seeded();
    let (points, faces) = sheet(&mut random);
    let mut one = contacts(&points, &faces, &FrankWolfe::default())[0];
    one.element = 7;
    assert!(!owners.owns(&one));
    (one.element, one.kind, one.vertices) = (0, ElementKind::Edge, [0, 1, NO_VERTEX]);
    assert!(!owners.owns(&one));
}
