use super::{Lattice, Storage};

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

impl<S: AsRef<[f32]>> Storage for Dense<S> {
    #[cfg_attr(feature = "std", inline(always))]
    fn corners(&self, [x, y, z]: [u32; 3]) -> [f32; 8] {
        // Every index is one of a sample; said so that neither a bounds check nor an overflow check can panic.
        let samples = self.samples.as_ref();
        let first = (z as usize).wrapping_mul(self.layer).wrapping_add((y as usize).wrapping_mul(self.row));
        let first = first.wrapping_add(x as usize);
        let above = first.wrapping_add(self.layer);
        let [[a, b], [c, d]] = [pair(samples, first), pair(samples, first.wrapping_add(self.row))];
        let [[e, f], [g, h]] = [pair(samples, above), pair(samples, above.wrapping_add(self.row))];
        [a, b, c, d, e, f, g, h]
    }
}

/// Two neighbours along x.
#[inline(always)]
fn pair(samples: &[f32], first: usize) -> [f32; 2] {
    match samples.get(first..) {
        Some(&[a, b, ..]) => [a, b],
        _ => [0.0; 2],
    }
}
