//! Bounds of the samples of each brick: value, slope, and magnitude at jumps of the sign.
//!
//! A brick's halo is read from the bricks and the coarse cells around it, part by part, with the bits of
//! [`Sparse::node`](sdf_core::grid::sparse::Sparse::node).

use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, Sparse};
use sdf_core::grid::{BlockBounds, Lattice};

use super::brick_tables::BrickTables;
use super::{CodesRef, Quantize};
use crate::error::node_bounds::{Halo, HaloBlock};

const SIDE: usize = BRICK as usize;

/// A baked grid whose bricks are to be bounded.
#[derive(Clone, Copy)]
pub(super) struct BoundedBricks<'a> {
    pub lattice: &'a Lattice,
    pub storage: &'a Sparse<BrickTables<'a>>,
    pub samples: Window<'a>,
    /// Errors of the samples of each brick.
    pub roundings: &'a [f64],
}

/// Samples of some bricks.
#[derive(Clone, Copy)]
pub(super) struct Window<'a> {
    /// The bricks, ascending; `None` stands for all.
    pub bricks: Option<&'a [u32]>,
    /// Codes of one after the other.
    pub codes: CodesRef<'a>,
}

impl Window<'_> {
    /// Codes of a brick, which must be one of them.
    #[inline(always)]
    fn brick<C>(self, codes: &[C], brick: usize) -> &[C] {
        let index = match self.bricks {
            None => brick,
            Some(bricks) => bricks.partition_point(|other| (*other as usize) < brick),
        };
        &codes[index * BRICK_SAMPLES..][..BRICK_SAMPLES]
    }
}

/// Bounds of one brick's samples, and the samples around it.
pub(super) struct SampleBounds {
    pub bounds: BlockBounds,
    /// Largest error of the samples at the corners of the brick's cells.
    pub rounding: f64,
    /// The brick and what is around it.
    pub halo: HaloBlock,
}

impl BoundedBricks<'_> {
    pub fn bound(self, arch: pulp::Arch, slot: [u32; 3]) -> SampleBounds {
        match self.samples.codes {
            CodesRef::F32(codes) => arch.dispatch(Bound { bricks: self, codes, slot }),
            CodesRef::U16(codes) => arch.dispatch(Bound { bricks: self, codes, slot }),
            CodesRef::U8(codes) => arch.dispatch(Bound { bricks: self, codes, slot }),
        }
    }

    /// Fills the nodes of the halo that are in the slot at `part` − 1 from the brick's, from `starts` to before `ends`.
    #[inline(always)]
    fn fill<C: Quantize>(
        &self,
        codes: &[C],
        halo: &mut Halo,
        slot: [u32; 3],
        part: [usize; 3],
        starts: [usize; 3],
        ends: [usize; 3],
    ) -> Option<usize> {
        let range = |axis: usize| {
            let [first, end] = [[0, 1], [1, SIDE + 1], [SIDE + 1, SIDE + 2]][part[axis]];
            first.max(starts[axis])..end.min(ends[axis])
        };
        let [xs, ys, zs] = [range(0), range(1), range(2)];
        if xs.is_empty() || ys.is_empty() || zs.is_empty() {
            return None;
        }
        let local = |at: usize| (at + SIDE - 1) % SIDE;
        let slot: [u32; 3] = std::array::from_fn(|axis| slot[axis] + part[axis] as u32 - 1);
        let Some(brick) = self.storage.brick_at(slot) else {
            let corners = self.storage.coarse_corners(slot);
            let mix = |a: f32, b: f32, at: usize| a + (b - a) * (local(at) as f32 / SIDE as f32);
            for x in xs {
                let along_x: [f32; 4] = std::array::from_fn(|edge| mix(corners[2 * edge], corners[2 * edge + 1], x));
                for y in ys.clone() {
                    let ends = [mix(along_x[0], along_x[1], y), mix(along_x[2], along_x[3], y)];
                    for z in zs.clone() {
                        halo[z][y][x] = mix(ends[0], ends[1], z);
                    }
                }
            }
            return None;
        };
        let (scale, codes) = (self.storage.bricks().scales[brick], self.samples.brick(codes, brick));
        for z in zs {
            for y in ys.clone() {
                let row = &codes[SIDE * (SIDE * local(z) + local(y))..][..SIDE];
                if xs.len() == SIDE {
                    for x in 0..SIDE {
                        halo[z][y][x + 1] = row[x].decode(scale);
                    }
                } else {
                    xs.clone().for_each(|x| halo[z][y][x] = row[local(x)].decode(scale));
                }
            }
        }
        Some(brick)
    }
}

