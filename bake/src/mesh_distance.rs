use std::fmt;

use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::bvh::{Bvh, NearestTriangle};
use crate::mesh::intersections::{intersecting_pairs, winding_step};
use crate::mesh::topology::{Topology, orient};
use crate::nearest::{NearestInPacket, Nodes, Packet};
use crate::sign::flood_fill::CLEARANCE;
use crate::sign::pseudo_normals::PseudoNormals;
use crate::sign::winding::{Estimate, MeshBoundary, WindingNumbers};
use crate::triangle::{NearestOnTriangle, nearest_on_triangle};

/// How inside is told from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignMethod {
    /// By the nearest feature's angle-weighted pseudo-normal: for one closed surface.
    PseudoNormal,
    /// By the generalized winding number: inside is where its magnitude is at least a half.
    Winding,
}

impl fmt::Display for SignMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PseudoNormal => "pseudo-normal",
            Self::Winding => "winding",
        })
    }
}

/// The exact signed distance to a mesh, by any method, at any point.
pub struct MeshDistance<'a> {
    mesh: &'a TriangleMesh,
    tree: Bvh,
    topology: Topology,
    winding: WindingNumbers,
    pseudo_normals: Option<PseudoNormals>,
    verdict: String,
}

/// The nearest triangle's unsigned distance, and where to look for a neighbouring point's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub distance: f64,
    pub guess: usize,
    /// By the pseudo-normal, where that is the method.
    pub is_inside: bool,
}

/// A point and what is nearest to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AdjacentTriangles {
    pub point: Vector3<f64>,
    pub nearest: Nearest,
}

impl Nearest {
    /// Negative inside; positive where the sign is yet to come.
    pub fn signed(&self) -> f64 {
        if self.is_inside { -self.distance } else { self.distance }
    }
}

impl<'a> MeshDistance<'a> {
    /// `sign`: `None` looks at the mesh and takes the pseudo-normals where they are sure.
    pub fn new(mesh: &'a TriangleMesh, sign: Option<SignMethod>) -> Self {
        let tree = Bvh::new(mesh);
        let mut oriented = orient(mesh);
        let orientations: Vec<f64> =
            tree.triangles.iter().map(|triangle| oriented.orientations[*triangle as usize]).collect();
        if oriented.topology.bounds_one_solid() {
            oriented.topology.intersecting_pairs = intersecting_pairs(mesh, &tree, &orientations);
        }
        let topology = oriented.topology;
        let sound = topology.bounds_one_solid();
        let method = sign.unwrap_or(if sound { SignMethod::PseudoNormal } else { SignMethod::Winding });
        let verdict = verdict(sign, method, &topology);
        let pseudo_normals = (method == SignMethod::PseudoNormal).then(|| PseudoNormals::new(mesh, &oriented));
        let boundary = MeshBoundary::new(
            oriented.boundary().map(|(points, times)| (points.map(|p| mesh.points[p as usize]), times)),
        );
        Self {
            mesh,
            winding: WindingNumbers::new(&tree, orientations, boundary),
            tree,
            topology,
            pseudo_normals,
            verdict,
        }
    }

    /// The box around the mesh.
    pub fn bounds(&self) -> Aabb {
        self.mesh.bounds()
    }

    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    pub fn sign_method(&self) -> SignMethod {
        if self.pseudo_normals.is_some() { SignMethod::PseudoNormal } else { SignMethod::Winding }
    }

    /// The signed distance has no jump: its sign changes at triangles alone. Not so around the holes of an open mesh, nor
    /// where pseudo-normals were asked for though shells lie within each other.
    pub fn is_continuous(&self) -> bool {
        let signs_agree = self.sign_method() == SignMethod::Winding || self.topology.bounds_one_solid();
        self.topology.is_closed() && signs_agree
    }

    /// What the mesh looks like and which method that made, in words.
    pub fn verdict(&self) -> &str {
        &self.verdict
    }

    /// Negative inside. Exact but for f64's own rounding.
    pub fn signed_distance(&self, point: [f64; 3]) -> f64 {
        let nearest = self.nearest(point.into(), 0);
        let is_inside = match self.pseudo_normals {
            Some(_) => nearest.is_inside,
            None => self.is_inside_by_winding(point.into()),
        };
        if is_inside { -nearest.distance } else { nearest.distance }
    }

