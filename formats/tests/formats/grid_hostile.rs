//! Files whose checksums all hold, but whose content breaks docs/format.md, by malice or by mistake.

use std::path::PathBuf;

use rust_hdf5::{H5File, H5Group, LibverBound};
use sdf_core::grid::owned::Precision;
use sdf_formats::grid_file::{self, DeepValues, SparseSamples};
use sha2::{Digest, Sha256};
use tempfile::TempDir;

use crate::grid_samples::{BAND, Content, Made, about};

#[derive(Clone)]
enum Value {
    Text(String),
    Numbers(Vec<f64>),
    Integers(Vec<u64>),
}

#[derive(Clone)]
enum Elements {
    F32(Vec<f32>),
    U32(Vec<u32>),
    U16(Vec<u16>),
    U8(Vec<u8>),
    /// A dataset of f32 of which only the first chunk is stored, as these compressed bytes.
    FirstChunkOnly(Vec<u8>),
}

#[derive(Clone)]
struct Table {
    name: &'static str,
    shape: Vec<usize>,
    chunk: Vec<usize>,
    elements: Elements,
}

/// A sparse u16 grid as docs/format.md describes it, to be falsified.
#[derive(Clone)]
struct Forged {
    attributes: Vec<(&'static str, Value)>,
    tables: Vec<Table>,
    /// Replaces the true checksum.
    digests_sha256: Option<String>,
}

impl Forged {
    fn new() -> Self {
        let made = Made::new([33, 34, 35], Some(Precision::U16));
        let Content::U16(bricks) = &made.content else { panic!("another layout") };
        let (text, about) = (|text: &str| Value::Text(text.to_owned()), about());
        let count = bricks.slots.len();
        let hex: String = about.source.sha256.iter().map(|byte| format!("{byte:02x}")).collect();
        let attributes = vec![
            ("format_version", Value::Integers(vec![3])),
            ("layout", text("sparse")),
            ("origin", Value::Numbers(made.lattice.origin().to_vec())),
            ("spacing", Value::Numbers(vec![made.lattice.spacing()])),
            ("counts", Value::Integers(made.lattice.nodes().map(u64::from).to_vec())),
            ("padding", Value::Numbers(vec![about.padding])),
            ("sign_method", text(about.sign_method.name())),
            ("sign_verdict", text(&about.sign_reason)),
            ("slope_bound", Value::Numbers(vec![about.slope_bound])),
            ("error_bound", Value::Numbers(vec![about.error_bound])),
            ("source_name", text(&about.source.name)),
            ("source_sha256", text(&hex)),
            ("source_triangles", Value::Integers(vec![about.source.triangles])),
            ("tool", text(&about.tool)),
            ("options", text(&about.options)),
            ("band", Value::Numbers(vec![BAND])),
            ("precision", text("u16")),
            ("brick_side", Value::Integers(vec![8])),
            ("bricks", Value::Integers(vec![count as u64])),
            ("deep_values", text("distances")),
        ];
        let table = |name, shape: &[usize], elements| {
            let chunk = shape.iter().map(|side| *side.min(&30)).collect();
            Table { name, shape: shape.to_vec(), chunk, elements }
        };
        let bounds = bricks
            .bounds
            .iter()
            .flat_map(|bounds| [bounds.range.lower, bounds.range.upper, bounds.slope_bound])
            .collect();
        let scales = bricks.scales.iter().flat_map(|scale| [scale.base, scale.step]).collect();
        let tables = vec![
            table("samples", &[count, 512], Elements::U16(differences(&bricks.samples))),
            table("bounds", &[count, 3], Elements::F32(bounds)),
            table("places", &[count, 3], Elements::U32(bricks.slots.as_flattened().to_vec())),
            table("scales", &[count, 2], Elements::F32(scales)),
            table("errors", &[count], Elements::F32(bricks.errors.clone())),
            table("coarse", &[6, 6, 6], Elements::F32(bricks.coarse.clone())),
        ];
        Self { attributes, tables, digests_sha256: None }
    }

