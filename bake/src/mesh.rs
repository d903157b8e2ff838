pub mod intersections;
pub mod topology;

use std::hash::BuildHasher;

use hashbrown::hash_table::Entry;
use hashbrown::{DefaultHashBuilder, HashTable};
use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;
use thiserror::Error;

/// Triangles that can be baked: all indices in range, all coordinates finite, some area.
///
/// Points at the same place are one; a triangle that stands twice counts once. What was found is in [`MeshReport`].
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    pub(crate) points: Vec<Vector3<f64>>,
    pub(crate) triangles: Vec<[u32; 3]>,
    bounds: Aabb,
    report: MeshReport,
}

/// What a mesh held that a clean one would not. None of it is an error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshReport {
    /// Points at the place of an earlier one, taken for that one.
    pub welded_points: usize,
    /// Points that no triangle uses.
    pub unreferenced_points: usize,
    /// Triangles without area. Distances to them count; they have no side.
    pub degenerate_triangles: usize,
    /// Triangles with the same corners and winding as an earlier one, left out.
    pub repeated_triangles: usize,
}

#[derive(Debug, Error, PartialEq)]
pub enum MeshError {
    #[error("the mesh has no triangles")]
    NoTriangles,
    #[error("the mesh has no extent: its longest side is {side}, and must be 1e-30 or more")]
    NoExtent { side: f64 },
    #[error("triangle {triangle} names point {index}, but there are {points}")]
    IndexOutOfRange { triangle: usize, index: u32, points: usize },
    #[error("point {point} is not finite")]
    NotFinite { point: usize },
    #[error("point {point} is too far out: a coordinate is beyond ±1e30")]
    TooFarOut { point: usize },
}

/// Samples are f32, which end at 3e38 and lose digits below 1e-38.
const LARGEST_COORDINATE: f64 = 1e30;
const SMALLEST_SIDE: f64 = 1e-30;

impl TriangleMesh {
    pub fn new(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Self, MeshError> {
        if triangles.is_empty() {
            return Err(MeshError::NoTriangles);
        }
        for (point, coordinates) in points.iter().enumerate() {
            if coordinates.iter().any(|x| !x.is_finite()) {
                return Err(MeshError::NotFinite { point });
            }
            if coordinates.iter().any(|x| x.abs() > LARGEST_COORDINATE) {
                return Err(MeshError::TooFarOut { point });
            }
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|index| **index as usize >= points.len()) {
                return Err(MeshError::IndexOutOfRange { triangle, index, points: points.len() });
            }
        }
        let first_at_place = weld(points);
        let count = triangles.len();
        let mut report = MeshReport {
            welded_points: first_at_place
                .iter()
                .enumerate()
                .filter(|(point, first)| *point != **first as usize)
                .count(),
            ..MeshReport::default()
        };

        let mut is_referenced = vec![false; points.len()];
        triangles.iter().flatten().for_each(|index| is_referenced[*index as usize] = true);
        report.unreferenced_points = is_referenced.iter().filter(|is_referenced| !**is_referenced).count();
        let referenced = || points.iter().zip(&is_referenced).filter(|(_, used)| **used).map(|(point, _)| *point);
        let bounds = Aabb::from_points(referenced()).ok_or(MeshError::NoTriangles)?;
        let side = bounds.longest_side();
        if side < SMALLEST_SIDE {
            return Err(MeshError::NoExtent { side });
        }

        let points: Vec<Vector3<f64>> = points.iter().map(|point| Vector3::from(*point)).collect();
        let triangles = triangles.iter().map(|corners| corners.map(|index| first_at_place[index as usize]));
        let kept = without_repeated(triangles);
        report.repeated_triangles = count - kept.len();
        let has_area = |corners: &&[u32; 3]| has_area(corners.map(|index| points[index as usize]));
        report.degenerate_triangles = kept.len() - kept.iter().filter(has_area).count();
        Ok(Self { points, triangles: kept, bounds, report })
    }

    /// The box around all points that a triangle uses.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    pub fn report(&self) -> MeshReport {
        self.report
    }

    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// The corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [[f64; 3]; 3] {
        self.triangles[triangle].map(|index| self.points[index as usize].into())
    }

    pub(crate) fn corner_points(&self, corners: [u32; 3]) -> [Vector3<f64>; 3] {
        corners.map(|index| self.points[index as usize])
    }
}

/// For each point the first one at its place.
fn weld(points: &[[f64; 3]]) -> Vec<u32> {
    let place = |index: u32| points[index as usize].map(|x| (x + 0.0).to_bits()); // −0 + 0 is 0
    // Seeded anew by each process, for a file may choose its points so that they collide.
    let hasher = DefaultHashBuilder::default();
    let hash = |index: &u32| hasher.hash_one(place(*index));
    // Of indices alone, which take a seventh of the points' own room.
    let mut first_at: HashTable<u32> = HashTable::with_capacity(points.len());
    let first =
        |index: u32| *first_at.entry(hash(&index), |first| place(*first) == place(index), hash).or_insert(index).get();
    (0..).zip(points).map(|(index, _)| index).map(first).collect()
}

/// Of triangles with the same corners and winding the first.
fn without_repeated(triangles: impl ExactSizeIterator<Item = [u32; 3]>) -> Vec<[u32; 3]> {
    let mut kept: Vec<[u32; 3]> = Vec::with_capacity(triangles.len());
    let mut seen: HashTable<u32> = HashTable::with_capacity(triangles.len());
    let hasher = DefaultHashBuilder::default();
    for corners in triangles {
        let turned = turned_to_lowest_first(corners);
        let of_kept = |index: &u32| turned_to_lowest_first(kept[*index as usize]);
        let hash = |index: &u32| hasher.hash_one(of_kept(index));
        if let Entry::Vacant(place) = seen.entry(hasher.hash_one(turned), |index| of_kept(index) == turned, hash) {
            place.insert(kept.len() as u32);
            kept.push(corners);
        }
    }
    kept
}

/// The same triangle with the same winding, however its corners are counted.
fn turned_to_lowest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a <= b && a <= c {
        [a, b, c]
    } else if b <= c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

pub(crate) fn has_area([a, b, c]: [Vector3<f64>; 3]) -> bool {
    (b - a).cross(&(c - a)).iter().any(|x| *x != 0.0)
}
