//! `export`, `import` and `view`: files, refusals, and what the page is made of. `.ci/readers.sh` and `.ci/view.sh` let other
//! programs read them.

use crate::folder::{Folder, says};
use crate::meshes::Model;

fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    folder.done("bake ball.obj --res 16 --layout sparse");
    folder
}

#[test]
fn each_format_is_written_under_the_name_of_the_field() {
    let folder = scene();
    let starts: [(&str, &[u8]); 6] = [
        ("nvdb", b"NanoVDB0"),
        ("raw", b""),
        ("npy", b"\x93NUMPY"),
        ("nrrd", b"NRRD0004\n"),
        ("vtkhdf", b"\x89HDF\r\n"),
        ("glb", b"glTF"),
    ];
    for (format, start) in starts {
        let json = folder.json(&format!("export ball.sdf.h5 --format {format}"));
        let name = format!("ball.{format}");
        assert_eq!((&json["files"][0]["path"], &json["format"]), (&name.clone().into(), &format.into()));
        let bytes = folder.read(&name);
        assert!(bytes.starts_with(start), "{format}");
        assert_eq!(json["files"][0]["bytes"], bytes.len());
        // The ending names the format as well, and the bytes are the same on any number of threads.
        folder.done(&format!("export ball.sdf.h5 -o again.{format} --threads 3"));
        assert!(folder.read(&format!("again.{format}")) == bytes, "{format}");
    }
    says(&String::from_utf8(folder.read("ball.raw.json")).unwrap(), &["\"file\": \"ball.raw\"", "\"band\": 0."]);
}

#[test]
fn an_export_that_cannot_be_says_why() {
    let folder = scene();
    says(&folder.wrong_usage("export ball.sdf.h5"), &["--format"]);
    says(&folder.misused("export ball.sdf.h5 -o ball.vdb"), &["--output", ".nvdb", "--format"]);
    says(&folder.misused("export ball.sdf.h5 --format npy --band 3"), &["--band is for --format nvdb"]);
    says(&folder.refused("export ball.obj --format npy"), &["export takes a field", "OBJ"]);
    folder.write("half.sdf.toml", "[field]\nshape = \"half_space\"\nnormal = [0, 0, 1]\noffset = 0\n");
    says(&folder.refused("export half.sdf.toml --format npy"), &["half.sdf.toml", "unbounded"]);
    folder.write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.sdftool("bake sheet.obj --res 8").assert().success();
    says(
        &folder.refused("export sheet.sdf.h5 --format glb"),
        &["the surface is empty", "take `surface --level`", "open mesh"],
    );
    folder.sdftool("surface sheet.sdf.h5 --level 0.1 -o sheet.ply").assert().success();
}

