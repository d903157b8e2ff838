use sdf_core::contact::{ContactStatus, ElementKind};
use serde::Serializer;

/// A value with a fixed list of names: a word in CSV and JSON, the word's index in HDF5.
pub trait Label: Copy + 'static {
    /// All values, in the order of their codes.
    const ALL: &'static [Self];

    /// All names, in the order of their codes.
    const NAMES: &'static [&'static str];

    /// Index into [`Self::NAMES`].
    fn code(self) -> u8;

    /// The value with this code; `None` if it means nothing.
    fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }

    /// The name of this value.
    fn name(self) -> &'static str {
        Self::NAMES[usize::from(self.code())]
    }
}

impl Label for ElementKind {
    const ALL: &'static [Self] = &[Self::Vertex, Self::Edge, Self::Face];

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
    const ALL: &'static [Self] = &[
        Self::Converged,
        Self::BudgetSpent,
        Self::OutsideGrid,
        Self::DegenerateGradient,
        Self::BeyondBand,
        Self::Possible,
    ];

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
