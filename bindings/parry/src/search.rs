/// How the lowest point of a triangle is searched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Search {
    /// A local minimum, by Newton steps between cutting planes: on convex shapes the lowest.
    #[default]
    Local,
    /// The lowest of all minima, proven, within 256 evaluations: several times the cost. Of a ball or a capsule it is proven where φ is a
    /// distance about the middle, as of most closed forms; else the nearest point of the field is found by a local search.
    Certified,
}
