//! Contacts of many elements, several at a time.
//!
//! The elements that a field's local bounds do not cull are asked at their centroids side by side in [`Lanes`], and those
//! that pass are searched side by side where [`Minimizer::PAYS_IN_LANES`]. Compiled for wide vectors, as a crate such as
//! `pulp` does at run time with what is inlined into a function, a lane costs a fraction of a scalar.
//!
//! ```
//! use sdf_core::contact::{Element, Outcome, batch, contact};
//! use sdf_core::minimize::FrankWolfe;
//! use sdf_core::{Simplex, nalgebra::Vector3, shapes::Sphere};
//! let sphere = Sphere::new(1.0).unwrap();
//! let corner = |x: f64, y, z| Vector3::new(x, y, z);
//! let elements: Vec<_> = (0..20).map(|id| Element {
//!     id,
//!     vertices: [id, id + 1, id + 2],
//!     simplex: Simplex { corners: [corner(-1.0, -1.0, f64::from(id)), corner(1.0, -1.0, 0.9), corner(0.0, 1.0, 0.9)] },
//! }).collect();
//! let mut outcomes = vec![Outcome::Culled; elements.len()];
//! let search = FrankWolfe::default();
//! batch::contacts::<_, _, _, _, 3, 8>(&sphere, &search, 0.0, &elements, |at, outcome| outcomes[at] = outcome);
//! for (element, outcome) in elements.iter().zip(outcomes) {
//!     assert_eq!(outcome, contact(&sphere, &search, 0.0, element));
//! }
//! ```

use core::array::from_fn;

use nalgebra::Vector3;

use super::{BoxBounds, Element, ElementKind, Outcome, bounds_in_box, judge};
use crate::minimize::{Minimizer, Minimum};
use crate::real::{Float, Real};
use crate::simplex::LowerBound;
use crate::{Lanes, Sdf, Simplex};

/// What [`contact`](super::contact) answers of each of the elements, bit for bit, in `L` lanes, at least one.
///
/// `take` is given each outcome once, with the element's place in the slice, in an order of no account.
#[inline(always)]
pub fn contacts<R, F, M, T, const N: usize, const L: usize>(
    field: &F,
    minimizer: &M,
    margin: R,
    elements: &[Element<R, N>],
    mut take: T,
) where
    R: Float,
    F: Sdf,
    M: Minimizer<N>,
    T: FnMut(usize, Outcome<R, N>),
{
    const { assert!(L > 0) };
    if ElementKind::of(N).is_none() {
        return elements.iter().enumerate().for_each(|(place, _)| take(place, Outcome::NotFinite));
    }
    let near = Queue::new(Near { place: 0, of_box: BoxBounds { least: R::zero(), slope_bound: R::zero() } });
    let passed = Queue::new(Passed { place: 0, lower_bound: R::zero() });
    Batch::<R, F, M, T, N, L> { field, minimizer, margin, elements, near, passed, take }.run();
}

/// An element that its box does not cull.
#[derive(Clone, Copy)]
struct Near<R> {
    place: usize,
    of_box: BoxBounds<R>,
}

/// An element that is to be searched.
#[derive(Clone, Copy)]
struct Passed<R> {
    place: usize,
    lower_bound: R,
}

/// Why an element is not searched: an [`Outcome`] without the room for a contact, which is large.
#[derive(Clone, Copy)]
enum Refusal {
    NotFinite,
    Culled,
}

impl Refusal {
    #[inline(always)]
    fn outcome<R: Float, const N: usize>(self) -> Outcome<R, N> {
        match self {
            Self::NotFinite => Outcome::NotFinite,
            Self::Culled => Outcome::Culled,
        }
    }
}

/// What waits until all lanes are taken.
struct Queue<T, const L: usize> {
    items: [T; L],
    count: usize,
}

impl<T: Copy, const L: usize> Queue<T, L> {
    fn new(nothing: T) -> Self {
        Self { items: [nothing; L], count: 0 }
    }

    /// Whether it is full now.
    #[inline(always)]
    fn push(&mut self, item: T) -> bool {
        if let Some(slot) = self.items.get_mut(self.count) {
            *slot = item;
            self.count = self.count.saturating_add(1);
        }
        self.count == L
    }

    /// All items and their count; in the lanes beyond it stands the first.
    #[inline(always)]
    fn drain(&mut self) -> ([T; L], usize) {
        let count = core::mem::take(&mut self.count);
        (from_fn(|lane| self.items[if lane < count { lane } else { 0 }]), count)
    }
}

struct Batch<'a, R: Float, F, M, T, const N: usize, const L: usize> {
    field: &'a F,
    minimizer: &'a M,
    margin: R,
    elements: &'a [Element<R, N>],
    near: Queue<Near<R>, L>,
    passed: Queue<Passed<R>, L>,
    take: T,
}

