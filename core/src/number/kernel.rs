//! Kernels: formulas as types, so that [`run`] applies them to one number or, in one loop, to all lanes.
//!
//! An operator of [`Lanes`](crate::Lanes) is a loop over the lanes. A formula of thirty operators is then thirty
//! loops, with all lanes stored in between. A [`LaneKernel`] is a single loop around the whole formula. Compilers
//! turn that into vector instructions best, under three conditions:
//!
//! - it is long enough not to be unrolled first;
//! - it has neither branches nor calls that are not inlined;
//! - what it takes and returns holds no masks. Flags are numbers, 0 or 1.

use nalgebra::Vector3;

use crate::number::Real;

/// Numbers, or vectors, arrays and tuples of them, that can be split into lanes and joined again: lane 3 of a
/// `Vector3<Lanes<f64, 8>>` is a `Vector3<f64>`.
pub trait LaneBundle<R: Real>: Copy {
    /// The same for one lane.
    type Lane: Copy;
    /// A bundle to be filled lane by lane.
    fn zero() -> Self;
    /// The bundle of one lane. `lane` is below [`Real::LANES`].
    fn lane(&self, lane: usize) -> Self::Lane;
    /// Sets the bundle of one lane. `lane` is below [`Real::LANES`].
    fn set_lane(&mut self, lane: usize, one: Self::Lane);
}

/// A formula over any number type. Its fields are what a closure would capture, such as a slope bound.
pub trait LaneKernel {
    /// Input.
    type From<R: Real>: LaneBundle<R, Lane = Self::From<R::Lane>>;
    /// Output.
    type To<R: Real>: LaneBundle<R, Lane = Self::To<R::Lane>>;

    /// The formula.
    fn apply<R: Real>(&self, from: Self::From<R>) -> Self::To<R>;
}

/// Applies a kernel to one number, or lane by lane in one loop.
#[inline(always)]
pub fn run<R: Real, K: LaneKernel>(kernel: &K, from: K::From<R>) -> K::To<R> {
    if R::LANES == 1 {
        return kernel.apply::<R>(from);
    }
    let mut to = K::To::<R>::zero();
    run_into(kernel, from, &mut to);
    to
}

/// Applies a kernel as [`run`] does, to a result that stays where it is. For what a loop changes with each pass: a new result
/// would be copied each time, and compilers copy vectors in pieces, which the processor cannot read before they are stored.
#[inline(always)]
pub fn run_into<R: Real, K: LaneKernel>(kernel: &K, from: K::From<R>, to: &mut K::To<R>) {
    if R::LANES == 1 {
        *to = kernel.apply::<R>(from);
        return;
    }
    for lane in 0..R::LANES {
        to.set_lane(lane, kernel.apply::<R::Lane>(from.lane(lane)));
    }
}

macro_rules! tuple {
    ($($bundle:ident $field:tt),*) => {
        impl<R: Real, $($bundle: LaneBundle<R>),*> LaneBundle<R> for ($($bundle,)*) {
            type Lane = ($($bundle::Lane,)*);
            #[inline(always)]
            fn zero() -> Self {
                ($($bundle::zero(),)*)
            }
            #[inline(always)]
            fn lane(&self, lane: usize) -> Self::Lane {
                ($(self.$field.lane(lane),)*)
            }
            #[inline(always)]
            fn set_lane(&mut self, lane: usize, one: Self::Lane) {
                $(self.$field.set_lane(lane, one.$field);)*
            }
        }
    };
}

tuple!(A 0, B 1);
tuple!(A 0, B 1, C 2);
tuple!(A 0, B 1, C 2, D 3);

impl<R: Real, const N: usize> LaneBundle<R> for [R; N] {
    type Lane = [R::Lane; N];
    #[inline(always)]
    fn zero() -> Self {
        [R::zero(); N]
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> Self::Lane {
        core::array::from_fn(|k| self[k].lane(lane))
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, one: Self::Lane) {
        for k in 0..N {
            self[k].set_lane(lane, one[k]);
        }
    }
}

impl<R: Real, const N: usize> LaneBundle<R> for [Vector3<R>; N] {
    type Lane = [Vector3<R::Lane>; N];
    #[inline(always)]
    fn zero() -> Self {
        [LaneBundle::zero(); N]
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> Self::Lane {
        core::array::from_fn(|k| self[k].lane(lane))
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, one: Self::Lane) {
        for k in 0..N {
            self[k].set_lane(lane, one[k]);
        }
    }
}

impl<R: Real> LaneBundle<R> for Vector3<R> {
    type Lane = Vector3<R::Lane>;
    #[inline(always)]
    fn zero() -> Self {
        Vector3::new(R::zero(), R::zero(), R::zero())
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> Self::Lane {
        Vector3::new(self.x.lane(lane), self.y.lane(lane), self.z.lane(lane))
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, one: Self::Lane) {
        self.x.set_lane(lane, one.x);
        self.y.set_lane(lane, one.y);
        self.z.set_lane(lane, one.z);
    }
}
