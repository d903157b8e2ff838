use sdf_core::contact::{ContactStatus, ElementKind};
use serde::Serializer;

/// A value with a fixed list of names: a word in CSV and JSON, the word's index in HDF5.
pub trait Label: Copy {
    /// All names, in the order of their codes.
    const NAMES: &'static [&'static str];

    /// Index into [`Self::NAMES`].
    fn code(self) -> u8;

    /// The name of this value.
    fn name(self) -> &'static str {
        Self::NAMES[usize::from(self.code())]
    }
}

impl Label for ElementKind {
    const NAMES: &'static [&'static str] = &["vertex", "edge", "face"];

    fn code(self) -> u8 {
        match self {
            Self::Vertex => 0,
            Self::Edge => 1,
            Self::Face => 2,
        }
    }
}

impl Label for ContactStatus {
    const NAMES: &'static [&'static str] =
        &["converged", "budget_spent", "outside_grid", "degenerate_gradient", "beyond_band", "possible"];

    fn code(self) -> u8 {
        match self {
            Self::Converged => 0,
            Self::BudgetSpent => 1,
            Self::OutsideGrid => 2,
            Self::DegenerateGradient => 3,
            Self::BeyondBand => 4,
            Self::Possible => 5,
        }
    }
}

/// Serializes the name, for `#[serde(serialize_with)]`.
pub(super) fn serialize<T: Label, S: Serializer>(label: &T, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(label.name())
}
