//! Bounds that a dense grid states of itself: slope and error.

use sdf_bake::{MeshDistance, dense};
use sdf_core::grid::{Dense, Grid, Lattice, Precision, Storage};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, Sdf};

use crate::meshes::{self, Mesh};
use crate::oracle::{self, Baked};
use crate::random::Random;

/// Rounding of f64 sums, relative to the mesh's size.
const F64_ROUNDING: f64 = 1e-13;

fn closed_meshes(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let turn = random.rotation();
    let mut closed = vec![
        ("sphere", meshes::icosphere(2)),
        ("cube", meshes::cube()),
        ("turned cube", meshes::cube().turned(&turn)),
        ("L", meshes::l_solid().turned(&turn)),
        ("star", meshes::star(1, 3, 1.5)),
        ("thin plate", meshes::block([1.0, 0.7, 0.01]).turned(&turn)),
        ("overlapping", meshes::icosphere(1).and(meshes::icosphere(1).moved(1.0, 0.3, 0.0))),
        ("cavity", meshes::icosphere(1).and(meshes::icosphere(1).flipped().scaled(0.6))),
        ("tiny torus", meshes::torus(1.0, 0.3, 16, 8).scaled(1e-12)),
        ("far sphere", meshes::icosphere(1).moved(1e4, 0.0, -1e4)),
    ];
    closed.extend(meshes::with_edges_of_four_faces().into_iter().map(|(name, mesh)| (name, mesh.turned(&turn))));
    closed
}

fn open_meshes(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let sphere = meshes::icosphere(2);
    let bowl: Vec<usize> = (0..sphere.triangles.len()).filter(|t| sphere.corners()[*t][0].z > 0.1).collect();
    vec![
        ("bowl", sphere.clone().without(&bowl)),
        ("sphere with a hole", sphere.without(&[0, 1, 2, 3])),
        ("cube without half a side", meshes::cube().without(&[5])),
        ("one-sided sheet", meshes::sheet(3)),
        ("wavy sheet", meshes::sheet(8).mapped(|p| p + Vector3::new(0.0, 0.0, 0.3 * (4.0 * p.x).sin()))),
        ("soup", meshes::soup(60, 0.7, random)),
        ("fin", meshes::cube().and(meshes::sheet(2).moved(2.0, 0.0, 0.1))),
    ]
}

/// Cells of half a gap between numbers: a node is off by up to a cell along each axis. A lattice at the origin shows it: there each node
/// is where it should be.
#[test]
fn nodes_that_rounding_moves_by_a_cell_are_within_the_error_bound() {
    let far = 2.0_f64.powi(30);
    let gap = far * f64::EPSILON;
    let mesh = |x: f64| meshes::tetrahedron().scaled(32.0 * gap).moved(x, x, x).baked();
    let lattice = |x: f64| Lattice::new([x; 3], 0.5 * gap, [97; 3]).unwrap();
    let (far_mesh, near_mesh) = (mesh(far + 8.0 * gap), mesh(8.0 * gap));
    let grid = dense::bake(&MeshDistance::new(&far_mesh, None), &lattice(far), &|_| ());
    let distance = MeshDistance::new(&near_mesh, None);
    let nodes = (0..97_u32.pow(3)).map(|i| [i % 97, i / 97 % 97, i / 97 / 97]);
    let error = |node| {
        let exact = distance.signed_distance(lattice(0.0).node(node));
        (f64::from(grid.distances[lattice(0.0).index(node)]) - exact).abs()
    };
    let worst = nodes.map(error).fold(0.0, f64::max);
    assert!(worst > 1.5 * lattice(0.0).spacing(), "not moved by rounding");
    assert!(worst <= grid.error_bound, "off by {worst}, more than {}", grid.error_bound);
}

#[test]
fn the_interpolant_changes_no_faster_than_its_slope_bound() {
    let mut random = Random::from_env();
    for (name, mesh) in closed_meshes(&mut random).into_iter().chain(open_meshes(&mut random)) {
        let baked = Baked::from_mesh(&mesh, None, 12);
        let storage = Dense::new(&baked.lattice, &baked.grid.distances).unwrap();
        let field = Grid::new(baked.lattice, storage, baked.grid.slope_bound).unwrap();
        let bounds = baked.lattice.bounds().inflate(2.0 * baked.lattice.spacing());
        let rounding = F64_ROUNDING * largest_coordinate(&bounds);
        for _ in 0..20_000 {
            let from = random.point_in_box(bounds.min, bounds.max);
            let size = baked.lattice.spacing() * 10.0_f64.powf(random.between(-3.0, 1.0));
            let to = from + random.point_in_cube(size);
            let change = (field.value(to) - field.value(from)).abs();
            let max_change = baked.grid.slope_bound * (to - from).norm() + rounding * baked.grid.slope_bound;
            assert!(change <= max_change, "{name}: {change} > {max_change} from {from:?} to {to:?}");
        }
    }
}

