//! Faults beside a query: is each said, and does it leave the query as it was?

use cudarc::driver::{CudaContext, CudaSlice};
use sdf_core::placed::Rigid;
use sdf_field::cuda::Cuda;
use sdf_field::{ContactOptions, Field, MeshView};
use sdf_gpu::{Elements, Gpu, GpuError, GpuField, GpuMesh, GpuQuery, Method, QueryOptions};

use crate::scenes::{Scene, scene};
use crate::{gpu, with_stub};

fn parts(gpu: &Gpu, scene: &Scene) -> (GpuField, GpuMesh) {
    let field = GpuField::new(gpu, &scene.field).unwrap();
    (field, GpuMesh::new(gpu, &scene.points, Elements::Faces(&scene.faces)).unwrap())
}

const CERTIFIED: QueryOptions = QueryOptions { method: Method::Certified, ..DEFAULT };

const DEFAULT: QueryOptions = QueryOptions {
    method: Method::FrankWolfe,
    margin: 0.02,
    iterations: 32,
    tolerance: 1e-3,
    stages: sdf_gpu::Stages::Separate,
    unsettled: sdf_gpu::Unsettled::Keep,
};

#[test]
fn a_query_is_made_on_any_thread() {
    with_stub("failures::a_query_is_made_on_any_thread", &[], |folder| {
        let (gpu, scene) = (gpu(folder), scene("dense"));
        let (field, mesh) = parts(&gpu, &scene);
        // No context is current there.
        let made = std::thread::spawn(move || GpuQuery::new(&gpu, &field, mesh, &DEFAULT).map(drop));
        made.join().unwrap().unwrap();
    });
}

#[test]
fn a_kernel_that_the_card_has_no_room_for_is_not_an_unknown_one() {
    let name = "failures::a_kernel_that_the_card_has_no_room_for_is_not_an_unknown_one";
    with_stub(name, &[("SDF_STUB_CODE_MEMORY", "0")], |folder| {
        let (gpu, scene) = (gpu(folder), scene("dense"));
        let (field, mesh) = parts(&gpu, &scene);
        let error = GpuQuery::new(&gpu, &field, mesh, &CERTIFIED).unwrap_err();
        assert!(error.is_out_of_memory(), "{error}");
    });
}

#[test]
fn a_measurement_says_why_a_launch_failed() {
    let name = "failures::a_measurement_says_why_a_launch_failed";
    with_stub(name, &[("SDF_STUB_LOCAL_MEMORY", "0")], |folder| {
        let (gpu, scene) = (gpu(folder), scene("dense"));
        let (field, mesh) = parts(&gpu, &scene);
        let error = GpuQuery::new(&gpu, &field, mesh, &CERTIFIED).unwrap().time(1).unwrap_err();
        assert!(error.is_out_of_memory(), "{error}");
    });
}

#[test]
fn fields_and_meshes_of_another_gpu_are_refused() {
    with_stub("failures::fields_and_meshes_of_another_gpu_are_refused", &[], |folder| {
        let (gpu, other, scene) = (gpu(folder), gpu(folder), scene("dense"));
        for (field_of, mesh_of, wrong) in [(&other, &gpu, "field"), (&gpu, &other, "mesh"), (&gpu, &gpu.clone(), "")] {
            let ((field, _), (_, mesh)) = (parts(field_of, &scene), parts(mesh_of, &scene));
            match GpuQuery::new(&gpu, &field, mesh, &DEFAULT) {
                Ok(_) => assert_eq!(wrong, ""),
                Err(error) => {
                    assert!(!matches!(error, GpuError::Driver(_)), "{error}");
                    let words = format!("the {wrong} was made by another Gpu");
                    assert!(!wrong.is_empty() && error.to_string().contains(&words), "{error}");
                }
            }
        }
    });
}

/// All memory of the card that is left.
fn rest_of_memory() -> Vec<CudaSlice<u8>> {
    let stream = CudaContext::new(0).unwrap().default_stream();
    let mut taken = vec![];
    for bytes in [1 << 20, 1 << 10, 1] {
        // SAFETY: nobody reads it.
        while let Ok(list) = unsafe { stream.alloc(bytes) } {
            taken.push(list);
        }
    }
    taken
}

#[test]
fn a_pose_that_the_card_has_no_room_for_changes_nothing() {
    let name = "failures::a_pose_that_the_card_has_no_room_for_changes_nothing";
    with_stub(name, &[("SDF_STUB_MEMORY", "67108864")], |folder| {
        // The CPU searches what the card leaves open by one evaluation, by the pose of its own.
        let (cuda, scene) = (Cuda::open(&folder.join("kernels.ptx")).unwrap(), scene("sparse_u16"));
        let field = Field::new(scene.field.clone());
        let points: Vec<[f64; 3]> = scene.points.iter().map(|point| point.map(f64::from)).collect();
        let mesh = MeshView { points: &points, faces: &scene.faces };
        let options = ContactOptions { margin: 0.02, budget: Some(1), ..Default::default() };
        let mut query = field.query_on(&cuda, mesh, &options).unwrap();
        let before = query.contacts().unwrap();
        let taken = rest_of_memory();
        let pose = Some(Rigid::new([0.3, 0.1, -0.2], [0.1, 0.2, 0.3, 0.9]).unwrap());
        let error = query.set_pose(pose).unwrap_err();
        assert!(error.to_string().contains("memory"), "{error}");
        assert!(query.contacts().unwrap() == before);
        drop(taken);
        query.set_pose(pose).unwrap();
        assert!(query.contacts().unwrap() != before);
    });
}
