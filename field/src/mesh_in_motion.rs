//! A mesh that is queried frame after frame: [`MeshInMotion`], with what is known of it, and [`MeshClusters`], which cull its faces 16
//! and more at a time. What is left of it is a [`Selection`] of elements.

use sdf_core::contact::{ClusterKey, Clusters, Element, cluster_count, refit};
use sdf_core::nalgebra::Isometry3;
use sdf_core::placed::{Placement, Posed, Rigid};
use sdf_core::{Aabb, AnyField, EnclosedSdf, ErrorBound};

use crate::mesh_view::{MeshView, VertexOutOfRange, check, check_one, element};
use crate::query_error::QueryError;
use crate::{ContactOptions, Field, MarginOutOfReach, Threads};

/// The faces of a mesh in clusters of neighbours: made once for a mesh at rest, fitted again where it is deformed.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshClusters {
    order: Vec<u32>,
    boxes: Vec<Aabb>,
}

impl MeshClusters {
    /// Sorts the faces along a Hilbert curve. Takes about as long as ten queries.
    pub fn new(mesh: MeshView) -> Result<Self, VertexOutOfRange> {
        check(mesh.points, mesh.faces)?;
        let count = mesh.faces.len();
        let (mut order, mut boxes) = (vec![0; count], vec![Aabb::EVERYWHERE; cluster_count(count)]);
        let mut scratch = vec![ClusterKey::default(); count];
        Clusters::build(mesh.points, mesh.faces, &mut scratch, &mut order, &mut boxes)
            .expect("buffers of the mesh's size, and vertices that are there");
        Ok(Self { order, boxes })
    }

    /// Fits the boxes to points that have moved against each other. The faces must be the same.
    pub fn refit(&mut self, mesh: MeshView) -> Result<(), QueryError> {
        check(mesh.points, mesh.faces).map_err(QueryError::VertexOutOfRange)?;
        let is_fitted = refit(mesh.points, mesh.faces, &self.order, &mut self.boxes);
        if is_fitted { Ok(()) } else { Err(QueryError::FaceCountDiffers) }
    }

    /// The clusters as the core takes them.
    pub fn as_core(&self) -> Clusters<'_> {
        Clusters::from_parts(&self.order, &self.boxes).expect("as many boxes as clusters")
    }
}

/// A mesh, and what is known of it beside its points: see [`Field::contacts_in_motion`](crate::Field::contacts_in_motion).
#[derive(Clone, Copy, Debug)]
pub struct MeshInMotion<'a> {
    /// The mesh; of a rigid body, in its own frame.
    pub mesh: MeshView<'a>,
    /// Pose of its frame in the world; `None` where its points are the world's.
    pub pose: Option<Rigid>,
    /// Its clusters, fitted to its points; `None` looks at every face.
    pub clusters: Option<&'a MeshClusters>,
    /// A margin for each face, in place of [`ContactOptions::margin`]: thickness, and how far face and field get until the next
    /// detection.
    pub margins: Option<&'a [f64]>,
}

impl<'a> MeshInMotion<'a> {
    /// A mesh of which nothing more is known.
    pub fn new(mesh: MeshView<'a>) -> Self {
        Self { mesh, pose: None, clusters: None, margins: None }
    }

    /// Refuses margins of single faces at which contacts of the field would be left out or false: see
    /// [`ContactOptions::check_margin`], which is for the one margin of all. Those that are NaN or infinite are refused by the search.
    pub fn check_margins(&self, field: &Field, options: &ContactOptions) -> Result<(), MarginOutOfReach> {
        let margins = self.margins.into_iter().flatten().filter(|margin| margin.is_finite());
        let least = margins.clone().copied().reduce(f64::min);
        let most = margins.copied().reduce(f64::max);
        let mut extremes = least.into_iter().chain(most);
        extremes.try_for_each(|margin| ContactOptions { margin, ..*options }.check_margin(field))
    }
}

/// Rounding of a coordinate that goes through two poses, in units of epsilon and the largest translation: two rotations of some ten
/// operations each, and two sums.
const POSES: f64 = 64.0;

/// The pose of the second frame in the first; `None` if it is not finite.
fn between(first: Option<Rigid>, second: Option<Rigid>) -> Option<Rigid> {
    let isometry = |pose: Option<Rigid>| pose.map_or(Isometry3::identity(), |pose| pose.isometry());
    let relative = isometry(first).inv_mul(&isometry(second));
    let q = relative.rotation.quaternion();
    Rigid::new(relative.translation.vector.into(), [q.i, q.j, q.k, q.w])
}

/// Elements of a mesh to search: all, or those that clusters left.
pub(crate) struct Selection<'a, const N: usize> {
    points: &'a [[f64; 3]],
    elements: &'a [[u32; N]],
    /// The indices of those to search, in ascending order; `None` of all.
    ids: Option<Vec<u32>>,
    pose: Option<Rigid>,
    margins: Option<&'a [f64]>,
}