#[test]
fn an_imported_grid_finds_the_same_contacts_and_says_that_nothing_is_certified() {
    let folder = scene();
    folder.write("sheet.obj", Model::ball([0.0, 0.0, 1.5], 0.6, 2).obj());
    let contacts = |field: &str| folder.json(&format!("contacts sheet.obj {field}"))["contacts"].clone();
    let ours = contacts("ball.sdf.h5");
    assert!(ours.as_array().unwrap().len() > 5);
    folder.done("export ball.sdf.h5 --format nvdb");
    folder.done("import ball.nvdb -o theirs.sdf.h5");
    let theirs = contacts("theirs.sdf.h5");
    assert_eq!(ours.as_array().unwrap().len(), theirs.as_array().unwrap().len());
    for (ours, theirs) in ours.as_array().unwrap().iter().zip(theirs.as_array().unwrap()) {
        let difference = ours["distance"].as_f64().unwrap() - theirs["distance"].as_f64().unwrap();
        assert!(ours["id"] == theirs["id"] && difference.abs() < 2e-3, "{ours} {theirs}");
    }
    let info = folder.json("info theirs.sdf.h5");
    assert_eq!((&info["error_bound"], &info["sign_method"]), (&serde_json::Value::Null, &"given".into()));
    says(&folder.done("info theirs.sdf.h5"), &["unknown: the samples were imported", "ball.nvdb", "import"]);
    says(&folder.refused("contacts sheet.obj theirs.sdf.h5 --complete"), &["error"]);

    // Its leaves end by a cell's diagonal at most: their other values would fall to the background from cell to cell.
    folder.done("bake ball.obj --res 60 -o fine.sdf.h5");
    folder.done("export fine.sdf.h5 --format nvdb");
    folder.done("import fine.nvdb -o again.sdf.h5");
    let slope = folder.json("info again.sdf.h5")["slope_bound"].as_f64().unwrap();
    assert!(slope < 3.1, "{slope}");

    folder.done("export ball.sdf.h5 --format npy");
    let spacing = info["spacing"].as_f64().unwrap();
    folder.done(&format!("import ball.npy --spacing {spacing} --origin -1,-1,-1 -o array.sdf.h5"));
    assert_eq!(folder.json("info array.sdf.h5")["origin"], serde_json::json!([-1.0, -1.0, -1.0]));
    for place in ["0.1 --origin 1e300,0,0", "1e300", "1e29", "1e-9 --origin 0,1e9,0"] {
        let line = folder.refused(&format!("import ball.npy --spacing {place} -o far.sdf.h5"));
        says(&line, &["ball.npy: 25 × 25 × 25 nodes", "are not a grid", "beyond ±1e30"]);
    }
    folder.done("import ball.npy --spacing 1e28 --origin 0,-1e29,0 -o far.sdf.h5");
    says(&folder.misused("import ball.npy"), &["ball.npy", "add --spacing"]);
    // By its first bytes, whatever its name.
    folder.write("ball.array", folder.read("ball.npy"));
    folder.done("import ball.array --spacing 0.1 -o named.sdf.h5");
    says(&folder.misused("import ball.array -o named.sdf.h5"), &["ball.array: a NumPy array", "add --spacing"]);
    says(&folder.misused("import ball.nvdb --spacing 1 -o x.sdf.h5"), &["remove --spacing"]);
    for words in ["import ball.npz", "import ball.NPZ --spacing 1 -o x.sdf.h5"] {
        says(&folder.misused(words), &["an archive of arrays is not read: import one of its .npy"]);
    }
    says(&folder.refused("import ball.obj -o x.sdf.h5"), &["ball.obj", "not a NanoVDB file"]);
}

/// A NumPy array of shape (z, y, x), x fastest.
fn array([z, y, x]: [usize; 3], sample: impl Fn(usize) -> f32) -> Vec<u8> {
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({z}, {y}, {x}), }}\n");
    let length = (header.len() as u16).to_le_bytes();
    let samples = (0..x * y * z).flat_map(|index| sample(index).to_le_bytes());
    [&b"\x93NUMPY\x01\x00"[..], &length, header.as_bytes()].concat().into_iter().chain(samples).collect()
}

#[test]
fn an_array_without_two_nodes_along_each_axis_is_refused_for_that() {
    let folder = Folder::new();
    for (shape, counts) in [([1, 7, 8], "8 × 7 × 1"), ([0, 7, 8], "8 × 7 × 0"), ([7, 1, 8], "8 × 1 × 7")] {
        folder.write("thin.npy", array(shape, |_| 0.0));
        let line = folder.refused("import thin.npy --spacing 0.1");
        says(&line, &["thin.npy", counts, "two nodes along each axis are needed"]);
    }
}

#[test]
fn an_import_warns_of_signs_that_no_solid_in_the_box_has() {
    let folder = Folder::new();
    let ball = |index: usize| {
        let squared = |i: usize| (i as f32 - 7.5).powi(2);
        0.1 * ((squared(index % 16) + squared(index / 16 % 16) + squared(index / 256)).sqrt() - 4.0)
    };
    let warning = |sample: &dyn Fn(usize) -> f32| {
        folder.write("ball.npy", array([16; 3], sample));
        let words = "import ball.npy --spacing 0.1 -o ball.sdf.h5";
        let (document, rows) = (folder.json(words), folder.done(words));
        let warning = document["warning"].as_str().map(str::to_owned);
        assert_eq!(rows.contains("warning"), warning.is_some(), "{rows}");
        says(&rows, &[warning.as_deref().unwrap_or_default()]);
        warning
    };
    assert_eq!(warning(&ball), None);
    // A rod that leaves the box on two sides.
    assert_eq!(warning(&|index| ball(index / 16 * 16 + 8)), None);
    says(&warning(&|index| ball(index).abs()).unwrap(), &["no node is inside the solid"]);
    says(
        &warning(&|index| -ball(index)).unwrap(),
        &["reaches or lies outside the box on all sides", "are the signs flipped?"],
    );
    let slope = "at the surface the samples change by ";
    says(&warning(&|index| 10.0 * ball(index)).unwrap(), &[slope, "are they distances in another unit?"]);
    says(&warning(&|index| 0.1 * ball(index)).unwrap(), &[slope]);
    assert_eq!(warning(&|index| 1.2 * ball(index)), None);
    says(&warning(&|index| -ball(index)).unwrap(), &["are the signs flipped?"]);
    // No error is certified, and yet all signs are wrong, in cells as at nodes.
    folder.write("ball.obj", Model::ball([0.75; 3], 0.4, 3).obj());
    let verified = folder.sdftool("verify ball.sdf.h5 ball.obj --points 1000 --json").assert().code(1);
    let document: serde_json::Value = serde_json::from_slice(&verified.get_output().stdout).unwrap();
    assert!(document["points"]["wrong_signs"].as_u64().unwrap() > 300, "{document}");
}

