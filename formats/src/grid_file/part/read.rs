//! A part read from its file: attributes and tables at once, samples brick by brick.
//!
//! Whatever a part declares is held against its size and its checksums, as of a grid ([`super::super::reader`]); so are the numbers that
//! a grid does not have.

use std::path::{Path, PathBuf};

use sdf_core::grid::owned::Precision;
use sdf_core::grid::sparse::{Scale, brick_counts};

use super::{Codes, GROUP, PartInfo, PartTables, Sides, map_sizes, share};
use crate::grid_file::attributes::Attributes;
use crate::grid_file::coding::Coding;
use crate::grid_file::digests::{DatasetList, Digests, open_dataset};
use crate::grid_file::header::Header;
use crate::grid_file::kept_mesh::MeshReader;
use crate::grid_file::read_sparse::SampleDataset;
use crate::grid_file::{
    About, Compression, DeepValues, GridFault, GridFileError, MeshInfo, SparseInfo, StoredMesh, check, layout,
};
use crate::hdf5::{Dataset, Element, Hdf5Reader, Object, Value};

/// Bricks in a chunk of samples: all that is read for one of them.
pub(super) const CHUNK_BRICKS: usize = 32;

/// Attributes that only parts have, after those of a sparse grid.
pub(super) const PART_ONLY: [&str; 5] = [PART, BRICKS, COMPRESSION, CONTINUITY, SIDES];
/// Index and number of parts.
const PART: &str = "part";
/// Bricks near the surface, and others.
const BRICKS: &str = "part_bricks";
const COMPRESSION: &str = "compress";
const CONTINUITY: &str = "mesh_kind";
const SIDES: &str = "sides";

/// The attributes of a part.
pub(super) struct PartHeader;

impl PartHeader {
    /// All attributes but their checksum.
    pub(super) fn attributes(
        info: &PartInfo,
        mesh: Option<&StoredMesh>,
        bricks: [usize; 2],
        sides: Sides,
        digests_sha256: String,
    ) -> Attributes {
        let sparse = SparseInfo {
            band: info.band,
            precision: info.precision,
            bricks: bricks[0] + bricks[1],
            deep_values: DeepValues::Distances,
        };
        let mesh = mesh.map(|mesh| MeshInfo {
            vertices: mesh.vertices.len(),
            triangles: mesh.triangles.len(),
            is_sign_continuous: mesh.is_sign_continuous,
        });
        let header = Header {
            version: layout::PLAIN_VERSION,
            lattice: info.lattice,
            sparse: Some(sparse),
            precision: info.precision,
            coding: Coding::Plain,
            about: About { slope_bound: 0.0, error_bound: 0.0, ..info.about.clone() },
            mesh,
            digests_sha256,
        };
        let mut attributes = header.attributes();
        let integers = |numbers: &[i128]| Value::Integers(numbers.to_vec());
        let kind = if info.is_sign_continuous { "closed" } else { "open" };
        let part_only = [
            integers(&[info.index.into(), info.count.into()]),
            integers(&bricks.map(|bricks| bricks as i128)),
            Value::Text(info.compression.name().to_owned()),
            Value::Text(kind.to_owned()),
            Value::Text(sides.name().to_owned()),
        ];
        attributes.0.extend(PART_ONLY.into_iter().zip(part_only));
        attributes
    }
}

/// Which part this is, and of how many.
pub(super) fn part_and_count(file: &Hdf5Reader, part: &Object) -> Option<(u32, u32)> {
    let attributes = Attributes::read(file, part, [PART]).ok()?;
    let [index, count] = attributes.integers::<2>(PART).ok()?.map(|number| u32::try_from(number).ok());
    Some((index?, count?)).filter(|(index, count)| index < count)
}

/// An open part: everything but the samples is read and checked.
pub(super) struct PartReader {
    pub path: PathBuf,
    pub info: PartInfo,
    pub mesh_info: Option<MeshInfo>,
    /// Empty once they are taken.
    pub tables: PartTables,
    /// Number of bricks near the surface, and of others.
    pub bricks: [usize; 2],
    pub sides: Sides,
    file: Hdf5Reader<'static>,
    digests: Digests,
    samples: Option<SampleDataset>,
    mesh: Option<MeshReader>,
}

impl PartReader {
    pub(super) fn open(path: &Path) -> Result<Self, GridFileError> {
        Self::read(path).map_err(|fault| fault.with_path(path))
    }

