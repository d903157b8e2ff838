//! A field, a mesh and their contacts as one HTML page: `page/template.html` draws them by WebGL2, without a network. It is what
//! `sdftool view` writes and what the browser's door shows.
//!
//! The numbers stand in one deflated text. Points are u16 in the box of their mesh, points and indices are differences from the one
//! before, which deflate well. The surface and the slice are at most 128 cells fine. A graphics card computes in f32: all that is drawn
//! is about the middle of the scene and in units of its diagonal (`Frame`), whatever its place and its unit.

use std::io::Write;

use base64::prelude::{BASE64_STANDARD, Engine};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use sdf_bake::lattice_around;
use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::BRICK;
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placement, Rigid};
use sdf_core::{Aabb, Sdf};
use sdf_formats::contact_file::{ContactRecord, Label};
use serde_json::{Map, Value, json};

use crate::export::BEYOND_GRIDS;
use crate::{Field, MeshView, SurfaceMesh, Threads};

/// Contents of a page.
pub struct Scene<'a> {
    /// The heading.
    pub name: String,
    /// A grid, or a bounded closed form.
    pub field: &'a Field,
    /// Where the field stands in the mesh's frame.
    pub pose: Option<Rigid>,
    /// The mesh whose contacts are shown. One without faces and segments is drawn as its points.
    pub mesh: Option<MeshView<'a>>,
    /// Line elements of the mesh, such as a rope's.
    pub segments: &'a [[u32; 2]],
    /// Contacts of the mesh with the field.
    pub contacts: &'a [ContactRecord],
}

/// A page, and what it lacks.
pub struct Page {
    /// The bytes of the file.
    pub html: String,
    /// Nodes along each axis of the lattice on which the surface was extracted, where no surface passes between them: the page shows none.
    pub empty_between: Option<[u32; 3]>,
}

/// Why a page cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PageError {
    /// The field's surface has no end.
    Unbounded,
    /// The field's box is empty or too large.
    NoCells,
    /// The surface lies beyond the band or the box of a grid that the field is made of.
    BeyondGrids,
    /// The page would have so many bytes, which browsers take long to open.
    TooLong(usize),
}

impl std::fmt::Display for PageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unbounded => f.write_str("the field is unbounded: intersect it with a box"),
            Self::NoCells => f.write_str("the field's box cannot be cut into cells"),
            Self::BeyondGrids => f.write_str(BEYOND_GRIDS),
            Self::TooLong(bytes) => write!(f, "the page would have {bytes} bytes: give a coarser mesh"),
        }
    }
}

impl std::error::Error for PageError {}

/// Cells along the longest side of the surface and of the slice's samples: 1.6 MB for a dragon and its cloth.
const DETAIL: f64 = 128.0;

/// Longest page that is written, in bytes; browsers take long to open longer ones.
const MAX_BYTES: usize = 64 << 20;

const TEMPLATE: &str = include_str!("page/template.html");

