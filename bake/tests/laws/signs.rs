//! Negative is inside: of closed meshes exactly, of broken ones as their winding number says.

use sdf_bake::{MeshDistance, SignMethod};
use sdf_core::nalgebra::Vector3;

use crate::meshes::{self, Mesh};
use crate::oracle::{self, Baked};
use crate::random::Random;

const METHODS: [Option<SignMethod>; 3] = [None, Some(SignMethod::PseudoNormal), Some(SignMethod::Winding)];

/// Nearer to the mesh than this part of its diagonal the side is a matter of rounding.
const ON_SURFACE: f64 = 1e-9;

fn closed_solids(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let turn = random.rotation();
    vec![
        ("sphere", meshes::icosphere(2)),
        ("cube", meshes::cube()),
        ("turned cube", meshes::cube().turned(&turn)),
        ("torus", meshes::torus(1.0, 0.3, 20, 10)),
        ("L", meshes::l_solid()),
        ("turned L", meshes::l_solid().turned(&turn)),
        ("star", meshes::star(2, 4, 1.5).turned(&turn)),
        ("blunt star", meshes::star(1, 3, 0.1)),
        ("leaning spike", meshes::leaning_spike(0.05)),
        ("leaning needle", meshes::leaning_spike(1e-4)),
        ("thin plate", meshes::block([1.0, 1.0, 1e-5]).turned(&turn)),
        ("far cube", meshes::cube().moved(1e5, -2e5, 3e5)),
        ("tiny star", meshes::star(1, 3, 1.5).scaled(1e-20)),
        ("huge star", meshes::star(1, 3, 1.5).scaled(1e20)),
    ]
}

/// A change of sign between neighbours passes through a surface, and that is no farther from both than their way.
fn assert_no_leak(name: &str, baked: &Baked) {
    let [row, rows, layers] = baked.lattice.nodes();
    let at = |node: [u32; 3]| f64::from(baked.grid.distances[baked.lattice.index(node)]);
    for (axis, last) in [row, rows, layers].into_iter().enumerate() {
        for index in 0..baked.lattice.node_count() as u32 {
            let node = [index % row, index / row % rows, index / (row * rows)];
            if node[axis] + 1 < last {
                let mut next = node;
                next[axis] += 1;
                let (here, there) = (at(node), at(next));
                let is_free = here.abs() + there.abs() > baked.lattice.spacing() * (1.0 + 1e-6);
                assert!(!is_free || (here < 0.0) == (there < 0.0), "{name}: {here} beside {there} at {node:?}");
            }
        }
    }
}

/// All nodes that are not on the surface have the sign that `holds` says.
fn assert_inside(
    name: &str,
    mesh: &Mesh,
    method: Option<SignMethod>,
    cells: u32,
    holds: impl Fn(Vector3<f64>) -> bool,
) -> Baked {
    let baked = Baked::of(mesh, method, cells);
    let on_surface = ON_SURFACE * oracle::diagonal(mesh);
    for (node, signed) in baked.nodes() {
        if signed.abs() > on_surface {
            assert_eq!(signed < 0.0, holds(node), "{name}, {method:?}: {signed} at {node:?}");
        }
    }
    baked
}

fn solid(mesh: &Mesh) -> impl Fn(Vector3<f64>) -> bool + use<> {
    let corners = mesh.corners();
    move |point| oracle::winding_number(&corners, point).abs() >= 0.5
}

#[test]
fn no_node_of_a_closed_mesh_has_the_wrong_sign_by_either_method() {
    let mut random = Random::of_test();
    for (name, mesh) in closed_solids(&mut random) {
        for method in METHODS {
            let baked = assert_inside(name, &mesh, method, 11, solid(&mesh));
            assert_no_leak(name, &baked);
        }
    }
}

