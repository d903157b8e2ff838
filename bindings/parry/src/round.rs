//! Touches of a ball that is swept along a segment: a ball or a capsule.
//!
//! | step | touches |
//! |---|---|
//! | 1 | from the triangles within the margin downhill on the round surface, by projected gradient descent: all places where it rests |
//! | 2 | of the balls about the point of the segment where φ is least ([`Certified`]), and about its ends |
//!
//! A ball about c touches at the point q of the field's surface that is nearest to c, and is |φ(c)| − r away where φ is a distance: then the
//! step φ(c) along ∇φ(c) ends on the surface, and no point of it is nearer. Where it does not end there, as outside of a grid's box,
//! q is searched. A way downhill can stop at an edge of the field, and ∇φ says little there: then the ball about c takes its place.

use sdf_core::contact::{Contact, Feature};
use sdf_core::minimize::{Certified, Minimizer};
use sdf_core::nalgebra::Vector3;
use sdf_core::{AnyField, Sdf, Simplex};

use crate::nearest::NearestPoint;
use crate::touch::{Query, Touch};

/// Steps of a point on a round surface, and the shortest of them in radii.
const STEPS: u32 = 48;
const SHORTEST_STEP: f64 = 1e-6;

/// Points on a round surface that are nearer than this, in radii, are one.
const SAME_POINT: f64 = 0.15;

/// A point is on the field's surface within this fraction of radius and distance.
const AT_SURFACE: f64 = 1e-6;

/// Ways between the segment and the field's surface, in search of the nearest points.
const WAYS_TO_AND_FRO: u32 = 8;

/// A touch downhill stays where the ball about the segment has the same gap up to this, in radii: where both are one but for the error of
/// a grid, the normal stays the mean of a cap from step to step.
const SAME_GAP: f64 = 1e-3;

/// Depth of the cap whose mean is the normal of a round surface, in radii, and points along either side of it.
const CAP_DEPTH: f64 = 0.004;
const CAP_POINTS: i32 = 4;

/// A ball swept along a segment, in the field's frame.
pub(crate) struct RoundSurface<'a> {
    pub query: &'a Query<'a>,
    pub segment: [Vector3<f64>; 2],
    pub radius: f64,
}

