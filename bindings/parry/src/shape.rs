//! A field as a shape of parry: its box, its mass, rays and nearest points. Contacts are the dispatcher's: [`SdfDispatcher`].
//!
//! | query | method |
//! |---|---|
//! | ray | sphere tracing (Hart 1996) with the field's slope bound, from where the ray enters its box |
//! | nearest point | downhill onto the surface, then along it, to a local minimum of the distance: `nearest` |
//! | mass | cells that are cut at the surface, eight of each, as often as the budget allows; then by the fraction that is inside |
//!
//! [`SdfDispatcher`]: crate::SdfDispatcher

use std::sync::{Arc, OnceLock};

use parry3d::bounding_volume::{Aabb, BoundingSphere};
use parry3d::mass_properties::MassProperties;
use parry3d::math::{Matrix, Vector};
use parry3d::query::{PointProjection, PointQuery, Ray, RayCast, RayIntersection};
use parry3d::shape::{FeatureId, Shape, ShapeType, TypedShape};
use sdf_core::nalgebra::{Matrix3, Vector3};
use sdf_core::overlap::{NoRegion, Pair};
use sdf_core::{AnyField, Sdf};

use crate::body_part::{BodyPart, at_surface};
use crate::convert::{to_core, to_parry};
use crate::nearest::NearestPoint;
use crate::surface::Surface;

/// A field as a solid body. A clone shares everything.
#[derive(Clone)]
pub struct SdfShape {
    field: Arc<AnyField>,
    bounds: Aabb,
    /// The same as the field has it. A grid reads many samples to tell it.
    field_bounds: sdf_core::Aabb,
    parts: Arc<[BodyPart]>,
    unit_mass: Arc<OnceLock<MassProperties>>,
    mesh: Option<Arc<Surface>>,
}

/// Why something is not the shape of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum InvalidShape {
    /// The field has points with φ ≤ 0 at any distance, or none at all.
    Unbounded,
    /// The field's box reaches beyond what parry's f32 holds.
    TooFar,
    /// A face of the mesh names a vertex that is not there.
    VertexOutOfRange,
    /// The mesh has no faces.
    NoFaces,
    /// A vertex of the mesh is NaN or infinite.
    VertexNotFinite,
}

impl std::fmt::Display for InvalidShape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Unbounded => "a collider needs a field with a finite, not empty inside: intersect it with a box",
            Self::TooFar => "the box of a collider's field reaches beyond 3.4e38, the largest f32",
            Self::VertexOutOfRange => "a face of the mesh names a vertex that is not there",
            Self::NoFaces => "the mesh of a collider needs faces",
            Self::VertexNotFinite => "a vertex of the mesh is NaN or infinite",
        })
    }
}

impl std::error::Error for InvalidShape {}

/// Steps of a ray. Each step that is not the last gets at least 1e-6 of the box's diagonal further.
const MAX_RAY_STEPS: u32 = 4096;

/// Cells along the longest side in which a field is proven to be empty.
const PROOF_CELLS: u32 = 64;

/// Cells along the longest side in which mass is counted first.
const MASS_CELLS: f64 = 8.0;

/// Evaluations that mass takes at most, but for those of the first cells.
const MASS_EVALUATIONS: usize = 300_000;

/// Volume, its first and its second moments.
#[derive(Clone, Copy, Default)]
struct Moments {
    volume: f64,
    first: Vector3<f64>,
    second: Matrix3<f64>,
}

impl Moments {
    /// Adds a share of a cube.
    fn add_cube(&mut self, middle: Vector3<f64>, side: f64, share: f64) {
        let volume = share * side.powi(3);
        self.volume += volume;
        self.first += middle * volume;
        self.second += (middle * middle.transpose() + Matrix3::from_diagonal_element(side * side / 12.0)) * volume;
    }
}

impl SdfShape {
    /// Any field of the core: a closed form, a baked grid, a combination. In the unit of the scene, negative inside.
    pub fn new(field: impl Into<AnyField>) -> Result<Self, InvalidShape> {
        let field = field.into();
        let field_bounds = field.bounds(0.0);
        let sdf_core::Aabb { min, max } = field_bounds;
        let is_body = (0..3).all(|axis| min[axis] <= max[axis] && field_bounds.extents()[axis].is_finite());
        if !is_body {
            return Err(InvalidShape::Unbounded);
        }
        let bounds = Aabb::new(to_parry(min.into()), to_parry(max.into()));
        if !(bounds.mins.is_finite() && bounds.maxs.is_finite()) {
            return Err(InvalidShape::TooFar);
        }
        let field = Arc::new(field);
        let parts = BodyPart::all(&field, &field_bounds).into();
        let shape = Self { field, bounds, field_bounds, parts, unit_mass: Arc::default(), mesh: None };
        if shape.parts.is_empty() && shape.is_empty() {
            return Err(InvalidShape::Unbounded);
        }
        Ok(shape)
    }

