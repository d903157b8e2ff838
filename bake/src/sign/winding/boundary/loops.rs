//! Closed loops of boundary edges.
//!
//! The boundary of triangles is a cycle: at each point as many edges end as begin. So a walk along unused edges can always go on until it
//! comes back to a point of its own, where a loop is closed and taken off.

/// Directed edges between points, each as many times as its multiplicity says, divided into loops that meet no point twice. Edges that close
/// none stand last, if the multiplicities are not those of a cycle.
pub(super) fn loops(point_count: usize, edges: impl Iterator<Item = ([u32; 2], f64)>) -> Vec<Vec<[u32; 2]>> {
    let mut directed: Vec<[u32; 2]> = vec![];
    for ([from, to], multiplicity) in edges {
        let edge = if multiplicity < 0.0 { [to, from] } else { [from, to] };
        directed.resize(directed.len() + multiplicity.abs() as usize, edge);
    }
    if directed.is_empty() {
        return vec![];
    }
    // The ends of the edges from one point stand together, in `ends[first[point]..unused[point]]` those that are unused.
    let mut first = vec![0; point_count + 1];
    directed.iter().for_each(|[from, _]| first[*from as usize + 1] += 1);
    (0..point_count).for_each(|point| first[point + 1] += first[point]);
    let (mut unused, mut ends) = (first.clone(), vec![0; directed.len()]);
    for [from, to] in directed {
        ends[unused[from as usize]] = to;
        unused[from as usize] += 1;
    }
    // Where on the path a point is.
    let mut place = vec![usize::MAX; point_count];
    let (mut loops, mut rest, mut path) = (vec![], vec![], Vec::<[u32; 2]>::new());
    for start in 0..point_count {
        let mut at = start;
        while unused[at] > first[at] {
            unused[at] -= 1;
            let to = ends[unused[at]];
            place[at] = path.len();
            path.push([at as u32, to]);
            at = to as usize;
            if place[at] < path.len() {
                let closed: Vec<_> = path.drain(place[at]..).collect();
                closed.iter().for_each(|[from, _]| place[*from as usize] = usize::MAX);
                loops.push(closed);
            }
        }
        path.iter().for_each(|[from, _]| place[*from as usize] = usize::MAX);
        rest.append(&mut path);
    }
    if !rest.is_empty() {
        loops.push(rest);
    }
    loops
}

/// Do edges form one closed loop?
pub(super) fn is_closed(edges: &[[u32; 2]]) -> bool {
    let next = edges.iter().skip(1).chain(edges.first());
    edges.iter().zip(next).all(|([_, to], [from, _])| to == from)
}
