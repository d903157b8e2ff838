//! The three stages of a query, one thread per element or a team of them: cull, search, report.
//!
//! Each stage is a function of `sdf_core::contact`, so that a contact is that of `contact::contact::<f32, …>` bit for bit. Between
//! the stages the elements that are left move together, so that no thread of a warp waits for one without work:
//!
//! | stage | function of the core | takes | appends to |
//! |---|---|---|---|
//! | [`cull`] | `contact::cull` | every element | survivors |
//! | [`search`] | `Minimizer::minimize_below` | survivors | hits |
//! | [`report`] | `contact::contact_at` | hits | contacts |
//!
//! [`contact()`] is all three in one thread, and [`lean`] so much of them as the paper has; [`lean_cull`] and [`lean_search`] are the same
//! in several kernels.
//!
//! Unsettled elements of a search ([`is_settled`]) go to a second list, the input of the certified search.
//! Where the field has a pose, `place_points` brings the points into its frame before all this, and [`place`] the
//! contacts into the world after it.
//!
//! Elements are appended in no particular order. A minimum is kept in the layout of this compiler: no other code reads it.

#[cfg(target_arch = "nvptx64")]
use core::arch::asm;
#[cfg(target_arch = "nvptx64")]
use core::arch::nvptx::{_block_dim_x, _block_idx_x, _thread_idx_x};
use core::sync::atomic::{AtomicU32, Ordering};

use sdf_core::contact::{self, Contact, Element, Feature, Outcome};
use sdf_core::grid::PlainNormals;
use sdf_core::minimize::{Minimizer, Minimum};
use sdf_core::nalgebra::Vector3;
use sdf_core::{EnclosedSdf, Simplex};

use crate::abi::{ContactRecord, Frame, HIT_BYTES, PoseParams, SURVIVOR_BYTES, counter};

/// An element that the cull leaves, and a lower bound of φ on it.
#[repr(C)]
#[derive(Clone, Copy)]
struct Survivor {
    element: u32,
    lower_bound: f32,
}

/// A survivor whose minimum is not above the margin.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct Hit<const N: usize> {
    survivor: Survivor,
    minimum: Minimum<f32, N>,
}

const _: () = assert!(size_of::<Survivor>() <= SURVIVOR_BYTES && size_of::<Hit<3>>() <= HIT_BYTES);

/// Index of this thread among all.
#[cfg(target_arch = "nvptx64")]
#[inline(always)]
pub fn thread() -> usize {
    // SAFETY: these read registers that every thread has.
    let [block, size, thread] = unsafe { [_block_idx_x(), _block_dim_x(), _thread_idx_x()] };
    block as usize * size as usize + thread as usize
}

/// [`thread`], computed again: the compiler does not keep the one from before.
#[cfg(target_arch = "nvptx64")]
#[inline(always)]
fn thread_again() -> usize {
    let index: u32;
    // SAFETY: these read registers that every thread has.
    unsafe {
        asm!(
            "{{ .reg .u32 block, size; mov.u32 block, %ctaid.x; mov.u32 size, %ntid.x; mov.u32 {0}, %tid.x; mad.lo.u32 {0}, block, size, {0}; }}",
            out(reg32) index,
            options(nomem, nostack)
        );
    }
    index as usize
}

/// Index of the thread of the card that a thread of the CPU stands for.
#[cfg(not(target_arch = "nvptx64"))]
pub use crate::threads::{thread, thread as thread_again};

/// The counter's value before one is added to it.
#[inline(always)]
unsafe fn count_one(frame: &Frame, counter: u32) -> usize {
    // SAFETY: the host allocated all counters.
    unsafe { (*(frame.counters as *const AtomicU32).add(counter as usize)).fetch_add(1, Ordering::Relaxed) as usize }
}

