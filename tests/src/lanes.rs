//! Packs points and simplices into SIMD lanes, and unpacks samples.

use std::array::from_fn;

use nalgebra::Vector3;
use sdf_core::{Float, Lanes, Sample, Simplex, Status};

pub fn pack_points<R: Float, const L: usize>(points: &[Vector3<R>; L]) -> Vector3<Lanes<R, L>> {
    Vector3::from_fn(|axis, _| Lanes(from_fn(|lane| points[lane][axis])))
}

pub fn pack_simplices<R: Float, const L: usize, const N: usize>(
    simplices: &[Simplex<R, N>; L],
) -> Simplex<Lanes<R, L>, N> {
    Simplex { corners: from_fn(|corner| pack_points(&from_fn(|lane| simplices[lane].corners[corner]))) }
}

pub fn lane_sample<R: Float, const L: usize>(sample: &Sample<Lanes<R, L>>, lane: usize) -> Sample<R> {
    Sample {
        value: sample.value.0[lane],
        gradient: sample.gradient.map(|x| x.0[lane]),
        status: Status {
            degenerate_gradient: sample.status.degenerate_gradient.0[lane],
            outside_grid: sample.status.outside_grid.0[lane],
            beyond_band: sample.status.beyond_band.0[lane],
            not_finite: sample.status.not_finite.0[lane],
        },
    }
}
