//! Soft bodies as obstacles: a sheet on a soft body, whose field its tetrahedra carry.

use std::ops::ControlFlow;
use std::path::Path;

use sdf_core::cage::CageMap;
use sdf_core::nalgebra::Rotation3;
use sdf_field::{ContactOptions, Elements, MeshView, Threads};
use sdf_sim::scene::{self, Stage};
use sdf_sim::{CageRoom, CagedBody, Contacts, Motion, Query};

use crate::V3;

/// The scene, at a part of its size.
fn spec() -> scene::SceneSpec {
    let text = include_str!("../../../scenes/09-cloth-on-soft-pot.toml");
    let mut spec = scene::parse(text, "09-cloth-on-soft-pot").unwrap();
    spec.shrink();
    spec.substeps = 10;
    spec
}

/// The depth of each touched face of the sheet, by one map.
fn depths(stage: &Stage, body: &CagedBody, map: CageMap, room: &mut CageRoom) -> Vec<(u32, f64)> {
    let rest = body.at_rest(room).unwrap();
    let query = Query { thickness: 0.05, one_per_feature: false, ..Query::default() };
    let mut found = Contacts::default();
    let asked = body.with_map(map).with_obstacle(&rest, &stage.world, &mut CageRoom::default(), |obstacle| {
        query.find(obstacle, &stage.surfaces[0], &stage.world, &Motion::NONE, &mut found)
    });
    asked.unwrap().unwrap();
    found.contacts.iter().map(|contact| (contact.element, contact.distance)).collect()
}

#[test]
fn the_map_frozen_at_the_centroid_and_the_exact_one_agree_to_a_tenth_of_an_edge() {
    let spec = spec();
    let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
    let [body] = &stage.cages.clone()[..] else { panic!("one soft body") };
    let edge = 1.8 / 20.0;
    let (mut worst, mut compared, mut squeezed) = (0.0_f64, 0, 1.0_f64);
    let start = stage.world.x.clone();
    let figures = scene::run(&spec, &mut stage, "auto".parse().unwrap(), Threads::ONE, |frame, stage| {
        squeezed = squeezed.min(stage.world.min_volume_ratio());
        if frame % 10 == 0 {
            let [frozen, exact] =
                [CageMap::Frozen, CageMap::Exact].map(|map| depths(stage, body, map, &mut CageRoom::default()));
            for (face, depth) in &frozen {
                // Faces that one of the two does not report are within the margin's last tenth of an edge, or the depths differ.
                let other = exact.iter().find(|(other, _)| other == face).map_or(0.05, |(_, depth)| *depth);
                worst = worst.max((depth - other).abs());
                compared += 1;
            }
        }
        ControlFlow::Continue(())
    });
    let figures = figures.unwrap();
    let moved = stage.world.x.iter().zip(&start).map(|(now, start): (&V3, &V3)| (now - start).norm());
    println!("{compared} faces, differ by {worst}, {} of an edge; det F {squeezed}; {figures:?}", worst / edge);
    assert!(figures.finite && figures.deep_faces == 0, "{figures:?}");
    assert!(compared > 100 && squeezed < 0.95 && moved.fold(0.0, f64::max) > 0.1, "{compared}, {squeezed}");
    assert!(worst < 0.1 * edge, "{worst}");
}

#[test]
fn a_sheet_presses_on_the_body_that_carries_it() {
    let mut spec = spec();
    spec.gravity = [0.0; 3];
    spec.obstacle.clear();
    spec.friction = 0.0;
    spec.cloth[0].start.velocity = [0.0, 0.0, -2.0];
    let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
    let momentum = stage.world.momentum();
    let figures = scene::run(&spec, &mut stage, "fw".parse().unwrap(), Threads::ONE, |_, _| ControlFlow::Continue(()));
    let drag = figures.unwrap();
    assert!(drag.finite);
    // What the sheet loses the body gains, drag aside, which takes the same share of both.
    let left = (1.0 / spec.rate / f64::from(spec.substeps) * spec.drag).ln_1p();
    let left = (-left * f64::from(spec.frames * spec.substeps)).exp();
    let error = (stage.world.momentum() - momentum * left).norm() / momentum.norm();
    println!("momentum off by {error}");
    assert!(error < 1e-9, "{error}");
}

