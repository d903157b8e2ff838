//! Overlaps of rigid bodies are undone at the speed that a scene gives.

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