/// The page of a scene.
pub fn page(scene: &Scene) -> Result<Page, PageError> {
    let lattice = lattice(scene.field)?;
    if !scene.field.knows_surface() {
        return Err(PageError::BeyondGrids);
    }
    let SurfaceMesh { points, triangles } = scene.field.surface(0.0, &lattice, Threads::ALL);
    let points: Vec<[f64; 3]> = points.iter().map(|point| scene.push(Vector3::from(*point)).into()).collect();
    let frame = Frame::new(&scene.window(&lattice, &points));
    let mut parts = Parts::default();
    let mut boxes = Map::new();
    let triangles_of_surface = Drawn::Triangles(&triangles);
    boxes.insert("surface".to_owned(), parts.mesh("surface", &frame, &points, &[triangles_of_surface]));
    if let Some(mesh) = scene.mesh {
        boxes.insert("mesh".to_owned(), parts.mesh("mesh", &frame, mesh.points, &scene.elements(&mesh)));
    }
    let contacts = scene.contacts;
    let contact_points = contacts.iter().flat_map(|contact| contact.point);
    parts.put("contact_points", contact_points.flat_map(f64::to_le_bytes), 8);
    parts.f32s("contact_normals", contacts.iter().flat_map(|contact| contact.normal));
    let numbers = |contact: &ContactRecord| [contact.distance, contact.lower_bound, f64::from(contact.evaluations)];
    parts.f32s("contact_numbers", contacts.iter().flat_map(numbers));
    parts.put("contact_ids", contacts.iter().flat_map(|contact| contact.id.to_le_bytes()), 4);
    let bricks = scene.field.grid().map_or(&[][..], |grid| grid.storage().slots());
    parts.put("bricks", bricks.iter().flatten().flat_map(|index| (*index as u16).to_le_bytes()), 2);
    let values = parts.field(scene.field, &lattice);
    let head = scene.head(&lattice, &frame, values, boxes, parts.places);
    let data = BASE64_STANDARD.encode(deflated(&parts.bytes));
    // In a script, `</` or `<!--` of a name would end it. The head comes last: a name in it may be that of another placeholder.
    let html = TEMPLATE.replace("{{DATA}}", &data).replace("{{HEAD}}", &head.to_string().replace('<', "\\u003c"));
    if html.len() > MAX_BYTES {
        return Err(PageError::TooLong(html.len()));
    }
    Ok(Page { html, empty_between: triangles.is_empty().then(|| lattice.nodes()) })
}

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("memory takes all that is written")
}

/// The grid's own lattice if it is coarse enough.
fn lattice(field: &Field) -> Result<Lattice, PageError> {
    let bounds = match field.grid() {
        Some(grid) if grid.lattice().cells().iter().all(|cells| f64::from(*cells) <= DETAIL) => {
            return Ok(*grid.lattice());
        }
        Some(grid) => grid.lattice().bounds(),
        None => field.bounds(0.0).inflate(0.1 * field.bounds(0.0).longest_side()),
    };
    if !bounds.extents().iter().all(|extent| extent.is_finite()) {
        return Err(PageError::Unbounded);
    }
    lattice_around(&bounds, bounds.longest_side() / DETAIL, 0).ok_or(PageError::NoCells)
}

impl<'a> Scene<'a> {
    /// A field alone.
    pub fn of_field(name: String, field: &'a Field) -> Self {
        Self { name, field, pose: None, mesh: None, segments: &[], contacts: &[] }
    }