#[test]
fn the_slope_that_an_import_calls_measured_is_that_of_the_samples() {
    let folder = Folder::new();
    let constant = |sample: f32| array([4, 5, 6], move |_| sample);
    let ramp = array([4, 5, 6], |index| 0.25 * (index % 6) as f32 + 0.1);
    let steep = array([4, 5, 6], |index| 3.0 * (index % 6) as f32 - 7.0);
    for (samples, bound, measured) in [
        (constant(1.0), "1.000000", "0.000000"),
        (constant(-1.0), "1.000000", "0.000000"),
        (constant(0.0), "1.000000", "0.000000"),
        (ramp, "1.000000", "0.250000"),
        // Rounded up.
        (steep, "3.162279", "3.000001"),
    ] {
        folder.write("samples.npy", samples);
        let rows = folder.done("import samples.npy --spacing 1 -o samples.sdf.h5");
        says(&rows, &[&format!("slope  at most {bound}; {measured} in the box, as measured\n")]);
        says(&folder.done("info samples.sdf.h5"), &[&format!("slope  at most {bound}\n")]);
    }
}

#[test]
fn an_import_does_not_replace_the_grid_that_its_file_came_from() {
    let folder = scene();
    let grid = folder.read("ball.sdf.h5");
    for (format, words) in [("npy", "import ball.npy --spacing 0.1"), ("nvdb", "import ball.nvdb")] {
        folder.done(&format!("export ball.sdf.h5 --format {format}"));
        says(&folder.refused(words), &["ball.sdf.h5: is there already", "-o"]);
        assert!(folder.read("ball.sdf.h5") == grid, "{format}");
    }
    folder.done("import ball.nvdb -o ball.sdf.h5");
    assert!(folder.read("ball.sdf.h5") != grid);
    std::fs::remove_file(folder.at("ball.sdf.h5")).unwrap();
    folder.done("import ball.nvdb");
}

/// Offset and number of entries of each array of a page.
fn parts_of(page: &[u8]) -> serde_json::Value {
    let page = std::str::from_utf8(page).unwrap();
    let head = page.split_once("id=\"head\">").unwrap().1.split_once("</script>").unwrap().0;
    let head: serde_json::Value = serde_json::from_str(head).unwrap();
    head["parts"].clone()
}

#[test]
fn a_page_shows_ropes_and_points_and_their_contacts() {
    let folder = scene();
    folder.write("rope.obj", "v -2 0 0.5\nv 0 0.1 0.6\nv 2 0 0.5\nv 0 3 0\nl 1 2 3\n");
    folder.write("points.obj", "v 0 0 0.5\nv 0 0.1 0.6\nv 2 0 0.5\n");
    folder.write("both.obj", "v -2 0 0.5\nv 0 0.1 0.6\nv 2 0 0.5\nv 0 3 0\nf 1 2 3\nl 1 4\nl 2 4\n");
    let cases = [
        ("rope.obj", "", 2, ("mesh_segments", 4)),
        ("points.obj", "", 2, ("mesh_dots", 3)),
        ("both.obj", "", 1, ("mesh_triangles", 3)),
        ("both.obj", "--elements edges", 4, ("mesh_segments", 4)),
        ("both.obj", "--elements vertices", 1, ("mesh_segments", 4)),
    ];
    for (mesh, options, contacts, (part, count)) in cases {
        let json = folder.json(&format!("view ball.sdf.h5 {mesh} -o page.html {options}"));
        assert_eq!(json["contacts"], contacts, "{mesh} {options}");
        let page = folder.read("page.html");
        let parts = parts_of(&page);
        assert_eq!((&parts[part][1], &parts["contact_ids"][1]), (&count.into(), &contacts.into()), "{mesh} {options}");
        let elements = match mesh {
            "rope.obj" => "--elements edges",
            "points.obj" => "--elements vertices",
            _ => options,
        };
        folder.done(&format!("contacts {mesh} ball.sdf.h5 {elements} --view same.html"));
        assert!(folder.read("same.html") == page, "{mesh} {options}");
    }
    for (words, advice) in [
        ("view ball.sdf.h5 rope.obj --elements faces", "use --elements vertices or edges"),
        ("view ball.sdf.h5 points.obj --elements edges", "no edges in points.obj: use --elements vertices"),
    ] {
        says(&folder.refused(words), &[advice]);
    }
}

