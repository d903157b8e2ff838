//! What may stand in a file, whether it is to be written or was read.

use sdf_core::grid::sparse::{BRICK_SAMPLES, Code, NO_BRICK, Scale, brick_counts};
use sdf_core::grid::{BlockBounds, Lattice};

use super::element::Element;
use super::head::Head;
use super::{About, Layout, Precision, Samples, SparseSamples, layout};

/// Of samples that may be written, with the checksum of their digests left empty; else what is wrong with them.
pub(super) fn head(lattice: &Lattice, samples: &Samples, about: &About) -> Result<Head, String> {
    let sparse = |band: f64, precision: Precision, bricks: usize| Layout::Sparse { band, precision, bricks };
    let layout = match samples {
        Samples::Dense { .. } => Layout::Dense,
        Samples::F32(samples) => sparse(samples.band, Precision::F32, samples.places.len()),
        Samples::U16(samples) => sparse(samples.band, Precision::U16, samples.places.len()),
        Samples::U8(samples) => sparse(samples.band, Precision::U8, samples.places.len()),
    };
    let head = Head { lattice: *lattice, layout, about: about.clone(), digests_sha256: String::new() };
    if let Some(flaw) = head.flaw() {
        return Err(flaw);
    }
    match samples {
        Samples::Dense { distances, bounds } => {
            count("distances", distances.len(), Some(lattice.node_count()))?;
            count("bounds", bounds.len(), layout::place_count(lattice))?;
            finite("sample", distances)?;
            sound_bounds(bounds)?;
        }
        Samples::F32(samples) => sparse_samples(lattice, samples, Precision::F32)?,
        Samples::U16(samples) => sparse_samples(lattice, samples, Precision::U16)?,
        Samples::U8(samples) => sparse_samples(lattice, samples, Precision::U8)?,
    }
    Ok(head)
}

fn sparse_samples<C: Element>(
    lattice: &Lattice,
    samples: &SparseSamples<C>,
    precision: Precision,
) -> Result<(), String> {
    let bricks = samples.places.len();
    count("scales", samples.scales.len(), Some(bricks))?;
    count("samples", samples.samples.len(), bricks.checked_mul(BRICK_SAMPLES))?;
    count("bounds", samples.bounds.len(), Some(bricks))?;
    count("errors", samples.errors.len(), Some(bricks))?;
    count("nodes of the coarse grid", samples.coarse.len(), coarse_count(lattice))?;
    table(lattice, samples.places)?;
    finite("sample", samples.samples)?;
    finite("coarse node", samples.coarse)?;
    sound_scales(samples.scales, precision)?;
    sound_bounds(samples.bounds)?;
    sound_errors(samples.errors)
}

fn coarse_count(lattice: &Lattice) -> Option<usize> {
    layout::coarse_shape(lattice).iter().try_fold(1_usize, |count, along| count.checked_mul(*along))
}

fn count(what: &str, found: usize, wanted: Option<usize>) -> Result<(), String> {
    match wanted {
        Some(wanted) if wanted == found => Ok(()),
        Some(wanted) => Err(format!("{found} {what} where {wanted} belong")),
        None => Err(format!("more {what} belong there than can be counted")),
    }
}

fn finite<T: Element>(what: &str, elements: &[T]) -> Result<(), String> {
    match elements.iter().position(|element| !element.is_valid()) {
        Some(at) => Err(format!("{what} {at} is not finite")),
        None => Ok(()),
    }
}

/// Which brick is at each place.
pub(super) fn table(lattice: &Lattice, places: &[[u32; 3]]) -> Result<Vec<u32>, String> {
    let counts = brick_counts(lattice);
    let count = layout::place_count(lattice).ok_or("more places than can be counted")?;
    let mut table = Vec::new();
    table.try_reserve_exact(count).map_err(|_| "more places than memory has room for")?;
    table.resize(count, NO_BRICK);
    for (brick, place) in places.iter().enumerate() {
        if (0..3).any(|axis| place[axis] >= counts[axis]) {
            return Err(format!("brick {brick} is at {place:?} of {counts:?} places"));
        }
        let [x, y, z] = place.map(|at| at as usize);
        let entry = &mut table[(z * counts[1] as usize + y) * counts[0] as usize + x];
        if *entry != NO_BRICK {
            return Err(format!("bricks {entry} and {brick} are both at {place:?}"));
        }
        *entry = brick as u32;
    }
    Ok(table)
}

pub(super) fn sound_bounds(bounds: &[BlockBounds]) -> Result<(), String> {
    let is_valid = |bounds: &BlockBounds| {
        let finite =
            [bounds.range.lower, bounds.range.upper, bounds.slope_bound].iter().all(|number| number.is_finite());
        finite && bounds.range.lower <= bounds.range.upper && bounds.slope_bound >= 0.0
    };
    match bounds.iter().position(|bounds| !is_valid(bounds)) {
        Some(at) => Err(format!("bounds {at} are {:?}", bounds[at])),
        None => Ok(()),
    }
}

/// None steps back, or beyond all numbers at the last code.
pub(super) fn sound_scales(scales: &[Scale], precision: Precision) -> Result<(), String> {
    let is_valid = |scale: &Scale| {
        let last = match precision {
            Precision::F32 => scale.step,
            Precision::U16 => u16::MAX.decode(*scale),
            Precision::U8 => u8::MAX.decode(*scale),
        };
        scale.base.is_finite() && scale.step >= 0.0 && last.is_finite()
    };
    match scales.iter().position(|scale| !is_valid(scale)) {
        Some(at) => Err(format!("scale {at} is {:?}", scales[at])),
        None => Ok(()),
    }
}

pub(super) fn sound_errors(errors: &[f32]) -> Result<(), String> {
    match errors.iter().position(|error| !(error.is_finite() && *error >= 0.0)) {
        Some(at) => Err(format!("error {at} is {}", errors[at])),
        None => Ok(()),
    }
}
