//! The exact minimum of a grid on a triangle is not above its minimum on any edge, or on any line along which the faces of cells
//! cut it. Those are found another way here: plane by plane, by the exact minimum on a segment. Triangles have up to 50 cells along an
//! axis: small ones are searched at once, larger ones block by block. A level at which the search may stop changes no minimum below it.

mod bricks;

use bricks::Bricks;
use sdf_core::grid::sparse::{BRICK, NO_BRICK, Scale, Sparse, brick_counts};
use sdf_core::grid::{BlockBounds, Dense, Grid, Lattice, Storage, WithBlockBounds, measure_slope_bound};
use sdf_core::nalgebra::Vector3;
use sdf_core::{EnclosedSdf, Goal, Interval, Sdf};

type Corners = [Vector3<f64>; 3];

const SPACING: f64 = 0.125;
const NODES: [u32; 3] = [33, 29, 52];

/// Splitmix64, as numbers from 0 to 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

fn lattice() -> Lattice {
    Lattice::new([-0.5, 0.25, -1.0], SPACING, NODES).unwrap()
}

/// Noise, a rough ball, a ball, a cube.
fn samples(kind: usize, random: &mut Random) -> Vec<f32> {
    let bounds = lattice().bounds();
    let middle: [f64; 3] = std::array::from_fn(|k| random.between(bounds.min[k], bounds.max[k]));
    let radius = random.between(0.1, 2.0);
    let mut samples = vec![];
    for z in 0..NODES[2] {
        for y in 0..NODES[1] {
            for x in 0..NODES[0] {
                let node = lattice().node([x, y, z]);
                let offset = Vector3::from(std::array::from_fn(|k| node[k] - middle[k]));
                samples.push(match kind {
                    0 => random.between(-1.0, 1.0),
                    1 => offset.norm() - radius + random.between(-0.02, 0.02),
                    2 => offset.norm() - radius,
                    _ => offset.amax() - radius,
                } as f32);
            }
        }
    }
    samples
}

/// A random triangle: with corners or edges in faces of cells, through a node, collinear, or as it comes.
fn triangle(case: usize, random: &mut Random) -> Corners {
    let bounds = lattice().bounds();
    let (min, max) = (Vector3::from(bounds.min), Vector3::from(bounds.max));
    let snap = |x: f64| (x / SPACING).round() * SPACING;
    let size = 10.0_f64.powf(random.between(-2.5, 0.6));
    let about = Vector3::from_fn(|k, _| random.between(min[k], max[k]));
    let mut corners: Corners = std::array::from_fn(|_| Vector3::from_fn(|k, _| about[k] + random.between(-size, size)));
    match case {
        0 => corners.iter_mut().for_each(|corner| corner.y = snap(about.y)),
        1 => corners.iter_mut().for_each(|corner| *corner = corner.map(snap)),
        2 => corners[..2].iter_mut().for_each(|corner| corner.y = snap(about.y)),
        3 => corners[..2].iter_mut().for_each(|corner| (corner.x, corner.y) = (snap(about.x), snap(about.y))),
        4 => corners[2] = corners[0] + (corners[1] - corners[0]) * 0.3,
        5 => {
            let to_node = about.map(snap) - (corners[0] + corners[1] + corners[2]) / 3.0;
            corners.iter_mut().for_each(|corner| *corner += to_node);
        }
        6 => corners.iter_mut().for_each(|corner| corner.y = snap(about.y) + random.between(-1e-15, 1e-15)),
        _ => {}
    }
    corners.map(|corner| corner.zip_zip_map(&min, &max, |x, min: f64, max: f64| x.clamp(min, max)))
}

/// The edges of a triangle, and its cuts with the faces of cells.
fn lines(corners: &Corners) -> Vec<[Vector3<f64>; 2]> {
    let [a, b, c] = *corners;
    let mut lines = vec![[a, b], [b, c], [c, a]];
    for axis in 0..3 {
        for plane in 0..NODES[axis] {
            let plane = lattice().origin()[axis] + SPACING * f64::from(plane);
            let crossing = |[from, to]: [Vector3<f64>; 2]| {
                let (s, r) = (from[axis] - plane, to[axis] - plane);
                (s * r < 0.0).then(|| {
                    let mut point = from + (to - from) * (s / (s - r));
                    point[axis] = plane;
                    point
                })
            };
            let ends: Vec<_> = [[a, b], [b, c], [c, a]].into_iter().filter_map(crossing).collect();
            lines.extend(ends.first_chunk::<2>());
        }
    }
    lines
}

/// Numbers of triangles of which the minimum was found, and of those with a minimum that is proven above a level.
#[derive(Default)]
struct Counts {
    found: u32,
    proven: u32,
}

