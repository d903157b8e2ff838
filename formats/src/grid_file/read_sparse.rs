//! Sparse grids: bricks of 8 × 8 × 8 samples near the surface, over a coarse grid. Dense grids of codes: a brick in every slot.

use sdf_core::Aabb;
use sdf_core::grid::owned::{BlockCode, Blocks, Layout, OwnedBricks, OwnedStorage, Precision, no_coarse_grid};
use sdf_core::grid::sparse::{BRICK_SAMPLES, Code, NO_BRICK, Scale, Sparse};
use sdf_core::grid::{BlockBounds, Lattice};

use super::block_mask::BlockMask;
use super::coarse_reader::CoarseReader;
use super::coding::{BrickCoding, Coding};
use super::digests::{DatasetList, Digests, open_dataset};
use super::header::Header;
use super::kept_mesh::MeshReader;
use super::placeholder::{SamplePlaceholder, placeholder_grid};
use super::read_dense::Opened;
use super::{GridFault, ReadCount, check, layout, layout_of};
use crate::hdf5::{Dataset, Hdf5Reader, Object, Tile};

const CHECKED: &str = "the tables were checked";

/// Index of the first digest of the samples: they come first.
const SAMPLES_DIGEST: usize = 0;

/// A sparse grid, or a dense one of codes, whose samples and coarse grid are not read yet, but all tables of its bricks.
pub(super) struct SparseReader {
    layout: Layout,
    samples: SampleDataset,
    coding: Coding,
    tables: BrickTables,
    /// `None` of a dense grid.
    coarse: Option<CoarseReader>,
}

/// Tables of bricks beside their samples, as [`OwnedBricks`] has them.
struct BrickTables {
    table: Blocks<u32>,
    slots: Vec<[u32; 3]>,
    scales: Vec<Scale>,
    bounds: Vec<BlockBounds>,
    errors: Vec<f32>,
}

impl BrickTables {
    fn with_samples<C>(self, samples: Vec<C>, coarse: Blocks<f32>) -> OwnedBricks<C> {
        let Self { table, slots, scales, bounds, errors } = self;
        OwnedBricks { table, slots, scales, samples, bounds, errors, coarse }
    }
}

pub(super) enum SampleDataset {
    F32(Dataset<f32>),
    U16(Dataset<u16>),
    U8(Dataset<u8>),
}

impl SparseReader {
    pub(super) fn open(
        file: &Hdf5Reader,
        sdf: &Object,
        header: &Header,
        bricks: usize,
    ) -> Result<Opened<Self>, GridFault> {
        let precision = header.precision;
        let mut datasets = DatasetList::default();
        let samples = SampleDataset::open(file, sdf, bricks, precision, &mut datasets)?;
        let bounds = open_dataset::<f32>(file, sdf, "bounds", &[bricks, 3])?;
        let slots = open_dataset::<u32>(file, sdf, "places", &[bricks, 3])?;
        let scales = open_dataset::<f32>(file, sdf, "scales", &[bricks, 2])?;
        let bounds_digest = datasets.add(&bounds);
        let slots_digest = datasets.add(&slots);
        let scales_digest = datasets.add(&scales);
        let layout = layout_of(header.sparse);
        let more = match layout {
            Layout::Dense => None,
            Layout::Sparse => {
                let errors = open_dataset::<f32>(file, sdf, "errors", &[bricks])?;
                let coarse = open_dataset::<f32>(file, sdf, "coarse", &layout::coarse_shape(&header.lattice))?;
                let digests = [datasets.add(&errors), datasets.add(&coarse)];
                Some((errors, coarse, digests))
            }
        };
        let mesh = MeshReader::open(file, sdf, header, &mut datasets)?;
        let digests = datasets.read_digests(file, sdf, header)?;
        // The coarse grid's chunks are all there: a file that holds them justifies the memory of a table of slots. So do the slots of a
        // dense grid.
        let (errors, coarse) = match more {
            None => (vec![], None),
            Some((errors, coarse, [errors_digest, coarse_digest])) => {
                let coarse = CoarseReader::new(&header.lattice, coarse, coarse_digest)?;
                (digests.elements(file, &errors, errors_digest)?, Some(coarse))
            }
        };
        let slots = digests.elements(file, &slots, slots_digest)?;
        let slots: Vec<[u32; 3]> = slots.chunks_exact(3).map(|slot| [slot[0], slot[1], slot[2]]).collect();
        let scales = digests.elements(file, &scales, scales_digest)?;
        let tables = BrickTables {
            table: check::brick_table(&header.lattice, &slots).map_err(GridFault::damaged)?,
            slots,
            scales: scales.chunks_exact(2).map(|scale| Scale { base: scale[0], step: scale[1] }).collect(),
            bounds: check::block_bounds(&digests.elements(file, &bounds, bounds_digest)?)?,
            errors,
        };
        check::valid_scales(&tables.scales, precision).map_err(GridFault::damaged)?;
        check::valid_errors(&tables.errors).map_err(GridFault::damaged)?;
        Ok((Self { layout, samples, coding: header.coding, tables, coarse }, digests, mesh))
    }

