//! Shapes in TOML are the core's own, and work wherever a grid does.

use sdf_core::combine::{Difference, Intersection, Offset, Shell, SmoothUnion, Union};
use sdf_core::grid::Storage;
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placed, Similarity, Stretch};
use sdf_core::shapes::{
    Bowl, Capsule, Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Horseshoe, Octahedron, RoundedBox, Sphere, Torus,
};
use sdf_core::{EnclosedSdf, Sdf};
use sdf_formats::field_file::{self, Field};
use sdf_formats::grid_file::StoredGrid;
use sdf_procedural::random::Random;

use crate::folder::{Folder, says};
use crate::meshes::Model;

/// Checks that `sdftool eval` of the table equals the field itself, bit for bit.
fn same<F: EnclosedSdf>(folder: &Folder, table: &str, field: &F) {
    folder.write("field.sdf.toml", format!("[field]\n{table}\n"));
    let mut random = Random::new(7);
    let points: Vec<[f64; 3]> = (0..200).map(|_| random.point_in_cube(3.0)).collect();
    let lines: Vec<String> = points.iter().map(|[x, y, z]| format!("{x:?},{y:?},{z:?}")).collect();
    folder.write("points.csv", lines.join("\n"));
    let json = folder.json("eval field.sdf.toml --points points.csv");
    for (point, answer) in points.iter().zip(json["samples"].as_array().unwrap()) {
        let sample = field.sample(Vector3::from(*point));
        assert_eq!(answer["distance"], sample.value, "{table} at {point:?}");
        for k in 0..3 {
            assert_eq!(answer["gradient"][k], sample.gradient[k], "{table} at {point:?}");
        }
    }
    folder.done("info field.sdf.toml");
}

#[test]
fn every_shape_is_the_cores_own() {
    let folder = Folder::new();
    let deg = f64::to_radians;
    same(&folder, "shape = 'sphere'\nradius = 1", &Sphere::new(1.0).unwrap());
    let half_space = HalfSpace::new([1.0, 2.0, -2.0], 0.5).unwrap();
    same(&folder, "shape = 'half_space'\nnormal = [1, 2, -2]\noffset = 0.5", &half_space);
    same(&folder, "shape = 'box'\nhalf_extents = [1, 0.5, 0.25]", &Cuboid::new([1.0, 0.5, 0.25]).unwrap());
    let rounded = RoundedBox::new([1.0, 0.5, 0.25], 0.125).unwrap();
    same(&folder, "shape = 'rounded_box'\nhalf_extents = [1, 0.5, 0.25]\nradius = 0.125", &rounded);
    let capsule = Capsule::new([-1.0, 0.0, 0.5], [1.0, 1.0, 0.0], 0.3).unwrap();
    same(&folder, "shape = 'capsule'\na = [-1, 0, 0.5]\nb = [1, 1, 0]\nradius = 0.3", &capsule);
    let cylinder = Cylinder::new(0.6, 1.2).unwrap();
    same(&folder, "shape = 'cylinder'\nradius = 0.6\nhalf_height = 1.2", &cylinder);
    same(&folder, "shape = 'cone'\nhalf_angle_deg = 10.0\nheight = 1.0", &Cone::new(deg(10.0), 1.0).unwrap());
    let torus = Torus::new(1.5, 0.4).unwrap();
    same(&folder, "shape = 'torus'\nmajor_radius = 1.5\nminor_radius = 0.4", &torus);
    same(&folder, "shape = 'octahedron'\nsize = 1.5", &Octahedron::new(1.5).unwrap());
    same(&folder, "shape = 'ellipsoid'\nradii = [2, 1, 0.5]", &Ellipsoid::new([2.0, 1.0, 0.5]).unwrap());
    let bowl = Bowl::new(1.5, 0.3, 0.2).unwrap();
    same(&folder, "shape = 'bowl'\nradius = 1.5\ncut_height = 0.3\nthickness = 0.2", &bowl);
    let horseshoe = Horseshoe::new(1.0, 0.4, deg(90.0), 0.8, 0.3).unwrap();
    let table = "shape = 'horseshoe'\nradius = 1\nthickness = 0.4\nbend_deg = 90\nleg = 0.8\nhalf_depth = 0.3";
    same(&folder, table, &horseshoe);
}

