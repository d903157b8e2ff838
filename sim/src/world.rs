//! How does everything move? XPBD (Macklin et al. 2016) in small steps (Macklin et al. 2019): predict, one pass over all
//! constraints, velocities from positions.
//!
//! | constraint | file |
//! |---|---|
//! | distance between two particles: stretch and bending | `stretch` |
//! | edges that carry much, once more | `loaded` |
//! | corotated tetrahedra (Stomakhin et al. 2012) | `tets` |
//! | contacts with Coulomb and rolling friction, both ways | `touch` |
//!
//! A pass goes there and back: contacts, stretch, tetrahedra, then all of it in reverse. Then what still moves along a distance is
//! damped. docs/simulation.md derives why a pass one way explodes, and why damping never harms.

mod loaded;
mod stretch;
mod tets;
mod touch;

use sdf_core::nalgebra::UnitQuaternion;

use crate::row::Rows;
use crate::{Body, V3};

pub use stretch::Stretch;
pub use tets::Tet;

/// Order of the constraints in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Passes {
    /// Forwards, then in reverse: never gains energy.
    #[default]
    ThereAndBack,
    /// Forwards only. Stiff sheets explode.
    OneWay,
}

/// Particles, bodies and constraints.
#[derive(Clone, Debug)]
pub struct World {
    /// Positions of the particles.
    pub x: Vec<V3>,
    /// Their velocities.
    pub v: Vec<V3>,
    /// 1 / mass; 0 for a particle that nothing moves: it keeps its velocity.
    pub inv_mass: Vec<f64>,
    /// Distances to keep.
    pub stretches: Vec<Stretch>,
    /// Tetrahedra.
    pub tets: Vec<Tet>,
    /// Rigid bodies.
    pub bodies: Vec<Body>,
    /// Acceleration of everything that has a mass.
    pub gravity: V3,
    /// Rate at which everything loses speed: v ← v / (1 + drag · dt).
    pub drag: f64,
    /// Time τ of the dashpot beside each distance: its force is τ / compliance times the relative speed. A rigid distance loses all
    /// of that speed.
    pub damping: f64,
    /// Momentum from outside: gravity, drag, and what nobody carries.
    pub(crate) outer: Impulses,
    /// Speed at which sides that are too near are parted. Undoing depth never makes two rigid bodies part faster, however many contacts
    /// they share. Sheets and soft bodies part faster: a sheet that rises from a floor at up to eight times that.
    pub recovery_speed: f64,
    /// Rounds over edges that carry much, and all contacts, at either end of a step (docs/simulation.md). 2 keep a sheet on needles from
    /// stretching; where it would rest without them, it rests less well.
    pub loaded_rounds: u32,
    /// Lever of the rolling friction of rigid bodies, a length: the torque that a contact has against the turn of one side on the other is
    /// at most this times its push. 0 for none: round bodies then roll and rock for ever.
    pub rolling_friction: f64,
    /// Order of a pass.
    pub passes: Passes,
    previous: Vec<V3>,
    previous_poses: Vec<(V3, UnitQuaternion<f64>)>,
    /// Poses as the step began; `previous_poses` are shifted with their bodies.
    start_poses: Vec<(V3, UnitQuaternion<f64>)>,
    stretch_multipliers: Vec<f64>,
    /// Edges that carried much in the last step.
    loaded: Vec<u32>,
    tet_multipliers: Vec<[f64; 2]>,
    /// The rotations of the last step.
    tet_rotations: Vec<UnitQuaternion<f64>>,
}

/// Time of a dashpot unless told otherwise.
pub(crate) const DAMPING: f64 = 0.01;

/// How many more times a pass goes over the rows, before and after all else, where there are rigid bodies.
const RIGID_ROUNDS: u32 = 2;

/// A sum of impulses.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Impulses {
    pub sum: V3,
    /// The sum of their lengths.
    pub length: f64,
}

impl Impulses {
    pub fn add(&mut self, impulse: &V3) {
        self.sum += impulse;
        self.length += impulse.norm();
    }
}

