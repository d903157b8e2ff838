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
use super::team_list::TeamList;
use crate::grid::Storage;
use crate::grid::exact::LANES;
use crate::number::Float;

/// One step along each axis, in an index of the eight cells around a corner.
const BIT: [usize; 3] = [1, 2, 4];

/// Words of a table, and of full lanes after the last.
pub(super) const TABLE_ROOM: usize = MAX_ENTRIES as usize + LANES;

/// The byte of all directions of descent.
const CREASE: u32 = 0xFF;

/// A word of four bytes by cell. Entry (x + 1, y + 1, z + 1) is that of cell (x, y, z) of the box; cells before the first
/// are there, and do not matter.
pub(super) struct DescentTable<const ROOM: usize> {
    words: TeamList<u32, ROOM>,
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

impl<const ROOM: usize> DescentTable<ROOM> {
    /// A table in which nothing matters.
    #[inline(always)]
    pub fn new<R: Float>(triangle: &GridTriangle<R>) -> Self {
        let [nx, ny, nz] = triangle.cell_counts().map(|count| count as usize);
        let row = nx.wrapping_add(1);
        let layer = row.wrapping_mul(ny.wrapping_add(1));
        let end = layer.wrapping_mul(nz.wrapping_add(1));
        Self { words: TeamList::new(u32::MAX), row, layer, end }
    }

    /// Enters the cells, with the feasible directions of each edge, which are zero for edges without a minimum. Creases count
    /// where `with_creases`.
    #[inline(always)]
    pub fn fill<R: Float, S: Storage, const CELLS: usize>(
        &mut self,
        storage: &S,
        triangle: &GridTriangle<R>,
        cells: &Cells<CELLS>,
        feasible: [u8; 3],
        with_creases: bool,
    ) {
        let [nx, ny, _] = triangle.cell_counts().map(|count| count as usize);
        let crease_mask = if with_creases { 0 } else { CREASE };
        let inverse = [1.0 / nx as f32, 1.0 / nx.wrapping_mul(ny) as f32];
        let mut from = 0;
        while from < cells.count {
            let Some(own) = cells.own_lanes::<S>(from) else { break };
            let (mut entries, mut words) = ([0_u32; LANES], [0_u32; LANES]);
            for lane in 0..S::LANES_OF_THREAD {
                let cell = &own[lane];
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
                (entries[lane], words[lane]) = (self.entry([x, y, z]) as u32, word);
            }
            // Lanes beyond the last cell repeat the first one.
            for lane in 0..LANES {
                let (entry, word) = (storage.of_lane(&entries, lane), storage.of_lane(&words, lane));
                self.words.set(storage, entry as usize, word);
            }
            from = from.saturating_add(LANES);
        }
    }

    #[inline(always)]
    fn entry(&self, [x, y, z]: [usize; 3]) -> usize {
        let [x, y, z] = [x.wrapping_add(1), y.wrapping_add(1), z.wrapping_add(1)];
        z.wrapping_mul(self.layer).wrapping_add(y.wrapping_mul(self.row)).wrapping_add(x)
    }

    /// The parts of creases and edges that may hold a minimum.
    #[inline(always)]
    pub fn parts<'a, S: Storage>(&'a self, storage: &'a S) -> PartsToSearch<'a, S, ROOM> {
        let before = self.steps_back();
        PartsToSearch {
            table: self,
            storage,
            before,
            next: before[7],
            lanes: 0,
            found: [0; LANES],
            cell: [0; 3],
            lines: 0,
        }
    }

    /// Entries from a cell back to its neighbours: bits 0, 1 and 2 of the index say before it in x, y and z.
    #[inline(always)]
    fn steps_back(&self) -> [usize; 8] {
        let (row, layer) = (self.row, self.layer);
        let both = row.wrapping_add(layer);
        [0, 1, row, row.wrapping_add(1), layer, layer.wrapping_add(1), both, both.wrapping_add(1)]
    }

    /// The lines that are to be searched in a cell's closure as they touch its first corner or one of the three edges
    /// and faces there: bit k for [`LinePart::line`] k in the first byte, the cell in the other three. `words` are those
    /// [`steps_back`](Self::steps_back) from its entry.
    #[cfg_attr(feature = "std", inline(never))]
    #[cfg_attr(not(feature = "std"), inline(always))]
    fn lines_at(&self, entry: usize, words: &[u32; 8]) -> u32 {
        let (layer, row) = ((self.layer as u32).max(1), (self.row as u32).max(1));
        let (z, in_layer) = (entry as u32 / layer, entry as u32 % layer);
        let (y, x) = (in_layer / row, in_layer % row);
        if x == 0 || y == 0 || z == 0 || entry >= self.end {
            return 0;
        }
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
        let byte = |index: u32, at: u32| index.wrapping_sub(1).wrapping_shl(at.wrapping_mul(8));
        lines | byte(x, 1) | byte(y, 2) | byte(z, 3)
    }
}

/// Iterator over the parts of a [`DescentTable`].
pub(super) struct PartsToSearch<'a, S, const ROOM: usize> {
    table: &'a DescentTable<ROOM>,
    storage: &'a S,
    /// See [`DescentTable::steps_back`].
    before: [usize; 8],
    /// The entry at which the next eight begin.
    next: usize,
    /// Bit k: lines were found at entry k of the last eight, and are still to be searched.
    lanes: u32,
    /// See [`DescentTable::lines_at`]; of the lanes that this thread computes.
    found: [u32; LANES],
    cell: [u32; 3],
    /// The lines that are left in the cell.
    lines: u32,
}

impl<S: Storage, const ROOM: usize> Iterator for PartsToSearch<'_, S, ROOM> {
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
            let [lines, x, y, z] = self.storage.of_lane(&self.found, lane).to_le_bytes();
            (self.cell, self.lines) = ([x, y, z].map(u32::from), u32::from(lines));
        }
        let line = self.lines.trailing_zeros();
        self.lines &= self.lines.wrapping_sub(1);
        Some(LinePart { line, cell: self.cell })
    }
}

impl<S: Storage, const ROOM: usize> PartsToSearch<'_, S, ROOM> {
    /// Joins the words of the cells around the next eight first corners, and finds the lines where that leaves a byte zero.
    #[inline(always)]
    fn look(&mut self) -> Option<()> {
        // Not by a loop, for which a card would keep them in memory.
        let [a, b, c, d, e, f, g, h] = self.before;
        let words = |back| self.table.words.lanes(self.storage, self.next.wrapping_sub(back));
        let words = [words(a)?, words(b)?, words(c)?, words(d)?, words(e)?, words(f)?, words(g)?, words(h)?];
        let mut joint = [u32::MAX; LANES];
        for lanes in &words {
            for lane in 0..S::LANES_OF_THREAD {
                joint[lane] &= lanes[lane];
            }
        }
        self.lanes = self.storage.lanes_where(&joint.map(|word| u8::from(zero_bytes(word) != 0)));
        if self.lanes != 0 {
            for lane in 0..S::LANES_OF_THREAD {
                if zero_bytes(joint[lane]) != 0 {
                    let entry = self.next.wrapping_add(self.storage.first_lane()).wrapping_add(lane);
                    self.found[lane] = self.table.lines_at(entry, &words.map(|lanes| lanes[lane]));
                }
            }
        }
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