const SPHERE: &str = "{ shape = 'sphere', radius = 1.0 }";
const BOX: &str = "{ shape = 'box', half_extents = [0.8, 0.9, 1.4] }";
const TORUS: &str = "{ shape = 'torus', major_radius = 1.2, minor_radius = 0.3 }";

#[test]
fn every_combination_is_the_cores_own() {
    let folder = Folder::new();
    let sphere = || Sphere::new(1.0).unwrap();
    let cuboid = || Cuboid::new([0.8, 0.9, 1.4]).unwrap();
    let torus = || Torus::new(1.2, 0.3).unwrap();
    let combined = |shape: &str, parts: &[&str]| format!("shape = '{shape}'\nof = [{}]", parts.join(", "));
    same(&folder, &combined("union", &[SPHERE, BOX]), &Union(sphere(), cuboid()));
    same(&folder, &combined("union", &[SPHERE, BOX, TORUS]), &Union(Union(sphere(), cuboid()), torus()));
    same(&folder, &combined("union", &[TORUS]), &torus());
    same(&folder, &combined("intersection", &[SPHERE, BOX]), &Intersection(sphere(), cuboid()));
    same(&folder, &combined("difference", &[BOX, SPHERE]), &Difference(cuboid(), sphere()));
    same(&folder, &combined("difference", &[BOX, SPHERE, TORUS]), &Difference(cuboid(), Union(sphere(), torus())));
    same(&folder, &combined("difference", &[BOX]), &cuboid());
    let smooth = SmoothUnion::new(sphere(), cuboid(), 0.4).unwrap();
    same(&folder, &format!("{}\nblend = 0.4", combined("smooth_union", &[SPHERE, BOX])), &smooth);
    let grown = Offset::new(cuboid(), 0.2).unwrap();
    same(&folder, &format!("shape = 'offset'\ndistance = 0.2\nof = {BOX}"), &grown);
    let shrunk = Offset::new(cuboid(), -0.2).unwrap();
    same(&folder, &format!("shape = 'offset'\ndistance = -0.2\nof = {BOX}"), &shrunk);
    same(&folder, &format!("shape = 'shell'\nthickness = 0.1\nof = {BOX}"), &Shell::new(cuboid(), 0.1).unwrap());
}

#[test]
fn a_pose_on_any_node_places_it_in_its_parent() {
    let folder = Folder::new();
    let pose = Similarity::new([0.3, -0.2, 0.5], [0.1, 0.2, 0.3, 0.9], 1.5).unwrap();
    let turned = "[field.pose]\ntranslation = [0.3, -0.2, 0.5]\nrotation = [0.1, 0.2, 0.3, 0.9]\nscale = 1.5";
    let torus = || Torus::new(1.2, 0.3).unwrap();
    let table = format!("shape = 'torus'\nmajor_radius = 1.2\nminor_radius = 0.3\n{turned}");
    same(&folder, &table, &Placed { field: torus(), placement: pose });
    // Each part is optional.
    let scaled = Placed { field: torus(), placement: Similarity::new([0.0; 3], [0.0, 0.0, 0.0, 1.0], 2.0).unwrap() };
    same(&folder, "shape = 'torus'\nmajor_radius = 1.2\nminor_radius = 0.3\npose.scale = 2", &scaled);

    // Stretched along its own axes and mirrored, then rotated and moved.
    let stretched = Placed { field: torus(), placement: Stretch::new([0.5, -2.0, 1.5]).unwrap() };
    let placement = Similarity::new([0.3, -0.2, 0.5], [0.1, 0.2, 0.3, 0.9], 1.0).unwrap();
    let table = table.replace("scale = 1.5", "scale = [0.5, -2, 1.5]");
    same(&folder, &table, &Placed { field: stretched, placement });

    for (scale, word) in [("[1, 0, 1]", "zero"), ("[1, 2]", "3 finite numbers"), ("-1", "positive")] {
        folder.write("bad.sdf.toml", format!("[field]\nshape = 'sphere'\nradius = 1\npose.scale = {scale}\n"));
        says(&folder.refused("info bad.sdf.toml"), &["bad.sdf.toml", word]);
    }

    // A placed shell of a union of a placed sphere and a difference.
    let up = Similarity::new([0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0], 1.0).unwrap();
    let inner = Union(
        Placed { field: Sphere::new(1.0).unwrap(), placement: up },
        Difference(Cuboid::new([0.8, 0.9, 1.4]).unwrap(), torus()),
    );
    let nested = Placed { field: Shell::new(inner, 0.2).unwrap(), placement: pose };
    let table = format!(
        "shape = 'shell'\nthickness = 0.2\n{turned}\n[field.of]\nshape = 'union'\n\
         [[field.of.of]]\nshape = 'sphere'\nradius = 1\npose.translation = [0, 0, 1]\n\
         [[field.of.of]]\nshape = 'difference'\nof = [{BOX}, {TORUS}]"
    );
    same(&folder, &table, &nested);
}