    /// The same with its surface as triangles, such as the mesh that was baked. They are needed where the other shape has none: against
    /// half-spaces, and against other fields. Against all others that are at least as wide their vertices are points of contact, too: a body
    /// that moves and rests on several of its own points needs them on wide triangles.
    pub fn with_mesh(self, points: &[[f64; 3]], faces: &[[u32; 3]]) -> Result<Self, InvalidShape> {
        if faces.is_empty() {
            return Err(InvalidShape::NoFaces);
        }
        if !points.as_flattened().iter().all(|x| x.is_finite()) {
            return Err(InvalidShape::VertexNotFinite);
        }
        let mesh = Surface::of_mesh(points.to_vec(), faces.to_vec()).ok_or(InvalidShape::VertexOutOfRange)?;
        Ok(Self { mesh: Some(Arc::new(mesh.with_clusters())), ..self })
    }

    /// The field, in the shape's own frame.
    pub fn field(&self) -> &AnyField {
        &self.field
    }

    pub(crate) fn shared_field(&self) -> Arc<AnyField> {
        self.field.clone()
    }

    /// The box around the field's inside.
    pub(crate) fn field_bounds(&self) -> sdf_core::Aabb {
        self.field_bounds
    }

    pub(crate) fn mesh(&self) -> Option<&Arc<Surface>> {
        self.mesh.as_ref()
    }

    /// The parts of the body in which a point was found.
    pub(crate) fn parts(&self) -> &[BodyPart] {
        &self.parts
    }

    /// Is it proven that φ > 0 in all of the box?
    fn is_empty(&self) -> bool {
        let twice = Pair::new(&*self.field, &*self.field, 0.0);
        twice.and_then(|pair| pair.shrink::<f64>(PROOF_CELLS)).err() == Some(NoRegion::Separated)
    }

    fn nearest_to(&self, start: Vector3<f64>) -> Vector3<f64> {
        NearestPoint { field: &self.field, start, tolerance: self.at_surface() }.find()
    }

    fn at_surface(&self) -> f64 {
        at_surface(&self.field_bounds)
    }

    /// Mass, centre and inertia at a density of one.
    fn integrate(&self) -> MassProperties {
        let Moments { volume, first, second } = self.moments();
        if volume <= 0.0 {
            return MassProperties::default();
        }
        let centre = first / volume;
        let products = second - centre * centre.transpose() * volume;
        let inertia = Matrix3::from_diagonal_element(products.trace()) - products;
        let columns = [0, 1, 2].map(|axis| to_parry(inertia.column(axis).into()));
        let inertia = Matrix::from_cols(columns[0], columns[1], columns[2]);
        MassProperties::with_inertia_matrix(to_parry(centre), volume as f32, inertia)
    }

    /// Adds up cubes that lie wholly inside, and shares of those that the surface meets. These are cut into eight as long as the budget lasts,
    /// so that a body that is thin in its box is counted in cells as thin.
    fn moments(&self) -> Moments {
        let (low, extents) = (to_core(self.bounds.mins), to_core(self.bounds.extents()));
        let mut moments = Moments::default();
        let mut side = extents.max() / MASS_CELLS;
        if side <= 0.0 {
            return moments;
        }
        let [nx, ny, nz]: [u32; 3] = extents.map(|extent| (extent / side).ceil().max(1.0) as u32).into();
        let cells = (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| Vector3::new(i, j, k))));
        // About the middle of the box, so that a body that is symmetric is counted so.
        let first = low + (extents - Vector3::new(nx, ny, nz).map(f64::from) * side) / 2.0;
        let middle = |index: Vector3<u32>| first + index.map(|index| (f64::from(index) + 0.5) * side);
        let mut cells: Vec<Vector3<f64>> = cells.map(middle).collect();
        let mut evaluations = 0;
        loop {
            evaluations += cells.len();
            let samples = cells.iter().map(|middle| (*middle, self.field.value(*middle)));
            // No value in a cube is farther from that in its middle.
            let reach = self.field.slope_bound() * side * 0.75_f64.sqrt();
            let mut cut = vec![];
            for (middle, value) in samples {
                if value.abs() <= reach {
                    cut.push((middle, value));
                } else if value < 0.0 {
                    moments.add_cube(middle, side, 1.0);
                }
            }
            if cut.is_empty() || evaluations + 8 * cut.len() > MASS_EVALUATIONS {
                for (middle, value) in cut {
                    moments.add_cube(middle, side, (0.5 - value / side).clamp(0.0, 1.0));
                }
                return moments;
            }
            side *= 0.5;
            let corners = (0..8).map(|corner| Vector3::new(corner & 1, corner >> 1 & 1, corner >> 2));
            let steps: Vec<_> = corners.map(|corner| corner.map(|step| (f64::from(step) - 0.5) * side)).collect();
            cells = cut.iter().flat_map(|(middle, _)| steps.iter().map(move |step| middle + step)).collect();
        }
    }
}

