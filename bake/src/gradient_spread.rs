//! How far apart the gradients of a distance can lie, and so by how much its trilinear interpolant can be off. The proof
//! stands in `docs/error-bounds.md`; the letters here are the same.

use sdf_core::nalgebra::Vector3;

/// Nothing is known of the gradients but that they are no longer than one: half a cell's diagonal over its side.
pub(crate) const MOST_ERROR: f64 = 0.866_025_403_784_438_7;

/// A triangle that is no sliver has a normal off by at most 2⁻⁵² over the least sine, 1e-7; and what is composed of such by
/// ten times that where [`LEAST_COSINE`] divides.
const NORMAL_ROUNDING: f64 = 1e-7;

/// In wider caps a gradient's share across is bounded by the cap alone.
const LEAST_COSINE: f64 = 0.1;

/// Unit normals, and a cap of the unit sphere around them: all directions u with u·axis ≥ cosine.
struct Cone<'a> {
    normals: &'a [Vector3<f64>],
    axis: Vector3<f64>,
    cosine: f64,
    sine: f64,
}

/// The most by which the interpolant of exact distances can be off, in spacings, where each gradient lies in one of these
/// cones. A cone is given by unit normals, of which it holds the nonnegative combinations; a zero is a
/// normal that is not known.
pub(crate) fn error_in_cones(cones: &[&[Vector3<f64>]]) -> f64 {
    if cones.iter().any(|normals| normals.is_empty() || normals.contains(&Vector3::zeros())) {
        return MOST_ERROR;
    }
    let cones: Vec<Cone> = cones.iter().map(|normals| Cone::around(normals)).collect();
    let by_ranges: f64 = axes(&cones).iter().map(|along| 0.25 * range(&cones, *along)).sum();
    (by_ball(&cones).min(by_ranges) + NORMAL_ROUNDING).min(MOST_ERROR)
}

fn by_ball(cones: &[Cone]) -> f64 {
    if let [cone] = cones {
        return MOST_ERROR * cone.sine;
    }
    let middle: Vector3<f64> = cones.iter().map(|cone| cone.axis).sum();
    let Some(middle) = middle.try_normalize(NORMAL_ROUNDING) else { return MOST_ERROR };
    let cosine = cones.iter().map(|cone| cone.range(middle)[0]).fold(1.0, f64::min);
    if cosine > 0.0 { MOST_ERROR * (1.0 - cosine * cosine).sqrt() } else { MOST_ERROR }
}

impl<'a> Cone<'a> {
    fn around(normals: &'a [Vector3<f64>]) -> Self {
        let farthest = |from: Vector3<f64>| farthest_along(normals.iter(), from).unwrap_or(from);
        let first = farthest(normals[0]);
        let second = farthest(first);
        let mut cap = Self::with_axis(normals, first + second);
        if cap.cosine <= first.dot(&cap.axis) * (1.0 - NORMAL_ROUNDING) {
            // A third sticks out: the cap of all three, if it holds them in its smaller half.
            let third = farthest(cap.axis);
            let around_three = (second - first).cross(&(third - first));
            let candidates = [around_three, -around_three, first + second + third];
            for other in candidates.map(|axis| Self::with_axis(normals, axis)) {
                if other.cosine > cap.cosine {
                    cap = other;
                }
            }
        }
        cap
    }

    fn with_axis(normals: &'a [Vector3<f64>], axis: Vector3<f64>) -> Self {
        let axis = axis.try_normalize(NORMAL_ROUNDING).unwrap_or(normals[0]);
        let least = normals.iter().map(|normal| normal.dot(&axis)).fold(1.0, lesser);
        if least <= 0.0 {
            return Self { normals, axis, cosine: least.max(-1.0), sine: 1.0 };
        }
        // The sine has its digits where the cosine is near one.
        let sine_sq = normals.iter().map(|normal| normal.cross(&axis).norm_squared()).fold(0.0, greater);
        let sine = sine_sq.sqrt().min(1.0);
        Self { normals, axis, cosine: (1.0 - sine * sine).sqrt(), sine }
    }

    /// The least and the greatest that a unit vector of the cone has along a direction.
    fn range(&self, along: Vector3<f64>) -> [f64; 2] {
        if self.cosine <= 0.0 {
            return [-1.0, 1.0];
        }
        let (height, across) = (self.axis.dot(&along), self.axis.cross(&along).norm());
        // cos(β ± θ), β the angle between axis and direction, but for where the cap holds the direction itself.
        let lowest = if -height >= self.cosine { -1.0 } else { height * self.cosine - across * self.sine };
        let highest = if height >= self.cosine { 1.0 } else { height * self.cosine + across * self.sine };
        if self.cosine < LEAST_COSINE {
            return [lowest, highest];
        }
        let shares = self.normals.iter().map(|normal| normal.dot(&along));
        let (least, greatest) =
            shares.fold((1.0, -1.0), |(least, greatest), share| (lesser(least, share), greater(greatest, share)));
        // The weights of a combination sum to between 1 and 1/cosine.
        let least = if least < 0.0 { least / self.cosine } else { least };
        let greatest = if greatest > 0.0 { greatest / self.cosine } else { greatest };
        [lowest.max(least), highest.min(greatest)]
    }
}

