//! A soft body as an obstacle: its field at rest is carried by its tetrahedra (Macklin et al. 2020, §5.3), core's `cage`.
//!
//! 1. Once a run the tetrahedra at rest are sorted, and each gets a lower bound of the field: [`CagedBody::at_rest`].
//! 2. Once a frame the tree over them is fitted to where they are now: [`CagedBody::with_obstacle`].
//! 3. Each element near them is searched in the body at rest. The contact presses on the four corners of the tetrahedron that holds
//!    its surface point.

use sdf_core::cage::{Cage, CageMap, CageOutcome, TetFrame, TetLocator, bound_tets, sort_tets, tet_tree_size};
use sdf_core::contact::{ClusterKey, Contact, Element, Row, RowSide, TetPoint};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer, PointSampling};
use sdf_core::{Aabb, Simplex};
use sdf_field::{ContactOptions, Contacts, Elements, Field, MeshView, Method, QueryError, VertexOutOfRange};

use crate::halo::Halo;
use crate::{Obstacle, V3, World};

/// A soft body that others touch.
#[derive(Clone, Debug)]
pub struct CagedBody {
    field: Field,
    /// Particles of the body, then points of the halo.
    points: Vec<[f64; 3]>,
    /// Tetrahedra of the body, then those of the halo.
    tets: Vec<[u32; 4]>,
    /// The tetrahedra, sorted where they rest.
    order: Vec<u32>,
    first: u32,
    first_tet: u32,
    particle_count: usize,
    tet_count: usize,
    halo: Halo,
    reach: f64,
    map: CageMap,
}

/// Buffers of one shape of a body's tetrahedra, kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct CageRoom {
    points: Vec<[f64; 3]>,
    boxes: Vec<Aabb>,
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
        let points: Vec<_> = world.x[first..].iter().map(|x| (*x).into()).collect();
        let tets = world.tets[first_tet..].iter().map(|tet| tet.corners.map(|corner| corner - first as u32));
        let tets: Vec<_> = tets.collect();
        let (particle_count, tet_count) = (points.len(), tets.len());
        Self {
            field,
            order: sorted(&points, &tets),
            points,
            tets,
            first: first as u32,
            first_tet: first_tet as u32,
            particle_count,
            tet_count,
            halo: Halo::default(),
            reach: 0.0,
            map,
        }
    }

    /// The same body, its field carried on beyond its tetrahedra by one layer of cubes, which have neither mass nor stiffness. The body is
    /// one of [`soft::add`](crate::soft::add) with cubes of this side. For a body whose tetrahedra end where its mesh ends.
    #[must_use]
    pub fn with_halo(mut self, side: f64) -> Self {
        self.points.truncate(self.particle_count);
        self.tets.truncate(self.tet_count);
        self.halo = Halo::of_cubes(&self.points, &self.tets, side);
        let particles: Vec<_> = self.points.iter().map(|point| V3::from(*point)).collect();
        self.points.extend(self.halo.points(&particles));
        self.tets.extend(&self.halo.tets);
        self.order = sorted(&self.points, &self.tets);
        self.with_reach(side)
    }

    /// The same body, of which is known that its tetrahedra go on beyond its mesh for this distance at least.
    #[must_use]
    pub fn with_reach(self, reach: f64) -> Self {
        Self { reach, ..self }
    }

    /// How far its field goes on beyond its mesh; 0 where that is not known.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// The same body, searched by another map.
    pub fn with_map(&self, map: CageMap) -> Self {
        Self { map, ..self.clone() }
    }

    /// Its tetrahedra at rest. `None` of a body without any.
    pub fn at_rest<'a>(&'a self, room: &'a mut CageRoom) -> Option<CageAtRest<'a>> {
        let locator = room.locator(self, self.points.iter().copied())?;
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
        let particles = self.particles(world);
        let points = particles.iter().map(|x| (*x).into()).chain(self.halo.points(particles));
        let now = room.locator(self, points)?;
        let (bounds, cage) = (now.bounds(), Cage::new(rest.locator, now)?);
        let margin_factor = self.field.slope_bound() * slope_factor_bound(&cage);
        Some(run(&Caged { body: self, lower_bounds: &rest.lower_bounds, cage, bounds, margin_factor }))
    }

    /// The largest speed of its particles.
    pub fn max_speed(&self, world: &World) -> f64 {
        let first = self.first as usize;
        world.v[first..first + self.particle_count].iter().map(|v| v.norm()).fold(0.0, f64::max)
    }

    /// Is a tetrahedron of the world one of the body's?
    pub fn has_tet(&self, tet: u32) -> bool {
        (self.first_tet..self.first_tet + self.tet_count as u32).contains(&tet)
    }

    fn particles<'a>(&self, world: &'a World) -> &'a [V3] {
        let first = self.first as usize;
        &world.x[first..first + self.particle_count]
    }
}

