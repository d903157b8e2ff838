//! Each key of what `--json` prints is explained in the documents.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::folder::Folder;
use crate::meshes::Model;

/// Names of all keys, also those of objects inside. Parts of a file are named in docs/format.md.
fn keys(value: &Value, names: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) => {
            for (name, value) in object {
                names.insert(name.clone());
                if name != "parts" && !(name == "bytes" && value.is_object()) {
                    keys(value, names);
                }
            }
        }
        Value::Array(list) => list.iter().for_each(|value| keys(value, names)),
        _ => (),
    }
}

/// The section about a schema: of docs/json.md, or of the page that it names.
fn section(schema: &str) -> &'static str {
    let pages = include_str!("../../../docs/json.md").split("\n## ");
    match schema {
        "sdftool.contacts/2" | "sdftool.overlap/1" => include_str!("../../../docs/contacts.md"),
        _ => pages
            .skip(1)
            .find(|section| section.lines().next().unwrap().contains(&format!("`{schema}`")))
            .unwrap_or_else(|| panic!("{schema} has no section")),
    }
}

#[test]
fn each_key_is_explained_in_the_section_of_its_schema() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 2).obj());
    folder.write("other.obj", Model::ball([0.0; 3], 0.9, 2).obj());
    folder.write("open.obj", Model::hills(6).obj());
    folder.write("sheet.obj", Model::hills(8).obj());
    folder.write("sphere.sdf.toml", "[field]\nshape = 'sphere'\nradius = 1\n");
    folder.write("points.csv", "0,0,0\n");
    let [mut seen, mut missing] = [BTreeSet::new(), BTreeSet::new()];
    for words in [
        "demo",
        "bake ball.obj --res 16 --keep-mesh",
        "bake open.obj --res 16",
        "bake open.obj --res 16 --layout sparse -o bricks.sdf.h5",
        "bake ball.obj --res 24 --layout sparse --memory 8MB -o sparse.sdf.h5",
        "bake ball.obj --res 24 --precision u8 -o codes.sdf.h5",
        "bake ball.obj other.obj no.obj --res 16 --resume --out-dir grids",
        "bake ball.obj --res 16 --layout sparse --shard 0/1 -o part.h5",
        "merge part.h5 -o whole.sdf.h5",
        "contacts sheet.obj ball.sdf.h5 --reduce 4",
        "contacts sheet.obj sparse.sdf.h5",
        "contacts sheet.obj codes.sdf.h5 --elements edges",
        "contacts sphere.sdf.toml sparse.sdf.h5 --translate 0.5,0,0",
        "compare sheet.obj ball.sdf.h5 --rounds 1",
        "eval sparse.sdf.h5 --points points.csv",
        "info ball.sdf.h5",
        "info open.sdf.h5",
        "info sparse.sdf.h5",
        "info sphere.sdf.toml",
        "verify ball.sdf.h5 ball.obj --points 1000",
        "verify sparse.sdf.h5 ball.obj --points 1000 --tight",
        "verify ball.sdf.h5 other.obj --points 1000",
        "slice ball.sdf.h5 -o slice.png",
        "surface ball.sdf.h5 -o surface.ply",
        "surface ball.sdf.h5 --level 0.24 -o open.ply",
        "view ball.sdf.h5 sheet.obj",
        "export ball.sdf.h5 --format nvdb",
        "export ball.sdf.h5 --format raw",
        "export sparse.sdf.h5 --format glb",
        "import ball.nvdb -o imported.sdf.h5",
        "info missing.sdf.h5",
    ] {
        let output = folder.sdftool(&format!("{words} --json")).output().unwrap();
        let printed = String::from_utf8(output.stdout).unwrap();
        assert!(!printed.is_empty(), "{words}: {}", String::from_utf8_lossy(&output.stderr));
        for line in printed.lines() {
            let object: Value = serde_json::from_str(line).unwrap();
            let schema = object["schema"].as_str().unwrap();
            assert!(
                words.contains("missing") || words.contains("no.obj") || schema != "sdftool.error/1",
                "{words}: {line}"
            );
            let mut names = BTreeSet::new();
            keys(&object, &mut names);
            names.remove("schema");
            let section = section(schema);
            let is_missing = |name: &String| !section.contains(&format!("`{name}`"));
            missing.extend(names.into_iter().filter(is_missing).map(|name| format!("{schema}: {name}: {words}")));
            seen.insert(schema.to_owned());
        }
    }
    assert_eq!(missing, BTreeSet::new());
    let document = include_str!("../../../docs/json.md");
    let sections = document.lines().filter(|line| line.starts_with("## "));
    let told: BTreeSet<String> =
        sections.flat_map(|line| line.split('`').skip(1).step_by(2)).map(str::to_owned).collect();
    let elsewhere = ["sdftool.contacts/2", "sdftool.overlap/1"].map(str::to_owned).into();
    assert_eq!(seen.difference(&elsewhere).cloned().collect::<BTreeSet<_>>(), told);
}
