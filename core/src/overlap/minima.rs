use super::bounds::Asked;
use super::leaves::Leaves;
use super::{OverlapPoint, Pair, Piece, Search};
use crate::number::Float;
use crate::vector::from_f64;
use crate::{Aabb, EnclosedSdf};

/// A cube of the region in which the bodies may touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaf<R> {
    /// Its place in Morton order: bits of x, y and z in turn.
    code: u64,
    value: R,
    /// A leaf with a lower value in the same hollow, or itself.
    parent: u32,
    /// Which leaf has this rank when they are ordered by value.
    ranked: u32,
}

impl<R: Float> Leaf<R> {
    /// What to fill the scratch with.
    pub fn empty() -> Self {
        Self { code: 0, value: R::zero(), parent: 0, ranked: 0 }
    }
}

/// What is known of all isolated minima.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Minima {
    /// How many there are; those that found room are the deepest.
    pub count: usize,
    /// Leaves in which the bodies may touch.
    pub leaves: usize,
    /// Leaves in which a field is no number: they are left out.
    pub unknown: usize,
    /// What a way from leaf to leaf must climb to part two minima; a way between their middles can climb twice as much.
    pub barrier: f64,
    pub evaluations: u32,
    /// False if the budget or the scratch was spent first: there may be more.
    pub complete: bool,
}

impl<A: EnclosedSdf, B: EnclosedSdf> Pair<'_, A, B> {
    /// Every isolated point that is deepest: the least of max(φ_A, φ_B) in each part of the region in which the bodies
    /// touch, and of two minima in one part the higher as well, if every way from it to a lower point climbs by more than
    /// twice the `barrier`, the most that the value changes along the diagonal of a leaf; none is told of that climbs by less
    /// than half of it. So what lies flat or bends around is one minimum, and neither the lattice of the leaves nor noise that
    /// is finer than it makes one.
    ///
    /// That is the merge tree of the value on cubes with an edge of `resolution` (Edelsbrunner, Letscher, Zomorodian 2002,
    /// "Topological persistence and simplification"), each asked at its middle, those that touch being neighbours. Parts
    /// that come nearer to each other than two cubes count as one.
    ///
    /// `found` is filled with the lowest in rising order, each followed downhill to the bottom. `scratch` needs room for all
    /// cubes in which the bodies may touch.
    pub fn minima<R: Float>(
        &self,
        resolution: f64,
        evaluations: u32,
        scratch: &mut [Leaf<R>],
        found: &mut [Option<OverlapPoint<R>>],
    ) -> Minima {
        let asked = Asked::<R, A, B>::of(self);
        let leaves = Leaves::of(&self.region, resolution);
        let edge = leaves.edge;
        let steepest = self.a.slope_bound().max(self.b.slope_bound());
        let barrier = edge * libm::sqrt(3.0) * steepest;
        let mut minima = Minima { count: 0, leaves: 0, unknown: 0, barrier, evaluations: 0, complete: true };
        asked.gather(leaves, evaluations, scratch, &mut minima);
        let held = minima.leaves.min(scratch.len());
        let mut forest = Forest { leaves: scratch.get_mut(..held).unwrap_or_default() };
        forest.rank();
        let leaves = Leaves::of(&self.region, resolution);
        forest.merge(R::from_f64(barrier), |code| {
            let (bottom, looks) = asked.bottom(leaves.middle(place(code)), edge);
            minima.evaluations = minima.evaluations.saturating_add(looks);
            // The leaf may touch, by what is certain of it; its bottom does not.
            if bottom.value <= asked.margin + asked.rounding {
                minima.count = minima.count.saturating_add(1);
                keep(found, bottom);
            }
        });
        minima
    }
}

/// Boxes around a minimum that are searched, each where the one before was lowest.
const MAX_BOXES: u32 = 8;

/// A box of three leaves along each side is searched to a share of its side.
const NEARBY: Search = Search { evaluations: 512, tolerance: 1e-3 };

