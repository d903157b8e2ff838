//! Where do coordinates on a card begin? In f32 a position far from the origin is coarse: 10⁶ sizes away a step is a sixteenth of a size.
//! The card counts from a point near the field, and differences are taken in f64.

use sdf_core::contact::Contact;
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placement, Rigid};
use sdf_core::{Aabb, AnyField, Sdf};

/// Points from which a card counts. Both are the origin where the field is within 32 sizes of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origins {
    /// In the field's frame.
    pub field_origin: [f64; 3],
    /// In the world.
    pub world_origin: [f64; 3],
    /// Box of the field, in its frame.
    bounds: Aabb,
}

impl Origins {
    /// `has_points`: does the host have them? Points that the card alone has count from the world's origin.
    pub fn new(field: &AnyField, pose: Option<&Rigid>, has_points: bool) -> Self {
        let bounds = field.bounds(0.0);
        let field_origin = near(&bounds, bounds.center().into());
        Self { field_origin, world_origin: [0.0; 3], bounds }.moved(pose, has_points)
    }

    /// The origins for the same field elsewhere.
    pub fn moved(self, pose: Option<&Rigid>, has_points: bool) -> Self {
        let world_origin = match pose {
            _ if !has_points => [0.0; 3],
            None => self.field_origin,
            Some(pose) => near(&self.bounds, pose.push(self.bounds.center().into())),
        };
        Self { world_origin, ..self }
    }

    /// The motion of the field between the coordinates on the card; `None` if they are the same.
    pub fn pose(&self, pose: Option<Rigid>) -> Option<Rigid> {
        let (field, points) = (Vector3::from(self.field_origin), Vector3::from(self.world_origin));
        match pose {
            None if field == points => None,
            None => Rigid::new((field - points).into(), [0.0, 0.0, 0.0, 1.0]),
            Some(pose) if field == points && points == Vector3::zeros() => Some(pose),
            Some(pose) => Rigid::new((pose.push(field) - points).into(), pose.rotation()),
        }
    }

    /// A point of the world as the card has it.
    pub fn round(&self, point: &[f64; 3]) -> [f32; 3] {
        [0, 1, 2].map(|axis| (point[axis] - self.world_origin[axis]) as f32)
    }

    /// Points of the world as the card has them.
    pub fn round_all(&self, points: &[[f64; 3]]) -> Vec<[f32; 3]> {
        points.iter().map(|point| self.round(point)).collect()
    }

    /// A contact that the card found, where it is in the world.
    pub fn in_world(&self, contact: Contact<f64>) -> Contact<f64> {
        let origin = Vector3::from(self.world_origin);
        Contact { point: contact.point + origin, surface_point: contact.surface_point + origin, ..contact }
    }

    /// Distance of a point from the one that the card has in its place, in the frame of the field, which has these poses in the world and
    /// [on the card](Self::pose).
    pub fn rounding_of(&self, point: &[f64; 3], [pose, on_card_pose]: [Option<&Rigid>; 2]) -> f64 {
        let (world, on_card) = (Vector3::from(*point), Vector3::from(self.round(point)).map(f64::from));
        let exact = pose.map_or(world, |pose| pose.pull(world).point) - Vector3::from(self.field_origin);
        let on_card = on_card_pose.map_or(on_card, |pose| pose.pull(on_card).point.map(|x| f64::from(x as f32)));
        // Of the differences in f64, which are exact where nothing is far.
        let far =
            [self.field_origin, self.world_origin].into_iter().flatten().fold(0.0, |far: f64, x| far.max(x.abs()));
        (exact - on_card).norm() + far * (16.0 * f64::EPSILON)
    }
}

/// The multiple of about 64 sizes of a box that is nearest to its center at a place. As a power of two it changes with the unit, and
/// a body that moves stays near it for long.
fn near(bounds: &Aabb, center: Vector3<f64>) -> [f64; 3] {
    let step = 64.0 * power_of_two(bounds.diagonal());
    let nearest = center.map(|x| (x / step).round() * step);
    if nearest.iter().all(|x| x.is_finite()) { nearest.into() } else { [0.0; 3] }
}

/// The largest that is not more than a positive number; 0 below the smallest normal one.
fn power_of_two(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & f64::INFINITY.to_bits())
}
