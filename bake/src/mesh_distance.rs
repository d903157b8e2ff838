//! Exact signed distance to a mesh: distance by the tree (`bvh`, `nearest`), sign by the method that suits the mesh
//! (`sign`).

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};

use sdf_core::Aabb;
use sdf_core::grid::Lattice;
use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::bvh::{Bvh, NearestTriangle};
use crate::mesh::intersections::{intersecting_pairs, whole_winding_number, winding_change};
use crate::mesh::topology::{Topology, orient};
use crate::nearest::{NearestToNode, PacketNodes, PacketSearch};
use crate::rounding::{SUM_SLACK, node_position_rounding};
use crate::sign::flood_fill::CLEARANCE;
use crate::sign::pseudo_normals::PseudoNormals;
use crate::sign::winding::{Estimate, MeshBoundary, WindingNumbers};
use crate::triangle::{NearestOnTriangle, nearest_on_triangle};

/// How inside and outside are distinguished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignMethod {
    /// Angle-weighted pseudo-normal of the nearest feature: for one closed surface.
    PseudoNormal,
    /// Generalized winding number w: inside where |w| ≥ 1/2.
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

/// Squared distance to the surface from which a point tells others its side, relative to theirs to it: a thousandth.
const MIN_REACH_SQ: f64 = 1e-6;

/// Coordinates whose squares, and sums of these, are finite.
const FAR: f64 = 1e150;

/// Exact signed distance to a mesh.
pub struct MeshDistance<'a> {
    mesh: &'a TriangleMesh,
    tree: Bvh,
    /// Tree of the mesh whose winding numbers give the signs, where distances are those to the surface of its solid.
    solid: Option<Bvh>,
    topology: Topology,
    winding: WindingNumbers,
    method: SignMethod,
    /// `None` where another method gives the sign.
    pseudo_normals: Option<PseudoNormals>,
    /// Do pseudo-normals tell the side of every point, with more digits than rounding takes?
    are_normals_certain: bool,
    /// [`TriangleMesh::outward`], in the tree's order.
    outward: Option<Vec<f64>>,
    sign_reason: String,
    cancel: Option<&'a AtomicBool>,
}

/// Unsigned distance at a point, and its sign if pseudo-normals give it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub distance: f64,
    /// Slot of the nearest triangle, or of one near it: where to begin the search from a neighbouring point.
    pub guess: usize,
    /// False if the sign is yet to be computed by winding numbers.
    pub is_inside: bool,
}

/// A point whose nearest triangle is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeasuredPoint {
    pub point: Vector3<f64>,
    pub nearest: Nearest,
}

impl Nearest {
    pub fn signed(&self) -> f64 {
        if self.is_inside { -self.distance } else { self.distance }
    }
}

impl<'a> MeshDistance<'a> {
    /// `sign`: `None` chooses pseudo-normals if the mesh bounds one solid, is not folded shut, and is not far from the origin, else winding
    /// numbers. A mesh of which
    /// [`TriangleMesh::without_inner_faces`] left only a part has winding numbers in any case.
    pub fn new(mesh: &'a TriangleMesh, sign: Option<SignMethod>) -> Self {
        let tree = mesh.tree.take().unwrap_or_else(|| Bvh::new(mesh));
        let tree_of_solid = |solid: &TriangleMesh| solid.tree.take().unwrap_or_else(|| Bvh::for_points(solid));
        let solid = mesh.solid.as_deref().map(tree_of_solid);
        let sign = if solid.is_some() { sign.and(Some(SignMethod::Winding)) } else { sign };
        let (mesh_of_signs, tree_of_signs) = (mesh.mesh_of_signs(), solid.as_ref().unwrap_or(&tree));
        let mut oriented = mesh_of_signs.orientation.take().unwrap_or_else(|| orient(mesh_of_signs));
        let orientations: Vec<f64> =
            tree_of_signs.triangles.iter().map(|triangle| oriented.orientations[*triangle as usize]).collect();
        if oriented.topology.is_one_closed_shell() {
            let count = || intersecting_pairs(mesh_of_signs, tree_of_signs, &orientations);
            oriented.topology.intersecting_pairs = mesh_of_signs.intersecting_pairs.unwrap_or_else(count);
        }
        let topology = oriented.topology;
        let may_be_certain = sign != Some(SignMethod::Winding) && topology.bounds_one_solid();
        let normals =
            (may_be_certain || sign == Some(SignMethod::PseudoNormal)).then(|| PseudoNormals::new(mesh, &oriented));
        let doubt = normals.as_ref().filter(|_| may_be_certain).and_then(|normals| normals.doubt(&mesh.bounds()));
        let are_normals_certain = may_be_certain && doubt.is_none();
        let chosen = if are_normals_certain { SignMethod::PseudoNormal } else { SignMethod::Winding };
        let method = sign.unwrap_or(chosen);
        let sign_reason = sign_reason(sign, method, &topology, doubt);
        let pseudo_normals = normals.filter(|_| method == SignMethod::PseudoNormal);
        let winding = WindingNumbers::of_mesh(mesh_of_signs, &oriented, orientations);
        let in_tree =
            |outward: &Vec<i8>| tree.triangles.iter().map(|triangle| outward[*triangle as usize].into()).collect();
        let are_any_known = |outward: &&Vec<i8>| outward.iter().any(|outward| *outward != 0);
        let outward = mesh.outward.as_ref().filter(are_any_known).map(in_tree);
        // Whole winding numbers are those of rays.
        if pseudo_normals.is_none() && !winding.boundary().is_empty() {
            winding.prepare(tree_of_signs);
        }
        let cancel = None;
        Self {
            mesh,
            tree,
            solid,
            topology,
            winding,
            method,
            pseudo_normals,
            are_normals_certain,
            outward,
            sign_reason,
            cancel,
        }
    }

