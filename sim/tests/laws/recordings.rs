//! Recordings: floors are drawn where the run takes place, nothing depends on the unit or on words of a title, and thin walls are warned of.

use std::path::Path;

use sdf_field::Threads;
use sdf_sim::record::{self, Recording};
use sdf_sim::scene::{self, Stage};

use crate::V3;

fn stage(tables: &str) -> Stage {
    let spec = scene::parse(&format!("title = \"all\"\nframes = 1\n{tables}"), "my.toml").unwrap();
    Stage::build(&spec, Path::new("."), Threads::ONE).unwrap()
}

fn box_over_floor(offset: f64) -> Stage {
    stage(&format!(
        "[[rigid]]\nmesh.cuboid = {{ half = [0.1, 0.1, 0.1] }}\n[[obstacle]]\nshape = 'field = {{ shape = \"half_space\", \
         normal = [0.0, 0.0, 1.0], offset = {offset:?} }}'\n"
    ))
}

/// Is all of what stands still at this height, and does it reach beyond a box about x on all sides?
fn is_floor(recording: &Recording, x: f32, height: f32) -> bool {
    let points = &recording.still_points;
    let beyond = |x: f32, axis: usize, way: f32| points.iter().any(|point| (point[axis] - x) * way > 0.1);
    !recording.still_faces.is_empty()
        && recording.still_faces.iter().flatten().all(|vertex| (*vertex as usize) < points.len())
        && points.iter().all(|point| (point[2] - height).abs() < 1e-5 * height.abs())
        && [1.0, -1.0].iter().all(|way| beyond(x, 0, *way) && beyond(0.0, 1, *way))
}

#[test]
fn a_floor_is_drawn_far_below_the_start_and_wherever_the_run_gets() {
    let mut stage = box_over_floor(-1.5);
    let mut recording = Recording::new("all", 60.0, &stage, 24);
    assert!(is_floor(&recording, 0.0, -1.5), "{:?}", recording.still_points);
    recording.push(&stage);
    assert!(recording.bounds().min[2] < -1.49);
    for x in [3.0, 500.0] {
        stage.world.bodies[0].position = V3::new(x, 0.0, -1.3);
        recording.push(&stage);
        assert!(is_floor(&recording, x as f32, -1.5), "at {x}: {:?}", recording.bounds());
    }
    // What explodes takes no floor along.
    stage.world.bodies[0].position = V3::new(1e9, 0.0, 0.0);
    recording.push(&stage);
    assert!(recording.bounds().max[0] < 1e4, "{:?}", recording.bounds());

    // One so far below that the body would be a dot: once the run is there.
    let mut stage = box_over_floor(-100.0);
    let mut recording = Recording::new("all", 60.0, &stage, 24);
    recording.push(&stage);
    assert!(recording.still_faces.is_empty() && recording.bounds().longest_side() < 0.3, "{:?}", recording.bounds());
    stage.world.bodies[0].position = V3::new(0.0, 0.0, -99.9);
    recording.push(&stage);
    assert!(is_floor(&recording, 0.0, -100.0), "{:?}", recording.bounds());
}

#[test]
fn a_recording_is_the_same_picture_in_any_unit() {
    let recorded = |unit: f64| {
        let at = |x: f64| x * unit;
        let [a, b, c, d] = [0.1, 0.2, 0.3, 0.5].map(at);
        let stage = stage(&format!(
            "[[rigid]]\nmesh.cuboid = {{ half = [{a:?}, {b:?}, {a:?}] }}\nstart.translate = [0.0, 0.0, {d:?}]\n\
             [[obstacle]]\nshape = 'field = {{ shape = \"sphere\", radius = {b:?} }}'\n\
             [[obstacle]]\nshape = 'field = {{ shape = \"sphere\", radius = {b:?} }}'\ntranslate = [{d:?}, 0.0, 0.0]\n\
             becomes = 'field = {{ shape = \"sphere\", radius = {c:?} }}'\n\
             [[obstacle]]\nshape = 'field = {{ shape = \"half_space\", normal = [0.0, 0.0, 1.0], offset = -{c:?} }}'\n"
        ));
        let mut recording = Recording::new("all", 60.0, &stage, 24);
        recording.push(&stage);
        recording
    };
    let pages = |recording: &Recording| {
        let page = record::page(recording);
        let is_of_points = |line: &&str| line.contains("id=\"moving\"") || line.starts_with("const still");
        let points = page.lines().filter(is_of_points);
        points.map(str::to_owned).collect::<Vec<_>>()
    };
    let one = recorded(1.0);
    assert_eq!(pages(&one).len(), 3);
    // About 1e-12 and 1e9, exactly.
    for power in [-40, 30] {
        let other = recorded(2.0_f64.powi(power));
        assert_eq!(other.bounds().extents(), one.bounds().extents().map(|x| x * 2.0_f64.powi(power)), "{power}");
        assert!(pages(&other) == pages(&one), "{power}: other points");
        assert!(record::contact_sheet(&other, 1, 64) == record::contact_sheet(&one, 1, 64), "{power}: another picture");
    }
}

