//! Contacts of many elements, several at a time.
//!
//! The elements that a field's local bounds do not cull are asked at their centroids side by side in [`Lanes`], and those
//! that pass are searched side by side where [`Minimizer::LOCKSTEP`]. Compiled for wide vectors, as a crate such as
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

use super::{BoxBounds, Element, ElementKind, Outcome, judge, rounding_in_box};
use crate::minimize::{Minimizer, Minimum};
use crate::number::kernel::run;
use crate::number::{Float, Real};
use crate::simplex::LowerBound;
use crate::{Aabb, EnclosedSdf, Lanes, Simplex};

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
    F: EnclosedSdf,
    M: Minimizer<N>,
    T: FnMut(usize, Outcome<R, N>),
{
    let search = Search { field, margin, elements };
    let mut waiting = Queue::<_, L>::none();
    let culling = Culling::<_, _, N, L> { field, margin, elements };
    culling.run(|looked| {
        let is_full = match looked {
            Some((place, Ok(lower_bound))) => waiting.push((place, Survivor { place, lower_bound })),
            Some((place, Err(refusal))) => {
                take(place, refusal.outcome());
                false
            }
            None => true,
        };
        if is_full {
            search.each_of(minimizer, &mut waiting, |(place, passed), minimum| {
                search.tell(*place, passed, minimum, &mut take);
            });
        }
    });
}

/// The first half of it: what no value on an element is below, or why it is not to be searched.
///
/// `take` is given this of each element once, with its place in the slice, in an order of no account.
#[inline(always)]
pub fn cull<R, F, T, const N: usize, const L: usize>(field: &F, margin: R, elements: &[Element<R, N>], mut take: T)
where
    R: Float,
    F: EnclosedSdf,
    T: FnMut(usize, Result<R, CullReason>),
{
    Culling::<_, _, N, L> { field, margin, elements }.run(|looked| {
        if let Some((place, looked)) = looked {
            take(place, looked);
        }
    });
}

/// The second half of it: the outcomes of the elements that passed [`cull`].
///
/// `take` is given each outcome once, with its place in `passed`, in an order of no account: what a [brief](Minimizer::brief) search
/// leaves over waits until it fills all lanes.
#[inline(always)]
pub fn search<R, F, M, T, const N: usize, const L: usize>(
    field: &F,
    minimizer: &M,
    margin: R,
    elements: &[Element<R, N>],
    passed: &[Survivor<R>],
    mut take: T,
) where
    R: Float,
    F: EnclosedSdf,
    M: Minimizer<N>,
    T: FnMut(usize, Outcome<R, N>),
{
    const { assert!(L > 0) };
    let search = Search { field, margin, elements };
    let quick_pass = if M::LOCKSTEP { minimizer.quick_pass() } else { None };
    let (mut left_over, mut waiting) = (Queue::<_, L>::none(), Queue::<_, L>::none());
    let mut fresh = passed.chunks(L).zip((0..).step_by(L));
    loop {
        waiting.take_from(&mut left_over);
        let next = if waiting.count == L { None } else { fresh.next() };
        let method = next.and(quick_pass.as_ref()).unwrap_or(minimizer);
        let is_brief = next.is_some() && quick_pass.is_some();
        let mut queue = match next {
            Some((chunk, first)) => Queue::of((first..).zip(chunk.iter().copied())),
            None => core::mem::replace(&mut waiting, Queue::none()),
        };
        if queue.count == 0 {
            break;
        }
        search.each_of(method, &mut queue, |item, minimum| {
            if is_brief && !minimum.converged {
                left_over.push(*item);
            } else {
                search.tell(item.0, &item.1, minimum, &mut take);
            }
        });
    }
}

/// An element that is to be searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Survivor<R> {
    /// In the slice of elements.
    pub place: usize,
    /// No value on the element is below this.
    pub lower_bound: R,
}

/// Why an element is not searched: an [`Outcome`] without the room for a contact, which is large.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CullReason {
    NotFinite,
    Culled,
}

impl CullReason {
    #[inline(always)]
    fn outcome<R: Float, const N: usize>(self) -> Outcome<R, N> {
        match self {
            Self::NotFinite => Outcome::NotFinite,
            Self::Culled => Outcome::Culled,
        }
    }
}

/// The boxes around `L` elements.
struct Boxes<R, const L: usize> {
    /// By axis.
    min: [[R; L]; 3],
    max: [[R; L]; 3],
    /// See [`rounding_in_box`].
    rounding: [R; L],
    /// 1 where all corners are within reach, else 0.
    is_representable: [R; L],
}

