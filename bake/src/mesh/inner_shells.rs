//! Shells inside of the solid: which closed shells are no part of its surface, because the solid goes on at both sides?
//!
//! The solid is where the winding number W is not zero. A shell that meets no other separates W = w from W = w + s; w is
//! the winding number of all others at the shell, s = ±1 its own orientation. It is inner if neither is zero.
//!
//! | step | arithmetic |
//! |---|---|
//! | 1. label shells: triangles connected by edges | – |
//! | 2. set aside *entangled* shells, which cross or touch themselves or others | exact predicates (`intersections`) |
//! | 3. compute w along a ray from a corner of the shell, by the triangles that it crosses | exact predicates |
//! | 4. remove inner shells | – |
//!
//! Removal leaves the solid as it was. Without entangled shells, W on the solid's side of each shell that is left is ±1,
//! and keeps its sign as far as the solid goes. So what is left winds once around it. An entangled shell must not lie in
//! a shell that is removed, nor around it: then the same holds within each removed shell.

use std::sync::atomic::{AtomicBool, Ordering};

use sdf_core::nalgebra::Vector3;

use super::intersections::{RAYS, TooMany, contacts, ray_crossings, ray_end};
use super::known::Known;
use super::topology::{OrientedMesh, Topology, orient, same_edge};
use crate::TriangleMesh;
use crate::bvh::Bvh;
use crate::triangle::area_vector;
use crate::union_find::UnionFind;

/// More shells than this are not examined: each takes a ray.
const MAX_SHELLS: usize = 10_000;

/// A shell's volume is known to be positive or negative if it is more than this share of the mesh's diagonal cubed.
const MIN_RELATIVE_VOLUME: f64 = 1e-12;

/// A closed shell.
struct Shell {
    /// Does it meet neither itself nor another, and enclose a volume?
    is_free: bool,
    /// 1 if wound outward, −1 if inward.
    orientation: i32,
    /// Winding number of each shell around a corner of this one, where it is not zero.
    windings: Vec<(usize, i32)>,
}

impl Shell {
    /// Winding number of all others around it.
    fn winding(&self) -> i32 {
        self.windings.iter().map(|(_, winding)| winding).sum()
    }

    /// 1 if the outside of the solid is at the front of its triangles, as they are oriented, and the inside at their back, −1 if the
    /// other way round, 0 if both are on one side or it meets others.
    fn outward(&self) -> i8 {
        let winding = self.winding();
        let enclosed = winding + self.orientation;
        match (self.is_free, winding == 0, enclosed == 0) {
            (true, true, false) => self.orientation as i8,
            (true, false, true) => -self.orientation as i8,
            _ => 0,
        }
    }
}

impl TriangleMesh {
    /// The mesh without closed shells that lie inside of the solid, as a cube in a cube that is wound alike.
    /// [`report`](Self::report) counts them, and those that are entangled and therefore kept.
    ///
    /// Unchanged unless the mesh is closed, without doubled triangles, and has from two to 10,000 shells.
    pub fn without_inner_shells(self) -> Self {
        let oriented = orient(&self);
        if !has_known_shells(&oriented.topology) {
            return Self { orientation: Known::new(oriented), ..self };
        }
        let tree = Bvh::for_points(&self);
        let (mesh, _) = self.without_free_inner_shells(&oriented, &tree, 0);
        if mesh.report.inner_shells > 0 { mesh } else { mesh.with_known(tree, oriented) }
    }

