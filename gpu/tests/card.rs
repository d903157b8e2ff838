//! Queries on a card, if there is one. Without a driver: is the error one that helps?
//!
//! `SDF_GPU_KERNELS` names the kernels that `.ci/gpu.sh --out` made. Without it, or without a driver, nothing runs on a card.

use std::path::Path;

use sdf_core::contact::{Contact, Element, Outcome, contact};
use sdf_core::minimize::FrankWolfe;
use sdf_core::nalgebra::Vector3;
use sdf_core::shapes::{Sphere, Torus};
use sdf_core::{AnyField, Simplex};
use sdf_gpu::{Elements, Gpu, GpuError, GpuField, GpuMesh, GpuQuery, QueryOptions, Stages};

#[test]
fn without_a_driver_the_error_says_so() {
    match Gpu::new(Path::new("no-such-file.ptx")) {
        Err(GpuError::NoDriver) => assert!(GpuError::NoDriver.to_string().contains("libcuda.so")),
        Err(error) => println!("a driver is here: {error}"),
        Ok(_) => panic!("kernels were loaded from a file that does not exist"),
    }
}

/// Triangles all over the cube from −1 to 1, some through the surface.
fn faces() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let at = |step: u32, stride: f32| (step as f32 * stride).fract() * 2.0 - 1.0;
    let points = (0..3000).map(|step| [at(step, 0.618_034), at(step, 0.754_878), at(step, 0.569_840)]).collect();
    (points, (0..1000).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect())
}

#[test]
fn contacts_on_the_card_are_those_of_the_processor() {
    let Some(kernels) = std::env::var_os("SDF_GPU_KERNELS") else {
        return println!("skipped: SDF_GPU_KERNELS is not set");
    };
    let gpu = match Gpu::new(Path::new(&kernels)) {
        Err(GpuError::NoDriver) => return println!("skipped: no driver"),
        gpu => gpu.unwrap(),
    };
    let (points, faces) = faces();
    let shapes = vec![AnyField::Sphere(Sphere::new(0.5).unwrap()), AnyField::Torus(Torus::new(0.8, 0.1).unwrap())];
    let field = AnyField::union(shapes).unwrap();
    let expected: Vec<Contact<f32>> = (0..)
        .zip(&faces)
        .filter_map(|(id, vertices)| {
            let corners = vertices.map(|vertex| Vector3::from(points[vertex as usize]));
            let element = Element { id, vertices: *vertices, simplex: Simplex { corners } };
            match contact(&field, &FrankWolfe::default(), 0.01, &element) {
                Outcome::Contact(contact) => Some(contact),
                _ => None,
            }
        })
        .collect();
    assert!(expected.len() > 100 && expected.len() < 1000, "{}", expected.len());
    let card_field = GpuField::new(&gpu, &field).unwrap();
    for stages in [Stages::Separate, Stages::Fused] {
        let mesh = GpuMesh::new(&gpu, &points, Elements::Faces(&faces)).unwrap();
        let options = QueryOptions { margin: 0.01, stages, ..QueryOptions::default() };
        let mut query = GpuQuery::new(&gpu, &card_field, mesh, &options).unwrap();
        assert_eq!(query.contacts().unwrap().contacts, expected);
    }
}
