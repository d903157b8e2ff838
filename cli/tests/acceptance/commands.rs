//! Each command does its job and reports it in a table, or with --json in one object.

use serde_json::Value;

use crate::folder::{Folder, says};
use crate::meshes::Model;

const SPHERE: &str = "[field]\nshape = \"sphere\"\nradius = 1.0\n";

fn keys(object: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> = object.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

/// A folder with a baked ball of radius 1, its mesh and a sheet that cuts it.
fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    folder.write("sheet.obj", Model::hills(10).obj());
    folder.done("bake ball.obj --res 16");
    folder
}

#[test]
fn bake_writes_into_the_current_folder_under_the_meshs_stem() {
    let folder = Folder::new();
    std::fs::create_dir(folder.at("meshes")).unwrap();
    let ball = Model::ball([0.0; 3], 1.0, 2);
    folder.write("meshes/a.b.obj", ball.obj());
    folder.write("meshes/c.ply", ball.ply());
    folder.write("meshes/d.stl", ball.stl());
    // The kind of file is known by content, not by name.
    folder.write("meshes/e.obj", ball.stl());
    for (mesh, grid) in [("a.b.obj", "a.b"), ("c.ply", "c"), ("d.stl", "d"), ("e.obj", "e")] {
        let printed = folder.done(&format!("bake meshes/{mesh} --res 8"));
        says(&printed, &["66 points, 128 triangles", "closed", "17 × 17 × 17", &format!("{grid}.sdf.h5")]);
        assert!(folder.at(&format!("{grid}.sdf.h5")).is_file());
    }
    assert_eq!(folder.names(), ["a.b.sdf.h5", "c.sdf.h5", "d.sdf.h5", "e.sdf.h5", "meshes"]);
}

#[test]
fn bake_takes_the_size_of_the_grid_from_res_or_from_the_voxel_size() {
    let folder = Folder::new();
    folder.write("cube.obj", Model::cube().obj());
    let by_res = folder.json("bake cube.obj --res 10 --padding 2 -o by-res.sdf.h5");
    assert_eq!(by_res["counts"], serde_json::json!([15, 15, 15]));
    assert_eq!(by_res["spacing"], 0.1);
    let by_size = folder.json("bake cube.obj --voxel-size 0.1 --padding 2 -o by-size.sdf.h5");
    assert_eq!((&by_size["counts"], &by_size["origin"]), (&by_res["counts"], &by_res["origin"]));
    folder.wrong_usage("bake cube.obj");
    folder.wrong_usage("bake cube.obj --res 8 --voxel-size 0.1");
}

#[test]
fn bake_reports_which_sign_method_it_used_and_why() {
    let folder = Folder::new();
    folder.write("closed.obj", Model::cube().obj());
    let mut open = Model::cube();
    open.triangles.pop();
    folder.write("open.obj", open.obj());
    let closed = folder.json("bake closed.obj --res 8");
    assert_eq!(closed["sign_method"], "pseudo-normal");
    let open = folder.json("bake open.obj --res 8");
    assert_eq!((&open["sign_method"], &open["boundary_edges"]), (&"winding".into(), &3.into()));
    says(open["sign_verdict"].as_str().unwrap(), &["winding", "3 boundary edges"]);
    assert_eq!(folder.json("bake closed.obj --res 8 --sign winding")["sign_method"], "winding");
    assert_eq!(folder.json("bake open.obj --res 8 --sign pseudo-normal")["sign_method"], "pseudo-normal");
}

#[test]
fn bake_counts_defects_of_the_mesh() {
    let folder = Folder::new();
    let mut text = Model::cube().obj();
    text.push_str("v 7 7 7\nv 0 0 0\nf 1 1 2\nf 1 3 4\nf 1 3 4\n");
    folder.write("cube.obj", text);
    let json = folder.json("bake cube.obj --res 4");
    let counted = ["triangles", "degenerate_triangles", "repeated_triangles", "unreferenced_points", "welded_points"];
    assert_eq!(counted.map(|key| json[key].as_u64().unwrap()), [15, 1, 2, 2, 1]);
}

