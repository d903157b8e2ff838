//! The three stages of a query, one thread per element: cull, search, report.
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
//! Elements are appended in no particular order. A minimum is kept in the layout of this compiler: no other code reads it.

use core::arch::nvptx::{_block_dim_x, _block_idx_x, _thread_idx_x};
use core::sync::atomic::{AtomicU32, Ordering};

use sdf_core::contact::{self, Contact, Element, Feature, Outcome};
use sdf_core::minimize::{Minimizer, Minimum};
use sdf_core::nalgebra::Vector3;
use sdf_core::{EnclosedSdf, Simplex};

use crate::abi::{ContactRecord, Frame, HIT_BYTES, SURVIVOR_BYTES};

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
#[inline(always)]
pub fn thread() -> usize {
    // SAFETY: these read registers that every thread has.
    let [block, size, thread] = unsafe { [_block_idx_x(), _block_dim_x(), _thread_idx_x()] };
    block as usize * size as usize + thread as usize
}

/// Index of a counter in [`Frame::counters`].
#[derive(Clone, Copy)]
enum Counter {
    Survivors,
    Hits,
    Skipped,
}

/// The counter's value before one is added to it.
#[inline(always)]
unsafe fn count_one(frame: &Frame, counter: Counter) -> usize {
    // SAFETY: the host allocated three counters.
    unsafe { (*(frame.counters as *const AtomicU32).add(counter as usize)).fetch_add(1, Ordering::Relaxed) as usize }
}

/// The counter's value, which no thread of this kernel changes.
#[inline(always)]
unsafe fn read(frame: &Frame, counter: Counter) -> usize {
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
        match contact::cull(field, frame.margin, &element::<N>(frame, id)) {
            Ok(lower_bound) => {
                let slot = count_one(frame, Counter::Survivors);
                *(frame.survivors as *mut Survivor).add(slot) = Survivor { element: id, lower_bound };
            }
            Err(Outcome::NotFinite) => {
                count_one(frame, Counter::Skipped);
            }
            Err(_) => {}
        }
    }
}

/// # Safety
/// As [`cull`], which has run.
#[inline(always)]
pub unsafe fn search<F: EnclosedSdf, M: Minimizer<N>, const N: usize>(field: &F, method: &M, frame: &Frame) {
    // SAFETY: as many survivors were written as are counted; each appends at most once.
    unsafe {
        let index = thread();
        if index >= read(frame, Counter::Survivors) {
            return;
        }
        let survivor = *(frame.survivors as *const Survivor).add(index);
        let element = element::<N>(frame, survivor.element);
        let minimum = method.minimize_below(field, &element.simplex, frame.margin);
        let is_separated = frame.margin < minimum.sample.value && minimum.sample.value.is_finite();
        if !is_separated {
            let slot = count_one(frame, Counter::Hits);
            *(frame.hits as *mut Hit<N>).add(slot) = Hit { survivor, minimum };
        }
    }
}

/// # Safety
/// As [`search`], which has run.
#[inline(always)]
pub unsafe fn report<F: EnclosedSdf, const N: usize>(field: &F, frame: &Frame) {
    // SAFETY: as many hits were written as are counted.
    unsafe {
        let index = thread();
        if index >= read(frame, Counter::Hits) {
            return;
        }
        let Hit { survivor, minimum } = *(frame.hits as *const Hit<N>).add(index);
        let element = element::<N>(frame, survivor.element);
        let record = match contact::contact_at(field, &element, &minimum, survivor.lower_bound) {
            Some(contact) => record(&contact),
            None => {
                count_one(frame, Counter::Skipped);
                ContactRecord { kind: u32::MAX, element: element.id, ..ContactRecord::default() }
            }
        };
        *(frame.contacts as *mut ContactRecord).add(index) = record;
    }
}

/// All three stages of an element in one thread.
///
/// # Safety
/// As [`cull`].
#[inline(always)]
pub unsafe fn contact<F: EnclosedSdf, M: Minimizer<N>, const N: usize>(field: &F, method: &M, frame: &Frame) {
    let id = thread();
    if id >= frame.element_count as usize {
        return;
    }
    // SAFETY: the id is below the number of elements; each appends at most once.
    unsafe {
        match contact::contact(field, method, frame.margin, &element::<N>(frame, id as u32)) {
            Outcome::Contact(contact) => {
                let slot = count_one(frame, Counter::Hits);
                *(frame.contacts as *mut ContactRecord).add(slot) = record(&contact);
            }
            Outcome::NotFinite => {
                count_one(frame, Counter::Skipped);
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
