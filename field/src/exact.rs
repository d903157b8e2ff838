//! Contacts with the mesh that a grid was baked from, not with the grid: distance, normal and surface point of its triangles.
//!
//! 1. The grid tells which elements can be near at all: φ exceeds the distance by no more than its error bound. Its value at
//!    the centroid shows whether that is outside.
//! 2. Where it is outside, the nearest points of element and mesh are those of two triangles: [`MeshSurface::closest`].
//! 3. Where it is inside, or both cross: [`MeshSurface::deepest`]. Of an open mesh, whose sign jumps in its holes, it is hardly bounded
//!    there: it begins at the grid's minimum too, and what it leaves open is counted.

use sdf_bake::{ClosestPoints, DepthLimits, MeshSurface, Probe, SurfacePoint};
use sdf_core::contact::{Contact, ContactStatus, Element, ElementKind, NO_VERTEX};
use sdf_core::minimize::{Certified, Minimizer};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placement, Posed, Rigid};
use sdf_core::{AnyField, EnclosedSdf, Sdf, Simplex};

use crate::MeshView;
use crate::contacts::{CHUNK, Contacts};
use crate::engine::{CullMargins, Query};
use crate::mesh_in_motion::finite_bounds;
use crate::mesh_view::{check, element};
use crate::method::Method;
use crate::options::{ContactOptions, Elements};
use crate::query_error::QueryError;

/// Depths are certified to this fraction of the diagonal of the mesh's box.
const TOLERANCE: f64 = 2e-7;

/// Points measured in the search for the deepest point of one element, at most.
const MAX_EVALUATIONS: u32 = 2048;

/// Evaluations of the search in the grid, where the mesh is open.
const GRID_EVALUATIONS: u32 = 256;

/// Rounding of the grid's value and its error bound, as a fraction of it.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// A grid, and the mesh that it was baked from.
#[derive(Clone, Copy)]
pub(crate) struct ExactField<'a> {
    pub grid: &'a AnyField,
    pub surface: &'a MeshSurface,
}

impl ExactField<'_> {
    /// The contacts of a mesh.
    pub fn find(&self, mesh: MeshView, options: &ContactOptions) -> Result<Contacts, QueryError> {
        match options.elements {
            Elements::Faces => self.find_elements(mesh.points, mesh.faces, options),
            Elements::Edges => self.find_elements(mesh.points, &mesh.edges(), options),
            Elements::Vertices => self.find_elements(mesh.points, &mesh.vertices(), options),
        }
    }

    /// The contacts of elements that are given.
    pub fn find_elements<const N: usize>(
        &self,
        points: &[[f64; 3]],
        elements: &[[u32; N]],
        options: &ContactOptions,
    ) -> Result<Contacts, QueryError> {
        check(points, elements).map_err(QueryError::VertexOutOfRange)?;
        if options.method != Method::Auto || options.all_minima {
            return Err(QueryError::ExactHasItsOwnMethod);
        }
        let ContactOptions { margin, pose, .. } = *options;
        let field = Posed { field: self.grid, pose };
        let error = field.error_bound(&finite_bounds(points));
        // Every point deep inside is below this too, though its value in a sparse grid is coarse.
        let search_margin = error.reach(margin.max(0.0));
        if search_margin == f64::INFINITY {
            return Err(QueryError::ErrorBoundUnknown);
        }
        let search = ExactSearch { grid: self.grid, surface: self.surface, pose, margin, error: error.near };
        let search_chunk = |first: usize, vertices: &[[u32; N]]| {
            let elements: Vec<_> =
                (first..).zip(vertices).map(|(id, vertices)| element(points, id, *vertices)).collect();
            let query = Query {
                field: self.grid,
                pose,
                margins: CullMargins::All(search_margin),
                level: &|_| search_margin,
                elements: &elements,
                lean: false,
            };
            let (mut found, mut guess) = (Contacts::default(), 0);
            for (index, bound) in query.survivors() {
                if bound.is_err() {
                    found.not_finite_count += 1;
                    continue;
                }
                found.searched_count += 1;
                let element = &elements[index];
                let value = field.value(element.simplex.centroid());
                let Some(settled) = search.settle_element(element, value, &mut guess) else { continue };
                match settled.at.distance <= margin {
                    true => found.contacts.push(search.report(element, &settled)),
                    false => found.undecided_count += usize::from(settled.lower_bound <= margin && !settled.is_settled),
                }
            }
            found
        };
        let chunks = options.threads.map_chunks(elements, CHUNK, search_chunk);
        Ok(Contacts::join(elements.len(), chunks, options))
    }
}

/// The search of one element after the other in one mesh.
struct ExactSearch<'a> {
    grid: &'a AnyField,
    surface: &'a MeshSurface,
    pose: Option<Rigid>,
    margin: f64,
    /// The grid's value is off by no more.
    error: f64,
}

/// The point of an element that is nearest to the mesh or deepest in it.
struct Settled {
    weights: [f64; 3],
    at: SurfacePoint,
    lower_bound: f64,
    /// Distance and bound are off by no more.
    error: f64,
    is_settled: bool,
    evaluations: u32,
}

