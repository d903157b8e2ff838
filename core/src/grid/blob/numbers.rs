//! The numbers of a blob's head, in f32 and f64, and whether they are valid. No arithmetic in f64, so that a processor without it
//! links none.

use crate::Parameter;
use crate::grid::brick::Scale;
use crate::grid::{Lattice, Precision};

/// The head beside magic, version and kind.
pub(super) struct Numbers {
    nodes: [u32; 3],
    pub bricks: u32,
    origin: [Parameter; 3],
    spacing: [Parameter; 2],
    pub slope_bound: Parameter,
    pub band: Parameter,
    pub scale: Scale,
    pub checksum: u32,
    pub errors: [f64; 3],
}

impl Numbers {
    pub fn read(head: &[u8; super::HEAD_BYTES], double: &[u8; super::NUMBERS_END - super::HEAD_BYTES]) -> Self {
        let (head, double) = (&mut head.get(8..).unwrap_or(&[]), &mut &double[..]);
        let (nodes, bricks) = ([0; 3].map(|_| word(head)), word(head));
        let mut parameter =
            || Parameter { single: f32::from_bits(word(head)), double: f64::from_bits(long_word(double)) };
        let origin = [0; 3].map(|_| parameter());
        let spacing = [0; 2].map(|_| parameter());
        let (slope_bound, band) = (parameter(), parameter());
        let scale = Scale { base: f32::from_bits(word(head)), step: f32::from_bits(word(head)) };
        let checksum = word(head);
        let errors = [0; 3].map(|_| f64::from_bits(long_word(double)));
        Self { nodes, bricks, origin, spacing, slope_bound, band, scale, checksum, errors }
    }

    /// As [`Lattice::new`] asks, in f32.
    pub fn lattice(&self) -> Option<Lattice> {
        let Self { origin, spacing: [spacing, inv_spacing], nodes, .. } = *self;
        let agree = origin.iter().chain(&self.spacing).all(agrees);
        let counts_fit = nodes.iter().all(|n| (2..=Lattice::MAX_NODES).contains(n));
        let far = |axis: usize| origin[axis].single + spacing.single * nodes[axis] as f32;
        let finite = (0..3).all(|axis| origin[axis].single.is_finite() && far(axis).is_finite());
        // Two roundings, of each and of their product.
        let product = spacing.single * inv_spacing.single;
        let is_inverse = spacing.single > 0.0 && (1.0 - 1e-6..1.0 + 1e-6).contains(&product);
        (agree && counts_fit && finite && is_inverse)
            .then(|| Lattice::from_parameters(origin, [spacing, inv_spacing], nodes))
    }

    pub fn are_valid(&self) -> bool {
        let Self { slope_bound, band, scale, errors, .. } = self;
        let is_slope = (0.0..f32::INFINITY).contains(&slope_bound.single);
        let is_band = band.single > 0.0;
        let is_scale = scale.base.is_finite() && is_valid_scale(*scale, Precision::U16);
        // Not negative, not NaN: as integers, numbers of one sign have the order that they have as numbers.
        let are_bounds = errors.iter().all(|bound| bound.to_bits() <= f64::INFINITY.to_bits());
        agrees(slope_bound) && agrees(band) && is_slope && is_band && is_scale && are_bounds
    }
}

/// Are the samples of all codes finite? Those of f32 do not use it.
pub(super) fn is_valid_scale(scale: Scale, precision: Precision) -> bool {
    let last = match precision {
        Precision::F32 => return true,
        Precision::U16 => f32::from(u16::MAX),
        Precision::U8 => f32::from(u8::MAX),
    };
    scale.base.is_finite() && (scale.base + scale.step * last).is_finite()
}

/// Is the f32 the f64, rounded? By their bits: the f32's, widened, are at most half of its last place away.
fn agrees(parameter: &Parameter) -> bool {
    const EXPONENTS: u64 = 1023 - 127;
    let (single, double) = (parameter.single.to_bits(), parameter.double.to_bits());
    let (magnitude, double_magnitude) = (u64::from(single & !(1 << 31)), double & !(1 << 63));
    if u64::from(single >> 31) != double >> 63 {
        return false;
    }
    match single >> 23 & 0xff {
        // Zero, or too small to be normal in f32.
        0 => double_magnitude >> 52 <= EXPONENTS,
        0xff => magnitude == 0xff << 23 && double_magnitude == 0x7ff << 52,
        _ => (magnitude << 29).wrapping_add(EXPONENTS << 52).abs_diff(double_magnitude) <= 1 << 28,
    }
}

/// The next so many bytes. `None` if there are fewer.
pub(super) fn split<'a>(bytes: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (first, rest) = bytes.split_at_checked(count)?;
    *bytes = rest;
    Some(first)
}

/// The next u32; zero beyond the end, which the sizes of the arrays exclude.
fn word(bytes: &mut &[u8]) -> u32 {
    split(bytes, 4).and_then(|word| word.first_chunk()).map_or(0, |word| u32::from_le_bytes(*word))
}

fn long_word(bytes: &mut &[u8]) -> u64 {
    split(bytes, 8).and_then(|word| word.first_chunk()).map_or(0, |word| u64::from_le_bytes(*word))
}
