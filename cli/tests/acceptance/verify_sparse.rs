//! `verify` of sparse grids: what it finds, and what it takes for true.

use sdf_core::grid::BlockBounds;
use sdf_core::grid::owned::{ErrorRegions, OwnedBricks, OwnedStorage};
use sdf_core::nalgebra::Vector3;
use sdf_formats::grid_file::{
    self, About, Samples, Source, SparseInfo, SparseSamples, StoredGrid, StoredMesh, WriteOptions,
};

use crate::folder::{Folder, says};
use crate::meshes::Model;

const PRECISIONS: [&str; 3] = ["f32", "u16", "u8"];

/// The reasons why `verify` refuses.
fn mismatch(folder: &Folder, words: &str) -> String {
    let output = folder.sdftool(words).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{words}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn verify_refuses_another_mesh_than_the_baked_one() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    folder.write("larger.obj", Model::ball([0.0; 3], 1.02, 3).obj());
    folder.done("bake ball.obj --res 32 --layout sparse");
    says(
        &folder.done("verify ball.sdf.h5 ball.obj --points 2000"),
        &["the very file", "0 missing", "certified", "bytes"],
    );
    let said = mismatch(&folder, "verify ball.sdf.h5 larger.obj --points 2000");
    says(&said, &["ball.sdf.h5 does not match larger.obj", "a node is wrong by"]);
}

/// All that is wrong lies beyond the band around the mesh.
#[test]
fn verify_refuses_surfaces_that_the_mesh_lacks() {
    let folder = Folder::new();
    let ball = Model::ball([0.0; 3], 1.0, 3);
    folder.write("ball.obj", ball.obj());
    let mut cavity = Model::ball([0.1, 0.2, 0.05], 0.05, 2);
    cavity.triangles.iter_mut().for_each(|corners| corners.swap(0, 1));
    let sheet = Model::hills(4).moved(|[x, y, z]| [0.5 * x, 0.5 * y, 1.7 + 0.1 * z]);
    let inner = Model::ball([0.0; 3], 0.3, 2);
    let others = [
        (cavity, "", vec!["nodes beyond the band have the wrong sign", "a point deep inside is wrong by"]),
        (sheet, "", vec!["a node beyond the band is wrong by"]),
        (inner, "--inner-faces keep", vec!["a node beyond the band is wrong by", "a point deep inside is wrong by"]),
    ];
    for (other, option, reasons) in others {
        folder.write("both.obj", ball.and(&other).obj());
        for words in ["--precision f32", "--precision u16 --band 1", "--precision u8 --band 6"] {
            folder.done(&format!("bake both.obj --res 64 --layout sparse {words} {option}"));
            folder.done("verify both.sdf.h5 both.obj --points 5000 --all-nodes");
            says(&mismatch(&folder, "verify both.sdf.h5 ball.obj --points 5000 --all-nodes"), &reasons);
        }
    }
}

/// Writes `wrong.sdf.h5`: a sparse grid in f32 with other samples of its coarse grid.
fn write_with_coarse(folder: &Folder, grid: &str, coarse: &[f32]) {
    let StoredGrid { grid, sparse, about, .. } = grid_file::read(&folder.at(grid)).unwrap();
    let OwnedStorage::SparseF32(storage) = grid.storage() else { panic!("a sparse grid") };
    let bricks = storage.bricks();
    let samples = SparseSamples {
        band: sparse.unwrap().band,
        deep_values: sparse.unwrap().deep_values,
        slots: &bricks.slots,
        scales: &bricks.scales,
        samples: &bricks.samples,
        bounds: &bricks.bounds,
        errors: &bricks.errors,
        coarse,
    };
    grid_file::write(&folder.at("wrong.sdf.h5"), grid.lattice(), samples, &about).unwrap();
}

