//! Validity of a grid's parts: before a file is written, and after one is read.

use sdf_core::Interval;
use sdf_core::grid::owned::{Blocks, Precision};
use sdf_core::grid::sparse::{BRICK_SAMPLES, Code, NO_BRICK, Scale, brick_counts};
use sdf_core::grid::{BlockBounds, Lattice};

use super::coding::Coding;
use super::header::Header;
use super::{
    About, DenseBlockSamples, GridFault, MeshInfo, Samples, SparseInfo, SparseSamples, StoredMesh, kept_mesh, layout,
};
use crate::hdf5::Element;

/// The header of a grid that may be written, without the checksum of its digests; or what is wrong with the grid. A sparse grid's
/// samples need not be here.
pub(super) fn checked_header(
    lattice: &Lattice,
    samples: &Samples,
    about: &About,
    mesh: Option<&StoredMesh>,
    coding: Coding,
    are_samples_here: bool,
) -> Result<Header, String> {
    fn sparse<C>(samples: &SparseSamples<C>, precision: Precision) -> Option<SparseInfo> {
        let SparseSamples { band, deep_values, slots, .. } = *samples;
        Some(SparseInfo { band, precision, bricks: slots.len(), deep_values })
    }
    let (version, precision) = match samples {
        Samples::Dense { .. } | Samples::F32(_) => (layout::PLAIN_VERSION, Precision::F32),
        Samples::U16(_) => (layout::PLAIN_VERSION, Precision::U16),
        Samples::U8(_) => (layout::PLAIN_VERSION, Precision::U8),
        Samples::DenseU16(_) => (layout::DENSE_CODES_VERSION, Precision::U16),
        Samples::DenseU8(_) => (layout::DENSE_CODES_VERSION, Precision::U8),
    };
    let sparse = match samples {
        Samples::Dense { .. } | Samples::DenseU16(_) | Samples::DenseU8(_) => None,
        Samples::F32(samples) => sparse(samples, Precision::F32),
        Samples::U16(samples) => sparse(samples, Precision::U16),
        Samples::U8(samples) => sparse(samples, Precision::U8),
    };
    if let Some(violation) = mesh.and_then(kept_mesh::violation) {
        return Err(violation);
    }
    let mesh = mesh.map(|mesh| MeshInfo {
        vertices: mesh.vertices.len(),
        triangles: mesh.triangles.len(),
        is_sign_continuous: mesh.is_sign_continuous,
    });
    let header = Header {
        version,
        lattice: *lattice,
        sparse,
        precision,
        coding,
        about: about.clone(),
        mesh,
        digests_sha256: String::new(),
    };
    if let Some(violation) = header.violation().or_else(|| header.brick_violation()) {
        return Err(violation);
    }
    match samples {
        Samples::Dense { distances, bounds } => {
            count("distances", distances.len(), Some(lattice.node_count()))?;
            count("bounds", bounds.len(), layout::slot_count(lattice))?;
            all_finite("sample", distances)?;
            valid_bounds(bounds)?;
        }
        Samples::DenseU16(samples) => block_samples(lattice, samples, Precision::U16)?,
        Samples::DenseU8(samples) => block_samples(lattice, samples, Precision::U8)?,
        Samples::F32(samples) => sparse_samples(lattice, samples, Precision::F32, are_samples_here)?,
        Samples::U16(samples) => sparse_samples(lattice, samples, Precision::U16, are_samples_here)?,
        Samples::U8(samples) => sparse_samples(lattice, samples, Precision::U8, are_samples_here)?,
    }
    Ok(header)
}

fn block_samples<C>(lattice: &Lattice, samples: &DenseBlockSamples<C>, precision: Precision) -> Result<(), String> {
    let blocks = samples.slots.len();
    count("blocks", blocks, layout::slot_count(lattice))?;
    count("scales", samples.scales.len(), Some(blocks))?;
    count("samples", samples.samples.len(), blocks.checked_mul(BRICK_SAMPLES))?;
    count("bounds", samples.bounds.len(), Some(blocks))?;
    // Each slot has a block, as there are as many.
    brick_table(lattice, samples.slots)?;
    valid_scales(samples.scales, precision)?;
    valid_bounds(samples.bounds)
}

