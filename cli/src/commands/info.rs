use anyhow::Result;
use sdf_core::Sdf;
use sdf_formats::field_file::{self, FieldSummary};
use sdf_formats::grid_file::Summary;
use serde_json::json;

use crate::args::InfoArgs;
use crate::report::{Report, counts, number};

pub fn run(args: &InfoArgs) -> Result<()> {
    match field_file::read_summary(&args.sdf)? {
        FieldSummary::Grid(Summary { lattice, about, file_bytes }) => {
            let bounds = lattice.bounds();
            let sha256: String = about.source.sha256.iter().map(|byte| format!("{byte:02x}")).collect();
            let corner = |corner: [f64; 3]| corner.map(number).join(", ");
            Report {
                rows: vec![
                    ("layout", "dense, f32".to_owned()),
                    ("nodes", counts(lattice.nodes())),
                    ("spacing", number(lattice.spacing())),
                    ("box", format!("({}) to ({})", corner(bounds.min), corner(bounds.max))),
                    ("sign", about.sign_verdict.clone()),
                    ("slope", format!("at most {}", number(about.slope_bound))),
                    ("error", format!("at most {}", number(about.error_bound))),
                    (
                        "source",
                        format!("{}, {} triangles, SHA-256 {sha256}", about.source.name, about.source.triangles),
                    ),
                    ("made by", format!("{} {}", about.tool, about.options)),
                    ("file", format!("{file_bytes} bytes for {} of samples", 4 * lattice.node_count())),
                ],
                json: json!({
                    "schema": "sdftool.info/1",
                    "layout": "dense",
                    "counts": lattice.nodes(),
                    "origin": lattice.origin(),
                    "spacing": lattice.spacing(),
                    "sign_method": about.sign_method,
                    "sign_verdict": about.sign_verdict,
                    "slope_bound": about.slope_bound,
                    "error_bound": about.error_bound,
                    "source": {
                        "name": about.source.name,
                        "sha256": sha256,
                        "triangles": about.source.triangles,
                    },
                    "tool": about.tool,
                    "options": about.options,
                    "file_bytes": file_bytes,
                    "sample_bytes": 4 * lattice.node_count(),
                }),
            }
            .print(args.json)
        }
        FieldSummary::Analytic(node) => {
            let bounds = node.bounds(0.0);
            let is_bounded = bounds.extents().iter().all(|extent| extent.is_finite());
            let corner = |corner: [f64; 3]| corner.map(number).join(", ");
            let shown = format!("({}) to ({})", corner(bounds.min), corner(bounds.max));
            Report {
                rows: vec![
                    ("layout", "analytic".to_owned()),
                    ("box", if is_bounded { shown } else { "unbounded".to_owned() }),
                    ("slope", format!("at most {}", number(node.slope_bound()))),
                ],
                json: json!({
                    "schema": "sdftool.info/1",
                    "layout": "analytic",
                    "bounds": is_bounded.then_some(json!({"min": bounds.min, "max": bounds.max})),
                    "slope_bound": node.slope_bound(),
                }),
            }
            .print(args.json)
        }
    }
}
