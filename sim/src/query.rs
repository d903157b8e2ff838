//! From a surface and an obstacle to rows: which elements are asked, by which method, within which margin, and what is kept.

mod elements;
mod few;
mod rigid;

use sdf_core::contact::{Contact, Feature, FeatureOwners, Row, one_per_feature};
use sdf_core::nalgebra::Isometry3;
use sdf_field::{ContactOptions, Field, MeshInMotion, MeshView, Method, QueryError, Threads};

use crate::memory::{self, Again, Asked, Known};
use crate::motion::Motion;
use crate::obstacle::Obstacle;
use crate::opposed::oppose;
use crate::row::{Rounding, Rows};
use crate::sheet_normal::SheetNormals;
use crate::surface::{Carrier, Surface};
use crate::{V3, World};

pub use elements::Elements;
use rigid::RigidMemory;

/// Knowledge of one surface and one obstacle from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    faces: Known,
    edges: Known,
    rigid: RigidMemory,
}

/// How contacts are searched and what becomes of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    /// Kinds of elements.
    pub elements: Elements,
    /// Are vertices of sheets, strings and soft bodies searched too that arrive within the frame: that get farther than the thickness, beside what
    /// they fall, or than a tenth of it and do not touch yet? Of a face that comes down level one point is the lowest, and its other corners
    /// would go on until the next search.
    pub struck_vertices: bool,
    /// How the lowest point of an element is searched.
    pub method: Method,
    /// One contact for each touched feature; else one for each element.
    pub one_per_feature: bool,
    /// Distance to keep from the obstacle.
    pub thickness: f64,
    /// Coulomb's coefficient.
    pub friction: f64,
    /// A contact is kept until its element has moved farther than this against the obstacle: see [`Memory`].
    pub hold: f64,
    /// Way of a contact's point within which its plane is kept where the element is searched anew: see [`Memory`].
    pub keep: f64,
    /// Most contacts of a rigid body with each obstacle, those that hold it best ([`Reduction`](sdf_core::contact::Reduction)); `None` for all.
    pub reduce: Option<usize>,
    /// Do contacts of a body's skin with a body push against the sides of both? Else along the field's normal, which leans out where two
    /// bodies stand flush. The skin is closed, its faces counterclockwise from outside.
    pub opposed: bool,
    /// How many threads search. The contacts do not depend on it.
    pub threads: Threads,
}

/// Share of the thickness: a vertex that moves farther in a frame, and is farther from touching, is searched by itself.
const STRUCK: f64 = 0.1;

impl Default for Query {
    fn default() -> Self {
        Self {
            elements: Elements::FACES,
            struck_vertices: true,
            method: Method::Auto,
            one_per_feature: true,
            thickness: 0.0,
            friction: 0.3,
            hold: 0.0,
            keep: 0.0,
            reduce: None,
            opposed: true,
            threads: Threads::ONE,
        }
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
    /// How far those that [`Query::reduce`] leaves out can sink at most, in the worst pair of body and obstacle.
    pub shortfall: f64,
    /// The deepest contact that no side of its body is opposite to.
    pub(crate) buried: Option<Contact<f64>>,
    rows: Rows,
}

impl Contacts {
    /// Forgets everything but the buffers.
    pub fn clear(&mut self) {
        self.contacts.clear();
        self.rows.clear();
        self.buried = None;
        (self.element_count, self.searched_count, self.without_normal_count, self.shortfall) = (0, 0, 0, 0.0);
    }

    /// The rows that a solver takes.
    pub fn rows(&mut self) -> &mut Rows {
        &mut self.rows
    }

    /// Adds a contact and its row.
    pub(crate) fn push(&mut self, contact: Contact<f64>, row: Row<f64>) {
        self.contacts.push(contact);
        self.rows.push(row);
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
        self.pick(&order);
    }

    /// Keeps the contacts with these indices, in this order, and their rows.
    pub(crate) fn pick(&mut self, indices: &[usize]) {
        self.contacts = indices.iter().map(|index| self.contacts[*index]).collect();
        self.rows.pick(indices);
    }
}

/// A surface and an obstacle as a search takes them.
struct Pair<'a> {
    obstacle: &'a dyn Obstacle,
    surface: &'a Surface,
    /// The obstacle's field, if that stands still in `frame`.
    still: Option<&'a Field>,
    frame: Isometry3<f64>,
    slope_bound: f64,
}

impl Query {
    /// Adds the contacts of a surface with an obstacle, and a row for each.
    ///
    /// Each element's margin is the thickness and what it moves until the next search. An obstacle that moves asks for more:
    /// [`Motion::toward`].
    pub fn find(
        &self,
        obstacle: &dyn Obstacle,
        surface: &Surface,
        world: &World,
        motion: &Motion,
        contacts: &mut Contacts,
    ) -> Result<(), QueryError> {
        self.find_again(obstacle, surface, world, motion, &mut Memory::default(), contacts)
    }

