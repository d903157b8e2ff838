//! Whose skin is a mesh? [`Surface`]: triangles and edges over particles, a rigid body, or tetrahedra that the mesh is embedded in.

use std::sync::Arc;

use sdf_core::Aabb;
use sdf_core::contact::{Contact, FeatureOwners, FeatureUse, RowSide, TetPoint};
use sdf_core::placed::Placement;
use sdf_field::{MeshClusters, MeshView};

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
        points: Arc<[[f64; 3]]>,
    },
    /// Each vertex is a point of one of the world's tetrahedra.
    Tets(Vec<TetPoint<f64>>),
}

/// A mesh and what carries it. Copies of a body share all but the carrier.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Triangles of vertices.
    pub faces: Arc<[[u32; 3]]>,
    /// The edges of the faces, each once, or those of strings.
    pub edges: Arc<[[u32; 2]]>,
    /// Owner of the vertices.
    pub carrier: Carrier,
    /// For each face the vertices and edges that it speaks for: [`FeatureOwners::bits`].
    pub(crate) owners: Arc<[u8]>,
    /// The faces around each vertex of a body's skin, one vertex after the other, and where those of each begin; empty of others.
    around: Arc<[u32]>,
    around_starts: Arc<[u32]>,
    /// Knowledge of a rigid body's faces.
    rigid: Option<Arc<RigidSkin>>,
    vertex_count: usize,
    /// The mesh as recordings have it, where it differs from this one.
    given: Option<Arc<Given>>,
}

/// A mesh before its points were welded.
#[derive(Debug, PartialEq)]
struct Given {
    /// For each point the vertex of the surface.
    vertices: Vec<u32>,
    /// Triangles of these points.
    faces: Vec<[u32; 3]>,
}

#[derive(Debug, PartialEq)]
struct RigidSkin {
    /// Clusters of the faces.
    clusters: MeshClusters,
    /// The box around the vertices in the body's frame.
    bounds: Aabb,
    /// The largest distance of a vertex from the center of mass.
    radius: f64,
}

impl Surface {
    /// A surface of triangles. Clusters of a rigid body's faces are made here.
    ///
    /// # Panics
    /// Where a face of a rigid body has a vertex that is not there.
    pub fn of_faces(faces: Vec<[u32; 3]>, vertex_count: usize, carrier: Carrier) -> Self {
        // A pass depends on the order of its constraints. Lower vertices first, whatever the order of the faces.
        let mut edges = MeshView { points: &[], faces: &faces }.edges();
        edges.iter_mut().for_each(|ends| ends.sort_unstable());
        edges.sort_unstable();
        let mut owners = vec![0; faces.len()];
        FeatureOwners::assign(&faces, &mut vec![FeatureUse::default(); 6 * faces.len()], &mut owners)
            .expect("buffers of the mesh's size");
        let is_skin = !matches!(carrier, Carrier::Particles { .. });
        let (around, around_starts) = if is_skin { faces_around(&faces, vertex_count) } else { Default::default() };
        let rigid = match &carrier {
            Carrier::Body { points, .. } => {
                let clusters = MeshClusters::new(MeshView { points, faces: &faces }).expect("vertices that are there");
                let bounds = Aabb::from_points(points.iter().copied()).unwrap_or(Aabb { min: [0.0; 3], max: [0.0; 3] });
                let radius = points.iter().map(|point| V3::from(*point).norm()).fold(0.0, f64::max);
                Some(Arc::new(RigidSkin { clusters, bounds, radius }))
            }
            _ => None,
        };
        Self {
            faces: faces.into(),
            edges: edges.into(),
            carrier,
            owners: owners.into(),
            around: around.into(),
            around_starts: around_starts.into(),
            rigid,
            vertex_count,
            given: None,
        }
    }

    /// Strings: edges without triangles.
    pub fn of_edges(edges: Vec<[u32; 2]>, vertex_count: usize, carrier: Carrier) -> Self {
        let none = || Arc::new([]);
        let (around, around_starts) = (none(), none());
        Self {
            faces: Arc::new([]),
            edges: edges.into(),
            carrier,
            owners: Arc::new([]),
            around,
            around_starts,
            rigid: None,
            vertex_count,
            given: None,
        }
    }

    /// Recordings have these points, each a vertex of the surface, and these triangles of them.
    pub(crate) fn recorded_as(self, vertices: Vec<u32>, faces: Vec<[u32; 3]>) -> Self {
        Self { given: Some(Arc::new(Given { vertices, faces })), ..self }
    }

    /// The triangles as recordings have them.
    pub(crate) fn recorded_faces(&self) -> &[[u32; 3]] {
        self.given.as_ref().map_or(&self.faces, |given| &given.faces)
    }

    /// How many points recordings have.
    pub(crate) fn recorded_count(&self) -> usize {
        self.given.as_ref().map_or(self.vertex_count, |given| given.vertices.len())
    }

    /// The points as recordings have them.
    pub(crate) fn recorded_points(&self, world: &World) -> Vec<[f64; 3]> {
        let points = self.points(world);
        match &self.given {
            Some(given) => given.vertices.iter().map(|vertex| points[*vertex as usize]).collect(),
            None => points,
        }
    }

    /// How many vertices there are.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Is it the skin of a rigid or soft body?
    pub(crate) fn is_skin(&self) -> bool {
        !self.around.is_empty()
    }

