//! Soft bodies by themselves: rest, free flight and small strains, from rubber to what no pass can solve.

use std::collections::BTreeSet;

use sdf_core::Simplex;
use sdf_core::contact::{Contact, Element, Outcome, Row, RowSide, TetPoint, contact};
use sdf_core::minimize::FrankWolfe;
use sdf_core::shapes::HalfSpace;
use sdf_procedural::random::{Random, test_seed};
use sdf_sim::soft::{self, Matter};
use sdf_sim::{Rows, World};

use crate::{V3, cuboid};

const STEP: f64 = 1.0 / 1200.0;

/// A cube of side 0.4 in cells of 0.1, without gravity.
fn cube(young: f64, poisson: f64) -> World {
    let mut world = World::new([0.0; 3]);
    let (points, faces) = cuboid([0.19; 3]);
    let matter = Matter { density: 1000.0, young, poisson };
    soft::add(&mut world, &points, &faces, 0.1, 0.0, &matter, |_| true);
    world
}

/// Also where the mesh ends within cubes, and where there are cubes around it.
#[test]
fn a_body_has_the_mass_of_its_mesh_and_not_of_its_cubes() {
    let density = 1000.0;
    let wanted = density * 8.0 * 0.19 * 0.19 * 0.3;
    for (side, padding) in [(0.1, 0.0), (0.15, 0.0), (0.3, 0.0), (0.1, 0.1), (0.38, 0.2)] {
        let mut world = World::new([0.0; 3]);
        let (points, faces) = cuboid([0.19, 0.19, 0.3]);
        let far = points.iter().map(|point| [point[0] + 7.0, point[1], point[2] - 7.0]).collect::<Vec<_>>();
        let matter = Matter { density, young: 1e5, poisson: 0.3 };
        soft::add(&mut world, &far, &faces, side, padding, &matter, |_| true);
        let mass: f64 = world.inv_mass.iter().map(|inv_mass| 1.0 / inv_mass).sum();
        assert!((mass / wanted - 1.0).abs() < 1e-12, "cubes of {side}, padding {padding}: {mass} and not {wanted}");
    }
}

const MODULI: [f64; 7] = [1e2, 1e4, 1e6, 1e7, 1e8, 1e10, 1e13];

#[test]
fn a_body_at_rest_stays_there_however_stiff() {
    for (young, poisson) in MODULI.into_iter().flat_map(|young| [0.05, 0.3, 0.49].map(|poisson| (young, poisson))) {
        let mut world = cube(young, poisson);
        let start = world.x.clone();
        (0..200).for_each(|_| world.step(STEP, &mut Rows::default()));
        let moved = world.x.iter().zip(&start).map(|(now, start)| (now - start).norm()).fold(0.0, f64::max);
        assert!(moved < 1e-12, "{young}, {poisson}: moved by {moved}");
        assert_eq!(world.energy(), 0.0, "{young}, {poisson}");
    }
}

/// Every particle has a velocity of its own, of up to 1. What they have together is conserved.
#[test]
fn a_body_in_free_flight_keeps_its_momentum_and_gains_no_speed_however_stiff() {
    for young in MODULI {
        let mut world = cube(young, 0.4);
        for (index, v) in (0_u8..).zip(&mut world.v) {
            *v = V3::from([0.37, 0.71, 0.53].map(|stride: f64| (stride * f64::from(index)).sin()));
        }
        let [kinetic, mass] = [world.kinetic_energy(), world.inv_mass.iter().map(|inv_mass| 1.0 / inv_mass).sum()];
        let (momentum, mut highest) = (world.momentum(), 0.0_f64);
        for _ in 0..600 {
            world.step(STEP, &mut Rows::default());
            highest = highest.max(world.kinetic_energy());
        }
        let drift = (world.momentum() - momentum).norm();
        assert!(drift < 1e-9 * mass, "{young}: momentum off by {drift}");
        assert!(highest <= kinetic * (1.0 + 1e-9), "{young}: kinetic energy {kinetic} grew to {highest}");
        // A soft one has less energy to hold against than there is in its motion.
        assert!(young < 1e6 || world.min_volume_ratio() > 0.0, "{young}: a tetrahedron is inverted");
    }
}

/// A bar of Young's modulus E that is stretched by ε along one axis, and thinner by ν ε along the others, holds E ε²/2 for each unit of
/// volume, whichever way it is turned. The rest is of the third order: less than 3 ε of it.
#[test]
fn small_strains_have_the_energy_of_hookes_law() {
    let (young, strain) = (1e6, 1e-4);
    for (poisson, axis) in [0.05, 0.3, 0.45].into_iter().flat_map(|poisson| [0, 1, 2].map(|axis| (poisson, axis))) {
        let mut world = cube(young, poisson);
        let turn = sdf_core::nalgebra::Rotation3::new(V3::new(2.0, -1.0, 0.5));
        for x in &mut world.x {
            let stretched =
                std::array::from_fn(|k| x[k] * if k == axis { 1.0 + strain } else { 1.0 - poisson * strain });
            *x = turn * V3::from(stretched);
        }
        let expected = 0.38_f64.powi(3) * young * strain * strain / 2.0;
        let energy = world.energy();
        assert!((energy / expected - 1.0).abs() < 3.0 * strain, "{poisson}, axis {axis}: {energy}, not {expected}");
    }
}

