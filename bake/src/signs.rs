//! Which nodes of a block are inside, by winding number.
//!
//! Between two points whose distances sum to more than the way between them there is no triangle: each point of that way
//! lies in one of two balls without any. Along it the winding number changes as slowly as the mesh's rim allows. So a side
//! spreads from where it is sure, and the winding number is asked where nothing has spread to.

use sdf_core::nalgebra::Vector3;

use crate::MeshDistance;

/// A winding number near a point, and by how much that at the point may be another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Winding {
    pub value: f32,
    pub error: f32,
}

impl Winding {
    pub const UNKNOWN: Self = Self { value: 0.0, error: f32::INFINITY };

    fn is_known(self) -> bool {
        self.error < f32::INFINITY
    }

    pub fn is_inside(self) -> bool {
        self.value.abs() >= 0.5
    }

    /// The side is the same for all that the winding number may be.
    fn is_sure(self) -> bool {
        (self.value.abs() - 0.5).abs() > self.error
    }

    /// And its error, to which the last way added `loss`, leaves room for ways to come.
    fn may_go_on(self, loss: f64) -> bool {
        self.is_sure() && self.error <= MOST_CARRIED_ERROR && loss <= MOST_LOSS
    }
}

/// Two points whose distances sum to this many times the way between them have no triangle between them, though distances were
/// rounded to f32.
pub(crate) const FREE_WAY: f64 = 1.0 + 1e-6;

/// How many of the smallest steps of the largest coordinate neighbours may be farther apart than a spacing.
const STEPS_OFF: f64 = 8.0;

/// Winding numbers beyond this are not carried through triangles: of many shells one around the other the sum from afar is off by
/// more than a half, which does no harm while all that it can be is inside.
const MOST_CARRIED: f32 = 1.5;

/// A mesh without a rim has whole winding numbers. One that was summed and is farther from all of them is not carried.
const MOST_FRACTION: f32 = 0.25;

/// Nodes nearer to the surface than this part of a spacing are on it but for rounding.
const ON_SURFACE: f64 = 1e-4;

/// Nodes of a regular grid, x fastest.
pub(crate) struct NodeBlock<P> {
    pub counts: [usize; 3],
    pub spacing: f64,
    pub position: P,
}

/// A point beside a node of a block, with its winding number.
pub(crate) struct Known {
    pub node: [usize; 3],
    pub position: Vector3<f64>,
    /// From the node to there, in spacings.
    pub way: f64,
    /// No triangle is nearer to the point.
    pub distance: f32,
    pub winding: Winding,
}

impl<P: Fn([usize; 3]) -> Vector3<f64>> NodeBlock<P> {
    /// Negates the distances of all nodes inside. A distance may be less than the true one. The sides do not depend on what is
    /// `known`, only the time does. The winding numbers come back.
    pub fn sign(&self, mesh: &MeshDistance, known: &[Known], distances: &mut [f32]) -> Vec<Winding> {
        let mut spread = Spread::new(self, mesh, distances);
        for point in known {
            spread.accept(point);
        }
        // Through the surface from what is known, which takes less time than to ask.
        if spread.is_begun() {
            spread.give_sides(0.0, false);
        }
        // From far out first, where a side holds for the most nodes.
        for least in [4.0, 1.0] {
            spread.give_sides((least * self.spacing) as f32, true);
        }
        spread.spread_across();
        spread.give_sides(0.0, true);
        for (distance, winding) in distances.iter_mut().zip(spread.windings()) {
            *distance = if winding.is_inside() { -distance.abs() } else { distance.abs() };
        }
        spread.windings().collect()
    }

    fn rows(&self) -> impl Iterator<Item = [usize; 2]> + use<P> {
        let [_, rows, layers] = self.counts;
        (0..layers).flat_map(move |z| (0..rows).map(move |y| [y, z]))
    }
}

/// A block with one more node on each side, so that every node of the block has all its neighbours.
struct Spread<'a, P> {
    block: &'a NodeBlock<P>,
    mesh: &'a MeshDistance<'a>,
    /// To the next node along each axis.
    strides: [usize; 3],
    /// Of nodes around the block so negative that no way to them is free.
    distances: Vec<f32>,
    windings: Vec<Winding>,
    losses: Losses,
    /// [`FREE_WAY`], and more where coordinates are so large that nodes do not stand where the lattice says.
    free_way: f64,
    /// Nodes whose neighbours are yet to be looked at.
    queue: Vec<usize>,
}

