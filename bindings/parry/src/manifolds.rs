//! Touches as contact manifolds: grouped by normal, at most four points each, with the impulses of the last step.
//!
//! | step | rule |
//! |---|---|
//! | group | the deepest first; a touch joins the first group whose normal is within 5°. Groups of the last step come first, so that none is torn |
//! | reduce | the deepest point, the farthest from it, then the farthest on either side of the line between; one that is less deep counts as nearer |
//! | keep | a point takes the data of the last step's point on the same feature, else of the nearest within the prediction that is left |
//!
//! Of points that are equally deep, corners come first and faces last: on a plane all of a face is equally deep, and its corners stay.

use parry3d::math::{Pose, Vector};
use parry3d::query::{ContactManifold, TrackedContact};
use parry3d::shape::PackedFeatureId;
use sdf_core::nalgebra::Vector3;

use crate::convert::{to_core, to_parry};
use crate::touch::Touch;

/// Cosine of the angle within which normals are one: 5.1°, as in rapier's own clusters.
const SAME_NORMAL: f64 = 0.996;

/// Handicap of edges over corners, and of faces over edges, in the choice of points: a fraction of the prediction.
const HANDICAP: f64 = 0.01;

/// How much nearer a point counts for each length by which it is less deep: a body that rests on two points turns about the deepest by 1/8
/// before it reaches one that is an eighth of their distance higher.
const HIGHER_IS_NEARER: f64 = 8.0;

/// Replaces manifolds by those of the touches. `pose` takes the surface into the field's frame; `flipped` says that the field is
/// the second shape.
pub(crate) fn update<M: Default, C: Default + Copy>(
    manifolds: &mut Vec<ContactManifold<M, C>>,
    mut touches: Vec<Touch>,
    pose: &Pose,
    flipped: bool,
    prediction: f64,
) {
    touches.sort_unstable_by(|a, b| rank(a, prediction).total_cmp(&rank(b, prediction)));
    let old = manifolds.iter().map(|manifold| if flipped { manifold.local_n2 } else { manifold.local_n1 });
    let mut groups: Vec<Group> = old.map(|normal| Group { normal: to_core(normal), touches: vec![] }).collect();
    for touch in touches {
        match groups.iter_mut().find(|group| group.normal.dot(&touch.normal) >= SAME_NORMAL) {
            Some(group) => group.touches.push(touch),
            None => groups.push(Group { normal: touch.normal, touches: vec![touch] }),
        }
    }
    manifolds.resize_with(groups.len(), ContactManifold::new);
    for (manifold, group) in manifolds.iter_mut().zip(groups) {
        let last = std::mem::take(&mut manifold.points);
        group.fill(manifold, pose, flipped);
        keep_data(&mut manifold.points, last, flipped, prediction as f32);
    }
    manifolds.retain(|manifold| !manifold.points.is_empty());
}

/// Depth, with the handicap.
fn rank(touch: &Touch, prediction: f64) -> f64 {
    let steps = match () {
        () if touch.feature.is_vertex() => 0.0,
        () if touch.feature.is_edge() => 1.0,
        () => 2.0,
    };
    touch.gap + steps * HANDICAP * prediction
}

/// Touches with about the same normal, the deepest first.
struct Group {
    normal: Vector3<f64>,
    touches: Vec<Touch>,
}

impl Group {
    fn fill<M, C: Default + Copy>(self, manifold: &mut ContactManifold<M, C>, pose: &Pose, flipped: bool) {
        let kept = reduce(&self.touches);
        let mean = kept.iter().map(|touch| touch.normal).sum::<Vector3<f64>>();
        let normal = to_parry(mean.try_normalize(0.5).unwrap_or(self.normal));
        let other_normal = pose.rotation.inverse() * -normal;
        (manifold.local_n1, manifold.local_n2) = if flipped { (other_normal, normal) } else { (normal, other_normal) };
        manifold.points.extend(kept.iter().map(|touch| {
            let (on_field, on_other) = (to_parry(touch.field_point), to_parry(touch.point));
            let on_other = pose.inverse_transform_point(on_other);
            let (none, feature) = (PackedFeatureId::UNKNOWN, touch.feature);
            TrackedContact::flipped(on_field, on_other, none, feature, touch.gap as f32, flipped)
        }));
    }
}

/// At most four touches that hold a body as all of them do.
fn reduce(touches: &[Touch]) -> Vec<Touch> {
    let [deepest, rest @ ..] = touches else { return vec![] };
    if touches.len() <= 4 {
        return touches.to_vec();
    }
    let higher = |touch: &Touch| HIGHER_IS_NEARER * (touch.gap - deepest.gap);
    let from_deepest = |touch: &Touch| (touch.point - deepest.point).norm() - higher(touch);
    let Some(farthest) = first_max(rest, from_deepest) else { return vec![*deepest] };
    let across = (farthest.point - deepest.point).cross(&deepest.normal);
    let Some(across) = across.try_normalize(0.0) else { return vec![*deepest, farthest] };
    let side = |touch: &Touch| (touch.point - deepest.point).dot(&across);
    // Points on the line between the two add nothing.
    let least = 1e-3 * (farthest.point - deepest.point).norm();
    let left = first_max(rest, |touch| side(touch) - higher(touch)).filter(|touch| side(touch) > least);
    let right = first_max(rest, |touch| -side(touch) - higher(touch)).filter(|touch| side(touch) < -least);
    [Some(*deepest), Some(farthest), left, right].into_iter().flatten().collect()
}

/// The first touch with the largest score, but for rounding.
fn first_max(touches: &[Touch], score: impl Fn(&Touch) -> f64) -> Option<Touch> {
    let largest = touches.iter().map(&score).fold(f64::NEG_INFINITY, f64::max);
    touches.iter().find(|touch| score(touch) >= largest - 1e-6 * largest.abs()).copied()
}

/// Gives points the data of those of the last step that they go on from, each of which goes on once: on the same feature, else near by.
fn keep_data<C: Copy>(
    points: &mut [TrackedContact<C>],
    mut last: Vec<TrackedContact<C>>,
    flipped: bool,
    prediction: f32,
) {
    let mut others = vec![];
    for point in points {
        match last.iter().position(|known| (known.fid1, known.fid2) == (point.fid1, point.fid2)) {
            Some(index) => point.data = last.swap_remove(index).data,
            None => others.push(point),
        }
    }
    let on_field =
        |contact: &TrackedContact<C>| -> Vector { if flipped { contact.local_p2 } else { contact.local_p1 } };
    for point in others {
        let distance_sq = |known: &TrackedContact<C>| (on_field(known) - on_field(point)).length_squared();
        let nearest = (0..last.len()).min_by(|a, b| distance_sq(&last[*a]).total_cmp(&distance_sq(&last[*b])));
        if let Some(index) = nearest.filter(|index| distance_sq(&last[*index]) < prediction * prediction) {
            point.data = last.swap_remove(index).data;
        }
    }
}
