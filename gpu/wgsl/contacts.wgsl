// From an element to its contact, one thread an element: core/src/contact/cull.rs and core/src/contact/classify.rs in f32.
//
// 1. An element is culled if φ(centroid) − slope bound · max |corner − centroid| − rounding is above the margin.
// 2. `minimize` finds its lowest point.
// 3. If φ is within the margin there, it is reported, in the next place of `contacts`.

/// An element in the grid's frame: the point of weights w is corner + w.y · edge_1 + w.z · edge_2. A corner that it does not have is
/// its first one.
struct Element {
    corner: vec3f,
    edge_1: vec3f,
    edge_2: vec3f,
    has_corner: vec3<bool>,
}

struct Minimum {
    sample: Sample,
    weights: vec3f,
    evaluations: u32,
    is_converged: bool,
}

/// Rounding of φ in units of ε · length: core/src/rounding.rs.
const EVALUATION = 32.0;
const EPSILON = 0x1p-23;

@compute @workgroup_size(64)
fn find_contacts(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= query.element_count {
        return;
    }
    let index = query.first_element + id.x;
    let world = array(world_corner(index, 0u), world_corner(index, 1u), world_corner(index, 2u));
    if !(is_representable(world[0]) && is_representable(world[1]) && is_representable(world[2])) {
        atomicAdd(&counts.not_finite, 1u);
        return;
    }
    let has_corner = vec3u(0u, 1u, 2u) < vec3u(query.corner_count);
    let from_world = transpose(query.rotation);
    let corner = from_world * (world[0] - query.translation);
    let element = Element(corner, from_world * (world[1] - world[0]), from_world * (world[2] - world[0]), has_corner);
    if is_culled(element) {
        return;
    }
    atomicAdd(&counts.searched, 1u);
    let minimum = minimize(element);
    if minimum.sample.value > query.margin {
        return;
    }
    let place = atomicAdd(&counts.contacts, 1u);
    if place < query.capacity {
        let point = world[0] + (world[1] - world[0]) * minimum.weights.y + (world[2] - world[0]) * minimum.weights.z;
        contacts[place] = report(index, element, minimum, point);
    }
}

/// A corner's position in the world; that of the first if the element does not have it.
fn world_corner(element: u32, corner: u32) -> vec3f {
    let vertex = 3u * elements[element * query.corner_count + select(0u, corner, corner < query.corner_count)];
    return vec3f(points[vertex], points[vertex + 1u], points[vertex + 2u]);
}

/// Are all coordinates within ±MAX_COORDINATE? By their bits: a device may assume that there are no NaN and no infinities.
fn is_representable(point: vec3f) -> bool {
    return all((bitcast<vec3u>(point) & vec3u(0x7fffffffu)) <= vec3u(bitcast<u32>(f32(MAX_COORDINATE))));
}

fn is_culled(element: Element) -> bool {
    let to_centroid = (element.edge_1 + element.edge_2) / f32(query.corner_count);
    let centroid = element.corner + to_centroid;
    let reach = max(length(to_centroid), max(length(element.edge_1 - to_centroid), length(element.edge_2 - to_centroid)));
    let value = evaluate(centroid).value;
    let size = max(max(reach, abs(centroid.x)), max(abs(centroid.y), abs(centroid.z)));
    let rounding = EVALUATION * EPSILON * max(size * query.slope_bound, abs(value));
    return value - reach * query.slope_bound - rounding > query.margin;
}

fn evaluate_weights(element: Element, weights: vec3f) -> Minimum {
    let point = element.corner + element.edge_1 * weights.y + element.edge_2 * weights.z;
    return Minimum(evaluate(point), weights, 1u, false);
}

/// Where a search starts.
fn lowest_corner(element: Element) -> Minimum {
    var best = evaluate_weights(element, vec3f(1.0, 0.0, 0.0));
    if element.has_corner.y {
        keep_lower(&best, evaluate_weights(element, vec3f(0.0, 1.0, 0.0)));
    }
    if element.has_corner.z {
        keep_lower(&best, evaluate_weights(element, vec3f(0.0, 0.0, 1.0)));
    }
    return best;
}

/// Counts a candidate, and keeps it where it is lower.
fn keep_lower(best: ptr<function, Minimum>, candidate: Minimum) {
    (*best).evaluations += 1u;
    if candidate.sample.value < (*best).sample.value {
        (*best).sample = candidate.sample;
        (*best).weights = candidate.weights;
    }
}

/// ∂φ/∂w_k − ∂φ/∂w_0 = ∇φ·(x_k − x_0): zero for a corner that the element does not have, as for the first.
fn weight_slopes(element: Element, gradient: vec3f) -> vec3f {
    return vec3f(0.0, dot(gradient, element.edge_1), dot(gradient, element.edge_2));
}

fn longest_edge(element: Element) -> f32 {
    return max(length(element.edge_1), max(length(element.edge_2), length(element.edge_2 - element.edge_1)));
}

/// The contact at a minimum whose point in the world is `point`.
fn report(index: u32, element: Element, minimum: Minimum, point: vec3f) -> Contact {
    let sample = minimum.sample;
    let at = element.corner + element.edge_1 * minimum.weights.y + element.edge_2 * minimum.weights.z;
    var status = minimum.evaluations << EVALUATIONS_SHIFT;
    status |= select(0u, CONVERGED, minimum.is_converged);
    status |= select(0u, BEYOND_BAND, abs(sample.value) >= query.band);
    status |= select(0u, OUTSIDE_GRID, sample.is_outside);
    for (var k = 0u; k < 3u; k++) {
        status |= select(0u, SPANNED << k, minimum.weights[k] > FEATURE_WEIGHT);
    }
    var gradient = smooth_gradient(at);
    var slope = length(gradient);
    if slope < 1.0 / MAX_COORDINATE {
        status |= DEGENERATE_GRADIENT;
        gradient = sample.gradient;
        slope = length(gradient);
    }
    if slope < 1.0 / MAX_COORDINATE {
        return Contact(point, index, vec3f(), sample.value, point, 0.0, minimum.weights, status);
    }
    let normal = query.rotation * (gradient / slope);
    // Near a medial axis |g| goes to zero and φ does not: half of the full slope stands for it.
    let way = sample.value / max(slope, 0.5 * min(query.slope_bound, 1.0));
    return Contact(point, index, normal, sample.value, point - normal * way, slope, minimum.weights, status);
}
