//! Figures of a run: how far sheets stretch, what touches, and how far normals turn.

use std::ops::ControlFlow;
use std::path::Path;

use sdf_field::Threads;
use sdf_sim::scene::{self, Figures, Reach, Stage};

use crate::V3;

/// Runs a scene of these tables; its figures, and the stage before and after.
fn measured(tables: &str) -> (Figures, [Stage; 2]) {
    let spec = scene::parse(&format!("title = \"all\"\n{tables}"), "my.toml").unwrap();
    let mut stage = Stage::build(&spec, Path::new("."), Threads::ONE).unwrap();
    let start = stage.clone();
    let each = |_: u32, _: &Stage| ControlFlow::Continue(());
    let figures = scene::run(&spec, &mut stage, "auto".parse().unwrap(), Threads::ONE, each).unwrap();
    (figures, [start, stage])
}

/// The second sheet gives way along its edges more than the first, and the third more than across them.
#[test]
fn stretch_is_the_longest_edge_of_every_sheet() {
    let sheet = "[[cloth]]\nmesh.sheet = { cells = [6, 6], size = [1.0, 1.0], height = 0.0, bend = 0.0, floor = 0.0 }\npins = [0, 6]\n";
    let fabrics = ["", "stretch = 1e-2\nbend = 1.0\n", "stretch = 2e-2\nbend = 1e-3\n"];
    let alone = fabrics.map(|fabric| {
        let (figures, [start, end]) = measured(&format!("frames = 90\ndrag = 2.0\n{sheet}{fabric}"));
        let [rest, now] = [start, end].map(|stage| {
            let points = stage.surfaces[0].points(&stage.world);
            let length = |[a, b]: &[u32; 2]| (V3::from(points[*a as usize]) - V3::from(points[*b as usize])).norm();
            stage.surfaces[0].edges.iter().map(length).collect::<Vec<f64>>()
        });
        let longest = rest.iter().zip(&now).map(|(rest, now)| now / rest).fold(1.0, f64::max);
        assert!((figures.stretch - longest).abs() < 1e-12, "{fabric}: {} and not {longest}", figures.stretch);
        longest
    });
    assert!(alone[1] > alone[0] + 0.05 && alone[2] > alone[0] + 0.05, "{alone:?}");
    let apart = |index: usize| format!("start.translate = [{}.0, 0.0, 0.0]\n", 3 * index);
    let all: String = (0..3).map(|index| format!("{sheet}{}{}", fabrics[index], apart(index))).collect();
    let (figures, _) = measured(&format!("frames = 90\ndrag = 2.0\n{all}"));
    let most = alone.into_iter().fold(1.0, f64::max);
    assert!((figures.stretch - most).abs() < 1e-12, "{} and not {most}", figures.stretch);
}

/// A sheet that lies on the middle of a changing ball, of a soft box, and of both.
#[test]
fn what_changes_and_what_is_soft_counts_among_pairs_that_touch() {
    let sheet =
        "[[cloth]]\nmesh.sheet = { cells = [4, 4], size = [0.4, 0.4], height = 0.105, bend = 0.0, floor = 0.0 }\n";
    let ball = "[[obstacle]]\nshape = 'field = { shape = \"sphere\", radius = 0.1 }'\n\
                becomes = 'field = { shape = \"sphere\", radius = 0.11 }'\n";
    let soft = "[[soft]]\nmesh.cuboid = { half = [0.1, 0.1, 0.1] }\ncell = 0.1\ndensity = 1e3\nyoung = 1e6\npoisson = 0.3\n\
                touched = \"exact\"\n";
    let floor = "[[obstacle]]\nshape = 'field = { shape = \"half_space\", normal = [0.0, 0.0, 1.0], offset = -9.0 }'\n";
    let shared = "thickness = 0.01\n";
    for (others, pairs) in [("".to_owned(), 0), (ball.to_owned(), 1), (soft.to_owned(), 1)] {
        // In the frame after, it has left.
        let still = format!("frames = 1\n{shared}gravity = [0.0, 0.0, 0.0]\n{sheet}{others}{floor}");
        assert_eq!(measured(&still).0.pairs, pairs, "{others}");
    }
    // The sheet bends over the ball.
    let (figures, _) = measured(&format!("frames = 20\n{shared}{sheet}{ball}"));
    assert!(figures.turn.unwrap() > 0.01, "{:?}", figures.turn);
}