/// The box around points; those that are not finite do not count.
pub(crate) fn finite_bounds(points: &[[f64; 3]]) -> Aabb {
    let finite = points.iter().filter(|point| point.iter().all(|x| x.is_finite()));
    Aabb::from_points(finite.copied()).unwrap_or(Aabb { min: [0.0; 3], max: [0.0; 3] })
}

impl<'a, const N: usize> Selection<'a, N> {
    pub fn all(points: &'a [[f64; 3]], elements: &'a [[u32; N]]) -> Result<Self, QueryError> {
        check(points, elements).map_err(QueryError::VertexOutOfRange)?;
        Ok(Self { points, elements, ids: None, pose: None, margins: None })
    }

    pub fn element_count(&self) -> usize {
        self.elements.len()
    }

    pub fn margins(&self) -> Option<&'a [f64]> {
        self.margins
    }

    /// The box around all points, in the world; those that are not finite do not count.
    pub fn bounds(&self) -> Aabb {
        let local = finite_bounds(self.points);
        self.pose.map_or(local, |pose| pose.push_bounds(local))
    }

    /// Error of the field around all elements in a complete search, none in others.
    pub fn error_bound(&self, field: &AnyField, options: &ContactOptions) -> ErrorBound {
        let field = Posed { field, pose: options.pose };
        if options.complete { field.error_bound(&self.bounds()) } else { ErrorBound::EXACT }
    }

    /// The farthest that any element must be searched.
    pub fn largest_reach(&self, error: &ErrorBound, options: &ContactOptions) -> f64 {
        let reach = |margin: &f64| error.reach(*margin);
        match self.margins {
            None => reach(&options.margin),
            Some(margins) => margins.iter().map(reach).fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// Runs `search` on chunks of the elements, in their order.
    pub fn map_chunks<T: Send>(
        &self,
        threads: Threads,
        chunk: usize,
        search: impl Fn(Vec<Element<f64, N>>) -> T + Sync,
    ) -> Vec<T> {
        match &self.ids {
            None => threads.map_chunks(self.elements, chunk, |first, vertices: &[[u32; N]]| {
                search((first..).take(vertices.len()).map(|id| self.element(id)).collect())
            }),
            Some(ids) => threads.map_chunks(ids, chunk, |_, ids: &[u32]| {
                search(ids.iter().map(|id| self.element(*id as usize)).collect())
            }),
        }
    }

    fn element(&self, id: usize) -> Element<f64, N> {
        let mut element = element(self.points, id, self.elements[id]);
        if let Some(pose) = &self.pose {
            element.simplex.corners = element.simplex.corners.map(|corner| pose.push(corner));
        }
        element
    }
}

impl<'a> Selection<'a, 3> {
    /// The faces that may come within the margin.
    pub fn near(field: &AnyField, mesh: &MeshInMotion<'a>, options: &ContactOptions) -> Result<Self, QueryError> {
        let MeshInMotion { mesh: MeshView { points, faces }, pose, clusters, margins } = *mesh;
        let differs = clusters.is_some_and(|clusters| clusters.order.len() != faces.len())
            || margins.is_some_and(|margins| margins.len() != faces.len());
        if differs {
            return Err(QueryError::FaceCountDiffers);
        }
        if let Some(face) = margins.into_iter().flatten().position(|margin| !margin.is_finite()) {
            return Err(QueryError::MarginNotFinite(face));
        }
        let selection = Self { points, elements: faces, ids: None, pose, margins };
        let all = || Ok(Self { pose, margins, ..Self::all(points, faces)? });
        let Some(clusters) = clusters else { return all() };
        let relative = match (options.pose, pose) {
            (None, None) => None,
            // Where a place in the field's frame is not finite, clusters tell nothing.
            (field, mesh) => match between(field, mesh) {
                None => return all(),
                relative => relative,
            },
        };
        let reach = selection.largest_reach(&selection.error_bound(field, options), options);
        // Boxes go from the mesh's frame to the field's at once: by way of the world's they would grow twice. Points that go there by
        // way of the world's are off by their rounding.
        let rounded = [pose, options.pose].into_iter().flatten().flat_map(|pose| pose.translation());
        let rounded = rounded.fold(0.0_f64, |largest, x| largest.max(x.abs())) * POSES * f64::EPSILON;
        let margin = reach + rounded * sdf_core::Sdf::slope_bound(field);
        let mut ids = vec![];
        clusters.as_core().visit_near(field, margin, relative.as_ref(), |members| ids.extend_from_slice(members));
        ids.sort_unstable();
        // The others are not looked at.
        for id in &ids {
            check_one(points, *id as usize, &faces[*id as usize]).map_err(QueryError::VertexOutOfRange)?;
        }
        Ok(Self { ids: Some(ids), ..selection })
    }
}
