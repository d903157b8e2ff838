//! Files that `gpu --export` writes for other programs.

use serde_json::Value;

use crate::program::{Folder, GPU};

/// The numbers of a file without a header.
fn words(folder: &Folder, name: &str) -> Vec<u32> {
    let bytes = std::fs::read(folder.path(name)).unwrap();
    bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

fn numbers(folder: &Folder, name: &str) -> Vec<f64> {
    words(folder, name).iter().map(|word| f64::from(f32::from_bits(*word))).collect()
}

fn triple(about: &Value, key: &str) -> [f64; 3] {
    serde_json::from_value(about[key].clone()).unwrap()
}

#[test]
fn exported_samples_interpolate_to_the_distances_of_the_exported_contacts() {
    let folder = Folder::new(GPU);
    assert_eq!(folder.done("--export scenes --cells 24 --only Teapot"), "Teapot: written\n");
    let about: Value = serde_json::from_str(&folder.read("scenes/Teapot/scene.json")).unwrap();
    let (origin, nodes) = (triple(&about, "origin"), triple(&about, "nodes").map(|count| count as usize));
    let (spacing, margin) = (about["spacing"].as_f64().unwrap(), about["margin"].as_f64().unwrap());
    let samples = numbers(&folder, "scenes/Teapot/samples.f32");
    assert_eq!(samples.len(), nodes.iter().product::<usize>());
    let interpolated = |point: [f64; 3]| -> f64 {
        let local: [f64; 3] = std::array::from_fn(|axis| (point[axis] - origin[axis]) / spacing);
        let corner = |index: usize| -> f64 {
            let mut weight = 1.0;
            let at: [usize; 3] = std::array::from_fn(|axis| {
                let (cell, is_upper) = (local[axis].floor(), index >> axis & 1);
                weight *= if is_upper == 1 { local[axis] - cell } else { cell + 1.0 - local[axis] };
                cell as usize + is_upper
            });
            weight * samples[(at[2] * nodes[1] + at[1]) * nodes[0] + at[0]]
        };
        (0..8).map(corner).sum()
    };
    let elements = [("points", "points.f32"), ("frank_wolfe", "elements.u32")];
    for (method, elements) in elements {
        let count = words(&folder, &format!("scenes/Teapot/{elements}")).len() / 3;
        let name = format!("scenes/Teapot/{method}.contacts");
        let (ids, found) = (words(&folder, &name), numbers(&folder, &name));
        assert!(found.len() > 8 * 100, "{method}: {} contacts", found.len() / 8);
        for (id, [_, distance, x, y, z, normal @ ..]) in ids.iter().step_by(8).zip(found.as_chunks::<8>().0) {
            assert!((*id as usize) < count && *distance <= margin, "{method}: element {id}");
            assert!((interpolated([*x, *y, *z]) - distance).abs() < 1e-5, "{method}: element {id}");
            assert!((normal.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-5, "{method}: element {id}");
        }
    }
}

#[test]
fn a_scene_of_closed_forms_has_nothing_to_export() {
    let folder = Folder::new(GPU);
    let said = folder.done("--export scenes --only Analytic");
    assert!(said.starts_with("Analytic: skipped") && !folder.path("scenes/Analytic").exists(), "{said}");
}
