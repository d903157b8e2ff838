use std::ops::Range;

/// A dataset cut into chunks. One of fewer than three axes counts as having one layer, and one row, of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tiling {
    /// The last runs fastest in memory.
    shape: [usize; 3],
    /// Of a chunk.
    sides: [usize; 3],
}

/// Where a chunk lies, as far as the dataset reaches.
#[derive(Clone, Copy)]
pub(super) struct Tile {
    pub first: [usize; 3],
    pub size: [usize; 3],
}

impl Tiling {
    /// Of at most three axes, each with at least one element in a chunk.
    pub(super) fn new(shape: &[usize], sides: &[usize]) -> Self {
        Self { shape: with_leading_ones(shape), sides: with_leading_ones(sides) }
    }

    pub(super) fn sides(&self) -> [usize; 3] {
        self.sides
    }

    pub(super) fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// Chunks along each axis.
    pub(super) fn counts(&self) -> [usize; 3] {
        std::array::from_fn(|axis| self.shape[axis].div_ceil(self.sides[axis]))
    }

    /// Chunks in all. `None` where that is beyond all numbers.
    pub(super) fn count(&self) -> Option<usize> {
        self.counts().iter().try_fold(1_usize, |total, count| total.checked_mul(*count))
    }

    /// Elements in memory side by side that hold all of some chunks and nothing of others: the chunks of one place along
    /// the first axis, or along the second where there is one layer alone.
    pub(super) fn slab_elements(&self) -> usize {
        let [nz, ny, nx] = self.shape;
        if nz > 1 { self.sides[0] * ny * nx } else { self.sides[1] * nx }
    }

    /// The chunks of a slab.
    pub(super) fn slab(&self, at: usize) -> Range<usize> {
        let [_, rows, columns] = self.counts();
        let chunks = if self.shape[0] > 1 { rows * columns } else { columns };
        at * chunks..(at + 1) * chunks
    }

    /// The chunk along the last axis runs fastest.
    pub(super) fn tile(&self, at: usize) -> Tile {
        let [_, rows, columns] = self.counts();
        let place = [at / columns / rows, at / columns % rows, at % columns];
        let first: [usize; 3] = std::array::from_fn(|axis| place[axis] * self.sides[axis]);
        Tile { first, size: std::array::from_fn(|axis| self.sides[axis].min(self.shape[axis] - first[axis])) }
    }

    /// All of the dataset.
    pub(super) fn whole(&self) -> Tile {
        Tile { first: [0; 3], size: self.shape }
    }

    /// Where in the dataset the rows of a tile begin, each of `size[2]` elements.
    pub(super) fn rows(&self, tile: Tile) -> impl Iterator<Item = usize> {
        self.whole().rows(tile)
    }
}

impl Tile {
    /// Where in this one the rows of a tile within it begin, each of `size[2]` elements.
    pub(super) fn rows(self, within: Tile) -> impl Iterator<Item = usize> {
        let [_, ny, nx] = self.size;
        let [z, y, x] = std::array::from_fn(|axis| within.first[axis] - self.first[axis]);
        let rows = y..y + within.size[1];
        (z..z + within.size[0]).flat_map(move |z| rows.clone().map(move |y| (z * ny + y) * nx + x))
    }

    /// Cut at multiples of `sides`, counted from the dataset's first element.
    pub(super) fn pieces(self, sides: [usize; 3]) -> impl Iterator<Item = Tile> {
        let cuts = move |axis: usize| {
            let (first, past, side) = (self.first[axis], self.first[axis] + self.size[axis], sides[axis]);
            (first / side..past.div_ceil(side)).map(move |at| {
                let [begin, end] = [first.max(at * side), past.min(at.saturating_add(1).saturating_mul(side))];
                (begin, end - begin)
            })
        };
        let tile = |along: [(usize, usize); 3]| Tile { first: along.map(|it| it.0), size: along.map(|it| it.1) };
        cuts(0).flat_map(move |z| cuts(1).flat_map(move |y| cuts(2).map(move |x| tile([z, y, x]))))
    }
}

fn with_leading_ones(shape: &[usize]) -> [usize; 3] {
    let mut padded = [1; 3];
    padded[3 - shape.len()..].copy_from_slice(shape);
    padded
}
