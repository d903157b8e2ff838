//! When does a mesh that moves first touch a field that stands still or moves? [`Field::first_touches`]: all elements, on all threads.

use std::sync::atomic::{AtomicBool, Ordering};

use sdf_core::contact::{Contact, ContactStatus, FirstTouch, MovingElement, Touch, contact_at};
use sdf_core::minimize::{Certified, Minimizer};
use sdf_core::moving::{MovingSdf, RigidMotion, Travelling};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Posed, Rigid};
use sdf_core::{Aabb, Real};

use crate::mesh_view::check;
use crate::not_finite::is_valid;
use crate::{Elements, Field, MeshView, QueryError, Threads};

/// A mesh whose vertices move in straight lines from the time 0 to 1.
#[derive(Clone, Copy, Debug)]
pub struct MeshPath<'a> {
    /// The mesh at the time 0.
    pub start: MeshView<'a>,
    /// Its vertices at the time 1.
    pub end: &'a [[f64; 3]],
}

/// Which elements are watched, and how closely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstTouchOptions {
    /// Faces, edges or vertices.
    pub elements: Elements,
    /// Elements touch where φ ≤ thickness: a length in the unit of the mesh.
    pub thickness: f64,
    /// Where the field stands in the mesh's frame at the time 0; `None` where it is already there.
    pub pose: Option<Rigid>,
    /// Where it stands at the time 1; in between it moves at constant velocity and spin, by the shorter way around. `None` where it stands still.
    pub end_pose: Option<Rigid>,
    /// A length: φ ≤ thickness + tolerance at the times that are found. `None` stands for 10⁻⁴ of the longest side of the box around
    /// the elements at both times.
    pub tolerance: Option<f64>,
    /// Evaluations of the field per element.
    pub budget: u32,
    /// How many threads work.
    pub threads: Threads,
}

impl Default for FirstTouchOptions {
    fn default() -> Self {
        Self {
            elements: Elements::Faces,
            thickness: 0.0,
            pose: None,
            end_pose: None,
            tolerance: None,
            budget: FirstTouch::default().evaluations,
            threads: Threads::ALL,
        }
    }
}

/// A contact at its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedContact {
    /// From 0 to 1. The element has φ > thickness at all earlier times.
    pub time: f64,
    /// The lowest point at that time, in the mesh's frame.
    pub contact: Contact<f64>,
}

/// First touches of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FirstTouches {
    /// In the order of the elements, at most one for each: those that touch, and those whose budget was spent. Of these,
    /// [`BudgetSpent`](ContactStatus::BudgetSpent) and farther than thickness + tolerance, the time is the last one up to which
    /// nothing touches.
    pub touches: Vec<TimedContact>,
    /// All elements.
    pub element_count: usize,
    /// Elements among `touches` whose budget was spent.
    pub undecided_count: usize,
    /// Elements that were skipped: a coordinate, or an answer of the field, is NaN or infinite or too large.
    pub not_finite_count: usize,
}

/// Elements that one thread searches at a time: a few may take as long as all others.
const CHUNK: usize = 32;

/// The tolerance as a fraction of the box around the mesh's way.
const TOLERANCE: f64 = 1e-4;

impl Field {
    /// For each element of a moving mesh the first time at which some point of it has φ ≤ thickness, and the contact at that time
    /// ([`FirstTouch`]). No time is late; it is early only in that φ is at most thickness + tolerance there.
    ///
    /// The thickness is one of the field's margins: ask [`Field::check_margin`].
    ///
    /// # Errors
    /// A vertex that is not there, other vertices at the time 1 than at 0, a thickness that is not finite, or a tolerance that is not positive.
    pub fn first_touches(&self, path: &MeshPath, options: &FirstTouchOptions) -> Result<FirstTouches, QueryError> {
        self.first_touches_cancellable(path, options, &AtomicBool::new(false))
    }

    /// [`first_touches`](Self::first_touches), until another thread sets `cancel`. Then the elements that are left are skipped, and the
    /// result is [`QueryError::Cancelled`].
    pub fn first_touches_cancellable(
        &self,
        path: &MeshPath,
        options: &FirstTouchOptions,
        cancel: &AtomicBool,
    ) -> Result<FirstTouches, QueryError> {
        let MeshPath { start: mesh, end } = *path;
        if mesh.points.len() != end.len() {
            return Err(QueryError::VertexCountDiffers);
        }
        let is_positive = |tolerance: f64| tolerance > 0.0 && tolerance.is_finite();
        if !options.tolerance.is_none_or(is_positive) {
            return Err(QueryError::ToleranceOutOfRange);
        }
        let is_length = options.thickness.abs() <= f64::MAX_COORDINATE;
        if !is_length {
            return Err(QueryError::ThicknessOutOfRange);
        }
        let search = Search {
            path,
            thickness: options.thickness,
            tolerance: options.tolerance,
            budget: options.budget,
            threads: options.threads,
            cancel,
        };
        let field = self.as_any();
        let FirstTouchOptions { elements, pose, end_pose, .. } = *options;
        match end_pose {
            None => search.by_kind(&Posed { field, pose }, elements),
            Some(end) => {
                let start = pose.or_else(|| Rigid::new([0.0; 3], [0.0, 0.0, 0.0, 1.0])).unwrap_or(end);
                search.by_kind(&Travelling { field, motion: RigidMotion::between(start, end) }, elements)
            }
        }
    }
}