/// The order of tetrahedra where they rest.
fn sorted(points: &[[f64; 3]], tets: &[[u32; 4]]) -> Vec<u32> {
    let mut order = vec![0; tets.len()];
    let is_sorted = sort_tets(points, tets, &mut vec![ClusterKey::default(); tets.len()], &mut order);
    assert!(is_sorted, "corners of tetrahedra are particles of the world");
    order
}

impl CageRoom {
    /// The body's tetrahedra with their corners at the points. `None` without any.
    fn locator<'a>(
        &'a mut self,
        body: &'a CagedBody,
        points: impl Iterator<Item = [f64; 3]>,
    ) -> Option<TetLocator<'a>> {
        let count = body.tets.len();
        self.points.clear();
        self.points.extend(points);
        self.boxes.resize(tet_tree_size(count), Aabb::EVERYWHERE);
        self.frames.resize(count, TetFrame::ILL_CONDITIONED);
        let locator = TetLocator::new(&self.points, &body.tets, &body.order, &mut self.boxes, &mut self.frames)?;
        (count > 0).then_some(locator)
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

    fn is_body(&self) -> bool {
        true
    }

    fn complete(&self, row: Row<f64>) -> Row<f64> {
        match self.cage.pull(row.surface_point).and_then(|(_, at)| self.carrier(row.surface_point, at)) {
            Some(at) => row.with_field(RowSide::Tet(TetPoint { tet: self.body.first_tet + at.tet, ..at })),
            None => row,
        }
    }
}

impl Caged<'_> {
    /// The tetrahedron with mass that carries a point: of a point in the halo the nearest one goes on.
    fn carrier(&self, point: V3, at: TetPoint<f64>) -> Option<TetPoint<f64>> {
        let count = self.body.tet_count as u32;
        if at.tet < count {
            return Some(at);
        }
        let now = self.cage.now();
        let candidates = (0..count).filter_map(|tet| Some(TetPoint { tet, weights: now.weights(tet, point)? }));
        // The one that it is least outside of.
        let lowest = |at: &TetPoint<f64>| at.weights.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        candidates.max_by(|a, b| lowest(a).total_cmp(&lowest(b)))
    }

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
            let (margins, map) = ([margin, options.margin], self.body.map);
            let search = self.cage.contact_within(field, minimizer, margins, &element, self.lower_bounds, map);
            match search.outcome {
                CageOutcome::NotFinite => found.not_finite_count += 1,
                CageOutcome::Separated => found.searched_count += 1,
                CageOutcome::Contact(found_at) => {
                    found.searched_count += 1;
                    let distance = found_at.world_distance();
                    found.contacts.push(Contact { distance, ..found_at.contact });
                }
            }
        }
        Ok(found)
    }
}

/// Upper bound of [`Cage::slope_factor`], for a tenth of its price: ‖G‖² = λ(GᵀG) ≤ the largest sum of |entries| in a row of GᵀG. Near a
/// rotation the two agree.
fn slope_factor_bound(cage: &Cage) -> f64 {
    let tets = 0..cage.now().tets().len() as u32;
    let squares = tets.filter_map(|tet| cage.jacobian(tet)).map(|jacobian| {
        let square = jacobian.tr_mul(&jacobian);
        (0..3).map(|row| square.row(row).iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max)
    });
    // Rounding of a sum of nine products is far below this.
    squares.fold(0.0, f64::max).sqrt() * (1.0 + 1e-12)
}
