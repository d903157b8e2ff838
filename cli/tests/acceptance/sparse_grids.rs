//! Sparse grids: what dense grids can do, and what only sparse ones can.

use std::collections::HashSet;

use sdf_formats::grid_file::{self, StoredGrid};
use serde_json::Value;

use crate::folder::{Folder, says};
use crate::meshes::Model;

const PRECISIONS: [&str; 3] = ["f32", "u16", "u8"];

fn number(json: &Value, key: &str) -> f64 {
    json[key].as_f64().unwrap_or_else(|| panic!("{key} of {json}"))
}

fn contacts(json: &Value) -> &Vec<Value> {
    json["contacts"].as_array().unwrap()
}

#[test]
fn every_precision_is_baked_described_and_verified() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([3.0, -2.0, 0.5], 1.0, 4).obj());
    let dense = folder.json("bake ball.obj --res 48 -o dense.sdf.h5");
    let mut sizes = vec![];
    for precision in PRECISIONS {
        let name = format!("{precision}.sdf.h5");
        let baked =
            folder.json(&format!("bake ball.obj --res 48 --layout sparse --band 2 --precision {precision} -o {name}"));
        assert_eq!([&baked["layout"], &baked["precision"]], ["sparse", precision]);
        assert_eq!(baked["counts"], dense["counts"]);
        assert_eq!(number(&baked, "band"), 2.0 * number(&baked, "spacing"));
        assert!(baked["stored_nodes"].as_u64().unwrap() < dense["stored_nodes"].as_u64().unwrap());
        assert!(number(&baked, "median_error_bound") < 0.5 * number(&dense, "error_bound"), "{baked}");
        let info = folder.json(&format!("info {name}"));
        for key in ["layout", "precision", "bricks", "band", "padding", "counts", "slope_bound", "error_bound"] {
            assert_eq!(info[key], baked[key], "{key}");
        }
        let parts = info["parts"].as_object().unwrap();
        let listed: u64 = parts.values().map(|bytes| bytes.as_u64().unwrap()).sum();
        let bytes = folder.read(&name).len() as u64;
        assert!(
            parts.contains_key("samples") && listed < bytes && bytes < listed + 40_000,
            "{listed} of {bytes}: {info}"
        );
        says(&folder.done(&format!("info {name}")), &["sparse", precision, "bricks", "samples"]);

        let verified = folder.json(&format!("verify {name} ball.obj --points 20000 --all-nodes"));
        assert_eq!((&verified["missing_cells"], &verified["beyond_their_brick"]), (&0.into(), &0.into()));
        assert!(number(&verified["points"], "max") <= number(&baked, "error_bound"), "{verified}");
        assert!(number(&verified["slope"], "steepest") <= number(&baked, "slope_bound"));
        assert!(number(&verified["far"], "falls_short") > 0.0 && verified["far"]["wrong_signs"] == 0);
        assert!(verified["bytes"]["samples"] == info["parts"]["samples"]);
        assert!(verified["points"]["voxels"].as_array().unwrap().len() == 4);
        sizes.push(bytes);
        if precision == "u16" {
            assert!(bytes as f64 <= 2.9 * number(&baked, "stored_cells"), "{bytes} bytes: {baked}");
        }
    }
    assert!(sizes[0] > sizes[1] && sizes[1] > sizes[2], "{sizes:?}");
}

/// docs/contacts.md says so of `error_bound`.
#[test]
fn the_error_of_a_contact_beyond_the_band_is_known_inside() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    folder.write("inner.obj", Model::ball([0.0; 3], 0.2, 1).obj());
    let spacing = number(&folder.json("bake ball.obj --res 48 --layout sparse"), "spacing");
    let found = folder.json("contacts inner.obj ball.sdf.h5 --elements vertices");
    assert!(contacts(&found).len() > 10);
    for contact in contacts(&found) {
        let in_voxels = number(contact, "error_bound") / spacing;
        assert!(contact["status"] == "beyond_band" && (in_voxels / 4.5 / 3_f64.sqrt() - 1.0).abs() < 1e-3, "{contact}");
    }
}

