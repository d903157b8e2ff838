//! Which bytes has each part of a NanoVDB file? Offsets as in NanoVDB.h of OpenVDB 10 and 11 (version 32.6), little-endian.

use sdf_core::grid::Lattice;

use super::tree::{Node, Tree};
use super::{FLOAT, LEVEL_SET, MAGIC, size};

/// 32.6.0: 11, 11 and 10 bits.
const VERSION: u32 = 32 << 21 | 6 << 10;
/// The grid has boxes (2), extremes (4), and nodes in breadth-first order (32).
const GRID_FLAGS: u32 = 2 | 4 | 32;
const HAS_BOX: u8 = 2;
/// All ones: no checksum was computed.
const NO_CHECKSUM: u64 = u64::MAX;
/// Longest name in a grid, with a NUL to follow.
const MAX_NAME: usize = 255;

/// Writes a tree over a lattice.
pub(super) struct Writer<'a> {
    pub lattice: &'a Lattice,
    pub name: &'a str,
    pub band: f32,
    pub tree: &'a Tree,
}

/// Facts about the active nodes of a leaf, or of all.
#[derive(Clone, Copy)]
struct Active {
    count: u64,
    lower: [i32; 3],
    upper: [i32; 3],
    min: f32,
    max: f32,
}

impl Active {
    const NONE: Self =
        Self { count: 0, lower: [i32::MAX; 3], upper: [i32::MIN; 3], min: f32::INFINITY, max: f32::NEG_INFINITY };

    fn union(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            lower: std::array::from_fn(|axis| self.lower[axis].min(other.lower[axis])),
            upper: std::array::from_fn(|axis| self.upper[axis].max(other.upper[axis])),
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }
}

/// Places bytes one after the other.
struct Cursor<'a> {
    bytes: &'a mut [u8],
    at: usize,
}

impl Cursor<'_> {
    fn put(&mut self, bytes: &[u8]) {
        self.bytes[self.at..self.at + bytes.len()].copy_from_slice(bytes);
        self.at += bytes.len();
    }

    fn u32s(&mut self, numbers: &[u32]) {
        numbers.iter().for_each(|number| self.put(&number.to_le_bytes()));
    }

    fn i32s(&mut self, numbers: &[i32]) {
        numbers.iter().for_each(|number| self.put(&number.to_le_bytes()));
    }

    fn u64s(&mut self, numbers: &[u64]) {
        numbers.iter().for_each(|number| self.put(&number.to_le_bytes()));
    }

    fn f32s(&mut self, numbers: &[f32]) {
        numbers.iter().for_each(|number| self.put(&number.to_le_bytes()));
    }

    fn f64s(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|number| self.put(&number.to_le_bytes()));
    }
}

fn cursor(bytes: &mut [u8], at: usize) -> Cursor<'_> {
    Cursor { bytes, at }
}

/// Offsets of the levels from the grid's first byte.
struct Offsets {
    root: usize,
    uppers: usize,
    lowers: usize,
    leaves: usize,
    end: usize,
}