fn sparse_samples<C: Element>(
    lattice: &Lattice,
    samples: &SparseSamples<C>,
    precision: Precision,
    are_samples_here: bool,
) -> Result<(), String> {
    let bricks = samples.slots.len();
    count("scales", samples.scales.len(), Some(bricks))?;
    // Others are checked when they are read.
    let count_here = if are_samples_here { bricks.checked_mul(BRICK_SAMPLES) } else { Some(0) };
    count("samples", samples.samples.len(), count_here)?;
    count("bounds", samples.bounds.len(), Some(bricks))?;
    count("errors", samples.errors.len(), Some(bricks))?;
    count("nodes of the coarse grid", samples.coarse.len(), coarse_count(lattice))?;
    brick_table(lattice, samples.slots)?;
    all_finite("sample", samples.samples)?;
    all_finite("coarse node", samples.coarse)?;
    valid_scales(samples.scales, precision)?;
    valid_bounds(samples.bounds)?;
    valid_errors(samples.errors)
}

fn coarse_count(lattice: &Lattice) -> Option<usize> {
    layout::coarse_shape(lattice).iter().try_fold(1_usize, |count, nodes| count.checked_mul(*nodes))
}

fn count(what: &str, found: usize, expected: Option<usize>) -> Result<(), String> {
    match expected {
        Some(expected) if expected == found => Ok(()),
        Some(expected) => Err(format!("{found} {what} where {expected} are expected")),
        None => Err(format!("the number of {what} overflows")),
    }
}

fn all_finite<T: Element>(what: &str, elements: &[T]) -> Result<(), String> {
    match elements.iter().position(|element| !element.is_finite()) {
        Some(index) => Err(format!("{what} {index} is not finite")),
        None => Ok(()),
    }
}

/// For each brick slot the index of its brick or [`NO_BRICK`].
pub(super) fn brick_table(lattice: &Lattice, slots: &[[u32; 3]]) -> Result<Blocks<u32>, String> {
    let counts = brick_counts(lattice);
    let mut table = Blocks::new(counts, NO_BRICK).ok_or("too many brick slots")?;
    for (brick, slot) in slots.iter().enumerate() {
        let Some(entry) = table.get_mut(*slot) else {
            return Err(format!("brick {brick} is at {slot:?} of {counts:?} slots"));
        };
        if *entry != NO_BRICK {
            return Err(format!("bricks {entry} and {brick} are both at {slot:?}"));
        }
        *entry = brick as u32;
    }
    Ok(table)
}

/// Block bounds from rows of three numbers: lower, upper, slope.
pub(super) fn block_bounds(numbers: &[f32]) -> Result<Vec<BlockBounds>, GridFault> {
    let row = |numbers: &[f32]| BlockBounds {
        range: Interval { lower: numbers[0], upper: numbers[1] },
        slope_bound: numbers[2],
    };
    let bounds: Vec<BlockBounds> = numbers.chunks_exact(3).map(row).collect();
    valid_bounds(&bounds).map_err(GridFault::damaged)?;
    Ok(bounds)
}

/// An error unless every bound is finite, lower ≤ upper, and slope ≥ 0.
fn valid_bounds(bounds: &[BlockBounds]) -> Result<(), String> {
    let is_valid = |bounds: &BlockBounds| {
        let is_finite =
            [bounds.range.lower, bounds.range.upper, bounds.slope_bound].iter().all(|number| number.is_finite());
        is_finite && bounds.range.lower <= bounds.range.upper && bounds.slope_bound >= 0.0
    };
    match bounds.iter().position(|bounds| !is_valid(bounds)) {
        Some(index) => {
            let BlockBounds { range: Interval { lower, upper }, slope_bound } = bounds[index];
            Err(format!("bounds {index} are {lower} to {upper}, with a slope of {slope_bound}"))
        }
        None => Ok(()),
    }
}

/// An error unless every step is at least zero and the largest code decodes to a finite value.
pub(super) fn valid_scales(scales: &[Scale], precision: Precision) -> Result<(), String> {
    let is_valid = |scale: &Scale| {
        let max_value = match precision {
            Precision::F32 => scale.step,
            Precision::U16 => u16::MAX.decode(*scale),
            Precision::U8 => u8::MAX.decode(*scale),
        };
        scale.base.is_finite() && scale.step >= 0.0 && max_value.is_finite()
    };
    match scales.iter().position(|scale| !is_valid(scale)) {
        Some(index) => {
            let Scale { base, step } = scales[index];
            Err(format!("scale {index} has base {base:?} and step {step:?}"))
        }
        None => Ok(()),
    }
}

/// An error unless every error bound is finite and at least zero.
pub(super) fn valid_errors(errors: &[f32]) -> Result<(), String> {
    match errors.iter().position(|error| !(error.is_finite() && *error >= 0.0)) {
        Some(index) => Err(format!("error {index} is {}", errors[index])),
        None => Ok(()),
    }
}