#[test]
fn bake_prints_one_object_with_its_numbers() {
    let folder = scene();
    let json = folder.json("bake ball.obj --res 16 -o again.sdf.h5");
    assert_eq!(json["schema"], "sdftool.bake/1");
    let wanted = "band boundary_edges bricks cap_triangles capped_loops counts crossing_triangles degenerate_triangles dropped_pieces entangled_shells error_bound error_regions \
                  file_bytes \
                  inner_shells inner_triangles intersecting_pairs kept_pieces layout median_error_bound merged_points nodes \
                  non_manifold_edges objects open_loops origin output padding peak_memory_bytes polygons polygons_cut_blindly precision repeated_triangles schema seconds shells \
                  sign_method sign_verdict slope_bound spacing stored_cells stored_nodes triangles \
                  uncertain_pieces unreferenced_points warning welded_points wrongly_wound";
    assert_eq!(keys(&json).join(" "), wanted);
    assert_eq!(keys(&json["seconds"]), ["bake", "read", "write"]);
    assert_eq!((&json["output"], &json["triangles"]), (&"again.sdf.h5".into(), &512.into()));
    assert_eq!(json["file_bytes"], folder.read("again.sdf.h5").len());
}

#[test]
fn contacts_finds_where_a_triangle_touches_a_sphere() {
    let folder = Folder::new();
    folder.write("sphere.sdf.toml", SPHERE);
    // One across the pole, one far away, and one that is separated though it passes the cull.
    let triangles =
        "v -3 -2 0.9\nv 3 -2 0.9\nv 0 4 0.9\nv 9 9 9\nv 8 9 9\nv 9 8 9\nv -3 -2 1.1\nv 3 -2 1.1\nv 0 4 1.1\n";
    folder.write("three.obj", format!("{triangles}f 1 2 3\nf 4 5 6\nf 7 8 9\n"));
    let json = folder.json("contacts three.obj sphere.sdf.toml --iterations 1000");
    assert_eq!(json["schema"], "sdftool.contacts/2");
    let names = "beyond_band contacts device elements not_finite outside_grid passed_cull possible read schema seconds undecided";
    assert_eq!(keys(&json).join(" "), names);
    assert_eq!(keys(&json["seconds"]), ["query", "read"]);
    assert_eq!([&json["elements"], &json["passed_cull"], &json["not_finite"]], [3, 2, 0]);
    let [contact] = &json["contacts"].as_array().unwrap()[..] else { panic!("{json}") };
    let documented = "distance element error_bound evaluations feature feature_id id key lower_bound normal point polygon \
                      shape_lower_bound slope status surface_point vertices weights";
    assert_eq!(keys(contact).join(" "), documented);
    assert_eq!((&contact["element"], &contact["id"], &contact["polygon"]), (&"face".into(), &0.into(), &0.into()));
    assert_eq!((&contact["feature"], &contact["feature_id"]), (&"face".into(), &serde_json::json!([0])));
    let numbers =
        |key: &str| -> Vec<f64> { contact[key].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect() };
    let near = |found: Vec<f64>, expected: [f64; 3]| {
        assert!(found.iter().zip(expected).all(|(x, y)| (x - y).abs() < 0.02), "{found:?} {expected:?}");
    };
    assert!((numbers("weights").iter().sum::<f64>() - 1.0).abs() < 1e-12);
    near(numbers("weights"), [1.0 / 3.0; 3]);
    near(numbers("point"), [0.0, 0.0, 0.9]);
    near(numbers("surface_point"), [0.0, 0.0, 1.0]);
    near(numbers("normal"), [0.0, 0.0, 1.0]);
    let [distance, lower_bound] = [&contact["distance"], &contact["lower_bound"]].map(|x| x.as_f64().unwrap());
    assert!((distance + 0.1).abs() < 1e-3 && lower_bound <= -0.1 && distance >= -0.1 - 1e-9, "{contact}");
    assert!(contact["evaluations"].as_u64().unwrap() >= 1);
    let with_margin = folder.json("contacts three.obj sphere.sdf.toml --margin 0.11");
    assert_eq!(with_margin["contacts"].as_array().unwrap().len(), 2);
    let deep_alone = folder.json("contacts three.obj sphere.sdf.toml --margin -0.2");
    assert_eq!(deep_alone["contacts"].as_array().unwrap().len(), 0);

    let table = folder.done("contacts three.obj sphere.sdf.toml");
    says(&table, &["elements  3\n", "passed the cull  2\n", "contacts  1\n", "face 0"]);
}