    /// The faces around a vertex of a body's skin.
    pub(crate) fn faces_around(&self, vertex: u32) -> &[u32] {
        let start = |index: usize| self.around_starts.get(index).map_or(0, |start| *start as usize);
        self.around.get(start(vertex as usize)..start(vertex as usize + 1)).unwrap_or_default()
    }

    /// Where the vertices are.
    pub fn points(&self, world: &World) -> Vec<[f64; 3]> {
        self.map(|vertex| self.point(world, vertex).into())
    }

    /// A coordinate of the vertices that is not finite or beyond f32, which recordings hold; `None` if all are within. Of a rigid body
    /// one of the cube around it.
    pub(crate) fn beyond_f32(&self, world: &World) -> Option<f64> {
        let is_beyond = |x: &f64| x.is_nan() || x.abs() > f64::from(f32::MAX);
        match self.carrier {
            Carrier::Body { id, .. } => {
                world.bodies[id as usize].position.iter().map(|x| x.abs() + self.radius()).find(is_beyond)
            }
            _ => self.points(world).into_iter().flatten().find(is_beyond),
        }
    }

    /// The vertices of a rigid body in its own frame, and clusters of its faces.
    pub(crate) fn at_rest(&self) -> Option<(&[[f64; 3]], &MeshClusters)> {
        match (&self.carrier, &self.rigid) {
            (Carrier::Body { points, .. }, Some(skin)) => Some((points, &skin.clusters)),
            _ => None,
        }
    }

    /// The largest distance of a rigid body's vertex from its center of mass.
    pub(crate) fn radius(&self) -> f64 {
        self.rigid.as_ref().map_or(0.0, |skin| skin.radius)
    }

    /// A box around all vertices. `None` without any.
    pub(crate) fn bounds(&self, world: &World) -> Option<Aabb> {
        match (&self.carrier, &self.rigid) {
            (Carrier::Body { id, .. }, Some(skin)) => Some(world.bodies[*id as usize].pose()?.push_bounds(skin.bounds)),
            _ => Aabb::from_points(self.points(world)),
        }
    }

    /// Upper bound of the speed of all vertices.
    pub fn max_speed(&self, world: &World) -> f64 {
        match &self.carrier {
            Carrier::Body { id, .. } => {
                let body = &world.bodies[*id as usize];
                body.velocity.norm() + body.angular_velocity().norm() * self.radius()
            }
            _ => self.speeds(world).into_iter().fold(0.0, f64::max),
        }
    }

    /// The longest edge of a sheet, a net or strings over its length in a world where they are at rest; at least 1, and 1 of bodies.
    pub fn max_stretch(&self, world: &World, at_rest: &World) -> f64 {
        let Carrier::Particles { .. } = self.carrier else { return 1.0 };
        let ratio = |ends: &[u32; 2]| {
            let length = |world| {
                let [a, b] = ends.map(|end| self.point(world, end as usize));
                (b - a).norm()
            };
            let rest = length(at_rest);
            (rest > 0.0).then(|| length(world) / rest)
        };
        self.edges.iter().filter_map(ratio).fold(1.0, f64::max)
    }

    /// Upper bound of the speed of each vertex.
    pub(crate) fn speeds(&self, world: &World) -> Vec<f64> {
        match &self.carrier {
            Carrier::Particles { first } => self.map(|vertex| world.v[*first as usize + vertex].norm()),
            Carrier::Tets(points) => {
                let corners = points.iter().map(|point| world.tets[point.tet as usize].corners);
                corners
                    .map(|corners| corners.map(|id| world.v[id as usize].norm()).into_iter().fold(0.0, f64::max))
                    .collect()
            }
            Carrier::Body { .. } => vec![self.max_speed(world); self.vertex_count],
        }
    }

    fn map<T>(&self, value: impl FnMut(usize) -> T) -> Vec<T> {
        (0..self.vertex_count).map(value).collect()
    }

    fn point(&self, world: &World, vertex: usize) -> V3 {
        match &self.carrier {
            Carrier::Particles { first } => world.x[*first as usize + vertex],
            Carrier::Body { id, points } => world.bodies[*id as usize].world_point(&V3::from(points[vertex])),
            Carrier::Tets(points) => {
                let TetPoint { tet, weights } = points[vertex];
                let corners = world.tets[tet as usize].corners.iter().zip(weights);
                corners.map(|(id, weight)| world.x[*id as usize] * weight).sum()
            }
        }
    }

    /// The side of a row that a contact's point belongs to.
    pub(crate) fn side(&self, contact: &Contact<f64>, world: &World) -> RowSide<f64> {
        match &self.carrier {
            Carrier::Particles { first } => RowSide::particles(contact, *first),
            Carrier::Body { id, .. } => RowSide::body(*id, world.bodies[*id as usize].position, contact.point),
            Carrier::Tets(points) => RowSide::embedded(contact, points).unwrap_or(RowSide::Fixed),
        }
    }
}

/// The faces around each vertex, one vertex after the other, and where those of each begin.
fn faces_around(faces: &[[u32; 3]], vertex_count: usize) -> (Vec<u32>, Vec<u32>) {
    let mut uses: Vec<[u32; 2]> =
        faces.iter().zip(0..).flat_map(|(face, id)| face.map(|vertex| [vertex, id])).collect();
    uses.sort_unstable();
    let starts = (0..=vertex_count as u32).map(|vertex| uses.partition_point(|[other, _]| *other < vertex) as u32);
    let starts = starts.collect();
    (uses.into_iter().map(|[_, face]| face).collect(), starts)
}
