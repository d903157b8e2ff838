//! `contacts` of two fields, without a mesh on either side.

use sdf_formats::mesh;
use serde_json::Value;

use crate::folder::{Folder, says};
use crate::meshes::Model;

const BALL: &str = "[field]\nshape = 'sphere'\nradius = 1\n";
const FLOOR: &str = "[field]\nshape = 'half_space'\nnormal = [0, 0, 1]\noffset = 0\n";

/// A ball, a dumbbell, a floor and a bar in closed form; the ball and a block as grids of either layout.
fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("ball.sdf.toml", BALL);
    folder.write("floor.sdf.toml", FLOOR);
    folder.write(
        "dumbbell.sdf.toml",
        "[field]\nshape = 'union'\nof = [{ shape = 'sphere', radius = 0.5, pose.translation = [-1, 0, 0] }, \
         { shape = 'sphere', radius = 0.5, pose.translation = [1, 0, 0] }, \
         { shape = 'capsule', a = [-1, 0, 0], b = [1, 0, 0], radius = 0.2 }]\n",
    );
    folder.write("bar.sdf.toml", "[field]\nshape = 'box'\nhalf_extents = [2, 0.5, 0.4]\n");
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    folder.done("bake ball.obj --res 32");
    folder.done("bake ball.obj --res 64 --layout sparse -o sparse.sdf.h5");
    folder
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

fn vector(value: &Value) -> [f64; 3] {
    std::array::from_fn(|k| number(&value[k]))
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

fn meetings<'a>(json: &'a Value, kind: &str) -> Vec<&'a Value> {
    json["meetings"].as_array().unwrap().iter().filter(|meeting| meeting["kind"] == kind).collect()
}

#[test]
fn two_fields_of_any_kind_meet_where_their_shapes_do() {
    let folder = scene();
    // Shallower than the band of the sparse grid, beyond which it has only bounds.
    let area = std::f64::consts::PI * (1.0 - 0.925 * 0.925);
    for (first, second) in [
        ("ball.sdf.toml", "ball.sdf.toml"),
        ("ball.sdf.h5", "ball.sdf.toml"),
        ("ball.sdf.toml", "sparse.sdf.h5"),
        ("ball.sdf.h5", "ball.sdf.h5"),
        ("sparse.sdf.h5", "sparse.sdf.h5"),
    ] {
        let json = folder.json(&format!("contacts {first} {second} --translate 1.85,0,0"));
        assert_eq!((&json["schema"], &json["verdict"]), (&"sdftool.overlap/1".into(), &"contact".into()));
        let deepest = meetings(&json, "deepest");
        assert_eq!(deepest.len(), 1, "{first} {second}");
        assert!((number(&deepest[0]["distance"]) + 0.075).abs() < 0.01, "{first} {second}: {}", deepest[0]);
        assert!(distance(vector(&deepest[0]["point"]), [0.925, 0.0, 0.0]) < 0.1, "{first} {second}: {}", deepest[0]);
        // The normal points out of the second and into the first.
        assert!(distance(vector(&deepest[0]["normal"]), [-1.0, 0.0, 0.0]) < 0.15, "{first} {second}: {}", deepest[0]);
        assert_eq!(json["deepest"]["value"], deepest[0]["distance"]);
        assert!(number(&json["deepest"]["lower_bound"]) <= number(&json["deepest"]["value"]));
        let patch = meetings(&json, "patch");
        assert_eq!(json["patch"]["points"], patch.len());
        let sum: f64 = patch.iter().map(|piece| number(&piece["area"])).sum();
        assert!((sum / area - 1.0).abs() < 0.1 && (sum - number(&json["patch"]["area"])).abs() < 1e-9, "{sum} {area}");
        for piece in patch {
            let [x, y, z] = vector(&piece["point"]);
            assert!((x - 0.925).abs() < 0.02 && y.hypot(z) < 0.42 && number(&piece["distance"]) <= 1e-9, "{piece}");
        }
        let is_grid = [first, second].map(|name| name.ends_with(".h5"));
        assert_eq!([0, 1].map(|k| json["read"][k].is_object()), is_grid);
    }
    says(
        &folder.done("contacts ball.sdf.toml ball.sdf.toml --translate 1.5,0,0"),
        &["verdict  contact", "deepest  -0.25", "separation  -0.5", "nothing below  -0.25", "patch area  1.37"],
    );
}

