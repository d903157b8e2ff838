//! Which points are within a distance d of each other, directly or through others? A grid hash with cells of 0.577 d: all points
//! of one cell are that near, and others are at most two cells away.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use sdf_core::nalgebra::Vector3;

use crate::rounding::PRUNE_SLACK;
use crate::union_find::UnionFind;

/// Side of a cell in distances: less than 1/√3, so that a cell's diagonal is less than the distance.
const CELL: f64 = 0.577;

/// Pairs of points that are compared at once, at most.
const COMPARED: usize = 16;

/// Cells of the grid in lexicographic order, each with its points.
type Cells = Vec<([i64; 3], Vec<u32>)>;

/// The points, those that triangles use and that are near others moved onto one of them; and how many were moved, not counting
/// those that were at one position before.
pub(super) fn weld_within(points: &[[f64; 3]], triangles: &[[u32; 3]], distance: f64) -> (Vec<[f64; 3]>, usize) {
    // −0 and 0 are one coordinate.
    let mut positions: Vec<[f64; 3]> =
        triangles.iter().flatten().map(|point| points[*point as usize].map(|x| x + 0.0)).collect();
    positions.sort_unstable_by(|a, b| compare(*a, *b));
    positions.dedup();
    // Named by the lowest index, and so by the lowest position.
    let mut groups = UnionFind::new(positions.len());
    let cells = cells(&positions, distance);
    let index: HashMap<[i64; 3], usize> = cells.iter().enumerate().map(|(index, (cell, _))| (*cell, index)).collect();
    for (cell, own) in &cells {
        let is_far = is_far(*cell);
        if is_far {
            join_near(&mut groups, &positions, own, own, distance);
        } else {
            own.iter().for_each(|point| groups.join(own[0], *point));
        }
        for step in FORWARD.iter().filter(|step| **step > [0, 0, 0]) {
            let next = std::array::from_fn(|axis| cell[axis].saturating_add(step[axis]));
            let Some(other) = index.get(&next).map(|index| &cells[*index].1) else { continue };
            if is_far {
                join_near(&mut groups, &positions, own, other, distance);
            } else if groups.root(own[0]) != groups.root(other[0]) {
                let mut is_near = |a, b| is_within(&positions, a, b, distance);
                if is_any_near(&positions, &mut own.clone(), &mut other.clone(), distance, &mut is_near) {
                    groups.join(own[0], other[0]);
                }
            }
        }
    }
    let mut moved_to: HashMap<[u64; 3], [f64; 3]> = HashMap::new();
    for (point, position) in (0..).zip(&positions) {
        let target = groups.root(point);
        if target != point {
            moved_to.insert(position.map(f64::to_bits), positions[target as usize]);
        }
    }
    let target = |point: &[f64; 3]| moved_to.get(&point.map(|x| (x + 0.0).to_bits())).copied();
    let welded = points.iter().map(|point| target(point).unwrap_or(*point)).collect();
    (welded, moved_to.len())
}

/// Steps to the cells within two along each axis.
const FORWARD: [[i64; 3]; 125] = {
    let mut steps = [[0; 3]; 125];
    let mut index = 0;
    while index < 125 {
        let step = index as i64;
        steps[index] = [step / 25 - 2, step / 5 % 5 - 2, step % 5 - 2];
        index += 1;
    }
    steps
};

fn compare(a: [f64; 3], b: [f64; 3]) -> std::cmp::Ordering {
    a.iter().zip(&b).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
}

fn cells(positions: &[[f64; 3]], distance: f64) -> Cells {
    let mut cells: Cells = vec![];
    let mut index: HashMap<[i64; 3], usize> = HashMap::new();
    for (point, position) in (0..).zip(positions) {
        // Saturates: so far out, neighbouring numbers are farther apart than the distance.
        let cell = position.map(|x| (x / (CELL * distance)).floor() as i64);
        match index.entry(cell) {
            Entry::Occupied(entry) => cells[*entry.get()].1.push(point),
            Entry::Vacant(entry) => {
                entry.insert(cells.len());
                cells.push((cell, vec![point]));
            }
        }
    }
    cells
}

/// Is a cell so many cells from the origin that the rounding of coordinates shows in it? Then its points are compared one by one.
fn is_far(cell: [i64; 3]) -> bool {
    cell.iter().any(|index| index.unsigned_abs() > 1 << 40)
}

/// Is a point of one set within the distance of a point of another, as `is_near` compares them? Sets are halved across the longest side of
/// their box, and parts are skipped that lie farther apart along the way between their middles.
pub(super) fn is_any_near(
    positions: &[[f64; 3]],
    own: &mut [u32],
    other: &mut [u32],
    distance: f64,
    is_near: &mut impl FnMut(u32, u32) -> bool,
) -> bool {
    if own.len() * other.len() <= COMPARED {
        return own.iter().any(|a| other.iter().any(|b| is_near(*a, *b)));
    }
    let [own_box, other_box] = [&*own, &*other].map(|set| bounds(positions, set));
    let [from, to] = [own_box, other_box].map(|[min, max]| (min + max) * 0.5);
    let direction = (to - from).try_normalize(0.0).unwrap_or_default();
    let height = |point: &u32| direction.dot(&(Vector3::from(positions[*point as usize]) - from));
    let highest = own.iter().map(height).fold(f64::NEG_INFINITY, f64::max);
    let lowest = other.iter().map(height).fold(f64::INFINITY, f64::min);
    if lowest - highest > distance * (1.0 + PRUNE_SLACK) {
        return false;
    }
    let (split, whole, [min, max]) =
        if own.len() > other.len() { (own, other, own_box) } else { (other, own, other_box) };
    let length = |axis: usize| max[axis] - min[axis];
    let longest = (1..3).fold(0, |longest, axis| if length(axis) > length(longest) { axis } else { longest });
    let along = |point: &u32| positions[*point as usize][longest];
    let middle = split.len() / 2;
    split.select_nth_unstable_by(middle, |a, b| along(a).total_cmp(&along(b)));
    let (low, high) = split.split_at_mut(middle);
    is_any_near(positions, low, whole, distance, is_near) || is_any_near(positions, high, whole, distance, is_near)
}

/// The corners of the box around some points.
fn bounds(positions: &[[f64; 3]], set: &[u32]) -> [Vector3<f64>; 2] {
    let first = Vector3::from(positions[set[0] as usize]);
    set.iter()
        .map(|point| Vector3::from(positions[*point as usize]))
        .fold([first; 2], |[min, max], position| [min.inf(&position), max.sup(&position)])
}

pub(super) fn is_within(positions: &[[f64; 3]], a: u32, b: u32, distance: f64) -> bool {
    let [a, b] = [a, b].map(|point| positions[point as usize]);
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt() <= distance
}

/// Joins the points of two cells that are near each other. The points of a cell are in the order of their x, and so only those are looked at
/// whose x is near.
fn join_near(groups: &mut UnionFind, positions: &[[f64; 3]], own: &[u32], other: &[u32], distance: f64) {
    let x = |point: u32| positions[point as usize][0];
    let mut first = 0;
    for a in own {
        while other.get(first).is_some_and(|b| x(*a) - x(*b) > distance) {
            first += 1;
        }
        let near = other[first..].iter().take_while(|b| x(**b) - x(*a) <= distance);
        near.filter(|b| is_within(positions, *a, **b, distance)).for_each(|b| groups.join(*a, *b));
    }
}
