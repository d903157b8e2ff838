//! Finds the contacts of a mesh with a field. Of a grid, only the blocks that the mesh may touch are read.

mod reduce;

use std::ops::ControlFlow;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use sdf_core::contact::{Contact, ContactStatus};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placement, Rigid};
use sdf_core::{Real, Simplex};
use sdf_field::page::Scene;
use sdf_field::{ContactOptions, Field, MeshView, Threads};
use sdf_formats::contact_file::{ContactRecord, ContactRows, Label};
use sdf_formats::field_file::OpenField;
use sdf_formats::grid_file::{GridReader, StoredGrid, StoredMesh};
use sdf_formats::mesh::Mesh;
use serde::{Serialize, Serializer};

use crate::args::{ContactsArgs, Elements};
use crate::commands::export::stem;
use crate::device::{Search, Searcher};
use crate::failure::misuse;
use crate::page;
use crate::read_summary::{ROUNDING, ReadSummary, require_distances};
use crate::report::{Report, counted, line_of_json, number, point_at, seconds};
use crate::{field_input, mesh_input, output, progress, standard_output};
use reduce::ReducedContacts;

/// Refuses a mesh that has no such elements.
pub fn require_elements(mesh: &Mesh, elements: Elements, name: &str) -> Result<()> {
    if elements == Elements::Faces {
        mesh.require_triangles(name).map_err(|error| anyhow!("{error}: use --elements vertices or edges"))?;
    }
    if elements == Elements::Edges && mesh.triangles.is_empty() && mesh.segments.is_empty() {
        bail!("no edges in {name}: use --elements vertices");
    }
    Ok(())
}

