//! Which shape of a pair is the field, and which the surface? The first field whose partner has triangles; a half-space is a field,
//! too, where its partner is a field with a mesh.

use std::sync::Arc;

use parry3d::bounding_volume::{Aabb as ParryAabb, BoundingVolume};
use parry3d::math::{Pose, Vector};
use parry3d::query::details::ShapeCastOptions;
use parry3d::query::{NonlinearRigidMotion, PointQuery};
use parry3d::shape::{Shape, SharedShape, TypedShape};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, AnyField, Sdf, shapes};

use crate::convert::{to_core, to_parry, to_rigid};
use crate::nearest::{AT_SURFACE, NearestPoint};
use crate::search::Search;
use crate::shape::SdfShape;
use crate::surface::Surface;
use crate::touch::{Touch, touches};
use crate::triangles::{surface_near, surface_of};
use crate::vertices;

/// Ways between two shapes that are apart, in search of their nearest points, and the smallest fraction by which two make the gap shorter.
const WAYS_TO_AND_FRO: u32 = 32;
const SHORTENED: f64 = 1e-6;

/// Triangles are looked at up to this times the value that is known: f32 rounds it.
const FARTHER: f64 = 1.0001;

pub(crate) struct Pair {
    pub field: Arc<AnyField>,
    /// The box around the field's inside.
    pub bounds: Aabb,
    pub surface: Arc<Surface>,
    /// The field is the second shape.
    pub flipped: bool,
}

impl Pair {
    /// `None` if neither is an [`SdfShape`], or its partner has no triangles.
    pub fn new(g1: &dyn Shape, g2: &dyn Shape) -> Option<Self> {
        Self::roles(g1, g2).and_then(|(field, bounds, shape, flipped)| {
            Some(Self { field, bounds, surface: surface_of(shape)?, flipped })
        })
    }

    /// The same with those triangles alone that the field comes within the target distance of, on its way.
    pub fn near(
        [g1, g2]: [&dyn Shape; 2],
        motions: [&NonlinearRigidMotion; 2],
        start: f32,
        options: &ShapeCastOptions,
    ) -> Option<Self> {
        let (field, bounds, shape, flipped) = Self::roles(g1, g2)?;
        let level = f64::from(options.target_distance);
        let region = match &*field {
            // A grid reads many samples to tell its box.
            AnyField::Grid(_) => bounds.inflate(level.max(0.0)),
            _ => field.bounds(level),
        };
        let surface = match reach(&region, motions, start, options.max_time_of_impact, flipped) {
            Some(reach) => surface_near(shape, &reach)?,
            None => surface_of(shape)?,
        };
        Some(Self { field, bounds, surface, flipped })
    }

    /// The same of shapes that do not move.
    pub fn near_at(g1: &dyn Shape, g2: &dyn Shape, pos12: &Pose, target_distance: f32) -> Option<Self> {
        let [still, moved] = [Pose::IDENTITY, *pos12].map(NonlinearRigidMotion::constant_position);
        let now = ShapeCastOptions { target_distance, ..ShapeCastOptions::with_max_time_of_impact(0.0) };
        Self::near([g1, g2], [&still, &moved], 0.0, &now)
    }