    /// [`Self::without_inner_shells`] of a mesh that [has known shells](has_known_shells), and the pairs of triangles of all its shells
    /// that are in [contact](contacts), if there are no more than `max_pairs`.
    pub(super) fn without_free_inner_shells(
        mut self,
        oriented: &OrientedMesh,
        tree: &Bvh,
        max_pairs: usize,
    ) -> (Self, Option<Vec<[u32; 2]>>) {
        let mut sets = UnionFind::new(self.triangles.len() + self.stitches.len());
        for edge in oriented.half_edges.chunk_by(same_edge) {
            edge.windows(2).for_each(|pair| sets.join(pair[0].triangle, pair[1].triangle));
        }
        let (labels, count) = labels(&mut sets, self.triangles.len());
        let (is_entangled, pairs) = entangled(&self, tree, &labels, count, max_pairs);
        let ends = first_and_last_triangles(&labels, count);
        let volumes = volumes(&self, &oriented.orientations, &labels, count);
        let is_free = |index: usize| {
            let [volume, size] = volumes[index];
            !is_entangled[index] && volume.abs() > MIN_RELATIVE_VOLUME * size
        };
        self.report.entangled_shells = (0..count).filter(|index| !is_free(*index)).count();
        let shell = |index: usize| {
            let windings = windings_around(&self, tree, &oriented.orientations, &labels, ends[index])?;
            let orientation = if volumes[index][0] > 0.0 { 1 } else { -1 };
            Some(Shell { is_free: is_free(index), orientation, windings })
        };
        let shells = sdf_parallel::map(count, shell).into_iter().collect::<Option<Vec<Shell>>>();
        let Some(shells) = shells else { return (self, pairs) };
        let is_inner = inner(&shells);
        let count_before = self.triangles.len();
        let kept = || (0..count_before).filter(|triangle| !is_inner[labels[*triangle]]);
        let outward: Vec<i8> = shells.iter().map(Shell::outward).collect();
        let of_triangle = |triangle: usize| outward[labels[triangle]] * oriented.orientations[triangle] as i8;
        self.outward = Some(kept().map(of_triangle).collect());
        self.report.inner_shells = is_inner.iter().filter(|is_inner| **is_inner).count();
        if self.report.inner_shells == 0 {
            return (self, pairs);
        }
        self.triangles = kept().map(|triangle| self.triangles[triangle]).collect();
        (self.order, self.tree, self.orientation) = (None, Known::default(), Known::default());
        self.report.inner_triangles = count_before - self.triangles.len();
        (self, pairs)
    }

    /// The mesh with its tree and orientation, for whoever asks next.
    pub(super) fn with_known(self, tree: Bvh, oriented: OrientedMesh) -> Self {
        let order = Some(tree.triangles.clone());
        Self { order, tree: Known::new(tree), orientation: Known::new(oriented), ..self }
    }
}

/// Is a mesh closed, without doubled triangles, and of more than one shell but not too many?
pub(super) fn has_known_shells(topology: &Topology) -> bool {
    topology.is_closed() && topology.doubled == 0 && (2..=MAX_SHELLS).contains(&topology.shells)
}

/// Is each shell inside of the solid at both sides, and apart from entangled shells?
fn inner(shells: &[Shell]) -> Vec<bool> {
    let is_inner = |shell: &Shell| {
        let winding = shell.winding();
        let is_in_free_shells = shell.windings.iter().all(|(around, _)| shells[*around].is_free);
        shell.is_free && is_in_free_shells && winding != 0 && winding + shell.orientation != 0
    };
    let mut is_inner: Vec<bool> = shells.iter().map(is_inner).collect();
    for entangled in shells.iter().filter(|shell| !shell.is_free) {
        entangled.windings.iter().for_each(|(around, _)| is_inner[*around] = false);
    }
    is_inner
}

/// Index of each triangle's shell, and the number of shells.
fn labels(sets: &mut UnionFind, triangle_count: usize) -> (Vec<usize>, usize) {
    let mut label_of_root = vec![usize::MAX; triangle_count];
    let mut count = 0;
    let labels = (0..triangle_count as u32).map(|triangle| {
        // The root is the lowest index, so it is no collinear triangle.
        let label = &mut label_of_root[sets.root(triangle) as usize];
        if *label == usize::MAX {
            *label = count;
            count += 1;
        }
        *label
    });
    let labels = labels.collect();
    (labels, count)
}