/// Where the nearest feature is a corner or an edge, a face's own normal is often wrong.
#[test]
fn no_point_near_a_corner_or_an_edge_of_a_closed_mesh_has_the_wrong_sign() {
    let mut random = Random::of_test();
    for (name, mesh) in closed_solids(&mut random) {
        let diagonal = oracle::diagonal(&mesh);
        let reach = diagonal / mesh.triangles.len() as f64;
        let corners = mesh.corners();
        let baked = mesh.baked();
        for method in METHODS {
            let distance = MeshDistance::new(&baked, method);
            for _ in 0..1000 {
                let [a, b, _] = corners[random.below(corners.len())];
                let share = if random.below(2) == 0 { 0.0 } else { random.unit() };
                let far = 10.0_f64.powf(random.between(-3.0, 1.0));
                let offset = random.in_cube(reach * far);
                let point = a + (b - a) * share + offset;
                let signed = distance.signed_distance(point.into());
                // A thin plate's two sides are 2e-5 apart, and a number of 1e5 is rounded by 1e-11.
                if signed.abs() > ON_SURFACE * diagonal {
                    let winding = oracle::winding_number(&corners, point);
                    assert_eq!(
                        signed < 0.0,
                        winding.abs() >= 0.5,
                        "{name}, {method:?}: {signed} at {point:?}, {winding}"
                    );
                }
            }
        }
    }
}

#[test]
fn wrongly_wound_faces_do_not_change_the_inside() {
    let mut random = Random::of_test();
    for (name, mesh) in closed_solids(&mut random) {
        let flipped: Vec<usize> = (0..mesh.triangles.len() / 3).map(|_| random.below(mesh.triangles.len())).collect();
        for broken in [mesh.clone().with_flipped(&flipped), mesh.clone().flipped()] {
            for method in METHODS {
                assert_inside(name, &broken, method, 7, solid(&mesh));
            }
        }
    }
}

#[test]
fn faces_that_stand_twice_do_not_change_the_inside() {
    let mut random = Random::of_test();
    for (name, mesh) in closed_solids(&mut random) {
        let mut same = mesh.clone();
        let mut opposite = mesh.clone();
        for triangle in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.triangles[triangle];
            same = same.with_triangle([b, c, a]);
            if triangle % 3 == 0 {
                opposite = opposite.with_triangle([c, b, a]);
            }
        }
        for broken in [same, opposite] {
            for method in METHODS {
                assert_inside(name, &broken, method, 7, solid(&mesh));
            }
        }
    }
}

#[test]
fn triangles_without_area_do_not_change_the_inside() {
    let mut random = Random::of_test();
    let plain = meshes::l_solid().turned(&random.rotation());
    let inner = meshes::l_solid().points.len() as u32;
    let mut stray = plain.clone();
    // A segment and a point in the midst of the solid, and one that leads out of it.
    let center = plain.points.iter().sum::<Vector3<f64>>() / 12.0;
    stray.points.extend([center, center * 0.9 + plain.points[0] * 0.1, center + Vector3::new(3.0, 0.0, 0.0)]);
    for (name, mesh) in [
        ("a segment inside", stray.clone().with_triangle([inner, inner + 1, inner + 1])),
        ("a point inside", stray.clone().with_triangle([inner, inner, inner])),
        ("a segment that leads out", stray.clone().with_triangle([inner, inner + 2, inner])),
        ("the inner edge", plain.clone().with_triangle([3, 9, 9])),
        ("the inner edge, turned", plain.clone().with_triangle([9, 3, 9])),
        ("all edges", plain.triangles.iter().fold(plain.clone(), |mesh, [a, b, _]| mesh.with_triangle([*a, *a, *b]))),
    ] {
        for method in METHODS {
            assert_inside(name, &mesh, method, 14, solid(&plain));
        }
    }
}