impl<R: Float, A: EnclosedSdf, B: EnclosedSdf> Asked<'_, R, A, B> {
    /// Downhill from a point, and by branch and bound in a box around where that ends: where several faces of a body meet,
    /// steps along gradients come to rest above the bottom. With how often both fields were asked.
    fn bottom(&self, from: [f64; 3], edge: f64) -> (OverlapPoint<R>, u32) {
        let (mut at, mut looks) = self.descend(self.see(from_f64(from)), R::from_f64(0.5 * edge));
        for _ in 0..MAX_BOXES {
            let middle: [f64; 3] = at.point.map(R::to_f64).into();
            let around = Aabb { min: middle, max: middle }.inflate(1.5 * edge);
            let Some(region) = self.pair.region.intersection(&around) else { break };
            let nearby = Pair { a: self.pair.a, b: self.pair.b, margin: self.pair.margin, region };
            let deepest = nearby.deepest::<R>(&NEARBY, &mut [Piece::EMPTY; 64]);
            looks = looks.saturating_add(deepest.evaluations);
            let Some(lower) = deepest.at.filter(|lower| lower.value < at.value) else { break };
            let is_much = R::from_f64(NEARBY.tolerance * 3.0 * edge) < at.value - lower.value;
            at = lower;
            if !is_much {
                break;
            }
        }
        (at, looks)
    }

    fn gather(&self, mut leaves: Leaves, budget: u32, scratch: &mut [Leaf<R>], minima: &mut Minima) {
        while let Some(block) = leaves.next_block() {
            if minima.evaluations >= budget {
                minima.complete = false;
                return;
            }
            let look = self.look(&block.region);
            minima.evaluations = minima.evaluations.saturating_add(u32::from(look.seen.is_some()));
            let Some(seen) = look.seen.filter(|_| look.may_touch()) else { continue };
            if !block.is_leaf() {
                leaves.split(&block);
            } else if !seen.is_known() {
                minima.unknown = minima.unknown.saturating_add(1);
            } else {
                match scratch.get_mut(minima.leaves) {
                    Some(slot) => *slot = Leaf { code: code(block.at), value: seen.value, ..Leaf::empty() },
                    None => minima.complete = false,
                }
                minima.leaves = minima.leaves.saturating_add(1);
            }
        }
    }
}

/// In rising order, as far as there is room.
fn keep<R: Float>(found: &mut [Option<OverlapPoint<R>>], point: OverlapPoint<R>) {
    let mut carried = Some(point);
    for slot in found {
        let is_lower = match (&carried, &slot) {
            (Some(carried), Some(there)) => carried.value < there.value,
            (carried, None) => carried.is_some(),
            (None, _) => false,
        };
        if is_lower {
            core::mem::swap(slot, &mut carried);
        }
    }
}

/// Leaves in Morton order, and the trees of those that hang together below a level that rises.
struct Forest<'s, R> {
    leaves: &'s mut [Leaf<R>],
}