/// A point above the middle of a soft box whose cubes end where it ends. It is turned and stretched along its own z by 1.1; then a distance there
/// is 1.1 times that at rest. The bake's error and a cell's cut are below a hundredth of the distance in the middle of a side.
#[test]
fn the_field_goes_on_beyond_a_body_without_padding() {
    let text = "title = \"a box\"\nframes = 1\n[[soft]]\nmesh.cuboid = { half = [0.2, 0.2, 0.2] }\ncell = 0.2\n\
                touched = \"exact\"\ndensity = 100.0\nyoung = 1e5\npoisson = 0.3\n";
    let spec = scene::parse(text, "my.toml").unwrap();
    let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
    let turn = Rotation3::new(V3::new(0.3, -0.2, 0.5));
    let image = |x: &V3| turn * V3::new(x.x, x.y, 1.1 * x.z);
    stage.world.x.iter_mut().for_each(|x| *x = image(x));
    let [body] = &stage.cages.clone()[..] else { panic!("one soft body") };
    let (mut room, mut now) = (CageRoom::default(), CageRoom::default());
    let rest = body.at_rest(&mut room).unwrap();
    for (axis, above) in [(0, 0.01), (1, 0.01), (2, 0.01), (2, 0.002)] {
        let mut out = V3::zeros();
        out[axis] = 1.0;
        let points = [image(&(out * (0.2 + above))).into()];
        let options = ContactOptions { elements: Elements::Vertices, margin: 0.2, ..ContactOptions::default() };
        let found = body.with_obstacle(&rest, &stage.world, &mut now, |obstacle| {
            obstacle.contacts(MeshView { points: &points, faces: &[] }, &[], &options).unwrap()
        });
        let [contact] = found.unwrap().contacts[..] else { panic!("a contact along axis {axis}") };
        let distance = above * if axis == 2 { 1.1 } else { 1.0 };
        assert!((contact.distance / distance - 1.0).abs() < 0.01, "axis {axis}: {}, not {distance}", contact.distance);
        assert!((contact.normal - turn * out).norm() < 0.01, "axis {axis}: {}", contact.normal);
    }
}

/// A sheet that flies at a soft plate from some heights, so fast that within a frame it gets from beyond the plate's field to beyond the plate:
/// a frame is searched as often as it takes. Where a substep is too long for that, a warning says so.
#[test]
fn a_fast_sheet_does_not_pass_through_a_soft_plate() {
    let scene = |height: f64, speed: f64, padding: f64| {
        format!(
            "title = \"a blow\"\nframes = 8\ngravity = [0.0, 0.0, 0.0]\nthickness = 0.004\nbeyond = {{ below = -0.2 }}\n\
             [[cloth]]\nmesh.sheet = {{ cells = [2, 2], size = [0.2, 0.2], height = {height:?}, bend = 0.0, floor = 0.0 }}\n\
             mass = 0.01\nstart = {{ velocity = [0.0, 0.0, -{speed:?}] }}\n\
             [[soft]]\nmesh.cuboid = {{ half = [0.3, 0.3, 0.05] }}\ncell = 0.05\npadding = {padding:?}\ndensity = 1000.0\n\
             young = 1e7\npoisson = 0.3\ntouched = \"exact\"\n"
        )
    };
    let run = |text: &str| {
        let spec = scene::parse(text, "my.toml").unwrap();
        let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
        scene::run(&spec, &mut stage, "auto".parse().unwrap(), Threads::ONE, |_, _| ControlFlow::Continue(())).unwrap()
    };
    for (height, speed) in [0.33, 0.4].into_iter().flat_map(|height| [10.0, 15.0, 20.0].map(|speed| (height, speed))) {
        for padding in [0.0, 0.05] {
            let figures = run(&scene(height, speed, padding));
            assert_eq!(figures.beyond, 0, "from {height} at {speed}, padding {padding}");
            assert!(figures.warnings().is_empty(), "{:?}", figures.warnings());
        }
    }
    let warnings = run(&scene(0.33, 60.0, 0.0)).warnings();
    assert!(warnings.iter().any(|warning| warning.starts_with("something moves farther in a substep")), "{warnings:?}");
}
