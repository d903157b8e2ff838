//! All parts of one bake together: refused by name where they are not, else one list of bricks, and a grid file of them.

use std::io;
use std::path::{Path, PathBuf};

use sdf_core::grid::owned::Precision;
use sdf_core::grid::sparse::BRICK_SAMPLES;

use super::read::PartReader;
use super::{Codes, PartInfo, PartTables};
use crate::grid_file::write::SamplesElsewhere;
use crate::grid_file::{About, GridFault, GridFileError, MeshInfo, Samples, StoredMesh, check, coding, write};
use crate::hdf5::{Elements, Tile, Tiling};

/// The parts of one bake, whose bricks are counted so: those near the surface of all parts, then the others of all parts.
pub struct JoinedParts {
    /// In the order of their indices.
    parts: Vec<PartReader>,
    /// For each part and for the end: bricks near the surface before it.
    near: Vec<usize>,
    /// For each part and for the end: other bricks before it, and all near the surface.
    others: Vec<usize>,
}

impl JoinedParts {
    /// Opens parts, in any order. Refuses what does not make one grid: parts of different meshes, options or versions, parts that
    /// are missing or there twice.
    pub fn open(paths: &[PathBuf]) -> Result<Self, GridFileError> {
        let mut parts: Vec<PartReader> = vec![];
        for path in paths {
            let part = PartReader::open(path)?;
            let difference = parts.first().and_then(|first| difference(first, &part));
            let twin = parts.iter().find(|other| other.info.index == part.info.index);
            let PartInfo { index, count, .. } = part.info;
            let twin = twin.map(|twin| format!("is part {index}/{count}, and so is {}", twin.path.display()));
            if let Some(what) = difference.or(twin) {
                return Err(GridFault::DoesNotJoin(what).with_path(path));
            }
            parts.push(part);
        }
        parts.sort_by_key(|part| part.info.index);
        let Some(PartInfo { count, .. }) = parts.first().map(|part| part.info.clone()) else {
            return Err(GridFault::DoesNotJoin("no parts".to_owned()).with_path(Path::new("")));
        };
        let is_missing = |index: &u32| parts.get(*index as usize).is_none_or(|part| part.info.index != *index);
        if let Some(missing) = (0..count).find(is_missing) {
            let what = format!("is one of {count} parts, and part {missing}/{count} is missing");
            return Err(GridFault::DoesNotJoin(what).with_path(&parts[0].path));
        }
        let sums = |start: usize, kind: usize| {
            let counts = parts.iter().map(|part| part.bricks[kind]);
            let mut sums = vec![start];
            counts.for_each(|count| sums.push(sums[sums.len() - 1] + count));
            sums
        };
        let near = sums(0, 0);
        let others = sums(near[parts.len()], 1);
        Ok(Self { parts, near, others })
    }

    /// Facts that the parts have in common, as the first states them.
    pub fn info(&self) -> &PartInfo {
        &self.parts[0].info
    }

    /// Size of the mesh that the grid keeps.
    pub fn mesh_info(&self) -> Option<MeshInfo> {
        self.parts[0].mesh_info
    }

    /// The mesh that the grid keeps.
    pub fn mesh(&self) -> Result<Option<StoredMesh>, GridFileError> {
        self.parts[0].mesh().map_err(|fault| fault.with_path(&self.parts[0].path))
    }

    /// The tables of all parts in one, taken out: a second call returns empty tables.
    pub fn take_tables(&mut self) -> PartTables {
        let sides = self.parts[0].sides;
        let mut all = PartTables { near: self.near[self.parts.len()], sides, ..PartTables::default() };
        let mut tables: Vec<PartTables> = self.parts.iter_mut().map(|part| std::mem::take(&mut part.tables)).collect();
        if let [one] = &mut tables[..] {
            return std::mem::take(one);
        }
        for is_near in [true, false] {
            for table in &tables {
                let range = if is_near { 0..table.near } else { table.near..table.slots.len() };
                all.slots.extend(&table.slots[range.clone()]);
                all.scales.extend(&table.scales[range.clone()]);
                all.roundings.extend(&table.roundings[range.clone()]);
                all.interpolations.extend(&table.interpolations[range]);
            }
        }
        for table in &mut tables {
            append(&mut all.coarse, &mut table.coarse);
            append(&mut all.slot_sides, &mut table.slot_sides);
        }
        all
    }

    /// Codes of some bricks, ascending.
    pub fn codes(&self, bricks: &[u32]) -> Result<Codes, GridFileError> {
        let mut all = match self.info().precision {
            Precision::F32 => Codes::F32(Vec::new()),
            Precision::U16 => Codes::U16(Vec::new()),
            Precision::U8 => Codes::U8(Vec::new()),
        };
        for bricks in bricks.chunk_by(|a, b| self.holder(*a).0 == self.holder(*b).0) {
            let (part, first) = self.holder(bricks[0]);
            let part = &self.parts[part];
            let local: Vec<u32> = bricks.iter().map(|brick| (*brick as usize - first.0 + first.1) as u32).collect();
            let mut codes = part.codes(&local).map_err(|fault| fault.with_path(&part.path))?;
            match (&mut all, &mut codes) {
                (Codes::F32(all), Codes::F32(codes)) => append(all, codes),
                (Codes::U16(all), Codes::U16(codes)) => append(all, codes),
                (Codes::U8(all), Codes::U8(codes)) => append(all, codes),
                _ => unreachable!("parts of different precision were refused"),
            }
        }
        Ok(all)
    }

