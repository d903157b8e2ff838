//! Contacts between pairs of triangles (§8.4 of the paper): parry3d's contact manifolds of mesh against mesh.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{Result, anyhow};
use parry3d::math::{Pose, Vector};
use parry3d::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher};
use parry3d::shape::{TriMesh, TriMeshFlags};
use sdf_formats::mesh::read;
use serde_json::json;

use crate::{Answer, Work};

pub type Manifold = ContactManifold<(), ()>;

/// Trees are built beforehand, as our field is baked beforehand. The cloth may have moved, so no state is kept between runs.
pub fn work(cloth: &Path, body: &Path, margin: f32) -> Result<Work> {
    let (cloth, body) = (read(cloth)?, read(body)?);
    let cloth = trimesh(&cloth.points, &cloth.triangles, TriMeshFlags::empty())?;
    let body = trimesh(&body.points, &body.triangles, TriMeshFlags::ORIENTED)?;
    Ok(Box::new(move || {
        let manifolds = manifolds(&cloth, &body, margin)?;
        let touching = manifolds.iter().filter(|manifold| manifold.points.iter().any(|point| point.dist <= margin));
        let triangles: BTreeSet<u32> = touching.map(|manifold| manifold.subshape1).collect();
        let points: usize = manifolds.iter().map(|manifold| manifold.points.len()).sum();
        Ok(Answer::facts(json!({"pairs": manifolds.len(), "points": points, "faces": triangles.len()})))
    }))
}

pub fn trimesh(points: &[[f64; 3]], triangles: &[[u32; 3]], flags: TriMeshFlags) -> Result<TriMesh> {
    let points = points.iter().map(|p| Vector::from_array(p.map(|x| x as f32))).collect();
    Ok(TriMesh::with_flags(points, triangles.to_vec(), flags)?)
}

pub fn manifolds(cloth: &TriMesh, body: &TriMesh, margin: f32) -> Result<Vec<Manifold>> {
    let mut manifolds: Vec<Manifold> = vec![];
    DefaultQueryDispatcher
        .contact_manifolds(&Pose::IDENTITY, cloth, body, margin, &mut manifolds, &mut None)
        .map_err(|_| anyhow!("parry3d does not support contacts of two meshes"))?;
    Ok(manifolds)
}
