//! Boundary loops of an oriented mesh: cycles of edges with one triangle, directed against it, so that a cap has the triangles'
//! orientation.
//!
//! At a vertex where holes touch, several edges go on. The walk takes the one to the lowest vertex, and each time it comes back to a
//! vertex of its own path it has found a loop. So no loop visits a vertex twice.

use std::collections::BTreeMap;

use crate::TriangleMesh;
use crate::mesh::topology::{OrientedMesh, same_edge};

pub(super) struct BoundaryLoops {
    /// The points of each loop, in order.
    pub closed: Vec<Vec<u32>>,
    /// Walks that ended away from their beginning, as where triangles disagree which side is out.
    pub unfinished: usize,
}

pub(super) fn boundary_loops(mesh: &TriangleMesh, oriented: &OrientedMesh) -> BoundaryLoops {
    let mut ends: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for edge in oriented.half_edges.chunk_by(same_edge).filter(|edge| edge.len() == 1) {
        let half = edge[0];
        let triangle = half.triangle as usize;
        let corners = mesh.triangles.get(triangle).unwrap_or_else(|| &mesh.stitches[triangle - mesh.triangles.len()]);
        let [from, to] = [0, 1].map(|step| corners[(usize::from(half.corner) + step) % 3]);
        let [from, to] = if oriented.orientations[triangle] < 0.0 { [from, to] } else { [to, from] };
        ends.entry(from).or_default().push(to);
    }
    // The last is taken first.
    ends.values_mut().for_each(|ends| ends.sort_unstable_by(|a, b| b.cmp(a)));
    let mut loops = BoundaryLoops { closed: vec![], unfinished: 0 };
    while let Some((start, _)) = ends.first_key_value() {
        let mut path = vec![*start];
        let mut place_in_path = BTreeMap::from([(*start, 0)]);
        while let Some(at) = path.last().copied() {
            let Some(next) = take_end(&mut ends, at) else {
                loops.unfinished += usize::from(path.len() > 1);
                break;
            };
            if let Some(place) = place_in_path.get(&next).copied() {
                let found: Vec<u32> = path.drain(place..).collect();
                found.iter().for_each(|point| {
                    place_in_path.remove(point);
                });
                loops.closed.push(found);
            }
            place_in_path.insert(next, path.len());
            path.push(next);
        }
    }
    loops
}

fn take_end(ends: &mut BTreeMap<u32, Vec<u32>>, from: u32) -> Option<u32> {
    let of_point = ends.get_mut(&from)?;
    let to = of_point.pop();
    if of_point.is_empty() {
        ends.remove(&from);
    }
    to
}