#[test]
fn what_a_title_holds_is_not_filled_in() {
    let title = "5 % of %FACES%, %TITLE% and %HEAD%";
    let mut recording = Recording::new(title, 60.0, &box_over_floor(-0.2), 8);
    recording.push(&box_over_floor(-0.2));
    let page = record::page(&recording);
    assert!(page.contains(&format!("<title>{title}</title>")), "{}", page.lines().nth(4).unwrap());
    let head = page.lines().find_map(|line| line.strip_prefix("const head = ")?.strip_suffix(';')).unwrap();
    let head: serde_json::Value = serde_json::from_str(head).unwrap();
    assert_eq!(head["title"], title);
    assert!(!page.contains("%MOVING%") && !page.contains("%STILLFACES%"));
}

#[test]
fn an_obstacle_thinner_than_a_cell_is_warned_of() {
    let warnings = |half: f64| {
        let stage = stage(&format!(
            "[[rigid]]\nmesh.cuboid = {{ half = [0.1, 0.1, 0.1] }}\n[[obstacle]]\nshape = 'field = {{ shape = \"box\", \
             half_extents = [1.0, 1.0, {half:?}], pose = {{ rotation = [0.1, 0.0, 0.0, 1.0] }} }}'\n"
        ));
        Recording::new("all", 60.0, &stage, 40).warnings
    };
    // A cell is about 0.05.
    for thin in [0.002, 0.01] {
        let [warning] = &warnings(thin)[..] else { panic!("{thin}: one warning") };
        assert!(warning.contains("thinner than a cell of 5") && warning.lines().count() == 1, "{warning}");
    }
    assert_eq!(warnings(0.1), [""; 0]);
}

/// A run's end is what a page is opened for.
#[test]
fn a_page_of_few_frames_keeps_the_first_and_the_last_and_others_evenly() {
    for (frames, most) in (0..700).flat_map(|frames| [2, 3, 24, 150].map(|most| (frames, most))) {
        let kept: Vec<usize> = record::thinned(frames, most).collect();
        let [last, gap] = [frames.saturating_sub(1), *kept.get(1).unwrap_or(&0)];
        let is_even = |pair: &[usize]| pair[1] - pair[0] == gap || pair[1] == last && pair[1] - pair[0] < gap;
        assert!(kept.len() <= most.min(frames) && (kept.len() == frames || gap > 1), "{frames} of {most}: {kept:?}");
        assert!(frames == 0 || (kept[0], kept[kept.len() - 1]) == (0, last), "{frames} of {most}: {kept:?}");
        assert!(kept.windows(2).all(is_even), "{frames} of {most}: {kept:?}");
    }
    let mut stage = box_over_floor(-1.5);
    let mut recording = Recording::new("all", 60.0, &stage, 24);
    for frame in 0..300 {
        stage.world.bodies[0].position = V3::new(0.0, 0.0, f64::from(frame));
        recording.push(&stage);
    }
    assert_eq!(recording.frames.len(), 300);
    let page = record::page(&recording);
    assert!(page.contains("\"frames\":101,"), "{:?}", page.find("\"frames\""));
}

#[test]
fn a_page_of_many_points_keeps_fewer_frames() {
    let mut recording = Recording::default();
    recording.frames = vec![vec![]; 500];
    for (points, most) in [(1000, 150), (1_000_000, 33), (20_000_000, 2)] {
        recording.frames[0] = vec![[0.0; 3]; points];
        let kept: Vec<usize> = record::page_frames(&recording).collect();
        assert!(kept.len() <= most && kept.len() > most / 2, "{points}: {}", kept.len());
        assert_eq!([kept[0], kept[kept.len() - 1]], [0, 499]);
    }
}

/// The page's code draws no point whose coordinates are all 65535.
#[test]
fn a_point_far_away_or_without_a_place_is_marked_in_a_page() {
    let mut stage = box_over_floor(-1.5);
    let mut recording = Recording::new("all", 60.0, &stage, 8);
    let marks = |recording: &Recording| {
        let page = record::page(recording);
        let (_, moving) = page.split_once("id=\"moving\">").unwrap();
        // Three bytes of 255 are four slashes.
        moving.split_once('<').unwrap().0.matches("////////").count()
    };
    recording.push(&stage);
    assert_eq!(marks(&recording), 0);
    for place in [1e12, f64::NAN, f64::INFINITY] {
        stage.world.bodies[0].position = V3::new(0.0, place, 0.0);
        recording.push(&stage);
    }
    let points = recording.frames[0].len();
    assert_eq!(marks(&recording), 3 * points);
}
