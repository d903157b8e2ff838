// The samples of a sparse grid with u16 codes: bricks of 8 × 8 × 8 nodes near the surface, every eighth node elsewhere
// (docs/format.md). A node has the sample of its brick; if its slot has none, that of the coarse cell around it.
//
// A brick takes 1 KiB: 128 MiB, a storage buffer by the default limits of WebGPU, hold 131,072 bricks.

/// Two codes of 16 bits to a word, the first in the low half; 512 codes to a brick, x fastest. Sums of the file's differences.
@group(0) @binding(5) var<storage, read> codes: array<u32>;
/// For each slot, x fastest, the number of its brick, or NO_BRICK.
@group(0) @binding(6) var<storage, read> table: array<u32>;
/// For each brick: base and step. A sample is base + step · code.
@group(0) @binding(7) var<storage, read> scales: array<vec2f>;
/// Samples of the coarse grid, x fastest: one more along each axis than there are slots.
@group(0) @binding(8) var<storage, read> coarse: array<f32>;

const NO_BRICK = 0xffffffffu;

/// Slots along each axis: ⌈nodes / 8⌉.
fn slot_counts() -> vec3u {
    return (query.nodes + 7u) / 8u;
}

/// The number of the brick in a slot, or NO_BRICK.
fn brick_in_slot(slot: vec3u) -> u32 {
    let count = slot_counts();
    return table[(slot.z * count.y + slot.y) * count.x + slot.x];
}

/// A sample of a brick, by the node's index in it.
fn brick_sample(brick: u32, index: u32) -> f32 {
    let at = brick * 512u + index;
    let code = (codes[at / 2u] >> (16u * (at & 1u))) & 0xffffu;
    let scale = scales[brick];
    return scale.x + scale.y * f32(code);
}

/// Index of a node in its brick.
fn index_in_brick(node: vec3u) -> u32 {
    let local = node % 8u;
    return (local.z * 8u + local.y) * 8u + local.x;
}

/// The coarse grid's interpolant at a node.
fn coarse_sample(node: vec3u) -> f32 {
    let count = slot_counts() + 1u;
    let slot = node / 8u;
    let a = (slot.z * count.y + slot.y) * count.x + slot.x;
    let b = a + count.x * count.y;
    let corners = array(
        coarse[a], coarse[a + 1u], coarse[a + count.x], coarse[a + count.x + 1u],
        coarse[b], coarse[b + 1u], coarse[b + count.x], coarse[b + count.x + 1u],
    );
    return interpolate(corners, vec3f(node % 8u) / 8.0).w;
}

/// The sample of a node.
fn node_sample(node: vec3u) -> f32 {
    let brick = brick_in_slot(node / 8u);
    if brick == NO_BRICK {
        return coarse_sample(node);
    }
    return brick_sample(brick, index_in_brick(node));
}

/// The samples at a cell's corners, x fastest: 000, 100, 010, 110, 001, 101, 011, 111.
fn cell_samples(cell: vec3u) -> array<f32, 8> {
    let brick = brick_in_slot(cell / 8u);
    if all(cell % 8u < vec3u(7u)) && brick != NO_BRICK {
        let a = index_in_brick(cell);
        return array(
            brick_sample(brick, a), brick_sample(brick, a + 1u), brick_sample(brick, a + 8u), brick_sample(brick, a + 9u),
            brick_sample(brick, a + 64u), brick_sample(brick, a + 65u), brick_sample(brick, a + 72u), brick_sample(brick, a + 73u),
        );
    }
    var corners: array<f32, 8>;
    for (var k = 0u; k < 8u; k++) {
        corners[k] = node_sample(cell + vec3u(k & 1u, (k >> 1u) & 1u, k >> 2u));
    }
    return corners;
}