pub fn run(args: &ContactsArgs) -> Result<()> {
    if let Some(path) = &args.output {
        output::ensure_writable(path, &[&args.mesh, &args.sdf])?;
        output::ensure_alone(path, args.json)?;
    }
    if let Some(page) = &args.view {
        output::ensure_writable(page, &[&args.mesh, &args.sdf])?;
    }
    if args.view.is_some() && mesh_input::is_standard_input(&args.sdf) {
        misuse!("--view reads the field again, which standard input cannot be: name the field's file");
    }
    args.refuse_options_of_fields()?;
    args.refuse_methods_of_exact()?;
    args.refuse_what_lean_leaves_out()?;
    let searcher = Searcher::open(&args.device)?;
    let started = Instant::now();
    let mesh = mesh_input::read_mesh(&args.mesh)?;
    require_elements(&mesh, args.elements, &mesh_input::shown(&args.mesh))?;
    let pose = args.pose.rigid()?;
    let (found, has_grid, read_summary, read) = progress::on_threads(args.threads, || {
        let (field, read_summary) = read_field(args, &searcher, &mesh, &pose)?;
        let read = started.elapsed().as_secs_f64();
        anyhow::Ok((find(args, &searcher, &mesh, &field)?, field.has_grid(), read_summary, read))
    })??;
    let query = started.elapsed().as_secs_f64() - read;

    let document = Document {
        schema: "sdftool.contacts/2",
        device: searcher.name(),
        card: searcher.card()?,
        elements: found.elements,
        passed_cull: found.passed_cull,
        not_finite: found.not_finite,
        possible: found.possible,
        undecided: found.undecided,
        beyond_band: found.beyond_band,
        outside_grid: found.outside_grid,
        reduced: found.reduced,
        contacts: &found,
        read: read_summary,
        seconds: Seconds { read, query },
    };
    if let Some(path) = &args.output {
        output::write_contacts(path, found.records(), |out| line_of_json(&document, out))?;
    }
    if let Some(path) = &args.view {
        // The page shows the whole field, of which only a part was read.
        let field = field_input::read_whole(&args.sdf)?;
        let name = format!("{} on {}", stem(&args.mesh), stem(&args.sdf));
        let pose = args.pose.motion()?;
        let contacts: Vec<ContactRecord> = found.records().collect();
        let view = Some(MeshView { points: &mesh.points, faces: &mesh.triangles });
        let scene = Scene { name, field: &field, pose, mesh: view, segments: &mesh.segments, contacts: &contacts };
        page::write(path, &args.sdf, &scene)?;
    }
    let deepest = found.records().min_by(|a, b| a.distance.total_cmp(&b.distance));
    let mut rows = vec![
        ("elements", found.elements.to_string()),
        ("passed the cull", found.passed_cull.map_or("not counted on a GPU".to_owned(), |count| count.to_string())),
        ("contacts", found.reduced.map_or(found.rows.len(), |reduced| reduced.found).to_string()),
        ("inside", found.inside.to_string()),
        ("deepest", deepest.as_ref().map_or("none".to_owned(), describe)),
        ("time", format!("{} to read, {} to find", seconds(read), seconds(query))),
    ];
    if let Some(reduced) = &found.reduced {
        rows.push(("reduced", reduced.in_words(found.rows.len())));
    }
    if let Some(card) = &document.card {
        rows.push(("device", card.clone()));
    }
    if let Some(read) = &read_summary {
        rows.push(("read", read.in_words()));
    }
    // A closed form has no error.
    if args.complete && !args.exact && (has_grid || found.possible > 0) {
        let what = if has_grid { "the search or the grid's error" } else { "the search" };
        rows.push(("possible", format!("{} of the contacts: {what} leaves open whether they are", found.possible)));
    }
    if args.exact {
        rows.push(("exact", exact_row(&found)));
    }
    if found.undecided > 0 {
        let by_cpu = if searcher.is_card() { "--complete on the CPU" } else { "--complete" };
        let advice = match args.exact {
            true => "give --complete in place of --exact, which lists them".to_owned(),
            false => format!("give more --iterations or a smaller --tolerance, or {by_cpu}, which lists them"),
        };
        rows.push(("undecided", format!("{} elements may be within the margin: {advice}", found.undecided)));
    }
    if found.beyond_band > 0 {
        let count = found.beyond_band;
        let advice = "their distances are coarse; bake with a larger --band, or --layout dense";
        rows.push(("beyond the band", format!("{}: {advice}", counted(count, "contact"))));
    }
    if found.outside_grid > 0 {
        let count = found.outside_grid;
        let advice = "they may be farther away than they say; bake with more --padding, or use a smaller --margin";
        rows.push(("outside the grid", format!("{}: {advice}", counted(count, "contact"))));
    }
    if found.not_finite > 0 {
        let largest = if searcher.is_card() { f32::MAX_COORDINATE } else { f64::MAX_COORDINATE };
        rows.push(("skipped", skipped(found.not_finite, largest)));
    }
    if let Some(path) = &args.output {
        rows.push(("file", standard_output::shown(path)));
    }
    Report { rows, json: document }.print_beside(args.output.as_deref(), args.json)
}

/// Elements that are not searched.
pub fn skipped(count: usize, largest: f64) -> String {
    let elements = counted(count, "element");
    format!("{elements} with coordinates that are not finite or exceed {largest:e}, or where the field has no number")
}

#[derive(Serialize)]
struct Document<'a> {
    schema: &'static str,
    device: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    card: Option<String>,
    elements: usize,
    /// `None` where it is not counted.
    passed_cull: Option<usize>,
    not_finite: usize,
    possible: usize,
    undecided: usize,
    beyond_band: usize,
    outside_grid: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    reduced: Option<ReducedContacts>,
    #[serde(serialize_with = "serialize_records")]
    contacts: &'a ContactList<'a>,
    /// `None` for shapes in closed form.
    read: Option<ReadSummary>,
    seconds: Seconds,
}

/// How many contacts of an exact search are certified.
fn exact_row(found: &ContactList) -> String {
    let is_open = |contact: &ContactRecord| contact.status == ContactStatus::BudgetSpent;
    match found.records().filter(is_open).count() {
        0 => "by the triangles of the kept mesh".to_owned(),
        open => format!("by the triangles of the kept mesh; the depths of {open} may be more, see lower_bound"),
    }
}

#[derive(Serialize)]
struct Seconds {
    read: f64,
    query: f64,
}

fn describe(contact: &ContactRecord) -> String {
    let point = point_at(contact.point, contact.distance);
    format!("{} at {point}, {} {}", number(contact.distance), contact.element.name(), contact.id)
}