fn first_and_last_triangles(labels: &[usize], count: usize) -> Vec<[usize; 2]> {
    let mut ends = vec![[0; 2]; count];
    labels.iter().enumerate().rev().for_each(|(triangle, label)| ends[*label][0] = triangle);
    labels.iter().enumerate().for_each(|(triangle, label)| ends[*label][1] = triangle);
    ends
}

/// Signed volume of each shell: V = ⅓ Σ area vector · corner, about a corner of its own, and the sum of the magnitudes of the terms.
fn volumes(mesh: &TriangleMesh, orientations: &[f64], labels: &[usize], count: usize) -> Vec<[f64; 2]> {
    let (mut volumes, mut origins) = (vec![[0.0; 2]; count], vec![None; count]);
    for ((corners, orientation), label) in mesh.triangles.iter().zip(orientations).zip(labels) {
        let corners = mesh.corner_points(*corners);
        let origin: Vector3<f64> = *origins[*label].get_or_insert(corners[0]);
        let corners = corners.map(|corner| corner - origin);
        let vector = area_vector(corners);
        volumes[*label][0] += orientation * vector.dot(&corners[0]) / 3.0;
        volumes[*label][1] += vector.norm() * corners[0].norm() / 3.0;
    }
    volumes
}

/// Does each shell cross or touch itself or another? And the pairs of triangles in contact, if there are no more than `max_pairs`.
fn entangled(
    mesh: &TriangleMesh,
    tree: &Bvh,
    labels: &[usize],
    count: usize,
    max_pairs: usize,
) -> (Vec<bool>, Option<Vec<[u32; 2]>>) {
    let is_entangled: Vec<AtomicBool> = (0..count).map(|_| AtomicBool::new(false)).collect();
    let entangle = |a: usize, b: usize| {
        is_entangled[a].store(true, Ordering::Relaxed);
        is_entangled[b].store(true, Ordering::Relaxed);
    };
    let mut shell_of_point = vec![usize::MAX; mesh.points.len()];
    for (corners, label) in mesh.triangles.iter().zip(labels) {
        for corner in corners {
            let shell = &mut shell_of_point[*corner as usize];
            if *shell != usize::MAX && *shell != *label {
                entangle(*shell, *label);
            }
            *shell = *label;
        }
    }
    let are_one_shell = |a: u32, b: u32| labels[a as usize] == labels[b as usize];
    let on_meeting = |a: u32, b: u32| entangle(labels[a as usize], labels[b as usize]);
    let pairs = contacts(mesh, tree, max_pairs, are_one_shell, on_meeting);
    // Of shells that were not all looked at, none is known to be free.
    let are_unknown = pairs == Err(TooMany::Tests);
    (is_entangled.into_iter().map(|is| are_unknown || is.into_inner()).collect(), pairs.ok())
}

/// Winding numbers of all other shells at a corner of one of two triangles, where they are not zero. `None` if every ray
/// tried touches an edge, or begins on another shell.
fn windings_around(
    mesh: &TriangleMesh,
    tree: &Bvh,
    orientations: &[f64],
    labels: &[usize],
    ends: [usize; 2],
) -> Option<Vec<(usize, i32)>> {
    (0..RAYS).find_map(|ray| {
        let from = mesh.points[mesh.triangles[ends[ray % 2]][ray % 3] as usize];
        let mut windings: Vec<(usize, i32)> = vec![];
        let is_other = |slot: usize| labels[tree.triangles[slot] as usize] != labels[ends[0]];
        for (slot, crossing) in ray_crossings(tree, [from, ray_end(from, &mesh.bounds, ray)], is_other)? {
            let triangle = tree.triangles[slot] as usize;
            let label = labels[triangle];
            let change = -(crossing * orientations[triangle]) as i32;
            match windings.iter_mut().find(|(shell, _)| *shell == label) {
                Some((_, winding)) => *winding += change,
                None => windings.push((label, change)),
            }
        }
        windings.retain(|(_, winding)| *winding != 0);
        Some(windings)
    })
}
