//! A grid of which only a part was read answers there as the whole does, and reading it costs what the part does.

mod grid_samples;

use std::fs;
use std::time::Instant;

use grid_samples::{KINDS, Made, Random, about};
use sdf_core::contact::{Element, Outcome, contact};
use sdf_core::grid::Lattice;
use sdf_core::minimize::ProjectedGradient;
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, EnclosedSdf, Float, Sdf, Simplex};
use sdf_formats::grid_file::{self, OwnedGrid, Precision};
use tempfile::TempDir;

fn share(random: &mut Random) -> f64 {
    random.below(1 << 30) as f64 / (1 << 30) as f64
}

/// Some within the grid, some across its faces, some outside.
fn region(random: &mut Random, lattice: &Lattice) -> Aabb {
    let bounds = lattice.bounds();
    let size = [0.0, 0.02, 0.2, 1.0][random.below(4)];
    let around = 2.5 * f64::from(random.below(2) as u32);
    let corner: [f64; 3] = std::array::from_fn(|k| {
        let (middle, half) = ((bounds.min[k] + bounds.max[k]) / 2.0, bounds.extents()[k] / 2.0 + around);
        middle + half * (2.0 * share(random) - 1.0)
    });
    Aabb { min: corner, max: corner.map(|x| x + size * 4.0 * share(random)) }
}

fn same<R: Float>(whole: &OwnedGrid, part: &OwnedGrid, point: [f64; 3]) -> bool {
    let point = Vector3::from(point).map(R::from_f64);
    let answer = |grid: &OwnedGrid| {
        let sample = grid.sample(point);
        let numbers = [sample.value, sample.gradient.x, sample.gradient.y, sample.gradient.z];
        (numbers.map(|x| x.to_f64().to_bits()), sample.status)
    };
    answer(whole) == answer(part)
}

#[test]
fn a_part_answers_as_the_whole() {
    let mut random = Random::told();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let mut saved = 0;
    for (kind, nodes) in KINDS.into_iter().flat_map(|kind| [(kind, [120, 111, 100]), (kind, [70, 64, 90])]) {
        let made = Made::new(nodes, kind);
        made.write(&path);
        let whole = grid_file::read(&path).unwrap();
        for _ in 0..25 {
            let regions: Vec<Aabb> = (0..1 + random.below(3)).map(|_| region(&mut random, &made.lattice)).collect();
            let part = grid_file::open(&path).unwrap().read_reached(regions.clone(), f64::MAX).unwrap();
            assert!(part.read.blocks <= part.read.of_blocks && part.read.of_blocks == whole.read.of_blocks);
            saved += usize::from(part.read.blocks < whole.read.blocks);
            assert!(part.read.bytes <= whole.read.bytes);
            assert_eq!(part.read.blocks == part.read.of_blocks, part.read.bytes == whole.read.bytes);
            for region in &regions {
                for _ in 0..200 {
                    let at = |k: usize, share: f64| region.min[k] + region.extents()[k] * share;
                    let mut shares = [0, 1, 2].map(|_| share(&mut random));
                    if random.below(4) == 0 {
                        shares = shares.map(f64::round);
                    }
                    let point = std::array::from_fn(|k| at(k, shares[k]));
                    assert!(same::<f64>(&whole.grid, &part.grid, point), "{kind:?} {region:?} {point:?}");
                    assert!(same::<f32>(&whole.grid, &part.grid, point), "{kind:?} {region:?} {point:?}");
                }
                assert_eq!(whole.grid.enclose_box(region), part.grid.enclose_box(region));
            }
        }
    }
    assert!(saved > 50, "only {saved} were parts");
}

/// Points of f32 on nodes, which rounding may find in either cell; and a grid so far off that it may find them cells away.
#[test]
fn a_part_answers_as_the_whole_where_f32_rounds() {
    let mut random = Random::told();
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
            let part = grid_file::open(&path).unwrap().read_reached([region], f64::MAX).unwrap();
            assert!(same::<f32>(&whole.grid, &part.grid, point), "{kind:?} {node:?}");
            assert!(same::<f64>(&whole.grid, &part.grid, point), "{kind:?} {node:?}");
        }
    }
}

