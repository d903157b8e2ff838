//! Grid files as docs/format.md describes them, written by a writer of their own, to be falsified.

use std::path::PathBuf;

use rust_hdf5::{H5File, H5Group, LibverBound};
use sdf_core::grid::owned::Precision;
use sdf_formats::grid_file;
use sha2::{Digest, Sha256};
use tempfile::TempDir;

use crate::grid_samples::{BAND, Content, Made, about};

#[derive(Clone)]
pub enum Value {
    Text(String),
    Numbers(Vec<f64>),
    Integers(Vec<u64>),
}

#[derive(Clone)]
pub enum Elements {
    F32(Vec<f32>),
    U32(Vec<u32>),
    U16(Vec<u16>),
    U8(Vec<u8>),
    F64(Vec<f64>),
    /// A dataset of f32 of which only the first chunk is stored, as these compressed bytes.
    FirstChunkOnly(Vec<u8>),
}

#[derive(Clone)]
pub struct Table {
    pub name: &'static str,
    pub shape: Vec<usize>,
    pub chunk: Vec<usize>,
    pub elements: Elements,
}

/// A sparse u16 grid as docs/format.md describes it, to be falsified.
#[derive(Clone)]
pub struct Forged {
    pub attributes: Vec<(&'static str, Value)>,
    pub tables: Vec<Table>,
    /// Replaces the true checksum.
    pub digests_sha256: Option<String>,
    /// The first chunk has another checksum than its own.
    pub is_first_digest_wrong: bool,
}

impl Forged {
    pub fn new() -> Self {
        let made = Made::new([33, 34, 35], Some(Precision::U16));
        let Content::U16(bricks) = &made.content else { panic!("another layout") };
        let (text, about) = (|text: &str| Value::Text(text.to_owned()), about());
        let count = bricks.slots.len();
        let hex: String = about.source.sha256.iter().map(|byte| format!("{byte:02x}")).collect();
        let attributes = vec![
            ("format_version", Value::Integers(vec![4])),
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
            ("kept_mesh", text("none")),
            ("mesh_counts", Value::Integers(vec![0, 0])),
            ("band", Value::Numbers(vec![BAND])),
            ("precision", text("u16")),
            ("brick_side", Value::Integers(vec![8])),
            ("bricks", Value::Integers(vec![count as u64])),
            ("deep_values", text("distances")),
            ("coding", text("differences")),
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
            table("coarse", &[6, 6, 6], Elements::F32(bricks.coarse.to_vec())),
        ];
        Self { attributes, tables, digests_sha256: None, is_first_digest_wrong: false }
    }

    pub fn set(mut self, name: &str, value: Value) -> Self {
        self.attributes.iter_mut().find(|(known, _)| *known == name).unwrap().1 = value;
        self
    }

    /// The same grid as version 2 or 3 has it.
    pub fn version(mut self, version: u64) -> Self {
        let news: [(u64, &[&str]); 2] = [(3, &["deep_values", "kept_mesh", "mesh_counts"]), (4, &["coding"])];
        let is_known = |name: &str| news.iter().all(|(first, names)| version >= *first || !names.contains(&name));
        self.attributes.retain(|(name, _)| is_known(name));
        self.set("format_version", Value::Integers(vec![version]))
    }

    fn has_sha256(&self) -> bool {
        let (_, version) = self.attributes.iter().find(|(name, _)| *name == "format_version").unwrap();
        matches!(version, Value::Integers(version) if version[0] < 4)
    }

    /// With a tetrahedron as its mesh.
    pub fn with_mesh(mut self) -> Self {
        let vertices = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let triangles = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
        let table = |name, elements| Table { name, shape: vec![4, 3], chunk: vec![3, 3], elements };
        self.tables.push(table("mesh_vertices", Elements::F64(vertices.to_vec())));
        self.tables.push(table("mesh_triangles", Elements::U32(triangles.to_vec())));
        self.set("kept_mesh", Value::Text("closed".into())).set("mesh_counts", Value::Integers(vec![4, 4]))
    }

    pub fn change(mut self, name: &str, change: impl FnOnce(&mut Table)) -> Self {
        change(self.tables.iter_mut().find(|table| table.name == name).unwrap());
        self
    }

    pub fn set_f32(self, name: &str, at: usize, value: f32) -> Self {
        self.change(name, |table| match &mut table.elements {
            Elements::F32(elements) => elements[at] = value,
            _ => panic!("not f32"),
        })
    }

    pub fn set_u32(self, name: &str, at: usize, value: u32) -> Self {
        self.change(name, |table| match &mut table.elements {
            Elements::U32(elements) => elements[at] = value,
            _ => panic!("not u32"),
        })
    }

    pub fn write(&self) -> (TempDir, PathBuf) {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("forged.sdf.h5");
        let file = H5File::options().libver(LibverBound::Earliest).create(&path).unwrap();
        let sdf = file.create_group("sdf").unwrap();
        let mut digests = Vec::new();
        for table in &self.tables {
            table.write(&sdf);
            digests.extend(table.digests(self.has_sha256()));
        }
        digests[0] ^= u8::from(self.is_first_digest_wrong);
        let (shape, elements) = if self.has_sha256() {
            (vec![digests.len() / 32, 32], Elements::U8(digests.clone()))
        } else {
            let checksums: Vec<u32> = digests.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
            (vec![checksums.len()], Elements::U32(checksums))
        };
        Table { name: "digests", chunk: shape.clone(), shape, elements }.write(&sdf);
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

    pub fn refusal(&self) -> String {
        let (_folder, path) = self.write();
        let error = grid_file::read(&path).expect_err("not a grid").to_string();
        assert_eq!(error.lines().count(), 1, "{error}");
        error
    }
}

impl Table {
    pub fn write(&self, group: &H5Group) {
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
            Elements::F64(elements) => write!(elements, f64),
            Elements::FirstChunkOnly(packed) => {
                let dataset = group.new_dataset::<f32>().shape(&self.shape).chunk(&self.chunk);
                dataset.shuffle_deflate(4).create(self.name).unwrap().write_chunk_raw(0, packed, 0).unwrap();
            }
        }
    }

    pub fn bytes(&self) -> Vec<u8> {
        match &self.elements {
            Elements::F32(elements) => elements.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Elements::U32(elements) => elements.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Elements::U16(elements) => elements.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Elements::U8(elements) => elements.clone(),
            Elements::F64(elements) => elements.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Elements::FirstChunkOnly(packed) => packed.clone(),
        }
    }

    /// SHA-256 or CRC-32 of the chunks, by sorting each element into its chunk.
    pub fn digests(&self, by_sha256: bool) -> Vec<u8> {
        let bytes = self.bytes();
        if let Elements::FirstChunkOnly(_) = self.elements {
            return vec![0; if by_sha256 { 32 } else { 4 }];
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
        let digest = |chunk: &Vec<u8>| if by_sha256 { Sha256::digest(chunk).to_vec() } else { crc32(chunk) };
        chunks.values().flat_map(digest).collect()
    }
}

/// CRC-32 of docs/format.md, bit by bit.
fn crc32(bytes: &[u8]) -> Vec<u8> {
    let step = |crc: u32| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    let crc = bytes.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| step(crc)));
    (!crc).to_le_bytes().to_vec()
}

/// Delta coding: for each code, the alternating sum over the corners of the cell that ends at it.
pub fn differences(samples: &[u16]) -> Vec<u16> {
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
