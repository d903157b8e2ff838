//! Bounding volume hierarchy over the triangles of a mesh: an implicit 8-ary tree of boxes in Hilbert order.
//!
//! Triangles are sorted along a Hilbert curve by their centroids and packed into full nodes from the bottom up (Kamel
//! and Faloutsos 1994, "Hilbert R-tree: an improved R-tree using fractals"). Node i of a level has the children 8i …
//! 8i + 7 of the level below, so the tree stores boxes alone and no links. The boxes of eight children stand side by
//! side and are tested in SIMD lanes.
//!
//! | question | file |
//! |---|---|
//! | Where does a cell lie on the curve? | `sdf_core::hilbert`, `curve_order` |
//! | Which triangle is nearest to a point? Which triangles are near a point or meet a box? | `query` |
//! | Which triangles can be nearest to some point of a box? | `prune` |
//! | Which disc encloses a node's triangles? It is much thinner than the box on a smooth mesh | `bounding_disc` |

pub mod bounding_disc;
mod prune;
mod query;

use std::ops::Deref;
use std::sync::OnceLock;

use sdf_core::hilbert::BITS;
use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::bvh::bounding_disc::BoundingDisc;
use crate::curve_order::curve_order;
use crate::simd::{LANES, Lanes, VectorX8};
use crate::triangle::approx::{ApproxTriangle, UnitFrame};
pub(crate) use prune::PruneBound;
pub(crate) use query::NearestTriangle;

/// Children per node, one per SIMD lane.
pub(crate) const ARITY: usize = LANES;

/// Size of a traversal stack: a tree of `u32` triangles has up to 11 levels, each with up to 7 waiting children.
pub(crate) const STACK: usize = 11 * ARITY;

/// Expansion of a packet's candidate nodes stops when there are more than this. With a smaller limit, each octant
/// expands nodes that a larger list would have excluded once for all; with a larger one, too many nodes are tested per
/// packet.
pub(crate) const MAX_EXPANDED: usize = 192;

/// The tree. A triangle's index in the tree's order is its *slot*.
#[derive(Debug)]
pub(crate) struct Bvh {
    /// Corners of each slot.
    pub corners: Vec<[Vector3<f64>; 3]>,
    /// Index in the mesh of each slot.
    pub triangles: Vec<u32>,
    pub frame: UnitFrame,
    /// From the bottom up: `levels[0][i]` holds the boxes of the triangles 8i … 8i + 7, `levels[1][i]` those of the
    /// nodes 8i … 8i + 7 of level 0. The last level is the root alone.
    levels: Vec<Vec<ChildBoxes>>,
    /// Made when first asked for: a sparse bake seldom searches packets.
    for_packets: OnceLock<ForPackets>,
    /// Levels with more nodes than this have discs.
    disc_nodes: usize,
    pub arch: pulp::Arch,
}

/// A tree whose approximations and discs are there: reads go straight to them.
#[derive(Clone, Copy)]
pub(crate) struct PacketTree<'a> {
    tree: &'a Bvh,
    /// Approximation of each slot in [`Bvh::frame`].
    pub approx: &'a [ApproxTriangle],
    bounding_discs: &'a [Vec<BoundingDisc>],
}

impl Deref for PacketTree<'_> {
    type Target = Bvh;

    #[inline(always)]
    fn deref(&self) -> &Bvh {
        self.tree
    }
}

impl PacketTree<'_> {
    /// Disc around the triangles of a node. Nodes directly above triangles have height 1. Only the levels that
    /// [`Bvh::with_discs_above`] chose have discs.
    #[inline(always)]
    pub fn bounding_disc(&self, height: usize, node: u32) -> &BoundingDisc {
        &self.bounding_discs[height - 1][node as usize]
    }
}

/// Approximations and discs, which searches of packets ask for beside the tree.
#[derive(Debug)]
struct ForPackets {
    /// Approximation of each slot in [`Bvh::frame`].
    approx: Vec<ApproxTriangle>,
    /// `bounding_discs[k][i]` encloses the triangles of `levels[k][i]`, for the lowest levels.
    bounding_discs: Vec<Vec<BoundingDisc>>,
}

/// Boxes of a node's children, side by side. Unused lanes hold an empty box, infinitely far from everything.
#[derive(Clone, Copy, Debug, Default)]
struct ChildBoxes {
    min: VectorX8<f64>,
    max: VectorX8<f64>,
}

impl Bvh {
    pub fn new(mesh: &TriangleMesh) -> Self {
        Self::with_discs_above(mesh, MAX_EXPANDED)
    }

    /// Builds a tree with bounding discs on its lowest level and on each level with more than `min_nodes` nodes.
    pub fn with_discs_above(mesh: &TriangleMesh, min_nodes: usize) -> Self {
        Self { disc_nodes: min_nodes, ..Self::for_points(mesh) }
    }

