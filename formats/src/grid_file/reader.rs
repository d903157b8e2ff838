use std::path::{Path, PathBuf};

use rayon::prelude::*;
use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, BrickSlices, Code, Scale, Sparse};
use sdf_core::grid::{BlockBounds, Dense, Grid, Lattice, Storage, WithBlockBounds};
use sdf_core::{Aabb, Interval};
use sha2::{Digest, Sha256};

use super::classic::{Classic, Dataset, Object};
use super::differences::Differences;
use super::element::Element;
use super::head::{Attributes, Head};
use super::reached::Reached;
use super::tiling::Tile;
use super::{
    About, Fault, GridFileError, Layout, OwnedBricks, OwnedGrid, OwnedSamples, Part, Precision, ReadCount, StoredGrid,
    Summary, check, layout,
};

/// Reads a grid and holds it against its checksums. See [`open`].
pub fn read(path: &Path) -> Result<StoredGrid, GridFileError> {
    open(path)?.read()
}

/// Reads all but the samples of a grid, and holds it against its checksums.
///
/// What is cut short, damaged, not HDF5, not a grid, of another version, or declares more than it holds is refused.
/// Memory stays within some three thousand times the size of the file: deflate packs a number 1032 times at most, and to
/// each number of the coarse grid come two of ours.
pub fn open(path: &Path) -> Result<GridReader, GridFileError> {
    Opened::open(path).map(|opened| GridReader { path: path.to_owned(), opened }).map_err(|fault| fault.at(path))
}

/// An open file of which all but the samples is read and checked.
pub struct GridReader {
    path: PathBuf,
    opened: Opened,
}

impl GridReader {
    pub fn lattice(&self) -> &Lattice {
        &self.opened.head.lattice
    }

    pub fn about(&self) -> &About {
        &self.opened.head.about
    }

    pub fn layout(&self) -> Layout {
        self.opened.head.layout
    }

    pub fn summary(&self) -> Summary {
        let Opened { file, head, parts, .. } = &self.opened;
        Summary {
            lattice: head.lattice,
            layout: head.layout,
            about: head.about.clone(),
            parts: parts.clone(),
            file_bytes: file.file_bytes(),
        }
    }

    /// Reads all samples.
    pub fn read(self) -> Result<StoredGrid, GridFileError> {
        self.opened.grid(None).map_err(|fault| fault.at(&self.path))
    }

    /// Reads the samples that the field needs to answer in `regions`, boxes in its own frame. Elsewhere its samples are zero:
    /// it may be asked for values in the regions alone, and for local bounds anywhere; `bounds` of the whole reads what may
    /// not be there.
    ///
    /// A region in which no sample can be as low as `level` is passed over, for [`sdf_core::contact`] does not ask there
    /// if `level` is its margin. It culls by one more, or less, by rounding: what f32 rounds in the field's own frame is
    /// minded here; of a field placed far off add to the level what it rounds there. Of a region that is not finite nothing
    /// is known, and all is read.
    pub fn read_reached(
        self,
        regions: impl IntoIterator<Item = Aabb>,
        level: f64,
    ) -> Result<StoredGrid, GridFileError> {
        let reached = self.opened.reached(regions, level);
        self.opened.grid(Some(&reached)).map_err(|fault| fault.at(&self.path))
    }
}

struct Opened {
    file: Classic,
    head: Head,
    digests: Digests,
    samples: Samples,
    tables: Tables,
    parts: Vec<Part>,
}

/// The dataset that is read later, its chunks the first that have digests.
enum Samples {
    F32(Dataset<f32>),
    U16(Dataset<u16>),
    U8(Dataset<u8>),
}

/// What stands beside the samples.
enum Tables {
    Dense {
        bounds: Vec<BlockBounds>,
    },
    /// But for the samples.
    Sparse(OwnedBricks<Unread>),
}

/// A sample that is not there yet, and takes no memory.
#[derive(Clone, Copy)]
struct Unread;

impl Code for Unread {
    fn decode(self, _scale: Scale) -> f32 {
        0.0
    }
}

impl Storage for Unread {
    fn corners(&self, _cell: [u32; 3]) -> [f32; 8] {
        [0.0; 8]
    }
}

impl Opened {
    fn open(path: &Path) -> Result<Self, Fault> {
        let mut file = Classic::open(path)?;
        let sdf = file.member(None, "sdf")?;
        let head = Head::read(&mut file, &sdf)?;
        match head.layout {
            Layout::Dense => Self::open_dense(file, &sdf, head),
            Layout::Sparse { bricks, precision, .. } => Self::open_sparse(file, &sdf, head, bricks, precision),
        }
    }