/// Along a direction, from the least of all cones to the greatest.
fn range(cones: &[Cone], along: Vector3<f64>) -> f64 {
    let ranges = cones.iter().map(|cone| cone.range(along));
    let [least, greatest] = ranges.fold([1.0_f64, -1.0_f64], |[a, b], [c, d]| [a.min(c), b.max(d)]);
    (greatest - least).max(0.0)
}

/// At right angles to each other, the first where the normals differ most.
fn axes(cones: &[Cone]) -> [Vector3<f64>; 3] {
    let farthest_from = |along: Vector3<f64>| {
        // Of each cone the first; of all the first of these.
        let of_cones = cones.iter().filter_map(|cone| farthest_along(cone.normals.iter(), along));
        of_cones.min_by(|a, b| a.dot(&along).total_cmp(&b.dot(&along)))
    };
    let middle = cones[0].axis;
    let first = farthest_from(middle).unwrap_or(middle);
    let second = farthest_from(first).unwrap_or(middle);
    let spread = (second - first).try_normalize(NORMAL_ROUNDING).unwrap_or_else(|| any_across(middle));
    let across = |v: Vector3<f64>| v - spread * v.dot(&spread);
    let next = across(middle).try_normalize(NORMAL_ROUNDING).unwrap_or_else(|| any_across(spread));
    [spread, next, spread.cross(&next)]
}

/// The first of those with the least share along a direction.
fn farthest_along<'a>(
    mut normals: impl Iterator<Item = &'a Vector3<f64>>,
    along: Vector3<f64>,
) -> Option<Vector3<f64>> {
    let mut farthest = normals.next()?;
    let mut least = farthest.dot(&along);
    for normal in normals {
        let share = normal.dot(&along);
        if share.total_cmp(&least).is_lt() {
            (farthest, least) = (normal, share);
        }
    }
    Some(*farthest)
}

/// One instruction, as `f64::min` is not: it minds NaN, which nothing here is.
fn lesser(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

fn greater(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

fn any_across(direction: Vector3<f64>) -> Vector3<f64> {
    let least = direction.iamin();
    direction.cross(&Vector3::from_fn(|axis, _| if axis == least { 1.0 } else { 0.0 })).normalize()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// SplitMix64, from −1 to 1.
    pub fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 * 0.5_f64.powi(52) - 1.0
    }

    pub fn random_vector(state: &mut u64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| random(state))
    }

    /// Whether a cone of these normals may hold a direction, as seen along some others.
    pub fn may_hold(normals: &[Vector3<f64>], direction: Vector3<f64>, state: &mut u64) -> bool {
        let cone = Cone::around(normals);
        (0..40).all(|_| {
            let along = random_vector(state).normalize();
            let [least, greatest] = cone.range(along);
            (least - 1e-9..=greatest + 1e-9).contains(&direction.dot(&along))
        })
    }

    #[test]
    fn a_cone_holds_the_combinations_of_its_normals() {
        let mut state = 3;
        for round in 0..3000 {
            let middle = random_vector(&mut state).normalize();
            let spread = 1.5 * random(&mut state).abs();
            let count = 1 + round % 6;
            let normals: Vec<_> =
                (0..count).map(|_| (middle + random_vector(&mut state) * spread).normalize()).collect();
            for _ in 0..10 {
                // Cubes: often one or two weigh nearly all.
                let sum: Vector3<f64> = normals.iter().map(|normal| normal * random(&mut state).abs().powi(3)).sum();
                let Some(direction) = sum.try_normalize(1e-6) else { continue };
                assert!(may_hold(&normals, direction, &mut state), "{direction} {normals:?}");
            }
        }
    }

    /// Σ wᵢ gᵢ·(xᵢ − x) with the gradient towards each corner the worst of them.
    #[test]
    fn no_choice_of_gradients_is_off_by_more() {
        let mut state = 5;
        let mut worst = 0.0_f64;
        for round in 0..3000 {
            let middle = random_vector(&mut state).normalize();
            let spread = random(&mut state).abs();
            let cones: Vec<Vec<_>> = (0..1 + round % 3)
                .map(|_| (0..3).map(|_| (middle + random_vector(&mut state) * spread).normalize()).collect())
                .collect();
            let slices: Vec<&[Vector3<f64>]> = cones.iter().map(|normals| &normals[..]).collect();
            let bound = error_in_cones(&slices);
            for _ in 0..10 {
                let share = random_vector(&mut state).abs();
                let gradients: Vec<Vector3<f64>> = cones
                    .iter()
                    .map(|normals| normals.iter().map(|normal| normal * random(&mut state).abs()).sum::<Vector3<f64>>())
                    .filter_map(|sum| sum.try_normalize(1e-6))
                    .chain(cones.iter().flatten().copied())
                    .collect();
                let of_corner = |corner: usize| {
                    let at = Vector3::from_fn(|axis, _| (corner >> axis & 1) as f64);
                    let weight: f64 = (0..3).map(|axis| 1.0 - (at[axis] - share[axis]).abs()).product();
                    weight * gradients.iter().map(|gradient| gradient.dot(&(at - share))).fold(-2.0, f64::max)
                };
                let off: f64 = (0..8).map(of_corner).sum();
                assert!(off <= bound + 1e-12, "{off} > {bound}: {cones:?}");
                worst = worst.max(off / bound);
            }
        }
        assert!(worst > 0.8, "{worst}: the bound is wider than it need be");
    }
}
