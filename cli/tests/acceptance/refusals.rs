//! Messages of the program when it was given the wrong thing: they say what was given, what is wanted, and what to type.

use serde_json::Value;

use crate::folder::{Folder, says};
use crate::meshes::Model;

fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 2).obj());
    folder.write("sheet.stl", Model::hills(4).stl());
    folder.write("sphere.sdf.toml", "[field]\nshape = 'sphere'\nradius = 1\n");
    folder.done("bake ball.obj --res 8");
    folder
}

#[test]
fn a_mesh_in_the_place_of_a_field_is_told_with_the_command_that_was_meant() {
    let folder = scene();
    let order = "contacts takes a mesh, then a field, but ";
    for (words, given, meant) in [
        (
            "contacts ball.sdf.h5 sheet.stl",
            "is a field and sheet.stl is an STL mesh",
            "contacts sheet.stl ball.sdf.h5`",
        ),
        (
            "contacts sphere.sdf.toml ball.obj",
            "a field and ball.obj is an OBJ mesh",
            "contacts ball.obj sphere.sdf.toml`",
        ),
        (
            "contacts sheet.stl ball.obj",
            "but ball.obj is an OBJ mesh: bake it first",
            "`sdftool bake ball.obj --res 128`",
        ),
    ] {
        says(&folder.refused(words), &[order, given, meant]);
    }
    for command in ["info", "eval --points points.csv", "slice -o out.png", "surface -o out.obj", "verify sheet.stl"] {
        let line = folder.refused(&format!("{command} ball.obj"));
        let first = command.split(' ').next().unwrap();
        if first == "verify" {
            says(&line, &["verify takes a field", "sheet.stl is an STL mesh"]);
        } else {
            says(&line, &[&format!("{first} takes a field"), "ball.obj is an OBJ mesh", "`sdftool bake ball.obj"]);
        }
    }
    says(&folder.refused("verify ball.obj ball.sdf.h5"), &["`sdftool verify ball.sdf.h5 ball.obj`"]);
    says(&folder.refused("compare ball.sdf.h5 ball.obj"), &["`sdftool compare ball.obj ball.sdf.h5`"]);
    says(&folder.refused("compare ball.sdf.h5 sphere.sdf.toml"), &["ball.sdf.h5 is a field: give a mesh first"]);
    says(&folder.refused("bake ball.sdf.h5 --res 8"), &["ball.sdf.h5 is a field already"]);
    // The right order, and a text that is neither, are not mistaken.
    folder.done("contacts sheet.stl sphere.sdf.toml");
    folder.write("notes.txt", "dear diary\n");
    says(&folder.refused("info notes.txt"), &["notes.txt", "not TOML from line 1 on"]);
}

#[test]
fn a_misspelt_key_is_named() {
    let folder = Folder::new();
    for (text, words) in [
        ("[feild]\nshape = 'sphere'\nradius = 1\n", ["needs field, a table", "\"feild\" is misspelt"]),
        ("[field]\nshap = 'sphere'\nradius = 1\n", ["field: needs shape, a string", "\"shap\" is misspelt"]),
        ("[field]\nshape = 'sphere'\nradus = 1\n", ["field: needs radius, a number", "\"radus\" is misspelt"]),
        (
            "[field]\nshape = 'torus'\nmajor_radius = 2\nminor_raduis = 1\n",
            ["minor_radius", "\"minor_raduis\" is misspelt"],
        ),
        ("[field]\nshape = 'sphere'\nradius = 1\npose.scael = 2\n", ["field.pose", "unknown key \"scael\""]),
    ] {
        folder.write("bad.sdf.toml", text);
        says(&folder.refused("info bad.sdf.toml"), &words);
    }
    for (text, words) in [
        ("[field]\nshape = 'sphere'\nradius = nan\n", "field: radius must be a finite number, not nan"),
        ("[field]\nshape = 'sphere'\nradius = -inf\n", "field: radius must be a finite number, not inf"),
        ("[field]\nshape = 'sphere'\nradius = '1'\n", "field: radius must be a finite number, not a string"),
        ("[field]\nshape = 'union'\nof = []\n", "field: of must be a list of at least one table, not an empty list"),
        ("[field]\nshape = 'union'\nof = [1]\n", "field.of[0] must be a table, not an integer"),
    ] {
        folder.write("bad.sdf.toml", text);
        says(&folder.refused("info bad.sdf.toml"), &[words]);
    }
    // A key of another meaning is not taken for a slip of the pen.
    folder.write("bad.sdf.toml", "[field]\nshape = 'sphere'\ncolour = 1\n");
    assert_eq!(folder.refused("info bad.sdf.toml"), "bad.sdf.toml: field: needs radius, a number");
}

