//! Fields as the kernels hold them, and the functions that make them of plain numbers.

#[cfg(target_arch = "nvptx64")]
use core::arch::asm;

use sdf_core::combine::Compound;
use sdf_core::delegate_sdf;
use sdf_core::grid::sparse::{BRICK_SAMPLES, Bricks, Code, Scale, Sparse};
use sdf_core::grid::{BlockBounds, Grid, Lattice, Storage, WithBlockBounds};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placement, Posed, Similarity};
use sdf_core::shapes::{Capsule, Cone, Cuboid, Cylinder, Sphere, Torus};
use sdf_core::{Aabb, EnclosedSdf, Enclosure, Float, Real, Relaxation, Sample, Sdf};

use crate::abi::{FIELD_MARK, FieldBlob, GridParams, ShapeParams, Slice, shape};
use crate::team::OfTeam;

/// Dense samples with block bounds.
pub type DenseGrid = Grid<WithBlockBounds<OfTeam<CardDense>, &'static [BlockBounds]>>;

/// Bricks of any precision.
pub type SparseGrid<C> = Grid<OfTeam<Sparse<CardBricks<C>>>>;

/// The union of closed forms.
pub type Shapes = Compound<&'static [Part]>;

/// The samples of all nodes, x fastest, in the card's memory.
///
/// [`Dense`](sdf_core::grid::Dense) would do, too. It checks each index against the length in 64 bits, which costs a third of the
/// registers.
#[derive(Clone, Copy)]
pub struct CardDense {
    samples: *const f32,
    /// Samples from a node to its neighbour in y.
    row: u32,
    /// Samples from a node to its neighbour in z.
    layer: u32,
}

impl CardDense {
    /// `None` unless there are as many samples as nodes, and fewer than 2³².
    fn new(lattice: &Lattice, samples: &'static [f32]) -> Option<Self> {
        let [x, y, _] = lattice.nodes();
        let fits = samples.len() == lattice.node_count() && u32::try_from(samples.len()).is_ok();
        fits.then_some(Self { samples: samples.as_ptr(), row: x, layer: x.wrapping_mul(y) })
    }
}

impl Storage for CardDense {
    #[inline(always)]
    fn corners(&self, [x, y, z]: [u32; 3]) -> [f32; 8] {
        let first = z.wrapping_mul(self.layer).wrapping_add(y.wrapping_mul(self.row)).wrapping_add(x);
        let pair = |index: u32| {
            // SAFETY: the cell is one of the lattice, and `new` saw samples at all its nodes.
            unsafe {
                let low = self.samples.add(index as usize);
                [read_only(low), read_only(low.add(1))]
            }
        };
        let above = first.wrapping_add(self.layer);
        let ([a, b], [c, d]) = (pair(first), pair(first.wrapping_add(self.row)));
        let ([e, f], [g, h]) = (pair(above), pair(above.wrapping_add(self.row)));
        [a, b, c, d, e, f, g, h]
    }
}

/// A number that no thread writes, read through the cache for such numbers.
///
/// # Safety
/// The address is that of a number in the card's memory.
#[cfg(target_arch = "nvptx64")]
#[inline(always)]
unsafe fn read_only(address: *const f32) -> f32 {
    let number: f32;
    // SAFETY: the caller's; the load changes nothing.
    unsafe {
        asm!("ld.global.nc.f32 {0}, [{1}];", out(reg32) number, in(reg64) address, options(pure, readonly, nostack));
    }
    number
}

/// The same on the CPU.
///
/// # Safety
/// As there.
#[cfg(not(target_arch = "nvptx64"))]
unsafe fn read_only(address: *const f32) -> f32 {
    // SAFETY: the caller's.
    unsafe { *address }
}

/// The arrays of a sparse grid in the card's memory.
pub struct CardBricks<C: 'static> {
    table: &'static [u32],
    scales: &'static [Scale],
    samples: &'static [C],
    bounds: &'static [BlockBounds],
    coarse: &'static [f32],
    errors: &'static [f32],
}

impl<C: Code> Bricks for CardBricks<C> {
    type Code = C;
    #[inline(always)]
    fn table(&self) -> &[u32] {
        self.table
    }
    #[inline(always)]
    fn scales(&self) -> &[Scale] {
        self.scales
    }
    #[inline(always)]
    fn samples(&self) -> &[C] {
        self.samples
    }
    #[inline(always)]
    fn bounds(&self) -> &[BlockBounds] {
        self.bounds
    }
    #[inline(always)]
    fn coarse(&self) -> &[f32] {
        self.coarse
    }
    #[inline(always)]
    fn errors(&self) -> &[f32] {
        self.errors
    }
}