    /// [`find`](Self::find) for who asks frame after frame: elements of which the memory knows enough are not searched. The memory is
    /// that of this surface and this obstacle.
    pub fn find_again(
        &self,
        obstacle: &dyn Obstacle,
        surface: &Surface,
        world: &World,
        motion: &Motion,
        memory: &mut Memory,
        contacts: &mut Contacts,
    ) -> Result<(), QueryError> {
        self.find_guided(obstacle, surface, world, motion, memory, contacts, |_| ())
    }

    /// [`find_again`](Self::find_again), with a callback that may change the contacts before they become rows.
    #[expect(clippy::too_many_arguments, reason = "the pair, its state, and where the answer goes")]
    pub fn find_guided(
        &self,
        obstacle: &dyn Obstacle,
        surface: &Surface,
        world: &World,
        motion: &Motion,
        memory: &mut Memory,
        contacts: &mut Contacts,
        guide: impl FnOnce(&mut Vec<Contact<f64>>),
    ) -> Result<(), QueryError> {
        let (still, frame) = obstacle.still().unzip();
        if still.is_none() {
            *memory = Memory::default();
        }
        let slope_bound = still.map_or(1.0, Field::slope_bound);
        let pair = Pair { obstacle, surface, still, frame: frame.unwrap_or_default(), slope_bound };
        // A rigid surface is moved where it is searched.
        let is_rigid = matches!(surface.carrier, Carrier::Body { .. });
        let points = if is_rigid { vec![] } else { surface.points(world) };
        let found = match &surface.carrier {
            Carrier::Body { id, points: rest } => {
                let (body, reach) = (&world.bodies[*id as usize], motion.reach(surface.max_speed(world)));
                self.find_rigid(&pair, (body, rest), reach, &mut memory.rigid, contacts)
            }
            _ => self.find_soft(&pair, &points, world, motion, memory, contacts),
        };
        // The memory marks elements as searched before they are. After a search that failed, the marks are wrong.
        let mut found = found.inspect_err(|_| *memory = Memory::default())?;
        if self.one_per_feature {
            let (mut minima, others): (Vec<_>, Vec<_>) = found.into_iter().partition(|contact| contact.rank == 0);
            let count = match surface.faces.is_empty() {
                true => one_per_feature(&mut minima),
                false => FeatureOwners::from_bits(&surface.owners).one_per_feature(&mut minima),
            };
            minima.truncate(count);
            found = [minima, others].concat();
        }
        if self.opposed && obstacle.is_body() && surface.is_skin() {
            let at = |vertex: u32| match &surface.carrier {
                Carrier::Body { id, points } => world.bodies[*id as usize].rotation * V3::from(points[vertex as usize]),
                _ => points[vertex as usize].into(),
            };
            // A blow folds the faces of a soft body: where they look then tells nothing.
            let speeds = if is_rigid { vec![] } else { surface.speeds(world) };
            let fall = motion.fall_from_rest(world);
            let is_struck = |contact: &Contact<f64>| {
                let ways = contact.vertices.iter().filter_map(|vertex| speeds.get(*vertex as usize));
                ways.fold(0.0, |way: f64, speed| way.max(motion.reach(*speed) - fall)) > self.thickness
            };
            oppose(&mut found, surface, at, is_struck, &mut contacts.buried);
        }
        guide(&mut found);
        if let (Some(count), Carrier::Body { id, .. }) = (self.reduce, &surface.carrier) {
            let points = found.iter().map(|contact| contact.point.into());
            let reach = few::reach(points, &world.bodies[*id as usize], obstacle.angular_speed(), motion);
            self.keep_few(count, reach, &mut found, contacts);
        }
        let is_sheet = !surface.faces.is_empty() && !is_rigid;
        let normals = is_sheet.then(|| SheetNormals::new(surface, &points));
        for contact in found {
            match Row::from_contact(&contact, self.thickness) {
                Some(row) => {
                    let normal = normals.as_ref().map_or(row.normal, |normals| normals.direction(&contact));
                    let row = Row { normal, friction: self.friction, element: surface.side(&contact, world), ..row };
                    let row = obstacle.complete(row);
                    let is_flat = matches!(contact.feature, Feature::Face(_));
                    let rounding = Rounding::of(&row, is_flat, || {
                        memory.rigid.radius(&contact, || obstacle.radius_of_curvature(&row))
                    });
                    contacts.rows.push_round(row, rounding);
                    contacts.contacts.push(contact);
                }
                None => contacts.without_normal_count += 1,
            }
        }
        Ok(())
    }