    /// The tree with what searches of packets ask for, which is made unless it is there. Outside of the lock: a thread that waits for
    /// others within it could come back to it.
    pub fn prepare_packets(&self) -> PacketTree<'_> {
        let ForPackets { approx, bounding_discs } = match self.for_packets.get() {
            Some(made) => made,
            None => {
                let made = self.new_for_packets();
                self.for_packets.get_or_init(|| made)
            }
        };
        PacketTree { tree: self, approx, bounding_discs }
    }

    fn new_for_packets(&self) -> ForPackets {
        let Self { corners, levels, frame, disc_nodes, .. } = self;
        let approx = sdf_parallel::map_plain(corners.len(), |slot| ApproxTriangle::new(corners[slot], frame));
        let mut bounding_discs = vec![];
        let mut triangles_below = 1;
        for level in levels.iter().take_while(|level| level.len() > *disc_nodes || level.len() == levels[0].len()) {
            triangles_below *= ARITY;
            let disc = |node: usize| BoundingDisc::enclosing(corners, node * triangles_below, triangles_below, frame);
            bounding_discs.push(sdf_parallel::map_plain(level.len(), disc));
        }
        ForPackets { approx, bounding_discs }
    }

    /// Builds a tree. Searches of packets ask for more: [`Self::prepare_packets`].
    pub fn for_points(mesh: &TriangleMesh) -> Self {
        let triangles = Self::order(mesh);
        let corners = sdf_parallel::map_plain(triangles.len(), |slot| {
            mesh.corner_points(mesh.triangles[triangles[slot] as usize])
        });
        let mut levels = vec![group(&corners, box_around)];
        while levels[levels.len() - 1].len() > 1 {
            levels.push(group(&levels[levels.len() - 1], ChildBoxes::union));
        }
        let frame = UnitFrame::enclosing(&mesh.bounds());
        let (for_packets, disc_nodes) = (OnceLock::new(), MAX_EXPANDED);
        Self { corners, triangles, frame, levels, for_packets, disc_nodes, arch: pulp::Arch::new() }
    }

    /// The triangles in the order of the tree: along a Hilbert curve by their centroids.
    pub fn order(mesh: &TriangleMesh) -> Vec<u32> {
        if let Some(order) = &mesh.order {
            return order.clone();
        }
        let bounds = mesh.bounds();
        let cells_per_length = f64::from((1_u32 << BITS) - 1) / bounds.longest_side();
        curve_order(mesh.triangle_count(), |triangle| {
            let [a, b, c] = mesh.corner_points(mesh.triangles[triangle]);
            let from_corner = a / 3.0 + b / 3.0 + c / 3.0 - Vector3::from(bounds.min);
            (from_corner * cells_per_length).map(|x| x as u32).into()
        })
    }

    /// Approximations of all slots in [`Self::frame`]; none before [`Self::prepare_packets`].
    #[inline(always)]
    pub fn approx(&self) -> &[ApproxTriangle] {
        self.for_packets.get().map_or(&[], |for_packets| &for_packets.approx)
    }
}

impl ChildBoxes {
    const EMPTY: Self = Self { min: [[f64::INFINITY; ARITY]; 3], max: [[f64::NEG_INFINITY; ARITY]; 3] };

    /// Box around all children.
    fn union(&self) -> [Vector3<f64>; 2] {
        let min = |lanes: &Lanes<f64>| lanes.iter().copied().fold(f64::INFINITY, f64::min);
        let max = |lanes: &Lanes<f64>| lanes.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        [Vector3::from_fn(|axis, _| min(&self.min[axis])), Vector3::from_fn(|axis, _| max(&self.max[axis]))]
    }
}

fn box_around([a, b, c]: &[Vector3<f64>; 3]) -> [Vector3<f64>; 2] {
    [a.inf(b).inf(c), a.sup(b).sup(c)]
}

fn group<T: Sync>(children: &[T], bounds: impl Fn(&T) -> [Vector3<f64>; 2] + Sync) -> Vec<ChildBoxes> {
    let node = |children: &[T]| {
        let mut boxes = ChildBoxes::EMPTY;
        for (lane, child) in children.iter().enumerate() {
            let [min, max] = bounds(child);
            for axis in 0..3 {
                boxes.min[axis][lane] = min[axis];
                boxes.max[axis][lane] = max[axis];
            }
        }
        boxes
    };
    sdf_parallel::map_plain(children.len().div_ceil(ARITY), |index| {
        node(&children[index * ARITY..children.len().min((index + 1) * ARITY)])
    })
}

#[cfg(test)]
mod tests;
