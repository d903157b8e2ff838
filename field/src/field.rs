//! How does a program hold a field? As [`Field`]: any grid or closed form, with what is known of a baked grid.

use std::sync::{Arc, OnceLock};

use sdf_core::grid::owned::OwnedGrid;
use sdf_core::{Aabb, AnyField, Sample, Sdf, Status};

use crate::contacts::{self, Contacts};
use crate::engine::map_points;
#[cfg(feature = "bake")]
use crate::exact::ExactField;
use crate::info::GridInfo;
use crate::kept_mesh::KeptMesh;
use crate::not_finite::is_valid;
use crate::query_error::QueryError;
use crate::reach::{Boxes, Reach};
use crate::{ContactOptions, MeshInMotion, MeshView, Threads};

/// A signed distance field: a grid or any closed form. Negative inside, in the unit of its points.
///
/// A clone shares the samples.
///
/// ```
/// use sdf_field::{ContactOptions, Field, MeshView, core::shapes::Cone};
/// // The cone's apex pokes through the middle of a triangle whose corners lie outside.
/// let field = Field::new(Cone::new(0.2, 1.0).unwrap());
/// let points = [[-1.0, -1.0, -0.1], [1.0, -1.0, -0.1], [0.0, 1.0, -0.1]];
/// let mesh = MeshView { points: &points, faces: &[[0, 1, 2]] };
/// let found = field.contacts(mesh, &ContactOptions::default()).unwrap();
/// assert!((found.contacts[0].distance + 0.1 * 0.2_f64.sin()).abs() < 1e-3);
/// assert!(field.sample(&points, sdf_field::Threads::ONE).iter().all(|sample| sample.value > 0.5));
/// ```
#[derive(Clone, Debug)]
pub struct Field {
    field: AnyField,
    info: Option<Arc<GridInfo>>,
    mesh: Option<Arc<KeptMesh>>,
    /// Computed where it is first asked for.
    reach: OnceLock<Reach>,
}

/// Points that one thread samples at a time.
const CHUNK: usize = 1024;

impl Field {
    /// A field of the core: a shape, a combination, a grid in memory.
    pub fn new(field: impl Into<AnyField>) -> Self {
        Self { field: field.into(), info: None, mesh: None, reach: OnceLock::new() }
    }

    /// A grid, and what is known of it.
    pub fn from_grid(grid: impl Into<Arc<OwnedGrid>>, info: GridInfo) -> Self {
        Self { info: Some(Arc::new(info)), ..Self::new(AnyField::Grid(grid.into())) }
    }

    /// Facts about a grid that was baked; `None` of others and of closed forms.
    pub fn info(&self) -> Option<&GridInfo> {
        self.info.as_deref()
    }

    /// The same grid with the mesh that it was baked from, for [`ContactOptions::exact`].
    pub fn with_mesh(self, mesh: impl Into<Arc<KeptMesh>>) -> Self {
        Self { mesh: Some(mesh.into()), ..self }
    }

    /// The mesh that a grid was baked from, if it was kept.
    pub fn mesh(&self) -> Option<&KeptMesh> {
        self.mesh.as_deref()
    }

    /// The field as the core has it: a field like any other.
    pub fn as_any(&self) -> &AnyField {
        &self.field
    }

    /// Levels that [`check_margin`](Self::check_margin) asks for.
    pub(crate) fn reach(&self) -> &Reach {
        self.reach.get_or_init(|| Reach::of(&self.field, Boxes::TakenAway))
    }

    /// The same, to keep.
    pub fn into_any(self) -> AnyField {
        self.field
    }

    /// The grid, if it is one.
    pub fn grid(&self) -> Option<&Arc<OwnedGrid>> {
        match &self.field {
            AnyField::Grid(grid) => Some(grid),
            _ => None,
        }
    }

    /// A box that holds every point with φ ≤ level.
    pub fn bounds(&self, level: f64) -> Aabb {
        self.field.bounds(level)
    }

    /// A grid's box, or one around the inside of any other field.
    pub fn domain(&self) -> Aabb {
        self.grid().map_or_else(|| self.bounds(0.0), |grid| grid.lattice().bounds())
    }

