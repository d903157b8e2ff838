//! In which order is a mesh kept? Triangles in the order of the tree, vertices in the order in which those use them: neighbours stand
//! together, so that both compress well, and the tree is built again without a sort.

use crate::TriangleMesh;
use crate::bvh::Bvh;

/// Stands for a vertex that has no place yet.
const UNPLACED: u32 = u32::MAX;

impl TriangleMesh {
    /// Vertices and triangles, triangles without area last: [`TriangleMesh::new`] makes the same mesh of them, and then
    /// [`without_inner_faces`](Self::without_inner_faces) the same surface, up to its rounding.
    pub fn packed(&self) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        self.mesh_of_signs().packed_as_it_is()
    }

    fn packed_as_it_is(&self) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        let order = Bvh::order(self);
        let mut place = vec![UNPLACED; self.points.len()];
        let mut points: Vec<[f64; 3]> = vec![];
        let ordered = order.iter().map(|triangle| &self.triangles[*triangle as usize]);
        let triangles = ordered.chain(&self.stitches).map(|corners| {
            corners.map(|corner| {
                let place = &mut place[corner as usize];
                if *place == UNPLACED {
                    *place = points.len() as u32;
                    points.push(self.points[corner as usize].into());
                }
                *place
            })
        });
        let triangles = triangles.collect();
        (points, triangles)
    }
}
