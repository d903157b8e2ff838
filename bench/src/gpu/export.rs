//! Files of a scene, so that other programs can search the same grid: `tests/peers/gpu.py` does.
//!
//! All numbers are little-endian, without a header:
//!
//! | file | numbers |
//! |---|---|
//! | `points.f32` | x, y, z of each vertex |
//! | `elements.u32` | the vertices of each face (3) or edge (2) |
//! | `samples.f32` | φ at each node, x fastest; of a sparse grid as it is interpolated there |
//! | `body_points.f32`, `body_faces.u32` | the mesh that the grid was baked from |
//! | `points.contacts`, `frank_wolfe.contacts` | contacts by the CPU: element as u32, distance, point, normal as f32, 32 bytes each |
//! | `scene.json` | name, kind of elements, margin, lattice, slope bound |

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use rayon::prelude::*;
use sdf_core::contact::Contact;
use sdf_core::nalgebra::Vector3;
use sdf_core::{AnyField, Sdf};
use sdf_gpu::{Elements, Method};
use serde::Serialize;

use super::Scene;
use crate::accuracy::SceneFile;

/// Contents of `scene.json`.
#[derive(Serialize)]
struct About<'a> {
    name: &'a str,
    elements: &'static str,
    margin: f32,
    /// Number of nodes along x, y and z.
    nodes: [u32; 3],
    /// Position of the first node.
    origin: [f64; 3],
    spacing: f64,
    slope_bound: f64,
}

/// Writes the files of a scene into `folder`. A scene of closed forms has none: returns `false`.
pub(super) fn write(folder: &Path, file: &SceneFile, cells: u32) -> Result<bool> {
    let Some(body) = file.body()? else { return Ok(false) };
    let scene = Scene::new(file, cells)?;
    let AnyField::Grid(grid) = &scene.field else { return Ok(false) };
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let lattice = grid.lattice();
    let ([nx, ny, nz], origin, spacing) = (lattice.nodes(), Vector3::from(lattice.origin()), lattice.spacing());
    let layers = (0..nz)
        .into_par_iter()
        .flat_map_iter(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| Vector3::new(i, j, k).map(f64::from))));
    let samples: Vec<_> = layers.map(|node| grid.value(origin + node * spacing) as f32).collect();
    let (kind, elements) = match scene.elements(Method::FrankWolfe) {
        Some(Elements::Edges(edges)) => ("edges", edges.as_flattened()),
        _ => ("faces", scene.mesh.triangles.as_flattened()),
    };
    let about = About {
        name: &scene.name,
        elements: kind,
        margin: scene.margin,
        nodes: lattice.nodes(),
        origin: lattice.origin(),
        spacing,
        slope_bound: grid.slope_bound(),
    };
    let body_points: Vec<_> = body.points.iter().flatten().map(|x| *x as f32).collect();
    let words = |numbers: &[f32]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    for (name, numbers) in [
        ("points.f32", words(scene.points.as_flattened())),
        ("elements.u32", elements.to_vec()),
        ("samples.f32", words(&samples)),
        ("body_points.f32", words(&body_points)),
        ("body_faces.u32", body.triangles.as_flattened().to_vec()),
        ("points.contacts", contacts(&scene, Method::PointSampling)),
        ("frank_wolfe.contacts", contacts(&scene, Method::FrankWolfe)),
    ] {
        let path = folder.join(name);
        let bytes: Vec<_> = numbers.iter().flat_map(|word| word.to_le_bytes()).collect();
        fs::write(&path, bytes).with_context(|| path.display().to_string())?;
    }
    let path = folder.join("scene.json");
    fs::write(&path, serde_json::to_vec(&about)?).with_context(|| path.display().to_string())?;
    Ok(true)
}

/// The records of the scene's contacts by a method on the CPU.
fn contacts(scene: &Scene, method: Method) -> Vec<u32> {
    let found = scene.elements(method).map_or(vec![], |elements| scene.on_processor(elements, method, false));
    found.iter().flat_map(record).collect()
}

fn record(contact: &Contact<f32>) -> Vec<u32> {
    let vectors = [contact.point, contact.normal];
    let numbers = [contact.distance].into_iter().chain(vectors.iter().flatten().copied());
    [contact.element].into_iter().chain(numbers.map(f32::to_bits)).collect()
}