    fn set(mut self, name: &str, value: Value) -> Self {
        self.attributes.iter_mut().find(|(known, _)| *known == name).unwrap().1 = value;
        self
    }

    /// The same grid as version 2 has it.
    fn version_2(mut self) -> Self {
        self.attributes.retain(|(name, _)| *name != "deep_values");
        self.set("format_version", Value::Integers(vec![2]))
    }

    fn change(mut self, name: &str, change: impl FnOnce(&mut Table)) -> Self {
        change(self.tables.iter_mut().find(|table| table.name == name).unwrap());
        self
    }

    fn set_f32(self, name: &str, at: usize, value: f32) -> Self {
        self.change(name, |table| match &mut table.elements {
            Elements::F32(elements) => elements[at] = value,
            _ => panic!("not f32"),
        })
    }

    fn set_u32(self, name: &str, at: usize, value: u32) -> Self {
        self.change(name, |table| match &mut table.elements {
            Elements::U32(elements) => elements[at] = value,
            _ => panic!("not u32"),
        })
    }

    fn write(&self) -> (TempDir, PathBuf) {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("forged.sdf.h5");
        let file = H5File::options().libver(LibverBound::Earliest).create(&path).unwrap();
        let sdf = file.create_group("sdf").unwrap();
        let mut digests = Vec::new();
        for table in &self.tables {
            table.write(&sdf);
            digests.extend(table.digests());
        }
        let rows = digests.len() / 32;
        let shape = vec![rows, 32];
        Table { name: "digests", chunk: shape.clone(), shape, elements: Elements::U8(digests.clone()) }.write(&sdf);
        let mut attributes = self.attributes.clone();
        let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
        let checksum = self.digests_sha256.clone().unwrap_or_else(|| hex(&Sha256::digest(&digests)));
        attributes.push(("digests_sha256", Value::Text(checksum)));
        let mut canonical = String::new();
        for (name, value) in &attributes {
            let value = match value {
                Value::Text(text) => {
                    sdf.set_attr_string(name, text).unwrap();
                    text.clone()
                }
                Value::Numbers(numbers) => {
                    sdf.set_attr_array_numeric(name, numbers).unwrap();
                    numbers.iter().map(|number| format!("{:016x}", number.to_bits())).collect::<Vec<_>>().join(" ")
                }
                Value::Integers(integers) => {
                    sdf.set_attr_array_numeric(name, integers).unwrap();
                    integers.iter().map(u64::to_string).collect::<Vec<_>>().join(" ")
                }
            };
            canonical += &format!("{name}={value}\n");
        }
        sdf.set_attr_string("attributes_sha256", &hex(&Sha256::digest(canonical))).unwrap();
        file.close().unwrap();
        (folder, path)
    }