#[test]
fn no_sentence_is_said_twice() {
    let folder = scene();
    for words in [
        "info missing.sdf.h5",
        "info missing.sdf.toml",
        "contacts missing.obj sphere.sdf.toml",
        "contacts ball.obj missing.sdf.toml",
        "eval sphere.sdf.toml --points missing.csv",
        "bake missing.obj --res 8",
        "surface missing.sdf.toml -o out.obj",
        "bake ball.obj --res 8 -o missing/out.sdf.h5",
    ] {
        let line = folder.refused(words);
        assert_eq!(line.matches("os error 2").count(), 1, "{words}: {line}");
        says(&line, &["missing"]);
    }
}

#[test]
fn an_output_is_refused_whose_ending_is_not_what_is_written() {
    let folder = scene();
    for (words, endings) in [
        ("bake ball.obj --res 8 -o ball.obj", ".sdf.h5"),
        ("bake ball.obj --res 8 -o grid", ".sdf.h5"),
        ("contacts ball.obj sphere.sdf.toml -o list.txt", ".csv, .json, .ply or .h5"),
        ("compare ball.obj sphere.sdf.toml -o page.pdf", ".html"),
        ("slice sphere.sdf.toml -o picture.jpg", ".png"),
        ("surface sphere.sdf.toml -o surface.gltf", ".obj, .ply, .stl or .off"),
        ("verify ball.sdf.h5 ball.obj --histogram errors.png", ".svg"),
    ] {
        says(&folder.wrong_usage(words), &["use a name that ends in ", endings]);
    }
    folder.done("bake ball.obj --res 8 -o grid.H5");
}

#[test]
fn a_limit_in_percent_is_repeated_as_it_was_given() {
    let folder = scene();
    says(&folder.refused("bake ball.obj --max-error 0.0001%"), &["--max-error 0.0001%: "]);
    // 0.018 · 100 is 1.8000000000000003.
    folder.done("bake ball.obj --max-error 1.8% -o large.sdf.h5");
    let options = folder.json("info large.sdf.h5")["options"].as_str().unwrap().to_owned();
    assert!(options.starts_with("--max-error 1.8% "), "{options}");
}

#[test]
fn with_json_an_error_is_one_object_on_standard_output_too() {
    let folder = scene();
    for (words, status) in [
        ("info missing.sdf.h5 --json", 1),
        ("contacts --json ball.sdf.h5 ball.obj", 1),
        ("bake ball.obj --json", 2),
        ("bake ball.obj --res 0 --json", 2),
        ("bake ball.obj --res 8 --layout dense --band 3 --json", 2),
    ] {
        let output = folder.sdftool(words).output().unwrap();
        let [printed, said] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
        assert_eq!(
            (output.status.code(), printed.matches('\n').count()),
            (Some(status), 1),
            "{words}: {printed}{said}"
        );
        let object: Value = serde_json::from_str(&printed).unwrap();
        let error = object["error"].as_str().unwrap();
        assert_eq!((&object["schema"], object.as_object().unwrap().len()), (&"sdftool.error/1".into(), 2), "{printed}");
        let said = said.replace("\n  ", " ");
        assert!(!error.is_empty() && said.contains(error), "{words}: {printed}{said}");
    }
    let error = |words: &str| {
        let output = folder.sdftool(words).output().unwrap();
        serde_json::from_slice::<Value>(&output.stdout).unwrap()["error"].as_str().unwrap().to_owned()
    };
    // The names of arguments and values stand in later lines of the text.
    says(&error("bake ball.obj --json"), &["not provided: <--res <N>|--voxel-size <H>|--max-error <E>>"]);
    says(&error("verify --json"), &["not provided: <SDF>, <MESH>"]);
    says(&error("slice ball.sdf.h5 -o out.png --axis w --json"), &["'w'", "[possible values: x, y, z]"]);
    // Without it, and for help, standard output is as before.
    assert!(!folder.refused("info missing.sdf.h5").is_empty());
    says(&folder.done("info --json --help"), &["Usage: sdftool info"]);
}