struct Bound<'a, C> {
    bricks: BoundedBricks<'a>,
    codes: &'a [C],
    slot: [u32; 3],
}

impl<C: Quantize> pulp::NullaryFnOnce for Bound<'_, C> {
    type Output = SampleBounds;

    #[inline(always)]
    fn call(self) -> SampleBounds {
        let Self { bricks, codes, slot } = self;
        let mut rounding = 0.0_f64;
        let (mut halo, [starts, ends]) = HaloBlock::empty(bricks.lattice, slot);
        for part in 0..27_usize {
            let part = [part % 3, part / 3 % 3, part / 9];
            let brick = bricks.fill(codes, &mut halo.values, slot, part, starts, ends);
            // The brick's cells have corners in the bricks above along each axis too.
            if part[0] > 0 && part[1] > 0 && part[2] > 0 {
                rounding = brick.map_or(rounding, |brick| rounding.max(bricks.roundings[brick]));
            }
        }
        SampleBounds { bounds: halo.bounds(), rounding, halo }
    }
}

#[cfg(test)]
mod tests {
    use sdf_core::grid::owned::Blocks;
    use sdf_core::grid::sparse::{BrickSlices, NO_BRICK, Scale, brick_counts};

    use super::*;
    use crate::testing::random;

    /// The promise of the module's header: each node of a halo has the bits of `Sparse::node`, in bricks, in slots without one, and at
    /// the ends of the lattice.
    #[test]
    fn a_halo_holds_the_nodes_of_the_grid_bit_for_bit() {
        let mut state = 9;
        for counts in [[9, 17, 20], [8, 8, 8], [25, 18, 10]] {
            let lattice = Lattice::new([0.0; 3], 0.3, counts).unwrap();
            let slot_counts = brick_counts(&lattice);
            let mut bricks = 0;
            let table: Vec<u32> = (0..slot_counts.iter().product::<u32>())
                .map(|_| if random(&mut state) > 0.0 { NO_BRICK } else { (bricks, bricks += 1).0 })
                .collect();
            let mut number = || random(&mut state) as f32;
            let scales: Vec<Scale> =
                (0..bricks).map(|_| Scale { base: number(), step: 1e-4 * number().abs() }).collect();
            let samples: Vec<u16> =
                (0..bricks as usize * BRICK_SAMPLES).map(|_| (3e4 * (number() + 1.0)) as u16).collect();
            let coarse: Vec<f32> = (0..slot_counts.iter().map(|n| n + 1).product::<u32>()).map(|_| number()).collect();
            let bounds = vec![
                BlockBounds { range: sdf_core::Interval { lower: 0.0, upper: 0.0 }, slope_bound: 0.0 };
                bricks as usize
            ];
            let slices =
                BrickSlices { table: &table, scales: &scales, samples: &samples, bounds: &bounds, coarse: &coarse };
            let storage = Sparse::new(&lattice, slices).unwrap();
            let blocks = Blocks::from_dense(slot_counts, NO_BRICK, &table).unwrap();
            let tables = Sparse::of_checked(&lattice, BrickTables { table: &blocks, scales: &scales, coarse: &coarse });
            let roundings: Vec<f64> = (0..bricks).map(f64::from).collect();
            let samples = Window { bricks: None, codes: CodesRef::U16(&samples) };
            let all = BoundedBricks { lattice: &lattice, storage: &tables, samples, roundings: &roundings };
            for slot in (0..table.len() as u32).map(|index| {
                let [x, y, _] = slot_counts;
                [index % x, index / x % y, index / x / y]
            }) {
                let found = all.bound(pulp::Arch::new(), slot);
                let mut rounding = 0.0_f64;
                for index in 0..1000_u32 {
                    let at = [index % 10, index / 10 % 10, index / 100];
                    let node: [u32; 3] = std::array::from_fn(|axis| (slot[axis] * BRICK + at[axis]).wrapping_sub(1));
                    let value = found.halo.values[at[2] as usize][at[1] as usize][at[0] as usize];
                    if node.iter().zip(counts).any(|(node, count)| *node >= count) {
                        assert!(value.is_nan(), "{slot:?} {at:?} of {counts:?}");
                        continue;
                    }
                    assert_eq!(value.to_bits(), storage.node(node).to_bits(), "{node:?} around {slot:?} of {counts:?}");
                    let brick = storage.brick_at(node.map(|n| n / BRICK));
                    if at.iter().all(|at| *at > 0) {
                        rounding = brick.map_or(rounding, |brick| rounding.max(roundings[brick]));
                    }
                }
                assert_eq!(found.rounding, rounding, "{slot:?} of {counts:?}");
            }
        }
    }
}