/// One node of the coarse grid is more than its distance, another is much less inside than the file states.
#[test]
fn verify_refuses_a_single_wrong_node_of_the_coarse_grid() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    folder.done("bake ball.obj --res 128 --padding 40 --layout sparse --precision f32 --band 1");
    let words = "verify wrong.sdf.h5 ball.obj --points 5000 --all-nodes";
    let StoredGrid { grid, .. } = grid_file::read(&folder.at("ball.sdf.h5")).unwrap();
    let OwnedStorage::SparseF32(storage) = grid.storage() else { panic!("a sparse grid") };
    let coarse = storage.bricks().coarse.to_vec();
    let write = |coarse: &[f32]| write_with_coarse(&folder, "ball.sdf.h5", coarse);
    write(&coarse);
    folder.done(words);
    let deepest = (0..coarse.len()).min_by(|a, b| coarse[*a].total_cmp(&coarse[*b])).unwrap();
    let spacing = grid.lattice().spacing() as f32;
    let distance_of_first = Vector3::from(grid.lattice().node([0; 3])).norm() as f32 - 1.0;
    let changes = [
        (0, distance_of_first + 2.0 * spacing, "a node beyond the band is wrong by"),
        (deepest, coarse[deepest] + 12.0 * spacing, "a point deep inside is wrong by"),
        (deepest, coarse[deepest] - 12.0 * spacing, "a point deep inside is wrong by"),
    ];
    for (node, wrong, reason) in changes {
        let mut coarse = coarse.clone();
        coarse[node] = wrong;
        write(&coarse);
        says(&mismatch(&folder, words), &[reason]);
    }
}

#[test]
fn one_wrong_sign_is_singular_and_two_are_not() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    folder.done("bake ball.obj --res 16");
    let StoredGrid { grid, about, .. } = grid_file::read(&folder.at("ball.sdf.h5")).unwrap();
    let OwnedStorage::Dense(storage) = grid.storage() else { panic!("a dense grid") };
    let mut distances = storage.storage().samples().to_vec();
    for reason in ["1 node has the wrong sign", "2 nodes have the wrong sign"] {
        let deepest = (0..distances.len()).min_by(|a, b| distances[*a].total_cmp(&distances[*b])).unwrap();
        distances[deepest] *= -1.0;
        let samples = Samples::Dense { distances: &distances, bounds: storage.bounds() };
        grid_file::write(&folder.at("wrong.sdf.h5"), grid.lattice(), samples, &about).unwrap();
        says(&mismatch(&folder, "verify wrong.sdf.h5 ball.obj --points 10 --all-nodes"), &[reason]);
    }
}

/// Exact contacts are measured by the mesh that the grid keeps, `info` repeats what the file states.
#[test]
fn verify_refuses_a_kept_mesh_and_facts_that_are_not_those_of_the_mesh() {
    let folder = Folder::new();
    let mut open = Model::ball([0.0; 3], 1.0, 3);
    open.triangles.retain(|corners| !corners.contains(&0));
    folder.write("open.obj", open.obj());
    folder.write("again.obj", format!("# The same mesh in another file.\n{}", open.obj()));
    folder.done("bake open.obj --res 24 --keep-mesh");
    let StoredGrid { grid, about, mesh, .. } = grid_file::read(&folder.at("open.sdf.h5")).unwrap();
    let (mesh, regions) = (mesh.unwrap(), about.error_regions.clone().unwrap());
    let OwnedStorage::Dense(storage) = grid.storage() else { panic!("a dense grid") };
    let write = |about: &About, mesh: &StoredMesh| {
        let samples = Samples::Dense { distances: storage.storage().samples(), bounds: storage.bounds() };
        let options = WriteOptions { mesh: Some(mesh), ..WriteOptions::default() };
        grid_file::write_with(&folder.at("wrong.sdf.h5"), grid.lattice(), samples, about, options).unwrap();
    };
    let words = |mesh: &str| format!("verify wrong.sdf.h5 {mesh} --points 20000");
    write(&about, &mesh);
    folder.done(&words("open.obj"));
    folder.done(&words("again.obj"));
    let mut moved = mesh.clone();
    moved.vertices[7][1] += 1e-9;
    write(&about, &moved);
    says(&mismatch(&folder, &words("open.obj")), &["the kept mesh is not the one that was baked"]);
    folder.done(&words("again.obj"));
    moved.vertices.iter_mut().for_each(|vertex| vertex[0] *= 0.5);
    write(&about, &moved);
    says(&mismatch(&folder, &words("again.obj")), &["the kept mesh is another by 0."]);
    write(&about, &StoredMesh { is_sign_continuous: true, ..mesh.clone() });
    says(&mismatch(&folder, &words("open.obj")), &["the kept mesh counts as closed, and is not"]);

    let source = Source { triangles: 7, ..about.source.clone() };
    write(&About { source, ..about.clone() }, &mesh);
    says(
        &mismatch(&folder, &words("open.obj")),
        &[&format!("the file states 7 triangles of {}", open.triangles.len())],
    );
    let small = ErrorRegions { error_bound: 1e-3 * regions.error_bound, ..regions };
    write(&About { error_regions: Some(small), ..about.clone() }, &mesh);
    says(&mismatch(&folder, &words("open.obj")), &["wrong by more than the file states of where the error is large"]);
}