    fn open_dense(mut file: Classic, sdf: &Object, head: Head) -> Result<Self, Fault> {
        let places = layout::place_count(&head.lattice).ok_or_else(too_many_places)?;
        let samples = vtkhdf(&mut file, &head.lattice)?;
        let bounds = dataset::<f32>(&mut file, sdf, "bounds", &[places, 3])?;
        let mut parts = Parts::default();
        parts.add("distance", &samples);
        let bounds_at = parts.add("bounds", &bounds);
        let digests = parts.finish(&mut file, sdf, &head)?;
        let tables = Tables::Dense { bounds: node_bounds(&digests.elements(&mut file, &bounds, bounds_at)?)? };
        Ok(Self { file, head, digests, samples: Samples::F32(samples), tables, parts: parts.parts })
    }

    fn open_sparse(
        mut file: Classic,
        sdf: &Object,
        head: Head,
        bricks: usize,
        precision: Precision,
    ) -> Result<Self, Fault> {
        let mut parts = Parts::default();
        let shape = layout::bricks_shape(bricks);
        let samples = match precision {
            Precision::F32 => Samples::F32(parts.samples(&mut file, sdf, &shape)?),
            Precision::U16 => Samples::U16(parts.samples(&mut file, sdf, &shape)?),
            Precision::U8 => Samples::U8(parts.samples(&mut file, sdf, &shape)?),
        };
        let bounds = dataset::<f32>(&mut file, sdf, "bounds", &[bricks, 3])?;
        let places = dataset::<u32>(&mut file, sdf, "places", &[bricks, 3])?;
        let scales = dataset::<f32>(&mut file, sdf, "scales", &[bricks, 2])?;
        let errors = dataset::<f32>(&mut file, sdf, "errors", &[bricks])?;
        let coarse = dataset::<f32>(&mut file, sdf, "coarse", &layout::coarse_shape(&head.lattice))?;
        let bounds_at = parts.add("bounds", &bounds);
        let places_at = parts.add("places", &places);
        let scales_at = parts.add("scales", &scales);
        let errors_at = parts.add("errors", &errors);
        let coarse_at = parts.add("coarse", &coarse);
        let digests = parts.finish(&mut file, sdf, &head)?;
        // First, for as many numbers as it has are the table's and more, and then they are there.
        let coarse = digests.elements(&mut file, &coarse, coarse_at)?;
        let places = digests.elements(&mut file, &places, places_at)?;
        let places: Vec<[u32; 3]> = places.chunks_exact(3).map(|place| [place[0], place[1], place[2]]).collect();
        let scales = digests.elements(&mut file, &scales, scales_at)?;
        let errors = digests.elements(&mut file, &errors, errors_at)?;
        let tables = OwnedBricks {
            table: check::table(&head.lattice, &places).map_err(Fault::damaged)?,
            places,
            scales: scales.chunks_exact(2).map(|scale| Scale { base: scale[0], step: scale[1] }).collect(),
            samples: vec![Unread; bricks * BRICK_SAMPLES],
            bounds: node_bounds(&digests.elements(&mut file, &bounds, bounds_at)?)?,
            errors,
            coarse,
        };
        check::sound_scales(&tables.scales, precision).map_err(Fault::damaged)?;
        check::sound_errors(&tables.errors).map_err(Fault::damaged)?;
        Ok(Self { file, head, digests, samples, tables: Tables::Sparse(tables), parts: parts.parts })
    }

    fn reached(&self, regions: impl IntoIterator<Item = Aabb>, level: f64) -> Reached {
        let lattice = &self.head.lattice;
        match (&self.tables, &self.samples) {
            (Tables::Dense { bounds }, Samples::F32(_)) => {
                let storage = WithBlockBounds::new(lattice, Unread, bounds).expect("one for each place was read");
                Reached::by_regions(&self.unread(storage), regions, level)
            }
            (Tables::Dense { .. }, _) => unreachable!("dense samples are f32"),
            (Tables::Sparse(bricks), _) => {
                let slices = BrickSlices {
                    table: &bricks.table,
                    scales: &bricks.scales,
                    samples: &bricks.samples,
                    bounds: &bricks.bounds,
                    coarse: &bricks.coarse,
                };
                let storage = Sparse::new(lattice, slices).expect("its tables have been checked");
                Reached::by_regions(&self.unread(storage), regions, level)
            }
        }
    }

    /// A grid that knows the bounds of its nodes and no sample.
    fn unread<S: Storage>(&self, storage: S) -> Grid<S> {
        Grid::new(self.head.lattice, storage, self.head.about.slope_bound).expect("its slope bound has been checked")
    }

