//! Which requests are there, and what are their answers? Requests and answers are JSON; arrays lie beside them in buffers.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use sdf_field::core::contact::Contact;
use sdf_field::page::{self, Scene};
use sdf_field::{BakeError, ContactRow, Contacts, Field, MeshView, Progress, QueryError, Threads, status_bits};
use sdf_formats::contact_file::ContactRecord;
use sdf_formats::mesh;
use serde::Deserialize;
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use crate::options::{self, BakeWords, ContactWords};
use crate::{Buffers, FIELDS, progress};

/// A request, named by `call`.
#[derive(Deserialize)]
#[serde(tag = "call", rename_all = "camelCase", rename_all_fields = "camelCase", deny_unknown_fields)]
enum Request {
    /// Version and names of codes.
    About {},
    /// Bytes of a mesh file: points, faces and where they come from.
    Mesh { name: String },
    /// Points and faces: the number of a field, and facts about it.
    Bake { options: Map<String, Value> },
    /// Bytes of a field's file: likewise.
    Open { name: String },
    /// The bytes of a file that `Open` opens.
    Save { field: usize },
    /// Points: values, then gradients; statuses as bytes.
    Sample { field: usize },
    /// Points and faces: the contacts, column by column.
    Contacts { field: usize, options: Map<String, Value> },
    /// Points and faces, or none: a page as bytes.
    Page { field: usize, name: String, options: Map<String, Value> },
    /// Gives the field's memory back.
    Free { field: usize },
}

pub fn run(input: Buffers) -> Result<Buffers, String> {
    let request = serde_json::from_slice(&input.text).map_err(|error| error.to_string())?;
    match request {
        Request::About {} => Buffers::text(&json!({
            "version": env!("CARGO_PKG_VERSION"),
            "elementNames": ContactRow::ELEMENT_NAMES,
            "statusNames": ContactRow::STATUS_NAMES,
        })),
        Request::Mesh { name } => read_mesh(&input.bytes, &name),
        Request::Bake { options } => bake(&input, &options::read(options)?),
        Request::Open { name } => {
            let field = Field::from_bytes(&input.bytes, &name).map_err(|error| error.to_string())?;
            Buffers::text(&keep(field))
        }
        Request::Save { field } => {
            let bytes = self::field(field)?.to_bytes().map_err(|error| error.to_string())?;
            Ok(Buffers { bytes, ..Buffers::text(&json!({}))? })
        }
        Request::Sample { field } => sample(&self::field(field)?, &input),
        Request::Contacts { field, options } => {
            let field = self::field(field)?;
            let (found, summary) = contacts(&field, mesh(&input)?, &options::read(options)?)?;
            let rows: Vec<ContactRow> = found.contacts.iter().map(ContactRow::from).collect();
            let (f64s, u32s) = columns(&rows);
            Ok(Buffers { f64s, u32s, ..Buffers::text(&summary)? })
        }
        Request::Page { field, name, options } => page(&self::field(field)?, name, &input, &options::read(options)?),
        Request::Free { field } => {
            FIELDS.with_borrow_mut(|fields| fields.get_mut(field).and_then(Option::take));
            Buffers::text(&json!({}))
        }
    }
}

fn read_mesh(bytes: &[u8], name: &str) -> Result<Buffers, String> {
    let mesh = mesh::read_bytes(bytes, name).map_err(|error| error.to_string())?;
    let sha256: String = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    let answer = Buffers::text(&json!({"source": {"name": name, "sha256": sha256}}))?;
    Ok(Buffers { f64s: mesh.points.into_flattened(), u32s: mesh.triangles.into_flattened(), ..answer })
}

fn bake(input: &Buffers, options: &BakeWords) -> Result<Buffers, String> {
    let mesh = mesh(input)?;
    let options = options.to_rust(mesh.faces.len())?;
    let (cancel, done, total) = (AtomicBool::new(false), AtomicU64::new(0), AtomicU64::new(0));
    let on_progress = |step| {
        match step {
            Progress::Total(count) => total.fetch_add(count, Ordering::Relaxed),
            Progress::Done(count) => done.fetch_add(count, Ordering::Relaxed),
        };
        let [done, total] = [&done, &total].map(|count| count.load(Ordering::Relaxed) as f64);
        if !cancel.load(Ordering::Relaxed) && progress(done, total) != 0 {
            cancel.store(true, Ordering::Relaxed);
        }
    };
    let baked = Field::bake_cancellable(mesh, &options, &on_progress, &cancel);
    let baked = baked.map_err(|error: BakeError| error.to_string())?;
    let mut answer = keep(baked.field);
    answer["isSignContinuous"] = json!(baked.is_sign_continuous);
    Buffers::text(&answer)
}

/// Keeps a field under a number, and says what is known of it.
fn keep(field: Field) -> Value {
    let facts = facts(&field);
    let number = FIELDS.with_borrow_mut(|fields| {
        let free = fields.iter().position(Option::is_none);
        let number = free.unwrap_or(fields.len());
        fields.resize_with(fields.len().max(number + 1), || None);
        fields[number] = Some(field);
        number
    });
    json!({"field": number, "info": facts})
}

fn facts(field: &Field) -> Value {
    let bounds = field.domain();
    let mut facts = json!({
        "layout": field.grid().map_or("closed form", |grid| grid.storage().layout().name()),
        "bounds": [bounds.min, bounds.max],
        "slopeBound": field.slope_bound(),
    });
    if let Some(grid) = field.grid() {
        facts["precision"] = json!(grid.storage().precision().name());
        facts["shape"] = json!(grid.lattice().nodes());
        facts["spacing"] = json!(grid.lattice().spacing());
    }
    if let Some(info) = field.info() {
        facts["errorBound"] = json!(info.error_bound);
        facts["band"] = json!(info.band);
        facts["maxMargin"] = json!(info.max_margin());
        facts["signMethod"] = json!(info.sign_method.name());
        facts["signReason"] = json!(info.sign_reason);
    }
    facts
}

