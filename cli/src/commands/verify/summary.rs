//! The result of `verify` as rows and as JSON.

use anyhow::Result;

use super::far::{FarErrors, FarNodes};
use super::findings::{Errors, Findings, Slope};
use super::tight::TightBound;
use crate::args::VerifyArgs;
use crate::report::{Report, number, seconds};

/// The result of a run, as rows for a person and JSON for a program.
pub struct Summary<'a> {
    pub findings: &'a Findings,
    /// Diagonal of the mesh's box.
    pub diagonal: f64,
    /// `None` for shapes in closed form, like `same_mesh` and `parts`, which a blob does not have either.
    pub spacing: Option<f64>,
    /// Was the grid baked from this very file? A blob does not say.
    pub same_mesh: Option<bool>,
    /// Bytes of the file by part.
    pub parts: Option<serde_json::Map<String, serde_json::Value>>,
    pub faults: &'a [String],
    /// With `--tight`; then `None` within where the mesh does not bound one solid.
    pub tight: Option<Option<TightBound>>,
    /// Seconds.
    pub elapsed: f64,
}

impl Summary<'_> {
    pub fn print(&self, args: &VerifyArgs) -> Result<()> {
        let mut rows = self.rows();
        if let Some(path) = &args.histogram {
            rows.push(("picture", path.display().to_string()));
        }
        rows.push(("time", seconds(self.elapsed)));
        Report { rows, json: self.json()? }.print(args.json)
    }

    fn rows(&self) -> Vec<(&'static str, String)> {
        let findings = self.findings;
        let mut rows = Vec::new();
        if let Some(same) = self.same_mesh {
            let kind = if same { "the very file that was baked" } else { "not the file that was baked" };
            rows.push(("mesh", kind.to_owned()));
        }
        if let Some(nodes) = &findings.nodes {
            rows.push(("nodes", self.row(nodes)));
        }
        if let Some(FarNodes { sample_count, excess, wrong_signs }) = &findings.far_nodes {
            let excess = self.length(*excess);
            rows.push((
                "far nodes",
                format!("{sample_count} sampled: at most {excess} beyond what they may be, {wrong_signs} wrong signs"),
            ));
        }
        rows.push((if findings.far.is_some() { "band" } else { "points" }, self.row(&findings.points)));
        if let Some(FarErrors { sample_count, falls_short, over, wrong_signs, .. }) = &findings.far {
            let [falls_short, over] = [falls_short, over].map(|error| self.length(*error));
            rows.push((
                "beyond",
                format!(
                    "{sample_count} sampled: at most {falls_short} short of the distance, {over} over, {wrong_signs} wrong signs"
                ),
            ));
        }
        if let Some(bound) = findings.bound {
            let is_known = bound.is_finite();
            let certified =
                if is_known { format!("at most {}", self.length(bound)) } else { "no error is certified".to_owned() };
            rows.push(("certified", certified));
        }
        if let Some(tight) = &self.tight {
            let found = match tight {
                Some(TightBound { median, max }) => {
                    format!("at most {}, of the median brick {}", self.length(*max), self.length(*median))
                }
                None => "unknown: the mesh does not bound one solid".to_owned(),
            };
            rows.push(("tight", found));
        }
        if let (Some(points), Some(missing)) = (findings.surface_points, findings.missing_cells) {
            rows.push(("cells", format!("{missing} missing, at {points} points of the surface and those of the band")));
        }
        if let Some(Slope { steepest, bound }) = &findings.slope {
            rows.push(("slope", format!("{} at most, certified {}", number(*steepest), number(*bound))));
        }
        if let Some(parts) = &self.parts {
            let parts: Vec<String> = parts.iter().map(|(name, bytes)| format!("{name} {bytes}")).collect();
            rows.push(("bytes", parts.join(", ")));
        }
        rows
    }

    fn row(&self, errors: &Errors) -> String {
        let Errors { sample_count, mean, p95, p99_9, max, wrong_signs, .. } = errors;
        let [mean, p95, p99_9, max] = [mean, p95, p99_9, max].map(|error| self.length(*error));
        format!("{sample_count} sampled: mean {mean}, 95 % {p95}, 99.9 % {p99_9}, max {max}, {wrong_signs} wrong signs")
    }

    fn length(&self, length: f64) -> String {
        match self.spacing {
            Some(spacing) => format!("{} ({:.3} voxels)", number(length), length / spacing),
            None => format!("{} ({:.2e} of the diagonal)", number(length), length / self.diagonal),
        }
    }

    fn json(&self) -> Result<serde_json::Value> {
        let mut json = serde_json::json!({
            "schema": "sdftool.verify/1",
            "same_mesh": self.same_mesh,
            "diagonal": self.diagonal,
            "spacing": self.spacing,
            "error_bound": self.findings.bound,
            "bytes": self.parts,
            "faults": self.faults,
            "seconds": self.elapsed,
        });
        if let Some(tight) = self.tight {
            json["tight"] = serde_json::to_value(tight)?;
        }
        if let (Some(all), serde_json::Value::Object(found)) =
            (json.as_object_mut(), serde_json::to_value(self.findings)?)
        {
            all.extend(found);
        }
        Ok(json)
    }
}
