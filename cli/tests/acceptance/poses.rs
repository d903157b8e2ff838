//! --rotate and --translate place the field in the world.

use serde_json::Value;

use crate::folder::Folder;
use crate::meshes::Model;

/// Rotates a vector by the unit quaternion of x, y, z, w: v + 2w (u × v) + 2 u × (u × v).
fn rotate([x, y, z, w]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let u = [x, y, z];
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let once = cross(u, v);
    let twice = cross(u, once);
    std::array::from_fn(|k| v[k] + 2.0 * (w * once[k] + twice[k]))
}

fn numbers(value: &Value) -> [f64; 3] {
    std::array::from_fn(|k| value[k].as_f64().unwrap())
}

#[test]
fn a_placed_field_touches_what_the_unplaced_field_touches_of_the_mesh_moved_back() {
    let folder = Folder::new();
    let [x, y, z, w] = [0.1, -0.5, 0.3, 0.8_f64];
    let length = (x * x + y * y + z * z + w * w).sqrt();
    let unit = [x, y, z, w].map(|q| q / length);
    let shift = [0.3, -0.2, 0.15];
    let sheet = Model::hills(24);
    let back = [-unit[0], -unit[1], -unit[2], unit[3]];
    let moved_back = sheet.moved(|p| rotate(back, std::array::from_fn(|k| p[k] - shift[k])));
    folder.write("sheet.obj", sheet.obj());
    folder.write("back.obj", moved_back.obj());
    let mut body = Model::ball([0.0; 3], 0.5, 3);
    body.points.iter_mut().for_each(|p| p[0] *= 1.7);
    folder.write("body.obj", body.obj());
    folder.done("bake body.obj --res 40");
    folder.write("cone.sdf.toml", "[field]\nshape = \"cone\"\nhalf_angle_deg = 35\nheight = 1.2\n");
    for field in ["body.sdf.h5", "cone.sdf.toml"] {
        for elements in ["faces", "edges", "vertices"] {
            let find = |mesh: &str, pose: &str| {
                // A certified minimum is often on the face of a cell, where the gradient jumps and rounding decides its side.
                let method = if elements == "edges" { "gss" } else { "fw" };
                let words =
                    format!("contacts {mesh} {field} --elements {elements} --method {method} --margin 0.05 {pose}");
                folder.json(&words)["contacts"].as_array().unwrap().clone()
            };
            // The quaternion is not normalized.
            let placed = find("sheet.obj", "--rotate 0.1,-0.5,0.3,0.8 --translate 0.3,-0.2,0.15");
            let in_place = find("back.obj", "");
            assert!(placed.len() > 50, "{field} {elements}");
            assert_eq!(placed.len(), in_place.len(), "{field} {elements}");
            for (placed, in_place) in placed.iter().zip(&in_place) {
                assert_eq!(placed["id"], in_place["id"]);
                let [a, b] = [placed, in_place].map(|contact| contact["distance"].as_f64().unwrap());
                assert!((a - b).abs() < 1e-9, "{field} {elements} {}: {a} {b}", placed["id"]);
                if placed["status"] != "converged" {
                    continue;
                }
                let into_world = |p: [f64; 3]| rotate(unit, p);
                let normal = into_world(numbers(&in_place["normal"]));
                let surface = into_world(numbers(&in_place["surface_point"]));
                for k in 0..3 {
                    assert!((numbers(&placed["normal"])[k] - normal[k]).abs() < 1e-6);
                    assert!((numbers(&placed["surface_point"])[k] - surface[k] - shift[k]).abs() < 1e-6);
                }
            }
        }
    }
}

#[test]
fn a_quarter_turn_is_counterclockwise() {
    let folder = Folder::new();
    folder.write(
        "box.sdf.toml",
        "[field]\nshape = \"box\"\nhalf_extents = [2, 0.5, 0.5]\npose.translation = [2, 0, 0]\n",
    );
    folder.write("points.obj", "v 0 3 0\nv 3 0 0\nv 0 -3 0\nv 10 3 0\n");
    // A quarter turn about z maps x to y.
    let touched = |pose: &str| {
        let json = folder.json(&format!("contacts points.obj box.sdf.toml --elements vertices {pose}"));
        json["contacts"].as_array().unwrap().iter().map(|contact| contact["id"].as_u64().unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(touched(""), [1]);
    assert_eq!(touched("--rotate 0,0,1,1"), [0]);
    assert_eq!(touched("--rotate 0,0,-1,1"), [2]);
    // Rotation comes before translation.
    assert_eq!(touched("--rotate 0,0,1,1 --translate 10,0,0"), [3]);
    assert_eq!(touched("--translate -3,-3,0 --rotate 0,0,0,-1"), [2]);
    assert_eq!(touched("--translate -3,3,0"), [0]);
}
