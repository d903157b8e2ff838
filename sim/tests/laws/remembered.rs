//! A memory hides nothing by what it holds from earlier frames: neither by a plane that was kept, nor by a search that failed.

use sdf_core::placed::Rigid;
use sdf_core::shapes::HalfSpace;
use sdf_field::{ContactOptions, Field, MeshView, Method, QueryError};
use sdf_sim::{Body, Carrier, Contacts, Memory, Motion, Placed, Query, Surface, World};

use crate::V3;

/// The distances of all contacts with a floor.
fn distances(
    query: &Query,
    surface: &Surface,
    world: &World,
    fall: f64,
    memory: &mut Memory,
) -> Result<Vec<f64>, QueryError> {
    let floor = Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    let floor = Placed { field: &floor, pose: Rigid::new([0.0; 3], [0.0, 0.0, 0.0, 1.0]).unwrap() };
    let mut contacts = Contacts::default();
    let motion = Motion { time: 0.0, fall, max: f64::INFINITY };
    query.find_again(&floor, surface, world, &motion, memory, &mut contacts)?;
    Ok(contacts.contacts.iter().map(|contact| contact.distance).collect())
}

/// A loose face with its corners at these heights.
fn face(heights: [f64; 3]) -> (Surface, World) {
    let [a, b, c] = heights;
    let x = vec![V3::new(0.0, 0.0, a), V3::new(1.0, 0.0, b), V3::new(0.0, 1.0, c)];
    let mut world = World::default();
    (world.x, world.v) = (x, vec![V3::zeros(); 3]);
    (Surface::of_faces(vec![[0, 1, 2]], 3, Carrier::Particles { first: 0 }), world)
}

/// A corner rises out of reach while another sinks: where the floor then counts from farther off, the other is found.
#[test]
fn a_plane_out_of_reach_does_not_hide_a_corner_that_comes_into_it() {
    for (hold, keep) in [(0.0, 0.1), (0.005, 0.1), (0.0, 0.0)] {
        let query = Query { thickness: 0.1, hold, keep, struck_vertices: false, ..Query::default() };
        let mut memory = Memory::default();
        let frames = [([0.09, 0.5, 0.5], 0.0), ([0.18, 0.115, 0.5], 0.0), ([0.18, 0.115, 0.5], 0.02)];
        for (heights, fall) in frames {
            let (surface, world) = face(heights);
            let anew = distances(&query, &surface, &world, fall, &mut Memory::default()).unwrap();
            let found = distances(&query, &surface, &world, fall, &mut memory).unwrap();
            assert_eq!(found, anew, "hold {hold}, keep {keep}, corners at {heights:?}");
        }
        let (surface, world) = face([0.18, 0.115, 0.5]);
        assert_eq!(distances(&query, &surface, &world, 0.02, &mut memory).unwrap(), [0.115]);
    }
}

/// A search fails by a method that does not search faces, or within an infinite margin.
#[test]
fn a_search_that_fails_is_not_remembered() {
    let query = Query { thickness: 0.1, struck_vertices: false, ..Query::default() };
    let by_edges = Query { method: Method::GoldenSection, ..query };
    for ((surface, world), failing, fall) in [
        (face([0.05, 0.5, 0.5]), by_edges, 0.0),
        (face([0.05, 0.5, 0.5]), query, f64::INFINITY),
        (tetrahedron(0.05), by_edges, 0.0),
    ] {
        let mut memory = Memory::default();
        assert!(distances(&failing, &surface, &world, fall, &mut memory).is_err());
        let found = distances(&query, &surface, &world, 0.0, &mut memory).unwrap();
        assert!(!found.is_empty() && (found[0] - 0.05).abs() < 1e-12, "{found:?}");
    }
}

/// A body with its lowest face at this height.
fn tetrahedron(height: f64) -> (Surface, World) {
    let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let (mut body, points) = Body::of_mesh(&corners, &faces, 1.0).unwrap();
    let lowest = points.iter().map(|point| point[2]).fold(f64::INFINITY, f64::min);
    body.position.z = height - lowest;
    let mut world = World::default();
    let id = world.add_body(body);
    (Surface::of_faces(faces, 4, Carrier::Body { id, points: points.into() }), world)
}

/// A negative thickness asks for a depth, as a negative margin does.
#[test]
fn a_negative_thickness_finds_what_is_so_deep() {
    let (surface, world) = tetrahedron(-0.11);
    let query = Query { thickness: -0.1, struck_vertices: false, one_per_feature: false, ..Query::default() };
    let found = distances(&query, &surface, &world, 0.0, &mut Memory::default()).unwrap();
    let floor = Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    let (points, faces) = (surface.points(&world), surface.faces.to_vec());
    let options = ContactOptions { margin: -0.1, ..ContactOptions::default() };
    let contacts = floor.contacts(MeshView { points: &points, faces: &faces }, &options).unwrap().contacts;
    assert!(found.len() == contacts.len() && found.len() == 4, "{found:?}");
}
