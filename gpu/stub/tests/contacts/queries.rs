//! One launch after the other, from frame to frame.

use sdf_core::contact::Contact;
use sdf_core::minimize::{Certified, FrankWolfe, GoldenSection, Newton, PointSampling, ProjectedGradient};
use sdf_core::placed::Rigid;
use sdf_gpu::{Elements, Gpu, GpuError, GpuField, GpuMesh, GpuQuery, Method, QueryOptions, Stages};

use crate::scenes::{Scene, assert_equal, pulled, pushed, scene, scenes};
use crate::{gpu, with_stub};

/// All methods, and the elements that they search.
const METHODS: [(&str, Method); 9] = [
    ("faces", Method::FrankWolfe),
    ("faces", Method::ProjectedGradient),
    ("faces", Method::Newton),
    ("faces", Method::Certified),
    ("edges", Method::FrankWolfe),
    ("edges", Method::ProjectedGradient),
    ("edges", Method::GoldenSection),
    ("edges", Method::Certified),
    ("vertices", Method::PointSampling),
];

fn elements<'a>(scene: &'a Scene, kind: &str) -> Elements<'a> {
    match kind {
        "faces" => Elements::Faces(&scene.faces),
        "edges" => Elements::Edges(&scene.edges),
        _ => Elements::Vertices,
    }
}

fn expected(scene: &Scene, kind: &str, method: Method, stages: Stages) -> (Vec<Contact<f32>>, u32) {
    if matches!(stages, Stages::Lean | Stages::LeanSeparate) {
        let points = PointSampling { samples: 32, corners: false };
        return match (kind, method) {
            ("vertices", _) => scene.expected_lean(&scene.vertices(), &points),
            ("edges", Method::ProjectedGradient) => scene.expected_lean(&scene.edges, &ProjectedGradient::default()),
            ("edges", _) => scene.expected_lean(&scene.edges, &FrankWolfe::default()),
            (_, Method::ProjectedGradient) => scene.expected_lean(&scene.faces, &ProjectedGradient::default()),
            _ => scene.expected_lean(&scene.faces, &FrankWolfe::default()),
        };
    }
    let certified = Certified { evaluations: 32, ..Certified::default() };
    match (kind, method) {
        ("vertices", _) => scene.expected(&scene.vertices(), &PointSampling { samples: 32, corners: false }),
        ("edges", Method::GoldenSection) => scene.expected(&scene.edges, &GoldenSection::default()),
        ("edges", Method::Certified) => scene.expected(&scene.edges, &certified),
        ("edges", Method::ProjectedGradient) => scene.expected(&scene.edges, &ProjectedGradient::default()),
        ("edges", _) => scene.expected(&scene.edges, &FrankWolfe::default()),
        (_, Method::ProjectedGradient) => scene.expected(&scene.faces, &ProjectedGradient::default()),
        (_, Method::Newton) => scene.expected(&scene.faces, &Newton::default()),
        (_, Method::Certified) => scene.expected(&scene.faces, &certified),
        _ => scene.expected(&scene.faces, &FrankWolfe::default()),
    }
}

fn query(gpu: &Gpu, scene: &Scene, kind: &str, options: QueryOptions) -> Result<GpuQuery, GpuError> {
    let field = GpuField::new(gpu, &scene.field)?;
    let mesh = GpuMesh::new(gpu, &scene.points, elements(scene, kind))?;
    GpuQuery::new(gpu, &field, mesh, &QueryOptions { margin: scene.margin, ..options })
}

#[test]
fn contacts_are_those_of_the_core_bit_for_bit() {
    with_stub("queries::contacts_are_those_of_the_core_bit_for_bit", &[], |folder| {
        let gpu = gpu(folder);
        let mut compared = 0;
        for scene in scenes() {
            for (kind, method) in METHODS {
                for stages in [Stages::Separate, Stages::Fused, Stages::Lean, Stages::LeanSeparate] {
                    let options = QueryOptions { method, stages, ..QueryOptions::default() };
                    let what = format!("{} {kind} {method:?} {stages:?}", scene.kind);
                    let mut query = match query(&gpu, &scene, kind, options) {
                        Err(GpuError::Unsupported(_)) => continue,
                        query => query.unwrap(),
                    };
                    let (contacts, skipped) = expected(&scene, kind, method, stages);
                    // The counters begin at zero each time.
                    for _ in 0..2 {
                        let found = query.contacts().unwrap();
                        assert_equal(&found.contacts, &contacts, &what);
                        assert_eq!(found.skipped_count, skipped, "{what}");
                    }
                    compared += 1;
                }
            }
        }
        // As the table of docs/gpu.md has them.
        assert_eq!(compared, 36 + 11 + 4);
    });
}

