use super::sub_simplex::SubSimplex;
use super::{Certified, Minimizer, Minimum};
use crate::number::{Float, Real};
use crate::rounding::rounding;
use crate::simplex::mean;
use crate::{EnclosedSdf, Simplex};

/// Every isolated minimum of a field on a simplex: what §9 of the paper leaves open, the triangle that rests on several
/// bumps.
///
/// From any point of the simplex with a value below the level that is asked by a third of `tolerance` or more, a way
/// through the simplex leads to one of the minima without ever rising by more than `tolerance` above where it began. So a
/// dent goes unseen only if it is no deeper than that below the pass to a deeper one (its persistence: Edelsbrunner,
/// Letscher and Zomorodian 2002, "Topological Persistence and Simplification").
///
/// The simplex is cut until from every point of a piece a straight way to one of its corners rises by no more than a third of
/// that ([`EnclosedSdf::max_rise_to_corners`]), or the field is convex there and the least value of the piece known as well; pieces above the level
/// are dropped. Then each such exit is left for a lower one as far as pieces lead there. The least of the whole simplex, by a
/// certified search, is always among them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllMinima {
    /// How many pieces are looked at, at most.
    pub looks: u32,
    /// As a share of longest edge · slope bound.
    pub tolerance: f64,
    /// Of pieces on which the field is convex, and from an exit to the minimum.
    pub search: Certified,
}

impl Default for AllMinima {
    fn default() -> Self {
        Self { looks: 4096, tolerance: 1e-2, search: Certified { evaluations: 1024, ..Certified::default() } }
    }
}

/// Of fields within each other, each once, and of the values on either side of a comparison.
const MAX_ROUNDINGS: f64 = 16.0;

/// The straight way from one exit to another is looked at in so many parts.
const PARTS: u32 = 16;

/// Room for one piece of a simplex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place<R, const N: usize> {
    piece: SubSimplex<R, N>,
    /// Where its points are led.
    exit: Exit<R, N>,
    /// The values at the corners that a way leads to as well, else infinity.
    corners: [R; N],
    /// The last walk that came here, and whether it went on.
    walk: usize,
    is_left: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Exit<R, const N: usize> {
    weights: [R; N],
    value: R,
}

impl<R: Float, const N: usize> Exit<R, N> {
    /// By value, and where that is the same by place, so that no two walks lead to each other.
    fn is_below(&self, other: &Self) -> bool {
        self.value < other.value || (self.value == other.value && self.weights < other.weights)
    }
}

impl<R: Float, const N: usize> Default for Place<R, N> {
    fn default() -> Self {
        let piece = SubSimplex::whole();
        let exit = Exit { weights: piece.centroid(), value: R::zero() };
        Self { piece, exit, corners: [R::from_f64(f64::INFINITY); N], walk: 0, is_left: false }
    }
}

/// What [`AllMinima`] found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found<R: Real, const N: usize> {
    /// Of the certified search of the whole simplex; above the level if there is no other.
    pub least: Minimum<R, N>,
    /// How many minima were written, in rising order.
    pub count: usize,
    /// Whether these are all: neither the looks nor the room for pieces or minima ran out, and no value is no number.
    pub is_complete: bool,
    /// No point of the simplex has a value below this.
    pub lower_bound: R,
    /// How many times the field was asked, a look at a piece counted as one.
    pub evaluations: u32,
}

