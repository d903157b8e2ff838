//! Chunks of a dataset: which elements each one holds, and where its rows lie in memory.
//!
//! A dataset of shape (n₀, n₁, n₂), the last axis fastest, is cut at multiples of the chunk's sides. Chunks at the
//! upper ends stick out of the dataset; a [`Tile`] is the part inside.

use std::ops::Range;

/// A dataset cut into chunks. Missing axes count as leading axes of length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tiling {
    /// Elements along each axis, the last fastest.
    shape: [usize; 3],
    /// Elements of a chunk along each axis.
    sides: [usize; 3],
}

/// A box of elements: the part of a chunk inside the dataset.
#[derive(Clone, Copy)]
pub(crate) struct Tile {
    pub first: [usize; 3],
    pub size: [usize; 3],
}

impl Tiling {
    /// Takes at most three axes; every side must be at least 1.
    pub(crate) fn new(shape: &[usize], sides: &[usize]) -> Self {
        Self { shape: padded_shape(shape), sides: padded_shape(sides) }
    }

    pub(crate) fn sides(&self) -> [usize; 3] {
        self.sides
    }

    pub(crate) fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// Chunks along each axis.
    pub(crate) fn counts(&self) -> [usize; 3] {
        std::array::from_fn(|axis| self.shape[axis].div_ceil(self.sides[axis]))
    }

    /// Number of chunks; `None` on overflow.
    pub(crate) fn count(&self) -> Option<usize> {
        self.counts().iter().try_fold(1_usize, |total, count| total.checked_mul(*count))
    }

    /// Elements of a slab: a contiguous range of memory that holds whole chunks and nothing of others. A slab is one
    /// layer of chunks, or one row of chunks if the dataset has a single layer of elements.
    pub(crate) fn slab_elements(&self) -> usize {
        let [nz, ny, nx] = self.shape;
        if nz > 1 { self.sides[0] * ny * nx } else { self.sides[1] * nx }
    }

    /// Indices of a slab's chunks.
    pub(crate) fn slab(&self, index: usize) -> Range<usize> {
        let [_, rows, columns] = self.counts();
        let chunks = if self.shape[0] > 1 { rows * columns } else { columns };
        index * chunks..(index + 1) * chunks
    }

    /// Elements of a chunk; chunks are counted with the last axis fastest.
    pub(crate) fn tile(&self, chunk: usize) -> Tile {
        let [_, rows, columns] = self.counts();
        let position = [chunk / columns / rows, chunk / columns % rows, chunk % columns];
        let first: [usize; 3] = std::array::from_fn(|axis| position[axis] * self.sides[axis]);
        Tile { first, size: std::array::from_fn(|axis| self.sides[axis].min(self.shape[axis] - first[axis])) }
    }

    /// All elements of the dataset.
    pub(crate) fn whole(&self) -> Tile {
        Tile { first: [0; 3], size: self.shape }
    }

    /// Offsets in the dataset at which the rows of a tile begin, each of `size[2]` elements.
    pub(crate) fn rows(&self, tile: Tile) -> impl Iterator<Item = usize> {
        self.whole().rows(tile)
    }
}

impl Tile {
    /// Offsets in this tile at which the rows of `inner` begin, each of `inner.size[2]` elements.
    pub(crate) fn rows(self, inner: Tile) -> impl Iterator<Item = usize> {
        let [_, ny, nx] = self.size;
        let [z, y, x] = std::array::from_fn(|axis| inner.first[axis] - self.first[axis]);
        let rows = y..y + inner.size[1];
        (z..z + inner.size[0]).flat_map(move |z| rows.clone().map(move |y| (z * ny + y) * nx + x))
    }

    /// The needed pieces of the tile, cut at multiples of `sides` that count from the dataset's first element. Neighbours along the last
    /// axis are one run: its rows are copied at once.
    pub(crate) fn runs(self, sides: [usize; 3], is_needed: impl Fn(Self) -> bool) -> impl Iterator<Item = Self> {
        let cuts = move |axis: usize| {
            let (first, end, side) = (self.first[axis], self.first[axis] + self.size[axis], sides[axis]);
            (first / side..end.div_ceil(side)).map(move |index| {
                let [begin, end] = [first.max(index * side), end.min(index.saturating_add(1).saturating_mul(side))];
                (begin, end - begin)
            })
        };
        let tile =
            |spans: [(usize, usize); 3]| Self { first: spans.map(|span| span.0), size: spans.map(|span| span.1) };
        let bars = cuts(0).flat_map(move |z| cuts(1).map(move |y| (z, y)));
        bars.flat_map(move |(z, y)| {
            let mut needed = cuts(2).filter(|x| is_needed(tile([z, y, *x]))).peekable();
            let mut runs = Vec::new();
            while let Some((first, mut size)) = needed.next() {
                while let Some((_, more)) = needed.next_if(|(next, _)| *next == first + size) {
                    size += more;
                }
                runs.push(tile([z, y, (first, size)]));
            }
            runs
        })
    }
}

fn padded_shape(shape: &[usize]) -> [usize; 3] {
    let mut padded = [1; 3];
    padded[3 - shape.len()..].copy_from_slice(shape);
    padded
}