#[test]
fn exchanged_arguments_give_the_same_points_with_opposite_normals() {
    let folder = scene();
    let rotation = "0.2,-0.1,0.3,0.9";
    for (a, b) in
        [("ball.sdf.h5", "bar.sdf.toml"), ("sparse.sdf.h5", "ball.sdf.h5"), ("dumbbell.sdf.toml", "floor.sdf.toml")]
    {
        let forward = folder.json(&format!("contacts {a} {b} --translate-first 0.3,0.2,0.6 --rotate {rotation}"));
        let back = folder.json(&format!("contacts {b} {a} --translate 0.3,0.2,0.6 --rotate-first {rotation}"));
        let [forward, back] = [&forward, &back].map(|json| json["meetings"].as_array().unwrap());
        assert!(forward.len() > 20 && forward.len() == back.len(), "{a} {b}: {} {}", forward.len(), back.len());
        for (one, other) in forward.iter().zip(back) {
            assert_eq!(
                ["point", "distance", "area"].map(|name| &one[name]),
                ["point", "distance", "area"].map(|name| &other[name])
            );
            assert_eq!((&one["distance_a"], &one["distance_b"]), (&other["distance_b"], &other["distance_a"]));
            assert_eq!(vector(&one["normal"]), vector(&other["normal"]).map(|x| -x));
        }
    }
}

#[test]
fn poses_place_either_field() {
    let folder = scene();
    // A quarter turn about z maps x to y.
    let touches =
        |pose: &str| folder.json(&format!("contacts bar.sdf.toml ball.sdf.toml {pose}"))["verdict"] == "contact";
    assert!(touches("--translate 2.5,0,0") && !touches("--translate 0,2.5,0"));
    assert!(
        touches("--translate 0,2.5,0 --rotate-first 0,0,1,1") && !touches("--translate 2.5,0,0 --rotate-first 0,0,1,1")
    );
    // Rotation comes before translation.
    assert!(touches("--translate 10,2.5,0 --rotate-first 0,0,1,1 --translate-first 10,0,0"));
    // Moving both leaves the contact unchanged.
    let here = folder.json("contacts bar.sdf.toml ball.sdf.h5 --translate 2.5,0,0.1");
    let there = folder.json("contacts bar.sdf.toml ball.sdf.h5 --translate 4.5,3,1.1 --translate-first 2,3,1");
    let [here, there] = [&here, &there].map(|json| meetings(json, "deepest")[0].clone());
    assert!((number(&here["distance"]) - number(&there["distance"])).abs() < 2e-3);
    let moved = vector(&here["point"]);
    assert!(
        distance([moved[0] + 2.0, moved[1] + 3.0, moved[2] + 1.0], vector(&there["point"])) < 0.15,
        "{here} {there}"
    );
}

#[test]
fn a_dumbbell_on_the_floor_has_two_deepest_points() {
    let folder = scene();
    let json = folder.json("contacts dumbbell.sdf.toml floor.sdf.toml --translate-first 0,0,0.45");
    let deepest = meetings(&json, "deepest");
    assert_eq!((deepest.len(), &json["minima"]["count"]), (2, &2.into()));
    let mut at: Vec<f64> = deepest.iter().map(|at| number(&at["point"][0])).collect();
    at.sort_by(f64::total_cmp);
    assert!((at[0] + 1.0).abs() < 0.02 && (at[1] - 1.0).abs() < 0.02, "{at:?}");
}

#[test]
fn separation_is_reported_and_the_margin_finds_near_fields() {
    let folder = scene();
    let far = folder.json("contacts ball.sdf.h5 ball.sdf.toml --translate 0,9,0");
    assert_eq!(
        (&far["verdict"], &far["meetings"], &far["deepest"]),
        (&"apart".into(), &Value::Array(vec![]), &Value::Null)
    );
    // A gap of 0.1, with boxes that overlap.
    let pose = "--translate 1.484924,1.484924,0";
    let apart = folder.json(&format!("contacts ball.sdf.h5 ball.sdf.h5 {pose}"));
    assert_eq!(apart["verdict"], "apart");
    let near = folder.json(&format!("contacts ball.sdf.h5 ball.sdf.h5 {pose} --margin 0.06"));
    assert!(near["verdict"] == "contact" && (number(&near["meetings"][0]["separation"]) - 0.1).abs() < 0.02, "{near}");
    let touching = folder.json("contacts ball.sdf.toml ball.sdf.toml --translate 2,0,0");
    assert!(
        touching["verdict"] != "apart" && touching["deepest"]["lower_bound"].as_f64().unwrap() <= 0.0,
        "{touching}"
    );
}