/// The field is then not asked where nothing was read.
#[test]
fn contacts_with_a_part_are_those_with_the_whole() {
    let mut random = Random::told();
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
                    let near = near.map(|x| x + share(&mut random) as f32 - 0.5);
                    let corners = [0, 1, 2].map(|_| Vector3::from(near).map(|x| x + 0.1 * share(&mut random) as f32));
                    Element { id, vertices: [0, 1, 2], simplex: Simplex { corners } }
                })
                .collect();
            let regions = elements.iter().map(|element| element.simplex.bounds());
            let part = grid_file::open(&path).unwrap().read_reached(regions, margin.into()).unwrap();
            saved += part.read.of_blocks - part.read.blocks;
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
        let part = grid_file::open(&path).unwrap().read_reached([region], 1.0).unwrap().read;
        // Of 32 bricks a chunk, of 5 × 5 × 5 chunks of nodes at most eight.
        let most = if kind.is_some() { 8 * 32 } else { 8 };
        assert!(0 < part.blocks && part.blocks <= most && part.blocks < part.of_blocks / 4, "{part:?}");
        assert!(part.bytes < all.bytes / 2, "{part:?} of {all:?}");
        let none = grid_file::open(&path).unwrap().read_reached([region], -1.0).unwrap().read;
        assert_eq!(none.blocks, 0);
        assert!(none.bytes < part.bytes);
        println!("{kind:?}: {part:?} of {} bytes, {none:?}", fs::metadata(&path).unwrap().len());
    }
}

/// Counted one by one: the chunks of the nodes around the regions, one more to each side.
#[test]
fn no_chunk_is_read_that_is_not_reached() {
    let mut random = Random::told();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    for nodes in [[120, 111, 100], [20, 70, 100], [100, 70, 20], [33, 2, 97]] {
        let made = Made::new(nodes, None);
        made.write(&path);
        for _ in 0..50 {
            let regions: Vec<Aabb> = (0..random.below(4)).map(|_| region(&mut random, &made.lattice)).collect();
            let reached = |chunk: [u32; 3]| {
                regions.iter().any(|region| {
                    let [first, last] = made.lattice.nodes_around(region).unwrap();
                    (0..3).all(|k| {
                        first[k].saturating_sub(1) / 32 <= chunk[k] && chunk[k] <= (last[k] + 1).min(nodes[k] - 1) / 32
                    })
                })
            };
            let [nx, ny, nz] = nodes.map(|n| n.div_ceil(32));
            let chunks = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
            let expected = chunks.filter(|chunk| reached(*chunk)).count();
            let part = grid_file::open(&path).unwrap().read_reached(regions.clone(), f64::MAX).unwrap();
            assert_eq!(part.read.blocks, expected, "{nodes:?} {regions:?}");
        }
    }
}

#[test]
fn what_is_no_box_reaches_everything() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    for kind in [None, Some(Precision::U8)] {
        let made = Made::new([70, 64, 90], kind);
        made.write(&path);
        let read = |region: Aabb| grid_file::open(&path).unwrap().read_reached([region], -1e9).unwrap();
        let sound = Aabb { min: [0.0; 3], max: [1.0; 3] };
        let (mut nan, mut turned) = (sound, sound);
        nan.min[1] = f64::NAN;
        turned.max[2] = -1.0;
        for region in [Aabb::EVERYWHERE, nan, turned] {
            let stored = read(region);
            assert_eq!(stored.read.blocks, stored.read.of_blocks);
            assert!(stored.grid == made.grid() && stored.about == about());
        }
        assert_eq!(read(sound).read.blocks, 0);
    }
}

#[test]
fn a_million_regions_of_any_size_take_no_time() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    Made::new([160, 160, 160], Some(Precision::U16)).write(&path);
    let whole = Aabb { min: [-9.0; 3], max: [9.0; 3] };
    let started = Instant::now();
    let regions = std::iter::repeat_n(whole, 1_000_000);
    let stored = grid_file::open(&path).unwrap().read_reached(regions, 0.0).unwrap();
    assert_eq!(stored.read.blocks, stored.read.of_blocks);
    assert!(started.elapsed().as_secs() < 20, "{:?}", started.elapsed());
}