impl<R: Float, const L: usize> Boxes<R, L> {
    fn nowhere() -> Self {
        Self {
            min: [[R::zero(); L]; 3],
            max: [[R::zero(); L]; 3],
            rounding: [R::zero(); L],
            is_representable: [R::zero(); L],
        }
    }
}

/// An element that its box does not cull.
#[derive(Clone, Copy)]
struct Near<R> {
    place: usize,
    of_box: BoxBounds<R>,
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

    /// As many items of another as there is room for, its last ones first.
    #[inline(always)]
    fn take_from(&mut self, other: &mut Self) {
        while self.count < L {
            let Some(last) = other.count.checked_sub(1) else { return };
            other.count = last;
            if let Some(item) = other.items.get(last) {
                self.push(*item);
            }
        }
    }

    /// All items and their count; in the lanes beyond it stands the first.
    #[inline(always)]
    fn drain(&mut self) -> ([T; L], usize) {
        let count = core::mem::take(&mut self.count);
        (from_fn(|lane| self.items[if lane < count { lane } else { 0 }]), count)
    }
}

/// A place, and what is to be searched.
type Waiting<R> = (usize, Survivor<R>);

impl<R: Float, const L: usize> Queue<Waiting<R>, L> {
    #[inline(always)]
    fn none() -> Self {
        Self::new((0, Survivor { place: 0, lower_bound: R::zero() }))
    }

    #[inline(always)]
    fn of(items: impl Iterator<Item = Waiting<R>>) -> Self {
        let mut queue = Self::none();
        for item in items {
            queue.push(item);
        }
        queue
    }
}

struct Culling<'a, R: Float, F, const N: usize, const L: usize> {
    field: &'a F,
    margin: R,
    elements: &'a [Element<R, N>],
}

impl<R: Float, F: EnclosedSdf, const N: usize, const L: usize> Culling<'_, R, F, N, L> {
    /// `take` is given nothing at the end, once.
    #[inline(always)]
    fn run(&self, mut take: impl FnMut(Option<(usize, Result<R, CullReason>)>)) {
        const { assert!(L > 0) };
        let mut boxes = Boxes::nowhere();
        let mut near = Queue::new(Near { place: 0, of_box: BoxBounds { least: R::zero(), slope_bound: R::zero() } });
        // One place more than there are: there the queue is emptied. So each stage stands here, and is inlined, once.
        for place in 0..=self.elements.len() {
            let lane = place % L;
            if lane == 0 {
                boxes = self.boxes(place);
            }
            let is_last = place == self.elements.len();
            let looked = if is_last { Err(CullReason::Culled) } else { self.look_at_box(&boxes, lane) };
            let is_full = match looked {
                Ok(of_box) => near.push(Near { place, of_box }),
                Err(refusal) => {
                    if !is_last {
                        take(Some((place, Err(refusal))));
                    }
                    is_last
                }
            };
            // Without any there would be elements that were refused in the lanes.
            if is_full && near.count > 0 {
                let (near, count) = near.drain();
                let lower_bounds = self.look_at_centroids(&near);
                let looked = near.iter().zip(lower_bounds).take(count);
                looked.for_each(|(near, looked)| take(Some((near.place, looked))));
            }
        }
        take(None);
    }

    /// The boxes around the elements from the given one on; beyond the last, that of the last.
    #[inline(always)]
    fn boxes(&self, first: usize) -> Boxes<R, L> {
        let mut boxes = Boxes::nowhere();
        let Some(last) = self.elements.len().checked_sub(1) else { return boxes };
        let slope_bound = self.field.slope_bound();
        // Numbers alone, and no branch, in a loop over the lanes: that compilers turn into vectors.
        for lane in 0..L {
            let Some(element) = self.elements.get(first.saturating_add(lane).min(last)) else { continue };
            let corners = &element.simplex.corners;
            for axis in 0..3 {
                let along = |corner: usize| corners[corner].as_slice()[axis];
                let (mut min, mut max) = (along(0), along(0));
                for corner in 1..N {
                    (min, max) = (Real::min(min, along(corner)), Real::max(max, along(corner)));
                }
                (boxes.min[axis][lane], boxes.max[axis][lane]) = (min, max);
            }
            boxes.rounding[lane] = rounding_in_box(slope_bound, self.margin, &element.simplex);
            boxes.is_representable[lane] = R::select(element.simplex.is_representable(), R::one(), R::zero());
        }
        boxes
    }

    /// The first half of [`contact`](super::contact)'s cull.
    #[inline(always)]
    fn look_at_box(&self, boxes: &Boxes<R, L>, lane: usize) -> Result<BoxBounds<R>, CullReason> {
        if ElementKind::of(N).is_none() || boxes.is_representable[lane] <= R::zero() {
            return Err(CullReason::NotFinite);
        }
        let along = |bounds: &[[R; L]; 3]| from_fn(|axis| bounds[axis][lane].to_f64());
        let region = Aabb { min: along(&boxes.min), max: along(&boxes.max) };
        let of_box = BoxBounds::new(self.field, &region, boxes.rounding[lane]);
        if self.margin < of_box.least { Err(CullReason::Culled) } else { Ok(of_box) }
    }

    /// The second half of it, which gives a lower bound of each that passes.
    #[inline(always)]
    fn look_at_centroids(&self, near: &[Near<R>; L]) -> [Result<R, CullReason>; L] {
        let simplex = side_by_side(self.elements, near.map(|near| near.place));
        let centroid = simplex.centroid();
        let below = LowerBound { slope_bound: self.field.slope_bound() };
        let slope_bound = Lanes(near.map(|near| near.of_box.slope_bound));
        let [by_slope] = run(&below, (simplex, [slope_bound], centroid, [self.field.value(centroid)]));
        let lower_bound = Real::max(by_slope, Lanes(near.map(|near| near.of_box.least)));
        let margin = Lanes([self.margin; L]);
        let (is_above, is_within) = (margin.lt(by_slope), lower_bound.le(margin));
        from_fn(|lane| match () {
            () if is_above.0[lane] => Err(CullReason::Culled),
            () if is_within.0[lane] => Ok(lower_bound.0[lane]),
            () => Err(CullReason::NotFinite),
        })
    }
}

