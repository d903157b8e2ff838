//! Contacts of many elements, several at a time.
//!
//! | step | what is done | file |
//! |---|---|---|
//! | 1 | Elements are culled by the bounds in their boxes; the rest is evaluated at the centroids, `L` side by side | `cull` |
//! | 2 | Survivors are searched, side by side where [`Minimizer::LOCKSTEP`]: first by the [quick pass](Minimizer::quick_pass), then what that leaves over by the method itself | `search` |
//!
//! Elements wait in a `queue` until they fill all lanes. Compiled for wide vectors, as a crate such as `pulp` does at run time
//! with what is inlined into a function, a lane costs a fraction of a scalar.
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
//! batch::contacts::<_, _, _, _, 3, 8>(&sphere, &search, 0.0, &elements, |index, outcome| outcomes[index] = outcome);
//! for (element, outcome) in elements.iter().zip(outcomes) {
//!     assert_eq!(outcome, contact(&sphere, &search, 0.0, element));
//! }
//! ```

mod cull;
mod margins;
mod queue;
mod search;

use nalgebra::Vector3;

use cull::Culling;
pub use margins::Margins;
use queue::Queue;
use search::Search;

use super::{Element, Outcome};
use crate::minimize::{Minimizer, Minimum};
use crate::number::Float;
use crate::{EnclosedSdf, Lanes, Simplex};

/// Elements that [`contacts`] culls at a time. Those that are left wait until there are more of them than this.
const CHUNK: usize = 128;

/// The outcomes of [`contact`](super::contact), bit for bit, in `L` ≥ 1 lanes. `margin` is one for all, or a slice with one for each
/// element.
///
/// Calls `visit(index, outcome)` once per element, in unspecified order.
#[inline(always)]
pub fn contacts<R, F, M, V, const N: usize, const L: usize>(
    field: &F,
    minimizer: &M,
    margin: impl Margins<R>,
    elements: &[Element<R, N>],
    mut visit: V,
) where
    R: Float,
    F: EnclosedSdf,
    M: Minimizer<N>,
    V: FnMut(usize, Outcome<R, N>),
{
    // One after the other, not one within the other: so compilers keep the state of the search in registers.
    let mut survivors = [Survivor { index: 0, lower_bound: R::zero() }; 2 * CHUNK];
    let mut count: usize = 0;
    for first in (0..elements.len()).step_by(CHUNK) {
        let range = first..elements.len().min(first.saturating_add(CHUNK));
        let is_last = range.end == elements.len();
        Culling::<_, _, _, N, L> { field, margin, elements, range }.run(|index, culled| match culled {
            Ok(lower_bound) => {
                if let Some(next) = survivors.get_mut(count) {
                    *next = Survivor { index, lower_bound };
                }
                count = count.saturating_add(1);
            }
            Err(reason) => visit(index, reason.outcome()),
        });
        if is_last || count > CHUNK {
            let waiting = survivors.get(..count).unwrap_or(&[]);
            search::<_, _, _, _, N, L>(field, minimizer, margin, elements, waiting, |survivor, outcome| {
                if let Some(survivor) = waiting.get(survivor) {
                    visit(survivor.index, outcome);
                }
            });
            count = 0;
        }
    }
}

/// The first half of [`contacts`]: a lower bound of φ on each element, or why it is not searched.
///
/// Calls `visit(index, result)` once per element, in unspecified order.
#[inline(always)]
pub fn cull<R, F, V, const N: usize, const L: usize>(
    field: &F,
    margin: impl Margins<R>,
    elements: &[Element<R, N>],
    mut visit: V,
) where
    R: Float,
    F: EnclosedSdf,
    V: FnMut(usize, Result<R, CullReason>),
{
    Culling::<_, _, _, N, L> { field, margin, elements, range: 0..elements.len() }.run(&mut visit);
}

