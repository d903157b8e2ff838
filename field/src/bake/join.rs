//! Parts of a bake joined into a grid file: their bricks bounded and their samples copied, some thousands at a time.

use std::path::{Path, PathBuf};

use sdf_bake::MeshDistance;
use sdf_bake::sparse::{
    BakedPart, BoundedGrid, BrickColumns, BrickSamples, CoarseMap, Quantize, SlotSides, UnboundedGrid, code_step,
};
use sdf_core::grid::Lattice;
use sdf_core::grid::owned::Precision;
use sdf_formats::atomic_write;
use sdf_formats::grid_file::part::{self, Codes, JoinedParts, PartInfo, PartTables, Sides};
use sdf_formats::grid_file::{About, DeepValues, GridFault, GridFileError, Samples, SignMethod, SparseSamples};

use super::on_disk::{BRICKS_AT_A_TIME, BakeFileError, Failure, GridOnDisk};
use super::{TOOL, at_box};
use crate::file::info_from;

/// Joins the parts of one bake, in any order, into a grid file: the bytes of a bake at once. Holds the samples of a few thousand bricks.
pub fn merge_parts(parts: &[PathBuf], output: &Path) -> Result<GridOnDisk, BakeFileError> {
    let joined = JoinedParts::open(parts).map_err(BakeFileError::File)?;
    let tool = &joined.info().about.tool;
    if tool != TOOL {
        let fault = GridFault::DoesNotJoin(format!("was baked by {tool}, and this is {TOOL}: merge with the former"));
        return Err(BakeFileError::File(GridFileError { path: parts[0].clone(), fault }));
    }
    let written = atomic_write(output, |temporary| join(joined, temporary, BRICKS_AT_A_TIME, None, || ()));
    written.map_err(|failure: Failure| failure.at(output))
}

/// Writes the grid of all parts, and the regions of its error if the mesh is there. Calls `on_bounded` when its bricks are bounded, before they are packed.
pub(super) fn join(
    parts: JoinedParts,
    path: &Path,
    at_a_time: usize,
    mesh: Option<&MeshDistance>,
    on_bounded: impl FnOnce(),
) -> Result<GridOnDisk, Failure> {
    match parts.info().precision {
        Precision::F32 => join_as::<f32>(parts, path, at_a_time, mesh, on_bounded),
        Precision::U16 => join_as::<u16>(parts, path, at_a_time, mesh, on_bounded),
        Precision::U8 => join_as::<u8>(parts, path, at_a_time, mesh, on_bounded),
    }
}

fn join_as<C: Quantize>(
    mut parts: JoinedParts,
    path: &Path,
    at_a_time: usize,
    mesh: Option<&MeshDistance>,
    on_bounded: impl FnOnce(),
) -> Result<GridOnDisk, Failure>
where
    for<'a> SamplesOfParts<'a>: BrickSamples<C, Error = GridFileError>,
    for<'a> Samples<'a>: From<SparseSamples<'a, C>>,
{
    let PartInfo { lattice, band, precision, is_sign_continuous, about, .. } = parts.info().clone();
    let (baked, coarse) = baked_part(&lattice, parts.take_tables())?;
    let unbounded = UnboundedGrid::new(&lattice, band, is_sign_continuous, baked, coarse);
    if let Some(slot) = unbounded.missing() {
        return Err(
            GridFault::DoesNotJoin(format!("its parts lack the brick of slot {slot:?}: bake them again")).into()
        );
    }
    let (grid, sources) = unbounded.bounded(&SamplesOfParts(&parts), at_a_time, mesh)?;
    on_bounded();
    let BoundedGrid {
        table,
        slots,
        scales,
        bounds,
        errors,
        coarse,
        slope_bound,
        error_bound,
        inside_reaches_box,
        jumps,
    } = grid;
    drop(table);
    let has_inside = bounds.iter().any(|bounds| bounds.range.lower < 0.0) || coarse.iter().any(|sample| *sample < 0.0);
    let error_regions = jumps.map(|jumps| jumps.regions(&lattice, code_step(precision, &scales)));
    let sign_reason = about.sign_reason.clone() + at_box(inside_reaches_box);
    // As `MeshDistance::is_sign_certain`, without the mesh.
    let is_certain = is_sign_continuous || about.sign_method == SignMethod::Winding;
    let error_bound = if is_certain { error_bound } else { f64::INFINITY };
    let about = About { sign_reason, slope_bound, error_bound, inside_reaches_box, error_regions, ..about };
    let mesh = parts.mesh()?;
    let deep_values = DeepValues::Distances;
    let samples = SparseSamples::<C> {
        band,
        deep_values,
        slots: &slots,
        scales: &scales,
        samples: &[],
        bounds: &bounds,
        errors: &errors,
        coarse: &coarse,
    };
    part::write_joined(path, &parts, samples, &|brick| sources.place(brick), &about, mesh.as_ref())?;
    let info = info_from(about, Some(band));
    Ok(GridOnDisk { lattice, info, precision, slope_bound, slots, errors, is_sign_continuous, has_inside })
}

fn baked_part(lattice: &Lattice, tables: PartTables) -> Result<(BakedPart, CoarseMap), GridFault> {
    let PartTables { near, mut slots, mut scales, mut roundings, mut interpolations, .. } = tables;
    let closing = BrickColumns {
        slots: slots.split_off(near),
        scales: scales.split_off(near),
        roundings: roundings.split_off(near),
        interpolations: interpolations.split_off(near),
    };
    let near = BrickColumns { slots, scales, roundings, interpolations };
    let sides = match tables.sides {
        Sides::FirstNodes => SlotSides::FirstNodes,
        Sides::Slots => SlotSides::Own(tables.slot_sides),
        Sides::SlotsAndNodes => SlotSides::WithNodes(tables.slot_sides),
    };
    let coarse = CoarseMap::new(lattice, tables.coarse, sides);
    let coarse =
        coarse.ok_or_else(|| GridFault::Damaged("the parts' shares of the coarse grid do not add up".to_owned()))?;
    Ok((BakedPart { near, closing }, coarse))
}

/// The samples of joined parts.
struct SamplesOfParts<'a>(&'a JoinedParts);

macro_rules! brick_samples {
    ($code:ty, $precision:ident) => {
        impl BrickSamples<$code> for SamplesOfParts<'_> {
            type Error = GridFileError;
            fn read(&self, bricks: &[u32]) -> Result<Vec<$code>, GridFileError> {
                match self.0.codes(bricks)? {
                    Codes::$precision(codes) => Ok(codes),
                    _ => unreachable!("parts have the precision that they state"),
                }
            }
        }
    };
}

brick_samples!(f32, F32);
brick_samples!(u16, U16);
brick_samples!(u8, U8);
