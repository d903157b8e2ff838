//! No margin is taken at which a sparse grid leaves contacts out, however it is moved and combined.

use sdf_field::core::AnyField;
use sdf_field::core::grid::owned::Layout;
use sdf_field::core::placed::{Placed, Similarity, Stretch};
use sdf_field::core::shapes::Cuboid;
use sdf_field::export::{ExportFormat, ExportOptions};
use sdf_field::{BakeOptions, ContactOptions, Field, GridSize, MeshView, Threads};
use sdf_procedural::SpikedBall;

/// A sparse ball of the radius 1, and its band.
fn ball() -> (Field, f64) {
    let mesh = SpikedBall { levels: 3, radius: 1.0 }.mesh();
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let options = BakeOptions { size: GridSize::Cells(48), layout: Layout::Sparse, band: 2, ..BakeOptions::default() };
    let field = Field::bake(view, &options).unwrap().field;
    let band = field.info().unwrap().band.unwrap();
    (field, band)
}

/// The same ball in a dense grid.
fn dense_ball(padding: u32) -> Field {
    let mesh = SpikedBall { levels: 3, radius: 1.0 }.mesh();
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let options = BakeOptions { size: GridSize::Cells(48), padding, ..BakeOptions::default() };
    Field::bake(view, &options).unwrap().field
}

fn placed(field: &Field, translation: [f64; 3], scale: f64) -> Field {
    field.placed(Similarity::new(translation, [0.0, 0.6, 0.0, 0.8], scale).unwrap()).unwrap()
}

fn stretched(field: &Field, factors: [f64; 3]) -> Field {
    let placement = Stretch::new(factors).unwrap();
    Field::new(AnyField::Stretched(Box::new(Placed { field: field.as_any().clone(), placement })))
}

#[test]
fn a_margin_is_taken_as_far_as_a_combination_of_sparse_grids_has_distances() {
    let (ball, band) = ball();
    let (far, block) = (placed(&ball, [9.0, 0.0, 0.0], 0.5), Field::new(Cuboid::new([2.0; 3]).unwrap()));
    let dense = Field::new(dense_ball(2).into_any());
    let at_box = |field: &Field| field.grid().unwrap().lowest_boundary_sample();
    let any = f64::INFINITY;
    let shrunk = ball.offset(-0.5).unwrap();
    let cases = [
        (block.clone(), -any, any),
        (ball.clone(), -band, band),
        (Field::new(ball.as_any().clone()), -band, any),
        (placed(&ball, [1.0, 0.0, 0.0], 1.0), -band, any),
        (placed(&ball, [0.0; 3], 3.0), -3.0 * band, any),
        (stretched(&ball, [3.0, 2.0, 4.0]), -2.0 * band, any),
        (Field::union(&[block.clone(), ball.clone(), far]).unwrap(), -0.5 * band, any),
        (block.intersection(&ball).unwrap(), -band, any),
        (block.difference(&ball).unwrap(), -band.min(at_box(&ball)), band),
        (block.difference(&dense).unwrap(), -at_box(&dense), any),
        (dense.clone(), -any, any),
        (Field::union(&[block.clone(), dense.clone()]).unwrap(), -any, any),
        (ball.difference(&block).unwrap(), -band, any),
        (ball.smooth_union(&block, 0.1).unwrap(), -band, any),
        (ball.offset(0.25).unwrap(), -band - 0.25, any),
        (shrunk.clone(), -band + 0.5, any),
        (stretched(&shrunk, [3.0, 2.0, 4.0]), 4.0 * (0.5 - band), any),
        (ball.shell(0.01).unwrap(), -any, band - 0.005),
        (ball.shell(1.0).unwrap(), -any, band - 0.5),
        (block.difference(&ball.shell(0.01).unwrap()).unwrap(), 0.005 - band, any),
    ];
    for (index, (field, lowest, highest)) in cases.iter().enumerate() {
        let context = || format!("case {index}: {lowest} to {highest}");
        assert_eq!(field.max_margin().unwrap_or(any), *highest, "{}", context());
        assert_eq!(field.has_grid(), index > 0);
        for (end, beyond) in [(lowest, -1e-3), (highest, 1e-3)] {
            if !end.is_finite() {
                assert!(field.check_margin(end.signum() * 1e6).is_ok(), "{}", context());
                continue;
            }
            assert!(field.check_margin(*end).is_ok(), "{}", context());
            let error = field.check_margin(end + beyond).unwrap_err();
            assert_eq!(error.is_too_deep(), beyond < 0.0, "{}", context());
            let text = error.to_string();
            assert!(text.contains(&end.abs().to_string()) && text.contains("wider band"), "{text}");
        }
        assert!(field.check_margin(f64::NAN).is_err());
    }
}

