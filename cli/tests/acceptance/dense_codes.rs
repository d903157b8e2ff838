//! Dense grids of u16 and u8: smaller files that do what those of f32 do, each with a certified error.

use serde_json::Value;

use crate::folder::{Folder, says};
use crate::meshes::Model;

fn number(json: &Value, key: &str) -> f64 {
    json[key].as_f64().unwrap_or_else(|| panic!("{key} of {json}"))
}

/// Identifiers and distances of contacts.
fn contacts(json: &Value) -> Vec<(u64, f64)> {
    let found = json["contacts"].as_array().unwrap().iter();
    found.map(|contact| (contact["id"].as_u64().unwrap(), number(contact, "distance"))).collect()
}

#[test]
fn every_precision_of_a_dense_grid_is_baked_described_verified_and_queried() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([3.0, -2.0, 0.5], 1.0, 4).obj());
    folder.write("tetrahedron.obj", Model::ball([3.0, -2.0, 0.5], 0.9, 1).obj());
    let plain = folder.json("bake ball.obj --res 48 -o f32.sdf.h5");
    assert_eq!(folder.json("bake ball.obj --res 48 --precision f32 -o same.sdf.h5")["precision"], "f32");
    assert_eq!(folder.read("same.sdf.h5"), folder.read("f32.sdf.h5"));
    let contacts_with = |name: &str| contacts(&folder.json(&format!("contacts tetrahedron.obj {name} --margin 0.02")));
    let expected = contacts_with("f32.sdf.h5");
    assert!(expected.len() > 20);
    let mut sizes = vec![folder.read("f32.sdf.h5").len()];
    for precision in ["u16", "u8"] {
        let name = format!("{precision}.sdf.h5");
        let baked = folder.json(&format!("bake ball.obj --res 48 --precision {precision} -o {name}"));
        assert_eq!([&baked["layout"], &baked["precision"]], ["dense", precision]);
        for key in ["counts", "stored_nodes", "stored_cells", "bricks", "band", "sign_method"] {
            assert_eq!(baked[key], plain[key], "{key}");
        }
        let growth = number(&baked, "error_bound") - number(&plain, "error_bound");
        assert!(growth > 0.0 && growth < 0.025 * number(&plain, "spacing"), "{growth}");
        let info = folder.json(&format!("info {name}"));
        for key in ["layout", "precision", "bricks", "band", "padding", "counts", "slope_bound", "error_bound"] {
            assert_eq!(info[key], baked[key], "{key}");
        }
        assert_eq!(info["options"], format!("--res 48 --padding 4 --sign auto --precision {precision}"));
        says(&folder.done(&format!("info {name}")), &["dense", precision, "samples"]);

        let verified = folder.json(&format!("verify {name} ball.obj --points 20000 --all-nodes"));
        assert!(number(&verified["points"], "max") <= number(&baked, "error_bound"), "{verified}");
        assert!(number(&verified["slope"], "steepest") <= number(&baked, "slope_bound"));

        let found = contacts_with(&name);
        let is_near = |(a, b): (&(u64, f64), &(u64, f64))| a.0 == b.0 && (a.1 - b.1).abs() <= growth;
        assert!(found.len() == expected.len() && found.iter().zip(&expected).all(is_near), "{precision}");
        folder.done(&format!("slice {name} -o {precision}.png"));
        // Exported and imported samples are those of the grid; a blob is the grid itself.
        folder.done(&format!("export {name} --format blob -o {precision}.sdfb"));
        assert_eq!(contacts_with(&format!("{precision}.sdfb")), found);
        let blob = folder.json(&format!("info {precision}.sdfb"));
        assert_eq!([&blob["layout"], &blob["precision"]], ["dense", precision]);
        folder.done(&format!("export {name} --format npy -o {precision}.npy"));
        let spacing = number(&baked, "spacing");
        let origin: Vec<String> =
            baked["origin"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap().to_string()).collect();
        let place = format!("--spacing {spacing} --origin {}", origin.join(","));
        folder.done(&format!("import {precision}.npy {place} -o again.sdf.h5"));
        assert_eq!(contacts_with("again.sdf.h5"), found);
        sizes.push(folder.read(&name).len());
    }
    assert!(sizes[0] > 2 * sizes[1] && sizes[1] > sizes[2], "{sizes:?}");
}

#[test]
fn a_dense_grid_of_codes_has_the_same_bytes_on_any_number_of_threads() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    let bake = |threads: u32| {
        folder.done(&format!("bake ball.obj --res 40 --precision u16 --threads {threads} -o {threads}.sdf.h5"));
        folder.read(&format!("{threads}.sdf.h5"))
    };
    let alone = bake(1);
    assert!(bake(2) == alone && bake(5) == alone);
}

/// Blocks that no element is near are not read.
#[test]
fn contacts_read_only_the_blocks_that_they_need() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    folder.write("patch.obj", Model::ball([1.0, 0.0, 0.0], 0.05, 1).obj());
    folder.done("bake ball.obj --res 96 --precision u8");
    let found = folder.json("contacts patch.obj ball.sdf.h5");
    let whole = folder.read("ball.sdf.h5").len() as f64;
    assert!(!contacts(&found).is_empty() && number(&found["read"], "bytes") < 0.3 * whole, "{found}");
}
