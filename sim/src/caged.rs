//! A soft body as an obstacle: its field at rest is carried by its tetrahedra (Macklin et al. 2020, §5.3), core's `cage`.
//!
//! 1. Once a run the tetrahedra at rest are sorted into a table, and each gets a lower bound of the field: [`CagedBody::at_rest`].
//! 2. Once a frame they are sorted as they are now: [`CagedBody::with_obstacle`].
//! 3. Each element near them is searched in the body at rest. The contact presses on the four corners of the tetrahedron that holds
//!    its surface point.

use sdf_core::cage::{Cage, CageMap, CageOutcome, TableRoom, TetFrame, TetLocator, TetTable, bound_tets, table_shape};
use sdf_core::contact::{Contact, Element, Row, RowSide, TetPoint};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer, PointSampling};
use sdf_core::{Aabb, Simplex};
use sdf_field::{ContactOptions, Contacts, Elements, Field, MeshView, Method, QueryError, VertexOutOfRange};

use crate::{Obstacle, V3, World};

/// A soft body that others touch.
#[derive(Clone, Debug)]
pub struct CagedBody {
    field: Field,
    points: Vec<[f64; 3]>,
    tets: Vec<[u32; 4]>,
    first: u32,
    first_tet: u32,
    map: CageMap,
}

/// Buffers of one shape of a body's tetrahedra, kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct CageRoom {
    starts: Vec<u32>,
    entries: Vec<u32>,
    frames: Vec<TetFrame>,
}

/// A body's tetrahedra at rest, and a lower bound of the field in each.
#[derive(Clone, Debug)]
pub struct CageAtRest<'a> {
    locator: TetLocator<'a>,
    lower_bounds: Vec<f64>,
}

impl CagedBody {
    /// A body of the world's tetrahedra from `first_tet` on and particles from `first` on, which are where they rest now; so is the
    /// field.
    pub fn new(field: Field, world: &World, first: usize, first_tet: usize, map: CageMap) -> Self {
        let points = world.x[first..].iter().map(|x| (*x).into()).collect();
        let tets = world.tets[first_tet..].iter().map(|tet| tet.corners.map(|corner| corner - first as u32)).collect();
        Self { field, points, tets, first: first as u32, first_tet: first_tet as u32, map }
    }

    /// The same body, searched by another map.
    pub fn with_map(&self, map: CageMap) -> Self {
        Self { map, ..self.clone() }
    }

    /// Its tetrahedra at rest. `None` of a body without any.
    pub fn at_rest<'a>(&'a self, room: &'a mut CageRoom) -> Option<CageAtRest<'a>> {
        let shape = room.fit(&self.points, &self.tets)?;
        let CageRoom { starts, entries, frames } = room;
        let table = TetTable::build(&self.points, &self.tets, shape, starts, entries).ok()?;
        let locator = TetLocator::new(&self.points, &self.tets, frames, table)?;
        let mut lower_bounds = vec![0.0; self.tets.len()];
        bound_tets(self.field.as_any(), &locator, &mut lower_bounds);
        Some(CageAtRest { locator, lower_bounds })
    }

    /// Calls `run` with the body as it is in the world.
    pub fn with_obstacle<T>(
        &self,
        rest: &CageAtRest,
        world: &World,
        room: &mut CageRoom,
        run: impl FnOnce(&dyn Obstacle) -> T,
    ) -> Option<T> {
        let points: Vec<[f64; 3]> = self.particles(world).iter().map(|x| (*x).into()).collect();
        let bounds = Aabb::from_points(points.iter().copied())?;
        room.with_table(&points, &self.tets, |table, frames| {
            let now = TetLocator::new(&points, &self.tets, frames, table)?;
            let cage = Cage::new(rest.locator, now)?;
            let margin_factor = self.field.slope_bound() * cage.slope_factor();
            Some(run(&Caged { body: self, lower_bounds: &rest.lower_bounds, cage, bounds, margin_factor }))
        })
    }

    /// The largest speed of its particles.
    pub fn max_speed(&self, world: &World) -> f64 {
        let first = self.first as usize;
        world.v[first..first + self.points.len()].iter().map(|v| v.norm()).fold(0.0, f64::max)
    }

    /// Is a tetrahedron of the world one of the body's?
    pub fn has_tet(&self, tet: u32) -> bool {
        (self.first_tet..self.first_tet + self.tets.len() as u32).contains(&tet)
    }

    fn particles<'a>(&self, world: &'a World) -> &'a [V3] {
        let first = self.first as usize;
        &world.x[first..first + self.points.len()]
    }
}

impl CageRoom {
    /// Makes room for a table, and returns its shape.
    fn fit(&mut self, points: &[[f64; 3]], tets: &[[u32; 4]]) -> Option<[u32; 3]> {
        let bounds = Aabb::from_points(points.iter().copied())?;
        self.with_table(points, tets, |_, _| Some(table_shape(&bounds, tets.len())))
    }