/// Fraction of the box around the vertices that elements name and that can touch.
fn default_tolerance<const N: usize>(path: &MeshPath, elements: &[[u32; N]]) -> f64 {
    let points = elements
        .iter()
        .flatten()
        .flat_map(|vertex| [path.start.points, path.end].map(|points| points[*vertex as usize]));
    Aabb::from_points(points.filter(is_valid)).map_or(0.0, |bounds| TOLERANCE * bounds.longest_side())
}

struct Search<'a> {
    path: &'a MeshPath<'a>,
    thickness: f64,
    tolerance: Option<f64>,
    budget: u32,
    threads: Threads,
    cancel: &'a AtomicBool,
}

impl Search<'_> {
    fn by_kind<M: MovingSdf + Sync>(&self, field: &M, elements: Elements) -> Result<FirstTouches, QueryError> {
        let mesh = self.path.start;
        match elements {
            Elements::Faces => self.find(field, mesh.faces),
            Elements::Edges => self.find(field, &mesh.edges()),
            Elements::Vertices => self.find(field, &mesh.vertices()),
        }
    }

    fn find<M: MovingSdf + Sync, const N: usize>(
        &self,
        field: &M,
        elements: &[[u32; N]],
    ) -> Result<FirstTouches, QueryError> {
        check(self.path.end, elements).map_err(QueryError::VertexOutOfRange)?;
        let tolerance = self.tolerance.unwrap_or_else(|| default_tolerance(self.path, elements));
        let search = FirstTouch { tolerance, evaluations: self.budget };
        let chunks = self.threads.map_chunks(elements, CHUNK, |first, chunk: &[[u32; N]]| {
            let mut found = FirstTouches::default();
            let left = (first..).zip(chunk).take_while(|_| !self.cancel.load(Ordering::Relaxed));
            left.for_each(|(id, vertices)| found.add(self.touch(&search, field, id as u32, *vertices)));
            found
        });
        if self.cancel.load(Ordering::Relaxed) {
            return Err(QueryError::Cancelled);
        }
        let mut all = FirstTouches { element_count: elements.len(), ..FirstTouches::default() };
        for chunk in chunks {
            all.touches.extend(chunk.touches);
            all.undecided_count += chunk.undecided_count;
            all.not_finite_count += chunk.not_finite_count;
        }
        Ok(all)
    }

    fn touch<M: MovingSdf, const N: usize>(
        &self,
        search: &FirstTouch,
        field: &M,
        id: u32,
        vertices: [u32; N],
    ) -> Outcome {
        let corner = |points: &[[f64; 3]], vertex: u32| Vector3::from(points[vertex as usize]);
        let path = vertices.map(|vertex| [corner(self.path.start.points, vertex), corner(self.path.end, vertex)]);
        let moving = MovingElement { id, vertices, path };
        let (time, minimum, is_open) = match search.first_touch(field, self.thickness, &moving) {
            Touch::NotFinite => return Outcome::NotFinite,
            Touch::Never => return Outcome::Never,
            Touch::At { time, minimum } => (time, minimum, false),
            Touch::BudgetSpent { time } => {
                let evaluations = Certified::default().evaluations.min(self.budget);
                let lowest = Certified { evaluations, ..Certified::default() };
                (time, lowest.minimize(&field.at(time), &moving.at(time).simplex), true)
            }
        };
        match contact_at(&field.at(time), &moving.at(time), &minimum, f64::NEG_INFINITY) {
            None => Outcome::NotFinite,
            Some(contact) if is_open => {
                Outcome::Open(TimedContact { time, contact: Contact { status: ContactStatus::BudgetSpent, ..contact } })
            }
            Some(contact) => Outcome::Touch(TimedContact { time, contact }),
        }
    }
}

enum Outcome {
    NotFinite,
    Never,
    Touch(TimedContact),
    Open(TimedContact),
}

impl FirstTouches {
    fn add(&mut self, outcome: Outcome) {
        match outcome {
            Outcome::Never => {}
            Outcome::NotFinite => self.not_finite_count += 1,
            Outcome::Touch(touch) => self.touches.push(touch),
            Outcome::Open(touch) => {
                self.touches.push(touch);
                self.undecided_count += 1;
            }
        }
    }
}
