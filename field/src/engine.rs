//! How elements are searched in the kind of field at hand: the one place that raises the instruction set.
//!
//! | field | cull | search |
//! |---|---|---|
//! | dense grid | AVX2, as a type of its own | AVX2 where the method uses SIMD, else as any field |
//! | dense grid of u16 or u8, sparse grid | AVX2, as [`OwnedGrid`](sdf_core::grid::owned::OwnedGrid) | AVX2 where the method uses SIMD, else as any field |
//! | closed form | element by element, as [`NearField`], but for runs that are far off | the same |
//!
//! Each line is compiled once for a method and a kind of element, whether there is a pose or not ([`Posed`]). A processor
//! without AVX2 takes the last line, and so does WebAssembly. On other architectures the first two use their baseline vectors.

use pulp::NullaryFnOnce;
use sdf_core::contact::batch::{self, CullReason, Margins, Survivor};
use sdf_core::contact::{Element, Outcome, classify, cull, lean_contact_at};
use sdf_core::grid::PlainNormals;
use sdf_core::grid::owned::OwnedStorage;
use sdf_core::minimize::{Minimizer, Minimum};
use sdf_core::placed::{Posed, Rigid};
use sdf_core::{AnyField, EnclosedSdf};

pub(crate) use near_field::map_points;
use near_field::{NearField, all_of, visit_near, with_error_of_all};

#[cfg_attr(target_arch = "wasm32", path = "engine/whole_field.rs")]
mod near_field;

/// Elements that are culled side by side: as many f64 as the widest vectors hold.
const CULL_LANES: usize = 8;

/// Elements that are searched side by side in a dense grid: two vectors, so that one need not wait for the other. One takes 1.15 to 1.3
/// times as long, four 1.35 to 1.5 times: their numbers no longer fit into registers.
const DENSE_LANES: usize = 8;

/// The same in other grids, which fetch samples one by one: two vectors are no faster, and more code.
const OTHER_LANES: usize = 4;

/// The margins of the cull.
#[derive(Clone, Copy)]
pub(crate) enum CullMargins<'a> {
    /// One for all elements.
    All(f64),
    /// One for each.
    Each(&'a [f64]),
}

impl Margins<f64> for CullMargins<'_> {
    #[inline(always)]
    fn margin(&self, index: usize) -> f64 {
        match self {
            Self::All(margin) => *margin,
            Self::Each(margins) => margins.margin(index),
        }
    }
}

/// A field, where it stands, and the elements to search in it.
#[derive(Clone, Copy)]
pub(crate) struct Query<'a, const N: usize> {
    pub field: &'a AnyField,
    pub pose: Option<Rigid>,
    /// Elements that are above theirs are culled.
    pub margins: CullMargins<'a>,
    /// Value, at most the margin, up to which the minimum on an element is searched.
    pub level: &'a dyn Fn(&Element<f64, N>) -> f64,
    pub elements: &'a [Element<f64, N>],
    /// See [`ContactOptions::lean`](crate::ContactOptions::lean).
    pub lean: bool,
}

