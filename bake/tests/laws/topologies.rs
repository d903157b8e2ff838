//! Topology of a mesh, and the sign method chosen for it.

use std::collections::BTreeSet;

use sdf_bake::{MeshDistance, SignMethod, Topology};
use sdf_core::nalgebra::{Rotation3, Vector3};

use crate::meshes::{self, Mesh};
use crate::random::Random;

const CLOSED_SHELL: Topology = Topology {
    boundary_edges: 0,
    non_manifold_edges: 0,
    wrongly_wound: 0,
    non_orientable_edges: 0,
    stitches: 0,
    shells: 1,
    doubled: 0,
    intersecting_pairs: Some(0),
    inside_out: false,
};

fn assert_verdict(mesh: &Mesh, wanted: Topology, verdict: &str) {
    let baked = mesh.baked();
    let distance = MeshDistance::new(&baked, None);
    let is_one_closed_shell = wanted.is_closed() && wanted.shells == 1 && wanted.stitches == 0;
    let intersecting_pairs = wanted.intersecting_pairs.filter(|_| is_one_closed_shell);
    let wanted = Topology { intersecting_pairs, ..wanted };
    assert_eq!((distance.topology(), distance.sign_reason()), (&wanted, verdict));
    let named = if verdict.starts_with("winding") { SignMethod::Winding } else { SignMethod::PseudoNormal };
    assert_eq!(distance.sign_method(), named);
}

#[test]
fn a_closed_shell_gets_its_signs_from_pseudo_normals_unless_rounding_hides_them() {
    let mut random = Random::from_env();
    for mesh in [
        meshes::tetrahedron(),
        meshes::cube(),
        meshes::icosphere(3).turned(&random.rotation()),
        meshes::torus(1.0, 0.3, 20, 10),
        meshes::l_solid().refined(),
        meshes::star(2, 4, 1.5),
        meshes::leaning_spike(0.1),
    ] {
        assert_verdict(&mesh, CLOSED_SHELL, "pseudo-normal: closed, consistently wound, one shell");
    }
    // Rounding would decide there.
    for (mesh, doubt) in [
        (meshes::leaning_spike(1e-6), "folded shut at an edge or a corner"),
        (meshes::cube().moved(1e6, 0.0, 0.0), "far from the origin"),
    ] {
        assert_verdict(&mesh, CLOSED_SHELL, &format!("winding: closed, consistently wound, one shell, {doubt}"));
    }
}

#[test]
fn holes_are_counted_by_their_edges() {
    let cube = meshes::cube();
    assert_verdict(
        &cube.clone().without(&[0]),
        Topology { boundary_edges: 3, ..CLOSED_SHELL },
        "winding: 3 boundary edges",
    );
    assert_verdict(
        &cube.clone().without(&[0, 1]),
        Topology { boundary_edges: 4, ..CLOSED_SHELL },
        "winding: 4 boundary edges",
    );
    let sheet = Topology { boundary_edges: 20, ..CLOSED_SHELL };
    assert_verdict(&meshes::sheet(5), sheet, "winding: 20 boundary edges");
}

#[test]
fn edges_of_more_than_two_triangles_are_counted() {
    let mut fin = meshes::cube();
    fin.points.push(Vector3::new(2.0, 0.0, 0.0));
    let fin = fin.with_triangle([1, 3, 8]);
    let wanted = Topology { boundary_edges: 2, non_manifold_edges: 1, ..CLOSED_SHELL };
    assert_verdict(&fin, wanted, "winding: 2 boundary edges, 1 non-manifold edge");
    let on_an_edge = meshes::cube().and(meshes::cube().moved(2.0, 2.0, 0.0));
    assert_verdict(&on_an_edge, Topology { non_manifold_edges: 1, ..CLOSED_SHELL }, "winding: 1 non-manifold edge");
}

