use sdf_core::grid::owned::{ErrorRegion, ErrorRegions};
use serde_json::json;

use crate::report::number;

/// Why a baked grid may have no error bound.
pub const UNFIT: &str =
    "unknown: pseudo-normals do not fit this mesh, and whole regions may have the wrong sign: use --sign auto";

/// Words for an error bound, with those for the `median` behind it, and what is proven of it. Where the inside of an open mesh ends between
/// nodes is a matter of definition.
pub fn bound_row(bound: f64, median: &str, is_sign_continuous: bool) -> String {
    let proof = if is_sign_continuous { "proven" } else { "proven with the sign of a cell's corners where they agree" };
    if bound.is_finite() { format!("at most {}{median}, {proof}", number(bound)) } else { UNFIT.to_owned() }
}

/// The share of cells with the error of a closed mesh, and where the others are.
pub fn row(found: &ErrorRegions) -> String {
    let share = found.cells_within as f64 / found.cells.max(1) as f64;
    let bound = number(found.error_bound);
    let within = format!("{:.2} % of {} cells are within {bound}", 100.0 * share, found.cells);
    let Some(largest) = found.regions.first() else { return within };
    let corner = |corner: [f64; 3]| corner.map(number).join(", ");
    let (from, to, cells) = (corner(largest.bounds.min), corner(largest.bounds.max), largest.cells);
    let count = match found.region_count {
        1 => "the others are".to_owned(),
        count => format!("the others are in {count} regions, the largest of {cells} cells"),
    };
    format!("{within}; {count} from ({from}) to ({to}), within {}", number(largest.error_bound))
}

/// The same in JSON.
pub fn document(found: &ErrorRegions) -> serde_json::Value {
    let region = |region: &ErrorRegion| {
        json!({
            "min": region.bounds.min,
            "max": region.bounds.max,
            "cells": region.cells,
            "error_bound": region.error_bound,
        })
    };
    json!({
        "cells": found.cells,
        "cells_within": found.cells_within,
        "error_bound_within": found.error_bound,
        "region_count": found.region_count,
        "largest_regions": found.regions.iter().map(region).collect::<Vec<_>>(),
    })
}