impl Default for World {
    fn default() -> Self {
        Self {
            x: vec![],
            v: vec![],
            inv_mass: vec![],
            stretches: vec![],
            tets: vec![],
            bodies: vec![],
            gravity: V3::zeros(),
            drag: 0.0,
            damping: DAMPING,
            outer: Impulses::default(),
            recovery_speed: 1.0,
            loaded_rounds: 0,
            rolling_friction: 0.0,
            passes: Passes::ThereAndBack,
            previous: vec![],
            previous_poses: vec![],
            start_poses: vec![],
            stretch_multipliers: vec![],
            loaded: vec![],
            tet_multipliers: vec![],
            tet_rotations: vec![],
        }
    }
}

impl World {
    /// An empty world.
    pub fn new(gravity: [f64; 3]) -> Self {
        Self { gravity: V3::from(gravity), ..Self::default() }
    }

    /// Adds a particle at rest and returns its index.
    pub fn add_particle(&mut self, x: V3, inv_mass: f64) -> u32 {
        self.x.push(x);
        self.v.push(V3::zeros());
        self.inv_mass.push(inv_mass);
        self.x.len() as u32 - 1
    }

    /// Adds a body and returns its index.
    pub fn add_body(&mut self, body: Body) -> u32 {
        self.bodies.push(body);
        self.bodies.len() as u32 - 1
    }

    /// Moves everything on by `dt`.
    ///
    /// # Panics
    ///
    /// If `dt` is not positive and finite: then nothing would have a place any more.
    pub fn step(&mut self, dt: f64, rows: &mut Rows) {
        assert!(dt > 0.0 && dt.is_finite(), "a step needs a positive time, not {dt}");
        self.start_poses.clear();
        self.start_poses.extend(self.bodies.iter().map(|body| (body.position, body.rotation)));
        self.prepare(rows);
        rows.age += dt;
        self.predict(dt);
        let soft = 1.0 / (dt * dt);
        self.stretch_multipliers.clear();
        self.stretch_multipliers.resize(self.stretches.len(), 0.0);
        self.tet_multipliers.clear();
        self.tet_multipliers.resize(self.tets.len(), [0.0; 2]);
        for index in self.tet_rotations.len()..self.tets.len() {
            self.tet_rotations.push(self.tets[index].rotation(&self.x));
        }
        let (stretches, tets, touches) = (self.stretches.len(), self.tets.len(), rows.touches.len());
        let speed = self.recovery_speed;
        let there_and_back = self.passes == Passes::ThereAndBack;
        // A body that rests on many points needs more than one pass; particles are as light as what holds them.
        let rounds = if self.bodies.is_empty() { 0 } else { RIGID_ROUNDS };
        if there_and_back {
            self.relax_loaded(rows, soft, dt);
            (0..rounds).for_each(|_| self.touch_all(rows, touches, dt));
            (0..touches).for_each(|index| self.touch(rows, index, dt, speed));
        }
        (0..stretches).for_each(|index| self.stretch(index, soft));
        (0..tets).for_each(|index| self.deform(index, soft, false));
        if there_and_back {
            (0..tets).rev().for_each(|index| self.deform(index, soft, true));
            (0..stretches).rev().for_each(|index| self.stretch(index, soft));
            (0..touches).rev().for_each(|index| self.touch(rows, index, dt, speed));
            (0..rounds).for_each(|_| self.touch_all(rows, touches, dt));
            self.relax_loaded(rows, soft, dt);
            self.note_loaded();
        } else {
            (0..touches).for_each(|index| self.touch(rows, index, dt, speed));
        }
        for ((v, x), previous) in self.v.iter_mut().zip(&self.x).zip(&self.previous) {
            *v = (x - previous) / dt;
        }
        if there_and_back {
            (0..stretches).for_each(|index| self.damp(index, dt));
            (0..stretches).rev().for_each(|index| self.damp(index, dt));
        }
    }

    /// All rows, there and back.
    fn touch_all(&mut self, rows: &mut Rows, count: usize, dt: f64) {
        let speed = self.recovery_speed;
        (0..count).chain((0..count).rev()).for_each(|index| self.touch(rows, index, dt, speed));
    }

