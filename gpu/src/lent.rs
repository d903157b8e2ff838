//! Arrays of other programs that are in the card's memory: may kernels read them where they are, and from when on?
//!
//! The lender promises that the array stays where it is. The driver checks the rest: the address is memory of this card and not of the
//! host, and the whole array lies in it. Adjacent mappings count as one piece of memory.

use cudarc::driver::result::{DriverError, memcpy_dtod_async, memcpy_dtoh_async, stream};
use cudarc::driver::{CudaSlice, DevicePtr, sys};

use crate::{Gpu, GpuError};

use sys::CUpointer_attribute as Attribute;

/// Rows of three numbers of four bytes each in the card's memory, which belong to somebody else: points in f32, or faces in u32.
#[derive(Clone, Copy, Debug)]
pub struct LentRows {
    pub(crate) address: u64,
    pub(crate) rows: usize,
}

impl LentRows {
    /// Number of rows.
    pub fn count(&self) -> usize {
        self.rows
    }
}

/// A row of a lent array: three numbers of four bytes.
pub trait LentRow: Copy + Default + private::Sealed {}

impl LentRow for [f32; 3] {}
impl LentRow for [u32; 3] {}

mod private {
    pub trait Sealed {}
    impl Sealed for [f32; 3] {}
    impl Sealed for [u32; 3] {}
}

/// Time from which a lent array holds what it should.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ready {
    /// From now on.
    Now,
    /// Once the work is done that this stream of the driver has: 1 is the default stream, 2 that of the thread, all else a handle.
    AfterStream(u64),
    /// Once all work is done that any stream of the card has.
    AfterAll,
}

/// `CU_MEMORYTYPE_HOST`.
const HOST: u32 = sys::CUmemorytype::CU_MEMORYTYPE_HOST as u32;

/// The card that all queries run on.
const CARD: i32 = 0;

const ROW_BYTES: u64 = 12;

impl Gpu {
    /// Takes rows of three numbers of four bytes, one after the other, at an address in the card's memory, and waits for them.
    ///
    /// # Safety
    ///
    /// From now on, until the last query that has the rows is dropped or has other points, the memory stays allocated, and nobody
    /// writes to it while a query looks for contacts. A stream that is waited for exists.
    pub unsafe fn lend(&self, address: u64, rows: usize, ready: Ready) -> Result<LentRows, GpuError> {
        self.context.bind_to_thread()?;
        if rows == 0 {
            return Ok(LentRows { address: 0, rows });
        }
        if u32::try_from(rows).is_err() {
            return Err(GpuError::Lent("an array of more rows than 32 bits count"));
        }
        let bytes = (rows as u64).checked_mul(ROW_BYTES).filter(|bytes| address.checked_add(*bytes).is_some());
        check_memory(address, bytes.ok_or(GpuError::Lent("an array of more bytes than there are addresses"))?)?;
        match ready {
            Ready::Now => {}
            // SAFETY: the caller's.
            Ready::AfterStream(handle) => unsafe { stream::synchronize(handle as sys::CUstream)? },
            Ready::AfterAll => self.context.synchronize()?,
        }
        Ok(LentRows { address, rows })
    }

    /// A copy of its own of lent faces, on the card.
    pub(crate) fn copy_lent(&self, lent: &LentRows) -> Result<CudaSlice<u32>, GpuError> {
        let count = 3 * lent.rows;
        // An allocation of nothing is an error. SAFETY: all that is read is written below.
        let copy = unsafe { self.stream.alloc(count.max(1))? };
        if count > 0 {
            let to = copy.device_ptr(&self.stream).0;
            // SAFETY: both lists have that many numbers.
            unsafe { memcpy_dtod_async(to, lent.address, 4 * count, self.stream.cu_stream())? };
        }
        Ok(copy)
    }

    /// Lent points as `[f32; 3]`, or lent faces as `[u32; 3]`.
    pub fn read_lent<T: LentRow>(&self, lent: &LentRows) -> Result<Vec<T>, GpuError> {
        let mut rows = vec![T::default(); lent.rows];
        if !rows.is_empty() {
            self.context.bind_to_thread()?;
            // SAFETY: the array has that many rows, as `lend` saw, and any bytes are numbers.
            unsafe { memcpy_dtoh_async(&mut rows, lent.address, self.stream.cu_stream())? };
            self.stream.synchronize()?;
        }
        Ok(rows)
    }
}

/// Do all bytes from this address on lie in memory of the card?
fn check_memory(address: u64, bytes: u64) -> Result<(), GpuError> {
    if !address.is_multiple_of(4) {
        return Err(GpuError::Lent("an address that no number of four bytes has"));
    }
    let end = address + bytes;
    let mut place = address;
    while place < end {
        let beyond = if place == address {
            "an address that is not in the card's memory: lend an array of the card, or give one of the host as it is"
        } else {
            "an array that ends beyond its memory"
        };
        let unknown = |_: DriverError| GpuError::Lent(beyond);
        // SAFETY: the types are those that CUDA's documentation gives for these attributes.
        let (kind, is_managed, card, start, size) = unsafe {
            (
                attribute::<u32>(place, Attribute::CU_POINTER_ATTRIBUTE_MEMORY_TYPE).map_err(unknown)?,
                attribute::<u32>(place, Attribute::CU_POINTER_ATTRIBUTE_IS_MANAGED).map_err(unknown)?,
                attribute::<i32>(place, Attribute::CU_POINTER_ATTRIBUTE_DEVICE_ORDINAL).map_err(unknown)?,
                attribute::<u64>(place, Attribute::CU_POINTER_ATTRIBUTE_RANGE_START_ADDR).map_err(unknown)?,
                attribute::<usize>(place, Attribute::CU_POINTER_ATTRIBUTE_RANGE_SIZE).map_err(unknown)?,
            )
        };
        // Managed memory moves between host and card by itself.
        if is_managed == 0 && kind == HOST {
            return Err(GpuError::Lent("memory of the host: give the array as it is, without the card"));
        }
        if is_managed == 0 && card != CARD {
            return Err(GpuError::Lent("memory of another card than the first, where the kernels run"));
        }
        let next = start.saturating_add(size as u64);
        if next <= place {
            return Err(GpuError::Lent(beyond));
        }
        place = next;
    }
    Ok(())
}

/// Answer of the driver about an address.
///
/// # Safety
///
/// The attribute's value is a `T`.
unsafe fn attribute<T: Default>(address: u64, attribute: Attribute) -> Result<T, DriverError> {
    let mut value = T::default();
    // SAFETY: the caller's; the driver writes a value of that type.
    unsafe { sys::cuPointerGetAttribute((&raw mut value).cast(), attribute, address).result()? };
    Ok(value)
}
