//! Topology of a mesh, and an orientation of its triangles: does it bound one solid, and which side is out?
//!
//! 1. Doubled triangles, the same corners with opposite windings, are reduced to one where the rest closes without the other: each
//!    connected group of them by itself.
//! 2. Half-edges are sorted by their end points; those of one edge are counted to find boundary and non-manifold edges.
//!    Collinear triangles take part where they join boundary edges (`stitches`).
//! 3. Union-find over edges counts shells.
//! 4. A search across edges of two triangles turns each to agree with its neighbour. The majority of a connected part keeps its
//!    winding. Edges that agree as they are wound come first: triangles that they connect are turned together or not at all.
//! 5. A closed shell with negative volume (divergence theorem, V = ⅓ Σ area vector · corner) is turned as a whole.

use std::cmp::Ordering;
use std::fmt;

use crate::TriangleMesh;
use crate::mesh::stitches::needed_stitches;
use crate::triangle::area_vector;
use crate::union_find::UnionFind;

/// Connectivity of the triangles with an area.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// Edges with one triangle.
    pub boundary_edges: usize,
    /// Edges with more than two triangles.
    pub non_manifold_edges: usize,
    /// Triangles wound against the majority of their shell. They are turned to compute signs.
    pub wrongly_wound: usize,
    /// Edges whose triangles disagree however they are turned, as on a Möbius strip.
    pub non_orientable_edges: usize,
    /// Collinear faces that join the edges at T-junctions. Without them there would be boundary edges.
    pub stitches: usize,
    /// Parts connected by edges.
    pub shells: usize,
    /// Triangles that occur twice with opposite windings.
    pub doubled: usize,
    /// Pairs of triangles that cross, overlap, or lie back to back nearer than rounding. `None` if they are not counted: the mesh is not
    /// one closed shell, or more triangles are near each other than can be compared in some ten seconds.
    pub intersecting_pairs: Option<usize>,
    /// The one closed shell was wound inside out, and is turned as a whole.
    pub inside_out: bool,
}

impl Topology {
    /// Does every edge have two triangles that use it in opposite directions, after turning the wrongly wound?
    pub fn is_closed(&self) -> bool {
        self.boundary_edges == 0 && self.non_manifold_edges == 0 && self.non_orientable_edges == 0
    }

    /// Is the mesh one closed shell without self-intersections and T-junctions? Then angle-weighted pseudo-normals give
    /// the sign, but where rounding decides.
    pub fn bounds_one_solid(&self) -> bool {
        self.is_one_closed_shell() && self.intersecting_pairs == Some(0)
    }

    /// Is the mesh one closed shell without T-junctions, whether or not it intersects itself?
    pub(crate) fn is_one_closed_shell(&self) -> bool {
        self.is_closed() && self.shells == 1 && self.stitches == 0
    }
}

/// Defects of the mesh in words; empty if there are none.
impl fmt::Display for Topology {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = [
            (self.boundary_edges, "boundary edge", "boundary edges"),
            (self.non_manifold_edges, "non-manifold edge", "non-manifold edges"),
            (self.stitches, "T-junction stitched by a face without area", "T-junctions stitched by faces without area"),
            (self.wrongly_wound, "wrongly wound face", "wrongly wound faces"),
            (self.non_orientable_edges, "edge that no winding suits", "edges that no winding suits"),
            (self.doubled, "face doubled back to back", "faces doubled back to back"),
            (self.intersecting_pairs.unwrap_or(0), "pair of intersecting faces", "pairs of intersecting faces"),
            (if self.shells > 1 { self.shells } else { 0 }, "shell", "shells"),
        ];
        if self.shells == 0 {
            return f.write_str("no face with an area");
        }
        let mut separator = "";
        for (count, one, several) in counts.into_iter().filter(|(count, ..)| *count > 0) {
            write!(f, "{separator}{count} {}", if count == 1 { one } else { several })?;
            separator = ", ";
        }
        if self.inside_out {
            write!(f, "{separator}wound inside out")?;
            separator = ", ";
        }
        if self.is_one_closed_shell() && self.intersecting_pairs.is_none() {
            write!(f, "{separator}intersecting faces not counted, as too many are near each other")?;
        }
        Ok(())
    }
}

