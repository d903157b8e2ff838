//! Where is the error of an open mesh's grid large? Two attributes of /sdf that only such a file has, with a checksum of their own: a
//! reader that does not know them passes them over.

use sdf_core::Aabb;
use sdf_core::grid::owned::{ErrorRegion, ErrorRegions};

use super::GridFault;
use super::attributes::Attributes;
use crate::hdf5::{Group, Hdf5Reader, Object, Value};

const REGIONS: &str = "error_regions";
const CHECKSUM: &str = "error_regions_sha256";

/// Numbers before those of the regions, and of each region.
const COUNTS: usize = 4;
const PER_REGION: usize = 8;

/// Most regions that are written; a reader takes fewer too.
const MAX_REGIONS: usize = 8;

/// Largest count that f64 holds exactly.
const MAX_COUNT: f64 = (1_u64 << 53) as f64;

pub(super) fn write(sdf: &Group, found: &ErrorRegions) {
    let regions = &found.regions[..found.regions.len().min(MAX_REGIONS)];
    let counts = [found.cells as f64, found.cells_within as f64, found.error_bound, found.region_count as f64];
    let numbers = regions.iter().flat_map(|region| {
        let Aabb { min: [a, b, c], max: [d, e, f] } = region.bounds;
        [a, b, c, d, e, f, region.cells as f64, region.error_bound]
    });
    let numbers: Vec<f64> = counts.into_iter().chain(numbers).collect();
    sdf.set_numbers(REGIONS, &numbers);
    sdf.set_text(CHECKSUM, &Attributes(vec![(REGIONS, Value::Numbers(numbers))]).checksum());
}

/// `None` where the file has none.
pub(super) fn read(file: &Hdf5Reader, sdf: &Object) -> Result<Option<ErrorRegions>, GridFault> {
    match [REGIONS, CHECKSUM].map(|name| file.has_attribute(sdf, name)) {
        [Ok(false), Ok(false)] => return Ok(None),
        [Ok(true), Ok(true)] => (),
        [Err(error), _] | [_, Err(error)] => return Err(error.into()),
        _ => return Err(GridFault::damaged("error_regions and its checksum are not both there")),
    }
    let attributes = Attributes::read(file, sdf, [REGIONS])?;
    if Attributes::read(file, sdf, [CHECKSUM])?.text(CHECKSUM)? != attributes.checksum() {
        return Err(GridFault::damaged("checksum of error_regions does not match"));
    }
    let Some((_, Value::Numbers(numbers))) = attributes.0.first() else {
        return Err(GridFault::not_a_grid("its attribute error_regions does not hold numbers"));
    };
    decoded(numbers).map(Some).ok_or_else(|| GridFault::damaged("error_regions are not regions"))
}

fn decoded(numbers: &[f64]) -> Option<ErrorRegions> {
    let (counts, regions) = numbers.split_at_checked(COUNTS)?;
    let count = |number: f64| ((0.0..=MAX_COUNT).contains(&number) && number.fract() == 0.0).then_some(number as u64);
    let length = |number: f64| (number.is_finite() && number >= 0.0).then_some(number);
    let region = |numbers: &[f64]| {
        let [a, b, c, d, e, f, cells, error_bound] = numbers.try_into().ok()?;
        let bounds = Aabb { min: [a, b, c], max: [d, e, f] };
        let is_box = (0..3).all(|axis| bounds.min[axis] <= bounds.max[axis]);
        let region = ErrorRegion { bounds, cells: count(cells)?, error_bound: length(error_bound)? };
        (is_box && bounds.max.iter().chain(&bounds.min).all(|x| x.is_finite())).then_some(region)
    };
    let found = ErrorRegions {
        cells: count(counts[0])?,
        cells_within: count(counts[1])?,
        error_bound: length(counts[2])?,
        regions: regions.chunks(PER_REGION).map(region).collect::<Option<_>>()?,
        region_count: usize::try_from(count(counts[3])?).ok()?,
    };
    (found.cells_within <= found.cells && found.regions.len() <= found.region_count).then_some(found)
}

/// Can these be written and read back?
pub(super) fn is_valid(found: &ErrorRegions) -> bool {
    let is_length = |number: f64| number.is_finite() && number >= 0.0;
    let is_region = |region: &ErrorRegion| {
        let Aabb { min, max } = region.bounds;
        is_length(region.error_bound)
            && (0..3).all(|axis| min[axis] <= max[axis] && (max[axis] - min[axis]).is_finite())
    };
    is_length(found.error_bound)
        && found.cells_within <= found.cells
        && found.regions.len() <= found.region_count
        && found.regions.iter().all(is_region)
}
