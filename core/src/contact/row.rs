//! A contact as a solver takes it: one unilateral constraint between two sides, [`Row`].
//!
//! ```text
//! C = n · (a − b) − thickness ≥ 0        a: the contact's point, carried by its element
//!                                        b: the point of the surface, carried by the field
//! ∂C/∂x_i =  w_i n                       a particle of the element's side
//! ∂C/∂x_i = −w_i n                       a particle of the field's side
//! Ċ       =  n · (ȧ − ḃ − u)             u: the surface's own velocity, where the field moves by itself
//! ```
//!
//! n points from the field to the element. Each side says who carries its point: nobody, particles, a rigid body, or
//! tetrahedra (Macklin et al. 2020, §5 and §8; Macklin et al. 2016, "XPBD"). Rows hold for rigid-body solvers as well as for
//! position-based ones: no time step and no stiffness stands in them.

use nalgebra::Vector3;

use super::{Contact, NO_VERTEX};
use crate::number::{Float, Real};

/// A point of a mesh of tetrahedra: x = Σ_k w_k x_k over the corners of one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TetPoint<R> {
    /// The index of the tetrahedron.
    pub tet: u32,
    /// Barycentric, in the order of its corners. Their sum is 1. Negative ones extrapolate.
    pub weights: [R; 4],
}

/// The carrier of a contact's point, which takes the impulse at it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RowSide<R: Real> {
    /// Nobody: the point has infinite mass.
    Fixed,
    /// One to three particles: x = Σ w_k x_k. [`NO_VERTEX`] and weight 0 beyond the last.
    Particles {
        /// The particles.
        indices: [u32; 3],
        /// Their shares.
        weights: [R; 3],
    },
    /// A rigid body: x = centre + arm.
    Body {
        /// The body.
        body: u32,
        /// Vector from the body's centre to the point, in world axes.
        arm: Vector3<R>,
    },
    /// A tetrahedron: its four corners are the particles.
    Tet(TetPoint<R>),
    /// An element of a surface that is embedded in tetrahedra: one for each corner, twelve particles at most. The weights are the
    /// products of the contact's and the embedding's; an element with fewer corners has zeros.
    Embedded([TetPoint<R>; 3]),
}

impl<R: Float> RowSide<R> {
    /// The particles of the contact's element: its mesh's vertices, of which the first is particle `first`.
    pub fn particles(contact: &Contact<R>, first: u32) -> Self {
        let indices = contact.vertices.map(|vertex| match vertex {
            NO_VERTEX => NO_VERTEX,
            vertex => vertex.saturating_add(first),
        });
        Self::Particles { indices, weights: contact.weights }
    }

    /// A point of a rigid body.
    pub fn body(body: u32, centre: Vector3<R>, point: Vector3<R>) -> Self {
        Self::Body { body, arm: point - centre }
    }

    /// The contact's element where each vertex of its mesh is a point of a tetrahedron: `embedding` has one for each vertex.
    /// `None` if a vertex is missing there.
    pub fn embedded(contact: &Contact<R>, embedding: &[TetPoint<R>]) -> Option<Self> {
        let mut points = [TetPoint { tet: 0, weights: [R::zero(); 4] }; 3];
        for ((point, vertex), weight) in points.iter_mut().zip(contact.corner_vertices()).zip(contact.weights) {
            let TetPoint { tet, weights } = *embedding.get(*vertex as usize)?;
            *point = TetPoint { tet, weights: weights.map(|share| share * weight) };
        }
        Some(Self::Embedded(points))
    }

    /// Visits each particle of the side once, with its weight; `tets` has the corners of each tetrahedron. Shares of zero are left out.
    /// Nothing comes of a rigid body or a fixed side.
    ///
    /// So the inverse mass that an impulse along the normal meets is Σ w²/m over what is visited.
    pub fn visit_particles(&self, tets: &[[u32; 4]], mut visit: impl FnMut(u32, R)) {
        let mut found = Particles { count: 0, shares: [(NO_VERTEX, R::zero()); 12] };
        let add_tet = |found: &mut Particles<R>, point: &TetPoint<R>| {
            let corners = tets.get(point.tet as usize).into_iter().flatten();
            corners.zip(point.weights).for_each(|(particle, weight)| found.add(*particle, weight));
        };
        match self {
            Self::Tet(point) => add_tet(&mut found, point),
            Self::Embedded(points) => points.iter().for_each(|point| add_tet(&mut found, point)),
            Self::Particles { indices, weights } => {
                let shares = indices.iter().zip(*weights).filter(|(index, _)| **index != NO_VERTEX);
                shares.for_each(|(index, weight)| found.add(*index, weight));
            }
            Self::Fixed | Self::Body { .. } => {}
        }
        found.shares.iter().take(found.count).for_each(|(particle, weight)| visit(*particle, *weight));
    }
}

