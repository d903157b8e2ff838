//! Pieces of a face: how do the triangles that cross it divide it?
//!
//! A crossing triangle meets the face's plane in a segment, one in that plane with its three edges. Each segment is cut at
//! the face's edges and goes down a binary space partition of the face (Fuchs, Kedem and Naylor 1980, "On visible surface
//! generation by a priori tree structures"): a line that separates its ends cuts it in two, and a leaf that it reaches is
//! cut in two by the segment's line. So every leaf is a convex polygon that no segment enters. All decisions are exact
//! (`lines`); a polygon is the list of its edges' lines, its corners are where consecutive ones meet.

use robust::{Coord3D, orient3d};
use sdf_core::nalgebra::Vector3;

use super::lines::{Lines, Side};
use crate::triangle::area_vector;

type Triangle = [Vector3<f64>; 3];

/// Exactly zero for a point in a plane, positive on the side to which the normal (b − a) × (c − a) points.
pub(super) fn side_of([a, b, c]: Triangle, point: Vector3<f64>) -> Side {
    let [a, b, c, point] = [a, b, c, point].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    match orient3d(a, b, c, point) {
        volume if volume < 0.0 => 1,
        volume if volume > 0.0 => -1,
        _ => 0,
    }
}

/// A convex part of a face.
pub(super) struct Piece {
    /// Rounded; in the face's winding.
    pub corners: Vec<Vector3<f64>>,
    /// Planes through its edges, and the side of each on which it lies.
    pub planes: Vec<(Triangle, Side)>,
}

/// The part of a line between two others that cross it.
#[derive(Clone, Copy)]
struct Segment {
    line: usize,
    ends: [usize; 2],
}

/// A polygon, or a line with what lies at its negative and its positive side.
enum Node {
    Leaf(Vec<usize>),
    Split { line: usize, children: [usize; 2] },
}

/// Divides a face by other triangles. The pieces do not overlap, and cover the face.
pub(super) fn pieces(face: Triangle, others: &[Triangle]) -> Vec<Piece> {
    let axis = area_vector(face).iamax();
    let mut planes: Vec<Triangle> = (0..3).map(|edge| upright(face, edge, axis)).collect();
    let mut segments = vec![];
    for other in others {
        push_segments(face, axis, *other, &mut planes, &mut segments);
    }
    let lines = Lines::new(face, planes);
    let inner_sides: [Side; 3] = std::array::from_fn(|edge| lines.side((edge + 1) % 3, (edge + 2) % 3, edge));
    let mut tree = vec![Node::Leaf(vec![0, 1, 2])];
    for segment in segments {
        let within_face = (0..3).try_fold(segment, |segment, edge| part(&lines, segment, edge, inner_sides[edge]));
        if let Some(segment) = within_face {
            insert(&lines, &mut tree, segment);
        }
    }
    let polygon = |node: &Node| match node {
        Node::Leaf(polygon) => Some(piece(&lines, polygon)),
        Node::Split { .. } => None,
    };
    tree.iter().filter_map(polygon).collect()
}

/// The plane through an edge of a triangle and a coordinate axis.
fn upright(triangle: Triangle, edge: usize, axis: usize) -> Triangle {
    let [from, to] = [triangle[edge], triangle[(edge + 1) % 3]];
    let mut above = from;
    // Any other number will do; this one has few bits, and is far enough for all predicates.
    above[axis] = if from[axis] > 0.0 { -1.0 } else { 1.0 } * power_of_two_above(triangle);
    [from, to, above]
}

fn power_of_two_above(triangle: Triangle) -> f64 {
    let max = triangle.iter().map(|corner| corner.amax()).fold(f64::MIN_POSITIVE, f64::max);
    f64::from_bits(max.to_bits() & !((1 << 52) - 1)) * 2.0
}