#[test]
fn options_that_contradict_each_other_are_told_with_the_usage_of_their_command() {
    let folder = scene();
    let message = folder.wrong_usage("bake ball.obj --res 8 --band 4");
    says(&message, &["a dense grid has no band", "Usage: sdftool bake [OPTIONS]"]);
}

#[test]
fn a_plane_outside_the_box_and_an_empty_set_of_elements_are_errors() {
    let folder = scene();
    folder.write("points.obj", "v 0 0 0\nv 1 0 0\n");
    for field in ["ball.sdf.h5", "sphere.sdf.toml"] {
        for at in ["9", "-9", "1e308"] {
            let line = folder.refused(&format!("slice {field} --axis y --at {at} -o out.png"));
            says(&line, &[field, "--at ", "outside the field's box: use y from "]);
        }
        folder.done(&format!("slice {field} --axis y --at 0.9 -o out.png --pixels 16"));
        std::fs::remove_file(folder.at("out.png")).unwrap();
    }
    says(
        &folder.refused("contacts points.obj sphere.sdf.toml"),
        &["no triangles in points.obj", "--elements vertices"],
    );
    let line = folder.refused("contacts points.obj sphere.sdf.toml --elements edges");
    says(&line, &["no edges in points.obj", "--elements vertices"]);
    folder.done("contacts points.obj sphere.sdf.toml --elements vertices");
}

#[test]
fn points_may_stand_between_commas_semicolons_or_blanks() {
    let folder = scene();
    folder.write("commas.csv", "x,y,z\n0.5,-1,2e0\n0,0,3,more\n");
    folder.write("semicolons.csv", "x;y;z\n0.5; -1 ;2e0\n0;0;3;more\n");
    folder.write("blanks.csv", "x y z\n0.5 -1\t2e0\n  0 0   3 more\n");
    folder.write("mixed.csv", "0.5,-1,2e0\n0;0;3\n");
    let wanted = folder.done("eval sphere.sdf.toml --points commas.csv");
    assert_eq!(wanted.lines().count(), 3);
    for name in ["semicolons", "blanks", "mixed"] {
        assert_eq!(folder.done(&format!("eval sphere.sdf.toml --points {name}.csv")), wanted, "{name}");
    }
    // A decimal comma is not a column.
    folder.write("decimal.csv", "1,5;2,5;3\n");
    says(&folder.refused("eval sphere.sdf.toml --points decimal.csv"), &["decimal.csv, line 1", "points for decimals"]);
}

#[test]
fn a_dash_reads_a_mesh_or_a_field_from_standard_input() {
    let folder = scene();
    folder.done("export ball.sdf.h5 --format npy");
    folder.done("export ball.sdf.h5 --format nvdb");
    folder.write("points.csv", "2,0,0\n");
    let piped = |words: &str, name: &str| {
        let assert = folder.sdftool(words).write_stdin(folder.read(name)).assert().success().stderr("");
        String::from_utf8_lossy(&assert.get_output().stdout).into_owned()
    };
    for field in ["ball.sdf.h5", "sphere.sdf.toml"] {
        assert_eq!(piped("info -", field), folder.done(&format!("info {field}")));
        let words = "eval --points points.csv";
        assert_eq!(piped(&format!("{words} -"), field), folder.done(&format!("{words} {field}")));
    }
    let count = |json: &str| serde_json::from_str::<Value>(json).unwrap()["contacts"].as_array().unwrap().len();
    let by_name = folder.done("contacts sheet.stl ball.sdf.h5 --json");
    assert_eq!(count(&piped("contacts - ball.sdf.h5 --json", "sheet.stl")), count(&by_name));
    assert_eq!(count(&piped("contacts sheet.stl - --json", "ball.sdf.h5")), count(&by_name));
    piped("bake - --res 8 -o piped.sdf.h5", "ball.obj");
    folder.done("verify piped.sdf.h5 ball.obj --points 10");
    for words in
        ["verify - ball.obj --points 10", "view - -o page.html", "slice - -o out.png --pixels 16", "surface - -o s.obj"]
    {
        piped(words, "ball.sdf.h5");
    }
    piped("verify ball.sdf.h5 - --points 10", "ball.obj");
    piped("view ball.sdf.h5 - -o page.html", "ball.obj");
    for (words, name) in [("import --spacing 0.1", "ball.npy"), ("import", "ball.nvdb")] {
        piped(&format!("{words} - -o piped.sdf.h5"), name);
        folder.done(&format!("{words} {name} -o named.sdf.h5"));
        assert_eq!(folder.json("info piped.sdf.h5")["counts"], folder.json("info named.sdf.h5")["counts"], "{name}");
    }
    for words in ["import -", "import - --spacing 0.1", "view -", "export - --format npy"] {
        says(&folder.misused(words), &["standard input has no name: add -o"]);
    }
    for words in ["verify - -", "view - -", "compare - -"] {
        says(&folder.misused(words), &["cannot both be standard input"]);
    }
    says(
        &folder.misused("contacts sheet.stl - --view page.html"),
        &["--view reads the field again", "name the field's file"],
    );
    says(&folder.misused("merge - -o merged.sdf.h5"), &["a part cannot be standard input", "name its file"]);
    says(&folder.misused("simulate -"), &["a scene", "cannot be standard input: name its file"]);
    says(&folder.misused("bake - --res 8"), &["add -o"]);
    says(&folder.misused("contacts - -"), &["cannot both be standard input"]);
    says(&folder.misused("eval - --points -"), &["cannot both be standard input"]);
    says(&folder.refused("info -"), &["standard input: an empty file"]);
    let refused = folder.sdftool("eval sphere.sdf.toml --points -").write_stdin("1,2\n").assert().code(1);
    says(&String::from_utf8_lossy(&refused.get_output().stderr), &["standard input, line 1: expected 3 numbers"]);
    folder.write("long.csv", "0,0,0 ".repeat(20_000));
    says(&folder.refused("eval sphere.sdf.toml --points long.csv"), &["long.csv, line 1", "longer than 65536 bytes"]);
}

