//! The nearest triangles of 8 × 8 × 8 nodes at once.
//!
//! What may be nearest to any of them is gathered once for all, and sifted twice: for each of eight cubes of 4 × 4 × 4 nodes,
//! and of these again for each of eight cubes of 2 × 2 × 2. The eight stand side by side in the lanes of registers, as do the
//! eight nodes in the end. Sifting is in f32 and keeps all that rounding leaves in doubt. What remains is measured in f64, with
//! the same bits as by [`Tree::nearest`].

use sdf_core::grid::Lattice;
use sdf_core::nalgebra::Vector3;

use crate::lanes_triangle::{LANES, Points, distances_sq};
use crate::rough_triangle::{Frame, Lanes, RoughTriangle, Seen};
use crate::tree::{Cube, NearestTriangle, Reached, Tree};

/// Nodes along each side.
pub(crate) const SIDE: usize = 8;

/// All of them.
pub(crate) const NODES: usize = SIDE * SIDE * SIDE;

/// More triangles than this are not sifted; each node is searched for by itself.
const MOST_TRIANGLES: usize = 1 << 13;

/// Where the nodes stand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nodes {
    /// Along each axis; of equal spacing.
    pub axes: [[f64; SIDE]; 3],
    pub spacing: f64,
    /// How many along each axis are asked for, the first of them.
    pub counts: [usize; 3],
}

/// The nearest triangle of each node, and room to work in.
pub(crate) struct Packet<'a> {
    tree: &'a Tree,
    /// By node, x fastest. What was not asked for is not set.
    nearest: Vec<NearestInPacket>,
    /// Nearest to the middle of the last packet.
    guess: usize,
    reached: Vec<Reached>,
    candidates: Vec<Candidate>,
    of_large: [Vec<Candidate>; LANES],
    of_small: [Vec<Candidate>; LANES],
    picked: Vec<u32>,
    seen: Vec<(u32, Seen)>,
}

/// What is nearest to a node.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NearestInPacket {
    /// In the order of the tree.
    pub slot: u32,
    pub distance_sq: f64,
}

/// A triangle that may be nearest to a node of a cube.
#[derive(Clone, Copy)]
struct Candidate {
    slot: u32,
    /// At v from the middle of the cube it is no nearer than `least` + v · `direction`.
    least: f32,
    direction: [f32; 3],
}

/// Eight cubes in a cube.
#[derive(Clone, Copy)]
struct Cubes {
    /// Of the outer cube, in the tree's frame, as all here.
    middle: [f32; 3],
    /// From there to the middles of the eight, along each axis.
    step: f32,
    half_side: f32,
    /// What bounds are off by at most.
    rounding: f32,
}

/// What is nearest to the middles of eight cubes so far.
struct Bests {
    slots: [u32; LANES],
    seen: Seen,
}

/// How near what is nearest to a point of each of eight cubes is at most.
struct Bounds {
    /// A of [`Tree::reaching`], and twice the rounding.
    most: Lanes,
    /// k e of the same.
    slope: [Lanes; 3],
}

impl Nodes {
    /// From the `first` on.
    pub fn of_lattice(lattice: &Lattice, first: [usize; 3], counts: [usize; 3]) -> Self {
        let mut axes = [[0.0; SIDE]; 3];
        for step in 0..SIDE {
            let node = lattice.node(first.map(|n| (n + step) as u32));
            for axis in 0..3 {
                axes[axis][step] = node[axis];
            }
        }
        Self { axes, spacing: lattice.spacing(), counts }
    }

    /// Some node from the `first` on is asked for.
    fn asks_from(&self, first: [usize; 3]) -> bool {
        (0..3).all(|axis| first[axis] < self.counts[axis])
    }

    pub fn at(&self, step: [usize; 3]) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.axes[axis][step[axis]])
    }
}

impl<'a> Packet<'a> {
    pub fn new(tree: &'a Tree) -> Self {
        Self {
            tree,
            nearest: vec![NearestInPacket::default(); NODES],
            guess: 0,
            reached: vec![],
            candidates: vec![],
            of_large: Default::default(),
            of_small: Default::default(),
            picked: vec![],
            seen: vec![],
        }
    }

