//! Which tetrahedron holds a point? A uniform table of cells, each with the tetrahedra whose boxes meet it, in lent slices. It is
//! built by counting (Knuth 1998, "The Art of Computer Programming", vol. 3, §5.2, algorithm D): once over all to count, once to
//! fill; so it is cheap enough to be built again whenever the cage has moved.

use nalgebra::{Matrix3, Vector3};

use super::tet_bounds;
use crate::Aabb;
use crate::contact::TetPoint;
use crate::number::Real;
use crate::placed::affine::inverse;
use crate::rounding::{BARYCENTRIC, INVERSE_RESIDUAL};

/// Says if a tetrahedron has a map to material space that can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TetStatus {
    /// It has.
    Good,
    /// It is turned inside out, and lies over others.
    Inverted,
    /// It is so flat, at rest or deformed, that its inverse has lost all digits, or a corner is not finite.
    IllConditioned,
}

/// D⁻¹ of one tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TetFrame {
    /// Rows: the gradients of the weights of the corners 1, 2 and 3. Zero where it is ill-conditioned.
    pub(super) inverse: Matrix3<f64>,
    /// Its sign is that of the volume; 0 where the tetrahedron is ill-conditioned.
    pub(super) determinant: f64,
}

impl TetFrame {
    /// A tetrahedron without an inverse: fills buffers.
    pub const ILL_CONDITIONED: Self =
        Self { inverse: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), determinant: 0.0 };

    fn new([v0, v1, v2, v3]: &[Vector3<f64>; 4]) -> Self {
        let edges = Matrix3::from_columns(&[v1 - v0, v2 - v0, v3 - v0]);
        let Some(found) = inverse(&edges) else { return Self::ILL_CONDITIONED };
        let residual = (edges * found - Matrix3::identity()).amax();
        // Of the inverse, whose entries are not smaller than their reciprocal lengths.
        let determinant = found.determinant();
        let is_good = residual <= INVERSE_RESIDUAL && determinant.is_finite();
        if is_good { Self { inverse: found, determinant } } else { Self::ILL_CONDITIONED }
    }
}

/// Why no table was built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableRoom {
    /// `starts` must have one entry more than there are cells, and there must be a cell along each axis.
    Starts {
        /// So many entries are needed.
        needed: usize,
    },
    /// `entries` is too short.
    Entries {
        /// So many entries are needed.
        needed: usize,
    },
}

/// The tetrahedra near each cell of a uniform grid.
#[derive(Clone, Copy, Debug)]
pub struct TetTable<'a> {
    bounds: Aabb,
    /// Cells per length along each axis.
    density: [f64; 3],
    shape: [u32; 3],
    /// Beginning of each cell's tetrahedra in `entries`, x fastest; at last their number.
    starts: &'a [u32],
    entries: &'a [u32],
}

/// A table shape for so many tetrahedra in a box: about one cell for each, nearly cubes. `starts` then needs the product plus 1.
pub fn table_shape(bounds: &Aabb, tet_count: usize) -> [u32; 3] {
    let extents = bounds.extents().map(|extent| if extent > 0.0 && extent.is_finite() { extent } else { 0.0 });
    let longest = extents.iter().fold(0.0_f64, |longest, extent| longest.max(*extent));
    let cells = (tet_count.max(1) as f64).min(2e6);
    // As if no side were thinner than a hundredth of the longest.
    let sides = extents.map(|extent| if longest > 0.0 { (extent / longest).max(0.01) } else { 1.0 });
    let scale = libm::cbrt(cells / sides.iter().product::<f64>());
    sides.map(|side| (side * scale) as u32 + 1)
}