/// The second half of [`contacts`]: the outcomes of the elements that [`cull`] left.
///
/// Calls `visit(index, outcome)` once per survivor, with its index in `survivors`, in unspecified order.
#[inline(always)]
pub fn search<R, F, M, V, const N: usize, const L: usize>(
    field: &F,
    minimizer: &M,
    margin: impl Margins<R>,
    elements: &[Element<R, N>],
    survivors: &[Survivor<R>],
    mut visit: V,
) where
    R: Float,
    F: EnclosedSdf,
    M: Minimizer<N>,
    V: FnMut(usize, Outcome<R, N>),
{
    let search = Search { field, margin, elements };
    minima::<_, _, _, _, N, L>(field, minimizer, margin, elements, survivors, |index, minimum| {
        if let Some(survivor) = survivors.get(index) {
            search.emit(index, survivor, minimum, &mut visit);
        }
    });
}

/// [`search`] without the last step: the minima on the elements that [`cull`] left. Of each, [`classify`](super::classify) makes the
/// outcome, and [`lean_contact_at`](super::lean_contact_at) one with less in it.
///
/// Calls `visit(index, minimum)` once per survivor, with its index in `survivors`, in unspecified order: what the
/// [quick pass](Minimizer::quick_pass) leaves over waits until it fills all lanes.
#[inline(always)]
pub fn minima<R, F, M, V, const N: usize, const L: usize>(
    field: &F,
    minimizer: &M,
    margin: impl Margins<R>,
    elements: &[Element<R, N>],
    survivors: &[Survivor<R>],
    mut visit: V,
) where
    R: Float,
    F: EnclosedSdf,
    M: Minimizer<N>,
    V: FnMut(usize, &Minimum<R, N>),
{
    const { assert!(L > 0) };
    let search = Search { field, margin, elements };
    let quick_pass = if M::LOCKSTEP { minimizer.quick_pass() } else { None };
    let (mut left_over, mut waiting) = (Queue::<_, L>::empty(), Queue::<_, L>::empty());
    let mut fresh = survivors.chunks(L).zip((0..).step_by(L));
    loop {
        waiting.fill_from(&mut left_over);
        let next = if waiting.count == L { None } else { fresh.next() };
        let method = next.and(quick_pass.as_ref()).unwrap_or(minimizer);
        let is_quick = next.is_some() && quick_pass.is_some();
        let mut queue = match next {
            Some((chunk, first)) => Queue::from_items((first..).zip(chunk.iter().copied())),
            None => core::mem::replace(&mut waiting, Queue::empty()),
        };
        if queue.count == 0 {
            break;
        }
        search.minimize(method, &mut queue, |item, minimum| {
            if is_quick && !minimum.converged {
                left_over.push(*item);
            } else {
                visit(item.0, minimum);
            }
        });
    }
}

/// An element that was not culled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Survivor<R> {
    /// Its index in the slice of elements.
    pub index: usize,
    /// Lower bound of φ on the element.
    pub lower_bound: R,
}

/// Why an element is not searched: an [`Outcome`] without the size of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CullReason {
    /// See [`Outcome::NotFinite`].
    NotFinite,
    /// See [`Outcome::Culled`].
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

/// The simplices of the elements with these indices, one a lane. An index beyond the last element stands for the last.
#[inline(always)]
fn simplices_in_lanes<R: Float, const N: usize, const L: usize>(
    elements: &[Element<R, N>],
    indices: [usize; L],
) -> Simplex<Lanes<R, L>, N> {
    let mut corners = [Vector3::new(Lanes([R::zero(); L]), Lanes([R::zero(); L]), Lanes([R::zero(); L])); N];
    let Some(last) = elements.len().checked_sub(1) else { return Simplex { corners } };
    for lane in 0..L {
        let Some(element) = elements.get(indices[lane].min(last)) else { continue };
        for corner in 0..N {
            let one = element.simplex.corners[corner];
            (corners[corner].x.0[lane], corners[corner].y.0[lane], corners[corner].z.0[lane]) = (one.x, one.y, one.z);
        }
    }
    Simplex { corners }
}