    /// Reads the coarse grid near the regions, and tells the blocks needed for queries there that reach `level`.
    pub(super) fn mask(
        mut self,
        file: &Hdf5Reader,
        digests: &Digests,
        header: &Header,
        regions: impl IntoIterator<Item = Aabb>,
        level: f64,
    ) -> Result<(Self, BlockMask), GridFault> {
        let regions: Vec<Aabb> = regions.into_iter().collect();
        let nodes = match &mut self.coarse {
            Some(coarse) => {
                coarse.read_near(file, digests, &header.lattice, &regions)?;
                coarse.lend_nodes()
            }
            None => no_coarse(&header.lattice)?,
        };
        let Self { layout, tables, samples, coding, mut coarse } = self;
        let placeholders: Vec<SamplePlaceholder> = vec![SamplePlaceholder; tables.scales.len() * BRICK_SAMPLES];
        let storage = tables.with_samples(placeholders, nodes).into_storage(&header.lattice).expect(CHECKED);
        let mask = BlockMask::needed(&placeholder_grid(header, &storage), regions, level);
        let OwnedBricks { table, slots, scales, bounds, errors, coarse: nodes, .. } = storage.into_bricks();
        let tables = BrickTables { table, slots, scales, bounds, errors };
        if let Some(coarse) = &mut coarse {
            coarse.take_back(nodes);
        }
        Ok((Self { layout, samples, coding, tables, coarse }, mask))
    }

    /// Checks the checksums of all samples and of the coarse grid.
    pub(super) fn check(&self, file: &Hdf5Reader, digests: &Digests) -> Result<(), GridFault> {
        match &self.samples {
            SampleDataset::F32(dataset) => digests.check_all(file, dataset, SAMPLES_DIGEST)?,
            SampleDataset::U16(dataset) => digests.check_all(file, dataset, SAMPLES_DIGEST)?,
            SampleDataset::U8(dataset) => digests.check_all(file, dataset, SAMPLES_DIGEST)?,
        }
        self.coarse.as_ref().map_or(Ok(()), |coarse| coarse.check(file, digests))
    }

    /// Reads all samples, or those of the bricks in `mask`, and says how much of the file was read.
    pub(super) fn read(
        self,
        file: &Hdf5Reader,
        digests: &Digests,
        lattice: &Lattice,
        mask: Option<&BlockMask>,
    ) -> Result<(OwnedStorage, ReadCount), GridFault> {
        let total_blocks = self.tables.slots.len();
        let coarse = match self.coarse {
            Some(mut coarse) => {
                if mask.is_none() {
                    coarse.read_all(file, digests)?;
                }
                coarse.into_nodes()
            }
            None => no_coarse(lattice)?,
        };
        let bricks = BrickReader { file, digests, lattice, mask, coding: self.coding };
        let (samples, blocks) = match self.samples {
            SampleDataset::F32(dataset) => {
                let (sparse, blocks) = bricks.read(&dataset, self.tables, coarse)?;
                (OwnedStorage::SparseF32(sparse), blocks)
            }
            SampleDataset::U16(dataset) => {
                let (sparse, blocks) = bricks.read(&dataset, self.tables, coarse)?;
                (storage(sparse, self.layout), blocks)
            }
            SampleDataset::U8(dataset) => {
                let (sparse, blocks) = bricks.read(&dataset, self.tables, coarse)?;
                (storage(sparse, self.layout), blocks)
            }
        };
        Ok((samples, ReadCount { bytes: file.bytes_read(), blocks, total_blocks }))
    }
}

fn storage<C: BlockCode>(bricks: Sparse<OwnedBricks<C>>, layout: Layout) -> OwnedStorage {
    match layout {
        Layout::Dense => OwnedStorage::dense_bricks(bricks).expect("there are as many bricks as slots"),
        Layout::Sparse => C::storage(bricks),
    }
}

fn no_coarse(lattice: &Lattice) -> Result<Blocks<f32>, GridFault> {
    no_coarse_grid(lattice).ok_or_else(|| GridFault::damaged("too many brick slots"))
}

