//! Cracks and holes of a mesh, closed as far as the caller asks: vertices welded, then boundary loops capped.
//!
//! | step | method | file |
//! |---|---|---|
//! | 1. merge vertices within a distance | connected components of the points within that distance, found by a grid hash | `weld` |
//! | 2. find boundary loops | directed edges with one triangle, joined end to end | `boundary_loops` |
//! | 3. cap loops up to a size | triangulation of minimum area by dynamic programming (Barequet and Sharir 1995) | `cap` |

mod boundary_loops;
mod cap;
mod weld;

use sdf_core::Aabb;

use crate::mesh::topology::orient;
use crate::{InvalidMesh, TriangleMesh};
use boundary_loops::boundary_loops;
use cap::Capping;
use weld::weld_within;

/// Repairs to make before a mesh is baked. Lengths are in the mesh's unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Repairs {
    /// Vertices at most this far from each other, directly or through others, become one.
    pub weld: Option<f64>,
    /// Boundary loops are capped whose bounding box has a diagonal of at most this.
    pub close: Option<f64>,
}

impl Repairs {
    /// The checked mesh, closed. [`TriangleMesh::report`] has the counts.
    ///
    /// A welded vertex takes the position of the vertex with the lowest coordinates among those that it is merged with. So
    /// the result does not depend on the order of points and triangles. Lengths that are not positive change nothing.
    pub fn apply(&self, points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<TriangleMesh, InvalidMesh> {
        let Some(distance) = self.weld.filter(|distance| *distance > 0.0) else {
            return TriangleMesh::new(points, triangles)?.capped(self.close);
        };
        TriangleMesh::check(points, triangles)?;
        let (welded, moved) = weld_within(points, triangles, distance);
        let mut mesh = match TriangleMesh::new(&welded, triangles) {
            // Of a mesh that had no area before, its own error.
            Err(InvalidMesh::NoArea | InvalidMesh::NoExtent { .. }) => {
                TriangleMesh::new(points, triangles)?;
                return Err(InvalidMesh::WeldedAway { distance });
            }
            mesh => mesh?,
        };
        mesh.report.merged_points = moved;
        mesh.report.welded_points -= moved.min(mesh.report.welded_points);
        mesh.capped(self.close)
    }

    /// As the command line has them, such as ` --weld 0.01 --close 2`; empty if there are none.
    pub fn words(&self) -> String {
        let option =
            |name: &str, length: Option<f64>| length.map_or(String::new(), |length| format!(" {name} {length}"));
        option(WELD, self.weld) + &option(CLOSE, self.close)
    }

    /// The repairs among the words of a command line, as [`words`](Self::words) writes them.
    pub fn from_words(words: &str) -> Self {
        let length = |name: &str| {
            let mut words = words.split_whitespace().skip_while(|word| *word != name);
            words.nth(1)?.parse().ok()
        };
        Self { weld: length(WELD), close: length(CLOSE) }
    }
}

const WELD: &str = "--weld";
const CLOSE: &str = "--close";

impl TriangleMesh {
    /// The mesh with all boundary loops capped whose boxes have a diagonal of at most `size`.
    fn capped(self, size: Option<f64>) -> Result<Self, InvalidMesh> {
        let Some(size) = size.filter(|size| *size > 0.0) else { return Ok(self) };
        let loops = boundary_loops(&self, &orient(&self));
        let position = |point: &u32| self.points[*point as usize];
        let (mut caps, mut report) = (vec![], self.report);
        let mut capping = Capping::new();
        for boundary in &loops.closed {
            let corners: Vec<_> = boundary.iter().map(position).collect();
            let diagonal =
                Aabb::from_points(corners.iter().map(|corner| (*corner).into())).map(|around| around.diagonal());
            if diagonal.is_none_or(|diagonal| diagonal > size) {
                report.open_loops += 1;
                continue;
            }
            report.capped_loops += 1;
            caps.extend(capping.triangles(&corners).into_iter().map(|cap| cap.map(|corner| boundary[corner])));
        }
        report.open_loops += loops.unfinished;
        report.cap_triangles = caps.len();
        if caps.is_empty() {
            return Ok(Self { report, ..self });
        }
        let points: Vec<[f64; 3]> = self.points.iter().map(|point| (*point).into()).collect();
        let triangles: Vec<[u32; 3]> = self.triangles.into_iter().chain(self.stitches).chain(caps).collect();
        Ok(Self { report, ..Self::new(&points, &triangles)? })
    }
}

#[cfg(test)]
mod tests;
