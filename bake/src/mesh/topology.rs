use std::collections::VecDeque;
use std::fmt;

use crate::TriangleMesh;
use crate::mesh::has_area;
use crate::triangle::area_vector;

/// How the triangles of a mesh hang together. Triangles without area are left out of all of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// Edges with a triangle on one side only: holes.
    pub boundary_edges: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Triangles wound against the most of their shell. They are turned for the sign.
    pub wrongly_wound: usize,
    /// Edges across which no turning makes the winding agree, as on a Möbius strip.
    pub non_orientable_edges: usize,
    /// Parts that are joined by edges.
    pub shells: usize,
    /// Triangles that stand twice with opposite windings.
    pub doubled: usize,
    /// Pairs of triangles that pass through each other or lie on each other. Counted only where all else is in order.
    pub intersecting_pairs: usize,
    /// The one closed shell was wound inside out, and is turned as a whole.
    pub inside_out: bool,
}

impl Topology {
    /// Every edge has two triangles that run along it in opposite senses, after turning the wrongly wound.
    pub fn is_closed(&self) -> bool {
        self.boundary_edges == 0 && self.non_manifold_edges == 0 && self.non_orientable_edges == 0
    }

    /// The angle-weighted pseudo-normals tell inside from outside.
    pub fn bounds_one_solid(&self) -> bool {
        self.is_closed() && self.shells == 1 && self.intersecting_pairs == 0
    }
}

/// What is wrong with the mesh, in words; nothing where all is in order.
impl fmt::Display for Topology {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = [
            (self.boundary_edges, "boundary edge", "boundary edges"),
            (self.non_manifold_edges, "non-manifold edge", "non-manifold edges"),
            (self.wrongly_wound, "wrongly wound face", "wrongly wound faces"),
            (self.non_orientable_edges, "edge that no winding suits", "edges that no winding suits"),
            (self.doubled, "face doubled back to back", "faces doubled back to back"),
            (self.intersecting_pairs, "pair of intersecting faces", "pairs of intersecting faces"),
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
        }
        Ok(())
    }
}

/// One side of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct HalfEdge {
    /// Its points, the lower first.
    pub points: [u32; 2],
    pub triangle: u32,
    /// From this corner of the triangle to the next.
    pub corner: u8,
    /// The triangle runs from the lower point to the higher.
    forward: bool,
}

/// A mesh whose triangles are turned to agree.
pub(crate) struct Oriented {
    pub topology: Topology,
    /// Of each triangle: 1 as it is wound, −1 to be turned, 0 not to count.
    pub orientations: Vec<f64>,
    /// All sides of all edges of triangles that count, those of one edge together.
    pub half_edges: Vec<HalfEdge>,
}

impl Oriented {
    /// The edges along which the turned triangles do not cancel, and how many more run one way than the other.
    pub fn boundary(&self) -> impl Iterator<Item = ([u32; 2], f64)> + '_ {
        let excess = |edge: &[HalfEdge]| -> f64 {
            edge.iter()
                .map(|half| self.orientations[half.triangle as usize] * if half.forward { 1.0 } else { -1.0 })
                .sum()
        };
        let edges = self.half_edges.chunk_by(same_edge).map(move |edge| (edge[0].points, excess(edge)));
        edges.filter(|(_, times)| *times != 0.0)
    }
}

/// Intersections are left to the caller, who has a tree.
pub(crate) fn orient(mesh: &TriangleMesh) -> Oriented {
    let mut counts: Vec<bool> = mesh.triangles.iter().map(|corners| has_area(mesh.corner_points(*corners))).collect();
    let doubles = back_to_back(mesh, &counts);
    doubles.iter().for_each(|[_, second]| counts[*second as usize] = false);
    let mut half_edges = half_edges(mesh, &counts);
    if !doubles.is_empty() && half_edges.chunk_by(same_edge).any(|edge| edge.len() % 2 == 1) {
        // A sheet with two sides, or a wall between two solids: both count, and cancel.
        doubles.iter().for_each(|[_, second]| counts[*second as usize] = true);
        half_edges = self::half_edges(mesh, &counts);
    }

    let mut topology = Topology { doubled: doubles.len(), ..Topology::default() };
    let mut neighbours: Vec<[Option<Neighbour>; 3]> = vec![[None; 3]; counts.len()];
    let mut shells = Shells::new(counts.len());
    for edge in half_edges.chunk_by(same_edge) {
        edge.windows(2).for_each(|pair| shells.join(pair[0].triangle, pair[1].triangle));
        match edge {
            [_] => topology.boundary_edges += 1,
            [a, b] => {
                let agrees = a.forward != b.forward;
                neighbours[a.triangle as usize][usize::from(a.corner)] =
                    Some(Neighbour { triangle: b.triangle, agrees });
                neighbours[b.triangle as usize][usize::from(b.corner)] =
                    Some(Neighbour { triangle: a.triangle, agrees });
            }
            _ => topology.non_manifold_edges += 1,
        }
    }
    topology.shells = (0..counts.len()).filter(|triangle| counts[*triangle] && shells.is_root(*triangle)).count();

    let mut orientations = vec![0.0; counts.len()];
    for first in 0..counts.len() {
        if counts[first] && orientations[first] == 0.0 {
            turn_to_agree(first, &neighbours, &mut orientations, &mut topology);
        }
    }
    if topology.is_closed() && topology.shells == 1 && volume(mesh, &orientations) < 0.0 {
        topology.inside_out = true;
        orientations.iter_mut().for_each(|orientation| *orientation = -*orientation);
    }
    Oriented { topology, orientations, half_edges }
}

