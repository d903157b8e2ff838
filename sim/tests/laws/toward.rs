//! Things that move toward each other are caught, whichever of them moves.

use std::ops::ControlFlow;
use std::path::Path;

use sdf_field::Threads;
use sdf_sim::scene::{self, Stage};
use sdf_sim::{Carrier, Surface, World};

const SCENE: &str = r#"
title = "toward each other"
frames = 6
rate = 60.0
substeps = 20
gravity = [0.0, 0.0, 0.0]
thickness = 0.01

[[rigid]]
mesh.cuboid = { half = [0.3, 0.3, 0.05] }
cells = 16
start = { translate = [0.0, 0.0, 0.145], velocity = [0.0, 0.0, UPPER] }

"#;

/// Thin things that begin around z = 0, and move up.
const OTHERS: [&str; 2] = [
    r#"[[rigid]]
mesh.cuboid = { half = [0.5, 0.5, 0.02] }
cells = 16
start.velocity = [0.0, 0.0, LOWER]
"#,
    r#"[[cloth]]
mesh.sheet = { cells = [20, 20], size = [2.0, 2.0], height = 0.0, bend = 0.0, floor = -9.0 }
start.velocity = [0.0, 0.0, LOWER]
"#,
];

/// Height of the first body over another, or over the points below its middle: a cloth beside it lags behind.
fn height_over(surface: &Surface, world: &World) -> f64 {
    let body = world.bodies[0].position;
    if let Carrier::Body { id, .. } = surface.carrier {
        return body.z - world.bodies[id as usize].position.z;
    }
    let is_by = |point: &&[f64; 3]| (point[0] - body.x).abs().max((point[1] - body.y).abs()) < 0.2;
    surface.points(world).iter().filter(is_by).map(|point| body.z - point[2]).fold(f64::INFINITY, f64::min)
}

/// At 20 a unit of time both get to the other within a frame, and past each other within the next.
#[test]
fn what_moves_toward_each_other_does_not_pass_through_whichever_moves() {
    for other in OTHERS {
        for (upper, lower) in [(-20.0, 0.0), (0.0, 20.0), (-10.0, 10.0), (30.0, 50.0)] {
            let text = format!("{SCENE}{other}")
                .replace("UPPER", &format!("{upper:?}"))
                .replace("LOWER", &format!("{lower:?}"));
            let spec = scene::parse(&text, "toward").unwrap();
            let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
            let is_other = |surface: &&Surface| !matches!(surface.carrier, Carrier::Body { id: 0, .. });
            let other = stage.surfaces.iter().find(is_other).unwrap().clone();
            let mut least = height_over(&other, &stage.world);
            let each = |_: u32, stage: &Stage| {
                least = least.min(height_over(&other, &stage.world));
                ControlFlow::Continue(())
            };
            let figures = scene::run(&spec, &mut stage, "fw".parse().unwrap(), Threads::ONE, each).unwrap();
            println!("{upper} and {lower}: {least}");
            assert!(least > 0.0 && figures.finite, "{upper} and {lower}: {least}\n{text}");
        }
    }
}
