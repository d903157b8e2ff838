//! Promises 7 and 10: results depend neither on the number of threads, nor on the order of elements, nor on other elements.

use serde_json::Value;

use crate::folder::Folder;
use crate::meshes::Model;

const THREADS: [u32; 4] = [1, 2, 3, 8];

fn contacts(folder: &Folder, words: &str) -> (u64, Vec<Value>) {
    let json = folder.json(&format!("contacts {words}"));
    (json["elements"].as_u64().unwrap(), json["contacts"].as_array().unwrap().clone())
}

#[test]
fn bake_writes_the_same_bytes_on_any_number_of_threads() {
    let folder = Folder::new();
    folder.write("closed.obj", Model::ball([0.1, 0.2, 0.3], 0.7, 3).obj());
    folder.write("open.obj", Model::hills(13).obj());
    for (mesh, options) in [
        ("closed", "--res 37"),
        ("open", "--res 37"),
        ("closed", "--res 60 --layout sparse --precision f32"),
        ("open", "--res 60 --layout sparse"),
        ("closed", "--max-error 0.01"),
    ] {
        let bake = |threads: u32| {
            folder.done(&format!("bake {mesh}.obj {options} --threads {threads}"));
            folder.read(&format!("{mesh}.sdf.h5"))
        };
        let on_one_thread = bake(1);
        assert!(THREADS.iter().all(|threads| bake(*threads) == on_one_thread), "{mesh} {options}");
    }
}

#[test]
fn contacts_are_the_same_on_any_number_of_threads() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 0.8, 3).obj());
    folder.write("sheet.obj", Model::hills(40).obj());
    folder.done("bake ball.obj --res 32");
    for elements in ["faces", "edges", "vertices"] {
        let find = |threads: u32| {
            let words = format!("sheet.obj ball.sdf.h5 --elements {elements} --margin 0.02 --threads {threads}");
            let files = ["list.csv", "list.ply", "list.h5"].map(|name| {
                folder.done(&format!("contacts {words} -o {name}"));
                folder.read(name)
            });
            (files, contacts(&folder, &words))
        };
        let on_one_thread = find(1);
        assert!(on_one_thread.1.1.len() > 100);
        assert!(THREADS.iter().all(|threads| find(*threads) == on_one_thread), "{elements}");
    }
}

/// The contact with the numbers of its elements and points raised.
fn renumbered(contact: &Value, elements: u64, points: u64) -> Value {
    let mut contact = contact.clone();
    let add = |value: &mut Value, offset: u64| *value = (value.as_u64().unwrap() + offset).into();
    add(&mut contact["id"], elements);
    add(&mut contact["key"], elements);
    let offset = if contact["feature"] == "face" { elements } else { points };
    contact["feature_id"].as_array_mut().unwrap().iter_mut().for_each(|id| add(id, offset));
    contact["vertices"].as_array_mut().unwrap().iter_mut().for_each(|vertex| add(vertex, points));
    if contact["polygon"].is_u64() {
        add(&mut contact["polygon"], elements);
    }
    contact
}

#[test]
fn contacts_of_two_meshes_in_one_file_are_those_of_either() {
    let folder = Folder::new();
    folder.write("body.obj", Model::ball([0.0; 3], 0.8, 3).obj());
    folder.done("bake body.obj --res 32 -o dense.sdf.h5");
    folder.done("bake body.obj --res 32 --layout sparse -o sparse.sdf.h5");
    let (sheet, ball) = (Model::hills(20), Model::ball([0.5, 0.4, 0.3], 0.4, 3));
    folder.write("a.obj", sheet.obj());
    folder.write("b.obj", ball.obj());
    folder.write("both.obj", sheet.and(&ball).obj());
    let grids = ["dense.sdf.h5", "sparse.sdf.h5"];
    for (elements, grid) in ["faces", "edges", "vertices"].into_iter().flat_map(|kind| grids.map(|grid| (kind, grid))) {
        let find = |mesh: &str| contacts(&folder, &format!("{mesh} {grid} --elements {elements}"));
        let ((count_a, mut expected), (count_b, of_b)) = (find("a.obj"), find("b.obj"));
        assert!(expected.len() > 20 && of_b.len() > 20);
        expected.extend(of_b.iter().map(|contact| renumbered(contact, count_a, sheet.points.len() as u64)));
        assert_eq!(find("both.obj"), (count_a + count_b, expected), "{elements}");
    }
}

#[test]
fn the_order_of_the_triangles_changes_no_contact() {
    let folder = Folder::new();
    folder.write("body.obj", Model::ball([0.0; 3], 0.8, 3).obj());
    folder.done("bake body.obj --res 32");
    let sheet = Model::hills(20);
    let mut reversed = sheet.clone();
    reversed.triangles.reverse();
    folder.write("a.obj", sheet.obj());
    folder.write("b.obj", reversed.obj());
    let last = sheet.triangles.len() as u64 - 1;
    let (_, forwards) = contacts(&folder, "a.obj body.sdf.h5");
    let (_, mut backwards) = contacts(&folder, "b.obj body.sdf.h5");
    backwards.reverse();
    for contact in &mut backwards {
        let [id, key] = ["id", "key"].map(|name| contact[name].as_u64().unwrap());
        contact["id"] = (last - id).into();
        contact["polygon"] = (last - id).into();
        contact["key"] = (key - id + (last - id)).into();
        if contact["feature"] == "face" {
            contact["feature_id"] = vec![last - id].into();
        }
    }
    assert_eq!(forwards, backwards);
}