#[test]
fn a_grids_path_is_relative_to_the_file_that_names_it() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 3).obj());
    std::fs::create_dir_all(folder.at("fields/grids")).unwrap();
    folder.done("bake ball.obj --res 12 -o fields/grids/ball.sdf.h5");
    let Ok(Field::Grid(StoredGrid { grid, .. })) = field_file::read(&folder.at("fields/grids/ball.sdf.h5")) else {
        panic!("a grid")
    };
    folder.write(
        "fields/two.sdf.toml",
        "[field]\nshape = 'union'\nof = [{ shape = 'grid', file = 'grids/ball.sdf.h5' }, \
        { shape = 'grid', file = './grids/ball.sdf.h5', pose.translation = [2, 0, 0] }]\n",
    );
    folder.write("points.csv", "0.2,0.3,1.2\n-1.5,0.1,0.2\n-9,0,0\n");
    let json = folder.json("eval fields/two.sdf.toml --points points.csv");
    for sample in json["samples"].as_array().unwrap() {
        let point: [f64; 3] = std::array::from_fn(|k| sample["point"][k].as_f64().unwrap());
        assert_eq!(sample["distance"], grid.sample(Vector3::from(point)).value);
    }
    assert_eq!(json["samples"][2]["outside_grid"], true);
}

/// A grid is loaded once, even if it is named 200 times.
#[cfg(target_os = "linux")]
#[test]
fn a_grid_that_is_named_often_is_loaded_once() {
    let folder = Folder::new();
    folder.write("cube.obj", Model::cube().obj());
    folder.done("bake cube.obj --res 100");
    let part = "{ shape = 'grid', file = 'cube.sdf.h5' }";
    folder.write("many.sdf.toml", format!("[field]\nshape = 'union'\nof = [{}]\n", vec![part; 200].join(",")));
    // 5 MB of samples each, with 400 MB of address space for all.
    let script = format!("ulimit -v 400000; exec {} info many.sdf.toml", crate::folder::SDFTOOL);
    let mut command = assert_cmd::Command::new("sh");
    crate::folder::done(command.args(["-c", &script]).current_dir(folder.path()), "info many.sdf.toml");
}

/// The document of 600,000 points, 100 MB of text, is written as it is computed.
#[cfg(target_os = "linux")]
#[test]
fn eval_holds_no_document_in_memory() {
    let folder = Folder::new();
    folder.write("ball.sdf.toml", "[field]\nshape = 'sphere'\nradius = 1\n");
    folder.write("points.csv", "0,0,2\n".repeat(600_000));
    // Points take 24 bytes each, and objects of two kilobytes would take more than a gigabyte.
    let program = crate::folder::SDFTOOL;
    let script = format!("ulimit -v 400000; {program} eval ball.sdf.toml --points points.csv --json | tail -c 100");
    let mut command = assert_cmd::Command::new("sh");
    let end = crate::folder::done(command.args(["-c", &script]).current_dir(folder.path()), "eval");
    says(&end, &["\"point\":[0.0,0.0,2.0]}],\"schema\":\"sdftool.eval/1\"}"]);
}