    /// Finds the nearest triangle of each node. False where none is `within` so much of the mesh: then they are not set.
    pub fn measure(&mut self, nodes: &Nodes, within: f64) -> bool {
        let middle = Vector3::from_fn(|axis, _| 0.5 * (nodes.axes[axis][0] + nodes.axes[axis][SIDE - 1]));
        let nearest = self.tree.nearest(middle, self.guess);
        self.guess = nearest.slot;
        match self.tree.arch.dispatch(MeasureTogether { packet: self, nodes, within, middle, nearest }) {
            Outcome::Measured => true,
            Outcome::Beyond => false,
            Outcome::TooMany => {
                self.measure_each(nodes);
                true
            }
        }
    }

    /// Of a node that was asked for.
    pub fn nearest(&self, [x, y, z]: [usize; 3]) -> NearestInPacket {
        self.nearest[(z * SIDE + y) * SIDE + x]
    }

    /// A triangle near to what was measured last.
    pub fn guess(&self) -> usize {
        self.guess
    }

    fn measure_each(&mut self, nodes: &Nodes) {
        let mut guess = self.guess;
        for index in 0..NODES {
            let step = [index % SIDE, index / SIDE % SIDE, index / SIDE / SIDE];
            if nodes.asks_from(step) {
                let node = nodes.at(step);
                let NearestTriangle { slot, on_triangle } = self.tree.nearest(node, guess);
                guess = slot;
                self.nearest[index] = NearestInPacket { slot: slot as u32, distance_sq: on_triangle.distance_sq };
            }
        }
    }
}

struct MeasureTogether<'a, 'b> {
    packet: &'a mut Packet<'b>,
    nodes: &'a Nodes,
    within: f64,
    middle: Vector3<f64>,
    nearest: NearestTriangle,
}

enum Outcome {
    Measured,
    /// No node is as near as was asked.
    Beyond,
    /// More triangles may be nearest than are worth sifting.
    TooMany,
}

impl pulp::NullaryFnOnce for MeasureTogether<'_, '_> {
    type Output = Outcome;

    #[inline(always)]
    fn call(self) -> Outcome {
        let Self { packet, nodes, within, middle, nearest } = self;
        packet.measure_together(nodes, within, middle, nearest)
    }
}

