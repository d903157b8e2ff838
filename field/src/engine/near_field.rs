//! The part of a closed form that counts on a few elements: nothing where all are beyond their margins, else of a union the parts that
//! can be the lowest there.
//!
//! A run of elements that follow each other in the mesh is looked at first, then each of its pieces. A run is granted more rounding
//! than an element, so that what is left for an element is the same in any run, and by itself.

use sdf_core::combine::Compound;
use sdf_core::contact::{Contact, Element, with_error};
use sdf_core::delegate_sdf;
use sdf_core::minimize::Minimum;
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::Posed;
use sdf_core::{AnyField, Sdf, Simplex};

/// Runs that a run is cut into.
const PIECES: usize = 4;

/// Points of a run that are evaluated in the same parts, and of one that is looked at first: few enough that a look at each part costs
/// little beside them.
const POINTS: [usize; 2] = [8, 64];

/// Width that is added to a run's ball, as a fraction of all coordinates: some thousand roundings.
const ROUNDING: f64 = 1e-12;

/// A field, or what counts of it.
pub(crate) enum NearField<'a> {
    Whole(&'a AnyField),
    /// Parts of a union.
    Parts(Compound<Vec<&'a AnyField>>),
}

delegate_sdf!(NearField<'a> { Whole, Parts } unions { Whole, Parts });

impl NearField<'_> {
    fn part_count(&self) -> usize {
        match self {
            Self::Whole(_) => 1,
            Self::Parts(union) => union.parts().len(),
        }
    }
}

/// All of a field.
pub(super) fn all_of(field: &AnyField) -> NearField<'_> {
    match field {
        AnyField::Union(union) if union.parts().len() > 1 => NearField::Parts(union.by_reference()),
        _ => NearField::Whole(field),
    }
}

/// Visits each element that may be within its margin, and maybe some others, in their order, with what counts of the field there.
pub(super) fn visit_near<'a, const N: usize>(
    field: &Posed<NearField<'a>>,
    elements: &[Element<f64, N>],
    margin: impl Fn(usize) -> f64,
    visit: impl FnMut(usize, &Posed<NearField<'a>>),
) {
    if !elements.is_empty() {
        Visit { margin, visit, magnitude: field.magnitude() }.run(field, 0, elements);
    }
}

/// The result of each point, in their order, by what counts of the field there.
pub(crate) fn map_points<T>(
    field: &AnyField,
    points: &[[f64; 3]],
    map: impl Fn(&NearField, Vector3<f64>) -> T,
) -> Vec<T> {
    let all = Posed { field: all_of(field), pose: None };
    let (magnitude, mut mapped) = (all.magnitude(), Vec::with_capacity(points.len()));
    let [few, many] = POINTS;
    for run in points.chunks(many) {
        let near = parts_near(&all, || Ball::around_points(run, magnitude));
        let near = near.as_ref().unwrap_or(&all);
        let mut is_worth = true;
        for piece in run.chunks(few) {
            let nearer = if is_worth { parts_near(near, || Ball::around_points(piece, magnitude)) } else { None };
            is_worth = nearer.as_ref().is_some_and(|nearer| 2 * nearer.field.part_count() < near.field.part_count());
            let parts = &nearer.as_ref().unwrap_or(near).field;
            mapped.extend(piece.iter().map(|point| map(parts, Vector3::from(*point))));
        }
    }
    mapped
}

struct Visit<M, V> {
    /// The margin of the element with an index.
    margin: M,
    visit: V,
    /// The field's magnitude.
    magnitude: f64,
}

impl<'a, M: Fn(usize) -> f64, V: FnMut(usize, &Posed<NearField<'a>>)> Visit<M, V> {
    /// Visits a run of one element or more, of which the first has the index `first`.
    fn run<const N: usize>(&mut self, field: &Posed<NearField<'a>>, first: usize, run: &[Element<f64, N>]) {
        if let [element] = run {
            let near = parts_near(field, || Ball::of(element));
            return (self.visit)(first, near.as_ref().unwrap_or(field));
        }
        let ball = Ball::around(run, self.magnitude);
        let highest_margin = (first..).take(run.len()).map(&self.margin).fold(f64::NEG_INFINITY, f64::max);
        if ball.is_some_and(|ball| ball.lowest(field) > highest_margin) {
            return;
        }
        let near = parts_near(field, || ball);
        let length = run.len().div_ceil(PIECES);
        for (piece, first) in run.chunks(length).zip((first..).step_by(length)) {
            self.run(near.as_ref().unwrap_or(field), first, piece);
        }
    }
}

/// A contact with what counts of a field, `near`, with the error of all of it: a part that is higher may have a larger error, and its
/// body be nearer.
pub(super) fn with_error_of_all<const N: usize>(
    all: &Posed<&AnyField>,
    near: &Posed<NearField>,
    element: &Element<f64, N>,
    minimum: &Minimum<f64, N>,
    contact: Contact<f64>,
) -> Contact<f64> {
    match near.field {
        NearField::Whole(_) => contact,
        NearField::Parts(_) => with_error(all, element, minimum, contact),
    }
}

/// The parts of a union that can be the lowest in a ball; `None` where all that is left of the field is needed.
fn parts_near<'a>(field: &Posed<NearField<'a>>, ball: impl FnOnce() -> Option<Ball>) -> Option<Posed<NearField<'a>>> {
    match &field.field {
        NearField::Parts(union) if union.parts().len() > 1 => {
            let Ball { center, radius } = ball()?;
            let (center, radius) = field.pull_ball(center, radius);
            Some(Posed { field: NearField::Parts(union.near(center, radius)), pose: field.pose })
        }
        _ => None,
    }
}

#[derive(Clone, Copy)]
struct Ball {
    center: Vector3<f64>,
    radius: f64,
}

impl Ball {
    /// A ball around an element; `None` where a corner cannot be computed with.
    fn of<const N: usize>(element: &Element<f64, N>) -> Option<Self> {
        let center = element.simplex.centroid();
        element.simplex.is_representable().then(|| Self { center, radius: element.simplex.max_distance_from(center) })
    }

    /// A ball around the balls of some elements in a field of this magnitude, with room for rounding.
    fn around<const N: usize>(run: &[Element<f64, N>], magnitude: f64) -> Option<Self> {
        let balls: Vec<_> = run.iter().map(Self::of).collect::<Option<_>>()?;
        let centers = balls.iter().map(|ball| ball.center);
        let lowest = centers.clone().reduce(|a, b| a.inf(&b))?;
        let highest = centers.reduce(|a, b| a.sup(&b))?;
        let center = lowest + 0.5 * (highest - lowest);
        let radius = balls.iter().map(|ball| (ball.center - center).norm() + ball.radius).fold(0.0, f64::max);
        let largest = lowest.amax().max(highest.amax()).max(radius).max(magnitude);
        Some(Self { center, radius: radius + ROUNDING * largest })
    }

    /// A ball around points, as [`around`](Self::around).
    fn around_points(points: &[[f64; 3]], magnitude: f64) -> Option<Self> {
        let of_point =
            |point: &[f64; 3]| Element { id: 0, vertices: [0], simplex: Simplex { corners: [Vector3::from(*point)] } };
        Self::around(&points.iter().map(of_point).collect::<Vec<_>>(), magnitude)
    }

    /// Lower bound of φ in a ball with room for rounding.
    fn lowest<F: Sdf>(&self, field: &F) -> f64 {
        let (value, reach) = (field.value(self.center), self.radius * field.slope_bound());
        value - reach - ROUNDING * (value.abs() + reach)
    }
}