    /// Elements that are drawn of the mesh.
    fn elements<'b>(&self, mesh: &MeshView<'b>) -> Vec<Drawn<'b>>
    where
        'a: 'b,
    {
        match (mesh.faces, self.segments) {
            ([], []) => vec![Drawn::Points(mesh.points.len() as u32)],
            (faces, segments) => vec![Drawn::Triangles(faces), Drawn::Segments(segments)],
        }
    }

    /// The place of a point of the field in the mesh's frame.
    fn push(&self, point: Vector3<f64>) -> Vector3<f64> {
        self.pose.map_or(point, |pose| pose.push(point))
    }

    /// The box of all that is drawn.
    fn window(&self, lattice: &Lattice, surface: &[[f64; 3]]) -> Aabb {
        let field = self.pose.map_or(lattice.bounds(), |pose| pose.push_bounds(lattice.bounds()));
        let mesh = self.mesh.and_then(|mesh| Aabb::from_points(used_points(mesh.points, &self.elements(&mesh))));
        let all = [Some(field), mesh, Aabb::from_points(surface.iter().copied())];
        all.into_iter().flatten().reduce(|a, b| a.union(&b)).unwrap_or(field)
    }

    /// The matrix, column by column, from numbers along the axes of a lattice in the field's frame, in steps, to what is drawn.
    fn matrix(&self, frame: &Frame, origin: [f64; 3], steps: [f64; 3]) -> Vec<f64> {
        let origin = self.push(Vector3::from(origin));
        let zero = self.push(Vector3::zeros());
        let column = |axis: usize| (self.push(Vector3::ith(axis, 1.0)) - zero) * (steps[axis] / frame.unit);
        let columns = [0, 1, 2].map(|axis| column(axis).push(0.0));
        let [x, y, z] = frame.place(origin.into());
        columns.iter().flat_map(|column| column.iter().copied()).chain([x, y, z, 1.0]).collect()
    }

    fn head(
        &self,
        lattice: &Lattice,
        frame: &Frame,
        values: [f64; 2],
        boxes: Map<String, Value>,
        parts: Map<String, Value>,
    ) -> Value {
        let element = self.contacts.first().map_or("face", |contact| contact.element.name());
        let (low, size) = (lattice.origin(), lattice.bounds().extents());
        json!({
            "name": self.name,
            "facts": self.facts(),
            "element": element,
            "statuses": sdf_core::contact::ContactStatus::NAMES,
            "status": self.contacts.iter().map(|contact| contact.status.code()).collect::<Vec<_>>(),
            "center": frame.center,
            "unit": frame.unit,
            "boxes": boxes,
            "field": {
                "low": low,
                "size": size,
                "matrix": self.matrix(frame, low, size),
                "counts": lattice.nodes(),
                "values": values,
                "isoline": isoline(values),
            },
            "bricks": self.field.grid().map(|grid| {
                let side = grid.lattice().spacing() * f64::from(BRICK);
                self.matrix(frame, grid.lattice().origin(), [side; 3])
            }),
            "parts": parts,
        })
    }

    /// Rows of the page's table.
    fn facts(&self) -> Vec<[String; 2]> {
        let mut facts = Vec::new();
        let mut row = |name: &str, value: String| facts.push([name.to_owned(), value]);
        if let Some(grid) = self.field.grid() {
            let lattice = grid.lattice();
            row("nodes", format!("{}, {}", counts(lattice.nodes()), grid.storage().layout().name()));
            row("spacing", number(lattice.spacing()));
            if grid.band().is_finite() {
                row("band", number(grid.band()));
            }
        }
        let error = self.field.info().map(|info| info.error_bound);
        match error {
            Some(bound) if bound.is_finite() => row("certified error", format!("at most {}", number(bound))),
            Some(_) => row("error", "unknown: no error is certified".to_owned()),
            None => row("field", "a closed form".to_owned()),
        }
        if self.mesh.is_some() {
            row("contacts", self.contacts.len().to_string());
            let deepest = self.contacts.iter().map(|contact| contact.distance).fold(f64::INFINITY, f64::min);
            if deepest.is_finite() {
                row("deepest", number(deepest));
            }
        }
        facts
    }
}

/// Counts along three axes, as reports and pages write them.
pub fn counts(counts: [u32; 3]) -> String {
    let [x, y, z] = counts;
    format!("{x} × {y} × {z}")
}

/// A number as reports and pages write it: six decimals; in exponential form below 10⁻³ and from 10⁶ on.
pub fn number(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e6).contains(&x.abs()) { format!("{x:.4e}") } else { format!("{x:.6}") }
}

/// A step of 1, 2 or 5 times a power of ten that cuts the range into 20 to 50.
fn isoline([low, high]: [f64; 2]) -> f64 {
    let step = ((high - low) / 20.0).max(f64::MIN_POSITIVE);
    let power = 10_f64.powf(step.log10().floor());
    let digit = step / power;
    power
        * if digit >= 5.0 {
            5.0
        } else if digit >= 2.0 {
            2.0
        } else {
            1.0
        }
}

/// Elements of one kind, by the indices of their vertices.
enum Drawn<'a> {
    Triangles(&'a [[u32; 3]]),
    Segments(&'a [[u32; 2]]),
    /// Each of so many points.
    Points(u32),
}

impl Drawn<'_> {
    fn name(&self) -> &'static str {
        match self {
            Self::Triangles(_) => "triangles",
            Self::Segments(_) => "segments",
            Self::Points(_) => "dots",
        }
    }

    /// The vertices of those elements that can be drawn, one element after the other.
    fn vertices(&self, points: &[[f64; 3]]) -> Vec<u32> {
        let is_finite = |vertex: &u32| points.get(*vertex as usize).is_some_and(|p| p.iter().all(|x| x.is_finite()));
        match self {
            Self::Triangles(all) => all.iter().filter(|one| one.iter().all(is_finite)).flatten().copied().collect(),
            Self::Segments(all) => all.iter().filter(|one| one.iter().all(is_finite)).flatten().copied().collect(),
            Self::Points(count) => (0..*count).filter(is_finite).collect(),
        }
    }
}