    /// The same with those triangles alone that can be nearest to the field at this pose of the second shape. No triangle is, unless φ is somewhere
    /// on it at most that at the point of the other shape that is nearest to a point of the field's body.
    pub fn nearest_parts(g1: &dyn Shape, g2: &dyn Shape, pos12: &Pose) -> Option<Self> {
        let (field, _, other, flipped) = Self::roles(g1, g2)?;
        let body = if flipped { g2 } else { g1 };
        let pose = if flipped { pos12.inverse() } else { *pos12 };
        let is_large = matches!(
            other.as_typed_shape(),
            TypedShape::TriMesh(_) | TypedShape::HeightField(_) | TypedShape::Compound(_)
        );
        let part = body.as_shape::<SdfShape>().filter(|_| is_large).and_then(|body| body.parts().first());
        let inner = part.map(|part| pose.inverse_transform_point(to_parry(part.inner_point)));
        let on_other = inner.map(|inner| pose.transform_point(other.project_local_point(inner, false).point));
        let level = on_other.map(|point| field.value(to_core(point))).filter(|level| level.is_finite());
        let Some(level) = level else { return Self::new(g1, g2) };
        let pair = Self::near_at(g1, g2, pos12, (level.max(0.0) * FARTHER) as f32)?;
        // The way out of a shape is to any of its triangles.
        let is_whole =
            pair.surface.parts.iter().all(|part| part.faces.is_empty()) || pair.swallowed([g1, g2], &pose).is_some();
        if is_whole { Self::new(g1, g2) } else { Some(pair) }
    }

    /// The same with a surface that is known from the last step.
    pub fn with_surface(g1: &dyn Shape, g2: &dyn Shape, surface: Arc<Surface>) -> Option<Self> {
        Self::roles(g1, g2).map(|(field, bounds, _, flipped)| Self { field, bounds, surface, flipped })
    }

