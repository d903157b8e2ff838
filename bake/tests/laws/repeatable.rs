//! Repeatability: the same mesh bakes to the same bytes, in any order of its triangles and in any unit.

use sdf_bake::{DenseGrid, MeshDistance, SignMethod, TriangleMesh, dense, lattice_around};
use sdf_core::grid::{Lattice, Precision};
use sdf_core::nalgebra::Vector3;

use crate::meshes::{self, Mesh};
use crate::oracle::{self, Baked};
use crate::random::Random;

fn samples(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let turn = random.rotation();
    let sphere = meshes::icosphere(3);
    vec![
        ("star", meshes::star(3, 7, 1.5).turned(&turn)),
        ("cube", meshes::cube().refined().refined()),
        ("open sphere", sphere.clone().without(&[1, 2, 3, 500])),
        ("nested", sphere.clone().and(sphere.scaled(0.5))),
        ("soup", meshes::soup(700, 0.3, random)),
        ("needles", meshes::needles(200, 1e-6, random)),
        ("degenerate", meshes::degenerate_soup(100, random)),
    ]
}

fn assert_same_bits(name: &str, a: &DenseGrid, b: &DenseGrid) {
    let differing = a.distances.iter().zip(&b.distances).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    assert_eq!(differing, 0, "{name}: of {} samples", a.distances.len());
    assert_eq!(a.slope_bound.to_bits(), b.slope_bound.to_bits(), "{name}");
    assert_eq!(a.error_bound.to_bits(), b.error_bound.to_bits(), "{name}");
}

#[test]
fn any_number_of_threads_bakes_the_same_bytes() {
    let mut random = Random::from_env();
    for (name, mesh) in samples(&mut random) {
        let bake_on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let Baked { grid, lattice } = Baked::from_mesh(&mesh, None, 16);
                let coded = Precision::ALL.map(|precision| grid.clone().into_grid_as(&lattice, precision));
                (grid, coded)
            })
        };
        let (alone, coded) = bake_on(1);
        for threads in [2, 7] {
            let (grid, again) = bake_on(threads);
            assert_same_bits(name, &alone, &grid);
            assert!(again == coded, "{name}: other codes");
        }
    }
}

#[test]
fn progress_counts_every_node_once() {
    let mesh = meshes::icosphere(1).baked();
    let lattice = lattice_around(&mesh.bounds(), 0.07, 3).unwrap();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let count = |nodes| {
        done.fetch_add(nodes, std::sync::atomic::Ordering::Relaxed);
    };
    dense::bake(&MeshDistance::new(&mesh, None), &lattice, &count);
    assert_eq!(done.into_inner(), lattice.node_count());
}

/// The distance to the nearest triangle does not depend on the order, bit for bit.
#[test]
fn any_order_of_triangles_and_points_bakes_the_same_samples() {
    let mut random = Random::from_env();
    for (name, mesh) in samples(&mut random) {
        let baked = Baked::from_mesh(&mesh, None, 16);
        for _ in 0..2 {
            let mut shuffled = mesh.clone();
            random.shuffle(&mut shuffled.triangles);
            let mut new_indices: Vec<u32> = (0..mesh.points.len() as u32).collect();
            random.shuffle(&mut new_indices);
            for (point, index) in mesh.points.iter().zip(&new_indices) {
                shuffled.points[*index as usize] = *point;
            }
            shuffled.triangles.iter_mut().flatten().for_each(|index| *index = new_indices[*index as usize]);
            assert_same_bits(name, &baked.grid, &Baked::from_mesh(&shuffled, None, 16).grid);
        }
    }
}

/// The order of the corners changes how a distance is rounded in f64, and so at times its last place in f32.
#[test]
fn any_order_of_corners_bakes_the_same_samples_up_to_rounding() {
    let mut random = Random::from_env();
    for (name, mesh) in samples(&mut random) {
        let baked = Baked::from_mesh(&mesh, None, 16);
        let mut turned = mesh.clone();
        turned.triangles.iter_mut().for_each(|corners| corners.rotate_left(random.below(3)));
        let again = Baked::from_mesh(&turned, None, 16);
        let on_surface = 1e-9 * oracle::diagonal(&mesh);
        let mut differing = 0;
        for ((node, first), (_, second)) in baked.nodes().zip(again.nodes()) {
            differing += usize::from(first != second);
            if first.abs() > on_surface || second.abs() > on_surface {
                assert!(
                    (first - second).abs() <= f64::from(f32::EPSILON) * first.abs(),
                    "{name}: {first} {second} at {node:?}"
                );
            }
        }
        println!("{name}: {differing} samples differ in the last place");
    }
}

/// Promise 8: nothing depends on the unit of length. Scaling by a power of two is exact.
#[test]
fn a_mesh_scaled_by_a_power_of_two_bakes_to_the_samples_scaled() {
    let mut random = Random::from_env();
    for (name, mesh) in samples(&mut random) {
        for method in [SignMethod::PseudoNormal, SignMethod::Winding] {
            let baked = Baked::from_mesh(&mesh, Some(method), 12);
            for exponent in [-80, -1, 7, 80] {
                let scale = 2.0_f64.powi(exponent);
                let scaled = Baked::from_mesh(&mesh.clone().scaled(scale), Some(method), 12);
                let mut wanted = baked.grid.clone();
                wanted.distances.iter_mut().for_each(|distance| *distance *= scale as f32);
                wanted.error_bound *= scale;
                assert_same_bits(name, &wanted, &scaled.grid);
            }
        }
    }
}

/// All coordinates are multiples of 2⁻²⁰ below 2²⁰, before and after the move: so only distances are rounded.
#[test]
fn a_mesh_moved_exactly_bakes_to_the_same_samples_up_to_rounding() {
    let mut random = Random::from_env();
    let snap = |p: Vector3<f64>| (p * 1_048_576.0).map(f64::round) / 1_048_576.0;
    for (name, mesh) in samples(&mut random).into_iter().filter(|(name, _)| *name != "needles") {
        let mesh = mesh.mapped(snap);
        let bake_moved = |by: f64| {
            let moved: Vec<[f64; 3]> = mesh.points.iter().map(|p| p.add_scalar(by).into()).collect();
            let moved = TriangleMesh::new(&moved, &mesh.triangles).unwrap();
            let lattice = Lattice::new([by - 1.75; 3], 0.125, [29; 3]).unwrap();
            dense::bake(&MeshDistance::new(&moved, None), &lattice, &|_| ())
        };
        let baked = bake_moved(0.0);
        for by in [1.0, -64.0, 1024.0] {
            for (here, there) in baked.distances.iter().zip(&bake_moved(by).distances) {
                let rounding = f32::EPSILON * here.abs() + 1e-12;
                assert!((here.abs() - there.abs()).abs() <= rounding, "{name}: {here} {there}");
                assert!(here.abs() < 1e-6 || (*here < 0.0) == (*there < 0.0), "{name}: {here} {there}");
            }
        }
    }
}
