//! Error bounds of a sparse grid of an open mesh, where the sign jumps: in the band and far beyond it.

use sdf_bake::MeshDistance;
use sdf_bake::sparse::{self, Quantize, SparseGrid};
use sdf_core::grid::sparse::{BRICK, DEEP_ERROR, Sparse};
use sdf_core::grid::{Grid, Storage};
use sdf_core::{Aabb, EnclosedSdf, Sdf};

use super::{BAND, open_meshes};
use crate::meshes::{self, Mesh};
use crate::oracle;
use crate::random::Random;

/// Counts of random points.
#[derive(Debug, Default)]
struct Found {
    /// Number of those whose sign is wrong, more than half of the band away from the surface.
    at_jumps: usize,
    /// Number of those with another sign than all corners of their cell by their winding number, in slots with bricks and without.
    in_pockets: [usize; 2],
}

fn check<C: Quantize>(name: &str, mesh: &Mesh, cells: u32, random: &mut Random) -> Found {
    let baked = mesh.baked();
    let distance = MeshDistance::new(&baked, None);
    let bounds = baked.bounds();
    let lattice = sdf_bake::lattice_around(&bounds, bounds.longest_side() / f64::from(cells), 4).unwrap();
    let band = BAND * lattice.spacing();
    let grid: SparseGrid<C> = sparse::bake(&distance, &lattice, band, &|_| ()).unwrap();
    let storage = Sparse::new(&lattice, &grid).unwrap();
    let field = Grid::new(lattice, storage, grid.slope_bound).unwrap().with_band(band);
    let field = field.with_error_bound(grid.error_bound).with_deep_error(DEEP_ERROR * lattice.spacing());
    let mut found = Found::default();
    for _ in 0..20_000 {
        let point = random.point_in_box(lattice.bounds().min, lattice.bounds().max);
        let by_winding = distance.signed_distance(point.into());
        let value = field.value(point);
        let cell = oracle::cell_of(&lattice, point);
        let exact = oracle::with_sign_of_cell(by_winding, storage.corners(cell));
        let has_no_brick = storage.brick_at(cell.map(|index| index / BRICK)).is_none();
        found.in_pockets[usize::from(has_no_brick)] += usize::from(exact != by_winding);
        let bound = field.error_bound(&Aabb { min: point.into(), max: point.into() });
        let context = || format!("{name} of {cells} cells: {value} for {exact} at {point:?}: {bound:?}");
        assert!(value - exact <= bound.above && exact - value <= bound.below, "{}", context());
        let are_alike = value.min(exact) > bound.levels.upper || value.max(exact) < bound.levels.lower;
        assert!(are_alike || (value - exact).abs() <= bound.near, "{}", context());
        assert!(value <= bound.reach(exact), "{}", context());
        found.at_jumps += usize::from((value < 0.0) != (exact < 0.0) && exact.abs() > 0.5 * band);
    }
    found
}

#[test]
fn no_point_of_an_open_mesh_is_off_by_more_than_its_error_bound() {
    let mut random = Random::from_env();
    let cube = meshes::cube();
    let lid: Vec<usize> =
        (0..cube.triangles.len()).filter(|t| cube.corners()[*t].iter().all(|corner| corner.z == 1.0)).collect();
    let mut open = open_meshes(&mut random);
    open.push(("cube without a lid", cube.clone().without(&lid)));
    open.push(("turned cube without a lid", cube.without(&lid).turned(&random.rotation())));
    let mut at_jumps = 0;
    for (name, mesh) in open {
        for cells in [20, 50] {
            let found = check::<f32>(name, &mesh, cells, &mut random);
            println!("{name}, {cells} cells: {found:?}");
            at_jumps += found.at_jumps + check::<u8>(name, &mesh, cells, &mut random).at_jumps;
        }
    }
    assert!(at_jumps > 400, "{at_jumps} points");
}
