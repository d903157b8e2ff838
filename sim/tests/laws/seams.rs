//! A sheet whose file has several points at one place, as along the seams of a texture.

use std::ops::ControlFlow;
use std::path::Path;

use sdf_field::Threads;
use sdf_procedural::Sheet;
use sdf_sim::record::Recording;
use sdf_sim::scene;

/// The recording of a sheet of this OBJ text, which is pinned at vertex 0 and at `pin`.
fn recorded(name: &str, obj: &str, pin: usize) -> Recording {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(folder.join(name), obj).unwrap();
    let text = format!(
        "title = \"a sheet\"\nframes = 20\nthickness = 0.01\n[[cloth]]\nmesh.file = \"{name}\"\npins = [0, {pin}]\n\
         [[obstacle]]\nshape = 'field = {{ shape = \"sphere\", radius = 0.4 }}'\n"
    );
    let spec = scene::parse(&text, "seams.toml").unwrap();
    let mut recording = Recording::default();
    let method = "auto".parse().unwrap();
    let outcome = scene::run_all(&spec, folder, method, Threads::ONE, 1, |_, frame, stage| {
        if frame == 0 {
            recording = Recording::new(&spec.title, spec.rate, stage, 8);
        }
        recording.push(stage);
        ControlFlow::Continue(())
    });
    assert_eq!(outcome.unwrap().warnings, [] as [&str; 0]);
    recording
}

fn obj(points: &[[f64; 3]], faces: &[[u32; 3]]) -> String {
    let points = points.iter().map(|[x, y, z]| format!("v {x:?} {y:?} {z:?}\n"));
    points.chain(faces.iter().map(|face| format!("f {} {} {}\n", face[0] + 1, face[1] + 1, face[2] + 1))).collect()
}

/// The copies come after all other points, so that the sheet is the same one without them, to the last bit.
#[test]
fn a_sheet_holds_together_at_points_that_its_file_has_twice_and_is_recorded_as_the_file_has_it() {
    let sheet =
        Sheet { cells: [8, 8], size: [1.0, 1.0], height: 0.45, bend: 0.0, floor: -1.0, holes: None, faces: None };
    let mesh = sheet.mesh();
    let (mut points, mut faces, mut copies) = (mesh.points.clone(), mesh.triangles.clone(), vec![]);
    for face in &mut faces {
        if face.iter().any(|vertex| mesh.points[*vertex as usize][0] > 0.0) {
            for vertex in face.iter_mut().filter(|vertex| mesh.points[**vertex as usize][0] == 0.0) {
                let copy = copies.iter().position(|other| other == vertex).unwrap_or_else(|| {
                    copies.push(*vertex);
                    // 0 and −0 are one place.
                    let [x, y, z] = mesh.points[*vertex as usize];
                    points.push([-x, y, z]);
                    copies.len() - 1
                });
                *vertex = (mesh.points.len() + copy) as u32;
            }
        }
    }
    assert_eq!(copies.len(), 9);
    let whole = recorded("whole.obj", &obj(&mesh.points, &mesh.triangles), copies[8] as usize);
    let split = recorded("split.obj", &obj(&points, &faces), points.len() - 1);
    assert_eq!((whole.faces, &split.faces), (mesh.triangles, &faces));
    for (whole, split) in whole.frames.iter().zip(&split.frames) {
        let (first, rest) = split.split_at(whole.len());
        assert_eq!(first, whole);
        assert_eq!(rest, copies.iter().map(|vertex| whole[*vertex as usize]).collect::<Vec<_>>());
    }
}

/// Each triangle has corners of its own: without a weld they fall one by one.
#[test]
fn a_sheet_of_single_triangles_hangs_by_its_pins() {
    let sheet =
        Sheet { cells: [4, 4], size: [1.0, 1.0], height: 0.45, bend: 0.0, floor: -1.0, holes: None, faces: None };
    let mesh = sheet.mesh();
    let points: Vec<_> = mesh.triangles.as_flattened().iter().map(|vertex| mesh.points[*vertex as usize]).collect();
    let faces: Vec<[u32; 3]> = (0..mesh.triangles.len() as u32).map(|face| [0, 1, 2].map(|k| 3 * face + k)).collect();
    let recording = recorded("soup.obj", &obj(&points, &faces), points.len() - 1);
    assert_eq!(recording.faces, faces);
    for frame in &recording.frames {
        for (a, b) in points.iter().zip(frame).flat_map(|a| points.iter().zip(frame).map(move |b| (a, b))) {
            assert!(a.0 != b.0 || a.1 == b.1, "{a:?} {b:?}");
        }
    }
}
