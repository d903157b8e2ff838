//! Checks of a mesh before it is baked.

use sdf_bake::{InvalidMesh, MeshReport, Repairs, TriangleMesh};

use crate::meshes;

const CORNERS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn report(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> MeshReport {
    TriangleMesh::new(points, triangles).unwrap().report()
}

#[test]
fn a_clean_mesh_has_nothing_to_report() {
    for mesh in [meshes::cube(), meshes::icosphere(2), meshes::torus(1.0, 0.3, 12, 6), meshes::sheet(5)] {
        let baked = mesh.baked();
        assert_eq!(baked.report(), MeshReport::default());
        assert_eq!(baked.triangle_count(), mesh.triangles.len());
        for (triangle, corners) in mesh.corners().into_iter().enumerate() {
            assert_eq!(baked.corners(triangle), corners.map(<[f64; 3]>::from));
        }
    }
}

#[test]
fn points_at_one_position_are_welded() {
    let mut points = CORNERS.to_vec();
    points.extend([CORNERS[1], [-0.0, 1.0, -0.0], [1.0, 0.0, f64::MIN_POSITIVE]]);
    let found = report(&points, &[[0, 1, 2], [0, 4, 3], [0, 5, 3], [6, 2, 3]]);
    assert_eq!(found, MeshReport { welded_points: 2, ..MeshReport::default() });
    let apart = meshes::cube();
    let corners: Vec<[f64; 3]> = apart.corners().into_iter().flatten().map(<[f64; 3]>::from).collect();
    let triangles: Vec<[u32; 3]> = (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let welded = TriangleMesh::new(&corners, &triangles).unwrap();
    assert_eq!(welded.report(), MeshReport { welded_points: 28, ..MeshReport::default() });
    let verdict = sdf_bake::MeshDistance::new(&welded, None).sign_reason().to_owned();
    assert_eq!(verdict, "pseudo-normal: closed, consistently wound, one shell");
}

#[test]
fn points_that_no_triangle_uses_are_counted_and_do_not_widen_the_box() {
    let mut points = CORNERS.to_vec();
    points.extend([[9.0; 3], [-9.0; 3]]);
    let mesh = TriangleMesh::new(&points, &[[0, 1, 2]]).unwrap();
    assert_eq!(mesh.report(), MeshReport { unreferenced_points: 3, ..MeshReport::default() });
    assert_eq!((mesh.bounds().min, mesh.bounds().max), ([0.0; 3], [1.0, 1.0, 0.0]));
}

#[test]
fn points_that_no_triangle_uses_may_be_anything() {
    let crossing = meshes::cube().and(meshes::cube().moved(0.3, 0.4, 0.5));
    let bad = [[f64::NAN; 3], [0.0, f64::INFINITY, 0.0], [1e300, 0.0, f64::MIN]];
    for (name, mesh) in [("open", meshes::cube().without(&[5])), ("crossing", crossing)] {
        let points = [&[[f64::NEG_INFINITY; 3]], &mesh.coordinates()[..], &bad].concat();
        let triangles: Vec<_> = mesh.triangles.iter().map(|corners| corners.map(|corner| corner + 1)).collect();
        for repairs in [Repairs::default(), Repairs { weld: Some(1e-3), close: Some(9.0) }] {
            let clean = repairs.apply(&mesh.coordinates(), &mesh.triangles).unwrap().without_inner_faces();
            let padded = repairs.apply(&points, &triangles).unwrap().without_inner_faces();
            assert_eq!((padded.bounds(), padded.packed()), (clean.bounds(), clean.packed()), "{name}");
            assert_eq!(padded.report(), MeshReport { unreferenced_points: 4, ..clean.report() }, "{name}");
            let [clean, padded] = [&clean, &padded].map(|mesh| sdf_bake::MeshDistance::new(mesh, None));
            let steps =
                (0..512).map(|step| [step % 8, step / 8 % 8, step / 64].map(|step| 0.4 * f64::from(step) - 1.3));
            for point in steps {
                let found = [&padded, &clean].map(|distance| distance.signed_distance(point));
                assert_eq!(found[0].to_bits(), found[1].to_bits(), "{name}: {point:?}");
            }
        }
    }
}

#[test]
fn triangles_without_area_are_counted_and_left_out() {
    let mut points = CORNERS.to_vec();
    points.push([0.5, 0.0, 0.0]);
    let mesh = TriangleMesh::new(&points, &[[0, 1, 2], [0, 1, 4], [1, 1, 3], [2, 2, 2], [0, 2, 3]]).unwrap();
    assert_eq!(mesh.report(), MeshReport { degenerate_triangles: 3, ..MeshReport::default() });
    assert_eq!(mesh.triangle_count(), 2);
    let on_a_line = TriangleMesh::new(&[[0.0; 3], [1.0; 3], [2.0; 3]], &[[0, 1, 2], [0, 0, 1]]);
    assert_eq!(on_a_line.unwrap_err(), InvalidMesh::NoArea);
}

#[test]
fn repeated_triangles_are_counted_and_left_out() {
    let mut points = CORNERS.to_vec();
    points.push(CORNERS[2]);
    let triangles = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 1, 4], [0, 2, 1], [1, 2, 3], [3, 1, 2]];
    let mesh = TriangleMesh::new(&points, &triangles).unwrap();
    assert_eq!(mesh.report(), MeshReport { welded_points: 1, repeated_triangles: 4, ..MeshReport::default() });
    assert_eq!(mesh.triangle_count(), 3);
}