impl<const N: usize> Query<'_, N> {
    /// The index and outcome of each element that is not culled, in their order.
    pub fn outcomes<M: Minimizer<N>>(&self, minimizer: &M) -> Vec<(usize, Outcome<f64, N>)> {
        match (self.field, Vectors::new()) {
            (AnyField::Grid(grid), Some(vectors)) => match grid.storage() {
                OwnedStorage::Dense(samples) => {
                    self.wide::<DENSE_LANES, _, _>(&grid.with_storage(samples), minimizer, vectors)
                }
                _ => self.wide::<OTHER_LANES, _, _>(&**grid, minimizer, vectors),
            },
            _ => self.near_fields(minimizer),
        }
    }

    /// Indices of the elements that are not culled, in their order, each with a lower bound, or why there is none.
    #[cfg(feature = "bake")]
    pub fn survivors(&self) -> Vec<(usize, Result<f64, CullReason>)> {
        match (self.field, Vectors::new()) {
            (AnyField::Grid(grid), Some(vectors)) => match grid.storage() {
                OwnedStorage::Dense(samples) => self.wide_survivors(&grid.with_storage(samples), vectors),
                _ => self.wide_survivors(&**grid, vectors),
            },
            _ => {
                let field = Posed { field: self.field, pose: self.pose };
                let bound = |(index, element)| match cull(&field, self.margins.margin(index), element) {
                    Err(Outcome::Culled) => (index, None),
                    result => (index, Some(result.map_err(|_| CullReason::NotFinite))),
                };
                let bounds = self.elements.iter().enumerate().map(bound);
                bounds.filter_map(|(index, result)| result.map(|result| (index, result))).collect()
            }
        }
    }

    fn wide_survivors<F: EnclosedSdf>(&self, field: &F, vectors: Vectors) -> Vec<(usize, Result<f64, CullReason>)> {
        let field = Posed { field, pose: self.pose };
        let elements = self.elements;
        // Apart: the loops over lanes of the cull have no room for the choice.
        let mut survivors = match self.margins {
            CullMargins::All(margins) => vectors.run(WideCull { field, margins, elements }),
            CullMargins::Each(margins) => vectors.run(WideCull { field, margins, elements }),
        };
        survivors.sort_unstable_by_key(|(index, _)| *index);
        survivors
    }

    /// Element by element, each in what counts of the field there.
    fn near_fields<M: Minimizer<N>>(&self, minimizer: &M) -> Vec<(usize, Outcome<f64, N>)> {
        let whole = Posed { field: self.field, pose: self.pose };
        let field = Posed { field: all_of(self.field), pose: self.pose };
        let margin = |index| self.margins.margin(index);
        let mut outcomes = vec![];
        visit_near(&field, self.elements, margin, |index, near| {
            let (minimum, outcome) = self.search(near, index, minimizer);
            let outcome = match outcome {
                Outcome::Culled => return,
                Outcome::Contact(contact) if !self.lean => {
                    Outcome::Contact(with_error_of_all(&whole, near, &self.elements[index], &minimum, contact))
                }
                outcome => outcome,
            };
            outcomes.push((index, outcome));
        });
        outcomes
    }

    /// The minimum on an element and the outcome.
    #[inline(never)]
    fn search<M: Minimizer<N>>(
        &self,
        field: &Posed<NearField>,
        index: usize,
        minimizer: &M,
    ) -> (Minimum<f64, N>, Outcome<f64, N>) {
        let element = &self.elements[index];
        match cull(field, self.margins.margin(index), element) {
            Ok(lower_bound) => {
                let level = (self.level)(element);
                let minimum = minimizer.minimize_below(field, &element.simplex, level);
                (minimum, self.outcome(field, element, &minimum, level, lower_bound))
            }
            Err(outcome) => (Minimum::default(), outcome),
        }
    }

    /// The outcome of an element that the cull leaves, from its minimum, the level of its search and the lower bound there.
    fn outcome<F: EnclosedSdf>(
        &self,
        field: &F,
        element: &Element<f64, N>,
        minimum: &Minimum<f64, N>,
        level: f64,
        lower_bound: f64,
    ) -> Outcome<f64, N> {
        match self.lean {
            true => lean_contact_at(&PlainNormals(field), level, element, minimum, lower_bound),
            false => classify(field, level, element, minimum, lower_bound),
        }
    }

    fn wide<const L: usize, F, M>(&self, field: &F, minimizer: &M, vectors: Vectors) -> Vec<(usize, Outcome<f64, N>)>
    where
        F: EnclosedSdf,
        M: Minimizer<N>,
    {
        let culled = self.wide_survivors(field, vectors);
        let field = Posed { field, pose: self.pose };
        let elements = self.elements;
        if !M::USES_SIMD {
            let field = Posed { field: all_of(self.field), pose: self.pose };
            return culled.iter().map(|(index, _)| (*index, self.search(&field, *index, minimizer).1)).collect();
        }
        let mut outcomes: Vec<_> = culled.iter().map(|(index, _)| (*index, Outcome::NotFinite)).collect();
        let (mut survivors, mut places) = (vec![], vec![]);
        let mut levels = vec![f64::NAN; elements.len()];
        for (place, (index, result)) in culled.iter().enumerate() {
            if let Ok(lower_bound) = *result {
                survivors.push(Survivor { index: *index, lower_bound });
                places.push(place);
                levels[*index] = (self.level)(&elements[*index]);
            }
        }
        let visit = |survivor: usize, minimum: &Minimum<f64, N>| {
            let Survivor { index, lower_bound } = survivors[survivor];
            let outcome = self.outcome(&field, &elements[index], minimum, levels[index], lower_bound);
            outcomes[places[survivor]].1 = outcome;
        };
        let levels = levels.as_slice();
        vectors.run(WideSearch::<_, _, _, N, L> { field, minimizer, levels, elements, survivors: &survivors, visit });
        outcomes
    }
}

