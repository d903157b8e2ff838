//! Random polygons and meshes, and writers of all formats.

use std::fmt::Write;
use std::path::PathBuf;

use crate::random::Random;

/// Points and polygons, to be written in any format.
#[derive(Clone, Default)]
pub struct Model {
    pub points: Vec<[f64; 3]>,
    pub polygons: Vec<Vec<u32>>,
}

impl Model {
    /// A random mesh of points that are exact as f32, with polygons of 3 to `max_corners` corners.
    pub fn random(random: &mut Random, points: usize, polygons: usize, max_corners: usize) -> Self {
        let points: Vec<_> = (0..points).map(|_| [random.unit(), -random.unit(), 4.0 * random.unit()]).collect();
        let polygon = |random: &mut Random| {
            let corners = 3 + random.below(max_corners - 2);
            (0..corners).map(|_| random.below(points.len()) as u32).collect()
        };
        let polygons = (0..polygons).map(|_| polygon(random)).collect();
        Self { points, polygons }
    }

    pub fn obj(&self) -> String {
        let mut text = String::new();
        for [x, y, z] in &self.points {
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
        for polygon in &self.polygons {
            text.push('f');
            polygon.iter().for_each(|i| write!(text, " {}", i + 1).unwrap());
            text.push('\n');
        }
        text
    }

    pub fn off(&self) -> String {
        let mut text = format!("OFF\n{} {} 0\n", self.points.len(), self.polygons.len());
        for [x, y, z] in &self.points {
            writeln!(text, "{x} {y} {z}").unwrap();
        }
        for polygon in &self.polygons {
            write!(text, "{}", polygon.len()).unwrap();
            polygon.iter().for_each(|i| write!(text, " {i}").unwrap());
            text.push('\n');
        }
        text
    }

    pub fn ply(&self, encoding: &str) -> Vec<u8> {
        let mut bytes = format!(
            "ply\nformat {encoding} 1.0\ncomment made by a test\nelement vertex {}\nproperty float x\nproperty float y\n\
             property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.points.len(),
            self.polygons.len()
        )
        .into_bytes();
        let mut put = |little: &[u8], text: String| match encoding {
            "ascii" => bytes.extend(text.bytes()),
            "binary_little_endian" => bytes.extend(little),
            _ => bytes.extend(little.iter().rev()),
        };
        for [x, y, z] in &self.points {
            put(&(*x as f32).to_le_bytes(), format!("{x} "));
            put(&(*y as f32).to_le_bytes(), format!("{y} "));
            put(&(*z as f32).to_le_bytes(), format!("{z}\n"));
        }
        for polygon in &self.polygons {
            put(&[polygon.len() as u8], polygon.len().to_string());
            polygon.iter().for_each(|i| put(&i.to_le_bytes(), format!(" {i}")));
            put(&[], "\n".into());
        }
        bytes
    }

    pub fn stl_text(&self) -> String {
        let mut text = "solid a name of words\n".to_string();
        for triangle in &self.polygons {
            text.push_str("facet normal 0 0 1\n outer loop\n");
            for &i in triangle {
                let [x, y, z] = self.points[i as usize];
                writeln!(text, "  vertex {x:e} {y:e} {z:e}").unwrap();
            }
            text.push_str(" endloop\nendfacet\n");
        }
        text + "endsolid a name of words\n"
    }

    pub fn stl_binary(&self, header: &str) -> Vec<u8> {
        let mut bytes = header.as_bytes().to_vec();
        bytes.resize(80, 0);
        bytes.extend((self.polygons.len() as u32).to_le_bytes());
        for triangle in &self.polygons {
            bytes.extend([0; 12]);
            for &i in triangle {
                self.points[i as usize].iter().for_each(|x| bytes.extend((*x as f32).to_le_bytes()));
            }
            bytes.extend([0; 2]);
        }
        bytes
    }
}

/// A simple polygon through random points: a closed path whose crossings are removed one by one.
pub fn simple_polygon(random: &mut Random, corners: usize) -> Vec<[f64; 2]> {
    let mut path: Vec<_> = (0..corners).map(|_| [random.unit(), random.unit()]).collect();
    loop {
        let mut crossed = false;
        for i in 0..corners {
            for j in i + 2..corners {
                if is_crossing(path[i], path[i + 1], path[j], path[(j + 1) % corners]) {
                    path[i + 1..=j].reverse();
                    crossed = true;
                }
            }
        }
        if !crossed {
            return path;
        }
    }
}

fn is_crossing(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> bool {
    turn(a, b, c) * turn(a, b, d) < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0
}

/// Twice the area of a triangle. Exact for multiples of 2^-20 in [0, 1].
pub fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Twice the area of a polygon.
pub fn area(polygon: &[[f64; 2]]) -> f64 {
    polygon.windows(2).map(|edge| turn(polygon[0], edge[0], edge[1])).sum()
}

/// Meshes kept beside the project, if there are any.
pub fn shared_meshes(ending: &str) -> Vec<PathBuf> {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/meshes"));
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: no shared meshes here");
        return Vec::new();
    };
    let mut paths: Vec<_> =
        entries.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == ending)).collect();
    paths.sort();
    paths
}
