//! Shells that cross, nest and touch: distances are those to the surface of the solid, signs stay as they were.

use sdf_bake::sparse::SparseGrid;
use sdf_bake::{MeshDistance, MeshSurface, SignMethod, TriangleMesh, dense, lattice_around, sparse};
use sdf_core::grid::sparse::Sparse;
use sdf_core::grid::{Dense, Storage};
use sdf_core::nalgebra::{Rotation3, Vector3};

use crate::meshes::{self, Mesh};
use crate::oracle;
use crate::random::Random;

/// A box between points of the lattice of whole numbers.
type Block = [[u32; 3]; 2];

/// Cells of the lattice along each axis.
const CELLS: u32 = 7;

pub fn random_block(random: &mut Random) -> Block {
    let mut block = [[0; 3]; 2];
    for axis in 0..3 {
        let low = random.below(CELLS as usize) as u32;
        let high = low + 1 + random.below(5) as u32;
        (block[0][axis], block[1][axis]) = (low, high.min(CELLS));
    }
    block
}

pub fn mesh_of(blocks: &[Block]) -> Mesh {
    let shell = |[low, high]: &Block| {
        let [low, high] = [low, high].map(|corner| Vector3::from(corner.map(f64::from)));
        meshes::cube().mapped(|p| low + p.map(|x| 0.5 * (x + 1.0)).component_mul(&(high - low)))
    };
    blocks.iter().map(shell).fold(Mesh::default(), Mesh::and)
}

/// The union of boxes by the cells that they hold, and the squares between these cells and the others.
struct Cells {
    blocks: Vec<Block>,
    /// First corner and normal axis.
    squares: Vec<(Vector3<f64>, usize)>,
}

impl Cells {
    fn new(blocks: &[Block]) -> Self {
        let holds = |cell: [i64; 3]| {
            let is_in = |[low, high]: &Block| {
                (0..3).all(|axis| (i64::from(low[axis])..i64::from(high[axis])).contains(&cell[axis]))
            };
            blocks.iter().any(is_in)
        };
        let mut squares = vec![];
        let range = || 0..=i64::from(CELLS);
        for x in range() {
            for y in range() {
                for z in range() {
                    for axis in 0..3 {
                        let mut before = [x, y, z];
                        before[axis] -= 1;
                        if holds([x, y, z]) != holds(before) {
                            squares.push((Vector3::new(x as f64, y as f64, z as f64), axis));
                        }
                    }
                }
            }
        }
        Self { blocks: blocks.to_vec(), squares }
    }

    fn signed_distance(&self, point: Vector3<f64>) -> f64 {
        let to_square = |(corner, axis): &(Vector3<f64>, usize)| {
            let high = corner + Vector3::from_fn(|a, _| if a == *axis { 0.0 } else { 1.0 });
            (point - point.sup(corner).inf(&high)).norm()
        };
        let distance = self.squares.iter().map(to_square).fold(f64::INFINITY, f64::min);
        let is_in = |[low, high]: &Block| {
            (0..3).all(|axis| f64::from(low[axis]) < point[axis] && point[axis] < f64::from(high[axis]))
        };
        if self.blocks.iter().any(is_in) { -distance } else { distance }
    }
}

/// Blocks no two of which have a side in one plane.
fn blocks_in_general_position(count: usize, random: &mut Random) -> Vec<Block> {
    let mut blocks = vec![[[0; 3]; 2]; count];
    for axis in 0..3 {
        let mut planes: Vec<u32> = (0..2 * count as u32).collect();
        for block in &mut blocks {
            let [a, b] = [0; 2].map(|_| planes.swap_remove(random.below(planes.len())));
            (block[0][axis], block[1][axis]) = (a.min(b), a.max(b));
        }
    }
    blocks
}