impl Packet<'_> {
    #[inline(always)]
    fn measure_together(
        &mut self,
        nodes: &Nodes,
        within: f64,
        middle: Vector3<f64>,
        nearest: NearestTriangle,
    ) -> Outcome {
        let cube = Cube { middle, half_side: 0.5 * (SIDE - 1) as f64 * nodes.spacing };
        if !self.tree.reaching(cube, &nearest.on_triangle, MOST_TRIANGLES, &mut self.reached) {
            return Outcome::TooMany;
        }
        self.take_reached(nearest.slot);
        let Frame { per_length, .. } = self.tree.frame;
        let middle = self.tree.frame.local(middle);
        let spacing = (nodes.spacing * per_length) as f32;
        let farthest = middle.iter().fold(0.0_f32, |most, x| most.max(x.abs())) + SIDE as f32 * spacing;
        let rounding = Frame::rounding(farthest);
        let large = Cubes { middle, step: 2.0 * spacing, half_side: 1.5 * spacing, rounding };
        sift(&self.tree.rough, &self.candidates, &large, &mut self.picked, &mut self.seen, &mut self.of_large);
        // From the middle of a large cube to its corners, and what rounding adds.
        let reach = 3.0_f32.sqrt() * large.half_side + 2.0 * rounding;
        let beyond = (within * per_length) as f32 + reach;
        if self.of_large.iter().flatten().all(|candidate| candidate.least > beyond) {
            return Outcome::Beyond;
        }
        for octant in 0..LANES {
            let first = corner(octant).map(|side| side * SIDE / 2);
            if !nodes.asks_from(first) {
                continue;
            }
            let sides = sides(octant);
            let middle = [0, 1, 2].map(|axis: usize| middle[axis] + sides[axis] * large.step);
            let small = Cubes { middle, step: spacing, half_side: 0.5 * spacing, rounding };
            sift(
                &self.tree.rough,
                &self.of_large[octant],
                &small,
                &mut self.picked,
                &mut self.seen,
                &mut self.of_small,
            );
            for part in 0..LANES {
                let corner = corner(part);
                let first: [usize; 3] = [0, 1, 2].map(|axis: usize| first[axis] + 2 * corner[axis]);
                if nodes.asks_from(first) {
                    self.measure_eight(nodes, first, part, &small);
                }
            }
        }
        Outcome::Measured
    }

    /// Makes candidates of what was reached, that in the slot `nearest` the first.
    #[inline(always)]
    fn take_reached(&mut self, nearest: usize) {
        self.candidates.clear();
        for reached in &self.reached {
            let per_distance = if reached.distance > 0.0 { 1.0 / reached.distance } else { 0.0 };
            self.candidates.push(Candidate {
                slot: reached.slot as u32,
                least: (reached.distance * self.tree.frame.per_length) as f32,
                direction: reached.way.map(|way| (way * per_distance) as f32),
            });
            if reached.slot == nearest {
                let last = self.candidates.len() - 1;
                self.candidates.swap(0, last);
            }
        }
    }

    /// 2 × 2 × 2 nodes from the `first` on: a part of those cubes.
    #[inline(always)]
    fn measure_eight(&mut self, nodes: &Nodes, first: [usize; 3], part: usize, cubes: &Cubes) {
        let mut points: Points = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            for axis in 0..3 {
                points[axis][lane] = nodes.axes[axis][first[axis] + corner(lane)[axis]];
            }
        }
        let candidates = &self.of_small[part];
        let mut best_sq = distances_sq_of(self.tree, &points, candidates[0].slot);
        let mut slots = [candidates[0].slot; LANES];
        let mut most: Lanes = [0.0; LANES];
        for lane in 0..LANES {
            most[lane] = (best_sq[lane].sqrt() * self.tree.frame.per_length) as f32 + 2.0 * cubes.rounding;
        }
        let rest = &candidates[1..];
        pick(rest, &mut self.picked, &AtNodes { steps: steps(cubes.half_side), most });
        for picked in &self.picked {
            let slot = rest[*picked as usize].slot;
            let found_sq = distances_sq_of(self.tree, &points, slot);
            for lane in 0..LANES {
                let is_tied = (found_sq[lane] == best_sq[lane]) & (slot < slots[lane]);
                let is_nearer = (found_sq[lane] < best_sq[lane]) | is_tied;
                best_sq[lane] = if is_nearer { found_sq[lane] } else { best_sq[lane] };
                slots[lane] = if is_nearer { slot } else { slots[lane] };
            }
        }
        for lane in 0..LANES {
            let [x, y, z]: [usize; 3] = [0, 1, 2].map(|axis: usize| first[axis] + corner(lane)[axis]);
            self.nearest[(z * SIDE + y) * SIDE + x] = NearestInPacket { slot: slots[lane], distance_sq: best_sq[lane] };
        }
    }
}

/// Of the candidates of a cube those of each of eight cubes in it, the nearest to its middle first.
#[inline(always)]
fn sift(
    triangles: &[RoughTriangle],
    candidates: &[Candidate],
    cubes: &Cubes,
    picked: &mut Vec<u32>,
    seen: &mut Vec<(u32, Seen)>,
    of_cubes: &mut [Vec<Candidate>; LANES],
) {
    let Cubes { half_side, rounding, .. } = *cubes;
    let steps = steps(cubes.step);
    let mut middles = steps;
    for axis in 0..3 {
        for lane in 0..LANES {
            middles[axis][lane] += cubes.middle[axis];
        }
    }
    let first = triangles[candidates[0].slot as usize].seen_from(&middles);
    let mut bests = Bests { slots: [candidates[0].slot; LANES], seen: first };
    pick(candidates, picked, &InCubes { steps, bounds: bests.bounds(half_side, rounding), half_side });
    seen.clear();
    for picked in picked.iter() {
        let slot = candidates[*picked as usize].slot;
        let found = triangles[slot as usize].seen_from(&middles);
        bests.update(slot, &found);
        seen.push((slot, found));
    }
    bests.deal_out(seen, half_side, rounding, of_cubes);
}

/// Whether a candidate may be nearest, by lanes: 1, else 0.
trait Test {
    fn passed(&self, candidate: &Candidate) -> [u32; LANES];
}

/// At nodes that are no farther from the mesh than `most`.
struct AtNodes {
    steps: [Lanes; 3],
    most: Lanes,
}

/// Somewhere in cubes.
struct InCubes {
    steps: [Lanes; 3],
    bounds: Bounds,
    half_side: f32,
}

