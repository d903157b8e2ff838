//! A grid read in part has the values of the whole grid there, and reading it costs what the part does.

use std::fs;
use std::time::Instant;

use sdf_core::contact::{Element, Outcome, contact};
use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{OwnedGrid, Precision};
use sdf_core::minimize::ProjectedGradient;
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, EnclosedSdf, Float, Sdf, Simplex};
use sdf_formats::grid_file::{self};
use tempfile::TempDir;

use crate::grid_samples::{DENSE, KINDS, Kind, Made, SPARSE_U16, about};
use crate::random::Random;

fn fraction(random: &mut Random) -> f64 {
    random.below(1 << 30) as f64 / (1 << 30) as f64
}

/// A box inside the grid, across its faces, or outside.
fn region(random: &mut Random, lattice: &Lattice) -> Aabb {
    let bounds = lattice.bounds();
    let size = [0.0, 0.02, 0.2, 1.0][random.below(4)];
    let margin = 2.5 * f64::from(random.below(2) as u32);
    let corner: [f64; 3] = std::array::from_fn(|k| {
        let (middle, half) = ((bounds.min[k] + bounds.max[k]) / 2.0, bounds.extents()[k] / 2.0 + margin);
        middle + half * (2.0 * fraction(random) - 1.0)
    });
    Aabb { min: corner, max: corner.map(|x| x + size * 4.0 * fraction(random)) }
}

fn is_same<R: Float>(whole: &OwnedGrid, part: &OwnedGrid, point: [f64; 3]) -> bool {
    let point = Vector3::from(point).map(R::from_f64);
    let answer = |grid: &OwnedGrid| {
        let sample = grid.sample(point);
        let numbers = [sample.value, sample.gradient.x, sample.gradient.y, sample.gradient.z];
        (numbers.map(|x| x.to_f64().to_bits()), sample.status)
    };
    answer(whole) == answer(part)
}

#[test]
fn a_part_has_the_values_of_the_whole() {
    let mut random = Random::from_clock();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let mut saved = 0;
    for (kind, nodes) in KINDS.into_iter().flat_map(|kind| [(kind, [120, 111, 100]), (kind, [70, 64, 90])]) {
        let made = Made::new(nodes, kind);
        made.write(&path);
        let whole = grid_file::read(&path).unwrap();
        for _ in 0..25 {
            let regions: Vec<Aabb> = (0..1 + random.below(3)).map(|_| region(&mut random, &made.lattice)).collect();
            let part = grid_file::open(&path).unwrap().read_needed(regions.clone(), f64::MAX).unwrap();
            assert!(part.read.blocks <= part.read.total_blocks && part.read.total_blocks == whole.read.total_blocks);
            saved += usize::from(part.read.blocks < whole.read.blocks);
            assert!(part.read.bytes <= whole.read.bytes);
            assert_eq!(part.read.blocks == part.read.total_blocks, part.read.bytes == whole.read.bytes);
            for region in &regions {
                for _ in 0..200 {
                    let position = |k: usize, t: f64| region.min[k] + region.extents()[k] * t;
                    let mut fractions = [0, 1, 2].map(|_| fraction(&mut random));
                    if random.below(4) == 0 {
                        fractions = fractions.map(f64::round);
                    }
                    let point = std::array::from_fn(|k| position(k, fractions[k]));
                    assert!(is_same::<f64>(&whole.grid, &part.grid, point), "{kind:?} {region:?} {point:?}");
                    assert!(is_same::<f32>(&whole.grid, &part.grid, point), "{kind:?} {region:?} {point:?}");
                }
                assert_eq!(whole.grid.enclose_box(region), part.grid.enclose_box(region));
            }
        }
    }
    assert!(saved > 50, "only {saved} were parts");
}