/// The field of a number. A clone shares the samples.
fn field(number: usize) -> Result<Field, String> {
    let field = FIELDS.with_borrow(|fields| fields.get(number).and_then(Option::clone));
    field.ok_or_else(|| "the field was freed".to_owned())
}

/// Points that are sampled before their answers are written, so that memory grows by these alone.
const BLOCK: usize = 1 << 12;

fn sample(field: &Field, input: &Buffers) -> Result<Buffers, String> {
    let points = points(input)?;
    let (mut f64s, mut bytes) = (vec![0.0; 4 * points.len()], vec![0; points.len()]);
    let (values, gradients) = f64s.split_at_mut(points.len());
    let samples = points.chunks(BLOCK).flat_map(|block| field.sample(block, Threads::ONE));
    let places = values.iter_mut().zip(gradients.as_chunks_mut().0).zip(&mut bytes);
    for (sample, ((value, gradient), status)) in samples.zip(places) {
        *value = if sample.status.not_finite { f64::NAN } else { sample.value };
        *gradient = sample.gradient.into();
        *status = status_bits(sample.status);
    }
    Ok(Buffers { f64s, bytes, ..Buffers::text(&json!({}))? })
}

/// The contacts, and facts about the search.
fn contacts(field: &Field, mesh: MeshView, words: &ContactWords) -> Result<(Contacts, Value), String> {
    let options = words.to_rust()?;
    options.check_margin(field).map_err(|error| {
        let advice = if error.is_too_deep() { ", or give complete: true" } else { "" };
        format!("{error}{advice}")
    })?;
    let mut found = field.contacts(mesh, &options).map_err(|error| match error {
        QueryError::MeshNotKept => {
            "exact: the field does not keep its mesh: bake it again with keepMesh: true".to_owned()
        }
        error => error.to_string(),
    })?;
    found.require_finite(mesh, options.elements).map_err(|error| error.to_string())?;
    let mut summary = summary(&found);
    if let Some(reduction) = words.reduction() {
        let reduced = found.reduce(&reduction).map_err(|error| format!("reduce: {error}"))?;
        summary["foundCount"] = std::mem::replace(&mut summary["count"], json!(reduced.count));
        summary["shortfall"] = json!(reduced.shortfall);
    }
    Ok((found, summary))
}

fn summary(found: &Contacts) -> Value {
    let distances = found.contacts.iter().map(|contact: &Contact<f64>| contact.distance);
    json!({
        "count": found.contacts.len(),
        "elementCount": found.element_count,
        "searchedCount": found.searched_count,
        "possibleCount": found.possible_count,
        "undecidedCount": found.undecided_count,
        "insideCount": distances.clone().filter(|distance| *distance < 0.0).count(),
        "deepest": distances.reduce(f64::min),
    })
}

/// Columns in the order of `F64_COLUMNS` and `U32_COLUMNS` in `sdftool.js`.
fn columns(rows: &[ContactRow]) -> (Vec<f64>, Vec<u32>) {
    let (mut f64s, mut u32s) = (Vec::with_capacity(17 * rows.len()), Vec::with_capacity(12 * rows.len()));
    let triples: [fn(&ContactRow) -> [f64; 3]; 4] =
        [|row| row.weights, |row| row.point, |row| row.surface_point, |row| row.normal];
    triples.iter().for_each(|column| f64s.extend(rows.iter().flat_map(column)));
    let numbers: [fn(&ContactRow) -> f64; 5] = [
        |row| row.distance,
        |row| row.lower_bound,
        |row| row.slope,
        |row| row.error_bound,
        |row| row.shape_lower_bound,
    ];
    numbers.iter().for_each(|column| f64s.extend(rows.iter().map(column)));
    u32s.extend(rows.iter().flat_map(|row| [row.key as u32, (row.key >> 32) as u32]));
    u32s.extend(rows.iter().flat_map(|row| row.vertices));
    u32s.extend(rows.iter().flat_map(|row| row.feature_id));
    let codes: [fn(&ContactRow) -> u32; 5] = [
        |row| row.id,
        |row| row.evaluations,
        |row| row.element.into(),
        |row| row.feature.into(),
        |row| row.status.into(),
    ];
    codes.iter().for_each(|column| u32s.extend(rows.iter().map(column)));
    (f64s, u32s)
}

fn page(field: &Field, name: String, input: &Buffers, options: &ContactWords) -> Result<Buffers, String> {
    let mesh = mesh(input)?;
    let pose = options.to_rust()?.pose;
    let (found, summary) = contacts(field, mesh, options)?;
    let mesh = Some(mesh).filter(|mesh| !mesh.points.is_empty());
    let records: Vec<ContactRecord> = found.contacts.iter().map(ContactRecord::from).collect();
    let scene = Scene { name, field, pose, mesh, segments: &[], contacts: &records };
    let page = page::page(&scene).map_err(|error| error.to_string())?;
    Ok(Buffers { bytes: page.html.into_bytes(), ..Buffers::text(&summary)? })
}

fn points(input: &Buffers) -> Result<&[[f64; 3]], String> {
    let (points, rest) = input.f64s.as_chunks();
    if rest.is_empty() { Ok(points) } else { Err("points: give three numbers for each".to_owned()) }
}

fn mesh(input: &Buffers) -> Result<MeshView<'_>, String> {
    let points = points(input)?;
    let (faces, rest) = input.u32s.as_chunks();
    if rest.is_empty() { Ok(MeshView { points, faces }) } else { Err("faces: give three indices for each".to_owned()) }
}