/// The counter's value, which no thread of this kernel changes.
#[inline(always)]
unsafe fn read(frame: &Frame, counter: u32) -> usize {
    // SAFETY: as `count_one`.
    unsafe { *(frame.counters as *const u32).add(counter as usize) as usize }
}

#[inline(always)]
unsafe fn element<const N: usize>(frame: &Frame, id: u32) -> Element<f32, N> {
    // SAFETY: the host checked that every index is below the number of points.
    unsafe {
        let vertices = if N == 1 { [id; N] } else { *(frame.elements as *const [u32; N]).add(id as usize) };
        let point = |vertex: u32| Vector3::from(*(frame.points as *const [f32; 3]).add(vertex as usize));
        Element { id, vertices, simplex: Simplex { corners: vertices.map(point) } }
    }
}

/// # Safety
/// The addresses of the frame are those of arrays as [`Frame`] describes them.
#[inline(always)]
pub unsafe fn cull<F: EnclosedSdf, const N: usize>(field: &F, frame: &Frame) {
    let id = thread();
    if id >= frame.element_count as usize {
        return;
    }
    // SAFETY: the id is below the number of elements; each appends at most once.
    unsafe {
        let id = id as u32;
        keep_survivor(frame, id, contact::cull(field, frame.margin, &element::<N>(frame, id)));
    }
}

/// Appends what a cull leaves, and counts what is skipped.
#[inline(always)]
unsafe fn keep_survivor<const N: usize>(frame: &Frame, element: u32, bound: Result<f32, Outcome<f32, N>>) {
    // SAFETY: the caller's: each element appends at most once.
    unsafe {
        match bound {
            Ok(lower_bound) => {
                let slot = count_one(frame, counter::SURVIVORS);
                *(frame.survivors as *mut Survivor).add(slot) = Survivor { element, lower_bound };
            }
            Err(Outcome::NotFinite) => {
                count_one(frame, counter::SKIPPED);
            }
            Err(_) => {}
        }
    }
}

/// # Safety
/// As [`cull`], which has run.
#[inline(always)]
pub unsafe fn search<F: EnclosedSdf, M: Minimizer<N>, const N: usize>(field: &F, method: &M, frame: &Frame) {
    // SAFETY: the caller's.
    unsafe {
        search_and_list::<_, _, N, 1>(field, method, frame, (counter::UNSETTLED, frame.unsettled != 0), is_settled)
    }
}

/// A search whose answers are certified: it leaves open what its budget did not suffice for, and counts that also where there is no list
/// and the answers are kept. A team of threads has one element of a grid: see `Storage::LANES_OF_THREAD`. On the CPU its first thread does
/// all.
///
/// # Safety
/// As [`search`].
#[inline(always)]
pub unsafe fn certify<F: EnclosedSdf, M: Minimizer<N>, const N: usize, const THREADS: usize>(
    field: &F,
    method: &M,
    frame: &Frame,
) {
    // SAFETY: the caller's.
    unsafe { search_and_list::<_, _, N, THREADS>(field, method, frame, (counter::OPEN, true), is_certified) }
}

/// Is there a survivor for this thread and the others of its team? On the CPU the first of them does all the work.
///
/// # Safety
/// As [`search`].
#[inline(always)]
pub unsafe fn is_at_work<const THREADS: usize>(frame: &Frame) -> bool {
    // SAFETY: the caller's.
    let count = unsafe { read(frame, frame.survivor_counter) };
    thread() / THREADS < count && (cfg!(target_arch = "nvptx64") || thread().is_multiple_of(THREADS))
}