/// The points that are drawn; the others may be anything.
fn used_points(points: &[[f64; 3]], elements: &[Drawn]) -> Vec<[f64; 3]> {
    elements.iter().flat_map(|elements| elements.vertices(points)).map(|vertex| points[vertex as usize]).collect()
}

/// Where the picture is in the world: its middle is drawn at 0, its diagonal as 1.
struct Frame {
    center: [f64; 3],
    unit: f64,
}

impl Frame {
    fn new(window: &Aabb) -> Self {
        let center = window.center();
        // A point has no diagonal.
        let unit = Some(window.diagonal()).filter(|diagonal| *diagonal > 0.0 && diagonal.is_finite()).unwrap_or(1.0);
        Self { center, unit }
    }

    fn place(&self, point: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| (point[axis] - self.center[axis]) / self.unit)
    }
}

/// Arrays one after the other, each at a multiple of eight bytes.
#[derive(Default)]
struct Parts {
    bytes: Vec<u8>,
    /// For each array its offset in bytes and its length in elements.
    places: Map<String, Value>,
}

impl Parts {
    fn put(&mut self, name: &str, bytes: impl IntoIterator<Item = u8>, element: usize) {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let count = (self.bytes.len() - start) / element;
        self.bytes.resize(self.bytes.len().next_multiple_of(8), 0);
        self.places.insert(name.to_owned(), json!([start, count]));
    }

    fn f32s(&mut self, name: &str, numbers: impl Iterator<Item = f64>) {
        self.put(name, numbers.flat_map(|number| (number as f32).to_le_bytes()), 4);
    }

    /// Adds points and elements, and returns the box in which the points are.
    fn mesh(&mut self, name: &str, frame: &Frame, points: &[[f64; 3]], elements: &[Drawn]) -> Value {
        let bounds = Aabb::from_points(used_points(points, elements).into_iter().map(|point| frame.place(point)));
        let bounds = bounds.unwrap_or(Aabb { min: [0.0; 3], max: [0.0; 3] });
        let extents = bounds.extents();
        let steps = |point: &[f64; 3]| -> [u16; 3] {
            let place = frame.place(*point);
            std::array::from_fn(|axis| ((place[axis] - bounds.min[axis]) / extents[axis] * 65535.0).round() as u16)
        };
        let mut last = [0_u16; 3];
        let change = |point: &[f64; 3]| {
            let old = std::mem::replace(&mut last, steps(point));
            std::array::from_fn::<u16, 3, _>(|axis| last[axis].wrapping_sub(old[axis]))
        };
        let changes: Vec<[u16; 3]> = points.iter().map(change).collect();
        self.put(&format!("{name}_points"), changes.iter().flatten().flat_map(|x| x.to_le_bytes()), 2);
        for elements in elements {
            let mut last = 0_u32;
            let vertices = elements.vertices(points).into_iter();
            let changes = vertices.map(|index| index.wrapping_sub(std::mem::replace(&mut last, index)));
            self.put(&format!("{name}_{}", elements.name()), changes.flat_map(u32::to_le_bytes), 4);
        }
        json!({ "low": bounds.min, "size": extents })
    }

    /// The values at the nodes in 256 steps; returns those of the first and the last step.
    fn field(&mut self, field: &Field, lattice: &Lattice) -> [f64; 2] {
        let [nx, ny, nz] = lattice.nodes();
        let nodes = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        let value = |node: [u32; 3]| -> f64 { field.as_any().value(Vector3::from(lattice.node(node))) };
        let values: Vec<f32> = nodes.map(|node| value(node) as f32).collect();
        let low = f64::from(values.iter().copied().fold(f32::INFINITY, f32::min));
        let high = f64::from(values.iter().copied().fold(f32::NEG_INFINITY, f32::max));
        let scale = 255.0 / (high - low).max(f64::MIN_POSITIVE);
        self.put("field", values.iter().map(|value| ((f64::from(*value) - low) * scale).round() as u8), 1);
        [low, high]
    }
}