/// One triangle's side of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct HalfEdge {
    /// End points, the lower index first.
    pub points: [u32; 2],
    pub triangle: u32,
    /// Corner of the triangle at which the edge begins.
    pub corner: u8,
    /// Does the triangle's winding go from the lower index to the higher?
    is_forward: bool,
}

/// A mesh with consistent orientations.
#[derive(Debug)]
pub(crate) struct OrientedMesh {
    pub topology: Topology,
    /// Per triangle, and after them per collinear triangle: 1 as it is wound, −1 to be turned, 0 to be ignored.
    pub orientations: Vec<f64>,
    /// Half-edges of all triangles that are not ignored, grouped by edge.
    pub half_edges: Vec<HalfEdge>,
}

impl OrientedMesh {
    /// Boundary of the oriented mesh: edges along which it does not cancel, as their points and net multiplicity, the
    /// triangles that use the edge forward minus backward.
    pub fn boundary(&self) -> impl Iterator<Item = ([u32; 2], f64)> + '_ {
        let multiplicity = |edge: &[HalfEdge]| -> f64 {
            edge.iter()
                .map(|half| self.orientations[half.triangle as usize] * if half.is_forward { 1.0 } else { -1.0 })
                .sum()
        };
        let edges = self.half_edges.chunk_by(same_edge).map(move |edge| (edge[0].points, multiplicity(edge)));
        edges.filter(|(_, multiplicity)| *multiplicity != 0.0)
    }
}

/// Computes all of a mesh's topology but its intersections, for which the caller has a tree.
pub(crate) fn orient(mesh: &TriangleMesh) -> OrientedMesh {
    let mut is_counted = vec![true; mesh.triangles.len()];
    let mut half_edges = half_edges(mesh, &is_counted);
    let doubles = back_to_back(mesh, &half_edges);
    if !doubles.is_empty() {
        without_needless_doubles(&doubles, &half_edges, &mut is_counted);
        half_edges = self::half_edges(mesh, &is_counted);
    }
    is_counted.resize(mesh.triangles.len() + mesh.stitches.len(), false);
    if !mesh.stitches.is_empty() && boundary_edges(&half_edges) > 0 {
        let mut is_stitched = is_counted.clone();
        is_stitched[mesh.triangles.len()..].copy_from_slice(&needed_stitches(mesh, &is_counted));
        let stitched = self::half_edges(mesh, &is_stitched);
        if boundary_edges(&stitched) < boundary_edges(&half_edges) {
            (is_counted, half_edges) = (is_stitched, stitched);
        }
    }

    let stitches = is_counted[mesh.triangles.len()..].iter().filter(|is_counted| **is_counted).count();
    let mut topology = Topology { doubled: doubles.len(), stitches, ..Topology::default() };
    let mut neighbours: Vec<[Option<Neighbour>; 3]> = vec![[None; 3]; is_counted.len()];
    let mut shells = UnionFind::new(is_counted.len());
    for edge in half_edges.chunk_by(same_edge) {
        edge.windows(2).for_each(|pair| shells.join(pair[0].triangle, pair[1].triangle));
        match edge {
            [_] => topology.boundary_edges += 1,
            [a, b] => {
                let agrees = a.is_forward != b.is_forward;
                neighbours[a.triangle as usize][usize::from(a.corner)] =
                    Some(Neighbour { triangle: b.triangle, agrees });
                neighbours[b.triangle as usize][usize::from(b.corner)] =
                    Some(Neighbour { triangle: a.triangle, agrees });
            }
            _ => topology.non_manifold_edges += 1,
        }
    }
    topology.shells =
        (0..is_counted.len()).filter(|triangle| is_counted[*triangle] && shells.is_root(*triangle as u32)).count();

    let mut orientations = vec![0.0; is_counted.len()];
    for first in 0..is_counted.len() {
        if is_counted[first] && orientations[first] == 0.0 {
            let mut part = orient_connected(first, &neighbours, &mut orientations);
            if part.depends_on_first() {
                // By where the triangles are, so that the order of the faces decides nothing.
                part.triangles.iter().for_each(|triangle| orientations[*triangle] = 0.0);
                let first = lowest(mesh, &part.triangles).unwrap_or(first);
                part = orient_connected(first, &neighbours, &mut orientations);
            }
            topology.non_orientable_edges += part.non_orientable_edges;
            topology.wrongly_wound += part.wrongly_wound;
        }
    }
    if topology.is_closed() && topology.shells == 1 && volume(mesh, &orientations) < 0.0 {
        topology.inside_out = true;
        orientations.iter_mut().for_each(|orientation| *orientation = -*orientation);
    }
    OrientedMesh { topology, orientations, half_edges }
}