/// Triangles that close the gap between a long edge and the two halves of it on the other side: collinear but for
/// rounding, so that their normals point anywhere.
#[test]
fn slivers_between_an_edge_and_its_halves_do_not_change_the_inside() {
    let mut random = Random::of_test();
    for round in 0..30 {
        let plain = if round % 2 == 0 { meshes::l_solid() } else { meshes::leaning_spike(0.2) };
        let plain = plain.turned(&random.rotation()).moved(0.1, 0.2, 0.3);
        let mut split = Mesh { points: plain.points.clone(), triangles: vec![] };
        // Of every third triangle the first side is cut, and a sliver joins the halves to the whole.
        for (index, [a, b, c]) in plain.triangles.iter().copied().enumerate() {
            if index % 3 != round % 3 {
                split.triangles.push([a, b, c]);
                continue;
            }
            let share = random.between(0.2, 0.8);
            split.points.push(split.points[a as usize] * (1.0 - share) + split.points[b as usize] * share);
            let middle = split.points.len() as u32 - 1;
            split.triangles.extend([[a, middle, c], [middle, b, c], [a, b, middle]]);
        }
        let baked = split.baked();
        let is_inside = solid(&plain);
        // Where a sliver is without area to the last digit the mesh counts as open, and pseudo-normals asked for are wrong.
        for method in [None, Some(SignMethod::Winding)] {
            assert_inside("split", &split, method, 14, &is_inside);
            let distance = MeshDistance::new(&baked, method);
            for [a, b, middle] in split.corners().into_iter().filter(|[a, b, c]| (b - a).cross(&(c - a)).norm() < 1e-12)
            {
                for _ in 0..100 {
                    // Straight out from the middle, so that its corner or one beside it is nearest.
                    let point = middle + (b - a).cross(&random.in_cube(0.1));
                    let signed = distance.signed_distance(point.into());
                    assert_eq!(signed < 0.0, is_inside(point), "{method:?}: {signed} at {point:?} beside {middle:?}");
                }
            }
        }
    }
}

#[test]
fn shells_fill_what_any_of_them_holds_and_inward_ones_carve() {
    let ball = || meshes::icosphere(2);
    let (small, beside) = (ball().scaled(0.5), ball().moved(1.2, 0.1, 0.2));
    let (in_ball, in_small, in_beside) = (solid(&ball()), solid(&small), solid(&beside));
    for method in [None, Some(SignMethod::Winding)] {
        let overlapping = ball().and(beside.clone());
        let baked = assert_inside("overlapping", &overlapping, method, 16, |p| in_ball(p) || in_beside(p));
        assert_no_leak("overlapping", &baked);
        let nested = ball().and(small.clone());
        assert_no_leak("nested", &assert_inside("nested", &nested, method, 16, &in_ball));
        let cavity = ball().and(small.clone().flipped());
        let baked = assert_inside("cavity", &cavity, method, 16, |p| in_ball(p) && !in_small(p));
        assert_no_leak("cavity", &baked);
        let apart = ball().and(ball().flipped().moved(3.0, 0.0, 0.0));
        assert_inside("one of two inside out", &apart, method, 16, |p| in_ball(p) || in_ball(p - Vector3::x() * 3.0));
    }
}

#[test]
fn cubes_that_touch_are_both_inside() {
    let in_cube = |p: Vector3<f64>| p.abs().max() < 1.0;
    for offset in [[2.0, 2.0, 2.0], [2.0, 2.0, 0.0], [2.0, 0.0, 0.0], [2.0, 0.5, 0.0]] {
        let offset = Vector3::from(offset);
        let cubes = meshes::cube().and(meshes::cube().mapped(|p| p + offset));
        for method in [None, Some(SignMethod::Winding)] {
            assert_inside("cubes", &cubes, method, 13, |p| in_cube(p) || in_cube(p - offset));
        }
    }
}

/// The wall between two cubes is there twice, back to back. Beside it the winding number is one, not one half.
#[test]
fn a_wall_between_two_solids_is_inside_from_both_sides() {
    let wall = meshes::cube().and(meshes::cube().moved(2.0, 0.0, 0.0)).refined().refined().baked();
    let distance = MeshDistance::new(&wall, None);
    for beside in [-1e-2, -1e-6, 1e-6, 1e-2] {
        for height in [-0.9, 0.0, 0.123, 0.7] {
            let point = [1.0 + beside, height, 0.3];
            assert!((distance.winding_number(point) - 1.0).abs() < 0.1);
            assert!(distance.signed_distance(point) < 0.0);
        }
    }
}