impl Test for AtNodes {
    #[inline(always)]
    fn passed(&self, candidate: &Candidate) -> [u32; LANES] {
        let least = candidate.least_at(&self.steps);
        let mut passed = [0; LANES];
        for lane in 0..LANES {
            passed[lane] = if least[lane] > self.most[lane] { 0 } else { 1 };
        }
        passed
    }
}

impl Test for InCubes {
    #[inline(always)]
    fn passed(&self, candidate: &Candidate) -> [u32; LANES] {
        let [x, y, z] = candidate.direction;
        self.bounds.passed(&candidate.least_at(&self.steps), &[[x; LANES], [y; LANES], [z; LANES]], self.half_side)
    }
}

#[inline(always)]
fn distances_sq_of(tree: &Tree, points: &Points, slot: u32) -> [f64; LANES] {
    let slot = slot as usize;
    distances_sq(points, &tree.corners[slot], tree.rough[slot].is_sliver)
}

/// The numbers of those candidates that pass in any lane. Without a branch for each, which would be hard to foretell.
#[inline(always)]
fn pick(candidates: &[Candidate], picked: &mut Vec<u32>, test: &impl Test) {
    picked.clear();
    picked.resize(candidates.len(), 0);
    let mut count = 0;
    for (number, candidate) in (0..).zip(candidates) {
        picked[count] = number;
        count += test.passed(candidate).iter().fold(0, |any, one| any | one) as usize;
    }
    picked.truncate(count);
}

impl Candidate {
    /// No nearer than this, at so many steps from the middle of its cube.
    #[inline(always)]
    fn least_at(&self, steps: &[Lanes; 3]) -> Lanes {
        let mut least = [0.0; LANES];
        for lane in 0..LANES {
            least[lane] = self.least
                + (steps[0][lane] * self.direction[0]
                    + steps[1][lane] * self.direction[1]
                    + steps[2][lane] * self.direction[2]);
        }
        least
    }
}

impl Bests {
    /// To each cube what may be nearest to a point of it.
    #[inline(always)]
    fn deal_out(&self, seen: &[(u32, Seen)], half_side: f32, rounding: f32, of_cubes: &mut [Vec<Candidate>; LANES]) {
        let bounds = self.bounds(half_side, rounding);
        of_cubes.iter_mut().for_each(Vec::clear);
        for (slot, found) in seen {
            let passed = bounds.passed(&found.least, &found.direction, half_side);
            let mut passed = (0..LANES).fold(0_u32, |bits, lane| bits | passed[lane] << lane);
            while passed != 0 {
                let lane = passed.trailing_zeros() as usize % LANES;
                passed &= passed - 1;
                let of_cube = &mut of_cubes[lane];
                let direction = [found.direction[0][lane], found.direction[1][lane], found.direction[2][lane]];
                of_cube.push(Candidate { slot: *slot, least: found.least[lane], direction });
                if *slot == self.slots[lane] {
                    let last = of_cube.len() - 1;
                    of_cube.swap(0, last);
                }
            }
        }
    }

    #[inline(always)]
    fn update(&mut self, slot: u32, found: &Seen) {
        for lane in 0..LANES {
            let is_nearer = found.most[lane] < self.seen.most[lane];
            self.slots[lane] = if is_nearer { slot } else { self.slots[lane] };
            self.seen.most[lane] = if is_nearer { found.most[lane] } else { self.seen.most[lane] };
            for axis in 0..3 {
                let best = &mut self.seen.direction[axis][lane];
                *best = if is_nearer { found.direction[axis][lane] } else { *best };
            }
        }
    }

    #[inline(always)]
    fn bounds(&self, half_side: f32, rounding: f32) -> Bounds {
        let mut bounds = Bounds { most: [0.0; LANES], slope: [[0.0; LANES]; 3] };
        for lane in 0..LANES {
            let distance = self.seen.most[lane];
            let hypotenuse = (distance * distance + 3.0 * half_side * half_side).sqrt();
            let share = distance / hypotenuse;
            bounds.most[lane] = hypotenuse + 2.0 * rounding;
            for axis in 0..3 {
                bounds.slope[axis][lane] = share * self.seen.direction[axis][lane];
            }
        }
        bounds
    }
}