#[test]
fn contacts_within_the_band_are_those_of_the_dense_grid() {
    // Without projected gradient descent, whose steps depend on the grid's slope bound.
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    folder.write("sheet.obj", Model::hills(60).obj());
    folder.done("bake ball.obj --res 40 -o dense.sdf.h5");
    folder.done("bake ball.obj --res 40 --layout sparse --precision f32 --band 4 -o sparse.sdf.h5");
    for (elements, method) in [("faces", "fw"), ("edges", "gss"), ("vertices", "fw")] {
        let search = |name: &str| {
            folder.json(&format!("contacts sheet.obj {name} --elements {elements} --method {method} --margin 0.05"))
        };
        let [dense, sparse] = [search("dense.sdf.h5"), search("sparse.sdf.h5")];
        let found = |json: &Value| -> Vec<(u64, f64)> {
            contacts(json)
                .iter()
                .map(|contact| (contact["id"].as_u64().unwrap(), number(contact, "distance")))
                .collect()
        };
        let (dense, sparse) = (found(&dense), found(&sparse));
        assert!(dense.iter().filter(|(_, distance)| distance.abs() < 0.05).count() > 5, "{elements}");
        assert_eq!(dense.len(), sparse.len(), "{elements} by {method}");
        for (dense, sparse) in dense.into_iter().zip(sparse) {
            // Bricks are measured in f32 about their middles: to 1e-6 of the diagonal, √12.
            let is_near = sparse.1.abs() > 0.05 || (dense.1 - sparse.1).abs() <= 1e-6 * 12_f64.sqrt();
            assert!(dense.0 == sparse.0 && is_near, "{elements} by {method}: {dense:?} {sparse:?}");
        }
    }
}

/// A small mesh alone and beside a large one: its contacts do not depend on how much else is read.
#[test]
fn only_blocks_near_the_elements_are_read_and_nothing_else_changes() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    let patch = Model::hills(4).moved(|[x, y, z]| [0.08 * x + 0.95, 0.08 * y, 0.08 * z]);
    folder.write("patch.obj", patch.obj());
    folder.write("both.obj", patch.and(&Model::ball([0.0; 3], 1.0, 3)).obj());
    folder.write("far.obj", patch.moved(|[x, y, z]| [x + 90.0, y, z]).obj());
    // No face uses its last point.
    folder.write("unused.obj", patch.obj() + "v 1e15 0 0\n");
    for (layout, blocks, of_blocks) in [
        ("dense", "chunks", "of_chunks"),
        ("sparse --precision f32", "bricks", "of_bricks"),
        ("sparse --precision u16", "bricks", "of_bricks"),
        ("sparse --precision u8", "bricks", "of_bricks"),
    ] {
        folder.done(&format!("bake ball.obj --res 120 --layout {layout}"));
        let bytes = folder.read("ball.sdf.h5").len() as u64;
        for pose in ["", "--translate 0.01,0.02,-0.03 --rotate 0.1,0.2,0.3,2"] {
            let search = |mesh: &str| folder.json(&format!("contacts {mesh} ball.sdf.h5 --margin 0.02 {pose}"));
            let [alone, both, far, unused] = ["patch.obj", "both.obj", "far.obj", "unused.obj"].map(search);
            let read = |json: &Value, key: &str| {
                json["read"][key].as_u64().unwrap_or_else(|| panic!("{key}: {}", json["read"]))
            };
            assert_eq!(read(&alone, "file_bytes"), bytes);
            assert!(4 * read(&alone, blocks) < read(&alone, of_blocks), "{layout}: {}", alone["read"]);
            // Tables are read once, references to them more than once.
            assert!(
                read(&alone, "bytes") < read(&both, "bytes") && read(&both, "bytes") < bytes + 60_000,
                "{} {}",
                alone["read"],
                both["read"]
            );
            assert!(2 * read(&alone, "bytes") < bytes, "{layout}: {}", alone["read"]);
            assert_eq!(unused["read"], alone["read"], "{layout}");
            assert_eq!((read(&far, blocks), contacts(&far).len()), (0, 0), "{layout}: {}", far["read"]);
            let triangles = patch.triangles.len() as u64;
            let of_patch: Vec<&Value> =
                contacts(&both).iter().filter(|contact| contact["id"].as_u64().unwrap() < triangles).collect();
            assert!(of_patch.len() > 3, "{layout}: {} contacts", of_patch.len());
            assert_eq!(contacts(&alone).iter().collect::<Vec<_>>(), of_patch, "{layout} {pose}");
        }
        folder.write("points.csv", "0.99,0,0\n0.98,0.01,0\n");
        let json = folder.json("eval ball.sdf.h5 --points points.csv");
        let read = |key: &str| json["read"][key].as_u64().unwrap();
        assert!(0 < read(blocks) && 4 * read(blocks) < read(of_blocks), "{}", json["read"]);
    }
}

