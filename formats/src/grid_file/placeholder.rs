use sdf_core::grid::sparse::{Code, Scale};
use sdf_core::grid::{Grid, Storage};

use super::header::Header;

/// Placeholder for a sample that is not read yet; takes no memory. A grid of these has block bounds but no values.
#[derive(Clone, Copy)]
pub(super) struct SamplePlaceholder;

impl Code for SamplePlaceholder {
    fn decode(self, _scale: Scale) -> f32 {
        0.0
    }
}

impl Storage for SamplePlaceholder {
    fn corners(&self, _cell: [u32; 3]) -> [f32; 8] {
        [0.0; 8]
    }
}

/// A grid with the header's lattice and slope bound.
pub(super) fn placeholder_grid<S: Storage>(header: &Header, storage: S) -> Grid<S> {
    Grid::new(header.lattice, storage, header.about.slope_bound).expect("the header has a valid slope bound")
}