/// A block without a grid is known no deeper than the grid knows distances around itself.
#[test]
fn a_margin_deeper_than_the_box_of_what_is_taken_away_is_refused() {
    let (block, dense) = (Field::new(Cuboid::new([4.0; 3]).unwrap()), dense_ball(4));
    let at_box = dense.grid().unwrap().lowest_boundary_sample();
    // About 1.6 from the ball, in the corner of a box of half a side of 1.2: φ of the grid is lower.
    let (point, depth) = ([1.5; 3], 1.5 * 3.0_f64.sqrt() - 1.0);
    let left = block.difference(&dense).unwrap();
    let value = left.sample(&[point], Threads::ONE)[0].value;
    assert!(value > 0.1 - depth && value < -at_box, "{value}, {depth} deep");
    let points = [point, [1.501, 1.5, 1.5], [1.5, 1.501, 1.5]];
    let view = MeshView { points: &points, faces: &[[0, 1, 2]] };
    let options = ContactOptions { margin: 0.1 - depth, ..ContactOptions::default() };
    assert!(left.contacts(view, &options).unwrap().contacts.is_empty(), "the contact is left out");
    assert!(options.check_margin(&left).unwrap_err().is_too_deep());
    assert!(ContactOptions { margin: -0.9 * at_box, ..options }.check_margin(&left).is_ok());
}

/// A grid that is moved has no distances outside of its box, and its samples claim none.
#[test]
fn a_grid_that_is_moved_and_sampled_again_knows_no_more_than_before() {
    let (known, all) = (dense_ball(3), dense_ball(24));
    let at_box = known.grid().unwrap().lowest_boundary_sample();
    let [moved, truth] = [&known, &all].map(|ball| placed(ball, [0.3, 0.0, 0.0], 1.0));
    let levels = moved.known_levels();
    assert!(levels.lower == f64::NEG_INFINITY && (levels.upper - at_box).abs() < 1e-12, "{levels:?}, {at_box}");
    let blob =
        moved.export(ExportFormat::Blob, &ExportOptions { cells: Some(60), ..ExportOptions::default() }).unwrap();
    let blob = Field::from_bytes(&blob.bytes, "blob").unwrap();
    let padding = blob.info().unwrap().padding;
    assert!(0.9 * at_box < padding && padding <= at_box, "{padding}, {at_box}");
    let mut wrong_beyond = 0;
    for n in 0..8000 {
        let point = [n % 20, n / 20 % 20, n / 400].map(|n| f64::from(n) * 0.14 - 1.3);
        let [found, exact] = [&blob, &truth].map(|field| field.sample(&[point], Threads::ONE)[0].value);
        let is_off = (found - exact).abs() > 1.5 * blob.grid().unwrap().lattice().spacing();
        assert!(!is_off || found > padding, "{point:?}: {found} in place of {exact}, within {padding}");
        wrong_beyond += usize::from(is_off);
    }
    assert!(wrong_beyond > 0);
    for distance in [1.1 * at_box, -1.1 * at_box] {
        let offset = known.offset(distance).unwrap();
        assert_eq!(offset.knows_surface(), distance < 0.0);
        assert_eq!(offset.export(ExportFormat::Glb, &ExportOptions::default()).is_ok(), distance < 0.0);
    }
}

#[test]
fn a_margin_that_leaves_out_deep_contacts_is_refused_and_a_complete_search_has_them_all() {
    let (ball, band) = ball();
    let within = SpikedBall { levels: 1, radius: 0.1 }.mesh();
    let view = MeshView { points: &within.points, faces: &within.triangles };
    let pair = Field::union(&[ball.clone(), placed(&ball, [9.0, 0.0, 0.0], 1.0)]).unwrap();
    for field in [ball, pair] {
        // All faces are 0.7 deep at least: the ball is flatter than a sphere by less than 0.1, and spikes are shorter than 0.1.
        let options = ContactOptions { margin: -0.7, ..ContactOptions::default() };
        let error = options.check_margin(&field).unwrap_err();
        assert!(error.is_too_deep() && (error.limit + band).abs() < 1e-12, "{error}");
        let complete = ContactOptions { complete: true, ..options };
        assert!(complete.check_margin(&field).is_ok());
        assert_eq!(field.contacts(view, &complete).unwrap().contacts.len(), within.triangles.len());
    }
}