/// Segments in which a triangle meets a face's plane: one across, three in it, none if only a corner touches it.
fn push_segments(
    face: Triangle,
    axis: usize,
    other: Triangle,
    planes: &mut Vec<Triangle>,
    segments: &mut Vec<Segment>,
) {
    let first = planes.len();
    let sides = other.map(|corner| side_of(face, corner));
    if sides == [0; 3] {
        planes.extend((0..3).map(|edge| upright(other, edge, axis)));
        let edge = |edge: usize| Segment { line: first + edge, ends: [1, 2].map(|step| first + (edge + step) % 3) };
        segments.extend((0..3).map(edge));
        return;
    }
    // An end lies where an edge that is not in the plane meets it. Two such edges can meet it in one corner.
    let ends: Vec<usize> = (0..3)
        .filter(|edge| {
            let [from, to] = [sides[*edge], sides[(edge + 1) % 3]];
            let is_corner_told = to == 0 && sides[(edge + 2) % 3] != 0;
            from != to && from * to <= 0 && !is_corner_told
        })
        .collect();
    if let [start, end] = ends[..] {
        let other_axis = area_vector(other).iamax();
        planes.push(other);
        planes.extend([start, end].map(|edge| upright(other, edge, other_axis)));
        segments.push(Segment { line: first, ends: [first + 1, first + 2] });
    }
}

/// The part of a segment on one side of a line. `None` if it has no length there.
fn part(lines: &Lines, segment: Segment, line: usize, side: Side) -> Option<Segment> {
    let sides = segment.ends.map(|end| lines.side(segment.line, end, line) * side);
    if sides.iter().all(|side| *side <= 0) {
        return None;
    }
    let mut ends = segment.ends;
    ends.iter_mut().zip(sides).filter(|(_, side)| *side < 0).for_each(|(end, _)| *end = line);
    Some(Segment { ends, ..segment })
}

/// Cuts all polygons in two that a segment enters.
fn insert(lines: &Lines, tree: &mut Vec<Node>, segment: Segment) {
    let mut waiting = vec![(0, segment)];
    while let Some((node, segment)) = waiting.pop() {
        match &tree[node] {
            Node::Split { line, children } => {
                for (child, side) in children.iter().zip([-1, 1]) {
                    waiting.extend(part(lines, segment, *line, side).map(|segment| (*child, segment)));
                }
            }
            Node::Leaf(polygon) => {
                let Some(halves) = halves(lines, polygon, segment.line) else { continue };
                let children = [tree.len(), tree.len() + 1];
                tree.extend(halves.map(Node::Leaf));
                tree[node] = Node::Split { line: segment.line, children };
            }
        }
    }
}

/// The parts of a polygon on the negative and the positive side of a line, if it has both.
fn halves(lines: &Lines, polygon: &[usize], line: usize) -> Option<[Vec<usize>; 2]> {
    let next = |edge: usize| polygon[(edge + 1) % polygon.len()];
    // Corner `edge` ends this edge and begins the next.
    let sides: Vec<Side> = (0..polygon.len()).map(|edge| lines.side(polygon[edge], next(edge), line)).collect();
    let half = |side: Side| {
        let mut half = vec![];
        for (edge, own_line) in polygon.iter().enumerate() {
            let [start, end] = [sides[(edge + polygon.len() - 1) % polygon.len()], sides[edge]].map(|s| s * side);
            if start > 0 || end > 0 {
                half.push(*own_line);
            }
            if start > 0 && end <= 0 {
                half.push(line);
            }
        }
        half
    };
    (sides.contains(&-1) && sides.contains(&1)).then(|| [half(-1), half(1)])
}

fn piece(lines: &Lines, polygon: &[usize]) -> Piece {
    let count = polygon.len();
    let at = |edge: usize| polygon[edge % count];
    let corners = (0..count).map(|edge| match [at(edge), at(edge + 1)] {
        // The face's own corners are not computed.
        [0, 1] => lines.face[1],
        [1, 2] => lines.face[2],
        [2, 0] => lines.face[0],
        [p, q] => lines.meeting_point(p, q),
    });
    let plane = |edge: usize| (lines.planes[at(edge)], lines.side(at(edge + 1), at(edge + 2), at(edge)));
    Piece { corners: corners.collect(), planes: (0..count).map(plane).collect() }
}

#[cfg(test)]
mod tests;