#[test]
fn shells_are_counted() {
    let cube = meshes::cube();
    let touching = cube.clone().and(cube.clone().moved(2.0, 2.0, 2.0));
    assert_verdict(&touching, Topology { shells: 2, ..CLOSED_SHELL }, "winding: 2 shells");
    let three = touching.and(cube.flipped().scaled(0.5));
    assert_verdict(&three, Topology { shells: 3, ..CLOSED_SHELL }, "winding: 3 shells");
}

#[test]
fn wrongly_wound_faces_are_counted_and_turned() {
    let cube = meshes::cube();
    let two = Topology { wrongly_wound: 2, ..CLOSED_SHELL };
    assert_verdict(
        &cube.clone().with_flipped(&[1, 6]),
        two,
        "pseudo-normal: closed, one shell (2 wrongly wound faces: put right)",
    );
    let first = Topology { wrongly_wound: 1, ..CLOSED_SHELL };
    assert_verdict(
        &cube.clone().with_flipped(&[0]),
        first,
        "pseudo-normal: closed, one shell (1 wrongly wound face: put right)",
    );
    let all = Topology { inside_out: true, ..CLOSED_SHELL };
    assert_verdict(&cube.clone().flipped(), all, "pseudo-normal: closed, one shell (wound inside out: put right)");
    let nine = Topology { wrongly_wound: 3, inside_out: true, ..CLOSED_SHELL };
    let verdict = "pseudo-normal: closed, one shell (3 wrongly wound faces, wound inside out: put right)";
    assert_verdict(&cube.clone().flipped().with_flipped(&[0, 4, 9]), nine, verdict);
    let open = Topology { boundary_edges: 3, wrongly_wound: 1, ..CLOSED_SHELL };
    assert_verdict(&cube.without(&[0]).with_flipped(&[5]), open, "winding: 3 boundary edges, 1 wrongly wound face");
}

#[test]
fn a_strip_with_half_a_turn_has_an_edge_that_no_winding_suits() {
    let strip = meshes::moebius_strip(40).baked();
    let distance = MeshDistance::new(&strip, None);
    let found = distance.topology();
    assert_eq!((found.boundary_edges, found.non_orientable_edges, found.shells), (80, 1, 1));
    assert_eq!(distance.sign_method(), SignMethod::Winding);
    assert!(distance.sign_reason().contains("80 boundary edges, 1 edge that no winding suits"));
}

#[test]
fn faces_doubled_back_to_back_are_counted() {
    let cube = meshes::cube();
    let [a, b, c] = cube.triangles[3];
    let one = Topology { doubled: 1, ..CLOSED_SHELL };
    assert_verdict(
        &cube.clone().with_triangle([c, b, a]),
        one,
        "pseudo-normal: closed, one shell (1 face doubled back to back: put right)",
    );
    let wall = cube.clone().and(cube.clone().moved(2.0, 0.0, 0.0));
    let wanted = Topology { doubled: 2, non_manifold_edges: 5, ..CLOSED_SHELL };
    assert_verdict(&wall, wanted, "winding: 5 non-manifold edges, 2 faces doubled back to back");
    // Apart from each other, one is put right as if it were alone, and the other closes.
    let cube_and_wall = cube.clone().with_triangle([c, b, a]).and(wall.moved(0.0, 9.0, 0.0));
    let wanted = Topology { doubled: 3, non_manifold_edges: 5, shells: 2, ..CLOSED_SHELL };
    assert_verdict(&cube_and_wall, wanted, "winding: 5 non-manifold edges, 3 faces doubled back to back, 2 shells");
    assert!(MeshDistance::new(&cube_and_wall.baked(), None).is_continuous());
    // Beside a hole, too.
    let open = cube.clone().with_triangle([c, b, a]).without(&[11]);
    assert_verdict(
        &open,
        Topology { doubled: 1, boundary_edges: 3, ..CLOSED_SHELL },
        "winding: 3 boundary edges, 1 face doubled back to back",
    );
    let two_sided = meshes::sheet(2).and(meshes::sheet(2).flipped());
    let wanted = Topology { doubled: 8, non_manifold_edges: 8, ..CLOSED_SHELL };
    assert_verdict(&two_sided, wanted, "winding: 8 non-manifold edges, 8 faces doubled back to back");
}

