//! Random elements, each posed on a field.

use sdf_core::AnyField;
use sdf_core::minimize::{Certified, Minimizer};
use sdf_core::nalgebra::Vector3;
use sdf_core::shapes::Cone;
use sdf_core::{Aabb, Sdf, Simplex};

use super::random::NamedRandom;
use super::reference::Reference;

/// Depth of a contact, in longest edges, at which a method is tested for missing it.
///
/// Each element has a margin of its own, at this distance above its minimum. With one margin for all, nearly every contact
/// would be deep, and no method would miss any.
pub const MISS_DEPTH: f64 = 1e-3;

/// Elements and their fields.
pub struct ProblemSet<const N: usize> {
    pub name: &'static str,
    pub about: &'static str,
    pub fields: Vec<AnyField>,
    /// Number of elements drawn, rejected ones included.
    pub drawn: usize,
    pub problems: Vec<Problem<N>>,
}

pub struct Problem<const N: usize> {
    /// Index of the field.
    pub field: usize,
    pub simplex: Simplex<f64, N>,
    pub longest_edge: f64,
}

/// Region of the elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Domain {
    /// The plane z = 0.
    Plane,
    Space,
}

impl<const N: usize> ProblemSet<N> {
    /// Elements in a body's box or around it. Each fits a cube whose side is between 1/20 of the box and the whole box, its
    /// logarithm distributed evenly. Each field gets as many draws. Elements with the minimum at a corner are rejected:
    /// the minimizers evaluate the corners first.
    pub fn random(
        name: &'static str,
        about: &'static str,
        fields: Vec<AnyField>,
        count: usize,
        domain: Domain,
    ) -> Self {
        let mut random = NamedRandom::new(&format!("{name} {N}"));
        let boxes: Vec<Aabb> = fields.iter().map(|field| body_box(field, domain)).collect();
        let (mut drawn, mut problems) = (0, vec![]);
        while problems.len() < count {
            let field = drawn % fields.len();
            let size = boxes[field].longest_side();
            let simplex = random_element(&mut random, &boxes[field].inflate(OUTSIDE * size), size, domain);
            drawn += 1;
            if !is_lowest_at_a_corner(&fields[field], &simplex) {
                problems.push(Problem { field, longest_edge: simplex.longest_edge(), simplex });
            }
        }
        Self { name, about, fields, drawn, problems }
    }
}

/// Is the minimum within [`MISS_DEPTH`] of the lowest corner, as far as a short branch and bound tells?
fn is_lowest_at_a_corner<const N: usize>(field: &AnyField, simplex: &Simplex<f64, N>) -> bool
where
    Certified: Minimizer<N>,
{
    let search = Certified { evaluations: 64, ..Certified::default() };
    let lowest_corner = simplex.corners.iter().map(|corner| field.value(*corner)).fold(f64::INFINITY, f64::min);
    let minimum = search.minimize(field, simplex).sample.value;
    lowest_corner - minimum <= MISS_DEPTH * simplex.longest_edge()
}

/// Largest distance of an element's center from the body's box, in its longest sides.
const OUTSIDE: f64 = 0.15;

fn body_box(field: &AnyField, domain: Domain) -> Aabb {
    let mut bounds = field.bounds(0.0);
    if domain == Domain::Plane {
        (bounds.min[2], bounds.max[2]) = (0.0, 0.0);
    }
    bounds
}

fn random_element<const N: usize>(
    random: &mut NamedRandom,
    bounds: &Aabb,
    size: f64,
    domain: Domain,
) -> Simplex<f64, N> {
    let center = Vector3::from_fn(|axis, _| random.between(bounds.min[axis], bounds.max[axis]));
    let half = 0.5 * size * 20.0_f64.powf(random.between(-1.0, 0.0));
    let corners = [(); N].map(|()| {
        let corner = center + Vector3::from_fn(|_, _| random.between(-half, half));
        if domain == Domain::Plane { Vector3::new(corner.x, corner.y, 0.0) } else { corner }
    });
    Simplex { corners }
}

/// Triangles pierced by the apex of a cone of 2 to 30 degrees half angle, 1e-4 to 1e-2 deep. The minimum lies on the cone's
/// axis, and its value −depth · sin(angle) is known.
pub fn apexes(count: usize) -> (ProblemSet<3>, Vec<Reference>) {
    let mut random = NamedRandom::new("apexes");
    let (mut fields, mut problems, mut references) = (vec![], vec![], vec![]);
    while problems.len() < count {
        let angle = random.between(2.0, 30.0).to_radians();
        let depth = 10.0_f64.powf(random.between(-4.0, -2.0));
        let weights = [(); 3].map(|()| random.between(0.05, 1.05));
        let sum: f64 = weights.iter().sum();
        let corners = [(); 3].map(|()| Vector3::new(random.between(-0.5, 0.5), random.between(-0.5, 0.5), 0.0));
        let pierced = Simplex { corners }.point(weights.map(|weight| weight / sum));
        let simplex = Simplex { corners: corners.map(|corner| corner - pierced - Vector3::z() * depth) };
        let Some(cone) = Cone::new(angle, 2.0) else { continue };
        let minimum = -depth * angle.sin();
        problems.push(Problem { field: fields.len(), longest_edge: simplex.longest_edge(), simplex });
        references.push(Reference { lower_bound: minimum, value: minimum, converged: true });
        fields.push(AnyField::Cone(cone));
    }
    let about = "triangles pierced by the apex of a cone of 2 to 30 degrees";
    (ProblemSet { name: "apexes", about, fields, drawn: count, problems }, references)
}