/// Where both bars are deepest they are 0.4 deep.
#[test]
fn a_minimum_within_the_tolerance_of_the_margin_is_undecided_until_the_tolerance_is_smaller() {
    let folder = Folder::new();
    folder.write("bar.sdf.toml", "[field]\nshape = 'box'\nhalf_extents = [2, 0.5, 0.4]\n");
    let turned = "--rotate=0.3,-0.4,0.2,0.8 --translate=0.3,0,0.1";
    let search = format!("contacts bar.sdf.toml bar.sdf.toml {turned} --margin=-0.40001");
    says(&folder.done(&search), &["verdict  undecided", "give a smaller --tolerance"]);
    says(&folder.done(&format!("{search} --tolerance 1e-6")), &["verdict  apart"]);
}

/// A sheet with its inside below, which reaches the grid's box. Beyond the box the inside continues for its depth there.
#[test]
fn a_field_that_is_negative_on_its_box_continues_beyond_it() {
    let folder = scene();
    folder.write("sheet.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n");
    folder.done("bake sheet.obj --res 8 --sign pseudo-normal");
    folder.write("pebble.sdf.toml", "[field]\nshape = 'sphere'\nradius = 0.05\n");
    for pose in ["--translate 0,0,-1.3", "--translate 0,0,-0.9", "--translate 0,0,0.02"] {
        assert_eq!(
            folder.json(&format!("contacts sheet.sdf.h5 pebble.sdf.toml {pose}"))["verdict"],
            "contact",
            "{pose}"
        );
    }
    let above = folder.json("contacts sheet.sdf.h5 pebble.sdf.toml --translate 0,0,0.3");
    assert_eq!(above["verdict"], "apart");
}

#[test]
fn every_kind_of_file_contains_what_is_printed() {
    let folder = scene();
    let words = "contacts ball.sdf.h5 dumbbell.sdf.toml --translate 0.3,0.2,1.2";
    let mut printed = folder.json(&format!("{words} -o list.json"));
    let mut kept: Value = serde_json::from_slice(&folder.read("list.json")).unwrap();
    [&mut printed, &mut kept].into_iter().for_each(|json| {
        json["seconds"].take();
    });
    assert_eq!(kept, printed);
    let meetings = printed["meetings"].as_array().unwrap();
    assert!(meetings.len() > 50);

    folder.done(&format!("{words} -o list.csv"));
    let text = String::from_utf8(folder.read("list.csv")).unwrap();
    let mut lines = text.lines();
    assert_eq!(
        lines.next().unwrap(),
        "kind,x,y,z,normal_x,normal_y,normal_z,distance,distance_a,distance_b,separation,area,status"
    );
    assert_eq!(lines.clone().count(), meetings.len());
    for (line, meeting) in lines.zip(meetings) {
        let cells: Vec<&str> = line.split(',').collect();
        let cell = |index: usize| cells[index].parse::<f64>().unwrap();
        assert_eq!((cells[0], cells[12]), (meeting["kind"].as_str().unwrap(), meeting["status"].as_str().unwrap()));
        assert_eq!([1, 2, 3].map(cell), vector(&meeting["point"]));
        assert_eq!([4, 5, 6].map(cell), vector(&meeting["normal"]));
        for (index, name) in (7..).zip(["distance", "distance_a", "distance_b", "separation", "area"]) {
            assert_eq!(cell(index), number(&meeting[name]), "{name} of {line}");
        }
    }

    folder.done(&format!("{words} -o list.ply"));
    let cloud = mesh::read(&folder.at("list.ply")).unwrap();
    let points: Vec<[f64; 3]> = meetings.iter().map(|meeting| vector(&meeting["point"])).collect();
    assert_eq!(cloud.points, points);
    let bytes = folder.read("list.ply");
    let header = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    assert!(String::from_utf8_lossy(&bytes[..header]).contains("property double area\n"));
    assert_eq!(bytes.len() - header, 64 * points.len());
    let last = f64::from_le_bytes(bytes[bytes.len() - 8..].try_into().unwrap());
    assert_eq!(last, number(&meetings.last().unwrap()["area"]));

    folder.done(&format!("{words} -o list.h5"));
    let bytes = folder.read("list.h5");
    assert!(bytes.starts_with(b"\x89HDF\r\n\x1a\n") && bytes.windows(17).any(|text| text == b"sdftool.overlap/1"));
    for name in ["list.csv", "list.json", "list.ply", "list.h5"] {
        folder.done(&format!("contacts ball.sdf.toml ball.sdf.toml --translate 0,9,0 -o {name}"));
        assert!(!folder.read(name).is_empty(), "{name}");
    }
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let folder = scene();
    let find = |threads: u32| {
        ["list.csv", "list.ply", "list.h5"].map(|name| {
            folder.done(&format!(
                "contacts sparse.sdf.h5 bar.sdf.toml --translate 0.5,1,0.3 --threads {threads} -o {name}"
            ));
            folder.read(name)
        })
    };
    assert_eq!(find(1), find(3));
}

