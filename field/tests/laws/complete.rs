//! A complete search leaves out no face that is near the mesh itself, though the grid is off; and bounds hold for the mesh.

use sdf_bake::{MeshDistance, TriangleMesh};
use sdf_field::core::contact::ContactStatus;
use sdf_field::core::grid::owned::Layout;
use sdf_field::core::placed::Rigid;
use sdf_field::core::shapes::{HalfSpace, Sphere};
use sdf_field::{
    BakeOptions, ContactOptions, Field, GridInfo, GridSize, InnerFaces, MeshView, Method, QueryError, SignMethod,
    Threads,
};
use sdf_procedural::random::{Random, test_seed};
use sdf_procedural::{Bowl, Mesh, SpikedBall};

/// Five closed meshes, most of them with features finer than a voxel.
pub fn meshes() -> Vec<(&'static str, Mesh)> {
    let ball = |levels, radius| SpikedBall { levels, radius }.mesh();
    let stretched = ball(2, 0.9).transformed(|[x, y, z]| [x, 0.4 * y, 0.2 * z]);
    let mut apart = ball(1, 0.5).transformed(|[x, y, z]| [x - 1.5, y, z]);
    apart.append(&ball(0, 1.0).transformed(|[x, y, z]| [x + 1.5, y, z]));
    vec![
        ("spiked ball", ball(2, 0.6)),
        ("facets", ball(3, 1.0)),
        ("stretched", stretched),
        ("bowl", Bowl { slices: 24, stacks: 24, thickness: 0.06 }.mesh()),
        ("two bodies", apart),
    ]
}

/// Triangles of all sizes, half of them near a point of the surface.
pub fn random_faces(mesh: &Mesh, random: &mut Random, count: usize) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let mut points = vec![];
    for _ in 0..count {
        let middle = match random.below(2) {
            0 => random.point_in_cube(1.6),
            _ => random.pick(&mesh.points),
        };
        let size = random.pick(&[0.02, 0.1, 0.4]);
        for _ in 0..3 {
            let offset = random.point_in_cube(size);
            points.push(std::array::from_fn(|axis| middle[axis] + offset[axis]));
        }
    }
    let faces = (0..count as u32).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect();
    (points, faces)
}

/// The lowest exact distance of a lattice on a triangle: an upper bound of its minimum.
fn lowest_on_lattice(exact: &MeshDistance, corners: [[f64; 3]; 3]) -> f64 {
    const STEPS: u32 = 8;
    let mut lowest = f64::INFINITY;
    for i in 0..=STEPS {
        for j in 0..=STEPS - i {
            let [u, v] = [i, j].map(|step| f64::from(step) / f64::from(STEPS));
            let weights = [1.0 - u - v, u, v];
            let point = std::array::from_fn(|axis| (0..3).map(|corner| weights[corner] * corners[corner][axis]).sum());
            lowest = lowest.min(exact.signed_distance(point));
        }
    }
    lowest
}

#[test]
fn a_complete_search_misses_no_face_that_is_near_the_mesh() {
    let seed = test_seed(20_201_122);
    println!("to repeat: SDF_SEED={seed}");
    let mut random = Random::new(seed);
    let (mut missed, mut missed_when_complete, mut possible, mut found) = (0, 0, 0, 0);
    for (name, mesh) in meshes() {
        let triangles = TriangleMesh::new(&mesh.points, &mesh.triangles).unwrap();
        let exact = MeshDistance::new(&triangles, None);
        let (points, faces) = random_faces(&mesh, &mut random, 400);
        let view = MeshView { points: &points, faces: &faces };
        let truth: Vec<f64> =
            faces.iter().map(|face| lowest_on_lattice(&exact, face.map(|vertex| points[vertex as usize]))).collect();
        for layout in Layout::ALL {
            let options = BakeOptions { size: GridSize::Cells(32), layout, ..BakeOptions::default() };
            let field = Field::bake(MeshView { points: &mesh.points, faces: &mesh.triangles }, &options).unwrap().field;
            for (margin, method) in [(0.0, Method::Auto), (0.02, Method::Auto), (0.0, Method::FrankWolfe)] {
                let plain = ContactOptions { margin, method, ..ContactOptions::default() };
                let complete = ContactOptions { complete: true, ..plain };
                let (few, all) = (field.contacts(view, &plain).unwrap(), field.contacts(view, &complete).unwrap());
                let has = |contacts: &sdf_field::Contacts, face: usize| {
                    contacts.contacts.iter().any(|contact| contact.element as usize == face)
                };
                for (face, truth) in truth.iter().enumerate().filter(|(_, truth)| **truth <= margin) {
                    missed += usize::from(!has(&few, face));
                    let is_missed = !has(&all, face);
                    assert!(!is_missed, "{name} {layout:?}: face {face} at {truth} is missed by {method:?}");
                    missed_when_complete += usize::from(is_missed);
                    found += 1;
                }
                assert_eq!(
                    all.possible_count,
                    all.contacts.iter().filter(|contact| contact.status == ContactStatus::Possible).count()
                );
                possible += all.possible_count;
                for contact in &all.contacts {
                    let context = || format!("{name} {layout:?}: {contact:?}");
                    assert_eq!(contact.status == ContactStatus::Possible, contact.distance > margin, "{}", context());
                    // Rounding of exact distances and of weights.
                    let slack = 1e-6;
                    assert!(contact.shape_lower_bound <= truth[contact.element as usize] + slack, "{}", context());
                    let off = (exact.signed_distance(contact.point.into()) - contact.distance).abs();
                    assert!(off <= contact.error_bound + slack, "{off}: {}", context());
                }
            }
        }
    }
    println!("{found} faces near: {missed} missed, {missed_when_complete} by a complete search; {possible} possible");
    assert!(missed > 10, "only {missed} faces were missed by the plain search: the meshes are too easy");
}