    fn read(path: &Path) -> Result<Self, GridFault> {
        let file = Hdf5Reader::open(path)?;
        let Ok(part) = file.member(None, GROUP) else {
            let what = match file.member(None, "sdf") {
                Ok(_) => "a whole grid, not a part of a bake; give files that `sdftool bake --shard` wrote",
                Err(_) => "an HDF5 file, but not a part of a bake; give files that `sdftool bake --shard` wrote",
            };
            return Err(GridFault::DoesNotJoin(what.to_owned()));
        };
        let (header, attributes) = Header::read_part(&file, &part, PART_ONLY)?;
        let (index, count) = part_and_count(&file, &part).ok_or_else(|| unexpected(PART))?;
        let bricks = attributes.integers::<2>(BRICKS)?.map(|bricks| usize::try_from(bricks).unwrap_or(usize::MAX));
        let compression =
            Compression::from_name(attributes.text(COMPRESSION)?).ok_or_else(|| unexpected(COMPRESSION))?;
        let is_sign_continuous = match attributes.text(CONTINUITY)? {
            "closed" => true,
            "open" => false,
            _ => return Err(unexpected(CONTINUITY)),
        };
        let sides = Sides::from_name(attributes.text(SIDES)?).ok_or_else(|| unexpected(SIDES))?;
        let sparse = header.sparse.ok_or_else(|| unexpected("layout"))?;
        let [slots, nodes] =
            map_sizes(&header.lattice).ok_or_else(|| GridFault::damaged("its lattice has too many slots"))?;
        let all = sparse.bricks;
        if bricks[0].checked_add(bricks[1]) != Some(all) || all > slots.min(layout::MAX_BRICKS) {
            return Err(GridFault::damaged(format!("{bricks:?} bricks where {all} are declared")));
        }
        let mut tables = TableReader { file: &file, part: &part, datasets: DatasetList::default() };
        let samples = match all {
            0 => None,
            _ => Some(SampleDataset::open(&file, &part, all, sparse.precision, &mut tables.datasets)?),
        };
        let node_share = share(nodes, index, count).len();
        let places = tables.open::<u32>("places", all, 3)?;
        let scales = tables.open::<f32>("scales", all, 2)?;
        let roundings = tables.open::<f64>("roundings", all, 1)?;
        let interpolations = tables.open::<f64>("interpolations", all, 1)?;
        let coarse = tables.open::<f32>("coarse", node_share, 1)?;
        let slot_share = if sides == Sides::FirstNodes { 0 } else { share(slots, index, count).len() };
        let slot_sides = tables.open::<u8>("slot_sides", slot_share, 1)?;
        let mut datasets = tables.datasets;
        let mesh = if index == 0 { MeshReader::open(&file, &part, &header, &mut datasets)? } else { None };
        let digests = datasets.read_digests(&file, &part, &header)?;
        let read = Elements { file: &file, digests: &digests };
        let scales = read.all(&scales)?;
        let tables = PartTables {
            near: bricks[0],
            slots: read.all(&places)?.as_chunks().0.to_vec(),
            scales: scales.chunks_exact(2).map(|scale| Scale { base: scale[0], step: scale[1] }).collect(),
            roundings: read.all(&roundings)?,
            interpolations: read.all(&interpolations)?,
            coarse: read.all(&coarse)?,
            sides,
            slot_sides: read.all(&slot_sides)?.iter().map(|side| *side != 0).collect(),
        };
        check::valid_scales(&tables.scales, sparse.precision).map_err(GridFault::damaged)?;
        let counts = brick_counts(&header.lattice);
        let is_outside = |slot: &&[u32; 3]| (0..3).any(|axis| slot[axis] >= counts[axis]);
        if let Some(slot) = tables.slots.iter().find(is_outside) {
            return Err(GridFault::damaged(format!("a brick is at {slot:?} of {counts:?} slots")));
        }
        let is_length = |length: &f64| length.is_finite() && *length >= 0.0;
        if !tables.roundings.iter().chain(&tables.interpolations).all(is_length) {
            return Err(GridFault::damaged("an error of a brick is negative or not finite"));
        }
        let (precision, band, lattice) = (sparse.precision, sparse.band, header.lattice);
        let info =
            PartInfo { index, count, lattice, band, precision, about: header.about, compression, is_sign_continuous };
        let (path, mesh_info) = (path.to_owned(), header.mesh);
        Ok(Self { path, info, mesh_info, tables, bricks, sides, file, digests, samples, mesh })
    }

    /// Codes of some of the bricks, ascending; checked.
    pub(super) fn codes(&self, bricks: &[u32]) -> Result<Codes, GridFault> {
        let Self { file, digests, .. } = self;
        // The samples come first.
        Ok(match &self.samples {
            Some(SampleDataset::F32(samples)) => Codes::F32(digests.rows(file, samples, 0, bricks)?),
            Some(SampleDataset::U16(samples)) => Codes::U16(digests.rows(file, samples, 0, bricks)?),
            Some(SampleDataset::U8(samples)) => Codes::U8(digests.rows(file, samples, 0, bricks)?),
            None => match self.info.precision {
                Precision::F32 => Codes::F32(vec![]),
                Precision::U16 => Codes::U16(vec![]),
                Precision::U8 => Codes::U8(vec![]),
            },
        })
    }

    /// The mesh, which only the first part has.
    pub(super) fn mesh(&self) -> Result<Option<StoredMesh>, GridFault> {
        self.mesh.as_ref().map(|mesh| mesh.read(&self.file, &self.digests)).transpose()
    }
}

/// A dataset and the index of the digest of its first chunk; `None` where the table is empty.
type Table<T> = Option<(Dataset<T>, usize)>;

struct TableReader<'a> {
    file: &'a Hdf5Reader<'static>,
    part: &'a Object,
    datasets: DatasetList,
}

impl TableReader<'_> {
    fn open<T: Element>(&mut self, name: &'static str, rows: usize, columns: usize) -> Result<Table<T>, GridFault> {
        if rows == 0 {
            return Ok(None);
        }
        let shape = [rows, columns];
        let shape = if columns == 1 { &shape[..1] } else { &shape[..] };
        let dataset = open_dataset(self.file, self.part, name, shape)?;
        let first = self.datasets.add(&dataset);
        Ok(Some((dataset, first)))
    }
}

struct Elements<'a> {
    file: &'a Hdf5Reader<'static>,
    digests: &'a Digests,
}

impl Elements<'_> {
    fn all<T: Element>(&self, table: &Table<T>) -> Result<Vec<T>, GridFault> {
        match table {
            Some((dataset, first)) => Ok(self.digests.elements(self.file, dataset, *first)?),
            None => Ok(vec![]),
        }
    }
}

fn unexpected(name: &str) -> GridFault {
    GridFault::damaged(format!("its attribute {name} is not what docs/format.md says"))
}