#[test]
fn grids_of_other_codes_are_searched_as_sparse_ones_of_u16() {
    with_stub("queries::grids_of_other_codes_are_searched_as_sparse_ones_of_u16", &[], |folder| {
        let gpu = gpu(folder);
        for name in ["sparse_u8", "dense_u16", "dense_u8"] {
            let scene = scene(name);
            for method in [Method::FrankWolfe, Method::Certified] {
                let options = QueryOptions { method, ..QueryOptions::default() };
                let found = query(&gpu, &scene, "faces", options).unwrap().contacts().unwrap();
                let (contacts, _) = expected(&scene, "faces", method, Stages::Separate);
                assert_equal(&found.contacts, &contacts, &format!("{name} {method:?}"));
            }
        }
    });
}

#[test]
fn a_pose_moves_the_field_and_what_is_on_the_card_stays() {
    with_stub("queries::a_pose_moves_the_field_and_what_is_on_the_card_stays", &[], |folder| {
        let gpu = gpu(folder);
        let turned = Rigid::new([0.05, -0.1, 0.2], [0.1, 0.2, -0.3, 0.9]).unwrap();
        let far = Rigid::new([1000.0, 0.0, -500.0], [0.0, 0.0, 1.0, 0.0]).unwrap();
        for (kind, stages) in [("dense", Stages::Separate), ("dense", Stages::Fused), ("shapes", Stages::Separate)] {
            let mut scene = scene(kind);
            let own_points = scene.points.clone();
            let mut query = query(&gpu, &scene, "faces", QueryOptions { stages, ..QueryOptions::default() }).unwrap();
            for pose in [None, Some(turned), Some(far), None, Some(turned)] {
                let what = format!("{kind} {stages:?} {pose:?}");
                // The mesh of this frame: about the field, wherever that stands.
                let shift = pose.map_or([0.0; 3], |pose| pose.translation()).map(|x| x as f32);
                let points: Vec<[f32; 3]> =
                    own_points.iter().map(|point| [0, 1, 2].map(|axis| point[axis] + shift[axis])).collect();
                query.set_points(&points).unwrap();
                query.set_pose(pose.as_ref()).unwrap();
                scene.points = pose.map_or(points.clone(), |pose| pulled(&points, &pose));
                let (local, _) = scene.expected(&scene.faces, &FrankWolfe::default());
                let world = |contact: &Contact<f32>| pose.map_or(*contact, |pose| pushed(contact, &pose));
                let expected: Vec<_> = local.iter().map(world).collect();
                assert_equal(&query.contacts().unwrap().contacts, &expected, &what);
            }
        }
    });
}

#[test]
fn a_measured_query_leaves_the_same_contacts() {
    with_stub("queries::a_measured_query_leaves_the_same_contacts", &[], |folder| {
        let (gpu, scene) = (gpu(folder), scene("dense"));
        let mut query = query(&gpu, &scene, "faces", QueryOptions::default()).unwrap();
        let times = query.time(3).unwrap();
        assert_eq!((times.kernels.len(), times.graph.len(), times.launched.len()), (3, 3, 3));
        assert!(times.kernels.iter().all(|kernel| kernel.len() == 3));
        let (contacts, _) = scene.expected(&scene.faces, &FrankWolfe::default());
        assert_equal(&query.contacts().unwrap().contacts, &contacts, "after the measurement");
    });
}

#[test]
fn wrong_input_is_refused_before_a_launch() {
    with_stub("queries::wrong_input_is_refused_before_a_launch", &[], |folder| {
        let (gpu, scene) = (gpu(folder), scene("shapes"));
        let none = GpuMesh::new(&gpu, &scene.points[..5], Elements::Faces(&[[0, 1, 2], [3, 4, 5]]));
        assert!(matches!(none, Err(GpuError::NoVertex { element: 1, vertex: 5, count: 5 })), "{none:?}");
        let mut query = query(&gpu, &scene, "faces", QueryOptions::default()).unwrap();
        let short = query.set_points(&scene.points[1..]);
        assert!(matches!(short, Err(GpuError::PointCount { .. })), "{short:?}");

        let field = GpuField::new(&gpu, &scene.field).unwrap();
        let empty = GpuMesh::new(&gpu, &[], Elements::Faces(&[])).unwrap();
        let mut query = GpuQuery::new(&gpu, &field, empty, &QueryOptions::default()).unwrap();
        query.set_points(&[]).unwrap();
        query.set_pose(Some(&Rigid::new([1.0; 3], [0.0, 0.0, 0.0, 1.0]).unwrap())).unwrap();
        assert_eq!(query.contacts().unwrap(), sdf_gpu::GpuContacts::default());
    });
}