impl AllMinima {
    /// The minima with a value of at most `level`, on a point, segment or triangle whose corners are finite and within
    /// ±[`Real::MAX_COORDINATE`]. With less room than a few hundred pieces triangles are seldom searched to the end.
    pub fn minima<R: Float, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        level: R,
        places: &mut [Place<R, N>],
        minima: &mut [Minimum<R, N>],
    ) -> Found<R, N> {
        let (slope_bound, longest_edge) = (field.slope_bound(), simplex.longest_edge());
        let rounding = rounding(slope_bound, simplex.corners[0], longest_edge, level);
        let rise =
            longest_edge * R::from_f64(slope_bound * self.tolerance / 3.0) + rounding * R::from_f64(MAX_ROUNDINGS);
        let least = self.search.minimize_below(field, simplex, level);
        let evaluations = least.evaluations.to_f64() as u32;
        let mut found = Found { least, count: 0, is_complete: true, lower_bound: least.lower_bound, evaluations };
        if level < least.lower_bound {
            return found;
        }
        let mut search = Search { field, simplex, within: &self.search, rise, evaluations, is_complete: true };
        if let Some(first) = minima.first_mut().filter(|_| least.sample.value.le(level)) {
            *first = least;
            found.count = 1;
        }
        let used = search.cut_up(self.looks, level, places);
        let places = places.get_mut(..used).unwrap_or(&mut []);
        for walk in 1..=used {
            let Some(exit) = places.get(walk.wrapping_sub(1)).map(|place| place.exit) else { break };
            let is_new = places.iter().take(walk.wrapping_sub(1)).all(|place| place.exit != exit);
            if !is_new || search.leads_lower(walk, &exit, places) {
                continue;
            }
            let minimum = search.descend(&exit, places);
            if !minimum.sample.value.le(level) {
                continue;
            }
            let is_one_dent = |known: &&mut Minimum<R, N>| search.is_one_dent(&minimum, known);
            if let Some(known) = minima.iter_mut().take(found.count).find(is_one_dent) {
                *known = lower(*known, minimum);
            } else if let Some(free) = minima.get_mut(found.count) {
                *free = minimum;
                found.count = found.count.saturating_add(1);
            } else {
                search.is_complete = false;
                minima.last_mut().into_iter().for_each(|highest| *highest = lower(*highest, minimum));
            }
            sort(minima, found.count);
        }
        let is_complete = search.is_complete;
        for minimum in minima.iter_mut().take(found.count) {
            (minimum.lower_bound, minimum.converged) = (found.lower_bound, is_complete);
            minimum.evaluations = R::from_f64(f64::from(search.evaluations));
        }
        Found { is_complete, evaluations: search.evaluations, ..found }
    }
}

fn lower<R: Float, const N: usize>(a: Minimum<R, N>, b: Minimum<R, N>) -> Minimum<R, N> {
    if b.sample.value < a.sample.value { b } else { a }
}

/// The first so many, in rising order: all but one of them are so already.
fn sort<R: Float, const N: usize>(minima: &mut [Minimum<R, N>], count: usize) {
    for at in (1..count).rev() {
        if let Some([a, b]) = minima.get_mut(at.wrapping_sub(1)..=at)
            && b.sample.value < a.sample.value
        {
            core::mem::swap(a, b);
        }
    }
}

/// The least value of a piece, as far as it is known.
struct Least<R, const N: usize> {
    exit: Exit<R, N>,
    lower_bound: R,
}

struct Search<'a, R: Float, F, const N: usize> {
    field: &'a F,
    simplex: &'a Simplex<R, N>,
    within: &'a Certified,
    /// By how much a straight way to an exit may rise.
    rise: R,
    evaluations: u32,
    is_complete: bool,
}

