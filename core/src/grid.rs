//! Fields that are stored as samples on a regular grid and interpolated trilinearly.

mod block_bounds;
mod dense;
mod exact;
mod gradient_range;
mod lattice;
pub mod sparse;
mod trilinear;

use nalgebra::Vector3;

pub use block_bounds::WithBlockBounds;
pub use dense::Dense;
pub use exact::segment::SegmentMinimum;
pub use exact::triangle::TriangleMinimum;
use gradient_range::GradientRange;
pub use lattice::Lattice;

use crate::enclosure::{bounds, reach, rounding};
use crate::number::kernel::LaneKernel;
use crate::number::{Float, Mask, Real};
use crate::vector::{from_f64, norm};
use crate::{Aabb, BoxEnclosure, Enclosure, Sample, Sdf, Status};

/// Where a grid's samples come from.
pub trait Storage {
    /// The samples at the eight nodes of a cell, x fastest: 000, 100, 010, 110, 001, 101, 011, 111. The cell's indices
    /// are below [`Lattice::cells`].
    fn corners(&self, cell: [u32; 3]) -> [f32; 8];

    /// [`corners`](Self::corners) of several cells, whose indices are given axis by axis as whole numbers.
    #[inline(always)]
    fn corners_of<R: Float, const N: usize>(&self, [x, y, z]: [[R; N]; 3]) -> [[R; N]; 8] {
        let mut corners = [[R::zero(); N]; 8];
        for cell in 0..N {
            let of_cell = self.corners([x[cell].to_index(), y[cell].to_index(), z[cell].to_index()]);
            for corner in 0..8 {
                corners[corner][cell] = R::from_stored(of_cell[corner]);
            }
        }
        corners
    }

    /// Whether [`block_bounds`](Self::bounds_of_nodes) ever answers: where it does not, it is not asked.
    const HAS_BLOCK_BOUNDS: bool = false;

    /// What is certain of the nodes from `first` to `last`, where the storage knows it without looking at each.
    fn block_bounds(&self, _first: [u32; 3], _last: [u32; 3]) -> Option<BlockBounds> {
        None
    }
}

impl<S: Storage> Storage for &S {
    #[inline(always)]
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        (**self).corners(cell)
    }

    #[inline(always)]
    fn corners_of<R: Float, const N: usize>(&self, cells: [[R; N]; 3]) -> [[R; N]; 8] {
        (**self).corners_of(cells)
    }

    const HAS_BLOCK_BOUNDS: bool = S::HAS_BLOCK_BOUNDS;

    #[inline(always)]
    fn block_bounds(&self, first: [u32; 3], last: [u32; 3]) -> Option<BlockBounds> {
        (**self).block_bounds(first, last)
    }
}

/// What is certain of a block of nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockBounds {
    /// No sample is below this.
    pub least: f32,
    /// No sample is above this.
    pub greatest: f32,
    /// The most that the interpolant changes over a unit of distance in any cell with a corner in the block.
    pub slope: f32,
}

impl BlockBounds {
    /// Those of two blocks together.
    pub fn union(self, other: Self) -> Self {
        Self {
            least: self.least.min(other.least),
            greatest: self.greatest.max(other.greatest),
            slope: self.slope.max(other.slope),
        }
    }
}

/// A field of samples. Inside its box the value is the trilinear interpolant and the gradient the derivative of that
/// very interpolant, one-sided on the faces between cells.
///
/// Outside, with P the nearest point of the box and d the distance to it, the value is hypot(d, φ(P)): continuous, and
/// no more than the distance to a surface that lies inside the box (`outside_grid` is set). The paper's §6 proposes
/// φ(P) + d, which is no less, and a cull by it drops contacts. Where φ(P) is negative, so that the inside reaches the
/// box, nothing is known beyond, and the value is φ(P) + d for continuity's sake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid<S> {
    lattice: Lattice,
    storage: S,
    slope_bound: f64,
}

impl<S: Storage> Grid<S> {
    /// `slope_bound` is what [`slope_bound`] measures, or more. `None` unless it is finite and not negative.
    pub fn new(lattice: Lattice, storage: S, slope_bound: f64) -> Option<Self> {
        (slope_bound.is_finite() && slope_bound >= 0.0).then_some(Self { lattice, storage, slope_bound })
    }

    /// The same grid of the same samples in a storage of another type, such as the only one of several that it can be.
    pub fn with_storage<T: Storage>(&self, storage: T) -> Grid<T> {
        Grid { lattice: self.lattice, storage, slope_bound: self.slope_bound }
    }

    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    pub fn storage(&self) -> &S {
        &self.storage
    }
}

/// The most that the trilinear interpolant changes over a unit of distance, inside the box and out: over all cells the
/// length of the largest differences along each axis, over the spacing. One pass over all samples.
pub fn slope_bound<S: Storage>(lattice: &Lattice, storage: &S) -> f64 {
    let [cells_x, cells_y, cells_z] = lattice.cells();
    let mut inside = 0.0_f64;
    for z in 0..cells_z {
        for y in 0..cells_y {
            for x in 0..cells_x {
                inside = inside.max(cell_slope(storage.corners([x, y, z]), lattice.spacing()));
            }
        }
    }
    slope_bound_with_outside(inside, lowest_on_box(lattice, storage) < 0.0)
}

