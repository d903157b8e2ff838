//! Meshes and fields that move: first touches on the way to the next frame.

use sdf_field::core::contact::FirstTouch;
use sdf_field::{ContactOptions, FirstTouchOptions, MeshPath, MeshView};

use crate::border::{self, guard};
use crate::types::{Failure, SdfError, SdfField, SdfQuery, SdfResult, SdfTouch, pose};

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
        let mut counter = border::Writer::<usize>::new(count, 1, "count")?;
        let mut room = border::Writer::new(touches, capacity, "touches")?;
        let field = &border::reference(field, "field")?.0;
        let points = border::rows(vertices, vertex_count, "vertices")?;
        let end = border::rows(end_vertices, vertex_count, "end_vertices")?;
        let faces = border::rows(faces, face_count, "faces")?;
        let ContactOptions { elements, margin, pose: start_pose, budget, threads, .. } =
            border::value(query, "query")?.to_rust()?;
        let end_pose = match end_pose.is_null() {
            true => None,
            false => {
                let [x, y, z, rotation @ ..] = border::value(end_pose.cast::<[f64; 7]>(), "end_pose")?;
                Some(pose("end_pose", "", [x, y, z], rotation)?)
            }
        };
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
        counter.push(found.touches.len());
        found.require_finite(&path, elements).map_err(Failure::invalid)?;
        border::require_room(found.touches.len(), capacity, "touches")
    })
}
