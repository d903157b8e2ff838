//! Dense grids: a sample for every node, and bounds of each block of 8 × 8 × 8 nodes.

use sdf_core::Aabb;
use sdf_core::grid::sparse::BRICK;
use sdf_core::grid::{BlockBounds, Dense, Lattice, WithBlockBounds};

use super::attributes::Attributes;
use super::block_mask::BlockMask;
use super::digests::{DatasetList, Digests, WHOLE_CHUNKS, open_dataset};
use super::header::Header;
use super::kept_mesh::MeshReader;
use super::placeholder::{SamplePlaceholder, placeholder_grid};
use super::{GridFault, ReadCount, check, layout};
use crate::hdf5::{Dataset, Hdf5Reader, Object, Tile};
use sdf_core::grid::owned::OwnedStorage;

/// Index of the first digest of the samples: they come first.
const SAMPLES_DIGEST: usize = 0;

/// A dense grid whose samples are not read yet.
pub(super) struct DenseReader {
    samples: Dataset<f32>,
    bounds: Vec<BlockBounds>,
}

/// A reader of samples, the digests of all datasets, and a reader of the mesh.
pub(super) type Opened<T> = (T, Digests, Option<MeshReader>);

impl DenseReader {
    pub(super) fn open(file: &Hdf5Reader, sdf: &Object, header: &Header) -> Result<Opened<Self>, GridFault> {
        let slots = layout::slot_count(&header.lattice).ok_or_else(|| GridFault::damaged("too many brick slots"))?;
        let samples = open_vtkhdf(file, &header.lattice)?;
        let bounds = open_dataset::<f32>(file, sdf, "bounds", &[slots, 3])?;
        let mut datasets = DatasetList::default();
        datasets.add(&samples);
        let bounds_digest = datasets.add(&bounds);
        let mesh = MeshReader::open(file, sdf, header, &mut datasets)?;
        let digests = datasets.read_digests(file, sdf, header)?;
        let bounds = check::block_bounds(&digests.elements(file, &bounds, bounds_digest)?)?;
        Ok((Self { samples, bounds }, digests, mesh))
    }

    /// Blocks needed for queries in `regions` that reach `level`.
    pub(super) fn mask(&self, header: &Header, regions: impl IntoIterator<Item = Aabb>, level: f64) -> BlockMask {
        let storage = WithBlockBounds::new(&header.lattice, SamplePlaceholder, &self.bounds)
            .expect("a row for each slot was read");
        BlockMask::needed(&placeholder_grid(header, storage), regions, level)
    }

    /// Checks the checksums of all samples.
    pub(super) fn check(&self, file: &Hdf5Reader, digests: &Digests) -> Result<(), GridFault> {
        Ok(digests.check_all(file, &self.samples, SAMPLES_DIGEST)?)
    }

    /// Reads all samples, or those of the blocks in `mask`, and says how much of the file was read.
    pub(super) fn read(
        self,
        file: &Hdf5Reader,
        digests: &Digests,
        lattice: &Lattice,
        mask: Option<&BlockMask>,
    ) -> Result<(OwnedStorage, ReadCount), GridFault> {
        let is_needed = |tile: Tile| mask.is_none_or(|mask| mask.intersects(tile));
        let piece = mask.map_or(WHOLE_CHUNKS, |_| [BRICK as usize; 3]);
        let samples = digests.elements_in(file, &self.samples, SAMPLES_DIGEST, piece, is_needed)?;
        let tiling = self.samples.tiling();
        let total_blocks = self.samples.chunk_count();
        let blocks = (0..total_blocks).filter(|chunk| is_needed(tiling.tile(*chunk))).count();
        let dense = Dense::new(lattice, samples).expect("the dataset has the lattice's shape");
        let bounded = WithBlockBounds::new(lattice, dense, self.bounds).expect("a row for each slot was read");
        Ok((OwnedStorage::Dense(bounded), ReadCount { bytes: file.bytes_read(), blocks, total_blocks }))
    }
}

/// The dataset of samples, after checking that all of /VTKHDF agrees with /sdf.
fn open_vtkhdf(file: &Hdf5Reader, lattice: &Lattice) -> Result<Dataset<f32>, GridFault> {
    let group = file.member(None, "VTKHDF")?;
    let names = ["Version", "Type", "WholeExtent", "Origin", "Spacing", "Direction"];
    let attributes = Attributes::read(file, &group, names)?;
    let agrees = attributes.integers("Version")? == layout::VTKHDF_VERSION.map(i128::from)
        && attributes.text("Type")? == "ImageData"
        && attributes.integers("WholeExtent")? == layout::whole_extent(lattice).map(i128::from)
        && attributes.numbers("Origin")?.map(f64::to_bits) == lattice.origin().map(f64::to_bits)
        && attributes.numbers("Spacing")? == [lattice.spacing(); 3]
        && attributes.numbers("Direction")? == layout::IDENTITY;
    let points = file.member(Some(&group), "PointData")?;
    let object = file.member(Some(&points), "distance")?;
    let agrees = agrees
        && Attributes::read(file, &points, ["Scalars"])?.text("Scalars")? == "distance"
        && Attributes::read(file, &object, ["Attribute"])?.text("Attribute")? == "Scalars";
    if !agrees {
        return Err(GridFault::damaged("/VTKHDF and /sdf do not agree"));
    }
    Ok(file.dataset(&object, "distance", &layout::dense_shape(lattice))?)
}
