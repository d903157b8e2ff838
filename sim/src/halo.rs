//! How does a soft body's field go on beyond its tetrahedra? [`Halo`]: a layer of cubes around them, without mass and stiffness, which
//! follow the cubes that they lie on.
//!
//! A field that its tetrahedra carry ends where they end. Where that is at the mesh, an element is found only once it is inside, and then
//! beside an edge the nearest side may be the wrong one: it is pushed out sideways.
//!
//! A node g of the layer goes on from the nearest node n of a cube, along that cube's edges, with s the steps from n to g and e the unit
//! steps from n into the cube:
//!
//! ```text
//! x_g = x_n + Σ_axis |s_axis| (x_n − x_{n + e_axis})
//! ```
//!
//! Where several cubes are as near, it is the mean of theirs.

use std::collections::{BTreeMap, BTreeSet};

use crate::V3;
use crate::soft::{ORDERS, corner_steps};

/// A layer of tetrahedra around those of a body.
#[derive(Clone, Debug, Default)]
pub(crate) struct Halo {
    /// Weights of the body's particles in each of the layer's own points.
    terms: Vec<Vec<(u32, f64)>>,
    /// Corners of the layer's tetrahedra: particles of the body, then points of the layer.
    pub tets: Vec<[u32; 4]>,
}

type Node = [i32; 3];

impl Halo {
    /// The layer around a body of [`soft::add`](crate::soft::add) with cubes of this side, whose particles are where they rest.
    pub fn of_cubes(points: &[[f64; 3]], tets: &[[u32; 4]], side: f64) -> Self {
        let nodes: Vec<Node> = points.iter().map(|point| point.map(|x| (x / side).round() as i32)).collect();
        let lowest = |tet: &[u32; 4]| [0, 1, 2].map(|axis| tet.map(|corner| nodes[corner as usize][axis])).map(least);
        let cubes: BTreeSet<Node> = tets.iter().map(lowest).collect();
        let mut ids: BTreeMap<Node, u32> = nodes.iter().copied().zip(0..).collect();
        let around = cubes.iter().flat_map(|cube| offsets(-1, 1).map(|offset| plus(cube, &offset)));
        let layer: BTreeSet<Node> = around.filter(|cube| !cubes.contains(cube)).collect();
        let mut halo = Self::default();
        for cube in &layer {
            for order in ORDERS {
                let corners = corner_steps(cube, &order);
                for node in corners {
                    let next = (points.len() + halo.terms.len()) as u32;
                    if let std::collections::btree_map::Entry::Vacant(entry) = ids.entry(node) {
                        entry.insert(next);
                        halo.terms.push(vec![]);
                    }
                }
                halo.tets.push(corners.map(|node| ids[&node]));
            }
        }
        for (node, id) in &ids {
            if let Some(terms) = (*id as usize).checked_sub(points.len()).and_then(|own| halo.terms.get_mut(own)) {
                *terms = terms_of(node, &cubes, &ids);
            }
        }
        halo
    }

    /// Where the layer's own points are, given the particles.
    pub fn points<'a>(&'a self, particles: &'a [V3]) -> impl Iterator<Item = [f64; 3]> + 'a {
        let point = |terms: &Vec<(u32, f64)>| terms.iter().map(|(id, weight)| particles[*id as usize] * *weight).sum();
        self.terms.iter().map(move |terms| V3::into(point(terms)))
    }
}

/// Weights of a node of the layer: the mean of what the nearest cubes say.
fn terms_of(node: &Node, cubes: &BTreeSet<Node>, ids: &BTreeMap<Node, u32>) -> Vec<(u32, f64)> {
    // The node is a corner of a cube beside another one: two steps from that one's lowest corner at most, one from its highest.
    let near = offsets(-2, 1).map(|offset| plus(node, &offset)).filter(|cube| cubes.contains(cube));
    let near: Vec<_> =
        near.map(|cube| (cube, from_axes(|axis| node[axis].clamp(cube[axis], cube[axis] + 1)))).collect();
    let steps = |from: &Node| from_axes(|axis| node[axis] - from[axis]);
    let way = |from: &Node| steps(from).iter().map(|step| step * step).sum::<i32>();
    let least = near.iter().map(|(_, from)| way(from)).min().unwrap_or(0);
    let nearest: Vec<_> = near.iter().filter(|(_, from)| way(from) == least).collect();
    let share = 1.0 / nearest.len().max(1) as f64;
    let mut weights = BTreeMap::new();
    for (cube, from) in nearest {
        *weights.entry(ids[from]).or_insert(0.0) += share;
        for axis in 0..3 {
            let step = f64::from(steps(from)[axis].abs()) * share;
            let mut inward = *from;
            inward[axis] = 2 * cube[axis] + 1 - from[axis];
            *weights.entry(ids[from]).or_insert(0.0) += step;
            *weights.entry(ids[&inward]).or_insert(0.0) -= step;
        }
    }
    weights.into_iter().filter(|(_, weight)| *weight != 0.0).collect()
}

fn from_axes(value: impl FnMut(usize) -> i32) -> Node {
    std::array::from_fn(value)
}

fn plus(a: &Node, b: &Node) -> Node {
    from_axes(|axis| a[axis] + b[axis])
}

fn least(corners: [i32; 4]) -> i32 {
    corners.into_iter().fold(i32::MAX, i32::min)
}

/// All nodes with coordinates from `low` to `high`.
fn offsets(low: i32, high: i32) -> impl Iterator<Item = Node> {
    (low..=high).flat_map(move |x| (low..=high).flat_map(move |y| (low..=high).map(move |z| [x, y, z])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::World;
    use crate::soft::{self, Matter};

    /// Three cubes around a corner, whose layer has nodes that are beside one, two and three of them. What moves all particles by one
    /// affine map moves the layer by it, to the rounding of a sum of at most twelve.
    #[test]
    fn the_layer_follows_an_affine_map() {
        let mut world = World::new([0.0; 3]);
        let points = [[0.05, 0.05, 0.05], [0.15, 0.05, 0.05], [0.05, 0.15, 0.05]];
        let matter = Matter { density: 1.0, young: 1.0, poisson: 0.3 };
        soft::add(&mut world, &points, &[], 0.1, 0.0, &matter, |_| false);
        let tets: Vec<_> = world.tets.iter().map(|tet| tet.corners).collect();
        let rest: Vec<[f64; 3]> = world.x.iter().map(|x| (*x).into()).collect();
        let halo = Halo::of_cubes(&rest, &tets, 0.1);
        // A box of 4 × 4 × 3 cubes without one column at a corner, less the three.
        assert_eq!(halo.tets.len(), 6 * (15 * 3 - 3));
        let image = |x: &V3| V3::new(1.0 + 1.2 * x.x - 0.3 * x.y, 0.9 * x.y + 0.1 * x.z, 0.2 * x.x + 0.8 * x.z);
        let moved: Vec<V3> = world.x.iter().map(image).collect();
        for (now, at) in halo.points(&moved).zip(halo.points(&world.x)) {
            assert!((V3::from(now) - image(&V3::from(at))).amax() < 1e-14, "{at:?}");
            let steps = at.map(|x| x / 0.1);
            assert!(steps.iter().all(|steps| (steps - steps.round()).abs() < 1e-9), "{at:?} is no node");
        }
    }
}