/// A closed form.
pub enum Shape {
    Sphere(Sphere),
    Cuboid(Cuboid),
    Capsule(Capsule),
    Cylinder(Cylinder),
    Cone(Cone),
    Torus(Torus),
}

delegate_sdf!(Shape { Sphere, Cuboid, Capsule, Cylinder, Cone, Torus });

/// A closed form as it stands, or placed.
pub struct Part {
    shape: Shape,
    /// There without a place, too, so that it is read before the answer to that question, together with it.
    pose: Similarity,
    is_placed: bool,
    /// The middle of the box around its surface, in the frame of the union, and half of its sides.
    center: [f32; 3],
    half: [f32; 3],
}

impl Part {
    fn posed(&self) -> Posed<&Shape, Similarity> {
        Posed { field: &self.shape, pose: self.is_placed.then_some(self.pose) }
    }
}

impl Sdf for Part {
    const IS_SMOOTH_AS_IT_IS: bool = true;

    #[inline(always)]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let [x, y, z] = point.into();
        evaluate_part(self, x, y, z)
    }
    fn bounds(&self, level: f64) -> Aabb {
        self.posed().bounds(level)
    }
    fn slope_bound(&self) -> f64 {
        self.posed().slope_bound()
    }
    fn magnitude<R: Real>(&self) -> R {
        self.posed().magnitude()
    }
    fn extent<R: Real>(&self) -> R {
        self.posed().extent()
    }
    /// All shapes are true distances: none is below the signed distance to the box around it, nor that below the largest along an axis.
    #[inline(always)]
    fn lowest_about<R: Real>(&self, point: Vector3<R>) -> R {
        // SAFETY: all parts are in the card's memory.
        let Part { center, half, .. } = unsafe { in_card_memory(self) };
        let number = |x: f32| R::from_f64(x.into());
        let beyond = |k: usize| (point[k] - number(center[k])).abs() - number(half[k]);
        beyond(0).max(beyond(1)).max(beyond(2))
    }
}

/// One copy of the code of all shapes: a warp waits longer for code that it has not run yet than for a call. Arguments and answer are in
/// registers by the ABI of C.
#[allow(improper_ctypes_definitions, reason = "only this crate calls it")]
#[inline(never)]
extern "C" fn evaluate_part<R: Real>(part: &Part, x: R, y: R, z: R) -> Sample<R> {
    // SAFETY: all parts are in the card's memory.
    let Part { shape, pose, is_placed, .. } = unsafe { in_card_memory(part) };
    let point = Vector3::new(x, y, z);
    let pulled = pose.pull(point);
    let local = shape.evaluate(if *is_placed { pulled.point } else { point });
    let placed = pulled.push_sample(local);
    if *is_placed { placed } else { local }
}

/// The same reference. The compiler learns that it is one of the card's memory, and not of a thread's stack.
///
/// # Safety
/// It is.
#[cfg(target_arch = "nvptx64")]
#[inline(always)]
unsafe fn in_card_memory<T>(reference: &T) -> &T {
    let address: u64;
    // SAFETY: the same address; see gpu/kernels/link on pointers that are made of integers.
    unsafe {
        asm!("mov.u64 {0}, {1};", out(reg64) address, in(reg64) &raw const *reference as u64, options(pure, nomem, nostack));
        &*(address as *const T)
    }
}

/// The same on the CPU.
///
/// # Safety
/// As there.
#[cfg(not(target_arch = "nvptx64"))]
unsafe fn in_card_memory<T>(reference: &T) -> &T {
    reference
}

/// Bounds that a certified search asks for.
impl EnclosedSdf for Part {
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.posed().enclosure(about, corners)
    }
    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        self.posed().relaxation(about, corners)
    }
    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        self.posed().is_convex_on(corners)
    }
    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        self.posed().max_rise_to_corners(corners)
    }
    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.posed().linearization_error(region)
    }
}

/// # Safety
/// The slice is that of an array of `T` in the card's memory.
unsafe fn slice<T>(slice: Slice) -> &'static [T] {
    // An empty slice needs an address, too.
    let address = if slice.len == 0 { align_of::<T>() as u64 } else { slice.address };
    // SAFETY: the caller's.
    unsafe { core::slice::from_raw_parts(address as *const T, slice.len as usize) }
}

