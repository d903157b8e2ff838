mod search;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use sdf_core::contact::{Contact, Element, Outcome, all_contacts};
use sdf_core::minimize::{
    AllMinima, Certified, FrankWolfe, GoldenSection, LineSearch, Minimizer, Minimum, Newton, Place, PointSampling,
    ProjectedGradient,
};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placed, Placement, Rigid};
use sdf_core::{Sdf, Simplex};
use sdf_formats::contact_file::{self, ContactRecord, Label};
use sdf_formats::field_file::{self, Field, OpenField};
use sdf_formats::grid_file::{GridReader, StoredGrid, Summary};
use sdf_formats::mesh::Mesh;
use serde::Serialize;

use self::search::Search;
use super::overlap;
use crate::args::{ContactsArgs, Elements, Method};
use crate::from_file::{FromFile, band};
use crate::report::{Report, line_of_json, many, number, seconds};
use crate::{mesh_input, output, progress};

pub fn run(args: &ContactsArgs) -> Result<()> {
    if let Some(path) = &args.output {
        output::require(path, &[&args.mesh, &args.sdf])?;
    }
    if field_file::is_field(&args.mesh) {
        return overlap::run(args);
    }
    overlap::refuse_options_of_fields(args)?;
    let started = Instant::now();
    let mesh = mesh_input::read_mesh(&args.mesh)?;
    if args.elements == Elements::Faces {
        let name = args.mesh.display().to_string();
        mesh.require_triangles(&name).context("take --elements vertices or edges")?;
    }
    let pose = Rigid::new(args.translate.0, args.rotate.0).context("--rotate is no turn")?;
    let (found, from_file, read) = progress::on_threads(args.threads, || {
        let (field, from_file) = read_field(args, &mesh, &pose)?;
        let read = started.elapsed().as_secs_f64();
        anyhow::Ok((find(args, &mesh, &field)?, from_file, read))
    })??;
    let query = started.elapsed().as_secs_f64() - read;

    let document = Document {
        schema: "sdftool.contacts/1",
        elements: found.elements,
        passed_cull: found.passed_cull,
        not_finite: found.not_finite,
        contacts: &found.contacts,
        read: from_file,
        seconds: Seconds { read, query },
    };
    if let (Some(path), Some(format)) = (&args.output, args.format()) {
        mesh_input::at(path, contact_file::write(path, format, &found.contacts, || line_of_json(&document)))?;
    }
    let deepest = found.contacts.iter().min_by(|a, b| a.distance.total_cmp(&b.distance));
    let mut rows = vec![
        ("elements", found.elements.to_string()),
        ("passed the cull", found.passed_cull.to_string()),
        ("contacts", found.contacts.len().to_string()),
        ("inside", found.contacts.iter().filter(|contact| contact.distance < 0.0).count().to_string()),
        ("deepest", deepest.map_or("none".to_owned(), describe)),
        ("time", format!("{} to read, {} to find", seconds(read), seconds(query))),
    ];
    if let Some(read) = &from_file {
        rows.push(("read", read.in_words()));
    }
    if found.not_finite > 0 {
        rows.push(("too far out", format!("{} elements were passed over: no number holds them", found.not_finite)));
    }
    if let Some(path) = &args.output {
        rows.push(("file", path.display().to_string()));
    }
    Report { rows, json: document }.print(args.json)
}

#[derive(Serialize)]
struct Document<'a> {
    schema: &'static str,
    elements: usize,
    passed_cull: usize,
    not_finite: usize,
    contacts: &'a [ContactRecord],
    /// Of a grid alone.
    read: Option<FromFile>,
    seconds: Seconds,
}

#[derive(Serialize)]
struct Seconds {
    read: f64,
    query: f64,
}

fn describe(contact: &ContactRecord) -> String {
    let [x, y, z] = contact.point.map(number);
    format!("{} at ({x}, {y}, {z}), {} {}", number(contact.distance), contact.element.name(), contact.id)
}

/// The field, a grid only as far as the mesh can reach it.
fn read_field(args: &ContactsArgs, mesh: &Mesh, pose: &Rigid) -> Result<(Field, Option<FromFile>)> {
    match field_file::open(&args.sdf)? {
        OpenField::Analytic(node) => Ok((Field::Analytic(node), None)),
        OpenField::Grid(reader) => {
            let summary = reader.summary();
            require_known(&args.sdf, args.margin, &summary)?;
            let stored = match args.elements {
                Elements::Faces => read_reached(args, mesh, pose, reader, &mesh.triangles),
                Elements::Edges => read_reached(args, mesh, pose, reader, &mesh.edges()),
                Elements::Vertices => read_reached(args, mesh, pose, reader, &vertices(mesh)),
            }?;
            let from_file = FromFile::of(&stored, summary.file_bytes);
            Ok((Field::Grid(stored), Some(from_file)))
        }
    }
}

