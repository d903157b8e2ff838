//! Contents of a field file: a grid's header without its samples, or the bounds of shapes.

use anyhow::Result;
use sdf_core::{Aabb, Sdf};
use sdf_formats::blob_file::StoredBlob;
use sdf_formats::field_file::OpenField;
use sdf_formats::grid_file::{SignMethod, Summary, layout_of};
use serde_json::json;

use crate::args::InfoArgs;
use crate::read_summary::bytes_of;
use crate::report::{Report, corners_of, counted, counts, number};
use crate::{error_regions, field_input};

fn error_row(bound: f64, why_unknown: &str) -> String {
    if bound.is_finite() { format!("at most {}", number(bound)) } else { why_unknown.to_owned() }
}

fn bounds_document(bounds: &Aabb) -> serde_json::Value {
    json!({"min": bounds.min, "max": bounds.max})
}

pub fn run(args: &InfoArgs) -> Result<()> {
    match field_input::open(&args.sdf)? {
        OpenField::Grid(reader) => {
            let Summary { lattice, sparse, precision, about, mesh, parts, file_bytes } = reader.summary();
            let bounds = lattice.bounds();
            let sha256: String = about.source.sha256.iter().map(|byte| format!("{byte:02x}")).collect();
            let is_imported = about.sign_method == SignMethod::Given;
            let why_unknown = if is_imported { "unknown: the samples were imported" } else { error_regions::UNFIT };
            let (name, precision) = (layout_of(sparse).name(), precision.name());
            let (band, bricks) = (sparse.map(|sparse| sparse.band), sparse.map(|sparse| sparse.bricks));
            let in_words = match (band, bricks) {
                (Some(band), Some(bricks)) => {
                    format!("sparse, {} in {precision}, distances within {}", counted(bricks, "brick"), number(band))
                }
                _ => format!("{name}, {precision}"),
            };
            let kept = mesh.map_or("not kept".to_owned(), |mesh| {
                let jumps = if mesh.is_sign_continuous { "" } else { "; open: the sign jumps at its holes" };
                format!("{} vertices, {} kept{jumps}", mesh.vertices, counted(mesh.triangles, "triangle"))
            });
            let stored = parts.iter().map(|part| format!("{} {}", part.name, part.stored_bytes));
            let mut rows = vec![
                ("layout", in_words),
                ("nodes", counts(lattice.nodes())),
                ("spacing", number(lattice.spacing())),
                ("box", corners_of(&bounds)),
                ("sign", about.sign_reason.clone()),
                ("slope", format!("at most {}", number(about.slope_bound))),
                ("error", error_row(about.error_bound, why_unknown)),
                (
                    "source",
                    format!("{}, {}, SHA-256 {sha256}", about.source.name, counted(about.source.triangles, "triangle")),
                ),
                ("mesh", kept),
                ("made by", format!("{} {}", about.tool, about.options)),
                ("padding", format!("{} around the mesh", number(about.padding))),
                ("file", format!("{file_bytes} bytes: {}", stored.collect::<Vec<_>>().join(", "))),
            ];
            if let Some(found) = &about.error_regions {
                let after_error = rows.iter().position(|(name, _)| *name == "error").map_or(0, |row| row + 1);
                rows.insert(after_error, ("regions", error_regions::row(found)));
            }
            Report {
                rows,
                json: json!({
                    "schema": "sdftool.info/1",
                    "layout": name,
                    "precision": precision,
                    "bricks": bricks,
                    "band": band,
                    "padding": about.padding,
                    "counts": lattice.nodes(),
                    "origin": lattice.origin(),
                    "spacing": lattice.spacing(),
                    "bounds": bounds_document(&bounds),
                    "sign_method": about.sign_method,
                    "sign_verdict": about.sign_reason,
                    "slope_bound": about.slope_bound,
                    "error_bound": about.error_bound,
                    "error_regions": about.error_regions.as_ref().map(error_regions::document),
                    "source": {
                        "name": about.source.name,
                        "sha256": sha256,
                        "triangles": about.source.triangles,
                    },
                    "deep_values": sparse.map(|sparse| sparse.deep_values.name()),
                    "mesh": mesh.map(|mesh| json!({
                        "vertices": mesh.vertices,
                        "triangles": mesh.triangles,
                        "is_sign_continuous": mesh.is_sign_continuous,
                    })),
                    "tool": about.tool,
                    "options": about.options,
                    "file_bytes": file_bytes,
                    "parts": bytes_of(&parts),
                }),
            }
            .print(args.json)
        }
        OpenField::Blob(blob) => blob_report(&blob).print(args.json),
        OpenField::Analytic(node) => {
            let bounds = node.bounds(0.0);
            let is_bounded = bounds.extents().iter().all(|extent| extent.is_finite());
            Report {
                rows: vec![
                    ("layout", "analytic".to_owned()),
                    ("box", if is_bounded { corners_of(&bounds) } else { "unbounded".to_owned() }),
                    ("slope", format!("at most {}", number(node.slope_bound()))),
                ],
                json: json!({
                    "schema": "sdftool.info/1",
                    "layout": "analytic",
                    "bounds": is_bounded.then(|| bounds_document(&bounds)),
                    "slope_bound": node.slope_bound(),
                }),
            }
            .print(args.json)
        }
    }
}

fn blob_report(StoredBlob { grid, precision, padding }: &StoredBlob) -> Report<serde_json::Value> {
    let (lattice, storage) = (grid.lattice(), grid.storage());
    let (bounds, layout) = (lattice.bounds(), storage.layout().name());
    let (bricks, band) = (storage.brick_count(), Some(grid.band()).filter(|band| band.is_finite()));
    let stored = bricks.map_or(String::new(), |bricks| format!(", {}", counted(bricks, "brick")));
    Report {
        rows: vec![
            ("layout", format!("{layout}{stored} in {}, a blob", precision.name())),
            ("nodes", counts(lattice.nodes())),
            ("spacing", number(lattice.spacing())),
            ("box", corners_of(&bounds)),
            ("slope", format!("at most {}", number(grid.slope_bound()))),
            ("error", error_row(grid.global_error_bound(), "unknown: no error is certified")),
            ("padding", format!("{} around the mesh", number(*padding))),
        ],
        json: json!({
            "schema": "sdftool.info/1",
            "layout": layout,
            "precision": precision.name(),
            "bricks": bricks,
            "band": band,
            "padding": padding,
            "counts": lattice.nodes(),
            "origin": lattice.origin(),
            "spacing": lattice.spacing(),
            "bounds": bounds_document(&bounds),
            "slope_bound": grid.slope_bound(),
            "error_bound": grid.global_error_bound(),
        }),
    }
}