#[derive(Clone, Copy)]
struct Neighbour {
    triangle: u32,
    /// Do both triangles use their edge in opposite directions, as they should?
    agrees: bool,
}

pub(crate) fn same_edge(a: &HalfEdge, b: &HalfEdge) -> bool {
    a.points == b.points
}

fn boundary_edges(half_edges: &[HalfEdge]) -> usize {
    half_edges.chunk_by(same_edge).filter(|edge| edge.len() == 1).count()
}

/// Half-edges of the triangles that count, in their order: a counting sort by the first point, then each small bucket by itself.
fn half_edges(mesh: &TriangleMesh, is_counted: &[bool]) -> Vec<HalfEdge> {
    let all = mesh.triangles.iter().chain(&mesh.stitches).zip(is_counted).enumerate();
    let triangles =
        || all.clone().filter(|(_, (_, is_counted))| **is_counted).map(|(index, (corners, _))| (index, corners));
    let edges = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
    let mut ends = vec![0_usize; mesh.points.len() + 1];
    for (_, corners) in triangles() {
        edges(*corners).into_iter().for_each(|[from, to]| ends[from.min(to) as usize + 1] += 1);
    }
    (1..ends.len()).for_each(|point| ends[point] += ends[point - 1]);
    let unset = HalfEdge { points: [0; 2], triangle: 0, corner: 0, is_forward: false };
    let mut sorted = vec![unset; ends[mesh.points.len()]];
    for (triangle, corners) in triangles() {
        for (corner, [from, to]) in (0..).zip(edges(*corners)) {
            let points = [from.min(to), from.max(to)];
            let position = &mut ends[points[0] as usize];
            sorted[*position] = HalfEdge { points, triangle: triangle as u32, corner, is_forward: from < to };
            *position += 1;
        }
    }
    let key = |half: &HalfEdge| (u64::from(half.points[1]) << 32 | u64::from(half.triangle), half.corner);
    sorted.chunk_by_mut(|a, b| a.points[0] == b.points[0]).for_each(|edges| edges.sort_unstable_by_key(key));
    sorted
}

/// Pairs of triangles with the same corners and different windings, by the half-edges of all.
fn back_to_back(mesh: &TriangleMesh, half_edges: &[HalfEdge]) -> Vec<[u32; 2]> {
    let third = |half: &HalfEdge| mesh.triangles[half.triangle as usize][(usize::from(half.corner) + 2) % 3];
    let mut pairs = vec![];
    for edge in half_edges.chunk_by(same_edge) {
        let points = edge[0].points;
        if edge.len() == 1 || edge.len() == 2 && third(&edge[0]) != third(&edge[1]) {
            continue;
        }
        // Each pair is found at the edge without its highest corner.
        let opposite = edge.iter().map(|half| (third(half), half.triangle, half.is_forward));
        let mut opposite: Vec<(u32, u32, bool)> = opposite.filter(|(third, ..)| *third > points[1]).collect();
        opposite.sort_unstable();
        let is_pair = |pair: &&[(u32, u32, bool)]| pair[0].0 == pair[1].0 && pair[0].2 != pair[1].2;
        pairs.extend(opposite.windows(2).filter(is_pair).map(|pair| [pair[0].1, pair[1].1]));
    }
    pairs
}

/// The second of two triangles back to back does not count, unless more edges close with both: of a sheet with two sides, or a wall between
/// two solids, both count, and cancel. Those that are connected by edges are decided together.
fn without_needless_doubles(doubles: &[[u32; 2]], half_edges: &[HalfEdge], is_counted: &mut [bool]) {
    doubles.iter().for_each(|[_, second]| is_counted[*second as usize] = false);
    let mut groups = UnionFind::new(is_counted.len());
    let is_second = |half: &&HalfEdge| !is_counted[half.triangle as usize];
    for edge in half_edges.chunk_by(same_edge) {
        let mut seconds = edge.iter().filter(is_second);
        if let Some(first) = seconds.next() {
            seconds.for_each(|second| groups.join(first.triangle, second.triangle));
        }
    }
    // Edges of each group that are open without its second triangles, less those that are with them.
    let mut gains = vec![0_i64; is_counted.len()];
    for edge in half_edges.chunk_by(same_edge) {
        let mut seconds = edge.iter().filter(is_second);
        if let Some(first) = seconds.next() {
            let without = edge.len() - 1 - seconds.count();
            let is_open = |count: usize| i64::from(count % 2 == 1);
            gains[groups.root(first.triangle) as usize] += is_open(without) - is_open(edge.len());
        }
    }
    for [_, second] in doubles {
        is_counted[*second as usize] = gains[groups.root(*second) as usize] > 0;
    }
}

