use super::{Lattice, Storage};
use crate::number::Float;

/// Every node's sample in one slice, x fastest: lent from memory or flash (`&[f32]`), or held by anything that lends it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dense<S> {
    samples: S,
    row: usize,
    layer: usize,
}

impl<S: AsRef<[f32]>> Dense<S> {
    /// `None` unless there are as many samples as nodes.
    pub fn new(lattice: &Lattice, samples: S) -> Option<Self> {
        let [x, y, _] = lattice.nodes().map(|n| n as usize);
        (samples.as_ref().len() == lattice.node_count()).then_some(Self { samples, row: x, layer: x.wrapping_mul(y) })
    }
}

/// The samples of a [`Dense`] from the first corner of a cell on, and from its neighbours along y, along z and along both:
/// each as long as the last, so that one check of an index holds for all.
struct Edges<'a> {
    samples: [&'a [f32]; 4],
    /// The last place with a neighbour along x.
    last: usize,
    row: usize,
    layer: usize,
}

impl Edges<'_> {
    /// The samples at a cell's corners, two by two along x. Indices of a cell are within; that they are is said by a least
    /// and not by a check, which vectors could not pass.
    #[inline(always)]
    fn pairs(&self, cell: [u32; 3]) -> [[f32; 2]; 4] {
        let first = first(cell, self.row, self.layer).min(self.last);
        self.samples.map(|samples| pair(samples, first))
    }
}

impl<S: AsRef<[f32]>> Dense<S> {
    /// `None` never, but the compiler does not know.
    #[inline(always)]
    fn edges(&self) -> Option<Edges<'_>> {
        let (samples, row, layer) = (self.samples.as_ref(), self.row, self.layer);
        let above = samples.get(row.wrapping_add(layer)..)?;
        let from = |first: usize| samples.get(first..)?.get(..above.len());
        let last = above.len().checked_sub(2)?;
        Some(Edges { samples: [from(0)?, from(row)?, from(layer)?, above], last, row, layer })
    }
}

impl<S: AsRef<[f32]>> Storage for Dense<S> {
    #[cfg_attr(feature = "std", inline(always))]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        // Every index is one of a sample; said so that neither a bounds check nor an overflow check can panic.
        let samples = self.samples.as_ref();
        let first = first(cell, self.row, self.layer);
        let above = first.wrapping_add(self.layer);
        let [[a, b], [c, d]] = [pair(samples, first), pair(samples, first.wrapping_add(self.row))];
        let [[e, f], [g, h]] = [pair(samples, above), pair(samples, above.wrapping_add(self.row))];
        [a, b, c, d, e, f, g, h]
    }

    #[inline(always)]
    fn corners_in_lanes<R: Float, const N: usize>(&self, [x, y, z]: [[R; N]; 3]) -> [[R; N]; 8] {
        let mut corners = [[R::zero(); N]; 8];
        let Some(edges) = self.edges() else { return corners };
        // All in one loop, and two neighbours as the halves of one number: vectors fetch that at once.
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

/// Where the first corner of a cell stands.
#[inline(always)]
fn first([x, y, z]: [u32; 3], row: usize, layer: usize) -> usize {
    (z as usize).wrapping_mul(layer).wrapping_add((y as usize).wrapping_mul(row)).wrapping_add(x as usize)
}

/// Two neighbours along x.
#[inline(always)]
fn pair(samples: &[f32], first: usize) -> [f32; 2] {
    match samples.get(first..) {
        Some(&[a, b, ..]) => [a, b],
        _ => [0.0; 2],
    }
}