struct Search<'a, R: Float, F, const N: usize> {
    field: &'a F,
    margin: R,
    elements: &'a [Element<R, N>],
}

impl<R: Float, F: EnclosedSdf, const N: usize> Search<'_, R, F, N> {
    /// Side by side where that pays.
    #[inline(always)]
    fn each_of<M: Minimizer<N>, const L: usize>(
        &self,
        minimizer: &M,
        waiting: &mut Queue<Waiting<R>, L>,
        mut take: impl FnMut(&Waiting<R>, &Minimum<R, N>),
    ) {
        let (items, count) = waiting.drain();
        if count == 0 {
            return;
        }
        if M::LOCKSTEP {
            let simplices = side_by_side(self.elements, items.map(|(_, passed)| passed.place));
            let minimum = minimizer.minimize_below(self.field, &simplices, Lanes([self.margin; L]));
            for (lane, item) in items.iter().enumerate().take(count) {
                take(item, &minimum.lane(lane));
            }
        } else {
            for item in items.iter().take(count) {
                let Some(element) = self.elements.get(item.1.place) else { continue };
                take(item, &minimizer.minimize_below(self.field, &element.simplex, self.margin));
            }
        }
    }

    #[inline(always)]
    fn tell(
        &self,
        place: usize,
        passed: &Survivor<R>,
        minimum: &Minimum<R, N>,
        take: &mut impl FnMut(usize, Outcome<R, N>),
    ) {
        if let Some(element) = self.elements.get(passed.place) {
            take(place, judge(self.margin, element, minimum, passed.lower_bound));
        }
    }
}

/// The simplices of the elements at these places, none of which is beyond them.
#[inline(always)]
fn side_by_side<R: Float, const N: usize, const L: usize>(
    elements: &[Element<R, N>],
    places: [usize; L],
) -> Simplex<Lanes<R, L>, N> {
    let mut corners = [Vector3::new(Lanes([R::zero(); L]), Lanes([R::zero(); L]), Lanes([R::zero(); L])); N];
    let Some(last) = elements.len().checked_sub(1) else { return Simplex { corners } };
    for lane in 0..L {
        let Some(element) = elements.get(places[lane].min(last)) else { continue };
        for corner in 0..N {
            let one = element.simplex.corners[corner];
            (corners[corner].x.0[lane], corners[corner].y.0[lane], corners[corner].z.0[lane]) = (one.x, one.y, one.z);
        }
    }
    Simplex { corners }
}
