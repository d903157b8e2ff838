//! Where can a minimum lie on the borders of cells and on the triangle's edges?
//!
//! A point p of the triangle lies in one cell, or on the border of two, four or eight. If φ falls along one direction d in
//! *all* cells that hold p, and a step along d stays in the triangle, then p is not a minimum: however short the step, it
//! ends in one of these cells. So a minimum lies
//!
//! - inside a cell without a direction of descent (`interior_minimum`),
//! - on a *crease*, the cut of the triangle with the border of cells that share no direction of descent, or
//! - on an edge, in cells that share none of the directions that are feasible there.
//!
//! [`DescentTable`] holds four bytes for each cell of the triangle's box: the directions of descent, and those of them that
//! are feasible on each edge. A byte is 255 where the cell, or the edge in it, does not matter. The bytes of cells that meet
//! in a point are joined by "and", four at once; a byte that becomes zero tells of a possible minimum. Borders of four and
//! eight cells count only where those of fewer cells, which are searched with their ends, do not.
//!
//! A cell that the triangle just misses makes more pieces to search, not fewer: nothing depends on rounding.

use super::cells::Cells;
use super::grid_triangle::{GridTriangle, MAX_ENTRIES};
use crate::grid::exact::LANES;
use crate::number::Float;

/// One step along each axis, in an index of the eight cells around a corner.
const BIT: [usize; 3] = [1, 2, 4];

/// The byte of all directions of descent.
const CREASE: u32 = 0xFF;

/// A word of four bytes by cell. Entry (x + 1, y + 1, z + 1) is that of cell (x, y, z) of the box; cells before the first
/// are there, and do not matter.
pub(super) struct DescentTable {
    words: [u32; MAX_ENTRIES as usize + LANES],
    row: usize,
    layer: usize,
    end: usize,
}

/// A part of a line to be searched: that in a cell's closure.
#[derive(Clone, Copy)]
pub(super) struct LinePart {
    /// 0, 1 and 2: the cut with the lower face of the cell across x, y or z. 3, 4 and 5: the edges ab, ac and bc.
    pub line: u32,
    /// Counted from the first cell.
    pub cell: [u32; 3],
}

impl DescentTable {
    /// A table in which nothing matters.
    #[inline(always)]
    pub fn new<R: Float>(triangle: &GridTriangle<R>) -> Self {
        let [nx, ny, nz] = triangle.cell_counts().map(|count| count as usize);
        let row = nx.wrapping_add(1);
        let layer = row.wrapping_mul(ny.wrapping_add(1));
        let end = layer.wrapping_mul(nz.wrapping_add(1));
        Self { words: [u32::MAX; MAX_ENTRIES as usize + LANES], row, layer, end }
    }

    /// Enters the cells, with the feasible directions of each edge, which are zero for edges without a minimum. Creases count
    /// where `with_creases`.
    #[inline(always)]
    pub fn fill<R: Float>(&mut self, triangle: &GridTriangle<R>, cells: &Cells, feasible: [u8; 3], with_creases: bool) {
        let [nx, ny, _] = triangle.cell_counts().map(|count| count as usize);
        let crease_mask = if with_creases { 0 } else { CREASE };
        let inverse = [1.0 / nx as f32, 1.0 / nx.wrapping_mul(ny) as f32];
        for cell in cells.iter() {
            let descents = u32::from(cell.descents);
            let mut word = descents | crease_mask;
            for (edge, feasible) in (0..3_u32).zip(feasible) {
                let is_met = feasible != 0 && u32::from(cell.edges).wrapping_shr(edge) & 1 != 0;
                let byte = if is_met { descents & u32::from(feasible) } else { 0xFF };
                word |= byte.wrapping_shl(edge.wrapping_add(1).wrapping_mul(8));
            }
            // The half keeps rounding away from the next integer.
            let number = usize::from(cell.number);
            let z = ((number as u32 as f32 + 0.5) * inverse[1]) as usize;
            let in_layer = number.wrapping_sub(z.wrapping_mul(nx.wrapping_mul(ny)));
            let y = ((in_layer as u32 as f32 + 0.5) * inverse[0]) as usize;
            let x = in_layer.wrapping_sub(y.wrapping_mul(nx));
            let entry = self.entry([x, y, z]);
            if let Some(slot) = self.words.get_mut(entry) {
                *slot = word;
            }
        }
    }

    #[inline(always)]
    fn entry(&self, [x, y, z]: [usize; 3]) -> usize {
        let [x, y, z] = [x.wrapping_add(1), y.wrapping_add(1), z.wrapping_add(1)];
        z.wrapping_mul(self.layer).wrapping_add(y.wrapping_mul(self.row)).wrapping_add(x)
    }

