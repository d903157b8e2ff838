//! Files whose checksums all hold, but whose content breaks docs/format.md, by malice or by mistake.

use sdf_formats::grid_file::{self, DeepValues, SparseSamples, StoredMesh, WriteOptions};

use crate::forged::{Elements, Forged, Value};
use crate::grid_samples::{Made, SPARSE_U16, about};

/// Also with chunks of any shape and shuffled bytes.
#[test]
fn a_valid_file_of_another_writer_is_read() {
    let made = Made::new([33, 34, 35], SPARSE_U16);
    let (_folder, path) = Forged::new().write();
    assert!(grid_file::read(&path).unwrap_or_else(|error| panic!("{error}")).grid == made.grid());
    let across = Forged::new().change("samples", |table| table.chunk = vec![7, 100]);
    let (_folder, path) = across.write();
    let stored = grid_file::open(&path).unwrap().read_needed([], 0.0).unwrap();
    assert_eq!(stored.read.blocks, 0);
    assert!(grid_file::read(&path).unwrap().grid == made.grid());
}

/// Files of version 3 have a SHA-256 of each chunk, and differences of codes.
#[test]
fn a_file_of_version_3_is_read() {
    let made = Made::new([33, 34, 35], SPARSE_U16);
    let (_folder, path) = Forged::new().with_mesh().version(3).write();
    let stored = grid_file::read(&path).unwrap_or_else(|error| panic!("{error}"));
    assert!(stored.grid == made.grid() && stored.mesh.is_some());
    let mut damaged = Forged::new().version(3);
    damaged.digests_sha256 = Some("0".repeat(64));
    assert!(damaged.refusal().contains("checksum of the digests does not match"));
}

#[test]
fn a_chunk_is_held_against_its_checksum_in_every_version() {
    for version in [2, 3, 4] {
        let forged = Forged { is_first_digest_wrong: true, ..Forged::new().version(version) };
        let refusal = forged.refusal();
        assert!(refusal.contains("checksum of a chunk of samples does not match"), "version {version}: {refusal}");
    }
}

/// A foreign writer may choose any coding, whatever the filters.
#[test]
fn codes_are_read_in_any_coding() {
    let made = Made::new([33, 34, 35], SPARSE_U16);
    let coded = |coding: &str, code: fn(u16) -> u16| {
        let forged = Forged::new().set("coding", Value::Text(coding.into()));
        forged.change("samples", |table| match &mut table.elements {
            Elements::U16(elements) => elements.iter_mut().for_each(|element| *element = code(*element)),
            _ => panic!("not u16"),
        })
    };
    let zigzag = |difference: u16| match difference as i16 {
        negative @ ..0 => (-2 * i32::from(negative) - 1) as u16,
        positive => 2 * positive as u16,
    };
    let plain = Forged::new().set("coding", Value::Text("plain".into())).change("samples", |table| {
        table.elements = Elements::U16(made.u16_bricks().samples.to_vec());
    });
    for forged in [coded("differences", |code| code), coded("zigzag", zigzag), plain] {
        let (_folder, path) = forged.write();
        assert!(grid_file::read(&path).unwrap_or_else(|error| panic!("{error}")).grid == made.grid());
    }
    assert!(coded("guesses", |code| code).refusal().contains("coding is \"guesses\""));
}

/// Files of version 2 do not say what their deep values are, and so state no bound of them.
#[test]
fn a_file_of_version_2_is_read_and_claims_nothing_of_its_deep_values() {
    let made = Made::new([33, 34, 35], SPARSE_U16);
    let (_folder, path) = Forged::new().version(2).write();
    let stored = grid_file::read(&path).unwrap_or_else(|error| panic!("{error}"));
    assert!(stored.grid == made.grid().with_deep_error(f64::INFINITY));
    assert_eq!(stored.sparse.unwrap().deep_values, DeepValues::LowerBounds);

    // Written again in the version of today, it still claims nothing.
    let lower = SparseSamples { deep_values: DeepValues::LowerBounds, ..made.u16_bricks() };
    grid_file::write(&path, &made.lattice, lower, &about()).unwrap();
    assert_eq!(grid_file::read(&path).unwrap().grid.deep_error(), f64::INFINITY);
    made.write(&path);
    let deep_error = grid_file::read(&path).unwrap().grid.deep_error();
    assert!((deep_error / made.lattice.spacing() - 4.5 * 3_f64.sqrt()).abs() < 1e-3, "{deep_error}");
}

