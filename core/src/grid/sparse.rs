use nalgebra::Vector3;

use crate::number::interval::Interval;

use super::block_bounds::merge_blocks;
use super::{BlockBounds, Lattice, Storage, cell_slope, trilinear};

/// Nodes along a brick's side.
pub const BRICK: u32 = 8;

/// Samples in a brick.
pub const BRICK_SAMPLES: usize = (BRICK * BRICK * BRICK) as usize;

/// Stands in the table of a [`Sparse`] where there is no brick.
pub const NO_BRICK: u32 = u32::MAX;

/// How a sample is kept.
pub trait Code: Copy {
    fn decode(self, scale: Scale) -> f32;
}

/// What a brick's codes are multiplied by, and where they begin. `f32` samples need neither.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    pub base: f32,
    pub step: f32,
}

impl Code for f32 {
    #[inline(always)]
    fn decode(self, _scale: Scale) -> f32 {
        self
    }
}

impl Code for u16 {
    #[inline(always)]
    fn decode(self, scale: Scale) -> f32 {
        scale.base + scale.step * f32::from(self)
    }
}

impl Code for u8 {
    #[inline(always)]
    fn decode(self, scale: Scale) -> f32 {
        scale.base + scale.step * f32::from(self)
    }
}

/// How many bricks the nodes of a lattice fall into along each axis.
pub fn brick_counts(lattice: &Lattice) -> [u32; 3] {
    lattice.nodes().map(|nodes| nodes.div_ceil(BRICK))
}

/// What a [`Sparse`] grid is made of, lent or held.
pub trait Bricks {
    type Code: Code;
    /// For each place of a brick, x fastest, which of the bricks it is, or [`NO_BRICK`].
    fn table(&self) -> &[u32];
    /// One for each brick.
    fn scales(&self) -> &[Scale];
    /// By brick, then by node, x fastest.
    fn samples(&self) -> &[Self::Code];
    /// One for each brick, nodes beyond the lattice not counted.
    fn bounds(&self) -> &[BlockBounds];
    /// One more along each axis than there are places of bricks, x fastest.
    fn coarse(&self) -> &[f32];
}

/// Bricks in borrowed slices, from memory or flash.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrickSlices<'a, C> {
    pub table: &'a [u32],
    pub scales: &'a [Scale],
    pub samples: &'a [C],
    pub bounds: &'a [BlockBounds],
    pub coarse: &'a [f32],
}

impl<C: Code> Bricks for BrickSlices<'_, C> {
    type Code = C;
    fn table(&self) -> &[u32] {
        self.table
    }
    fn scales(&self) -> &[Scale] {
        self.scales
    }
    fn samples(&self) -> &[C] {
        self.samples
    }
    fn bounds(&self) -> &[BlockBounds] {
        self.bounds
    }
    fn coarse(&self) -> &[f32] {
        self.coarse
    }
}

impl<B: Bricks> Bricks for &B {
    type Code = B::Code;
    fn table(&self) -> &[u32] {
        (**self).table()
    }
    fn scales(&self) -> &[Scale] {
        (**self).scales()
    }
    fn samples(&self) -> &[B::Code] {
        (**self).samples()
    }
    fn bounds(&self) -> &[BlockBounds] {
        (**self).bounds()
    }
    fn coarse(&self) -> &[f32] {
        (**self).coarse()
    }
}

/// Samples in bricks of 8 × 8 × 8 nodes where the field is needed in detail, and a coarse grid of every eighth node for
/// the rest.
///
/// Every node has one value: its brick's sample where its brick is there, else what the coarse grid's cell around it
/// interpolates. So the field is continuous across the borders of bricks and from fine to coarse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sparse<B> {
    /// Places along each axis.
    places: [u32; 3],
    coarse_spacing: f64,
    bricks: B,
}

impl<B: Bricks> Sparse<B> {
    /// `None` unless the table has a place for each brick of the lattice and the coarse grid one node more along each
    /// axis, every entry is [`NO_BRICK`] or a brick's number, and there are as many scales and bounds as bricks of
    /// samples.
    pub fn new(lattice: &Lattice, bricks: B) -> Option<Self> {
        let places = brick_counts(lattice);
        let count = |more: usize| places.iter().try_fold(1, |n: usize, places| n.checked_mul(*places as usize + more));
        let scales = bricks.scales().len();
        let in_range = |brick: &u32| *brick == NO_BRICK || (*brick as usize) < scales;
        let fits = Some(bricks.table().len()) == count(0)
            && Some(bricks.coarse().len()) == count(1)
            && bricks.bounds().len() == scales
            && scales.checked_mul(BRICK_SAMPLES) == Some(bricks.samples().len())
            && bricks.table().iter().all(in_range);
        let coarse_spacing = lattice.spacing() * f64::from(BRICK);
        fits.then_some(Self { places, coarse_spacing, bricks })
    }

    /// What it is made of.
    pub fn bricks(&self) -> &B {
        &self.bricks
    }

    /// The brick that a node falls into: its number, if it is there.
    #[inline(always)]
    fn brick(&self, node: [u32; 3]) -> Option<usize> {
        self.brick_in(node.map(|index| index / BRICK))
    }

    /// The number of the brick at a place, if it is there.
    pub fn brick_at(&self, place: [u32; 3]) -> Option<usize> {
        let is_place = (0..3).all(|axis| place[axis] < self.places[axis]);
        if is_place { self.brick_in(place) } else { None }
    }

