//! Flood fill within a cube of 8³ nodes, on bits: a word for each layer, a byte for each row.
//!
//! A set of nodes is flooded a layer at a time: shifts by 1 and 8 bits move it along x and y, and masks keep the moves
//! that follow clear edges.

/// Nodes along a side of the cube.
pub(super) const SIDE: usize = 8;

/// A set of nodes of the cube, by layers.
pub(super) type NodeBits = [u64; SIDE];

/// Bits of the first and of the last node of each row, and of the first and of the last row.
const FIRST_X: u64 = 0x0101_0101_0101_0101;
const LAST_X: u64 = FIRST_X << 7;
const FIRST_Y: u64 = 0xff;
const LAST_Y: u64 = FIRST_Y << 56;

/// For each axis, the nodes whose edge to the next node along it is clear.
pub(super) struct ClearEdges {
    axes: [NodeBits; 3],
}

impl ClearEdges {
    pub const ALL: Self = Self { axes: [[!LAST_X; SIDE], [!LAST_Y; SIDE], [!0; SIDE]] };

    /// An edge is clear if the distances at its ends sum to more than `min_sum`. `distances` begin at the cube's first
    /// node; `strides` lead to the next node along each axis.
    pub fn new(distances: &[f32], strides: [usize; 3], min_sum: f32) -> Self {
        pulp::Arch::new().dispatch(FindClearEdges { distances, strides, min_sum })
    }

    /// Keeps only the edges within a smaller cube.
    pub fn restricted_to(mut self, cube: &SubCube) -> Self {
        for z in 0..SIDE {
            let [layer, above] = [z, z + 1].map(|z| cube.layer(z));
            self.axes[0][z] &= layer & layer >> 1;
            self.axes[1][z] &= layer & layer >> 8;
            self.axes[2][z] &= layer & above;
        }
        self
    }

    /// All nodes that paths of clear edges reach from a node, itself included.
    pub fn reachable_from(&self, [x, y, z]: [usize; 3]) -> NodeBits {
        let [along_x, along_y, along_z] = &self.axes;
        let flood = |mut layer: u64, z: usize| loop {
            let (x, y) = (along_x[z], along_y[z]);
            let wider = layer | (layer & x) << 1 | (layer >> 1 & x) | (layer & y) << 8 | (layer >> 8 & y);
            if wider == layer {
                return layer;
            }
            layer = wider;
        };
        let mut nodes = [0; SIDE];
        nodes[z] = flood(1 << (8 * y + x), z);
        loop {
            let before = nodes;
            for z in 1..SIDE {
                nodes[z] = flood(nodes[z] | (nodes[z - 1] & along_z[z - 1]), z);
            }
            for z in (0..SIDE - 1).rev() {
                nodes[z] = flood(nodes[z] | (nodes[z + 1] & along_z[z]), z);
            }
            if nodes == before {
                return nodes;
            }
        }
    }
}

struct FindClearEdges<'a> {
    distances: &'a [f32],
    strides: [usize; 3],
    min_sum: f32,
}

impl pulp::WithSimd for FindClearEdges<'_> {
    type Output = ClearEdges;
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> ClearEdges {
        let Self { distances, strides, min_sum } = self;
        let mut axes = [[0; SIDE]; 3];
        for z in 0..SIDE {
            for y in 0..SIDE {
                let first = z * strides[2] + y * strides[1];
                for axis in 0..3 {
                    let [here, there] = [first, first + strides[axis]].map(|first| &distances[first..first + SIDE]);
                    let mut row = 0;
                    for x in 0..SIDE {
                        row |= u64::from(here[x] + there[x] > min_sum) << x;
                    }
                    axes[axis][z] |= row << (8 * y);
                }
            }
        }
        for z in 0..SIDE {
            axes[0][z] &= !LAST_X;
            axes[1][z] &= !LAST_Y;
        }
        ClearEdges { axes }
    }
}

/// An octree cell of the cube, or the cube itself.
pub(super) struct SubCube {
    first: [usize; 3],
    side: usize,
}

impl SubCube {
    /// The cell of `side`³ nodes that holds a node. `side` is 8 or 4.
    pub fn new(node: [usize; 3], side: usize) -> Self {
        Self { first: node.map(|n| n / side * side), side }
    }

    /// Its nodes in a layer of the cube.
    fn layer(&self, z: usize) -> u64 {
        let [first_x, first_y, first_z] = self.first;
        if z < first_z || z >= first_z + self.side {
            return 0;
        }
        let first_nodes =
            |whole: u64, step: usize| if self.side == SIDE { whole } else { whole & ((1 << (step * self.side)) - 1) };
        (first_nodes(FIRST_X, 8) * first_nodes(FIRST_Y, 1)) << (8 * first_y + first_x)
    }

    /// Calls `visit` with each node on one of its faces, the axis of that face, and whether it is the last along it.
    pub fn visit_faces(&self, nodes: &NodeBits, mut visit: impl FnMut([usize; 3], usize, bool)) {
        let last = self.first.map(|first| first + self.side - 1);
        for (z, layer) in nodes.iter().copied().enumerate().filter(|(_, layer)| *layer != 0) {
            let layer_if = |is_face: bool| if is_face { !0 } else { 0 };
            let faces = |[x, y, end]: [usize; 3]| [FIRST_X << x, FIRST_Y << (8 * y), layer_if(z == end)];
            for (end, faces) in [self.first, last].map(faces).into_iter().enumerate() {
                for (axis, face) in faces.into_iter().enumerate() {
                    let mut left = layer & face;
                    while left != 0 {
                        let bit = left.trailing_zeros() as usize;
                        visit([bit % 8, bit / 8, z], axis, end == 1);
                        left &= left - 1;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
