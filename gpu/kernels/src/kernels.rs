//! Which kernels are there? Each is a stage of `stages` with a field, the corners of an element and a method.
//!
//! A kernel's name is stage, element, field and method, joined by `_`: `search_faces_dense_frank_wolfe`. On the card each is an entry
//! point; on the CPU, where `gpu/stub` compiles the same lines, [`find`] has it by its name.

use sdf_core::Interval;
use sdf_core::grid::BlockBounds;
use sdf_core::grid::sparse::Scale;
use sdf_core::minimize::{Certified, FrankWolfe, GoldenSection, Newton, PointSampling, ProjectedGradient};

use crate::abi::{FieldBlob, Frame, GridParams, PoseParams, SearchParams, ShapeParams, TEAM, VERSION};
use crate::fields::{self, DenseGrid, Part, Shapes, SparseGrid};
use crate::stages;

/// A kernel on the CPU.
#[cfg(not(target_arch = "nvptx64"))]
pub struct Kernel {
    pub name: &'static str,
    /// Bytes of each argument.
    pub argument_bytes: &'static [usize],
    /// Work of one thread, which takes the addresses of the arguments.
    pub run: unsafe fn(&[*const u8]),
}

/// Functions as kernels, under their names.
macro_rules! kernels {
    ($table:ident: $($(#[$doc:meta])* fn $name:ident($($argument:ident: $type:ty),+) $body:block)+) => {
        $(
            $(#[$doc])*
            #[cfg(target_arch = "nvptx64")]
            #[unsafe(no_mangle)]
            pub unsafe extern "ptx-kernel" fn $name($($argument: $type),+) {
                // SAFETY: the host passes what the kernel's header says.
                unsafe { $body }
            }
        )+

        #[cfg(not(target_arch = "nvptx64"))]
        static $table: &[Kernel] = &[$(Kernel {
            name: stringify!($name),
            argument_bytes: &[$(size_of::<$type>()),+],
            run: |arguments| {
                // SAFETY: the host passes what the kernel's header says.
                unsafe {
                    let mut arguments = arguments.iter();
                    $(let $argument: $type = argument(&mut arguments);)+
                    $body
                }
            },
        }),+];
    };
}

/// The next argument of a launch.
///
/// # Safety
/// Its address is that of a value of this type.
#[cfg(not(target_arch = "nvptx64"))]
unsafe fn argument<T: Copy>(arguments: &mut core::slice::Iter<*const u8>) -> T {
    // SAFETY: the caller's.
    unsafe { arguments.next().expect("an argument for each parameter").cast::<T>().read_unaligned() }
}

kernels! { PLAIN:
    /// Bytes of a [`Part`], a [`BlockBounds`] and a [`Scale`], for the host's allocations, and what these kernels understand.
    fn sizes(out: *mut [u32; 4]) {
        *out = [size_of::<Part>() as u32, size_of::<BlockBounds>() as u32, size_of::<Scale>() as u32, VERSION]
    }

    /// Block bounds from lowest sample, highest sample and slope bound.
    fn prepare_bounds(from: *const [f32; 3], to: *mut BlockBounds, count: u32) {
        let index = stages::thread();
        if index < count as usize {
            let [lower, upper, slope_bound] = *from.add(index);
            to.add(index).write(BlockBounds { range: Interval { lower, upper }, slope_bound });
        }
    }

    /// Scales of bricks from base and step.
    fn prepare_scales(from: *const [f32; 2], to: *mut Scale, count: u32) {
        let index = stages::thread();
        if index < count as usize {
            let [base, step] = *from.add(index);
            to.add(index).write(Scale { base, step });
        }
    }

    fn prepare_dense(params: *const GridParams, blob: *mut FieldBlob) {
        fields::store(blob, fields::dense(&*params))
    }

    fn prepare_sparse_u16(params: *const GridParams, blob: *mut FieldBlob) {
        fields::store(blob, fields::sparse::<u16>(&*params))
    }

    fn prepare_sparse_f32(params: *const GridParams, blob: *mut FieldBlob) {
        fields::store(blob, fields::sparse::<f32>(&*params))
    }

    /// A union of closed forms; none of them if one has invalid numbers.
    fn prepare_shapes(params: *const ShapeParams, parts: *mut Part, count: u32, blob: *mut FieldBlob) {
        let mut is_valid = true;
        for index in 0..count as usize {
            match fields::part(&*params.add(index)) {
                Some(part) => parts.add(index).write(part),
                None => is_valid = false,
            }
        }
        fields::store(blob, if is_valid { fields::union(parts as u64, count) } else { None });
    }

    /// Points of the world in the field's frame.
    fn place_points(pose: PoseParams, from: *const [f32; 3], to: *mut [f32; 3], count: u32) {
        let index = stages::thread();
        if index < count as usize {
            *to.add(index) = pose.pull(*from.add(index));
        }
    }

    /// Contacts of the field's frame in the world.
    fn place_contacts(pose: PoseParams, frame: Frame) {
        stages::place(&pose, &frame)
    }
}

/// Kernels of a stage that has no method: name, field, corners of an element.
macro_rules! stage {
    ($table:ident, $stage:ident: $($name:ident, $field:ty, $n:literal;)+) => {
        kernels! { $table: $(
            fn $name(field: FieldBlob, frame: Frame) {
                stages::$stage::<$field, $n>(fields::load(&field), &frame)
            }
        )+ }
    };
}

/// Kernels of a search, or of all stages in one: name, field, corners of an element, method.
macro_rules! method {
    ($table:ident, $stage:ident: $($name:ident, $field:ty, $n:literal, $method:ident;)+) => {
        kernels! { $table: $(
            fn $name(field: FieldBlob, frame: Frame, search: SearchParams) {
                stages::$stage::<$field, _, $n>(fields::load(&field), &$method(&search), &frame)
            }
        )+ }
    };
}

#[inline(always)]
fn frank_wolfe(search: &SearchParams) -> FrankWolfe {
    FrankWolfe { iterations: search.iterations, tolerance: search.tolerance }
}

#[inline(always)]
fn projected_gradient(search: &SearchParams) -> ProjectedGradient {
    ProjectedGradient { iterations: search.iterations, tolerance: search.tolerance }
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

#[inline(always)]
fn certified(search: &SearchParams) -> Certified {
    let local = Newton { iterations: 8, tolerance: 1e-8 };
    Certified { evaluations: search.iterations, tolerance: search.tolerance, local }
}

stage! { CULL, cull:
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

method! { SEARCH, search:
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
    search_edges_sparse_u16_projected_gradient, SparseGrid<u16>, 2, projected_gradient;
    search_edges_sparse_f32_projected_gradient, SparseGrid<f32>, 2, projected_gradient;
    search_edges_shapes_projected_gradient, Shapes, 2, projected_gradient;
    search_vertices_dense_point_sampling, DenseGrid, 1, point_sampling;
    search_vertices_sparse_u16_point_sampling, SparseGrid<u16>, 1, point_sampling;
    search_vertices_sparse_f32_point_sampling, SparseGrid<f32>, 1, point_sampling;
    search_vertices_shapes_point_sampling, Shapes, 1, point_sampling;
}

/// Threads of an element in a certified search of a grid, and of a union.
const OF_GRID: usize = TEAM as usize;
const OF_SHAPES: usize = 1;

/// Certified searches by teams of so many threads: name, field, corners of an element.
macro_rules! certify {
    ($table:ident, $threads:ident: $($name:ident, $field:ty, $n:literal;)+) => {
        kernels! { $table: $(
            fn $name(field: FieldBlob, frame: Frame, search: SearchParams) {
                if stages::is_at_work::<$threads>(&frame) {
                    // The search takes the field's address: here, so that only threads at work have it on their stack.
                    let own = field;
                    stages::certify::<$field, _, $n, $threads>(fields::load(&own), &certified(&search), &frame)
                }
            }
        )+ }
    };
}

certify! { CERTIFY_ON_GRID, OF_GRID:
    search_faces_dense_certified, DenseGrid, 3;
    search_edges_dense_certified, DenseGrid, 2;
    search_faces_sparse_u16_certified, SparseGrid<u16>, 3;
    search_edges_sparse_u16_certified, SparseGrid<u16>, 2;
    search_faces_sparse_f32_certified, SparseGrid<f32>, 3;
    search_edges_sparse_f32_certified, SparseGrid<f32>, 2;
}

certify! { CERTIFY_ON_SHAPES, OF_SHAPES:
    search_faces_shapes_certified, Shapes, 3;
    search_edges_shapes_certified, Shapes, 2;
}

stage! { REPORT, report:
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

method! { FUSED, contact:
    contact_faces_dense_frank_wolfe, DenseGrid, 3, frank_wolfe;
    contact_faces_dense_projected_gradient, DenseGrid, 3, projected_gradient;
    contact_edges_dense_frank_wolfe, DenseGrid, 2, frank_wolfe;
    contact_vertices_dense_point_sampling, DenseGrid, 1, point_sampling;
    contact_faces_shapes_frank_wolfe, Shapes, 3, frank_wolfe;
    contact_vertices_shapes_point_sampling, Shapes, 1, point_sampling;
}

method! { LEAN, lean:
    lean_faces_dense_frank_wolfe, DenseGrid, 3, frank_wolfe;
    lean_faces_dense_projected_gradient, DenseGrid, 3, projected_gradient;
    lean_faces_sparse_u16_frank_wolfe, SparseGrid<u16>, 3, frank_wolfe;
    lean_faces_shapes_frank_wolfe, Shapes, 3, frank_wolfe;
    lean_faces_sparse_u16_projected_gradient, SparseGrid<u16>, 3, projected_gradient;
    lean_faces_shapes_projected_gradient, Shapes, 3, projected_gradient;
    lean_edges_dense_frank_wolfe, DenseGrid, 2, frank_wolfe;
    lean_edges_dense_projected_gradient, DenseGrid, 2, projected_gradient;
    lean_vertices_dense_point_sampling, DenseGrid, 1, point_sampling;
    lean_vertices_sparse_u16_point_sampling, SparseGrid<u16>, 1, point_sampling;
    lean_vertices_shapes_point_sampling, Shapes, 1, point_sampling;
}

stage! { LEAN_CULL, lean_cull:
    lean_cull_faces_dense, DenseGrid, 3;
    lean_cull_faces_sparse_u16, SparseGrid<u16>, 3;
}

method! { LEAN_SEARCH, lean_search:
    lean_search_faces_dense_frank_wolfe, DenseGrid, 3, frank_wolfe;
    lean_search_faces_sparse_u16_frank_wolfe, SparseGrid<u16>, 3, frank_wolfe;
    lean_search_faces_dense_projected_gradient, DenseGrid, 3, projected_gradient;
    lean_search_faces_sparse_u16_projected_gradient, SparseGrid<u16>, 3, projected_gradient;
}

/// The kernel of this name.
#[cfg(not(target_arch = "nvptx64"))]
pub fn find(name: &str) -> Option<&'static Kernel> {
    [PLAIN, CULL, SEARCH, CERTIFY_ON_GRID, CERTIFY_ON_SHAPES, REPORT, FUSED, LEAN, LEAN_CULL, LEAN_SEARCH]
        .into_iter()
        .flatten()
        .find(|kernel| kernel.name == name)
}
