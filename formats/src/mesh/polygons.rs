use super::PolygonCounts;
use super::error::MeshFault;
use super::triangulate::{Cut, Triangulator, fan};

/// The polygons of a file while it is read, stored as fans. Larger polygons are cut at the end, because their points
/// may come later in the file.
#[derive(Default)]
pub(super) struct Polygons {
    triangles: Vec<[u32; 3]>,
    /// For each triangle, the index of its polygon.
    polygons: Vec<u32>,
    /// For each polygon with more than three corners: its first triangle and their number.
    larger: Vec<(usize, usize)>,
    count: usize,
}

impl Polygons {
    /// Adds a polygon of three or more corners.
    #[inline]
    pub(super) fn push(&mut self, corners: &[u32]) -> Result<(), MeshFault> {
        debug_assert!(corners.len() >= 3);
        let Ok(polygon) = u32::try_from(self.count) else {
            return Err(MeshFault::whole_file(format!("at most {} polygons", u32::MAX), "more"));
        };
        self.count += 1;
        if let &[a, b, c] = corners {
            self.triangles.push([a, b, c]);
            self.polygons.push(polygon);
            return Ok(());
        }
        let (first, count) = (self.triangles.len(), corners.len() - 2);
        self.triangles.resize(first + count, [0; 3]);
        self.polygons.resize(first + count, polygon);
        fan(corners, &mut self.triangles[first..]);
        self.larger.push((first, count));
        Ok(())
    }

    /// The triangles, the polygon of each, and the counts. All corners must be indices of `points`.
    pub(super) fn cut(mut self, points: &[[f64; 3]]) -> (Vec<[u32; 3]>, Vec<u32>, PolygonCounts) {
        let mut counts = PolygonCounts { total: self.count, larger: self.larger.len(), ..PolygonCounts::default() };
        let mut triangulator = Triangulator::new();
        let mut corners = Vec::new();
        for (first, count) in self.larger {
            let triangles = &mut self.triangles[first..first + count];
            corners.clear();
            corners.extend(&triangles[0][..2]);
            corners.extend(triangles.iter().map(|t| t[2]));
            match triangulator.cut(points, &corners, triangles) {
                Cut::Fan => {}
                Cut::Ears => counts.ear_clipped += 1,
                Cut::Unverified => counts.unverified += 1,
            }
        }
        (self.triangles, self.polygons, counts)
    }
}
