//! Which elements are searched, by which method, and within which limits: [`ContactOptions`].

use sdf_core::placed::Rigid;

use crate::{Field, MarginOutOfReach, Method, QueryError, Threads};

/// Which parts of a mesh are searched for contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Elements {
    /// The triangles: finds everything.
    #[default]
    Faces,
    /// The edges of the triangles, each once.
    Edges,
    /// The vertices.
    Vertices,
}

/// Elements to search, the method, and its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactOptions {
    /// Faces, edges or vertices.
    pub elements: Elements,
    /// How the minimum on an element is searched.
    pub method: Method,
    /// Elements with φ ≤ margin anywhere are contacts: a length in the unit of the mesh; negative: only at least so deep;
    /// infinite: all elements.
    pub margin: f64,
    /// Where the field stands in the mesh's frame; `None` where it is already there.
    pub pose: Option<Rigid>,
    /// Evaluations per element of the certified methods, iterations of the others; `None` stands for
    /// [`Method::default_budget`].
    pub budget: Option<u32>,
    /// The certified methods stop within this fraction of slope bound · longest edge of the minimum, or of slope bound · size of the
    /// field, if that is shorter: the longest side of its box, of a union that of its largest part.
    pub tolerance: f64,
    /// Report every isolated minimum of an element, not only the lowest. Needs a certified method.
    pub all_minima: bool,
    /// Leave out no element whose distance to the *shape* is within the margin, such as the mesh that a grid was baked from. What the
    /// field's error bound leaves open is reported with the status [`Possible`](sdf_core::contact::ContactStatus::Possible). Needs a
    /// closed form or a grid whose error bound is known.
    pub complete: bool,
    /// Measure contacts by the triangles of the mesh that the grid was baked from: distance, normal and surface point are those of the
    /// mesh, and no element within the margin is left out. Needs a field that keeps its mesh and [`Method::Auto`]; `budget` and
    /// `tolerance` do not matter.
    pub exact: bool,
    /// Report one contact for each vertex, edge or face that is touched: see
    /// [`one_per_feature`](sdf_core::contact::one_per_feature).
    pub one_per_feature: bool,
    /// Leave out what a solver may not need: smooth normals and bounds of the field's error. Elements, points, weights, distances and
    /// lower bounds are those of full contacts, bit for bit, by every method. Normal, slope and surface point are by ∇φ, which on a grid
    /// jumps at the faces of cells, and so is the status [`DegenerateGradient`](sdf_core::contact::ContactStatus::DegenerateGradient).
    /// `error_bound` is infinite, and `shape_lower_bound` −∞. Not with `all_minima`, `complete` or `exact`.
    pub lean: bool,
    /// How many threads work.
    pub threads: Threads,
}

impl ContactOptions {
    /// The margin that [`GridInfo::check_margin`](crate::GridInfo::check_margin) is to be asked for: complete and exact searches answer
    /// any depth.
    pub fn margin_to_check(&self) -> f64 {
        if self.complete || self.exact { self.margin.max(0.0) } else { self.margin }
    }

    /// Refuses the margin where contacts of the field would be left out or false: see [`Field::check_margin`].
    pub fn check_margin(&self, field: &Field) -> Result<(), MarginOutOfReach> {
        match field.info() {
            Some(info) => info.check_margin(self.margin_to_check()),
            None if self.complete || self.exact => Ok(()),
            None => field.check_margin(self.margin),
        }
    }
}

impl Default for ContactOptions {
    fn default() -> Self {
        Self {
            elements: Elements::Faces,
            method: Method::Auto,
            margin: 0.0,
            pose: None,
            budget: None,
            tolerance: 1e-3,
            all_minima: false,
            complete: false,
            exact: false,
            one_per_feature: false,
            lean: false,
            threads: Threads::ALL,
        }
    }
}

impl ContactOptions {
    /// Projected gradient descent: the fastest, and misses some contacts.
    pub fn fast() -> Self {
        Self { method: Method::ProjectedGradient, ..Self::default() }
    }

    /// The default: certified within 256 evaluations per element.
    pub fn balanced() -> Self {
        Self::default()
    }

    /// Certified within 1024 evaluations per element.
    pub fn certified() -> Self {
        Self { method: Method::Certified, ..Self::default() }
    }

    /// Refuses options that do not go together, and a margin or a tolerance that is not a number.
    pub(crate) fn check(&self) -> Result<(), QueryError> {
        match () {
            () if self.margin.is_nan() => Err(QueryError::MarginIsNan),
            () if !(self.tolerance > 0.0 && self.tolerance.is_finite()) => Err(QueryError::ToleranceOutOfRange),
            () if self.lean && (self.all_minima || self.complete || self.exact) => Err(QueryError::LeanLeavesOut),
            () => Ok(()),
        }
    }

    pub(crate) fn budget(&self) -> u32 {
        self.budget.unwrap_or(self.method.default_budget())
    }
}
