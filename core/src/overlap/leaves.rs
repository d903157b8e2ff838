use crate::Aabb;

/// A cube of 2^level leaves along each side, what of it lies in the region.
#[derive(Clone, Copy)]
pub(super) struct Block {
    /// The first leaf in it, counted along each axis.
    pub at: [u32; 3],
    level: u32,
    pub region: Aabb,
}

impl Block {
    pub fn is_leaf(&self) -> bool {
        self.level == 0
    }
}

/// Cubes of one size over a region, visited in Morton order from the whole down: a block is answered once, and its eight
/// parts only if it is split.
///
/// The lattice is shifted by a share of an edge that no symmetric scene has, so that a plane of symmetry of the region,
/// on which the middle surface often lies, is never between two leaves, in both or in neither.
pub(super) struct Leaves {
    region: Aabb,
    origin: [f64; 3],
    pub edge: f64,
    counts: [u32; 3],
    waiting: [([u32; 3], u32); MAX_WAITING],
    count: usize,
}

/// Halvings of the whole: Morton codes of three times as many bits fit u64, and counts f64 and f32.
const MAX_LEVELS: u32 = 20;

/// Of each level seven wait while the eighth is visited.
const MAX_WAITING: usize = 7 * MAX_LEVELS as usize + 8;

const SHIFT: f64 = 0.381_966;

impl Leaves {
    /// `edge` is made longer where it would take more than 2^20 leaves along a side, and where it is no length.
    pub fn of(region: &Aabb, edge: f64) -> Self {
        let longest = region.longest_side();
        let least = (longest / f64::from((1_u32 << MAX_LEVELS) - 2)).max(f64::MIN_POSITIVE);
        let edge = if edge.is_finite() { edge.max(least) } else { longest.max(least) };
        let origin = region.min.map(|x| x - SHIFT * edge);
        let counts = core::array::from_fn(|axis| (((region.max[axis] - origin[axis]) / edge) as u32).saturating_add(1));
        let most = counts.iter().fold(1, |most: u32, count| most.max(*count));
        let level = most.min(1 << MAX_LEVELS).next_power_of_two().trailing_zeros();
        let mut waiting = [([0; 3], 0); MAX_WAITING];
        waiting[0].1 = level;
        Self { region: *region, origin, edge, counts, waiting, count: 1 }
    }

    pub fn next_block(&mut self) -> Option<Block> {
        loop {
            self.count = self.count.checked_sub(1)?;
            let (at, level) = self.waiting.get(self.count).copied()?;
            let block = Block { at, level, region: self.part(at, 1_u32.wrapping_shl(level)) };
            let is_there = (0..3).all(|axis| at[axis] < self.counts[axis] && block.region.extents()[axis] >= 0.0);
            if is_there {
                return Some(block);
            }
        }
    }

    /// Lets its eight parts be visited next.
    pub fn split(&mut self, block: &Block) {
        let Some(level) = block.level.checked_sub(1) else { return };
        for part in (0..8_u32).rev() {
            let step: [u32; 3] = core::array::from_fn(|axis| (part.wrapping_shr(axis as u32) & 1).wrapping_shl(level));
            let at = core::array::from_fn(|axis| block.at[axis].wrapping_add(step[axis]));
            if let Some(slot) = self.waiting.get_mut(self.count) {
                *slot = (at, level);
                self.count = self.count.wrapping_add(1);
            }
        }
    }

    pub fn part(&self, at: [u32; 3], side: u32) -> Aabb {
        let place = |axis: usize, index: u32| self.origin[axis] + self.edge * f64::from(index);
        Aabb {
            min: core::array::from_fn(|axis| place(axis, at[axis]).max(self.region.min[axis])),
            max: core::array::from_fn(|axis| place(axis, at[axis].wrapping_add(side)).min(self.region.max[axis])),
        }
    }
}
