//! `contacts --reduce`: few contacts of a rigid body in place of many.

use serde_json::Value;

use crate::folder::{Folder, says};

/// A plate of 2 · 12² faces, a little below the ground's surface.
fn scene() -> Folder {
    let folder = Folder::new();
    let mut plate = String::new();
    let at = |n: u32| f64::from(n) / 12.0;
    for (i, j) in (0..13).flat_map(|j| (0..13).map(move |i| (i, j))) {
        plate += &format!("v {} {} -0.001\n", at(i), at(j));
    }
    for (i, j) in (0..12).flat_map(|j| (0..12).map(move |i| (i, j))) {
        let a = j * 13 + i + 1;
        plate += &format!("f {a} {} {}\nf {a} {} {}\n", a + 1, a + 14, a + 14, a + 13);
    }
    folder.write("plate.obj", plate);
    folder.write("ground.sdf.toml", "[field]\nshape = \"half_space\"\nnormal = [0, 0, 1]\noffset = 0\n");
    folder
}

#[test]
fn few_contacts_hold_a_plate_and_the_rest_is_told() {
    let folder = scene();
    let query = "contacts plate.obj ground.sdf.toml --margin 0.01";
    let [all, few] = ["", " --reduce 16"].map(|reduce| folder.json(&format!("{query}{reduce}")));
    let contacts = |report: &Value| report["contacts"].as_array().unwrap().clone();
    assert_eq!((contacts(&all).len(), &all["reduced"]), (288, &Value::Null));
    assert!((4..=16).contains(&contacts(&few).len()), "{} are kept", contacts(&few).len());
    assert!(contacts(&few).iter().all(|kept| contacts(&all).contains(kept)), "a contact that was not found");
    assert_eq!(few["reduced"]["found"], 288);
    let [movement, shortfall] = ["movement", "shortfall"].map(|name| few["reduced"][name].as_f64().unwrap());
    // The margin and the depth.
    assert!((movement - 0.011).abs() < 1e-9 && shortfall < 0.1 * movement, "{shortfall} of {movement}");
    let told = folder.done(&format!("{query} --reduce 4 --movement 0.5 -o few.csv"));
    assert!(
        told.contains("reduced") && told.contains("to 4: where these are held") && told.contains("of 0.5"),
        "{told}"
    );
    assert_eq!(String::from_utf8(folder.read("few.csv")).unwrap().lines().count(), 5);
}

#[test]
fn a_reduction_without_sense_is_refused() {
    let folder = scene();
    let query = "contacts plate.obj ground.sdf.toml";
    for count in ["0", "65", "-1", "four"] {
        says(&folder.wrong_usage(&format!("{query} --reduce {count}")), &["--reduce", "1 to 64"]);
    }
    says(&folder.wrong_usage(&format!("{query} --movement 1")), &["--reduce"]);
    says(&folder.misused("contacts ground.sdf.toml ground.sdf.toml --reduce 4"), &["--reduce needs a mesh"]);
    // On the surface, and no margin: nothing says how far the body moves.
    let flat = String::from_utf8(folder.read("plate.obj")).unwrap().replace("-0.001", "0");
    folder.write("flat.obj", flat);
    let refused = folder.misused("contacts flat.obj ground.sdf.toml --reduce 4");
    says(&refused, &["--reduce", "--movement"]);
}