#[derive(Clone, Copy)]
struct Neighbour {
    triangle: u32,
    /// Both run along their edge in opposite senses, as they should.
    agrees: bool,
}

pub(crate) fn same_edge(a: &HalfEdge, b: &HalfEdge) -> bool {
    a.points == b.points
}

fn half_edges(mesh: &TriangleMesh, counts: &[bool]) -> Vec<HalfEdge> {
    let triangles = (0_u32..).zip(&mesh.triangles).filter(|(triangle, _)| counts[*triangle as usize]);
    let mut half_edges: Vec<HalfEdge> = triangles
        .flat_map(|(triangle, corners)| {
            [0_u8, 1, 2].map(|corner| {
                let [from, to] = [0, 1].map(|step| corners[(usize::from(corner) + step) % 3]);
                HalfEdge { points: [from.min(to), from.max(to)], triangle, corner, forward: from < to }
            })
        })
        .collect();
    sort_by_first(&mut half_edges, mesh.points.len(), |half| half.points[0]);
    half_edges
}

/// Sorts items whose order is that of a number below `numbers`, and among few of the same number their own.
fn sort_by_first<T: Ord + Copy>(items: &mut Vec<T>, numbers: usize, number: impl Fn(&T) -> u32) {
    let mut ends = vec![0_usize; numbers + 1];
    items.iter().for_each(|item| ends[number(item) as usize + 1] += 1);
    (0..numbers).for_each(|number| ends[number + 1] += ends[number]);
    let mut sorted = items.clone();
    for item in items.iter() {
        let place = &mut ends[number(item) as usize];
        sorted[*place] = *item;
        *place += 1;
    }
    sorted.chunk_by_mut(|a, b| number(a) == number(b)).for_each(<[T]>::sort_unstable);
    *items = sorted;
}

/// Pairs of triangles on the same corners. (Those of the same winding are one already.)
fn back_to_back(mesh: &TriangleMesh, counts: &[bool]) -> Vec<[u32; 2]> {
    let triangles = (0_u32..).zip(&mesh.triangles).filter(|(triangle, _)| counts[*triangle as usize]);
    let mut by_corners: Vec<([u32; 3], u32)> = triangles
        .map(|(triangle, corners)| {
            let mut sorted = *corners;
            sorted.sort_unstable();
            (sorted, triangle)
        })
        .collect();
    sort_by_first(&mut by_corners, mesh.points.len(), |(corners, _)| corners[0]);
    by_corners.windows(2).filter(|pair| pair[0].0 == pair[1].0).map(|pair| [pair[0].1, pair[1].1]).collect()
}

/// Gives a sense to all triangles that are joined to `first` by edges of two, so that the fewest are turned.
fn turn_to_agree(
    first: usize,
    neighbours: &[[Option<Neighbour>; 3]],
    orientations: &mut [f64],
    topology: &mut Topology,
) {
    let mut part = vec![first];
    let mut disagreements = 0;
    let mut queue = VecDeque::from([first]);
    orientations[first] = 1.0;
    while let Some(triangle) = queue.pop_front() {
        for neighbour in neighbours[triangle].iter().flatten() {
            let wanted = if neighbour.agrees { orientations[triangle] } else { -orientations[triangle] };
            let orientation = &mut orientations[neighbour.triangle as usize];
            if *orientation == 0.0 {
                *orientation = wanted;
                part.push(neighbour.triangle as usize);
                queue.push_back(neighbour.triangle as usize);
            } else if *orientation != wanted {
                disagreements += 1;
            }
        }
    }
    let turned = part.iter().filter(|triangle| orientations[**triangle] < 0.0).count();
    if 2 * turned > part.len() {
        part.iter().for_each(|triangle| orientations[*triangle] = -orientations[*triangle]);
    }
    topology.wrongly_wound += turned.min(part.len() - turned);
    topology.non_orientable_edges += disagreements / 2;
}

fn volume(mesh: &TriangleMesh, orientations: &[f64]) -> f64 {
    let origin = mesh.points[mesh.triangles[0][0] as usize];
    let cones = mesh.triangles.iter().zip(orientations).map(|(corners, orientation)| {
        let corners = mesh.corner_points(*corners).map(|corner| corner - origin);
        orientation * area_vector(corners).dot(&corners[0])
    });
    cones.sum::<f64>() / 3.0
}

/// Union-find over triangles.
struct Shells(Vec<u32>);

impl Shells {
    fn new(triangles: usize) -> Self {
        Self((0..triangles as u32).collect())
    }

    fn root(&mut self, mut triangle: u32) -> u32 {
        while self.0[triangle as usize] != triangle {
            let parent = self.0[triangle as usize];
            self.0[triangle as usize] = self.0[parent as usize];
            triangle = parent;
        }
        triangle
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    fn is_root(&self, triangle: usize) -> bool {
        self.0[triangle] as usize == triangle
    }
}