#[test]
fn a_finer_resolution_gives_more_pieces_of_the_same_patch() {
    let folder = scene();
    let patch = |resolution: f64| {
        let words = format!("contacts ball.sdf.toml ball.sdf.toml --translate 1.5,0,0 --resolution {resolution}");
        let json = folder.json(&words);
        assert_eq!(json["patch"]["resolution"], resolution);
        (number(&json["patch"]["points"]), number(&json["patch"]["area"]))
    };
    let ((few, coarse), (many, fine)) = (patch(0.1), patch(0.025));
    assert!(many > 12.0 * few && (coarse / fine - 1.0).abs() < 0.05, "{few} {many} {coarse} {fine}");
}

/// Cubes of 1/220 of the box would take most of a minute for the minima alone.
#[test]
fn a_resolution_too_fine_for_the_minima_is_that_of_the_patch_alone_and_one_too_fine_for_any_patch_is_refused() {
    let folder = scene();
    let words = "contacts ball.sdf.toml ball.sdf.h5 --translate 1.5,0,0";
    let json = folder.json(&format!("{words} --resolution 0.006"));
    let cubes = number(&json["patch"]["points"]);
    assert!(cubes > 20_000.0 && json["patch"]["complete"] == true, "{}", json["patch"]);
    assert!(number(&json["minima"]["evaluations"]) < 1e6, "{}", json["minima"]);
    says(
        &folder.refused(&format!("{words} --resolution 1e-9")),
        &["--resolution 1.0000e-9", "1/4096", "take a larger one"],
    );
}

#[test]
fn depths_beyond_a_sparse_band_are_told_and_margins_there_are_refused() {
    let folder = scene();
    let deep = "contacts ball.sdf.toml sparse.sdf.h5 --translate 0.2,0,0";
    let json = folder.json(deep);
    let coarse =
        json["meetings"].as_array().unwrap().iter().filter(|meeting| meeting["status"] == "beyond_band").count();
    assert!(coarse > 0 && json["beyond_band"] == coarse, "{}", json["beyond_band"]);
    says(&folder.done(deep), &["beyond the band", &format!("{coarse} of "), "--layout dense"]);
    let shallow = "contacts ball.sdf.toml sparse.sdf.h5 --translate 1.95,0,0";
    assert!(!folder.done(shallow).contains("beyond the band"));
    says(
        &folder.refused(&format!("{deep} --margin -0.3")),
        &["sparse.sdf.h5: --margin -0.300000 is deeper than", "--band 10"],
    );
    folder.done("contacts ball.sdf.toml ball.sdf.h5 --translate 0.2,0,0 --margin -0.3");
}

#[test]
fn coordinates_too_large_for_two_fields_are_refused_for_what_they_are() {
    let folder = Folder::new();
    folder.write("large.obj", Model::ball([0.0; 3], 1e19, 2).obj());
    folder.done("bake large.obj --res 8");
    says(&folder.refused("contacts large.sdf.h5 large.sdf.h5"), &["large.sdf.h5", "exceed 1e18", "scale them down"]);
}

