//! Fields that are stored as samples on a regular grid and interpolated trilinearly.

mod block_bounds;
mod dense;
mod exact;
mod gradient_range;
mod lattice;
#[cfg(feature = "alloc")]
pub mod owned;
pub mod sparse;
mod trilinear;

use nalgebra::Vector3;

pub use block_bounds::WithBlockBounds;
pub use dense::Dense;
use gradient_range::GradientRange;
pub use lattice::Lattice;

use crate::number::interval::Interval;
use crate::number::kernel::{LaneKernel, run};
use crate::number::{Float, Gather, Mask, Real};
use crate::rounding::rounding;
use crate::simplex::max_distance;
use crate::vector::{from_f64, norm};
use crate::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ExactMinimum, Goal, Sample, Sdf, Status};

/// Where a grid's samples come from.
pub trait Storage {
    /// The samples at the eight nodes of a cell, x fastest: 000, 100, 010, 110, 001, 101, 011, 111. The cell's indices
    /// are below [`Lattice::cells`].
    fn corners(&self, cell: [u32; 3]) -> [f32; 8];

    /// [`corners`](Self::corners) of several cells, whose indices are given axis by axis as whole numbers.
    #[inline(always)]
    fn corners_in_lanes<R: Float, const N: usize>(&self, [x, y, z]: [[R; N]; 3]) -> [[R; N]; 8] {
        let mut corners = [[R::zero(); N]; 8];
        for cell in 0..N {
            let of_cell = self.corners([x[cell].to_index(), y[cell].to_index(), z[cell].to_index()]);
            for corner in 0..8 {
                corners[corner][cell] = R::from_stored(of_cell[corner]);
            }
        }
        corners
    }

    /// Can [`block_bounds`](Self::block_bounds) be `Some`? Where not, it is never called.
    const HAS_BLOCK_BOUNDS: bool = false;

    /// Bounds of the nodes from `first` to `last`, where the storage knows them without visiting each.
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
    fn corners_in_lanes<R: Float, const N: usize>(&self, cells: [[R; N]; 3]) -> [[R; N]; 8] {
        (**self).corners_in_lanes(cells)
    }

    const HAS_BLOCK_BOUNDS: bool = S::HAS_BLOCK_BOUNDS;

    #[inline(always)]
    fn block_bounds(&self, first: [u32; 3], last: [u32; 3]) -> Option<BlockBounds> {
        (**self).block_bounds(first, last)
    }
}

/// Bounds of a block of nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockBounds {
    /// Holds every sample.
    pub range: Interval<f32>,
    /// Lipschitz constant of the interpolant in every cell with a corner in the block.
    pub slope_bound: f32,
}

impl BlockBounds {
    /// Bounds of no node: the neutral element of [`union`](Self::union).
    pub const EMPTY: Self = Self { range: Interval::<f32>::EMPTY, slope_bound: 0.0 };

    /// Bounds of two blocks together.
    #[inline(always)]
    pub fn union(self, other: Self) -> Self {
        Self { range: self.range.hull(other.range), slope_bound: self.slope_bound.max(other.slope_bound) }
    }
}

/// The samples at the corners of cells, as the number types fetch them.
struct Corners<'a, S>(&'a S);