fn check<S: Storage>(name: &str, grid: &Grid<S>, corners: Corners, counts: &mut Counts) {
    let minimum_below = |level: f64| grid.exact_minimum(corners, Goal { level, gap: 1e-3 });
    let Some(minimum) = minimum_below(f64::INFINITY) else { return };
    for line in lines(&corners) {
        let Some(on_line) = grid.exact_minimum(line, Goal::exact()) else { continue };
        assert!(
            minimum.value <= on_line.value + 1e-12,
            "{name}: {minimum:?} on {corners:?}, but {on_line:?} on {line:?}"
        );
        assert!(minimum.lower_bound <= on_line.value + 1e-12, "{name}: {minimum:?} on {corners:?}");
    }
    let above = minimum_below(minimum.value + 0.02).unwrap();
    assert!((above.value - minimum.value).abs() < 1e-12, "{name}: {above:?} is not {minimum:?} on {corners:?}");
    let level = minimum.value - 0.02;
    let below = minimum_below(level).unwrap();
    assert!(minimum.value <= below.value + 1e-12, "{name}: {below:?} is below {minimum:?} on {corners:?}");
    assert!(below.lower_bound <= minimum.value + 1e-12, "{name}: {below:?} and {minimum:?} on {corners:?}");
    counts.found += 1;
    counts.proven += u32::from(level < below.lower_bound);
}

#[test]
fn the_exact_minimum_on_a_triangle_is_not_above_that_on_any_edge_or_cut() {
    let mut random = Random(17);
    let mut counts = Counts::default();
    for round in 0..48 {
        let samples = samples(round % 4, &mut random);
        let dense = Dense::new(&lattice(), &samples[..]).unwrap();
        let slope_bound = measure_slope_bound(&lattice(), &dense);
        let bounds = block_bounds(&samples);
        let bounded =
            Grid::new(lattice(), WithBlockBounds::new(&lattice(), dense, &bounds[..]).unwrap(), slope_bound).unwrap();
        let dense = Grid::new(lattice(), dense, slope_bound).unwrap();
        let bricks = sampled_bricks(&samples, &mut random);
        let sparse = Sparse::new(&lattice(), bricks.slices()).unwrap();
        let slope_bound = measure_slope_bound(&lattice(), &sparse);
        let sparse = Grid::new(lattice(), sparse, slope_bound).unwrap();
        for case in 0..60 {
            let corners = triangle(case % 12, &mut random);
            check("dense", &dense, corners, &mut counts);
            check("dense with bounds of blocks", &bounded, corners, &mut counts);
            check("sparse", &sparse, corners, &mut counts);
        }
    }
    assert!(counts.found > 8_000 && counts.proven > 7_000, "{} and {}", counts.found, counts.proven);
}

/// The lowest value at points of a triangle, in rows.
fn lowest_sample<S: Storage>(grid: &Grid<S>, corners: &Corners) -> f64 {
    const ROWS: u32 = 100;
    let mut lowest = f64::INFINITY;
    for i in 0..=ROWS {
        for j in 0..=ROWS - i {
            let [u, v] = [i, j].map(|index| f64::from(index) / f64::from(ROWS));
            lowest = lowest.min(grid.value(corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v));
        }
    }
    lowest
}

/// Checks an answer in double and in single precision. In single precision it may end with nothing.
fn is_not_above<S: Storage>(grid: &Grid<S>, corners: Corners, random: &Random) {
    let lowest = lowest_sample(grid, &corners);
    let exact = grid.exact_minimum(corners, Goal::exact()).unwrap();
    let seed = random.0;
    assert!(
        exact.lower_bound <= lowest + 1e-12 && exact.value <= lowest + 1e-9,
        "{seed}: {exact:?}, {lowest}, {corners:?}"
    );
    let single = corners.map(|corner| corner.map(|x| x as f32));
    let lowest = lowest_sample(grid, &single.map(|corner| corner.map(f64::from)));
    if let Some(exact) = grid.exact_minimum(single, Goal::exact()) {
        assert!(f64::from(exact.lower_bound) <= lowest + 1e-12, "{seed}: {exact:?}, {lowest}, {single:?}");
    }
}

/// Over a flat floor the gradient has no part along a level triangle but rounding: no direction is one of descent.
#[test]
fn a_bump_under_the_middle_of_a_level_triangle_is_found() {
    let mut random = Random(20_261_129);
    for (nodes, bump) in [([10, 10, 10], [6, 2]), ([30, 30, 12], [20, 6])] {
        for _ in 0..100 {
            let spacing = 0.1 * random.between(0.5, 2.0);
            let lattice = Lattice::new([0.0; 3], spacing, nodes).unwrap();
            let top = Vector3::from(lattice.node([bump[0], bump[1], 0]));
            let mut samples = vec![];
            for node in self::nodes(nodes) {
                let point = Vector3::from(lattice.node(node));
                let along = point - top;
                samples.push((point.z - 3.0 * spacing - (1.5 * spacing - along.x.hypot(along.y)).max(0.0)) as f32);
            }
            let dense = Dense::new(&lattice, &samples[..]).unwrap();
            let grid = Grid::new(lattice, dense, measure_slope_bound(&lattice, &dense)).unwrap();
            let [near, far] = [random.between(0.1, 0.4), f64::from(nodes[0]) - 1.0 - random.between(0.1, 0.4)];
            let z = random.between(5.0, 7.0) * spacing;
            let at = |x: f64, y: f64| Vector3::new(x * spacing, y * spacing, z);
            is_not_above(&grid, [at(near, near), at(far, near), at(near, far)], &random);
        }
    }
}

