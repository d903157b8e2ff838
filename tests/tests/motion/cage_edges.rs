//! Bounds of a cage where they hold with equality: of φ in a tetrahedron, of boxes under its map, of slopes and of margins.

use nalgebra::{Matrix3, Rotation3, Vector3};
use sdf_core::Sdf;
use sdf_core::cage::{Cage, CageMap, CageOutcome, bound_tets};
use sdf_core::contact::{Element, TetPoint};
use sdf_core::minimize::{Certified, FrankWolfe};
use sdf_core::placed::{Placed, Placement};
use sdf_core::shapes::HalfSpace;
use sdf_core::{Aabb, Simplex};
use sdf_tests::random::Random;

use crate::cage_lattice::{Lattice, with_locator};
use crate::random_weights;

type Point = Vector3<f64>;

/// A cage of one tetrahedron that is not flat, at rest and deformed.
fn with_tet(random: &mut Random, run: impl FnOnce(&Cage, &mut Random)) {
    let points = loop {
        let corners: Vec<Point> = (0..4).map(|_| random.in_cube(1.0)).collect();
        let [a, b, c] = [1, 2, 3].map(|k| corners[k] - corners[0]);
        if a.dot(&b.cross(&c)) > 0.1 {
            break corners.into_iter().map(<[f64; 3]>::from).collect();
        }
    };
    let lattice = Lattice { points, tets: vec![[0, 1, 2, 3]] };
    let (stretch, turn) = (random.between(0.5, 2.0), random.between(-0.3, 0.3));
    let linear = Matrix3::new(stretch, turn, 0.1, -turn, 1.0, 0.2, 0.0, -0.1, 0.8);
    let now: Vec<[f64; 3]> = lattice.points.iter().map(|x| (linear * Vector3::from(*x)).into()).collect();
    with_locator(&lattice, &lattice.points, |rest| {
        with_locator(&lattice, &now, |now| run(&Cage::new(rest, now).unwrap(), random));
    });
}

/// The bound comes from the middle: a plane whose normal points from the farthest corner to the middle reaches it.
#[test]
fn no_value_in_a_tetrahedron_is_below_its_bound_and_planes_reach_it() {
    let mut random = Random::seeded();
    for _ in 0..300 {
        with_tet(&mut random, |cage, random| {
            let corners = cage.rest().corners(0).unwrap();
            let middle: Point = corners.iter().sum::<Point>() / 4.0;
            let far = corners.iter().max_by(|a, b| (*a - middle).norm().total_cmp(&(*b - middle).norm())).unwrap();
            for (normal, is_sharp) in
                [((middle - far).normalize(), true), (Vector3::z(), false), (-Vector3::x(), false)]
            {
                let field = HalfSpace::new(normal.into(), normal.dot(far) - 0.2).unwrap();
                let mut bounds = [0.0];
                assert!(bound_tets(&field, cage.rest(), &mut bounds));
                let lowest = corners.iter().map(|corner| field.value(*corner)).fold(f64::INFINITY, f64::min);
                assert!(bounds[0] <= lowest && (!is_sharp || lowest - bounds[0] < 1e-9), "{} for {lowest}", bounds[0]);
                // A point that just touches is not left out for it.
                let at = TetPoint { tet: 0, weights: random_weights(random) };
                let point = cage.now().point(&at).unwrap();
                for corner in cage.now().corners(0).unwrap().into_iter().chain([point]) {
                    let element = Element { id: 0, vertices: [0], simplex: Simplex { corners: [corner] } };
                    let search = |margin, bounds: &[f64]| {
                        cage.contact(&field, &FrankWolfe::default(), margin, &element, bounds, CageMap::Exact).outcome
                    };
                    let CageOutcome::Contact(found) = search(9.0, &[]) else { panic!("{:?}", search(9.0, &[])) };
                    let touches = search(found.contact.distance, &bounds);
                    assert!(matches!(touches, CageOutcome::Contact(_)), "{touches:?}");
                }
            }
        });
    }
}

#[test]
fn boxes_under_a_frozen_map_hold_the_images_of_their_corners_and_no_more() {
    let mut random = Random::seeded();
    for _ in 0..300 {
        with_tet(&mut random, |cage, random| {
            let at = TetPoint { tet: 0, weights: [0.25; 4] };
            let frozen = cage.frozen_at(cage.now().point(&at).unwrap()).unwrap();
            let (a, b) = (random.in_cube(1.0), random.in_cube(1.0));
            let bounds = Aabb::from_points([a.into(), b.into()]).unwrap();
            let corners: Vec<Point> = (0..8)
                .map(|k| Vector3::from_fn(|axis, _| if k >> axis & 1 == 1 { a[axis] } else { b[axis] }))
                .collect();
            let pulled: Vec<Point> = corners.iter().map(|corner| frozen.pull(*corner).point).collect();
            let jacobian = frozen.pull(a).jacobian;
            let to_world = jacobian.try_inverse().unwrap();
            let pushed: Vec<Point> =
                corners.iter().map(|corner| a + to_world * (corner - frozen.pull(a).point)).collect();
            for (found, images) in [(frozen.pull_bounds(bounds), pulled), (frozen.push_bounds(bounds), pushed)] {
                let around = Aabb::from_points(images.into_iter().map(Into::into)).unwrap();
                for axis in 0..3 {
                    assert!((found.min[axis] - around.min[axis]).abs() < 1e-9, "{found:?} {around:?}");
                    assert!((found.max[axis] - around.max[axis]).abs() < 1e-9, "{found:?} {around:?}");
                }
            }
        });
    }
}

