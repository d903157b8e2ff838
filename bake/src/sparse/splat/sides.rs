//! Which nodes of a brick are inside of a closed mesh: bits that flood along clear edges of the grid.
//!
//! An edge of the grid is *clear* if the distances at its ends sum to more than its length (`sign::flood_fill`): no
//! triangle meets it, and both ends are on one side. Layers of 8 × 8 nodes are words of 64 bits. Sides flood from the nodes
//! that `distances` decided. The caller tells those of other nodes, far from the surface first: their sides flood the farthest.

use crate::simd::bits_of_bytes;

/// Nodes of a brick.
pub(super) const NODES: usize = 512;

/// Bits of the nodes of each layer, x fastest.
pub(super) type NodeBits = [u64; 8];

/// For each axis, bit i: the edge from node i to the one before it along the axis is clear.
struct ClearEdges([NodeBits; 3]);

/// Distances, in voxels, above which nodes are seeds, one round after the other.
const SEED_DISTANCES: [f32; 3] = [1.0, 0.5, f32::NEG_INFINITY];

/// Nodes inside. `distances` are lower bounds; an edge is clear if its ends' sum to more than `clearance`. The sides of the
/// nodes `known` are those of `inside`. `is_inside(node)` tells the side of another one.
pub(super) fn nodes_inside(
    arch: pulp::Arch,
    distances: &[f32; NODES],
    [mut known, mut inside]: [NodeBits; 2],
    clearance: f32,
    mut is_inside: impl FnMut(usize) -> bool,
) -> NodeBits {
    for (inside, known) in inside.iter_mut().zip(known) {
        *inside &= known;
    }
    if known == [u64::MAX; 8] {
        return inside;
    }
    let edges = arch.dispatch(FindClearEdges { distances, clearance });
    edges.flood(&mut known, &mut inside);
    for min_distance in SEED_DISTANCES {
        for layer in 0..8 {
            let mut unknown = !known[layer];
            while unknown != 0 {
                let bit = unknown.trailing_zeros() as usize;
                unknown &= unknown - 1;
                let node = 64 * layer + bit;
                if min_distance < distances[node] {
                    known[layer] |= 1 << bit;
                    inside[layer] |= u64::from(is_inside(node)) << bit;
                    edges.flood(&mut known, &mut inside);
                    unknown &= !known[layer];
                }
            }
        }
    }
    inside
}

struct FindClearEdges<'a> {
    distances: &'a [f32; NODES],
    clearance: f32,
}

impl pulp::NullaryFnOnce for FindClearEdges<'_> {
    type Output = ClearEdges;

    #[inline(always)]
    fn call(self) -> ClearEdges {
        let Self { distances, clearance } = self;
        let mut edges = [[0_u64; 8]; 3];
        for layer in 0..8 {
            let here = &distances[64 * layer..64 * layer + 64];
            let mut is_clear = [[0_u8; 64]; 3];
            for node in 1..64 {
                is_clear[0][node] = u8::from(here[node] + here[node - 1] > clearance);
            }
            for node in 8..64 {
                is_clear[1][node] = u8::from(here[node] + here[node - 8] > clearance);
            }
            if layer > 0 {
                let below = &distances[64 * layer - 64..64 * layer];
                for node in 0..64 {
                    is_clear[2][node] = u8::from(here[node] + below[node] > clearance);
                }
            }
            for axis in 0..3 {
                edges[axis][layer] = bits_of_bytes(&is_clear[axis]);
            }
            // No edge leads from the first node of a row to the last of the row before.
            edges[0][layer] &= 0xfefe_fefe_fefe_fefe;
        }
        ClearEdges(edges)
    }
}

/// Nodes whose side is known, and those inside.
#[derive(Clone, Copy)]
struct Layer {
    known: u64,
    inside: u64,
}

impl Layer {
    /// Takes over the sides of the nodes `from` whose bits were moved to their neighbours.
    #[inline(always)]
    fn take(&mut self, from: u64, inside: u64) {
        let new = from & !self.known;
        self.known |= new;
        self.inside |= inside & new;
    }
}

impl ClearEdges {
    /// Carries sides along clear edges until nothing changes.
    fn flood(&self, known: &mut NodeBits, inside: &mut NodeBits) {
        let Self([along_x, along_y, along_z]) = self;
        loop {
            let mut changed = 0;
            for step in 0..16 {
                let z = if step < 8 { step } else { 15 - step };
                let mut layer = Layer { known: known[z], inside: inside[z] };
                if z > 0 {
                    layer.take(known[z - 1] & along_z[z], inside[z - 1]);
                }
                if z < 7 {
                    layer.take(known[z + 1] & along_z[z + 1], inside[z + 1]);
                }
                for _ in 0..3 {
                    let Layer { known, inside } = layer;
                    layer.take(known << 1 & along_x[z], inside << 1);
                    layer.take((known & along_x[z]) >> 1, inside >> 1);
                    layer.take(known << 8 & along_y[z], inside << 8);
                    layer.take((known & along_y[z]) >> 8, inside >> 8);
                }
                changed |= layer.known ^ known[z];
                (known[z], inside[z]) = (layer.known, layer.inside);
            }
            if changed == 0 {
                return;
            }
        }
    }
}
