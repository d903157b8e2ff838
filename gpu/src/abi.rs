//! Plain numbers that the host and the kernels exchange. Both crates compile this file.
//!
//! Everything is `repr(C)` and made of integers and floats of fixed size. An address of the card is a `u64`.

/// Counts the changes of this file, and the mends without which kernels are wrong: kernels of another version are refused.
pub const VERSION: u32 = 16;

/// Threads of a certified search on a grid: a team has one element.
pub const TEAM: u32 = 8;

/// A list in the card's memory.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Slice {
    pub address: u64,
    pub len: u64,
}

/// A grid: its lattice, what is known of it, and where its arrays are. Arrays that a layout does not have are empty.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct GridParams {
    pub origin: [f64; 3],
    pub spacing: f64,
    pub slope_bound: f64,
    pub band: f64,
    pub error_bound: f64,
    pub deep_error: f64,
    pub nodes: [u32; 3],
    /// Not 0: the inside reaches the faces of the box.
    pub inside_reaches_box: u32,
    /// Samples of a dense grid, or codes of the bricks.
    pub samples: Slice,
    /// Per block or brick: the lowest sample, the highest, and the slope bound.
    pub bounds: Slice,
    /// Sparse: the brick in each slot.
    pub table: Slice,
    /// Sparse: base and step of each brick.
    pub scales: Slice,
    /// Sparse: samples of the coarse grid.
    pub coarse: Slice,
    /// Sparse: the error bound of each brick.
    pub errors: Slice,
}

/// A closed form and its place.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShapeParams {
    /// One of the constants in [`shape`].
    pub kind: u32,
    /// 1 if the place below counts, 0 if the shape stands as it is.
    pub is_placed: u32,
    /// Arguments of the shape's constructor, in their order.
    pub numbers: [f64; 7],
    pub translation: [f64; 3],
    /// A quaternion x, y, z, w.
    pub rotation: [f64; 4],
    pub scale: f64,
}

/// Kinds of closed forms.
pub mod shape {
    pub const SPHERE: u32 = 0;
    pub const CUBOID: u32 = 1;
    pub const CAPSULE: u32 = 2;
    pub const CYLINDER: u32 = 3;
    pub const CONE: u32 = 4;
    pub const TORUS: u32 = 5;
}

/// A field as the kernels hold it: written by a `prepare` kernel, passed to all others, opaque to the host.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct FieldBlob(pub [u64; 40]);

/// The word of a [`FieldBlob`] that is 1 if it holds a field, behind all fields.
pub const FIELD_MARK: usize = 39;

/// Vertices, edges or faces of a mesh, and where the stages write.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Frame {
    /// `[f32; 3]` per vertex.
    pub points: u64,
    /// `[u32; N]` per element; unused for vertices.
    pub elements: u64,
    /// [`SURVIVOR_BYTES`] per element.
    pub survivors: u64,
    /// [`HIT_BYTES`] per element.
    pub hits: u64,
    /// [`ContactRecord`] per element.
    pub contacts: u64,
    /// Where a search appends the elements that it does not settle, as many as there are; 0 if it settles all.
    pub unsettled: u64,
    /// A `u32` for each constant of [`counter`].
    pub counters: u64,
    pub element_count: u32,
    /// The counter of `survivors`.
    pub survivor_counter: u32,
    pub margin: f32,
    pub unused: u32,
}

/// Indices of the counters of a [`Frame`].
pub mod counter {
    /// Elements that the cull left.
    pub const SURVIVORS: u32 = 0;
    /// Minima within the margin.
    pub const HITS: u32 = 1;
    /// Elements that were skipped.
    pub const SKIPPED: u32 = 2;
    /// Elements that the first search did not settle.
    pub const UNSETTLED: u32 = 3;
    /// Elements that the certified search left open.
    pub const OPEN: u32 = 4;
}

/// Where a field stands: a world point is t + R p, with p in the field's frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseParams {
    /// Rows of Rᵀ.
    pub local_from_world: [[f64; 3]; 3],
    /// t.
    pub translation: [f64; 3],
}

impl PoseParams {
    /// Point of the field's frame, in f64 so that a mesh far from the origin loses nothing by its place.
    #[inline(always)]
    pub fn pull(&self, point: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = [0, 1, 2].map(|axis: usize| f64::from(point[axis % 3]) - self.translation[axis % 3]);
        self.local_from_world.map(|row| (row[0] * x + row[1] * y + row[2] * z) as f32)
    }

    /// Point of the world.
    #[inline(always)]
    pub fn push(&self, point: [f32; 3]) -> [f32; 3] {
        let turned = self.turn(point);
        [0, 1, 2].map(|axis: usize| (turned[axis % 3] + self.translation[axis % 3]) as f32)
    }

    /// Direction in the world.
    #[inline(always)]
    pub fn turned(&self, direction: [f32; 3]) -> [f32; 3] {
        self.turn(direction).map(|number| number as f32)
    }

    /// R times a vector.
    #[inline(always)]
    fn turn(&self, vector: [f32; 3]) -> [f64; 3] {
        let [x, y, z] = vector.map(f64::from);
        let [first, second, third] = &self.local_from_world;
        [0, 1, 2].map(|axis: usize| first[axis % 3] * x + second[axis % 3] * y + third[axis % 3] * z)
    }
}

/// Bytes that the cull writes for an element it leaves.
pub const SURVIVOR_BYTES: usize = 8;

/// Bytes that a search writes for a minimum within the margin.
pub const HIT_BYTES: usize = 80;

/// Knobs of a search. A method ignores those it does not have.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchParams {
    /// Tolerance of the method, in its own unit.
    pub tolerance: f64,
    /// Largest number of steps, or the number of samples.
    pub iterations: u32,
    pub unused: u32,
}

/// A contact: the fields of `sdf_core::contact::Contact<f32>`, in their order.
///
/// Aligned, so that a thread writes 16 bytes at a time.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactRecord {
    /// 0 vertex, 1 edge, 2 face; another number where the field's answer is not finite.
    pub kind: u32,
    pub element: u32,
    pub vertices: [u32; 3],
    pub rank: u32,
    /// 0 vertex, 1 edge, 2 face.
    pub feature_kind: u32,
    /// Vertex, both vertices of an edge, or face.
    pub feature: [u32; 2],
    pub weights: [f32; 3],
    pub point: [f32; 3],
    pub surface_point: [f32; 3],
    pub normal: [f32; 3],
    pub slope: f32,
    pub distance: f32,
    pub lower_bound: f32,
    pub error_bound: f32,
    pub shape_lower_bound: f32,
    pub evaluations: u32,
    /// Index of the status among `sdf_core::contact::ContactStatus`, from the first on.
    pub status: u32,
}
