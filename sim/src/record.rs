//! Recordings: the frames of a run, kept as f32, and written for whoever looks at them.
//!
//! | written as | opens in | file |
//! |---|---|---|
//! | a folder of OBJ files | Blender, everything | `record/obj` |
//! | VTKHDF with time steps | ParaView | `record/vtkhdf` |
//! | a PNG of some frames, an APNG of all | README, any viewer | `record/picture` |
//! | an HTML page with a slider | any browser | `record/page` |

mod marching;
mod obj;
mod page;
mod picture;
mod vtkhdf;

pub use obj::{files_of_folder, write_folder};
pub use page::page;
pub use picture::{animation, contact_sheet};
pub use vtkhdf::{still_path, write_vtkhdf};

use sdf_core::Aabb;
use sdf_field::{Field, Threads};

use crate::V3;
use crate::scene::Stage;

/// Frames of a run.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// One line for a headline.
    pub title: String,
    /// Frames per unit of time.
    pub rate: f64,
    /// Triangles of what moves: those of bodies first, then those of obstacles that change.
    pub faces: Vec<[u32; 3]>,
    /// How many of the triangles are those of bodies.
    pub body_face_count: usize,
    /// Strings of what moves.
    pub edges: Vec<[u32; 2]>,
    /// For each edge, then for each triangle, the index of its body or obstacle.
    pub bodies: Vec<u32>,
    /// For each frame the points of all that moves.
    pub frames: Vec<Vec<[f32; 3]>>,
    /// Points on obstacles that change, as they are now.
    outlines: Vec<Outline>,
    /// Points of the surfaces of obstacles that stand still.
    pub still_points: Vec<[f32; 3]>,
    /// Their triangles.
    pub still_faces: Vec<[u32; 3]>,
}

impl Recording {
    /// An empty recording of a stage at its start. Obstacles are drawn within a window around all that moves, by the surface in a
    /// lattice of so many cells along each side.
    pub fn new(title: &str, rate: f64, stage: &Stage, cells: u32) -> Self {
        let window = window(stage);
        let window = window.inflate(0.1 * window.longest_side());
        let mut recording = Self { title: title.to_owned(), rate, ..Self::default() };
        let mut first = 0;
        let (mut edge_bodies, mut face_bodies) = (vec![], vec![]);
        for (body, surface) in (0..).zip(&stage.surfaces) {
            recording.faces.extend(surface.recorded_faces().iter().map(|face| face.map(|vertex| first + vertex)));
            face_bodies.resize(recording.faces.len(), body);
            if surface.faces.is_empty() {
                recording.edges.extend(surface.edges.iter().map(|edge| edge.map(|vertex| first + vertex)));
                edge_bodies.resize(recording.edges.len(), body);
            }
            first += surface.recorded_count() as u32;
        }
        recording.body_face_count = recording.faces.len();
        for (body, shape) in (stage.surfaces.len() as u32..).zip(&stage.animations) {
            let outline = outline(&shape.at(0.0), &window, cells);
            recording.faces.extend(outline.faces.iter().map(|face| face.map(|vertex| first + vertex)));
            face_bodies.resize(recording.faces.len(), body);
            first += outline.points.len() as u32;
            recording.outlines.push(outline);
        }
        recording.bodies = [edge_bodies, face_bodies].concat();
        for Outline { points, faces } in stage.obstacles.iter().map(|field| outline(field, &window, cells)) {
            let first = recording.still_points.len() as u32;
            recording.still_points.extend(points.iter().map(|point| point.map(|x| x as f32)));
            recording.still_faces.extend(faces.iter().map(|face| face.map(|vertex| first + vertex)));
        }
        recording
    }

    /// Adds the stage as it is.
    pub fn push(&mut self, stage: &Stage) {
        for (outline, shape) in self.outlines.iter_mut().zip(&stage.animations) {
            outline.settle(&shape.at(stage.time));
        }
        let bodies = stage.surfaces.iter().flat_map(|surface| surface.recorded_points(&stage.world));
        let obstacles = self.outlines.iter().flat_map(|outline| &outline.points).copied();
        self.frames.push(bodies.chain(obstacles).map(|point| point.map(|x| x as f32)).collect());
    }

    /// The box around all that moves, in all frames, and what is near of what stands still.
    pub fn bounds(&self) -> Aabb {
        let finite = |points: &[[f32; 3]]| {
            let points = points.iter().map(|point| point.map(f64::from));
            let finite = points.filter(|point| point.iter().all(|x| x.abs() < 1e6));
            finite.map(|point| Aabb { min: point, max: point }).reduce(|a, b| a.union(&b))
        };
        let moving = self.frames.iter().filter_map(|points| finite(points)).reduce(|a, b| a.union(&b));
        let still = finite(&self.still_points);
        let all = moving.into_iter().chain(still).reduce(|a, b| a.union(&b));
        all.unwrap_or(Aabb { min: [-1.0; 3], max: [1.0; 3] })
    }
}

/// Triangles near a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    /// Corners.
    pub points: Vec<[f64; 3]>,
    /// Indices of corners, counterclockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
}

/// Steps of [`Outline::settle`]: one is enough on a distance, more where the surface bends.
const SETTLE_STEPS: usize = 3;

impl Outline {
    /// Moves the points to where the field is zero now, along its gradient (Newton's method).
    fn settle(&mut self, field: &Field) {
        for _ in 0..SETTLE_STEPS {
            let samples = field.sample(&self.points, Threads::ALL);
            for (point, sample) in self.points.iter_mut().zip(samples) {
                let way = sample.gradient * (sample.value / sample.gradient.norm_squared().max(0.25));
                *point = (V3::from(*point) - way).into();
            }
        }
    }
}

/// A box around all that moves at the start and all obstacles of finite size: what to show.
fn window(stage: &Stage) -> Aabb {
    let is_finite = |bounds: &Aabb| bounds.min.iter().chain(&bounds.max).all(|x| x.abs() < 1e6);
    let moving = stage.surfaces.iter().filter_map(|surface| Aabb::from_points(surface.points(&stage.world)));
    let shapes: Vec<Field> = stage.animations.iter().map(|shape| shape.at(stage.time)).collect();
    let obstacles = stage.obstacles.iter().chain(&shapes).map(|field| field.bounds(0.0));
    let all = moving.chain(obstacles).filter(is_finite);
    all.reduce(|a, b| a.union(&b)).unwrap_or(Aabb { min: [-1.0; 3], max: [1.0; 3] })
}

/// Triangles near the surface φ = 0 of a field, by marching tetrahedra on a lattice of so many cells: for pictures.
///
/// A field without a finite box, such as a floor, is shown within `window`.
pub fn outline(field: &Field, window: &Aabb, cells: u32) -> Outline {
    let own = field.bounds(0.0);
    let clip = |axis: usize, low: f64, high: f64| [low.max(own.min[axis]), high.min(own.max[axis])];
    let ends = [0, 1, 2].map(|axis| clip(axis, window.min[axis], window.max[axis]));
    let longest = ends.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
    if !(longest > 0.0 && longest.is_finite()) {
        return Outline::default();
    }
    let step = longest / f64::from(cells.max(1));
    let origin = V3::from(ends.map(|[low, _]| low - step));
    let counts = ends.map(|[low, high]| ((high - low).max(0.0) / step).ceil() as usize + 3);
    marching::tetrahedra(field, &origin, step, counts)
}