/// Triangles that are connected by edges of two triangles.
struct Part {
    triangles: Vec<usize>,
    wrongly_wound: usize,
    non_orientable_edges: usize,
}

impl Part {
    /// Would other triangles be turned, had the search begun at another one?
    fn depends_on_first(&self) -> bool {
        self.non_orientable_edges > 0 || 2 * self.wrongly_wound == self.triangles.len()
    }
}

/// The first of some triangles by the coordinates of its corners; `None` of none.
fn lowest(mesh: &TriangleMesh, triangles: &[usize]) -> Option<usize> {
    let corners = |triangle: usize| {
        let corners = mesh.triangles.iter().chain(&mesh.stitches).nth(triangle).copied().unwrap_or_default();
        let mut points = mesh.corner_points(corners).map(<[f64; 3]>::from);
        let compare = |a: &[f64; 3], b: &[f64; 3]| a.partial_cmp(b).unwrap_or(Ordering::Equal);
        points.sort_unstable_by(compare);
        points
    };
    let all = triangles.iter().map(|triangle| (corners(*triangle), *triangle));
    all.min_by(|(a, _), (b, _)| a.partial_cmp(b).unwrap_or(Ordering::Equal)).map(|(_, triangle)| triangle)
}

/// Orients all triangles connected to `first`. A minority is turned: the triangles that are connected by edges that agree as they are wound
/// stay as one.
fn orient_connected(first: usize, neighbours: &[[Option<Neighbour>; 3]], orientations: &mut [f64]) -> Part {
    // The triangles found so far, which is also the queue of the search.
    let mut part: Vec<usize> = vec![];
    let (mut next, mut has_disagreeing) = (0, false);
    let mut across_disagreeing = vec![(first, 1.0)];
    while let Some((start, orientation)) = across_disagreeing.pop() {
        if orientations[start] != 0.0 {
            continue;
        }
        orientations[start] = orientation;
        part.push(start);
        while let Some(&triangle) = part.get(next) {
            next += 1;
            for neighbour in neighbours[triangle].iter().flatten() {
                let other = neighbour.triangle as usize;
                if !neighbour.agrees {
                    has_disagreeing = true;
                    across_disagreeing.push((other, -orientation));
                } else if orientations[other] == 0.0 {
                    orientations[other] = orientation;
                    part.push(other);
                }
            }
        }
    }
    if !has_disagreeing {
        return Part { triangles: part, wrongly_wound: 0, non_orientable_edges: 0 };
    }
    let disagreements = |triangle: &usize| {
        let of_neighbours = neighbours[*triangle].iter().flatten();
        let is_same = |other: u32| orientations[*triangle] == orientations[other as usize];
        of_neighbours.filter(|neighbour| neighbour.agrees != is_same(neighbour.triangle)).count()
    };
    // Each edge is seen from both sides.
    let non_orientable_edges = part.iter().map(disagreements).sum::<usize>() / 2;
    let turned = part.iter().filter(|triangle| orientations[**triangle] < 0.0).count();
    if 2 * turned > part.len() {
        part.iter().for_each(|triangle| orientations[*triangle] = -orientations[*triangle]);
    }
    Part { wrongly_wound: turned.min(part.len() - turned), triangles: part, non_orientable_edges }
}

fn volume(mesh: &TriangleMesh, orientations: &[f64]) -> f64 {
    let origin = mesh.points[mesh.triangles[0][0] as usize];
    let cones = mesh.triangles.iter().zip(orientations).map(|(corners, orientation)| {
        let corners = mesh.corner_points(*corners).map(|corner| corner - origin);
        orientation * area_vector(corners).dot(&corners[0])
    });
    cones.sum::<f64>() / 3.0
}
