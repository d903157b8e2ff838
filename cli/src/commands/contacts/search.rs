//! How the elements of a mesh are searched for contacts with each kind of field.

use pulp::{Arch, NullaryFnOnce};
use sdf_core::Sdf;
use sdf_core::contact::{Element, Outcome, batch, contact};
use sdf_core::minimize::Minimizer;
use sdf_core::placed::{Placed, Rigid};
use sdf_formats::field_file::Node;
use sdf_formats::grid_file::OwnedGrid;

/// As many f64 as the widest vectors hold.
const LANES: usize = 8;

/// A field that is searched in the way that is fastest for it.
pub trait Search: Sdf + Sync {
    /// What becomes of those of the elements that are not culled, in their order.
    fn outcomes<M: Minimizer<N>, const N: usize>(
        &self,
        minimizer: &M,
        margin: f64,
        elements: &[Element<f64, N>],
    ) -> Vec<Outcome<f64, N>>;
}

macro_rules! several_at_a_time {
    ($($field:ty),*) => {$(
        impl Search for $field {
            fn outcomes<M: Minimizer<N>, const N: usize>(
                &self,
                minimizer: &M,
                margin: f64,
                elements: &[Element<f64, N>],
            ) -> Vec<Outcome<f64, N>> {
                let batch = Batch { field: self, minimizer, margin, elements };
                Arch::new().dispatch(batch)
            }
        }
    )*};
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

several_at_a_time!(OwnedGrid, Placed<&OwnedGrid, Rigid>);
// A tree of shapes is asked by calls, which take no part in wider vectors.
one_by_one!(Node, Placed<&Node, Rigid>);

struct Batch<'a, F, M, const N: usize> {
    field: &'a F,
    minimizer: &'a M,
    margin: f64,
    elements: &'a [Element<f64, N>],
}

impl<F: Sdf, M: Minimizer<N>, const N: usize> NullaryFnOnce for Batch<'_, F, M, N> {
    type Output = Vec<Outcome<f64, N>>;

    // Only what is inlined here is compiled for the processor's own vectors.
    #[inline(always)]
    fn call(self) -> Self::Output {
        let mut outcomes = vec![];
        let take = |at, outcome| {
            if !matches!(outcome, Outcome::Culled) {
                outcomes.push((at, outcome));
            }
        };
        batch::contacts::<_, _, _, _, N, LANES>(self.field, self.minimizer, self.margin, self.elements, take);
        outcomes.sort_unstable_by_key(|(at, _)| *at);
        outcomes.into_iter().map(|(_, outcome)| outcome).collect()
    }
}
