//! A checked triangle mesh: equal points welded, repeated triangles and triangles without area removed.
//!
//! `topology` counts what keeps it from bounding one solid and orients its triangles, with the help of `stitches`;
//! `intersections` finds crossing triangles exactly; `inner_faces` removes what lies inside of the solid, `inner_shells`
//! those of its shells that no other meets.

mod inner_faces;
mod inner_shells;
pub mod intersections;
pub mod known;
mod repeated;
mod stitches;
pub mod topology;

use std::hash::BuildHasher;
use std::sync::Arc;

use hashbrown::{DefaultHashBuilder, HashTable};
use robust::{Coord, orient2d};
use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;
use thiserror::Error;

use crate::bvh::Bvh;
use known::Known;
use topology::OrientedMesh;

/// Triangles that can be baked: indices in range, finite coordinates, positive extent.
///
/// Points at one position become one point; a triangle that occurs twice counts once, one without area not at all.
/// [`TriangleMesh::report`] has the counts.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    pub(crate) points: Vec<Vector3<f64>>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Collinear triangles of three points. No distance is measured to them, but they can join edges.
    pub(crate) stitches: Vec<[u32; 3]>,
    pub(crate) bounds: Aabb,
    pub(crate) report: MeshReport,
    /// Number of pairs of triangles that cross: `None` if not asked for yet, `Some(None)` if too many are near each other to compare.
    pub(crate) intersecting_pairs: Option<Option<usize>>,
    /// The triangles in the order of a tree, where one was built before.
    pub(crate) order: Option<Vec<u32>>,
    /// The tree of its triangles, and the mesh's orientation, where it was found before.
    pub(crate) tree: Known<Bvh>,
    pub(crate) orientation: Known<OrientedMesh>,
    /// The mesh whose winding numbers give the signs, where this is only the surface of its solid.
    pub(crate) solid: Option<Arc<TriangleMesh>>,
    /// Proven sides of each triangle as it is wound: 1 if the outside of the solid is in front of it and the inside behind it, −1 for the
    /// reverse, 0 for neither. `None` where no sides were computed.
    pub(crate) outward: Option<Vec<i8>>,
    /// Distance by which the surface may be off, as its corners are rounded.
    pub(crate) rounding: f64,
}

/// Redundancies of the input. None is an error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshReport {
    /// Points at the position of an earlier one, replaced by it.
    pub welded_points: usize,
    /// Points that no triangle uses.
    pub unreferenced_points: usize,
    /// Triangles without area, their corners repeated or collinear by exact predicates, removed.
    pub degenerate_triangles: usize,
    /// Triangles with the corners and winding of an earlier one, removed.
    pub repeated_triangles: usize,
    /// Closed shells that [`TriangleMesh::without_inner_shells`] removed: both their sides are inside of the solid.
    pub inner_shells: usize,
    /// Whole triangles that were removed: those of [`Self::inner_shells`], and what [`TriangleMesh::without_inner_faces`]
    /// found inside of the solid.
    pub inner_triangles: usize,
    /// Closed shells that cross or touch themselves or each other, and whose parts inside of the solid are not removed.
    pub entangled_shells: usize,
    /// Triangles that others divide, by crossing them or in their plane.
    pub crossing_triangles: usize,
    /// Pieces of [`Self::crossing_triangles`] that are part of the solid's surface.
    pub kept_pieces: usize,
    /// Pieces of [`Self::crossing_triangles`] that were removed: both their sides are inside of the solid.
    pub dropped_pieces: usize,
    /// Pieces as near to another triangle as rounding, whose sides are those a little farther away, if they are the same all along them.
    pub uncertain_pieces: usize,
    /// So many triangles cross that none was divided.
    pub has_too_many_crossings: bool,
    /// Vertices that [`Repairs::weld`](crate::Repairs::weld) moved onto another one.
    pub merged_points: usize,
    /// Boundary loops that [`Repairs::close`](crate::Repairs::close) capped.
    pub capped_loops: usize,
    /// Triangles of the caps.
    pub cap_triangles: usize,
    /// Boundary loops that were too large for it.
    pub open_loops: usize,
}

/// Reason why a mesh cannot be baked.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum InvalidMesh {
    /// The list of triangles is empty.
    #[error("the mesh has no triangles")]
    NoTriangles,
    /// Every triangle has repeated or collinear corners.
    #[error("no triangle of the mesh has an area: the corners of each are repeated or on one line")]
    NoArea,
    /// The longest side of the bounding box is below 1e-30.
    #[error("the mesh has no extent: its longest side is {side:?}, and must be 1e-30 or more")]
    NoExtent {
        /// Longest side of the bounding box.
        side: f64,
    },
    /// [`Repairs::weld`](crate::Repairs::weld) made one point of all corners of each triangle that has an area, or put them on one line.
    #[error("welding vertices within {distance:?} of each other leaves no triangle an area: use a smaller weld")]
    WeldedAway {
        /// The distance of [`Repairs::weld`](crate::Repairs::weld).
        distance: f64,
    },
    /// A triangle has a corner that does not exist.
    #[error("triangle {triangle} refers to point {index}, but the mesh has {points} points")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The index that is too large.
        index: u32,
        /// Number of points.
        points: usize,
    },
    /// A coordinate of a triangle's corner is NaN or infinite.
    #[error("point {point} has a coordinate that is not finite")]
    NotFinite {
        /// Index of the point.
        point: usize,
    },
    /// A coordinate of a triangle's corner exceeds 1e30 in magnitude.
    #[error("the point {position:?} is too far out: a coordinate is beyond ±1e30")]
    TooFarOut {
        /// Index of the point.
        point: usize,
        /// Its coordinates.
        position: [f64; 3],
    },
}