    /// The generalized winding number: 1 inside a closed surface, 0 outside, in between near a hole. Exact but for rounding where
    /// the mesh is closed, and at most points where its rim is short; else off by less than 0.1, and never on the wrong side of one half
    /// but for rounding.
    pub fn winding_number(&self, point: [f64; 3]) -> f64 {
        const MAX_ERROR: f64 = 0.1;
        self.bounded_winding(point.into(), MAX_ERROR).value
    }

    /// `guess` is a triangle to begin with: any will do, a near one saves time.
    pub(crate) fn nearest(&self, point: Vector3<f64>, guess: usize) -> Nearest {
        let NearestTriangle { slot, on_triangle } = self.tree.nearest(point, guess);
        let is_inside = self.is_inside_by_normal(point, slot, || on_triangle);
        Nearest { distance: on_triangle.distance_sq.sqrt(), guess: slot, is_inside }
    }

    /// The same of a node that was measured, or was found to be far: then the distance is a bound from below. It takes less time
    /// `beside` a point that is near.
    pub(crate) fn nearest_in(
        &self,
        packet: &Packet,
        nodes: &Nodes,
        step: [usize; 3],
        beside: Option<AdjacentTriangles>,
    ) -> Nearest {
        let NearestInPacket { slot, distance_sq } = packet.nearest(step);
        let node = nodes.at(step);
        let distance = distance_sq.sqrt();
        let guess = slot.map_or(packet.guess(), |slot| slot as usize);
        if let Some(beside) = beside.filter(|beside| self.are_on_one_side(beside, node, distance)) {
            return Nearest { distance, guess, is_inside: beside.nearest.is_inside };
        }
        if slot.is_none() && self.pseudo_normals.is_some() {
            return self.nearest(node, guess);
        }
        let is_inside = self.is_inside_by_normal(node, guess, || nearest_on_triangle(node, self.tree.corners[guess]));
        Nearest { distance, guess, is_inside }
    }

    /// Of nodes farther than this, that they are so is enough to tell their sides from those of their neighbours.
    pub(crate) fn measured_within(&self, far: f64) -> f64 {
        let needs_all = self.pseudo_normals.is_some() && self.normals_of_one_solid().is_none();
        if needs_all { f64::INFINITY } else { far }
    }

    /// Two points are so near to each other that the surface of one solid cannot pass between them.
    fn are_on_one_side(&self, beside: &AdjacentTriangles, point: Vector3<f64>, distance: f64) -> bool {
        self.normals_of_one_solid().is_some()
            && beside.nearest.distance + distance > (point - beside.point).norm() * CLEARANCE
    }

    /// By the pseudo-normal of what is nearest on a triangle of the tree, where that is the method.
    fn is_inside_by_normal(
        &self,
        point: Vector3<f64>,
        slot: usize,
        on_triangle: impl Fn() -> NearestOnTriangle,
    ) -> bool {
        self.pseudo_normals.as_ref().is_some_and(|normals| {
            let on_triangle = on_triangle();
            let normal = normals.feature(self.mesh, self.tree.triangles[slot], on_triangle.feature);
            if normal == Vector3::zeros() {
                return self.is_inside_by_winding(point);
            }
            normal.dot(&(point - on_triangle.point)) < 0.0
        })
    }

    fn is_inside_by_winding(&self, point: Vector3<f64>) -> bool {
        self.bounded_winding(point, f64::INFINITY).value.abs() >= 0.5
    }

    pub(crate) fn tree(&self) -> &Bvh {
        &self.tree
    }

    /// The normals of all faces, where these bound one solid and every side is told by them.
    pub(crate) fn normals_of_one_solid(&self) -> Option<&PseudoNormals> {
        self.pseudo_normals.as_ref().filter(|_| self.topology.bounds_one_solid())
    }

    /// The corners of a triangle of the tree, by their numbers.
    pub(crate) fn points_of(&self, slot: usize) -> [u32; 3] {
        self.mesh.triangles[self.tree.triangles[slot] as usize]
    }