/// Blocks that share parts of faces, edges and corners more often than not, and blocks that do not, turned.
#[test]
fn overlapping_blocks_have_the_distances_of_the_union_of_their_cells() {
    let mut random = Random::from_env();
    let mut dropped = [[0; 2]; 2];
    for round in 0..150 {
        let is_turned = round % 2 == 1;
        let blocks = if is_turned {
            blocks_in_general_position(2 + random.below(3), &mut random)
        } else {
            (0..2 + random.below(5)).map(|_| random_block(&mut random)).collect()
        };
        let cells = Cells::new(&blocks);
        let turn = if is_turned { random.rotation() } else { Rotation3::identity() };
        let mesh = mesh_of(&blocks).turned(&turn).baked().without_inner_faces();
        dropped[round % 2][0] += mesh.report().dropped_pieces;
        dropped[round % 2][1] += mesh.report().inner_triangles;
        // Turned, the halves of a side are no more in one plane: slivers lie between the lines in which they cross others.
        assert!(is_turned || mesh.report().uncertain_pieces == 0, "round {round}");
        let distance = MeshDistance::new(&mesh, None);
        for _ in 0..100 {
            let point = random.point_in_box([-2.0; 3], [f64::from(CELLS) + 2.0; 3]);
            let exact = cells.signed_distance(point);
            let found = distance.signed_distance((turn * point).into());
            assert!((found - exact).abs() < 1e-12, "round {round}: {found} for {exact} at {point:?} of {blocks:?}");
        }
    }
    assert!(dropped.iter().flatten().all(|count| *count > 50), "{dropped:?}");
}

/// Blocks that have a whole face in common, of the same triangles: without its copies, all but one are open there.
#[test]
fn blocks_on_one_base_have_the_distances_of_the_union_of_their_cells() {
    let mut random = Random::from_env();
    for round in 0..60 {
        let [low, high] = random_block(&mut random);
        let axis = random.below(3);
        let heights = 1 + random.below(4) as u32;
        let blocks: Vec<Block> = (low[axis] + 1..=(low[axis] + 1 + heights).min(CELLS))
            .map(|top| [low, std::array::from_fn(|a| if a == axis { top } else { high[a] })])
            .collect();
        let cells = Cells::new(&blocks);
        // Mirrored, they stand on their other end.
        let mirror = |p: Vector3<f64>| if round % 2 == 0 { p } else { p.map(|x| f64::from(CELLS) - x) };
        let mut mesh = mesh_of(&blocks).mapped(mirror);
        if round % 2 == 1 {
            mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        let mesh = mesh.baked().without_inner_faces();
        let distance = MeshDistance::new(&mesh, None);
        for _ in 0..100 {
            let point = random.point_in_box([-2.0; 3], [f64::from(CELLS) + 2.0; 3]);
            let (exact, found) = (cells.signed_distance(point), distance.signed_distance(mirror(point).into()));
            assert!((found - exact).abs() < 1e-12, "round {round}: {found} for {exact} at {point:?} of {blocks:?}");
        }
    }
}

/// Blocks of unit squares, which share parts of their sides square by square: some wound alike, others back to back.
#[test]
fn blocks_that_share_squares_have_the_distances_of_the_union_of_their_cells() {
    let mut random = Random::from_env();
    let mut doubled = 0;
    for round in 0..100 {
        let blocks: Vec<Block> = (0..2 + random.below(3)).map(|_| random_block(&mut random)).collect();
        let hull = |[low, high]: &Block| {
            let along = |axis: usize| low[axis] as i32..high[axis] as i32;
            let columns = along(0).flat_map(|x| along(1).map(move |y| (x, y)));
            meshes::voxel_hull(&columns.flat_map(|(x, y)| along(2).map(move |z| [x, y, z])).collect::<Vec<_>>())
        };
        let mesh = blocks.iter().map(hull).fold(Mesh::default(), Mesh::and).baked();
        let inner = mesh.clone().without_inner_faces();
        let (cells, distance) = (Cells::new(&blocks), MeshDistance::new(&inner, None));
        doubled += MeshDistance::new(&mesh, None).topology().doubled;
        assert!(distance.is_continuous(), "round {round}: {blocks:?}");
        for _ in 0..60 {
            let point = random.point_in_box([-2.0; 3], [f64::from(CELLS) + 2.0; 3]);
            let (exact, found) = (cells.signed_distance(point), distance.signed_distance(point.into()));
            assert!((found - exact).abs() < 1e-12, "round {round}: {found} for {exact} at {point:?} of {blocks:?}");
        }
    }
    assert!(doubled > 100, "{doubled}");
}

#[test]
fn two_crossing_cubes_are_one_solid() {
    let mesh = meshes::cube().and(meshes::cube().moved(1.0, 0.5, 0.25)).baked().without_inner_faces();
    let report = mesh.report();
    assert_eq!((report.entangled_shells, report.crossing_triangles, report.uncertain_pieces), (0, 12, 0));
    assert!(report.dropped_pieces > 0 && !report.has_too_many_crossings, "{report:?}");
    let distance = MeshDistance::new(&mesh, None);
    assert_eq!(distance.sign_reason(), "winding: 2 shells");
    assert_eq!(distance.signed_distance([1.0, 0.25, 0.0]), -0.75);
    assert!(distance.is_continuous());
}

/// A tube around a figure eight, which passes through itself in the middle.
fn figure_eight(around: u32, across: u32) -> Mesh {
    let path = |t: f64| Vector3::new(2.0 * t.sin(), 2.0 * t.sin() * t.cos(), 0.0);
    let mut tube = meshes::torus(1.0, 0.3, around, across);
    for point in &mut tube.points {
        let t = point.y.atan2(point.x);
        let from_path = point.xy().norm() - 1.0;
        let along = Vector3::new(2.0 * t.cos(), 2.0 * (2.0 * t).cos(), 0.0).normalize();
        *point = path(t) + Vector3::new(along.y, -along.x, 0.0) * from_path + Vector3::new(0.0, 0.0, point.z);
    }
    tube
}

pub fn random_part(random: &mut Random) -> Mesh {
    let part = match random.below(6) {
        0 => meshes::cube().scaled(0.8),
        1 => meshes::icosphere(2),
        2 => meshes::torus(0.9, 0.35, 16, 9),
        3 => meshes::l_solid().moved(-0.5, -0.5, -0.5),
        4 => meshes::tetrahedron().moved(-0.25, -0.25, -0.25).scaled(2.5),
        _ => figure_eight(24, 8).scaled(0.5),
    };
    let part = part.turned(&random.rotation()).scaled(10.0_f64.powf(random.between(-0.7, 0.1)));
    let [x, y, z] = random.point_in_cube(0.9).into();
    let part = if random.below(5) == 0 { part.flipped() } else { part };
    part.moved(x, y, z)
}

/// Points of the surface of the solid: points of all triangles with one side inside.
pub fn samples_of_surface(all: &[[Vector3<f64>; 3]], random: &mut Random, count: usize) -> Vec<Vector3<f64>> {
    let mut samples = vec![];
    for _ in 0..count {
        let corners = all[random.below(all.len())];
        let point = point_on(corners, random);
        if is_on_surface(all, point, normal(corners)) {
            samples.push(point);
        }
    }
    samples
}

fn normal([a, b, c]: [Vector3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a)).normalize()
}