/// Reads the field; of a grid only the blocks that the mesh may touch.
fn read_field(
    args: &ContactsArgs,
    searcher: &Searcher,
    mesh: &Mesh,
    pose: &Rigid,
) -> Result<(Field, Option<ReadSummary>)> {
    let margin_to_check = options(args)?.margin_to_check();
    match field_input::open(&args.sdf)? {
        OpenField::Analytic(field) if args.exact => match Field::new(field).has_grid() {
            true => bail!(
                "{}: --exact needs the file of the grid itself: give that, and where it stands by --translate and --rotate",
                mesh_input::shown(&args.sdf)
            ),
            false => bail!("{}: shapes in closed form are exact already: remove --exact", mesh_input::shown(&args.sdf)),
        },
        OpenField::Blob(_) if args.exact => {
            bail!(
                "{}: a blob keeps no mesh for --exact: give the baked grid that it was exported from",
                mesh_input::shown(&args.sdf)
            )
        }
        OpenField::Blob(blob) => Ok((field_input::from_blob(&args.sdf, blob, margin_to_check)?, None)),
        OpenField::Analytic(field) => Ok((field_input::from_shapes(&args.sdf, field, &options(args)?)?, None)),
        OpenField::Grid(reader) => {
            let summary = reader.summary();
            let kept = if args.exact { Some(read_kept_mesh(args, &reader)?) } else { None };
            require_distances(&args.sdf, margin_to_check, &summary)?;
            // A complete search looks as far as the grid can be off.
            let margin = match (args.exact, args.complete) {
                (true, _) => summary.error_bound().reach(args.margin.max(0.0)),
                (false, true) => summary.error_bound().reach(args.margin),
                (false, false) => args.margin,
            };
            let stored = match args.elements {
                // In f32 an element may lie beyond what it needs in f64.
                _ if searcher.is_card() => Ok(reader.read()?),
                Elements::Faces => read_needed(args, margin, mesh, pose, reader, &mesh.triangles),
                Elements::Edges => read_needed(args, margin, mesh, pose, reader, &mesh.edges()),
                Elements::Vertices => read_needed(args, margin, mesh, pose, reader, &vertices(mesh)),
            }?;
            let read_summary = ReadSummary::new(&stored, summary.file_bytes);
            Ok((Field::from_stored(StoredGrid { mesh: kept, ..stored }), Some(read_summary)))
        }
    }
}

fn read_kept_mesh(args: &ContactsArgs, reader: &GridReader) -> Result<StoredMesh> {
    let advice =
        || format!("{} keeps no mesh for --exact: bake it again by bake --keep-mesh", mesh_input::shown(&args.sdf));
    reader.read_mesh()?.with_context(advice)
}

fn read_needed<const N: usize>(
    args: &ContactsArgs,
    margin: f64,
    mesh: &Mesh,
    pose: &Rigid,
    reader: GridReader,
    elements: &[[u32; N]],
) -> Result<StoredGrid> {
    // Of the elements alone: other points of the mesh may be far away.
    let coordinates = elements.iter().flatten().flat_map(|vertex| mesh.points[*vertex as usize]);
    let farthest = coordinates.fold(margin.abs(), |farthest, x| farthest.max(x.abs()));
    let is_moved = args.pose.is_moved();
    // A query on an element may lie outside its box by the rounding of world coordinates.
    let rounding = farthest * 4.0 * f64::EPSILON;
    let regions = elements.iter().map(|vertices| {
        let bounds = simplex(mesh, *vertices).bounds();
        if is_moved { pose.pull_bounds(bounds.inflate(rounding)) } else { bounds }
    });
    Ok(reader.read_needed(regions, margin + farthest * ROUNDING)?)
}

