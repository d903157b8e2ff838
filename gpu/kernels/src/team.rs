//! Storages whose lanes a team of threads computes.

use sdf_core::Float;
#[cfg(target_arch = "nvptx64")]
use sdf_core::grid::TEAM_LANES;
use sdf_core::grid::{BlockBounds, CellErrors, JumpLimits, Storage};

/// A storage for teams of eight threads, each with a lane: see [`Storage::LANES_OF_THREAD`]. Kernels without teams have no such lanes. On
/// the CPU one thread has them all.
#[derive(Clone, Copy)]
pub struct OfTeam<S>(pub S);

impl<S: Storage> Storage for OfTeam<S> {
    #[inline(always)]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        self.0.corners(cell)
    }

    #[inline(always)]
    fn corners_in_lanes<R: Float, const N: usize>(&self, cells: [[R; N]; 3]) -> [[R; N]; 8] {
        self.0.corners_in_lanes(cells)
    }

    #[cfg(target_arch = "nvptx64")]
    const LANES_OF_THREAD: usize = 1;

    #[cfg(target_arch = "nvptx64")]
    #[inline(always)]
    fn first_lane(&self) -> usize {
        thread_of_block() as usize % TEAM_LANES
    }

    #[cfg(target_arch = "nvptx64")]
    #[inline(always)]
    fn of_lane<T: Copy>(&self, computed: &[T; TEAM_LANES], lane: usize) -> T {
        const { assert!(size_of::<T>() <= size_of::<u32>()) };
        let team = 0xFF << (thread_of_block() & 24);
        let mut word = 0_u32;
        // SAFETY: a value of up to four bytes fits. All threads of the team are here: what decides their way is the same in each.
        unsafe {
            (&raw mut word).cast::<T>().write(computed[0]);
            word = shuffle(team, word, lane as u32, EIGHTS_OF_WARP);
            (&raw const word).cast::<T>().read()
        }
    }

    #[cfg(target_arch = "nvptx64")]
    #[inline(always)]
    fn lanes_where(&self, computed: &[u8; TEAM_LANES]) -> u32 {
        let first = thread_of_block() & 24;
        // SAFETY: as above.
        unsafe { ballot(0xFF << first, computed[0] != 0) >> first & 0xFF }
    }

    const SLOPES_TAKE_LONG: bool = S::SLOPES_TAKE_LONG;

    const HAS_LOWEST: bool = S::HAS_LOWEST;

    #[inline(always)]
    fn lowest(&self, first: [u32; 3], last: [u32; 3]) -> Option<f32> {
        self.0.lowest(first, last)
    }

    const HAS_BLOCK_BOUNDS: bool = S::HAS_BLOCK_BOUNDS;

    #[inline(always)]
    fn block_bounds(&self, first: [u32; 3], last: [u32; 3]) -> Option<BlockBounds> {
        self.0.block_bounds(first, last)
    }

    const HAS_CELL_ERRORS: bool = S::HAS_CELL_ERRORS;

    #[inline(always)]
    fn cell_errors(&self, first: [u32; 3], last: [u32; 3], limits: JumpLimits) -> Option<CellErrors> {
        self.0.cell_errors(first, last, limits)
    }
}

/// Index of this thread in its block.
#[cfg(target_arch = "nvptx64")]
#[inline(always)]
fn thread_of_block() -> u32 {
    // SAFETY: this reads a register that every thread has.
    unsafe { core::arch::nvptx::_thread_idx_x() as u32 }
}

/// The third operand of `shfl.sync.idx`: lanes are counted within eight threads.
#[cfg(target_arch = "nvptx64")]
const EIGHTS_OF_WARP: u32 = 0x181F;

#[cfg(target_arch = "nvptx64")]
unsafe extern "C" {
    /// The value of another thread. No inline assembly, which the compiler might take apart into two branches.
    #[link_name = "llvm.nvvm.shfl.sync.idx.i32"]
    fn shuffle(threads: u32, value: u32, lane: u32, segment: u32) -> u32;

    /// A bit for each of these threads.
    #[link_name = "llvm.nvvm.vote.ballot.sync"]
    fn ballot(threads: u32, bit: bool) -> u32;
}