    fn predict(&mut self, dt: f64) {
        self.previous.clone_from(&self.x);
        self.previous_poses.clone_from(&self.start_poses);
        let slower = 1.0 / (1.0 + self.drag * dt);
        for ((x, v), inv_mass) in self.x.iter_mut().zip(&mut self.v).zip(&self.inv_mass) {
            if *inv_mass > 0.0 {
                let before = *v;
                *v = (*v + self.gravity * dt) * slower;
                self.outer.add(&((*v - before) / *inv_mass));
            }
            *x += *v * dt;
        }
        for body in self.bodies.iter_mut().filter(|body| body.inv_mass > 0.0) {
            let before = body.velocity;
            body.velocity = (body.velocity + self.gravity * dt) * slower;
            body.momentum *= slower;
            self.outer.add(&((body.velocity - before) / body.inv_mass));
            body.advance(dt);
        }
    }

    /// Kinetic energy, and potential energy in the field of gravity.
    pub fn energy(&self) -> f64 {
        let particles = self.x.iter().zip(&self.v).zip(&self.inv_mass).filter(|(_, inv_mass)| **inv_mass > 0.0);
        let of_particles: f64 =
            particles.map(|((x, v), inv_mass)| (0.5 * v.norm_squared() - self.gravity.dot(x)) / inv_mass).sum();
        let bodies = self.bodies.iter().filter(|body| body.inv_mass > 0.0);
        let of_bodies: f64 =
            bodies.map(|body| body.kinetic_energy() - self.gravity.dot(&body.position) / body.inv_mass).sum();
        of_particles + of_bodies + self.elastic_energy()
    }

    /// Momentum of everything that has a mass.
    pub fn momentum(&self) -> V3 {
        let particles = self.v.iter().zip(&self.inv_mass).filter(|(_, inv_mass)| **inv_mass > 0.0);
        let bodies = self.bodies.iter().filter(|body| body.inv_mass > 0.0);
        particles.map(|(v, inv_mass)| v / *inv_mass).sum::<V3>()
            + bodies.map(|body| body.velocity / body.inv_mass).sum::<V3>()
    }

    /// Mass of everything that has one.
    pub fn mass(&self) -> f64 {
        let inverse = self.inv_mass.iter().copied().chain(self.bodies.iter().map(|body| body.inv_mass));
        inverse.filter(|inv_mass| *inv_mass > 0.0).map(f64::recip).sum()
    }

    /// Kinetic energy of everything that has a mass.
    pub fn kinetic_energy(&self) -> f64 {
        let particles = self.v.iter().zip(&self.inv_mass).filter(|(_, inv_mass)| **inv_mass > 0.0);
        particles.map(|(v, inv_mass)| 0.5 * v.norm_squared() / inv_mass).sum::<f64>()
            + self.bodies.iter().map(Body::kinetic_energy).sum::<f64>()
    }

    /// Sum of |m v| of everything that has a mass.
    pub(crate) fn momentum_scale(&self) -> f64 {
        let particles = self.v.iter().zip(&self.inv_mass).filter(|(_, inv_mass)| **inv_mass > 0.0);
        let bodies = self.bodies.iter().filter(|body| body.inv_mass > 0.0);
        particles.map(|(v, inv_mass)| v.norm() / inv_mass).sum::<f64>()
            + bodies.map(|body| body.velocity.norm() / body.inv_mass).sum::<f64>()
    }

    /// Is every coordinate finite?
    pub fn is_finite(&self) -> bool {
        let is_finite = |v: &V3| v.iter().all(|x| x.is_finite());
        self.x.iter().all(is_finite) && self.bodies.iter().all(|body| is_finite(&body.position))
    }

    /// The largest speed of a particle or of a body's center of mass. A [`Surface`](crate::Surface) knows how fast a body's farthest point is.
    pub fn max_speed(&self) -> f64 {
        let speeds = self.v.iter().chain(self.bodies.iter().map(|body| &body.velocity)).map(|v| v.norm());
        speeds.fold(0.0, f64::max)
    }
}
