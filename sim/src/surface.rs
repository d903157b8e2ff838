//! Whose skin is a mesh? [`Surface`]: triangles and edges over particles, a rigid body, or tetrahedra that the mesh is embedded in.

use sdf_core::contact::Contact;
use sdf_field::MeshView;

use crate::row::{Rows, Side};
use crate::{V3, World};

/// Owner of a surface's vertices.
#[derive(Clone, Debug, PartialEq)]
pub enum Carrier {
    /// Vertex i is particle `first + i`.
    Particles {
        /// The particle of vertex 0.
        first: u32,
    },
    /// The vertices stand still in a body's frame.
    Body {
        /// Index of the body.
        id: u32,
        /// The vertices in the body's frame.
        points: Vec<[f64; 3]>,
    },
    /// Each vertex is a weighted mean of the corners of a tetrahedron.
    Tets(Vec<[(u32, f64); 4]>),
}

/// A mesh and what carries it.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Triangles of vertices.
    pub faces: Vec<[u32; 3]>,
    /// The edges of the faces, each once, or those of strings.
    pub edges: Vec<[u32; 2]>,
    /// Owner of the vertices.
    pub carrier: Carrier,
    vertex_count: usize,
}

impl Surface {
    /// A surface of triangles.
    pub fn of_faces(faces: Vec<[u32; 3]>, vertex_count: usize, carrier: Carrier) -> Self {
        // A pass depends on the order of its constraints. Lower vertices first, whatever the order of the faces.
        let mut edges = MeshView { points: &[], faces: &faces }.edges();
        edges.iter_mut().for_each(|ends| ends.sort_unstable());
        edges.sort_unstable();
        Self { faces, edges, carrier, vertex_count }
    }

    /// Strings: edges without triangles.
    pub fn of_edges(edges: Vec<[u32; 2]>, vertex_count: usize, carrier: Carrier) -> Self {
        Self { faces: vec![], edges, carrier, vertex_count }
    }

    /// How many vertices there are.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Where the vertices are.
    pub fn points(&self, world: &World) -> Vec<[f64; 3]> {
        self.map(|vertex| self.point(world, vertex).into())
    }

    /// The largest speed of each vertex.
    pub(crate) fn speeds(&self, world: &World) -> Vec<f64> {
        match &self.carrier {
            Carrier::Particles { first } => self.map(|vertex| world.v[*first as usize + vertex].norm()),
            Carrier::Tets(weights) => weights
                .iter()
                .map(|corners| corners.iter().map(|(id, _)| world.v[*id as usize].norm()).fold(0.0, f64::max))
                .collect(),
            Carrier::Body { id, points } => {
                let body = &world.bodies[*id as usize];
                let angular = body.angular_velocity().norm();
                points.iter().map(|point| body.velocity.norm() + angular * V3::from(*point).norm()).collect()
            }
        }
    }

    fn map<T>(&self, value: impl FnMut(usize) -> T) -> Vec<T> {
        (0..self.vertex_count).map(value).collect()
    }

    fn point(&self, world: &World, vertex: usize) -> V3 {
        match &self.carrier {
            Carrier::Particles { first } => world.x[*first as usize + vertex],
            Carrier::Body { id, points } => world.bodies[*id as usize].world_point(&V3::from(points[vertex])),
            Carrier::Tets(weights) => weights[vertex].iter().map(|(id, weight)| world.x[*id as usize] * *weight).sum(),
        }
    }

    /// The side of a row that a contact's point belongs to.
    pub(crate) fn side(&self, contact: &Contact<f64>, world: &World, rows: &mut Rows) -> Side {
        let corners = contact.corner_vertices().iter().zip(contact.corner_weights());
        match &self.carrier {
            Carrier::Particles { first } => rows.particles(corners.map(|(vertex, weight)| (first + vertex, *weight))),
            Carrier::Body { id, .. } => {
                Side::Body { id: *id, arm: world.bodies[*id as usize].local_point(&contact.point) }
            }
            Carrier::Tets(weights) => rows.particles(corners.flat_map(|(vertex, weight)| {
                weights[*vertex as usize].map(|(particle, share)| (particle, share * weight))
            })),
        }
    }
}
