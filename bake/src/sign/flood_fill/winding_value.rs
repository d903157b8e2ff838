use crate::rounding::{ESTIMATE_ROUNDING, SAMPLE_ROUNDING};
use crate::sign::winding::Estimate;

/// An [`Estimate`] in f32, on the same side of 1/2.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Winding {
    pub value: f32,
    pub error: f32,
}

impl Winding {
    pub const UNKNOWN: Self = Self { value: 0.0, error: f32::INFINITY };

    /// So near to 1/2 that rounding decides the side: the outside is taken. It is carried nowhere.
    pub const UNDECIDED: Self = Self { value: 0.5_f32.next_down(), error: f32::EPSILON };

    pub fn new(estimate: Estimate) -> Self {
        let rounded = estimate.value as f32;
        // Only a value just below 1/2 changes sides by rounding.
        let changes_side = estimate.value.abs() < 0.5 && rounded.abs() >= 0.5;
        let value = if changes_side { 0.5_f32.next_down().copysign(rounded) } else { rounded };
        let rounding = if f64::from(value) == estimate.value { 0.0 } else { value.abs() * SAMPLE_ROUNDING };
        Self { value, error: estimate.error as f32 * (1.0 + ESTIMATE_ROUNDING) + rounding }
    }

    pub fn is_known(self) -> bool {
        self.error < f32::INFINITY
    }

    pub fn is_inside(self) -> bool {
        self.value.abs() >= 0.5
    }

    /// Whether all values within the error lie on one side of 1/2.
    pub fn is_certain(self) -> bool {
        (f64::from(self.value.abs()) - 0.5).abs() > f64::from(self.error)
    }
}

impl From<Winding> for Estimate {
    fn from(winding: Winding) -> Self {
        Self { value: winding.value.into(), error: winding.error.into() }
    }
}