/// Proof that the processor has AVX2 and FMA. FMA is never made of a product and a sum, so that bits stay.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
struct Vectors(pulp::x86::V3);

#[cfg(target_arch = "x86_64")]
impl Vectors {
    fn new() -> Option<Self> {
        pulp::x86::V3::try_new().map(Self)
    }

    /// Runs work with these instructions, as far as it is inlined.
    #[inline(always)]
    fn run<W: NullaryFnOnce>(self, work: W) -> W::Output {
        self.0.vectorize(work)
    }
}

/// WebAssembly's vectors hold two f64: what is written for wide ones would be a quarter of the module, and gain little.
#[cfg(target_arch = "wasm32")]
#[derive(Clone, Copy)]
enum Vectors {}

#[cfg(target_arch = "wasm32")]
impl Vectors {
    fn new() -> Option<Self> {
        None
    }

    fn run<W: NullaryFnOnce>(self, _work: W) -> W::Output {
        match self {}
    }
}

/// The vectors that every processor of the architecture has.
#[cfg(not(any(target_arch = "x86_64", target_arch = "wasm32")))]
#[derive(Clone, Copy)]
struct Vectors;

#[cfg(not(any(target_arch = "x86_64", target_arch = "wasm32")))]
impl Vectors {
    fn new() -> Option<Self> {
        Some(Self)
    }

    #[inline(always)]
    fn run<W: NullaryFnOnce>(self, work: W) -> W::Output {
        work.call()
    }
}

/// The indices of the elements that are not culled, and lower bounds on them.
struct WideCull<'a, F, M, const N: usize> {
    field: F,
    margins: M,
    elements: &'a [Element<f64, N>],
}

impl<F: EnclosedSdf, M: Margins<f64>, const N: usize> NullaryFnOnce for WideCull<'_, F, M, N> {
    type Output = Vec<(usize, Result<f64, CullReason>)>;

    // Only what is inlined here is compiled for the wider vectors.
    #[inline(always)]
    fn call(self) -> Self::Output {
        let mut survivors = vec![];
        batch::cull::<_, _, _, N, CULL_LANES>(&self.field, self.margins, self.elements, |index, result| {
            if result != Err(CullReason::Culled) {
                survivors.push((index, result));
            }
        });
        survivors
    }
}

struct WideSearch<'a, F, M, V, const N: usize, const L: usize> {
    field: F,
    minimizer: &'a M,
    levels: &'a [f64],
    elements: &'a [Element<f64, N>],
    survivors: &'a [Survivor<f64>],
    visit: V,
}

impl<F, M, V, const N: usize, const L: usize> NullaryFnOnce for WideSearch<'_, F, M, V, N, L>
where
    F: EnclosedSdf,
    M: Minimizer<N>,
    V: FnMut(usize, &Minimum<f64, N>),
{
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { field, minimizer, levels, elements, survivors, visit } = self;
        batch::minima::<_, _, _, _, N, L>(&field, minimizer, levels, elements, survivors, visit);
    }
}