impl<R: Float, F: EnclosedSdf, const N: usize> Search<'_, R, F, N> {
    /// Fills the first places with pieces that have an exit, which together hold all points with values of at most the level;
    /// returns how many.
    fn cut_up(&mut self, looks: u32, level: R, places: &mut [Place<R, N>]) -> usize {
        let Some(first) = places.first_mut() else {
            self.is_complete = false;
            return 0;
        };
        *first = Place::default();
        let (mut at, mut used) = (0, 1_usize);
        let mut looks = looks;
        while at < used {
            let last = places.get(used.wrapping_sub(1)).copied();
            let Some(piece) = places.get(at).map(|place| place.piece) else { break };
            let corners = piece.embed(self.simplex).corners;
            let enclosure = self.field.enclosure(mean(&corners), &corners);
            self.evaluations = self.evaluations.saturating_add(1);
            if level < enclosure.range.lower {
                if let (Some(place), Some(last)) = (places.get_mut(at), last) {
                    *place = last;
                }
                used = used.wrapping_sub(1);
                continue;
            }
            let is_convex = self.field.is_convex_on(&corners);
            let (place, is_gentle) = self.place(piece, &Simplex { corners }, is_convex);
            // To cut where the field is convex would make the least value of either part hard to find, not one.
            let may_cut = !is_gentle && !is_convex && looks > 0 && used < places.len();
            looks = looks.saturating_sub(1);
            if let Some([half, other]) = may_cut.then(|| piece.bisect(self.simplex)).flatten() {
                let free = places.iter_mut().skip(used).take(1);
                free.for_each(|place| *place = Place { piece: other, ..Place::default() });
                places.iter_mut().skip(at).take(1).for_each(|place| place.piece = half);
                used = used.saturating_add(1);
            } else {
                self.is_complete &= is_gentle && enclosure.range.lower <= enclosure.value;
                places.iter_mut().skip(at).take(1).for_each(|free| *free = place);
                at = at.saturating_add(1);
            }
        }
        used
    }

    /// A piece with its exit, and whether ways there rise by no more than allowed.
    fn place(&mut self, piece: SubSimplex<R, N>, corners: &Simplex<R, N>, is_convex: bool) -> (Place<R, N>, bool) {
        let values = corners.corners.map(|corner| self.field.value(corner));
        self.evaluations = self.evaluations.saturating_add(N as u32);
        let place = Place { piece, ..Place::default() };
        if is_convex {
            let least = self.least(&piece);
            let is_gentle = least.exit.value - self.rise <= least.lower_bound;
            return (Place { exit: least.exit, corners: values, ..place }, is_gentle);
        }
        let rises = self.field.max_rise_to_corners(&corners.corners);
        self.evaluations = self.evaluations.saturating_add(1);
        let mut corners = [R::from_f64(f64::INFINITY); N];
        let mut lowest = Exit { weights: piece.corners[0], value: values[0] };
        for (((gentle, weights), value), rise) in corners.iter_mut().zip(piece.corners).zip(values).zip(rises) {
            let here = Exit { weights, value };
            lowest = if here.is_below(&lowest) { here } else { lowest };
            if rise <= self.rise {
                *gentle = value;
            }
        }
        let gentle = piece.corners.iter().zip(corners).map(|(weights, value)| Exit { weights: *weights, value });
        let exit = gentle.fold(None, |best: Option<Exit<R, N>>, here| match best {
            _ if !here.value.is_finite() => best,
            Some(best) if !here.is_below(&best) => Some(best),
            _ => Some(here),
        });
        (Place { exit: exit.unwrap_or(lowest), corners, ..place }, exit.is_some())
    }

    /// Whether pieces lead from an exit to a lower one, over none that is higher by more than allowed.
    fn leads_lower(&self, walk: usize, from: &Exit<R, N>, places: &mut [Place<R, N>]) -> bool {
        let highest = from.value + self.rise;
        let mut corners = [from.weights; N];
        let mut values = [from.value; N];
        loop {
            for (at, value) in corners.iter().zip(values) {
                for place in places.iter_mut().filter(|place| value <= highest && place.walk != walk) {
                    if place.piece.contains(at) {
                        if place.exit.is_below(from) {
                            return true;
                        }
                        (place.walk, place.is_left) = (walk, false);
                    }
                }
            }
            let Some(next) = places.iter_mut().find(|place| place.walk == walk && !place.is_left) else { return false };
            next.is_left = true;
            (corners, values) = (next.piece.corners, next.corners);
        }
    }

    /// Whether a straight way between two minima certainly never rises far above the higher.
    fn is_one_dent(&self, a: &Minimum<R, N>, b: &Minimum<R, N>) -> bool {
        let highest = Real::max(a.sample.value, b.sample.value) + self.rise;
        let way = b.point - a.point;
        let at = |part: u32| a.point + way * R::from_f64(f64::from(part) / f64::from(PARTS));
        (0..PARTS).all(|part| {
            let ends = [at(part), at(part.saturating_add(1))];
            let [from, to] = ends.map(|end| self.field.value(end));
            let top = if self.field.is_convex_on(&ends) {
                Real::max(from, to)
            } else {
                from + self.field.max_rise_to_corners(&ends)[1]
            };
            top <= highest
        })
    }

    fn least(&mut self, piece: &SubSimplex<R, N>) -> Least<R, N> {
        let least = self.within.minimize(self.field, &piece.embed(self.simplex));
        self.evaluations = self.evaluations.saturating_add(least.evaluations.to_f64() as u32);
        let weights = piece.weights(least.weights);
        Least { exit: Exit { weights, value: least.sample.value }, lower_bound: least.lower_bound }
    }

    /// The lowest point that is found in the pieces around an exit.
    fn descend(&mut self, exit: &Exit<R, N>, places: &[Place<R, N>]) -> Minimum<R, N> {
        let mut best = *exit;
        for place in places.iter().filter(|place| place.piece.contains(&exit.weights)) {
            let least = self.least(&place.piece).exit;
            best = if least.value < best.value { least } else { best };
        }
        let point = self.simplex.point(best.weights);
        let sample = self.field.evaluate(point);
        let [lower_bound, evaluations] = [sample.value, R::zero()];
        Minimum { weights: best.weights, point, sample, lower_bound, evaluations, converged: false }
    }
}