    /// Elements that move against each other: each is searched unless its own memory tells enough.
    fn find_soft(
        &self,
        pair: &Pair,
        points: &[[f64; 3]],
        world: &World,
        motion: &Motion,
        memory: &mut Memory,
        contacts: &mut Contacts,
    ) -> Result<Vec<Contact<f64>>, QueryError> {
        let Pair { surface, frame, slope_bound, .. } = pair;
        let reaches: Vec<f64> = surface.speeds(world).iter().map(|speed| motion.reach(*speed)).collect();
        // Ways beside what falls from rest in the frame. What touches already, and rocks, keeps what is known of it.
        let fall = motion.fall_from_rest(world);
        let is_struck = |contact: &Contact<f64>| {
            let way = reaches[contact.vertices[0] as usize] - fall;
            let is_away = contact.distance > (1.0 + STRUCK) * self.thickness;
            self.thickness < way || (is_away && STRUCK * self.thickness < way)
        };
        let reach = |vertices: &[u32]| {
            self.thickness + vertices.iter().map(|vertex| reaches[*vertex as usize]).fold(0.0, f64::max)
        };
        let local: Vec<V3> = points.iter().map(|x| frame.inverse_transform_point(&(*x).into()).coords).collect();
        let mut kept = vec![];
        if self.elements.faces {
            let known = &mut memory.faces;
            let asked = known.ask(&surface.faces, &local, |face| reach(face), self.hold, *slope_bound);
            let mesh = MeshView { points, faces: &asked.elements };
            let mesh = MeshInMotion { margins: Some(&asked.margins), ..MeshInMotion::new(mesh) };
            let found = pair.obstacle.contacts_in_motion(&mesh, &self.options(sdf_field::Elements::Faces, 0.0))?;
            contacts.element_count += surface.faces.len();
            contacts.searched_count += found.searched_count;
            let again = self.look_again(pair, points, &asked.old)?;
            known.tell(&asked.ids, found.contacts, again, self.hold, frame);
            kept.extend(known.contacts());
        }
        if self.elements.edges {
            let known = &mut memory.edges;
            let asked = known.ask(&surface.edges, &local, |edge| reach(edge), self.hold, *slope_bound);
            let found = self.search_edges(pair.obstacle, points, &asked, contacts)?;
            contacts.element_count += surface.edges.len() - asked.ids.len();
            known.tell(&asked.ids, found, self.look_again(pair, points, &asked.old)?, self.hold, frame);
            kept.extend(known.contacts());
        }
        let mut found: Vec<_> = kept.into_iter().map(|kept| memory::in_world(frame, kept, points)).collect();
        let widest = reaches.iter().fold(0.0, |a: f64, b| a.max(*b));
        if self.elements.vertices || (self.struck_vertices && STRUCK * self.thickness < widest - fall) {
            let of_vertices = self.search_vertices(pair.obstacle, points, self.thickness + widest, contacts)?;
            let is_asked = |contact: &Contact<f64>| self.elements.vertices || is_struck(contact);
            found.extend(of_vertices.into_iter().filter(is_asked));
        }
        found.retain(|contact| contact.distance <= reach(contact.corner_vertices()));
        Ok(found)
    }

    /// Evaluates the field where elements touched before.
    fn look_again(&self, pair: &Pair, points: &[[f64; 3]], old: &[Contact<f64>]) -> Result<Again, QueryError> {
        let points: Vec<[f64; 3]> = old.iter().map(|contact| memory::point_on(contact, points).into()).collect();
        let options = self.options(sdf_field::Elements::Vertices, f64::INFINITY);
        let found = pair.obstacle.contacts(MeshView { points: &points, faces: &[] }, &[], &options)?;
        let mut again = Again::default();
        for now in found.contacts {
            let before = &old[now.element as usize];
            let Contact { kind, element, vertices, feature, weights, .. } = *before;
            let now = Contact { kind, element, vertices, feature, weights, ..now };
            again.add(before, memory::into_frame(&pair.frame, now), self.keep);
        }
        Ok(again)
    }

    /// Contacts of edges, numbered as they were asked.
    fn search_edges(
        &self,
        obstacle: &dyn Obstacle,
        points: &[[f64; 3]],
        asked: &Asked<2>,
        contacts: &mut Contacts,
    ) -> Result<Vec<Contact<f64>>, QueryError> {
        let widest = asked.margins.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
        let mesh = MeshView { points, faces: &[] };
        let options = self.options(sdf_field::Elements::Edges, widest);
        let mut found = obstacle.contacts(mesh, &asked.elements, &options)?;
        contacts.element_count += found.element_count;
        contacts.searched_count += found.searched_count;
        found.contacts.retain(|contact| contact.distance <= asked.margins[contact.element as usize]);
        Ok(found.contacts)
    }

    /// Contacts of points, numbered as they are.
    fn search_vertices(
        &self,
        obstacle: &dyn Obstacle,
        points: &[[f64; 3]],
        margin: f64,
        contacts: &mut Contacts,
    ) -> Result<Vec<Contact<f64>>, QueryError> {
        let mesh = MeshView { points, faces: &[] };
        let found = obstacle.contacts(mesh, &[], &self.options(sdf_field::Elements::Vertices, margin))?;
        contacts.element_count += found.element_count;
        contacts.searched_count += found.searched_count;
        Ok(found.contacts)
    }

    fn options(&self, elements: sdf_field::Elements, margin: f64) -> ContactOptions {
        ContactOptions { elements, method: self.method, margin, threads: self.threads, ..ContactOptions::default() }
    }
}
