use std::collections::HashSet;

use super::Mesh;

impl Mesh {
    /// Each edge of the triangles once, in the order of first appearance, then the file's own segments. An edge has the
    /// direction that it has in its first triangle.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let mut known = HashSet::with_capacity(2 * self.triangles.len());
        let sides = self.triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
        let mut edges: Vec<[u32; 2]> =
            sides.filter(|[from, to]| known.insert([*from.min(to), *from.max(to)])).collect();
        edges.extend(&self.segments);
        edges
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::read_bytes;

    #[test]
    fn an_edge_of_two_triangles_counts_once_and_segments_come_last() {
        let mesh = read_bytes(b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nl 1 2\nf 1 2 3 4\n", "square.obj").unwrap();
        assert_eq!(mesh.edges(), [[0, 1], [1, 2], [2, 0], [2, 3], [3, 0], [0, 1]]);
    }
}