impl<R: Float> Forest<'_, R> {
    fn leaf(&self, index: usize) -> Leaf<R> {
        self.leaves.get(index).copied().unwrap_or(Leaf::empty())
    }

    fn ranked(&self, rank: usize) -> usize {
        self.leaf(rank).ranked as usize
    }

    /// By value, then by place.
    fn is_lower(&self, a: usize, b: usize) -> bool {
        let (of_a, of_b) = (self.leaf(a).value, self.leaf(b).value);
        of_a < of_b || (of_a <= of_b && a < b)
    }

    /// Heapsort (Williams 1964) of the ranks.
    fn rank(&mut self) {
        for (index, leaf) in self.leaves.iter_mut().enumerate() {
            (leaf.ranked, leaf.parent) = (index as u32, index as u32);
        }
        let count = self.leaves.len();
        for root in (0..count / 2).rev() {
            self.sift(root, count);
        }
        for end in (1..count).rev() {
            self.swap_ranks(0, end);
            self.sift(0, end);
        }
    }

    fn sift(&mut self, root: usize, end: usize) {
        let mut at = root;
        loop {
            let below = [1, 2].map(|side| at.saturating_mul(2).saturating_add(side)).into_iter();
            let higher = |a, b| if self.is_lower(self.ranked(a), self.ranked(b)) { b } else { a };
            let Some(child) = below.filter(|child| *child < end).reduce(higher) else { return };
            if !self.is_lower(self.ranked(at), self.ranked(child)) {
                return;
            }
            self.swap_ranks(at, child);
            at = child;
        }
    }

    fn swap_ranks(&mut self, a: usize, b: usize) {
        let (of_a, of_b) = (self.leaf(a).ranked, self.leaf(b).ranked);
        self.set(a, |leaf| leaf.ranked = of_b);
        self.set(b, |leaf| leaf.ranked = of_a);
    }

    fn set(&mut self, index: usize, change: impl FnOnce(&mut Leaf<R>)) {
        if let Some(leaf) = self.leaves.get_mut(index) {
            change(leaf);
        }
    }

    fn root(&mut self, index: usize) -> usize {
        let mut at = index;
        loop {
            let parent = self.leaf(at).parent as usize;
            if parent == at {
                return at;
            }
            let above = self.leaf(parent).parent;
            self.set(at, |leaf| leaf.parent = above);
            at = above as usize;
        }
    }

    /// Calls `isolated` with the code of the lowest leaf of each hollow that is deeper than the barrier, and of each part.
    fn merge(&mut self, barrier: R, mut isolated: impl FnMut(u64)) {
        for rank in 0..self.leaves.len() {
            let index = self.ranked(rank);
            let leaf = self.leaf(index);
            for step in 0..27_u32 {
                let Some(neighbor) = self.neighbor(leaf.code, step).filter(|other| self.is_lower(*other, index)) else {
                    continue;
                };
                let (one, other) = (self.root(index), self.root(neighbor));
                let (low, high) = if self.is_lower(one, other) { (one, other) } else { (other, one) };
                if low == high {
                    continue;
                }
                self.set(high, |leaf| leaf.parent = low as u32);
                let bottom = self.leaf(high);
                if barrier < leaf.value - bottom.value {
                    isolated(bottom.code);
                }
            }
        }
        for index in 0..self.leaves.len() {
            let leaf = self.leaf(index);
            if leaf.parent as usize == index {
                isolated(leaf.code);
            }
        }
    }

    /// The leaf that is −1, 0 or 1 away along each axis, as the digits of `step` to the base of three say, if it is there.
    fn neighbor(&self, of: u64, step: u32) -> Option<usize> {
        let at = place(of);
        let steps = [step % 3, step / 3 % 3, step / 9];
        let mut there = [0; 3];
        for axis in 0..3 {
            there[axis] = at[axis].checked_add(steps[axis])?.checked_sub(1)?;
        }
        let code = code(there);
        self.leaves.binary_search_by(|leaf| leaf.code.cmp(&code)).ok()
    }
}

/// Bits below this are of places.
const PLACE_BITS: u32 = 21;

fn code(at: [u32; 3]) -> u64 {
    let mut code = 0;
    for (axis, index) in (0_u32..).zip(at) {
        for bit in 0..PLACE_BITS {
            let place = bit.wrapping_mul(3).wrapping_add(axis);
            code |= u64::from(index.wrapping_shr(bit) & 1).wrapping_shl(place);
        }
    }
    code
}

fn place(code: u64) -> [u32; 3] {
    core::array::from_fn(|axis| {
        let of_axis = code.wrapping_shr(axis as u32);
        (0..PLACE_BITS).fold(0, |index, bit| {
            let digit = of_axis.wrapping_shr(bit.wrapping_mul(3)) & 1;
            index | (digit as u32).wrapping_shl(bit)
        })
    })
}

impl Leaves {
    fn middle(&self, at: [u32; 3]) -> [f64; 3] {
        let leaf = self.part(at, 1);
        core::array::from_fn(|axis| 0.5 * (leaf.min[axis] + leaf.max[axis]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_says_its_place_and_grows_with_it() {
        for at in [[0, 0, 0], [1, 2, 3], [1 << 20, 5, 77], [(1 << 21) - 1; 3]] {
            assert_eq!(place(code(at)), at);
        }
        assert!(code([1, 0, 0]) < code([0, 1, 0]) && code([1, 1, 1]) < code([2, 0, 0]));
    }
}
