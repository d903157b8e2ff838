//! Numbering of elements.

use serde_json::{Value, json};

use crate::folder::{Folder, says};

/// A ball that contains all meshes here.
const ALL: &str = "[field]\nshape = \"sphere\"\nradius = 100.0\n";

/// Two squares side by side as polygons, and two line elements of three segments, one along an edge of the squares.
const SQUARES: &str = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 5 5 5\n\
                       l 1 7\nf 1 2 5 4\nl 2 3 7\nf 2 3 6 5\n";

fn contacts(words: &str) -> (Value, Vec<Value>) {
    let folder = Folder::new();
    folder.write("all.sdf.toml", ALL);
    folder.write("squares.obj", SQUARES);
    let json = folder.json(&format!("contacts squares.obj all.sdf.toml {words}"));
    (json["elements"].clone(), json["contacts"].as_array().unwrap().clone())
}

#[test]
fn faces_count_triangles_and_name_their_polygon() {
    let (elements, contacts) = contacts("--elements faces");
    assert_eq!(elements, 4);
    let named: Vec<[&Value; 3]> = contacts.iter().map(|c| [&c["element"], &c["id"], &c["polygon"]]).collect();
    let face = |id: u32, polygon: u32| [json!("face"), json!(id), json!(polygon)];
    let wanted = [face(0, 0), face(1, 0), face(2, 1), face(3, 1)];
    assert_eq!(named, wanted.iter().map(|w| w.each_ref()).collect::<Vec<_>>());
}

#[test]
fn edges_count_each_edge_of_the_triangles_once_and_then_the_line_elements() {
    let (elements, contacts) = contacts("--elements edges");
    // Nine edges of triangles, diagonals included, then 1-7, 2-3 and 3-7.
    assert_eq!((elements, contacts.len()), (json!(12), 12));
    assert!(contacts.iter().enumerate().all(|(id, contact)| contact["id"] == id && contact["element"] == "edge"));
    assert!(contacts.iter().all(|contact| contact.get("polygon").is_none()));
    // The deepest point of each edge, nearest to the middle of the field, identifies it.
    let point = |id: usize| contacts[id]["point"].clone();
    assert_eq!(point(0), json!([0.0, 0.0, 0.0]));
    assert_eq!((point(1), point(5)), (json!([1.0, 0.0, 0.0]), json!([1.0, 0.0, 0.0])));
    assert_eq!(contacts[1]["feature_id"], json!([1]));
    assert_eq!((contacts[9]["feature_id"].clone(), point(9)), (json!([0]), json!([0.0, 0.0, 0.0])));
    assert_eq!((contacts[10]["feature_id"].clone(), contacts[11]["feature_id"].clone()), (json!([1]), json!([2])));
    assert!(contacts.iter().all(|contact| contact["weights"].as_array().unwrap().len() == 2));
}

#[test]
fn vertices_count_points() {
    let (elements, contacts) = contacts("--elements vertices");
    assert_eq!((elements, contacts.len()), (json!(7), 7));
    for (id, contact) in contacts.iter().enumerate() {
        assert_eq!((&contact["element"], &contact["feature"]), (&json!("vertex"), &json!("vertex")));
        assert_eq!(
            (&contact["id"], &contact["feature_id"], &contact["weights"]),
            (&json!(id), &json!([id]), &json!([1.0]))
        );
    }
    assert_eq!(contacts[6]["point"], json!([5.0, 5.0, 5.0]));
}

#[test]
fn a_mesh_of_points_and_lines_has_no_faces_but_edges_and_vertices() {
    let folder = Folder::new();
    folder.write("all.sdf.toml", ALL);
    folder.write("rope.obj", "v 0 0 0\nv 1 0 0\nv 2 0 1\nl 1 2 3\n");
    says(
        &folder.refused("contacts rope.obj all.sdf.toml"),
        &["rope.obj", "no triangles", "--elements vertices or edges"],
    );
    assert_eq!(folder.json("contacts rope.obj all.sdf.toml --elements edges")["elements"], 2);
    assert_eq!(folder.json("contacts rope.obj all.sdf.toml --elements vertices")["elements"], 3);
}