    /// Calls `run` with a table of the tetrahedra and room for their frames.
    fn with_table<T>(
        &mut self,
        points: &[[f64; 3]],
        tets: &[[u32; 4]],
        run: impl FnOnce(TetTable, &mut [TetFrame]) -> Option<T>,
    ) -> Option<T> {
        let bounds = Aabb::from_points(points.iter().copied())?;
        let shape = table_shape(&bounds, tets.len());
        self.frames.resize(tets.len(), TetFrame::ILL_CONDITIONED);
        loop {
            match TetTable::build(points, tets, shape, &mut self.starts, &mut self.entries) {
                Ok(table) => return run(table, &mut self.frames),
                Err(TableRoom::Starts { needed }) => self.starts.resize(needed, 0),
                // A body that moves needs a little more or less next time.
                Err(TableRoom::Entries { needed }) => self.entries.resize(needed + needed / 4, 0),
            }
        }
    }
}

/// A soft body as it is now.
struct Caged<'a> {
    body: &'a CagedBody,
    lower_bounds: &'a [f64],
    cage: Cage<'a>,
    bounds: Aabb,
    /// A distance of the world times this is at least as long at rest.
    margin_factor: f64,
}

impl Obstacle for Caged<'_> {
    fn contacts(&self, mesh: MeshView, edges: &[[u32; 2]], options: &ContactOptions) -> Result<Contacts, QueryError> {
        match options.elements {
            Elements::Faces => self.find_by_method(mesh.points, mesh.faces, options),
            Elements::Edges => self.find_by_method(mesh.points, edges, options),
            Elements::Vertices => self.find(mesh.points, &mesh.vertices(), options, &FrankWolfe::default()),
        }
    }

    fn complete(&self, row: Row<f64>) -> Row<f64> {
        match self.cage.pull(row.surface_point) {
            Some((_, at)) => row.with_field(RowSide::Tet(TetPoint { tet: self.body.first_tet + at.tet, ..at })),
            None => row,
        }
    }
}

impl Caged<'_> {
    fn find_by_method<const N: usize>(
        &self,
        points: &[[f64; 3]],
        elements: &[[u32; N]],
        options: &ContactOptions,
    ) -> Result<Contacts, QueryError>
    where
        PointSampling: Minimizer<N>,
    {
        match options.method {
            Method::Sampling(samples) => {
                self.find(points, elements, options, &PointSampling { samples, corners: false })
            }
            Method::Auto | Method::Certified => {
                let evaluations = options.method.default_budget();
                let search = Certified { evaluations, tolerance: options.tolerance, ..Certified::default() };
                self.find(points, elements, options, &search)
            }
            _ => self.find(points, elements, options, &FrankWolfe::default()),
        }
    }

    fn find<M: Minimizer<N>, const N: usize>(
        &self,
        points: &[[f64; 3]],
        elements: &[[u32; N]],
        options: &ContactOptions,
        minimizer: &M,
    ) -> Result<Contacts, QueryError> {
        let mut found = Contacts { element_count: elements.len(), ..Contacts::default() };
        let near = self.bounds.inflate(options.margin);
        let margin = options.margin * self.margin_factor;
        for (id, vertices) in (0..).zip(elements) {
            if let Some(vertex) = vertices.iter().find(|vertex| **vertex as usize >= points.len()) {
                let missing = VertexOutOfRange { element: id as usize, vertex: *vertex, vertex_count: points.len() };
                return Err(QueryError::VertexOutOfRange(missing));
            }
            let corners = vertices.map(|vertex| V3::from(points[vertex as usize]));
            let element = Element { id, vertices: *vertices, simplex: Simplex { corners } };
            if element.simplex.bounds().intersection(&near).is_none() {
                continue;
            }
            let field = self.body.field.as_any();
            let search = self.cage.contact(field, minimizer, margin, &element, self.lower_bounds, self.body.map);
            match search.outcome {
                CageOutcome::NotFinite => found.not_finite_count += 1,
                CageOutcome::Separated => found.searched_count += 1,
                CageOutcome::Contact(found_at) => {
                    found.searched_count += 1;
                    let contact = in_world(found_at.contact);
                    found.contacts.extend((contact.distance <= options.margin).then_some(contact));
                }
            }
        }
        Ok(found)
    }
}

/// The contact with its distance in the world: along the normal to the surface point, or to first order where it has no normal.
fn in_world(contact: Contact<f64>) -> Contact<f64> {
    let distance = match contact.normal == V3::zeros() {
        true => contact.distance,
        false => contact.normal.dot(&(contact.point - contact.surface_point)),
    };
    Contact { distance, ..contact }
}
