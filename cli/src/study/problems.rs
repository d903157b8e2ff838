use sdf_core::minimize::{Certified, Minimizer};
use sdf_core::nalgebra::Vector3;
use sdf_core::shapes::Cone;
use sdf_core::{Aabb, Sdf, Simplex};
use sdf_formats::field_file::Node;

use super::curves::SHALLOW;
use super::random::Random;
use super::reference::Reference;

/// Elements, and the field that each is held against.
pub struct ProblemSet<const N: usize> {
    pub name: &'static str,
    /// What is in it, in a few words.
    pub about: &'static str,
    pub fields: Vec<Node>,
    /// How many elements were drawn to have the problems.
    pub drawn: usize,
    pub problems: Vec<Problem<N>>,
}

pub struct Problem<const N: usize> {
    /// Which of the fields.
    pub field: usize,
    pub simplex: Simplex<f64, N>,
    pub longest_edge: f64,
}

/// Where elements are put.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Where {
    /// In the plane z = 0.
    Plane,
    Space,
}

impl<const N: usize> ProblemSet<N> {
    /// Elements whose middle is anywhere in a body's box or around it. They fit a cube whose side is between a twentieth of
    /// the box and all of it, its logarithm evenly. Those whose least value is at a corner, where every method looks first, are
    /// no problems. Each of the fields is drawn as often.
    pub fn random(name: &'static str, about: &'static str, fields: Vec<Node>, count: usize, place: Where) -> Self {
        let mut random = Random::new(&format!("{name} {N}"));
        let boxes: Vec<Aabb> = fields.iter().map(|field| outline(field, place)).collect();
        let (mut drawn, mut problems) = (0, vec![]);
        while problems.len() < count {
            let field = drawn % fields.len();
            let size = boxes[field].longest_side();
            let simplex = element(&mut random, &boxes[field].inflate(AROUND * size), size, place);
            drawn += 1;
            if !is_lowest_at_a_corner(&fields[field], &simplex) {
                problems.push(Problem { field, longest_edge: simplex.longest_edge(), simplex });
            }
        }
        Self { name, about, fields, drawn, problems }
    }
}

/// Whether corners alone would not miss a contact, as far as a short branch and bound tells.
fn is_lowest_at_a_corner<const N: usize>(field: &Node, simplex: &Simplex<f64, N>) -> bool
where
    Certified: Minimizer<N>,
{
    let search = Certified { evaluations: 64, ..Certified::default() };
    let lowest_corner = simplex.corners.iter().map(|corner| field.value(*corner)).fold(f64::INFINITY, f64::min);
    let found = search.minimize(field, simplex).sample.value;
    lowest_corner - found <= SHALLOW * simplex.longest_edge()
}

/// How far beyond a body's box the middles of elements lie, in its longest side.
const AROUND: f64 = 0.15;

fn outline(field: &Node, place: Where) -> Aabb {
    let mut bounds = field.bounds(0.0);
    if place == Where::Plane {
        (bounds.min[2], bounds.max[2]) = (0.0, 0.0);
    }
    bounds
}

fn element<const N: usize>(random: &mut Random, bounds: &Aabb, size: f64, place: Where) -> Simplex<f64, N> {
    let middle = Vector3::from_fn(|axis, _| random.between(bounds.min[axis], bounds.max[axis]));
    let half = 0.5 * size * 20.0_f64.powf(random.between(-1.0, 0.0));
    let corners = [(); N].map(|()| {
        let corner = middle + Vector3::from_fn(|_, _| random.between(-half, half));
        if place == Where::Plane { Vector3::new(corner.x, corner.y, 0.0) } else { corner }
    });
    Simplex { corners }
}

/// Triangles that the apex of a cone pierces, by at most a hundredth of the box that they are from: the deepest point is on
/// the cone's axis, and its depth is known. Cones have half angles of 2 to 30 degrees.
pub fn apexes(count: usize) -> (ProblemSet<3>, Vec<Reference>) {
    let mut random = Random::new("apexes");
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
        let deepest = -depth * angle.sin();
        problems.push(Problem { field: fields.len(), longest_edge: simplex.longest_edge(), simplex });
        references.push(Reference { lower_bound: deepest, value: deepest, converged: true });
        fields.push(Node::Cone(cone));
    }
    let about = "triangles pierced by the apex of a cone of 2 to 30 degrees";
    (ProblemSet { name: "apexes", about, fields, drawn: count, problems }, references)
}
