//! How the elements of a mesh are searched for contacts with each kind of field.

use pulp::{Arch, NullaryFnOnce};
use sdf_core::EnclosedSdf;
use sdf_core::contact::batch::{CullReason, Survivor};
use sdf_core::contact::{Element, Outcome, batch, contact};
use sdf_core::minimize::Minimizer;
use sdf_core::placed::{Placed, Rigid};
use sdf_formats::field_file::Node;
use sdf_formats::grid_file::{OwnedGrid, OwnedSamples};

/// So many elements are culled side by side: as many f64 as the widest vectors hold.
const CULLED: usize = 8;

/// So many are searched side by side: a step waits for the one before, and two vectors wait no longer than one.
const SEARCHED: usize = 16;

/// A field that is searched in the way that is fastest for it.
pub trait Search: EnclosedSdf + Sync {
    /// What becomes of those of the elements that are not culled, in their order.
    fn outcomes<M: Minimizer<N>, const N: usize>(
        &self,
        minimizer: &M,
        margin: f64,
        elements: &[Element<f64, N>],
    ) -> Vec<Outcome<f64, N>>;
}

macro_rules! one_by_one {
    ($($field:ty),*) => {$(
        impl Search for $field {
            fn outcomes<M: Minimizer<N>, const N: usize>(
                &self,
                minimizer: &M,
                margin: f64,
                elements: &[Element<f64, N>],
            ) -> Vec<Outcome<f64, N>> {
                let outcomes = elements.iter().map(|element| contact(self, minimizer, margin, element));
                outcomes.filter(|outcome| !matches!(outcome, Outcome::Culled)).collect()
            }
        }
    )*};
}

// A tree of shapes is asked by calls, which take no part in wider vectors.
one_by_one!(Node, Placed<&Node, Rigid>);

impl Search for OwnedGrid {
    fn outcomes<M: Minimizer<N>, const N: usize>(
        &self,
        minimizer: &M,
        margin: f64,
        elements: &[Element<f64, N>],
    ) -> Vec<Outcome<f64, N>> {
        match self.storage() {
            OwnedSamples::Dense(samples) => {
                Batch { field: self, wide: &self.with_storage(samples), minimizer, margin, elements }.outcomes()
            }
            _ => Batch { field: self, wide: self, minimizer, margin, elements }.outcomes(),
        }
    }
}

impl Search for Placed<&OwnedGrid, Rigid> {
    fn outcomes<M: Minimizer<N>, const N: usize>(
        &self,
        minimizer: &M,
        margin: f64,
        elements: &[Element<f64, N>],
    ) -> Vec<Outcome<f64, N>> {
        match self.field.storage() {
            OwnedSamples::Dense(samples) => {
                let wide = Placed { field: self.field.with_storage(samples), placement: self.placement };
                Batch { field: self, wide: &wide, minimizer, margin, elements }.outcomes()
            }
            _ => Batch { field: self, wide: self, minimizer, margin, elements }.outcomes(),
        }
    }
}

/// The same field twice: as it is, and as the type that vectors are compiled for.
struct Batch<'a, F, W, M, const N: usize> {
    field: &'a F,
    wide: &'a W,
    minimizer: &'a M,
    margin: f64,
    elements: &'a [Element<f64, N>],
}

impl<F: EnclosedSdf, W: EnclosedSdf, M: Minimizer<N>, const N: usize> Batch<'_, F, W, M, N> {
    fn outcomes(&self) -> Vec<Outcome<f64, N>> {
        let Self { field, wide, minimizer, margin, elements } = *self;
        let mut looked = Arch::new().dispatch(Cull { field: wide, margin, elements });
        looked.sort_unstable_by_key(|(place, _)| *place);
        let passed = looked.iter().enumerate().filter_map(|(at, (place, looked))| {
            let lower_bound = looked.ok()?;
            Some((at, Survivor { index: *place, lower_bound }))
        });
        let (ats, passed): (Vec<_>, Vec<_>) = passed.unzip();
        let mut outcomes = vec![Outcome::NotFinite; looked.len()];
        let take = |at: usize, outcome| outcomes[ats[at]] = outcome;
        if M::USES_SIMD {
            Arch::new().dispatch(Wide { field: wide, minimizer, margin, elements, passed: &passed, take });
        } else {
            batch::search::<_, _, _, _, N, SEARCHED>(field, minimizer, margin, elements, &passed, take);
        }
        outcomes
    }
}

/// Of the elements that are not culled their places and what no value on them is below.
struct Cull<'a, F, const N: usize> {
    field: &'a F,
    margin: f64,
    elements: &'a [Element<f64, N>],
}

impl<F: EnclosedSdf, const N: usize> NullaryFnOnce for Cull<'_, F, N> {
    type Output = Vec<(usize, Result<f64, CullReason>)>;

    // Only what is inlined here is compiled for the processor's own vectors.
    #[inline(always)]
    fn call(self) -> Self::Output {
        let mut passed = vec![];
        batch::cull::<_, _, _, N, CULLED>(self.field, self.margin, self.elements, |place, looked| {
            if looked != Err(CullReason::Culled) {
                passed.push((place, looked));
            }
        });
        passed
    }
}

struct Wide<'a, F, M, T, const N: usize> {
    field: &'a F,
    minimizer: &'a M,
    margin: f64,
    elements: &'a [Element<f64, N>],
    passed: &'a [Survivor<f64>],
    take: T,
}

impl<F: EnclosedSdf, M: Minimizer<N>, T: FnMut(usize, Outcome<f64, N>), const N: usize> NullaryFnOnce
    for Wide<'_, F, M, T, N>
{
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { field, minimizer, margin, elements, passed, take } = self;
        batch::search::<_, _, _, _, N, SEARCHED>(field, minimizer, margin, elements, passed, take);
    }
}
