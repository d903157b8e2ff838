//! Which way does a body push another beside an edge of both? Against the sides of both.
//!
//! Where a closed surface comes nearest to a field, the field's normal n is opposite to one of the surface: −n lies in the cone of the normals
//! m of the faces that meet there. An element alone comes nearest elsewhere, too: a side face at its lower rim, and a vertex that is asked
//! for itself. Where two bodies stand flush, n at such points leans out by up to 90°, and the upper body walks off. So a contact pushes along
//!
//! ```text
//! −n′ = the point of { Σ λ m, λ ≥ 0 } that is nearest to −n,    m: the face's, or those of all faces around the edge or vertex
//! ```
//!
//! and where that is farther than 60° from n, the surface comes no nearer there, and the contact makes no row. Where a blow folds a soft body,
//! its sides tell nothing, and contacts stay as they are.

use sdf_core::contact::{Contact, Feature};

use crate::V3;
use crate::surface::Surface;

/// cos 60°.
const LEAST: f64 = 0.5;

/// Rounds over the faces around a feature: two faces at right angles take one, a fan of nearly parallel ones some more.
const ROUNDS: usize = 30;

/// Turns contacts of a closed surface against its sides, and drops those that no side is opposite to, the deepest into `buried`. `at` tells
/// where a vertex is; contacts of which `is_struck` says so stay as they are.
pub(crate) fn oppose(
    contacts: &mut Vec<Contact<f64>>,
    surface: &Surface,
    at: impl Fn(u32) -> V3,
    is_struck: impl Fn(&Contact<f64>) -> bool,
    buried: &mut Option<Contact<f64>>,
) {
    contacts.retain_mut(|contact| {
        // Without a normal it makes no row, and is counted where rows are made.
        if contact.normal == V3::zeros() || is_struck(contact) {
            return true;
        }
        let Some(normal) = opposed(contact, &contact.normal, surface, &at) else {
            if buried.is_none_or(|other| contact.distance < other.distance) {
                *buried = Some(*contact);
            }
            return false;
        };
        let distance = normal.dot(&(contact.point - contact.surface_point));
        *contact = Contact { normal, distance, ..*contact };
        true
    });
}

/// The direction in which a contact of a closed surface pushes, `normal` in the direction of the field; `None` where no side of the surface is
/// opposite. `at` tells where a vertex is.
fn opposed(contact: &Contact<f64>, normal: &V3, surface: &Surface, at: impl Fn(u32) -> V3) -> Option<V3> {
    let around = |vertex: u32| surface.faces_around(vertex).iter().map(|face| surface.faces[*face as usize]);
    let faces: Vec<[u32; 3]> = match contact.feature {
        Feature::Face(_) => vec![contact.vertices],
        Feature::Edge([a, b]) => around(a).filter(|face| face.contains(&b)).collect(),
        Feature::Vertex(vertex) => around(vertex).collect(),
    };
    let across = |face: &[u32; 3]| {
        let [a, b, c] = face.map(&at);
        (b - a).cross(&(c - a)).try_normalize(f64::MIN_POSITIVE)
    };
    let sides: Vec<V3> = faces.iter().filter_map(across).collect();
    let mut shares = vec![0.0; sides.len()];
    // What −n lacks of the sum: coordinate descent on its square.
    let mut lack = -normal;
    for _ in 0..ROUNDS {
        for (side, share) in sides.iter().zip(&mut shares) {
            let next = f64::max(*share + side.dot(&lack), 0.0);
            lack -= side * (next - *share);
            *share = next;
        }
    }
    let opposite = normal + lack;
    (opposite.norm() >= LEAST).then(|| opposite.normalize())
}

#[cfg(test)]
mod tests {
    use sdf_core::Simplex;
    use sdf_core::contact::{self, Element, Outcome};
    use sdf_core::minimize::FrankWolfe;
    use sdf_core::shapes::HalfSpace;

    use super::*;
    use crate::surface::Carrier;

    /// A corner of a box at the origin, which lies on the side of x, y < 0 and z > 0.
    const POINTS: [[f64; 3]; 4] = [[0.0; 3], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
    const FACES: [[u32; 3]; 3] = [[0, 2, 1], [0, 3, 2], [0, 1, 3]];

    fn at(vertex: u32) -> V3 {
        POINTS[vertex as usize].into()
    }

    fn direction(feature: Feature, normal: V3) -> Option<V3> {
        let floor = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
        let element = Element { id: 0, vertices: FACES[0], simplex: Simplex { corners: FACES[0].map(at) } };
        let Outcome::Contact(found) = contact::contact(&floor, &FrankWolfe::default(), 1.0, &element) else { panic!() };
        let surface = Surface::of_faces(FACES.to_vec(), 4, Carrier::Tets(vec![]));
        opposed(&Contact { feature, ..found }, &normal, &surface, at)
    }

    #[test]
    fn a_contact_pushes_against_the_sides_of_the_surface() {
        let close =
            |found: Option<V3>, wanted: V3| assert!((found.unwrap() - wanted).norm() < 1e-12, "{found:?}, {wanted}");
        let (up, lean) = (V3::z(), V3::new(0.6, 0.0, 0.8));
        for feature in [Feature::Vertex(0), Feature::Edge([0, 2]), Feature::Face(0)] {
            close(direction(feature, up), up);
            // The side of +x does not take a push to +x, and the bottom takes one upward.
            close(direction(feature, lean), up);
            assert_eq!(direction(feature, V3::x()), None);
            assert_eq!(direction(feature, -V3::z()), None);
        }
        // A push to −x and up is one against both, at the edge of both.
        let inward = V3::new(-0.6, 0.0, 0.8);
        close(direction(Feature::Vertex(0), inward), inward);
        close(direction(Feature::Edge([0, 2]), inward), inward);
        close(direction(Feature::Edge([0, 1]), inward), up);
        close(direction(Feature::Face(0), inward), up);
    }
}