#[test]
fn shapes_work_wherever_a_grid_does() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.0; 3], 1.0, 4).obj());
    folder.write("sheet.obj", Model::hills(10).obj());
    folder.write("points.csv", "0,0,2\n");
    folder.write("field.sdf.toml", "[field]\nshape = 'sphere'\nradius = 1\n");
    folder.done("bake ball.obj --res 32");
    says(&folder.done("eval field.sdf.toml --points points.csv"), &["0.0,0.0,2.0,1.0,0.0,0.0,1.0"]);
    says(&folder.done("info field.sdf.toml"), &["analytic", "(-1.000000, -1.000000, -1.000000)", "at most 1.0"]);
    folder.done("slice field.sdf.toml -o out.png --pixels 64");
    folder.done("surface field.sdf.toml -o out.obj --res 16");
    let verified = folder.json("verify field.sdf.toml ball.obj --points 500");
    assert!(verified["nodes"].is_null() && verified["error_bound"].is_null() && verified["same_mesh"].is_null());
    assert!(verified["points"]["max"].as_f64().unwrap() < 0.01);
    let [shapes, grid] = ["field.sdf.toml", "ball.sdf.h5"].map(|field| {
        folder.json(&format!("contacts sheet.obj {field} --elements vertices"))["contacts"].as_array().unwrap().len()
    });
    assert!(shapes > 50 && shapes.abs_diff(grid) < 5, "{shapes} {grid}");
    // A mesh is not a field.
    says(&folder.refused("info ball.obj"), &["ball.obj is an OBJ mesh", "bake it first"]);
    says(&folder.done("contacts field.sdf.toml ball.sdf.h5"), &["verdict  contact"]);
}

#[test]
fn eval_at_the_nodes_gives_the_stored_samples() {
    let folder = Folder::new();
    folder.write("ball.obj", Model::ball([0.1, 0.2, 0.3], 1.0, 3).obj());
    folder.write("cube.obj", Model::cube().obj());
    for (mesh, tolerance) in [("cube", 0.0), ("ball", 1e-6)] {
        folder.done(&format!("bake {mesh}.obj --res 8"));
        let grid = sdf_formats::grid_file::read(&folder.at(&format!("{mesh}.sdf.h5"))).unwrap().grid;
        let lattice = *grid.lattice();
        let [nx, ny, nz] = lattice.nodes();
        let nodes = (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
        let lines: Vec<String> =
            nodes.clone().map(|node| lattice.node(node).map(|x| format!("{x:?}")).join(",")).collect();
        folder.write("nodes.csv", lines.join("\n"));
        let printed = folder.done(&format!("eval {mesh}.sdf.h5 --points nodes.csv"));
        let values: Vec<f64> =
            printed.lines().skip(1).map(|line| line.split(',').nth(3).unwrap().parse().unwrap()).collect();
        assert_eq!(values.len(), lattice.node_count());
        for (value, node) in values.iter().zip(nodes) {
            let cell: [u32; 3] = std::array::from_fn(|axis| node[axis].min(lattice.cells()[axis] - 1));
            let corner = (0..3).fold(0, |corner, axis| corner | ((node[axis] - cell[axis]) as usize) << axis);
            let stored = grid.storage().corners(cell)[corner];
            assert!((value - f64::from(stored)).abs() <= tolerance, "{mesh}: {value} {stored}");
        }
    }
}

#[test]
fn places_far_from_the_origin_are_printed_with_the_digits_of_the_body() {
    let folder = Folder::new();
    folder.write(
        "far.sdf.toml",
        "[field]\nshape = 'sphere'\nradius = 1.0\n[field.pose]\ntranslation = [1e7, 2e7, 10000003.5]\n",
    );
    says(
        &folder.done("info far.sdf.toml"),
        &["(9999999.000, 19999999.000, 10000002.500) to (10000001.000, 20000001.000,"],
    );
    says(&folder.done("slice far.sdf.toml -o slice.png"), &["plane  z = 10000003.500"]);
    let floor = Model::hills(4).moved(|[x, y, z]| [1e7 + x, 2e7 + y, 1e7 + 3.5 + 0.01 * z]);
    folder.write("floor.obj", floor.obj());
    let rows = folder.done("contacts floor.obj far.sdf.toml");
    let deepest = rows.lines().find(|line| line.trim_start().starts_with("deepest")).unwrap();
    says(deepest, &["(10000000.0", ", 20000000.0", ", 10000003.5"]);
}
