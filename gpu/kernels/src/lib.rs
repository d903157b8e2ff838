//! Kernels for NVIDIA GPUs: the functions of `sdf-core` and nothing beside them, one thread per element.
//!
//! | file | holds |
//! |---|---|
//! | `abi` | plain numbers that the host sends and reads; the same file as in `sdf-gpu` |
//! | `fields` | fields made of these numbers |
//! | `stages` | cull, search, report |
//!
//! A kernel's name is stage, element, field and method, joined by `_`: `search_faces_dense_frank_wolfe`. No product and sum is
//! contracted to an fma, so that every answer has the bits of the CPU's `f32`.

#![no_std]
#![feature(abi_ptx, asm_experimental_arch, stdarch_nvptx)]

#[path = "../../src/abi.rs"]
mod abi;
mod fields;
mod stages;

use sdf_core::Interval;
use sdf_core::grid::BlockBounds;
use sdf_core::grid::sparse::Scale;
use sdf_core::minimize::{FrankWolfe, GoldenSection, Newton, PointSampling, ProjectedGradient};

use abi::{FieldBlob, Frame, GridParams, SearchParams, ShapeParams};
use fields::{DenseGrid, Part, Shapes, SparseGrid};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // SAFETY: ends the kernel with an error that the host sees.
    unsafe { core::arch::nvptx::trap() }
}

/// Bytes of a [`Part`], a [`BlockBounds`] and a [`Scale`], for the host's allocations.
#[unsafe(no_mangle)]
pub unsafe extern "ptx-kernel" fn sizes(out: *mut [u32; 3]) {
    unsafe { *out = [size_of::<Part>() as u32, size_of::<BlockBounds>() as u32, size_of::<Scale>() as u32] }
}

/// Block bounds from lowest sample, highest sample and slope bound.
#[unsafe(no_mangle)]
pub unsafe extern "ptx-kernel" fn prepare_bounds(from: *const [f32; 3], to: *mut BlockBounds, count: u32) {
    let index = stages::thread();
    if index < count as usize {
        unsafe {
            let [lower, upper, slope_bound] = *from.add(index);
            to.add(index).write(BlockBounds { range: Interval { lower, upper }, slope_bound });
        }
    }
}