#[test]
fn no_more_is_read_than_the_file_has_and_tiny_numbers_are_short() {
    let folder = scene();
    folder.write("tiny.obj", Model::ball([0.0; 3], 1e-30, 2).obj());
    folder.done("bake tiny.obj --res 8");
    folder.done("surface tiny.sdf.h5 -o surface.obj");
    let text = String::from_utf8(folder.read("surface.obj")).unwrap();
    assert!(text.contains("e-3") && !text.contains("0000000000000000000"), "{:.200}", text);
    folder.done("bake ball.obj --res 60");
    for words in [
        "contacts ball.obj ball.sdf.h5 --elements vertices",
        "contacts ball.obj ball.sdf.h5",
        "eval ball.sdf.h5 --points c.csv",
    ] {
        folder.write("c.csv", "0,0,1\n0,1,0\n");
        let read = &folder.json(words)["read"];
        assert!(read["bytes"].as_u64() <= read["file_bytes"].as_u64(), "{words}: {read}");
    }
}

/// Depths there are coarse: contacts were left out without a word.
#[test]
fn a_margin_deeper_than_a_sparse_band_is_refused_unless_the_search_grants_it() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    folder.write("sheet.obj", Model::hills(20).moved(|[x, y, z]| [x, y, 0.3 * z]).obj());
    folder.done("bake ball.obj --res 40 --layout sparse --keep-mesh");
    let words = "contacts sheet.obj ball.sdf.h5 --margin -0.4";
    says(
        &folder.refused(words),
        &["ball.sdf.h5: --margin -0.400000 is deeper than the 0.150000", "--band 8", "--complete"],
    );
    let [exact, complete] = ["--exact", "--complete"].map(|option| {
        let json = folder.json(&format!("{words} {option}"));
        let ids = json["contacts"].as_array().unwrap().iter().map(|contact| contact["id"].as_u64().unwrap());
        ids.collect::<std::collections::BTreeSet<u64>>()
    });
    assert!(!exact.is_empty() && exact.is_subset(&complete), "{} and {}", exact.len(), complete.len());
}

/// A closed form keeps no margin of its grids.
#[test]
fn contacts_outside_of_a_grid_within_a_closed_form_are_counted() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    folder
        .write("grid.sdf.toml", "[field]\nshape = 'grid'\nfile = 'ball.sdf.h5'\npose.translation = [0.0, 0.0, 0.0]\n");
    folder.write("far.obj", "v 3 0 0\nv 3 1 0\nv 3 0 1\nf 1 2 3\n");
    folder.done("bake ball.obj --res 16");
    let words = "contacts far.obj grid.sdf.toml --margin 2.0";
    let json = folder.json(words);
    assert_eq!((&json["outside_grid"], json["contacts"].as_array().unwrap().len()), (&1.into(), 1));
    says(&folder.done(words), &["outside the grid", "1 contact:", "--padding"]);
}