#[inline(always)]
unsafe fn search_and_list<F: EnclosedSdf, M: Minimizer<N>, const N: usize, const THREADS: usize>(
    field: &F,
    method: &M,
    frame: &Frame,
    (counter, counts): (u32, bool),
    is_settled: impl Fn(&Minimum<f32, N>, f32) -> bool,
) {
    // SAFETY: as many survivors were written as are counted; each appends at most once.
    unsafe {
        if !is_at_work::<THREADS>(frame) {
            return;
        }
        let survivor = *(frame.survivors as *const Survivor).add(thread() / THREADS);
        let element = element::<N>(frame, survivor.element);
        let minimum = method.minimize_below(field, &element.simplex, frame.margin);
        if !thread_again().is_multiple_of(THREADS) {
            return;
        }
        // Kept through the search, survivor and index would take three of its registers.
        let survivor = (frame.survivors as *const Survivor).add(thread_again() / THREADS).read_volatile();
        if counts && !is_settled(&minimum, frame.margin) {
            let slot = count_one(frame, counter);
            if frame.unsettled != 0 {
                *(frame.unsettled as *mut Survivor).add(slot) = survivor;
                return;
            }
        }
        let is_separated = frame.margin < minimum.sample.value && minimum.sample.value.is_finite();
        if !is_separated {
            let slot = count_one(frame, counter::HITS);
            *(frame.hits as *mut Hit<N>).add(slot) = Hit { survivor, minimum };
        }
    }
}

/// Does a local search say enough? If it ended by its own condition and within the margin, or the answer is not finite. A minimum above
/// the margin may be a local one.
#[inline(always)]
fn is_settled<const N: usize>(minimum: &Minimum<f32, N>, margin: f32) -> bool {
    let value = minimum.sample.value;
    !value.is_finite() || (minimum.converged && value <= margin)
}

/// Does a certified search say enough? If its minimum is known to within its tolerance and is within the margin, if its bound is above
/// the margin, or if the answer is not finite. A minimum above the margin with a bound below it decides nothing.
#[inline(always)]
fn is_certified<const N: usize>(minimum: &Minimum<f32, N>, margin: f32) -> bool {
    is_settled(minimum, margin) || margin < minimum.lower_bound
}

/// # Safety
/// As [`search`], which has run.
#[inline(always)]
pub unsafe fn report<F: EnclosedSdf, const N: usize>(field: &F, frame: &Frame) {
    // SAFETY: as many hits were written as are counted.
    unsafe {
        let index = thread();
        if index >= read(frame, counter::HITS) {
            return;
        }
        let Hit { survivor, minimum } = *(frame.hits as *const Hit<N>).add(index);
        let element = element::<N>(frame, survivor.element);
        let record = match contact::contact_at(field, &element, &minimum, survivor.lower_bound) {
            Some(contact) => record(&contact),
            None => {
                count_one(frame, counter::SKIPPED);
                ContactRecord { kind: u32::MAX, element: element.id, ..ContactRecord::default() }
            }
        };
        *(frame.contacts as *mut ContactRecord).add(index) = record;
    }
}

/// Moves a contact into the world.
///
/// # Safety
/// As [`report`], which has run.
#[inline(always)]
pub unsafe fn place(pose: &PoseParams, frame: &Frame) {
    // SAFETY: as many contacts were written as hits are counted.
    unsafe {
        let index = thread();
        if index < read(frame, counter::HITS) {
            let record = &mut *(frame.contacts as *mut ContactRecord).add(index);
            record.point = pose.push(record.point);
            record.surface_point = pose.push(record.surface_point);
            record.normal = pose.turned(record.normal);
        }
    }
}

/// All three stages of an element in one thread.
///
/// # Safety
/// As [`cull`].
#[inline(always)]
pub unsafe fn contact<F: EnclosedSdf, M: Minimizer<N>, const N: usize>(field: &F, method: &M, frame: &Frame) {
    // SAFETY: the caller's.
    unsafe { finish(frame, |element| contact::contact(field, method, frame.margin, element)) }
}

/// [`contact`] without bounds in boxes, smooth normals and bounds of errors: what the paper computes.
///
/// # Safety
/// As [`cull`].
#[inline(always)]
pub unsafe fn lean<F: EnclosedSdf, M: Minimizer<N>, const N: usize>(field: &F, method: &M, frame: &Frame) {
    // SAFETY: the caller's.
    unsafe {
        finish(frame, |element| contact::lean_contact(&PlainNormals(field), method, frame.margin, element));
    }
}

