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
pub use page::{page, page_frames};
pub use picture::{animation, contact_sheet};
pub use vtkhdf::{still_path, write_vtkhdf};

use sdf_core::Aabb;
use sdf_field::{Field, Threads};

use crate::V3;
use crate::scene::Stage;

/// Frames that a page or an animation of at most `most`, at least two, keeps of a run's: evenly, and the last.
pub fn thinned(frames: usize, most: usize) -> impl Iterator<Item = usize> {
    let last = frames.checked_sub(1);
    (0..last.unwrap_or(0)).step_by(stride(frames, most)).chain(last)
}

/// Number of frames from one that is kept to the next; to the last it may be less.
fn stride(frames: usize, most: usize) -> usize {
    let most = most.max(2);
    frames.saturating_sub(1).div_ceil(most - 1).max(1)
}

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
    /// Reasons why obstacles are not drawn as they are, a line each.
    pub warnings: Vec<String>,
    /// Points beyond are those of a run that explodes, and not drawn.
    near: Option<Aabb>,
    /// Obstacles without an end, such as floors: drawn where the run takes place.
    endless: Vec<Field>,
    /// The box in which they are drawn, and its cells along the longest side.
    window: Option<(Aabb, u32)>,
    /// How many points and triangles of what stands still are those of the other obstacles.
    ended: [usize; 2],
}

