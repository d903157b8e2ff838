//! Signs: negative inside, exactly for closed meshes, and by the winding number for broken ones.

use sdf_bake::{MeshDistance, SignMethod};
use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;

use crate::meshes::{self, Mesh};
use crate::oracle::{self, Baked};
use crate::random::Random;

const METHODS: [Option<SignMethod>; 3] = [None, Some(SignMethod::PseudoNormal), Some(SignMethod::Winding)];

/// Nearer to the mesh than this fraction of its diagonal, rounding decides the side.
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

/// Asserts that the sign changes only between neighbours whose distances sum to at most a spacing.
fn assert_no_leak(name: &str, baked: &Baked) {
    let [row, rows, layers] = baked.lattice.nodes();
    let value = |node: [u32; 3]| f64::from(baked.grid.distances[baked.lattice.index(node)]);
    for (axis, last) in [row, rows, layers].into_iter().enumerate() {
        for index in 0..baked.lattice.node_count() as u32 {
            let node = [index % row, index / row % rows, index / (row * rows)];
            if node[axis] + 1 < last {
                let mut next = node;
                next[axis] += 1;
                let (here, there) = (value(node), value(next));
                let is_clear = here.abs() + there.abs() > baked.lattice.spacing() * (1.0 + 1e-6);
                assert!(!is_clear || (here < 0.0) == (there < 0.0), "{name}: {here} beside {there} at {node:?}");
            }
        }
    }
}

/// Asserts the sign of all nodes off the surface, and returns the grid.
fn assert_inside(
    name: &str,
    mesh: &Mesh,
    method: Option<SignMethod>,
    cells: u32,
    is_inside: impl Fn(Vector3<f64>) -> bool,
) -> Baked {
    let baked = Baked::from_mesh(mesh, method, cells);
    let on_surface = ON_SURFACE * oracle::diagonal(mesh);
    for (node, signed) in baked.nodes() {
        if signed.abs() > on_surface {
            assert_eq!(signed < 0.0, is_inside(node), "{name}, {method:?}: {signed} at {node:?}");
        }
    }
    baked
}

/// The inside of a closed mesh, by its winding number.
pub fn solid(mesh: &Mesh) -> impl Fn(Vector3<f64>) -> bool + use<> {
    let corners = mesh.corners();
    move |point| oracle::winding_number(&corners, point).abs() >= 0.5
}

