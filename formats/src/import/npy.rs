//! NumPy arrays, formats 1 to 3 of numpy.lib.format: three axes of f2, f4 or f8, of either byte order, in C or Fortran order.

use super::{ImportError, Volume, refused, require_finite, room};
use crate::export::NPY_MAGIC;

/// Tells a NumPy file by its first bytes.
pub fn is_npy(bytes: &[u8]) -> bool {
    bytes.starts_with(NPY_MAGIC)
}

/// Reads an array of shape (z, y, x) whose node (0, 0, 0) is at `origin`. Takes at most `max_bytes` for the samples.
pub fn npy(bytes: &[u8], origin: [f64; 3], spacing: f64, max_bytes: f64) -> Result<Volume, ImportError> {
    let Some(rest) = bytes.strip_prefix(NPY_MAGIC) else { return refused("not a NumPy file") };
    let length_bytes = match rest.first() {
        Some(1) => 2,
        Some(2 | 3) => 4,
        Some(version) => return refused(format!("its format version is {version}, and 1 to 3 are known")),
        None => return refused("cut off within its header"),
    };
    let Some((length, rest)) = rest.get(2..).and_then(|rest| rest.split_at_checked(length_bytes)) else {
        return refused("cut off within its header");
    };
    let length = length.iter().rev().fold(0_usize, |length, byte| length << 8 | usize::from(*byte));
    let Some((header, data)) = rest.split_at_checked(length) else { return refused("cut off within its header") };
    let header = String::from_utf8_lossy(header);
    let kind = value(&header, "'descr':").unwrap_or_default().trim_matches('\'');
    let (is_big, width) = match kind {
        "<f2" => (false, 2),
        "<f4" => (false, 4),
        "<f8" => (false, 8),
        ">f2" => (true, 2),
        ">f4" => (true, 4),
        ">f8" => (true, 8),
        other => return refused(format!("its type is {other:.20}: save float32, by array.astype('f4')")),
    };
    let is_fortran = value(&header, "'fortran_order':") == Some("True");
    let shape = shape(&header)?;
    let Some(counts) = <[u64; 3]>::try_from(shape.as_slice()).ok() else {
        return refused(format!("it has {} axes: three are needed, in the order z, y, x", shape.len()));
    };
    let [nz, ny, nx] = counts;
    // Samples that are transposed are there twice.
    let lattice = room(origin, spacing, [nx, ny, nz], if is_fortran { 0.5 * max_bytes } else { max_bytes })?;
    let wanted = lattice.node_count().checked_mul(width);
    if wanted != Some(data.len()) {
        return refused(format!("{} bytes of samples, where {nz} × {ny} × {nx} of {kind} are due", data.len()));
    }
    let little = |chunk: &[u8]| {
        let mut little: [u8; 8] = [0; 8];
        little[..width].copy_from_slice(chunk);
        if is_big {
            little[..width].reverse();
        }
        little
    };
    let double = |chunk: &[u8]| f64::from_le_bytes(little(chunk));
    let number = |chunk: &[u8]| match (width, little(chunk)) {
        (2, [a, b, ..]) => half(u16::from_le_bytes([a, b])),
        (4, [a, b, c, d, ..]) => f32::from_le_bytes([a, b, c, d]),
        _ => double(chunk) as f32,
    };
    let is_too_large = |x: &f64| x.is_finite() && (*x as f32).is_infinite();
    if width == 8
        && let Some((index, x)) = data.chunks_exact(8).map(double).enumerate().find(|(_, x)| is_too_large(x))
    {
        return refused(format!(
            "sample {index} is {x:e}, and samples are f32, of at most {:e}: scale the field",
            f32::MAX
        ));
    }
    let mut samples: Vec<f32> = data.chunks_exact(width).map(number).collect();
    if is_fortran {
        // z runs fastest: transpose.
        let [nx, ny, nz] = lattice.nodes().map(|n| n as usize);
        let old = samples;
        samples = Vec::with_capacity(old.len());
        for z in 0..nz {
            for y in 0..ny {
                samples.extend((0..nx).map(|x| old[(x * ny + y) * nz + z]));
            }
        }
    }
    require_finite(&samples)?;
    Ok(Volume { lattice, samples, background: None })
}

/// The word after a key of the header's dictionary.
fn value<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    header.split_once(key)?.1.trim_start().split([',', '}']).next().map(str::trim)
}

fn shape(header: &str) -> Result<Vec<u64>, ImportError> {
    let inside = header.split_once("'shape':").and_then(|(_, rest)| rest.split_once('(')?.1.split_once(')'));
    let Some((list, _)) = inside else { return refused("its header has no shape") };
    let numbers = list.split(',').map(str::trim).filter(|text| !text.is_empty());
    let parsed: Result<Vec<u64>, _> = numbers.map(str::parse).collect();
    parsed.or_else(|_| refused("its header has no shape"))
}

/// IEEE 754 binary16.
fn half(bits: u16) -> f32 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    let magnitude = match exponent {
        0 => fraction * 2_f32.powi(-24),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1024.0 + fraction) * 2_f32.powi(exponent - 25),
    };
    sign * magnitude
}
