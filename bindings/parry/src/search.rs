/// How the lowest point of a triangle is searched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Search {
    /// A local minimum, fast.
    #[default]
    FrankWolfe,
    /// The lowest of all minima, proven, within 256 evaluations: several times the cost.
    Certified,
}