impl ExactSearch<'_> {
    /// The element's lowest point. `value` is the grid's at the centroid. `guess` is a triangle near the last element: it saves time and
    /// changes nothing.
    fn settle_element<const N: usize>(
        &self,
        element: &Element<f64, N>,
        value: f64,
        guess: &mut usize,
    ) -> Option<Settled> {
        let corners = element.simplex.corners.map(|corner| self.pose.map_or(corner, |pose| pose.pull(corner).point));
        // Where the sign jumps away from the triangles, the way to them leads to no inside that the triangle does not touch.
        let by_grid = (!self.surface.is_continuous()).then(|| {
            let minimum = Certified { evaluations: GRID_EVALUATIONS, ..Certified::default() }
                .minimize(self.grid, &Simplex { corners });
            let mut weights = [0.0; 3];
            weights.iter_mut().zip(minimum.weights).for_each(|(weight, own)| *weight = own);
            Probe { weights, at: self.surface.nearest(minimum.point, *guess, None) }
        });
        self.settle(&corners, value, by_grid, guess)
    }

    /// `None` where no point is within the margin; not always then.
    fn settle(
        &self,
        corners: &[Vector3<f64>],
        value: f64,
        by_grid: Option<Probe>,
        guess: &mut usize,
    ) -> Option<Settled> {
        let share = 1.0 / corners.len() as f64;
        let weights = std::array::from_fn(|corner| if corner < corners.len() { share } else { 0.0 });
        let query = corners.iter().sum::<Vector3<f64>>() * share;
        let error = |distance: f64| self.surface.error_bound(corners, distance);
        // Where the grid's error leaves the sign open, the mesh has it.
        let is_outside = value > self.error * (1.0 + ROUNDING);
        let measured = (!is_outside).then(|| {
            let at = self.surface.nearest(query, *guess, None);
            *guess = at.slot;
            Probe { weights, at }
        });
        let mut known: Vec<Probe> = measured.into_iter().chain(by_grid).collect();
        if measured.is_none_or(|start| start.at.distance > 0.0) {
            let is_continuous = self.surface.is_continuous();
            // Where the sign jumps elsewhere, as at holes, a point far from the triangles may be inside.
            let margin = self.margin.max(0.0);
            let limit = if is_continuous { margin + error(margin) } else { f64::INFINITY };
            let closest = self.surface.closest(corners, measured.map(|start| start.at.slot), limit)?;
            // Two edges that cross come within rounding of each other.
            if closest.distance > error(0.0) && is_continuous {
                let ClosestPoints { weights, distance, at } = closest;
                let (lower_bound, error) = (distance.min(at.distance), error(distance));
                return Some(Settled { weights, at, lower_bound, error, is_settled: true, evaluations: 1 });
            }
            let at = self.surface.nearest(closest.at.query, closest.at.slot, measured.as_ref().map(|start| &start.at));
            known.push(Probe { weights: closest.weights, at });
        }
        let limits = DepthLimits {
            tolerance: TOLERANCE * self.surface.bounds().diagonal(),
            least_depth: if self.margin < 0.0 { -self.margin } else { f64::NEG_INFINITY },
            evaluations: MAX_EVALUATIONS,
        };
        let found = self.surface.deepest(corners, &known, limits);
        Some(Settled {
            weights: found.probe.weights,
            at: found.probe.at,
            lower_bound: found.lower_bound,
            error: error(found.probe.at.distance.abs().max(found.lower_bound.abs())),
            is_settled: found.is_settled,
            evaluations: found.evaluations.saturating_add(2),
        })
    }

    fn report<const N: usize>(&self, element: &Element<f64, N>, found: &Settled) -> Contact<f64> {
        let Settled { weights, at, lower_bound, error, is_settled, evaluations } = *found;
        let push = |point: Vector3<f64>| self.pose.map_or(point, |pose| pose.push(point));
        let own: [f64; N] = std::array::from_fn(|corner| weights[corner]);
        let mut vertices = [NO_VERTEX; 3];
        vertices.iter_mut().zip(element.vertices).for_each(|(vertex, known)| *vertex = known);
        let point = element.simplex.corners.iter().zip(own).map(|(corner, weight)| corner * weight).sum();
        let normal = self.surface.normal(&at);
        let normal = self.pose.map_or(normal, |pose| pose.push_vector(normal));
        // No point is deeper in a solid than its box is large, however far out the element's corners are.
        let deepest = if self.surface.is_continuous() { -self.surface.bounds().diagonal() } else { f64::NEG_INFINITY };
        let lower_bound = (lower_bound - error).max(deepest);
        let status = match () {
            () if normal == Vector3::zeros() => ContactStatus::DegenerateGradient,
            () if !is_settled => ContactStatus::BudgetSpent,
            () => ContactStatus::Converged,
        };
        Contact {
            kind: match N {
                1 => ElementKind::Vertex,
                2 => ElementKind::Edge,
                _ => ElementKind::Face,
            },
            element: element.id,
            vertices,
            rank: 0,
            feature: element.feature(own),
            weights,
            point,
            surface_point: push(at.point),
            normal,
            slope: 1.0,
            distance: at.distance,
            lower_bound,
            error_bound: error,
            shape_lower_bound: lower_bound,
            evaluations: evaluations.saturating_add(1),
            status,
        }
    }
}
