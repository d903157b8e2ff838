//! Which triangles does a segment or a ray cross, and how does the winding number change along it?

use std::ops::ControlFlow;

use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;

use super::{edge_volumes, side_of_plane};
use crate::bvh::Bvh;

/// Change of the winding number along a segment, by the triangles that it crosses. `None` if it touches the edge of a
/// triangle or an end lies in the plane of one. Also `None` if more than 256 boxes meet the segment's: evaluating the
/// winding number costs less.
pub(crate) fn winding_change(tree: &Bvh, orientations: &[f64], [from, to]: [Vector3<f64>; 2]) -> Option<f64> {
    const MAX_TRIANGLES: usize = 256;
    let (mut change, mut triangles) = (Some(0.0), 0);
    tree.visit_overlapping(from.inf(&to), from.sup(&to), |slot| {
        triangles += 1;
        let crossing = if orientations[slot] == 0.0 { Some(0.0) } else { crossing([from, to], tree.corners[slot]) };
        let crossing = crossing.filter(|_| triangles <= MAX_TRIANGLES);
        change = change.zip(crossing).map(|(change, crossing)| change + crossing * orientations[slot]);
        if change.is_none() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    change
}

/// Directions of rays that are tried where one touches an edge.
pub(in crate::mesh) const RAYS: usize = 12;

/// End of a ray from a point, out of a box. It has no simple ratio of coordinates, which are fractional parts of multiples of roots.
pub(in crate::mesh) fn ray_end(from: Vector3<f64>, bounds: &Aabb, ray: usize) -> Vector3<f64> {
    let direction = Vector3::from([2.0_f64, 3.0, 5.0].map(|n| ((ray + 1) as f64 * n.sqrt()).fract() - 0.5));
    let to_box = (from - Vector3::from(bounds.min)).norm();
    from + direction.normalize() * (2.0 * bounds.diagonal().max(to_box))
}

/// Winding number at a point, by the triangles that a ray crosses, where all winding numbers are whole. `orientation` is that of the
/// triangle of a slot. `None` if each ray touches an edge.
pub(crate) fn whole_winding_number(
    tree: &Bvh,
    from: Vector3<f64>,
    bounds: &Aabb,
    orientation: impl Fn(usize) -> f64,
) -> Option<i32> {
    let is_counted = |slot| orientation(slot) != 0.0;
    (0..RAYS).find_map(|ray| winding_along(tree, from, ray_end(from, bounds, ray), is_counted, &orientation))
}

/// Winding number at a point, by one ray to an end outside of the mesh. `None` if it touches an edge.
pub(in crate::mesh) fn winding_along(
    tree: &Bvh,
    from: Vector3<f64>,
    end: Vector3<f64>,
    is_counted: impl FnMut(usize) -> bool,
    orientation: impl Fn(usize) -> f64,
) -> Option<i32> {
    let crossings = ray_crossings(tree, [from, end], is_counted)?;
    Some(crossings.iter().map(|(slot, crossing)| -(crossing * orientation(*slot)) as i32).sum())
}

/// Slots of the counted triangles that a segment crosses, each with 1 if it does so from the front, −1 from the back. `None` if the segment
/// touches an edge, or an end of it lies in a triangle's plane.
pub(in crate::mesh) fn ray_crossings(
    tree: &Bvh,
    segment: [Vector3<f64>; 2],
    mut is_counted: impl FnMut(usize) -> bool,
) -> Option<Vec<(usize, f64)>> {
    let mut crossings = Some(vec![]);
    tree.visit_along(segment, |slot| {
        if is_counted(slot) {
            match crossing(segment, tree.corners[slot]) {
                Some(0.0) => {}
                Some(crossing) => crossings.iter_mut().for_each(|crossings| crossings.push((slot, crossing))),
                None => crossings = None,
            }
        }
        if crossings.is_none() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    crossings
}

/// 1 if the segment crosses a triangle from its front, −1 from its back, 0 if not; `None` if it touches an edge or the
/// plane.
pub(in crate::mesh) fn crossing(segment: [Vector3<f64>; 2], triangle: [Vector3<f64>; 3]) -> Option<f64> {
    let [from_side, to_side] = segment.map(|point| side_of_plane(triangle, point));
    if (from_side > 0.0 && to_side > 0.0) || (from_side < 0.0 && to_side < 0.0) {
        return Some(0.0);
    }
    let volumes = edge_volumes(segment, triangle);
    if volumes.iter().any(|volume| *volume > 0.0) && volumes.iter().any(|volume| *volume < 0.0) {
        return Some(0.0);
    }
    let is_clear = from_side != 0.0 && to_side != 0.0 && volumes.iter().all(|volume| *volume != 0.0);
    is_clear.then_some(if to_side > 0.0 { 1.0 } else { -1.0 })
}
