//! Invalid and deeply nested shapes in TOML.

use super::{SPHERE, bad_field, scene};
use crate::folder::says;

#[test]
fn an_invalid_field_table_is_refused_with_its_location() {
    let folder = scene();
    folder.write("notgrid.toml", SPHERE);
    let part = "{ shape = 'sphere', radius = 1 }";
    for (text, words) in [
        ("", ["empty file", "give a baked grid"]),
        ("# nothing\n", ["needs field", "table"]),
        ("shape = 'sphere'\nradius = 1\n", ["needs field", "table"]),
        ("field = 'sphere'\n", ["field must be a table", "string"]),
        ("[field]\n", ["field: needs shape", "string"]),
        ("[field]\nshape = 3\n", ["shape must be a string", "integer"]),
        ("[field]\nshape = 'spere'\nradius = 1\n", ["spere", "known shapes: sphere, half_space"]),
        ("[field]\nshape = 'sphere'\n", ["needs radius", "number"]),
        ("[field]\nshape = 'sphere'\nradius = '1'\n", ["radius must be a finite number", "string"]),
        ("[field]\nshape = 'sphere'\nradius = nan\n", ["radius must be a finite number", "field"]),
        ("[field]\nshape = 'sphere'\nradius = inf\n", ["radius must be a finite number", "field"]),
        ("[field]\nshape = 'sphere'\nradius = -1\n", ["not a valid sphere", "more than 0"]),
        ("[field]\nshape = 'sphere'\nradius = 0\n", ["not a valid sphere", "more than 0"]),
        ("[field]\nshape = 'sphere'\nradius = 1e400\n", ["not TOML from line 3 on", "overflow"]),
        ("[field]\nshape = 'sphere'\nradius = 1\nheight = 2\n", ["unknown key \"height\"", "known here: "]),
        ("[field]\nshape = 'sphere'\nradius = 1\n[fields]\n", ["unknown key \"fields\"", "field"]),
        ("[field]\nshape = 'sphere'\nradius = 1\nradius = 2\n", ["line 4", "duplicate"]),
        ("[field\nshape = 'sphere'\n", ["not TOML", "line 1"]),
        ("[field]\nshape = 'box'\nhalf_extents = [1, 2]\n", ["half_extents", "3 finite numbers"]),
        ("[field]\nshape = 'box'\nhalf_extents = [1, 2, 'x']\n", ["half_extents", "3 finite numbers"]),
        ("[field]\nshape = 'half_space'\nnormal = [0, 0, 0]\noffset = 1\n", ["half_space", "normal must not be zero"]),
        ("[field]\nshape = 'cone'\nhalf_angle_deg = 90\nheight = 1\n", ["not a valid cone", "between 0 and 90"]),
        (
            "[field]\nshape = 'cone'\nhalf_angle_deg = 30\nhalf_angle_rad = 0.5\nheight = 1\n",
            ["field: give one of", "half_angle_deg and half_angle_rad"],
        ),
        ("[field]\nshape = 'torus'\nmajor_radius = 1\nminor_radius = 2\n", ["not a valid torus", "no less than"]),
        (
            "[field]\nshape = 'capsule'\na = [0, 0, 0]\nb = [1e155, 0, 0]\nradius = 1\n",
            ["not a valid capsule: out of range", "1e150"],
        ),
        (
            "[field]\nshape = 'bowl'\nradius = 1e155\ncut_height = 0\nthickness = 1e154\n",
            ["not a valid bowl: out of range", "1e150"],
        ),
        (
            "[field]\nshape = 'smooth_union'\nblend = 0\nof = [{ shape = 'sphere', radius = 1 }]\n",
            ["not a valid smooth_union", "blend must be more than 0"],
        ),
        (
            "[field]\nshape = 'smooth_union'\nblend = -1\nof = [{ shape = 'sphere', radius = 1 }]\n",
            ["not a valid smooth_union", "blend must be more than 0"],
        ),
        ("[field]\nshape = 'bowl'\nradius = 1\ncut_height = 1\nthickness = 0.1\n", ["not a valid bowl", "cut_height"]),
        ("[field]\nshape = 'union'\nof = []\n", ["of must be a list", "at least one"]),
        ("[field]\nshape = 'union'\nof = [3]\n", ["of[0]", "table"]),
        ("[field]\nshape = 'shell'\nthickness = 0.1\n", ["needs of", "table"]),
        ("[field]\nshape = 'sphere'\nradius = 1\npose.scale = 0\n", ["field.pose", "scale must be positive"]),
        ("[field]\nshape = 'sphere'\nradius = 1\npose.scale = 1e-320\n", ["field.pose", "scale is too small"]),
        (
            "[field]\nshape = 'sphere'\nradius = 1\npose.scale = [1, 1, 1e-320]\n",
            ["field.pose", "scale of an axis is too small"],
        ),
        ("[field]\nshape = 'sphere'\nradius = 1\npose.scale = -1\n", ["field.pose", "[-1.0, 1.0, 1.0] mirrors"]),
        ("[field]\nshape = 'sphere'\nradius = 1\npose.rotation = [0, 0, 0, 0]\n", ["field.pose", "rotation"]),
        ("[field]\nshape = 'sphere'\nradius = 1\npose.rotate = [0, 0, 1]\n", ["unknown key \"rotate\"", "translation"]),
        ("[field]\nshape = 'grid'\nfile = 'missing.sdf.h5'\n", ["bad.sdf.toml: field: missing.sdf.h5", "No such file"]),
        ("[field]\nshape = 'grid'\nfile = 'bad.sdf.toml'\n", ["bad.sdf.toml", "not an HDF5 file"]),
        ("[field]\nshape = 'grid'\nfile = 'notgrid.toml'\n", ["notgrid.toml", "not an HDF5 file"]),
        ("[field]\nshape = 'grid'\nfile = '.'\n", ["bad.sdf.toml: field: ", "not a regular file"]),
        ("[field]\nshape = 'grid'\nfile = ''\n", ["bad.sdf.toml: field: ", "No such file"]),
        ("[field]\nshape = 'grid'\n", ["needs file", "string"]),
    ] {
        folder.write("bad.sdf.toml", text);
        let line = folder.refused("eval bad.sdf.toml --points points.csv");
        says(&line, &words);
        assert_eq!(folder.refused("info bad.sdf.toml"), line);
    }
    folder.write(
        "bad.sdf.toml",
        format!("[field]\nshape = 'union'\nof = [{part}, {{ shape = 'shell', thickness = 1, of = 7 }}]\n"),
    );
    says(&bad_field(&folder, "bad.sdf.toml"), &["field.of[1]: of must be a table, not an integer"]);
}

