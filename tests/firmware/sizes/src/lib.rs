//! One function for each query of docs/firmware.md, as a program that needs only that one would have it: `query.field.element`.
//!
//! `.ci/firmware.sh --table` links each alone and measures what is left. All are f32 and take nothing but references.

#![no_std]

use sdf_core::contact::{Element, Outcome, contact, lean_contact};
use sdf_core::grid::blob::{BlobBricks, BlobDense};
use sdf_core::grid::sparse::Sparse;
use sdf_core::grid::{Blob, Grid, PlainNormals};
use sdf_core::minimize::{Certified, FrankWolfe, GoldenSection, Minimizer, Newton, PointSampling, ProjectedGradient};
use sdf_core::nalgebra::Vector3;
use sdf_core::shapes::{Cuboid, Sphere};
use sdf_core::{EnclosedSdf, Simplex};

type DenseF32 = Grid<BlobDense<'static, [u8; 4]>>;
type DenseU16 = Grid<BlobDense<'static, [u8; 2]>>;
type SparseU16 = Grid<Sparse<BlobBricks<'static, [u8; 2]>>>;
type PlainU16 = PlainNormals<Grid<BlobDense<'static, [u8; 2]>>>;

/// Distance, weights and point of the minimum: what a program needs that has normals of its own.
#[inline(always)]
fn search<const N: usize>(
    field: &impl EnclosedSdf,
    minimizer: &impl Minimizer<N>,
    corners: &[[f32; 3]; N],
    out: &mut [f32; 7],
) {
    let simplex = Simplex { corners: corners.map(Vector3::from) };
    let minimum = minimizer.minimize(field, &simplex);
    out[0] = minimum.sample.value;
    out[1..4].iter_mut().zip(minimum.weights).for_each(|(out, weight)| *out = weight);
    out[4..].iter_mut().zip(&minimum.point).for_each(|(out, x)| *out = *x);
}

fn element<const N: usize>(corners: &[[f32; 3]; N]) -> Element<f32, N> {
    Element { id: 0, vertices: [0; N], simplex: Simplex { corners: corners.map(Vector3::from) } }
}

fn write<const N: usize>(outcome: Outcome<f32, N>, out: &mut [f32; 7]) {
    if let Outcome::Contact(contact) = outcome {
        *out = [0.0; 7];
        out[0] = contact.distance;
        out[1..4].copy_from_slice(contact.normal.as_slice());
        out[4..].copy_from_slice(contact.surface_point.as_slice());
    }
}

/// One exported function for each query.
macro_rules! queries {
    ($($kind:ident $minimizer:ident $field:ident $corners:literal $name:literal;)*) => {$(
        const _: () = {
            // SAFETY: no other function has this name.
            #[unsafe(export_name = $name)]
            #[allow(improper_ctypes_definitions, reason = "measured, not called from C")]
            pub extern "C" fn query(field: &$field, corners: &[[f32; 3]; $corners], out: &mut [f32; 7]) {
                queries!(@ $kind $minimizer, field, corners, out);
            }
        };
    )*};
    (@ search $minimizer:ident, $field:ident, $corners:ident, $out:ident) => {
        search($field, &$minimizer::default(), $corners, $out)
    };
    (@ lean $minimizer:ident, $field:ident, $corners:ident, $out:ident) => {
        write(lean_contact($field, &$minimizer::default(), 0.0, &element($corners)), $out)
    };
    (@ full $minimizer:ident, $field:ident, $corners:ident, $out:ident) => {
        write(contact($field, &$minimizer::default(), 0.0, &element($corners)), $out)
    };
}

queries! {
    search GoldenSection Sphere 2 "golden section.sphere.edge";
    search GoldenSection Cuboid 2 "golden section.box.edge";
    search GoldenSection DenseU16 2 "golden section.dense u16.edge";
    search GoldenSection SparseU16 2 "golden section.sparse u16.edge";
    search FrankWolfe Sphere 2 "Frank-Wolfe.sphere.edge";
    search FrankWolfe Cuboid 2 "Frank-Wolfe.box.edge";
    search FrankWolfe DenseU16 2 "Frank-Wolfe.dense u16.edge";
    search FrankWolfe SparseU16 2 "Frank-Wolfe.sparse u16.edge";
    search FrankWolfe Sphere 3 "Frank-Wolfe.sphere.face";
    search FrankWolfe Cuboid 3 "Frank-Wolfe.box.face";
    search FrankWolfe DenseF32 3 "Frank-Wolfe.dense f32.face";
    search FrankWolfe DenseU16 3 "Frank-Wolfe.dense u16.face";
    search FrankWolfe SparseU16 3 "Frank-Wolfe.sparse u16.face";
    search ProjectedGradient Cuboid 3 "projected gradient.box.face";
    search ProjectedGradient DenseU16 3 "projected gradient.dense u16.face";
    search ProjectedGradient SparseU16 3 "projected gradient.sparse u16.face";
    search Newton Cuboid 3 "Newton.box.face";
    search Newton DenseU16 3 "Newton.dense u16.face";
    search Newton SparseU16 3 "Newton.sparse u16.face";
    search PointSampling Cuboid 3 "point sampling.box.face";
    search PointSampling DenseU16 3 "point sampling.dense u16.face";
    search PointSampling SparseU16 3 "point sampling.sparse u16.face";
    search Certified Cuboid 3 "certified.box.face";
    search Certified DenseU16 3 "certified.dense u16.face";
    lean FrankWolfe Cuboid 3 "Frank-Wolfe, `lean_contact`.box.face";
    lean FrankWolfe PlainU16 3 "Frank-Wolfe, `lean_contact`, plain normals.dense u16.face";
    lean FrankWolfe DenseU16 3 "Frank-Wolfe, `lean_contact`.dense u16.face";
    lean FrankWolfe SparseU16 3 "Frank-Wolfe, `lean_contact`.sparse u16.face";
    full FrankWolfe DenseU16 3 "Frank-Wolfe, `contact`.dense u16.face";
    full Certified DenseU16 3 "certified, `contact`.dense u16.face";
}

/// Once for each blob, before any query.
#[unsafe(export_name = "opening.dense u16.")]
#[allow(improper_ctypes_definitions, reason = "measured, not called from C")]
pub extern "C" fn open_dense(bytes: &'static [u8], out: &mut Option<DenseU16>) {
    *out = Blob::open(bytes).ok().and_then(|blob| blob.dense());
}

/// Once for each blob, before any query.
#[unsafe(export_name = "opening.sparse u16.")]
#[allow(improper_ctypes_definitions, reason = "measured, not called from C")]
pub extern "C" fn open_sparse(bytes: &'static [u8], out: &mut Option<SparseU16>) {
    *out = Blob::open(bytes).ok().and_then(|blob| blob.sparse());
}

/// Linked where a query can panic, which the table would show.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}
