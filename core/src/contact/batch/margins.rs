use crate::number::{Float, Real};

/// The margins of the elements of a batch: a number for all of them, or a slice with one for each.
pub trait Margins<R>: Copy {
    /// The margin of the element with this index. Beyond the end of a slice NaN: the element's outcome is
    /// [`NotFinite`](crate::contact::Outcome::NotFinite).
    fn margin(&self, index: usize) -> R;
}

impl<R: Float> Margins<R> for R {
    #[inline(always)]
    fn margin(&self, _index: usize) -> R {
        *self
    }
}

impl<R: Float> Margins<R> for &[R] {
    #[inline(always)]
    fn margin(&self, index: usize) -> R {
        self.get(index).copied().unwrap_or(<R as Real>::from_f64(f64::NAN))
    }
}