#[test]
fn a_closed_form_has_nothing_possible_and_a_grid_without_bound_is_refused() {
    let points = [[0.0, 0.0, 1.001], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0]];
    let mesh = MeshView { points: &points, faces: &[[0, 1, 2]] };
    let complete = ContactOptions { complete: true, ..ContactOptions::default() };
    let sphere = Field::new(Sphere::new(1.0).unwrap());
    assert_eq!(sphere.contacts(mesh, &complete).unwrap().contacts, []);
    let touching = ContactOptions { pose: Rigid::new([0.0, 0.0, 0.01], [0.0, 0.0, 0.0, 1.0]), ..complete };
    let found = sphere.contacts(mesh, &touching).unwrap();
    assert_eq!((found.contacts.len(), found.possible_count, found.contacts[0].error_bound), (1, 0, 0.0));

    let ball = SpikedBall { levels: 1, radius: 0.5 }.mesh();
    let body = MeshView { points: &ball.points, faces: &ball.triangles };
    let baked = Field::bake(body, &BakeOptions { size: GridSize::Cells(8), ..BakeOptions::default() }).unwrap().field;
    let unknown = (**baked.grid().unwrap()).clone().with_error_bound(f64::INFINITY);
    let unknown = Field::from_grid(unknown, GridInfo::clone(baked.info().unwrap()));
    assert_eq!(unknown.contacts(mesh, &complete).unwrap_err(), QueryError::ErrorBoundUnknown);
}

#[test]
fn a_complete_search_says_where_a_mesh_leaves_the_box_of_a_grid_in_a_combination() {
    let ball = SpikedBall { levels: 1, radius: 0.5 }.mesh();
    let body = MeshView { points: &ball.points, faces: &ball.triangles };
    let dense = BakeOptions { size: GridSize::Cells(8), layout: Layout::Dense, ..BakeOptions::default() };
    let grid = Field::bake(body, &dense).unwrap().field;
    let near = [[0.0, 0.0, 0.2], [0.2, 0.0, 0.2], [0.0, 0.2, 0.3]];
    let far = near.map(|point| point.map(|x| x + 5.0));
    let points = [near, far].concat();
    let complete = ContactOptions { complete: true, ..ContactOptions::default() };
    let search = |field: &Field, faces: &[[u32; 3]]| {
        let vertices = &points[..3 * faces.len()];
        field.contacts(MeshView { points: vertices, faces }, &complete)
    };
    let both = [[0, 1, 2], [3, 4, 5]];
    let carved = Field::new(Sphere::new(0.5).unwrap()).difference(&grid).unwrap();
    for field in [grid.shell(0.02).unwrap(), carved] {
        assert!(search(&field, &both[..1]).is_ok());
        assert_eq!(search(&field, &both), Err(QueryError::OutsideGridInCombination));
    }
    assert_eq!(search(&grid, &both).unwrap().contacts.len(), 1);
}

