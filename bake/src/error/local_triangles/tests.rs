//! Candidates of blocks, compared with a search among all triangles one by one.

use super::*;
use crate::TriangleMesh;
use crate::error::block::ErrorBlock;
use crate::testing::{instruction_sets, random, random_vector};
use crate::triangle::NearestOnTriangle;

/// Small and large triangles, some of them slivers, each with a flipped copy a little beside it.
fn soup(triangles: u32, state: &mut u64) -> TriangleMesh {
    let mut points = vec![];
    for _ in 0..triangles {
        let (a, size) = (random_vector(state), random(state).powi(4));
        let b = a + random_vector(state) * size;
        let width = if random(state) > 0.8 { 1e-9 } else { size };
        let c = a + (b - a) * random(state) + random_vector(state) * width;
        let step = random_vector(state) * 1e-3;
        points.extend([a, b, c, b + step, a + step, c].map(<[f64; 3]>::from));
    }
    let triangles: Vec<[u32; 3]> = (0..2 * triangles).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriangleMesh::new(&points, &triangles).unwrap()
}

fn max_distance(query: &Query) -> f64 {
    query.distance + 12.0_f64.sqrt() * query.block.half_side * (1.0 + SINGLE_SLACK)
}

/// Candidates by the same formula, among all triangles and one by one.
fn one_by_one(tree: &Bvh, query: &Query) -> (Vec<u32>, CenterOffset) {
    let ErrorBlock { center, half_side } = query.block;
    let mut all: Vec<(u32, NearestOnTriangle)> = vec![];
    tree.visit_within(center, 1e6, |slot| all.push((slot as u32, nearest_on_triangle(center, tree.corners[slot]))));
    let (_, nearest) = *all.iter().min_by(|a, b| a.1.distance_sq.total_cmp(&b.1.distance_sq)).unwrap();
    let direction =
        |on_triangle: &NearestOnTriangle| (center - on_triangle.point).try_normalize(0.0).unwrap_or_default();
    let half_side = half_side * (1.0 + SINGLE_SLACK);
    let hypotenuse = (nearest.distance_sq + 3.0 * half_side * half_side).sqrt();
    let slope = direction(&nearest) * (nearest.distance_sq.sqrt() / hypotenuse);
    let max_distance = 2.0 * 3.0_f64.sqrt() * query.block.half_side * (1.0 + SINGLE_SLACK) + query.distance;
    all.retain(|(_, on_triangle)| {
        let excess = half_side * (slope - direction(on_triangle)).abs().sum();
        on_triangle.distance_sq <= max_distance * max_distance
            && on_triangle.distance_sq.sqrt() <= (hypotenuse + excess) * (1.0 + SINGLE_SLACK)
    });
    let offset = center - nearest.point;
    (all.into_iter().map(|(slot, _)| slot).collect(), CenterOffset { offset, distance_sq: nearest.distance_sq })
}

fn found(local: &LocalTriangles, query: usize) -> Vec<u32> {
    local.candidates.list(query).iter().map(|index| local.picked[*index as usize]).collect()
}

#[test]
fn the_candidates_of_blocks_are_those_that_are_found_one_by_one_among_all() {
    let mut state = 11;
    println!("seed {state}");
    for (arch, triangles) in instruction_sets().into_iter().cycle().zip([1, 3, 30, 300, 300, 300, 300]) {
        let mut tree = Bvh::new(&soup(triangles, &mut state));
        tree.arch = arch;
        for round in 0..90 {
            let (middle, size) = (random_vector(&mut state) * 1.2, 0.2 * random(&mut state).abs().powi(2));
            let half_side = size * random(&mut state).abs();
            let mut random_query = || {
                let mut center = middle + random_vector(&mut state) * size;
                if random(&mut state) > 0.8 {
                    // At a corner, where several triangles are equally near.
                    center = tree.corners[tree.nearest(center, 0).slot][1];
                }
                let nearest = tree.nearest(center, 0);
                let block = ErrorBlock { center, half_side };
                Query { block, distance: nearest.on_triangle.distance_sq.sqrt(), slot: nearest.slot }
            };
            let queries: Vec<Query> = (0..1 + round % LANES).map(|_| random_query()).collect();
            let farthest = |query: &Query| (query.block.center - middle).norm() + max_distance(query);
            let radius = queries.iter().map(farthest).fold(0.0, f64::max);
            let mut local = LocalTriangles::gather(&tree, middle, radius, half_side);
            local.find_candidates(&queries);
            for (index, query) in queries.iter().enumerate() {
                let (wanted, wanted_nearest) = one_by_one(&tree, query);
                assert_eq!(found(&local, index), wanted, "{query:?} of {triangles} triangles by {arch:?}");
                let nearest = local.candidates.nearest(index).unwrap();
                assert_eq!(nearest.distance_sq.to_bits(), wanted_nearest.distance_sq.to_bits());
                assert_eq!(nearest.offset, wanted_nearest.offset);
            }
        }
    }
}