#[test]
fn every_method_finds_the_same_deepest_contact() {
    let folder = scene();
    let deepest = |words: &str| {
        let json = folder.json(&format!("contacts sheet.obj ball.sdf.h5 {words}"));
        let contacts = json["contacts"].as_array().unwrap().clone();
        contacts.iter().map(|contact| contact["distance"].as_f64().unwrap()).fold(f64::INFINITY, f64::min)
    };
    let deepest_by_auto = deepest("");
    assert!((-1.0..-0.7).contains(&deepest_by_auto), "{deepest_by_auto}");
    for method in ["pgd", "fw", "newton", "certified", "sample4", "sample16", "sample64"] {
        assert!((deepest(&format!("--method {method}")) - deepest_by_auto).abs() < 0.05, "{method}");
    }
    for method in ["auto", "gss", "pgd", "fw", "newton", "certified", "sample16"] {
        let deepest = deepest(&format!("--elements edges --method {method}"));
        assert!((deepest - deepest_by_auto).abs() < 0.1, "{method}: {deepest}");
    }
    let said = folder.wrong_usage("contacts sheet.obj ball.sdf.h5 --method gss");
    says(&said, &["--method gss", "--elements edges"]);
    says(&folder.wrong_usage("contacts sheet.obj ball.sdf.h5 --rotate 0,0,0,0"), &["--rotate", "not a rotation"]);
    says(&folder.wrong_usage("contacts sheet.obj ball.sdf.h5 --translate 0,0"), &["expected 3 numbers", "found 2"]);
    says(&folder.wrong_usage("contacts sheet.obj ball.sdf.h5 -o list.txt"), &["list.txt", ".csv, .json, .ply or .h5"]);
    folder.wrong_usage("contacts sheet.obj ball.sdf.h5 --margin inf");
}

#[test]
fn certified_contacts_are_at_least_as_deep_as_all_others_and_have_tight_bounds() {
    let folder = scene();
    folder.done("bake ball.obj --res 16 --layout sparse -o sparse.sdf.h5");
    for grid in ["ball.sdf.h5", "sparse.sdf.h5"] {
        let contacts = |words: &str| folder.json(&format!("contacts sheet.obj {grid} {words}"))["contacts"].clone();
        let certified = contacts("--method certified --tolerance 1e-4");
        let certified = certified.as_array().unwrap();
        let number = |contact: &Value, key: &str| contact[key].as_f64().unwrap();
        // Deep in the sparse grid the status says that instead.
        let is_settled = |contact: &&Value| contact["status"] == "converged" || contact["status"] == "beyond_band";
        let converged = certified.iter().filter(is_settled).count();
        assert!(certified.len() > 50 && converged * 10 > certified.len() * 8, "{converged} of {}", certified.len());
        for contact in certified.iter().filter(|contact| contact["status"] == "converged") {
            // The sheet's longest edge is below 0.5, and the slope bound of a ball's grid below 2.
            let gap = number(contact, "distance") - number(contact, "lower_bound");
            assert!((0.0..1e-4 * 0.5 * 2.0).contains(&gap), "{gap}: {contact}");
        }
        for method in ["fw", "pgd", "sample64"] {
            for other in contacts(&format!("--method {method}")).as_array().unwrap() {
                let same = certified.iter().find(|contact| contact["id"] == other["id"]).unwrap();
                let higher = number(same, "distance") - number(other, "distance");
                assert!(higher < 1e-4 * 0.5 * 2.0, "{method} is {higher} lower: {other}, {same}");
            }
        }
    }
    folder.wrong_usage("contacts sheet.obj ball.sdf.h5 --method certified --tolerance 0");
}