    /// The same, in bakes that another thread can end: once the flag is set they skip what is left, and what they return is
    /// meaningless.
    #[must_use]
    pub fn with_cancel(self, cancel: &'a AtomicBool) -> Self {
        Self { cancel: Some(cancel), ..self }
    }

    /// Has the flag of [`with_cancel`](Self::with_cancel) been set?
    pub fn is_cancelled(&self) -> bool {
        self.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    /// Box around the mesh.
    pub fn bounds(&self) -> Aabb {
        self.mesh.bounds()
    }

    /// Does the whole mesh lie in the lattice's box, up to rounding?
    pub(crate) fn lies_in(&self, lattice: &Lattice) -> bool {
        let slack = SUM_SLACK * lattice.spacing() + node_position_rounding(lattice) + self.rounding();
        lattice.bounds().inflate(slack).encloses(&self.bounds())
    }

    /// Edges, shells and intersections of the mesh.
    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    /// The sign method in use: the one requested, or else the one chosen by the topology.
    pub fn sign_method(&self) -> SignMethod {
        self.method
    }

    /// Is the signed distance continuous, its sign changing at triangles alone? By winding numbers it is if the triangles cancel along
    /// every edge, however many share it: all of these numbers are whole. By pseudo-normals it is if the mesh bounds one solid that is not
    /// folded shut and not far from the origin. It jumps around the holes of an open mesh, and where pseudo-normals were requested for shells
    /// within each other.
    pub fn is_continuous(&self) -> bool {
        match self.sign_method() {
            SignMethod::Winding => self.winding.boundary().is_empty(),
            SignMethod::PseudoNormal => self.are_normals_certain,
        }
    }

    /// The sign method and the topology that led to it, in words.
    pub fn sign_reason(&self) -> &str {
        &self.sign_reason
    }

    /// Signed distance, negative inside. Exact up to the rounding of f64, but near faces thinner than a millionth of their length:
    /// off by up to 5e-8 of that length there.
    pub fn signed_distance(&self, point: [f64; 3]) -> f64 {
        let [x, y, z] = point;
        // The coordinates of a mesh are at most 1e30: from here it is one point, and squares of distances overflow.
        if point.iter().any(|x| x.abs() > FAR) {
            return x.hypot(y).hypot(z);
        }
        self.signed_nearest(point.into(), 0).signed()
    }

    /// Generalized winding number: 1 inside a closed surface, 0 outside, in between near a hole.
    ///
    /// Exact up to rounding if the mesh is closed, and at most points if its boundary is short. Else its error is less
    /// than 0.1, and it is on the same side of 1/2 as the exact value, up to rounding.
    pub fn winding_number(&self, point: [f64; 3]) -> f64 {
        const MAX_ERROR: f64 = 0.1;
        self.winding.evaluate(self.tree_of_signs(), point.into(), MAX_ERROR).value
    }

    /// Is the side of a point certain? Not if its winding number is so near to 1/2, or to −1/2, that rounding decides, as in the plane
    /// of a flat hole. Bakes may take such a point for either side: their winding numbers are rounded otherwise.
    pub fn is_side_certain(&self, point: [f64; 3]) -> bool {
        let Estimate { value, error } = self.winding_estimate(point.into(), f64::INFINITY);
        (value.abs() - 0.5).abs() > error.max(SUM_SLACK)
    }

    /// Nearest triangle. `guess` is any slot: a near one saves time.
    pub(crate) fn nearest(&self, point: Vector3<f64>, guess: usize) -> Nearest {
        let NearestTriangle { slot, on_triangle } = self.tree.nearest(point, guess);
        let is_inside = self.is_inside_by_normal(point, slot, || on_triangle);
        Nearest { distance: on_triangle.distance_sq.sqrt(), guess: slot, is_inside }
    }

    /// As [`Self::nearest`], with the side also where winding numbers tell it.
    pub(crate) fn signed_nearest(&self, point: Vector3<f64>, guess: usize) -> Nearest {
        let nearest = self.nearest(point, guess);
        let is_told = self.pseudo_normals.is_some();
        Nearest { is_inside: if is_told { nearest.is_inside } else { self.is_inside_by_winding(point) }, ..nearest }
    }

    /// Distance of a point, too great by at most `tolerance`, and the slot of the triangle it was measured to.
    pub(crate) fn distance_within(&self, point: Vector3<f64>, guess: usize, tolerance: f64) -> (f64, usize) {
        let NearestTriangle { slot, on_triangle } = self.tree.nearest_within(point, guess, tolerance);
        (on_triangle.distance_sq.sqrt(), slot)
    }

    /// Nearest triangle of a node of a searched packet, or a lower bound of its distance. A measured point near the
    /// node saves time.
    pub(crate) fn nearest_to_node(
        &self,
        search: &PacketSearch,
        nodes: &PacketNodes,
        step: [usize; 3],
        neighbour: Option<MeasuredPoint>,
    ) -> Nearest {
        let NearestToNode { slot, distance_sq } = search.nearest(step);
        let node = nodes.position(step);
        let distance = distance_sq.sqrt();
        let guess = slot.map_or(search.guess(), |slot| slot as usize);
        if let Some(neighbour) = neighbour.filter(|neighbour| self.is_segment_clear(neighbour, node, distance)) {
            return Nearest { distance, guess, is_inside: neighbour.nearest.is_inside };
        }
        if slot.is_none() && self.pseudo_normals.is_some() {
            return self.nearest(node, guess);
        }
        let is_inside = self.is_inside_by_normal(node, guess, || nearest_on_triangle(node, self.tree.corners[guess]));
        Nearest { distance, guess, is_inside }
    }

    /// Distance up to which packets are searched, if exact values are wanted up to `max_distance`. Infinite if signs
    /// need the nearest triangle of every node.
    pub(crate) fn search_distance(&self, max_distance: f64) -> f64 {
        let needs_all = self.pseudo_normals.is_some() && self.solid_normals().is_none();
        if needs_all { f64::INFINITY } else { max_distance }
    }

    /// Is the segment between two points too short for the surface of one solid to cross it? Then both are on one side.
    /// D(p) + D(q) > |p − q| suffices, for points of the surface are outside of both balls.
    fn is_segment_clear(&self, neighbour: &MeasuredPoint, point: Vector3<f64>, distance: f64) -> bool {
        let (reach, way_sq) = (neighbour.nearest.distance, (point - neighbour.point).norm_squared());
        let sum = reach + distance;
        // Very near the surface, rounding may have decided the neighbour's side.
        self.solid_normals().is_some()
            && reach * reach > MIN_REACH_SQ * way_sq
            && sum * sum > way_sq * (CLEARANCE * CLEARANCE)
    }

    /// Sign at a point by pseudo-normals, if its nearest triangle is one of the given slots.
    pub(crate) fn is_inside_by_nearest_of(&self, point: Vector3<f64>, slots: impl Iterator<Item = usize>) -> bool {
        let candidates = slots.map(|slot| (slot, nearest_on_triangle(point, self.tree.corners[slot])));
        let nearest =
            candidates.min_by(|(a, on_a), (b, on_b)| on_a.distance_sq.total_cmp(&on_b.distance_sq).then(a.cmp(b)));
        nearest.is_some_and(|(slot, on_triangle)| self.is_inside_by_normal(point, slot, || on_triangle))
    }

    /// Sign by the pseudo-normal of the nearest feature of a triangle. False without pseudo-normals.
    fn is_inside_by_normal(
        &self,
        point: Vector3<f64>,
        slot: usize,
        on_triangle: impl Fn() -> NearestOnTriangle,
    ) -> bool {
        self.pseudo_normals.as_ref().is_some_and(|normals| {
            // Far away rounding decides which triangle is the nearest, and so the side. A solid has no inside beyond its box.
            let at = Aabb { min: point.into(), max: point.into() };
            if self.topology.bounds_one_solid() && !self.bounds().encloses(&at) {
                return false;
            }
            let on_triangle = on_triangle();
            let normal = normals.feature(self.mesh, self.tree.triangles[slot], on_triangle.feature);
            if normal == Vector3::zeros() {
                return self.is_inside_by_winding(point);
            }
            normal.dot(&(point - on_triangle.point)) < 0.0
        })
    }

    pub(crate) fn is_inside_by_winding(&self, point: Vector3<f64>) -> bool {
        self.winding_estimate(point, f64::INFINITY).value.abs() >= 0.5
    }

    pub(crate) fn tree(&self) -> &Bvh {
        &self.tree
    }

    /// Normals of all faces, if pseudo-normals give every sign and are certain.
    pub(crate) fn solid_normals(&self) -> Option<&PseudoNormals> {
        self.pseudo_normals.as_ref().filter(|_| self.are_normals_certain)
    }

    /// For each triangle in the tree's order 1 if the outside is in front of it and the inside behind it, −1 if the other way round,
    /// 0 if that is not known. `None` if nothing is known of any: of open meshes, and where too many triangles cross.
    pub(crate) fn outward(&self) -> Option<&[f64]> {
        self.solid_normals().map(|_| self.winding.orientations()).or(self.outward.as_deref())
    }

    /// Indices of the corners of a triangle in the tree.
    pub(crate) fn corner_indices(&self, slot: usize) -> [u32; 3] {
        self.mesh.triangles[self.tree.triangles[slot] as usize]
    }

    /// Winding number with an error less than `max_error`, and so small that the value is on the right side of 1/2. Exact by a ray if
    /// all of the mesh are whole, unless each ray touches an edge, as at points on the surface.
    ///
    /// Where distances are those to the surface of a solid, it can change far from that surface, but not its side of 1/2.
    pub(crate) fn winding_estimate(&self, point: Vector3<f64>, max_error: f64) -> Estimate {
        let (tree, orientations) = (self.tree_of_signs(), self.winding.orientations());
        let by_ray = |point: Vector3<f64>| {
            let bounds = self.mesh.mesh_of_signs().bounds();
            let winding = whole_winding_number(tree, point, &bounds, |slot| orientations[slot])?;
            Some(Estimate { value: winding.into(), error: 0.0 })
        };
        // In the plane of a face that was dropped, w is the mean of what it is on either side.
        let off_dropped_faces = || {
            let distance = self.solid.as_ref().map(|_| self.tree.nearest(point, 0).on_triangle.distance_sq.sqrt())?;
            by_ray(moved_within(point, distance))
        };
        let whole = if self.winding.boundary().is_empty() { by_ray(point).or_else(off_dropped_faces) } else { None };
        whole.unwrap_or_else(|| self.winding.evaluate(tree, point, max_error))
    }

    fn tree_of_signs(&self) -> &Bvh {
        self.solid.as_ref().unwrap_or(&self.tree)
    }

    /// Distance by which the surface that is measured may be off the mesh's own.
    pub(crate) fn rounding(&self) -> f64 {
        self.mesh.rounding
    }

    pub(crate) fn boundary(&self) -> &MeshBoundary {
        self.winding.boundary()
    }

    /// Change of the winding number along a segment by the triangles that it crosses. `None` if rounding decides, and where
    /// triangles were dropped: what a flood carried past them is on the right side of 1/2, but another number.
    pub(crate) fn winding_change(&self, segment: [Vector3<f64>; 2]) -> Option<f64> {
        let is_exact = self.solid.is_none();
        is_exact.then(|| winding_change(&self.tree, self.winding.orientations(), segment))?
    }
}

/// A point on the same side as one at this distance from the surface: moved by half of that, in a direction without simple ratios.
pub(crate) fn moved_within(point: Vector3<f64>, distance: f64) -> Vector3<f64> {
    point + Vector3::new(0.267_1, 0.534_9, 0.801_3) * (0.5 * distance)
}

fn sign_reason(
    requested: Option<SignMethod>,
    method: SignMethod,
    topology: &Topology,
    doubt: Option<&'static str>,
) -> String {
    let found = match topology.to_string() {
        found if found.is_empty() => "closed, consistently wound, one shell".to_owned(),
        found if topology.bounds_one_solid() => format!("closed, one shell ({found}: put right)"),
        found => found,
    };
    let found = match doubt {
        Some(doubt) => format!("{found}, {doubt}"),
        None => found,
    };
    match requested {
        Some(_) => format!("{method}, as requested; the mesh: {found}"),
        None => format!("{method}: {found}"),
    }
}

#[cfg(test)]
mod tests;
