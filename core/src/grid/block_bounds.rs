use super::sparse::{BRICK, brick_counts};
use super::{BlockBounds, Lattice, Storage};
use crate::number::Float;

/// A storage beside which stands what is certain of each place of 8 × 8 × 8 nodes, so that culls can go by what is near an
/// element and not by the steepest cell of all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WithBlockBounds<S, B> {
    storage: S,
    bounds: B,
    /// Along each axis.
    places: [u32; 3],
}

impl<S: Storage, B: AsRef<[BlockBounds]>> WithBlockBounds<S, B> {
    /// `bounds` has one for each place, x fastest, as many as [`brick_counts`] says; else `None`.
    pub fn new(lattice: &Lattice, storage: S, bounds: B) -> Option<Self> {
        let places = brick_counts(lattice);
        let count = places.iter().try_fold(1, |n: usize, along| n.checked_mul(*along as usize));
        (count == Some(bounds.as_ref().len())).then_some(Self { storage, bounds, places })
    }

    pub fn storage(&self) -> &S {
        &self.storage
    }

    pub fn bounds(&self) -> &[BlockBounds] {
        self.bounds.as_ref()
    }
}

impl<S: Storage, B: AsRef<[BlockBounds]>> Storage for WithBlockBounds<S, B> {
    #[inline(always)]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        self.storage.corners(cell)
    }

    #[inline(always)]
    fn corners_in_lanes<R: Float, const N: usize>(&self, cells: [[R; N]; 3]) -> [[R; N]; 8] {
        self.storage.corners_in_lanes(cells)
    }

    const HAS_BLOCK_BOUNDS: bool = true;

    #[inline(always)]
    fn block_bounds(&self, first: [u32; 3], last: [u32; 3]) -> Option<BlockBounds> {
        let (along_x, along_y) = (self.places[0] as usize, self.places[1] as usize);
        merge_blocks(first, last, |place| {
            let (x, y, z) = (place[0] as usize, place[1] as usize, place[2] as usize);
            self.bounds.as_ref().get((z * along_y + y) * along_x + x).copied()
        })
    }
}

/// How many places are looked at before it is given up: an element as large as this gains little from what is known of
/// places.
const MAX_PLACES: u32 = 64;

/// Of all nodes in the places of the nodes from `first` to `last`.
#[inline(always)]
pub(super) fn merge_blocks(
    first: [u32; 3],
    last: [u32; 3],
    of_place: impl Fn([u32; 3]) -> Option<BlockBounds>,
) -> Option<BlockBounds> {
    let place = |[x, y, z]: [u32; 3]| [x / BRICK, y / BRICK, z / BRICK];
    let (first, last) = (place(first), place(last));
    let nothing = BlockBounds::EMPTY;
    // Most elements are no larger than a place.
    if first == last {
        return Some(nothing.union(of_place(first)?));
    }
    let mut count = 1_u32;
    for axis in 0..3 {
        count = count.saturating_mul(last[axis].checked_sub(first[axis])?.saturating_add(1));
    }
    if count > MAX_PLACES {
        return None;
    }
    let mut bounds = nothing;
    for z in first[2]..=last[2] {
        for y in first[1]..=last[1] {
            for x in first[0]..=last[0] {
                bounds = bounds.union(of_place([x, y, z])?);
            }
        }
    }
    Some(bounds)
}
