//! Reads an OBJ file into points and triangles in memory.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use anyhow::Result;
use serde_json::json;

use crate::{Answer, Work};

pub fn tobj(file: PathBuf) -> Work {
    Box::new(move || {
        let (models, _) = tobj::load_obj(&file, &tobj::LoadOptions { triangulate: true, ..Default::default() })?;
        let count = |len: fn(&tobj::Mesh) -> usize| models.iter().map(|model| len(&model.mesh) / 3).sum::<usize>();
        let (points, triangles) = (count(|mesh| mesh.positions.len()), count(|mesh| mesh.indices.len()));
        Ok(Answer::facts(json!({"points": points, "triangles": triangles})))
    })
}

pub fn ours(file: PathBuf) -> Work {
    Box::new(move || {
        let mesh = sdf_formats::mesh::read(&file)?;
        Ok(Answer::facts(json!({"points": mesh.points.len(), "triangles": mesh.triangles.len()})))
    })
}

/// Writes a hilly sheet with six decimals, as most programs do.
pub fn write(triangles: usize, file: &Path) -> Result<()> {
    let side = ((triangles as f64 / 2.0).sqrt().ceil() as usize).max(1);
    let mut text = String::new();
    for row in 0..=side {
        for column in 0..=side {
            let [x, y] = [column, row].map(|index| index as f64 / side as f64);
            writeln!(text, "v {x:.6} {y:.6} {:.6}", 0.1 * (17.0 * x).sin() * (13.0 * y).cos())?;
        }
    }
    for row in 0..side {
        for column in 0..side {
            let corner = row * (side + 1) + column + 1;
            let above = corner + side + 1;
            writeln!(text, "f {corner} {} {}\nf {corner} {} {above}", corner + 1, above + 1, above + 1)?;
        }
    }
    Ok(std::fs::write(file, text)?)
}
