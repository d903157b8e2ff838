//! Test meshes. Closed ones are wound outward unless their name says otherwise.

use std::collections::HashMap;

use sdf_bake::TriangleMesh;
use sdf_core::nalgebra::{Rotation3, Vector3};

use crate::random::Random;

#[derive(Clone, Debug, Default)]
pub struct Mesh {
    pub points: Vec<Vector3<f64>>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    pub fn new(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Self {
        Self { points: points.iter().map(|p| Vector3::from(*p)).collect(), triangles: triangles.to_vec() }
    }

    pub fn baked(&self) -> TriangleMesh {
        TriangleMesh::new(&self.coordinates(), &self.triangles).unwrap()
    }

    pub fn coordinates(&self) -> Vec<[f64; 3]> {
        self.points.iter().map(|p| (*p).into()).collect()
    }

    pub fn corners(&self) -> Vec<[Vector3<f64>; 3]> {
        self.triangles.iter().map(|corners| corners.map(|index| self.points[index as usize])).collect()
    }

    /// Corners of the triangles with an area: no others are measured to.
    pub fn corners_with_area(&self) -> Vec<[Vector3<f64>; 3]> {
        let baked = self.baked();
        (0..baked.triangle_count()).map(|triangle| baked.corners(triangle).map(Vector3::from)).collect()
    }

    /// Both meshes as one.
    pub fn and(mut self, other: Self) -> Self {
        let first = self.points.len() as u32;
        self.points.extend(other.points);
        self.triangles.extend(other.triangles.iter().map(|corners| corners.map(|index| index + first)));
        self
    }

    pub fn with_triangle(mut self, corners: [u32; 3]) -> Self {
        self.triangles.push(corners);
        self
    }

    pub fn flipped(mut self) -> Self {
        self.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        self
    }

    /// Reverses the winding of some triangles.
    pub fn with_flipped(mut self, triangles: &[usize]) -> Self {
        triangles.iter().for_each(|triangle| self.triangles[*triangle].swap(1, 2));
        self
    }

    /// Removes the triangles with these indices.
    pub fn without(mut self, triangles: &[usize]) -> Self {
        let mut index = 0..;
        self.triangles.retain(|_| !triangles.contains(&index.next().unwrap()));
        self
    }

    pub fn moved(self, x: f64, y: f64, z: f64) -> Self {
        self.mapped(|p| p + Vector3::new(x, y, z))
    }

    pub fn scaled(self, by: f64) -> Self {
        self.mapped(|p| p * by)
    }

    pub fn turned(self, rotation: &Rotation3<f64>) -> Self {
        self.mapped(|p| rotation * p)
    }

    pub fn mapped(mut self, map: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Self {
        self.points.iter_mut().for_each(|p| *p = map(*p));
        self
    }

    /// Cuts every triangle in four.
    pub fn refined(&self) -> Self {
        let mut finer = Self { points: self.points.clone(), triangles: vec![] };
        let mut middles = HashMap::new();
        for [a, b, c] in &self.triangles {
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    finer.points.push((self.points[a as usize] + self.points[b as usize]) * 0.5);
                    finer.points.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(*a, *b), middle(*b, *c), middle(*c, *a));
            finer.triangles.extend([[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]);
        }
        finer
    }
}

pub fn tetrahedron() -> Mesh {
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    Mesh::new(&points, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
}

/// The cube from −1 to 1: 8 points, 12 triangles, two for each side in the order −x, x, −y, y, −z, z.
pub fn cube() -> Mesh {
    let points: Vec<[f64; 3]> =
        (0..8).map(|corner| [0, 1, 2].map(|axis| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 })).collect();
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    Mesh::new(&points, &sides.map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).concat())
}

pub fn block(half: [f64; 3]) -> Mesh {
    cube().mapped(|p| p.component_mul(&Vector3::from(half)))
}

/// The unit sphere by 20 · 4^`levels` triangles.
/// Hull of unit cubes, wound outward. Where two of them share no more than an edge, that edge has four faces.
pub fn voxel_hull(voxels: &[[i32; 3]]) -> Mesh {
    let cube = cube().mapped(|p| p.map(|x| 0.5 * (x + 1.0)));
    let is_free = |voxel: [i32; 3], side: usize| {
        let mut beside = voxel;
        beside[side / 2] += if side.is_multiple_of(2) { -1 } else { 1 };
        !voxels.contains(&beside)
    };
    let hull = |voxel: &[i32; 3]| {
        let inner: Vec<usize> = (0..12).filter(|triangle| !is_free(*voxel, triangle / 2)).collect();
        let [x, y, z] = voxel.map(f64::from);
        cube.clone().without(&inner).moved(x, y, z)
    };
    voxels.iter().map(hull).fold(Mesh::default(), Mesh::and)
}

/// Closed meshes with edges of four faces: a hull of voxels, cubes that share an edge, one of them around another or inside out.
pub fn with_edges_of_four_faces() -> Vec<(&'static str, Mesh)> {
    let pair = || cube().and(cube().moved(2.0, 2.0, 0.0));
    vec![
        ("hull of voxels", voxel_hull(&[[0, 0, 0], [1, 1, 0], [1, 2, 0], [0, 1, 1], [2, 0, 1], [1, 0, 2]])),
        ("cubes that share an edge", pair()),
        ("cubes that share an edge, around a third", pair().and(cube().scaled(0.3).moved(0.2, 0.1, 0.0))),
        ("cubes that share an edge, across a third", pair().and(cube().moved(0.7, 1.1, 0.3))),
        ("cubes that share an edge, one inside out", cube().and(cube().flipped().moved(2.0, 2.0, 0.0))),
    ]
}

pub fn icosphere(levels: usize) -> Mesh {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let points = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ];
    let triangles = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let icosahedron = Mesh::new(&points, &triangles).mapped(|p| p.normalize());
    (0..levels).fold(icosahedron, |mesh, _| mesh.refined().mapped(|p| p.normalize()))
}

