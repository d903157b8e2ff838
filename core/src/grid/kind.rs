//! The kinds of stored grids: which nodes have a sample, and of which type it is.

/// Which nodes have a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Layout {
    /// Every node.
    Dense,
    /// Bricks near the surface, and every eighth sample elsewhere.
    Sparse,
}

impl Layout {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Dense, Self::Sparse];

    /// The layout of this [`name`](Self::name).
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|layout| layout.name() == name)
    }

    /// `dense` or `sparse`, as files and the command line have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dense => "dense",
            Self::Sparse => "sparse",
        }
    }
}

/// The type in which samples are stored. Bricks of integers, and blocks of 8 × 8 × 8 nodes of a dense grid, have a base and a step each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Precision {
    /// Exact to half a unit in the last place of `f32`.
    F32,
    /// 65,536 steps between the lowest and the highest sample of a brick or block.
    U16,
    /// 256 steps.
    U8,
}

impl Precision {
    /// From the finest to the coarsest.
    pub const ALL: [Self; 3] = [Self::F32, Self::U16, Self::U8];

    /// The precision of this [`name`](Self::name).
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|precision| precision.name() == name)
    }

    /// `f32`, `u16` or `u8`, as files and the command line have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::U16 => "u16",
            Self::U8 => "u8",
        }
    }
}
