//! The border to C: the one file with `unsafe` code. Each function makes references of the caller's pointers and calls a safe one.
//!
//! The header asks for pointers that are valid for what they are declared as, and for a blob whose bytes stay where they are.

use core::mem::MaybeUninit;

use super::{OpenBlob, SdfBlobContact, contact, open, sample};

/// `SdfBlob` of the header: room for an open blob. Its owner is C, which copies nothing of it.
#[repr(C, align(8))]
pub struct SdfBlob(MaybeUninit<[u64; 40]>);

const _: () = assert!(size_of::<OpenBlob>() <= size_of::<SdfBlob>() && align_of::<OpenBlob>() <= align_of::<SdfBlob>());

/// Result of a null pointer.
const NULL: i32 = -3;

/// # Safety
/// `blob` and `bytes` are null or valid, the latter for `size` bytes that stay as they are while the blob is used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdf_blob_open(blob: *mut SdfBlob, bytes: *const u8, size: usize) -> i32 {
    if blob.is_null() || bytes.is_null() || size > isize::MAX as usize {
        return NULL;
    }
    // SAFETY: the caller's; an `OpenBlob` fits, see above, and has no destructor.
    unsafe { open(core::slice::from_raw_parts(bytes, size), |open| blob.cast::<OpenBlob>().write(open)) }
}

/// # Safety
/// The pointers are null or valid for what the header says; `blob` was opened with success.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdf_blob_sample(blob: *const SdfBlob, point: *const [f32; 3], out: *mut [f32; 4]) -> i32 {
    // SAFETY: the caller's.
    match unsafe { (blob.cast::<OpenBlob>().as_ref(), point.as_ref(), out.as_mut()) } {
        (Some(blob), Some(point), Some(out)) => sample(blob, *point, out),
        _ => NULL,
    }
}

/// # Safety
/// As [`sdf_blob_sample`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdf_blob_edge(
    blob: *const SdfBlob,
    corners: *const [[f32; 3]; 2],
    margin: f32,
    out: *mut SdfBlobContact,
) -> i32 {
    // SAFETY: the caller's.
    unsafe { of_element(blob, corners, margin, out) }
}

/// # Safety
/// As [`sdf_blob_sample`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sdf_blob_face(
    blob: *const SdfBlob,
    corners: *const [[f32; 3]; 3],
    margin: f32,
    out: *mut SdfBlobContact,
) -> i32 {
    // SAFETY: the caller's.
    unsafe { of_element(blob, corners, margin, out) }
}

/// # Safety
/// As [`sdf_blob_sample`].
#[inline]
unsafe fn of_element<const N: usize>(
    blob: *const SdfBlob,
    corners: *const [[f32; 3]; N],
    margin: f32,
    out: *mut SdfBlobContact,
) -> i32 {
    // SAFETY: the caller's.
    match unsafe { (blob.cast::<OpenBlob>().as_ref(), corners.as_ref(), out.as_mut()) } {
        (Some(blob), Some(corners), Some(out)) => contact(blob, *corners, margin, out),
        _ => NULL,
    }
}

/// Not linked as long as nothing can panic, which `.ci/firmware.sh` checks.
#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}