impl Writer<'_> {
    /// The file. `leaf` returns the values of a slot, z fastest, and which of them are nodes of the lattice.
    pub fn write(&self, leaf: impl Fn([u32; 3]) -> ([f32; 512], [bool; 512]) + Sync) -> Option<Vec<u8>> {
        let Tree { uppers, lowers, leaves } = self.tree;
        u32::try_from(leaves.len()).ok()?;
        let root = size::GRID + size::TREE;
        let upper = root + size::ROOT + size::TILE * uppers.len();
        let lower = upper + size::UPPER * uppers.len();
        let first_leaf = lower + size::LOWER * lowers.len();
        let end = first_leaf + size::LEAF * leaves.len();
        let offsets = Offsets { root, uppers: upper, lowers: lower, leaves: first_leaf, end };
        let name = &self.name[..self.name.floor_char_boundary(MAX_NAME)];
        let before = size::FILE + size::META + name.len() + 1;
        let mut bytes = vec![0; before + end];
        let grid = &mut bytes[before..];
        let active = self.leaves(&mut grid[first_leaf..], leaf);
        if active.count == 0 {
            return None;
        }
        self.grid(grid, name, &active, &offsets);
        self.root(grid, &active, &offsets);
        for (index, node) in uppers.iter().enumerate() {
            let layout = NodeLayout { side: 4096, masks: 4096, table: 8256, children: (lower, size::LOWER) };
            self.node(grid, upper + index * size::UPPER, node, &layout, &active);
        }
        for (index, node) in lowers.iter().enumerate() {
            let layout = NodeLayout { side: 128, masks: 512, table: 1088, children: (first_leaf, size::LEAF) };
            self.node(grid, lower + index * size::LOWER, node, &layout, &active);
        }
        self.head(&mut bytes, name, &active, end);
        Some(bytes)
    }

    /// Box of 24 bytes if something is active, then as bounds of the last corner a node beyond.
    fn world_box(&self, active: &Active) -> [f64; 6] {
        let node = |index: [i32; 3], more: i32| -> [f64; 3] {
            std::array::from_fn(|axis| {
                self.lattice.origin()[axis] + self.lattice.spacing() * f64::from(index[axis] + more)
            })
        };
        let ([a, b, c], [d, e, f]) = (node(active.lower, 0), node(active.upper, 1));
        [a, b, c, d, e, f]
    }

    fn head(&self, bytes: &mut [u8], name: &str, active: &Active, grid_size: usize) {
        let Tree { uppers, lowers, leaves } = self.tree;
        let mut out = cursor(bytes, 0);
        out.put(&MAGIC);
        out.u32s(&[VERSION, 1]); // one grid; codec 0: not packed
        let size = grid_size as u64;
        out.u64s(&[size, size, name_key(name), active.count]);
        out.u32s(&[FLOAT, LEVEL_SET]);
        out.f64s(&self.world_box(active));
        out.i32s(&active.lower);
        out.i32s(&active.upper);
        out.f64s(&[self.lattice.spacing(); 3]);
        out.u32s(&[name.len() as u32 + 1, leaves.len() as u32, lowers.len() as u32, uppers.len() as u32, 1]);
        out.u32s(&[0, 0, 0, 0, VERSION]); // active tiles of each level; codec and padding
        out.put(name.as_bytes());
    }

    fn grid(&self, grid: &mut [u8], name: &str, active: &Active, offsets: &Offsets) {
        let (h, origin) = (self.lattice.spacing(), self.lattice.origin());
        let Tree { uppers, lowers, leaves } = self.tree;
        let mut out = cursor(grid, 0);
        out.put(&MAGIC);
        out.u64s(&[NO_CHECKSUM]);
        out.u32s(&[VERSION, GRID_FLAGS, 0, 1]); // grid 0 of 1
        out.u64s(&[offsets.end as u64]);
        out.put(name.as_bytes());
        out.at = 296;
        let diagonal = |x: f64| [x, 0.0, 0.0, 0.0, x, 0.0, 0.0, 0.0, x];
        let map: Vec<f64> = [&diagonal(h)[..], &diagonal(1.0 / h), &origin, &[1.0]].concat();
        map.iter().for_each(|x| out.f32s(&[*x as f32]));
        out.f64s(&map);
        out.f64s(&self.world_box(active));
        out.f64s(&[h; 3]);
        out.u32s(&[LEVEL_SET, FLOAT]);
        out.u64s(&[offsets.end as u64]); // blind data: none, behind the grid
        let mut tree = cursor(grid, size::GRID);
        let from_tree = |offset: usize| (offset - size::GRID) as u64;
        tree.u64s(&[offsets.leaves, offsets.lowers, offsets.uppers, offsets.root].map(from_tree));
        tree.u32s(&[leaves.len() as u32, lowers.len() as u32, uppers.len() as u32, 0, 0, 0]);
        tree.u64s(&[active.count]);
    }

    fn root(&self, grid: &mut [u8], active: &Active, offsets: &Offsets) {
        let mut out = cursor(grid, offsets.root);
        out.i32s(&active.lower);
        out.i32s(&active.upper);
        out.u32s(&[self.tree.uppers.len() as u32]);
        out.f32s(&[self.band, active.min, active.max, 0.0, 0.0]);
        for (index, node) in self.tree.uppers.iter().enumerate() {
            let [x, y, z] = node.place.map(u64::from);
            let mut tile = cursor(grid, offsets.root + size::ROOT + index * size::TILE);
            tile.u64s(&[z | y << 21 | x << 42, (offsets.uppers + index * size::UPPER - offsets.root) as u64]);
            tile.u32s(&[0]);
            tile.f32s(&[self.band]);
        }
    }

    fn node(&self, grid: &mut [u8], at: usize, node: &Node, layout: &NodeLayout, active: &Active) {
        let mut out = cursor(grid, at);
        let first = node.place.map(|index| (index * layout.side) as i32);
        out.i32s(&first);
        out.i32s(&first.map(|x| x + layout.side as i32 - 1));
        out.u64s(&[u64::from(HAS_BOX)]);
        let child_mask = at + 32 + layout.masks;
        cursor(grid, child_mask + layout.masks).f32s(&[active.min, active.max, 0.0, 0.0]);
        let table = at + layout.table;
        for entry in 0..8 * layout.masks {
            cursor(grid, table + 8 * entry).f32s(&[self.band]);
        }
        for entry in &node.inside {
            cursor(grid, table + 8 * entry).f32s(&[-self.band]);
        }
        for (entry, child) in &node.children {
            grid[child_mask + entry / 8] |= 1 << (entry % 8);
            let (first, size) = layout.children;
            cursor(grid, table + 8 * entry).u64s(&[(first + child * size - at) as u64]);
        }
    }

    fn leaves(&self, bytes: &mut [u8], leaf: impl Fn([u32; 3]) -> ([f32; 512], [bool; 512]) + Sync) -> Active {
        let nodes = bytes.chunks_exact_mut(size::LEAF).zip(&self.tree.leaves).collect();
        let active = sdf_parallel::map_items(nodes, || (), |(), (bytes, slot)| self.leaf(bytes, *slot, leaf(*slot)));
        active.into_iter().fold(Active::NONE, Active::union)
    }

    fn leaf(&self, bytes: &mut [u8], slot: [u32; 3], (values, is_node): ([f32; 512], [bool; 512])) -> Active {
        let first = slot.map(|index| 8 * index as i32);
        let mut active = Active::NONE;
        for (index, (value, is_node)) in values.iter().zip(is_node).enumerate() {
            if is_node && value.abs() < self.band {
                let node = [index >> 6, index >> 3 & 7, index & 7];
                let node = std::array::from_fn(|axis| first[axis] + node[axis] as i32);
                active = active.union(Active { count: 1, lower: node, upper: node, min: *value, max: *value });
                bytes[16 + index / 8] |= 1 << (index % 8);
            }
        }
        let (lower, upper) = if active.count > 0 { (active.lower, active.upper) } else { (first, first) };
        let mut out = cursor(bytes, 0);
        out.i32s(&lower);
        out.put(&[0, 1, 2].map(|axis| (upper[axis] - lower[axis]) as u8));
        out.put(&[if active.count > 0 { HAS_BOX } else { 0 }]);
        out.at = 80;
        out.f32s(&if active.count > 0 { [active.min, active.max, 0.0, 0.0] } else { [values[0], values[0], 0.0, 0.0] });
        out.f32s(&values);
        active
    }
}

/// Where the parts of an internal node are.
struct NodeLayout {
    /// Nodes of the lattice along a side.
    side: u32,
    /// Bytes of each of the two masks; eight entries of the table a byte.
    masks: usize,
    /// Offset of the table.
    table: usize,
    /// Offset of the first node of the next level, and the size of one.
    children: (usize, usize),
}

/// NanoVDB's hash of a grid's name.
fn name_key(name: &str) -> u64 {
    name.bytes().fold(0_u64, |hash, byte| hash.wrapping_mul(67).wrapping_add(u64::from(byte)).wrapping_add(hash >> 56))
}
