//! The state that a pass keeps beside each row: both of its sides where they stand, and all that was pushed in the step.

use crate::V3;

/// A row as a pass takes it: gap = n · (a − b − age · velocity) + offset. A fixed side that is not round stands at the origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    pub element: Side,
    pub field: Side,
    pub normal: V3,
    /// The body that the normal turns with, and the normal in its frame.
    pub turns_with: Option<(u32, V3)>,
    pub velocity: V3,
    pub offset: f64,
    pub friction: f64,
    /// Σ w²/m of all particles.
    pub particle_weight: f64,
    /// The largest w/m of a particle: how far a push of one moves it.
    pub farthest: f64,
    /// A push moves no particle much farther than this: the row is a plane only near where it was found.
    pub reach: f64,
    /// The push along n and across it in this step: mass · length.
    pub pushed: f64,
    pub held: V3,
    /// The twist against rolling: mass · length², as a push times an arm.
    pub twisted: V3,
    /// Have two bodies struck each other here in this step? Then what was pushed too much is taken back.
    pub is_struck: bool,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Side {
    /// A point that stands still: `radius` along the row's normal beyond a center.
    Fixed { center: V3, radius: f64, point: V3 },
    /// Entries of `Rows::terms`.
    Particles { first: u32, count: u32 },
    /// A point of a body: `radius` along the row's normal beyond a center that turns with the body, and as the last step began at
    /// `arm` from the body's position.
    Body { id: u32, center: V3, radius: f64, arm: V3 },
}
