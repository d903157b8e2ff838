//! Runs a scene frame by frame, and measures it.

mod deep;
mod frame;

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use sdf_core::combine::Shell;
use sdf_core::{Aabb, AnyField};
use sdf_field::{Field, Method, QueryError, Threads};

use super::build::Stage;
use super::coinciding::coinciding;
use super::figures::Figures;
use super::separate::Separations;
use super::spec::SceneSpec;
use super::touching::Touching;
use crate::caged::{CageAtRest, CageRoom, CagedBody};
use crate::motion::Motion;
use crate::query::{Contacts, Elements, Memory, Query};
use crate::surface::{Carrier, Surface};
use crate::world::Passes;
use crate::{V3, World};

/// Which elements are searched, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElementMethod {
    /// `false`: vertices alone.
    pub faces: bool,
    /// How faces and edges are searched.
    pub method: Method,
    /// Obstacles are taken as their surface without an inside, as pairs of triangles see them.
    pub surface_only: bool,
    /// Passes go one way: stiff sheets explode.
    pub one_way: bool,
}

/// A word that names no method.
#[derive(Clone, Debug, thiserror::Error)]
#[error(
    "unknown method {0:?}: take auto, certified, fw, pgd, newton, vertices, samples4, samples16, samples64, surface or one-way"
)]
pub struct UnknownMethod(String);

impl std::str::FromStr for ElementMethod {
    type Err = UnknownMethod;

    fn from_str(word: &str) -> Result<Self, UnknownMethod> {
        let method = match word {
            "auto" | "vertices" | "surface" | "one-way" => Method::Auto,
            "certified" => Method::Certified,
            "fw" => Method::FrankWolfe,
            "pgd" => Method::ProjectedGradient,
            "newton" => Method::Newton,
            "samples4" => Method::Sampling(4),
            "samples16" => Method::Sampling(16),
            "samples64" => Method::Sampling(64),
            _ => return Err(UnknownMethod(word.to_owned())),
        };
        Ok(Self { faces: word != "vertices", method, surface_only: word == "surface", one_way: word == "one-way" })
    }
}

/// Runs a scene. `on_frame` gets the stage at the start and after each frame, and may end the run.
pub fn run(
    spec: &SceneSpec,
    stage: &mut Stage,
    method: ElementMethod,
    threads: Threads,
    mut on_frame: impl FnMut(u32, &Stage) -> ControlFlow<()>,
) -> Result<Figures, RunError> {
    stage.world.passes = if method.one_way { Passes::OneWay } else { Passes::ThereAndBack };
    let bodies = stage.cages.clone();
    let mut rooms = vec![CageRoom::default(); bodies.len()];
    let cages = bodies.iter().zip(&mut rooms).filter_map(|(body, room)| Some((body, body.at_rest(room)?))).collect();
    let mut run = Run { cages, ..Run::new(spec, stage, method, threads) };
    run.figures.deep_at_start = run.deep(stage)?.0.max(coinciding(stage, spec.thickness));
    if on_frame(0, stage).is_continue() {
        for frame in 1..=spec.frames {
            match run.frame(stage) {
                // What is refused is one of its lengths: nothing that the scene says.
                Err(RunError::Query(_)) if run.is_beyond_f32(stage) => {
                    (run.figures.frames, run.figures.finite) = (frame, false);
                    break;
                }
                ended => ended?,
            }
            stage.time = f64::from(frame) / spec.rate;
            run.measure(stage, frame)?;
            if on_frame(frame, stage).is_break() || !run.figures.finite {
                break;
            }
        }
    }
    Ok(run.finish(stage)?)
}

/// Contacts are kept until their element has moved by this share of the thickness.
const HOLD: f64 = 0.05;

/// Thickness of an obstacle that is taken as its surface, and distance at which what has no thickness touches, over the size of what moves.
const SURFACE: f64 = 1e-9;

/// Why a run cannot go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RunError {
    /// A field refuses a search.
    #[error(transparent)]
    Query(#[from] QueryError),
    /// A frame has more contacts than memory has room for.
    #[error(
        "over {} contacts in a frame: do bodies start inside of each other? Give fewer, or move them apart",
        frame::MAX_CONTACTS
    )]
    TooManyContacts,
}