/// The elements that [`lean`] searches.
///
/// # Safety
/// As [`cull`].
#[inline(always)]
pub unsafe fn lean_cull<F: EnclosedSdf, const N: usize>(field: &F, frame: &Frame) {
    let id = thread();
    if id >= frame.element_count as usize {
        return;
    }
    // SAFETY: the id is below the number of elements; each appends at most once.
    unsafe {
        let id = id as u32;
        keep_survivor(frame, id, contact::lean_cull(&PlainNormals(field), frame.margin, &element::<N>(frame, id)));
    }
}

/// Search and contacts of what [`lean_cull`] leaves. Searches that do not converge are listed, if there is a list.
///
/// # Safety
/// As [`search`], after [`lean_cull`].
#[inline(always)]
pub unsafe fn lean_search<F: EnclosedSdf, M: Minimizer<N>, const N: usize>(field: &F, method: &M, frame: &Frame) {
    // SAFETY: as many survivors were written as are counted; each appends at most once.
    unsafe {
        let index = thread();
        if index >= read(frame, frame.survivor_counter) {
            return;
        }
        let survivor = *(frame.survivors as *const Survivor).add(index);
        let (field, element) = (PlainNormals(field), element::<N>(frame, survivor.element));
        let minimum = method.minimize_below(&field, &element.simplex, frame.margin);
        if frame.unsettled != 0 && !minimum.converged {
            let slot = count_one(frame, counter::UNSETTLED);
            *(frame.unsettled as *mut Survivor).add(slot) = survivor;
            return;
        }
        let lower_bound = survivor.lower_bound;
        keep(frame, &contact::lean_contact_at(&field, frame.margin, &element, &minimum, lower_bound));
    }
}

/// Keeps the outcome of this thread's element.
#[inline(always)]
unsafe fn finish<const N: usize>(frame: &Frame, outcome: impl Fn(&Element<f32, N>) -> Outcome<f32, N>) {
    let id = thread();
    if id < frame.element_count as usize {
        // SAFETY: the id is below the number of elements; each appends at most once.
        unsafe { keep(frame, &outcome(&element::<N>(frame, id as u32))) }
    }
}

/// Appends a contact, and counts what is skipped.
#[inline(always)]
unsafe fn keep<const N: usize>(frame: &Frame, outcome: &Outcome<f32, N>) {
    // SAFETY: the caller's: each element appends at most once.
    unsafe {
        match outcome {
            Outcome::Contact(contact) => {
                let slot = count_one(frame, counter::HITS);
                *(frame.contacts as *mut ContactRecord).add(slot) = record(contact);
            }
            Outcome::NotFinite => {
                count_one(frame, counter::SKIPPED);
            }
            Outcome::Culled | Outcome::Separated(_) => {}
        }
    }
}

#[inline(always)]
fn record(contact: &Contact<f32>) -> ContactRecord {
    let (feature_kind, feature) = match contact.feature {
        Feature::Vertex(vertex) => (0, [vertex, 0]),
        Feature::Edge(vertices) => (1, vertices),
        Feature::Face(face) => (2, [face, 0]),
    };
    ContactRecord {
        kind: contact.kind as u32,
        element: contact.element,
        vertices: contact.vertices,
        rank: contact.rank,
        feature_kind,
        feature,
        weights: contact.weights,
        point: contact.point.into(),
        surface_point: contact.surface_point.into(),
        normal: contact.normal.into(),
        slope: contact.slope,
        distance: contact.distance,
        lower_bound: contact.lower_bound,
        error_bound: contact.error_bound,
        shape_lower_bound: contact.shape_lower_bound,
        evaluations: contact.evaluations,
        status: contact.status as u32,
    }
}
