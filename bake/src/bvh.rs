pub mod bounding_disc;
pub mod hilbert;

use std::ops::ControlFlow;

use rayon::prelude::*;
use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::bvh::bounding_disc::BoundingDisc;
use crate::bvh::hilbert::{BITS, hilbert_index};
use crate::nearest::MAX_OPENED;
use crate::rounding::{POINT_ON_MESH_ROUNDING, PRUNE_SLACK, SINGLE_SLACK};
use crate::simd::{LANES, Lanes, VectorX8, max, min};
use crate::triangle::approx::{ApproxTriangle, UnitFrame};
use crate::triangle::{NearestOnTriangle, nearest_on_triangle};

/// How many children a node has. Their boxes are tested together.
pub(crate) const ARITY: usize = LANES;

/// Triangles in Hilbert order under an implicit tree: each level groups [`ARITY`] neighbours of the one below.
pub(crate) struct Bvh {
    /// Corners, in the order of the tree.
    pub corners: Vec<[Vector3<f64>; 3]>,
    /// For each of them its triangle in the mesh.
    pub triangles: Vec<u32>,
    /// Of each of them what is roughly so.
    pub rough: Vec<ApproxTriangle>,
    pub frame: UnitFrame,
    /// From the triangles up: `levels[0][i]` holds the boxes of triangles 8i to 8i + 7, `levels[1][i]` those of the
    /// groups 8i to 8i + 7 of level 0. The last level is the root alone.
    levels: Vec<Vec<Boxes>>,
    /// Around the triangles of each node: `bounding_discs[0][i]` of the triangles 8i to 8i + 7, and so on, as far up as they are asked for.
    bounding_discs: Vec<Vec<BoundingDisc>>,
    pub arch: pulp::Arch,
}

/// The boxes of a node's children, side by side. A place without a child holds a box that nothing is near to.
#[derive(Clone)]
struct Boxes {
    min: VectorX8<f64>,
    max: VectorX8<f64>,
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
    tree: &'a Bvh,
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

/// A box of points, and a point of the mesh that is near to all of them.
///
/// What is nearer to x than that point p fills the ball around x through p. A point t is in none of the balls of a box of such
/// points if it is in none of those around the box's corners: |x − t|² − |x − p|² is linear in x. Axes add up, so of a box
/// of t the least of it is the sum over the axes of the lesser at both ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PruneBound {
    /// Along each axis the first and the last of the points.
    ends: [[f64; 2]; 3],
    /// From there to the point of the mesh, squared.
    ways_sq: [[f64; 2]; 3],
    /// More than all rounding, of what is measured exactly as well.
    slack: f64,
}

impl PruneBound {
    #[inline(always)]
    pub fn new(ends: [[f64; 2]; 3], near: Vector3<f64>) -> Self {
        let mut ways_sq = [[0.0; 2]; 3];
        let (mut farthest_sq, mut largest) = (0.0_f64, 0.0_f64);
        for axis in 0..3 {
            let [first, last] = ends[axis].map(f64::abs);
            largest = largest.max(first).max(last).max(near[axis].abs());
            ways_sq[axis] = ends[axis].map(|end| (end - near[axis]) * (end - near[axis]));
            farthest_sq += max(ways_sq[axis][0], ways_sq[axis][1]);
        }
        // Far from the origin the point is off the mesh by some roundings of its coordinates.
        let rounding = POINT_ON_MESH_ROUNDING * largest * farthest_sq.sqrt();
        Self { ends, ways_sq, slack: SINGLE_SLACK * farthest_sq + rounding }
    }
}

/// No tree of u32 triangles is deeper; 7 of 8 children of each level wait at most.
pub(crate) const STACK: usize = 11 * ARITY;

impl Bvh {
    pub fn new(mesh: &TriangleMesh) -> Self {
        Self::with_patches(mesh, MAX_OPENED)
    }

