//! From a surface and an obstacle to rows: which elements are asked, by which method, within which margin, and what is kept.

use sdf_core::contact::{Contact, one_per_feature};
use sdf_field::{ContactOptions, MeshView, Method, QueryError, Threads};

use crate::obstacle::Obstacle;
use crate::row::{Row, Rows, Side};
use crate::surface::Surface;
use crate::{V3, World};

/// Kinds of elements that are asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Elements {
    /// Triangles.
    pub faces: bool,
    /// Edges.
    pub edges: bool,
    /// Vertices.
    pub vertices: bool,
}

impl Elements {
    /// Triangles alone: they find everything.
    pub const FACES: Self = Self { faces: true, edges: false, vertices: false };
    /// Edges alone: for strings.
    pub const EDGES: Self = Self { faces: false, edges: true, vertices: false };
    /// Vertices alone: as most simulators do.
    pub const VERTICES: Self = Self { faces: false, edges: false, vertices: true };
}

/// How contacts are searched and what becomes of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    /// Kinds of elements.
    pub elements: Elements,
    /// How the lowest point of an element is searched.
    pub method: Method,
    /// One contact for each touched feature; else one for each element.
    pub one_per_feature: bool,
    /// Distance to keep from the obstacle.
    pub thickness: f64,
    /// Coulomb's coefficient.
    pub friction: f64,
    /// How many threads search. The contacts do not depend on it.
    pub threads: Threads,
}

impl Default for Query {
    fn default() -> Self {
        Self {
            elements: Elements::FACES,
            method: Method::Auto,
            one_per_feature: true,
            thickness: 0.0,
            friction: 0.3,
            threads: Threads::ONE,
        }
    }
}

/// How far things get until the next search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Time until the next search.
    pub time: f64,
    /// Distance that what falls gains in it: ½ g t².
    pub fall: f64,
    /// The margin is never larger, thickness not counted.
    pub max: f64,
}

impl Motion {
    /// Motion of everything in the world for a time.
    pub fn of(world: &World, time: f64) -> Self {
        Self { time, fall: 0.5 * world.gravity.norm() * time * time, max: f64::INFINITY }
    }

    /// Nothing moves: contacts are found where things touch already.
    pub const NONE: Self = Self { time: 0.0, fall: 0.0, max: 0.0 };

    fn reach(&self, speed: f64) -> f64 {
        (speed * self.time + self.fall).min(self.max)
    }
}

/// Contacts and their rows, in buffers that are kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct Contacts {
    /// As found, those of each obstacle after those of the one before.
    pub contacts: Vec<Contact<f64>>,
    /// Elements that were asked.
    pub element_count: usize,
    /// Elements that the cull let pass.
    pub searched_count: usize,
    /// Contacts without a normal, which make no row.
    pub without_normal_count: usize,
    rows: Rows,
}

impl Contacts {
    /// Forgets everything but the buffers.
    pub fn clear(&mut self) {
        self.contacts.clear();
        self.rows.clear();
        (self.element_count, self.searched_count, self.without_normal_count) = (0, 0, 0);
    }

    /// The rows that a solver takes.
    pub fn rows(&mut self) -> &mut Rows {
        &mut self.rows
    }

    /// Puts the rows in an order that depends on where they are and not on which body was asked first: A against B and B against A
    /// give the same bits.
    pub fn sort_by_place(&mut self) {
        let mut order: Vec<usize> = (0..self.contacts.len()).collect();
        let key = |index: &usize| {
            let Contact { point, normal, .. } = &self.contacts[*index];
            [point.x, point.y, point.z, normal.x, normal.y, normal.z].map(|x| x + 0.0)
        };
        order.sort_by(|a, b| {
            let pairs = key(a).into_iter().zip(key(b));
            pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
        });
        self.contacts = order.iter().map(|index| self.contacts[*index]).collect();
        self.rows.rows = order.iter().map(|index| self.rows.rows[*index]).collect();
    }
}

impl Query {
    /// Adds the contacts of a surface with an obstacle, and a row for each.
    ///
    /// Each element's margin is the thickness and what it moves until the next search.
    pub fn find(
        &self,
        obstacle: &dyn Obstacle,
        surface: &Surface,
        world: &World,
        motion: &Motion,
        contacts: &mut Contacts,
    ) -> Result<(), QueryError> {
        self.find_guided(obstacle, surface, world, motion, contacts, |_| ())
    }

    /// [`find`](Self::find), with a callback that may change the contacts before they become rows.
    pub fn find_guided(
        &self,
        obstacle: &dyn Obstacle,
        surface: &Surface,
        world: &World,
        motion: &Motion,
        contacts: &mut Contacts,
        guide: impl FnOnce(&mut Vec<Contact<f64>>),
    ) -> Result<(), QueryError> {
        let points = surface.points(world);
        let reaches: Vec<f64> = surface.speeds(world).iter().map(|speed| motion.reach(*speed)).collect();
        let widest = reaches.iter().fold(0.0, |a: f64, b| a.max(*b));
        let margin = |contact: &Contact<f64>| {
            let corners = contact.corner_vertices().iter().map(|vertex| reaches[*vertex as usize]);
            self.thickness + corners.fold(0.0, f64::max)
        };
        let mut found = vec![];
        let Elements { faces, edges, vertices } = self.elements;
        let kinds = [
            (faces, sdf_field::Elements::Faces),
            (edges, sdf_field::Elements::Edges),
            (vertices, sdf_field::Elements::Vertices),
        ];
        for (_, elements) in kinds.into_iter().filter(|(is_wanted, _)| *is_wanted) {
            let options = ContactOptions {
                elements,
                method: self.method,
                margin: self.thickness + widest,
                threads: self.threads,
                ..ContactOptions::default()
            };
            let mesh = MeshView { points: &points, faces: &surface.faces };
            let of_kind = obstacle.contacts(mesh, &surface.edges, &options)?;
            contacts.element_count += of_kind.element_count;
            contacts.searched_count += of_kind.searched_count;
            found.extend(of_kind.contacts.into_iter().filter(|contact| contact.distance <= margin(contact)));
        }
        if self.one_per_feature {
            let count = one_per_feature(&mut found);
            found.truncate(count);
        }
        guide(&mut found);
        for contact in found {
            if contact.normal == V3::zeros() {
                contacts.without_normal_count += 1;
                continue;
            }
            let row = self.row(obstacle, surface, world, &contact, &mut contacts.rows);
            contacts.rows.rows.push(row);
            contacts.contacts.push(contact);
        }
        Ok(())
    }

    fn row(
        &self,
        obstacle: &dyn Obstacle,
        surface: &Surface,
        world: &World,
        contact: &Contact<f64>,
        rows: &mut Rows,
    ) -> Row {
        let a = surface.side(contact, world, rows);
        let b = obstacle.side(contact, rows);
        let origin = match &b {
            Side::Fixed(_) => V3::zeros(),
            Side::Body { id, arm } => world.bodies[*id as usize].world_point(arm),
            Side::Particles { first, count } => world.mean(rows.terms_of(*first, *count)),
        };
        let offset = contact.distance - self.thickness - contact.normal.dot(&(contact.point - origin));
        Row { a, b, normal: contact.normal, offset, friction: self.friction }
    }
}