#[test]
fn a_kept_mesh_is_read_and_a_hostile_one_is_refused() {
    let (_folder, path) = Forged::new().with_mesh().write();
    let mesh = grid_file::read(&path).unwrap_or_else(|error| panic!("{error}")).mesh.unwrap();
    assert_eq!((mesh.vertices.len(), mesh.triangles[3], mesh.is_sign_continuous), (4, [1, 2, 3], true));
    let reader = grid_file::open(&path).unwrap();
    assert_eq!(reader.read_mesh().unwrap(), Some(mesh));
    assert_eq!(reader.read_needed([], 0.0).unwrap().mesh, None);

    let forged = || Forged::new().with_mesh();
    let vertex = |at: usize, value: f64| {
        forged().change("mesh_vertices", |table| match &mut table.elements {
            Elements::F64(elements) => elements[at] = value,
            _ => panic!("not f64"),
        })
    };
    let counts = |counts: [u64; 2]| forged().set("mesh_counts", Value::Integers(counts.to_vec()));
    let kind = |kind: &str| forged().set("kept_mesh", Value::Text(kind.into()));
    let refusals = [
        (vertex(4, f64::NAN), "mesh_vertices is not finite"),
        (vertex(4, f64::INFINITY), "mesh_vertices is not finite"),
        (vertex(4, -2e30), "vertex 1 of the mesh is"),
        (forged().set_u32("mesh_triangles", 11, 4), "triangle 3 of the mesh is [1, 2, 4], of 4 vertices"),
        (forged().set_u32("mesh_triangles", 0, u32::MAX), "triangle 0 of the mesh is"),
        (counts([0, 4]), "kept_mesh is"),
        (counts([4, 0]), "kept_mesh is"),
        (counts([4, 5]), "mesh_triangles has 4 where 5 are declared"),
        (counts([1 << 40, 4]), "mesh_vertices has 4 where"),
        (counts([u64::MAX, 4]), "where"),
        (kind("none"), "kept_mesh is \"none\""),
        (kind("torn"), "kept_mesh is \"torn\""),
    ];
    for (forged, wanted) in refusals {
        let refusal = forged.refusal();
        assert!(refusal.contains(wanted), "{refusal}, not {wanted}");
    }
    let mut without = forged();
    without.tables.pop();
    assert!(without.refusal().contains("it has no mesh_triangles"));
    // A gigabyte of vertices from a hundred bytes.
    let balloon = counts([40_000_000, 4]).change("mesh_vertices", |table| {
        (table.shape, table.chunk) = (vec![40_000_000, 3], vec![40_000_000, 3]);
        table.elements = Elements::FirstChunkOnly(vec![0; 100]);
    });
    assert!(balloon.refusal().contains("mesh_vertices"));

    let made = Made::new([33, 34, 35], SPARSE_U16);
    let bad = StoredMesh { vertices: vec![[0.0; 3]; 3], triangles: vec![[0, 1, 3]], is_sign_continuous: true };
    let refused = grid_file::write_with(
        &path,
        &made.lattice,
        made.u16_bricks(),
        &about(),
        WriteOptions { mesh: Some(&bad), ..WriteOptions::default() },
    );
    assert!(refused.unwrap_err().to_string().contains("cannot be written: triangle 0 of the mesh is [0, 1, 3]"));
}