/// Any triangles of seven points: most edges have many, and each triangle may occur with either winding.
#[test]
fn doubled_faces_among_many_at_an_edge_are_counted() {
    let mut random = Random::from_env();
    for count in [20, 40, 80] {
        let points: Vec<[f64; 3]> = (0..7).map(|_| random.point_in_cube(1.0).into()).collect();
        let mut index = || (random.between(0.0, 7.0) as u32).min(6);
        let corners: Vec<[u32; 3]> = (0..count).map(|_| [index(), index(), index()]).collect();
        let mesh = Mesh::new(&points, &corners).baked();
        let sorted = |[a, b, c]: [u32; 3]| [a.min(b).min(c), a.max(b).max(c), a + b + c];
        let is_even = |[a, b, c]: [u32; 3]| (a < b) ^ (b < c) ^ (c < a);
        let distinct = corners.iter().filter(|[a, b, c]| a != b && b != c && c != a);
        let kinds: BTreeSet<([u32; 3], bool)> = distinct.map(|corners| (sorted(*corners), is_even(*corners))).collect();
        let wanted = kinds.iter().filter(|(corners, is_even)| *is_even && kinds.contains(&(*corners, false))).count();
        assert_eq!(MeshDistance::new(&mesh, None).topology().doubled, wanted, "{corners:?}");
    }
}

#[test]
fn triangles_without_area_belong_to_no_shell() {
    let cube = meshes::cube();
    let segment = cube.clone().with_triangle([0, 7, 7]).with_triangle([3, 3, 3]);
    assert_verdict(&segment, CLOSED_SHELL, "pseudo-normal: closed, consistently wound, one shell");
}

#[test]
fn faces_that_lie_on_each_other_are_counted() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let pillow = Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3], [1, 3, 2], [0, 3, 1]]);
    assert_verdict(
        &pillow,
        Topology { intersecting_pairs: Some(4), ..CLOSED_SHELL },
        "winding: 4 pairs of intersecting faces",
    );
    let leaf = Mesh::new(&corners, &[[0, 1, 2], [0, 2, 1]]);
    let wanted = Topology { doubled: 1, intersecting_pairs: Some(1), ..CLOSED_SHELL };
    assert_verdict(&leaf, wanted, "winding: 1 face doubled back to back, 1 pair of intersecting faces");
}

/// Fans of 8,200 faces: their 33.6 million pairs are more than are compared, and none intersects.
#[test]
fn faces_of_a_fan_do_not_intersect() {
    let mut random = Random::from_env();
    let count = 8200;
    // Around the point after the last, and around the first.
    let around = |center: u32| (0..count).map(move |index| [center, index, (index + 1) % count]);
    let from_first = (1..count - 1).map(|index| [0, index, index + 1]);
    let point = |index: u32, exponent: f64| {
        let (sin, cos) = (f64::from(index) / f64::from(count) * std::f64::consts::TAU).sin_cos();
        // A circle, or a square with rounded corners.
        let scale = (sin.abs().powf(exponent) + cos.abs().powf(exponent)).powf(-1.0 / exponent);
        [scale * cos, scale * sin, 0.0]
    };
    // Around the first, faces along a straight side would have no area. Unturned, the base and its plane are exact.
    let (center, unturned) = (|| around(count + 1).collect::<Vec<_>>(), Rotation3::identity());
    for (exponent, fan, rotation) in
        [(2.0, center(), unturned), (2.0, from_first.collect(), random.rotation()), (40.0, center(), random.rotation())]
    {
        let rim: Vec<[f64; 3]> = (0..count).map(|index| point(index, exponent)).collect();
        let points = [rim, vec![[0.05, 0.03, 1.0], [0.05, 0.03, 0.0]]].concat();
        let base = fan.into_iter().map(|[a, b, c]| [a, c, b]);
        let triangles: Vec<[u32; 3]> = around(count).chain(base).collect();
        let mesh = Mesh::new(&points, &triangles).turned(&rotation);
        assert_verdict(&mesh, CLOSED_SHELL, "pseudo-normal: closed, consistently wound, one shell");
    }
}