struct Run<'a> {
    spec: &'a SceneSpec,
    query: Query,
    only_vertices: bool,
    contacts: Contacts,
    touching: Touching,
    /// Knowledge of each surface and each obstacle; those of rigid bodies come after those that stand still.
    memories: BTreeMap<(usize, usize), Memory>,
    /// The obstacles as surfaces without an inside, where the method sees no more.
    hulls: Vec<Field>,
    figures: Figures,
    start: World,
    energy: [f64; 3],
    /// Positions half a unit of time before the end.
    settled: Vec<[f64; 3]>,
    before: Vec<[f64; 3]>,
    squares: (f64, usize),
    sides: Vec<BTreeMap<u32, V3>>,
    /// Rigid bodies that started inside of each other.
    separations: Separations,
    /// Soft bodies that others touch.
    cages: Vec<(&'a CagedBody, CageAtRest<'a>)>,
    cage_room: CageRoom,
}

impl<'a> Run<'a> {
    fn new(spec: &'a SceneSpec, stage: &Stage, method: ElementMethod, threads: Threads) -> Self {
        let query = Query {
            method: method.method,
            // Faces alone where patches leave on one side, where obstacles have no inside, and in the baseline of four samples.
            struck_vertices: !spec.choose_side && !method.surface_only && method.method != Method::Sampling(4),
            thickness: spec.thickness,
            friction: spec.friction,
            hold: HOLD * spec.thickness,
            keep: spec.thickness,
            reduce: spec.contacts_per_pair,
            threads,
            ..Query::default()
        };
        let energy = stage.world.energy();
        let surface = SURFACE * size_of(stage, &stage.world);
        let hull = |field: &Field| {
            Shell::new(field.clone().into_any(), surface).map(|shell| Field::new(AnyField::Shell(Box::new(shell))))
        };
        let hulls = stage.obstacles.iter().filter(|_| method.surface_only).filter_map(hull).collect();
        Self {
            spec,
            query,
            only_vertices: !method.faces,
            contacts: Contacts::default(),
            touching: Touching::new((1.0 + HOLD) * spec.thickness + surface),
            memories: BTreeMap::new(),
            hulls,
            figures: Figures {
                finite: true,
                volume: stage.world.min_volume_ratio(),
                stretch: 1.0,
                ..Figures::default()
            },
            start: stage.world.clone(),
            energy: [energy; 3],
            settled: vec![],
            before: vec![],
            squares: (0.0, 0),
            sides: vec![BTreeMap::new(); stage.surfaces.len()],
            separations: Separations::new(spec.thickness),
            cages: vec![],
            cage_room: CageRoom::default(),
        }
    }

    /// Does something go farther in a frame than f32 can tell?
    fn is_beyond_f32(&self, stage: &Stage) -> bool {
        let motion = Motion::of(&stage.world, 1.0 / self.spec.rate);
        let mut ways = stage.surfaces.iter().map(|surface| motion.reach(surface.max_speed(&stage.world)));
        // NaN too.
        !ways.all(|way| way < f64::from(f32::MAX))
    }

    fn measure(&mut self, stage: &Stage, frame: u32) -> Result<(), QueryError> {
        let Stage { world, surfaces, .. } = stage;
        let figures = &mut self.figures;
        figures.frames = frame;
        figures.finite = world.is_finite() && surfaces.iter().all(|surface| surface.beyond_f32(world).is_none());
        figures.volume = figures.volume.min(world.min_volume_ratio());
        let speeds = surfaces.iter().map(|surface| surface.max_speed(world));
        figures.max_speed = speeds.fold(figures.max_speed.max(world.max_speed()), f64::max);
        let energy = world.energy();
        self.energy = [self.energy[0], self.energy[1].max(energy), self.energy[2].min(energy)];
        // Half a unit of time before the end, or one frame, and from then on.
        if f64::from(self.spec.frames - frame) <= (0.5 * self.spec.rate).max(1.0) {
            let points: Vec<_> = surfaces.iter().flat_map(|surface| surface.points(world)).collect();
            if self.settled.is_empty() {
                self.settled.clone_from(&points);
            } else {
                self.squares.0 += points.iter().zip(&self.before).map(|(a, b)| distance_sq(a, b)).sum::<f64>();
                self.squares.1 += points.len();
                figures.turn = Some(self.touching.turned().max(figures.turn.unwrap_or(0.0)));
            }
            self.before = points;
        }
        if self.spec.choose_side || self.spec.every_frame || self.spec.vary.seeds > 0 {
            let (deep, deepest) = self.deep(stage)?;
            if self.spec.every_frame {
                self.figures.add_deep(deep, deepest);
            }
            let recovered = self.figures.recovered_frame.unwrap_or(frame);
            self.figures.recovered_frame = (deep == 0).then_some(recovered);
        }
        Ok(())
    }