/// The slope bound of a grid from that of its cells.
///
/// Outside the box the value rises with the distance to it, at a slope of one. Where that is added to what the nearest
/// point's value changes, as it is where the inside reaches the box, and not taken together with it as a hypotenuse, the
/// slopes are at right angles.
pub fn slope_bound_with_outside(of_cells: f64, inside_reaches_box: bool) -> f64 {
    if inside_reaches_box { libm::sqrt(1.0 + of_cells * of_cells) } else { of_cells.max(1.0) }
}

/// The least sample on the faces of the box.
fn lowest_on_box<S: Storage>(lattice: &Lattice, storage: &S) -> f64 {
    let cells = lattice.cells();
    let mut lowest = f64::INFINITY;
    for (axis, beside, above) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        // Below three, and said so: a check of it could panic.
        let along = |axis: usize| cells[axis % 3];
        for (face, layer) in [(0, 0), (1, along(axis).wrapping_sub(1))] {
            for i in 0..along(beside) {
                for j in 0..along(above) {
                    let mut cell = [layer; 3];
                    (cell[beside % 3], cell[above % 3]) = (i, j);
                    let corners = storage.corners(cell);
                    let on_face = corners.iter().enumerate().filter(|(corner, _)| corner >> (axis % 3) & 1 == face);
                    lowest = on_face.fold(lowest, |lowest, (_, sample)| lowest.min(f64::from(*sample)));
                }
            }
        }
    }
    lowest
}

/// The most that the interpolant of a cell's corners changes over a unit of distance: the length of the largest
/// differences along each axis, over the spacing.
pub fn cell_slope(corners: [f32; 8], spacing: f64) -> f64 {
    let c = corners.map(f64::from);
    let steepest =
        |edges: [(usize, usize); 4]| edges.iter().fold(0.0_f64, |most, (a, b)| most.max((c[*b] - c[*a]).abs()));
    let along_x = steepest([(0, 1), (2, 3), (4, 5), (6, 7)]);
    let along_y = steepest([(0, 2), (1, 3), (4, 6), (5, 7)]);
    let along_z = steepest([(0, 4), (1, 5), (2, 6), (3, 7)]);
    libm::sqrt(along_x * along_x + along_y * along_y + along_z * along_z) / spacing
}

/// Of a point: the cell of its nearest point in the box, how far that lies along each side of the cell, and 1 along axes
/// where the point is within the box, else 0.
type Located<R> = [Vector3<R>; 3];

struct Locate<'a>(&'a Lattice);

impl Locate<'_> {
    #[inline(always)]
    fn along<R: Real>(&self, axis: usize, x: R) -> [R; 3] {
        let last = R::from_f64(f64::from(self.0.cells()[axis]));
        let steps = (x - R::from_f64(self.0.origin()[axis])) * R::from_f64(self.0.inv_spacing());
        let clamped = steps.clamp(R::zero(), last);
        let cell = clamped.trunc().min(last - R::one());
        let within = R::select(steps.le(clamped) & clamped.le(steps), R::one(), R::zero());
        [cell, clamped - cell, within]
    }
}

impl LaneKernel for Locate<'_> {
    type From<R: Real> = Vector3<R>;
    type To<R: Real> = Located<R>;

    #[cfg_attr(feature = "std", inline(always))]
    fn apply<R: Real>(&self, point: Vector3<R>) -> Located<R> {
        let [x, y, z] = [self.along(0, point.x), self.along(1, point.y), self.along(2, point.z)];
        core::array::from_fn(|k| Vector3::new(x[k], y[k], z[k]))
    }
}

/// The value and the gradient in a cell, from the share of each side and the samples at the corners.
struct Interpolate<'a>(&'a Lattice);

impl LaneKernel for Interpolate<'_> {
    type From<R: Real> = (Vector3<R>, [R; 8]);
    type To<R: Real> = ([R; 1], Vector3<R>);

    #[cfg_attr(feature = "std", inline(always))]
    fn apply<R: Real>(&self, (share, corners): Self::From<R>) -> Self::To<R> {
        let (value, by_share) = trilinear::interpolate(corners, share);
        ([value], by_share * R::from_f64(self.0.inv_spacing()))
    }
}

/// What a point is answered, from what its nearest point in the box is: see [`Grid`].
struct Continue<'a>(&'a Lattice);