fn largest_coordinate(bounds: &Aabb) -> f64 {
    bounds.min.iter().chain(&bounds.max).fold(0.0, |largest, x| largest.max(x.abs()))
}

#[test]
fn the_interpolant_of_a_closed_mesh_is_off_by_no_more_than_its_error_bound() {
    let mut random = Random::from_env();
    for (name, mesh) in closed_meshes(&mut random) {
        for cells in [3, 8, 20] {
            let baked = Baked::from_mesh(&mesh, None, cells);
            let worst = worst_error(name, &mesh, &baked, &mut random);
            // Along each axis a distance has slope one at most.
            assert!(baked.grid.slope_bound <= 1.000_01 * 3.0_f64.sqrt(), "{name}: {}", baked.grid.slope_bound);
            let half_diagonal = 0.75_f64.sqrt() * baked.lattice.spacing();
            assert!(baked.grid.error_bound <= 1.000_01 * half_diagonal, "{name}: the bound is too wide");
            println!("{name}: {:.2} of the bound", worst / baked.grid.error_bound);
        }
    }
}

#[test]
fn the_interpolant_of_an_open_mesh_is_off_by_no_more_than_its_error_bound() {
    let mut random = Random::from_env();
    for (name, mesh) in open_meshes(&mut random) {
        for cells in [3, 8, 20] {
            let baked = Baked::from_mesh(&mesh, None, cells);
            let worst = worst_error(name, &mesh, &baked, &mut random);
            println!("{name}: {:.2} of the bound", worst / baked.grid.error_bound);
        }
    }
}

/// Largest error at random points. Between corners of one sign, points of an open mesh have that sign.
fn worst_error(name: &str, mesh: &Mesh, baked: &Baked, random: &mut Random) -> f64 {
    let storage = Dense::new(&baked.lattice, &baked.grid.distances).unwrap();
    let field = Grid::new(baked.lattice, storage, baked.grid.slope_bound).unwrap();
    let corners = mesh.corners();
    let bounds = baked.lattice.bounds();
    let rounding = F64_ROUNDING * largest_coordinate(&bounds);
    let is_continuous = MeshDistance::new(&mesh.baked(), None).is_continuous();
    let coded = [Precision::U16, Precision::U8].map(|to| baked.grid.clone().into_grid_as(&baked.lattice, to));
    for coded in &coded {
        // A distance changes by 7 √3 spacings in a block, which the sign of an open mesh doubles at most.
        let most = 7.0 * 3.0_f64.sqrt() * baked.lattice.spacing() / 254.0;
        assert!(coded.error_bound <= baked.grid.error_bound * 1.01 + most, "{name}: {}", coded.error_bound);
    }
    let (mut worst, mut deepest_pocket) = (0.0_f64, 0.0_f64);
    for _ in 0..3000 {
        let point = random.point_in_box(bounds.min, bounds.max);
        let exact = oracle::signed_distance(&corners, point);
        let of_cell = oracle::with_sign_of_cell(exact, storage.corners(oracle::cell_of(&baked.lattice, point)));
        let is_in_pocket = !is_continuous && of_cell != exact;
        // Not proven: docs/error-bounds.md has what is known of pockets without a node.
        let depth = exact.abs() / baked.lattice.spacing();
        assert!(!is_in_pocket || depth < 3.0_f64.sqrt(), "{name}: a pocket {depth} voxels deep at {point:?}");
        deepest_pocket = if is_in_pocket { deepest_pocket.max(depth) } else { deepest_pocket };
        let exact = if is_in_pocket { of_cell } else { exact };
        let error = (field.value(point) - exact).abs();
        let bound = baked.grid.error_bound + rounding;
        assert!(error <= bound, "{name}: {error} > {bound} at {point:?}");
        for coded in &coded {
            let (error, bound) = ((coded.grid.value(point) - exact).abs(), coded.error_bound + rounding);
            assert!(error <= bound, "{name} in codes: {error} > {bound} at {point:?}");
        }
        worst = worst.max(error);
    }
    if deepest_pocket > 0.0 {
        println!("{name}: a pocket {deepest_pocket:.2} voxels deep");
    }
    worst
}

/// With pseudo-normals the sign jumps between the shells, where the inner shell is nearer and reports outside.
#[test]
fn pseudo_normals_requested_for_nested_shells_widen_the_error_bound() {
    let nested = meshes::icosphere(1).and(meshes::icosphere(1).scaled(0.6));
    let widened = Baked::from_mesh(&nested, Some(sdf_bake::SignMethod::PseudoNormal), 12);
    let proven = Baked::from_mesh(&nested, None, 12);
    let half_diagonal = 0.75_f64.sqrt() * proven.lattice.spacing();
    assert!(proven.grid.error_bound <= 1.000_01 * half_diagonal, "{}", proven.grid.error_bound);
    assert!(widened.grid.error_bound > 1.5 * half_diagonal, "{}", widened.grid.error_bound);
}
