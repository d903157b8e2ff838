//! Steep and flat fields, fields that are not distances, and grids of one cell.

use nalgebra::Vector3;
use sdf_bake::SparseGrid;
use sdf_core::combine::SmoothUnion;
use sdf_core::grid::sparse::{BRICK_SAMPLES, Scale, Sparse};
use sdf_core::grid::{BlockBounds, Grid, cell_slope, measure_slope_bound};
use sdf_core::shapes::{Cuboid, Cylinder, Ellipsoid, HalfSpace, Sphere, Torus};
use sdf_core::{EnclosedSdf, Interval};

use super::{random, triangles};
use crate::random::Random;
use crate::scene_field::SceneField;
use crate::scenes::{cube_lattice, dense_grid, node_indices, sampled, shifted, with_block_bounds};
use crate::stability::bodies::{Body, all_bodies};

pub fn steep() -> Vec<Body> {
    let bodies = |steepness: f64| all_bodies(1.0, 2, &mut random()).into_iter().map(move |body| body.steep(steepness));
    let ball = sampled(&Sphere::new(0.5).unwrap(), cube_lattice(0.75, 12), 1e6);
    let elements = all_bodies(1.0, 20, &mut random()).remove(0).elements;
    let grid = Body::new("grid of 1e6 times a distance", ball, 1.0).with(elements);
    bodies(1e3).chain(bodies(1e9)).chain([grid]).collect()
}

pub fn flat() -> Vec<Body> {
    let all = all_bodies(1.0, 2, &mut random());
    let elements = all[0].elements.clone();
    let lattice = cube_lattice(0.75, 4);
    let constant = dense_grid(lattice, vec![0.25; lattice.node_count()], 1.0);
    let constant = Body::new("constant grid", constant, 1.0).with(elements);
    all.into_iter().map(|body| body.steep(1e-6)).chain([constant]).collect()
}

pub fn no_distances() -> Vec<Body> {
    let mut random = random();
    let ball = |x: f64| SceneField::new(shifted(SceneField::new(Sphere::new(0.5).unwrap()), [x, 0.0, 0.0]));
    let ordinary = |random: &mut Random| triangles(40, 1.0, random, |_, _| {});
    vec![
        Body::new("ellipsoid 1 : 1 : 100", Ellipsoid::new([0.01, 0.01, 1.0]).unwrap(), 1.0)
            .convex()
            .with(ordinary(&mut random)),
        Body::new("ellipsoid 1 : 100 : 100", Ellipsoid::new([0.01, 1.0, 1.0]).unwrap(), 1.0)
            .convex()
            .with(ordinary(&mut random)),
        Body::new("smooth union", SmoothUnion::new(ball(-0.4), ball(0.4), 0.5).unwrap(), 1.0)
            .with(ordinary(&mut random)),
        Body::new("smooth union, hardly", SmoothUnion::new(ball(-0.4), ball(0.4), 1e-9).unwrap(), 1.0)
            .with(ordinary(&mut random)),
        Body::new("smooth union, widely", SmoothUnion::new(ball(-0.4), ball(0.4), 1e3).unwrap(), 1e3)
            .with(ordinary(&mut random)),
        Body::new("0.1 times a cuboid", Cuboid::new([0.5, 0.3, 0.7]).unwrap(), 1.0)
            .steep(0.1)
            .convex()
            .with(ordinary(&mut random)),
        Body::new("10 times a torus", Torus::new(0.6, 0.2).unwrap(), 1.0).steep(10.0).with(ordinary(&mut random)),
    ]
}

/// Dense, with block bounds, and sparse with one brick.
pub fn one_cell() -> Vec<Body> {
    let mut random = random();
    let lattice = cube_lattice(0.5, 1);
    let corner = shifted(Cylinder::new(0.3, 0.4).unwrap(), [0.4, 0.4, 0.0]);
    let plane = HalfSpace::new([1.0, 2.0, -1.0], 0.1).unwrap();
    let ordinary = |random: &mut Random| triangles(30, 1.0, random, |_, _| {});
    vec![
        Body::new("cell of a cylinder", sampled(&corner, lattice, 1.0), 1.0).with(ordinary(&mut random)),
        Body::new("cell of a plane", sampled(&plane, lattice, 1.0), 1.0).with(ordinary(&mut random)),
        Body::new("bounded cell of a plane", with_block_bounds(sampled(&plane, lattice, 1.0)), 1.0)
            .with(ordinary(&mut random)),
        Body::new("brick of one cell", one_brick(&corner), 1.0).with(ordinary(&mut random)),
        Body::new("small cell of a plane", sampled(&plane, cube_lattice(0.5e-6, 1), 1.0), 1.0).with(triangles(
            30,
            1e-6,
            &mut random,
            |corners, random| {
                let offset = corners[0] - random.in_cube(0.5e-6);
                corners.iter_mut().for_each(|corner| *corner -= offset);
            },
        )),
    ]
}

fn one_brick(field: &impl EnclosedSdf) -> Grid<Sparse<SparseGrid<f32>>> {
    let lattice = cube_lattice(0.5, 1);
    let nodes: Vec<[u32; 3]> = node_indices([2; 3]).collect();
    let corners: [f32; 8] =
        std::array::from_fn(|corner| field.value(Vector3::from(lattice.node(nodes[corner]))) as f32);

    let mut samples = vec![0.0; BRICK_SAMPLES];
    for (corner, sample) in corners.iter().enumerate() {
        samples[(corner & 1) + 8 * (corner >> 1 & 1) + 64 * (corner >> 2)] = *sample;
    }
    let bounds = BlockBounds {
        range: Interval {
            lower: corners.into_iter().fold(f32::INFINITY, f32::min),
            upper: corners.into_iter().fold(f32::NEG_INFINITY, f32::max),
        },
        slope_bound: (cell_slope(corners, lattice.spacing()) as f32).next_up(),
    };
    let brick = SparseGrid {
        table: vec![0],
        slots: vec![[0; 3]],
        scales: vec![Scale { base: 0.0, step: 0.0 }],
        samples,
        coarse: vec![0.0; 8],
        bounds: vec![bounds],
        errors: vec![],
        slope_bound: 0.0,
        error_bound: 0.0,
        inside_reaches_box: false,
        jumps: None,
    };
    let storage = Sparse::new(&lattice, brick).unwrap();
    let slope_bound = measure_slope_bound(&lattice, &storage);
    Grid::new(lattice, storage, slope_bound).unwrap()
}