/// Scales of bricks from base and step.
#[unsafe(no_mangle)]
pub unsafe extern "ptx-kernel" fn prepare_scales(from: *const [f32; 2], to: *mut Scale, count: u32) {
    let index = stages::thread();
    if index < count as usize {
        unsafe {
            let [base, step] = *from.add(index);
            to.add(index).write(Scale { base, step });
        }
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "ptx-kernel" fn prepare_dense(params: *const GridParams, blob: *mut FieldBlob) {
    unsafe { fields::store(blob, fields::dense(&*params)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "ptx-kernel" fn prepare_sparse_u16(params: *const GridParams, blob: *mut FieldBlob) {
    unsafe { fields::store(blob, fields::sparse::<u16>(&*params)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "ptx-kernel" fn prepare_sparse_f32(params: *const GridParams, blob: *mut FieldBlob) {
    unsafe { fields::store(blob, fields::sparse::<f32>(&*params)) }
}

/// A union of closed forms; none of them if one has invalid numbers.
#[unsafe(no_mangle)]
pub unsafe extern "ptx-kernel" fn prepare_shapes(
    params: *const ShapeParams,
    parts: *mut Part,
    count: u32,
    blob: *mut FieldBlob,
) {
    unsafe {
        let mut is_valid = true;
        for index in 0..count as usize {
            match fields::part(&*params.add(index)) {
                Some(part) => parts.add(index).write(part),
                None => is_valid = false,
            }
        }
        fields::store(blob, if is_valid { fields::union(parts as u64, count) } else { None });
    }
}

/// Kernels of a stage that has no method: name, field, corners of an element.
macro_rules! stage {
    ($stage:ident: $($name:ident, $field:ty, $n:literal;)+) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "ptx-kernel" fn $name(field: FieldBlob, frame: Frame) {
            unsafe { stages::$stage::<$field, $n>(fields::load(&field), &frame) }
        }
    )+};
}

/// Kernels of a search, or of all stages in one: name, field, corners of an element, method.
macro_rules! method {
    ($stage:ident: $($name:ident, $field:ty, $n:literal, $method:ident;)+) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "ptx-kernel" fn $name(field: FieldBlob, frame: Frame, search: SearchParams) {
            unsafe { stages::$stage::<$field, _, $n>(fields::load(&field), &$method(&search), &frame) }
        }
    )+};
}

#[inline(always)]
fn frank_wolfe(search: &SearchParams) -> FrankWolfe {
    FrankWolfe { iterations: search.iterations, tolerance: search.tolerance }
}

#[inline(always)]
fn projected_gradient(search: &SearchParams) -> ProjectedGradient {
    ProjectedGradient { iterations: search.iterations, step: search.step, tolerance: search.tolerance }
}

#[inline(always)]
fn newton(search: &SearchParams) -> Newton {
    Newton { iterations: search.iterations, tolerance: search.tolerance }
}

#[inline(always)]
fn golden_section(search: &SearchParams) -> GoldenSection {
    GoldenSection { iterations: search.iterations, tolerance: search.tolerance }
}

#[inline(always)]
fn point_sampling(search: &SearchParams) -> PointSampling {
    PointSampling { samples: search.iterations, corners: false }
}

stage! { cull:
    cull_faces_dense, DenseGrid, 3;
    cull_faces_sparse_u16, SparseGrid<u16>, 3;
    cull_faces_sparse_f32, SparseGrid<f32>, 3;
    cull_faces_shapes, Shapes, 3;
    cull_edges_dense, DenseGrid, 2;
    cull_edges_sparse_u16, SparseGrid<u16>, 2;
    cull_edges_sparse_f32, SparseGrid<f32>, 2;
    cull_edges_shapes, Shapes, 2;
    cull_vertices_dense, DenseGrid, 1;
    cull_vertices_sparse_u16, SparseGrid<u16>, 1;
    cull_vertices_sparse_f32, SparseGrid<f32>, 1;
    cull_vertices_shapes, Shapes, 1;
}

method! { search:
    search_faces_dense_frank_wolfe, DenseGrid, 3, frank_wolfe;
    search_faces_sparse_u16_frank_wolfe, SparseGrid<u16>, 3, frank_wolfe;
    search_faces_sparse_f32_frank_wolfe, SparseGrid<f32>, 3, frank_wolfe;
    search_faces_shapes_frank_wolfe, Shapes, 3, frank_wolfe;
    search_faces_dense_projected_gradient, DenseGrid, 3, projected_gradient;
    search_faces_sparse_u16_projected_gradient, SparseGrid<u16>, 3, projected_gradient;
    search_faces_sparse_f32_projected_gradient, SparseGrid<f32>, 3, projected_gradient;
    search_faces_shapes_projected_gradient, Shapes, 3, projected_gradient;
    search_faces_dense_newton, DenseGrid, 3, newton;
    search_faces_dense_point_sampling, DenseGrid, 3, point_sampling;
    search_edges_dense_frank_wolfe, DenseGrid, 2, frank_wolfe;
    search_edges_dense_projected_gradient, DenseGrid, 2, projected_gradient;
    search_edges_dense_golden_section, DenseGrid, 2, golden_section;
    search_edges_sparse_u16_frank_wolfe, SparseGrid<u16>, 2, frank_wolfe;
    search_edges_sparse_f32_frank_wolfe, SparseGrid<f32>, 2, frank_wolfe;
    search_edges_shapes_frank_wolfe, Shapes, 2, frank_wolfe;
    search_vertices_dense_point_sampling, DenseGrid, 1, point_sampling;
    search_vertices_sparse_u16_point_sampling, SparseGrid<u16>, 1, point_sampling;
    search_vertices_sparse_f32_point_sampling, SparseGrid<f32>, 1, point_sampling;
    search_vertices_shapes_point_sampling, Shapes, 1, point_sampling;
}

stage! { report:
    report_faces_dense, DenseGrid, 3;
    report_faces_sparse_u16, SparseGrid<u16>, 3;
    report_faces_sparse_f32, SparseGrid<f32>, 3;
    report_faces_shapes, Shapes, 3;
    report_edges_dense, DenseGrid, 2;
    report_edges_sparse_u16, SparseGrid<u16>, 2;
    report_edges_sparse_f32, SparseGrid<f32>, 2;
    report_edges_shapes, Shapes, 2;
    report_vertices_dense, DenseGrid, 1;
    report_vertices_sparse_u16, SparseGrid<u16>, 1;
    report_vertices_sparse_f32, SparseGrid<f32>, 1;
    report_vertices_shapes, Shapes, 1;
}

method! { contact:
    contact_faces_dense_frank_wolfe, DenseGrid, 3, frank_wolfe;
    contact_faces_dense_projected_gradient, DenseGrid, 3, projected_gradient;
    contact_edges_dense_frank_wolfe, DenseGrid, 2, frank_wolfe;
    contact_vertices_dense_point_sampling, DenseGrid, 1, point_sampling;
    contact_faces_shapes_frank_wolfe, Shapes, 3, frank_wolfe;
    contact_vertices_shapes_point_sampling, Shapes, 1, point_sampling;
}
