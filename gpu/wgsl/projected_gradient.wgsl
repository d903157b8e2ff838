// The lowest point of an element by projected gradient descent: core/src/minimize/projected_gradient.rs in f32 (Goldstein 1964; Macklin
// et al. 2020, §3.1): w ← ℙ(w − α ∂φ/∂w), with ℙ the projection to barycentric weights and α = STEP / (longest edge · slope bound).

/// Largest change of a weight in one step.
const STEP = 0.5;
/// Converged when no weight changes by more than this.
const TOLERANCE = 1e-6;

fn minimize(element: Element) -> Minimum {
    var best = lowest_corner(element);
    var current = best;
    let max_slope = longest_edge(element) * query.slope_bound;
    var rate = 0.0;
    if max_slope > 0.0 {
        rate = STEP / max_slope;
    }
    for (var taken = 0u; taken < query.iterations; taken++) {
        let slopes = weight_slopes(element, current.sample.gradient);
        let next = project_weights(element, current.weights - slopes * rate);
        let change = abs(next - current.weights);
        if max(change.x, max(change.y, change.z)) <= TOLERANCE {
            best.is_converged = true;
            break;
        }
        current = evaluate_weights(element, next);
        keep_lower(&best, current);
    }
    return best;
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