impl RoundSurface<'_> {
    /// `near`: the lowest points of the triangles that stand for it.
    pub fn touches<M: Minimizer<1>>(&self, method: &M, mut near: Vec<Contact<f64>>) -> Vec<Touch> {
        near.sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance));
        let mut found: Vec<Touch> = vec![];
        for start in near {
            let lowest = self.descend(start.point);
            let touch = self.query.point(method, start.element, lowest, self.query.margin);
            let touch = touch.filter(|_| !found.iter().any(|known| self.is_same_point(known.point, lowest)));
            let touch = touch.and_then(|contact| self.query.touch(&contact, 0.0));
            found.extend(touch.map(|touch| self.on_cap(touch)));
        }
        let Some((lowest, is_exact)) = self.lowest_touch() else { return found };
        if !self.is_freed_by(&lowest) {
            return vec![self.way_out(lowest)];
        }
        let ends = if self.is_ball() { vec![] } else { self.segment.into_iter().zip(1..).collect() };
        let ends = ends.into_iter().filter_map(|(end, number)| self.touch_of_ball(end, number));
        let ends: Vec<_> = ends.filter(|(touch, _)| self.is_at_end(touch) && !self.are_one(touch, &lowest)).collect();
        for (touch, is_exact) in ends.into_iter().chain([(lowest, is_exact)]) {
            let tolerance = if is_exact { 0.0 } else { SAME_GAP * self.radius };
            // A field that is no distance can be lower, outside.
            let is_good = |known: &Touch| {
                known.gap <= touch.gap + tolerance
                    && (known.gap >= touch.gap - tolerance || known.gap > 0.0 && !is_exact)
            };
            let is_near = touch.value <= self.query.margin;
            if is_near && !found.iter().any(|known| self.are_one(known, &touch) && is_good(known)) {
                found.retain(|known| !self.are_one(known, &touch));
                found.push(touch);
            }
        }
        found
    }

    fn is_ball(&self) -> bool {
        self.segment[0] == self.segment[1]
    }

    fn are_one(&self, a: &Touch, b: &Touch) -> bool {
        self.is_same_point(a.point, b.point)
    }

    fn is_same_point(&self, a: Vector3<f64>, b: Vector3<f64>) -> bool {
        (a - b).norm() < SAME_POINT * self.radius
    }

    /// The touch of the ball about the point of the segment where φ is least, or from there to and fro between segment and surface, where
    /// φ is not a distance.
    fn lowest_touch(&self) -> Option<(Touch, bool)> {
        let [a, b] = self.segment;
        if self.is_ball() {
            return self.touch_of_ball(a, 0);
        }
        let lowest = Certified::default().minimize(self.query.field, &Simplex { corners: [a, b] });
        let mut best = self.touch_of_ball(lowest.point, 0)?;
        for _ in 0..WAYS_TO_AND_FRO {
            match self.touch_of_ball(axis_point(best.0.field_point, self.segment), 0) {
                Some(next) if next.0.gap < best.0.gap => best = next,
                _ => break,
            }
        }
        Some(best)
    }

    /// Is the point of a touch at an end on the surface, up to 15°? The rest of the capsule hides points that face the other end.
    fn is_at_end(&self, touch: &Touch) -> bool {
        let out = (touch.point - axis_point(touch.point, self.segment)) / self.radius;
        out.dot(&touch.normal) < -0.966
    }

    /// Is the surface out of the field once it has moved by the depth of its lowest ball? Only asked where the segment itself enters the
    /// field.
    fn is_freed_by(&self, lowest: &Touch) -> bool {
        if self.is_ball() || lowest.gap > -self.radius {
            return true;
        }
        let moved = Simplex { corners: self.segment.map(|end| end - lowest.normal * lowest.gap) };
        let moved = Certified::default().minimize(self.query.field, &moved);
        self.touch_of_ball(moved.point, 0).is_none_or(|(touch, _)| touch.gap >= -SAME_GAP * self.radius)
    }

    /// The shortest way out of the field's box, along the segment or at right angles to it, for a segment that pierces the field.
    fn way_out(&self, touch: Touch) -> Touch {
        let (bounds, [a, b]) = (self.query.bounds, self.segment);
        let axis = (b - a).normalize();
        let across = (0..3).map(|k| Vector3::ith(k, 1.0)).filter_map(|x| (x - axis * axis.dot(&x)).try_normalize(1e-3));
        let ways = across.chain([axis]).flat_map(|way| [way, -way]).map(|way| {
            let farthest = |k: usize| if way[k] > 0.0 { bounds.max[k] } else { bounds.min[k] };
            let lowest = if a.dot(&way) < b.dot(&way) { a } else { b } - way * self.radius;
            let depth = (Vector3::from([0, 1, 2].map(farthest)) - lowest).dot(&way);
            (way, lowest, depth)
        });
        let shortest = ways.min_by(|(.., a), (.., b)| a.total_cmp(b));
        let Some((normal, point, depth)) = shortest else { return touch };
        Touch { point, field_point: point + normal * depth, normal, gap: -depth, value: -depth, ..touch }
    }

    /// The touch of a ball about a point, and is it proven to be that of the nearest point of the field? `None` if it is proven to be
    /// beyond the margin.
    fn touch_of_ball(&self, centre: Vector3<f64>, number: u32) -> Option<(Touch, bool)> {
        let (field, radius) = (self.query.field, self.radius);
        let value = field.sample(centre).value;
        let slope_bound = field.slope_bound();
        // Not so of NaN.
        let may_touch = value - slope_bound * radius <= self.query.margin;
        if !may_touch {
            return None;
        }
        let tolerance = AT_SURFACE * (radius + value.abs());
        let step = centre - direction(field, centre) * value;
        let is_distance = field.sample(step).value.abs() <= tolerance;
        let nearest = if is_distance { step } else { NearestPoint { field, start: centre, tolerance }.find() };
        let side = if value < 0.0 { -1.0 } else { 1.0 };
        let way = (centre - nearest) * side;
        let normal = way.try_normalize(tolerance).unwrap_or_else(|| direction(field, nearest));
        let gap = way.norm() * side - radius;
        // A field less steep than a distance is no higher than this.
        let value = if gap > 0.0 { gap * slope_bound.min(1.0) } else { gap };
        let feature = self.query.feature(Feature::Vertex(u32::MAX - number));
        let point = centre - normal * radius;
        let touch = Touch { point, field_point: nearest, normal, gap, value, is_measured: false, border: 0.0, feature };
        Some((touch, is_distance))
    }

    /// The touch with the mean normal of the cap around it. The lowest point of a ball jumps where a grid has a crease between two cells;
    /// the mean over its neighbourhood, by weights that fall as φ rises, does not. A touch from within, of a field inside of the ball,
    /// stays as it is.
    fn on_cap(&self, touch: Touch) -> Touch {
        let (axis, radius, field) = (axis_point(touch.point, self.segment), self.radius, self.query.field);
        let out = (touch.point - axis) / radius;
        if out.dot(&touch.normal) > 0.0 {
            return touch;
        }
        let [u, v] = tangents(out);
        let depth = CAP_DEPTH * radius;
        // φ rises by 4 depths to the cap's rim, where the field is flat.
        let step = (8.0 * CAP_DEPTH).sqrt() / f64::from(CAP_POINTS);
        let steps = || (-CAP_POINTS..=CAP_POINTS).map(|index| f64::from(index) * step);
        let mut mean = Vector3::zeros();
        for (i, j) in steps().flat_map(|i| steps().map(move |j| (i, j))) {
            let direction = (out + u * i + v * j).normalize();
            let rise = field.sample(axis + direction * radius).value - touch.value;
            mean += direction * (-rise / depth).exp();
        }
        let Some(mean) = mean.try_normalize(1e-6) else { return touch };
        let point = axis + mean * radius;
        Touch { point, field_point: point + mean * touch.gap, normal: -mean, ..touch }
    }

    /// A local minimum of φ on the surface: x ← the surface point nearest to x − s ∇φ/|∇φ|, with steps s of the radius at first, shorter
    /// where φ did not fall, and longer again where it did.
    fn descend(&self, start: Vector3<f64>) -> Vector3<f64> {
        let (field, radius) = (self.query.field, self.radius);
        let mut at = self.on_surface(start).unwrap_or(start);
        let mut sample = field.sample(at);
        let mut step = radius;
        for _ in 0..STEPS {
            let slope = sample.gradient.norm();
            if slope < 1e-6 || step < SHORTEST_STEP * radius {
                break;
            }
            let Some(next) = self.on_surface(at - sample.gradient * (step / slope)) else { break };
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

    /// The point of the surface that is nearest to a point; `None` on the segment.
    fn on_surface(&self, point: Vector3<f64>) -> Option<Vector3<f64>> {
        let axis = axis_point(point, self.segment);
        let out = (point - axis).try_normalize(1e-12)?;
        Some(axis + out * self.radius)
    }
}

/// ∇φ/|∇φ|; any direction where it is zero.
fn direction(field: &AnyField, point: Vector3<f64>) -> Vector3<f64> {
    field.sample(point).gradient.try_normalize(1e-6).unwrap_or(Vector3::x())
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
