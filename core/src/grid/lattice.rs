//! The nodes of a regular grid: their positions, indices and cells.

use crate::{Aabb, Parameter, Real};

/// A regular grid of nodes: node (i, j, k) lies at `origin + spacing · (i, j, k)`.
///
/// Samples belong to nodes. A grid of n nodes along an axis has n − 1 cells there. In memory x runs fastest:
/// `index = (k · ny + j) · nx + i`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    origin: [Parameter; 3],
    spacing: Parameter,
    inv_spacing: Parameter,
    nodes: [u32; 3],
}

impl Lattice {
    /// Most nodes along an axis: f32 holds all integers up to it.
    pub const MAX_NODES: u32 = 1 << 24;

    /// `None` unless the origin is finite, the spacing and its reciprocal positive and finite, every axis has 2 to
    /// [`Self::MAX_NODES`] nodes, and their number fits `usize`.
    pub fn new(origin: [f64; 3], spacing: f64, nodes: [u32; 3]) -> Option<Self> {
        let far_corner = core::array::from_fn(|k| origin[k] + spacing * f64::from(nodes[k]));
        let finite = [origin, far_corner].iter().flatten().all(|x: &f64| x.is_finite());
        let counts_fit = nodes.iter().all(|n| (2..=Self::MAX_NODES).contains(n));
        let total = nodes.iter().try_fold(1_usize, |total, n| total.checked_mul(*n as usize));
        let inv_spacing = 1.0 / spacing;
        (finite && spacing > 0.0 && inv_spacing.is_finite() && counts_fit && total.is_some()).then_some(Self {
            origin: origin.map(Parameter::from),
            spacing: spacing.into(),
            inv_spacing: inv_spacing.into(),
            nodes,
        })
    }

    /// A lattice from numbers that were checked.
    pub(super) fn from_parameters(
        origin: [Parameter; 3],
        [spacing, inv_spacing]: [Parameter; 2],
        nodes: [u32; 3],
    ) -> Self {
        Self { origin, spacing, inv_spacing, nodes }
    }

    /// [`origin`](Self::origin), [`spacing`](Self::spacing) and [`inv_spacing`](Self::inv_spacing) in any number type.
    #[inline(always)]
    pub(super) fn in_numbers<R: Real>(&self) -> ([R; 3], R, R) {
        (self.origin.map(R::from_parameter), R::from_parameter(self.spacing), R::from_parameter(self.inv_spacing))
    }

    /// The position of node (0, 0, 0).
    #[inline(always)]
    pub fn origin(&self) -> [f64; 3] {
        self.origin.map(|origin| origin.double)
    }

    /// The distance between neighbouring nodes, the same along every axis.
    #[inline(always)]
    pub fn spacing(&self) -> f64 {
        self.spacing.double
    }

    /// 1 / spacing, stored because division is slow on small processors.
    #[inline(always)]
    pub fn inv_spacing(&self) -> f64 {
        self.inv_spacing.double
    }

    /// Number of nodes along x, y and z.
    #[inline(always)]
    pub fn nodes(&self) -> [u32; 3] {
        self.nodes
    }

    /// Number of cells along x, y and z.
    #[inline(always)]
    pub fn cells(&self) -> [u32; 3] {
        core::array::from_fn(|axis| self.nodes[axis].wrapping_sub(1))
    }

    /// Number of all nodes.
    #[inline(always)]
    pub fn node_count(&self) -> usize {
        self.nodes.iter().fold(1, |count: usize, n| count.wrapping_mul(*n as usize))
    }

    /// Index of a node's sample in memory.
    #[inline(always)]
    pub fn index(&self, [i, j, k]: [u32; 3]) -> usize {
        (k as usize * self.nodes[1] as usize + j as usize) * self.nodes[0] as usize + i as usize
    }

    /// The position of a node.
    #[inline(always)]
    pub fn node(&self, index: [u32; 3]) -> [f64; 3] {
        core::array::from_fn(|axis| self.origin[axis].double + self.spacing.double * f64::from(index[axis]))
    }

    /// First and last node of the cells that a box meets. A box outside of the grid is clamped to it first. `None`
    /// unless the box is finite and not empty.
    #[inline(always)]
    pub fn nodes_around(&self, region: &Aabb) -> Option<[[u32; 3]; 2]> {
        let is_valid = region.min.iter().zip(&region.max).all(|(low, high)| low <= high && (high - low).is_finite());
        let cell_along = |x: f64, origin: f64, cells: u32| {
            // The conversion truncates, and saturates at zero.
            let steps = ((x - origin) * self.inv_spacing()) as u32;
            steps.min(cells.wrapping_sub(1))
        };
        let ([x0, y0, z0], [nx, ny, nz]) = (self.origin(), self.cells());
        let cell = |[x, y, z]: [f64; 3]| [cell_along(x, x0, nx), cell_along(y, y0, ny), cell_along(z, z0, nz)];
        let [first, last]: [[u32; 3]; 2] = [cell(region.min), cell(region.max)];
        let [x, y, z] = last;
        is_valid.then_some([first, [x.wrapping_add(1), y.wrapping_add(1), z.wrapping_add(1)]])
    }

    /// The box from the first node to the last.
    #[inline]
    pub fn bounds(&self) -> Aabb {
        Aabb { min: self.origin(), max: self.node(self.cells()) }
    }
}