impl Bounds {
    /// In which of the cubes a triangle may be nearest to a point: 1, else 0.
    #[inline(always)]
    fn passed(&self, least: &Lanes, direction: &[Lanes; 3], half_side: f32) -> [u32; LANES] {
        let mut passed = [0; LANES];
        for lane in 0..LANES {
            let apart = (self.slope[0][lane] - direction[0][lane]).abs()
                + (self.slope[1][lane] - direction[1][lane]).abs()
                + (self.slope[2][lane] - direction[2][lane]).abs();
            passed[lane] = if least[lane] > self.most[lane] + half_side * apart { 0 } else { 1 };
        }
        passed
    }
}

/// From a middle to those of eight parts, so far along each axis.
#[inline(always)]
fn steps(step: f32) -> [Lanes; 3] {
    let mut steps = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        for axis in 0..3 {
            steps[axis][lane] = step * sides(lane)[axis];
        }
    }
    steps
}

/// On which side of the middle one of eight parts lies, along each axis: 0 or 1.
#[inline(always)]
fn corner(part: usize) -> [usize; 3] {
    [part & 1, part >> 1 & 1, part >> 2 & 1]
}

/// The same as −1 or 1.
#[inline(always)]
fn sides(part: usize) -> [f32; 3] {
    corner(part).map(|side| 2.0 * side as f32 - 1.0)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::TriangleMesh;
    use crate::gradient_spread::tests::{random, random_vector};
    use crate::triangle::nearest_on_triangle;

    /// The instruction sets of this machine that the code is compiled for.
    pub(crate) fn instruction_sets() -> Vec<pulp::Arch> {
        #[cfg(target_arch = "x86_64")]
        let known = [
            Some(pulp::Arch::Scalar),
            pulp::x86::V3::try_new().map(pulp::Arch::V3),
            pulp::x86::V4::try_new().map(pulp::Arch::V4),
        ];
        #[cfg(not(target_arch = "x86_64"))]
        let known = [Some(pulp::Arch::new())];
        known.into_iter().flatten().collect()
    }

    /// Squares in the x-y plane cut in two, their corners moved by up to `height` along z.
    fn sheet(cells: u32, height: f64, state: &mut u64) -> Vec<[Vector3<f64>; 3]> {
        let row = cells + 1;
        let corners: Vec<Vector3<f64>> = (0..row * row)
            .map(|index| Vector3::new(f64::from(index % row), f64::from(index / row), height * random(state)))
            .collect();
        let at = |x: u32, y: u32| corners[(y * row + x) as usize];
        let squares = (0..cells).flat_map(|y| (0..cells).map(move |x| (x, y)));
        squares
            .flat_map(|(x, y)| {
                let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    /// Triangles anywhere, some turned, some long: with less `thickness`, thinner ones.
    fn soup(triangles: usize, size: f64, thickness: f64, state: &mut u64) -> Vec<[Vector3<f64>; 3]> {
        let triangle = |_| {
            let a = random_vector(state) * 4.0;
            let b = a + random_vector(state) * size;
            let c = a + (b - a) * random(state) + random_vector(state) * (size * thickness);
            [a, b, c]
        };
        (0..triangles).map(triangle).collect()
    }

    fn meshes(state: &mut u64) -> Vec<Vec<[Vector3<f64>; 3]>> {
        let one = soup(1, 1.0, 1.0, state);
        let mut without_area = soup(40, 1.0, 0.0, state);
        without_area.extend(soup(10, 0.0, 0.0, state));
        without_area.extend(one.clone());
        let mut twice = soup(60, 1.0, 1.0, state);
        // The same place, another winding: as near, and not the same triangle.
        twice.extend(twice.clone().into_iter().map(|[a, b, c]| [a, c, b]));
        vec![
            sheet(9, 0.0, state),
            sheet(9, 0.5, state),
            soup(200, 1.0, 1.0, state),
            soup(200, 0.05, 1.0, state),
            soup(50, 30.0, 1.0, state),
            soup(100, 1.0, 1e-3, state),
            soup(100, 1.0, 1e-9, state),
            one,
            without_area,
            twice,
        ]
    }

    fn mesh_of(triangles: &[[Vector3<f64>; 3]], scale: f64) -> TriangleMesh {
        let points: Vec<[f64; 3]> = triangles.iter().flatten().map(|corner| (corner * scale).into()).collect();
        let indices: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        TriangleMesh::new(&points, &indices).unwrap()
    }

    fn nodes(first: Vector3<f64>, spacing: f64, counts: [usize; 3]) -> Nodes {
        let axes = [0, 1, 2].map(|axis| std::array::from_fn(|step| first[axis] + spacing * step as f64));
        Nodes { axes, spacing, counts }
    }

    /// The first of the equally near of all triangles.
    fn nearest_of_all(tree: &Tree, point: Vector3<f64>) -> (usize, f64) {
        let all = tree.corners.iter().map(|corners| nearest_on_triangle(point, *corners).distance_sq);
        all.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
    }

    fn steps_of(counts: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
        let [x, y, z] = counts;
        (0..x * y * z).map(move |index| [index % x, index / x % y, index / x / y])
    }

    #[test]
    fn each_node_of_a_packet_has_the_first_of_the_nearest_of_all_triangles_on_any_instruction_set() {
        let mut state = 3;
        println!("seed {state}");
        for triangles in meshes(&mut state) {
            for scale in [1.0, 2.0_f64.powi(-90), 1e25] {
                let mesh = mesh_of(&triangles, scale);
                for spacing in [1.0, 0.25, 0.03, 5.0] {
                    // On the corners of the sheets, or anywhere; the last far away.
                    let first = random_vector(&mut state) * 4.0;
                    let round = (first / spacing).map(|x| x.round() * spacing);
                    let first = [first, round, first * 60.0][(random(&mut state).abs() * 2.3) as usize];
                    let counts = [8, 3, 5].map(|count| if spacing == 1.0 { SIDE } else { count });
                    let nodes = nodes(first * scale, spacing * scale, counts);
                    let wanted: Vec<_> = {
                        let tree = Tree::new(&mesh);
                        steps_of(counts).map(|step| nearest_of_all(&tree, nodes.at(step))).collect()
                    };
                    for arch in instruction_sets() {
                        let mut tree = Tree::new(&mesh);
                        tree.arch = arch;
                        let mut packet = Packet::new(&tree);
                        assert!(packet.measure(&nodes, f64::INFINITY));
                        for (step, wanted) in steps_of(counts).zip(&wanted) {
                            let found = packet.nearest(step);
                            let found = (found.slot as usize, found.distance_sq);
                            assert_eq!(found, *wanted, "{arch:?} {nodes:?} {step:?} of {} at {scale}", triangles.len());
                            let alone = tree.nearest(nodes.at(step), 0);
                            assert_eq!((alone.slot, alone.on_triangle.distance_sq), *wanted);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn where_more_triangles_may_be_nearest_than_are_sifted_each_node_is_searched_for() {
        let mut state = 5;
        let mesh = mesh_of(&soup(MOST_TRIANGLES + 500, 0.1, 1.0, &mut state), 1.0);
        let tree = Tree::new(&mesh);
        let mut packet = Packet::new(&tree);
        let nodes = nodes(Vector3::new(-30.0, -31.0, -29.0), 8.0, [SIDE; 3]);
        assert!(packet.measure(&nodes, f64::INFINITY));
        for step in steps_of([SIDE; 3]) {
            let alone = tree.nearest(nodes.at(step), 0);
            let found = packet.nearest(step);
            assert_eq!((found.slot as usize, found.distance_sq), (alone.slot, alone.on_triangle.distance_sq));
        }
    }

    #[test]
    fn a_packet_is_beyond_only_where_no_node_is_as_near_as_was_asked() {
        let mut state = 7;
        let mesh = mesh_of(&soup(100, 1.0, 1.0, &mut state), 1.0);
        let tree = Tree::new(&mesh);
        let mut packet = Packet::new(&tree);
        let mut beyond = 0;
        for _ in 0..200 {
            let nodes = nodes(random_vector(&mut state) * 6.0, 0.3, [SIDE; 3]);
            let distances =
                steps_of([SIDE; 3]).map(|step| tree.nearest(nodes.at(step), 0).on_triangle.distance_sq.sqrt());
            let nearest = distances.fold(f64::INFINITY, f64::min);
            assert!(packet.measure(&nodes, nearest), "{nodes:?}");
            beyond += u32::from(!packet.measure(&nodes, 0.5 * nearest));
        }
        assert!(beyond > 20, "{beyond}");
    }
}