#[test]
fn between_two_equally_near_triangles_the_candidates_are_those_of_the_first_whichever_the_query_names() {
    // Two stacks of triangles, one on each side of the block. Those a little farther away are candidates only in the
    // stack of the first nearest triangle.
    let triangle = |x: f64| [[x, -0.005, -0.005], [x, 0.005, -0.005], [x, 0.0, 0.005]];
    let both = |step: u32| [0.1 + 0.002 * f64::from(step), -0.1 - 0.002 * f64::from(step)].map(triangle);
    let points: Vec<[f64; 3]> = (0..39).flat_map(both).flatten().collect();
    let triangles: Vec<[u32; 3]> = (0..78).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let tree = Bvh::new(&TriangleMesh::new(&points, &triangles).unwrap());
    let block = ErrorBlock { center: Vector3::zeros(), half_side: 0.02 };
    for slot in (0..78).filter(|slot| tree.corners[*slot][0].x.abs() < 0.101) {
        let query = Query { block, distance: 0.1, slot };
        let mut local = LocalTriangles::gather(&tree, block.center, max_distance(&query), block.half_side);
        local.find_candidates(&[query]);
        let (wanted, wanted_nearest) = one_by_one(&tree, &query);
        assert_eq!(found(&local, 0), wanted);
        assert_eq!(local.candidates.nearest(0).unwrap().offset, wanted_nearest.offset);
        assert!((10..70).contains(&wanted.len()), "{}", wanted.len());
    }
}

#[test]
fn no_sphere_is_rejected_that_holds_a_point_which_only_just_is_a_candidate() {
    let mut state = 23;
    println!("seed {state}");
    let mut admissible = 0;
    for round in 0..40_000 {
        let (half_side, distance) = (1.0, [0.1, 1.0, 4.0][round % 3] * random(&mut state).abs());
        let hypotenuse = (distance * distance + 3.0 * half_side * half_side).sqrt();
        let slope = random_vector(&mut state).normalize() * (distance / hypotenuse);
        let toward_block = random_vector(&mut state).normalize();
        let radius = [0.1, 1.0][round / 3 % 2] * random(&mut state).abs();
        let excess = half_side * (slope - toward_block).abs().sum();
        let length = radius + hypotenuse + excess + 0.4 * half_side * radius * random(&mut state).abs();
        // Points of the sphere's surface on the side of the block come nearest to being candidates.
        let margin = |point: Vector3<f64>| {
            let offset = -point;
            offset.norm() - hypotenuse - half_side * (slope - offset.normalize()).abs().sum()
        };
        let center = -toward_block * length;
        let on_sphere = || center + (toward_block + random_vector(&mut state) * 0.6).normalize() * radius;
        let min_margin = std::iter::repeat_with(on_sphere).take(30).map(margin).fold(f64::INFINITY, f64::min);
        let mut spheres = BoundingSpheres::NONE;
        spheres.set(0, center, radius, 10.0);
        let slope: [f32; 3] = slope.map(|x| x as f32).into();
        let [half_side, hypotenuse] = [half_side, hypotenuse].map(|x| x as f32);
        let bound = ApproxBound { center: [0.0; 3], half_side, hypotenuse, slope, max_distance: 1e6 };
        assert!(min_margin > 0.0 || bound.admits(&spheres)[0] == 1, "{center} {radius} {min_margin}");
        admissible += usize::from(min_margin <= 0.0);
    }
    assert!(admissible > 1000, "{admissible}");
}