impl<S: Storage> Gather for Corners<'_, S> {
    #[inline(always)]
    fn gather_one(&self, cell: [u32; 3]) -> [f32; 8] {
        self.0.corners(cell)
    }
    #[inline(always)]
    fn gather_lanes<T: Float, const N: usize>(&self, cells: [[T; N]; 3]) -> [[T; N]; 8] {
        self.0.corners_in_lanes(cells)
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
        let located = run(&Locate(&self.lattice), point);
        let [cell, share, within] = located;
        let corners = R::gather(cell.into(), &Corners(&self.storage));
        let inside = run(&Interpolate(&self.lattice), (share, corners));
        // Most points are within the box: what is said of others takes two roots and four divisions.
        if (within.x * within.y * within.z).lt(R::one()).any() {
            return run(&Continue(&self.lattice), (point, located, inside));
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
}

impl<S: Storage> EnclosedSdf for Grid<S> {
    /// From the block bounds of the nodes of all cells that the box meets, or comes nearest to.
    #[cfg_attr(feature = "std", inline(always))]
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let global = BoxEnclosure { slope_bound: self.slope_bound, ..BoxEnclosure::ANYTHING };
        if !S::HAS_BLOCK_BOUNDS {
            return global;
        }
        let Some([first, last]) = self.lattice.nodes_around(region) else { return global };
        let Some(nodes) = self.storage.block_bounds(first, last) else { return global };
        let (lower, upper) = (f64::from(nodes.range.lower), f64::from(nodes.range.upper));
        let slope = f64::from(nodes.slope_bound);
        let bounds = self.lattice.bounds();
        let sticks_out = !bounds.encloses(region);
        if !sticks_out {
            return BoxEnclosure { range: Interval { lower, upper }, slope_bound: slope.min(self.slope_bound) };
        }
        // Outside, the distance to the box is added to the value there, or is the other leg of a right angle: see `Grid`.
        let gap = |k: usize| (bounds.min[k] - region.max[k]).max(region.min[k] - bounds.max[k]).max(0.0);
        let distance = libm::hypot(libm::hypot(gap(0), gap(1)), gap(2));
        let is_inside = lower < 0.0;
        let lower = if is_inside { lower + distance } else { libm::hypot(lower, distance) };
        let slope_bound = slope_bound_with_outside(slope, is_inside);
        let range = Interval { lower, upper: f64::INFINITY };
        BoxEnclosure { range, slope_bound: slope_bound.min(self.slope_bound) }
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        match *corners.as_slice() {
            [a, b] => self.minimum_on_segment([a, b]).map(resize),
            [a, b, c] => self.minimum_on_triangle([a, b, c], goal).map(resize),
            _ => None,
        }
    }

    /// In a few cells by how far the gradient there may be from that at the middle.
    fn linearization_error(&self, region: &Aabb) -> f64 {
        let Some(GradientRange { gradients, .. }) = self.gradient_range::<f64>(region) else { return f64::INFINITY };
        let spread = gradients.upper - gradients.lower;
        spread.dot(&Vector3::from(region.extents())) * 0.5
    }

    /// In a few cells by how the gradient varies there (the mean value form of interval arithmetic: Moore 1966, "Interval
    /// Analysis", ch. 6): off by the square of the hull's size, where a bound by the slope is off by the size.
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        let Some(inside) = self.gradient_range::<R>(&Aabb::around_corners(corners)) else {
            return Enclosure::from_slope(self, about, corners);
        };
        let value = self.value(about);
        let (mut fall, mut rise) = (R::zero(), R::zero());
        for corner in corners {
            let change = inside.gradients.change_along(corner - about);
            (fall, rise) = (Real::min(fall, change.lower), Real::max(rise, change.upper));
        }
        let unrounded = Enclosure {
            value,
            range: Interval {
                lower: Real::max(value + fall, inside.range.lower),
                upper: Real::min(value + rise, inside.range.upper),
            },
            gradients: inside.gradients,
        };
        unrounded.widen(rounding(self.slope_bound, about, max_distance(about, corners), value))
    }
}

/// The same minimum with `N` weights, of which it has as many.
#[inline(always)]
fn resize<R: Float, const M: usize, const N: usize>(found: ExactMinimum<R, M>) -> ExactMinimum<R, N> {
    let mut weights = [R::zero(); N];
    weights.iter_mut().zip(found.weights).for_each(|(weight, known)| *weight = known);
    ExactMinimum { weights, value: found.value, lower_bound: found.lower_bound, evaluations: found.evaluations }
}