/// Two boxes whose sides lie between cubes, one wider and one longer, also where their coordinates are rounded: no cube is outside of
/// both, and each vertex stays where it is. Where no cube is wanted, each of the 16 vertices has one.
#[test]
fn a_body_whose_sides_lie_between_cubes_has_no_cube_outside_of_it() {
    let [wider, longer] = [[0.2; 3], [0.1, 0.1, 0.4]].map(|half| cuboid(half).0);
    let is_inside = |at: V3| at.amax() < 0.2 || (at.x.abs() < 0.1 && at.y.abs() < 0.1 && at.z.abs() < 0.4);
    let matter = Matter { density: 1000.0, young: 1e5, poisson: 0.3 };
    for ulps in [0.0, 4.0, -4.0] {
        let points: Vec<_> =
            wider.iter().chain(&longer).map(|point| point.map(|x| x * (1.0 + ulps * f64::EPSILON))).collect();
        for (is_wanted, count) in [(&is_inside as &dyn Fn(V3) -> bool, 64 + 16), (&|_| false, 16)] {
            let mut world = World::new([0.0; 3]);
            let surface = soft::add(&mut world, &points, &[], 0.1, 0.0, &matter, is_wanted);
            assert_eq!(world.tets.len(), 6 * count, "{ulps}");
            let off =
                surface.points(&world).into_iter().zip(&points).map(|(now, at)| (V3::from(now) - V3::from(*at)).amax());
            // Eight roundings of a coordinate.
            assert!(off.fold(0.0, f64::max) < 8.0 * f64::EPSILON, "{ulps}");
        }
    }
}

/// Closed as before, of the same volume, with the old points first and no edge longer than asked; what is short enough stays as it is.
#[test]
fn long_edges_are_cut_and_the_mesh_stays_closed() {
    let edges = |faces: &[[u32; 3]]| -> BTreeSet<[u32; 2]> {
        faces.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect()
    };
    let volume = |points: &[[f64; 3]], faces: &[[u32; 3]]| -> f64 {
        let corners = |face: &[u32; 3]| face.map(|corner| V3::from(points[corner as usize]));
        faces.iter().map(corners).map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0).sum()
    };
    let (points, faces) = cuboid([0.5, 0.35, 0.15]);
    for side in [3.0, 0.7, 0.3, 0.11, 0.05] {
        let (mut cut, mut parts) = (points.clone(), faces.clone());
        assert!(soft::split_edges(&mut cut, &mut parts, side));
        let all = edges(&parts);
        assert_eq!(all.len(), 3 * parts.len(), "{side}: an edge has two faces on one side");
        assert!(all.iter().all(|[a, b]| all.contains(&[*b, *a])), "{side}: it is open");
        assert_eq!(cut[..8], points, "{side}");
        assert!((volume(&cut, &parts) - 8.0 * 0.5 * 0.35 * 0.15).abs() < 1e-12, "{side}");
        let length = |[a, b]: &[u32; 2]| (V3::from(cut[*a as usize]) - V3::from(cut[*b as usize])).norm();
        let longest = all.iter().map(length).fold(0.0, f64::max);
        assert!(longest <= side * 2_f64.sqrt() * 1.000001, "{side}: {longest}");
        assert_eq!(parts.len() == faces.len(), side > 1.0, "{side}");
    }
    assert!(!soft::split_edges(&mut points.clone(), &mut faces.clone(), 1e-5));
}

/// A contact of a face on the ground, with these shares of its corners.
fn on_the_ground(weights: [f64; 3]) -> Contact<f64> {
    let ground = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
    let corners = [V3::zeros(), V3::x(), V3::y()];
    let element = Element { id: 0, vertices: [0, 1, 2], simplex: Simplex { corners } };
    match contact(&ground, &FrankWolfe::default(), 1.0, &element) {
        Outcome::Contact(contact) => Contact { weights, ..contact },
        other => panic!("{other:?}"),
    }
}

/// A face whose corners share particles, as most do: a push moves its point by Σ (Σ w)²/m, and what falls on the ground stops and does not
/// rebound.
#[test]
fn a_soft_body_that_strikes_the_ground_stops_at_the_point_and_gains_no_energy() {
    let seed = test_seed(2611);
    let mut random = Random::new(seed);
    for round in 0..200 {
        let mut world = cube(1e-9, 0.3);
        world.v.iter_mut().for_each(|v| *v = -V3::z());
        let mut shares = |count: usize| {
            let drawn: Vec<f64> = (0..count).map(|_| random.unit() + 1e-3).collect();
            let sum: f64 = drawn.iter().sum();
            drawn.into_iter().map(|share| share / sum).collect::<Vec<f64>>()
        };
        // In one tetrahedron, in two, in three of the cubes at a corner.
        let tets = [[0, 0, 0], [0, 0, 1], [0, 1, 2]][round % 3];
        let embedding = tets.map(|tet| TetPoint { tet, weights: shares(4).try_into().unwrap() });
        let contact = on_the_ground(shares(3).try_into().unwrap());
        let row = Row::from_contact(&contact, 0.0).unwrap();
        let element = RowSide::embedded(&contact, &embedding).unwrap();
        let place = |world: &World| {
            let mut z = 0.0;
            let corners: Vec<[u32; 4]> = world.tets.iter().map(|tet| tet.corners).collect();
            element.visit_particles(&corners, |particle, weight| z += world.x[particle as usize].z * weight);
            z
        };
        let (kinetic, start) = (world.kinetic_energy(), place(&world));
        let point = V3::z() * start;
        let mut rows = Rows::default();
        rows.push(Row { element, gap: 0.0, point, surface_point: point, ..row });
        world.step(STEP, &mut rows);
        let context = format!("round {round} of seed {seed}");
        let gain = world.kinetic_energy() / kinetic - 1.0;
        assert!(gain < 1e-12, "{context}: kinetic energy grew by {gain}");
        let sunk = (place(&world) - start) / STEP;
        assert!(sunk.abs() < 1e-9, "{context}: the point goes on at {sunk}");
    }
}
