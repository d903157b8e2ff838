//! Where does a field touch the triangles of a surface? At the lowest point of each triangle, and at the corners of those that touch:
//! a side that lies flat on something is held by its corners, not by one point of each triangle.
//!
//! Balls and capsules are searched about their axes, too: `round`. Where φ is no distance, outside of a grid's box and beyond a band, the
//! nearest point of the field's surface is searched: `nearest`.

use parry3d::shape::PackedFeatureId;
use sdf_core::contact::{Contact, ContactStatus, Element, Feature, Outcome, Row, contact, one_per_feature};
use sdf_core::minimize::{Certified, Minimizer, Newton};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::Rigid;
use sdf_core::{Aabb, AnyField, EnclosedSdf, Sdf, Simplex};

use crate::footprint;
use crate::nearest::{AT_SURFACE, NearestPoint};
use crate::round::RoundSurface;
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
    /// φ is no distance here, and the gap is that to the nearest point of the field's surface.
    pub is_measured: bool,
    /// How far the point lies before the triangles, where the surface is around them.
    pub border: f64,
    /// The vertex, edge or face of the surface, the same from step to step.
    pub feature: PackedFeatureId,
}

impl Touch {
    /// Do triangles themselves touch the field, and not only what is around them?
    pub fn is_of_triangles(&self) -> bool {
        self.value + self.border <= 0.0
    }
}

/// Points on which a field stands are numbered from here on, as vertices; a triangle in a box has at most nine corners.
const FIRST_FOOTPRINT: u32 = 1 << 28;
const MAX_CORNERS: u32 = 9;

/// All touches with φ ≤ margin, as far as the search finds them. Where φ is no distance, their gaps can be larger.
/// The field comes with the box around its inside.
pub(crate) fn touches(
    (field, bounds): (&AnyField, &Aabb),
    surface: &Surface,
    pose: &Rigid,
    margin: f64,
    search: Search,
) -> Vec<Touch> {
    let found = surface.parts.iter().zip(0..).map(|(part, number)| {
        let query = Query { field, bounds, part, number, pose, margin };
        match search {
            Search::Local => query.run(&Newton::default()),
            Search::Certified => query.run(&Certified { evaluations: 256, ..Certified::default() }),
        }
    });
    found.flatten().collect()
}

/// The search of one part of a surface.
pub(crate) struct Query<'a> {
    pub field: &'a AnyField,
    pub bounds: &'a Aabb,
    part: &'a Part,
    number: u32,
    pose: &'a Rigid,
    pub margin: f64,
}

impl Query<'_> {
    fn run<M: Minimizer<3> + Minimizer<1>>(&self, method: &M) -> Vec<Touch> {
        let margin = self.margin + self.part.border() * self.field.slope_bound() + self.error_at_border();
        let mut contacts = self.faces(method, margin);
        match self.part.rounding {
            Rounding::Swept { segment, radius } => {
                let segment = segment.map(|end| self.pose.push(end));
                RoundSurface { query: self, segment, radius }.touches(method, contacts)
            }
            rounding => {
                let further = [self.corners(method, &contacts, margin), self.footprints(method, &contacts, margin)];
                contacts.extend(further.into_iter().flatten());
                let count = one_per_feature(&mut contacts);
                contacts.truncate(count);
                let border = if let Rounding::Border(border) = rounding { border } else { 0.0 };
                contacts.iter().filter_map(|contact| self.touch(contact, border)).collect()
            }
        }
    }

    /// How much farther triangles may be by φ than they are, where a border around them is wider than a grid's band.
    fn error_at_border(&self) -> f64 {
        let Rounding::Border(border) = self.part.rounding else { return 0.0 };
        let error = self.field.error_bound(&Aabb::EVERYWHERE);
        let above = if border < error.levels.upper { error.near } else { error.above };
        if above.is_finite() { above.max(0.0) } else { 0.0 }
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

    /// Points on which the field stands, of these faces that are larger than it.
    fn footprints<M: Minimizer<1>>(&self, method: &M, faces: &[Contact<f64>], margin: f64) -> Vec<Contact<f64>> {
        let extent = self.field.extent();
        let of_face = |face: &Contact<f64>| {
            let simplex = Simplex { corners: face.vertices.map(|vertex| self.corner(vertex)) };
            let is_wide = simplex.longest_edge() > extent;
            let corners = if is_wide { footprint::corners(simplex.corners, self.bounds, margin) } else { vec![] };
            let first = FIRST_FOOTPRINT.wrapping_add(face.element.wrapping_mul(MAX_CORNERS));
            (first..).zip(corners).filter_map(|(id, at)| self.point(method, id, at, margin)).collect::<Vec<_>>()
        };
        faces.iter().flat_map(of_face).collect()
    }

    pub fn point<M: Minimizer<1>>(&self, method: &M, id: u32, at: Vector3<f64>, margin: f64) -> Option<Contact<f64>> {
        let element = Element { id, vertices: [id], simplex: Simplex { corners: [at] } };
        match contact(self.field, method, margin, &element) {
            Outcome::Contact(contact) => Some(contact),
            _ => None,
        }
    }

    /// `None` where the field has no normal, or the point is beyond the margin once the border is taken off.
    pub fn touch(&self, contact: &Contact<f64>, border: f64) -> Option<Touch> {
        let row = Row::from_contact(contact, border)?;
        let value = contact.distance - border;
        let point = row.point - row.normal * border;
        let feature = self.feature(contact.feature);
        let (field_point, normal, gap) = (row.surface_point, row.normal, row.gap);
        let touch = Touch { point, field_point, normal, gap, value, is_measured: false, border, feature };
        if value > self.margin {
            return None;
        }
        let is_distance = !matches!(contact.status, ContactStatus::OutsideGrid | ContactStatus::BeyondBand);
        Some(if is_distance { touch } else { self.measured(contact, touch) })
    }

    /// The touch by the nearest point of the field's surface, in place of by φ.
    fn measured(&self, contact: &Contact<f64>, touch: Touch) -> Touch {
        let tolerance = AT_SURFACE * contact.distance.abs();
        let field_point = NearestPoint { field: self.field, start: contact.point, tolerance }.find();
        let side = if contact.distance < 0.0 { -1.0 } else { 1.0 };
        let way = (contact.point - field_point) * side;
        let Some(normal) = way.try_normalize(tolerance) else { return touch };
        let gap = way.norm() * side - touch.border;
        Touch { point: contact.point - normal * touch.border, field_point, normal, gap, is_measured: true, ..touch }
    }

    fn corner(&self, vertex: u32) -> Vector3<f64> {
        self.pose.push(Vector3::from(self.part.points[vertex as usize]))
    }

    /// The feature's name; two large meshes can have one of the same, which costs no more than a solver's first guess.
    pub fn feature(&self, feature: Feature) -> PackedFeatureId {
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
