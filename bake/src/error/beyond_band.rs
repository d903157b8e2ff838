//! Error bound of a brick that its values outside, beyond the band, need too: docs/error-bounds.md, "Beyond the band".
//!
//! A grid claims φ − d ≤ max(near, 3h²/(8B)) there, with `near` the brick's error bound. Interpolation exceeds the distance by
//! c h²/B at most, with c less than 3/8, and the rounding δ of samples comes on top.

/// (c, 3/8 − c) h²/B: what interpolation exceeds the distance by, and what is left for rounding.
fn excess_and_slack(spacing: f64, band: f64) -> (f64, f64) {
    let voxels = band / spacing;
    let factor = match () {
        () if voxels >= 3.0 => 0.3,
        () if voxels >= 1.0 => 0.325,
        () => 0.375,
    };
    let unit = spacing / voxels;
    (factor * unit, (0.375 - factor) * unit)
}

/// Least error bound of a brick whose samples are rounded by so much: zero where the grid claims no more without it.
pub fn least_brick_error(rounding: f64, spacing: f64, band: f64) -> f64 {
    let (excess, slack) = excess_and_slack(spacing, band);
    if rounding <= slack { 0.0 } else { excess + rounding }
}

/// Least error bound of a brick beyond the band once its samples are rounded again, by so much. `error` is its bound before.
pub fn least_brick_error_rounded_again(error: f64, rounding: f64, spacing: f64, band: f64) -> f64 {
    let (_, slack) = excess_and_slack(spacing, band);
    // A bound above the slack counts the first rounding, or that was below the slack.
    least_brick_error(rounding + error.min(slack), spacing, band)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean distance of a cell's corners from a point, less that of the point whose mean they are, in voxels: at random,
    /// and from there uphill.
    #[test]
    fn no_interpolant_of_distances_to_a_point_exceeds_them_by_more() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for distance in [1.0, 1.5, 2.0, 2.999, 3.0, 4.0, 6.0, 10.0, 50.0, 1000.0] {
            let excess = |[x, y, z, a, b, c]: [f64; 6]| {
                let length = (x * x + y * y + z * z).sqrt().max(1e-3);
                let (from, t) = ([x, y, z].map(|x| distance * x / length), [a, b, c]);
                let corner = |corner: usize| -> f64 {
                    let side = |axis: usize| (corner >> axis & 1) as f64;
                    let weight: f64 = (0..3).map(|axis| 1.0 - (side(axis) - t[axis]).abs()).product();
                    let at = |axis: usize| from[axis] + side(axis) - t[axis];
                    weight * (at(0) * at(0) + at(1) * at(1) + at(2) * at(2)).sqrt()
                };
                (0..8).map(corner).sum::<f64>() - distance
            };
            let mut worst = 0.0_f64;
            for _ in 0..40 {
                let mut at: [f64; 6] = std::array::from_fn(|k| if k < 3 { random() - 0.5 } else { random() });
                let (mut found, mut step) = (excess(at), 0.5);
                for _ in 0..2000 {
                    let mut near = at.map(|x| x + step * (random() - 0.5));
                    near[3..].iter_mut().for_each(|t| *t = t.clamp(0.0, 1.0));
                    if excess(near) > found {
                        (at, found) = (near, excess(near));
                    } else {
                        step = (0.99 * step).max(1e-3);
                    }
                }
                worst = worst.max(found);
            }
            let (allowed, slack) = excess_and_slack(1.0, distance);
            assert!(worst < allowed && worst > 0.6 * allowed, "{distance}: {worst}, {allowed}");
            assert!((allowed + slack - 0.375 / distance).abs() < 1e-12);
            // What a brick claims is enough, for samples rounded once or twice.
            for rounding in [1e-5, 0.01, 0.03] {
                let claimed = |least: f64| least.max(0.375 / distance) + 1e-12;
                let once = least_brick_error(rounding, 1.0, distance);
                assert!(claimed(once) >= allowed + rounding, "{distance}, {rounding}");
                let error = once.max(rounding);
                let twice = least_brick_error_rounded_again(error, 0.01, 1.0, distance).max(error + 0.01);
                assert!(claimed(twice) >= allowed + rounding + 0.01, "{distance}, {rounding}");
            }
        }
    }
}