impl PointQuery for SdfShape {
    /// A point of the surface that is about the nearest; far from a grid, or from a body of several parts, it can be another that is near.
    fn project_local_point(&self, point: Vector, solid: bool) -> PointProjection {
        let is_inside = self.contains_local_point(point);
        if is_inside && solid {
            return PointProjection::new(true, point);
        }
        PointProjection::new(is_inside, to_parry(self.nearest_to(to_core(point))))
    }

    fn contains_local_point(&self, point: Vector) -> bool {
        self.field.sample(to_core(point)).value <= 0.0
    }

    fn project_local_point_and_get_feature(&self, point: Vector) -> (PointProjection, FeatureId) {
        (self.project_local_point(point, false), FeatureId::Unknown)
    }
}

impl RayCast for SdfShape {
    /// `None` too where a ray grazes the surface for thousands of steps.
    fn cast_local_ray_and_get_normal(&self, ray: &Ray, max_time: f32, solid: bool) -> Option<RayIntersection> {
        let hit = |time: f64, normal| {
            (time <= f64::from(max_time)).then(|| RayIntersection::new(time as f32, normal, FeatureId::Unknown))
        };
        let (origin, direction) = (to_core(ray.origin), to_core(ray.dir));
        let is_inside = self.field.sample(origin).value <= 0.0;
        if is_inside && solid {
            return hit(0.0, Vector::ZERO);
        }
        let (enter, leave) = self.bounds.clip_ray_parameters(ray)?;
        let speed = direction.norm() * self.field.slope_bound().max(f64::MIN_POSITIVE);
        let mut time = f64::from(enter.max(0.0));
        for _ in 0..MAX_RAY_STEPS {
            let sample = self.field.sample(origin + direction * time);
            let clearance = if is_inside { -sample.value } else { sample.value };
            if clearance <= self.at_surface() {
                let normal = to_parry(sample.gradient).normalize_or_zero();
                return hit(time, if is_inside { -normal } else { normal });
            }
            time += clearance / speed;
            if time > f64::from(leave) && !is_inside {
                return None;
            }
        }
        None
    }
}

impl Shape for SdfShape {
    fn compute_local_aabb(&self) -> Aabb {
        self.bounds
    }

    fn compute_local_bounding_sphere(&self) -> BoundingSphere {
        BoundingSphere::new(self.bounds.center(), self.bounds.half_extents().length())
    }

    fn clone_dyn(&self) -> Box<dyn Shape> {
        Box::new(self.clone())
    }

    /// `None`: a field is scaled before it becomes a shape, as `AnyField::Placed` or `AnyField::Stretched`.
    fn scale_dyn(&self, _: Vector, _: u32) -> Option<Box<dyn Shape>> {
        None
    }

    fn mass_properties(&self, density: f32) -> MassProperties {
        let mut mass = *self.unit_mass.get_or_init(|| self.integrate());
        mass.set_mass(mass.mass() * density, true);
        mass
    }

    fn shape_type(&self) -> ShapeType {
        ShapeType::Custom
    }

    fn as_typed_shape(&self) -> TypedShape<'_> {
        TypedShape::Custom(self)
    }

    fn ccd_thickness(&self) -> f32 {
        0.0
    }

    fn ccd_angular_thickness(&self) -> f32 {
        std::f32::consts::FRAC_PI_4
    }
}