    /// Lipschitz constant: |φ(x) − φ(y)| ≤ slope_bound · |x − y|.
    pub fn slope_bound(&self) -> f64 {
        self.field.slope_bound()
    }

    /// φ and ∇φ at points, in their order. Points that are NaN, infinite or too large get the status
    /// [`not_finite`](sdf_core::Status::not_finite), points outside a grid [`outside_grid`](sdf_core::Status::outside_grid).
    pub fn sample(&self, points: &[[f64; 3]], threads: Threads) -> Vec<Sample<f64>> {
        let sample_chunk = |_, points: &[[f64; 3]]| map_points(&self.field, points, |field, point| field.sample(point));
        threads.map_chunks(points, CHUNK, sample_chunk).concat()
    }

    /// φ at points, in their order: the values of [`sample`](Self::sample), in less time. NaN at points that are NaN, infinite or
    /// too large.
    pub fn values(&self, points: &[[f64; 3]], threads: Threads) -> Vec<f64> {
        let value_chunk = |_, points: &[[f64; 3]]| {
            map_points(&self.field, points, |field, point| {
                let value = if is_valid(&point.into()) { field.value(point) } else { f64::NAN };
                if value.is_finite() { value } else { f64::NAN }
            })
        };
        threads.map_chunks(points, CHUNK, value_chunk).concat()
    }

    /// The contacts of a mesh: every element with φ ≤ margin somewhere, and where on it φ is lowest.
    pub fn contacts(&self, mesh: MeshView, options: &ContactOptions) -> Result<Contacts, QueryError> {
        #[cfg(feature = "bake")]
        if options.exact {
            let surface = self.mesh_surface(options)?;
            return ExactField { grid: &self.field, surface: &surface }.find(mesh, options);
        }
        contacts::find(&self.field, mesh, options)
    }

    /// The contacts of a mesh's faces, for who asks frame after frame: the same as of [`contacts`](Self::contacts), bit for bit, but
    /// clusters of faces that are far off are not looked at, the mesh may stand anywhere, and each face may have a margin of its own.
    /// A complete search may leave out faces that are `Possible` by their own bounds alone, where the bounds of a cluster show that they are
    /// not. [`ContactOptions::elements`] does not count.
    pub fn contacts_in_motion(&self, mesh: &MeshInMotion, options: &ContactOptions) -> Result<Contacts, QueryError> {
        contacts::find_in_motion(&self.field, mesh, options)
    }

    /// [`contacts`](Self::contacts) of edges that are given, such as the line elements of a file.
    pub fn contacts_of_edges(
        &self,
        points: &[[f64; 3]],
        edges: &[[u32; 2]],
        options: &ContactOptions,
    ) -> Result<Contacts, QueryError> {
        #[cfg(feature = "bake")]
        if options.exact {
            let surface = self.mesh_surface(options)?;
            return ExactField { grid: &self.field, surface: &surface }.find_elements(points, edges, options);
        }
        contacts::find_edges(&self.field, points, edges, options)
    }

    /// The kept mesh, ready to be searched with these options.
    #[cfg(feature = "bake")]
    fn mesh_surface(&self, options: &ContactOptions) -> Result<Arc<sdf_bake::MeshSurface>, QueryError> {
        options.check()?;
        match (&self.mesh, self.info()) {
            (Some(mesh), Some(info)) => mesh.surface(info, options.threads),
            _ if self.grid().is_none() => Err(QueryError::ExactNeedsGrid),
            _ => Err(QueryError::MeshNotKept),
        }
    }
}

/// Where a value is not a distance, as a sum of 1: no derivative here, 2: outside of the grid, a lower bound but for the grid's error, 4: beyond a sparse grid's
/// band, outside a lower bound and inside a coarse depth, 8: not finite.
pub fn status_bits(status: Status<bool>) -> u8 {
    let flags = [status.degenerate_gradient, status.outside_grid, status.beyond_band, status.not_finite];
    flags.into_iter().zip(0..).map(|(flag, bit)| u8::from(flag) << bit).sum()
}

impl<F: Into<AnyField>> From<F> for Field {
    fn from(field: F) -> Self {
        Self::new(field)
    }
}
