//! The nodes of a cube of 8 × 8 × 8 as bits: a word a layer, a byte a row.

/// Nodes along a side.
pub(super) const SIDE: usize = 8;

pub(super) type Bits = [u64; SIDE];

/// Bits of the first and of the last node of each row, and of those of the first and of the last row.
const FIRST_X: u64 = 0x0101_0101_0101_0101;
const LAST_X: u64 = FIRST_X << 7;
const FIRST_Y: u64 = 0xff;
const LAST_Y: u64 = FIRST_Y << 56;

/// From which nodes the way to the next along each axis is free.
pub(super) struct Ways {
    next: [Bits; 3],
}

impl Ways {
    pub const ALL: Self = Self { next: [[!LAST_X; SIDE], [!LAST_Y; SIDE], [!0; SIDE]] };

    /// `distances` from the cube's first node on, and the steps to the next along each axis. A way is free where the distances at
    /// both ends sum to more than `free_way`.
    pub fn new(distances: &[f32], strides: [usize; 3], free_way: f32) -> Self {
        pulp::Arch::new().dispatch(Measure { distances, strides, free_way })
    }

    /// Those that do not leave a part.
    pub fn within(mut self, part: &Part) -> Self {
        for z in 0..SIDE {
            let [layer, above] = [z, z + 1].map(|z| part.layer(z));
            self.next[0][z] &= layer & layer >> 1;
            self.next[1][z] &= layer & layer >> 8;
            self.next[2][z] &= layer & above;
        }
        self
    }

    /// All nodes that free ways lead to from one, within the cube.
    pub fn from(&self, [x, y, z]: [usize; 3]) -> Bits {
        let [along_x, along_y, along_z] = &self.next;
        let flood = |mut layer: u64, z: usize| loop {
            let (x, y) = (along_x[z], along_y[z]);
            let wider = layer | (layer & x) << 1 | (layer >> 1 & x) | (layer & y) << 8 | (layer >> 8 & y);
            if wider == layer {
                return layer;
            }
            layer = wider;
        };
        let mut reached = [0; SIDE];
        reached[z] = flood(1 << (8 * y + x), z);
        loop {
            let before = reached;
            for z in 1..SIDE {
                reached[z] = flood(reached[z] | (reached[z - 1] & along_z[z - 1]), z);
            }
            for z in (0..SIDE - 1).rev() {
                reached[z] = flood(reached[z] | (reached[z + 1] & along_z[z]), z);
            }
            if reached == before {
                return reached;
            }
        }
    }
}

struct Measure<'a> {
    distances: &'a [f32],
    strides: [usize; 3],
    free_way: f32,
}

impl pulp::WithSimd for Measure<'_> {
    type Output = Ways;
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Ways {
        let Self { distances, strides, free_way } = self;
        let mut next = [[0; SIDE]; 3];
        for z in 0..SIDE {
            for y in 0..SIDE {
                let from = z * strides[2] + y * strides[1];
                for axis in 0..3 {
                    let [here, there] = [from, from + strides[axis]].map(|from| &distances[from..from + SIDE]);
                    let mut free = 0;
                    for x in 0..SIDE {
                        free |= u64::from(here[x] + there[x] > free_way) << x;
                    }
                    next[axis][z] |= free << (8 * y);
                }
            }
        }
        for z in 0..SIDE {
            next[0][z] &= !LAST_X;
            next[1][z] &= !LAST_Y;
        }
        Ways { next }
    }
}

/// A smaller cube.
pub(super) struct Part {
    first: [usize; 3],
    side: usize,
}

impl Part {
    /// Around a node, with so many nodes along a side: 8 or a half of that.
    pub fn new(node: [usize; 3], side: usize) -> Self {
        Self { first: node.map(|n| n / side * side), side }
    }

