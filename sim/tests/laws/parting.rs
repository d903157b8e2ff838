//! Boxes that start deep inside of each other part the shortest way, whichever was named first.

use std::ops::ControlFlow;
use std::path::Path;

use sdf_field::Threads;
use sdf_sim::scene::{self, Stage};

use crate::V3;

type Box = [V3; 8];

/// The least way along the axes of both and those across an axis of each: exact for boxes (Gottschalk, Lin and Manocha 1996).
fn depth([first, second]: &[Box; 2]) -> f64 {
    let axes = |points: &Box| [1, 2, 4].map(|corner| (points[corner] - points[0]).normalize());
    let (a, b) = (axes(first), axes(second));
    let across = a.iter().flat_map(|a| b.iter().filter_map(|b| a.cross(b).try_normalize(1e-9)));
    let way = |axis: V3| {
        let along = |points: &Box, fold: fn(f64, f64) -> f64| points.iter().map(|x| axis.dot(x)).reduce(fold).unwrap();
        along(second, f64::max) - along(first, f64::min)
    };
    a.into_iter().chain(b).chain(across).flat_map(|axis| [axis, -axis]).map(way).fold(f64::INFINITY, f64::min)
}

/// Corners of both boxes at the start and at the end, those of the first of `bodies` first.
fn run(bodies: &[String; 2], is_swapped: bool) -> [[Box; 2]; 2] {
    let [first, second] = if is_swapped { [&bodies[1], &bodies[0]] } else { [&bodies[0], &bodies[1]] };
    let text = format!("title = 'two'\nframes = 90\nsubsteps = 4\ngravity = [0.0, 0.0, 0.0]\n{first}{second}");
    let spec = scene::parse(&text, "two.toml").unwrap();
    let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
    let corners = |stage: &Stage| {
        let of = |index: usize| -> Box {
            let points = stage.surfaces[index].points(&stage.world);
            std::array::from_fn(|corner| V3::from(points[corner]))
        };
        if is_swapped { [of(1), of(0)] } else { [of(0), of(1)] }
    };
    let start = corners(&stage);
    scene::run(&spec, &mut stage, "auto".parse().unwrap(), Threads::ONE, |_, _| ControlFlow::Continue(())).unwrap();
    [start, corners(&stage)]
}

#[test]
fn boxes_inside_of_each_other_part_the_shortest_way_whichever_was_named_first() {
    let mut deep = 0;
    for round in 0..30_u32 {
        let random = |salt: u32| (f64::from(round) * 12.9898 + f64::from(salt) * 78.233).sin();
        let body = |salt: u32| {
            let half = [0, 1, 2].map(|axis| 0.2 + 0.1 * random(salt + axis));
            let translate = [3, 4, 5].map(|axis| 0.15 * random(salt + axis));
            let turn = [6, 7, 8].map(|axis| 180.0 * random(salt + axis));
            let start = format!("start = {{ translate = {translate:?}, turn = {turn:?} }}");
            format!("[[rigid]]\nmesh.cuboid = {{ half = {half:?} }}\ncells = 16\n{start}\n")
        };
        let bodies = [body(0), body(9)];
        let [start, end] = run(&bodies, false);
        assert_eq!(run(&bodies, true), [start, end], "round {round}");
        let middle = |points: &Box| points.iter().sum::<V3>() / 8.0;
        let between = |boxes: &[Box; 2]| middle(&boxes[0]) - middle(&boxes[1]);
        let way = (between(&end) - between(&start)).norm();
        let exact = depth(&start);
        if exact > 0.1 {
            deep += 1;
            println!("round {round}: {way} of {exact}");
            // The last of it their contacts hold, and turn them.
            assert!(way < 1.01 * exact, "round {round}: {way}, and {exact} would do");
        }
    }
    assert!(deep > 15, "{deep}");
}