/// The step of samples in f32 is written as 1, but nothing is rounded to it. Signs count in any unit.
#[test]
fn verify_compares_nodes_to_their_rounding_in_any_precision_and_unit() {
    let folder = Folder::new();
    for unit in [1e-3, 1.0, 100.0] {
        let ball = Model::ball([0.0; 3], unit, 3);
        let mut dented = ball.clone();
        dented.points[100] = dented.points[100].map(|x| 1.001 * x);
        folder.write("ball.obj", ball.obj());
        folder.write("dented.obj", dented.obj());
        for precision in PRECISIONS {
            folder.done(&format!("bake ball.obj --res 48 --layout sparse --precision {precision}"));
            folder.done("verify ball.sdf.h5 ball.obj --points 500 --all-nodes");
            let other = "verify ball.sdf.h5 dented.obj --points 500 --all-nodes";
            // Half a step of u8 is more than the dent.
            if precision != "u8" {
                says(&mismatch(&folder, other), &["a node is wrong by"]);
            }
        }
    }
}

/// Nodes in the plane of the missing side have the winding number 1/2: the order of the triangles decides their side.
#[test]
fn verify_takes_nodes_for_either_side_where_rounding_decides() {
    let folder = Folder::new();
    let mut open = Model::cube();
    open.triangles.truncate(10);
    folder.write("open.obj", open.obj());
    let mut verify = |order: usize| {
        open.triangles.rotate_left(order);
        open.triangles.iter_mut().for_each(|corners| corners.rotate_left(1));
        folder.write("again.obj", open.obj());
        folder.done("verify open.sdf.h5 again.obj --points 2000 --all-nodes");
    };
    for words in ["--res 8", "--res 16 --precision f32", "--res 20 --band 6", "--res 16 --band 40 --precision u8"] {
        folder.done(&format!("bake open.obj --layout sparse {words}"));
        (1..9).for_each(&mut verify);
    }
}

/// Rounding of bricks is relative to a brick's size, not to the mesh's alone.
#[test]
fn verify_accepts_bricks_larger_than_the_mesh() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 2).obj());
    for words in ["--res 1", "--res 2", "--res 1 --precision f32", "--res 2 --precision f32"] {
        folder.done(&format!("bake ball.obj --layout sparse --band 40 --padding 16 {words}"));
        folder.done("verify ball.sdf.h5 ball.obj --points 2000 --all-nodes");
    }
}

