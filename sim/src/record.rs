//! Recordings: the frames of a run, kept as f32, and written for whoever looks at them.
//!
//! | written as | opens in | file |
//! |---|---|---|
//! | a folder of OBJ files | Blender, everything | `record/obj` |
//! | a PNG of some frames | README, any viewer | `record/picture` |
//! | an HTML page with a slider | any browser | `record/page` |

mod marching;
mod obj;
mod page;
mod picture;

pub use obj::write_folder;
pub use page::page;
pub use picture::contact_sheet;

use sdf_core::Aabb;
use sdf_field::Field;

use crate::scene::Stage;
use crate::{V3, surface::Surface};

/// Frames of a run. Obstacles do not move.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// One line for a headline.
    pub title: String,
    /// Triangles of what moves.
    pub faces: Vec<[u32; 3]>,
    /// Strings of what moves.
    pub edges: Vec<[u32; 2]>,
    /// For each frame the points of all that moves.
    pub frames: Vec<Vec<[f32; 3]>>,
    /// Points of the obstacles' surfaces.
    pub still_points: Vec<[f32; 3]>,
    /// Their triangles.
    pub still_faces: Vec<[u32; 3]>,
}

impl Recording {
    /// An empty recording of a stage. `obstacles` are the surfaces to show of what stands still.
    pub fn new(title: &str, stage: &Stage, obstacles: &[Outline]) -> Self {
        let mut recording = Self { title: title.to_owned(), ..Self::default() };
        let mut first = 0;
        for surface in &stage.surfaces {
            recording.faces.extend(surface.faces.iter().map(|face| face.map(|vertex| first + vertex)));
            if surface.faces.is_empty() {
                recording.edges.extend(surface.edges.iter().map(|edge| edge.map(|vertex| first + vertex)));
            }
            first += surface.vertex_count() as u32;
        }
        for Outline { points, faces } in obstacles {
            let first = recording.still_points.len() as u32;
            recording.still_points.extend(points.iter().map(|point| point.map(|x| x as f32)));
            recording.still_faces.extend(faces.iter().map(|face| face.map(|vertex| first + vertex)));
        }
        recording
    }

    /// Adds the stage as it is.
    pub fn push(&mut self, stage: &Stage) {
        let points = |surface: &Surface| surface.points(&stage.world);
        let all = stage.surfaces.iter().flat_map(points).map(|point| point.map(|x| x as f32));
        self.frames.push(all.collect());
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

/// A box around all that moves at the start and all obstacles of finite size: what to show.
pub fn window(stage: &Stage) -> Aabb {
    let is_finite = |bounds: &Aabb| bounds.min.iter().chain(&bounds.max).all(|x| x.abs() < 1e6);
    let moving = stage.surfaces.iter().filter_map(|surface| Aabb::from_points(surface.points(&stage.world)));
    let all = moving.chain(stage.obstacles.iter().map(|field| field.bounds(0.0))).filter(is_finite);
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
