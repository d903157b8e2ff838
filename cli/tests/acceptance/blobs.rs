//! Blobs claim no more than the grid that they were exported from, and no command takes them for closed forms.

use crate::folder::{Folder, says};
use crate::meshes::Model;

/// A ball of radius 1 in a sparse grid, `ball.sdf.h5`, whose band of 3 cells is a small part of its padding.
fn scene() -> Folder {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    folder.write("away.obj", Model::ball([0.0, 0.0, 1.9], 0.2, 1).obj());
    folder.done("bake ball.obj --res 24 --layout sparse --padding 16");
    folder
}

#[test]
fn a_grid_sampled_again_has_distances_within_its_band_alone() {
    let folder = scene();
    folder.done("export ball.sdf.h5 --res 100 -o again.sdfb");
    let band = folder.json("info ball.sdf.h5")["band"].clone();
    assert_eq!(folder.json("info again.sdfb")["band"], band);
    for margin in ["0.8", "-0.8"] {
        for words in ["contacts away.obj", "compare away.obj"] {
            says(
                &folder.refused(&format!("{words} again.sdfb --margin {margin}")),
                &["again.sdfb: a margin of", "has distances"],
            );
        }
    }
    folder.done("contacts away.obj again.sdfb --margin 0.2");
    folder.done("export ball.sdf.h5 --res 100 -o again.raw");
    says(&String::from_utf8(folder.read("again.raw.json")).unwrap(), &[&format!("\"band\": {band}")]);
    // Cut to the grid's, which the report says.
    let json = folder.json("export ball.sdf.h5 --res 100 --band 50 -o again.nvdb");
    assert_eq!(json["band"], band);
    says(&folder.done("export ball.sdf.h5 --band 50 -o again.nvdb"), &["band  ", "3.000000 voxels"]);
    folder.write(
        "more.sdf.toml",
        "[field]\nshape = 'offset'\ndistance = 0.7\nof = { shape = 'grid', file = 'ball.sdf.h5' }\n",
    );
    for format in ["npy", "glb", "blob", "nvdb"] {
        says(
            &folder.refused(&format!("export more.sdf.toml --format {format}")),
            &["more.sdf.toml: its surface lies beyond"],
        );
    }
}