impl<'a> TetTable<'a> {
    /// Sorts tetrahedra into `shape` cells of the box around them all. Tetrahedra with points that are not finite or not there are
    /// left out. `starts` and `entries` are overwritten.
    pub fn build(
        points: &[[f64; 3]],
        tets: &[[u32; 4]],
        shape: [u32; 3],
        starts: &'a mut [u32],
        entries: &'a mut [u32],
    ) -> Result<Self, TableRoom> {
        let boxes =
            || (0..).zip(tets).filter_map(|(tet, corners)| Some((tet, tet_bounds(&tet_corners(points, corners)?))));
        let bounds = boxes().map(|(_, bounds)| bounds).reduce(|a, b| a.union(&b));
        let bounds = bounds.unwrap_or(Aabb { min: [0.0; 3], max: [0.0; 3] });
        let extents = bounds.extents();
        let density = core::array::from_fn(|k| if extents[k] > 0.0 { f64::from(shape[k]) / extents[k] } else { 0.0 });
        let cell_count = shape.iter().try_fold(1_usize, |count, along| count.checked_mul(*along as usize)).unwrap_or(0);
        let needed = cell_count.saturating_add(1);
        if cell_count == 0 || starts.len() != needed {
            return Err(TableRoom::Starts { needed });
        }
        let mut table = Self { bounds, density, shape, starts: &[], entries: &[] };
        starts.fill(0);
        for (_, bounds) in boxes() {
            table.visit_cells(&bounds, |_, cell| {
                if let Some(count) = starts.get_mut(cell) {
                    *count = count.saturating_add(1);
                }
            });
        }
        // From counts to ends. Filling from the back turns ends into starts.
        let mut end = 0_u32;
        for start in starts.iter_mut() {
            end = end.saturating_add(*start);
            *start = end;
        }
        let needed = end as usize;
        let Some(entries) = entries.get_mut(..needed) else { return Err(TableRoom::Entries { needed }) };
        for (tet, bounds) in boxes() {
            table.visit_cells(&bounds, |_, cell| {
                if let Some(start) = starts.get_mut(cell) {
                    *start = start.saturating_sub(1);
                    if let Some(entry) = entries.get_mut(*start as usize) {
                        *entry = tet;
                    }
                }
            });
        }
        table.starts = starts;
        table.entries = entries;
        Ok(table)
    }

    /// First and last cell along each axis that a box meets. Clamped to the table.
    fn cell_range(&self, bounds: &Aabb) -> [[u32; 3]; 2] {
        let cell = |x: [f64; 3]| {
            core::array::from_fn(|k| {
                // `as` makes 0 of NaN and of what is below 0.
                let index = ((x[k] - self.bounds.min[k]) * self.density[k]) as u32;
                index.min(self.shape[k].saturating_sub(1))
            })
        };
        [cell(bounds.min), cell(bounds.max)]
    }

    /// Visits the cells that a box meets: their places along the axes, and their indices.
    fn visit_cells(&self, bounds: &Aabb, mut visit: impl FnMut([u32; 3], usize)) {
        let [first, last] = self.cell_range(bounds);
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                for x in first[0]..=last[0] {
                    let row = (z as usize).saturating_mul(self.shape[1] as usize).saturating_add(y as usize);
                    visit([x, y, z], row.saturating_mul(self.shape[0] as usize).saturating_add(x as usize));
                }
            }
        }
    }

    fn tets_in(&self, cell: usize) -> &'a [u32] {
        let [start, end] =
            [cell, cell.saturating_add(1)].map(|at| self.starts.get(at).map_or(0, |start| *start as usize));
        self.entries.get(start..end).unwrap_or(&[])
    }
}

/// A mesh of tetrahedra in one shape, with what finds points in it.
#[derive(Clone, Copy, Debug)]
pub struct TetLocator<'a> {
    points: &'a [[f64; 3]],
    tets: &'a [[u32; 4]],
    frames: &'a [TetFrame],
    table: TetTable<'a>,
}

impl<'a> TetLocator<'a> {
    /// Fills `frames`, one for each tetrahedron. `table` was built of the same points and tetrahedra. `None` if the number of frames
    /// is another one.
    pub fn new(
        points: &'a [[f64; 3]],
        tets: &'a [[u32; 4]],
        frames: &'a mut [TetFrame],
        table: TetTable<'a>,
    ) -> Option<Self> {
        for (frame, corners) in frames.iter_mut().zip(tets) {
            *frame = tet_corners(points, corners).map_or(TetFrame::ILL_CONDITIONED, |corners| TetFrame::new(&corners));
        }
        (frames.len() == tets.len()).then_some(Self { points, tets, frames, table })
    }

