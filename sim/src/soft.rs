//! Soft bodies: a lattice of tetrahedra around a mesh, and the mesh embedded in it (Macklin et al. 2020, §5.3).
//!
//! Each cube of the lattice is cut into six tetrahedra around its diagonal, one for each order of the axes (Kuhn 1960). A point with
//! the shares s₁ ≥ s₂ ≥ s₃ of the sides along these axes has the weights 1 − s₁, s₁ − s₂, s₂ − s₃, s₃.

use std::collections::BTreeMap;

use sdf_core::contact::TetPoint;
use sdf_core::nalgebra::Matrix3;

use crate::V3;
use crate::surface::{Carrier, Surface};
use crate::world::{Tet, World};

/// The orders of the axes, one for each tetrahedron of a cube.
pub(crate) const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// Matter of a soft body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matter {
    /// Mass per volume of the mesh.
    pub density: f64,
    /// Young's modulus, a pressure.
    pub young: f64,
    /// Poisson's ratio, below ½.
    pub poisson: f64,
}

/// Share of a side by which a point may be beyond a cube and still counts as on its boundary: more than coordinates are rounded by.
const ON_SIDE: f64 = 1e-9;

/// Adds a soft body: cubes with this side wherever the mesh has a point, and of those within `padding` of the mesh's box wherever
/// `is_wanted` takes their center. A point between cubes asks for a cube of its own only where none of them is there.
///
/// All cubes are alike: the body has the mass and the stiffness of its matter in the mesh's [`volume`], spread over the cubes' own.
/// Without faces the cubes themselves are the body.
///
/// A contact moves the cubes of a face's corners alone: [`split_edges`] a mesh whose faces are larger than cubes before.
///
/// # Panics
///
/// If the side is not a positive length.
pub fn add(
    world: &mut World,
    points: &[[f64; 3]],
    faces: &[[u32; 3]],
    side: f64,
    padding: f64,
    matter: &Matter,
    is_wanted: impl Fn(V3) -> bool,
) -> Surface {
    assert!(side > 0.0 && side.is_finite(), "cubes need a positive side, not {side}");
    let layers: Vec<_> = points.iter().map(|point| point.map(|x| layers_at(x / side))).collect();
    let (inside, between): (Vec<&[[i32; 2]; 3]>, Vec<_>) =
        layers.iter().partition(|layers| layers.iter().all(|[a, b]| a == b));
    let mut cells: BTreeMap<[i32; 3], u32> = inside.iter().map(|layers| (layers.map(|[layer, _]| layer), 0)).collect();
    // A mesh that ends between two layers has none of the farther.
    let ends = |axis: usize| {
        let low = layers.iter().map(|layers| layers[axis][0].max(layers[axis][1])).min().unwrap_or(0);
        (low, layers.iter().map(|layers| layers[axis][0].min(layers[axis][1])).max().unwrap_or(0))
    };
    let ends = [0, 1, 2].map(ends);
    let padded = (padding / side).ceil() as i32;
    let [x, y, z] = ends.map(|(low, high)| (low - padded, high + padded));
    for cell in (z.0..=z.1).flat_map(|z| (y.0..=y.1).flat_map(move |y| (x.0..=x.1).map(move |x| [x, y, z]))) {
        if is_wanted(V3::from(cell.map(|steps| (f64::from(steps) + 0.5) * side))) {
            cells.insert(cell, 0);
        }
    }
    for layers in between {
        if !cells_at(layers).any(|cell| cells.contains_key(&cell)) {
            cells.insert(std::array::from_fn(|axis| layers[axis][0].min(ends[axis].1)), 0);
        }
    }
    let share = if faces.is_empty() { 1.0 } else { volume(points, faces) / (cells.len() as f64 * side.powi(3)) };
    let matter = &Matter { density: matter.density * share, young: matter.young * share, ..*matter };
    let mut nodes = BTreeMap::new();
    let first_tet = world.tets.len();
    for (cell, first) in &mut cells {
        *first = world.tets.len() as u32;
        for order in ORDERS {
            let corners = corner_steps(cell, &order).map(|node| {
                *nodes.entry(node).or_insert_with(|| world.add_particle(V3::from(node.map(f64::from)) * side, 0.0))
            });
            add_tet(world, corners, is_mirrored(&order), matter);
        }
    }
    share_mass(world, first_tet, matter.density);
    let embed = |(point, layers): (&[f64; 3], &[[i32; 2]; 3])| {
        let cell = cells_at(layers).find(|cell| cells.contains_key(cell)).expect("each point has a cube");
        let share: [f64; 3] = std::array::from_fn(|axis| (point[axis] / side - f64::from(cell[axis])).clamp(0.0, 1.0));
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| share[*b].total_cmp(&share[*a]));
        let [a, b, c] = order.map(|axis| share[axis]);
        let mut weights = [1.0 - a, a - b, b - c, c];
        let place = ORDERS.iter().position(|other| *other == order).unwrap_or(0);
        if is_mirrored(&order) {
            weights.swap(2, 3);
        }
        TetPoint { tet: cells[&cell] + place as u32, weights }
    };
    Surface::of_faces(faces.to_vec(), points.len(), Carrier::Tets(points.iter().zip(&layers).map(embed).collect()))
}

