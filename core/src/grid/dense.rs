//! Dense storage: the samples of all nodes in one slice.
//!
//! Lanes gather the eight corners of a cell as four pairs of x-neighbours. A pair is read as one 64-bit word, and its
//! index is clamped instead of checked, so that the compiler turns the loop over the cells into vector gathers.

use super::{Lattice, Storage};
use crate::number::Float;

/// The samples of all nodes, x fastest, in a slice in memory or flash (`&[f32]`) or anything that lends one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dense<S> {
    samples: S,
    /// Samples from a node to its neighbour in y.
    row: usize,
    /// Samples from a node to its neighbour in z.
    layer: usize,
}

impl<S: AsRef<[f32]>> Dense<S> {
    /// All samples, x fastest.
    pub fn samples(&self) -> &[f32] {
        self.samples.as_ref()
    }

    /// Samples of which as many as `row` lie along x, and as many as `layer` in a plane.
    pub(super) fn with_rows(samples: S, row: usize, layer: usize) -> Self {
        Self { samples, row, layer }
    }

    /// `None` unless there are as many samples as nodes.
    pub fn new(lattice: &Lattice, samples: S) -> Option<Self> {
        let [x, y, _] = lattice.nodes().map(|n| n as usize);
        (samples.as_ref().len() == lattice.node_count()).then_some(Self { samples, row: x, layer: x.wrapping_mul(y) })
    }
}

/// The samples, and the same samples shifted by a row, by a layer and by both: at the index of a cell's first corner
/// each holds one of its four edges along x. All slices have the length of the shortest, so that one clamp serves
/// all.
struct Edges<'a> {
    samples: [&'a [f32]; 4],
    /// Last index with a neighbour in x.
    last: usize,
    row: usize,
    layer: usize,
}

impl Edges<'_> {
    /// The corners of a cell as pairs along x. Valid cells are never clamped; the minimum stands in for a bounds
    /// check, which would keep the loop from being vectorized.
    #[inline(always)]
    fn pairs(&self, cell: [u32; 3]) -> [[f32; 2]; 4] {
        let index = first_corner(cell, self.row, self.layer).min(self.last);
        self.samples.map(|samples| pair(samples, index))
    }
}

impl<S: AsRef<[f32]>> Dense<S> {
    /// Always `Some`; the `Option` keeps a panic out of the binary.
    #[inline(always)]
    fn edges(&self) -> Option<Edges<'_>> {
        let (samples, row, layer) = (self.samples.as_ref(), self.row, self.layer);
        let shortest = samples.get(row.wrapping_add(layer)..)?;
        let shifted = |offset: usize| samples.get(offset..)?.get(..shortest.len());
        let last = shortest.len().checked_sub(2)?;
        Some(Edges { samples: [shifted(0)?, shifted(row)?, shifted(layer)?, shortest], last, row, layer })
    }
}

impl<S: AsRef<[f32]>> Storage for Dense<S> {
    #[cfg_attr(feature = "std", inline(always))]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        // Indices are valid; `wrapping_add` and `pair` keep overflow and bounds checks from panicking.
        let samples = self.samples.as_ref();
        let first = first_corner(cell, self.row, self.layer);
        let above = first.wrapping_add(self.layer);
        let [[a, b], [c, d]] = [pair(samples, first), pair(samples, first.wrapping_add(self.row))];
        let [[e, f], [g, h]] = [pair(samples, above), pair(samples, above.wrapping_add(self.row))];
        [a, b, c, d, e, f, g, h]
    }

    #[inline(always)]
    fn copy_row(&self, node: [u32; 3], count: u32, row: &mut [f32]) {
        let samples = self.samples.as_ref().get(first_corner(node, self.row, self.layer)..).unwrap_or(&[]);
        let mut at = 0;
        while at < count as usize {
            let (Some(from), Some(to)) = (samples.get(at..), row.get_mut(at..)) else { return };
            match (from.first_chunk::<8>(), to.first_chunk_mut::<8>()) {
                (Some(from), Some(to)) => *to = *from,
                _ => to.iter_mut().zip(from).for_each(|(to, from)| *to = *from),
            }
            at = at.saturating_add(8);
        }
    }

    #[inline(always)]
    fn corners_in_lanes<R: Float, const N: usize>(&self, [x, y, z]: [[R; N]; 3]) -> [[R; N]; 8] {
        let mut corners = [[R::zero(); N]; 8];
        let Some(edges) = self.edges() else { return corners };
        for cell in 0..N {
            let pairs = edges.pairs([x[cell].to_index(), y[cell].to_index(), z[cell].to_index()]);
            for edge in 0..4 {
                let [low, high] = pairs[edge].map(|sample| u64::from(sample.to_bits()));
                let both = low | high << 32;
                corners[2 * edge][cell] = R::from_stored(f32::from_bits(both as u32));
                corners[2 * edge + 1][cell] = R::from_stored(f32::from_bits((both >> 32) as u32));
            }
        }
        corners
    }
}

/// Index of the sample at a cell's first corner.
#[inline(always)]
fn first_corner([x, y, z]: [u32; 3], row: usize, layer: usize) -> usize {
    (z as usize).wrapping_mul(layer).wrapping_add((y as usize).wrapping_mul(row)).wrapping_add(x as usize)
}

/// Two neighbours along x.
#[inline(always)]
fn pair(samples: &[f32], index: usize) -> [f32; 2] {
    match samples.get(index..) {
        Some(&[a, b, ..]) => [a, b],
        _ => [0.0; 2],
    }
}
