// The samples of a dense grid: one f32 per node. 128 MiB, a storage buffer by the default limits of WebGPU, hold 322³ nodes.

/// x fastest, then y, then z: `distance` of the grid's file.
@group(0) @binding(5) var<storage, read> samples: array<f32>;

/// The sample of a node.
fn node_sample(node: vec3u) -> f32 {
    return samples[(node.z * query.nodes.y + node.y) * query.nodes.x + node.x];
}

/// The samples at a cell's corners, x fastest: 000, 100, 010, 110, 001, 101, 011, 111.
fn cell_samples(cell: vec3u) -> array<f32, 8> {
    let row = query.nodes.x;
    let layer = row * query.nodes.y;
    let a = cell.z * layer + cell.y * row + cell.x;
    let b = a + layer;
    return array(
        samples[a], samples[a + 1u], samples[a + row], samples[a + row + 1u],
        samples[b], samples[b + 1u], samples[b + row], samples[b + row + 1u],
    );
}
