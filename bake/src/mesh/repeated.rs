//! Triangles with the corners and the winding of another: which are needed?
//!
//! A triangle that was written twice opens the shell that it is in, and one of the two is enough. Shells that have a face in common need
//! it once each: without one of them, its shell is open. So a copy stays if the mesh with all copies is closed along the triangle's
//! edges, and without them is not.

/// The first of all triangles with the same corners and winding, and the copies that are needed, in their order. Corners are below
/// `point_count`.
pub(super) fn without_needless(triangles: &[[u32; 3]], point_count: usize) -> Vec<[u32; 3]> {
    // A counting sort by the lowest corner, which few triangles have in common.
    let mut ends = vec![0_u32; point_count + 1];
    let rotated = || triangles.iter().map(|corners| rotated_to_lowest_first(*corners));
    rotated().for_each(|[lowest, ..]| ends[lowest as usize + 1] += 1);
    (1..ends.len()).for_each(|point| ends[point] += ends[point - 1]);
    let mut sorted = vec![([0; 3], 0_u32); triangles.len()];
    for (index, corners) in (0..).zip(rotated()) {
        let position = &mut ends[corners[0] as usize];
        sorted[*position as usize] = (corners, index);
        *position += 1;
    }
    let mut is_first = vec![true; triangles.len()];
    for with_lowest in sorted.chunk_by_mut(|(a, _), (b, _)| a[0] == b[0]) {
        with_lowest.sort_unstable();
        for pair in with_lowest.windows(2) {
            is_first[pair[1].1 as usize] = pair[0].0 != pair[1].0;
        }
    }
    let is_kept = with_needed(triangles, &is_first);
    triangles.iter().zip(is_kept).filter(|(_, is_kept)| *is_kept).map(|(corners, _)| *corners).collect()
}

/// The first ones and the copies that are needed. A copy inside of a face of many triangles is needed once those at its rim are.
fn with_needed(triangles: &[[u32; 3]], is_first: &[bool]) -> Vec<bool> {
    let copies =
        || triangles.iter().zip(0_u32..).zip(is_first).filter(|(_, is_first)| !**is_first).map(|(copy, _)| copy);
    let mut edges: Vec<[u32; 2]> = copies().flat_map(|(corners, _)| directed(*corners)).map(|(edge, _)| edge).collect();
    if edges.is_empty() {
        return is_first.to_vec();
    }
    edges.sort_unstable();
    edges.dedup();
    // By how much the triangles that use an edge one way are more than those that use it the other way: of all, and of those that are kept.
    let mut excess = vec![[0_i64; 2]; edges.len()];
    for (corners, is_first) in triangles.iter().zip(is_first) {
        for (edge, way) in directed(*corners) {
            if let Ok(index) = edges.binary_search(&edge) {
                excess[index][0] += way;
                excess[index][1] += if *is_first { way } else { 0 };
            }
        }
    }
    let at_edges =
        |corners: [u32; 3]| directed(corners).map(|(edge, way)| (edges.partition_point(|other| *other < edge), way));
    // For each edge, and each way along it, the copies that may close it.
    let mut closing: Vec<[Vec<u32>; 2]> = vec![[vec![], vec![]]; edges.len()];
    for (corners, copy) in copies() {
        let at_edges = at_edges(*corners);
        if at_edges.iter().all(|(edge, _)| excess[*edge][0] == 0) {
            at_edges.iter().for_each(|(edge, way)| closing[*edge][usize::from(*way > 0)].push(copy));
        }
    }
    let mut is_kept = is_first.to_vec();
    let mut open: Vec<usize> = (0..edges.len()).filter(|edge| excess[*edge][1] != 0).collect();
    while let Some(edge) = open.pop() {
        let balance = excess[edge][1];
        let Some(copy) = (balance != 0).then(|| closing[edge][usize::from(balance < 0)].pop()).flatten() else {
            continue;
        };
        open.push(edge);
        if !std::mem::replace(&mut is_kept[copy as usize], true) {
            for (edge, way) in at_edges(triangles[copy as usize]) {
                excess[edge][1] += way;
                open.push(edge);
            }
        }
    }
    is_kept
}

/// The edges of a triangle, each with its lower index first, and 1 where the winding goes from that to the other, −1 where it comes back.
fn directed([a, b, c]: [u32; 3]) -> [([u32; 2], i64); 3] {
    [(a, b), (b, c), (c, a)].map(|(from, to)| ([from.min(to), from.max(to)], if from < to { 1 } else { -1 }))
}

/// The same triangle with the same winding, its lowest index first.
fn rotated_to_lowest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a <= b && a <= c {
        [a, b, c]
    } else if b <= c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}
