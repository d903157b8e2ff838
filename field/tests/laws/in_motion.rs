//! Queries of a mesh in motion: clusters, its own pose and margins for each face change no contact.

use sdf_core::placed::Rigid;
use sdf_core::shapes::{Cuboid, Torus};
use sdf_field::{
    BakeOptions, ContactOptions, Contacts, Field, GridSize, MeshClusters, MeshInMotion, MeshView, Method, QueryError,
    Threads, core as sdf_core,
};
use sdf_procedural::SpikedBall;
use sdf_procedural::random::{Random, test_seed};

/// The quaternion is about as long as `length`.
fn pose(random: &mut Random, half: f64, length: f64) -> Rigid {
    Rigid::new(random.point_in_cube(half), [0; 4].map(|_| length * random.between(-1.0, 1.0))).unwrap()
}

/// Checks that clusters change no contact. They may cull a face that its own box does not rule out: bounds of a smaller box need not
/// be tighter.
#[track_caller]
fn expect_same(found: &Contacts, plain: &Contacts) {
    assert_eq!(found.contacts, plain.contacts);
    assert!(found.searched_count <= plain.searched_count && found.element_count == plain.element_count);
}

#[test]
fn a_mesh_in_motion_has_the_contacts_of_its_moved_points() {
    let mut random = Random::new(test_seed(15));
    let field = Field::new(Torus::new(0.8, 0.3).unwrap());
    let body = SpikedBall { levels: 4, radius: 0.5 }.mesh();
    let mesh = MeshView { points: &body.points, faces: &body.triangles };
    let clusters = MeshClusters::new(mesh).unwrap();
    let (mut touching, mut culled) = (0, 0);
    for method in [Method::Auto, Method::FrankWolfe] {
        for length in [1.0, 1e-3, 1e-170, 1e170] {
            let [body_pose, field_pose] = [0; 2].map(|_| pose(&mut random, 0.8, length));
            let options = ContactOptions { margin: 0.03, pose: Some(field_pose), method, ..ContactOptions::default() };
            let moved: Vec<[f64; 3]> = body.points.iter().map(|point| body_pose.push((*point).into()).into()).collect();
            let plain = field.contacts(MeshView { points: &moved, ..mesh }, &options).unwrap();
            let in_motion =
                MeshInMotion { pose: Some(body_pose), clusters: Some(&clusters), ..MeshInMotion::new(mesh) };
            for threads in [Threads::ONE, Threads::new(3)] {
                let found = field.contacts_in_motion(&in_motion, &ContactOptions { threads, ..options }).unwrap();
                expect_same(&found, &plain);
            }
            touching += plain.contacts.len();
            culled += body.triangles.len() - plain.searched_count;

            // Each face with a margin of its own: the contacts of a larger one that are within it.
            let margins: Vec<f64> = body.triangles.iter().map(|_| random.between(-0.02, 0.03)).collect();
            let in_motion = MeshInMotion { margins: Some(&margins), ..in_motion };
            let found = field.contacts_in_motion(&in_motion, &options).unwrap();
            let within =
                |contact: &&sdf_core::contact::Contact<f64>| contact.distance <= margins[contact.element as usize];
            let expected: Vec<_> = plain.contacts.iter().filter(within).copied().collect();
            assert_eq!(found.contacts, expected);
        }
    }
    assert!(touching > 100 && culled > 1000, "{touching} touch, {culled} are culled");
}

#[test]
fn a_deformed_mesh_is_fitted_again() {
    let field = Field::new(Torus::new(0.8, 0.3).unwrap());
    let body = SpikedBall { levels: 3, radius: 0.5 }.mesh();
    let mut clusters = MeshClusters::new(MeshView { points: &body.points, faces: &body.triangles }).unwrap();
    let points: Vec<[f64; 3]> = body.points.iter().map(|[x, y, z]| [3.0 * x, y - 0.2 * x * x, z + 0.5]).collect();
    let deformed = MeshView { points: &points, faces: &body.triangles };
    clusters.refit(deformed).unwrap();
    let options = ContactOptions { margin: 0.05, ..ContactOptions::default() };
    let in_motion = MeshInMotion { clusters: Some(&clusters), ..MeshInMotion::new(deformed) };
    let found = field.contacts_in_motion(&in_motion, &options).unwrap();
    assert!(!found.contacts.is_empty());
    expect_same(&found, &field.contacts(deformed, &options).unwrap());
}

#[test]
fn clusters_and_margins_of_another_mesh_are_refused() {
    let field = Field::new(Torus::new(0.8, 0.3).unwrap());
    let (body, other) = (SpikedBall { levels: 2, radius: 0.5 }.mesh(), SpikedBall { levels: 1, radius: 0.5 }.mesh());
    let mesh = MeshView { points: &body.points, faces: &body.triangles };
    let mut clusters = MeshClusters::new(MeshView { points: &other.points, faces: &other.triangles }).unwrap();
    let options = ContactOptions::default();
    let refused = |mesh: &MeshInMotion| field.contacts_in_motion(mesh, &options).unwrap_err();
    let plain = MeshInMotion::new(mesh);
    assert_eq!(refused(&MeshInMotion { clusters: Some(&clusters), ..plain }), QueryError::FaceCountDiffers);
    assert_eq!(refused(&MeshInMotion { margins: Some(&[0.0]), ..plain }), QueryError::FaceCountDiffers);
    let mut margins = vec![0.0; body.triangles.len()];
    margins[5] = f64::NAN;
    assert_eq!(refused(&MeshInMotion { margins: Some(&margins), ..plain }), QueryError::MarginNotFinite(5));
    assert_eq!(clusters.refit(mesh).unwrap_err(), QueryError::FaceCountDiffers);
    let broken = MeshView { points: &body.points[..5], faces: &body.triangles };
    assert!(MeshClusters::new(broken).is_err());
}

/// All that is said of a face, its lower bounds too, follows from its own margin.
#[test]
fn the_margin_of_one_face_changes_nothing_of_another() {
    let cuboid = Field::new(Cuboid::new([0.5; 3]).unwrap());
    let cube = sdf_procedural::Cuboid { half: [0.5; 3] }.mesh();
    let cube = MeshView { points: &cube.points, faces: &cube.triangles };
    let baked = Field::bake(cube, &BakeOptions { size: GridSize::Cells(16), ..BakeOptions::default() }).unwrap().field;
    let at = |z: f64| [[-0.2, -0.2, z], [0.2, -0.2, z], [0.0, 0.2, z]];
    for field in [&cuboid, &baked] {
        let points = [at(0.51), at(0.7)].concat();
        let mesh = MeshView { points: &points, faces: &[[0, 1, 2], [3, 4, 5]] };
        for method in [Method::Auto, Method::FrankWolfe, Method::ProjectedGradient, Method::Newton] {
            let options = ContactOptions { method, margin: 0.02, ..ContactOptions::default() };
            let first = |margin: f64| {
                let in_motion = MeshInMotion { margins: Some(&[0.02, margin]), ..MeshInMotion::new(mesh) };
                field.contacts_in_motion(&in_motion, &options).unwrap().contacts[0]
            };
            let alone = field.contacts(mesh, &options).unwrap().contacts[0];
            for margin in [0.02, 0.5, 10.0, 1e6, 1e9] {
                assert_eq!(first(margin), alone, "{method}, margin {margin}");
            }
        }
    }
}