    fn roles<'a>(g1: &'a dyn Shape, g2: &'a dyn Shape) -> Option<(Arc<AnyField>, Aabb, &'a dyn Shape, bool)> {
        let sdf = |shape: &dyn Shape| shape.as_shape::<SdfShape>().cloned();
        let has_surface =
            |shape: &dyn Shape| shape.as_halfspace().is_none() && sdf(shape).is_none_or(|sdf| sdf.mesh().is_some());
        let has_mesh = |shape: &dyn Shape| sdf(shape).is_some_and(|sdf| sdf.mesh().is_some());
        match (sdf(g1), sdf(g2)) {
            (Some(field), _) if has_surface(g2) => Some((field.shared_field(), field.field_bounds(), g2, false)),
            (_, Some(field)) if has_surface(g1) => Some((field.shared_field(), field.field_bounds(), g1, true)),
            _ if has_mesh(g1) => half_space(g2).map(|(field, bounds)| (field, bounds, g1, true)),
            _ if has_mesh(g2) => half_space(g1).map(|(field, bounds)| (field, bounds, g2, false)),
            _ => None,
        }
    }

    /// Where the surface stands in the field's frame; `pos12` takes the second shape into the frame of the first.
    pub fn pose(&self, pos12: &Pose) -> Pose {
        if self.flipped { pos12.inverse() } else { *pos12 }
    }

    fn field_and_other<'a>(&self, [g1, g2]: [&'a dyn Shape; 2]) -> (&'a dyn Shape, &'a dyn Shape) {
        if self.flipped { (g2, g1) } else { (g1, g2) }
    }

    /// Touches at a pose of the surface in the field's frame.
    pub fn touches(&self, pose: &Pose, margin: f64, search: Search) -> Vec<Touch> {
        let mut touches = self.touches_by_value(pose, margin, search);
        touches.retain(|touch| !touch.is_measured || touch.gap <= margin);
        touches
    }

    /// The same of those that have φ ≤ margin.
    pub fn touches_by_value(&self, pose: &Pose, margin: f64, search: Search) -> Vec<Touch> {
        to_rigid(pose).map_or(vec![], |pose| touches((&self.field, &self.bounds), &self.surface, &pose, margin, search))
    }

    /// The touch with the lowest φ. Its value is at most that at the vertices that are evaluated.
    pub fn nearest(&self, pose: &Pose, search: Search) -> Option<Touch> {
        let rigid = to_rigid(pose)?;
        let value = |point: Vector3<f64>| self.field.value(rigid.push(point));
        let values = self.surface.parts.iter().flat_map(|part| part.low_points(value).into_iter().map(value));
        let margin = values.fold(f64::INFINITY, f64::min);
        // Above the value itself, so that rounding does not lose it.
        let margin = margin + 1e-6 * margin.abs() + f64::MIN_POSITIVE;
        let touches = if margin.is_finite() { self.touches_by_value(pose, margin, search) } else { vec![] };
        touches.into_iter().min_by(|a, b| a.value.total_cmp(&b.value))
    }

    /// A part of the field's body of which a point is inside of the triangles that stand for the other shape. Then they intersect, also where
    /// the part lies wholly within, and no triangle comes near.
    pub fn swallowed(&self, shapes: [&dyn Shape; 2], pose: &Pose) -> Option<Self> {
        let (field, other) = self.field_and_other(shapes);
        let part = field.as_shape::<SdfShape>()?.parts().iter().find(|part| {
            let point = pose.inverse_transform_point(to_parry(part.inner_point));
            contains_within_triangles(other, point)
        })?;
        let surface = self.surface.clone();
        Some(Self { field: part.field.clone(), bounds: part.bounds, surface, flipped: self.flipped })
    }

    /// The touches of a pair, or the way out if a part of the field is wholly inside of the other shape: where it is, no triangle touches it.
    pub fn touches_or_way_out(&self, shapes: [&dyn Shape; 2], pose: &Pose, margin: f64, search: Search) -> Vec<Touch> {
        let mut touches = self.touches(pose, margin, search);
        let is_crossed = touches.iter().any(Touch::is_of_triangles);
        if let Some(part) = (!is_crossed).then(|| self.swallowed(shapes, pose)).flatten() {
            return part.nearest(pose, search).map(|touch| part.way_out(touch)).into_iter().collect();
        }
        let (field, other) = self.field_and_other(shapes);
        // Another field has its own triangles here, and a smaller shape stands on its own.
        let is_wide = f64::from(other.compute_local_aabb().extents().max_element()) >= self.field.extent::<f64>();
        let own = field.as_shape::<SdfShape>().filter(|_| is_wide && other.as_shape::<SdfShape>().is_none());
        if let Some((own, mesh)) = own.and_then(|own| Some((own, own.mesh()?))) {
            touches.extend(vertices::touches(mesh, own.parts(), other, pose, margin));
        }
        touches
    }

    /// The nearest touch, or the way out, and whether the shapes intersect.
    pub fn nearest_or_way_out(&self, shapes: [&dyn Shape; 2], pose: &Pose, search: Search) -> (Option<Touch>, bool) {
        let touch = self.nearest(pose, search);
        let is_crossed = touch.is_some_and(|touch| touch.is_of_triangles());
        match (!is_crossed).then(|| self.swallowed(shapes, pose)).flatten() {
            Some(part) => (part.nearest(pose, search).map(|touch| part.way_out(touch)), true),
            None => (touch, touch.is_some_and(|touch| touch.gap <= 0.0)),
        }
    }

    /// The touch between the nearest points of both shapes, which are apart: from either to and fro to the nearest point of the other
    /// (Cheney and Goldstein 1959, "Proximity maps for convex sets"). φ compares touches where it is a distance, and falls short of that
    /// outside of a grid's box.
    pub fn apart(&self, shapes: [&dyn Shape; 2], pose: &Pose, touch: Touch) -> Touch {
        let (_, other) = self.field_and_other(shapes);
        let mut best: Option<Touch> = None;
        let mut point = touch.point;
        for _ in 0..WAYS_TO_AND_FRO {
            let tolerance = AT_SURFACE * touch.value.abs();
            let field_point = NearestPoint { field: &self.field, start: point, tolerance }.find();
            let way = point - field_point;
            let gap = way.norm();
            if best.is_some_and(|best| gap >= best.gap * (1.0 - SHORTENED)) {
                break;
            }
            let Some(normal) = way.try_normalize(0.0) else { break };
            best = Some(Touch { point, field_point, normal, gap, value: gap, ..touch });
            let there = other.project_local_point(pose.inverse_transform_point(to_parry(field_point)), true);
            if there.is_inside {
                break;
            }
            point = to_core(pose.transform_point(there.point));
        }
        best.unwrap_or(touch)
    }

    /// The touch of a swallowed part that is given the nearest point of the other's surface: it gets out if it moves there until
    /// all of its box has passed.
    fn way_out(&self, touch: Touch) -> Touch {
        // From within, the surface is on the other side of its triangles.
        let touch = Touch { point: touch.point + touch.normal * (2.0 * touch.border), ..touch };
        let bounds = &self.bounds;
        let last = |axis: usize| if touch.normal[axis] > 0.0 { bounds.min[axis] } else { bounds.max[axis] };
        let depth = (touch.point - Vector3::from([0, 1, 2].map(last))).dot(&touch.normal);
        let (field_point, normal) = (touch.point - touch.normal * depth, -touch.normal);
        Touch { field_point, normal, gap: -depth, value: -depth, ..touch }
    }
}

