// The lowest point of an element by projected gradient descent: core/src/minimize/projected_gradient.rs in f32 (Goldstein 1964; Macklin
// et al. 2020, §3.1): w ← ℙ(w − α ∂φ/∂w), with ℙ the projection to barycentric weights and α by the last step s and the change y of
// ∂φ/∂w along it, s·s / s·y (Barzilai and Borwein 1988). A step that ends no lower is taken back to where the tangents at its ends meet.

/// Converged when the next step falls by at most this fraction of longest edge · slope bound, by the tangents before it.
const TOLERANCE = 1e-6;
/// Largest α, over that with which no weight changes by more than 1, and its largest growth in a step.
const MAX_RATE = 64.0;
const MAX_GROWTH = 4.0;
/// Smallest part that is left of a step that is taken back; 1 minus this is the largest.
const MIN_FRACTION = 0.1;

fn minimize(element: Element) -> Minimum {
    var best = lowest_corner(element);
    let max_slope = longest_edge(element) * query.slope_bound;
    var unit = 0.0;
    if max_slope > 0.0 {
        unit = 1.0 / max_slope;
    }
    var rate = unit;
    var slopes = weight_slopes(element, best.sample.gradient);
    // Known, and not counted again.
    var trial = evaluate_weights(element, steepest_corner(slopes));
    for (var taken = 0u; taken < query.iterations; taken++) {
        let is_kept = trial.sample.value < best.sample.value;
        let step = trial.weights - best.weights;
        let trial_slopes = weight_slopes(element, trial.sample.gradient);
        let slope = dot(step, slopes);
        let trial_slope = dot(step, trial_slopes);

        let curvature = trial_slope - slope;
        let square = dot(step, step);
        let is_curved = square < curvature * unit * MAX_RATE;
        let inverse = 1.0 / select(1.0, curvature, is_curved);
        let max_rate = select(rate * 0.5, min(unit * MAX_RATE, rate * MAX_GROWTH), is_kept);
        let is_known = is_curved && square * inverse < max_rate;
        rate = select(max_rate, square * inverse, is_known);

        let meeting = (trial_slope - (trial.sample.value - best.sample.value)) * inverse;
        let crease = clamp(select(0.5, meeting, is_curved), MIN_FRACTION, 1.0 - MIN_FRACTION);
        let level = clamp(select(0.5, -slope * inverse, is_curved), 0.0, 1.0);
        let from_slopes = slopes + (trial_slopes - slopes) * select(level, 1.0, is_kept);
        let from_weights = best.weights + step * select(crease, 1.0, is_kept);
        let next = project_weights(element, from_weights - from_slopes * rate);
        let to_next = dot(from_weights - next, from_slopes);
        let min_slope = min(from_slopes.x, min(from_slopes.y, from_slopes.z));
        // While α grows, the next step is no measure: the element is.
        let of_kept = select(dot(from_weights, from_slopes) - min_slope, to_next, is_known);
        let fall = select(to_next - slope * crease, of_kept, is_kept);
        if is_kept {
            best.sample = trial.sample;
            best.weights = trial.weights;
            slopes = trial_slopes;
        }
        if fall <= max_slope * TOLERANCE {
            best.is_converged = true;
            return best;
        }
        trial = evaluate_weights(element, next);
        best.evaluations += 1u;
    }
    if trial.sample.value < best.sample.value {
        best.sample = trial.sample;
        best.weights = trial.weights;
    }
    return best;
}

/// Weights of the corner to which a tangent with these slopes falls most.
fn steepest_corner(slopes: vec3f) -> vec3f {
    if slopes.z < min(slopes.x, slopes.y) {
        return vec3f(0.0, 0.0, 1.0);
    }
    return select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), slopes.y < slopes.x);
}

/// The nearest weights that are not negative and have the sum 1: w_k = max(v_k − τ, 0), with v sorted in descending order and
/// τ = max_k (Σ_{i ≤ k} v_i − 1) / k (Held, Wolfe and Crowder 1974). Corners that the element does not have keep the weight 0.
fn project_weights(element: Element, weights: vec3f) -> vec3f {
    // Far below all others, so that they do not raise τ.
    let v = select(vec3f(-1e6), weights, element.has_corner);
    let largest = max(v.x, max(v.y, v.z));
    let smallest = min(v.x, min(v.y, v.z));
    let middle = max(min(v.x, v.y), min(max(v.x, v.y), v.z));
    let one = largest - 1.0;
    let two = one + middle;
    let excess = max(one, max(two / 2.0, (two + smallest) / 3.0));
    let positive = max(v - excess, vec3f());
    return positive / (positive.x + positive.y + positive.z);
}