impl LaneKernel for Continue<'_> {
    type From<R: Real> = (Vector3<R>, Located<R>, ([R; 1], Vector3<R>));
    type To<R: Real> = Sample<R>;

    #[cfg_attr(feature = "std", inline(always))]
    fn apply<R: Real>(&self, (point, located, ([value], gradient)): Self::From<R>) -> Sample<R> {
        let [cell, share, within] = located;
        let nearest = from_f64(self.0.origin()) + (cell + share) * R::from_f64(self.0.spacing());
        let nearest =
            within.zip_zip_map(&nearest, &point, |within, nearest, x| R::select(within.is_zero(), nearest, x));
        let from_box = point - nearest;
        let distance = norm(from_box);
        let is_outside = R::zero().lt(distance);
        let along_box = gradient.component_mul(&within);
        let rising = R::zero().le(value);
        let hypotenuse = (distance * distance + value * value).sqrt();
        let divisor = R::select(is_outside & rising, hypotenuse, R::select(is_outside, distance, R::one()));
        let outside = Sample {
            value: R::select(rising, hypotenuse, value + distance),
            gradient: from_box / divisor + along_box * R::select(rising, value / divisor, R::one()),
            status: Status { outside_grid: is_outside, ..Status::GOOD },
        };
        Sample::select(is_outside, outside, Sample::new(value, gradient))
    }
}

impl<S: Storage> Sdf for Grid<S> {
    #[cfg_attr(feature = "std", inline(always))]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let located = R::apply(&Locate(&self.lattice), point);
        let [cell, share, within] = located;
        let corners = R::corners(cell.into(), &self.storage);
        let inside = R::apply(&Interpolate(&self.lattice), (share, corners));
        // Most points are within the box: what is said of others takes two roots and four divisions.
        if (within.x * within.y * within.z).lt(R::one()).any() {
            return R::apply(&Continue(&self.lattice), (point, located, inside));
        }
        let ([value], gradient) = inside;
        Sample::new(value, gradient)
    }

    /// Reads the samples on the faces of the box: where one is negative, the field is so for as far beyond.
    fn bounds(&self, level: f64) -> Aabb {
        let depth = -lowest_on_box(&self.lattice, &self.storage).min(0.0);
        self.lattice.bounds().inflate((level + depth).max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        self.slope_bound
    }

    /// By what the storage knows of the nodes of all cells that the box meets, or comes nearest to.
    #[cfg_attr(feature = "std", inline(always))]
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let global = BoxEnclosure { slope_bound: self.slope_bound, ..BoxEnclosure::ANYTHING };
        if !S::HAS_BLOCK_BOUNDS {
            return global;
        }
        let Some([first, last]) = self.lattice.nodes_around(region) else { return global };
        let Some(nodes) = self.storage.block_bounds(first, last) else { return global };
        let (least, greatest, slope) = (f64::from(nodes.least), f64::from(nodes.greatest), f64::from(nodes.slope));
        let bounds = self.lattice.bounds();
        let sticks_out = !bounds.encloses(region);
        if !sticks_out {
            return BoxEnclosure { least, greatest, slope_bound: slope.min(self.slope_bound) };
        }
        // Outside, the way to the grid is added to the value there, or makes a right angle with it: see `Grid`.
        let gap = |k: usize| (bounds.min[k] - region.max[k]).max(region.min[k] - bounds.max[k]).max(0.0);
        let away = libm::hypot(libm::hypot(gap(0), gap(1)), gap(2));
        let reaches_in = least < 0.0;
        let least = if reaches_in { least + away } else { libm::hypot(least, away) };
        let slope_bound = slope_bound_with_outside(slope, reaches_in);
        BoxEnclosure { least, greatest: f64::INFINITY, slope_bound: slope_bound.min(self.slope_bound) }
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn minimum_on_segment<R: Float>(&self, ends: [Vector3<R>; 2]) -> Option<SegmentMinimum<R>> {
        self.least_on(ends)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn minimum_on_triangle<R: Float>(&self, corners: [Vector3<R>; 3], enough: [R; 2]) -> Option<TriangleMinimum<R>> {
        self.least_in(corners, enough)
    }

    /// In a few cells by how far the gradient there may be from that at the middle.
    fn linearization_error(&self, region: &Aabb) -> f64 {
        let Some(GradientRange { gradients, .. }) = self.range_in::<f64>(region) else { return f64::INFINITY };
        let spread = gradients.greatest - gradients.least;
        spread.dot(&Vector3::from(region.extents())) * 0.5
    }

    /// In a few cells by how the gradient varies there (the mean value form of interval arithmetic: Moore 1966, "Interval
    /// Analysis", ch. 6): off by the square of the hull's size, where a bound by the slope is off by the size.
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        let Some(range) = self.range_in::<R>(&bounds(corners)) else {
            return Enclosure::by_slope(self, about, corners);
        };
        let value = self.value(about);
        let (mut fall, mut rise) = (R::zero(), R::zero());
        for corner in corners {
            let [falls, rises] = range.gradients.along(corner - about);
            (fall, rise) = (Real::min(fall, falls), Real::max(rise, rises));
        }
        let unrounded = Enclosure {
            value,
            least: Real::max(value + fall, range.least),
            greatest: Real::min(value + rise, range.greatest),
            gradients: range.gradients,
        };
        unrounded.widen(rounding(self.slope_bound, about, reach(about, corners), value))
    }
}
