//! A disc with a thickness around neighbouring triangles.

use sdf_core::nalgebra::Vector3;

use crate::rounding::{MIN_AREA, SINGLE_SLACK};
use crate::triangle::approx::UnitFrame;

/// In the tree's [`UnitFrame`]. A mesh is smooth in the small: a disc is much thinner than a box.
#[derive(Clone, Copy)]
pub(crate) struct BoundingDisc {
    /// A corner of a triangle.
    pub middle: [f32; 3],
    /// Zero where there is none: then the disc is a ball.
    pub normal: [f32; 3],
    /// The most that a point is off the middle across the normal.
    pub radius: f32,
    /// The most that it is along it.
    pub half_thickness: f32,
    /// Whose first corner the middle is, in the order of the tree.
    pub slot: u32,
}

impl BoundingDisc {
    /// Around so many of the triangles, and no more than there are.
    pub fn around(all: &[[Vector3<f64>; 3]], first: usize, count: usize, frame: &UnitFrame) -> Self {
        let triangles = &all[first..all.len().min(first + count)];
        let corners = || triangles.iter().flatten().map(|corner| frame.scaled(*corner));
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        corners().for_each(|corner| (low, high) = (low.inf(&corner), high.sup(&corner)));
        let center = (low + high) * 0.5;
        let off_center = |[a, _, _]: &[Vector3<f64>; 3]| (frame.scaled(*a) - center).norm_squared();
        let nearest =
            (0..triangles.len()).min_by(|i, k| off_center(&triangles[*i]).total_cmp(&off_center(&triangles[*k])));
        let nearest = nearest.unwrap_or_default();
        let middle = frame.scaled(triangles[nearest][0]).map(|x| x as f32);

        let area = |triangle: &[Vector3<f64>; 3]| {
            let [a, b, c] = triangle.map(|corner| frame.scaled(corner));
            (b - a).cross(&(c - a))
        };
        let normal = triangles.iter().map(area).sum::<Vector3<f64>>();
        let normal = normal.try_normalize(MIN_AREA).unwrap_or_default().map(|x| x as f32);
        let (mut radius_sq, mut half_thickness) = (0.0_f64, 0.0_f64);
        for corner in corners() {
            let way = corner - middle.map(f64::from);
            let along = way.dot(&normal.map(f64::from));
            half_thickness = half_thickness.max(along.abs());
            radius_sq = radius_sq.max((way - normal.map(f64::from) * along).norm_squared());
        }
        Self {
            middle: middle.into(),
            normal: normal.into(),
            radius: (radius_sq.sqrt() * (1.0 + SINGLE_SLACK)) as f32,
            half_thickness: (half_thickness * (1.0 + SINGLE_SLACK)) as f32,
            slot: (first + nearest) as u32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{random, random_vector};
    use sdf_core::Aabb;

    #[test]
    fn a_patch_is_around_all_corners_and_its_middle_is_one() {
        let mut state = 13;
        println!("seed {state}");
        for round in 0..5000 {
            let scale = [1.0, 1e-20, 1e20][round % 3];
            let size = [1.0, 1e-3, 1e-7, 0.0][round % 4];
            let at = random_vector(&mut state);
            let corner = |state: &mut u64| (at + random_vector(state) * (size * random(state))) * scale;
            let triangles: Vec<[Vector3<f64>; 3]> =
                (0..11).map(|_| std::array::from_fn(|_| corner(&mut state))).collect();
            let frame = UnitFrame::around(&Aabb { min: [-scale; 3], max: [scale; 3] });
            let bounding_disc = BoundingDisc::around(&triangles, 8, 8, &frame);
            let corner = frame.scaled(triangles[bounding_disc.slot as usize][0]);
            assert!(bounding_disc.slot >= 8 && corner.map(|x| x as f32) == Vector3::from(bounding_disc.middle));
            let normal = Vector3::from(bounding_disc.normal).map(f64::from);
            for corner in triangles[8..].iter().flatten() {
                let way = frame.scaled(*corner) - Vector3::from(bounding_disc.middle).map(f64::from);
                let along = way.dot(&normal);
                assert!(along.abs() <= f64::from(bounding_disc.half_thickness), "{triangles:?}");
                assert!((way - normal * along).norm() <= f64::from(bounding_disc.radius), "{triangles:?}");
            }
        }
    }
}