impl<'a, P: Fn([usize; 3]) -> Vector3<f64>> Spread<'a, P> {
    fn new(block: &'a NodeBlock<P>, mesh: &'a MeshDistance<'a>, distances: &[f32]) -> Self {
        let [row, rows, layers] = block.counts.map(|n| n + 2);
        let mut padded = vec![f32::NEG_INFINITY; row * rows * layers];
        for ([y, z], distances) in block.rows().zip(distances.chunks_exact(block.counts[0])) {
            let from = ((z + 1) * rows + y + 1) * row + 1;
            for (padded, distance) in padded[from..].iter_mut().zip(distances) {
                *padded = distance.abs();
            }
        }
        let windings = vec![Winding::UNKNOWN; padded.len()];
        let losses = Losses::new(block, mesh);
        let ends = [[0; 3], block.counts.map(|n| n - 1)].map(&block.position);
        let farthest = ends.iter().map(|end| end.amax()).fold(0.0, f64::max);
        let free_way = FREE_WAY + STEPS_OFF * f64::EPSILON * farthest / block.spacing;
        let strides = [1, row, row * rows];
        Self { block, mesh, strides, distances: padded, windings, losses, free_way, queue: vec![] }
    }

    /// Of the block's nodes.
    fn windings(&self) -> impl Iterator<Item = Winding> + '_ {
        let rows = self.block.rows().map(|[y, z]| self.index([0, y, z]));
        rows.flat_map(|from| self.windings[from..from + self.block.counts[0]].iter().copied())
    }

    fn index(&self, node: [usize; 3]) -> usize {
        (0..3).map(|axis| (node[axis] + 1) * self.strides[axis]).sum()
    }

    fn node(&self, index: usize) -> [usize; 3] {
        let [_, row, layer] = self.strides;
        [index % row - 1, index % layer / row - 1, index / layer - 1]
    }

    fn position(&self, index: usize) -> Vector3<f64> {
        (self.block.position)(self.node(index))
    }

    fn accept(&mut self, known: &Known) {
        let index = self.index(known.node);
        if !self.windings[index].is_known() && self.is_free(index, known.distance, known.way) {
            self.take(index, known.winding, known.way, |_| known.position);
            self.spread();
        }
    }

    /// No triangle is between a node and a point so many spacings away with no triangle nearer than `distance`.
    fn is_free(&self, index: usize, distance: f32, way: f64) -> bool {
        if way == 0.0 {
            return !self.is_on_surface(index);
        }
        self.distances[index] + distance > (way * self.block.spacing * self.free_way) as f32
    }

    /// The winding number of a point so many spacings away, if that suffices.
    fn take(&mut self, index: usize, of: Winding, way: f64, from: impl FnOnce(&Self) -> Vector3<f64>) {
        let winding = self.along(index, of, way, from);
        if winding.is_sure() {
            self.windings[index] = winding;
            self.queue.push(index);
        }
    }

    /// At the end of a free way. It changes by what the rim adds at most; where that is too much, by what the rim says.
    fn along(&mut self, index: usize, of: Winding, way: f64, from: impl FnOnce(&Self) -> Vector3<f64>) -> Winding {
        if way == 0.0 || self.losses.are_none() {
            return of;
        }
        let node = self.node(index);
        let by = |loss: f64| Winding { error: of.error + (way * loss) as f32, ..of };
        let mut loss = self.losses.in_cube(node);
        if !by(loss).may_go_on(way * loss) {
            loss = self.losses.in_small_cube(self.block, self.mesh, node);
        }
        if by(loss).may_go_on(way * loss) {
            return by(loss);
        }
        let point = (self.block.position)(node);
        if by(loss).error > MOST_ERROR {
            let middle = (point + from(self)) * 0.5;
            let radius = 0.5 * way * self.block.spacing * FREE_WAY;
            loss = self.block.spacing * FREE_WAY * self.mesh.winding_slope(middle, radius);
        }
        let by_rim = self.by_rim(point, by(loss));
        if by_rim.is_sure() { by_rim } else { by(loss) }
    }

    /// With the fraction that the rim gives. Unknown where that does not tell the side for sure.
    fn by_rim(&self, point: Vector3<f64>, about: Winding) -> Winding {
        if about.error > MOST_ERROR {
            return Winding::UNKNOWN;
        }
        let Some(fraction) = self.mesh.winding_by_rim(point) else { return Winding::UNKNOWN };
        let value = fraction + (f64::from(about.value) - fraction).round();
        let winding = Winding { value: value as f32, error: RIM_ERROR };
        let agrees = (winding.value - about.value).abs() <= about.error + RIM_ERROR;
        if agrees { winding } else { Winding::UNKNOWN }
    }

    /// Spreads from the nodes of the queue, the first to come first: so by the shortest ways.
    fn spread(&mut self) {
        let free_way = (self.block.spacing * self.free_way) as f32;
        let mut next = 0;
        while let Some(index) = self.queue.get(next).copied() {
            next += 1;
            for stride in self.strides {
                for neighbour in [index - stride, index + stride] {
                    let is_free = self.distances[index] + self.distances[neighbour] > free_way;
                    if is_free && !self.windings[neighbour].is_known() {
                        self.take(neighbour, self.windings[index], 1.0, |spread| spread.position(index));
                    }
                }
            }
        }
        self.queue.clear();
    }

    fn spread_across(&mut self) {
        for [y, z] in self.block.rows() {
            let from = self.index([0, y, z]);
            for index in from..from + self.block.counts[0] {
                if !self.windings[index].is_known() {
                    self.take_across(index);
                    self.spread();
                }
            }
        }
    }

    /// Gives a side to nodes with at least this distance: to all of them where it `asks`.
    fn give_sides(&mut self, least: f32, asks: bool) {
        for [y, z] in self.block.rows() {
            let from = self.index([0, y, z]);
            for index in from..from + self.block.counts[0] {
                if self.windings[index].is_known() || self.distances[index] < least {
                    continue;
                }
                self.take_across(index);
                if !self.windings[index].is_known() {
                    self.take_through(index);
                }
                if asks && !self.windings[index].is_known() {
                    self.ask(index);
                }
                self.spread();
            }
        }
    }

    fn is_begun(&self) -> bool {
        self.windings.iter().any(|winding| winding.is_known())
    }

    fn ask(&mut self, index: usize) {
        let point = self.position(index);
        let is_on_surface = self.is_on_surface(index);
        let asked = self.mesh.winding_near(point, is_on_surface);
        let by_rim = if self.losses.are_none() || is_on_surface { asked } else { self.by_rim(point, asked) };
        let winding = if by_rim.is_sure() { by_rim } else { asked };
        self.windings[index] = winding;
        if winding.is_sure() {
            self.queue.push(index);
        }
    }

    /// The winding number of a neighbour across an edge or a corner of a cell, where the way is free as it was along no axis.
    fn take_across(&mut self, index: usize) {
        for (neighbour, way) in self.neighbours(index) {
            let winding = self.windings[neighbour];
            if way > 1.0 && winding.is_known() && self.is_free(index, self.distances[neighbour], way) {
                self.take(index, winding, way, |spread| spread.position(neighbour));
                if self.windings[index].is_known() {
                    return;
                }
            }
        }
    }

    /// The winding number of a neighbour, and what the triangles between add to it.
    fn take_through(&mut self, index: usize) {
        if self.is_on_surface(index) {
            return;
        }
        let known = |(neighbour, _): &(usize, f64)| self.may_be_carried(*neighbour) && !self.is_on_surface(*neighbour);
        let tried: Vec<_> = self.neighbours(index).filter(known).take(TRIES).collect();
        for (neighbour, way) in tried {
            let Winding { value, error } = self.windings[neighbour];
            let Some(step) = self.mesh.winding_step([neighbour, index].map(|end| self.position(end))) else { continue };
            self.take(index, Winding { value: value + step as f32, error }, way, |spread| spread.position(neighbour));
            if self.windings[index].is_known() {
                return;
            }
        }
    }

    fn may_be_carried(&self, index: usize) -> bool {
        let winding = self.windings[index];
        let is_whole = (winding.value - winding.value.round()).abs() <= MOST_FRACTION;
        winding.is_sure() && winding.value.abs() <= MOST_CARRIED && (is_whole || !self.losses.are_none())
    }

    fn is_on_surface(&self, index: usize) -> bool {
        f64::from(self.distances[index]) < ON_SURFACE * self.block.spacing
    }

    /// Along edges of cells, and across their faces and through them, with the way there in spacings.
    fn neighbours(&self, index: usize) -> impl Iterator<Item = (usize, f64)> + use<P> {
        let strides = self.strides;
        let first = index - strides.iter().sum::<usize>();
        STEPS.into_iter().map(move |step| {
            let way = (step.iter().filter(|along| **along != 1).count() as f64).sqrt();
            (first + (0..3).map(|axis| step[axis] * strides[axis]).sum::<usize>(), way)
        })
    }
}