impl<R, F, M, T, const N: usize, const L: usize> Batch<'_, R, F, M, T, N, L>
where
    R: Float,
    F: Sdf,
    M: Minimizer<N>,
    T: FnMut(usize, Outcome<R, N>),
{
    #[inline(always)]
    fn run(&mut self) {
        // One place more than there are: there the queues are emptied. So each stage stands here, and is inlined, once.
        for place in 0..=self.elements.len() {
            let is_full = match self.elements.get(place).map(|element| self.look_at_box(place, element)) {
                Some(Ok(near)) => self.near.push(near),
                Some(Err(refusal)) => {
                    (self.take)(place, refusal.outcome());
                    false
                }
                None => true,
            };
            if !is_full {
                continue;
            }
            let (near, count) = self.near.drain();
            let lower_bounds = if count > 0 { self.look_at_centroids(&near) } else { [Err(Refusal::Culled); L] };
            for lane in 0..=L {
                let is_full = match lower_bounds.get(lane) {
                    Some(_) if lane >= count => false,
                    Some(Ok(lower_bound)) => {
                        self.passed.push(Passed { place: near[lane].place, lower_bound: *lower_bound })
                    }
                    Some(Err(refusal)) => {
                        (self.take)(near[lane].place, refusal.outcome());
                        false
                    }
                    None => place == self.elements.len(),
                };
                if is_full {
                    self.search();
                }
            }
        }
    }

    /// The first half of [`contact`](super::contact)'s cull.
    #[inline(always)]
    fn look_at_box(&self, place: usize, element: &Element<R, N>) -> Result<Near<R>, Refusal> {
        let simplex = &element.simplex;
        if !simplex.is_in_reach() {
            return Err(Refusal::NotFinite);
        }
        let of_box = bounds_in_box(self.field, self.margin, simplex);
        if self.margin < of_box.least { Err(Refusal::Culled) } else { Ok(Near { place, of_box }) }
    }

    /// The second half of it, which gives a lower bound of each that passes.
    #[inline(always)]
    fn look_at_centroids(&self, near: &[Near<R>; L]) -> [Result<R, Refusal>; L] {
        let simplex = self.simplices(near.map(|near| near.place));
        let centroid = simplex.centroid();
        let below = LowerBound { slope_bound: self.field.slope_bound() };
        let slope_bound = Lanes(near.map(|near| near.of_box.slope_bound));
        let [by_slope] = Lanes::apply(&below, (simplex, [slope_bound], centroid, [self.field.value(centroid)]));
        let lower_bound = Real::max(by_slope, Lanes(near.map(|near| near.of_box.least)));
        let margin = Lanes([self.margin; L]);
        let (is_above, is_within) = (margin.lt(by_slope), lower_bound.le(margin));
        from_fn(|lane| match () {
            () if is_above.0[lane] => Err(Refusal::Culled),
            () if is_within.0[lane] => Ok(lower_bound.0[lane]),
            () => Err(Refusal::NotFinite),
        })
    }

    #[inline(always)]
    fn search(&mut self) {
        let (passed, count) = self.passed.drain();
        if count == 0 {
            return;
        }
        if M::PAYS_IN_LANES {
            let simplices = self.simplices(passed.map(|passed| passed.place));
            let minimum = self.minimizer.minimize_below(self.field, &simplices, Lanes([self.margin; L]));
            for (lane, passed) in passed.iter().enumerate().take(count) {
                self.report(passed, &minimum.lane(lane));
            }
        } else {
            for passed in passed.iter().take(count) {
                let Some(element) = self.elements.get(passed.place) else { continue };
                let minimum = self.minimizer.minimize_below(self.field, &element.simplex, self.margin);
                self.report(passed, &minimum);
            }
        }
    }

    #[inline(always)]
    fn report(&mut self, passed: &Passed<R>, minimum: &Minimum<R, N>) {
        if let Some(element) = self.elements.get(passed.place) {
            (self.take)(passed.place, judge(self.margin, element, minimum, passed.lower_bound));
        }
    }

    #[inline(always)]
    fn simplices(&self, places: [usize; L]) -> Simplex<Lanes<R, L>, N> {
        let mut corners = [Vector3::new(Lanes([R::zero(); L]), Lanes([R::zero(); L]), Lanes([R::zero(); L])); N];
        for lane in 0..L {
            let Some(element) = self.elements.get(places[lane]) else { continue };
            for corner in 0..N {
                let one = element.simplex.corners[corner];
                (corners[corner].x.0[lane], corners[corner].y.0[lane], corners[corner].z.0[lane]) =
                    (one.x, one.y, one.z);
            }
        }
        Simplex { corners }
    }
}
