use rayon::prelude::*;
use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::hilbert::{BITS, hilbert_index};
use crate::rough_triangle::{Frame, RoughTriangle};
use crate::triangle::{NearestOnTriangle, nearest_on_triangle};

/// How many children a node has. Their boxes are tested together.
pub(crate) const FAN: usize = 8;

/// Triangles in Hilbert order under an implicit tree: each level groups [`FAN`] neighbours of the one below.
pub(crate) struct Tree {
    /// Corners, in the order of the tree.
    pub corners: Vec<[Vector3<f64>; 3]>,
    /// For each of them its triangle in the mesh.
    pub triangles: Vec<u32>,
    /// Of each of them what is roughly so.
    pub rough: Vec<RoughTriangle>,
    pub frame: Frame,
    /// From the triangles up: `levels[0][i]` holds the boxes of triangles 8i to 8i + 7, `levels[1][i]` those of the
    /// groups 8i to 8i + 7 of level 0. The last level is the root alone.
    levels: Vec<Vec<Boxes>>,
    pub arch: pulp::Arch,
}

/// The boxes of a node's children, side by side. A place without a child holds a box that nothing is near to.
#[derive(Clone)]
struct Boxes {
    min: [[f64; FAN]; 3],
    max: [[f64; FAN]; 3],
}

/// A triangle of the tree and the point of it that is nearest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearestTriangle {
    /// In the order of the tree.
    pub slot: usize,
    pub on_triangle: NearestOnTriangle,
}

/// One search, for the instructions that the machine has.
struct Search<'a> {
    tree: &'a Tree,
    point: Vector3<f64>,
    guess: usize,
}

impl pulp::NullaryFnOnce for Search<'_> {
    type Output = NearestTriangle;

    #[inline(always)]
    fn call(self) -> NearestTriangle {
        self.tree.search(self.point, self.guess)
    }
}

/// A cube, by its middle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cube {
    pub middle: Vector3<f64>,
    pub half_side: f64,
}

/// A triangle that a search came to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reached {
    /// In the order of the tree.
    pub slot: usize,
    /// From the triangle's box.
    pub distance: f64,
    /// The way of that length.
    pub way: [f64; 3],
}

/// More than all rounding of a search in a cube, and of where the nodes in it stand.
const REACH_SLACK: f64 = 1.0 + 1e-6;

/// Boxes farther than this times the best distance so far are passed over. The excess over one is more than all
/// rounding of both: so the answer does not depend on where the search began.
const PRUNE_SLACK: f64 = 1.0 + 1e-12;

/// No tree of u32 triangles is deeper; 7 of 8 children of each level wait at most.
pub(crate) const STACK: usize = 11 * FAN;

impl Tree {
    pub fn new(mesh: &TriangleMesh) -> Self {
        let bounds = mesh.bounds();
        let cells_per_length = f64::from((1_u32 << BITS) - 1) / bounds.longest_side();
        let mut order: Vec<(u64, u32)> = (0..mesh.triangle_count() as u32)
            .into_par_iter()
            .map(|triangle| {
                let [a, b, c] = mesh.corner_points(mesh.triangles[triangle as usize]);
                let from_corner = a / 3.0 + b / 3.0 + c / 3.0 - Vector3::from(bounds.min);
                (hilbert_index((from_corner * cells_per_length).map(|x| x as u32).into()), triangle)
            })
            .collect();
        order.par_sort_unstable();
        let triangles: Vec<u32> = order.into_iter().map(|(_, triangle)| triangle).collect();
        let corners: Vec<_> =
            triangles.iter().map(|triangle| mesh.corner_points(mesh.triangles[*triangle as usize])).collect();

        let mut levels = vec![group(corners.iter().map(box_around))];
        while levels[levels.len() - 1].len() > 1 {
            levels.push(group(levels[levels.len() - 1].iter().map(Boxes::outer)));
        }
        let frame = Frame::around(&bounds);
        let rough = corners.iter().map(|corners| RoughTriangle::new(*corners, &frame)).collect();
        Self { corners, triangles, rough, frame, levels, arch: pulp::Arch::new() }
    }

