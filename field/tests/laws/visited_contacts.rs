//! Contacts visited batch by batch: the same as in a list, and the memory of a run.

use std::ops::ControlFlow;

use sdf_core::contact::Contact;
use sdf_core::shapes::Sphere;
use sdf_field::{ContactOptions, Elements, Field, MeshView, Method, Threads};
use sdf_formats::contact_file::{self, ContactFormat, ContactRecord, ContactRows};
use sdf_procedural::Sheet;

use crate::memory::peak_of;

/// Memory in use at most, beyond mesh and field, for each contact.
const MAX_BYTES_PER_CONTACT: usize = 150;

fn ball() -> Field {
    Field::new(Sphere::new(1.0).unwrap())
}

/// A sheet over a ball of radius 1, with two faces a cell.
fn sheet(cells: u32) -> sdf_procedural::Mesh {
    Sheet { cells: [cells; 2], size: [1.8; 2], height: 0.99, bend: 0.6, floor: -1.0, holes: None, faces: None }.mesh()
}

#[test]
fn visited_contacts_are_those_of_the_list() {
    let (field, mesh) = (ball(), sheet(80));
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    for elements in [Elements::Faces, Elements::Edges, Elements::Vertices] {
        for (one_per_feature, margin) in [(false, 0.05), (true, 0.05), (false, -10.0)] {
            let method = Method::FrankWolfe;
            let threads = Threads::ONE;
            let options = ContactOptions { elements, one_per_feature, margin, method, threads, ..Default::default() };
            let mut list = field.contacts(view, &options).unwrap();
            let mut visited = vec![];
            let visit = |contact: &Contact<f64>| {
                visited.push(*contact);
                ControlFlow::Continue(())
            };
            let counts = field.visit_contacts(view, &options, visit).unwrap().continue_value().unwrap();
            assert_eq!(visited, list.contacts, "{elements:?} {one_per_feature} {margin}");
            // 12,800 faces, 19,360 edges, 6,561 vertices: more than a batch of 4,096.
            assert!(margin < 0.0 || visited.last().unwrap().element > 4096);
            list.contacts.clear();
            assert_eq!(counts, list);
        }
    }
}

#[test]
fn rows_hold_every_bit_of_a_contact() {
    let (field, mesh) = (ball(), sheet(40));
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    for method in [Method::Auto, Method::FrankWolfe] {
        for elements in [Elements::Faces, Elements::Edges, Elements::Vertices] {
            let options = ContactOptions { elements, method, margin: 0.05, ..Default::default() };
            let mut contacts = field.contacts(view, &options).unwrap().contacts;
            // Fields that no rule foretells.
            for (index, contact) in contacts.iter_mut().enumerate().filter(|(index, _)| index % 3 == 0) {
                contact.rank = index as u32;
                contact.surface_point.y += 1e-9;
                contact.shape_lower_bound = -0.0;
                contact.lower_bound = f64::NEG_INFINITY;
                contact.error_bound = f64::INFINITY;
                contact.normal = -contact.normal * 0.0;
            }
            let mut rows = ContactRows::default();
            contacts.iter().for_each(|contact| rows.push(contact));
            assert!(contacts.len() > 500 && rows.len() == contacts.len());
            // The text of a number tells 0 from −0.
            let text = |contact: &Contact<f64>| format!("{contact:?}");
            assert!(rows.iter().map(|contact| text(&contact)).eq(contacts.iter().map(text)));
        }
    }
}

/// Search, list and every format at once: [`MAX_BYTES_PER_CONTACT`] at most.
#[test]
fn a_contact_takes_150_bytes_while_it_is_found_and_written() {
    let (field, mesh) = (ball(), sheet(300));
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let path = std::env::temp_dir().join(format!("sdf_field_memory_{}", std::process::id()));
    let options =
        ContactOptions { method: Method::FrankWolfe, margin: 1.0, threads: Threads::ONE, ..Default::default() };
    for format in [ContactFormat::Csv, ContactFormat::Ply, ContactFormat::Hdf5] {
        let (count, bytes) = peak_of(|| {
            let mut rows = ContactRows::default();
            let visit = |contact: &Contact<f64>| {
                rows.push(contact);
                ControlFlow::Continue(())
            };
            assert!(field.visit_contacts(view, &options, visit).unwrap().is_continue());
            let records = rows.iter().map(|contact| ContactRecord::from(&contact));
            contact_file::write(&path, format, records, |_| Ok(())).unwrap();
            rows.len()
        });
        assert!(count > 150_000, "{count}");
        let share = bytes / count;
        println!("{format:?}: {share} bytes a contact");
        assert!(share <= MAX_BYTES_PER_CONTACT, "{format:?}: {share} bytes a contact");
    }
    std::fs::remove_file(&path).unwrap();
}