#[test]
fn a_margin_beyond_the_grids_range_is_refused_with_the_option_to_raise() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    folder.write("sheet.obj", Model::hills(10).obj());
    let spacing = number(&folder.json("bake ball.obj --res 20 --padding 2 -o dense.sdf.h5"), "spacing");
    folder.done("bake ball.obj --res 20 --padding 9 --layout sparse --band 5 -o sparse.sdf.h5");
    for (name, known, option) in [("dense", 2.0, "--padding"), ("sparse", 5.0, "--band")] {
        let margin = |voxels: f64| format!("contacts sheet.obj {name}.sdf.h5 --margin {}", voxels * spacing);
        folder.json(&margin(known));
        // Depths beyond the band are coarse.
        folder.json(&format!("{} {}", margin(-9.0), if name == "sparse" { "--complete" } else { "" }));
        let said = folder.refused(&margin(known + 0.5));
        says(&said, &[&format!("{name}.sdf.h5"), "--margin", &format!("{option} {}", known + 1.0)]);
        folder.done(&format!(
            "bake ball.obj --res 20 --padding 9 -o {name}.sdf.h5 --layout {name} {}",
            match name {
                "sparse" => "--band 6",
                _ => "",
            }
        ));
        folder.json(&margin(known + 0.5));
    }
}

#[test]
fn a_closed_form_that_names_a_sparse_grid_refuses_a_margin_below_its_band() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    folder.write("inner.obj", Model::ball([0.0; 3], 0.1, 1).obj());
    folder.done("bake ball.obj --res 20 --layout sparse --band 2 -o ball.sdf.h5");
    let placed = "[field]\nshape = 'grid'\nfile = 'ball.sdf.h5'\npose.translation = [0.0, 0.0, 0.0]\n";
    folder.write("named.sdf.toml", placed);
    folder.write("core.sdf.toml", "[field]\nshape = 'sphere'\nradius = 0.3\n");
    for command in ["contacts inner.obj", "compare inner.obj", "contacts core.sdf.toml"] {
        let said = folder.refused(&format!("{command} named.sdf.toml --margin -0.5"));
        says(&said, &["named.sdf.toml", "-0.5 is deeper", "wider band", "--complete"]);
    }
    let all = contacts(&folder.json("contacts inner.obj named.sdf.toml --margin -0.5 --complete")).len();
    assert_eq!(all, contacts(&folder.json("contacts inner.obj named.sdf.toml")).len());
    // Alone and without a pose it is the grid itself, with what is known of that.
    folder.write("alone.sdf.toml", "[field]\nshape = 'grid'\nfile = 'ball.sdf.h5'\n");
    assert_eq!(folder.json("info alone.sdf.toml")["error_bound"], folder.json("info ball.sdf.h5")["error_bound"]);
    says(
        &folder.refused("contacts inner.obj alone.sdf.toml --margin -0.5"),
        &["alone.sdf.toml", "bake it with --band 5"],
    );
}