    /// With all samples, or those of the blocks that are reached.
    fn grid(mut self, reached: Option<&Reached>) -> Result<StoredGrid, Fault> {
        let lattice = self.head.lattice;
        let (samples, blocks, of_blocks) = match (self.samples, self.tables) {
            (Samples::F32(dataset), Tables::Dense { bounds }) => {
                let is_wanted = |tile: Tile| reached.is_none_or(|reached| reached.meets(tile));
                let piece = reached.map_or(ALL, |_| [BRICK as usize; 3]);
                let samples = self.digests.some_elements(&mut self.file, &dataset, 0, piece, is_wanted)?;
                let tiling = dataset.tiling();
                let of_chunks = dataset.chunk_count();
                let chunks = (0..of_chunks).filter(|at| is_wanted(tiling.tile(*at))).count();
                let dense = Dense::new(&lattice, samples).expect("the shape was held against the lattice");
                let bounded = WithBlockBounds::new(&lattice, dense, bounds).expect("one for each place was read");
                (OwnedSamples::Dense(bounded), chunks, of_chunks)
            }
            (samples, Tables::Sparse(bricks)) => {
                let of_bricks = bricks.places.len();
                let file = &mut self.file;
                let (samples, blocks) = match samples {
                    Samples::F32(dataset) => {
                        let (sparse, read) = self.digests.sparse(file, &lattice, &dataset, bricks, reached)?;
                        (OwnedSamples::SparseF32(sparse), read)
                    }
                    Samples::U16(dataset) => {
                        let (sparse, read) = self.digests.sparse(file, &lattice, &dataset, bricks, reached)?;
                        (OwnedSamples::SparseU16(sparse), read)
                    }
                    Samples::U8(dataset) => {
                        let (sparse, read) = self.digests.sparse(file, &lattice, &dataset, bricks, reached)?;
                        (OwnedSamples::SparseU8(sparse), read)
                    }
                };
                (samples, blocks, of_bricks)
            }
            (_, Tables::Dense { .. }) => unreachable!("dense samples are f32"),
        };
        let about = self.head.about;
        let grid = OwnedGrid::new(lattice, samples, about.slope_bound).expect("the bound has been checked");
        let read = ReadCount { bytes: self.file.bytes_read(), blocks, of_blocks };
        Ok(StoredGrid { grid, layout: self.head.layout, about, read })
    }
}

/// The samples, once all that VTK is told about them agrees with /sdf.
fn vtkhdf(file: &mut Classic, lattice: &Lattice) -> Result<Dataset<f32>, Fault> {
    let group = file.member(None, "VTKHDF")?;
    let names = ["Version", "Type", "WholeExtent", "Origin", "Spacing", "Direction"];
    let attributes = Attributes::read(file, &group, names)?;
    let agree = attributes.integers("Version")? == layout::VTKHDF_VERSION.map(i128::from)
        && attributes.text("Type")? == "ImageData"
        && attributes.integers("WholeExtent")? == layout::whole_extent(lattice).map(i128::from)
        && attributes.numbers("Origin")?.map(f64::to_bits) == lattice.origin().map(f64::to_bits)
        && attributes.numbers("Spacing")? == [lattice.spacing(); 3]
        && attributes.numbers("Direction")? == layout::IDENTITY;
    let points = file.member(Some(&group), "PointData")?;
    let object = file.member(Some(&points), "distance")?;
    let agree = agree
        && Attributes::read(file, &points, ["Scalars"])?.text("Scalars")? == "distance"
        && Attributes::read(file, &object, ["Attribute"])?.text("Attribute")? == "Scalars";
    if !agree {
        return Err(Fault::damaged("/VTKHDF and /sdf do not agree"));
    }
    file.dataset(&object, "distance", &layout::shape(lattice))
}

fn dataset<T: Element>(
    file: &mut Classic,
    sdf: &Object,
    name: &'static str,
    shape: &[usize],
) -> Result<Dataset<T>, Fault> {
    let object = file.member(Some(sdf), name)?;
    file.dataset(&object, name, shape)
}

/// The datasets, in the order of their digests.
#[derive(Default)]
struct Parts {
    parts: Vec<Part>,
    chunks: usize,
}

impl Parts {
    /// Returns which digest is that of its first chunk.
    fn add<T: Element>(&mut self, name: &'static str, dataset: &Dataset<T>) -> usize {
        self.parts.push(Part { name, stored_bytes: dataset.stored_bytes() });
        let first = self.chunks;
        self.chunks += dataset.chunk_count();
        first
    }

