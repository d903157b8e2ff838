//! One query in a number type that is chosen when it is made, and its answer in f64.

use nalgebra::Vector3;
use sdf_core::contact::{ContactStatus, Element, Outcome, contact};
use sdf_core::minimize::Minimizer;
use sdf_core::{Float, Simplex};

use crate::any_field::AnyField;
use crate::methods::Method;

type Point = Vector3<f64>;

/// What a query is asked in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    Single,
    Double,
}

impl Number {
    pub const BOTH: [Self; 2] = [Self::Single, Self::Double];

    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "f32",
            Self::Double => "f64",
        }
    }

    pub fn epsilon(self) -> f64 {
        match self {
            Self::Single => f64::from(f32::EPSILON),
            Self::Double => f64::EPSILON,
        }
    }

    /// The nearest number that is no less: the same, or the next one.
    pub fn round_up(self, x: f64) -> f64 {
        let nearest = x as f32;
        match self {
            Self::Single if f64::from(nearest) < x => f64::from(nearest.next_up()),
            Self::Single => f64::from(nearest),
            Self::Double => x,
        }
    }
}

/// What became of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    NotFinite,
    Culled,
    Separated,
    Contact(ContactStatus),
}

#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    pub fate: Fate,
    /// None of an element that was culled or not finite.
    pub found: Option<Found>,
}

/// The point that a search ended at.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    pub weights: Vec<f64>,
    pub point: Point,
    pub value: f64,
    pub lower_bound: f64,
    pub converged: bool,
    /// Normal and surface point, of a contact.
    pub surface: Option<[Point; 2]>,
}

impl Found {
    pub fn is_finite(&self) -> bool {
        let points = self.surface.iter().flatten().chain([&self.point]);
        // A bound may be −∞, where nothing is certain.
        points.flat_map(|point| point.iter()).chain(&self.weights).chain([&self.value]).all(|x| x.is_finite())
            && !self.lower_bound.is_nan()
    }
}

/// The contact of the element with these corners, one to three. With a margin of infinity it is one at its least value.
pub fn ask(field: &AnyField, method: &Method, margin: f64, corners: &[Point], number: Number) -> Answer {
    match (number, corners) {
        (Number::Single, &[a]) => of_type::<f32, 1>(field, method, margin, [a]),
        (Number::Single, &[a, b]) => of_type::<f32, 2>(field, method, margin, [a, b]),
        (Number::Single, &[a, b, c]) => of_type::<f32, 3>(field, method, margin, [a, b, c]),
        (Number::Double, &[a]) => of_type::<f64, 1>(field, method, margin, [a]),
        (Number::Double, &[a, b]) => of_type::<f64, 2>(field, method, margin, [a, b]),
        (Number::Double, &[a, b, c]) => of_type::<f64, 3>(field, method, margin, [a, b, c]),
        _ => panic!("an element has one to three corners, not {}", corners.len()),
    }
}

fn of_type<R: Float, const N: usize>(field: &AnyField, method: &Method, margin: f64, corners: [Point; N]) -> Answer
where
    Method: Minimizer<N>,
{
    let simplex = Simplex { corners: corners.map(|corner| corner.map(R::from_f64)) };
    let element = Element { id: 0, vertices: std::array::from_fn(|corner| corner as u32), simplex };
    let to_f64 = |point: Vector3<R>| point.map(R::to_f64);
    match contact(field, method, R::from_f64(margin), &element) {
        Outcome::NotFinite => Answer { fate: Fate::NotFinite, found: None },
        Outcome::Culled => Answer { fate: Fate::Culled, found: None },
        Outcome::Separated(minimum) => Answer {
            fate: Fate::Separated,
            found: Some(Found {
                weights: minimum.weights.map(R::to_f64).to_vec(),
                point: to_f64(minimum.point),
                value: minimum.sample.value.to_f64(),
                lower_bound: minimum.lower_bound.to_f64(),
                converged: minimum.converged,
                surface: None,
            }),
        },
        Outcome::Contact(contact) => Answer {
            fate: Fate::Contact(contact.status),
            found: Some(Found {
                weights: contact.weights.map(R::to_f64).to_vec(),
                point: to_f64(contact.point),
                value: contact.distance.to_f64(),
                lower_bound: contact.lower_bound.to_f64(),
                // What the minimizer says stands behind the other doubts of the status.
                converged: method.minimize(field, &simplex).converged,
                surface: Some([to_f64(contact.normal), to_f64(contact.surface_point)]),
            }),
        },
    }
}
