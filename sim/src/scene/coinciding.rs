//! Which faces of rigid bodies coincide at the start with the surface of another body or an obstacle while both have an inside there?
//!
//! No point of such a face is deep, so the search for contacts does not tell two bodies in one place. A face counts if its corners and its
//! centroid are on the other's surface and a point below the centroid is inside of both. Of bodies side by side that point is outside of
//! one of them. Of bodies thinner than 4 % of their radius no such point is found; soft bodies and obstacles that change are not looked at.

use sdf_core::Aabb;
use sdf_field::{Field, Threads};

use super::build::Stage;
use super::run::body_of;
use crate::{Body, V3};

/// Points nearer than a quarter of the thickness and this share of a body's radius are on a surface.
const NEAR: f64 = 0.01;

/// The point below a face is so many times as deep.
const BELOW: f64 = 3.0;

/// Number of such faces, each counted once for each of the others.
pub(super) fn coinciding(stage: &Stage, thickness: f64) -> usize {
    let Stage { world, surfaces, obstacles, fields, .. } = stage;
    let mut count = 0;
    for surface in surfaces {
        let (Some(id), Some((points, _))) = (body_of(surface), surface.at_rest()) else { continue };
        let skin = Skin {
            points,
            faces: &surface.faces,
            body: &world.bodies[id as usize],
            field: &fields[id as usize],
            radius: surface.radius(),
            near: 0.25 * thickness + NEAR * surface.radius(),
        };
        let others = (0..).zip(fields).filter(|(other, _)| *other != id);
        let others = others.map(|(other, field)| (field, Some(&world.bodies[other as usize])));
        for (field, other) in others.chain(obstacles.iter().map(|field| (field, None))) {
            count += skin.count_on(field, other);
        }
    }
    count
}

/// The skin of a rigid body, in its own frame.
struct Skin<'a> {
    points: &'a [[f64; 3]],
    faces: &'a [[u32; 3]],
    body: &'a Body,
    field: &'a Field,
    radius: f64,
    near: f64,
}

impl Skin<'_> {
    /// Faces that coincide with the surface of a field, which a body may carry.
    fn count_on(&self, other: &Field, carrier: Option<&Body>) -> usize {
        let local = |point: &V3| {
            let point = self.body.world_point(point);
            carrier.map_or(point, |carrier| carrier.local_point(&point))
        };
        let bounds = other.bounds(0.0).inflate(self.near);
        let is_within = |bounds: &Aabb, point: [f64; 3]| bounds.encloses(&Aabb { min: point, max: point });
        if !is_within(&bounds.inflate(self.radius), local(&V3::zeros()).into()) {
            return 0;
        }
        // What is outside of the box is not on the surface.
        let value = |point: V3| match is_within(&bounds, point.into()) {
            true => other.sample(&[point.into()], Threads::ONE)[0].value,
            false => f64::INFINITY,
        };
        let is_on = |point: &V3| value(local(point)).abs() <= self.near;
        let on: Vec<bool> = self.points.iter().map(|point| is_on(&V3::from(*point))).collect();
        let is_coinciding = |face: &&[u32; 3]| {
            if !face.iter().all(|vertex| on[*vertex as usize]) {
                return false;
            }
            let [a, b, c] = face.map(|vertex| V3::from(self.points[vertex as usize]));
            let centroid = (a + b + c) / 3.0;
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { return false };
            let below = centroid - normal * (BELOW * self.near);
            let own = self.field.sample(&[below.into()], Threads::ONE)[0].value;
            is_on(&centroid) && own < -self.near && value(local(&below)) < -self.near
        };
        self.faces.iter().filter(is_coinciding).count()
    }
}