    /// Its nodes in a layer of the cube, or none beyond.
    fn layer(&self, z: usize) -> u64 {
        let [first_x, first_y, first_z] = self.first;
        if z < first_z || z >= first_z + self.side {
            return 0;
        }
        let of_side =
            |whole: u64, step: usize| if self.side == SIDE { whole } else { whole & ((1 << (step * self.side)) - 1) };
        (of_side(FIRST_X, 8) * of_side(FIRST_Y, 1)) << (8 * first_y + first_x)
    }

    /// Calls `visit` with each node on one of its faces, the axis of that, and whether it is the last along it.
    pub fn on_faces(&self, bits: &Bits, mut visit: impl FnMut([usize; 3], usize, bool)) {
        let last = self.first.map(|first| first + self.side - 1);
        for (z, layer) in bits.iter().copied().enumerate().filter(|(_, layer)| *layer != 0) {
            let of_layer = |is_face: bool| if is_face { !0 } else { 0 };
            let of_ends = |[x, y, end]: [usize; 3]| [FIRST_X << x, FIRST_Y << (8 * y), of_layer(z == end)];
            for (end, faces) in [self.first, last].map(of_ends).into_iter().enumerate() {
                for (axis, face) in faces.into_iter().enumerate() {
                    let mut left = layer & face;
                    while left != 0 {
                        let place = left.trailing_zeros() as usize;
                        visit([place % 8, place / 8, z], axis, end == 1);
                        left &= left - 1;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random;

    #[test]
    fn free_ways_lead_to_the_nodes_that_are_reached_step_by_step() {
        let mut state = 53;
        println!("seed {state}");
        let strides = [1, SIDE + 2, (SIDE + 2) * (SIDE + 1)];
        for round in 0..200 {
            let free_way = 0.9 + 0.4 * random(&mut state) as f32;
            let distances: Vec<f32> = (0..strides[2] * (SIDE + 1)).map(|_| random(&mut state).abs() as f32).collect();
            let start = [0, 3, 6].map(|shift| ((round * 2_654_435_761_usize) >> shift) % SIDE);
            let part = Part::new(start, if round % 2 == 0 { SIDE } else { SIDE / 2 });
            let is_inside = |node: &[usize; 3]| (0..3).all(|axis| node[axis] / part.side == start[axis] / part.side);
            let at = |node: [usize; 3]| distances[(0..3).map(|axis| node[axis] * strides[axis]).sum::<usize>()];
            let mut wanted = [0; SIDE];
            let mut waiting = vec![start];
            while let Some(node) = waiting.pop() {
                let [x, y, z] = node;
                wanted[z] |= 1 << (8 * y + x);
                for axis in 0..3 {
                    for step in [1, usize::MAX] {
                        let mut next = node;
                        next[axis] = node[axis].wrapping_add(step);
                        let is_new = |[x, y, z]: [usize; 3]| wanted[z] >> (8 * y + x) & 1 == 0;
                        if next[axis] < SIDE && is_inside(&next) && at(node) + at(next) > free_way && is_new(next) {
                            waiting.push(next);
                        }
                    }
                }
            }
            let found = Ways::new(&distances, strides, free_way).within(&part).from(start);
            assert_eq!(found, wanted, "round {round}");
            assert_faces(&part, &found);
        }
    }

    /// Each way out of the part from a node of it is found once.
    fn assert_faces(part: &Part, nodes: &Bits) {
        let mut found = vec![];
        part.on_faces(nodes, |node, axis, is_last| found.push((node, axis, is_last)));
        let mut wanted = vec![];
        for place in 0..SIDE * SIDE * SIDE {
            let node = [place % SIDE, place / SIDE % SIDE, place / SIDE / SIDE];
            if nodes[node[2]] >> (place % 64) & 1 == 1 {
                let ends =
                    |axis: usize| [part.first[axis], part.first[axis] + part.side - 1].map(|end| node[axis] == end);
                wanted.extend((0..3).filter(|axis| ends(*axis)[0]).map(|axis| (node, axis, false)));
                wanted.extend((0..3).filter(|axis| ends(*axis)[1]).map(|axis| (node, axis, true)));
            }
        }
        found.sort_unstable();
        wanted.sort_unstable();
        assert_eq!(found, wanted);
    }
}