/// The box, in the frame of the other shape, out of which this region of the field does not come until the end; `None` if there is no end.
fn reach(
    region: &Aabb,
    [first, second]: [&NonlinearRigidMotion; 2],
    start: f32,
    end: f32,
    flipped: bool,
) -> Option<ParryAabb> {
    let (field, other) = if flipped { (second, first) } else { (first, second) };
    let region = ParryAabb::new(to_parry(region.min.into()), to_parry(region.max.into()));
    let is_finite = |bounds: &ParryAabb| bounds.mins.is_finite() && bounds.maxs.is_finite();
    if !is_finite(&region) {
        return None;
    }
    let place = |time: f32| {
        let pose = other.position_at_time(time).inv_mul(&field.position_at_time(time));
        region.transform_by(&pose)
    };
    let swept = if field.angvel == Vector::ZERO && other.angvel == Vector::ZERO {
        place(start).merged(&place(end))
    } else {
        // No point of the region is farther from the other's centre than this at the start, nor comes nearer or goes farther than by the
        // speed of the two centres.
        let centre =
            |motion: &NonlinearRigidMotion| motion.position_at_time(start).transform_point(motion.local_center);
        let radius = (region.center() - field.local_center).length() + region.half_extents().length();
        let way = (field.linvel - other.linvel).length() * (end - start);
        let reach = (centre(field) - centre(other)).length() + radius + way;
        ParryAabb::from_half_extents(other.local_center, Vector::splat(reach))
    };
    // Of f32, in all that is above.
    let rounding = 1e-5 * (swept.half_extents().length() + swept.center().length());
    (is_finite(&swept) && rounding.is_finite()).then(|| swept.loosened(rounding))
}

/// Is a point inside of the triangles that stand for a shape? Those of a rounded one are of the shape within.
fn contains_within_triangles(shape: &dyn Shape, point: Vector) -> bool {
    match shape.as_typed_shape() {
        TypedShape::RoundCuboid(round) => round.inner_shape.contains_local_point(point),
        TypedShape::RoundTriangle(round) => round.inner_shape.contains_local_point(point),
        TypedShape::RoundCylinder(round) => round.inner_shape.contains_local_point(point),
        TypedShape::RoundCone(round) => round.inner_shape.contains_local_point(point),
        TypedShape::RoundConvexPolyhedron(round) => round.inner_shape.contains_local_point(point),
        TypedShape::Compound(compound) => {
            let is_in = |(pose, part): &(Pose, SharedShape)| {
                contains_within_triangles(&**part, pose.inverse_transform_point(point))
            };
            compound.shapes().iter().any(is_in)
        }
        _ => shape.contains_local_point(point),
    }
}

fn half_space(shape: &dyn Shape) -> Option<(Arc<AnyField>, Aabb)> {
    let normal = to_core(shape.as_halfspace()?.normal);
    let field = AnyField::from(shapes::HalfSpace::new(normal.into(), 0.0)?);
    let bounds = field.bounds(0.0);
    Some((Arc::new(field), bounds))
}