/// Rounding moves positions there, and would decide the side of an edge's normal.
#[test]
fn solids_that_rounding_could_turn_inside_out_are_baked_and_verified() {
    let folder = Folder::new();
    for (exponent, layout) in [(5, "dense"), (9, "sparse"), (12, "dense"), (12, "sparse")] {
        let far = 10_f64.powi(exponent);
        folder.write("ball.obj", Model::ball([far, -far, far], 1.0, 2).obj());
        let said = folder.done(&format!("bake ball.obj --res 20 --layout {layout}"));
        says(&said, &["winding: closed, consistently wound, one shell, far from the origin"]);
        folder.done("verify ball.sdf.h5 ball.obj --points 5000");
    }
    // Front and back of a parallelogram, cut along different diagonals.
    folder.write(
        "plate.obj",
        "v 0 0 0\nv 0.3 0.1 0.2\nv 0.4 0.8 -0.2\nv 0.1 0.7 -0.4\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n",
    );
    for layout in ["dense", "sparse"] {
        folder.done(&format!("bake plate.obj --res 20 --layout {layout} --keep-mesh"));
        folder.done("verify plate.sdf.h5 plate.obj --points 5000");
        folder.write("near.obj", Model::ball([0.2, 0.4, -0.1], 0.3, 3).obj());
        let found = folder.json("contacts near.obj plate.sdf.h5 --margin 0.1 --exact");
        let found = found["contacts"].as_array().unwrap();
        assert!(found.len() > 50 && found.iter().all(|contact| contact["distance"].as_f64().unwrap() > -1e-9));
    }
}

/// The bound of an open mesh's error leaves room for a sign that jumps beside a point, but a node has the sign that is stored.
#[test]
fn verify_finds_a_wrong_sign_beyond_the_band_of_an_open_mesh() {
    let folder = Folder::new();
    let mut open = Model::ball([0.0; 3], 1.0, 3);
    open.triangles.retain(|corners| !corners.contains(&0));
    folder.write("open.obj", open.obj());
    folder.done("bake open.obj --res 96 --padding 24 --layout sparse --precision f32 --band 1");
    let StoredGrid { grid, .. } = grid_file::read(&folder.at("open.sdf.h5")).unwrap();
    let OwnedStorage::SparseF32(storage) = grid.storage() else { panic!("a sparse grid") };
    let coarse = storage.bricks().coarse.to_vec();
    let words = "verify wrong.sdf.h5 open.obj --points 10 --all-nodes";
    write_with_coarse(&folder, "open.sdf.h5", &coarse);
    folder.done(words);
    // The first is at a corner of the box. Only places without a brick have it.
    let deepest = (0..coarse.len()).min_by(|a, b| coarse[*a].total_cmp(&coarse[*b])).unwrap();
    for node in [0, deepest] {
        let mut coarse = coarse.clone();
        coarse[node] *= -1.0;
        write_with_coarse(&folder, "open.sdf.h5", &coarse);
        says(&mismatch(&folder, words), &["1 node beyond the band has the wrong sign"]);
    }
}

/// Through the missing side the sign jumps far from all faces, and the interpolant passes through zero there: that is no fault.
#[test]
fn an_open_mesh_is_verified_where_its_sign_jumps_beyond_the_band() {
    let folder = Folder::new();
    let side = "f 1 3 4 2\nf 1 2 6 5\nf 2 4 8 6\nf 4 3 7 8\nf 3 1 5 7\n";
    let open_box = |bottom: f64, top: f64| {
        let level = |z| format!("v 0 0 {z}\nv 1 0 {z}\nv 0 1 {z}\nv 1 1 {z}\n");
        level(bottom) + &level(top) + side
    };
    folder.write("open.obj", open_box(0.0, 1.0));
    folder.write("moved.obj", open_box(0.25, 1.25));
    folder.done("bake open.obj --res 32 --layout sparse -o open.sdf.h5");
    let verified = folder.json("verify open.sdf.h5 open.obj --points 20000");
    assert_eq!(verified["far"]["wrong_signs"], 0);
    let said = mismatch(&folder, "verify open.sdf.h5 moved.obj --points 20000");
    says(&said, &["points beyond the band have the wrong sign"]);
}

