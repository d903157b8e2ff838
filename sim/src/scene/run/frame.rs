//! A frame: the searches for contacts in it, and the steps between them.

use std::ops::Range;
use std::time::Instant;

use sdf_field::{Field, QueryError};

use super::{HOLD, Run, RunError, body_of, elements, is_skin};
use crate::World;
use crate::motion::Motion;
use crate::obstacle::{Carried, Moving};
use crate::query::{Memory, Query};
use crate::scene::build::Stage;
use crate::scene::entangled::choose_sides;
use crate::scene::passing::Passing;
use crate::scene::struck::Struck;
use crate::surface::{Carrier, Surface};

/// Contacts of a frame: some gigabytes with all that is kept of them.
pub(super) const MAX_CONTACTS: usize = 4_000_000;

impl Run<'_> {
    /// Searches, and steps.
    pub(super) fn frame(&mut self, stage: &mut Stage) -> Result<(), RunError> {
        let (searches, substeps) = (self.searches(stage), self.spec.substeps);
        let dt = self.substep();
        let mut first = 0;
        for search in 1..=u64::from(searches) {
            let end = (u64::from(substeps) * search / u64::from(searches)) as u32;
            let clock = Instant::now();
            self.search(stage, first..end)?;
            self.figures.seconds.detect += clock.elapsed().as_secs_f64();
            let clock = Instant::now();
            for _ in first..end {
                stage.world.step(dt, self.contacts.rows());
            }
            self.figures.seconds.solve += clock.elapsed().as_secs_f64();
            first = end;
        }
        Ok(())
    }

    /// Searches for contacts in the next frame: more than one where something gets farther in it than the field of a soft body reaches
    /// beyond its mesh, and could pass through it unseen.
    fn searches(&mut self, stage: &Stage) -> u32 {
        let Stage { world, surfaces, .. } = stage;
        let motion = self.motion(world, 1.0);
        let mut ways = 1.0_f64;
        for (cage, _) in self.cages.iter().filter(|(cage, _)| cage.reach() > 0.0) {
            let room = (cage.reach() - self.spec.thickness).max(0.5 * cage.reach());
            let is_own = |surface: &&Surface| is_skin(surface, cage);
            let Some(body) = surfaces.iter().find(is_own).and_then(|skin| skin.bounds(world)) else { continue };
            let motion = motion.toward(cage.max_speed(world));
            for other in surfaces.iter().filter(|surface| !is_own(surface)) {
                let way = motion.reach(other.max_speed(world));
                let bounds = other.bounds(world).map(|bounds| bounds.inflate(way));
                if way > room && bounds.is_some_and(|bounds| bounds.intersection(&body).is_some()) {
                    ways = ways.max(way / room);
                }
            }
        }
        let most = f64::from(self.spec.substeps);
        self.figures.outruns_soft |= ways > most;
        ways.ceil().min(most) as u32
    }

    fn substep(&self) -> f64 {
        1.0 / (self.spec.rate * f64::from(self.spec.substeps))
    }

    /// Motion of everything in a fraction of a frame.
    fn motion(&self, world: &World, fraction: f64) -> Motion {
        if self.spec.no_margin { Motion::NONE } else { Motion::of(world, fraction / self.spec.rate) }
    }

    /// Searches for contacts at the start of some substeps of a frame, which they are for.
    fn search(&mut self, stage: &Stage, steps: Range<u32>) -> Result<(), RunError> {
        let [start, fraction] =
            [steps.start, steps.end - steps.start].map(|n| f64::from(n) / f64::from(self.spec.substeps));
        let duration = fraction / self.spec.rate;
        let motion = self.motion(&stage.world, fraction);
        self.contacts.clear();
        self.touching.begin();
        let Stage { world, surfaces, obstacles, animations, fields, time, .. } = stage;
        let start = *time + start / self.spec.rate;
        let moments: Vec<[Field; 2]> =
            animations.iter().map(|shape| [start, start + duration].map(|time| shape.at(time))).collect();
        let struck = Struck::all(surfaces, world, &motion, self.query.thickness);
        for (index, surface) in surfaces.iter().enumerate() {
            let gain = struck[index].gain();
            let query = Query { elements: elements(&self.query, self.only_vertices, surface), ..self.query };
            let obstacles = if self.hulls.is_empty() { obstacles } else { &self.hulls };
            let changing = surfaces.len() + obstacles.len();
            for (number, obstacle) in obstacles.iter().enumerate() {
                let sides = &mut self.sides[index];
                let memory = self.memories.entry((index, number)).or_default();
                // A body has an inside, and leaves whole.
                let is_sheet = matches!(surface.carrier, Carrier::Particles { .. }) && !surface.faces.is_empty();
                let choose_side = self.spec.choose_side && is_sheet;
                if choose_side {
                    // A patch is led by where it touches now: points from before hold it back.
                    *memory = Memory::default();
                }
                let (motion, first) = (motion.toward(gain), self.contacts.contacts.len());
                query.find_guided(obstacle, surface, world, &motion, memory, &mut self.contacts, |found| {
                    if choose_side && !self.only_vertices && self.hulls.is_empty() {
                        choose_sides(found, surface, &surface.points(world), self.spec.thickness, sides);
                    }
                })?;
                self.touching.add(index, surfaces.len() + number, &self.contacts.contacts[first..]);
            }
            for (number, (shape, [now, later])) in (changing..).zip(animations.iter().zip(&moments)) {
                let obstacle = Moving { now, later, time: duration };
                let motion = motion.toward(shape.max_speed().max(gain));
                let first = self.contacts.contacts.len();
                query.find(&obstacle, surface, world, &motion, &mut self.contacts)?;
                self.touching.add(index, number, &self.contacts.contacts[first..]);
            }
            let mine = body_of(surface);
            for (number, other) in surfaces.iter().enumerate() {
                let Some(id) = body_of(other).filter(|id| Some(*id) != mine) else { continue };
                if struck[index].meets(&struck[number]) {
                    let obstacle = Carried { field: &fields[id as usize], id, body: &world.bodies[id as usize] };
                    let memory = self.memories.entry((index, obstacles.len() + id as usize)).or_default();
                    let first = self.contacts.contacts.len();
                    let motion = motion.toward(struck[number].speed.max(gain));
                    query.find_again(&obstacle, surface, world, &motion, memory, &mut self.contacts)?;
                    self.touching.add(index, number, &self.contacts.contacts[first..]);
                    let field = &fields[id as usize];
                    self.separations.look([index, number], surfaces, world, field, &mut self.contacts, first);
                    self.require_few()?;
                }
            }
        }
        self.separations.replace(surfaces, world, &mut self.contacts);
        for (cage, rest) in &self.cages {
            let speed = cage.max_speed(world);
            let found = cage.with_obstacle(rest, world, &mut self.cage_room, |obstacle| {
                let skin = surfaces.iter().position(|surface| is_skin(surface, cage)).unwrap_or(surfaces.len());
                surfaces.iter().enumerate().filter(|(index, _)| *index != skin).try_for_each(|(index, surface)| {
                    let query = Query { elements: elements(&self.query, self.only_vertices, surface), ..self.query };
                    let (motion, first) =
                        (motion.toward(speed.max(struck[index].gain())), self.contacts.contacts.len());
                    query.find(obstacle, surface, world, &motion, &mut self.contacts)?;
                    self.touching.add(index, skin, &self.contacts.contacts[first..]);
                    Ok::<(), QueryError>(())
                })
            });
            found.transpose()?;
        }
        let (threads, thickness) = (self.query.threads, self.query.thickness);
        if animations.is_empty() && self.hulls.is_empty() {
            let (near, substeps) = (HOLD * thickness, steps.len() as u32);
            let dt = self.substep();
            let passing = Passing { world, surfaces, obstacles, fields, thickness, near, substeps, dt, threads };
            passing.forget(&mut self.contacts)?;
        }
        if !fields.is_empty() {
            self.contacts.sort_by_place();
        }
        Ok(())
    }

    /// Refuses more contacts than memory has room for.
    fn require_few(&self) -> Result<(), RunError> {
        match self.contacts.contacts.len() {
            ..=MAX_CONTACTS => Ok(()),
            _ => Err(RunError::TooManyContacts),
        }
    }
}
