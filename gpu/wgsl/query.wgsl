// What a query takes and leaves: its uniform, its buffers, a contact. Lengths are in the unit of the mesh.
//
// A shader is five of these files, one after the other:
//
//     query.wgsl                                         the bindings, which this file describes
//     grid_dense.wgsl | grid_sparse.wgsl                 the samples of a node and of a cell
//     grid.wgsl                                          φ, ∇φ and the smooth gradient at a point
//     frank_wolfe.wgsl | projected_gradient.wgsl         the lowest point of an element
//     contacts.wgsl                                      cull, search, report: the entry point `find_contacts`
//
// It is a second source of what sdf-core does, in f32: gpu/wgsl/check.py compares the two. Dispatch ⌈element_count / 64⌉ workgroups,
// with `counts` zero. By the default limits of WebGPU a dispatch has at most 65,535 × 64 elements, and a buffer 2,097,152 contacts:
// `first_element` starts a second, once the contacts of the first are read.
//
// Frames. The mesh is in the world. The grid has a frame of its own, in which node (i, j, k) is at spacing · (i, j, k): a local
// point p is at rotation · p + translation in the world, so that `translation` is where node (0, 0, 0) is. Compute it in f64.

struct Query {
    /// From the grid's frame to the world: orthonormal, determinant 1.
    rotation: mat3x3f,
    /// World position of node (0, 0, 0).
    translation: vec3f,
    /// Elements with φ ≤ margin somewhere are contacts.
    margin: f32,
    /// Nodes along x, y, z, each at least 2.
    nodes: vec3u,
    /// Distance between neighbouring nodes, and its reciprocal.
    spacing: f32,
    inv_spacing: f32,
    /// Lipschitz constant of the grid: its file's `slope_bound`.
    slope_bound: f32,
    /// Where |φ| is at least this, a sparse grid is coarse: its file's `band`; 3.4e38 for a dense grid.
    band: f32,
    /// Elements of this dispatch, and the index of the first of them.
    element_count: u32,
    first_element: u32,
    /// Corners of an element: 3 for faces, 2 for edges, 1 for vertices.
    corner_count: u32,
    /// Contacts that the buffer holds.
    capacity: u32,
    /// Largest number of steps of a search.
    iterations: u32,
}

struct Contact {
    /// World position of the element's point with the lowest φ found.
    point: vec3f,
    /// Index of the element.
    element: u32,
    /// Out of the shape, in the world; zero if the field has no gradient.
    normal: vec3f,
    /// φ at the point: negative inside.
    distance: f32,
    /// On or near the surface: point − φ g / |g|², with g the smooth gradient.
    surface_point: vec3f,
    /// |g|: near 1 for a distance, near 0 at a medial axis.
    slope: f32,
    /// Barycentric, in the order of the element's corners; zero beyond its last one.
    weights: vec3f,
    /// The bits below, and from bit 8 on the number of evaluations of φ.
    status: u32,
}

/// The search met its own condition for a local minimum before `iterations` were over.
const CONVERGED = 1u;
/// The point lies beyond the band of a sparse grid: the distance is coarse.
const BEYOND_BAND = 2u;
/// The point lies outside the grid: the distance is a lower bound.
const OUTSIDE_GRID = 4u;
/// The smooth gradient is zero: the normal is the interpolant's, or zero.
const DEGENERATE_GRADIENT = 8u;
/// For each corner k, SPANNED << k: its weight is above FEATURE_WEIGHT. One bit: the contact is on a vertex, two: on an edge.
const SPANNED = 16u;
const EVALUATIONS_SHIFT = 8u;
const FEATURE_WEIGHT = 1e-3;

struct Counts {
    /// Contacts found. Beyond `capacity` they are counted, not stored.
    contacts: atomic<u32>,
    /// Elements that were not culled, and searched.
    searched: atomic<u32>,
    /// Elements that were skipped: a coordinate is NaN, infinite or above MAX_COORDINATE.
    not_finite: atomic<u32>,
}

/// Largest coordinate: its square is finite in f32. Smaller lengths than its reciprocal count as zero.
const MAX_COORDINATE = 1e18;

@group(0) @binding(0) var<uniform> query: Query;
/// x, y, z of each vertex of the mesh, without padding.
@group(0) @binding(1) var<storage, read> points: array<f32>;
/// `corner_count` vertices of each element. An index beyond the points is clamped by the device, not reported.
@group(0) @binding(2) var<storage, read> elements: array<u32>;
/// In no order: sort by `element`.
@group(0) @binding(3) var<storage, read_write> contacts: array<Contact>;
@group(0) @binding(4) var<storage, read_write> counts: Counts;
// Bindings from 5 on are the grid's: grid_dense.wgsl, grid_sparse.wgsl.