    fn refusal(&self) -> String {
        let (_folder, path) = self.write();
        let error = grid_file::read(&path).expect_err("not a grid").to_string();
        assert_eq!(error.lines().count(), 1, "{error}");
        error
    }
}

impl Table {
    fn write(&self, group: &H5Group) {
        macro_rules! write {
            ($elements:expr, $number:ident) => {{
                let dataset = group.new_dataset::<$number>().shape(&self.shape).chunk(&self.chunk);
                dataset.shuffle_deflate(4).create(self.name).unwrap().write_raw($elements).unwrap()
            }};
        }
        match &self.elements {
            Elements::F32(elements) => write!(elements, f32),
            Elements::U32(elements) => write!(elements, u32),
            Elements::U16(elements) => write!(elements, u16),
            Elements::U8(elements) => write!(elements, u8),
            Elements::FirstChunkOnly(packed) => {
                let dataset = group.new_dataset::<f32>().shape(&self.shape).chunk(&self.chunk);
                dataset.shuffle_deflate(4).create(self.name).unwrap().write_chunk_raw(0, packed, 0).unwrap();
            }
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match &self.elements {
            Elements::F32(elements) => elements.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Elements::U32(elements) => elements.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Elements::U16(elements) => elements.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Elements::U8(elements) => elements.clone(),
            Elements::FirstChunkOnly(packed) => packed.clone(),
        }
    }

    /// Digests of the chunks, by sorting each element into its chunk.
    fn digests(&self) -> Vec<u8> {
        let bytes = self.bytes();
        if let Elements::FirstChunkOnly(_) = self.elements {
            return vec![0; 32];
        }
        let count: usize = self.shape.iter().product();
        let width = bytes.len() / count;
        let mut chunks = std::collections::BTreeMap::<Vec<usize>, Vec<u8>>::new();
        for at in 0..count {
            let mut rest = at;
            let mut chunk = vec![0; self.shape.len()];
            for axis in (0..self.shape.len()).rev() {
                chunk[axis] = rest % self.shape[axis] / self.chunk[axis];
                rest /= self.shape[axis];
            }
            chunks.entry(chunk).or_default().extend(&bytes[at * width..][..width]);
        }
        chunks.values().flat_map(|chunk| Sha256::digest(chunk).to_vec()).collect()
    }
}

/// Delta coding: for each code, the alternating sum over the corners of the cell that ends at it.
fn differences(samples: &[u16]) -> Vec<u16> {
    let difference = |(at, _): (usize, &u16)| {
        let [x, y, z] = [at % 8, at / 8 % 8, at / 64 % 8];
        (0..8).fold(0_u16, |sum, corner| {
            let back = [corner & 1, corner >> 1 & 1, corner >> 2];
            if x < back[0] || y < back[1] || z < back[2] {
                return sum;
            }
            let code = samples[at - back[0] - 8 * back[1] - 64 * back[2]];
            if back.iter().sum::<usize>() % 2 == 0 { sum.wrapping_add(code) } else { sum.wrapping_sub(code) }
        })
    };
    samples.iter().enumerate().map(difference).collect()
}

/// Also with chunks of any shape and shuffled bytes.
#[test]
fn a_valid_file_of_another_writer_is_read() {
    let made = Made::new([33, 34, 35], Some(Precision::U16));
    let (_folder, path) = Forged::new().write();
    assert!(grid_file::read(&path).unwrap_or_else(|error| panic!("{error}")).grid == made.grid());
    let across = Forged::new().change("samples", |table| table.chunk = vec![7, 100]);
    let (_folder, path) = across.write();
    let stored = grid_file::open(&path).unwrap().read_needed([], 0.0).unwrap();
    assert_eq!(stored.read.blocks, 0);
    assert!(grid_file::read(&path).unwrap().grid == made.grid());
}

/// Files of version 2 do not say what their deep values are, and so state no bound of them.
#[test]
fn a_file_of_version_2_is_read_and_claims_nothing_of_its_deep_values() {
    let made = Made::new([33, 34, 35], Some(Precision::U16));
    let (_folder, path) = Forged::new().version_2().write();
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
fn numbers_that_do_not_make_a_grid_are_refused() {
    let forged = Forged::new;
    let number = |number: f64| Value::Numbers(vec![number]);
    let refusals = [
        (forged().set_u32("places", 4, 5), "brick 1 is at"),
        (forged().set_u32("places", 4, u32::MAX), "brick 1 is at"),
        (forged().set_f32("scales", 2, f32::NAN), "scales is not finite"),
        (forged().set_f32("scales", 3, -1e-9), "scale 1 is"),
        (forged().set_f32("scales", 3, 1e34), "scale 1 is"),
        (forged().set_f32("bounds", 3, f32::NEG_INFINITY), "bounds is not finite"),
        (forged().set_f32("bounds", 3, 1e9), "bounds 1 are"),
        (forged().set_f32("bounds", 5, -1e-9), "bounds 1 are"),
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