fn point_on([a, b, c]: [Vector3<f64>; 3], random: &mut Random) -> Vector3<f64> {
    let (u, v) = (random.between(0.0, 1.0), random.between(0.0, 1.0));
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    a + (b - a) * u + (c - a) * v
}

fn is_on_surface(all: &[[Vector3<f64>; 3]], point: Vector3<f64>, normal: Vector3<f64>) -> bool {
    let [front, back] = [1e-7, -1e-7].map(|step| oracle::winding_number(all, point + normal * step).abs() >= 0.5);
    front != back
}

/// The distance found is neither too small, for it ends at the surface of the solid, nor too large, for no sample of that
/// surface is nearer; outside it is the least of the distances to the parts.
#[test]
fn crossing_shells_have_the_distances_of_the_surface_of_their_solid() {
    let mut random = Random::from_env();
    let (mut inside, mut deeper, mut dropped) = (0, 0, 0);
    for round in 0..40 {
        let parts: Vec<Mesh> = (0..1 + random.below(4)).map(|_| random_part(&mut random)).collect();
        let mesh = parts.iter().cloned().fold(Mesh::default(), Mesh::and);
        let mesh = if parts.len() == 1 { figure_eight(24, 9).turned(&random.rotation()) } else { mesh };
        let all = mesh.corners();
        let baked = mesh.baked().without_inner_faces();
        assert!(!baked.report().has_too_many_crossings);
        dropped += baked.report().dropped_pieces;
        let distance = MeshDistance::new(&baked, None);
        let is_continuous = distance.is_continuous();
        assert!(is_continuous, "round {round}: {}", distance.sign_reason());
        let surface = MeshSurface::new(baked.clone(), distance.sign_method(), is_continuous);
        let samples = samples_of_surface(&all, &mut random, 300);
        for _ in 0..60 {
            let point = random.point_in_cube(1.4);
            let found = distance.signed_distance(point.into());
            let is_inside = oracle::winding_number(&all, point).abs() >= 0.5;
            assert_eq!(found < 0.0, is_inside, "round {round}: {found} at {point:?}");
            let to_all = oracle::distance(&all, point);
            let nearest_sample = samples.iter().map(|sample| (sample - point).norm()).fold(f64::INFINITY, f64::min);
            assert!(
                found.abs() <= nearest_sample + 1e-9,
                "round {round}: {found} beyond {nearest_sample} at {point:?}"
            );
            let nearest = surface.nearest(point, 0, None);
            assert_eq!(nearest.distance, found, "round {round}");
            if is_inside {
                (inside, deeper) = (inside + 1, deeper + usize::from(found < -to_all - 1e-9));
                assert!(found <= -to_all + 1e-12, "round {round}: {found} for {to_all} at {point:?}");
                // Where it ends, the solid ends: not all directions from there lead inside.
                let ahead = (nearest.point - point).normalize();
                let mut directions = std::iter::once(ahead).chain((0..400).map(|_| random.point_in_cube(1.0)));
                let is_out = |direction: Vector3<f64>| {
                    oracle::winding_number(&all, nearest.point + direction * 1e-6).abs() < 0.5
                };
                assert!(directions.any(is_out), "round {round}: {found} ends inside at {point:?}");
            } else {
                assert!((found - to_all).abs() < 1e-12, "round {round}: {found} for {to_all} at {point:?}");
            }
        }
    }
    assert!(inside > 200 && deeper > 25 && dropped > 1300, "{inside} {deeper} {dropped}");
}

