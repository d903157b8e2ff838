//! Bodies and cloths by formula, and repeatable random numbers: what a demonstration, a measurement or a test needs
//! without any file.
//!
//! | file | holds |
//! |---|---|
//! | `serpent` | [`Serpent`]: a long winding body with thin spines |
//! | `cuboid` | [`Cuboid`]: a box |
//! | `spiked_ball` | [`SpikedBall`]: a closed body with thin spikes |
//! | `revolution` | [`Bowl`] and [`Pot`]: solids of revolution, the pot of two shells that intersect |
//! | `sheet` | [`Sheet`]: a cloth or a net that hangs over the origin |
//! | `nut` | [`CrackedNut`]: a hex nut whose faces are not joined along part of two edges |
//! | `rope` | [`Rope`]: strands of line elements |
//! | `random` | [`random::Random`]: the generator SplitMix64 |

#![forbid(unsafe_code)]

pub mod random;

mod cuboid;
mod nut;
mod revolution;
mod rope;
mod serpent;
mod sheet;
mod spiked_ball;

pub use cuboid::Cuboid;
pub use nut::CrackedNut;
pub use revolution::{Bowl, Pot};
pub use rope::Rope;
pub use serpent::Serpent;
pub use sheet::{Holes, Sheet};
pub use spiked_ball::SpikedBall;

/// Points, and the triangles and line segments between them.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    pub points: Vec<[f64; 3]>,
    /// Indices of corners, counterclockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Indices of ends; only of a [`Rope`].
    pub segments: Vec<[u32; 2]>,
}

impl Mesh {
    /// The mesh with each point mapped.
    pub fn transformed(mut self, map: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        self.points.iter_mut().for_each(|point| *point = map(*point));
        self
    }

    /// Appends another mesh. Points that coincide are not merged.
    pub fn append(&mut self, other: &Self) {
        let first = self.points.len() as u32;
        self.points.extend(&other.points);
        self.triangles.extend(other.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
        self.segments.extend(other.segments.iter().map(|ends| ends.map(|end| first + end)));
    }

    /// The mesh without points that no triangle uses. Segments are not renumbered.
    fn without_unused_points(self) -> Self {
        let mut is_used = vec![false; self.points.len()];
        self.triangles.iter().flatten().for_each(|corner| is_used[*corner as usize] = true);
        let mut points = Vec::new();
        let mut new_index = Vec::new();
        for (point, is_used) in self.points.iter().zip(is_used) {
            new_index.push(points.len() as u32);
            points.extend(is_used.then_some(*point));
        }
        let triangles = self.triangles.iter().map(|corners| corners.map(|corner| new_index[corner as usize]));
        Self { triangles: triangles.collect(), points, segments: self.segments }
    }
}