/// Noise, and triangles in the upper face of the box, in the plane of a diagonal through columns of nodes, and next to these by rounding.
#[test]
fn a_triangle_within_rounding_of_a_face_of_cells_is_searched_on_all_of_it() {
    let mut random = Random(20_261_130);
    for round in 0..600 {
        let nodes = [10, if round % 2 == 0 { 4 } else { 10 }, 10];
        let origin = if round % 4 < 2 { 0.0 } else { 1e5 };
        let lattice = Lattice::new([origin; 3], 0.1, nodes).unwrap();
        let samples: Vec<f32> = (0..lattice.node_count()).map(|_| random.between(-0.1, 0.1) as f32).collect();
        let dense = Dense::new(&lattice, &samples[..]).unwrap();
        let grid = Grid::new(lattice, dense, measure_slope_bound(&lattice, &dense)).unwrap();
        let [min, max] = [lattice.bounds().min, lattice.bounds().max].map(Vector3::from);
        let corners: Corners = std::array::from_fn(|corner| {
            let along = |axis: usize, t: f64| (min[axis] + 0.9 * t).clamp(min[axis], max[axis]);
            let [s, t] = [random.next(), random.next()];
            match round % 2 {
                0 if corner < 2 => Vector3::new(along(0, s), max.y, along(2, t)),
                0 => Vector3::new(along(0, s), max.y.next_down(), along(2, t)),
                _ => Vector3::new(along(0, s), along(1, 1.0 - s), along(2, t)),
            }
        });
        if origin == 0.0 {
            is_not_above(&grid, corners, &random);
            continue;
        }
        // Coordinates round by 1e-11, and single precision has no digits left.
        let lowest = lowest_sample(&grid, &corners);
        let exact = grid.exact_minimum(corners, Goal::exact()).unwrap();
        assert!(exact.lower_bound <= lowest, "{}: {exact:?}, {lowest}, {corners:?}", random.0);
    }
}

/// Boxes of 9 and 10 cells along each axis have too many cells for one search, and few for blocks.
#[test]
fn a_triangle_in_a_box_of_any_size_up_to_fourteen_cells_needs_no_search() {
    let mut random = Random(20_261_131);
    let samples = samples(1, &mut random);
    let dense = Dense::new(&lattice(), &samples[..]).unwrap();
    let grid = Grid::new(lattice(), dense, measure_slope_bound(&lattice(), &dense)).unwrap();
    for cells in 1..=14 {
        let size = (f64::from(cells) - 0.5) * SPACING;
        let first = Vector3::from(lattice().origin()) + Vector3::repeat(0.25 * SPACING);
        let corners = [first, first + Vector3::new(size, size, 0.0), first + Vector3::new(0.0, size, size)];
        assert!(grid.exact_minimum(corners, Goal::exact()).is_some(), "{cells}");
    }
}

/// Bounds of the samples at the nodes of each block.
fn block_bounds(samples: &[f32]) -> Vec<BlockBounds> {
    let bounds = |slot: [u32; 3]| {
        let mut range = Interval { lower: f32::INFINITY, upper: f32::NEG_INFINITY };
        for node in nodes([BRICK; 3]).map(|node| std::array::from_fn(|k| slot[k] * BRICK + node[k])) {
            if (0..3).all(|k| node[k] < NODES[k]) {
                let sample = samples[lattice().index(node)];
                range = Interval { lower: range.lower.min(sample), upper: range.upper.max(sample) };
            }
        }
        BlockBounds { range, slope_bound: 100.0 }
    };
    nodes(brick_counts(&lattice())).map(bounds).collect()
}

/// A sparse grid of u16 with a brick in most slots.
fn sampled_bricks(samples: &[f32], random: &mut Random) -> Bricks {
    let at = |node: [u32; 3]| samples[lattice().index(std::array::from_fn(|k| node[k].min(NODES[k] - 1)))];
    let [nx, ny, nz] = brick_counts(&lattice());
    let mut bricks = Bricks::default();
    for slot in nodes([nx, ny, nz]) {
        if random.next() < 0.3 {
            bricks.table.push(NO_BRICK);
            continue;
        }
        bricks.table.push(bricks.scales.len() as u32);
        bricks.scales.push(Scale { base: -3.0, step: 6.0 / 65535.0 });
        let range = Interval { lower: -3.0, upper: 3.0 };
        bricks.bounds.push(BlockBounds { range, slope_bound: 100.0 });
        for node in nodes([BRICK; 3]) {
            let sample = at(std::array::from_fn(|k| slot[k] * BRICK + node[k]));
            bricks.samples.push(((sample + 3.0) / 6.0 * 65535.0) as u16);
        }
    }
    bricks.coarse = nodes([nx + 1, ny + 1, nz + 1]).map(|node| at(node.map(|index| index * BRICK))).collect();
    bricks
}

/// Indices of so many nodes, x fastest.
fn nodes([x, y, z]: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    (0..x * y * z).map(move |index| [index % x, index / x % y, index / (x * y)])
}