/// From the node before a node along each axis to its neighbours.
const STEPS: [[usize; 3]; 26] = {
    let mut steps = [[0; 3]; 26];
    let mut index = 0;
    while index < 26 {
        let place = if index < 13 { index } else { index + 1 };
        steps[index] = [place % 3, place / 3 % 3, place / 9];
        index += 1;
    }
    steps
};

/// Neighbours from which it is tried to pass through the surface. It seldom fails but where the rim is near.
const TRIES: usize = 3;

/// With more, a fraction would not tell which whole number to add.
const MOST_ERROR: f32 = 0.45;

/// With more, a winding number is asked of the rim again before it goes on. With less that is asked too often; with much more,
/// sides that were reached by a long way do not spread on, and nodes beyond are asked one by one.
const MOST_CARRIED_ERROR: f32 = 0.3;

/// Where a way may add more than this to the error, the rim is near, and is asked each time.
const MOST_LOSS: f64 = 0.2;

/// What the rim says is exact but for rounding. Nearer to one half than this the side is what the sum over the triangles
/// tells, which is less exact.
const RIM_ERROR: f32 = 0.004;

/// By how much the winding number may change from a node to any of its neighbours, for each spacing of the way.
struct Losses {
    /// Of cubes of nodes, x fastest; none where there is no rim.
    of_cubes: Vec<f64>,
    /// Of the small cubes in each of them, where they were asked for; not a number where not yet.
    of_small_cubes: Vec<Option<Box<[f64; PARTS * PARTS * PARTS]>>>,
    counts: [usize; 3],
}

