//! Triangles without area that a closed mesh needs: which collinear triangles join edges that nothing else joins?
//!
//! A corner m on the edge ab of a triangle leaves ab, am and mb without partners (a T-junction). A collinear triangle abm
//! joins all three. Others are whiskers. They are peeled: a triangle with an edge that no other uses goes first, and
//! then those that it leaves with such an edge.

use std::collections::HashMap;

use crate::TriangleMesh;

/// Uses of an edge of a collinear triangle.
#[derive(Default)]
struct EdgeUse {
    count: usize,
    stitches: Vec<usize>,
}

/// For each collinear triangle: does each of its edges have another triangle, once the whiskers are peeled?
pub(super) fn needed_stitches(mesh: &TriangleMesh, is_counted: &[bool]) -> Vec<bool> {
    let mut uses: HashMap<[u32; 2], EdgeUse> = HashMap::new();
    for (stitch, corners) in mesh.stitches.iter().enumerate() {
        for edge in edges(corners) {
            let edge_use = uses.entry(edge).or_default();
            edge_use.count += 1;
            edge_use.stitches.push(stitch);
        }
    }
    for (corners, _) in mesh.triangles.iter().zip(is_counted).filter(|(_, is_counted)| **is_counted) {
        for edge in edges(corners) {
            uses.entry(edge).and_modify(|edge_use| edge_use.count += 1);
        }
    }
    let mut is_needed = vec![true; mesh.stitches.len()];
    let mut waiting: Vec<usize> = (0..is_needed.len()).collect();
    while let Some(stitch) = waiting.pop() {
        let own_edges = edges(&mesh.stitches[stitch]);
        if !is_needed[stitch] || own_edges.iter().all(|edge| uses[edge].count > 1) {
            continue;
        }
        is_needed[stitch] = false;
        for edge in own_edges {
            if let Some(edge_use) = uses.get_mut(&edge) {
                edge_use.count -= 1;
                // Once an edge has one user, it is peeled at the next visit; the list has served.
                if edge_use.count == 1 {
                    waiting.append(&mut edge_use.stitches);
                }
            }
        }
    }
    is_needed
}

fn edges(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[from, to]| [from.min(to), from.max(to)])
}