#[test]
fn faces_too_many_to_compare_are_not_counted() {
    let mut random = Random::from_env();
    let mut heap = meshes::icosphere(5);
    heap.points.iter_mut().for_each(|point| *point = random.point_in_cube(1.0));
    let baked = heap.baked();
    let distance = MeshDistance::new(&baked, None);
    assert_eq!(distance.topology().intersecting_pairs, None);
    assert_eq!(distance.topology().shells, 1);
    assert_eq!(distance.sign_method(), SignMethod::Winding);
    assert!(distance.sign_reason().contains("intersecting faces not counted"), "{}", distance.sign_reason());
}

/// Points pulled through the opposite side of a sphere, so that faces cross in general position.
#[test]
fn faces_that_cross_are_counted() {
    let mut random = Random::from_env();
    for _ in 0..20 {
        let mut mesh = meshes::icosphere(2).turned(&random.rotation());
        for _ in 0..3 {
            let point = random.below(mesh.points.len());
            mesh.points[point] = mesh.points[point] * -1.3 + random.point_in_cube(0.4);
        }
        let baked = mesh.baked();
        let distance = MeshDistance::new(&baked, None);
        let pairs = crossing_pairs(&mesh);
        assert!(pairs > 0);
        assert_eq!(distance.topology().intersecting_pairs, Some(pairs));
        assert_eq!(distance.sign_method(), SignMethod::Winding);
        assert_eq!(distance.sign_reason(), format!("winding: {pairs} pairs of intersecting faces"));
    }
}

/// Number of crossing pairs by brute force, in general position. An edge p + t (q − p) crosses a triangle if
/// p + t (q − p) = a + u (b − a) + v (c − a) with 0 < t < 1 and u, v, 1 − u − v > 0.
fn crossing_pairs(mesh: &Mesh) -> usize {
    let corners = mesh.corners();
    let has_crossing_edge = |a: usize, b: usize| {
        let [origin, second, third] = corners[b];
        (0..3).any(|corner| {
            let ends = [0, 1].map(|step| (corner + step) % 3);
            if ends.iter().any(|end| mesh.triangles[b].contains(&mesh.triangles[a][*end])) {
                return false;
            }
            let [from, to] = ends.map(|end| corners[a][end]);
            let columns = [second - origin, third - origin, from - to];
            let system = sdf_core::nalgebra::Matrix3::from_columns(&columns);
            let Some(inverse) = system.try_inverse() else { return false };
            let [u, v, t]: [f64; 3] = (inverse * (from - origin)).into();
            u > 0.0 && v > 0.0 && u + v < 1.0 && t > 0.0 && t < 1.0
        })
    };
    let mut pairs = 0;
    for a in 0..corners.len() {
        pairs += (0..a).filter(|b| has_crossing_edge(a, *b) || has_crossing_edge(*b, a)).count();
    }
    pairs
}

#[test]
fn a_requested_method_is_used_and_named() {
    let open = meshes::cube().without(&[0]).baked();
    let distance = MeshDistance::new(&open, Some(SignMethod::PseudoNormal));
    assert_eq!(distance.sign_method(), SignMethod::PseudoNormal);
    assert_eq!(distance.sign_reason(), "pseudo-normal, as requested; the mesh: 3 boundary edges");
    let closed = meshes::cube().baked();
    let distance = MeshDistance::new(&closed, Some(SignMethod::Winding));
    assert_eq!(distance.sign_method(), SignMethod::Winding);
    assert_eq!(distance.sign_reason(), "winding, as requested; the mesh: closed, consistently wound, one shell");
}