/// Samples are f32, which end at 3e38 and lose digits below 1e-38.
const MAX_COORDINATE: f64 = 1e30;
const MIN_SIDE: f64 = 1e-30;

impl TriangleMesh {
    /// Checks the indices and coordinates, welds equal points and removes repeated triangles.
    pub fn new(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Self, InvalidMesh> {
        Self::check(points, triangles)?;
        let first_at_position = weld(points);
        let welded_points = (0..).zip(&first_at_position).filter(|(point, first)| *point != **first).count();

        let mut is_referenced = vec![false; points.len()];
        triangles.iter().flatten().for_each(|index| is_referenced[*index as usize] = true);
        let unreferenced_points = is_referenced.iter().filter(|is_referenced| !**is_referenced).count();
        let referenced = || points.iter().zip(&is_referenced).filter(|(_, used)| **used).map(|(point, _)| *point);
        let with_extent = |bounds: Aabb| match bounds.longest_side() {
            side if side < MIN_SIDE => Err(InvalidMesh::NoExtent { side }),
            _ => Ok(bounds),
        };
        with_extent(Aabb::from_points(referenced()).ok_or(InvalidMesh::NoTriangles)?)?;

        let points: Vec<Vector3<f64>> = points.iter().map(|point| Vector3::from(*point)).collect();
        let welded = triangles.iter().map(|corners| corners.map(|index| first_at_position[index as usize]));
        let unique = repeated::without_needless(&welded.collect::<Vec<_>>(), points.len());
        let repeated_triangles = triangles.len() - unique.len();
        let has_area = |corners: &[u32; 3]| has_area(corners.map(|index| points[index as usize]));
        let (mut triangles, mut stitches) = (unique, vec![]);
        triangles.retain(|corners| {
            let has_area = has_area(corners);
            stitches.extend((!has_area).then_some(*corners));
            has_area
        });
        triangles.shrink_to_fit();
        let degenerate_triangles = stitches.len();
        stitches.retain(|[a, b, c]| a != b && b != c && c != a);
        let corners = triangles.iter().flatten().map(|index| points[*index as usize].into());
        let bounds = with_extent(Aabb::from_points(corners).ok_or(InvalidMesh::NoArea)?)?;
        let counts = MeshReport { welded_points, unreferenced_points, ..MeshReport::default() };
        let report = MeshReport { degenerate_triangles, repeated_triangles, ..counts };
        let (intersecting_pairs, order, solid) = (None, None, None);
        let (tree, orientation) = (Known::default(), Known::default());
        Ok(Self {
            points,
            triangles,
            stitches,
            bounds,
            report,
            intersecting_pairs,
            order,
            tree,
            orientation,
            solid,
            outward: None,
            rounding: 0.0,
        })
    }

    /// Are all indices those of points, whose coordinates are finite and in range? Points that no triangle uses may be anything.
    pub(crate) fn check(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(), InvalidMesh> {
        if triangles.is_empty() {
            return Err(InvalidMesh::NoTriangles);
        }
        for (corner, &index) in triangles.as_flattened().iter().enumerate() {
            let point = index as usize;
            let Some(&position) = points.get(point) else {
                return Err(InvalidMesh::IndexOutOfRange { triangle: corner / 3, index, points: points.len() });
            };
            if position.iter().any(|x| !x.is_finite()) {
                return Err(InvalidMesh::NotFinite { point });
            }
            if position.iter().any(|x| x.abs() > MAX_COORDINATE) {
                return Err(InvalidMesh::TooFarOut { point, position });
            }
        }
        Ok(())
    }

    /// Box around all points that a triangle with an area uses.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Redundancies that were found in the input.
    pub fn report(&self) -> MeshReport {
        self.report
    }

    /// Number of triangles after the removal of repeated ones.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Corners of a triangle. Panics if there is no such triangle.
    pub fn corners(&self, triangle: usize) -> [[f64; 3]; 3] {
        self.triangles[triangle].map(|index| self.points[index as usize].into())
    }

    /// The mesh whose winding numbers tell inside from outside.
    pub(crate) fn mesh_of_signs(&self) -> &Self {
        self.solid.as_deref().unwrap_or(self)
    }

    pub(crate) fn corner_points(&self, corners: [u32; 3]) -> [Vector3<f64>; 3] {
        corners.map(|index| self.points[index as usize])
    }
}

/// For each point, the index of the first at its position.
fn weld(points: &[[f64; 3]]) -> Vec<u32> {
    let position = |index: u32| points[index as usize].map(|x| (x + 0.0).to_bits()); // −0 + 0 is 0
    // A new seed per process: a file could choose points that collide under a known one.
    let hasher = DefaultHashBuilder::default();
    let hash = |index: &u32| hasher.hash_one(position(*index));
    // The table holds indices, which take a seventh of the memory of points.
    let mut first_at: HashTable<u32> = HashTable::with_capacity(points.len());
    let first = |index: u32| {
        *first_at.entry(hash(&index), |first| position(*first) == position(index), hash).or_insert(index).get()
    };
    (0..).zip(points).map(|(index, _)| index).map(first).collect()
}

/// Is a triangle's area exactly more than zero? A projection along an axis then has an area too.
fn has_area(corners: [Vector3<f64>; 3]) -> bool {
    (0..3).any(|axis| {
        let [a, b, c] = corners.map(|p| Coord { x: p[(axis + 1) % 3], y: p[(axis + 2) % 3] });
        orient2d(a, b, c) != 0.0
    })
}
