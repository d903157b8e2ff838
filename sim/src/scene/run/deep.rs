//! Which faces and edges are deeper than they may be?

use sdf_core::cage::CageMap;
use sdf_field::{Field, Method, QueryError};

use super::{Run, body_of, is_skin};
use crate::V3;
use crate::caged::CageRoom;
use crate::motion::Motion;
use crate::obstacle::{Carried, Obstacle};
use crate::query::{Contacts, Elements, Query};
use crate::scene::build::Stage;
use crate::surface::Surface;

impl Run<'_> {
    /// Faces that are deep, and how deep the deepest is, by the certified search.
    pub(super) fn deep(&self, stage: &Stage) -> Result<(usize, f64), QueryError> {
        let Stage { world, surfaces, obstacles, animations, fields, time, .. } = stage;
        let mut depths = Depths { least: 0.25 * self.spec.thickness, ..Depths::default() };
        let moments: Vec<Field> = animations.iter().map(|shape| shape.at(*time)).collect();
        let certified = |surface: &Surface| {
            let elements = if surface.faces.is_empty() { Elements::EDGES } else { Elements::FACES };
            Query {
                elements,
                method: Method::Certified,
                one_per_feature: false,
                thickness: 0.0,
                reduce: None,
                opposed: false,
                ..self.query
            }
        };
        for surface in surfaces {
            let query = certified(surface);
            for obstacle in obstacles.iter().chain(&moments) {
                depths.add(|found| query.find(obstacle as &dyn Obstacle, surface, world, &Motion::NONE, found))?;
            }
            for (id, field) in (0..).zip(fields).filter(|(id, _)| body_of(surface) != Some(*id)) {
                let obstacle = Carried { field, id, body: &world.bodies[id as usize] };
                depths.add(|found| query.find(&obstacle, surface, world, &Motion::NONE, found))?;
            }
        }
        for (cage, rest) in &self.cages {
            let judged =
                cage.with_map(CageMap::Exact).with_obstacle(rest, world, &mut CageRoom::default(), |obstacle| {
                    surfaces.iter().filter(|surface| !is_skin(surface, cage)).try_for_each(|surface| {
                        depths.add(|found| certified(surface).find(obstacle, surface, world, &Motion::NONE, found))
                    })
                });
            judged.transpose()?;
        }
        Ok((depths.count, depths.deepest))
    }
}

/// Depths of contacts, of one pair after the other: all of them may not fit into memory.
#[derive(Default)]
struct Depths {
    /// Less deep does not count, nor what f32 does not tell apart.
    least: f64,
    count: usize,
    deepest: f64,
    found: Contacts,
}

impl Depths {
    fn add(&mut self, find: impl FnOnce(&mut Contacts) -> Result<(), QueryError>) -> Result<(), QueryError> {
        self.found.clear();
        find(&mut self.found)?;
        let contacts = &self.found.contacts;
        let farthest = contacts.iter().map(|contact| V3::from(contact.point).amax()).fold(0.0, f64::max);
        let least = self.least.max(farthest * f64::from(f32::EPSILON));
        let depths = contacts.iter().map(|contact| -contact.distance);
        self.count += depths.clone().filter(|depth| *depth > least).count();
        self.deepest = depths.fold(self.deepest, f64::max);
        Ok(())
    }
}
