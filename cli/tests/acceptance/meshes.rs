//! Small meshes, generated.

use std::collections::HashMap;
use std::fmt::Write;

/// Triangles on points.
#[derive(Clone, Default)]
pub struct Model {
    pub points: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Model {
    /// A closed ball with all points at `radius` from `center`: an octahedron with its faces divided into four `cuts` times.
    pub fn ball(center: [f64; 3], radius: f64, cuts: usize) -> Self {
        let mut points = vec![[1., 0., 0.], [-1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]];
        let mut triangles =
            vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        for _ in 0..cuts {
            let mut middles = HashMap::new();
            let mut finer = Vec::new();
            for [a, b, c] in triangles {
                let mut middle = |p: u32, q: u32| {
                    *middles.entry([p.min(q), p.max(q)]).or_insert_with(|| {
                        let sum: [f64; 3] = std::array::from_fn(|k| points[p as usize][k] + points[q as usize][k]);
                        let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
                        points.push(sum.map(|x| x / length));
                        points.len() as u32 - 1
                    })
                };
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
            }
            triangles = finer;
        }
        let scaled = |p: [f64; 3]| std::array::from_fn(|k| center[k] + radius * p[k]);
        Self { points: points.into_iter().map(scaled).collect(), triangles }
    }

    /// The box from 0 to 1 along each axis.
    pub fn cube() -> Self {
        let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2 & 1].map(f64::from);
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Self { points: (0..8).map(corner).collect(), triangles }
    }

    /// A hilly sheet of side 2 around the origin, with `cells` squares along each side.
    pub fn hills(cells: u32) -> Self {
        let mut sheet = Self::default();
        for row in 0..=cells {
            for column in 0..=cells {
                let [x, y] = [column, row].map(|step| 2.0 * f64::from(step) / f64::from(cells) - 1.0);
                sheet.points.push([x, y, 0.3 * (5.0 * x + 1.0).sin() * (4.0 * y).cos() + 0.1 * x]);
            }
        }
        for row in 0..cells {
            for column in 0..cells {
                let corner = row * (cells + 1) + column;
                let above = corner + cells + 1;
                sheet.triangles.extend([[corner, corner + 1, above + 1], [corner, above + 1, above]]);
            }
        }
        sheet
    }

    /// Both in one mesh, the points and triangles of `other` last.
    pub fn and(&self, other: &Self) -> Self {
        let first = self.points.len() as u32;
        let mut both = self.clone();
        both.points.extend(&other.points);
        both.triangles.extend(other.triangles.iter().map(|corners| corners.map(|corner| corner + first)));
        both
    }

    pub fn moved(&self, map: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        Self { points: self.points.iter().copied().map(map).collect(), triangles: self.triangles.clone() }
    }

    /// OBJ text that reads back bit for bit.
    pub fn obj(&self) -> String {
        let mut text = String::new();
        for [x, y, z] in &self.points {
            writeln!(text, "v {x:?} {y:?} {z:?}").unwrap();
        }
        for [a, b, c] in self.triangles.iter().map(|corners| corners.map(|corner| corner + 1)) {
            writeln!(text, "f {a} {b} {c}").unwrap();
        }
        text
    }

    pub fn ply(&self) -> String {
        let [points, faces] = [self.points.len(), self.triangles.len()];
        let mut text = format!(
            "ply\nformat ascii 1.0\nelement vertex {points}\nproperty double x\nproperty double y\nproperty double z\n\
             element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
        );
        self.points.iter().for_each(|[x, y, z]| writeln!(text, "{x:?} {y:?} {z:?}").unwrap());
        self.triangles.iter().for_each(|[a, b, c]| writeln!(text, "3 {a} {b} {c}").unwrap());
        text
    }

    /// Binary STL, rounded to f32.
    pub fn stl(&self) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes.extend((self.triangles.len() as u32).to_le_bytes());
        for corners in &self.triangles {
            bytes.extend([0; 12]);
            let coordinates = corners.iter().flat_map(|corner| self.points[*corner as usize]);
            bytes.extend(coordinates.flat_map(|x| (x as f32).to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }
}
