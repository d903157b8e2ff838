//! Closed loops of boundary edges.
//!
//! The boundary of triangles is a cycle: at each point as many edges end as begin. So a walk along unused edges can always go on until it
//! comes back to a point of its own, where a loop is closed and taken off.

use std::collections::HashMap;
use std::ops::Range;

/// Directed edges, each as many times as its multiplicity says, divided into loops that meet no point twice. Edges that close none stand
/// last, if the multiplicities are not those of a cycle.
pub(super) fn loops(edges: impl Iterator<Item = ([u32; 2], f64)>) -> Vec<Vec<[u32; 2]>> {
    let directed = |(ends, multiplicity): ([u32; 2], f64)| {
        let [from, to] = ends;
        let edge = if multiplicity < 0.0 { [to, from] } else { [from, to] };
        std::iter::repeat_n(edge, multiplicity.abs() as usize)
    };
    let mut edges: Vec<[u32; 2]> = edges.flat_map(directed).collect();
    edges.sort_unstable();
    let mut unused: HashMap<u32, Range<usize>> = HashMap::new();
    for (index, [from, _]) in edges.iter().enumerate() {
        unused.entry(*from).or_insert(index..index).end = index + 1;
    }
    let (mut loops, mut rest) = (vec![], vec![]);
    let (mut path, mut place): (Vec<[u32; 2]>, HashMap<u32, usize>) = (vec![], HashMap::new());
    for [start, _] in &edges {
        let mut at = *start;
        // A point of the path is at the edge that begins there.
        while let Some(next) = unused.get_mut(&at).and_then(Iterator::next) {
            place.insert(at, path.len());
            path.push(edges[next]);
            at = edges[next][1];
            if let Some(first) = place.get(&at) {
                let closed = path.split_off(*first);
                closed.iter().for_each(|[from, _]| _ = place.remove(from));
                loops.push(closed);
            }
        }
        place.clear();
        rest.append(&mut path);
    }
    loops.extend(Some(rest).filter(|rest| !rest.is_empty()));
    loops
}

/// Do edges form one closed loop?
pub(super) fn is_closed(edges: &[[u32; 2]]) -> bool {
    edges.iter().zip(edges.iter().cycle().skip(1)).all(|([_, to], [from, _])| to == from)
}