/// Nodes along a side of a cube, and of the small ones that are looked at where the rim is near.
const CUBE: usize = 8;
const SMALL_CUBE: usize = 2;
const PARTS: usize = CUBE / SMALL_CUBE;

impl Losses {
    fn new<P: Fn([usize; 3]) -> Vector3<f64>>(block: &NodeBlock<P>, mesh: &MeshDistance) -> Self {
        let counts = if mesh.has_rim() { block.counts.map(|n| n.div_ceil(CUBE)) } else { [0; 3] };
        let of_cube = |cube: usize| {
            let cube = [cube % counts[0], cube / counts[0] % counts[1], cube / counts[0] / counts[1]];
            block.loss(mesh, cube.map(|n| n * CUBE), CUBE)
        };
        let cubes = counts.iter().product();
        Self { of_cubes: (0..cubes).map(of_cube).collect(), of_small_cubes: vec![None; cubes], counts }
    }

    fn are_none(&self) -> bool {
        self.of_cubes.is_empty()
    }

    fn cube(&self, node: [usize; 3]) -> usize {
        let [x, y, z] = node.map(|n| n / CUBE);
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    fn in_cube(&self, node: [usize; 3]) -> f64 {
        self.of_cubes[self.cube(node)]
    }

    fn in_small_cube<P>(&mut self, block: &NodeBlock<P>, mesh: &MeshDistance, node: [usize; 3]) -> f64
    where
        P: Fn([usize; 3]) -> Vector3<f64>,
    {
        let cube = self.cube(node);
        let of_parts = self.of_small_cubes[cube].get_or_insert_with(|| Box::new([f64::NAN; PARTS * PARTS * PARTS]));
        let [x, y, z] = node.map(|n| n % CUBE / SMALL_CUBE);
        let loss = &mut of_parts[(z * PARTS + y) * PARTS + x];
        if loss.is_nan() {
            *loss = block.loss(mesh, node.map(|n| n / SMALL_CUBE * SMALL_CUBE), SMALL_CUBE);
        }
        *loss
    }
}

impl<P: Fn([usize; 3]) -> Vector3<f64>> NodeBlock<P> {
    /// In a cube of nodes, to the farthest neighbour.
    fn loss(&self, mesh: &MeshDistance, first: [usize; 3], side: usize) -> f64 {
        let last = std::array::from_fn(|axis| (first[axis] + side).min(self.counts[axis]) - 1);
        let [low, high] = [first, last].map(&self.position);
        let radius = 0.5 * (high - low).norm() + 3.0_f64.sqrt() * self.spacing * FREE_WAY;
        self.spacing * FREE_WAY * mesh.winding_slope((low + high) * 0.5, radius)
    }
}