/// All contacts of a mesh, in the order of its elements.
pub struct ContactList<'a> {
    pub elements: usize,
    /// `None` of lean contacts of a card, whose one kernel does not count them.
    pub passed_cull: Option<usize>,
    /// Number of skipped elements: a coordinate or a value of the field is NaN, infinite or too large.
    pub not_finite: usize,
    /// Contacts that the search or the grid's error leaves open.
    pub possible: usize,
    /// Elements that the search left open.
    pub undecided: usize,
    /// Contacts with a negative distance.
    pub inside: usize,
    /// Contacts whose distance is coarse, as they lie beyond the band of a sparse grid.
    pub beyond_band: usize,
    /// Contacts whose distance is a lower bound, as they lie outside of a grid: of one within a closed form.
    pub outside_grid: usize,
    /// Summary of --reduce.
    reduced: Option<ReducedContacts>,
    /// The contacts, packed: there may be millions.
    pub rows: ContactRows,
    /// For each face the polygon of the file; empty for other elements.
    polygons: &'a [u32],
}

impl ContactList<'_> {
    /// The contacts as files hold them.
    pub fn records(&self) -> impl ExactSizeIterator<Item = ContactRecord> {
        self.rows.iter().map(|contact| {
            let polygon = self.polygons.get(contact.element as usize).copied();
            ContactRecord { polygon, ..ContactRecord::from(&contact) }
        })
    }
}

fn serialize_records<S: Serializer>(list: &&ContactList, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(list.records())
}

/// Searches the mesh on the threads of the current pool.
pub fn find<'a>(args: &ContactsArgs, searcher: &Searcher, mesh: &'a Mesh, field: &Field) -> Result<ContactList<'a>> {
    let options = options(args)?;
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let (mut rows, mut inside, mut beyond_band, mut outside_grid) = (ContactRows::default(), 0, 0, 0);
    let mut to_reduce = args.reduce.map(|_| vec![]);
    let keep = |contact: &Contact<f64>| {
        inside += usize::from(contact.distance < 0.0);
        beyond_band += usize::from(contact.status == ContactStatus::BeyondBand);
        outside_grid += usize::from(contact.status == ContactStatus::OutsideGrid);
        match &mut to_reduce {
            Some(contacts) => contacts.push(*contact),
            None => rows.push(contact),
        }
        ControlFlow::Continue(())
    };
    // The line elements of the file are searched, too.
    let edges = if args.elements == Elements::Edges { Some(mesh.edges()) } else { None };
    let found = match searcher.contacts(field, Search { mesh: view, edges: edges.as_deref(), options: &options })? {
        Some(found) => found.contacts.iter().try_for_each(keep).map_continue(|()| found),
        None => match &edges {
            Some(edges) => field.visit_contacts_of_edges(&mesh.points, edges, &options, keep)?,
            None => field.visit_contacts(view, &options, keep)?,
        },
    };
    let found = found.continue_value().context("a search that nothing ends")?;
    let reduced = args.reduce.zip(to_reduce);
    let reduced = reduced.map(|(count, contacts)| reduce::reduce(args, count, contacts, &mut rows)).transpose()?;
    Ok(ContactList {
        elements: found.element_count,
        passed_cull: (!args.lean || !searcher.is_card()).then_some(found.searched_count),
        not_finite: found.not_finite_count,
        possible: found.possible_count,
        undecided: found.undecided_count,
        inside,
        beyond_band,
        outside_grid,
        reduced,
        rows,
        polygons: if args.elements == Elements::Faces { &mesh.polygons } else { &[] },
    })
}

fn options(args: &ContactsArgs) -> Result<ContactOptions> {
    Ok(ContactOptions {
        elements: args.elements.into(),
        method: args.method,
        margin: args.margin,
        pose: args.pose.motion()?,
        budget: args.iterations,
        tolerance: args.tolerance.unwrap_or(ContactOptions::default().tolerance),
        all_minima: args.all_minima,
        complete: args.complete,
        exact: args.exact,
        one_per_feature: args.one_per_feature,
        lean: args.lean,
        threads: Threads::ALL,
    })
}

fn vertices(mesh: &Mesh) -> Vec<[u32; 1]> {
    (0..mesh.points.len() as u32).map(|vertex| [vertex]).collect()
}

fn simplex<const N: usize>(mesh: &Mesh, vertices: [u32; N]) -> Simplex<f64, N> {
    Simplex { corners: vertices.map(|vertex| Vector3::from(mesh.points[vertex as usize])) }
}