#[test]
fn tables_within_tables_do_not_exhaust_the_stack() {
    let folder = scene();
    let nested = |levels: usize| {
        let tables =
            (0..levels).map(|level| format!("[field{}]\nshape = 'shell'\nthickness = 0.1\n", ".of".repeat(level)));
        format!("{}[field{}]\nshape = 'sphere'\nradius = 1\n", tables.collect::<String>(), ".of".repeat(levels))
    };
    folder.write("deep.sdf.toml", nested(63));
    folder.done("contacts cube.obj deep.sdf.toml");
    folder.done("surface deep.sdf.toml -o out.obj --res 8 --level 0.01");
    for (text, words) in [
        (nested(64), ["nested too deep", "of"]),
        (format!("[field]\nshape = {}{}\n", "[".repeat(100_000), "]".repeat(100_000)), ["not TOML", "recur"]),
        (format!("[field]\n{}a = 1\n", "a.".repeat(100_000)), ["not TOML", "recur"]),
        (format!("[{}a]\nb = 1\n", "field.".repeat(100_000)), ["not TOML", "recur"]),
    ] {
        folder.write("deep.sdf.toml", text);
        says(&bad_field(&folder, "deep.sdf.toml"), &words);
    }
    // Depth grows with the logarithm of the number of parts.
    let part = "{ shape = 'sphere', radius = 1 },";
    folder.write(
        "wide.sdf.toml",
        format!("[field]\nshape = 'smooth_union'\nblend = 0.1\nof = [{}]\n", part.repeat(20_000)),
    );
    folder.done("contacts cube.obj wide.sdf.toml --elements vertices");
    folder.write("vast.sdf.toml", vec![b'#'; (16 << 20) + 1]);
    says(&bad_field(&folder, "vast.sdf.toml"), &["16777216 bytes"]);
}