    fn finish(mut self, stage: &Stage) -> Result<Figures, QueryError> {
        let world = &stage.world;
        if self.figures.finite {
            let (deep, deepest) = self.deep(stage)?;
            self.figures.add_deep(deep, deepest);
        }
        let points: Vec<_> = stage.surfaces.iter().flat_map(|surface| surface.points(world)).collect();
        let figures = &mut self.figures;
        let stretches = stage.surfaces.iter().map(|surface| surface.max_stretch(world, &self.start));
        figures.stretch = stretches.fold(1.0, f64::max);
        // A turn is known where two frames are.
        let drift = self.settled.iter().zip(&points).map(|(a, b)| distance_sq(a, b).sqrt()).fold(0.0, f64::max);
        figures.jitter = figures.turn.map(|_| self.spec.rate * (self.squares.0 / self.squares.1.max(1) as f64).sqrt());
        figures.drift = figures.turn.map(|_| drift);
        let (mass, size) = (world.mass(), size_of(stage, &self.start));
        figures.energy_gain =
            Figures::energy_gain(self.energy, self.start.kinetic_energy(), mass * world.gravity.norm() * size);
        // What holds a pin is not known.
        let has_pins = world.inv_mass.contains(&0.0);
        let change = world.momentum() - self.start.momentum() - world.outer.sum;
        let all = self.start.momentum_scale() + world.outer.length;
        let largest = mass * size * self.spec.rate;
        figures.momentum_error = (!has_pins).then(|| Figures::momentum_error(change.norm(), all, largest));
        if let Some(beyond) = self.spec.beyond {
            let is_beyond = |point: &&[f64; 3]| {
                beyond.below.is_some_and(|z| point[2] < z)
                    || beyond.nearer.is_some_and(|radius| V3::from(**point).norm() < radius)
            };
            figures.beyond = points.iter().filter(is_beyond).count();
        }
        figures.contacts = self.contacts.contacts.len();
        figures.pairs = self.touching.pair_count();
        figures.elements = [self.contacts.element_count, self.contacts.searched_count];
        Ok(self.figures)
    }
}

/// Elements of a surface: rigid bodies need their vertices too, as of a level face any point is the lowest.
fn elements(query: &Query, only_vertices: bool, surface: &Surface) -> Elements {
    let is_rigid = matches!(surface.carrier, Carrier::Body { .. });
    let strings = surface.faces.is_empty();
    if only_vertices {
        return Elements::VERTICES;
    }
    Elements { faces: !strings, edges: strings, vertices: is_rigid && query.method != Method::Sampling(4) }
}

/// The longest diagonal of a surface's box.
fn size_of(stage: &Stage, world: &World) -> f64 {
    let diagonal = |surface: &Surface| Aabb::from_points(surface.points(world)).map_or(0.0, |bounds| bounds.diagonal());
    stage.surfaces.iter().map(diagonal).fold(0.0, f64::max)
}

/// Is the surface embedded in the tetrahedra of the body?
fn is_skin(surface: &Surface, cage: &CagedBody) -> bool {
    match &surface.carrier {
        Carrier::Tets(points) => points.first().is_some_and(|point| cage.has_tet(point.tet)),
        _ => false,
    }
}

pub(super) fn body_of(surface: &Surface) -> Option<u32> {
    match surface.carrier {
        Carrier::Body { id, .. } => Some(id),
        _ => None,
    }
}

fn distance_sq(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (V3::from(*a) - V3::from(*b)).norm_squared()
}
