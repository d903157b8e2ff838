//! Discs around the triangles of tree nodes: a center, a normal, a radius across it and a half thickness along it.
//!
//! The normal is that of the sum of the triangles' area vectors. A mesh is smooth in the small, so a disc is much
//! thinner than a box.

use sdf_core::nalgebra::Vector3;

use crate::rounding::{MIN_AREA, SINGLE_SLACK};
use crate::triangle::approx::UnitFrame;

/// Disc around the triangles of a node, in the tree's [`UnitFrame`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BoundingDisc {
    /// First corner of a triangle.
    pub center: [f32; 3],
    /// Zero if the triangles have none: then the disc is a ball.
    pub normal: [f32; 3],
    /// Largest distance of a point from the center across the normal.
    pub radius: f32,
    /// Largest distance of a point from the center along the normal.
    pub half_thickness: f32,
    /// Slot of the triangle at the center.
    pub slot: u32,
}

impl BoundingDisc {
    /// Disc around `count` triangles from `first` on, or as many as there are.
    pub fn enclosing(all: &[[Vector3<f64>; 3]], first: usize, count: usize, frame: &UnitFrame) -> Self {
        let triangles = &all[first..all.len().min(first + count)];
        let corners = || triangles.iter().flatten().map(|corner| frame.unit_from_mesh(*corner));
        let (mut min, mut max) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        corners().for_each(|corner| (min, max) = (min.inf(&corner), max.sup(&corner)));
        let box_center = (min + max) * 0.5;
        let off_center_sq = |[a, _, _]: &[Vector3<f64>; 3]| (frame.unit_from_mesh(*a) - box_center).norm_squared();
        let central = (0..triangles.len())
            .min_by(|i, k| off_center_sq(&triangles[*i]).total_cmp(&off_center_sq(&triangles[*k])))
            .unwrap_or_default();
        let center = frame.unit_from_mesh(triangles[central][0]).map(|x| x as f32);

        let doubled_area = |triangle: &[Vector3<f64>; 3]| {
            let [a, b, c] = triangle.map(|corner| frame.unit_from_mesh(corner));
            (b - a).cross(&(c - a))
        };
        let normal = triangles.iter().map(doubled_area).sum::<Vector3<f64>>();
        let normal = normal.try_normalize(MIN_AREA).unwrap_or_default().map(|x| x as f32);
        let (mut radius_sq, mut half_thickness) = (0.0_f64, 0.0_f64);
        for corner in corners() {
            let offset = corner - center.map(f64::from);
            let along = offset.dot(&normal.map(f64::from));
            half_thickness = half_thickness.max(along.abs());
            radius_sq = radius_sq.max((offset - normal.map(f64::from) * along).norm_squared());
        }
        Self {
            center: center.into(),
            normal: normal.into(),
            radius: (radius_sq.sqrt() * (1.0 + SINGLE_SLACK)) as f32,
            half_thickness: (half_thickness * (1.0 + SINGLE_SLACK)) as f32,
            slot: (first + central) as u32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{random, random_vector};
    use sdf_core::Aabb;

    #[test]
    fn a_disc_is_around_all_corners_and_its_center_is_one() {
        let mut state = 13;
        println!("seed {state}");
        for round in 0..5000 {
            let scale = [1.0, 1e-20, 1e20][round % 3];
            let size = [1.0, 1e-3, 1e-7, 0.0][round % 4];
            let at = random_vector(&mut state);
            let corner = |state: &mut u64| (at + random_vector(state) * (size * random(state))) * scale;
            let triangles: Vec<[Vector3<f64>; 3]> =
                (0..11).map(|_| std::array::from_fn(|_| corner(&mut state))).collect();
            let frame = UnitFrame::enclosing(&Aabb { min: [-scale; 3], max: [scale; 3] });
            let disc = BoundingDisc::enclosing(&triangles, 8, 8, &frame);
            let corner = frame.unit_from_mesh(triangles[disc.slot as usize][0]);
            assert!(disc.slot >= 8 && corner.map(|x| x as f32) == Vector3::from(disc.center));
            let normal = Vector3::from(disc.normal).map(f64::from);
            for corner in triangles[8..].iter().flatten() {
                let offset = frame.unit_from_mesh(*corner) - Vector3::from(disc.center).map(f64::from);
                let along = offset.dot(&normal);
                assert!(along.abs() <= f64::from(disc.half_thickness), "{triangles:?}");
                assert!((offset - normal * along).norm() <= f64::from(disc.radius), "{triangles:?}");
            }
        }
    }
}
