//! Dense grids of codes: whatever breaks docs/format.md is refused, in what is written and in what is read, though all checksums hold.

use std::fs;

use sdf_core::grid::owned::Precision;
use sdf_core::grid::sparse::{BRICK_SAMPLES, Scale};
use sdf_formats::grid_file::{self, DenseBlockSamples, Samples};
use tempfile::TempDir;

use crate::forged::{Elements, Forged, Value, differences};
use crate::grid_round_trip::bad_bounds;
use crate::grid_samples::{Content, Kind, Made, about, lent_blocks};

const KIND: Kind = Kind::Dense(Precision::U16);
const NODES: [u32; 3] = [33, 34, 35];

#[test]
fn blocks_that_could_not_be_read_are_not_written() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let made = Made::new([33, 9, 17], Kind::Dense(Precision::U8));
    let Content::DenseU8(blocks) = &made.content else { panic!("another layout") };
    let blocks = lent_blocks(blocks);
    let refused = |samples: DenseBlockSamples<u8>| {
        let error =
            grid_file::write(&path, &made.lattice, Samples::DenseU8(samples), &about()).unwrap_err().to_string();
        assert!(error.contains("cannot be written") && error.lines().count() == 1, "{error}");
    };
    refused(DenseBlockSamples { samples: &blocks.samples[512..], ..blocks });
    refused(DenseBlockSamples { scales: &blocks.scales[1..], ..blocks });
    refused(DenseBlockSamples { bounds: &blocks.bounds[1..], ..blocks });
    // One block less in all tables: a slot without one.
    let last = blocks.slots.len() - 1;
    let (slots, scales, bounds) = (&blocks.slots[..last], &blocks.scales[..last], &blocks.bounds[..last]);
    refused(DenseBlockSamples { slots, scales, bounds, samples: &blocks.samples[..last * BRICK_SAMPLES] });
    let mut slots = blocks.slots.to_vec();
    slots[3] = slots[2];
    refused(DenseBlockSamples { slots: &slots, ..blocks });
    for (base, step) in [(f32::NAN, 1.0), (0.0, -1e-9), (3e38, 1e38)] {
        let mut scales = blocks.scales.to_vec();
        scales[5] = Scale { base, step };
        refused(DenseBlockSamples { scales: &scales, ..blocks });
    }
    for bad in bad_bounds() {
        let mut bounds = blocks.bounds.to_vec();
        bounds[5] = bad;
        refused(DenseBlockSamples { bounds: &bounds, ..blocks });
    }
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    grid_file::write(&path, &made.lattice, Samples::DenseU8(blocks), &about()).unwrap();
}

/// A file as docs/format.md describes it, by another writer.
fn forged() -> Forged {
    let made = Made::new(NODES, KIND);
    let Content::DenseU16(blocks) = &made.content else { panic!("another layout") };
    let count = blocks.slots.len();
    let mut forged = Forged::new();
    forged.attributes.retain(|(name, _)| !["band", "bricks", "deep_values"].contains(name));
    forged.tables.retain(|table| !["errors", "coarse"].contains(&table.name));
    let bounds = blocks.bounds.iter().flat_map(|block| [block.range.lower, block.range.upper, block.slope_bound]);
    let contents = [
        Elements::U16(differences(&blocks.samples)),
        Elements::F32(bounds.collect()),
        Elements::U32(blocks.slots.as_flattened().to_vec()),
        Elements::F32(blocks.scales.iter().flat_map(|scale| [scale.base, scale.step]).collect()),
    ];
    for (table, elements) in forged.tables.iter_mut().zip(contents) {
        table.shape[0] = count;
        table.elements = elements;
    }
    forged.set("layout", Value::Text("dense".into())).set("format_version", Value::Integers(vec![5]))
}

#[test]
fn blocks_of_another_writer_are_read() {
    let (_folder, path) = forged().write();
    assert!(grid_file::read(&path).unwrap_or_else(|error| panic!("{error}")).grid == Made::new(NODES, KIND).grid());
    let (_folder, path) = forged().with_mesh().write();
    assert!(grid_file::read(&path).unwrap_or_else(|error| panic!("{error}")).mesh.is_some());
}

#[test]
fn blocks_that_do_not_make_a_grid_are_refused() {
    let text = |text: &str| Value::Text(text.to_owned());
    for (forged, told) in [
        // An earlier program would take these for dense grids of f32, and one of f32 for these.
        (forged().set("format_version", Value::Integers(vec![4])), "checksum of the attributes"),
        (forged().set("precision", text("f32")), "precision is f32"),
        (forged().set("precision", text("u12")), "precision is not"),
        (forged().set("precision", text("u8")), "samples"),
        (forged().set("brick_side", Value::Integers(vec![4])), "8 nodes along a side"),
        (forged().set("layout", text("sparse")), "band"),
        (forged().set("counts", Value::Integers(vec![33, 34, 51])), "samples"),
        (forged().set_u32("places", 3, 0), "are both at"),
        (forged().set_u32("places", 3, 5), "slots"),
        (forged().set_f32("scales", 7, -1.0), "scale 3"),
        (forged().set_f32("scales", 7, f32::NAN), "scales is not finite"),
        (forged().set_f32("bounds", 2, -1.0), "bounds 0"),
        (Forged { is_first_digest_wrong: true, ..forged() }, "checksum of a chunk of samples"),
    ] {
        let refusal = forged.refusal();
        assert!(refusal.contains(told), "{told}: {refusal}");
    }
}
