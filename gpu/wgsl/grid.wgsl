// φ and its gradients at a point of the grid's frame: core/src/grid/evaluate.rs and core/src/grid/smooth.rs in f32.
//
// Inside the box φ is the trilinear interpolant of the samples. Outside, with P the nearest point of the box and d = |x − P|:
//
//     φ(P) ≥ 0:  φ = √(d² + φ(P)²)     ∇φ = (x − P)/φ + ∇φ‖ · φ(P)/φ
//     φ(P) < 0:  φ = φ(P) + d          ∇φ = (x − P)/d + ∇φ‖
//
// ∇φ‖ is ∇φ(P) without the components along which P does not move with x.

struct Sample {
    gradient: vec3f,
    value: f32,
    is_outside: bool,
}

/// The nearest point of the box, as a cell and the position in it.
struct Located {
    cell: vec3u,
    /// Position in the cell, 0 to 1 along each axis.
    fraction: vec3f,
    /// In cells from node (0, 0, 0).
    steps: vec3f,
    /// True along axes where the point was not clamped.
    is_inside: vec3<bool>,
}

fn locate(point: vec3f) -> Located {
    let cells = query.nodes - 1u;
    let unclamped = point * query.inv_spacing;
    let steps = clamp(unclamped, vec3f(), vec3f(cells));
    let cell = min(vec3u(steps), cells - 1u);
    return Located(cell, steps - vec3f(cell), steps, steps == unclamped);
}

/// Trilinear interpolant of the samples at a cell's corners (w), and its derivatives by the fraction (xyz).
fn interpolate(c: array<f32, 8>, fraction: vec3f) -> vec4f {
    let low = vec4f(c[0], c[2], c[4], c[6]);
    let along_x = vec4f(c[1], c[3], c[5], c[7]) - low;
    // Edges along x at the fraction: y of 0 and 1, z of 0 and 1.
    let edges = low + along_x * fraction.x;
    let along_y = edges.yw - edges.xz;
    let rows = edges.xz + along_y * fraction.y;
    let slopes = along_x.xz + (along_x.yw - along_x.xz) * fraction.y;
    let by_x = slopes.x + (slopes.y - slopes.x) * fraction.z;
    let by_y = along_y.x + (along_y.y - along_y.x) * fraction.z;
    let by_z = rows.y - rows.x;
    return vec4f(by_x, by_y, by_z, rows.x + by_z * fraction.z);
}

/// φ and ∇φ.
fn evaluate(point: vec3f) -> Sample {
    let at = locate(point);
    let interpolated = interpolate(cell_samples(at.cell), at.fraction);
    let gradient = interpolated.xyz * query.inv_spacing;
    let value = interpolated.w;
    let from_box = select(point - at.steps * query.spacing, vec3f(), at.is_inside);
    let distance = length(from_box);
    if distance == 0.0 {
        return Sample(gradient, value, false);
    }
    let along_box = select(vec3f(), gradient, at.is_inside);
    if value < 0.0 {
        return Sample(from_box / distance + along_box, value + distance, true);
    }
    let hypotenuse = length(vec2f(distance, value));
    return Sample(from_box / hypotenuse + along_box * (value / hypotenuse), hypotenuse, true);
}

/// Nodes along each axis that the smooth gradient depends on.
const TAPS = 6u;

/// Weights of six nodes in a row, from `first` on: in the spline S, and in its derivative by the position in cells.
struct Taps {
    first: u32,
    weights: array<f32, TAPS>,
    slopes: array<f32, TAPS>,
}

/// S(x) = Σ_j f_j w(x/h − j), w(t) = (8 β³(t) − β³(t − 1) − β³(t + 1)) / 6: the cubic B-spline of filtered samples. Beyond the
/// lattice samples go on along straight lines, f_{−i} = (1 + i) f_0 − i f_1.
fn spline_taps(cell: u32, u: f32, last: u32) -> Taps {
    let v = 1.0 - u;
    let u2 = u * u;
    let u3 = u2 * u;
    // β³ and (β³)′ at the nodes −1 to 2 about the cell, times 6 and 2.
    let spline = vec4f(v * v * v, 3.0 * u3 - 6.0 * u2 + 4.0, 3.0 * (u + u2 - u3) + 1.0, u3);
    let slope = vec4f(-v * v, (3.0 * u - 4.0) * u, (2.0 - 3.0 * u) * u + 1.0, u2);
    var weights = filter_taps(spline, 1.0 / 36.0);
    var slopes = filter_taps(slope, 1.0 / 12.0);

    // As many of the six nodes as there are; weights of those beyond the lattice go to the last two inside.
    let first = clamp(i32(cell) - 2, 0, max(i32(last) - 5, 0));
    var taps = Taps(u32(first), array<f32, TAPS>(), array<f32, TAPS>());
    for (var tap = 0u; tap < TAPS; tap++) {
        let node = i32(cell + tap) - 2;
        let nearest = clamp(node, 0, i32(last));
        let beyond = node - nearest;
        let excess = f32(abs(beyond));
        let at = nearest - first;
        taps.weights[at] += weights[tap] * (1.0 + excess);
        taps.slopes[at] += slopes[tap] * (1.0 + excess);
        if beyond != 0 {
            let next = at - sign(beyond);
            taps.weights[next] -= weights[tap] * excess;
            taps.slopes[next] -= slopes[tap] * excess;
        }
    }
    return taps;
}

/// The filter (−1, 8, −1) of the weights of four nodes, times `factor`: the weights of six.
fn filter_taps(w: vec4f, factor: f32) -> array<f32, TAPS> {
    return array(
        -w.x * factor, (8.0 * w.x - w.y) * factor, (8.0 * w.y - w.x - w.z) * factor,
        (8.0 * w.z - w.y - w.w) * factor, (8.0 * w.w - w.z) * factor, -w.w * factor,
    );
}

/// ∇S, continuous where ∇φ jumps. Outside the box, with P and d as above: (|φ(P)| ∇S(P) + x − P) / √(d² + φ(P)²).
fn smooth_gradient(point: vec3f) -> vec3f {
    let at = locate(point);
    let last = query.nodes - 1u;
    var x = spline_taps(at.cell.x, at.fraction.x, last.x);
    var y = spline_taps(at.cell.y, at.fraction.y, last.y);
    var z = spline_taps(at.cell.z, at.fraction.z, last.z);
    var sum = vec3f();
    for (var k = 0u; k < TAPS; k++) {
        for (var j = 0u; j < TAPS; j++) {
            var value = 0.0;
            var slope = 0.0;
            for (var i = 0u; i < TAPS; i++) {
                // A lattice of fewer than six nodes: the weights beyond it are zero.
                let f = node_sample(min(vec3u(x.first + i, y.first + j, z.first + k), last));
                value += f * x.weights[i];
                slope += f * x.slopes[i];
            }
            sum += vec3f(slope * y.weights[j], value * y.slopes[j], value * y.weights[j])
                * vec3f(z.weights[k], z.weights[k], z.slopes[k]);
        }
    }
    let gradient = sum * query.inv_spacing;
    if all(at.is_inside) {
        return gradient;
    }
    let from_box = select(point - at.steps * query.spacing, vec3f(), at.is_inside);
    let value = abs(interpolate(cell_samples(at.cell), at.fraction).w);
    let hypotenuse = length(vec2f(length(from_box), value));
    if hypotenuse < 1.0 / MAX_COORDINATE {
        return gradient;
    }
    return from_box / hypotenuse + gradient * (value / hypotenuse);
}
