use super::PolygonCounts;
use super::error::Fault;
use super::triangulate::{Cut, Triangulator, fan};

/// The polygons of a file while it is read. They wait as fans, triangles being most of them; points may come later.
#[derive(Default)]
pub(super) struct Polygons {
    triangles: Vec<[u32; 3]>,
    /// Of each triangle.
    polygons: Vec<u32>,
    /// Of each polygon with more than three corners: its first triangle, and how many it has.
    larger: Vec<(usize, usize)>,
    count: usize,
}

impl Polygons {
    /// Takes the three or more corners of the next polygon.
    #[inline]
    pub(super) fn push(&mut self, corners: &[u32]) -> Result<(), Fault> {
        debug_assert!(corners.len() >= 3);
        let Ok(polygon) = u32::try_from(self.count) else {
            return Err(Fault::of_file(format!("at most {} polygons", u32::MAX), "more"));
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

    /// The triangles, the polygon of each, and the counts. All corners must be among the points.
    pub(super) fn cut(mut self, points: &[[f64; 3]]) -> (Vec<[u32; 3]>, Vec<u32>, PolygonCounts) {
        let mut counts = PolygonCounts { all: self.count, larger: self.larger.len(), ..PolygonCounts::default() };
        let mut triangulator = Triangulator::new();
        let mut corners = Vec::new();
        for (first, count) in self.larger {
            let triangles = &mut self.triangles[first..first + count];
            corners.clear();
            corners.extend(&triangles[0][..2]);
            corners.extend(triangles.iter().map(|t| t[2]));
            match triangulator.cut(points, &corners, triangles) {
                Cut::Fan => {}
                Cut::Ears => counts.clipped += 1,
                Cut::Blind => counts.blind += 1,
            }
        }
        (self.triangles, self.polygons, counts)
    }
}
