//! Contacts by the kept mesh are those of the mesh itself: none missed, none false, and as deep as it is.

use sdf_bake::{MeshDistance, TriangleMesh};
use sdf_field::core::Simplex;
use sdf_field::core::contact::ContactStatus;
use sdf_field::core::grid::owned::Layout;
use sdf_field::core::nalgebra::Vector3;
use sdf_field::core::placed::Rigid;
use sdf_field::{BakeOptions, ContactOptions, Elements, Field, GridSize, MeshView, Method, QueryError, SignMethod};
use sdf_procedural::Mesh;
use sdf_procedural::random::{Random, test_seed};

use crate::complete::{meshes, random_faces};

fn baked(mesh: &Mesh, cells: u32, layout: Layout, sign: Option<SignMethod>) -> Field {
    let options = BakeOptions { size: GridSize::Cells(cells), layout, sign, keep_mesh: true, ..BakeOptions::default() };
    Field::bake(MeshView { points: &mesh.points, faces: &mesh.triangles }, &options).unwrap().field
}

/// The least signed distance on a triangle, by branch and bound that knows only that its slope is 1: within `tolerance` of the
/// number returned, unless the budget ends. The second number is a lower bound.
fn least_distance(exact: &MeshDistance, corners: [Vector3<f64>; 3], tolerance: f64) -> (f64, f64) {
    let bound = |corners: [Vector3<f64>; 3]| {
        let simplex = Simplex { corners };
        let centroid = simplex.centroid();
        let value = exact.signed_distance(centroid.into());
        (value, value - simplex.max_distance_from(centroid))
    };
    let corner_values = corners.map(|corner| exact.signed_distance(corner.into()));
    let (value, lower) = bound(corners);
    let mut best = corner_values.into_iter().fold(value, f64::min);
    let mut open = vec![(lower, corners)];
    for _ in 0..3000 {
        let Some(index) = (0..open.len()).min_by(|a, b| open[*a].0.total_cmp(&open[*b].0)) else { break };
        let (lower, [a, b, c]) = open.swap_remove(index);
        if lower >= best - tolerance {
            return (best, best - tolerance);
        }
        let (ab, bc, ca) = ((a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0);
        for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            let (value, lower) = bound(part);
            best = best.min(value);
            open.push((lower, part));
        }
    }
    (best, open.iter().map(|(lower, _)| *lower).fold(best - tolerance, f64::min))
}