impl Recording {
    /// An empty recording of a stage at its start. Obstacles are drawn by their surface in a lattice of so many cells along the longest
    /// side; of those without an end, such as floors, what is near the run.
    pub fn new(title: &str, rate: f64, stage: &Stage, cells: u32) -> Self {
        let near = near(stage);
        let is_endless = |field: &Field| !is_within(&field.bounds(0.0), &near);
        let window = window(stage, &near);
        let mut recording =
            Self { title: title.to_owned(), rate, near: Some(near), window: Some((window, cells)), ..Self::default() };
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
            let shape = shape.at(0.0);
            let outline = outline(&shape, &window, cells);
            recording.warnings.extend(thin(&shape, &outline, &window, cells));
            recording.faces.extend(outline.faces.iter().map(|face| face.map(|vertex| first + vertex)));
            face_bodies.resize(recording.faces.len(), body);
            first += outline.points.len() as u32;
            recording.outlines.push(outline);
        }
        recording.bodies = [edge_bodies, face_bodies].concat();
        for field in stage.obstacles.iter().filter(|field| !is_endless(field)) {
            let outline = outline(field, &window, cells);
            recording.warnings.extend(thin(field, &outline, &window, cells));
            recording.add_still(&outline);
        }
        recording.ended = [recording.still_points.len(), recording.still_faces.len()];
        recording.endless = stage.obstacles.iter().filter(|field| is_endless(field)).cloned().collect();
        recording.draw_endless();
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
        let reached = self.frames.last().and_then(|points| self.box_around(points));
        if let (Some((window, _)), Some(reached)) = (&mut self.window, reached)
            && !self.endless.is_empty()
            && !window.encloses(&reached)
        {
            // With room, so that it is seldom drawn again.
            *window = window.union(&reached);
            *window = window.inflate(0.25 * window.longest_side());
            self.draw_endless();
        }
    }

    /// Draws the obstacles without an end anew.
    fn draw_endless(&mut self) {
        self.still_points.truncate(self.ended[0]);
        self.still_faces.truncate(self.ended[1]);
        let Some((window, cells)) = self.window else { return };
        let outlines: Vec<_> = self.endless.iter().map(|field| outline(field, &window, cells)).collect();
        outlines.iter().for_each(|outline| self.add_still(outline));
    }

    fn add_still(&mut self, outline: &Outline) {
        let first = self.still_points.len() as u32;
        self.still_points.extend(outline.points.iter().map(|point| point.map(|x| x as f32)));
        self.still_faces.extend(outline.faces.iter().map(|face| face.map(|vertex| first + vertex)));
    }

    /// The box around all that moves, in all frames, and what is near of what stands still.
    pub fn bounds(&self) -> Aabb {
        let all = self.frames.iter().chain([&self.still_points]).filter_map(|points| self.box_around(points));
        all.reduce(|a, b| a.union(&b)).unwrap_or(Aabb { min: [-1.0; 3], max: [1.0; 3] })
    }

    /// The box around those of the points that are near.
    fn box_around(&self, points: &[[f32; 3]]) -> Option<Aabb> {
        let boxes = points.iter().map(|point| point.map(f64::from)).map(|point| Aabb { min: point, max: point });
        let near = boxes.filter(|point| is_finite(point) && self.near.is_none_or(|near| near.encloses(point)));
        near.reduce(|a, b| a.union(&b))
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

/// Nothing farther away than so many times the size of all that moves is drawn.
const NEAR: f64 = 1e6;

/// Floors and the like are drawn from the start if they are nearer than so many times the size of what is to be seen; else once the run
/// gets there.
const FLOOR: f64 = 10.0;

fn is_finite(bounds: &Aabb) -> bool {
    bounds.min.iter().chain(&bounds.max).all(|x| x.is_finite())
}

fn is_within(bounds: &Aabb, near: &Aabb) -> bool {
    is_finite(bounds) && near.encloses(bounds)
}

/// The box around all that moves.
fn moving(stage: &Stage) -> Option<Aabb> {
    let boxes = stage.surfaces.iter().filter_map(|surface| Aabb::from_points(surface.points(&stage.world)));
    boxes.filter(is_finite).reduce(|a, b| a.union(&b))
}

/// The box of all that is drawn, whatever the unit.
fn near(stage: &Stage) -> Aabb {
    moving(stage)
        .filter(|bounds| bounds.longest_side() > 0.0)
        .map_or(Aabb::EVERYWHERE, |bounds| bounds.inflate(NEAR * bounds.longest_side()))
}

/// A box around all that moves at the start, all obstacles that have an end, and the nearest points of the others; with a margin.
fn window(stage: &Stage, near: &Aabb) -> Aabb {
    let shapes: Vec<Field> = stage.animations.iter().map(|shape| shape.at(stage.time)).collect();
    let obstacles = stage.obstacles.iter().chain(&shapes).map(|field| field.bounds(0.0));
    let all = moving(stage).into_iter().chain(obstacles.filter(|bounds| is_within(bounds, near)));
    let all = all.reduce(|a, b| a.union(&b)).unwrap_or(Aabb { min: [-1.0; 3], max: [1.0; 3] });
    let center = (V3::from(all.min) + V3::from(all.max)) * 0.5;
    let mut nearest = Outline { points: vec![], faces: vec![] };
    let mut window = all;
    for field in stage.obstacles.iter().filter(|field| !is_within(&field.bounds(0.0), near)) {
        nearest.points = vec![center.into()];
        nearest.settle(field);
        let point = Aabb { min: nearest.points[0], max: nearest.points[0] };
        if is_within(&point, &all.inflate(FLOOR * all.longest_side())) {
            window = window.union(&point);
        }
    }
    window.inflate(0.1 * window.longest_side())
}

/// Triangles near the surface φ = 0 of a field, by marching tetrahedra on a lattice of so many cells: for pictures.
///
/// A field without a finite box, such as a floor, is shown within `window`.
pub fn outline(field: &Field, window: &Aabb, cells: u32) -> Outline {
    let Some((ends, step)) = lattice(field, window, cells) else { return Outline::default() };
    let origin = V3::from(ends.map(|[low, _]| low - step));
    let counts = ends.map(|[low, high]| ((high - low).max(0.0) / step).ceil() as usize + 3);
    marching::tetrahedra(field, &origin, step, counts)
}

/// The part of a field's box within the window, and the side of a cell.
fn lattice(field: &Field, window: &Aabb, cells: u32) -> Option<([[f64; 2]; 3], f64)> {
    let own = field.bounds(0.0);
    let clip = |axis: usize, low: f64, high: f64| [low.max(own.min[axis]), high.min(own.max[axis])];
    let ends = [0, 1, 2].map(|axis| clip(axis, window.min[axis], window.max[axis]));
    let longest = ends.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
    (longest > 0.0 && longest.is_finite()).then(|| (ends, longest / f64::from(cells.max(1))))
}

/// Says that a good part of an obstacle is thinner than a cell: a cell below the surface is outside again.
fn thin(field: &Field, outline: &Outline, window: &Aabb, cells: u32) -> Option<String> {
    let (ends, step) = lattice(field, window, cells)?;
    let samples = field.sample(&outline.points, Threads::ALL);
    let below = outline.points.iter().zip(samples).map(|(point, sample)| {
        let outward = sample.gradient.try_normalize(0.0).unwrap_or_default();
        (V3::from(*point) - outward * step).into()
    });
    let below: Vec<[f64; 3]> = below.collect();
    let outside = field.sample(&below, Threads::ALL).iter().filter(|sample| sample.value > 0.0).count();
    (4 * outside > below.len() || below.is_empty()).then(|| {
        format!(
            "the obstacle from {:?} to {:?} is recorded with holes, or not at all: it is thinner than a cell of {step:.1e}; \
             contacts are not affected",
            ends.map(|[low, _]| low),
            ends.map(|[_, high]| high)
        )
    })
}
