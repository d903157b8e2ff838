//! Triangles that stand for the surface of a shape, and how the true surface lies around them; clusters for surfaces that are
//! queried many times.

use std::sync::Arc;

use parry3d::math::Pose;
use sdf_core::Aabb;
use sdf_core::contact::{CLUSTER_SIZE, ClusterKey, Clusters, cluster_count};
use sdf_core::nalgebra::Vector3;

use crate::convert::{to_core, to_parry};

/// The parts of a surface.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surface {
    pub parts: Vec<Part>,
}

/// Triangles, and how the true surface lies to them.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub points: Vec<[f64; 3]>,
    pub faces: Vec<[u32; 3]>,
    pub rounding: Rounding,
    /// The faces in clusters; empty if they were not made.
    order: Vec<u32>,
    boxes: Vec<Aabb>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rounding {
    /// The triangles are the surface.
    Sharp,
    /// The surface is at this distance outside of the triangles.
    Border(f64),
    /// The triangles are inscribed in a ball of this radius that is swept along a segment.
    Swept { segment: [Vector3<f64>; 2], radius: f64 },
}

impl Surface {
    /// `None` if a face names a vertex that is not there.
    pub fn of_mesh(points: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Option<Self> {
        let is_valid = faces.as_flattened().iter().all(|vertex| (*vertex as usize) < points.len());
        is_valid.then(|| Self { parts: vec![Part::new(points, faces)] })
    }

    /// Sorts the faces into clusters, for a surface that is asked again and again.
    pub fn with_clusters(mut self) -> Self {
        self.parts.iter_mut().for_each(Part::make_clusters);
        self
    }

    /// The same, unless it has clusters already.
    pub fn shared_with_clusters(this: Arc<Self>) -> Arc<Self> {
        let has_clusters = this.parts.iter().all(|part| part.clusters().is_some());
        if has_clusters { this } else { Arc::new(Arc::unwrap_or_clone(this).with_clusters()) }
    }

    /// Radius of a ball that holds the surface, wherever it lies: about the middle of its points' box.
    pub fn radius(&self) -> f64 {
        let points = || self.parts.iter().flat_map(|part| &part.points).map(|point| Vector3::from(*point));
        let low = points().fold(Vector3::repeat(f64::INFINITY), |low, point| low.inf(&point));
        let high = points().fold(Vector3::repeat(f64::NEG_INFINITY), |high, point| high.sup(&point));
        self.radius_about((low + high) / 2.0)
    }

    /// Radius of a ball about a point that holds the surface.
    pub fn radius_about(&self, centre: Vector3<f64>) -> f64 {
        let distances = self.parts.iter().flat_map(|part| {
            let border = part.border();
            part.points.iter().map(move |point| (Vector3::from(*point) - centre).norm() + border)
        });
        distances.fold(0.0, f64::max)
    }
}

impl Part {
    pub fn new(points: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Self {
        Self { points, faces, rounding: Rounding::Sharp, order: vec![], boxes: vec![] }
    }

    /// Triangles that share no vertices, by three corners each.
    pub fn from_corners(corners: Vec<[f64; 3]>) -> Self {
        let faces = (0..corners.len() as u32 / 3).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect();
        Self::new(corners, faces)
    }

    pub fn with_rounding(self, rounding: Rounding) -> Self {
        Self { rounding, ..self }
    }

    /// How far the true surface can be outside of the triangles.
    pub fn border(&self) -> f64 {
        match self.rounding {
            Rounding::Sharp => 0.0,
            Rounding::Border(radius) => radius,
            // Half an angle between vertices, in either direction: 1 − cos²(π/16) and what is lost at poles.
            Rounding::Swept { radius, .. } => 0.05 * radius,
        }
    }

    /// The same at a pose.
    pub fn placed(&self, pose: &Pose) -> Self {
        let place = |point: Vector3<f64>| to_core(pose.transform_point(to_parry(point)));
        let rounding = match self.rounding {
            Rounding::Swept { segment, radius } => Rounding::Swept { segment: segment.map(place), radius },
            other => other,
        };
        let points = self.points.iter().map(|point| place(Vector3::from(*point)).into()).collect();
        Self { rounding, ..Self::new(points, self.faces.clone()) }
    }

    fn make_clusters(&mut self) {
        let count = self.faces.len();
        let (mut order, mut boxes) = (vec![0; count], vec![Aabb::EVERYWHERE; cluster_count(count)]);
        let mut scratch = vec![ClusterKey::default(); count];
        if Clusters::build(&self.points, &self.faces, &mut scratch, &mut order, &mut boxes).is_some() {
            (self.order, self.boxes) = (order, boxes);
        }
    }

    /// Points among which one is about as low as the lowest by `value`: all, or those of the cluster whose middle is lowest.
    pub fn low_points(&self, value: impl Fn(Vector3<f64>) -> f64) -> Vec<Vector3<f64>> {
        let Some(clusters) = self.clusters() else {
            return self.points.iter().copied().map(Vector3::from).collect();
        };
        let values = clusters.boxes().iter().map(|bounds| value(bounds.center().into()));
        let lowest = values.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b)).map_or(0, |(index, _)| index);
        let faces = clusters.order().chunks(CLUSTER_SIZE).nth(lowest).unwrap_or_default();
        let vertices = faces.iter().flat_map(|face| self.faces[*face as usize]);
        vertices.map(|vertex| Vector3::from(self.points[vertex as usize])).collect()
    }

    /// The faces whose clusters meet a box; all of them without clusters.
    pub fn near(&self, region: &Aabb) -> Self {
        let Some(clusters) = self.clusters() else { return self.clone() };
        let meets = |bounds: &Aabb| bounds.intersection(region).is_some();
        let groups = clusters.boxes().iter().zip(clusters.order().chunks(CLUSTER_SIZE));
        let faces = groups.filter(|(bounds, _)| meets(bounds)).flat_map(|(_, faces)| faces);
        let corners = faces.flat_map(|face| self.faces[*face as usize]);
        Self::from_corners(corners.map(|vertex| self.points[vertex as usize]).collect()).with_rounding(self.rounding)
    }

    /// `None` if they were not made.
    pub fn clusters(&self) -> Option<Clusters<'_>> {
        Clusters::from_parts(&self.order, &self.boxes).filter(|clusters| !clusters.order().is_empty())
    }
}