    /// The part of a brick, and the first brick of its kind there: its number here and in the part.
    fn holder(&self, brick: u32) -> (usize, (usize, usize)) {
        let brick = brick as usize;
        let is_near = brick < self.near[self.parts.len()];
        let sums = if is_near { &self.near } else { &self.others };
        // Empty parts begin where the next begins.
        let part = sums.partition_point(|first| *first <= brick).clamp(1, self.parts.len()) - 1;
        (part, (sums[part], if is_near { 0 } else { self.parts[part].bricks[0] }))
    }
}

/// Moves all elements, without a copy if they are the first.
fn append<T>(all: &mut Vec<T>, more: &mut Vec<T>) {
    if all.is_empty() { std::mem::swap(all, more) } else { all.append(more) }
}

/// In which way two parts are not of one bake; the path of the first is named.
fn difference(a: &PartReader, b: &PartReader) -> Option<String> {
    let other = a.path.display();
    let (x, y) = (&a.info, &b.info);
    let of = |what: &str, here: &dyn std::fmt::Display, there: &dyn std::fmt::Display| {
        format!("is a part of another bake than {other}: {what} {here}, there {there}")
    };
    let (source, other_source) = (&y.about.source, &x.about.source);
    if source.sha256 != other_source.sha256 || source.triangles != other_source.triangles {
        return Some(format!("is of another mesh than {other}: {}, there {}", source.name, other_source.name));
    }
    if x.about.tool != y.about.tool {
        return Some(of("baked by", &y.about.tool, &x.about.tool));
    }
    if x.about.options != y.about.options {
        return Some(of("options", &y.about.options, &x.about.options));
    }
    if x.compression != y.compression {
        return Some(of("--compress", &y.compression.name(), &x.compression.name()));
    }
    if x.count != y.count {
        return Some(of("number of parts", &y.count, &x.count));
    }
    if source.name != other_source.name {
        return Some(of("mesh file", &source.name, &other_source.name));
    }
    let rest = |part: &PartReader| {
        let PartInfo { index: _, count: _, lattice, band, precision, about, compression: _, is_sign_continuous } =
            part.info.clone();
        (lattice, band.to_bits(), precision, about, is_sign_continuous, part.mesh_info, part.sides)
    };
    (rest(a) != rest(b)).then(|| format!("does not fit {other}, though both state the same mesh and options"))
}

/// Samples of a grid's bricks in parts. `place` gives the brick's number there, which grows with the brick.
struct SamplesInParts<'a> {
    parts: &'a JoinedParts,
    place: &'a (dyn Fn(u32) -> u32 + Sync),
}

macro_rules! elements {
    ($code:ty, $precision:ident) => {
        impl Elements<$code> for SamplesInParts<'_> {
            fn read(&self, _tiling: &Tiling, tile: Tile, elements: &mut Vec<$code>) -> io::Result<()> {
                debug_assert_eq!(tile.size[2], BRICK_SAMPLES);
                let bricks = tile.first[1] as u32..(tile.first[1] + tile.size[1]) as u32;
                let places: Vec<u32> = bricks.map(self.place).collect();
                match self.parts.codes(&places).map_err(io::Error::other)? {
                    Codes::$precision(mut codes) => Ok(append(elements, &mut codes)),
                    _ => Err(io::Error::other("samples of another precision than the grid has")),
                }
            }
        }
    };
}

elements!(f32, F32);
elements!(u16, U16);
elements!(u8, U8);

/// Writes the grid of joined parts at `path`: the bytes that [`write_with`](super::super::write_with) would write. `samples` has all but
/// the samples of its bricks; `place` gives the number of a brick among those of the parts, which grows with the brick.
pub fn write_joined<'a>(
    path: &Path,
    parts: &JoinedParts,
    samples: impl Into<Samples<'a>>,
    place: &(dyn Fn(u32) -> u32 + Sync),
    about: &About,
    mesh: Option<&StoredMesh>,
) -> Result<(), GridFault> {
    let PartInfo { lattice, precision, compression, .. } = parts.info();
    let samples = samples.into();
    let coding = coding::Coding::of(*compression);
    let header = check::checked_header(lattice, &samples, about, mesh, coding, false).map_err(GridFault::Refused)?;
    let in_parts = SamplesInParts { parts, place };
    let elsewhere = match precision {
        Precision::F32 => SamplesElsewhere::F32(&in_parts),
        Precision::U16 => SamplesElsewhere::U16(&in_parts),
        Precision::U8 => SamplesElsewhere::U8(&in_parts),
    };
    write::write(path, write::Contents { samples, elsewhere: Some(elsewhere), mesh, header, compression: *compression })
}
