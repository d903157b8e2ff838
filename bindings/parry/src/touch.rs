//! Where does a field touch the triangles of a surface? At the lowest point of each triangle, and at the corners of those that touch:
//! a side that lies flat on something is held by its corners, not by one point of each triangle.
//!
//! Points on balls and capsules are found on their triangles, then moved on the true surface downhill, by projected gradient descent.

use parry3d::shape::PackedFeatureId;
use sdf_core::contact::{Contact, Element, Feature, Outcome, Row, contact, one_per_feature};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::Rigid;
use sdf_core::{AnyField, Sdf, Simplex};

use crate::search::Search;
use crate::surface::{Part, Rounding, Surface};

/// A point of a surface at or near a field, in the field's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Touch {
    /// The point of the surface.
    pub point: Vector3<f64>,
    /// The point of the field's own surface that is nearest to it.
    pub field_point: Vector3<f64>,
    /// Unit vector out of the field.
    pub normal: Vector3<f64>,
    /// From `field_point` to `point` along the normal.
    pub gap: f64,
    /// φ at the point: what a search compares. It is the gap if φ is a true distance.
    pub value: f64,
    /// The vertex, edge or face of the surface, the same from step to step.
    pub feature: PackedFeatureId,
}

/// Steps of a point on a round surface, and the shortest of them in radii.
const ROUND_STEPS: u32 = 48;
const SHORTEST_STEP: f64 = 1e-6;

/// Points on a round surface that are nearer than this, in radii, are one.
const SAME_POINT: f64 = 0.15;

/// Depth of the cap whose mean is the normal of a round surface, in radii, and points along either side of it.
const CAP_DEPTH: f64 = 0.004;
const CAP_POINTS: i32 = 4;

/// All touches with φ ≤ margin, as far as the search finds them.
pub(crate) fn touches(field: &AnyField, surface: &Surface, pose: &Rigid, margin: f64, search: Search) -> Vec<Touch> {
    let found = surface.parts.iter().zip(0..).map(|(part, number)| {
        let query = Query { field, part, number, pose, margin };
        match search {
            Search::FrankWolfe => query.run(&FrankWolfe::default()),
            Search::Certified => query.run(&Certified { evaluations: 256, ..Certified::default() }),
        }
    });
    found.flatten().collect()
}

struct Query<'a> {
    field: &'a AnyField,
    part: &'a Part,
    number: u32,
    pose: &'a Rigid,
    margin: f64,
}