    /// The winding number, off by less than `most`, and by so little that the side of one half is right.
    pub(crate) fn bounded_winding(&self, point: Vector3<f64>, most: f64) -> Estimate {
        self.winding.evaluate(&self.tree, point, most)
    }

    /// The curve away from which the winding number varies as it says, other than across triangles.
    pub(crate) fn boundary(&self) -> &MeshBoundary {
        self.winding.boundary()
    }

    /// What triangles between two points add to the winding number. `None` where that is a matter of rounding.
    pub(crate) fn winding_step(&self, way: [Vector3<f64>; 2]) -> Option<f64> {
        winding_step(&self.tree, self.winding.orientations(), way)
    }
}

fn verdict(asked: Option<SignMethod>, method: SignMethod, topology: &Topology) -> String {
    let found = match topology.to_string() {
        found if found.is_empty() => "closed, consistently wound, one shell".to_owned(),
        found if topology.bounds_one_solid() => format!("closed, one shell ({found}: put right)"),
        found => found,
    };
    match asked {
        Some(_) => format!("{method}, as asked; the mesh: {found}"),
        None => format!("{method}: {found}"),
    }
}

#[cfg(test)]
mod tests {
    use sdf_core::grid::Lattice;

    use super::*;
    use crate::nearest::SIDE;
    use crate::testing::{random, random_vector};

    /// Around a square of pyramids, of random heights inward and outward.
    fn spiky_solid(state: &mut u64) -> TriangleMesh {
        let corner = |index: u32| [0, 1, 2].map(|axis| f64::from(index >> axis & 1));
        let mut points: Vec<[f64; 3]> = (0..8).map(corner).collect();
        let mut triangles = vec![];
        for (face, corners) in
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]].into_iter().enumerate()
        {
            let mut apex = [0.5; 3];
            apex[[2, 1, 0][face / 2]] = (face % 2) as f64 + 0.3 * random(state);
            points.push(apex);
            triangles.extend((0..4).map(|side| [corners[side], corners[(side + 1) % 4], 8 + face as u32]));
        }
        TriangleMesh::new(&points, &triangles).unwrap()
    }

    #[test]
    fn a_node_is_on_the_same_side_whatever_point_it_is_measured_beside_and_however_far_it_is() {
        let mut state = 11;
        println!("seed {state}");
        let [mut taken, mut bounded] = [0; 2];
        for _ in 0..20 {
            let mesh = spiky_solid(&mut state);
            let mesh = MeshDistance::new(&mesh, None);
            assert_eq!(mesh.sign_method(), SignMethod::PseudoNormal);
            let origin = (random_vector(&mut state) * 0.5).into();
            let lattice = Lattice::new(origin, 0.1, [SIDE as u32; 3]).unwrap();
            let nodes = Nodes::of_lattice(&lattice, [0; 3], [SIDE; 3]);
            let [mut packet, mut near] = [0; 2].map(|_| Packet::new(mesh.tree()));
            packet.measure(&nodes, f64::INFINITY, f64::INFINITY);
            near.measure(&nodes, f64::INFINITY, 0.1);
            for index in 0..SIDE * SIDE * SIDE {
                let step = [index % SIDE, index / SIDE % SIDE, index / SIDE / SIDE];
                let point = nodes.at(step) + random_vector(&mut state) * 0.3;
                let beside = AdjacentTriangles { point, nearest: mesh.nearest(point, 0) };
                let alone = mesh.nearest_in(&packet, &nodes, step, None);
                taken += usize::from(mesh.are_on_one_side(&beside, nodes.at(step), alone.distance));
                let found = mesh.nearest_in(&packet, &nodes, step, Some(beside));
                assert_eq!(found.is_inside, alone.is_inside, "{point:?} {:?}", nodes.at(step));
                for beside in [None, Some(beside)] {
                    let found = mesh.nearest_in(&near, &nodes, step, beside);
                    assert_eq!(found.is_inside, alone.is_inside, "{point:?} {:?}", nodes.at(step));
                    assert!(
                        found.distance == alone.distance || 0.1 < found.distance && found.distance < alone.distance
                    );
                    bounded += usize::from(found.distance < alone.distance);
                }
            }
        }
        assert!(taken > 1000 && bounded > 1000, "{taken} {bounded}");
    }
}
