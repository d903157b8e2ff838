//! Meshes and fields that move: clusters of faces, what a query says of a mesh in motion, first touches on the way to the next frame.

use sdf_field::core::contact::FirstTouch;
use sdf_field::core::placed::Rigid;
use sdf_field::{ContactOptions, Elements, FirstTouchOptions, MeshClusters, MeshInMotion, MeshPath, MeshView};

use crate::border::{self, Out, guard};
use crate::types::{Failure, SdfClusters, SdfError, SdfField, SdfQuery, SdfResult, SdfTouch, pose};

#[unsafe(no_mangle)]
pub extern "C" fn sdf_clusters(
    vertices: *const f64,
    vertex_count: usize,
    faces: *const u32,
    face_count: usize,
    out: *mut *mut SdfClusters,
    error: *mut SdfError,
) -> SdfResult {
    guard(error, || {
        let out = Out::new(out)?;
        let points = border::rows(vertices, vertex_count, "vertices")?;
        let faces = border::rows(faces, face_count, "faces")?;
        out.give(SdfClusters(MeshClusters::new(MeshView { points, faces }).map_err(Failure::invalid)?));
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_clusters_refit(
    clusters: *mut SdfClusters,
    vertices: *const f64,
    vertex_count: usize,
    faces: *const u32,
    face_count: usize,
    error: *mut SdfError,
) -> SdfResult {
    guard(error, || {
        let clusters = &mut border::exclusive(clusters, "clusters")?.0;
        let points = border::rows(vertices, vertex_count, "vertices")?;
        let faces = border::rows(faces, face_count, "faces")?;
        clusters.refit(MeshView { points, faces }).map_err(Failure::invalid)
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_clusters_free(clusters: *mut SdfClusters) {
    border::free(clusters);
}

/// What a query says of the mesh beside its points; `None` where it says nothing.
pub fn of_query<'a>(
    query: &SdfQuery,
    mesh: MeshView<'a>,
    elements: Elements,
) -> Result<Option<MeshInMotion<'a>>, Failure> {
    let SdfQuery { clusters, mesh_pose, margins, .. } = *query;
    if clusters.is_null() && mesh_pose.is_null() && margins.is_null() {
        return Ok(None);
    }
    if elements != Elements::Faces {
        return Err(Failure::invalid("clusters, mesh_pose and margins are for SDF_FACES alone"));
    }
    let mut moving = MeshInMotion { pose: pose_at("mesh_pose", mesh_pose)?, ..MeshInMotion::new(mesh) };
    if !clusters.is_null() {
        moving.clusters = Some(&border::reference(clusters, "clusters")?.0);
    }
    if !margins.is_null() {
        moving.margins = Some(border::slice(margins, mesh.faces.len(), "margins")?);
    }
    Ok(Some(moving))
}

/// The pose of seven numbers, a translation and a quaternion; `None` of NULL.
fn pose_at(what: &str, numbers: *const f64) -> Result<Option<Rigid>, Failure> {
    if numbers.is_null() {
        return Ok(None);
    }
    let [x, y, z, rotation @ ..] = border::value(numbers.cast::<[f64; 7]>(), what)?;
    pose(what, "", [x, y, z], rotation).map(Some)
}

#[unsafe(no_mangle)]
pub extern "C" fn sdf_first_touches(
    field: *const SdfField,
    vertices: *const f64,
    end_vertices: *const f64,
    vertex_count: usize,
    faces: *const u32,
    face_count: usize,
    query: *const SdfQuery,
    end_pose: *const f64,
    tolerance: f64,
    touches: *mut SdfTouch,
    capacity: usize,
    count: *mut usize,
    error: *mut SdfError,
) -> SdfResult {
    guard(error, || {
        let mut counter = border::Answer::new(count, 0, "count")?;
        let mut room = border::Writer::new(touches, capacity, "touches")?;
        let field = &border::reference(field, "field")?.0;
        let points = border::rows(vertices, vertex_count, "vertices")?;
        let end = border::rows(end_vertices, vertex_count, "end_vertices")?;
        let faces = border::rows(faces, face_count, "faces")?;
        let ContactOptions { elements, margin, pose: start_pose, budget, threads, .. } =
            border::value(query, "query")?.to_rust()?;
        let end_pose = pose_at("end_pose", end_pose)?;
        let options = FirstTouchOptions {
            elements,
            thickness: margin,
            pose: start_pose,
            end_pose,
            tolerance: (tolerance != 0.0).then_some(tolerance),
            budget: budget.unwrap_or(FirstTouch::default().evaluations),
            threads,
        };
        field.check_margin(margin).map_err(Failure::invalid)?;
        let path = MeshPath { start: MeshView { points, faces }, end };
        let found = field.first_touches(&path, &options).map_err(Failure::invalid)?;
        found.touches.iter().for_each(|touch| room.push(touch.into()));
        counter.set(found.touches.len());
        found.require_finite(&path, elements).map_err(Failure::invalid)?;
        border::require_room(found.touches.len(), capacity, "touches")
    })
}
