use serde::Deserialize;

use crate::Mesh;

/// A box about the origin, each side of two triangles.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Cuboid {
    /// Half of its extents.
    pub half: [f64; 3],
}

impl Cuboid {
    pub fn mesh(&self) -> Mesh {
        let corner = |index: u32| {
            std::array::from_fn(|axis| if index >> axis & 1 == 1 { self.half[axis] } else { -self.half[axis] })
        };
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        Mesh { points: (0..8).map(corner).collect(), triangles, segments: vec![] }
    }
}