    #[inline(always)]
    fn brick_in(&self, place: [u32; 3]) -> Option<usize> {
        let [along_x, along_y, _] = self.places.map(|n| n as usize);
        let [x, y, z] = place.map(|index| index as usize);
        let brick = self.bricks.table().get((z * along_y + y) * along_x + x).copied().unwrap_or(NO_BRICK);
        (brick != NO_BRICK).then_some(brick as usize)
    }

    #[inline(always)]
    fn sample(&self, brick: usize, [x, y, z]: [u32; 3]) -> f32 {
        let within = ((z % BRICK) * BRICK + y % BRICK) * BRICK + x % BRICK;
        match (self.bricks.samples().get(brick * BRICK_SAMPLES + within as usize), self.bricks.scales().get(brick)) {
            (Some(code), Some(scale)) => code.decode(*scale),
            _ => 0.0,
        }
    }

    /// Of a cell with all its corners in one brick, whose samples span 73 places.
    #[inline]
    fn corners_in(&self, brick: usize, [x, y, z]: [u32; 3]) -> [f32; 8] {
        let first = (((z % BRICK) * BRICK + y % BRICK) * BRICK + x % BRICK) as usize;
        let codes =
            self.bricks.samples().get(brick * BRICK_SAMPLES + first..).and_then(|codes| codes.first_chunk::<74>());
        let (Some(codes), Some(scale)) = (codes, self.bricks.scales().get(brick)) else { return [0.0; 8] };
        let corners = [codes[0], codes[1], codes[8], codes[9], codes[64], codes[65], codes[72], codes[73]];
        corners.map(|code| code.decode(*scale))
    }

    /// The coarse grid's corners around the place of a brick, in the order of [`Storage::corners`].
    pub fn coarse_corners(&self, place: [u32; 3]) -> [f32; 8] {
        let [along_x, along_y, _] = self.places.map(|n| n as usize + 1);
        let [x, y, z] = place.map(|index| index as usize);
        core::array::from_fn(|corner| {
            let [x, y, z] = [x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)];
            self.bricks.coarse().get((z * along_y + y) * along_x + x).copied().unwrap_or(0.0)
        })
    }

    /// Of a cell with all its corners in one place without a brick, so that all lie in one cell of the coarse grid.
    fn coarse_corners_in(&self, cell: [u32; 3]) -> [f32; 8] {
        let around = self.coarse_corners(cell.map(|index| index / BRICK));
        core::array::from_fn(|corner| {
            let share = |axis: usize| (cell[axis] % BRICK + (corner >> axis & 1) as u32) as f32 / BRICK as f32;
            trilinear::interpolate(around, Vector3::new(share(0), share(1), share(2))).0
        })
    }

    /// What the coarse cell around a node interpolates there.
    fn coarse(&self, node: [u32; 3]) -> f32 {
        let share = node.map(|index| (index % BRICK) as f32 / BRICK as f32);
        trilinear::interpolate(self.coarse_corners(node.map(|index| index / BRICK)), Vector3::from(share)).0
    }

    /// The value at a node.
    #[inline(always)]
    pub fn node(&self, node: [u32; 3]) -> f32 {
        match self.brick(node) {
            Some(brick) => self.sample(brick, node),
            None => self.coarse(node),
        }
    }
}

/// What is interpolated in f32 at two neighbouring nodes may differ by so many roundings more than it should: of seven
/// interpolations, each of a product and two sums, at both, and once in each of three directions.
const ROUNDINGS: f64 = 32.0;

impl<B: Bricks> Sparse<B> {
    /// Of the nodes of a place. A cell with all its corners in places without bricks lies in one cell of the coarse grid;
    /// any other has a corner in a brick.
    fn bounds_of_place(&self, place: [u32; 3]) -> BlockBounds {
        let of_brick = self.brick_in(place).and_then(|brick| self.bricks.bounds().get(brick));
        of_brick.copied().unwrap_or_else(|| {
            let corners = self.coarse_corners(place);
            let lower = corners.into_iter().fold(f32::INFINITY, f32::min);
            let upper = corners.into_iter().fold(f32::NEG_INFINITY, f32::max);
            let spacing = self.coarse_spacing / f64::from(BRICK);
            let rounding = ROUNDINGS * f64::from(f32::EPSILON) * f64::from(upper.max(-lower)) / spacing;
            let slope_bound = (cell_slope(corners, self.coarse_spacing) + rounding) as f32;
            BlockBounds { range: Interval { lower, upper }, slope_bound }
        })
    }
}

impl<B: Bricks> Storage for Sparse<B> {
    #[inline(always)]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        let corner = |corner: u32| [cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)];
        let in_one_brick = cell.iter().all(|index| index % BRICK != BRICK - 1);
        match self.brick(cell) {
            Some(brick) if in_one_brick => self.corners_in(brick, cell),
            None if in_one_brick => self.coarse_corners_in(cell),
            _ => {
                let mut corners = [0.0; 8];
                for index in 0..8 {
                    corners[index] = self.node(corner(index as u32));
                }
                corners
            }
        }
    }

    const HAS_BLOCK_BOUNDS: bool = true;

    fn block_bounds(&self, first: [u32; 3], last: [u32; 3]) -> Option<BlockBounds> {
        merge_blocks(first, last, |place| Some(self.bounds_of_place(place)))
    }
}