/// Both sides of a tetrahedron's faces, again and again in another order, begun at any corner.
#[test]
fn the_first_of_repeated_triangles_stays_wherever_the_others_are() {
    let sides = [[0, 1, 2], [0, 2, 1], [0, 1, 3], [0, 3, 1], [0, 2, 3], [0, 3, 2], [1, 2, 3], [1, 3, 2]];
    let rotated = |[a, b, c]: [u32; 3], by: usize| [[a, b, c], [b, c, a], [c, a, b]][by % 3];
    let triangle = |index: usize| rotated(sides[(5 * index * index + 3 * index / 2) % sides.len()], index / 2);
    let triangles: Vec<[u32; 3]> = (0..60).map(triangle).collect();
    let is_first = |index: &usize| {
        let is_same = |other: &[u32; 3]| (0..3).any(|by| rotated(*other, by) == triangles[*index]);
        !triangles[..*index].iter().any(is_same)
    };
    let firsts: Vec<[u32; 3]> = (0..60).filter(is_first).map(|index| triangles[index]).collect();
    assert!(firsts.len() > 4 && firsts != triangles[..firsts.len()]);
    let mesh = TriangleMesh::new(&CORNERS, &triangles).unwrap();
    assert_eq!(mesh.triangle_count(), firsts.len());
    for (triangle, corners) in firsts.iter().enumerate() {
        assert_eq!(mesh.corners(triangle), corners.map(|corner| CORNERS[corner as usize]));
    }
}

#[test]
fn an_invalid_mesh_is_refused_with_the_index_of_its_error() {
    let refusal = |points: &[[f64; 3]], triangles: &[[u32; 3]]| TriangleMesh::new(points, triangles).unwrap_err();
    assert_eq!(refusal(&CORNERS, &[]), InvalidMesh::NoTriangles);
    assert_eq!(refusal(&[], &[]), InvalidMesh::NoTriangles);
    let too_high = InvalidMesh::IndexOutOfRange { triangle: 1, index: 4, points: 4 };
    assert_eq!(refusal(&CORNERS, &[[0, 1, 2], [0, 4, 9]]), too_high);
    assert_eq!(too_high.to_string(), "triangle 1 refers to point 4, but the mesh has 4 points");
    assert_eq!(refusal(&[], &[[0, 0, 0]]), InvalidMesh::IndexOutOfRange { triangle: 0, index: 0, points: 0 });
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut points = CORNERS;
        points[2][1] = bad;
        assert_eq!(refusal(&points, &[[0, 1, 2]]), InvalidMesh::NotFinite { point: 2 });
    }
    for far in [1.000_001e30, -1e31, f64::MAX] {
        let mut points = CORNERS;
        points[3][2] = far;
        assert_eq!(refusal(&points, &[[0, 1, 2], [0, 1, 3]]), InvalidMesh::TooFarOut { point: 3, position: points[3] });
    }
    assert_eq!(refusal(&CORNERS, &[[1, 1, 1]]), InvalidMesh::NoExtent { side: 0.0 });
    let tiny = CORNERS.map(|p| p.map(|x| x * 0.99e-30));
    assert_eq!(refusal(&tiny, &[[0, 1, 2]]), InvalidMesh::NoExtent { side: 0.99e-30 });
}

#[test]
fn the_largest_and_the_smallest_valid_meshes_bake() {
    for size in [1e30, 1e-30] {
        let points = CORNERS.map(|p| p.map(|x| x * size));
        let mesh = TriangleMesh::new(&points, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap();
        let distance = sdf_bake::MeshDistance::new(&mesh, None);
        let found = distance.signed_distance([0.1 * size; 3]);
        assert!((found / size + 0.1).abs() < 1e-15, "{found}");
    }
}
