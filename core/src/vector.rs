use nalgebra::{Matrix3, Vector3};

use crate::number::Real;

/// A length and the direction it was measured in.
pub(crate) struct Direction<R: Real> {
    pub length: R,
    /// Of unit length; +x where the length is zero.
    pub unit: Vector3<R>,
    /// The length is zero, or so small that its square has lost digits.
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

#[inline(always)]
pub(crate) fn norm<R: Real>(vector: Vector3<R>) -> R {
    vector.dot(&vector).sqrt()
}

#[inline(always)]
pub(crate) fn from_f64<R: Real>(vector: [f64; 3]) -> Vector3<R> {
    Vector3::new(R::from_f64(vector[0]), R::from_f64(vector[1]), R::from_f64(vector[2]))
}

/// As nalgebra multiplies, to the same bits, but inlined, for wide vectors are only made of what is.
#[inline(always)]
pub(crate) fn times<R: Real>(matrix: &Matrix3<R>, vector: Vector3<R>) -> Vector3<R> {
    let row = |row: usize| {
        let [x, y, z] = [0, 1, 2].map(|column: usize| matrix.data.0[column % 3][row % 3]);
        x * vector.x + y * vector.y + z * vector.z
    };
    Vector3::new(row(0), row(1), row(2))
}

/// Coordinate by coordinate.
#[inline(always)]
pub(crate) fn select<R: Real>(mask: R::Mask, yes: Vector3<R>, no: Vector3<R>) -> Vector3<R> {
    Vector3::new(R::select(mask, yes.x, no.x), R::select(mask, yes.y, no.y), R::select(mask, yes.z, no.z))
}