    /// The parts of creases and edges that may hold a minimum.
    #[inline(always)]
    pub fn parts(&self) -> PartsToSearch<'_> {
        let before = self.steps_back();
        PartsToSearch { table: self, before, next: before[7], first: 0, lanes: 0, cell: [0; 3], lines: 0 }
    }

    /// Entries from a cell back to its neighbours: bits 0, 1 and 2 of the index say before it in x, y and z.
    #[inline(always)]
    fn steps_back(&self) -> [usize; 8] {
        let (row, layer) = (self.row, self.layer);
        let both = row.wrapping_add(layer);
        [0, 1, row, row.wrapping_add(1), layer, layer.wrapping_add(1), both, both.wrapping_add(1)]
    }

    /// A cell, and the lines that are to be searched in its closure as they touch its first corner or one of the three edges
    /// and faces there: bit k for [`LinePart::line`] k.
    #[inline(never)]
    fn lines_at(&self, entry: usize) -> ([u32; 3], u32) {
        let (layer, row) = ((self.layer as u32).max(1), (self.row as u32).max(1));
        let (z, in_layer) = (entry as u32 / layer, entry as u32 % layer);
        let (y, x) = (in_layer / row, in_layer % row);
        if x == 0 || y == 0 || z == 0 || entry >= self.end {
            return ([0; 3], 0);
        }
        // Not by a loop, for which a card would keep them in memory.
        let [a, b, c, d, e, f, g, h] = self.steps_back();
        let word = |back| self.words.get(entry.wrapping_sub(back)).copied().unwrap_or(u32::MAX);
        let words = [word(a), word(b), word(c), word(d), word(e), word(f), word(g), word(h)];
        let first = zero_bytes(words[0]);
        let (mut lines, mut edges) = (0, first);
        // Borders of two cells: by axis, then by the other two coordinates.
        let mut pairs = [[0; 8]; 3];
        for axis in 0..3 {
            for at in 0..8 {
                if at & BIT[axis] == 0 {
                    pairs[axis][at] = zero_bytes(words[at] & words[(at | BIT[axis]) % 8]);
                }
            }
            let neighbour = words[BIT[axis] % 8];
            let is_crease = words[0] & CREASE != CREASE && neighbour & CREASE != CREASE;
            lines |= u32::from(is_crease && pairs[axis][0] & CREASE != 0).wrapping_shl(axis as u32);
            edges |= pairs[axis][0] & !first & !zero_bytes(neighbour);
        }
        // Of four, two by two.
        let mut known = 0;
        for (a, b, across) in [(0, 1, 4), (1, 2, 1), (2, 0, 2)] {
            for at in [0, across] {
                let (with_a, with_b) = ((at | BIT[a % 3]) % 8, (at | BIT[b % 3]) % 8);
                let all = zero_bytes(words[at % 8] & words[with_a] & words[with_b] & words[(with_a | with_b) % 8]);
                known |= all;
                if at == 0 {
                    let (pairs_a, pairs_b) = (&pairs[a % 3], &pairs[b % 3]);
                    let new = all & !(pairs_a[0] | pairs_b[0] | pairs_a[with_b] | pairs_b[with_a]);
                    lines |= u32::from(new & CREASE != 0).wrapping_shl(a as u32);
                    edges |= new;
                }
            }
        }
        let new = zero_bytes(words.iter().fold(u32::MAX, |joint, word| joint & word)) & !known;
        lines |= u32::from(new & CREASE != 0);
        edges |= new;
        for edge in 0..3_u32 {
            let byte = edges.wrapping_shr(edge.wrapping_add(1).wrapping_mul(8)) & 0xFF;
            lines |= u32::from(byte != 0).wrapping_shl(edge.wrapping_add(3));
        }
        ([x.wrapping_sub(1), y.wrapping_sub(1), z.wrapping_sub(1)], lines)
    }
}

/// Iterator over the parts of a [`DescentTable`].
pub(super) struct PartsToSearch<'a> {
    table: &'a DescentTable,
    /// See [`DescentTable::steps_back`].
    before: [usize; 8],
    /// The entry at which the next eight begin.
    next: usize,
    /// The first of the last eight.
    first: usize,
    /// Bit k: entry `first` + k is still to be looked at.
    lanes: u32,
    cell: [u32; 3],
    /// The lines that are left in the cell.
    lines: u32,
}

impl Iterator for PartsToSearch<'_> {
    type Item = LinePart;

    #[inline(always)]
    fn next(&mut self) -> Option<LinePart> {
        while self.lines == 0 {
            while self.lanes == 0 {
                if self.next >= self.table.end {
                    return None;
                }
                self.look()?;
            }
            let lane = self.lanes.trailing_zeros() as usize;
            self.lanes &= self.lanes.wrapping_sub(1);
            (self.cell, self.lines) = self.table.lines_at(self.first.wrapping_add(lane));
        }
        let line = self.lines.trailing_zeros();
        self.lines &= self.lines.wrapping_sub(1);
        Some(LinePart { line, cell: self.cell })
    }
}

impl PartsToSearch<'_> {
    /// Joins the words of the cells around the next eight first corners.
    #[inline(always)]
    fn look(&mut self) -> Option<()> {
        let mut joint = [u32::MAX; LANES];
        for back in self.before {
            let words = self.table.words.get(self.next.wrapping_sub(back)..)?.first_chunk::<LANES>()?;
            for lane in 0..LANES {
                joint[lane] &= words[lane];
            }
        }
        let mut lanes = 0;
        for lane in 0..LANES {
            lanes |= u32::from(zero_bytes(joint[lane]) != 0).wrapping_shl(lane as u32);
        }
        (self.first, self.lanes) = (self.next, lanes);
        self.next = self.next.saturating_add(LANES);
        Some(())
    }
}

/// 128 in each byte that is zero, 0 in the others.
#[inline(always)]
fn zero_bytes(word: u32) -> u32 {
    const LOW: u32 = 0x7F7F_7F7F;
    !(((word & LOW).wrapping_add(LOW)) | word | LOW)
}