    fn samples<T: Element>(&mut self, file: &mut Classic, sdf: &Object, shape: &[usize]) -> Result<Dataset<T>, Fault> {
        let samples = dataset(file, sdf, "samples", shape)?;
        self.add("samples", &samples);
        Ok(samples)
    }

    fn finish(&mut self, file: &mut Classic, sdf: &Object, head: &Head) -> Result<Digests, Fault> {
        let dataset = dataset::<u8>(file, sdf, "digests", &[self.chunks, layout::DIGEST_BYTES])?;
        self.parts.push(Part { name: "digests", stored_bytes: dataset.stored_bytes() });
        // Datasets that share their chunks would unfold to more than the file could hold.
        if self.parts.iter().map(|part| part.stored_bytes).sum::<u64>() > file.file_bytes() {
            return Err(Fault::damaged("its datasets share their chunks"));
        }
        let digests = file.elements(&dataset, ALL, |_| true, |_, _| Ok(()))?;
        if layout::hex(&Sha256::digest(&digests)) != head.digests_sha256 {
            return Err(Fault::damaged("checksum of the digests does not match"));
        }
        Ok(Digests(digests))
    }
}

/// The SHA-256 of each chunk, one after the other.
struct Digests(Vec<u8>);

impl Digests {
    /// All of a dataset whose first chunk has the digest `first`.
    fn elements<T: Element>(&self, file: &mut Classic, dataset: &Dataset<T>, first: usize) -> Result<Vec<T>, Fault> {
        self.some_elements(file, dataset, first, ALL, |_| true)
    }

    /// See [`Dataset::read`].
    fn some_elements<T: Element>(
        &self,
        file: &mut Classic,
        dataset: &Dataset<T>,
        first: usize,
        piece: [usize; 3],
        is_wanted: impl Fn(Tile) -> bool + Sync,
    ) -> Result<Vec<T>, Fault> {
        file.elements(dataset, piece, is_wanted, |at, bytes| {
            let digest = &self.0[(first + at) * layout::DIGEST_BYTES..][..layout::DIGEST_BYTES];
            if Sha256::digest(bytes)[..] == *digest {
                return Ok(());
            }
            Err(Fault::damaged(format!("checksum of a chunk of {} does not match", dataset.name())))
        })
    }

    /// The bricks with their samples, and how many stand in chunks that were read.
    fn sparse<C: Code + Differences>(
        &self,
        file: &mut Classic,
        lattice: &Lattice,
        dataset: &Dataset<C>,
        bricks: OwnedBricks<Unread>,
        reached: Option<&Reached>,
    ) -> Result<(Sparse<OwnedBricks<C>>, usize), Fault> {
        let is_reached = |place: &[u32; 3]| reached.is_none_or(|reached| reached.holds(place.map(|at| at as usize)));
        let reached: Vec<bool> = bricks.places.iter().map(is_reached).collect();
        let is_wanted = |tile: Tile| reached[tile.first[1]..][..tile.size[1]].iter().any(|reached| *reached);
        let mut samples = self.some_elements(file, dataset, 0, [1, 1, BRICK_SAMPLES], is_wanted)?;
        let of_bricks = samples.par_chunks_exact_mut(BRICK_SAMPLES).zip(&reached);
        of_bricks.filter(|(_, reached)| **reached).for_each(|(brick, _)| C::sum(brick));
        let [_, chunk_bricks, _] = dataset.tiling().sides();
        let of_chunks = reached.chunks(chunk_bricks).filter(|chunk| chunk.contains(&true));
        let read = of_chunks.map(<[bool]>::len).sum();
        let OwnedBricks { table, places, scales, bounds, errors, coarse, .. } = bricks;
        let bricks = OwnedBricks { table, places, scales, samples, bounds, errors, coarse };
        Ok((Sparse::new(lattice, bricks).expect("its tables have been checked"), read))
    }
}

/// Of a dataset's axes, for a piece that is all of a chunk.
const ALL: [usize; 3] = [usize::MAX; 3];

fn node_bounds(numbers: &[f32]) -> Result<Vec<BlockBounds>, Fault> {
    let of = |numbers: &[f32]| BlockBounds {
        range: Interval { lower: numbers[0], upper: numbers[1] },
        slope_bound: numbers[2],
    };
    let bounds: Vec<BlockBounds> = numbers.chunks_exact(3).map(of).collect();
    check::sound_bounds(&bounds).map_err(Fault::damaged)?;
    Ok(bounds)
}

fn too_many_places() -> Fault {
    Fault::damaged("more places than can be counted")
}