#[test]
fn elements_with_too_large_coordinates_are_counted() {
    let folder = scene();
    folder.write("far.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1e200 0 0\nf 1 2 3\nf 1 2 4\n");
    let json = folder.json("contacts far.obj ball.sdf.h5");
    assert_eq!([&json["elements"], &json["passed_cull"], &json["not_finite"]], [2, 1, 1]);
    says(&folder.done("contacts far.obj ball.sdf.h5"), &["skipped  1 element with"]);
}

#[test]
fn eval_prints_distance_and_gradient_of_each_point() {
    let folder = Folder::new();
    folder.write("sphere.sdf.toml", SPHERE);
    folder.write("points.csv", "x,y,z\n2,0,0\n\n0, -0.5 ,0,and,more\r\n0,0,3e0\n");
    let printed = folder.done("eval sphere.sdf.toml --points points.csv");
    let wanted = "x,y,z,distance,gx,gy,gz,status\n2.0,0.0,0.0,1.0,1.0,0.0,0.0,good\n0.0,-0.5,0.0,-0.5,0.0,-1.0,0.0,good\n\
                  0.0,0.0,3.0,2.0,0.0,0.0,1.0,good\n";
    assert_eq!(printed, wanted);
    let json = folder.json("eval sphere.sdf.toml --points points.csv");
    assert_eq!((keys(&json), &json["schema"]), (vec!["read", "samples", "schema"], &"sdftool.eval/1".into()));
    let sample = "beyond_band degenerate_gradient distance gradient not_finite outside_grid point";
    assert_eq!(keys(&json["samples"][0]).join(" "), sample);
    assert_eq!(json["samples"].as_array().unwrap().len(), 3);

    // Its output is valid input; a dash is standard input.
    let again = folder.sdftool("eval sphere.sdf.toml --points -").write_stdin(printed).assert().success();
    assert_eq!(String::from_utf8_lossy(&again.get_output().stdout), wanted);
    // Numbers may be quoted, and are no header.
    folder.write("quoted.csv", "\"2\",\"0\",\"0\"\n\"0\", \"-0.5\" ,\"0\"\n0,0,\" 3 \"\n");
    assert_eq!(folder.done("eval sphere.sdf.toml --points quoted.csv"), wanted);
    folder.write("quoted.csv", "\"2,5\",\"0,1\",\"0,3\"\n");
    says(
        &folder.refused("eval sphere.sdf.toml --points quoted.csv"),
        &["line 1: expected x,y,z with points for decimals"],
    );
    // A header is optional.
    let bare = folder.sdftool("eval sphere.sdf.toml --points -").write_stdin("2,0,0").assert().success();
    assert_eq!(
        String::from_utf8_lossy(&bare.get_output().stdout),
        wanted.lines().take(2).collect::<Vec<_>>().join("\n") + "\n"
    );
}

#[test]
fn eval_reports_the_status_of_each_sample() {
    let folder = scene();
    folder.write("points.csv", "0,0,0.5\n0,0,9\n1e200,0,0\n");
    let json = folder.json("eval ball.sdf.h5 --points points.csv");
    let flags = |sample: usize, flag: &str| json["samples"][sample][flag].as_bool().unwrap();
    assert_eq!([0, 1, 2].map(|sample| flags(sample, "outside_grid")), [false, true, false]);
    assert_eq!([0, 1, 2].map(|sample| flags(sample, "not_finite")), [false, false, true]);
    let outside = json["samples"][1]["distance"].as_f64().unwrap();
    assert!(outside > 7.0 && outside <= 8.0, "a lower bound of the distance: {outside}");

    folder.done("bake ball.obj --res 64 --layout sparse -o sparse.sdf.h5");
    folder.write("sphere.sdf.toml", SPHERE);
    let statuses = |field: &str, points: &str| -> Vec<String> {
        folder.write("points.csv", points);
        let printed = folder.done(&format!("eval {field} --points points.csv"));
        printed.lines().skip(1).map(|line| line.rsplit(',').next().unwrap().to_owned()).collect()
    };
    assert_eq!(statuses("ball.sdf.h5", "0,0,0.5\n0,0,9\n1e200,0,0\n"), ["good", "outside_grid", "not_finite"]);
    assert_eq!(statuses("sparse.sdf.h5", "0,0,1\n0.3,0.1,0.2\n0,0,9\n"), ["good", "beyond_band", "outside_grid"]);
    assert_eq!(statuses("sphere.sdf.toml", "0,0,0\n0,0,0.1\n"), ["degenerate_gradient", "good"]);
}