#[test]
fn tight_bounds_are_computed_on_demand_as_a_tight_bake_states_them() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    folder.write("open.obj", Model::hills(8).obj());
    folder.done("bake ball.obj --res 48 --layout sparse");
    let stated = folder.json("bake ball.obj --res 48 --layout sparse --certify tight -o tight.sdf.h5");
    let words = "ball.obj --points 2000 --tight";
    let json = folder.json(&format!("verify ball.sdf.h5 {words}"));
    let [median, max] = ["median", "max"].map(|name| json["tight"][name].as_f64().unwrap());
    let [stated_max, fast_max] = [&stated["error_bound"], &json["error_bound"]].map(|bound| bound.as_f64().unwrap());
    assert!(
        median <= max && (max / stated_max - 1.0).abs() < 0.01 && max < fast_max,
        "{max}, {stated_max}, {fast_max}"
    );
    says(&folder.done(&format!("verify ball.sdf.h5 {words}")), &["tight", "of the median brick"]);
    assert!(folder.json("verify ball.sdf.h5 ball.obj --points 2000").get("tight").is_none());
    folder.done("bake open.obj --res 16 --layout sparse");
    assert!(folder.json("verify open.sdf.h5 open.obj --points 2000 --tight")["tight"].is_null());
    folder.done("bake ball.obj --res 16 -o dense.sdf.h5");
    says(
        &folder.misused(&format!("verify dense.sdf.h5 {words}")),
        &["dense.sdf.h5: --tight is for sparse grids", "remove it"],
    );
}

/// Checksums are right: what is wrong is what the file states beside its samples.
#[test]
fn verify_refuses_bounds_of_blocks_and_paddings_that_do_not_hold() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    let words = "verify wrong.sdf.h5 ball.obj --points 5000";
    let bounds_are_wrong = "outside of the bounds of values and slopes that blocks state";
    let (shift, halve) = (|x: &mut BlockBounds| shifted(x, 0.01), |x: &mut BlockBounds| x.slope_bound *= 0.5);
    type Change = fn(&mut BlockBounds);
    let changes: [(Change, f64, &str); 4] = [
        (|_| (), 1.0, ""),
        (shift, 1.0, bounds_are_wrong),
        (halve, 1.0, bounds_are_wrong),
        (|_| (), 2.0, "from the box's faces, less than the padding of"),
    ];
    for layout in ["dense", "sparse --precision f32"] {
        folder.done(&format!("bake ball.obj --res 32 --layout {layout}"));
        let StoredGrid { grid, sparse, about, .. } = grid_file::read(&folder.at("ball.sdf.h5")).unwrap();
        for (change, factor, reason) in changes {
            let about = About { padding: factor * about.padding, ..about.clone() };
            let (lattice, path) = (grid.lattice(), folder.at("wrong.sdf.h5"));
            match grid.storage() {
                OwnedStorage::Dense(storage) => {
                    let mut bounds = storage.bounds().to_vec();
                    bounds.iter_mut().for_each(change);
                    let distances = storage.storage().samples();
                    grid_file::write(&path, lattice, Samples::Dense { distances, bounds: &bounds }, &about).unwrap();
                }
                OwnedStorage::SparseF32(storage) => {
                    let bricks = storage.bricks();
                    let mut bounds = bricks.bounds.clone();
                    bounds.iter_mut().for_each(change);
                    let coarse = &bricks.coarse.to_vec();
                    let SparseInfo { band, deep_values, .. } = sparse.unwrap();
                    let OwnedBricks { slots, scales, samples, errors, .. } = bricks;
                    let samples =
                        SparseSamples { band, deep_values, slots, scales, samples, bounds: &bounds, errors, coarse };
                    grid_file::write(&path, lattice, samples, &about).unwrap();
                }
                _ => panic!("a grid of f32"),
            }
            if reason.is_empty() {
                folder.done(words);
            } else {
                says(&mismatch(&folder, words), &[reason]);
            }
        }
    }
}

fn shifted(bounds: &mut BlockBounds, by: f32) {
    bounds.range.lower += by;
    bounds.range.upper += by;
}