#[test]
fn only_blocks_near_the_other_field_are_read() {
    let folder = scene();
    folder.write("large.obj", Model::ball([0.0; 3], 4.0, 5).obj());
    folder.done("bake large.obj --res 128 --layout sparse");
    for other in ["ball.sdf.h5", "ball.sdf.toml"] {
        let json = folder.json(&format!("contacts {other} large.sdf.h5 --translate-first 0,0,4.8"));
        let read = &json["read"][1];
        let [bricks, of_bricks] = ["bricks", "of_bricks"].map(|name| number(&read[name]));
        assert!(json["verdict"] == "contact" && bricks > 0.0 && bricks < 0.25 * of_bricks, "{other}: {read}");
        // The contact has the value of the whole file.
        let point = vector(&json["meetings"][0]["point"]);
        folder.write("point.csv", format!("{:?},{:?},{:?}\n", point[0], point[1], point[2]));
        let eval = folder.json("eval large.sdf.h5 --points point.csv");
        assert_eq!(eval["samples"][0]["distance"], json["meetings"][0]["distance_b"], "{other}");
    }
}

#[test]
fn contradictory_arguments_are_refused_in_one_line() {
    let all_minima = scene().misused("contacts ball.sdf.toml floor.sdf.toml --all-minima");
    says(&all_minima, &["--all-minima", "needs a mesh"]);
    let folder = scene();
    folder.write("sheet.obj", Model::hills(4).obj());
    for (words, said) in [
        ("ball.sdf.toml ball.sdf.h5 --elements edges", &["--elements", "ball.sdf.toml is a field"][..]),
        ("ball.sdf.h5 ball.sdf.toml --method fw", &["--method", "ball.sdf.h5 is a field"]),
        ("ball.sdf.h5 ball.sdf.toml --iterations 4", &["--iterations", "remove it"]),
        ("sheet.obj ball.sdf.toml --resolution 0.1", &["--resolution", "sheet.obj is a mesh"]),
        ("sheet.obj ball.sdf.toml --translate-first 0,0,1", &["--translate-first", "needs two fields"]),
        ("sheet.obj ball.sdf.toml --rotate-first 0,0,1,1", &["--rotate-first", "needs two fields"]),
    ] {
        says(&folder.misused(&format!("contacts {words}")), said);
    }
    for (words, said) in [
        ("floor.sdf.toml floor.sdf.toml", &["floor.sdf.toml and floor.sdf.toml", "unbounded", "intersect"][..]),
        ("ball.sdf.h5 ball.sdf.toml --margin 1", &["ball.sdf.h5", "--margin", "--padding"]),
        ("ball.sdf.toml sparse.sdf.h5 --margin 0.11", &["sparse.sdf.h5", "--margin", "--band"]),
        ("ball.sdf.toml sheet.obj", &["sheet.obj is an OBJ mesh", "`sdftool contacts sheet.obj ball.sdf.toml`"]),
        ("missing.sdf.toml ball.sdf.toml", &["missing.sdf.toml"]),
        ("ball.sdf.toml missing.sdf.h5", &["missing.sdf.h5"]),
        ("ball.sdf.toml ball.sdf.h5 -o ball.sdf.h5", &["would replace ball.sdf.h5"]),
    ] {
        says(&folder.refused(&format!("contacts {words}")), said);
    }
    for words in
        ["--resolution 0", "--resolution nan", "--rotate-first 0,0,0,0", "--translate-first 1,2", "-o list.txt"]
    {
        folder.wrong_usage(&format!("contacts ball.sdf.toml ball.sdf.toml {words}"));
    }
    says(&folder.done("contacts --help"), &["two fields touch", "--translate-first", "--rotate-first", "--resolution"]);
}

#[test]
fn damaged_grids_are_refused_on_either_side() {
    let folder = scene();
    let whole = folder.read("ball.sdf.h5");
    for (name, bytes) in [("short.sdf.h5", &whole[..whole.len() / 2]), ("begun.sdf.h5", &whole[..8])] {
        folder.write(name, bytes);
        says(&folder.refused(&format!("contacts {name} ball.sdf.toml")), &[name]);
        says(&folder.refused(&format!("contacts ball.sdf.toml {name}")), &[name]);
    }
}
