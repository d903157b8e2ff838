//! sdftool for C: the functions of `include/sdftool.h`, on the crate `sdf-field`.
//!
//! | question | file |
//! |---|---|
//! | How do pointers become slices and back? The only `unsafe` code | `border` |
//! | Which Rust types are the structs of the header? | `types` |
//! | How does a bake report its progress? | `progress` |
//! | What does each function do? | here; of what moves `motion` |

mod border;
mod motion;
mod progress;
mod types;

use std::ffi::{c_char, c_void};
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use sdf_field::core::Sample;
use sdf_field::core::contact::{Contact, Reduction};
use sdf_field::file::{FieldError, GridFault, SaveError};
use sdf_field::{
    BakeError, BakeOptions, ContactOptions, ContactRow, Contacts, Field, MarginOutOfReach, MeshView, OverlapOptions,
    OverlapVerdict, QueryError, Threads,
};

use border::{Callback, Out, guard};
pub use motion::{sdf_clusters, sdf_clusters_free, sdf_clusters_refit, sdf_first_touches};
use progress::{ProgressFunction, Steps};
use types::sign_method;
pub use types::{
    Failure, SdfBakeOptions, SdfError, SdfField, SdfInfo, SdfOverlapPoint, SdfPatch, SdfQuery, SdfResult, SdfTouch,
};

/// The version of the library, such as `0.2.0`.
#[unsafe(no_mangle)]
pub extern "C" fn sdf_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// A dense grid of 64 cells, on the caller's thread.
#[unsafe(no_mangle)]
pub extern "C" fn sdf_bake_options() -> SdfBakeOptions {
    SdfBakeOptions::default()
}