#[test]
fn a_page_needs_no_network_and_is_written_by_three_commands() {
    let folder = scene();
    folder.write("sheet.obj", Model::ball([0.0, 0.0, 1.5], 0.6, 2).obj());
    let json = folder.json("view ball.sdf.h5 sheet.obj");
    let page = String::from_utf8(folder.read("ball.html")).unwrap();
    assert_eq!(json["bytes"], page.len());
    assert!(json["contacts"].as_u64().unwrap() > 5);
    says(&page, &["\"certified error\",\"at most 0.", "sheet on ball", "contact_points"]);
    assert!(!page.contains("://") && !page.contains("{{"), "the page loads something, or has a gap");
    folder.done("contacts sheet.obj ball.sdf.h5 --view same.html");
    assert!(folder.read("same.html") == page.as_bytes());
    folder.done("bake ball.obj --res 16 --layout sparse -o again.sdf.h5 --view again.html");
    folder.done("view again.sdf.h5 -o other.html");
    assert!(folder.read("again.html") == folder.read("other.html"));
    // A name cannot end the script that it stands in.
    std::fs::copy(folder.at("ball.sdf.h5"), folder.at("<!--<script>.sdf.h5")).unwrap();
    let mut view = folder.sdftool("view -o named.html --");
    view.arg("<!--<script>.sdf.h5").assert().success();
    assert_eq!(String::from_utf8(folder.read("named.html")).unwrap().matches("<script>").count(), 1);
    // Nor is anything filled in for what a name holds.
    std::fs::copy(folder.at("ball.sdf.h5"), folder.at("{{DATA}}.sdf.h5")).unwrap();
    folder.sdftool("view -o filled.html --").arg("{{DATA}}.sdf.h5").assert().success();
    let filled = String::from_utf8(folder.read("filled.html")).unwrap();
    says(&filled, &["{{DATA}}"]);
    assert!(filled.len() < folder.read("other.html").len() + 100, "the data are there twice");
    says(&folder.wrong_usage("view ball.sdf.h5 -o page.png"), &[".html"]);
}

/// The samples and their description: both, or neither.
#[test]
fn a_raw_file_without_its_description_is_not_left() {
    let folder = scene();
    std::fs::create_dir(folder.at("ball.raw.json")).unwrap();
    says(&folder.refused("export ball.sdf.h5 --format raw"), &["ball.raw.json"]);
    std::fs::remove_dir(folder.at("ball.raw.json")).unwrap();
    folder.done("export ball.sdf.h5 --format raw");
    let samples = folder.read("ball.raw");
    std::fs::remove_file(folder.at("ball.raw.json")).unwrap();
    std::fs::create_dir(folder.at("ball.raw.json")).unwrap();
    says(&folder.refused("export ball.sdf.h5 --res 8 --format raw"), &["ball.raw.json"]);
    assert!(folder.read("ball.raw") == samples);
}

/// Nothing is known of the error of samples of another program.
#[test]
fn a_histogram_of_an_imported_grid_has_numbers() {
    let folder = scene();
    folder.done("export ball.sdf.h5 --format npy");
    folder.done("import ball.npy --spacing 0.125 --origin -1.25,-1.25,-1.25 -o imported.sdf.h5");
    let _ = folder.sdftool("verify imported.sdf.h5 ball.obj --points 100 --histogram errors.svg").output().unwrap();
    let svg = String::from_utf8(folder.read("errors.svg")).unwrap();
    assert!(svg.contains("<rect") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
}