/// A point above a plane, at the margin of the world: in material space it is farther off by up to the slope factor.
#[test]
fn slopes_and_margins_of_a_cage_are_reached_along_its_largest_stretch() {
    let mut random = Random::seeded();
    for _ in 0..300 {
        with_tet(&mut random, |cage, random| {
            let svd = cage.jacobian(0).unwrap().svd(true, true);
            let largest = svd.singular_values.imax();
            // G v = σ u: a way along v in the world is σ times as long in material space, along u.
            let (u, v) = (svd.u.unwrap().column(largest).into_owned(), svd.v_t.unwrap().row(largest).transpose());
            let field = HalfSpace::new(u.into(), 0.0).unwrap();
            let point = cage.now().point(&TetPoint { tet: 0, weights: random_weights(random) }).unwrap();
            let middle = cage.now().point(&TetPoint { tet: 0, weights: [0.25; 4] }).unwrap();
            let placed = Placed { field: &field, placement: cage.frozen_at(middle).unwrap() };
            let way = 0.01;
            let rise = placed.value(point + v * way) - placed.value(point);
            for slope_bound in [placed.slope_bound(), cage.slope_factor() * field.slope_bound()] {
                assert!(rise <= slope_bound * way * (1.0 + 1e-9) && rise > 0.999_999 * slope_bound * way, "{rise}");
            }
        });
    }
}

/// The longest edges are of length 1. Heights go from that to a hundred-millionth of it.
#[test]
fn a_point_between_two_tetrahedra_is_in_one_of_them_however_flat_they_are() {
    let mut random = Random::seeded();
    let mut found = [0; 2];
    for _ in 0..2000 {
        let height = 10.0_f64.powf(random.between(-8.0, 0.0));
        let turn = Rotation3::new(random.direction() * random.between(0.0, 3.0));
        let flat: Vec<Point> = (0..5).map(|_| random.in_cube(0.5)).collect();
        let at = |k: usize, side: f64| turn * Vector3::new(flat[k].x, flat[k].y, side * height * flat[k].z.abs());
        let corners = [at(0, 1.0), at(1, 1.0), at(2, -1.0), at(3, 3.0), at(4, -3.0)];
        let points = corners.iter().map(|corner| (*corner).into()).collect();
        let lattice = Lattice { points, tets: vec![[0, 1, 2, 3], [0, 1, 2, 4]] };
        let weights: [f64; 3] = random_weights(&mut random);
        let point: Point = corners.iter().zip(weights).map(|(corner, weight)| corner * weight).sum();
        with_locator(&lattice, &lattice.points, |locator| {
            let has_frames = [0, 1].iter().all(|tet| locator.weights(*tet, point).is_some());
            found[usize::from(has_frames)] += 1;
            assert!(!has_frames || locator.locate(point).is_some(), "{height:e}, {corners:?}, {weights:?}");
        });
    }
    assert!(found.iter().all(|count| *count > 100), "{found:?} without and with frames");
}

/// The lower part lies in a tetrahedron that is stretched: it is far in the world.
#[test]
fn a_part_beyond_the_margin_of_the_world_does_not_hide_one_within_it() {
    let tet = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let beside = tet.map(|[x, y, z]| [x + 5.0, y, z]);
    let stretched = tet.map(|[x, y, z]| [x, y, 10.0 * z]);
    let lattice = Lattice { points: [tet, beside].concat(), tets: vec![[0, 1, 2, 3], [4, 5, 6, 7]] };
    let now = [stretched, beside].concat();
    let field = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
    let corners = [Vector3::new(0.2, 0.2, 0.5), Vector3::new(5.2, 0.2, 0.06)];
    let element = Element { id: 0, vertices: [0, 1], simplex: Simplex { corners } };
    with_locator(&lattice, &lattice.points, |rest| {
        with_locator(&lattice, &now, |now| {
            let cage = Cage::new(rest, now).unwrap();
            let search = |world_margin: f64| {
                let margins = [0.1, world_margin];
                cage.contact_within(&field, &Certified::default(), margins, &element, &[], CageMap::Exact).outcome
            };
            let [CageOutcome::Contact(lowest), CageOutcome::Contact(near)] = [search(f64::INFINITY), search(0.1)]
            else {
                panic!("{:?}, {:?}", search(f64::INFINITY), search(0.1));
            };
            assert!(lowest.contact.distance < 0.05 && lowest.world_distance() > 0.4, "{lowest:?}");
            assert!((near.contact.distance - 0.06).abs() < 1e-6 && near.world_distance() < 0.1, "{near:?}");
            // Bounds are those of the whole element.
            assert!(near.contact.lower_bound <= lowest.contact.distance, "{near:?}");
            assert_eq!(search(0.01), CageOutcome::Separated);
        });
    });
}