#[test]
fn no_node_of_a_closed_mesh_has_the_wrong_sign_by_either_method() {
    let mut random = Random::from_env();
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
    let mut random = Random::from_env();
    for (name, mesh) in closed_solids(&mut random) {
        let diagonal = oracle::diagonal(&mesh);
        let size = diagonal / mesh.triangles.len() as f64;
        let corners = mesh.corners();
        let baked = mesh.baked();
        for method in METHODS {
            let distance = MeshDistance::new(&baked, method);
            for _ in 0..1000 {
                let [a, b, _] = corners[random.below(corners.len())];
                let t = if random.below(2) == 0 { 0.0 } else { random.unit() };
                let far = 10.0_f64.powf(random.between(-3.0, 1.0));
                let offset = random.point_in_cube(size * far);
                let point = a + (b - a) * t + offset;
                let signed = distance.signed_distance(point.into());
                // A thin plate's two sides are 2e-5 apart, and coordinates of 1e5 are rounded by 1e-11.
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

/// Beyond 1e16 sizes of the mesh rounding decides which triangle is the nearest.
#[test]
fn no_point_beyond_the_box_of_a_closed_mesh_is_inside_however_far_it_is() {
    let mut random = Random::from_env();
    for (name, mesh) in closed_solids(&mut random) {
        let diagonal = oracle::diagonal(&mesh);
        let [baked, turned] = [mesh.baked(), mesh.clone().flipped().baked()];
        for (mesh, method) in [&baked, &turned].into_iter().flat_map(|mesh| METHODS.map(|method| (mesh, method))) {
            let distance = MeshDistance::new(mesh, method);
            for sizes in [1e1, 1e8, 1e16, 1e17, 1e18, 1e30, 1e100] {
                for _ in 0..30 {
                    let point = random.point_in_cube(diagonal * sizes);
                    let signed = distance.signed_distance(point.into());
                    let here = Aabb { min: point.into(), max: point.into() };
                    assert!(
                        signed > 0.0 || distance.bounds().encloses(&here),
                        "{name}, {method:?}: {signed} at {point:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn wrongly_wound_faces_do_not_change_the_inside() {
    let mut random = Random::from_env();
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
fn repeated_faces_do_not_change_the_inside() {
    let mut random = Random::from_env();
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
    let mut random = Random::from_env();
    let plain = meshes::l_solid().turned(&random.rotation());
    let inner = meshes::l_solid().points.len() as u32;
    let mut stray = plain.clone();
    // Segments and a point inside the solid, and a segment that leads out of it.
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

/// Slivers between a long edge and its two halves: collinear but for rounding, so that their normals point anywhere.
#[test]
fn slivers_between_an_edge_and_its_halves_do_not_change_the_inside() {
    let mut random = Random::from_env();
    for round in 0..30 {
        let plain = if round % 2 == 0 { meshes::l_solid() } else { meshes::leaning_spike(0.2) };
        let plain = plain.turned(&random.rotation()).moved(0.1, 0.2, 0.3);
        let mut split = Mesh { points: plain.points.clone(), triangles: vec![] };
        // Every third triangle is cut at its first edge, and a sliver joins the halves to the whole edge.
        for (index, [a, b, c]) in plain.triangles.iter().copied().enumerate() {
            if index % 3 != round % 3 {
                split.triangles.push([a, b, c]);
                continue;
            }
            let t = random.between(0.2, 0.8);
            split.points.push(split.points[a as usize] * (1.0 - t) + split.points[b as usize] * t);
            let middle = split.points.len() as u32 - 1;
            split.triangles.extend([[a, middle, c], [middle, b, c], [a, b, middle]]);
        }
        let baked = split.baked();
        let is_inside = solid(&plain);
        // A sliver whose area is exactly zero leaves the mesh open, and requested pseudo-normals wrong.
        for method in [None, Some(SignMethod::Winding)] {
            assert_inside("split", &split, method, 14, &is_inside);
            let distance = MeshDistance::new(&baked, method);
            for [a, b, middle] in split.corners().into_iter().filter(|[a, b, c]| (b - a).cross(&(c - a)).norm() < 1e-12)
            {
                for _ in 0..100 {
                    // At right angles to the sliver, so that its middle corner or a point beside it is nearest.
                    let point = middle + (b - a).cross(&random.point_in_cube(0.1));
                    let signed = distance.signed_distance(point.into());
                    assert_eq!(signed < 0.0, is_inside(point), "{method:?}: {signed} at {point:?} beside {middle:?}");
                }
            }
        }
    }
}

#[test]
fn the_inside_is_the_union_of_outward_shells_less_the_inward_ones() {
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

/// Two cubes share a double wall, back to back. Beside it the winding number is one, not one half.
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

/// Beside a cloth the winding number comes near one half, but never reaches it.
#[test]
fn no_point_beside_a_fine_flat_sheet_is_inside() {
    let mut random = Random::from_env();
    let sheet = meshes::sheet(60).turned(&random.rotation());
    let baked = sheet.baked();
    let distance = MeshDistance::new(&baked, None);
    let corners = sheet.corners();
    for _ in 0..20_000 {
        let [a, b, _] = corners[random.below(corners.len())];
        let far = random.between(0.003, 0.1);
        let point = a + (b - a) * random.unit() + random.point_in_cube(far);
        let signed = distance.signed_distance(point.into());
        assert!(signed > -0.002, "{signed} at {point:?}, {}", distance.winding_number(point.into()));
    }
}

/// A spindle torus: the tube is wider than the hole.
#[test]
fn a_self_intersecting_shell_has_its_inside_by_winding_number() {
    let spindle = meshes::torus(0.5, 0.8, 20, 14);
    assert_no_leak("spindle", &assert_inside("spindle", &spindle, None, 16, solid(&spindle)));
    assert!(MeshDistance::new(&spindle.baked(), None).sign_reason().contains("intersecting"));
}

/// Closed manifold shells without thickness, and sheets.
#[test]
fn a_flat_mesh_has_no_inside() {
    let mut random = Random::from_env();
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
    for (name, mesh) in [("holed", holed.clone()), ("holed and flipped", holed.clone().flipped())] {
        let baked = Baked::from_mesh(&mesh, None, 24);
        for (node, signed) in baked.nodes() {
            let radius = node.norm();
            // Half an edge from the sphere, the winding number beside a hole of a few triangles is still near 0 or 1.
            if !(0.85..1.15).contains(&radius) {
                assert_eq!(signed < 0.0, radius < 1.0, "{name}: {signed} at {node:?}");
            }
        }
    }
}

#[test]
fn a_mesh_without_any_inside_still_bakes() {
    let mut random = Random::from_env();
    for mesh in [
        meshes::moebius_strip(40),
        meshes::degenerate_soup(40, &mut random),
        meshes::soup(100, 0.5, &mut random),
        meshes::needles(40, 1e-9, &mut random),
    ] {
        for method in METHODS {
            let baked = Baked::from_mesh(&mesh, method, 12);
            assert!(baked.grid.distances.iter().all(|distance| distance.is_finite()));
            assert!(baked.grid.slope_bound.is_finite());
            // Pseudo-normals fit none of them: their signs have no bound.
            assert_eq!(baked.grid.error_bound.is_finite(), method != Some(SignMethod::PseudoNormal), "{method:?}");
        }
    }
}