/// Two boxes that touch turn as one, by 0.48 degrees in a frame.
#[test]
fn normals_between_rigid_bodies_turn_too() {
    let boxes = "[[rigid]]\nmesh.cuboid = { half = [0.2, 0.2, 0.2] }\nstart.spin = [0.5, 0.0, 0.0]\n[[rigid]]\n\
                 mesh.cuboid = { half = [0.1, 0.1, 0.1] }\nstart = { translate = [0.0, 0.0, 0.31], spin = [0.5, 0.0, 0.0], \
                 velocity = [0.0, -0.155, 0.0] }\n";
    let (figures, _) = measured(&format!("frames = 3\nthickness = 0.01\ngravity = [0.0, 0.0, 0.0]\n{boxes}"));
    assert_eq!(figures.pairs, 1);
    assert!((0.4..0.6).contains(&figures.turn.unwrap()), "{:?}", figures.turn);
}

/// A box that flies at a speed of 2 past nothing: at 60 frames, and at less than one, in a unit of time.
#[test]
fn what_moves_at_the_end_is_known_from_two_frames_on() {
    let flying = |rate: f64, frames: u32| {
        let body = "[[rigid]]\nmesh.cuboid = { half = [0.1, 0.1, 0.1] }\nstart.velocity = [2.0, 0.0, 0.0]\n";
        let (figures, _) =
            measured(&format!("frames = {frames}\nrate = {rate}\nsubsteps = 1\ngravity = [0.0, 0.0, 0.0]\n{body}"));
        let reach = Reach { jitter: Some(1.0), drift: Some(0.01), turn: Some(1.0), ..Reach::default() };
        let missed: Vec<&str> = figures.missed(&reach).into_keys().collect();
        (figures.jitter, figures.drift, figures.turn, missed)
    };
    let is_near = |value: Option<f64>, wanted: f64| (value.unwrap() - wanted).abs() < 1e-9;
    for (rate, frames, drift) in [(60.0, 90, 1.0), (60.0, 2, 2.0 / 60.0), (1.0, 3, 2.0), (0.5, 2, 4.0), (2.5, 9, 0.8)] {
        let (jitter, moved, turn, missed) = flying(rate, frames);
        assert!(is_near(jitter, 2.0) && is_near(moved, drift), "{rate} {frames}: {jitter:?} {moved:?}");
        assert_eq!((turn, missed), (Some(0.0), vec!["drift", "jitter"]), "{rate} {frames}");
    }
    for rate in [60.0, 1.0] {
        assert_eq!(flying(rate, 1), (None, None, None, vec!["drift", "jitter", "turn"]), "{rate}");
    }
}

/// The corners of the box are at a distance of 0.3 from its middle.
#[test]
fn the_largest_speed_is_that_of_a_body_with_its_spin() {
    let body = "[[rigid]]\nmesh.cuboid = { half = [0.2, 0.2, 0.1] }\nstart = { velocity = [2.0, 0.0, 0.0], spin = [0.0, 0.0, 10.0] }\n";
    let (figures, _) = measured(&format!("frames = 2\ngravity = [0.0, 0.0, 0.0]\n{body}"));
    assert!((figures.max_speed - 5.0).abs() < 1e-9, "{}", figures.max_speed);
}

/// A body that begins within another, its faces on those of the other, is told as one that begins deep in it; bodies side by side are not.
#[test]
fn bodies_in_one_place_overlap_at_the_start_and_those_side_by_side_do_not() {
    let bowl = "mesh.bowl = { around = 24, along = 12, thickness = 0.3 }\ncells = 48\n";
    let cube = "mesh.cuboid = { half = [0.1, 0.1, 0.1] }\n";
    let start = |mesh: &str, other: &str, at: [f64; 3], thickness: f64| {
        let first = format!("frames = 1\nthickness = {thickness:?}\n[[rigid]]\n{mesh}");
        measured(&format!("{first}{other}\n{mesh}start.translate = {at:?}\n")).0
    };
    for thickness in [0.0, 1e-3] {
        for shift in [0.0, 1e-6, 1e-3, 0.01] {
            let figures = start(cube, "[[rigid]]", [shift, 0.0, 0.0], thickness);
            assert!(figures.deep_at_start > 0 && figures.deep_at_start <= 24, "{shift}: {figures:?}");
            assert!(figures.warnings()[0].contains("deep at the start"));
        }
        assert!(start(bowl, "[[rigid]]", [0.0; 3], thickness).deep_at_start > 0);
        for at in [[0.2, 0.0, 0.0], [0.2 - 0.2 * thickness, 0.0, 0.0], [0.2, 0.2, 0.2], [0.3, 0.0, 0.0]] {
            let figures = start(cube, "[[rigid]]", at, thickness);
            assert_eq!((figures.deep_at_start, figures.warnings()), (0, vec![]), "{at:?}");
        }
        assert_eq!(start(bowl, "[[rigid]]", [2.3, 0.0, 0.0], thickness).deep_at_start, 0);
    }
    let obstacle = "[[obstacle]]\nshape = 'field = { shape = \"box\", half_extents = [0.1, 0.1, 0.1] }'\n";
    for (shift, faces) in [(0.0, 12), (0.2, 0)] {
        let body = format!("[[rigid]]\n{cube}start.translate = [{shift:?}, 0.0, 0.0]\n");
        assert_eq!(measured(&format!("frames = 1\n{body}{obstacle}")).0.deep_at_start, faces, "{shift}");
    }
}