/// The particles that carry a point, each once: at most the corners of three tetrahedra.
struct Particles<R> {
    count: usize,
    shares: [(u32, R); 12],
}

impl<R: Float> Particles<R> {
    /// Adds a share to those of its particle.
    fn add(&mut self, particle: u32, weight: R) {
        if Real::is_zero(weight) {
            return;
        }
        let (known, free) = self.shares.split_at_mut(self.count);
        if let Some((_, share)) = known.iter_mut().find(|(other, _)| *other == particle) {
            *share += weight;
        } else if let Some(share) = free.first_mut() {
            *share = (particle, weight);
            self.count += 1;
        }
    }
}

/// A contact as a unilateral constraint between two sides: C = n · (a − b) − thickness ≥ 0.
///
/// ```
/// use sdf_core::contact::{Element, Outcome, Row, RowSide, contact};
/// use sdf_core::{Simplex, minimize::FrankWolfe, nalgebra::Vector3, shapes::HalfSpace};
/// let ground = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
/// let vertex = Simplex { corners: [Vector3::new(1.0, 2.0, -0.25)] };
/// let element = Element { id: 0, vertices: [7], simplex: vertex };
/// let Outcome::Contact(contact) = contact(&ground, &FrankWolfe::default(), 0.0, &element) else { panic!() };
/// let row = Row::from_contact(&contact, 0.01).unwrap().with_element(RowSide::particles(&contact, 100));
/// assert_eq!(row.gap, -0.25 - 0.01);
/// row.element.visit_particles(&[], |particle, weight| assert_eq!((particle, weight), (107, 1.0)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<R: Float> {
    /// C when the contact was found: the way between the two points along the normal, less the thickness.
    pub gap: R,
    /// n: a unit vector, from the field to the element.
    pub normal: Vector3<R>,
    /// a: the point of the element.
    pub point: Vector3<R>,
    /// b: the point of the surface that is nearest, as the contact has it.
    pub surface_point: Vector3<R>,
    /// u: the velocity of the surface by itself, beside that of the field's side. Zero unless told.
    pub surface_velocity: Vector3<R>,
    /// The contact's thickness: how far from the surface the element is kept.
    pub thickness: R,
    /// Coulomb's coefficient: a push across the normal is at most this times that along it. Zero unless told.
    pub friction: R,
    /// Carrier of the element's point; pushed along the normal.
    pub element: RowSide<R>,
    /// Carrier of the surface's point; pushed against the normal.
    pub field: RowSide<R>,
    /// The contact's [`key`](Contact::key): the same from frame to frame, to warm-start a solver's impulses.
    pub key: u64,
}

impl<R: Float> Row<R> {
    /// The row of a contact of loose particles, its mesh's vertices, with a field that stands still. `None` where the contact has no
    /// normal: no direction separates there.
    pub fn from_contact(contact: &Contact<R>, thickness: R) -> Option<Self> {
        contact.has_normal().then(|| Self {
            gap: contact.gap() - thickness,
            normal: contact.normal,
            point: contact.point,
            surface_point: contact.surface_point,
            surface_velocity: Vector3::zeros(),
            thickness,
            friction: R::zero(),
            element: RowSide::particles(contact, 0),
            field: RowSide::Fixed,
            key: contact.key(),
        })
    }

    /// The same row, its element carried by `side`.
    pub fn with_element(self, side: RowSide<R>) -> Self {
        Self { element: side, ..self }
    }

    /// The same row, its surface carried by `side`.
    pub fn with_field(self, side: RowSide<R>) -> Self {
        Self { field: side, ..self }
    }

    /// The same row of a surface that moves by itself, as that of a moving or changing field does.
    pub fn with_surface_velocity(self, velocity: Vector3<R>) -> Self {
        Self { surface_velocity: velocity, ..self }
    }

    /// The same row with Coulomb's coefficient.
    pub fn with_friction(self, friction: R) -> Self {
        Self { friction, ..self }
    }

    /// C now: `point` and `surface_point` are where the two sides carry their points to. For the points of the row itself: the gap.
    pub fn gap_at(&self, point: Vector3<R>, surface_point: Vector3<R>) -> R {
        self.normal.dot(&(point - surface_point)) - self.thickness
    }

    /// Two unit vectors at right angles to the normal and to each other, continuous but where n.z changes its sign (Duff et al.
    /// 2017, "Building an Orthonormal Basis, Revisited").
    pub fn tangents(&self) -> [Vector3<R>; 2] {
        let [x, y, z]: [R; 3] = self.normal.into();
        let sign = z.sign();
        let a = -R::one() / (sign + z);
        let b = x * y * a;
        [Vector3::new(R::one() + sign * x * x * a, sign * b, -sign * x), Vector3::new(b, sign + y * y * a, -y)]
    }
}
