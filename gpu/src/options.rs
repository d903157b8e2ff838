//! How a query on the card searches.

/// A method of `sdf_core::minimize`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// `FrankWolfe`.
    FrankWolfe,
    /// `ProjectedGradient`.
    ProjectedGradient,
    /// `Newton`.
    Newton,
    /// `GoldenSection`, on edges.
    GoldenSection,
    /// `PointSampling`.
    PointSampling,
    /// `Certified`: many registers, much local memory, slow on a card.
    Certified,
}

impl Method {
    /// As the names of kernels have it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::FrankWolfe => "frank_wolfe",
            Self::ProjectedGradient => "projected_gradient",
            Self::Newton => "newton",
            Self::GoldenSection => "golden_section",
            Self::PointSampling => "point_sampling",
            Self::Certified => "certified",
        }
    }

    pub(crate) fn tolerance(self, options: &QueryOptions) -> f64 {
        match self {
            Self::Certified => options.tolerance,
            _ => 1e-6,
        }
    }
}

/// Method, limits and form of a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QueryOptions {
    /// The method of the search.
    pub method: Method,
    /// Contacts are reported where φ is at most this.
    pub margin: f32,
    /// Largest number of steps, of evaluations, or the number of samples.
    pub iterations: u32,
    /// The certified method stops within this fraction of longest edge · slope bound of the minimum.
    pub tolerance: f64,
    /// How the work is cut into kernels.
    pub stages: Stages,
    /// Treatment of elements that the search does not settle.
    pub unsettled: Unsettled,
}

impl Default for QueryOptions {
    fn default() -> Self {
        Self {
            method: Method::FrankWolfe,
            margin: 0.0,
            iterations: 32,
            tolerance: 1e-3,
            stages: Stages::Separate,
            unsettled: Unsettled::Keep,
        }
    }
}

/// How a query is cut into kernels. The contacts of the first two are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stages {
    /// Cull, search and report are a kernel each. What is left after each moves together, so that no thread waits.
    Separate,
    /// One kernel. It saves two launches, which on meshes of some ten thousand elements cost more than threads that wait.
    Fused,
    /// One kernel, for contacts with no more in them than the paper's: those of `sdf_core::contact::lean_contact` on
    /// `sdf_core::grid::PlainNormals`. Elements are culled at their centroid, a grid's normals are those of its cells, and nothing is
    /// known of errors: `error_bound` is infinite.
    Lean,
    /// The same contacts by three kernels, for meshes of some hundred thousand elements and more: the cull; searches of a single step,
    /// which settle elements whose lowest point is a corner; and searches of what that leaves.
    LeanSeparate,
}

/// Treatment of elements that a local search does not settle: its lowest value is above the margin, which may be a local minimum, or
/// its steps ended before its own condition was met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unsettled {
    /// Its answer is kept, as that of `sdf_core::contact::contact`.
    Keep,
    /// They are searched a second time on the card, by the certified method, and its answer is kept: no element within the margin is
    /// missed, but within the tolerance of its minimum or where its evaluations end: `GpuContacts::open_count` of them. Not with
    /// [`Method::Certified`], which leaves nothing to certify.
    Certify {
        /// Largest number of evaluations for each.
        evaluations: u32,
    },
    /// They are searched a second time on the card, and those that the certified method leaves open, because it has
    /// neither a minimum within the margin, known to within the tolerance, nor a bound above it, are left out of the contacts and listed.
    /// Not with [`Method::Certified`], for which [`List`](Self::List) does this.
    CertifyThenList {
        /// Largest number of evaluations for each.
        evaluations: u32,
    },
    /// They are left out of the contacts and listed, for a search elsewhere.
    List,
}
