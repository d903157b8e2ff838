//! Overlaps of rigid bodies are undone at the speed that a scene gives, also those of bodies that start inside of each other.

use std::ops::ControlFlow;
use std::path::Path;

use sdf_field::Threads;
use sdf_sim::scene::{self, Stage};

use crate::V3;

const FLOOR: &str =
    "[[obstacle]]\nshape = 'field = { shape = \"half_space\", normal = [0.0, 0.0, 1.0], offset = 0.0 }'\n";
const CUBE: &str = "[[rigid]]\nmesh.cuboid = { half = [0.1, 0.1, 0.1] }\n";

/// The middle of the first surface's vertices at the start and after each frame.
fn middles(text: &str) -> Vec<V3> {
    let spec = scene::parse(&format!("title = \"a floor\"\n{text}{FLOOR}"), "my.toml").unwrap();
    let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
    let mut middles = vec![];
    scene::run(&spec, &mut stage, "auto".parse().unwrap(), Threads::ONE, |_, stage| {
        let points = stage.surfaces[0].points(&stage.world);
        middles.push(points.iter().map(|point| V3::from(*point)).sum::<V3>() / points.len() as f64);
        ControlFlow::Continue(())
    })
    .unwrap();
    middles
}

/// Deep in a floor, a box rises at the recovery speed, and by up to 5 % more: each of its rows parts where the others turn it.
#[test]
fn a_box_leaves_an_overlap_at_the_recovery_speed_whatever_the_substeps() {
    let cube = format!("{CUBE}start.translate = [0.0, 0.0, -5.0]\n");
    let settings = [0.05, 1.0].into_iter().flat_map(|recovery| [1, 10, 40].map(|substeps| (recovery, substeps)));
    for (recovery, substeps) in settings {
        let keys = format!(
            "thickness = 0.001\ngravity = [0.0, 0.0, 0.0]\nrecovery = {recovery:?}\nsubsteps = {substeps}\nframes = 31\n"
        );
        let middles = middles(&format!("{keys}{cube}"));
        let speed = (middles[31].z - middles[1].z) * 2.0;
        assert!(
            speed > 0.98 * recovery && speed < 1.06 * recovery,
            "a box in {substeps} substeps rises at {speed}, not at {recovery}"
        );
    }
}

/// Two boxes of side 0.4 that overlap by half or more, flush or turned. They part at the recovery speed from the first frame on until they
/// stand the thickness apart, without a velocity. Flush ones go the shortest way: along x, by what they overlap there and the thickness, to
/// 1/20 of that, within which a contact is kept.
#[test]
fn boxes_that_start_inside_of_each_other_part_at_the_recovery_speed() {
    let cases = [
        ([0.08, 0.0, 0.0], [0.0; 3], Some(0.32)),
        ([0.2, 0.0, 0.0], [0.0; 3], Some(0.2)),
        ([0.0; 3], [0.0; 3], Some(0.4)),
        ([0.05, 0.1, 0.02], [20.0, 30.0, 10.0], None),
    ];
    for (translate, turn, overlap) in cases {
        let keys = "thickness = 0.002\ngravity = [0.0, 0.0, 0.0]\nrecovery = 0.6\nframes = 60\n";
        let body = "[[rigid]]\nmesh.cuboid = { half = [0.2, 0.2, 0.2] }\n";
        let second = format!("start = {{ translate = {translate:?}, turn = {turn:?} }}\n");
        let text = format!("title = \"two boxes\"\n{keys}{body}{body}{second}");
        let spec = scene::parse(&text, "my.toml").unwrap();
        let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
        let apart = |stage: &Stage| stage.world.bodies[1].position - stage.world.bodies[0].position;
        let (start, mut ways) = (apart(&stage), vec![]);
        let figures = scene::run(&spec, &mut stage, "auto".parse().unwrap(), Threads::ONE, |_, stage| {
            ways.push((apart(stage) - start).norm());
            ControlFlow::Continue(())
        });
        let figures = figures.unwrap();
        assert_eq!(figures.deep_faces, 0, "{translate:?}: {figures:?}");
        // Rounding of ten steps.
        let speeds: Vec<f64> = ways.windows(2).map(|ways| (ways[1] - ways[0]) * spec.rate).collect();
        assert!(speeds.iter().all(|speed| *speed < 0.6 * (1.0 + 1e-9)), "{translate:?}: {speeds:?}");
        assert!((speeds[0] - 0.6).abs() < 1e-9 && speeds[59] < 1e-9, "{translate:?}: {speeds:?}");
        assert!(figures.max_speed < 1e-9, "{translate:?}: thrown out at {}", figures.max_speed);
        if let Some(overlap) = overlap {
            let way = ways[60];
            assert!((way - overlap - 0.002).abs() < 1e-4, "{translate:?}: {way}, not {overlap} and the thickness");
        }
    }
}
