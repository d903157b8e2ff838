//! The methods that search an element, and their names: one list for programs, bindings and files.

use std::fmt;
use std::str::FromStr;

/// How the minimum on an element is searched. Displays as its name, and is parsed from it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Method {
    /// [`Certified`](Self::Certified) with a budget of 256 evaluations.
    #[default]
    Auto,
    /// Branch and bound with a budget of 1024 evaluations: the global minimum, and a proof of how near.
    Certified,
    /// Frank-Wolfe: a local minimum.
    FrankWolfe,
    /// Projected gradient descent: the fastest; a local minimum.
    ProjectedGradient,
    /// Newton's method between cutting planes: a local minimum, on faces more often the lowest.
    Newton,
    /// Golden-section search, on edges alone.
    GoldenSection,
    /// The lowest of so many fixed points: a baseline to compare with.
    Sampling(u32),
    /// The lowest of the element's corners and so many fixed points: with 0 points, vertices alone.
    SamplingWithCorners(u32),
}

impl Method {
    /// The methods that programs offer, and baselines with the usual numbers of points.
    pub const ALL: [Self; 11] = [
        Self::Auto,
        Self::Certified,
        Self::FrankWolfe,
        Self::ProjectedGradient,
        Self::Newton,
        Self::GoldenSection,
        Self::Sampling(4),
        Self::Sampling(16),
        Self::Sampling(64),
        Self::SamplingWithCorners(0),
        Self::SamplingWithCorners(64),
    ];

    /// The budget where none is given: evaluations of the certified methods, iterations of the others.
    pub fn default_budget(self) -> u32 {
        match self {
            Self::Auto => 256,
            Self::Certified => 1024,
            _ => 32,
        }
    }

    /// Tells whether the method only samples fixed points: a baseline.
    pub fn is_baseline(self) -> bool {
        matches!(self, Self::Sampling(_) | Self::SamplingWithCorners(_))
    }

    /// One sentence for a list of choices.
    pub fn summary(self) -> String {
        match self {
            Self::Auto => "Certified, within 256 evaluations".into(),
            Self::Certified => "Branch and bound: the global minimum, and a proof of how near".into(),
            Self::FrankWolfe => "Frank-Wolfe".into(),
            Self::ProjectedGradient => "Projected gradient descent".into(),
            Self::Newton => "Newton's method between cutting planes".into(),
            Self::GoldenSection => "Golden-section search, on edges only".into(),
            Self::Sampling(points) => format!("The lowest of {points} fixed points, a baseline"),
            Self::SamplingWithCorners(0) => "The lowest of the corners, a baseline".into(),
            Self::SamplingWithCorners(points) => {
                format!("The lowest of the corners and {points} fixed points, a baseline")
            }
        }
    }
}

/// Writes `auto`, `certified`, `fw`, `pgd`, `newton`, `gss`, `sample4`, `corners` or `corners64`, with any number of points.
impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Certified => f.write_str("certified"),
            Self::FrankWolfe => f.write_str("fw"),
            Self::ProjectedGradient => f.write_str("pgd"),
            Self::Newton => f.write_str("newton"),
            Self::GoldenSection => f.write_str("gss"),
            Self::Sampling(points) => write!(f, "sample{points}"),
            Self::SamplingWithCorners(0) => f.write_str("corners"),
            Self::SamplingWithCorners(points) => write!(f, "corners{points}"),
        }
    }
}

/// A name that no method has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownMethod {
    /// The name that was given.
    pub name: String,
}

impl fmt::Display for UnknownMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let known = Method::ALL.map(|method| method.to_string()).join(", ");
        write!(f, "no method is called {:?}: give one of {known}, or another number of points", self.name)
    }
}

impl std::error::Error for UnknownMethod {}

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<Self, UnknownMethod> {
        let sampling = |prefix: &str, method: fn(u32) -> Self| Some(method(name.strip_prefix(prefix)?.parse().ok()?));
        let samplings = [sampling("sample", Self::Sampling), sampling("corners", Self::SamplingWithCorners)];
        // "sample05" is parsed, and not a name.
        let known =
            Self::ALL.into_iter().chain(samplings.into_iter().flatten()).find(|method| method.to_string() == name);
        known.ok_or_else(|| UnknownMethod { name: name.to_owned() })
    }
}