/// Nodes along an axis, so that f32 has all of them and their halves.
const MAX_NODES: u32 = 1 << 22;

fn grid<S: Storage>(params: &GridParams, storage: impl FnOnce(&Lattice) -> Option<S>) -> Option<Grid<S>> {
    let [x, y, z] = params.nodes;
    if [x, y, z].iter().any(|nodes| *nodes >= MAX_NODES) {
        return None;
    }
    let lattice = Lattice::new(params.origin, params.spacing, [x, y, z])?;
    let storage = storage(&lattice)?;
    let grid = Grid::new(lattice, storage, params.slope_bound)?;
    let grid = grid.with_band(params.band).with_error_bound(params.error_bound).with_deep_error(params.deep_error);
    Some(grid.with_inside_at_box(params.inside_reaches_box != 0))
}

/// # Safety
/// The slices are those of arrays as [`GridParams`] describes them.
pub unsafe fn dense(params: &GridParams) -> Option<DenseGrid> {
    // SAFETY: the caller's.
    let (samples, bounds) = unsafe { (slice(params.samples), slice(params.bounds)) };
    grid(params, |lattice| WithBlockBounds::new(lattice, OfTeam(CardDense::new(lattice, samples)?), bounds))
}

/// # Safety
/// As [`dense`].
pub unsafe fn sparse<C: Code>(params: &GridParams) -> Option<SparseGrid<C>> {
    // SAFETY: the caller's.
    let bricks = unsafe {
        CardBricks::<C> {
            table: slice(params.table),
            scales: slice(params.scales),
            samples: slice(Slice { len: params.scales.len * BRICK_SAMPLES as u64, ..params.samples }),
            bounds: slice(params.bounds),
            coarse: slice(params.coarse),
            errors: slice(params.errors),
        }
    };
    grid(params, |lattice| Some(OfTeam(Sparse::new(lattice, bricks)?)))
}

/// A closed form from the arguments of its constructor.
pub fn part(params: &ShapeParams) -> Option<Part> {
    let [a, b, c, d, e, f, g] = params.numbers;
    let shape = match params.kind {
        shape::SPHERE => Shape::Sphere(Sphere::new(a)?),
        shape::CUBOID => Shape::Cuboid(Cuboid::new([a, b, c])?),
        shape::CAPSULE => Shape::Capsule(Capsule::new([a, b, c], [d, e, f], g)?),
        shape::CYLINDER => Shape::Cylinder(Cylinder::new(a, b)?),
        shape::CONE => Shape::Cone(Cone::new(a, b)?),
        shape::TORUS => Shape::Torus(Torus::new(a, b)?),
        _ => return None,
    };
    let is_placed = params.is_placed != 0;
    let pose = match is_placed {
        true => Similarity::new(params.translation, params.rotation, params.scale)?,
        false => Similarity::new([0.0; 3], [0.0, 0.0, 0.0, 1.0], 1.0)?,
    };
    let mut part = Part { shape, pose, is_placed, center: [0.0; 3], half: [0.0; 3] };
    let Aabb { min, max } = part.bounds(0.0);
    for k in 0..3 {
        (part.center[k], part.half[k]) = ((0.5 * (min[k] + max[k])) as f32, (0.5 * (max[k] - min[k])) as f32);
    }
    Some(part)
}

/// # Safety
/// As many parts as `count` stand at the address.
pub unsafe fn union(parts: u64, count: u32) -> Option<Shapes> {
    // SAFETY: the caller's.
    Compound::new(unsafe { slice(Slice { address: parts, len: u64::from(count) }) })
}

/// Writes a field where the host will read it, or zeros, which no field is, where there is none.
///
/// # Safety
/// `blob` is the address of a [`FieldBlob`].
pub unsafe fn store<F>(blob: *mut FieldBlob, field: Option<F>) {
    const { assert!(size_of::<F>() <= FIELD_MARK * size_of::<u64>() && align_of::<F>() <= align_of::<FieldBlob>()) }
    // SAFETY: it fits, by the line above.
    unsafe {
        *blob = FieldBlob([0; 40]);
        if let Some(field) = field {
            (*blob).0[FIELD_MARK] = 1;
            blob.cast::<F>().write(field);
        }
    }
}

/// The field that [`store`] wrote.
///
/// # Safety
/// The blob is that of a field of this type.
#[inline(always)]
pub unsafe fn load<F>(blob: &FieldBlob) -> &F {
    // SAFETY: the caller's.
    unsafe { &*(&raw const *blob).cast::<F>() }
}