#[test]
fn the_surface_of_a_sparse_grid_is_that_of_the_dense_one() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.5; 3], 1.0, 4).and(&Model::ball([4.0, 0.0, 0.0], 0.2, 2)).obj());
    folder.done("bake ball.obj --res 60 -o dense.sdf.h5");
    folder.done("bake ball.obj --res 60 --layout sparse --precision f32 -o sparse.sdf.h5");
    for level in ["0", "0.1", "-0.1"] {
        let surface = |name: &str| -> Vec<(bool, Vec<f64>)> {
            folder.done(&format!("surface {name}.sdf.h5 -o {name}.obj --level {level}"));
            let text = String::from_utf8(folder.read(&format!("{name}.obj"))).unwrap();
            let numbers = |line: &str| line.split_ascii_whitespace().skip(1).map(|x| x.parse().unwrap()).collect();
            text.lines()
                .filter(|line| !line.starts_with('#'))
                .map(|line| (line.starts_with('f'), numbers(line)))
                .collect()
        };
        let (dense, sparse) = (surface("dense"), surface("sparse"));
        assert!(dense.len() == sparse.len() && dense.len() > 1000, "level {level}");
        // Samples agree to 1e-6 of the diagonal. A vertex is a mean of zeros on edges of a cell, where φ has a slope of about 1.
        // Which diagonal cuts a square may depend on less.
        let same = |dense: &(bool, Vec<f64>), sparse: &(bool, Vec<f64>)| {
            dense.0 == sparse.0 && (dense.0 || dense.1.iter().zip(&sparse.1).all(|(a, b)| (a - b).abs() < 5e-5))
        };
        let different = dense.iter().zip(&sparse).find(|(dense, sparse)| !same(dense, sparse));
        assert!(different.is_none(), "level {level}: {different:?}");
    }
    let said = folder.refused("surface sparse.sdf.h5 -o out.obj --level 1");
    says(&said, &["sparse.sdf.h5", "--level 1", "--band"]);
}

fn is_green([red, green, blue]: &[u8; 3]) -> bool {
    green.saturating_sub(*red) > 40 && green.saturating_sub(*blue) > 30
}

#[test]
fn a_slice_outlines_bricks_and_the_band() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    folder.done("bake ball.obj --res 80 --layout sparse");
    folder.done("slice ball.sdf.h5 -o slice.png --pixels 400");
    let pixels = crate::pictures::pixels(&folder.read("slice.png"));
    let count = |is: fn(&[u8; 3]) -> bool| pixels.iter().filter(|pixel| is(pixel)).count();
    assert!(count(is_green) > 500, "the ends of the band are green");
    assert!(count(|p| *p == [0, 0, 0]) > 300, "the surface is black");
    assert!(count(|[r, g, b]| *r < 180 && r.abs_diff(*g) < 30 && g.abs_diff(*b) < 40) > 500, "bricks have grey edges");
    // A slice of a dense grid has neither bricks nor band.
    folder.done("bake ball.obj --res 80");
    folder.done("slice ball.sdf.h5 -o slice.png --pixels 400");
    let pixels = crate::pictures::pixels(&folder.read("slice.png"));
    assert_eq!(pixels.iter().filter(|pixel| is_green(pixel)).count(), 0);
}

#[test]
fn a_histogram_is_drawn_of_the_errors() {
    let folder = Folder::new();
    folder.write("ball <&>.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    let mut bake = folder.sdftool("bake --res 20 --layout sparse -o ball.sdf.h5");
    crate::folder::done(bake.arg("ball <&>.obj"), "bake");
    let mut verify = folder.sdftool("verify ball.sdf.h5 --points 3000 --histogram errors.svg");
    says(&crate::folder::done(verify.arg("ball <&>.obj"), "verify"), &["errors.svg"]);
    let svg = String::from_utf8(folder.read("errors.svg")).unwrap();
    says(&svg, &["<svg ", "in voxels", "certified", "ball &lt;&amp;&gt;.obj", "</svg>"]);
    // One bar for each height above zero.
    assert!(svg.matches("<rect x=").count() > 5);
}

/// Bricks of all shapes of neighbourhoods, also cut off by the box: counted from the bricks, and one by one.
#[test]
fn a_cell_is_stored_if_all_its_corners_are() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).moved(|[x, y, z]| [x, 0.7 * y, 0.4 * z]).obj());
    let baked = folder.json("bake ball.obj --res 75 --padding 1 --band 1 --layout sparse");
    let StoredGrid { grid, .. } = grid_file::read(&folder.at("ball.sdf.h5")).unwrap();
    let slots: HashSet<[u32; 3]> = grid.storage().slots().iter().copied().collect();
    let [nx, ny, nz] = grid.lattice().nodes();
    let is_stored = |node: [u32; 3]| slots.contains(&node.map(|along| along / 8));
    let count = |[nx, ny, nz]: [u32; 3], is_counted: &dyn Fn([u32; 3]) -> bool| {
        let all = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        all.filter(|node| is_counted(*node)).count() as u64
    };
    let corner = |[x, y, z]: [u32; 3], n: u32| [x + (n & 1), y + (n >> 1 & 1), z + (n >> 2)];
    let cells = count([nx - 1, ny - 1, nz - 1], &|cell| (0..8).all(|n| is_stored(corner(cell, n))));
    assert_eq!(baked["stored_nodes"], count([nx, ny, nz], &is_stored));
    assert!(cells > 0 && baked["stored_cells"] == cells, "{cells}, {baked}");
}

