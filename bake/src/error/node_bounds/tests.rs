use sdf_core::grid::cell_slope;

use super::*;
use crate::testing::random;

fn nodes(first: [u32; 3], end: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    let [xs, ys, zs] = [0, 1, 2].map(|axis| first[axis]..end[axis]);
    zs.flat_map(move |z| {
        let xs = xs.clone();
        ys.clone().flat_map(move |y| xs.clone().map(move |x| [x, y, z]))
    })
}

#[test]
fn bounds_in_lanes_are_those_of_all_nodes_and_cells_one_by_one() {
    let mut state = 5;
    for counts in [[2, 2, 2], [8, 9, 10], [17, 3, 16], [25, 18, 8], [9, 9, 9]] {
        let lattice = Lattice::new([0.0; 3], 0.3, counts).unwrap();
        let samples: Vec<f32> = (0..lattice.node_count()).map(|_| random(&mut state) as f32).collect();
        let value = |node: [u32; 3]| samples[lattice.index(node)];
        let corner = |cell: [u32; 3], corner: u32| value(std::array::from_fn(|axis| cell[axis] + (corner >> axis & 1)));
        for brick in nodes([0; 3], counts.map(|n| n.div_ceil(BRICK))) {
            let halo_block = HaloBlock::new(&lattice, brick, |[x, y, z], row| {
                (x..).zip(row).for_each(|(x, sample)| *sample = value([x, y, z]));
            });
            let first = brick.map(|n| n * BRICK);
            let end: [u32; 3] = std::array::from_fn(|axis| counts[axis].min(first[axis] + BRICK));
            let own = || nodes(first, end).map(value);
            let first_cell = first.map(|n| n.saturating_sub(1));
            let end_cell: [u32; 3] = std::array::from_fn(|axis| end[axis].min(counts[axis] - 1));
            let slope = |cell| cell_slope(std::array::from_fn(|index| corner(cell, index as u32)), 0.3);
            let steepest = nodes(first_cell, end_cell).map(slope).fold(0.0, f64::max);
            let wanted = BlockBounds {
                range: Interval {
                    lower: own().fold(f32::INFINITY, f32::min),
                    upper: own().fold(f32::NEG_INFINITY, f32::max),
                },
                slope_bound: round_up(steepest),
            };
            let found = halo_block.bounds();
            assert_eq!(found.range, wanted.range, "{brick:?} of {counts:?}");
            let excess = found.slope_bound / wanted.slope_bound;
            assert!((1.0..1.000_001).contains(&excess), "{brick:?} of {counts:?}: {excess}");

            let (rounding, max_magnitude) = (0.1, 0.9);
            let largest_if_sign_changes = |cell: [u32; 3]| {
                let corners: [f32; 8] = std::array::from_fn(|index| corner(cell, index as u32));
                let largest = corners.iter().fold(0.0_f32, |largest, corner| largest.max(corner.abs()));
                let has_both = corners.iter().any(|c| *c < rounding) && corners.iter().any(|c| *c >= -rounding);
                if has_both && largest <= max_magnitude { largest } else { 0.0 }
            };
            let wanted = nodes(first, end_cell).map(largest_if_sign_changes).fold(0.0, f32::max);
            let in_band = |cell: &[u32; 3]| {
                let largest = (0..8).map(|index| corner(*cell, index).abs()).fold(0.0, f32::max);
                (largest <= 0.8).then_some(largest)
            };
            let largest: Vec<f32> = nodes(first, end_cell).filter_map(|cell| in_band(&cell)).collect();
            let max_magnitude_in_band = largest.iter().copied().fold(0.0, f32::max);
            let cells = BandCells { count: largest.len() as u64, max_magnitude: max_magnitude_in_band };
            let found = halo_block.largest_at_sign_change(rounding, max_magnitude, 0.8);
            assert_eq!(found, (wanted, cells), "{brick:?} of {counts:?}");
        }
    }
}