fn read_reached<const N: usize>(
    args: &ContactsArgs,
    mesh: &Mesh,
    pose: &Rigid,
    reader: GridReader,
    elements: &[[u32; N]],
) -> Result<StoredGrid> {
    let world = || elements.iter().map(|vertices| simplex(mesh, *vertices).bounds());
    let farthest = world().fold(args.margin.abs(), |most, bounds| {
        bounds.min.into_iter().chain(bounds.max).fold(most, |most, x| most.max(x.abs()))
    });
    let stays = stays(args);
    // What is asked of an element may lie beyond its box by the rounding of the world's coordinates.
    let off = farthest * 4.0 * f64::EPSILON;
    let regions = world().map(|bounds| if stays { bounds } else { pose.pull_bounds(bounds.inflate(off)) });
    Ok(reader.read_needed(regions, args.margin + farthest * ROUNDING)?)
}

/// More than a cull allows for rounding in f64, as a share of the largest coordinate.
const ROUNDING: f64 = 1e-12;

/// Refuses a margin beyond which a grid has lower bounds in place of distances: contacts would be reported there that
/// are none.
pub(super) fn require_known(file: &Path, margin: f64, grid: &Summary) -> Result<()> {
    let spacing = grid.lattice.spacing();
    let limits = [("--padding", Some(grid.about.padding)), ("--band", band(&grid.layout))];
    for (option, limit) in limits.into_iter().filter_map(|(option, limit)| Some((option, limit?))) {
        if margin > limit * (1.0 + ROUNDING) {
            bail!(
                "{}: --margin {} is more than the {} around the surface in which the grid has distances: bake it with {option} {} \
                 or more, or take a smaller --margin",
                file.display(),
                number(margin),
                number(limit),
                many((margin / spacing).ceil())
            );
        }
    }
    Ok(())
}

/// All contacts of a mesh, in the order of its elements.
pub struct Found {
    pub elements: usize,
    pub passed_cull: usize,
    /// Elements with a corner, or an answer of the field, beyond what can be reckoned with.
    pub not_finite: usize,
    pub contacts: Vec<ContactRecord>,
}

/// Puts the field into the world, at no cost where it stays where it is.
pub fn find(args: &ContactsArgs, mesh: &Mesh, field: &Field) -> Result<Found> {
    let pose = Rigid::new(args.translate.0, args.rotate.0).context("--rotate is no turn")?;
    match (field, stays(args)) {
        (Field::Grid(StoredGrid { grid, .. }), true) => of_elements(args, mesh, grid),
        (Field::Grid(StoredGrid { grid, .. }), false) => {
            of_elements(args, mesh, &Placed { field: grid, placement: pose })
        }
        (Field::Analytic(node), true) => of_elements(args, mesh, node),
        (Field::Analytic(node), false) => of_elements(args, mesh, &Placed { field: node, placement: pose }),
    }
}

/// Whether the field stays where it is.
fn stays(args: &ContactsArgs) -> bool {
    args.translate.0 == [0.0; 3] && args.rotate.0 == [0.0, 0.0, 0.0, 1.0]
}

fn of_elements<F: Search>(args: &ContactsArgs, mesh: &Mesh, field: &F) -> Result<Found> {
    let mut found = match args.elements {
        Elements::Faces => by_method(args, mesh, field, &mesh.triangles)?,
        Elements::Vertices => by_method(args, mesh, field, &vertices(mesh))?,
        Elements::Edges if args.method == Method::Gss => {
            let search = GoldenSection { iterations: args.iterations(), ..GoldenSection::default() };
            of_each(args, mesh, field, &mesh.edges(), &search)
        }
        Elements::Edges => by_method(args, mesh, field, &mesh.edges())?,
    };
    if args.elements == Elements::Faces {
        found.contacts.iter_mut().for_each(|contact| contact.polygon = Some(mesh.polygons[contact.id as usize]));
    }
    Ok(found)
}

fn by_method<F: Search, const N: usize>(
    args: &ContactsArgs,
    mesh: &Mesh,
    field: &F,
    elements: &[[u32; N]],
) -> Result<Found>
where
    PointSampling: Minimizer<N>,
{
    let iterations = args.iterations();
    let samples = |samples| of_each(args, mesh, field, elements, &PointSampling { samples });
    Ok(match args.method {
        Method::Pgd => {
            let descent = ProjectedGradient { iterations, ..ProjectedGradient::default() };
            of_each(args, mesh, field, elements, &descent)
        }
        Method::Fw => of_each(args, mesh, field, elements, &FrankWolfe { iterations, ..FrankWolfe::default() }),
        Method::Ls => of_each(args, mesh, field, elements, &LineSearch { iterations, ..LineSearch::default() }),
        Method::Newton => of_each(args, mesh, field, elements, &Newton { iterations, ..Newton::default() }),
        Method::Auto | Method::Certified => {
            let search = Certified { evaluations: iterations, tolerance: args.tolerance, ..Certified::default() };
            if args.all_minima {
                all_of_each(args, mesh, field, elements, &AllMinima { search, ..AllMinima::default() })
            } else {
                of_each(args, mesh, field, elements, &search)
            }
        }
        Method::Sample4 => samples(4),
        Method::Sample16 => samples(16),
        Method::Sample64 => samples(64),
        Method::Gss => bail!("--method gss searches along edges"),
    })
}

