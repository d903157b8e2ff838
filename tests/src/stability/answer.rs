//! One query in a number type chosen at run time, and its answer in f64.

use nalgebra::Vector3;
use sdf_core::contact::{ContactStatus, Outcome, contact};
use sdf_core::minimize::Minimizer;
use sdf_core::{Float, Simplex};

use crate::methods::Method;
use crate::oracle::element;
use crate::scene_field::SceneField;

type Point = Vector3<f64>;

/// The number type of a query.
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

    /// The smallest number of the type that is at least `x`.
    pub fn round_up(self, x: f64) -> f64 {
        let nearest = x as f32;
        match self {
            Self::Single if f64::from(nearest) < x => f64::from(nearest.next_up()),
            Self::Single => f64::from(nearest),
            Self::Double => x,
        }
    }
}

/// The outcome of a query.
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
    /// `None` for an element that was culled or is not finite.
    pub minimum: Option<FoundMinimum>,
}

/// The point that a search ended at, and the bounds that came with it.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundMinimum {
    pub weights: Vec<f64>,
    pub point: Point,
    pub value: f64,
    pub lower_bound: f64,
    pub converged: bool,
    /// Normal and surface point of a contact.
    pub surface: Option<[Point; 2]>,
}

impl FoundMinimum {
    pub fn is_finite(&self) -> bool {
        let points = self.surface.iter().flatten().chain([&self.point]);
        // A lower bound of −∞ is valid: nothing is certain then.
        points.flat_map(|point| point.iter()).chain(&self.weights).chain([&self.value]).all(|x| x.is_finite())
            && !self.lower_bound.is_nan()
    }
}

/// The contact of the element with these corners, one to three. An infinite margin makes every element a contact at its
/// minimum.
pub fn query(field: &SceneField, method: &Method, margin: f64, corners: &[Point], number: Number) -> Answer {
    match (number, corners) {
        (Number::Single, &[a]) => query_in::<f32, 1>(field, method, margin, [a]),
        (Number::Single, &[a, b]) => query_in::<f32, 2>(field, method, margin, [a, b]),
        (Number::Single, &[a, b, c]) => query_in::<f32, 3>(field, method, margin, [a, b, c]),
        (Number::Double, &[a]) => query_in::<f64, 1>(field, method, margin, [a]),
        (Number::Double, &[a, b]) => query_in::<f64, 2>(field, method, margin, [a, b]),
        (Number::Double, &[a, b, c]) => query_in::<f64, 3>(field, method, margin, [a, b, c]),
        _ => panic!("an element has one to three corners, not {}", corners.len()),
    }
}

fn query_in<R: Float, const N: usize>(field: &SceneField, method: &Method, margin: f64, corners: [Point; N]) -> Answer
where
    Method: Minimizer<N>,
{
    let simplex = Simplex { corners: corners.map(|corner| corner.map(R::from_f64)) };
    let element = element(0, simplex);
    let to_f64 = |point: Vector3<R>| point.map(R::to_f64);
    match contact(field, method, R::from_f64(margin), &element) {
        Outcome::NotFinite => Answer { fate: Fate::NotFinite, minimum: None },
        Outcome::Culled => Answer { fate: Fate::Culled, minimum: None },
        Outcome::Separated(minimum) => Answer {
            fate: Fate::Separated,
            minimum: Some(FoundMinimum {
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
            minimum: Some(FoundMinimum {
                weights: contact.weights.map(R::to_f64).to_vec(),
                point: to_f64(contact.point),
                value: contact.distance.to_f64(),
                lower_bound: contact.lower_bound.to_f64(),
                // The status reports other problems first, so it can hide whether the minimizer converged.
                converged: match contact.status {
                    ContactStatus::Converged => true,
                    ContactStatus::BudgetSpent => false,
                    _ => method.minimize(field, &simplex).converged,
                },
                surface: Some([to_f64(contact.normal), to_f64(contact.surface_point)]),
            }),
        },
    }
}
