//! Triangles that stand for the surface of a shape, and how the true surface lies around them; clusters for surfaces that are
//! queried many times.

use std::sync::Arc;

use parry3d::math::Pose;
use sdf_core::Aabb;
use sdf_core::contact::{ClusterKey, Clusters, cluster_count};
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

    /// The widest border around triangles.
    pub fn widest_border(&self) -> f64 {
        let border = |part: &Part| if let Rounding::Border(radius) = part.rounding { radius } else { 0.0 };
        self.parts.iter().map(border).fold(0.0, f64::max)
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

    /// `None` if they were not made.
    pub fn clusters(&self) -> Option<Clusters<'_>> {
        Clusters::from_parts(&self.order, &self.boxes).filter(|clusters| !clusters.order().is_empty())
    }
}