#[test]
fn exact_contacts_are_those_of_the_mesh() {
    let seed = test_seed(20_201_123);
    println!("to repeat: SDF_SEED={seed}");
    let mut random = Random::new(seed);
    let (mut near, mut missed_by_the_grid, mut unsettled, mut found_in_all) = (0, 0, 0, 0);
    for (name, mesh) in meshes() {
        let triangles = TriangleMesh::new(&mesh.points, &mesh.triangles).unwrap();
        let exact = MeshDistance::new(&triangles, None);
        let diagonal = triangles.bounds().diagonal();
        let (points, faces) = random_faces(&mesh, &mut random, 150);
        let view = MeshView { points: &points, faces: &faces };
        let corners = |face: usize| faces[face].map(|vertex| Vector3::from(points[vertex as usize]));
        let truth: Vec<_> =
            (0..faces.len()).map(|face| least_distance(&exact, corners(face), 1e-5 * diagonal)).collect();
        for layout in Layout::ALL {
            let field = baked(&mesh, 32, layout, None);
            for margin in [0.0, 0.02, -0.03] {
                let options = ContactOptions { margin, exact: true, ..ContactOptions::default() };
                let found = field.contacts(view, &options).unwrap();
                let plain = field.contacts(view, &ContactOptions { margin, ..ContactOptions::default() }).unwrap();
                let of = |face: usize| found.contacts.iter().find(|contact| contact.element as usize == face);
                for (face, (best, lower)) in truth.iter().enumerate() {
                    let context =
                        || format!("{name} {layout:?} margin {margin}: face {face} at {best}: {:?}", of(face));
                    assert!(*best > margin || of(face).is_some(), "missed: {}", context());
                    assert!(*lower <= margin || of(face).is_none(), "false: {}", context());
                    near += usize::from(*best <= margin);
                    let is_missed = !plain.contacts.iter().any(|contact| contact.element as usize == face);
                    missed_by_the_grid += usize::from(*best <= margin && is_missed);
                    let Some(contact) = of(face) else { continue };
                    assert!(contact.distance <= best + 1e-6 * diagonal, "too shallow: {}", context());
                    assert!(contact.distance >= lower - 1e-12, "too deep: {}", context());
                    assert!(contact.lower_bound <= best + 1e-12, "no bound: {}", context());
                    let is_settled = contact.status == ContactStatus::Converged;
                    assert!(!is_settled || contact.distance - contact.lower_bound <= 1e-6 * diagonal, "{}", context());
                    unsettled += usize::from(!is_settled);
                    found_in_all += 1;
                }
                for contact in &found.contacts {
                    let context = || format!("{name} {layout:?} margin {margin}: {contact:?}");
                    let at = exact.signed_distance(contact.point.into());
                    assert!((at - contact.distance).abs() <= contact.error_bound + 1e-12, "{at}: {}", context());
                    let offset = contact.point - contact.surface_point;
                    assert!((offset.norm() - contact.distance.abs()).abs() < 1e-12, "{}", context());
                    assert!((contact.normal * contact.distance - offset).norm() < 1e-9, "{}", context());
                    assert!((contact.normal.norm() - 1.0).abs() < 1e-9, "{}", context());
                    assert!((contact.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{}", context());
                }
            }
        }
    }
    println!(
        "{near} near, {missed_by_the_grid} missed by the grid; {unsettled} of {found_in_all} contacts end by the budget"
    );
    assert!(missed_by_the_grid > 10, "the grid misses only {missed_by_the_grid}: the meshes are too easy");
    assert!(unsettled * 100 <= found_in_all, "{unsettled} of {found_in_all} are unsettled");
}

/// A cone of so many slices: apex at the origin, base one below it. Convex, so that the depth inside is the least distance to the planes.
fn cone(tangent: f64, slices: u32) -> Mesh {
    let ring = |slice: u32| {
        let angle = std::f64::consts::TAU * f64::from(slice) / f64::from(slices);
        [tangent * angle.cos(), tangent * angle.sin(), -1.0]
    };
    let points = [[0.0; 3], [0.0, 0.0, -1.0]].into_iter().chain((0..slices).map(ring)).collect();
    let pair = |slice: u32| (2 + slice, 2 + (slice + 1) % slices);
    let faces = |slice| [[0, pair(slice).0, pair(slice).1], [1, pair(slice).1, pair(slice).0]];
    Mesh { points, triangles: (0..slices).flat_map(faces).collect(), segments: vec![] }
}

/// 165 spikes through the middle of a triangle: 15 cones at 11 depths. A grid of so few cells sees few of them.
#[test]
fn every_spike_of_a_baked_cone_is_as_deep_as_it_is() {
    let (mut spikes, mut seen_by_the_grid) = (0, 0);
    for tangent in [0.05, 0.1, 0.2, 0.4, 0.8_f64] {
        for slices in [7, 12, 32] {
            let mesh = cone(tangent, slices);
            let field = baked(&mesh, 24, Layout::Sparse, None);
            // Half angle of the pyramid's faces.
            let sine = (tangent * (std::f64::consts::PI / f64::from(slices)).cos()).atan().sin();
            for step in 0..11 {
                let height = 1e-5 * 2.6_f64.powi(step);
                // Larger than the cone is wide there, turned, and not centred.
                let size = 3.0 * tangent * height + 0.02;
                let corner = |turn: f64| [size * (turn + 0.3).cos(), size * (turn + 0.3).sin() + 0.1 * size, -height];
                let points = [0.0, 2.1, 4.2].map(corner);
                let view = MeshView { points: &points, faces: &[[0, 1, 2]] };
                let truth = -height * sine;
                let found = field.contacts(view, &ContactOptions { exact: true, ..ContactOptions::default() }).unwrap();
                let context = || format!("tangent {tangent}, {slices} slices, {height} deep: {truth}, {found:?}");
                assert_eq!(found.contacts.len(), 1, "{}", context());
                let contact = &found.contacts[0];
                assert!((contact.distance - truth).abs() < 1e-6, "{}", context());
                assert!(
                    contact.lower_bound <= truth + 1e-12 && contact.status == ContactStatus::Converged,
                    "{}",
                    context()
                );
                let plain = field.contacts(view, &ContactOptions::default()).unwrap();
                let is_seen =
                    plain.contacts.iter().any(|contact| (contact.distance - truth).abs() <= 0.1 * truth.abs());
                seen_by_the_grid += usize::from(is_seen);
                spikes += 1;
            }
        }
    }
    println!("{spikes} spikes, {seen_by_the_grid} within 10 % by the grid");
    assert!(spikes == 165 && seen_by_the_grid < 80);
}

#[test]
fn edges_vertices_poses_and_any_number_of_threads_give_the_exact_answer_too() {
    let seed = test_seed(20_201_124);
    println!("to repeat: SDF_SEED={seed}");
    let mut random = Random::new(seed);
    let (_, mesh) = meshes().swap_remove(0);
    let triangles = TriangleMesh::new(&mesh.points, &mesh.triangles).unwrap();
    let exact = MeshDistance::new(&triangles, None);
    let field = baked(&mesh, 24, Layout::Dense, None);
    let (points, faces) = random_faces(&mesh, &mut random, 200);
    let view = MeshView { points: &points, faces: &faces };
    let at = |elements| ContactOptions { margin: 0.01, exact: true, elements, ..ContactOptions::default() };

    let found = field.contacts(view, &at(Elements::Vertices)).unwrap();
    for (vertex, point) in points.iter().enumerate() {
        let distance = exact.signed_distance(*point);
        let contact = found.contacts.iter().find(|contact| contact.element as usize == vertex);
        assert_eq!(contact.map(|contact| contact.distance), (distance <= 0.01).then_some(distance), "vertex {vertex}");
    }

    let found = field.contacts(view, &at(Elements::Edges)).unwrap();
    for (id, [a, b]) in view.edges().into_iter().enumerate() {
        let [a, b] = [a, b].map(|vertex| Vector3::from(points[vertex as usize]));
        let on_edge = (0..=300).map(|step| a + (b - a) * (f64::from(step) / 300.0));
        let lowest = on_edge.map(|point| exact.signed_distance(point.into())).fold(f64::INFINITY, f64::min);
        match found.contacts.iter().find(|contact| contact.element as usize == id) {
            Some(contact) => assert!(contact.distance <= lowest + 2e-6 && contact.lower_bound <= lowest, "{contact:?}"),
            None => assert!(lowest > 0.01, "edge {id} at {lowest}"),
        }
    }

    let still = field.contacts(view, &at(Elements::Faces)).unwrap();
    assert_eq!(
        field.contacts(view, &ContactOptions { threads: sdf_field::Threads::ONE, ..at(Elements::Faces) }).unwrap(),
        still
    );
    let pose = Rigid::new([0.5, -2.0, 1.0], [0.3, -0.1, 0.5, 0.8]).unwrap();
    let moved: Vec<[f64; 3]> = points.iter().map(|point| pose.push(Vector3::from(*point)).into()).collect();
    let options = ContactOptions { pose: Some(pose), ..at(Elements::Faces) };
    let found = field.contacts(MeshView { points: &moved, faces: &faces }, &options).unwrap();
    assert_eq!(found.contacts.len(), still.contacts.len());
    for (found, still) in found.contacts.iter().zip(&still.contacts) {
        assert!(
            found.element == still.element && (found.distance - still.distance).abs() < 2e-6,
            "{found:?}, {still:?}"
        );
        let offset = found.point - found.surface_point;
        assert!((found.normal * found.distance - offset).norm() < 1e-9, "{found:?}");
    }
}

/// Takes the normal as a vector: by way of two points it would lose the digits of the place.
#[test]
fn the_normal_of_a_body_far_away_has_length_one() {
    let (_, mesh) = meshes().swap_remove(0);
    let field = baked(&mesh, 16, Layout::Dense, None);
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    for place in [0.0, 6.4e6, 1e9] {
        let pose = Rigid::new([place, -place, 0.3], [0.1, 0.2, 0.3, 0.9]).unwrap();
        let moved: Vec<[f64; 3]> = mesh.points.iter().map(|point| pose.push((*point).into()).into()).collect();
        let options = ContactOptions { exact: true, margin: 0.01, pose: Some(pose), ..ContactOptions::default() };
        let found = field.contacts(MeshView { points: &moved, ..view }, &options).unwrap();
        let normals = found.contacts.iter().map(|contact| contact.normal).filter(|normal| *normal != Vector3::zeros());
        let error = normals.clone().map(|normal| (normal.norm() - 1.0).abs()).fold(0.0, f64::max);
        assert!(normals.count() > 10 && error < 1e-14, "{place}: {error}");
    }
}

/// A cube without the faces at either end of z, or without the upper one.
fn open_cube(ends: usize) -> Mesh {
    let points = (0..8).map(|corner| [0, 1, 2].map(|axis| f64::from(corner >> axis & 1))).collect();
    let mut triangles = vec![
        [0, 1, 5],
        [0, 5, 4],
        [1, 3, 7],
        [1, 7, 5],
        [3, 2, 6],
        [3, 6, 7],
        [2, 0, 4],
        [2, 4, 6],
        [0, 2, 3],
        [0, 3, 1],
    ];
    triangles.truncate(10 - 2 * (ends - 1));
    Mesh { points, triangles, ..Mesh::default() }
}

#[test]
fn deep_contacts_of_open_meshes_are_found_by_an_exact_search_or_counted() {
    let through = [[0.2, 0.3, -6.0], [0.8, 0.4, -9.0], [0.5, 0.6, 11.0]];
    let dipped = [[0.5, 0.5, 0.4], [3.0, 0.7, 2.5], [-2.5, 0.5, 3.0]];
    let (mut random, mut found_in_all) = (Random::new(test_seed(81)), 0);
    for (ends, corners, margin) in [(2, through, 0.0), (2, through, 0.01), (1, dipped, -0.45)] {
        let mesh = open_cube(ends);
        let field = baked(&mesh, 32, Layout::Dense, None);
        let options = ContactOptions { margin, ..ContactOptions::default() };
        let exact = ContactOptions { exact: true, ..options };
        let element = MeshView { points: &corners, faces: &[[0, 1, 2]] };
        let (plain, found) = (field.contacts(element, &options).unwrap(), field.contacts(element, &exact).unwrap());
        assert_eq!((plain.contacts.len(), found.contacts.len()), (1, 1), "{ends} ends, margin {margin}");
        // The grid's own error, at most half of the diagonal of a cell.
        assert!(found.contacts[0].distance <= plain.contacts[0].distance + 0.03, "{:?}", found.contacts);

        // What another search finds is found or counted.
        let (points, faces) = random_faces(&mesh, &mut random, 200);
        let elements = MeshView { points: &points, faces: &faces };
        let (plain, found) = (field.contacts(elements, &options).unwrap(), field.contacts(elements, &exact).unwrap());
        let ids = |contacts: &sdf_field::Contacts| {
            contacts.contacts.iter().map(|contact| contact.element).collect::<Vec<_>>()
        };
        let triangles = TriangleMesh::new(&mesh.points, &mesh.triangles).unwrap();
        let mesh_distance = MeshDistance::new(&triangles, None);
        let missed = plain.contacts.iter().filter(|contact| {
            let is_deep = mesh_distance.signed_distance(contact.point.into()) <= margin;
            is_deep && !ids(&found).contains(&contact.element)
        });
        let missed = missed.count();
        assert!(missed <= found.undecided_count, "{missed} missed, {} counted", found.undecided_count);
        found_in_all += found.contacts.len();
    }
    assert!(found_in_all > 20, "{found_in_all}");
}

/// So far away that the side of a face of the body is below rounding.
#[test]
fn no_point_of_a_vast_element_is_deeper_than_the_body() {
    let (_, mesh) = meshes().swap_remove(0);
    let (field, mut random) = (baked(&mesh, 16, Layout::Dense, None), Random::new(test_seed(71)));
    let size = field.domain().diagonal();
    for far in [1e3, 1e13, 1e16, 1e20, 1e30] {
        for _ in 0..40 {
            let [u, v, w] = [0; 3].map(|_| Vector3::from(random.point_in_cube(1.0)) * size);
            let corners = [u, v, -(u + v)].map(|side| <[f64; 3]>::from(side * far + w));
            let options = ContactOptions { exact: true, ..ContactOptions::default() };
            let found = field.contacts(MeshView { points: &corners, faces: &[[0, 1, 2]] }, &options).unwrap();
            for contact in found.contacts {
                assert!(contact.distance >= -size && contact.lower_bound >= -2.0 * size, "{far}: {contact:?}");
            }
        }
    }
}

#[test]
fn a_mesh_with_holes_and_a_field_without_mesh_are_told() {
    let (_, mut mesh) = meshes().swap_remove(1);
    let points = mesh.points.clone();
    let faces = mesh.triangles.clone();
    let view = MeshView { points: &points, faces: &faces };
    let exact = ContactOptions { exact: true, ..ContactOptions::default() };
    let options = BakeOptions { size: GridSize::Cells(8), ..BakeOptions::default() };
    let without = Field::bake(view, &options).unwrap().field;
    assert_eq!(without.contacts(view, &exact).unwrap_err(), QueryError::MeshNotKept);
    assert!(QueryError::MeshNotKept.to_string().contains("bake --keep-mesh"));
    let fast = ContactOptions { method: Method::FrankWolfe, ..exact };
    assert_eq!(
        baked(&mesh, 8, Layout::Dense, None).contacts(view, &fast).unwrap_err(),
        QueryError::ExactHasItsOwnMethod
    );

    // Two caps of the ball are gone. The distance is that of the open mesh, its sign by the winding number.
    mesh.triangles.retain(|face| face.iter().all(|vertex| mesh.points[*vertex as usize][2].abs() < 0.9));
    let open = TriangleMesh::new(&mesh.points, &mesh.triangles).unwrap();
    let distance = MeshDistance::new(&open, None);
    assert!(!distance.is_continuous());
    let field = baked(&mesh, 24, Layout::Sparse, None);
    let found = field.contacts(view, &ContactOptions { margin: 0.01, ..exact }).unwrap();
    assert!(found.contacts.len() > 100);
    for contact in &found.contacts {
        let at = distance.signed_distance(contact.point.into());
        assert!((at - contact.distance).abs() < 1e-9 && contact.distance <= 0.01, "{at}: {contact:?}");
    }
}

#[test]
fn a_kept_mesh_comes_back_from_its_file_with_the_same_contacts_and_bytes_on_any_number_of_threads() {
    let (_, mesh) = meshes().swap_remove(4);
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let options = ContactOptions { margin: 0.05, exact: true, ..ContactOptions::default() };
    let inside: Vec<[f64; 3]> = mesh.points.iter().map(|point| point.map(|x| 0.97 * x)).collect();
    let probe = MeshView { points: &inside, faces: &mesh.triangles };
    for layout in Layout::ALL {
        let bytes = |threads| {
            let size = GridSize::Cells(24);
            let options = BakeOptions { size, layout, keep_mesh: true, threads, ..BakeOptions::default() };
            Field::bake(view, &options).unwrap().field.to_bytes().unwrap()
        };
        let field = baked(&mesh, 24, layout, None);
        let file = field.to_bytes().unwrap();
        assert!(file == bytes(sdf_field::Threads::ONE) && file == bytes(sdf_field::Threads::new(3)));
        let read = Field::from_bytes(&file, "kept").unwrap();
        assert_eq!(read.mesh(), field.mesh());
        assert_eq!(read.mesh().unwrap().view().faces.len(), mesh.triangles.len());
        let found = field.contacts(probe, &options).unwrap();
        assert!(found.contacts.len() > 20 && read.contacts(probe, &options).unwrap() == found);
    }
}