    /// The corners of each tetrahedron.
    pub fn tets(&self) -> &'a [[u32; 4]] {
        self.tets
    }

    /// Positions of a tetrahedron's corners; `None` where one is not finite, or not there.
    pub fn corners(&self, tet: u32) -> Option<[Vector3<f64>; 4]> {
        tet_corners(self.points, self.tets.get(tet as usize)?)
    }

    pub(super) fn frame(&self, tet: u32) -> Option<&'a TetFrame> {
        self.frames.get(tet as usize)
    }

    /// The position of a point of a tetrahedron.
    pub fn point(&self, at: &TetPoint<f64>) -> Option<Vector3<f64>> {
        let [v0, v1, v2, v3] = self.corners(at.tet)?;
        let [_, w1, w2, w3] = at.weights;
        // Edges keep their digits far from the origin.
        Some(v0 + (v1 - v0) * w1 + (v2 - v0) * w2 + (v3 - v0) * w3)
    }

    /// Barycentric weights of any point in a tetrahedron, negative outside; `None` where it is ill-conditioned.
    pub fn weights(&self, tet: u32, point: Vector3<f64>) -> Option<[f64; 4]> {
        let frame = self.frame(tet).filter(|frame| frame.determinant != 0.0)?;
        let [v0, ..] = self.corners(tet)?;
        let w = frame.inverse * (point - v0);
        Some([1.0 - w.x - w.y - w.z, w.x, w.y, w.z])
    }

    /// The tetrahedron that holds a point, and its weights there. Of several the one that it is deepest in, then the first.
    pub fn locate(&self, point: Vector3<f64>) -> Option<TetPoint<f64>> {
        self.locate_where(point, |_| true)
    }

    /// [`locate`](Self::locate) among some of the tetrahedra.
    pub(super) fn locate_where(&self, point: Vector3<f64>, is_wanted: impl Fn(u32) -> bool) -> Option<TetPoint<f64>> {
        let at = Aabb { min: point.into(), max: point.into() };
        let mut best: Option<(f64, TetPoint<f64>)> = None;
        self.visit_near(&at, |tet| {
            let Some(weights) = self.weights(tet, point).filter(|_| is_wanted(tet)) else { return };
            let depth = weights.iter().fold(f64::INFINITY, |least, weight| least.min(*weight));
            let is_deeper = best.is_none_or(|(deepest, best)| depth > deepest || (depth == deepest && tet < best.tet));
            if depth >= -BARYCENTRIC && is_deeper {
                best = Some((depth, TetPoint { tet, weights }));
            }
        });
        best.map(|(_, at)| at)
    }

    /// Visits each tetrahedron once whose box may meet a box.
    pub(super) fn visit_near(&self, region: &Aabb, mut visit: impl FnMut(u32)) {
        if !region.min.iter().chain(&region.max).all(|x| x.is_representable()) {
            return;
        }
        // Weights may be negative by rounding.
        let region = region.inflate(BARYCENTRIC * self.table.bounds.diagonal());
        if self.table.bounds.intersection(&region).is_none() {
            return;
        }
        let [first, _] = self.table.cell_range(&region);
        self.table.visit_cells(&region, |cell, index| {
            for tet in self.table.tets_in(index) {
                let Some(bounds) = self.corners(*tet).map(|corners| tet_bounds(&corners)) else { continue };
                // Once: in the first cell that both boxes meet.
                let [start, _] = self.table.cell_range(&bounds);
                if (0..3).all(|k| cell[k] == start[k].max(first[k])) && bounds.intersection(&region).is_some() {
                    visit(*tet);
                }
            }
        });
    }
}

fn tet_corners(points: &[[f64; 3]], corners: &[u32; 4]) -> Option<[Vector3<f64>; 4]> {
    let mut found = [Vector3::zeros(); 4];
    for (corner, index) in found.iter_mut().zip(corners) {
        *corner = Vector3::from(*points.get(*index as usize)?);
    }
    let is_representable = found.iter().flatten().all(|x| x.is_representable());
    is_representable.then_some(found)
}
