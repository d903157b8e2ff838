//! An upper bound of a minimum of convex functions on a simplex.
//!
//! A convex function is on a simplex at most the linear interpolant of its values at the corners. So the maximum of min_t f_t is at most
//! max_w min_t Σ_i w_i f_t(c_i): the value of a matrix game (von Neumann 1928). For any weights λ_t ≥ 0 with sum 1,
//! max_i Σ_t λ_t f_t(c_i) is an upper bound of it, whatever rounding did to λ; it is the value at the best λ, which mixes no more
//! functions than there are corners.

/// For each function its values at the corners.
type Rows<'a> = &'a [[f64; 3]];

/// An upper bound, and where the interpolants come near it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GameValue {
    pub upper: f64,
    /// Barycentric; zero beyond the simplex's corners.
    pub weights: [f64; 3],
}

/// The value of the game on a simplex of two or three corners, or any bound that is at most `enough`.
///
/// The mixture that is best so far has a worst answer w; the function lowest at w enters, and the best mixture with it is taken.
pub(super) fn game_value(rows: Rows, corners: usize, enough: f64) -> GameValue {
    let mut best = Mixture { value: GameValue { upper: f64::INFINITY, weights: [0.0; 3] }, rows: [usize::MAX; 3] };
    for (index, row) in rows.iter().enumerate() {
        let highest = (1..corners).fold(0, |highest, corner| if row[corner] > row[highest] { corner } else { highest });
        if row[highest] < best.value.upper {
            let weights = std::array::from_fn(|corner| f64::from(u8::from(corner == highest)));
            best = Mixture { value: GameValue { upper: row[highest], weights }, rows: [index, usize::MAX, usize::MAX] };
        }
    }
    while best.value.upper > enough {
        let at = |row: &[f64; 3]| (0..corners).map(|corner| row[corner] * best.value.weights[corner]).sum::<f64>();
        let (mut entering, mut lowest) = (usize::MAX, best.value.upper);
        for (index, row) in rows.iter().enumerate() {
            let value = at(row);
            if value < lowest {
                (entering, lowest) = (index, value);
            }
        }
        if entering == usize::MAX {
            break;
        }
        let (before, used) = (best, best.rows.into_iter().filter(|row| *row != usize::MAX));
        let t = &rows[entering];
        for (position, first) in used.clone().enumerate() {
            let s = &rows[first];
            for (i, j) in [(0, 1), (1, 2), (2, 0)].into_iter().take(if corners < 3 { 1 } else { 3 }) {
                let slope = t[i] - s[i] - t[j] + s[j];
                let (lambda, weight) = ((s[j] - s[i]) / slope, (s[j] - t[j]) / slope);
                if !(0.0..=1.0).contains(&lambda) || !weight.is_finite() {
                    continue;
                }
                let weight = weight.clamp(0.0, 1.0);
                let mut weights = [0.0; 3];
                (weights[i], weights[j]) = (weight, 1.0 - weight);
                best.keep_lower(corners, [entering, first, usize::MAX], &[(lambda, t), (1.0 - lambda, s)], weights);
            }
            for second in used.clone().take(if corners < 3 { 0 } else { position }) {
                let Some((lambdas, weights)) = equalizers([t, s, &rows[second]]) else { continue };
                let mixture = [(lambdas[0], t), (lambdas[1], s), (lambdas[2], &rows[second])];
                best.keep_lower(corners, [entering, first, second], &mixture, weights);
            }
        }
        if best.value.upper >= before.value.upper {
            break;
        }
    }
    best.value
}

/// A bound, and the functions that are mixed for it.
#[derive(Clone, Copy)]
struct Mixture {
    value: GameValue,
    /// Up to three indices, then `usize::MAX`.
    rows: [usize; 3],
}

impl Mixture {
    fn keep_lower(&mut self, corners: usize, rows: [usize; 3], lambdas: &[(f64, &[f64; 3])], weights: [f64; 3]) {
        let at_corner = |corner: usize| lambdas.iter().map(|(lambda, row)| lambda * row[corner]).sum::<f64>();
        let upper = (0..corners).map(at_corner).fold(f64::NEG_INFINITY, f64::max);
        if upper < self.value.upper {
            *self = Self { value: GameValue { upper, weights }, rows };
        }
    }
}

/// Weights of three functions that make the mixture equal at all corners, and weights of the corners at which all three are equal:
/// 1ᵀ adj(M) and adj(M) 1, each divided by its sum. `None` where a function's weight is negative.
fn equalizers(rows: [&[f64; 3]; 3]) -> Option<([f64; 3], [f64; 3])> {
    // The game stays the same when a number is taken from all values; near zero they keep more digits.
    let shift = rows[0][0];
    let m = |t: usize, i: usize| rows[t % 3][i % 3] - shift;
    let cofactor = |t: usize, i: usize| m(t + 1, i + 1) * m(t + 2, i + 2) - m(t + 1, i + 2) * m(t + 2, i + 1);
    let lambdas: [f64; 3] = std::array::from_fn(|t| (0..3).map(|i| cofactor(t, i)).sum());
    let weights: [f64; 3] = std::array::from_fn(|i| (0..3).map(|t| cofactor(t, i)).sum());
    let sum: f64 = lambdas.iter().sum();
    let lambdas = lambdas.map(|lambda| lambda / sum);
    let is_valid = lambdas.iter().all(|lambda| lambda.is_finite() && *lambda >= 0.0);
    let weights = weights.map(|weight| (weight / sum).clamp(0.0, 1.0));
    let sum: f64 = weights.iter().sum();
    (is_valid && sum > 0.0).then(|| (lambdas, weights.map(|weight| weight / sum)))
}

#[cfg(test)]
mod tests;