    /// The triangle nearest to `point`, the first in the tree's order where several are equally near. `guess` is any
    /// triangle; the search is the shorter, the nearer it is.
    pub fn nearest(&self, point: Vector3<f64>, guess: usize) -> NearestTriangle {
        self.arch.dispatch(Search { tree: self, point, guess })
    }

    #[inline(always)]
    fn search(&self, point: Vector3<f64>, guess: usize) -> NearestTriangle {
        let mut best = NearestTriangle { slot: guess, on_triangle: nearest_on_triangle(point, self.corners[guess]) };
        let mut stack = [(0.0, 0, 0); STACK];
        let mut waiting = 1;
        stack[0] = (0.0, self.levels.len() - 1, 0);
        while waiting > 0 {
            waiting -= 1;
            let (distance_sq, level, node) = stack[waiting];
            if distance_sq > best.on_triangle.distance_sq * PRUNE_SLACK {
                continue;
            }
            let distances_sq = self.levels[level][node].distances_sq(point);
            let first_waiting = waiting;
            for (child, distance_sq) in distances_sq.into_iter().enumerate() {
                if distance_sq > best.on_triangle.distance_sq * PRUNE_SLACK {
                    continue;
                }
                let index = node * FAN + child;
                if level == 0 {
                    let on_triangle = nearest_on_triangle(point, self.corners[index]);
                    let found = (on_triangle.distance_sq, index);
                    if found < (best.on_triangle.distance_sq, best.slot) {
                        best = NearestTriangle { slot: index, on_triangle };
                    }
                    continue;
                }
                // The nearest child goes last, to be taken first.
                let mut place = waiting;
                while place > first_waiting && stack[place - 1].0 < distance_sq {
                    stack[place] = stack[place - 1];
                    place -= 1;
                }
                stack[place] = (distance_sq, level - 1, index);
                waiting += 1;
            }
        }
        best
    }

    /// All triangles that may be nearest to a point of a cube, and perhaps some more. `nearest` is the nearest to its middle.
    /// False where they are more than `most`.
    ///
    /// A point at v from the middle, v·v ≤ ρ², is no farther from the nearest point, at a distance D with direction e from
    /// there to the middle, than √(D² + 2D v·e + ρ²) ≤ A + k v·e, where A = √(D² + ρ²) and k = D/A; and from a box, at d with
    /// direction f, it is at least d + v·f away, as that lies behind the plane across f.
    #[inline(always)]
    pub fn reaching(&self, cube: Cube, nearest: &NearestOnTriangle, most: usize, found: &mut Vec<Reached>) -> bool {
        found.clear();
        let half_side = cube.half_side * REACH_SLACK;
        let hypotenuse = (nearest.distance_sq + 3.0 * half_side * half_side).sqrt();
        let slope = (cube.middle - nearest.point) / hypotenuse;
        let mut stack = [(0, 0); STACK];
        let mut waiting = 1;
        stack[0] = (self.levels.len() - 1, 0);
        while waiting > 0 {
            waiting -= 1;
            let (level, node) = stack[waiting];
            let (distances, ways) = self.levels[level][node].ways(cube.middle);
            let mut enters = [false; FAN];
            for child in 0..FAN {
                let mut apart = 0.0;
                for axis in 0..3 {
                    apart += (slope[axis] * distances[child] - ways[axis][child]).abs();
                }
                // Both sides times the distance.
                let most = hypotenuse * distances[child] + half_side * apart;
                // What is not a number is not beyond.
                let is_beyond = distances[child] * distances[child] > most * REACH_SLACK;
                enters[child] = !is_beyond;
            }
            for child in 0..FAN {
                let index = node * FAN + child;
                if !enters[child] {
                    continue;
                }
                if level > 0 {
                    if index < self.levels[level - 1].len() {
                        stack[waiting] = (level - 1, index);
                        waiting += 1;
                    }
                } else if index < self.corners.len() {
                    if found.len() == most {
                        return false;
                    }
                    let way = [ways[0][child], ways[1][child], ways[2][child]];
                    found.push(Reached { slot: index, distance: distances[child], way });
                }
            }
        }
        true
    }