/// Points of f32 on nodes, which rounding may move into either cell; and a grid so far from the origin that rounding
/// moves them by cells.
#[test]
fn a_part_has_the_values_of_the_whole_where_f32_rounds() {
    let mut random = Random::from_clock();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    for (kind, offset) in KINDS.into_iter().flat_map(|kind| [(kind, 0.0), (kind, 4e5)]) {
        let mut made = Made::new([120, 111, 100], kind);
        let origin = made.lattice.origin().map(|x| x + offset);
        made.lattice = Lattice::new(origin, made.lattice.spacing(), made.lattice.nodes()).unwrap();
        made.write(&path);
        let whole = grid_file::read(&path).unwrap();
        for _ in 0..100 {
            let node = made.lattice.nodes().map(|n| 8 * random.below(n as usize / 8 + 1) as u32);
            let point = made.lattice.node(node).map(|x| f64::from(x as f32));
            let region = Aabb { min: point, max: point };
            let part = grid_file::open(&path).unwrap().read_needed([region], f64::MAX).unwrap();
            assert!(is_same::<f32>(&whole.grid, &part.grid, point), "{kind:?} {node:?}");
            assert!(is_same::<f64>(&whole.grid, &part.grid, point), "{kind:?} {node:?}");
        }
    }
}

/// Boxes anywhere have bounds that hold, as if nodes that were not read had any value.
#[test]
fn bounds_of_a_part_hold_everywhere() {
    let mut random = Random::from_clock();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let mut unknown = 0;
    for kind in KINDS {
        let made = Made::new([300, 111, 100], kind);
        made.write(&path);
        let whole = grid_file::read(&path).unwrap().grid;
        let spot = region(&mut random, &made.lattice).min;
        let near = Aabb { min: spot, max: spot.map(|x| x + 0.01) };
        let part = grid_file::open(&path).unwrap().read_needed([near], f64::MAX).unwrap().grid;
        for _ in 0..300 {
            let corner = region(&mut random, &made.lattice).min;
            let place = Aabb { min: corner, max: corner.map(|x| x + 0.1 * fraction(&mut random)) };
            let [(least, most), (lower, upper)] = [&whole, &part].map(|grid| {
                let range = grid.enclose_box(&place).range;
                (range.lower, range.upper)
            });
            assert!(lower <= least && most <= upper, "{kind:?} {place:?}: {lower}..{upper} for {least}..{most}");
            unknown += usize::from(lower < least);
        }
    }
    println!("{unknown} boxes were not read");
    assert!(unknown > 100, "all was read");
}

/// The search does not evaluate the field where nothing was read.
#[test]
fn contacts_with_a_part_are_those_with_the_whole() {
    let mut random = Random::from_clock();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let (mut found, mut culled, mut saved) = (0, 0, 0);
    for (kind, margin) in KINDS.into_iter().flat_map(|kind| [-0.1_f32, 0.0, 0.15].map(|margin| (kind, margin))) {
        let made = Made::new([120, 111, 100], kind);
        made.write(&path);
        let whole = grid_file::read(&path).unwrap();
        let corner = |random: &mut Random| region(random, &made.lattice).min.map(|x| x as f32);
        for _ in 0..10 {
            let near = corner(&mut random);
            let elements: Vec<Element<f32, 3>> = (0..100)
                .map(|id| {
                    let near = near.map(|x| x + fraction(&mut random) as f32 - 0.5);
                    let corners =
                        [0, 1, 2].map(|_| Vector3::from(near).map(|x| x + 0.1 * fraction(&mut random) as f32));
                    Element { id, vertices: [0, 1, 2], simplex: Simplex { corners } }
                })
                .collect();
            let regions = elements.iter().map(|element| element.simplex.bounds());
            let part = grid_file::open(&path).unwrap().read_needed(regions, margin.into()).unwrap();
            saved += part.read.total_blocks - part.read.blocks;
            for element in &elements {
                let minimizer = ProjectedGradient::default();
                let outcome = contact(&part.grid, &minimizer, margin, element);
                assert_eq!(outcome, contact(&whole.grid, &minimizer, margin, element), "{kind:?} {element:?}");
                found += usize::from(matches!(outcome, Outcome::Contact(_)));
                culled += usize::from(outcome == Outcome::Culled);
            }
        }
    }
    println!("{found} contacts, {culled} culled, {saved} blocks saved");
    assert!(found > 500 && culled > 500 && saved > 1000);
}

