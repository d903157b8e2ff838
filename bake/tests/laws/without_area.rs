//! Triangles without area: dropped, but for those that join the edges of a closed mesh.

use sdf_bake::{MeshDistance, MeshReport, SignMethod};
use sdf_core::nalgebra::Vector3;

use crate::meshes::{self, Mesh};
use crate::oracle;
use crate::random::Random;

const CLOSED: &str = "pseudo-normal: closed, consistently wound, one shell";

#[test]
fn a_whisker_through_a_cube_leaves_its_centre_half_a_side_deep() {
    let cube = meshes::cube().mapped(|p| (p + Vector3::repeat(1.0)) * 0.5);
    let mut with_point = cube.clone();
    with_point.points.push(Vector3::new(0.5, 0.5, 0.5));
    let two_corners = cube.clone().with_triangle([0, 7, 0]);
    let three_corners = with_point.clone().with_triangle([0, 8, 7]);
    let beside_an_edge = with_point.clone().with_triangle([0, 7, 8]).with_triangle([0, 8, 7]).with_triangle([1, 1, 1]);
    for (mesh, dropped) in [(two_corners, 1), (three_corners, 1), (beside_an_edge, 3)] {
        let baked = mesh.baked();
        assert_eq!(baked.report().degenerate_triangles, dropped);
        assert_eq!(baked.triangle_count(), 12);
        let distance = MeshDistance::new(&baked, None);
        assert_eq!(distance.sign_reason(), CLOSED);
        assert_eq!(distance.signed_distance([0.5; 3]), -0.5);
    }
}

#[test]
fn a_whisker_that_sticks_out_does_not_widen_the_box() {
    let mut mesh = meshes::cube();
    mesh.points.push(Vector3::repeat(9.0));
    let baked = mesh.with_triangle([0, 8, 8]).baked();
    assert_eq!((baked.bounds().min, baked.bounds().max), ([-1.0; 3], [1.0; 3]));
}

/// Cuts some edges in one of their two triangles, at one to three points, and stitches the gap by collinear triangles.
/// Coordinates are multiples of 2⁻²⁰, so that points on edges are exact.
fn with_t_junctions(mesh: &Mesh, random: &mut Random) -> (Mesh, usize) {
    let mut cut = Mesh { points: mesh.points.clone(), triangles: vec![] };
    let mut stitches = vec![];
    for [a, b, c] in &mesh.triangles {
        // Of the two triangles of an edge at most one is cut.
        if random.below(3) > 0 || a > b {
            cut.triangles.push([*a, *b, *c]);
            continue;
        }
        let (mut end, ends) = (*b, 1 + random.below(3));
        for _ in 0..ends {
            cut.points.push((cut.points[*a as usize] + cut.points[end as usize]) * 0.5);
            let middle = cut.points.len() as u32 - 1;
            cut.triangles.push([middle, end, *c]);
            stitches.push([*a, end, middle]);
            end = middle;
        }
        cut.triangles.push([*a, end, *c]);
    }
    let count = stitches.len();
    // Their place in the file and their winding must not matter.
    for stitch in stitches {
        let [a, b, c] = stitch;
        let place = random.below(cut.triangles.len() + 1);
        cut.triangles.insert(place, if random.below(4) == 0 { [a, c, b] } else { stitch });
    }
    (cut, count)
}

fn on_lattice(mesh: Mesh) -> Mesh {
    mesh.mapped(|p| p.map(|x| (x * 1_048_576.0).round() / 1_048_576.0))
}

#[test]
fn a_mesh_stitched_at_t_junctions_is_closed_and_has_the_distances_of_the_uncut() {
    let mut random = Random::from_env();
    for (name, mesh) in [
        ("tetrahedron", meshes::tetrahedron()),
        ("cube", meshes::cube()),
        ("L", meshes::l_solid()),
        ("sphere", on_lattice(meshes::icosphere(2))),
        ("star", on_lattice(meshes::star(1, 3, 1.5))),
        ("torus", on_lattice(meshes::torus(1.0, 0.3, 16, 8))),
    ] {
        for round in 0..6 {
            let (mut cut, count) = with_t_junctions(&mesh, &mut random);
            let mut dropped = count;
            if round % 2 == 1 {
                // Whiskers beside them.
                cut = cut.with_triangle([0, 3, 3]);
                dropped += 1;
            }
            let baked = cut.baked();
            let report = MeshReport { degenerate_triangles: dropped, ..MeshReport::default() };
            assert_eq!(baked.report(), report, "{name}");
            let corners = mesh.corners();
            for method in [None, Some(SignMethod::PseudoNormal)] {
                let distance = MeshDistance::new(&baked, method);
                let topology = distance.topology();
                assert!(topology.is_closed(), "{name}: {}", distance.sign_reason());
                assert!(distance.is_continuous() || method.is_some(), "{name}");
                assert_eq!((topology.shells, topology.stitches), (1, count), "{name}");
                for _ in 0..300 {
                    let point = match random.below(3) {
                        0 => random.point_in_cube(1.5),
                        // Nearest to the corners and edges at the junctions.
                        _ => {
                            let at = cut.points[random.below(cut.points.len())];
                            let size = 10.0_f64.powf(random.between(-3.0, -0.5));
                            at + random.point_in_cube(size)
                        }
                    };
                    let exact = oracle::signed_distance(&corners, point);
                    let found = distance.signed_distance(point.into());
                    assert!((found - exact).abs() < 1e-12, "{name}: {found} for {exact} at {point:?}");
                }
            }
        }
    }
}