/// A cloth: beside it the winding number comes near one half, and still it has no inside.
#[test]
fn no_point_beside_a_fine_flat_sheet_is_inside() {
    let mut random = Random::of_test();
    let sheet = meshes::sheet(60).turned(&random.rotation());
    let baked = sheet.baked();
    let distance = MeshDistance::new(&baked, None);
    let corners = sheet.corners();
    for _ in 0..20_000 {
        let [a, b, _] = corners[random.below(corners.len())];
        let far = random.between(0.003, 0.1);
        let point = a + (b - a) * random.unit() + random.in_cube(far);
        let signed = distance.signed_distance(point.into());
        assert!(signed > -0.002, "{signed} at {point:?}, {}", distance.winding_number(point.into()));
    }
}

/// A torus fatter than its own hole.
#[test]
fn a_shell_that_passes_through_itself_is_inside_where_it_goes_around() {
    let spindle = meshes::torus(0.5, 0.8, 20, 14);
    assert_no_leak("spindle", &assert_inside("spindle", &spindle, None, 16, solid(&spindle)));
    assert!(MeshDistance::new(&spindle.baked(), None).sign_reason().contains("intersecting"));
}

/// One shell, closed and manifold, of which all or some has no thickness: what is there twice has no inside.
#[test]
fn what_lies_flat_on_itself_has_no_inside() {
    let mut random = Random::of_test();
    let turn = random.rotation();
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let pillow = Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3], [1, 3, 2], [0, 3, 1]]);
    let leaf = Mesh::new(&corners, &[[0, 1, 2], [0, 2, 1]]);
    let two_sided = |cells| meshes::sheet(cells).and(meshes::sheet(cells).flipped());
    for (name, mesh) in [
        ("pillow", pillow.clone()),
        ("leaf", leaf.clone()),
        ("turned leaf", leaf.turned(&turn)),
        ("two-sided square", two_sided(1)),
        ("two-sided sheet", two_sided(6)),
        ("turned two-sided sheet", two_sided(6).turned(&turn)),
        ("one-sided sheet", meshes::sheet(6)),
        ("turned sheet", meshes::sheet(20).turned(&turn)),
        ("one triangle", Mesh::new(&corners, &[[0, 1, 2]])),
    ] {
        for method in [None, Some(SignMethod::Winding)] {
            assert_inside(name, &mesh, method, 15, |_| false);
        }
    }
}

/// A fin of two layers, welded into the side of a cube so that all is one closed shell.
#[test]
fn a_flat_fin_on_a_cube_has_no_inside() {
    let mut finned = meshes::cube();
    // The edge between points 1 and 3 of the side x = 1 is opened and leads out to a point and back.
    finned.points.push(Vector3::new(2.0, 0.0, -1.0));
    let finned = finned.with_triangle([3, 1, 8]).with_triangle([1, 3, 8]);
    for method in [None, Some(SignMethod::Winding)] {
        assert_inside("closed fin", &finned, method, 13, solid(&meshes::cube()));
    }
    let mut single = meshes::cube();
    single.points.push(Vector3::new(2.0, 0.0, -1.5));
    let single = single.with_triangle([3, 1, 8]);
    for method in [None, Some(SignMethod::Winding)] {
        assert_inside("fin", &single, method, 13, solid(&meshes::cube()));
    }
}

#[test]
fn a_sphere_with_a_hole_keeps_its_inside() {
    let whole = meshes::icosphere(3);
    let holed = whole.clone().without(&[3, 17, 18, 400, 401, 402, 403]);
    for (sign, mesh) in [("holed", holed.clone()), ("holed and flipped", holed.clone().flipped())] {
        let baked = Baked::of(&mesh, None, 24);
        for (node, signed) in baked.nodes() {
            let radius = node.norm();
            // Half a triangle's side from the sphere, a hole of a few triangles still has a winding number near 0 or 1.
            if !(0.85..1.15).contains(&radius) {
                assert_eq!(signed < 0.0, radius < 1.0, "{sign}: {signed} at {node:?}");
            }
        }
    }
}

#[test]
fn what_has_no_inside_at_all_still_bakes() {
    let mut random = Random::of_test();
    for mesh in [
        meshes::moebius_strip(40),
        meshes::degenerate_soup(40, &mut random),
        meshes::soup(100, 0.5, &mut random),
        meshes::needles(40, 1e-9, &mut random),
    ] {
        for method in METHODS {
            let baked = Baked::of(&mesh, method, 12);
            assert!(baked.grid.distances.iter().all(|distance| distance.is_finite()));
            assert!(baked.grid.slope_bound.is_finite() && baked.grid.error_bound.is_finite());
        }
    }
}