    /// Calls `visit` with every triangle whose box is no farther from `point` than the root of `distance_sq`, and perhaps some
    /// more. Whatever the point, they come in the same order.
    pub fn near(&self, point: Vector3<f64>, distance_sq: f64, visit: impl FnMut(usize)) {
        let is_near = |boxes: &Boxes| boxes.distances_sq(point).map(|away_sq| away_sq <= distance_sq * PRUNE_SLACK);
        self.walk(is_near, visit);
    }

    /// Calls `visit` with every triangle whose box meets the box from `min` to `max`.
    pub fn overlapping(&self, min: Vector3<f64>, max: Vector3<f64>, visit: impl FnMut(usize)) {
        let apart = |boxes: &Boxes, child: usize, axis: usize| {
            boxes.max[axis][child] < min[axis] || max[axis] < boxes.min[axis][child]
        };
        self.walk(|boxes| std::array::from_fn(|child| !(0..3).any(|axis| apart(boxes, child, axis))), visit);
    }

    /// Calls `visit` with every triangle whose box, and all boxes around it, are among those that `enters` picks of a node's
    /// children.
    fn walk(&self, enters: impl Fn(&Boxes) -> [bool; FAN], mut visit: impl FnMut(usize)) {
        let mut stack = [(0, 0); STACK];
        let mut waiting = 1;
        stack[0] = (self.levels.len() - 1, 0);
        while waiting > 0 {
            waiting -= 1;
            let (level, node) = stack[waiting];
            let entered = enters(&self.levels[level][node]);
            for (child, _) in entered.iter().enumerate().filter(|(_, enters)| **enters) {
                let index = node * FAN + child;
                if level == 0 {
                    visit(index);
                } else {
                    stack[waiting] = (level - 1, index);
                    waiting += 1;
                }
            }
        }
    }
}

impl Boxes {
    const NOTHING: Self = Self { min: [[f64::INFINITY; FAN]; 3], max: [[f64::NEG_INFINITY; FAN]; 3] };

    #[inline(always)]
    fn distances_sq(&self, point: Vector3<f64>) -> [f64; FAN] {
        let mut distances_sq = [0.0; FAN];
        for axis in 0..3 {
            for child in 0..FAN {
                let below = self.min[axis][child] - point[axis];
                let above = point[axis] - self.max[axis][child];
                let outside = larger(larger(below, above), 0.0);
                distances_sq[child] += outside * outside;
            }
        }
        distances_sq
    }

    /// From each box to a point the shortest way, and how long it is. No numbers where there is no box.
    #[inline(always)]
    fn ways(&self, point: Vector3<f64>) -> ([f64; FAN], [[f64; FAN]; 3]) {
        let (mut distances, mut ways) = ([0.0; FAN], [[0.0; FAN]; 3]);
        for child in 0..FAN {
            let mut distance_sq = 0.0;
            for axis in 0..3 {
                let below = larger(self.min[axis][child] - point[axis], 0.0);
                let above = larger(point[axis] - self.max[axis][child], 0.0);
                ways[axis][child] = above - below;
                distance_sq += ways[axis][child] * ways[axis][child];
            }
            distances[child] = distance_sq.sqrt();
        }
        (distances, ways)
    }

    /// The box around all children.
    fn outer(&self) -> [Vector3<f64>; 2] {
        let least = |of: &[f64; FAN]| of.iter().copied().fold(f64::INFINITY, f64::min);
        let most = |of: &[f64; FAN]| of.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        [Vector3::from_fn(|axis, _| least(&self.min[axis])), Vector3::from_fn(|axis, _| most(&self.max[axis]))]
    }
}

/// One instruction, as `f64::max` is not: it minds NaN, which no distance to a box is.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

fn box_around([a, b, c]: &[Vector3<f64>; 3]) -> [Vector3<f64>; 2] {
    [a.inf(b).inf(c), a.sup(b).sup(c)]
}