/// A name with the escape sequence that turns a terminal red, and a bell.
#[cfg(unix)]
#[test]
fn text_of_a_file_does_not_act_on_the_terminal() {
    let folder = Folder::new();
    std::fs::create_dir(folder.at("of")).unwrap();
    folder.write("of/\u{1b}[31mred\u{7}.obj", Model::cube().obj());
    folder.done("bake of/\u{1b}[31mred\u{7}.obj --res 4 -o cube.sdf.h5");
    let table = folder.done("info cube.sdf.h5");
    says(&table, &["\u{fffd}[31mred\u{fffd}.obj, 12 triangles"]);
    assert!(!table.contains(|c: char| c.is_control() && c != '\n'), "{table:?}");
    assert_eq!(folder.json("info cube.sdf.h5")["source"]["name"], "\u{1b}[31mred\u{7}.obj");
}

#[test]
fn info_describes_a_file() {
    let folder = scene();
    let table = folder.done("info ball.sdf.h5");
    says(&table, &["25 × 25 × 25", "pseudo-normal", "ball.obj, 512 triangles", "--res 16 --padding 4 --sign auto"]);
    let json = folder.json("info ball.sdf.h5");
    assert_eq!(json["schema"], "sdftool.info/1");
    let wanted = "band bounds bricks counts deep_values error_bound error_regions file_bytes layout mesh options origin padding parts precision \
                  schema sign_method sign_verdict slope_bound source spacing tool";
    assert_eq!(keys(&json).join(" "), wanted);
    assert_eq!(keys(&json["source"]), ["name", "sha256", "triangles"]);
    assert_eq!(keys(&json["parts"]).join(" "), "bounds digests distance");
    assert_eq!(json["file_bytes"], folder.read("ball.sdf.h5").len());

    folder.write("half.sdf.toml", "[field]\nshape = \"half_space\"\nnormal = [0, 0, 2]\noffset = 1\n");
    assert!(folder.json("info half.sdf.toml")["bounds"].is_null());
    folder.write("sphere.sdf.toml", SPHERE);
    let bounds = &folder.json("info sphere.sdf.toml")["bounds"];
    assert_eq!((&bounds["min"][0], &bounds["max"][2]), (&(-1.0).into(), &1.0.into()));
}

#[test]
fn verify_distinguishes_a_grid_of_the_mesh_from_another() {
    let folder = scene();
    folder.write("sphere.sdf.toml", SPHERE);
    says(&folder.misused("verify sphere.sdf.toml ball.obj --all-nodes"), &["a closed form has no nodes"]);
    says(&folder.done("verify ball.sdf.h5 ball.obj --points 500"), &["the very file", "500 sampled", "0 wrong signs"]);
    let json = folder.json("verify ball.sdf.h5 ball.obj --points 500 --all-nodes");
    assert_eq!(json["schema"], "sdftool.verify/1");
    assert_eq!(
        keys(&json).join(" "),
        "bytes diagonal error_bound faults nodes points same_mesh schema seconds slope spacing"
    );
    assert_eq!(keys(&json["points"]).join(" "), "asked max mean p95 p99_9 voxels wrong_signs");
    assert_eq!((&json["nodes"]["asked"], &json["same_mesh"]), (&15625.into(), &true.into()));
    assert!(json["nodes"]["max"].as_f64().unwrap() < 1e-6 * json["diagonal"].as_f64().unwrap());
    assert!(json["points"]["max"].as_f64().unwrap() <= json["error_bound"].as_f64().unwrap());

    // The same surface in another file is accepted.
    folder.write("ball.ply", Model::ball([0.0; 3], 1.0, 3).ply());
    assert_eq!(folder.json("verify ball.sdf.h5 ball.ply --points 500")["same_mesh"], false);

    folder.write("larger.obj", Model::ball([0.0; 3], 1.1, 3).obj());
    let wrong = folder.sdftool("verify ball.sdf.h5 larger.obj --points 500").assert().code(1);
    let said = String::from_utf8_lossy(&wrong.get_output().stderr).into_owned();
    assert_eq!(said.matches('\n').count(), 1);
    says(&said, &["sdftool: ball.sdf.h5 does not match larger.obj: a node is wrong by"]);
    says(&String::from_utf8_lossy(&wrong.get_output().stdout), &["not the file that was baked", "certified"]);
}

