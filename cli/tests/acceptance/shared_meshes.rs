//! Whole runs on scanned meshes, if they are available beside the project, in shared/meshes.

use std::path::PathBuf;

use crate::folder::Folder;

fn mesh(name: &str) -> Option<String> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/meshes").join(name);
    if !path.is_file() {
        println!("skipped: no {name} in ../shared/meshes");
        return None;
    }
    Some(path.canonicalize().unwrap().display().to_string())
}

#[test]
fn a_cloth_on_a_dragon_touches_it() {
    let (Some(dragon), Some(cloth)) = (mesh("dragon.obj"), mesh("cloth.obj")) else { return };
    let folder = Folder::new();
    folder.done(&format!("bake {dragon} --res 64"));
    let json = folder.json(&format!("contacts {cloth} dragon.sdf.h5 --margin 0.01 -o list.csv"));
    assert_eq!(json["elements"], 39402);
    let contacts = json["contacts"].as_array().unwrap();
    assert!(contacts.len() > 1000, "{}", contacts.len());
    assert!(contacts.iter().all(|contact| contact["distance"].as_f64().unwrap() <= 0.01));
    let deepest = contacts.iter().map(|contact| contact["distance"].as_f64().unwrap()).fold(0.0, f64::min);
    assert!((-0.03..-0.003).contains(&deepest), "the cloth is 0.004 deep: {deepest}");
    folder.done(&format!("verify dragon.sdf.h5 {dragon} --points 5000"));
}

#[test]
fn meshes_with_and_without_holes_are_baked_right() {
    for name in ["teapot", "stanford-bunny", "cow"] {
        let Some(path) = mesh(&format!("{name}.obj")) else { continue };
        let folder = Folder::new();
        let json = folder.json(&format!("bake {path} --res 64"));
        println!("{name}: {}", json["sign_verdict"]);
        let json = folder.json(&format!("verify {name}.sdf.h5 {path} --points 5000"));
        assert_eq!((&json["faults"], &json["points"]["wrong_signs"]), (&serde_json::json!([]), &0.into()));
    }
}
