//! The four kinds of contact file contain what is printed. (h5py reads the HDF5 in tests/readers.)

use sdf_formats::mesh;
use serde_json::Value;

use crate::folder::Folder;
use crate::meshes::Model;

fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("body.sdf.toml", "[field]\nshape = \"torus\"\nmajor_radius = 0.7\nminor_radius = 0.2\n");
    folder.write("sheet.obj", Model::hills(12).obj());
    folder.write("far.obj", "v 50 50 50\nv 51 50 50\nv 50 51 50\nf 1 2 3\n");
    folder
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn csv_contains_every_number_of_every_contact() {
    let folder = scene();
    for elements in ["faces", "edges", "vertices"] {
        let words = format!("contacts sheet.obj body.sdf.toml --elements {elements} -o list.csv");
        let contacts = folder.json(&words)["contacts"].as_array().unwrap().clone();
        let text = String::from_utf8(folder.read("list.csv")).unwrap();
        let mut lines = text.lines();
        let names: Vec<&str> = lines.next().unwrap().split(',').collect();
        assert_eq!(lines.clone().count(), contacts.len());
        assert!(contacts.len() > 20);
        for (line, contact) in lines.zip(&contacts) {
            let cells: Vec<&str> = line.split(',').collect();
            assert_eq!(cells.len(), names.len(), "{line}");
            let cell = |name: &str| cells[names.iter().position(|known| *known == name).unwrap()];
            let same = |name: &str, value: &Value| {
                assert_eq!(cell(name).parse::<f64>().ok(), value.as_f64(), "{name} of {line}")
            };
            for name in ["element", "feature", "status"] {
                assert_eq!(cell(name), contact[name].as_str().unwrap());
            }
            for name in ["id", "polygon", "distance", "lower_bound", "evaluations", "key"] {
                same(name, contact.get(name).unwrap_or(&Value::Null));
            }
            for (k, [name, surface, normal]) in
                [["x", "surface_x", "normal_x"], ["y", "surface_y", "normal_y"], ["z", "surface_z", "normal_z"]]
                    .into_iter()
                    .enumerate()
            {
                same(name, &contact["point"][k]);
                same(surface, &contact["surface_point"][k]);
                same(normal, &contact["normal"][k]);
                same(&format!("w{k}"), &contact["weights"][k]);
            }
            let ids: Vec<u64> = cell("feature_id").split(' ').map(|id| id.parse().unwrap()).collect();
            assert_eq!(
                ids,
                contact["feature_id"].as_array().unwrap().iter().map(|id| id.as_u64().unwrap()).collect::<Vec<_>>()
            );
        }
    }
}

#[test]
fn json_contains_what_is_printed() {
    let folder = scene();
    let mut printed = folder.json("contacts sheet.obj body.sdf.toml -o list.json");
    let mut kept: Value = serde_json::from_slice(&folder.read("list.json")).unwrap();
    for json in [&mut printed, &mut kept] {
        json["seconds"].take();
    }
    assert_eq!(kept, printed);
    assert!(kept["contacts"].as_array().unwrap().len() > 20);
}

#[test]
fn ply_is_a_cloud_of_the_points_of_contact() {
    let folder = scene();
    let json = folder.json("contacts sheet.obj body.sdf.toml -o list.PLY");
    let cloud = mesh::read(&folder.at("list.PLY")).unwrap();
    let points: Vec<Vec<f64>> = json["contacts"].as_array().unwrap().iter().map(|c| numbers(&c["point"])).collect();
    assert_eq!(cloud.points.iter().map(|point| point.to_vec()).collect::<Vec<_>>(), points);
    let bytes = folder.read("list.PLY");
    let header = String::from_utf8_lossy(&bytes).into_owned();
    assert!(["nx", "ny", "nz", "distance"].iter().all(|name| header.contains(&format!("property double {name}\n"))));
    // Seven doubles and the id.
    let [_, rows] = &bytes
        .windows(11)
        .position(|window| window == b"end_header\n")
        .map(|at| bytes.split_at(at + 11))
        .unwrap()
        .into();
    assert_eq!(rows.len(), points.len() * 60);
    let contact = &json["contacts"][3];
    let row = &rows[3 * 60..4 * 60];
    let number = |index: usize| f64::from_le_bytes(row[8 * index..][..8].try_into().unwrap());
    assert_eq!([number(3), number(4), number(5)].to_vec(), numbers(&contact["normal"]));
    assert_eq!(number(6), contact["distance"].as_f64().unwrap());
    assert_eq!(u64::from(u32::from_le_bytes(row[56..].try_into().unwrap())), contact["id"].as_u64().unwrap());
}

#[test]
fn no_contacts_make_an_empty_list_of_every_kind() {
    let folder = scene();
    for name in ["list.csv", "list.json", "list.ply", "list.h5"] {
        let json = folder.json(&format!("contacts far.obj body.sdf.toml -o {name}"));
        assert_eq!((&json["contacts"], &json["passed_cull"]), (&Value::Array(Vec::new()), &0.into()), "{name}");
        assert!(!folder.read(name).is_empty());
    }
    assert_eq!(String::from_utf8(folder.read("list.csv")).unwrap().lines().count(), 1);
    assert!(String::from_utf8_lossy(&folder.read("list.ply")).contains("element vertex 0\n"));
    assert!(folder.read("list.h5").starts_with(b"\x89HDF\r\n\x1a\n"));
}

#[test]
fn a_list_replaces_an_old_list_but_not_an_input() {
    let folder = scene();
    folder.write("list.csv", "old");
    folder.done("contacts sheet.obj body.sdf.toml -o list.csv");
    assert!(folder.read("list.csv").starts_with(b"element,id,"));
    folder.write("sheet.ply", Model::hills(12).ply());
    let line = folder.refused("contacts sheet.ply body.sdf.toml -o ./sheet.ply");
    crate::folder::says(&line, &["./sheet.ply", "would replace sheet.ply", "choose another name"]);
    // The kind of a mesh is known by its content, whatever its name.
    std::fs::copy(folder.at("sheet.obj"), folder.at("sheet.h5")).unwrap();
    crate::folder::says(&folder.refused("bake sheet.h5 --res 8 -o sheet.h5"), &["would replace sheet.h5"]);
    assert_eq!(folder.read("sheet.ply"), Model::hills(12).ply().into_bytes());
}