/// Recordings hold f32: what leaves it is no longer finite, though f64 still has it.
/// A soft cube without gravity rests but for rounding, which is no momentum that was lost.
#[test]
fn momentum_of_what_rests_is_kept() {
    let cube = "[[soft]]\nmesh.cuboid = { half = [0.1, 0.1, 0.1] }\ncell = 0.07\ndensity = 100.0\nyoung = 1e5\npoisson = 0.3\n";
    let start = "start = { translate = [0.3, 0.2, 0.1], turn = [10.0, 20.0, 30.0] }\n";
    for mover in ["", "[[rigid]]\nmesh.cuboid = { half = [0.1, 0.1, 0.1] }\nstart.velocity = [2.0, 0.0, 0.0]\n"] {
        let (figures, _) = measured(&format!("frames = 30\ngravity = [0.0, 0.0, 0.0]\n{mover}{cube}{start}"));
        let error = figures.momentum_error.unwrap();
        assert!(error < 1e-12, "{error} with {mover:?}");
    }
}

/// 0.3 − 0.1 is less than 0.2 by rounding.
#[test]
fn what_stands_flush_without_thickness_is_not_deep_and_gains_no_energy() {
    let floor = "[[obstacle]]\nshape = 'field = { shape = \"half_space\", normal = [0.0, 0.0, 1.0], offset = 0.2 }'\n";
    let body = |z: f64| {
        format!("[[rigid]]\nmesh.cuboid = {{ half = [0.1, 0.1, 0.1] }}\nstart.translate = [0.0, 0.0, {z:?}]\n")
    };
    let (figures, _) = measured(&format!("frames = 60\n{}{floor}", body(0.3)));
    assert_eq!((figures.deep_at_start, figures.deep_faces), (0, 0), "{} deep", figures.deepest);
    assert!(figures.energy_gain < 1e-2, "{}", figures.energy_gain);
    let (figures, _) = measured(&format!("frames = 1\n{}{floor}", body(0.3 - 1e-6)));
    assert!(figures.deep_at_start > 0, "{} deep", figures.deepest);
}

#[test]
fn a_run_that_leaves_f32_is_not_finite_and_is_warned_of() {
    let body = "[[rigid]]\nmesh.cuboid = { half = [0.1, 0.1, 0.1] }\n";
    let floor = "[[obstacle]]\nshape = 'field = { shape = \"half_space\", normal = [0.0, 0.0, 1.0], offset = 0.0 }'\n";
    let sheet =
        "[[cloth]]\nmesh.sheet = { cells = [4, 4], size = [0.4, 0.4], height = 0.0, bend = 0.0, floor = 0.0 }\n";
    for (tables, is_finite) in [
        (format!("{body}start.velocity = [1e100, 0.0, 0.0]\n"), false),
        (format!("{sheet}start.velocity = [1e100, 0.0, 0.0]\n"), false),
        (format!("gravity = [0.0, 0.0, -1e100]\n{sheet}{body}"), false),
        (format!("rate = 1e-100\n{body}"), false),
        (format!("rate = 1e-300\n{body}start.translate = [0.0, 0.0, 1.0]\n{floor}"), false),
        (format!("{body}start = {{ translate = [0.0, 0.0, 1.0], spin = [0.0, 0.0, 1e100] }}\n{floor}"), false),
        (format!("{body}start.velocity = [1e30, 0.0, 0.0]\n"), true),
    ] {
        let (figures, _) = measured(&format!("frames = 2\n{tables}"));
        assert_eq!(figures.finite, is_finite, "{tables}");
        assert_eq!(figures.frames, if is_finite { 2 } else { 1 });
        let warned = "the last frame has coordinates beyond f32, in which recordings hold them: the run ends there";
        assert_eq!(figures.warnings().iter().any(|line| line == warned), !is_finite, "{:?}", figures.warnings());
        assert_eq!(figures.missed(&Reach::default()).contains_key("finite"), !is_finite);
    }
}