/// All contacts of faces with a distance of at most 0, by the certified search, on the caller's thread.
#[unsafe(no_mangle)]
pub extern "C" fn sdf_query() -> SdfQuery {
    SdfQuery::default()
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_bake(
    vertices: *const f64,
    vertex_count: usize,
    faces: *const u32,
    face_count: usize,
    options: *const SdfBakeOptions,
    progress: Option<ProgressFunction>,
    user: *mut c_void,
    out: *mut *mut SdfField,
    error: *mut SdfError,
) -> SdfResult {
    guard(error, || {
        let out = Out::new(out)?;
        let points = border::rows(vertices, vertex_count, "vertices")?;
        let faces = border::rows(faces, face_count, "faces")?;
        let options = border::value(options, "options")?;
        let progress = progress.map(|function| Callback { function, user });
        let mesh = MeshView { points, faces };
        let baked = border::on_threads(options.threads, || bake(mesh, &options.to_rust()?, progress))?;
        out.give(SdfField(baked));
        Ok(())
    })
}

fn bake(mesh: MeshView, options: &BakeOptions, progress: Option<Callback<ProgressFunction>>) -> Result<Field, Failure> {
    let steps = Steps::new(progress);
    let baked = Field::bake_cancellable(mesh, options, &|step| steps.count(step), &steps.cancel);
    if baked.is_ok() {
        steps.report();
    }
    match baked {
        Ok(_) if steps.cancel.load(Ordering::SeqCst) => Err(Failure::new(SdfResult::Stopped, BakeError::Cancelled)),
        Ok(baked) => Ok(baked.field),
        Err(error @ BakeError::Cancelled) => Err(Failure::new(SdfResult::Stopped, error)),
        Err(error) => Err(Failure::invalid(error)),
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_load(path: *const c_char, out: *mut *mut SdfField, error: *mut SdfError) -> SdfResult {
    guard(error, || {
        let out = Out::new(out)?;
        let path = border::text(path, "path")?;
        out.give(SdfField(Threads::ONE.install(|| Field::open(path)).map_err(file_failure)?));
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_read(
    bytes: *const c_void,
    count: usize,
    out: *mut *mut SdfField,
    error: *mut SdfError,
) -> SdfResult {
    guard(error, || {
        let out = Out::new(out)?;
        let bytes = border::slice(bytes.cast::<u8>(), count, "bytes")?;
        let field = Threads::ONE.install(|| Field::from_bytes(bytes, "bytes")).map_err(file_failure)?;
        out.give(SdfField(field));
        Ok(())
    })
}

fn file_failure(error: FieldError) -> Failure {
    Failure::new(SdfResult::File, error)
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_save(field: *const SdfField, path: *const c_char, error: *mut SdfError) -> SdfResult {
    guard(error, || {
        let field = &border::reference(field, "field")?.0;
        let path = border::text(path, "path")?;
        Threads::ONE.install(|| field.save(path)).map_err(|error| {
            let is_refused = match &error {
                SaveError::ClosedForm(FieldError::Refused { .. }) => true,
                SaveError::Grid(error) => matches!(error.fault, GridFault::Refused(_)),
                SaveError::NotABakedGrid | SaveError::DenseWithBand => true,
                _ => false,
            };
            Failure::new(if is_refused { SdfResult::InvalidArgument } else { SdfResult::File }, error)
        })
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_free(field: *mut SdfField) {
    border::free(field);
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_info(field: *const SdfField, info: *mut SdfInfo, error: *mut SdfError) -> SdfResult {
    guard(error, || {
        let mut room = border::Writer::new(info, 1, "info")?;
        room.push(SdfInfo::from(&border::reference(field, "field")?.0));
        Ok(())
    })
}

/// Points that are sampled before their answers are written, so that memory does not grow with them.
const BLOCK: usize = 1 << 12;

#[unsafe(no_mangle)]
pub extern "C" fn sdf_sample(
    field: *const SdfField,
    points: *const f64,
    count: usize,
    distances: *mut f64,
    gradients: *mut f64,
    error: *mut SdfError,
) -> SdfResult {
    guard(error, || {
        let field = &border::reference(field, "field")?.0;
        let points = border::rows(points, count, "points")?;
        let mut distances = border::Writer::new(distances, count, "distances")?;
        let mut gradients = match gradients.is_null() {
            true => None,
            false => Some(border::Writer::<[f64; 3]>::new(gradients.cast(), count, "gradients")?),
        };
        for block in points.chunks(BLOCK) {
            let Some(gradients) = &mut gradients else {
                field.values(block, Threads::ONE).into_iter().for_each(|value| distances.push(value));
                continue;
            };
            for Sample { value, gradient, status } in field.sample(block, Threads::ONE) {
                distances.push(if status.not_finite { f64::NAN } else { value });
                gradients.push(gradient.into());
            }
        }
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_mesh_distances(
    vertices: *const f64,
    vertex_count: usize,
    faces: *const u32,
    face_count: usize,
    sign: u32,
    threads: u32,
    points: *const f64,
    count: usize,
    distances: *mut f64,
    error: *mut SdfError,
) -> SdfResult {
    guard(error, || {
        let mesh = MeshView {
            points: border::rows(vertices, vertex_count, "vertices")?,
            faces: border::rows(faces, face_count, "faces")?,
        };
        let points = border::rows(points, count, "points")?;
        let mut distances = border::Writer::new(distances, count, "distances")?;
        let sign = sign_method(sign)?;
        let measured = border::on_threads(threads, || {
            Field::mesh_distances(mesh, points, sign, Threads::ALL).map_err(Failure::invalid)
        })?;
        measured.into_iter().for_each(|distance| distances.push(distance));
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_overlap(
    field: *const SdfField,
    other: *const SdfField,
    query: *const SdfQuery,
    verdict: *mut u32,
    points: *mut SdfOverlapPoint,
    capacity: usize,
    count: *mut usize,
    patch: *mut SdfPatch,
    error: *mut SdfError,
) -> SdfResult {
    guard(error, || {
        let mut verdict = border::Answer::optional(verdict, 2, "verdict")?;
        let mut patch = border::Answer::optional(patch, SdfPatch::default(), "patch")?;
        let mut counter = border::Answer::new(count, 0, "count")?;
        let mut room = border::Writer::new(points, capacity, "points")?;
        let fields = [&border::reference(field, "field")?.0, &border::reference(other, "other")?.0];
        let ContactOptions { pose, margin, .. } = border::value(query, "query")?.to_rust()?;
        fields.into_iter().try_for_each(|field| field.check_margin(margin)).map_err(Failure::invalid)?;
        let options = OverlapOptions { poses: [pose, None], margin, ..OverlapOptions::default() };
        let found = fields[0].overlap(fields[1], &options).map_err(Failure::invalid)?;
        found.points.iter().for_each(|point| room.push(point.into()));
        counter.set(found.points.len());
        patch.set(found.patch.into());
        verdict.set(match found.verdict {
            OverlapVerdict::Contact => 0,
            OverlapVerdict::Separated => 1,
            OverlapVerdict::Undecided => 2,
        });
        border::require_room(found.points.len(), capacity, "points")
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_reduce(
    contacts: *mut ContactRow,
    count: *mut usize,
    keep: usize,
    movement: f64,
    thickness: f64,
    shortfall: *mut f64,
    error: *mut SdfError,
) -> SdfResult {
    guard(error, || {
        let found = border::value(count.cast_const(), "count")?;
        let mut counter = border::Writer::new(count, 1, "count")?;
        let mut shortfall = border::Writer::new(shortfall, usize::from(!shortfall.is_null()), "shortfall")?;
        let rows = border::slice(contacts.cast_const(), found, "contacts")?;
        let read: Option<Vec<_>> = rows.iter().map(ContactRow::to_contact).collect();
        let read = read.ok_or_else(|| Failure::invalid("contacts: codes that mean nothing; give those of a query"))?;
        let mut kept = Contacts { contacts: read.clone(), ..Contacts::default() };
        let reduced = kept.reduce(&Reduction { count: keep, movement, thickness }).map_err(Failure::invalid)?;
        let mut others = read;
        for contact in &kept.contacts {
            if let Some(place) = others.iter().position(|other| other == contact) {
                others.remove(place);
            }
        }
        let mut room = border::Writer::new(contacts, found, "contacts")?;
        kept.contacts.iter().chain(&others).for_each(|contact| room.push(contact.into()));
        counter.push(reduced.count);
        shortfall.push(reduced.shortfall);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_contacts(
    field: *const SdfField,
    vertices: *const f64,
    vertex_count: usize,
    faces: *const u32,
    face_count: usize,
    query: *const SdfQuery,
    contacts: *mut ContactRow,
    capacity: usize,
    count: *mut usize,
    undecided: *mut usize,
    error: *mut SdfError,
) -> SdfResult {
    guard(error, || {
        let mut undecided = border::Answer::optional(undecided, 0, "undecided")?;
        let mut counter = border::Answer::new(count, 0, "count")?;
        let mut room = border::Writer::new(contacts, capacity, "contacts")?;
        let mut found = 0;
        let visited = visit(field, (vertices, vertex_count), (faces, face_count), query, &mut undecided, |row| {
            if found < capacity {
                room.push(row);
            }
            found += 1;
            ControlFlow::Continue(())
        });
        counter.set(found);
        let _: ControlFlow<()> = visited?;
        border::require_room(found, capacity, "contacts")
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_visit_contacts(
    field: *const SdfField,
    vertices: *const f64,
    vertex_count: usize,
    faces: *const u32,
    face_count: usize,
    query: *const SdfQuery,
    callback: Option<extern "C" fn(*mut c_void, *const ContactRow) -> i32>,
    user: *mut c_void,
    undecided: *mut usize,
    error: *mut SdfError,
) -> SdfResult {
    guard(error, || {
        let mut undecided = border::Answer::optional(undecided, 0, "undecided")?;
        let callback = callback.ok_or_else(|| Failure::invalid("visit is NULL"))?;
        let flow = visit(field, (vertices, vertex_count), (faces, face_count), query, &mut undecided, |row| {
            if callback(user, &row) == 0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        })?;
        match flow {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Failure::new(SdfResult::Stopped, "visit returned non-zero")),
        }
    })
}

/// Why contacts of this margin are refused, and what to do.
fn margin_advice(error: MarginOutOfReach) -> String {
    let advice = if error.is_too_deep() { ", or set complete of SdfQuery, not 0" } else { "" };
    format!("{error}{advice}")
}

fn visit(
    field: *const SdfField,
    vertices: (*const f64, usize),
    faces: (*const u32, usize),
    query: *const SdfQuery,
    undecided: &mut border::Answer<usize>,
    mut on_row: impl FnMut(ContactRow) -> ControlFlow<()>,
) -> Result<ControlFlow<()>, Failure> {
    let field = &border::reference(field, "field")?.0;
    let points = border::rows(vertices.0, vertices.1, "vertices")?;
    let faces = border::rows(faces.0, faces.1, "faces")?;
    let query = border::value(query, "query")?;
    // Margins of single faces stand in its place.
    let options =
        if query.margins.is_null() { query.to_rust()? } else { SdfQuery { margin: 0.0, ..query }.to_rust()? };
    if query.margins.is_null() {
        options.check_margin(field).map_err(|error| Failure::invalid(margin_advice(error)))?;
    }
    let mesh = MeshView { points, faces };
    let on_contact = |contact: &Contact<f64>| on_row(ContactRow::from(contact));
    let visited = match motion::of_query(&query, mesh, options.elements)? {
        None => field.visit_contacts(mesh, &options, on_contact),
        Some(mesh) => {
            mesh.check_margins(field, &options)
                .map_err(|error| Failure::invalid(format!("margins: {}", margin_advice(error))))?;
            field.visit_contacts_in_motion(&mesh, &options, on_contact)
        }
    };
    let visited = visited.map_err(|error| match error {
        QueryError::MeshNotKept => Failure::invalid(
            "an exact search needs the mesh in the field: bake it again with keep_mesh of SdfBakeOptions, not 0",
        ),
        error => Failure::invalid(error),
    });
    match visited? {
        ControlFlow::Continue(found) => {
            found.require_finite(mesh, options.elements).map_err(Failure::invalid)?;
            undecided.set(found.undecided_count);
        }
        ControlFlow::Break(()) => return Ok(ControlFlow::Break(())),
    }
    Ok(ControlFlow::Continue(()))
}
