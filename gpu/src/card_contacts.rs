//! Contacts that stay in the card's memory, for programs that go on with them there: [`CardContacts`].

use std::mem::offset_of;

use cudarc::driver::{CudaSlice, DevicePtr};

use sdf_core::contact::ContactStatus;

use crate::abi::ContactRecord;
use crate::record;
use crate::{Gpu, GpuError};

/// Contacts in the card's memory, in no particular order: rows of [`STRIDE`](Self::STRIDE) bytes. A query that goes on does not change
/// them. Dropping them waits for all work of the card, as any stream of it may still read them.
#[derive(Debug)]
pub struct CardContacts {
    gpu: Gpu,
    records: CudaSlice<ContactRecord>,
    count: usize,
}

/// A column of [`CardContacts`].
#[derive(Clone, Copy, Debug)]
pub struct CardColumn {
    /// Name as in contact files (docs/contacts.md).
    pub name: &'static str,
    /// Bytes from the start of a row.
    pub offset: usize,
    /// Numbers of four bytes each.
    pub numbers: usize,
    /// f32, else u32.
    pub is_float: bool,
}

macro_rules! columns {
    ($($field:ident $name:literal $numbers:literal $type:ident),+) => {
        &[$(CardColumn {
            name: $name,
            offset: offset_of!(ContactRecord, $field),
            numbers: $numbers,
            is_float: columns!(@ $type),
        }),+]
    };
    (@ f32) => { true };
    (@ u32) => { false };
}

impl CardContacts {
    /// Bytes from a contact to the next.
    pub const STRIDE: usize = size_of::<ContactRecord>();

    /// Meaning of each number in the column `status`: the card counts them in the order of the core, not in that of contact files.
    pub const STATUSES: [ContactStatus; 6] = record::STATUSES;

    /// Kinds of elements and features have the codes of contact files. Where the field's answer is not finite, `element` is 4294967295 and the rest means nothing.
    pub const COLUMNS: &[CardColumn] = columns!(
        kind "element" 1 u32, element "id" 1 u32, vertices "vertices" 3 u32, feature_kind "feature" 1 u32,
        feature "feature_id" 2 u32, weights "weights" 3 f32, point "point" 3 f32, surface_point "surface_point" 3 f32,
        normal "normal" 3 f32, slope "slope" 1 f32, distance "distance" 1 f32, lower_bound "lower_bound" 1 f32,
        error_bound "error_bound" 1 f32, shape_lower_bound "shape_lower_bound" 1 f32, evaluations "evaluations" 1 u32,
        status "status" 1 u32
    );

    /// Copies the first rows of a query's buffer.
    pub(crate) fn copy(gpu: &Gpu, from: &CudaSlice<ContactRecord>, count: usize) -> Result<Self, GpuError> {
        // SAFETY: all that is counted is written below.
        let mut records = unsafe { gpu.stream.alloc(count.max(1))? };
        if count > 0 {
            gpu.stream.memcpy_dtod(&from.slice(0..count), &mut records)?;
        }
        gpu.stream.synchronize()?;
        Ok(Self { gpu: gpu.clone(), records, count })
    }

    /// Number of contacts.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Is there none?
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Address of the first contact in the card's memory, which lives as long as this.
    pub fn address(&self) -> u64 {
        self.records.device_ptr(&self.gpu.stream).0
    }
}

impl Drop for CardContacts {
    fn drop(&mut self) {
        if self.count > 0 {
            // A card that fails has no work left that reads them.
            let _ = self.gpu.context.synchronize();
        }
    }
}