fn group(children: impl Iterator<Item = [Vector3<f64>; 2]>) -> Vec<Boxes> {
    let mut groups: Vec<Boxes> = Vec::new();
    for (index, [min, max]) in children.enumerate() {
        let place = index % FAN;
        if place == 0 {
            groups.push(Boxes::NOTHING);
        }
        let Some(group) = groups.last_mut() else { continue };
        for axis in 0..3 {
            group.min[axis][place] = min[axis];
            group.max[axis][place] = max[axis];
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SplitMix64, from −1 to 1.
    fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 * 0.5_f64.powi(52) - 1.0
    }

    /// `cells` by `cells` squares in the x-y plane cut in two, their corners moved by up to `height` along z.
    fn sheet(cells: u32, height: f64, state: &mut u64) -> TriangleMesh {
        let (mut points, mut triangles) = (vec![], vec![]);
        for index in 0..(cells + 1) * (cells + 1) {
            let [x, y] = [index % (cells + 1), index / (cells + 1)];
            points.push([f64::from(x), f64::from(y), height * random(state)]);
            if x < cells && y < cells {
                triangles
                    .extend([[index, index + 1, index + cells + 2], [index, index + cells + 2, index + cells + 1]]);
            }
        }
        TriangleMesh::new(&points, &triangles).unwrap()
    }

    fn soup(triangles: u32, thickness: f64, state: &mut u64) -> TriangleMesh {
        let mut points = vec![];
        for _ in 0..triangles {
            let [a, b] = [0, 1].map(|_| Vector3::from_fn(|_, _| random(state)));
            let c = a + (b - a) * random(state) + Vector3::from_fn(|_, _| thickness * random(state));
            points.extend([a, b, c].map(<[f64; 3]>::from));
        }
        let triangles: Vec<[u32; 3]> = (0..triangles).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        TriangleMesh::new(&points, &triangles).unwrap()
    }

    #[test]
    fn the_nearest_triangle_is_the_first_of_the_equally_near_whatever_the_guess() {
        let mut state = 7;
        for mesh in [
            sheet(9, 0.0, &mut state),
            sheet(9, 0.4, &mut state),
            soup(150, 0.5, &mut state),
            soup(150, 1e-4, &mut state),
            soup(1, 0.5, &mut state),
        ] {
            let tree = Tree::new(&mesh);
            let bounds = mesh.bounds();
            for round in 0..200 {
                // Half of the points stand where many triangles are equally near: on corners and above them.
                let corner = tree.corners[round % tree.corners.len()][0];
                let point = match round % 4 {
                    0 => corner,
                    1 => corner + Vector3::z(),
                    _ => Vector3::from_fn(|axis, _| {
                        let share = 0.7 * random(&mut state) + 0.5;
                        bounds.min[axis] + share * (bounds.max[axis] - bounds.min[axis]) + 0.1 * random(&mut state)
                    }),
                };
                let all = tree.corners.iter().map(|corners| nearest_on_triangle(point, *corners).distance_sq);
                let (first, least) = all.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
                for guess in 0..tree.corners.len() {
                    let found = tree.nearest(point, guess);
                    assert_eq!((found.slot, found.on_triangle.distance_sq), (first, least), "{point:?} from {guess}");
                }
            }
        }
    }

    #[test]
    fn a_box_meets_the_triangles_whose_boxes_it_meets() {
        let mut state = 11;
        let mesh = soup(200, 0.3, &mut state);
        let tree = Tree::new(&mesh);
        for _ in 0..200 {
            let [a, b] = [0, 1].map(|_| Vector3::from_fn(|_, _| random(&mut state)));
            let (min, max) = (a.inf(&b), a.sup(&b));
            let mut found = vec![];
            tree.overlapping(min, max, |slot| found.push(slot));
            found.sort_unstable();
            let meets = |corners: &[Vector3<f64>; 3]| {
                let [low, high] = box_around(corners);
                (0..3).all(|axis| low[axis] <= max[axis] && min[axis] <= high[axis])
            };
            let wanted: Vec<usize> = (0..tree.corners.len()).filter(|slot| meets(&tree.corners[*slot])).collect();
            assert_eq!(found, wanted);
        }
    }
}