#[test]
fn an_error_bound_can_replace_the_resolution() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    let diagonal = 2.0 * 3.0_f64.sqrt();
    for (words, allowed) in [("0.02", 0.02), ("0.3%", 0.003 * diagonal), ("0.01 --band 2", 0.01)] {
        let json = folder.json(&format!("bake ball.obj --max-error {words}"));
        assert_eq!(json["layout"], "sparse");
        assert!(number(&json, "error_bound") <= allowed, "{words}: {json}");
        assert!(number(&json, "error_bound") > 0.2 * allowed, "{words}: finer than requested: {json}");
        let verified = folder.json("verify ball.sdf.h5 ball.obj --points 5000");
        assert!(number(&verified["points"], "max") <= allowed);
        says(&folder.done(&format!("bake ball.obj --max-error {words}")), &["picked", "voxel", "error  at most"]);
    }
    let finer = folder.json("bake ball.obj --max-error 0.005");
    let coarser = folder.json("bake ball.obj --max-error 0.05");
    assert!(number(&finer, "spacing") < number(&coarser, "spacing"));
    let said = folder.refused("bake ball.obj --max-error 1e-9");
    says(
        &said,
        &[
            "ball.obj",
            "--max-error 1e-9: an error of 1e-9 is below what",
            "with voxels of any size",
            "larger --max-error",
        ],
    );
    let mut open = Model::ball([0.0; 3], 1.0, 3);
    open.triangles.truncate(500);
    folder.write("open.obj", open.obj());
    says(&folder.refused("bake open.obj --max-error 0.01"), &["open.obj", "--max-error", "--res"]);
}

/// An error that is certain on any mesh is not the limit of this one.
#[test]
fn an_error_that_is_certain_in_the_memory_is_not_called_the_least() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    let limited = |error: f64| format!("bake ball.obj --max-error {error} --memory 1MB");
    let said = folder.refused(&limited(1e-3));
    says(
        &said,
        &["takes up to about ", "but 1000000 are allowed", "is certain with voxels of", "a smaller one may be reached"],
    );
    let certain: f64 = said.split("; one of ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    folder.done(&limited(certain));
    folder.done(&limited(0.5 * certain));
}

#[test]
fn conflicting_options_are_wrong_usage() {
    let folder = Folder::new();
    for (words, message) in [
        ("--res 8 --band 3", "--layout sparse"),
        ("--max-error 0.1 --layout dense", "--max-error"),
        ("--max-error 0.1 --precision u8", "--precision"),
        ("--max-error 0.1 --res 8", "--max-error"),
        ("--max-error 0", "more than 0"),
        ("--max-error -1%", "more than 0"),
        ("--max-error many%", "not a finite number"),
        ("--res 8 --layout sparse --band 0", "--band"),
        ("--res 8 --layout sparse --precision f16", "--precision"),
    ] {
        says(&folder.wrong_usage(&format!("bake ball.obj {words}")), &[message]);
    }
}
