//! Which elements of many need no search? Step 1 of a batch: the lowest value in the box around `L` of them, bounds in the box of each,
//! then one evaluation at the centroids of those that are left, side by side in lanes (Macklin et al. 2020, §3.3).

use core::array::from_fn;
use core::ops::Range;

use super::queue::Queue;
use super::{CullReason, Margins, simplices_in_lanes};
use crate::contact::cull::{BoxBound, box_rounding};
use crate::contact::{Element, ElementKind};
use crate::number::kernel::run;
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, POSED_COORDINATE};
use crate::simplex::LowerBound;
use crate::{Aabb, EnclosedSdf, Lanes};

/// The boxes around `L` elements.
struct Boxes<R, const L: usize> {
    /// Lower corners, x of all elements first.
    min: [[R; L]; 3],
    max: [[R; L]; 3],
    /// See [`box_rounding`].
    rounding: [R; L],
    /// 1 where all corners are representable, else 0.
    is_representable: [R; L],
}

impl<R: Float, const L: usize> Boxes<R, L> {
    fn zero() -> Self {
        Self {
            min: [[R::zero(); L]; 3],
            max: [[R::zero(); L]; 3],
            rounding: [R::zero(); L],
            is_representable: [R::zero(); L],
        }
    }
}

/// An element that the bounds in its box do not cull.
#[derive(Clone, Copy)]
struct CullSurvivor<R> {
    index: usize,
    in_box: BoxBound<R>,
}

pub(super) struct Culling<'a, R: Float, F, M, const N: usize, const L: usize> {
    pub field: &'a F,
    pub margin: M,
    pub elements: &'a [Element<R, N>],
    /// The elements that are to be culled.
    pub range: Range<usize>,
}