/// A torus around the z axis.
pub fn torus(major: f64, minor: f64, around: u32, across: u32) -> Mesh {
    let angle = |i: u32, count: u32| std::f64::consts::TAU * f64::from(i) / f64::from(count);
    let mut mesh = Mesh::default();
    for i in 0..around {
        for j in 0..across {
            let (u, v) = (angle(i, around), angle(j, across));
            let radius = major + minor * v.cos();
            mesh.points.push(Vector3::new(radius * u.cos(), radius * u.sin(), minor * v.sin()));
            let index = |i: u32, j: u32| (i % around) * across + j % across;
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// Extrusion of a counterclockwise polygon in the x-y plane between two heights. `caps` triangulates the polygon.
pub fn prism(outline: &[[f64; 2]], caps: &[[u32; 3]], low: f64, high: f64) -> Mesh {
    let n = outline.len() as u32;
    let at_height = |height: f64| outline.iter().map(move |[x, y]| [*x, *y, height]);
    let points: Vec<_> = at_height(low).chain(at_height(high)).collect();
    let mut triangles: Vec<_> = caps.iter().flat_map(|[a, b, c]| [[*a, *c, *b], [*a + n, *b + n, *c + n]]).collect();
    for i in 0..n {
        let next = (i + 1) % n;
        triangles.extend([[i, next, next + n], [i, next + n, i + n]]);
    }
    Mesh::new(&points, &triangles)
}

/// An L of unit thickness with legs of length 2, with one concave edge.
pub fn l_solid() -> Mesh {
    let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    prism(&outline, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 0.0, 1.0)
}

/// An icosphere with every `every`th point drawn out to a sharp spike.
pub fn star(levels: usize, every: usize, length: f64) -> Mesh {
    let mut mesh = icosphere(levels).scaled(0.4);
    mesh.points.iter_mut().step_by(every).for_each(|p| *p *= length / 0.4);
    mesh
}

/// A tetrahedron of height 1 over a base of width `width`, its apex far to one side.
pub fn leaning_spike(width: f64) -> Mesh {
    let points = [[0.0, 0.0, 0.0], [width, 0.0, 0.0], [0.5 * width, width, 0.0], [1.5, 0.3, 1.0]];
    Mesh::new(&points, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
}

/// A square in the x-y plane from −1 to 1, `cells` by `cells` squares, facing up.
pub fn sheet(cells: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for y in 0..=cells {
        for x in 0..=cells {
            let coordinate = |i: u32| f64::from(i) / f64::from(cells) * 2.0 - 1.0;
            mesh.points.push(Vector3::new(coordinate(x), coordinate(y), 0.0));
            if x < cells && y < cells {
                let a = y * (cells + 1) + x;
                let [b, c, d] = [a + 1, a + cells + 2, a + cells + 1];
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    mesh
}

pub fn moebius_strip(around: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..around {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(around);
        for side in [-0.4, 0.4] {
            let (radius, height) = (1.0 + side * (angle / 2.0).cos(), side * (angle / 2.0).sin());
            mesh.points.push(Vector3::new(radius * angle.cos(), radius * angle.sin(), height));
        }
        let [a, b] = [2 * i, 2 * i + 1];
        let [c, d] = if i + 1 < around { [a + 2, b + 2] } else { [1, 0] };
        mesh.triangles.extend([[a, c, d], [a, d, b]]);
    }
    mesh
}

/// Random triangles in the cube from −1 to 1, without shared corners.
pub fn soup(triangles: u32, size: f64, random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for triangle in 0..triangles {
        let first = random.point_in_cube(1.0);
        mesh.points.extend([first, first + random.point_in_cube(size), first + random.point_in_cube(size)]);
        mesh.triangles.push([0, 1, 2].map(|corner| 3 * triangle + corner));
    }
    mesh
}

/// A soup with edges from 1e-9 to 1.
pub fn soup_of_all_sizes(triangles: u32, random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for triangle in 0..triangles {
        let first = random.point_in_cube(1.0);
        let size = 10.0_f64.powf(random.between(-9.0, 0.0));
        mesh.points.extend([first, first + random.point_in_cube(size), first + random.point_in_cube(size)]);
        mesh.triangles.push([0, 1, 2].map(|corner| 3 * triangle + corner));
    }
    mesh
}

/// Triangles of length about one and width `aspect`, the third corner beside any point of the longest edge.
pub fn needles(triangles: u32, aspect: f64, random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for triangle in 0..triangles {
        let (from, to) = (random.point_in_cube(1.0), random.point_in_cube(1.0));
        let beside = from + (to - from) * random.unit().mul_add(1.4, -0.2).clamp(0.0, 1.0);
        mesh.points.extend([from, to, beside + random.point_in_cube(aspect)]);
        let turn = random.below(3) as u32;
        mesh.triangles.push([0, 1, 2].map(|corner| 3 * triangle + (corner + turn) % 3));
    }
    mesh
}

/// Triangles flattened to a segment, exactly or but for rounding, or to a point.
pub fn degenerate_soup(triangles: u32, random: &mut Random) -> Mesh {
    let mut mesh = soup(triangles, 1.0, random);
    for triangle in 0..triangles as usize {
        let [a, b, c] = [0, 1, 2].map(|corner| 3 * triangle + corner);
        match triangle % 4 {
            0 => mesh.points[c] = mesh.points[b],
            1 => mesh.points[c] = mesh.points[a] + (mesh.points[b] - mesh.points[a]) * random.between(-1.0, 2.0),
            2 => mesh.points[c] = (mesh.points[a] + mesh.points[b]) * 0.5,
            _ => (mesh.points[b], mesh.points[c]) = (mesh.points[a], mesh.points[a]),
        }
    }
    mesh
}
