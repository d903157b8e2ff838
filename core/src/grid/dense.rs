use super::{Lattice, Storage};

/// Every node's sample in one borrowed slice, x fastest: from memory, a file or flash.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dense<'a> {
    samples: &'a [f32],
    row: usize,
    layer: usize,
}

impl<'a> Dense<'a> {
    /// `None` unless there are as many samples as nodes.
    pub fn new(lattice: &Lattice, samples: &'a [f32]) -> Option<Self> {
        let [x, y, _] = lattice.nodes().map(|n| n as usize);
        (samples.len() == lattice.node_count()).then_some(Self { samples, row: x, layer: x * y })
    }
}

impl Storage for Dense<'_> {
    #[inline]
    fn corners(&self, [x, y, z]: [u32; 3]) -> [f32; 8] {
        let first = z as usize * self.layer + y as usize * self.row + x as usize;
        let pair = |start: usize| match self.samples.get(start..start + 2) {
            Some(&[a, b]) => [a, b],
            _ => [0.0; 2],
        };
        let [[a, b], [c, d]] = [pair(first), pair(first + self.row)];
        let [[e, f], [g, h]] = [pair(first + self.layer), pair(first + self.layer + self.row)];
        [a, b, c, d, e, f, g, h]
    }
}