impl Query<'_> {
    fn run<M: Minimizer<3> + Minimizer<1>>(&self, method: &M) -> Vec<Touch> {
        // The true surface is nearer by as much.
        let margin = self.margin + self.part.border() * self.field.slope_bound();
        let mut contacts = self.faces(method, margin);
        match self.part.rounding {
            Rounding::Swept { segment, radius } => {
                let segment = segment.map(|end| self.pose.push(end));
                self.on_round_surface(method, contacts, segment, radius)
            }
            rounding => {
                contacts.extend(self.corners(method, &contacts, margin));
                let count = one_per_feature(&mut contacts);
                contacts.truncate(count);
                let border = if let Rounding::Border(border) = rounding { border } else { 0.0 };
                contacts.iter().filter_map(|contact| self.touch(contact, border)).collect()
            }
        }
    }

    /// The lowest point of each triangle.
    fn faces<M: Minimizer<3>>(&self, method: &M, margin: f64) -> Vec<Contact<f64>> {
        let mut contacts = vec![];
        let mut search = |face: u32| {
            let vertices = self.part.faces[face as usize];
            let corners = vertices.map(|vertex| self.corner(vertex));
            let element = Element { id: face, vertices, simplex: Simplex { corners } };
            if let Outcome::Contact(found) = contact(self.field, method, margin, &element) {
                contacts.push(found);
            }
        };
        match self.part.clusters() {
            Some(clusters) => clusters.visit_near(self.field, margin, Some(self.pose), |faces| {
                faces.iter().for_each(|face| search(*face));
            }),
            None => (0..self.part.faces.len() as u32).for_each(search),
        }
        contacts
    }

    /// The corners of these faces that are within the margin, too.
    fn corners<M: Minimizer<1>>(&self, method: &M, faces: &[Contact<f64>], margin: f64) -> Vec<Contact<f64>> {
        let mut vertices: Vec<u32> = faces.iter().flat_map(|face| face.vertices).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let found = vertices.into_iter().map(|vertex| self.point(method, vertex, self.corner(vertex), margin));
        found.flatten().collect()
    }

    /// Touches of a ball that is swept along a segment, in the field's frame.
    fn on_round_surface<M: Minimizer<1>>(
        &self,
        method: &M,
        mut near: Vec<Contact<f64>>,
        segment: [Vector3<f64>; 2],
        radius: f64,
    ) -> Vec<Touch> {
        near.sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance));
        let mut found: Vec<Touch> = vec![];
        for start in near {
            let lowest = descend(self.field, start.point, segment, radius);
            let is_known = found.iter().any(|known| (known.point - lowest).norm() < SAME_POINT * radius);
            let touch = self.point(method, start.element, lowest, self.margin);
            let touch = touch.filter(|_| !is_known).and_then(|contact| self.touch(&contact, 0.0));
            found.extend(touch.map(|touch| self.on_cap(touch, axis_point(lowest, segment), radius)));
        }
        found
    }

    /// The touch with the mean normal of the cap around it. The lowest point of a ball jumps where a grid has a crease between two cells;
    /// the mean over its neighbourhood, by weights that fall as φ rises, does not.
    fn on_cap(&self, touch: Touch, axis: Vector3<f64>, radius: f64) -> Touch {
        let out = (touch.point - axis) / radius;
        let [u, v] = tangents(out);
        let depth = CAP_DEPTH * radius;
        // φ rises by 4 depths to the cap's rim, where the field is flat.
        let step = (8.0 * CAP_DEPTH).sqrt() / f64::from(CAP_POINTS);
        let steps = || (-CAP_POINTS..=CAP_POINTS).map(|index| f64::from(index) * step);
        let mut mean = Vector3::zeros();
        for (i, j) in steps().flat_map(|i| steps().map(move |j| (i, j))) {
            let direction = (out + u * i + v * j).normalize();
            let rise = self.field.sample(axis + direction * radius).value - touch.value;
            mean += direction * (-rise / depth).exp();
        }
        let Some(mean) = mean.try_normalize(1e-6) else { return touch };
        let point = axis + mean * radius;
        Touch { point, field_point: point + mean * touch.gap, normal: -mean, ..touch }
    }

    fn point<M: Minimizer<1>>(&self, method: &M, id: u32, at: Vector3<f64>, margin: f64) -> Option<Contact<f64>> {
        let element = Element { id, vertices: [id], simplex: Simplex { corners: [at] } };
        match contact(self.field, method, margin, &element) {
            Outcome::Contact(contact) => Some(contact),
            _ => None,
        }
    }

    /// `None` where the field has no normal, or the point is beyond the margin once the border is taken off.
    fn touch(&self, contact: &Contact<f64>, border: f64) -> Option<Touch> {
        let row = Row::from_contact(contact, border)?;
        let value = contact.distance - border;
        let point = row.point - row.normal * border;
        let feature = self.feature(contact.feature);
        let touch = Touch { point, field_point: row.surface_point, normal: row.normal, gap: row.gap, value, feature };
        (value <= self.margin).then_some(touch)
    }

    fn corner(&self, vertex: u32) -> Vector3<f64> {
        self.pose.push(Vector3::from(self.part.points[vertex as usize]))
    }

    /// The feature's name; two large meshes can have one of the same, which costs no more than a solver's first guess.
    fn feature(&self, feature: Feature) -> PackedFeatureId {
        const MIX: u32 = 0x9E37_79B1;
        const CODES: u32 = 0x3FFF_FFFF;
        let code = |number: u32| number.wrapping_add(self.number.wrapping_mul(MIX)) & CODES;
        match feature {
            Feature::Vertex(vertex) => PackedFeatureId::vertex(code(vertex)),
            Feature::Edge([a, b]) => PackedFeatureId::edge(code(a.wrapping_mul(MIX) ^ b)),
            Feature::Face(face) => PackedFeatureId::face(code(face)),
        }
    }
}

/// A local minimum of φ on a ball swept along a segment: x ← the surface point nearest to x − s ∇φ/|∇φ|, with steps s of the radius at
/// first, shorter where φ did not fall, and longer again where it did.
fn descend(field: &AnyField, start: Vector3<f64>, segment: [Vector3<f64>; 2], radius: f64) -> Vector3<f64> {
    let mut at = on_swept_ball(start, segment, radius).unwrap_or(start);
    let mut sample = field.sample(at);
    let mut step = radius;
    for _ in 0..ROUND_STEPS {
        let slope = sample.gradient.norm();
        if slope < 1e-6 || step < SHORTEST_STEP * radius {
            break;
        }
        let Some(next) = on_swept_ball(at - sample.gradient * (step / slope), segment, radius) else { break };
        let lower = field.sample(next);
        if (next - at).norm() < SHORTEST_STEP * radius {
            break;
        }
        if lower.value < sample.value {
            (at, sample, step) = (next, lower, (1.6 * step).min(radius));
        } else {
            step *= 0.4;
        }
    }
    at
}

/// The point of the swept ball's surface that is nearest to a point; `None` on the segment.
fn on_swept_ball(point: Vector3<f64>, segment: [Vector3<f64>; 2], radius: f64) -> Option<Vector3<f64>> {
    let axis = axis_point(point, segment);
    let out = (point - axis).try_normalize(1e-12)?;
    Some(axis + out * radius)
}

/// Two unit vectors at right angles to a unit vector and to each other.
fn tangents(normal: Vector3<f64>) -> [Vector3<f64>; 2] {
    let u = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
    [u, normal.cross(&u)]
}

/// The point of a segment that is nearest to a point.
fn axis_point(point: Vector3<f64>, [a, b]: [Vector3<f64>; 2]) -> Vector3<f64> {
    let along = b - a;
    let share = ((point - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    a + along * share
}