#[test]
fn verify_samples_the_same_points_for_the_same_seed_only() {
    let folder = scene();
    let points =
        |seed: u32| folder.json(&format!("verify ball.sdf.h5 ball.obj --points 300 --seed {seed}"))["points"].clone();
    assert_eq!(points(1), points(1));
    assert_ne!(points(1), points(2));
}

#[test]
fn demo_does_the_whole_job_without_any_input() {
    let blocked = Folder::new();
    std::fs::create_dir_all(blocked.at("demo/contacts.png")).unwrap();
    says(&blocked.refused("demo -o demo"), &["contacts.png", "is a folder"]);
    assert_eq!(std::fs::read_dir(blocked.at("demo")).unwrap().count(), 1);
    let folder = Folder::new();
    says(&folder.done("demo"), &["body.obj", "cloth.obj", "body.sdf.h5", "contacts.csv", "contacts.png"]);
    assert_eq!(folder.names(), ["sdftool-demo"]);
    let json = folder.json("demo -o elsewhere/deeper");
    assert_eq!(json["schema"], "sdftool.demo/1");
    assert_eq!(keys(&json).join(" "), "contacts deepest elements folder passed_cull schema");
    let contacts = json["contacts"].as_u64().unwrap();
    assert!(contacts > 10 && json["deepest"].as_f64().unwrap() < -0.01);
    let list = String::from_utf8(folder.read("elsewhere/deeper/contacts.csv")).unwrap();
    assert_eq!(list.lines().count() as u64, contacts + 1);
    folder.done("verify elsewhere/deeper/body.sdf.h5 elsewhere/deeper/body.obj --points 2000");
    // A second run gives equal files, and may replace old ones.
    let files = ["body.obj", "cloth.obj", "body.sdf.h5", "contacts.csv", "contacts.png"];
    for name in files {
        let [once, again] = ["sdftool-demo", "elsewhere/deeper"].map(|target| folder.read(&format!("{target}/{name}")));
        assert!(once == again, "{name} differs from run to run");
    }
    folder.done("demo");
}

/// Commands that print help, the version or a script.
const HELPS: [&str; 6] = ["--help", "-h", "--version", "help bake", "bake --help", "completions bash"];

#[test]
fn a_pipe_that_closes_early_is_not_an_error() {
    let folder = scene();
    let contacts = ["contacts sheet.obj ball.sdf.h5 --json", "info ball.sdf.h5", "info ball.sdf.h5 --json"];
    for words in contacts.iter().chain(&HELPS) {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut command = std::process::Command::new(crate::folder::SDFTOOL);
        command.args(words.split(' ')).current_dir(folder.path()).stdout(writer);
        let output = command.stderr(std::process::Stdio::piped()).output().unwrap();
        assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""), "{words}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_output_device_is_an_error() {
    let folder = scene();
    let reports = ["info ball.sdf.h5", "info ball.sdf.h5 --json", "contacts sheet.obj ball.sdf.h5"];
    for words in reports.iter().chain(&HELPS) {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let mut command = std::process::Command::new(crate::folder::SDFTOOL);
        command.args(words.split(' ')).current_dir(folder.path()).stdout(full);
        let output = command.stderr(std::process::Stdio::piped()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), said.lines().count()), (Some(1), 1), "{words}: {said}");
        says(&said, &["sdftool: standard output: No space left on device"]);
    }
}