#[test]
fn a_small_region_costs_little() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    for kind in KINDS {
        let made = Made::new([160, 160, 160], kind);
        made.write(&path);
        let all = grid_file::read(&path).unwrap().read;
        let spot = [1.5, 0.03, 0.01];
        let region = Aabb { min: spot, max: spot.map(|x| x + 0.01) };
        let part = grid_file::open(&path).unwrap().read_needed([region], 1.0).unwrap().read;
        // At most eight chunks: of 32 bricks each, or of the 5 × 5 × 5 chunks of nodes.
        let max = if kind == DENSE { 8 } else { 8 * 32 };
        assert!(0 < part.blocks && part.blocks <= max && part.blocks < part.total_blocks / 4, "{part:?}");
        assert!(part.bytes < all.bytes / 2, "{part:?} of {all:?}");
        let none = grid_file::open(&path).unwrap().read_needed([region], -1.0).unwrap().read;
        assert_eq!(none.blocks, 0);
        assert!(none.bytes < part.bytes);
        println!("{kind:?}: {part:?} of {} bytes, {none:?}", fs::metadata(&path).unwrap().len());
    }
}

/// Counted one by one: the chunks of the nodes around the regions, and of one more node to each side.
#[test]
fn no_chunk_is_read_that_is_not_needed() {
    // Nodes of a chunk along x, y and z.
    const SIDES: [u32; 3] = [32, 16, 16];
    let mut random = Random::from_clock();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    for nodes in [[120, 111, 100], [20, 70, 100], [100, 70, 20], [33, 2, 97]] {
        let made = Made::new(nodes, DENSE);
        made.write(&path);
        for _ in 0..50 {
            let regions: Vec<Aabb> = (0..random.below(4)).map(|_| region(&mut random, &made.lattice)).collect();
            let is_needed = |chunk: [u32; 3]| {
                regions.iter().any(|region| {
                    let [first, last] = made.lattice.nodes_around(region).unwrap();
                    (0..3).all(|k| {
                        let side = SIDES[k];
                        let last = (last[k] + 3).min(nodes[k] - 1);
                        first[k].saturating_sub(3) / side <= chunk[k] && chunk[k] <= last / side
                    })
                })
            };
            let [nx, ny, nz] = std::array::from_fn(|k| nodes[k].div_ceil(SIDES[k]));
            let chunks = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
            let expected = chunks.filter(|chunk| is_needed(*chunk)).count();
            let part = grid_file::open(&path).unwrap().read_needed(regions.clone(), f64::MAX).unwrap();
            assert_eq!(part.read.blocks, expected, "{nodes:?} {regions:?}");
        }
    }
}

#[test]
fn a_region_that_is_not_a_box_needs_everything() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    for kind in [DENSE, Kind::Dense(Precision::U16), Kind::Sparse(Precision::U8)] {
        let made = Made::new([70, 64, 90], kind);
        made.write(&path);
        let read = |region: Aabb| grid_file::open(&path).unwrap().read_needed([region], -1e9).unwrap();
        let valid = Aabb { min: [0.0; 3], max: [1.0; 3] };
        let (mut nan, mut empty) = (valid, valid);
        nan.min[1] = f64::NAN;
        empty.max[2] = -1.0;
        for region in [Aabb::EVERYWHERE, nan, empty] {
            let stored = read(region);
            assert_eq!(stored.read.blocks, stored.read.total_blocks);
            assert!(stored.grid == made.grid() && stored.about == about());
        }
        assert_eq!(read(valid).read.blocks, 0);
    }
    // Also after a box that takes up all of a small grid and needs nothing of it.
    let made = Made::new([20, 20, 20], DENSE);
    made.write(&path);
    let whole = made.lattice.bounds();
    let not_a_box = Aabb { min: [f64::NAN; 3], ..whole };
    let stored = grid_file::open(&path).unwrap().read_needed([whole, not_a_box], -1e9).unwrap();
    assert_eq!(stored.read.blocks, stored.read.total_blocks);
}

#[test]
fn a_million_regions_of_any_size_take_no_time() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    Made::new([160, 160, 160], SPARSE_U16).write(&path);
    let whole = Aabb { min: [-9.0; 3], max: [9.0; 3] };
    let started = Instant::now();
    let regions = std::iter::repeat_n(whole, 1_000_000);
    let stored = grid_file::open(&path).unwrap().read_needed(regions, 0.0).unwrap();
    assert_eq!(stored.read.blocks, stored.read.total_blocks);
    assert!(started.elapsed().as_secs() < 20, "{:?}", started.elapsed());
}