/// The inside of three open sheets, one above the other, has no end below them: the winding number is above ½ there at the box's face.
#[test]
fn nothing_is_claimed_outside_of_the_box_where_the_inside_of_an_open_mesh_reaches_it() {
    let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
    let points: Vec<[f64; 3]> = [0.0, 0.15, 0.3].into_iter().flat_map(|z| corners.map(|[x, y]| [x, y, z])).collect();
    let faces: Vec<[u32; 3]> =
        (0..3).flat_map(|sheet| [[0, 1, 2], [0, 2, 3]].map(|face| face.map(|k| k + 4 * sheet))).collect();
    let sheets = MeshView { points: &points, faces: &faces };
    let at = |z: f64| [[0.0, 0.0, z], [0.01, 0.0, z], [0.0, 0.01, z]];
    let truth = |z: f64| Field::mesh_distances(sheets, &at(z), None, Threads::ONE).unwrap()[0];
    let face = [[0, 1, 2]];
    for layout in Layout::ALL {
        let options =
            BakeOptions { size: GridSize::Cells(20), layout, padding: 2, keep_mesh: true, ..BakeOptions::default() };
        let baked = Field::bake(sheets, &options).unwrap().field;
        assert!(baked.info().unwrap().sign_reason.contains("its inside reaches the grid's box"), "{layout:?}");
        let read = Field::from_bytes(&baked.to_bytes().unwrap(), "read").unwrap();
        let search = |field: &Field, z: f64, options: ContactOptions| {
            field.contacts(MeshView { points: &at(z), faces: &face }, &options)
        };
        for field in [&baked, &read] {
            for z in [-0.05, -0.2, -0.3] {
                let found = search(field, z, ContactOptions::default()).unwrap().contacts;
                assert!(
                    found.iter().all(|contact| contact.shape_lower_bound <= truth(z)),
                    "{layout:?}, {z}: {found:?}"
                );
            }
            let (complete, exact) = (
                ContactOptions { complete: true, ..ContactOptions::default() },
                ContactOptions { exact: true, ..ContactOptions::default() },
            );
            for options in [complete, exact] {
                assert_eq!(search(field, -0.05, options).unwrap().contacts.len(), 1, "{layout:?}");
                assert_eq!(search(field, -0.35, options), Err(QueryError::ErrorBoundUnknown), "{layout:?}");
            }
        }
        assert!(truth(-0.35) < 0.0);
    }
}

#[test]
fn one_contact_per_feature_keeps_every_feature() {
    let ground = Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    let mesh = SpikedBall { levels: 2, radius: 0.6 }.mesh();
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let all = ContactOptions { margin: -0.2, ..ContactOptions::default() };
    let few = ContactOptions { one_per_feature: true, ..all };
    let features = |options| {
        let found = ground.contacts(view, options).unwrap().contacts;
        let mut features: Vec<_> = found.iter().map(|contact| contact.feature).collect();
        features.sort_unstable();
        (found.len(), features)
    };
    let ((count, mut touched), (kept, representatives)) = (features(&all), features(&few));
    touched.dedup();
    assert!(kept < count && touched == representatives, "{kept} of {count}");
}

/// Two alike boxes within each other, and two that cross: pseudo-normals take what lies between or within for the outside. No bound holds
/// there, so none is stated.
#[test]
fn a_grid_whose_signs_may_be_wrong_has_no_error_bound() {
    let mut pairs = vec![];
    for (half, shift) in [([0.5; 3], [0.0; 3]), ([0.6, 0.4, 0.3], [0.9, 0.1, 0.2])] {
        let [mut both, inner] = [[1.0; 3], half].map(|half| sdf_procedural::Cuboid { half }.mesh());
        let first = both.points.len() as u32;
        both.points.extend(inner.points.iter().map(|[x, y, z]| [x + shift[0], y + shift[1], z + shift[2]]));
        both.triangles.extend(inner.triangles.iter().map(|face| face.map(|vertex| vertex + first)));
        pairs.push(both);
    }
    let corners = [[0.1, 0.2, 0.1], [0.11, 0.2, 0.1], [0.1, 0.21, 0.1]];
    let mesh = MeshView { points: &corners, faces: &[[0, 1, 2]] };
    let complete = ContactOptions { complete: true, ..ContactOptions::default() };
    for both in &pairs {
        let body = MeshView { points: &both.points, faces: &both.triangles };
        for layout in [Layout::Dense, Layout::Sparse] {
            for sign in [Some(SignMethod::PseudoNormal), None] {
                let options = BakeOptions {
                    size: GridSize::Cells(16),
                    layout,
                    sign,
                    inner_faces: InnerFaces::Keep,
                    ..BakeOptions::default()
                };
                let field = Field::bake(body, &options).unwrap().field;
                let (bound, found) = (field.info().unwrap().error_bound, field.contacts(mesh, &complete));
                match sign {
                    Some(_) => assert_eq!((bound, found), (f64::INFINITY, Err(QueryError::ErrorBoundUnknown))),
                    None => assert!(bound.is_finite() && found.unwrap().contacts.len() == 1),
                }
            }
        }
    }
}