#[test]
fn numbers_that_do_not_make_a_grid_are_refused() {
    let forged = Forged::new;
    let number = |number: f64| Value::Numbers(vec![number]);
    let refusals = [
        (forged().set_u32("places", 4, 5), "brick 1 is at"),
        (forged().set_u32("places", 4, u32::MAX), "brick 1 is at"),
        (forged().set_f32("scales", 2, f32::NAN), "scales is not finite"),
        (forged().set_f32("scales", 3, -1e-9), "scale 1 has"),
        (forged().set_f32("scales", 3, 1e34), "scale 1 has"),
        (forged().set_f32("bounds", 3, f32::NEG_INFINITY), "bounds is not finite"),
        (forged().set_f32("bounds", 3, 1e9), "bounds 1 are"),
        (forged().set_f32("bounds", 5, -1e-9), "with a slope of -0.000000001"),
        (forged().set_f32("errors", 1, -1e-9), "error 1 is"),
        (forged().set_f32("coarse", 1, f32::NAN), "coarse is not finite"),
        (forged().set("band", number(f64::NAN)), "band is NaN"),
        (forged().set("band", number(-1.0)), "band is -1"),
        (forged().set("padding", number(f64::INFINITY)), "padding is inf"),
        (forged().set("brick_side", Value::Integers(vec![16])), "8 nodes along a side"),
        (forged().set("precision", Value::Text("u8".into())), "its samples is not little-endian u8"),
        (forged().set("precision", Value::Text("f64".into())), "precision is not f32, u16 or u8"),
        (forged().set("deep_values", Value::Text("guesses".into())), "deep_values is \"guesses\""),
        (forged().set("sign_method", Value::Text("guess".into())), "sign_method is \"guess\""),
        // The checksum of a dense grid covers neither band nor bricks.
        (forged().set("layout", Value::Text("dense".into())), "checksum of the attributes"),
        (forged().set("layout", Value::Text("lumpy".into())), "neither dense nor sparse"),
    ];
    for (forged, wanted) in refusals {
        let refusal = forged.refusal();
        assert!(refusal.contains(wanted), "{refusal}, not {wanted}");
    }
    let twice = forged().change("places", |table| match &mut table.elements {
        Elements::U32(places) => places.copy_within(3..6, 6),
        _ => panic!("not u32"),
    });
    assert!(twice.refusal().contains("bricks 1 and 2 are both at"));
}

/// The digests fit the chunks, but the attributes belong to another grid.
#[test]
fn digests_that_do_not_match_the_attributes_are_refused() {
    let mut forged = Forged::new();
    forged.digests_sha256 = Some("0".repeat(64));
    assert!(forged.refusal().contains("checksum of the digests does not match"));
}

#[test]
fn counts_that_do_not_match_the_tables_are_refused() {
    let forged = Forged::new;
    for bricks in [0, 1, 24, 126, 1 << 32, u64::MAX] {
        let refusal = forged().set("bricks", Value::Integers(vec![bricks])).refusal();
        assert!(refusal.contains("where") || refusal.contains("bricks"), "{refusal}");
    }
    for counts in [[33, 34, 41], [33, 34, 300], [1 << 24; 3], [1 << 24, 1 << 24, 2], [2, 2, 2], [0, 2, 2]] {
        let refusal = forged().set("counts", Value::Integers(counts.to_vec())).refusal();
        assert!(refusal.contains("where") || refusal.contains("slots") || refusal.contains("not a grid"), "{refusal}");
    }
    let short = forged().change("errors", |table| {
        table.shape[0] -= 1;
        match &mut table.elements {
            Elements::F32(errors) => drop(errors.pop()),
            _ => panic!("not f32"),
        }
        table.chunk[0] = table.chunk[0].min(table.shape[0]);
    });
    assert!(short.refusal().contains("errors has"));
    let flat = forged().change("coarse", |table| (table.shape, table.chunk) = (vec![216], vec![100]));
    assert!(flat.refusal().contains("coarse does not have 3 axes"));
    let another = forged().change("places", |table| {
        if let Elements::U32(places) = &table.elements {
            table.elements = Elements::F32(places.iter().map(|place| *place as f32).collect());
        }
    });
    assert!(another.refusal().contains("places is not little-endian u32"));
    let mut fewer = forged();
    fewer.tables.pop();
    assert!(fewer.refusal().contains("it has no coarse"));
}

/// 10¹² brick slots are declared, but the file has no coarse grid for them.
#[test]
fn brick_slots_without_a_coarse_grid_take_no_memory() {
    let refusal = Forged::new().set("counts", Value::Integers(vec![80_000; 3])).refusal();
    assert!(refusal.contains("coarse has 6 where 10001 are declared"), "{refusal}");
}

/// One chunk of 4 GB from a hundred bytes, or a million chunks of one number.
#[test]
fn coarse_grids_too_large_for_the_file_take_no_memory() {
    for (side, chunk) in [(1000, 1000), (100, 1)] {
        let forged = Forged::new().set("counts", Value::Integers(vec![8 * (side - 1); 3]));
        let forged = forged.change("coarse", |table| {
            (table.shape, table.chunk) = (vec![side as usize; 3], vec![chunk; 3]);
            table.elements = Elements::FirstChunkOnly(vec![0; 100]);
        });
        let refusal = forged.refusal();
        assert!(refusal.contains("more of coarse is declared than it holds"), "{refusal}");
    }
}