/// The volume that a closed mesh encloses, negative if its faces point inward; twice what two shells enclose together.
pub fn volume(points: &[[f64; 3]], faces: &[[u32; 3]]) -> f64 {
    let Some(origin) = points.first().map(|point| V3::from(*point)) else { return 0.0 };
    let corners = faces.iter().map(|face| face.map(|corner| V3::from(points[corner as usize]) - origin));
    corners.map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0).sum()
}

/// Most faces of [`split_edges`].
const MAX_FACES: usize = 4_000_000;

/// Cuts all edges that are longer than a square of `side` across in halves, as often as it takes; neighbours stay joined. New points
/// come after the others. `false` if it takes more than four million faces, and then not all are cut.
pub fn split_edges(points: &mut Vec<[f64; 3]>, faces: &mut Vec<[u32; 3]>, side: f64) -> bool {
    // A square that rounding made longer is not cut.
    let longest = side * 2_f64.sqrt() * (1.0 + ON_SIDE);
    loop {
        let mut middles = BTreeMap::new();
        for [a, b] in faces.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]) {
            let [from, to] = [a.min(b), a.max(b)].map(|end| V3::from(points[end as usize]));
            if (to - from).norm() > longest {
                middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    points.push((from + (to - from) * 0.5).into());
                    points.len() as u32 - 1
                });
            }
        }
        if middles.is_empty() {
            return true;
        }
        let middle = |a: u32, b: u32| middles.get(&[a.min(b), a.max(b)]).copied();
        *faces = faces.iter().flat_map(|face| split_face(*face, middle)).collect();
        if faces.len() > MAX_FACES {
            return false;
        }
    }
}

/// A face in one to four, by the middles of those of its edges that are cut.
fn split_face([a, b, c]: [u32; 3], middle: impl Fn(u32, u32) -> Option<u32>) -> Vec<[u32; 3]> {
    match [middle(a, b), middle(b, c), middle(c, a)] {
        [None, None, None] => vec![[a, b, c]],
        [Some(ab), None, None] => vec![[a, ab, c], [ab, b, c]],
        [Some(ab), Some(bc), None] => vec![[ab, b, bc], [a, ab, bc], [a, bc, c]],
        [Some(ab), Some(bc), Some(ca)] => vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]],
        // The same with the corners turned.
        _ => split_face([b, c, a], middle),
    }
}

/// The layer of cubes at a coordinate in sides, and the other one where it is between two; else the same again.
fn layers_at(x: f64) -> [i32; 2] {
    let layer = x.floor() as i32;
    match x - x.floor() {
        share if share <= ON_SIDE => [layer, layer.saturating_sub(1)],
        share if share >= 1.0 - ON_SIDE => [layer, layer.saturating_add(1)],
        _ => [layer; 2],
    }
}

/// The cubes at a point with these layers along each axis; some come more than once.
fn cells_at(layers: &[[i32; 2]; 3]) -> impl Iterator<Item = [i32; 3]> {
    (0..8).map(|other| std::array::from_fn(|axis| layers[axis][other >> axis & 1]))
}

/// Number of cubes in the box around a body, of which [`add`] looks at each.
pub fn cube_count(points: &[[f64; 3]], side: f64, padding: f64) -> f64 {
    let extent = |axis: usize| {
        let all = || points.iter().map(|point| point[axis]);
        let [low, high] = [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)];
        // A cube's index is an i32.
        let is_in_reach = low.abs().max(high.abs()) + padding < side * 1e9;
        if is_in_reach { ((high - low + 2.0 * padding) / side).ceil() + 3.0 } else { f64::INFINITY }
    };
    [0, 1, 2].map(extent).iter().product()
}

/// The nodes on the way along a cube's diagonal, one axis after the other.
pub(crate) fn corner_steps(cell: &[i32; 3], order: &[usize; 3]) -> [[i32; 3]; 4] {
    let mut nodes = [*cell; 4];
    for (step, axis) in order.iter().enumerate() {
        nodes[step + 1] = nodes[step];
        nodes[step + 1][*axis] += 1;
    }
    nodes
}

/// Is the tetrahedron of an order of the axes left-handed? Every other one is: the odd permutations.
fn is_mirrored([a, b, _]: &[usize; 3]) -> bool {
    (a + 1) % 3 != *b
}

fn add_tet(world: &mut World, mut corners: [u32; 4], is_mirrored: bool, matter: &Matter) {
    if is_mirrored {
        corners.swap(2, 3);
    }
    let [o, a, b, c] = corners.map(|corner| world.x[corner as usize]);
    let rest = Matrix3::from_columns(&[a - o, b - o, c - o]);
    let inv_rest = rest.try_inverse().unwrap_or_else(Matrix3::zeros);
    let Matter { young, poisson, .. } = matter;
    world.tets.push(Tet {
        corners,
        inv_rest,
        volume: rest.determinant() / 6.0,
        lambda: young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
        mu: young / (2.0 * (1.0 + poisson)),
    });
}

/// A quarter of each tetrahedron's mass for each of its corners.
fn share_mass(world: &mut World, first_tet: usize, density: f64) {
    let mut masses = BTreeMap::new();
    for tet in &world.tets[first_tet..] {
        tet.corners.iter().for_each(|corner| *masses.entry(*corner).or_insert(0.0) += 0.25 * density * tet.volume);
    }
    masses.iter().for_each(|(corner, mass)| world.inv_mass[*corner as usize] = 1.0 / mass);
}