fn crossing_solid(turn: &Rotation3<f64>) -> Mesh {
    let nested = meshes::cube().scaled(0.3).moved(0.2, 0.1, 0.0);
    meshes::icosphere(3).and(meshes::cube().scaled(0.7).moved(0.6, 0.5, 0.0)).and(nested).turned(turn)
}

/// Dense and sparse grids of shells that cross hold the distances of the solid's surface, within their own bounds.
#[test]
fn grids_of_crossing_shells_keep_within_their_bounds() {
    let mut random = Random::from_env();
    let mesh = crossing_solid(&random.rotation()).baked().without_inner_faces();
    let distance = MeshDistance::new(&mesh, None);
    let spacing = mesh.bounds().longest_side() / 40.0;
    let lattice = lattice_around(&mesh.bounds(), spacing, 3).unwrap();
    let band = 3.0 * spacing;
    let dense = dense::bake(&distance, &lattice, &|_| ());
    for (node, value) in oracle::nodes(&lattice, &dense.distances) {
        let exact = distance.signed_distance(node.into());
        assert!((value - exact).abs() < 1e-6, "{value} for {exact} at {node:?}");
    }
    let grid: SparseGrid<u16> = sparse::bake(&distance, &lattice, band, &|_| ()).unwrap();
    let storage = Sparse::new(&lattice, &grid).unwrap();
    let dense_storage = Dense::new(&lattice, &dense.distances[..]).unwrap();
    let mut tested = 0;
    for _ in 0..4000 {
        let bounds = mesh.bounds();
        let point = random.point_in_box(bounds.min, bounds.max);
        let exact = distance.signed_distance(point.into());
        let cell = std::array::from_fn(|axis| ((point[axis] - lattice.origin()[axis]) / spacing) as u32);
        let value = |corners: [f64; 8]| {
            let t = [0, 1, 2].map(|axis| (point[axis] - lattice.origin()[axis]) / spacing - f64::from(cell[axis]));
            let weight = |corner: usize, axis: usize| if corner >> axis & 1 == 1 { t[axis] } else { 1.0 - t[axis] };
            (0..8).map(|corner| (0..3).map(|axis| weight(corner, axis)).product::<f64>() * corners[corner]).sum::<f64>()
        };
        let error = (value(dense_storage.corners(cell).map(f64::from)) - exact).abs();
        assert!(error <= dense.error_bound, "{error} beyond {} at {point:?}", dense.error_bound);
        if exact.abs() < band {
            let error = (value(storage.corners(cell).map(f64::from)) - exact).abs();
            assert!(error <= grid.error_bound, "{error} beyond {} at {point:?}", grid.error_bound);
            tested += 1;
        }
    }
    assert!(tested > 500, "{tested}");
}