impl SampleDataset {
    pub(super) fn open(
        file: &Hdf5Reader,
        sdf: &Object,
        bricks: usize,
        precision: Precision,
        datasets: &mut DatasetList,
    ) -> Result<Self, GridFault> {
        let shape = layout::bricks_shape(bricks);
        Ok(match precision {
            Precision::F32 => {
                let samples = open_dataset(file, sdf, "samples", &shape)?;
                datasets.add(&samples);
                Self::F32(samples)
            }
            Precision::U16 => {
                let samples = open_dataset(file, sdf, "samples", &shape)?;
                datasets.add(&samples);
                Self::U16(samples)
            }
            Precision::U8 => {
                let samples = open_dataset(file, sdf, "samples", &shape)?;
                datasets.add(&samples);
                Self::U8(samples)
            }
        })
    }
}

/// Reads samples of any precision.
struct BrickReader<'a> {
    file: &'a Hdf5Reader<'a>,
    digests: &'a Digests,
    lattice: &'a Lattice,
    mask: Option<&'a BlockMask>,
    coding: Coding,
}

impl BrickReader<'_> {
    /// The bricks with their samples, and how many bricks lie in chunks that were read. Of a part, the bricks that are needed come
    /// first, and memory is taken for their samples alone.
    fn read<C: Code + BrickCoding>(
        &self,
        dataset: &Dataset<C>,
        tables: BrickTables,
        coarse: Blocks<f32>,
    ) -> Result<(Sparse<OwnedBricks<C>>, usize), GridFault> {
        let is_slot_needed =
            |slot: &[u32; 3]| self.mask.is_none_or(|mask| mask.contains(slot.map(|index| index as usize)));
        let is_brick_needed: Vec<bool> = tables.slots.iter().map(is_slot_needed).collect();
        let [_, chunk_bricks, chunk_samples] = dataset.tiling().sides();
        let chunks_read = is_brick_needed.chunks(chunk_bricks).filter(|chunk| chunk.contains(&true));
        let bricks_read = chunks_read.map(<[bool]>::len).sum();
        // Chunks that cut bricks are none of ours.
        let is_partial = chunk_samples == BRICK_SAMPLES && is_brick_needed.contains(&false);
        let (tables, mut samples) = if is_partial {
            let (tables, needed) = with_needed_first(tables, &is_brick_needed);
            (tables, self.digests.rows(self.file, dataset, SAMPLES_DIGEST, &needed)?)
        } else {
            let is_needed = |tile: Tile| is_brick_needed[tile.first[1]..][..tile.size[1]].contains(&true);
            let piece = [1, 1, BRICK_SAMPLES];
            (tables, self.digests.elements_in(self.file, dataset, SAMPLES_DIGEST, piece, is_needed)?)
        };
        if self.coding != Coding::Plain {
            sdf_parallel::for_each(
                samples.chunks_mut(BRICKS_AT_A_TIME * BRICK_SAMPLES).collect(),
                |bricks: &mut [C]| {
                    bricks.chunks_exact_mut(BRICK_SAMPLES).for_each(|brick| C::decode_brick(brick, self.coding));
                },
            );
        }
        let bricks = tables.with_samples(samples, coarse);
        Ok((bricks.into_storage_of_first_samples(self.lattice).expect(CHECKED), bricks_read))
    }
}

/// Bricks that a thread decodes at once.
const BRICKS_AT_A_TIME: usize = 64;

/// The same bricks, those that are needed first; and these, as they were numbered.
fn with_needed_first(tables: BrickTables, is_needed: &[bool]) -> (BrickTables, Vec<u32>) {
    fn sorted<T: Copy>(column: &[T], order: &[u32]) -> Vec<T> {
        order.iter().map(|brick| column[*brick as usize]).collect()
    }
    let bricks = 0..is_needed.len() as u32;
    let needed: Vec<u32> = bricks.clone().filter(|brick| is_needed[*brick as usize]).collect();
    let mut order = needed.clone();
    order.extend(bricks.filter(|brick| !is_needed[*brick as usize]));
    let BrickTables { mut table, slots, scales, bounds, errors } = tables;
    let mut place = vec![NO_BRICK; order.len()];
    (0..).zip(&order).for_each(|(new, old)| place[*old as usize] = new);
    table.kept_mut().iter_mut().filter(|brick| **brick != NO_BRICK).for_each(|brick| *brick = place[*brick as usize]);
    let (slots, scales) = (sorted(&slots, &order), sorted(&scales, &order));
    // Dense grids have none.
    let errors = if errors.is_empty() { errors } else { sorted(&errors, &order) };
    let bounds = sorted(&bounds, &order);
    (BrickTables { table, slots, scales, bounds, errors }, needed)
}
