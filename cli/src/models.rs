//! Bodies and cloths made by formula, so that a demo or a measurement needs nothing at hand.

mod rope;
mod sheet;
mod spiked_ball;
mod turned;

pub use rope::Rope;
pub use sheet::Sheet;
pub use spiked_ball::SpikedBall;
pub use turned::{Bowl, Pot};

#[derive(Clone, Debug, Default)]
pub struct Model {
    pub points: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    pub segments: Vec<[u32; 2]>,
}

impl Model {
    pub fn moved(mut self, place: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        self.points.iter_mut().for_each(|point| *point = place(*point));
        self
    }

    /// Adds all of another, shared points or not.
    pub fn join(&mut self, other: &Self) {
        let first = self.points.len() as u32;
        self.points.extend(&other.points);
        self.triangles.extend(other.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
        self.segments.extend(other.segments.iter().map(|ends| ends.map(|end| first + end)));
    }

    /// Of the points only those that a triangle has.
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