#[test]
fn no_output_replaces_a_grid_that_a_field_names() {
    let folder = scene();
    std::fs::create_dir(folder.at("fields")).unwrap();
    let grid = "{ shape = 'grid', file = '../ball.sdf.h5' }";
    folder.write("fields/plain.sdf.toml", format!("field = {grid}\n"));
    let parts = format!("{{ shape = 'union', of = [{{ shape = 'sphere', radius = 1 }}, {grid}] }}");
    let nested = format!("[field]\nshape = 'offset'\ndistance = 0.1\nof = {parts}\n");
    folder.write("fields/nested.sdf.toml", nested);
    let before = folder.read("ball.sdf.h5");
    for name in ["plain", "nested"] {
        for words in [
            "contacts sheet.stl fields/NAME.sdf.toml -o ball.sdf.h5",
            "contacts fields/NAME.sdf.toml sphere.sdf.toml -o fields/../ball.sdf.h5",
            "export fields/NAME.sdf.toml --format vtkhdf -o ball.sdf.h5",
        ] {
            let line = folder.refused(&words.replace("NAME", name));
            let fault = format!("ball.sdf.h5: would replace a file that fields/{name}.sdf.toml names: choose another");
            says(&line, &[&fault]);
            assert!(folder.read("ball.sdf.h5") == before, "{words}");
        }
    }
    // Another file is replaced.
    for _ in 0..2 {
        folder.done("export fields/nested.sdf.toml --res 8 --format vtkhdf -o other.h5");
    }
}

#[test]
fn an_error_names_the_file_that_is_at_fault_and_counts_in_english() {
    let folder = scene();
    folder.write("half.sdf.toml", "[field]\nshape = 'half_space'\nnormal = [0, 0, 1]\noffset = 0\n");
    for words in ["view half.sdf.toml sheet.stl -o page.html", "contacts sheet.stl half.sdf.toml --view page.html"] {
        assert_eq!(folder.refused(words), "half.sdf.toml: the field is unbounded: intersect it with a box", "{words}");
    }
    folder.write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    says(&folder.done("bake one.obj --res 8"), &["3 points, 1 triangle\n"]);
    says(&folder.done("info one.sdf.h5"), &["one.obj, 1 triangle, "]);
    let line = folder.refused("bake ball.obj --res 256 --layout sparse --memory 300kB");
    says(&line, &["ball.obj: a grid of ", " bricks needs "]);
}

/// As a shell gives one for `<(cat ball.sdf.h5)`.
#[cfg(unix)]
#[test]
fn a_field_in_a_pipe_is_told_to_come_by_a_dash() {
    let folder = scene();
    let made = std::process::Command::new("mkfifo").arg(folder.at("pipe")).status().unwrap();
    assert!(made.success());
    for words in ["contacts sheet.stl pipe", "info pipe", "view pipe -o page.html", "contacts ball.sdf.h5 pipe"] {
        let line = folder.refused(words);
        assert_eq!(line, "pipe: not a regular file: give `-` and the field on standard input", "{words}");
    }
}

/// A file of that name is `./-`.
#[test]
fn a_dash_is_standard_input_whatever_a_file_of_that_name_holds() {
    let folder = scene();
    let piped = |words: &str, name: &str| {
        let assert = folder.sdftool(words).write_stdin(folder.read(name)).assert().success().stderr("");
        String::from_utf8_lossy(&assert.get_output().stdout).into_owned()
    };
    let info = folder.done("info ball.sdf.h5");
    let contacts = folder.json("contacts sheet.stl ball.sdf.h5")["contacts"].clone();
    for name in ["ball.obj", "ball.sdf.h5", "sphere.sdf.toml"] {
        folder.write("-", folder.read(name));
        assert_eq!(piped("info -", "ball.sdf.h5"), info, "{name}");
        let found: Value = serde_json::from_str(&piped("contacts - ball.sdf.h5 --json", "sheet.stl")).unwrap();
        assert_eq!(found["contacts"], contacts, "{name}");
        says(&folder.misused("contacts ball.sdf.h5 -"), &["two fields are read twice", "name a file for each"]);
    }
    folder.done("contacts ball.sdf.h5 ./sphere.sdf.toml");
}