    /// With [`Self::bounding_disc`] of the lowest nodes, and of those of each height that has more than so many.
    pub fn with_patches(mesh: &TriangleMesh, more_than: usize) -> Self {
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
            triangles.par_iter().map(|triangle| mesh.corner_points(mesh.triangles[*triangle as usize])).collect();

        let mut levels = vec![group(&corners, box_around)];
        while levels[levels.len() - 1].len() > 1 {
            levels.push(group(&levels[levels.len() - 1], Boxes::outer));
        }
        let frame = UnitFrame::around(&bounds);
        let rough = corners.par_iter().map(|corners| ApproxTriangle::new(*corners, &frame)).collect();
        let mut bounding_discs = vec![];
        let mut triangles_below = 1;
        for level in levels.iter().take_while(|level| level.len() > more_than || level.len() == levels[0].len()) {
            triangles_below *= ARITY;
            let of_node = |node: usize| BoundingDisc::around(&corners, node * triangles_below, triangles_below, &frame);
            bounding_discs.push((0..level.len()).into_par_iter().map(of_node).collect());
        }
        Self { corners, triangles, rough, frame, levels, bounding_discs, arch: pulp::Arch::new() }
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
            if distance_sq > best.on_triangle.distance_sq * (1.0 + PRUNE_SLACK) {
                continue;
            }
            let distances_sq = self.levels[level][node].distances_sq(point);
            let first_waiting = waiting;
            for (child, distance_sq) in distances_sq.into_iter().enumerate() {
                if distance_sq > best.on_triangle.distance_sq * (1.0 + PRUNE_SLACK) {
                    continue;
                }
                let index = node * ARITY + child;
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

    /// The nodes that may hold what is nearest to a point, all of one height, which comes back: 1 of those above the triangles, and
    /// more where there are more than `most` of some height.
    #[inline(always)]
    pub fn reached(&self, reach: &PruneBound, most: usize, found: &mut Vec<u32>, spare: &mut Vec<u32>) -> usize {
        let mut height = self.levels.len();
        found.clear();
        found.push(0);
        while height > 1 && found.len() <= most {
            self.open(height, found, reach, spare);
            std::mem::swap(found, spare);
            height -= 1;
        }
        height
    }

    /// Of nodes of some height those children that may hold what is nearest to a point: triangles where the height is 1.
    #[inline(always)]
    pub fn open(&self, height: usize, nodes: &[u32], reach: &PruneBound, found: &mut Vec<u32>) {
        found.clear();
        found.resize(nodes.len() * ARITY, 0);
        let mut count = 0;
        let children = if height > 1 { self.levels[height - 2].len() } else { self.corners.len() };
        for node in nodes {
            let excess = self.levels[height - 1][*node as usize].excess(reach);
            for child in 0..ARITY {
                let index = *node as usize * ARITY + child;
                found[count] = index as u32;
                // What is not a number is not beyond.
                let is_beyond = excess[child] > reach.slack;
                count += usize::from(!is_beyond & (index < children));
            }
        }
        found.truncate(count);
    }

    /// Around the triangles of a node that is no triangle, as high as [`Self::with_patches`] says.
    #[inline(always)]
    pub fn bounding_disc(&self, height: usize, node: u32) -> &BoundingDisc {
        &self.bounding_discs[height - 1][node as usize]
    }

    /// Calls `visit` with every triangle whose box is no farther from `point` than the root of `distance_sq`, and perhaps some
    /// more. Whatever the point, they come in the same order.
    pub fn near(&self, point: Vector3<f64>, distance_sq: f64, mut visit: impl FnMut(usize)) {
        let is_near =
            |boxes: &Boxes| boxes.distances_sq(point).map(|away_sq| away_sq <= distance_sq * (1.0 + PRUNE_SLACK));
        self.walk(is_near, |slot| {
            visit(slot);
            ControlFlow::Continue(())
        });
    }

    /// Calls `visit` with every triangle whose box meets the box from `min` to `max`, until it breaks off.
    pub fn overlapping(&self, min: Vector3<f64>, max: Vector3<f64>, visit: impl FnMut(usize) -> ControlFlow<()>) {
        let apart = |boxes: &Boxes, child: usize, axis: usize| {
            boxes.max[axis][child] < min[axis] || max[axis] < boxes.min[axis][child]
        };
        self.walk(|boxes| std::array::from_fn(|child| !(0..3).any(|axis| apart(boxes, child, axis))), visit);
    }

    /// Calls `visit` with every triangle whose box, and all boxes around it, are among those that `enters` picks of a node's
    /// children, until it breaks off.
    fn walk(&self, enters: impl Fn(&Boxes) -> Lanes<bool>, mut visit: impl FnMut(usize) -> ControlFlow<()>) {
        let mut stack = [(0, 0); STACK];
        let mut waiting = 1;
        stack[0] = (self.levels.len() - 1, 0);
        while waiting > 0 {
            waiting -= 1;
            let (level, node) = stack[waiting];
            let entered = enters(&self.levels[level][node]);
            for (child, _) in entered.iter().enumerate().filter(|(_, enters)| **enters) {
                let index = node * ARITY + child;
                if level == 0 {
                    if visit(index).is_break() {
                        return;
                    }
                } else {
                    stack[waiting] = (level - 1, index);
                    waiting += 1;
                }
            }
        }
    }
}

impl Boxes {
    const NOTHING: Self = Self { min: [[f64::INFINITY; ARITY]; 3], max: [[f64::NEG_INFINITY; ARITY]; 3] };

    #[inline(always)]
    fn distances_sq(&self, point: Vector3<f64>) -> Lanes<f64> {
        let mut distances_sq = [0.0; ARITY];
        for axis in 0..3 {
            for child in 0..ARITY {
                let below = self.min[axis][child] - point[axis];
                let above = point[axis] - self.max[axis][child];
                let outside = max(max(below, above), 0.0);
                distances_sq[child] += outside * outside;
            }
        }
        distances_sq
    }

    /// Of each child the least |x − t|² − |x − p|² of [`PruneBound`], where positive. Infinite where there is no child.
    #[inline(always)]
    fn excess(&self, reach: &PruneBound) -> Lanes<f64> {
        let mut excess = [0.0; ARITY];
        for axis in 0..3 {
            for child in 0..ARITY {
                let beyond = |end: usize| {
                    let point = reach.ends[axis][end];
                    let outside = max(max(self.min[axis][child] - point, point - self.max[axis][child]), 0.0);
                    outside * outside - reach.ways_sq[axis][end]
                };
                let (first, last) = (beyond(0), beyond(1));
                excess[child] += min(first, last);
            }
        }
        excess
    }

    /// The box around all children.
    fn outer(&self) -> [Vector3<f64>; 2] {
        let least = |of: &Lanes<f64>| of.iter().copied().fold(f64::INFINITY, f64::min);
        let most = |of: &Lanes<f64>| of.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        [Vector3::from_fn(|axis, _| least(&self.min[axis])), Vector3::from_fn(|axis, _| most(&self.max[axis]))]
    }
}

fn box_around([a, b, c]: &[Vector3<f64>; 3]) -> [Vector3<f64>; 2] {
    [a.inf(b).inf(c), a.sup(b).sup(c)]
}

fn group<T: Sync>(children: &[T], around: impl Fn(&T) -> [Vector3<f64>; 2] + Sync) -> Vec<Boxes> {
    let of_group = |children: &[T]| {
        let mut group = Boxes::NOTHING;
        for (place, child) in children.iter().enumerate() {
            let [min, max] = around(child);
            for axis in 0..3 {
                group.min[axis][place] = min[axis];
                group.max[axis][place] = max[axis];
            }
        }
        group
    };
    children.par_chunks(ARITY).map(of_group).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random;

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
            let tree = Bvh::new(&mesh);
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
    fn what_is_nearer_to_a_point_of_a_box_than_another_point_is_reached() {
        let mut state = 17;
        println!("seed {state}");
        let mut passed_over = 0;
        for mesh in [sheet(20, 0.3, &mut state), soup(500, 0.1, &mut state), soup(3, 0.5, &mut state)] {
            let tree = Bvh::new(&mesh);
            let bounds = mesh.bounds();
            for _ in 0..200 {
                let anywhere = |state: &mut u64| {
                    Vector3::from_fn(|axis, _| {
                        let share = random(state) + 0.5;
                        bounds.min[axis] + share * (bounds.max[axis] - bounds.min[axis]) + random(state)
                    })
                };
                let near = anywhere(&mut state);
                let low = anywhere(&mut state);
                let ends = [0, 1, 2].map(|axis| [low[axis], low[axis] + 0.3 * random(&mut state).abs()]);
                let reach = PruneBound::new(ends, near);
                let (mut found, mut spare) = (vec![], vec![]);
                let height = tree.reached(&reach, usize::MAX, &mut found, &mut spare);
                assert_eq!(height, 1);
                tree.open(1, &found, &reach, &mut spare);
                passed_over += tree.corners.len() - spare.len();
                for (slot, corners) in tree.corners.iter().enumerate() {
                    let is_nearer = (0..8_usize).any(|corner| {
                        let point = Vector3::from_fn(|axis, _| ends[axis][corner >> axis & 1]);
                        nearest_on_triangle(point, *corners).distance_sq <= (point - near).norm_squared()
                    });
                    assert!(!is_nearer || spare.contains(&(slot as u32)), "{slot} {reach:?}");
                }
            }
        }
        assert!(passed_over > 30_000, "{passed_over}");
    }

    #[test]
    fn a_box_meets_the_triangles_whose_boxes_it_meets() {
        let mut state = 11;
        let mesh = soup(200, 0.3, &mut state);
        let tree = Bvh::new(&mesh);
        for _ in 0..200 {
            let [a, b] = [0, 1].map(|_| Vector3::from_fn(|_, _| random(&mut state)));
            let (min, max) = (a.inf(&b), a.sup(&b));
            let mut found = vec![];
            tree.overlapping(min, max, |slot| {
                found.push(slot);
                ControlFlow::Continue(())
            });
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
