//! Distances and winding numbers by brute force over all triangles, with other formulas than the baker's.

use sdf_bake::MeshDistance;
use sdf_core::nalgebra::Vector3;

use crate::meshes::Mesh;

/// Distance to the nearest of all triangles.
pub fn distance(mesh: &[[Vector3<f64>; 3]], point: Vector3<f64>) -> f64 {
    mesh.iter().map(|corners| distance_to_triangle(*corners, point)).fold(f64::INFINITY, f64::min)
}

/// Distance to the nearest edge, or to the plane if the point projects into the triangle.
fn distance_to_triangle(corners: [Vector3<f64>; 3], point: Vector3<f64>) -> f64 {
    let sides = [0, 1, 2].map(|corner| [corners[corner], corners[(corner + 1) % 3]]);
    let to_edges = sides.map(|[from, to]| distance_to_segment(from, to, point));
    let to_edges = to_edges.into_iter().fold(f64::INFINITY, f64::min);
    // The longest side first: its cross product with the next has the most digits.
    let lengths = sides.map(|[from, to]| (to - from).norm());
    let longest = (0..3).max_by(|a, b| lengths[*a].total_cmp(&lengths[*b])).unwrap();
    let [[a, b], [_, c], _] = [0, 1, 2].map(|step| sides[(longest + step) % 3]);
    let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { return to_edges };
    let projects_inside = sides.iter().all(|[from, to]| (to - from).cross(&(point - from)).dot(&normal) >= 0.0);
    if projects_inside { normal.dot(&(point - a)).abs().min(to_edges) } else { to_edges }
}

fn distance_to_segment(from: Vector3<f64>, to: Vector3<f64>, point: Vector3<f64>) -> f64 {
    let length = (to - from).norm();
    if length == 0.0 {
        return (point - from).norm();
    }
    let direction = (to - from) / length;
    let along = (point - from).dot(&direction).clamp(0.0, length);
    (point - from - direction * along).norm()
}

/// Winding number: Σ Ω/4π, the solid angles Ω by Girard's spherical excess (sum of the angles less π).
pub fn winding_number(mesh: &[[Vector3<f64>; 3]], point: Vector3<f64>) -> f64 {
    let solid_angle = |corners: &[Vector3<f64>; 3]| {
        let directions = corners.map(|corner| (corner - point).try_normalize(0.0).unwrap_or_default());
        let angle_at = |corner: usize| {
            let [here, next, last] = [0, 1, 2].map(|step| directions[(corner + step) % 3]);
            let (to_next, to_last) = (here.cross(&next), here.cross(&last));
            to_next.cross(&to_last).norm().atan2(to_next.dot(&to_last))
        };
        let excess = angle_at(0) + angle_at(1) + angle_at(2) - std::f64::consts::PI;
        let triple = directions[0].dot(&directions[1].cross(&directions[2]));
        if triple == 0.0 { 0.0 } else { excess * triple.signum() }
    };
    mesh.iter().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// Distance, negated inside: where the winding number is at least one half.
pub fn signed_distance(mesh: &[[Vector3<f64>; 3]], point: Vector3<f64>) -> f64 {
    let distance = distance(mesh, point);
    if winding_number(mesh, point).abs() >= 0.5 { -distance } else { distance }
}

/// A signed distance at a point of a cell, with the sign of the cell's corners if they agree: the distance that the error of an open mesh's
/// grid is about.
pub fn with_sign_of_cell(distance: f64, corners: [f32; 8]) -> f64 {
    match corners.iter().filter(|corner| **corner < 0.0).count() {
        0 => distance.abs(),
        8 => -distance.abs(),
        _ => distance,
    }
}

/// The cell that holds a point.
pub fn cell_of(lattice: &sdf_core::grid::Lattice, point: Vector3<f64>) -> [u32; 3] {
    let steps = (point - Vector3::from(lattice.origin())) / lattice.spacing();
    std::array::from_fn(|axis| (steps[axis] as u32).min(lattice.cells()[axis] - 1))
}

/// Diagonal of the mesh's bounding box.
pub fn diagonal(mesh: &Mesh) -> f64 {
    mesh.baked().bounds().diagonal()
}

/// Positions of a grid's nodes with their baked distances.
pub fn nodes<'a>(
    lattice: &'a sdf_core::grid::Lattice,
    distances: &'a [f32],
) -> impl Iterator<Item = (Vector3<f64>, f64)> + 'a {
    let [row, rows, _] = lattice.nodes();
    (0_u32..).zip(distances).map(move |(index, distance)| {
        let node = lattice.node([index % row, index / row % rows, index / (row * rows)]);
        (Vector3::from(node), f64::from(*distance))
    })
}

/// A dense grid with `cells` cells along the longest side and two more on each side.
pub struct Baked {
    pub lattice: sdf_core::grid::Lattice,
    pub grid: sdf_bake::DenseGrid,
}

impl Baked {
    pub fn new(distance: &MeshDistance, bounds: &sdf_core::Aabb, cells: u32) -> Self {
        let spacing = bounds.longest_side() / f64::from(cells);
        let lattice = sdf_bake::lattice_around(bounds, spacing, 2).unwrap();
        let grid = sdf_bake::dense::bake(distance, &lattice, &|_| ());
        Self { lattice, grid }
    }

    pub fn from_mesh(mesh: &Mesh, sign: Option<sdf_bake::SignMethod>, cells: u32) -> Self {
        let mesh = mesh.baked();
        Self::new(&MeshDistance::new(&mesh, sign), &mesh.bounds(), cells)
    }

    pub fn nodes(&self) -> impl Iterator<Item = (Vector3<f64>, f64)> + '_ {
        nodes(&self.lattice, &self.grid.distances)
    }
}
