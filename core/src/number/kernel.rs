use nalgebra::Vector3;

use crate::number::Real;

/// Numbers, or vectors, arrays and tuples of them, that can be taken apart by lanes and put together again: of the lanes'
/// vector `Vector3<Lanes<f64, 8>>` the lane 3 is a `Vector3<f64>`. What a [`LaneKernel`] takes and gives.
pub trait LaneBundle<R: Real>: Copy {
    /// The same of one lane.
    type Lane: Copy;
    /// Room for any.
    fn zero() -> Self;
    /// `lane` is below [`Real::LANES`].
    fn lane(&self, lane: usize) -> Self::Lane;
    fn set_lane(&mut self, lane: usize, one: Self::Lane);
}

/// A calculation with numbers of any kind, as a type, so that [`run`] can apply it on one number or lane by lane.
///
/// An operator of [`Lanes`](crate::Lanes) is a loop over the lanes, and a formula of thirty operators thirty loops with all
/// lanes stored between them. A kernel is one loop around the whole formula, and that is what compilers turn into vectors
/// best, if it is long enough not to be unrolled before. It holds no branch and no call that is not inlined: either would leave
/// the loop as it is. So do masks in what it takes or gives. What a closure would capture, such as a slope bound, are its
/// fields.
pub trait LaneKernel {
    /// What it takes.
    type From<R: Real>: LaneBundle<R, Lane = Self::From<R::Lane>>;
    /// What it gives.
    type To<R: Real>: LaneBundle<R, Lane = Self::To<R::Lane>>;

    fn apply<R: Real>(&self, from: Self::From<R>) -> Self::To<R>;
}

/// Applies a kernel to one number, or lane by lane in one loop.
#[inline(always)]
pub fn run<R: Real, K: LaneKernel>(kernel: &K, from: K::From<R>) -> K::To<R> {
    if R::LANES == 1 {
        return kernel.apply::<R>(from);
    }
    let mut to = K::To::<R>::zero();
    for lane in 0..R::LANES {
        to.set_lane(lane, kernel.apply::<R::Lane>(from.lane(lane)));
    }
    to
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