impl<R: Float, F: EnclosedSdf, M: Margins<R>, const N: usize, const L: usize> Culling<'_, R, F, M, N, L> {
    /// Visits each element once.
    #[inline(always)]
    pub fn run(&self, mut visit: impl FnMut(usize, Result<R, CullReason>)) {
        const { assert!(L > 0) };
        let (mut boxes, mut are_far) = (Boxes::zero(), false);
        let filler = BoxBound { lower: R::zero(), slope_bound: R::zero() };
        let mut near = Queue::new(CullSurvivor { index: 0, in_box: filler });
        // One index more than the range has: there the queue is emptied. So each stage stands here, and is inlined, once.
        let Range { start, end } = self.range;
        for index in start..=end {
            let lane = index.wrapping_sub(start) % L;
            let is_last = index == end;
            if lane == 0 && !is_last {
                boxes = self.boxes(index);
                are_far = !F::SLOPES_TAKE_LONG && self.are_far(&boxes, index);
            }
            let bounded =
                if is_last || are_far { Err(CullReason::Culled) } else { self.bound_in_box(&boxes, index, lane) };
            let is_full = match bounded {
                Ok(in_box) => near.push(CullSurvivor { index, in_box }),
                Err(reason) => {
                    if !is_last {
                        visit(index, Err(reason));
                    }
                    is_last
                }
            };
            // An empty queue would have refused elements in its lanes.
            if is_full && near.count > 0 {
                let (near, count) = near.drain();
                let bounded = self.bound_at_centroids(&near);
                let bounded = near.iter().zip(bounded).take(count);
                bounded.for_each(|(near, result)| visit(near.index, result));
            }
        }
    }

    /// The boxes around `L` elements from the given one on; beyond the last element, its own.
    #[inline(always)]
    fn boxes(&self, first: usize) -> Boxes<R, L> {
        let mut boxes = Boxes::zero();
        let Some(last) = self.elements.len().checked_sub(1) else { return boxes };
        let scale = FieldScale::new(self.field);
        // Numbers alone, and no branch, in a loop over the lanes: that is what compilers turn into vectors.
        for lane in 0..L {
            let index = first.saturating_add(lane).min(last);
            let Some(element) = self.elements.get(index) else { continue };
            let corners = &element.simplex.corners;
            for axis in 0..3 {
                let coordinate = |corner: usize| corners[corner].as_slice()[axis];
                let (mut min, mut max) = (coordinate(0), coordinate(0));
                for corner in 1..N {
                    (min, max) = (Real::min(min, coordinate(corner)), Real::max(max, coordinate(corner)));
                }
                (boxes.min[axis][lane], boxes.max[axis][lane]) = (min, max);
            }
            boxes.rounding[lane] = box_rounding(scale, self.margin.margin(index), &element.simplex);
            boxes.is_representable[lane] = R::select(element.simplex.is_representable(), R::one(), R::zero());
        }
        boxes
    }

    /// Does the lowest value in the box around all `L` elements cull each of them? No element's own box has a lower one: where a
    /// pose rounds the boxes, the one around all is larger by that.
    #[inline(always)]
    fn are_far(&self, boxes: &Boxes<R, L>, first: usize) -> bool {
        let corner = |bounds: &[[R; L]; 3], choose: fn(R, R) -> R| -> [f64; 3] {
            from_fn(|axis| bounds[axis].iter().skip(1).fold(bounds[axis][0], |a, b| choose(a, *b)).to_f64())
        };
        let region = Aabb { min: corner(&boxes.min, Real::min), max: corner(&boxes.max, Real::max) };
        let largest = region.largest_finite_coordinate().max(self.field.magnitude());
        let region = region.inflate(largest * (POSED_COORDINATE * f64::EPSILON));
        let lowest = R::from_f64(self.field.lowest_in_box(&region));
        let is_far = |lane: usize| {
            let margin = self.margin.margin(first.saturating_add(lane));
            (R::zero() < boxes.is_representable[lane]) & (margin < lowest - boxes.rounding[lane])
        };
        ElementKind::from_corner_count(N).is_some() && (0..L).fold(true, |all, lane| all & is_far(lane))
    }

    /// The first half of [`contact`](crate::contact::contact)'s cull.
    #[inline(always)]
    fn bound_in_box(&self, boxes: &Boxes<R, L>, index: usize, lane: usize) -> Result<BoxBound<R>, CullReason> {
        if ElementKind::from_corner_count(N).is_none() || boxes.is_representable[lane] <= R::zero() {
            return Err(CullReason::NotFinite);
        }
        let corner = |bounds: &[[R; L]; 3]| from_fn(|axis| bounds[axis][lane].to_f64());
        let region = Aabb { min: corner(&boxes.min), max: corner(&boxes.max) };
        let margin = self.margin.margin(index);
        if F::SLOPES_TAKE_LONG && margin < R::from_f64(self.field.lowest_in_box(&region)) - boxes.rounding[lane] {
            return Err(CullReason::Culled);
        }
        let in_box = BoxBound::new(self.field, &region, boxes.rounding[lane]);
        if margin < in_box.lower { Err(CullReason::Culled) } else { Ok(in_box) }
    }

    /// The second half of it: a lower bound on each survivor.
    #[inline(always)]
    fn bound_at_centroids(&self, near: &[CullSurvivor<R>; L]) -> [Result<R, CullReason>; L] {
        let simplex = simplices_in_lanes(self.elements, near.map(|near| near.index));
        let centroid = simplex.centroid();
        let scale = FieldScale::new(self.field);
        let slope_bound = Lanes(near.map(|near| near.in_box.slope_bound));
        let [from_slope] = run(
            &LowerBound,
            (simplex, [scale.slope_bound, scale.magnitude, slope_bound], centroid, [self.field.value(centroid)]),
        );
        let lower_bound = Real::max(from_slope, Lanes(near.map(|near| near.in_box.lower)));
        let margin = Lanes(near.map(|near| self.margin.margin(near.index)));
        let (is_above, is_within) = (margin.lt(from_slope), lower_bound.le(margin));
        from_fn(|lane| match () {
            () if is_above.0[lane] => Err(CullReason::Culled),
            () if is_within.0[lane] => Ok(lower_bound.0[lane]),
            () => Err(CullReason::NotFinite),
        })
    }
}
