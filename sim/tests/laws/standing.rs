//! Boxes of the same size stand on each other, with their sides flush.

use std::ops::ControlFlow;
use std::path::Path;

use sdf_field::Threads;
use sdf_sim::scene::{self, Stage};

use crate::V3;

const FLOOR: &str =
    "[[obstacle]]\nshape = 'field = { shape = \"half_space\", normal = [0.0, 0.0, 1.0], offset = 0.0 }'\n";
const HALF: f64 = 0.2;

/// Boxes on a floor, each the thickness above what it stands on.
fn stack(count: u32, thickness: f64, keys: &str, body: &str) -> String {
    let bodies = (0..count).map(|index| {
        let z = (HALF + thickness) + f64::from(index) * (2.0 * HALF + thickness);
        format!("{body}mesh.cuboid = {{ half = [{HALF}, {HALF}, {HALF}] }}\nstart.translate = [0.0, 0.0, {z:?}]\n")
    });
    let bodies: String = bodies.collect();
    format!("title = \"a stack\"\nthickness = {thickness:?}\n{keys}{bodies}{FLOOR}")
}

/// The farthest that the middle of a box gets to a side, and its largest way down or up.
fn ways(text: &str) -> [f64; 2] {
    let spec = scene::parse(text, "my.toml").unwrap();
    let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
    let middles = |stage: &Stage| -> Vec<V3> {
        let middle = |points: Vec<[f64; 3]>| points.iter().map(|x| V3::from(*x)).sum::<V3>() / points.len() as f64;
        stage.surfaces.iter().map(|surface| middle(surface.points(&stage.world))).collect()
    };
    let (start, mut farthest) = (middles(&stage), [0.0; 2]);
    scene::run(&spec, &mut stage, "auto".parse().unwrap(), Threads::ONE, |_, stage| {
        for (now, start) in middles(stage).iter().zip(&start) {
            let way = now - start;
            farthest = [way.xy().norm().max(farthest[0]), way.z.abs().max(farthest[1])];
        }
        ControlFlow::Continue(())
    })
    .unwrap();
    farthest
}

/// Three for 2 units of time; in 10 they stand as well, which takes too long here. No middle gets farther to a side than the thickness. It
/// sinks by no more than twice what it does at rest, ρ g h² / 2E of a column of the height h, and by the thickness of three contacts.
#[test]
fn soft_boxes_stand_on_each_other() {
    let thickness = 0.004;
    for young in [1e5, 1e6] {
        let keys = "frames = 120\nsubsteps = 20\nfriction = 0.5\n";
        let matter = format!("density = 100.0\nyoung = {young:?}\npoisson = 0.3\n");
        let body = format!("[[soft]]\ncell = 0.2\ntouched = \"exact\"\n{matter}");
        let [aside, down] = ways(&stack(3, thickness, keys, &body));
        println!("{young}: {aside} aside, {down} down");
        let height = 6.0 * HALF;
        let sunk = 100.0 * 9.81 * height * height / 2.0 / young;
        assert!(aside < thickness, "{young}: {aside} aside");
        assert!(down < 2.0 * sunk + 3.0 * thickness, "{young}: {down} down");
    }
}

/// Three for 10 units of time. Without friction nothing holds what the search's tolerance pushes aside: less than a twentieth of a side. With
/// friction each creeps as on a level floor, by 0.008 (docs/simulation.md).
#[test]
fn rigid_boxes_stand_on_each_other() {
    for (friction, most) in [(0.0, 0.1 * HALF), (0.5, 3.0 * 0.008)] {
        let keys = format!("frames = 600\nfriction = {friction:?}\n");
        let [aside, down] = ways(&stack(3, 0.002, &keys, "[[rigid]]\n"));
        println!("{friction}: {aside} aside, {down} down");
        assert!(aside < most && down < 0.002, "friction {friction}: {aside} aside, {down} down");
    }
}
