//! On which side does an entangled patch leave? A sheet that goes through a body is pulled to both sides of the body's middle, and
//! stays (Macklin et al. 2020, §9).
//!
//! Deep contacts are joined into patches over the vertices of their elements. Each patch gets one direction: its faces' mean normal,
//! on the side that its contacts' normals, weighted by depth, prefer. All of its contacts then push that way.

use std::collections::BTreeMap;

use sdf_core::contact::Contact;

use crate::V3;
use crate::surface::Surface;

/// Contacts deeper than this many thicknesses belong to a patch.
const DEEP: f64 = 1.0;

/// Turns the normals of each deep patch to one side.
pub(super) fn choose_sides(
    contacts: &mut [Contact<f64>],
    surface: &Surface,
    points: &[[f64; 3]],
    thickness: f64,
    memory: &mut BTreeMap<u32, V3>,
) {
    let mut parents: Vec<u32> = (0..points.len() as u32).collect();
    let deep = |contact: &Contact<f64>| contact.distance < -DEEP * thickness;
    for contact in contacts.iter().filter(|contact| deep(contact)) {
        for pair in contact.corner_vertices().windows(2) {
            let [a, b] = [find(&mut parents, pair[0]), find(&mut parents, pair[1])];
            parents[a.max(b) as usize] = a.min(b);
        }
    }
    let mut patches: BTreeMap<u32, (V3, f64)> = BTreeMap::new();
    for contact in contacts.iter().filter(|contact| deep(contact)) {
        let across = face_normal(contact, surface, points);
        let root = find(&mut parents, contact.vertices[0]);
        let patch = patches.entry(root).or_insert((V3::zeros(), 0.0));
        patch.0 += across;
        patch.1 -= contact.distance * across.dot(&contact.normal);
    }
    let mut chosen = BTreeMap::new();
    for (root, (across, side)) in &patches {
        let Some(direction) = across.try_normalize(1e-12) else { continue };
        // A patch that chose a side before keeps it.
        let before = (0..points.len() as u32)
            .filter(|vertex| find(&mut parents, *vertex) == *root)
            .find_map(|vertex| memory.get(&vertex));
        let sign = before.map_or(*side, |before| before.dot(&direction)).signum();
        chosen.insert(*root, direction * sign);
    }
    memory.clear();
    for contact in contacts.iter_mut().filter(|contact| deep(contact)) {
        let root = find(&mut parents, contact.vertices[0]);
        if let Some(direction) = chosen.get(&root) {
            contact.normal = *direction;
            contact.surface_point = contact.point - direction * contact.distance;
            contact.corner_vertices().iter().for_each(|vertex| _ = memory.insert(*vertex, *direction));
        }
    }
}

fn face_normal(contact: &Contact<f64>, surface: &Surface, points: &[[f64; 3]]) -> V3 {
    let Some(face) = surface.faces.get(contact.element as usize) else { return V3::zeros() };
    let [a, b, c] = face.map(|vertex| V3::from(points[vertex as usize]));
    (b - a).cross(&(c - a))
}

fn find(parents: &mut [u32], vertex: u32) -> u32 {
    let mut root = vertex;
    while parents[root as usize] != root {
        parents[root as usize] = parents[parents[root as usize] as usize];
        root = parents[root as usize];
    }
    root
}
