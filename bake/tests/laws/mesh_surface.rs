//! Nearest and deepest points of triangles against the least of many sampled distances.

use sdf_bake::{ClosestPoints, DepthLimits, MeshDistance, MeshSurface, Probe, SignMethod};
use sdf_core::nalgebra::Vector3;

use crate::meshes::{Mesh, block, cube, icosphere, tetrahedron};
use crate::random::Random;

const STEPS: u32 = 48;

fn meshes() -> [(&'static str, Mesh); 4] {
    let lumpy = icosphere(4).mapped(|p| p * (1.0 + 0.1 * (7.0 * p.x).sin() * (5.0 * p.y + p.z).cos()));
    let star = icosphere(2).mapped(|p| if (p.x * 9.0).sin() > 0.6 { p * 1.4 } else { p * 0.8 });
    [
        ("lumps", lumpy),
        ("star", star),
        ("fine cube", cube().refined().refined().refined()),
        ("tetrahedron", tetrahedron()),
    ]
}

/// Points of an element of two or three corners.
fn lattice(corners: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let share = |step: u32| f64::from(step) / f64::from(STEPS);
    match *corners {
        [a, b] => (0..=STEPS).map(|i| a + (b - a) * share(i)).collect(),
        [a, b, c] => (0..=STEPS)
            .flat_map(|i| (0..=STEPS - i).map(move |j| a + (b - a) * share(i) + (c - a) * share(j)))
            .collect(),
        _ => corners.to_vec(),
    }
}

#[test]
fn no_point_of_an_element_is_nearer_or_deeper_than_what_is_found() {
    let mut random = Random::from_env();
    let (mut outside, mut inside, mut settled) = (0, 0, 0);
    for (name, mesh) in meshes() {
        let triangles = mesh.baked();
        let distance = MeshDistance::new(&triangles, None);
        assert_eq!(distance.sign_method(), SignMethod::PseudoNormal, "{name}");
        let surface = MeshSurface::new(mesh.baked(), distance.sign_method(), distance.is_continuous());
        for round in 0..120 {
            let middle = random.pick(&mesh.points) * random.between(0.85, 1.05);
            let size = [0.05, 0.2, 0.6][round % 3];
            let corners: Vec<Vector3<f64>> =
                (0..if round % 4 == 0 { 2 } else { 3 }).map(|_| middle + random.point_in_cube(size)).collect();
            let sampled: Vec<f64> = lattice(&corners).into_iter().map(|p| distance.signed_distance(p.into())).collect();
            let lowest = sampled.iter().copied().fold(f64::INFINITY, f64::min);
            let context = || format!("{name}, round {round}: {corners:?}, sampled {lowest}");

            let closest = surface.closest(&corners, None, f64::INFINITY).unwrap();
            let nearest = sampled.iter().map(|d| d.abs()).fold(f64::INFINITY, f64::min);
            assert!(closest.distance <= nearest + 1e-12, "{closest:?}: {}", context());
            let at = surface.nearest(closest.at.query, 0, None);
            assert!((at.distance.abs() - closest.distance).abs() < 1e-9, "{at:?} {closest:?}: {}", context());
            let slot = random.below(triangles.triangle_count());
            for (limit, is_within) in [(1.0 + 1e-9, true), (1.0 - 1e-9, false)] {
                let again = surface.closest(&corners, Some(slot), closest.distance * limit);
                let is_same = |again: ClosestPoints| (again.distance - closest.distance).abs() <= 1e-12;
                let is_right = if is_within { again.is_some_and(is_same) } else { again.is_none() };
                assert!(closest.distance == 0.0 || is_right, "{again:?} from {slot}, {closest:?}: {}", context());
            }
            if lowest > 0.0 {
                outside += 1;
                continue;
            }
            let limits = DepthLimits { tolerance: 1e-6, least_depth: f64::NEG_INFINITY, evaluations: 4096 };
            // A search may start anywhere.
            let corner = Probe { weights: [1.0, 0.0, 0.0], at: surface.nearest(corners[0], 0, None) };
            let start = if round % 2 == 0 { Probe { weights: closest.weights, at } } else { corner };
            let found = surface.deepest(&corners, &[start], limits);
            assert!(found.lower_bound <= lowest + 1e-12, "{found:?}: {}", context());
            let own = distance.signed_distance(found.probe.at.query.into());
            assert!((own - found.probe.at.distance).abs() < 1e-12, "{own} {found:?}: {}", context());
            if found.is_settled {
                settled += 1;
                assert!(found.probe.at.distance <= found.lower_bound + 1e-6, "{found:?}: {}", context());
            }
            inside += 1;
        }
    }
    println!("{outside} outside, {inside} inside, {settled} of them settled");
    assert!(outside > 30 && inside > 200 && settled * 100 >= inside * 97, "{outside} {inside} {settled}");
}

/// A box 3.5 high, and a segment from its top down by 2: halfway through the box, which is 1.75 deep, the bottom is as near as the top. From
/// the segment's middle it is farther off than the segment is long, and so is missed by a list that does not know the middle's distance.
#[test]
fn what_is_behind_the_far_end_of_an_element_counts() {
    let mesh = block([20.0, 20.0, 1.75]).refined();
    let surface = MeshSurface::new(mesh.baked(), SignMethod::PseudoNormal, true);
    let corners = [Vector3::new(0.1, 0.2, 1.75), Vector3::new(0.1, 0.2, -0.25)];
    for (index, corner) in corners.iter().enumerate() {
        let weights = std::array::from_fn(|at| f64::from(u8::from(at == index)));
        let known = Probe { weights, at: surface.nearest(*corner, 0, None) };
        let limits = DepthLimits { tolerance: 1e-6, least_depth: f64::NEG_INFINITY, evaluations: 4096 };
        let found = surface.deepest(&corners, &[known], limits);
        assert!((found.probe.at.distance + 1.75).abs() < 1e-5 && found.is_settled, "from {index}: {found:?}");
        assert!(found.lower_bound <= -1.75, "from {index}: {found:?}");
    }
}

#[test]
fn an_element_without_corners_has_no_closest_points() {
    let surface = MeshSurface::new(cube().baked(), SignMethod::PseudoNormal, true);
    assert!(surface.closest(&[], None, f64::INFINITY).is_none());
    assert!(surface.closest(&[Vector3::zeros(); 4], None, f64::INFINITY).is_none());
}

/// Heights over the plane of a face whose product is below all numbers: the line through both meets the face beside the element.
#[test]
fn an_element_beside_a_face_does_not_cross_it_however_little_it_is_above_its_plane() {
    let surface = MeshSurface::new(cube().moved(0.0, 0.0, -1.0).baked(), SignMethod::PseudoNormal, true);
    for height in [1e-3, 1e-160, 1e-170, 1e-300] {
        let corners = [[1.05, 0.3, height], [1.15, 0.3, 2.0 * height], [1.1, 0.35, -1e-3]].map(Vector3::from);
        for corners in [&corners[..], &corners[..2]] {
            let found = surface.closest(corners, None, f64::INFINITY).unwrap();
            assert!((found.distance - 0.05).abs() < 1e-4, "{height:e}: {found:?}");
        }
    }
}

/// Which triangles of an open mesh are turned is a choice, where it is wound as it comes or has but one side. The order of the faces does not
/// make it: a mesh that is kept beside a grid has another.
#[test]
fn signs_do_not_depend_on_the_order_of_faces() {
    let mut random = Random::from_env();
    let mut undecided = 0;
    for round in 0..300 {
        let points: Vec<_> = (0..7).map(|_| random.point_in_cube(1.0)).collect();
        let corners: [u32; 7] = std::array::from_fn(|index| index as u32);
        // Of two faces back to back the second does not count, so that there the order does.
        let mut triangles: Vec<[u32; 3]> = vec![];
        for _ in 0..random.between(2.0, 9.0) as usize {
            let mut corners = corners;
            random.shuffle(&mut corners);
            let [a, b, c, ..] = corners;
            if !triangles.iter().any(|triangle| [a, b, c].iter().all(|corner| triangle.contains(corner))) {
                triangles.push([a, b, c]);
            }
        }
        let mut mesh = Mesh { points, triangles };
        let queries: Vec<[f64; 3]> = (0..20).map(|_| random.point_in_cube(1.0).into()).collect();
        let signs = |mesh: &Mesh| {
            let triangles = mesh.baked();
            let distance = MeshDistance::new(&triangles, Some(SignMethod::Winding));
            let surface = MeshSurface::new(mesh.baked(), SignMethod::Winding, distance.is_continuous());
            let sign = |query: &[f64; 3]| {
                let at = surface.nearest(Vector3::from(*query), 0, None);
                // Where rounding of the winding number cannot decide.
                let is_clear = (distance.winding_number(*query).abs() - 0.5).abs() > 1e-6;
                (is_clear && at.distance.abs() > 1e-9)
                    .then(|| [distance.signed_distance(*query) < 0.0, at.distance < 0.0])
            };
            queries.iter().map(sign).collect::<Vec<_>>()
        };
        let first = signs(&mesh);
        assert!(first.iter().flatten().all(|[a, b]| a == b), "round {round}: {mesh:?}");
        undecided += first.iter().filter(|sign| sign.is_none()).count();
        for _ in 0..6 {
            random.shuffle(&mut mesh.triangles);
            assert_eq!(signs(&mesh), first, "round {round}: {mesh:?}");
        }
    }
    assert!(undecided < 60, "{undecided}");
}
