// The lowest point of an element by the Frank-Wolfe method: core/src/minimize/frank_wolfe.rs in f32 (Frank and Wolfe 1956; Macklin et
// al. 2020, §3.2). Each step goes towards the corner s with the lowest slope: x ← x + α (s − x), α = 2/(i + 2), i from 1 on.

/// Converged when the duality gap ∇φ(x)·(x − s) is at most this fraction of longest edge · slope bound.
const TOLERANCE = 1e-6;

fn minimize(element: Element) -> Minimum {
    var best = lowest_corner(element);
    var current = best;
    let tolerance = longest_edge(element) * query.slope_bound * TOLERANCE;
    for (var taken = 0u; taken < query.iterations; taken++) {
        let slopes = weight_slopes(element, current.sample.gradient);
        var min_slope = slopes.x;
        var target_corner = vec3f(1.0, 0.0, 0.0);
        if slopes.y < min_slope {
            min_slope = slopes.y;
            target_corner = vec3f(0.0, 1.0, 0.0);
        }
        if slopes.z < min_slope {
            min_slope = slopes.z;
            target_corner = vec3f(0.0, 0.0, 1.0);
        }
        let duality_gap = dot(current.weights, slopes) - min_slope;
        if duality_gap <= tolerance {
            best.is_converged = true;
            break;
        }
        let next = current.weights + (target_corner - current.weights) * (2.0 / (f32(taken) + 3.0));
        current = evaluate_weights(element, next);
        keep_lower(&best, current);
    }
    return best;
}