/// Meshes of which nothing is inside stay as they were, bit for bit.
#[test]
fn a_mesh_without_inner_faces_bakes_to_the_same_bytes() {
    let mut random = Random::from_env();
    let turn = random.rotation();
    let [apart, touching] = [5.0, 2.0].map(|x| meshes::cube().and(meshes::cube().moved(x, 0.3, 0.2)));
    let open = meshes::cube().and(meshes::cube().moved(1.0, 0.5, 0.3)).without(&[0]);
    let cavity = meshes::cube().and(meshes::cube().scaled(0.5).flipped());
    let meshes = [
        ("sphere", meshes::icosphere(2).turned(&turn)),
        ("star", meshes::star(2, 4, 1.5)),
        ("apart", apart.turned(&turn)),
        ("cavity", cavity),
        ("open", open),
        ("strip", meshes::moebius_strip(20)),
        ("soup", meshes::soup(40, 0.5, &mut random)),
    ];
    let dense_bytes = |mesh: &TriangleMesh| {
        let lattice = lattice_around(&mesh.bounds(), mesh.bounds().longest_side() / 12.0, 2).unwrap();
        let grid = dense::bake(&MeshDistance::new(mesh, None), &lattice, &|_| ());
        (grid.distances.iter().map(|x| x.to_bits()).collect::<Vec<_>>(), grid.error_bound.to_bits())
    };
    for (name, mesh) in meshes {
        let before = mesh.baked().without_inner_shells();
        let after = mesh.baked().without_inner_faces();
        assert_eq!(before.report(), after.report(), "{name}");
        assert_eq!(dense_bytes(&before), dense_bytes(&after), "{name}");
    }
    // Of cubes that touch in part of a face, that part is inside.
    let touching = touching.baked().without_inner_faces();
    assert!(touching.report().dropped_pieces > 0, "{:?}", touching.report());
    assert_eq!(MeshDistance::new(&touching, Some(SignMethod::PseudoNormal)).sign_method(), SignMethod::Winding);
}

/// Each of many needles crosses most of the others: so many pairs are not divided, and it is said.
#[test]
fn too_many_crossings_are_kept_and_said() {
    let mut random = Random::from_env();
    let needle = |random: &mut Random| meshes::block([1.0, 1e-3, 1e-3]).turned(&random.rotation());
    let mesh = (0..300).map(|_| needle(&mut random)).fold(Mesh::default(), Mesh::and);
    let flat = mesh.mapped(|p| Vector3::new(p.x, p.y, 1e-3 * p.z)).baked();
    let kept = flat.clone().without_inner_faces();
    assert!(kept.report().has_too_many_crossings, "{:?}", kept.report());
    assert_eq!(kept.triangle_count(), flat.triangle_count());
}

/// Most of the mesh lies within the rounding of a far corner, so that each ray comes near to most of it and touches an edge.
#[test]
fn a_far_corner_does_not_make_rays_go_on_for_long() {
    let mut random = Random::from_env();
    let mut far = meshes::icosphere(4);
    for _ in 0..20 {
        let corner = random.below(far.points.len());
        far.points[corner] = random.point_in_cube(1.0) * 10.0_f64.powf(random.between(10.0, 29.0));
    }
    let mesh = far.baked().without_inner_faces();
    assert!(mesh.report().has_too_many_crossings, "{:?}", mesh.report());
    assert_eq!(mesh.triangle_count(), far.triangles.len());
}
