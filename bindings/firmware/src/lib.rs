//! sdftool for C on a microcontroller: the functions of `include/sdf_blob.h`.
//!
//! | question | file |
//! |---|---|
//! | How do pointers become references? The only `unsafe` code | `border` |
//! | Which kinds of blobs are linked, and what is a contact? | here |
//!
//! All is f32: `lean_contact` of the core. Nothing here allocates, panics, or takes a lock.

#![cfg_attr(target_os = "none", no_std)]

mod border;

use sdf_core::contact::{Contact, Element, Outcome, lean_contact};
use sdf_core::grid::{Blob, Grid, Storage};
use sdf_core::minimize::FrankWolfe;
use sdf_core::nalgebra::Vector3;
use sdf_core::{Sample, Sdf, Simplex};

/// A grid with smooth normals, or with its own gradient as normals.
#[cfg(feature = "smooth")]
type Field<S> = Grid<S>;
#[cfg(not(feature = "smooth"))]
type Field<S> = sdf_core::grid::PlainNormals<Grid<S>>;

fn field<S: Storage>(grid: Grid<S>) -> Field<S> {
    #[cfg(feature = "smooth")]
    return grid;
    #[cfg(not(feature = "smooth"))]
    sdf_core::grid::PlainNormals(grid)
}

/// The enum of the kinds that are linked, and a call for whichever it is.
macro_rules! kinds {
    ($($feature:literal $variant:ident $method:ident $code:ty, $storage:ty;)+) => {
        /// An open blob.
        pub enum OpenBlob<'a> {
            $(
                #[cfg(feature = $feature)]
                $variant(Field<$storage>),
            )+
            /// Keeps the lifetime where no kind is linked; never made.
            #[doc(hidden)]
            Never(core::convert::Infallible, core::marker::PhantomData<&'a u8>),
        }

        impl<'a> OpenBlob<'a> {
            /// `None` of a kind that is not linked.
            fn new(blob: &Blob<'a>) -> Option<Self> {
                $(
                    #[cfg(feature = $feature)]
                    if let Some(grid) = blob.$method::<$code>() {
                        return Some(Self::$variant(field(grid)));
                    }
                )+
                let _ = blob;
                None
            }

            fn sample(&self, point: Vector3<f32>) -> Sample<f32> {
                match self {
                    $(
                        #[cfg(feature = $feature)]
                        Self::$variant(field) => field.sample(point),
                    )+
                    Self::Never(never, _) => match *never {},
                }
            }

            fn contact<const N: usize>(&self, element: &Element<f32, N>, margin: f32) -> Outcome<f32, N> {
                match self {
                    $(
                        #[cfg(feature = $feature)]
                        Self::$variant(field) => lean_contact(field, &FrankWolfe::default(), margin, element),
                    )+
                    Self::Never(never, _) => match *never {},
                }
            }
        }
    };
}

kinds! {
    "dense-f32" DenseF32 dense [u8; 4], sdf_core::grid::blob::BlobDense<'a, [u8; 4]>;
    "dense-u16" DenseU16 dense [u8; 2], sdf_core::grid::blob::BlobDense<'a, [u8; 2]>;
    "dense-u8" DenseU8 dense u8, sdf_core::grid::blob::BlobDense<'a, u8>;
    "sparse-f32" SparseF32 sparse [u8; 4], sdf_core::grid::sparse::Sparse<sdf_core::grid::blob::BlobBricks<'a, [u8; 4]>>;
    "sparse-u16" SparseU16 sparse [u8; 2], sdf_core::grid::sparse::Sparse<sdf_core::grid::blob::BlobBricks<'a, [u8; 2]>>;
    "sparse-u8" SparseU8 sparse u8, sdf_core::grid::sparse::Sparse<sdf_core::grid::blob::BlobBricks<'a, u8>>;
}

/// `SdfBlobContact` of the header.
#[repr(C)]
pub struct SdfBlobContact {
    distance: f32,
    lower_bound: f32,
    slope: f32,
    weights: [f32; 3],
    point: [f32; 3],
    surface_point: [f32; 3],
    normal: [f32; 3],
    feature: u32,
    status: u32,
    evaluations: u32,
}

impl From<Contact<f32>> for SdfBlobContact {
    fn from(contact: Contact<f32>) -> Self {
        Self {
            distance: contact.distance,
            lower_bound: contact.lower_bound,
            slope: contact.slope,
            weights: contact.weights,
            point: contact.point.into(),
            surface_point: contact.surface_point.into(),
            normal: contact.normal.into(),
            feature: (contact.key() >> 32 & 7) as u32,
            status: contact.status as u32,
            evaluations: contact.evaluations,
        }
    }
}

/// Results of the functions, as the header names them.
const OK: i32 = 0;
const CONTACT: i32 = 1;
const NOT_FINITE: i32 = -1;
const NOT_LINKED: i32 = -2;
/// Minus the number of the [`BlobError`](sdf_core::grid::blob::BlobError) is added.
const REFUSED: i32 = -10;

fn open<'a>(bytes: &'a [u8], put: impl FnOnce(OpenBlob<'a>)) -> i32 {
    match Blob::open(bytes) {
        Err(error) => REFUSED.wrapping_sub(error as i32),
        Ok(blob) => match OpenBlob::new(&blob) {
            Some(blob) => {
                put(blob);
                OK
            }
            None => NOT_LINKED,
        },
    }
}

fn sample(blob: &OpenBlob, point: [f32; 3], out: &mut [f32; 4]) -> i32 {
    let Sample { value, gradient, status } = blob.sample(point.into());
    if status.not_finite {
        return NOT_FINITE;
    }
    *out = [value, gradient.x, gradient.y, gradient.z];
    OK
}

/// Largest magnitude of a margin, as of a coordinate: squares beyond it overflow.
const LARGEST: f32 = 1e18;

fn contact<const N: usize>(blob: &OpenBlob, corners: [[f32; 3]; N], margin: f32, out: &mut SdfBlobContact) -> i32 {
    if !(-LARGEST..=LARGEST).contains(&margin) {
        return NOT_FINITE;
    }
    let simplex = Simplex { corners: corners.map(Vector3::from) };
    let element = Element { id: 0, vertices: core::array::from_fn(|corner| corner as u32), simplex };
    match blob.contact(&element, margin) {
        Outcome::Contact(found) => {
            *out = found.into();
            CONTACT
        }
        Outcome::NotFinite => NOT_FINITE,
        Outcome::Culled | Outcome::Separated(_) => OK,
    }
}