/// Sides spread from node to node and through triangles, and are asked only where they cannot.
#[test]
fn every_node_has_the_side_that_its_own_winding_number_tells() {
    let mut random = Random::of_test();
    let turn = random.rotation();
    let holed = meshes::icosphere(3).without(&[3, 17, 18, 19, 20, 400, 401, 402, 403]);
    let lidless = meshes::cube().without(&[10, 11]).refined().refined();
    for (name, mesh) in [
        ("closed", meshes::star(1, 3, 1.5).turned(&turn)),
        ("thin", meshes::block([1.0, 0.8, 0.01]).turned(&turn)),
        ("on the nodes", meshes::cube().refined()),
        ("spindle", meshes::torus(0.5, 0.8, 20, 14)),
        ("nested", meshes::icosphere(2).and(meshes::icosphere(2).scaled(0.6)).and(meshes::cube().scaled(0.2))),
        ("overlapping", meshes::icosphere(2).and(meshes::icosphere(2).moved(0.7, 0.3, 0.2))),
        ("one inward", meshes::icosphere(2).and(meshes::icosphere(1).flipped().moved(0.7, 0.3, 0.2))),
        ("holed", holed.clone()),
        ("holed and flipped", holed.clone().flipped()),
        ("lidless", lidless.clone()),
        ("lidless, turned", lidless.clone().turned(&turn)),
        ("two lidless", lidless.clone().and(lidless.scaled(0.5).turned(&turn))),
        ("sheet", meshes::sheet(9).turned(&turn)),
        ("strip", meshes::moebius_strip(30)),
        ("a few triangles", meshes::soup(12, 0.8, &mut random)),
        ("many rims", meshes::soup(300, 0.5, &mut random)),
        ("needles", meshes::needles(100, 0.01, &mut random)),
    ] {
        let mesh = mesh.baked();
        let distance = MeshDistance::new(&mesh, Some(SignMethod::Winding));
        let tells_inside = |node: Vector3<f64>| distance.winding_number(node.into()).abs() >= 0.5;
        let dense = Baked::new(&distance, &mesh.bounds(), 20);
        for (node, signed) in dense.nodes() {
            assert_eq!(signed.is_sign_negative(), tells_inside(node), "{name}: {signed} at {node:?}");
        }
        let sparse = sdf_bake::sparse::bake::<f32>(&distance, &dense.lattice, 3.0 * dense.lattice.spacing(), &|_| ());
        for (place, samples) in sparse.places.iter().zip(sparse.samples.chunks(512)) {
            for (index, signed) in (0..).zip(samples) {
                let step = [index % 8, index / 8 % 8, index / 64];
                let node = dense.lattice.node(std::array::from_fn(|axis| place[axis] * 8 + step[axis]));
                assert_eq!(
                    signed.is_sign_negative(),
                    tells_inside(node.into()),
                    "{name}: {signed} at {node:?}, sparse"
                );
            }
        }
    }
}

/// Where winding numbers are summed worst, and where nodes stand farthest from where the lattice has them.
#[test]
fn no_side_leaks_through_many_shells_nor_far_from_the_origin() {
    let shell = |k: u32| meshes::icosphere(1).scaled(1.0 - 0.0003 * f64::from(k));
    let far = meshes::cube().and(meshes::cube().scaled(0.6)).moved(1e9, 3e8, -1e9);
    for (name, mesh) in [("many shells", (1..16).fold(shell(0), |shells, k| shells.and(shell(k)))), ("far", far)] {
        let mesh = mesh.baked();
        let distance = MeshDistance::new(&mesh, Some(SignMethod::Winding));
        for cells in 9..30 {
            for (node, signed) in Baked::new(&distance, &mesh.bounds(), cells).nodes() {
                let is_inside = distance.winding_number(node.into()).abs() >= 0.5;
                assert_eq!(signed.is_sign_negative(), is_inside, "{name}, {cells} cells: {signed} at {node:?}");
            }
        }
    }
}