fn of_each<F, M, const N: usize>(
    args: &ContactsArgs,
    mesh: &Mesh,
    field: &F,
    elements: &[[u32; N]],
    minimizer: &M,
) -> Found
where
    F: Search,
    M: Minimizer<N> + Sync,
{
    let of_chunk = |(chunk, vertices): (usize, &[[u32; N]])| {
        let ids = chunk * CHUNK..;
        let elements: Vec<_> = ids.zip(vertices).map(|(id, vertices)| element(mesh, id, *vertices)).collect();
        let outcomes = field.outcomes(minimizer, args.margin, &elements);
        outcomes.iter().filter_map(Passed::of).collect::<Vec<_>>()
    };
    let passed = elements.par_chunks(CHUNK).enumerate().map(of_chunk);
    Found::of(elements.len(), passed.collect::<Vec<_>>().into_iter().flatten().collect())
}

/// So many elements are searched at a time: enough to fill all lanes but for the last, few enough to share among threads.
const CHUNK: usize = 512;

/// Room for the pieces of an element: half a megabyte a thread.
const MAX_PIECES: usize = 4096;

/// Of the minima of one element so many are found at most; with more, the contacts say that the budget was spent.
const MAX_MINIMA: usize = 256;

fn all_of_each<F: Sdf + Sync, const N: usize>(
    args: &ContactsArgs,
    mesh: &Mesh,
    field: &F,
    elements: &[[u32; N]],
    search: &AllMinima,
) -> Found {
    let room = || (vec![Place::default(); MAX_PIECES], vec![Minimum::default(); MAX_MINIMA]);
    let outcome = |(places, minima): &mut (Vec<_>, Vec<_>), (id, vertices): (usize, &[u32; N])| {
        let mut contacts = vec![];
        let take = |contact: &Contact<f64, N>| contacts.push(ContactRecord::from(contact));
        match all_contacts(field, search, args.margin, &element(mesh, id, *vertices), places, minima, take) {
            Outcome::NotFinite => Some(Passed::NotFinite),
            Outcome::Culled => None,
            Outcome::Separated(_) => Some(Passed::Separated),
            Outcome::Contact(_) => Some(Passed::Touches(contacts)),
        }
    };
    let passed: Vec<Option<Passed>> = elements.par_iter().enumerate().map_init(room, outcome).collect();
    Found::of(elements.len(), passed.into_iter().flatten().collect())
}

fn element<const N: usize>(mesh: &Mesh, id: usize, vertices: [u32; N]) -> Element<f64, N> {
    Element { id: id as u32, vertices, simplex: simplex(mesh, vertices) }
}

fn simplex<const N: usize>(mesh: &Mesh, vertices: [u32; N]) -> Simplex<f64, N> {
    Simplex { corners: vertices.map(|vertex| Vector3::from(mesh.points[vertex as usize])) }
}

impl Found {
    fn of(elements: usize, passed: Vec<Passed>) -> Self {
        let not_finite = passed.iter().filter(|passed| matches!(passed, Passed::NotFinite)).count();
        let passed_cull = passed.len() - not_finite;
        let contacts = passed.into_iter().flat_map(|passed| match passed {
            Passed::Touches(contacts) => contacts,
            Passed::NotFinite | Passed::Separated => vec![],
        });
        Self { elements, passed_cull, not_finite, contacts: contacts.collect() }
    }
}

fn vertices(mesh: &Mesh) -> Vec<[u32; 1]> {
    (0..mesh.points.len() as u32).map(|vertex| [vertex]).collect()
}

/// What became of an element that was not culled.
enum Passed {
    NotFinite,
    Separated,
    Touches(Vec<ContactRecord>),
}

impl Passed {
    fn of<const N: usize>(outcome: &Outcome<f64, N>) -> Option<Self> {
        match outcome {
            Outcome::NotFinite => Some(Self::NotFinite),
            Outcome::Culled => None,
            Outcome::Separated(_) => Some(Self::Separated),
            Outcome::Contact(contact) => Some(Self::Touches(vec![ContactRecord::from(contact)])),
        }
    }
}
