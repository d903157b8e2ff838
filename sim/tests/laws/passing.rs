//! Rigid bodies that pass by, and bodies that are struck within a frame.

use std::ops::ControlFlow;
use std::path::Path;

use sdf_field::Threads;
use sdf_procedural::random::{Random, test_seed};
use sdf_sim::scene::{self, Stage};

use crate::V3;

/// Runs a scene of these tables; the stage at the end.
fn ended(tables: &str) -> Stage {
    let spec = scene::parse(&format!("title = \"all\"\nthickness = 0.002\n{tables}"), "my.toml").unwrap();
    let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
    let each = |_: u32, _: &Stage| ControlFlow::Continue(());
    scene::run(&spec, &mut stage, "auto".parse().unwrap(), Threads::ONE, each).unwrap();
    stage
}

const BOX: &str = "[[rigid]]\nmesh.cuboid = { half = [0.2, 0.2, 0.2] }\n";

/// A table 0.1 thick, its top at z = 0.
const TABLE: &str = "[[obstacle]]\nshape = 'field = { shape = \"box\", half_extents = [0.5, 0.5, 0.05] }'\ntranslate = [0.0, 0.0, -0.05]\n";

/// The box is 0.005 beside the table, where a plane at its edge would stop it.
#[test]
fn a_box_falls_past_the_edge_of_a_table() {
    for place in ["[0.705, 0.0, 0.5]", "[0.705, 0.705, 0.5]"] {
        let stage = ended(&format!("frames = 60\n{BOX}start.translate = {place}\n{TABLE}"));
        let body = &stage.world.bodies[0];
        // Sum of the steps of 1/600.
        let fallen = 0.5 - 0.5 * 9.81 * (1.0 + 1.0 / 600.0);
        assert!((body.position.x - 0.705).abs() < 1e-9 && (body.position.z - fallen).abs() < 1e-9, "{body:?}");
        assert!(body.rotation.angle() < 1e-9, "{body:?}");
    }
    // Over the edge by 0.02 it is caught.
    let stage = ended(&format!("frames = 60\n{BOX}start.translate = [0.68, 0.0, 0.5]\n{TABLE}"));
    assert!(stage.world.bodies[0].rotation.angle() > 0.1, "{:?}", stage.world.bodies[0]);
}

#[test]
fn a_box_flies_past_another_without_a_push() {
    for speed in [3.0, 10.0] {
        let start = format!("start = {{ translate = [-1.03, 0.0, 0.41], velocity = [{speed:?}, 0.0, 0.0] }}\n");
        let stage = ended(&format!("frames = 60\ngravity = [0.0, 0.0, 0.0]\n{BOX}{start}{BOX}"));
        let [moving, still] = &stage.world.bodies[..] else { panic!() };
        assert!((moving.velocity - V3::new(speed, 0.0, 0.0)).norm() < 1e-9, "{moving:?}");
        assert!(still.velocity.norm() < 1e-9 && still.position.norm() < 1e-9, "{still:?}");
    }
}

/// The lower box is at rest above a floor 0.02 thick. The upper one strikes it within a frame, and both come to rest on it.
#[test]
fn a_body_that_is_struck_within_a_frame_stays_above_a_thin_floor() {
    let floor = "[[obstacle]]\nshape = 'field = { shape = \"box\", half_extents = [5.0, 5.0, 0.01] }'\ntranslate = [0.0, 0.0, -0.01]\n";
    for (gap, speed) in [(0.01, 20.0), (0.05, 10.0), (0.1, 20.0)] {
        let upper =
            format!("mass = 1.0\nstart = {{ translate = [0.0, 0.0, 1.0], velocity = [0.0, 0.0, {:?}] }}\n", -speed);
        let lower = format!("start.translate = [0.0, 0.0, {:?}]\n", 0.2 + gap);
        let stage = ended(&format!("frames = 60\n{BOX}{upper}{BOX}{lower}{floor}"));
        let heights: Vec<f64> = stage.world.bodies.iter().map(|body| body.position.z).collect();
        assert!(heights[0] > heights[1] && heights[1] > 0.19, "{gap} {speed}: {heights:?}");
    }
}

/// Each cube is about to hit the floor, 0.02 thick, or another cube within a frame: its contacts stay.
#[test]
fn a_fast_body_that_hits_within_a_frame_keeps_its_contacts() {
    let floor = "[[obstacle]]\nshape = 'field = { shape = \"box\", half_extents = [5.0, 5.0, 0.01] }'\ntranslate = [0.0, 0.0, -0.01]\n";
    let mut random = Random::new(test_seed(6));
    for run in 0..12 {
        let [x, y, z] = random.point_in_cube(180.0);
        let speed = random.between(5.0, 20.0);
        let start = format!(
            "start = {{ translate = [0.0, 0.0, 1.5], turn = [{x:?}, {y:?}, {z:?}], velocity = [1.0, 0.0, {:?}], spin = [3.0, 0.0, 0.0] }}\n",
            -speed
        );
        let below = if run % 2 == 0 { format!("{BOX}start.translate = [0.0, 0.0, 0.2021]\n") } else { String::new() };
        let stage = ended(&format!("frames = 30\n{BOX}{start}{below}{floor}"));
        for body in &stage.world.bodies {
            assert!(body.position.z > 0.1, "{start}{below}: {:?}", body.position);
        }
    }
}
