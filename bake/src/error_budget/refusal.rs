//! Why is no grid within a budget, and what would be?

use thiserror::Error;

#[cfg(doc)]
use crate::MeshDistance;

/// Error that is certain to be met with the memory allowed, on any mesh, and an estimate of what it takes. It is no limit: on most
/// meshes larger voxels do, and so a smaller error fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AchievableError {
    /// Bound of the error within the band, as a length.
    pub error: f64,
    /// Side of its voxels.
    pub spacing: f64,
    /// Largest memory of baking it.
    pub bytes: usize,
}

/// Reason why no grid is within a budget.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ErrorBudgetError {
    /// The error allowed is not positive and finite.
    #[error("the error must be a positive finite length, not {0:?}")]
    InvalidError(f64),
    /// The band is NaN, infinite or negative.
    #[error("the band must be a finite number of voxels of at least 0, not {0:?}")]
    InvalidBand(f64),
    /// The signed distance is not continuous, so that no voxel size bounds the error: see [`MeshDistance::is_continuous`].
    #[error(
        "no voxel is small enough: the sign of the distance jumps away from the faces, as around holes ({sign_reason})"
    )]
    SignJumps {
        /// The state of the mesh, see [`MeshDistance::sign_reason`].
        sign_reason: String,
    },
    /// The error is below the rounding of positions and distances, which no voxel is small enough to take away.
    #[error(
        "an error of {max_error:?} is below what positions and distances of this mesh are rounded by with voxels of any size, {rounding:?}{}",
        instead(achievable)
    )]
    BelowRounding {
        /// The error allowed.
        max_error: f64,
        /// Bound of the rounding.
        rounding: f64,
        /// Error that fits the memory with certainty; `None` if no size fits.
        achievable: Option<AchievableError>,
    },
    /// No grid was found that is within the error and takes no more memory than is allowed.
    #[error("an error of {max_error:?} takes {}, but {max_bytes} are allowed{}", needed(*bytes), instead(achievable))]
    TooLarge {
        /// The error allowed.
        max_error: f64,
        /// Memory of voxels that suffice for any mesh, extrapolated from larger ones. `None` if no size fits or the
        /// number overflows.
        bytes: Option<usize>,
        /// The memory allowed.
        max_bytes: usize,
        /// Error that fits the memory with certainty; `None` if no size fits.
        achievable: Option<AchievableError>,
    },
    /// The flag of [`MeshDistance::with_cancel`] was set.
    #[error("the bake was cancelled")]
    Cancelled,
}

impl ErrorBudgetError {
    /// The refusal of an error that stands for another.
    pub(super) fn about(mut self, error: f64) -> Self {
        if let Self::TooLarge { max_error, .. } | Self::BelowRounding { max_error, .. } = &mut self {
            *max_error = error;
        }
        self
    }
}

fn needed(bytes: Option<usize>) -> String {
    bytes.map_or_else(|| "more bytes".to_owned(), |bytes| format!("up to about {bytes} bytes"))
}

fn instead(achievable: &Option<AchievableError>) -> String {
    achievable.map_or_else(String::new, |AchievableError { error, spacing, bytes }| {
        format!("; one of {error:?} is certain with voxels of {spacing:?} in {bytes} bytes, and a smaller one may be reached")
    })
}
