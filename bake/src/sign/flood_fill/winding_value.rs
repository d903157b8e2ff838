use crate::rounding::{ESTIMATE_ROUNDING, SAMPLE_ROUNDING};
use crate::sign::winding::Estimate;

/// A winding number near a point, and by how much that at the point may be another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Winding {
    pub value: f32,
    pub error: f32,
}

impl Winding {
    pub const UNKNOWN: Self = Self { value: 0.0, error: f32::INFINITY };

    /// On the same side of one half.
    pub fn new(of: Estimate) -> Self {
        let rounded = of.value as f32;
        // No number leaves its side but for one just below.
        let is_moved = of.value.abs() < 0.5 && rounded.abs() >= 0.5;
        let value = if is_moved { 0.5_f32.next_down().copysign(rounded) } else { rounded };
        let rounding = if f64::from(value) == of.value { 0.0 } else { value.abs() * SAMPLE_ROUNDING };
        Self { value, error: of.error as f32 * (1.0 + ESTIMATE_ROUNDING) + rounding }
    }

    pub fn is_known(self) -> bool {
        self.error < f32::INFINITY
    }

    pub fn is_inside(self) -> bool {
        self.value.abs() >= 0.5
    }

    /// The side is the same for all that the winding number may be.
    pub fn is_sure(self) -> bool {
        (f64::from(self.value.abs()) - 0.5).abs() > f64::from(self.error)
    }
}

impl From<Winding> for Estimate {
    fn from(winding: Winding) -> Self {
        Self { value: winding.value.into(), error: winding.error.into() }
    }
}
