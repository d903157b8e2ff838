//! Vector functions over [`Real`], written branch-free so that lanes run them.

use nalgebra::{Matrix3, Vector3};

use crate::number::{Parameter, Real};

/// Length and direction of a vector.
pub(crate) struct Direction<R: Real> {
    pub length: R,
    /// Unit vector; +x where `is_zero`.
    pub unit: Vector3<R>,
    /// Is the length [negligible](Real::is_negligible), so that its square has lost digits?
    pub is_zero: R::Mask,
}

#[inline(always)]
pub(crate) fn direction<R: Real>(vector: Vector3<R>) -> Direction<R> {
    let length = norm(vector);
    let is_zero = length.is_negligible();
    let divisor = R::select(is_zero, R::one(), length);
    let unit = (vector / divisor).zip_map(&Vector3::x(), |unit, x| R::select(is_zero, x, unit));
    Direction { length, unit, is_zero }
}

/// |vector|.
#[inline(always)]
pub(crate) fn norm<R: Real>(vector: Vector3<R>) -> R {
    norm_squared(vector).sqrt()
}

/// |vector|².
#[inline(always)]
pub(crate) fn norm_squared<R: Real>(vector: Vector3<R>) -> R {
    vector.dot(&vector)
}

/// max(|x|, |y|, |z|).
#[inline(always)]
pub(crate) fn largest_component<R: Real>(vector: Vector3<R>) -> R {
    vector.iter().fold(R::zero(), |largest, x| largest.max(x.abs()))
}

#[inline(always)]
pub(crate) fn from_f64<R: Real>(vector: [f64; 3]) -> Vector3<R> {
    Vector3::new(R::from_f64(vector[0]), R::from_f64(vector[1]), R::from_f64(vector[2]))
}

/// A vector of parameters, without a conversion.
#[inline(always)]
pub(crate) fn from_parameters<R: Real>(vector: [Parameter; 3]) -> Vector3<R> {
    Vector3::from(vector.map(R::from_parameter))
}

/// matrix · vector, with the bits of nalgebra's product. Inlined, which vectorization needs.
#[inline(always)]
pub(crate) fn times<R: Real>(matrix: &Matrix3<R>, vector: Vector3<R>) -> Vector3<R> {
    let row = |row: usize| {
        let [x, y, z] = [0, 1, 2].map(|column: usize| matrix.data.0[column % 3][row % 3]);
        x * vector.x + y * vector.y + z * vector.z
    };
    Vector3::new(row(0), row(1), row(2))
}

/// [`Real::select`] for each coordinate.
#[inline(always)]
pub(crate) fn select<R: Real>(mask: R::Mask, yes: Vector3<R>, no: Vector3<R>) -> Vector3<R> {
    Vector3::new(R::select(mask, yes.x, no.x), R::select(mask, yes.y, no.y), R::select(mask, yes.z, no.z))
}
