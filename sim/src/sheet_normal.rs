//! Which way does a spine that is thinner than a cell push a sheet?
//!
//! At a point of a surface ∇φ has length 1. [`Contact::normal`] is the direction of a mean of ∇φ over a cell, and [`Contact::slope`] its
//! length: it falls short of 1 by as much as the directions in that cell differ. At the tip of a spine they fill a cone. All of
//! them are normals of the tip, and the grid tells which one a contact gets: it turned by up to 150° between two frames, and a
//! sheet on such tips slid for ever.
//!
//! Where a contact is the lowest point inside of a face, one normal of that cone makes it the lowest: the face's. So what the mean
//! lacks in length is filled up with the sheet's own normal m, on the mean's side:
//!
//! ```text
//! n = (∇φ ± (1 − |∇φ|) m) / |…|        m: the face's inside of a face, else that of the vertices, by the contact's weights
//! ```
//!
//! On a smooth surface |∇φ| = 1, and n is the field's. Inside of a body it always is: there |∇φ| falls short of 1 near the middle too,
//! which is no tip.

use sdf_core::contact::{Contact, ElementKind, Feature};

use crate::V3;
use crate::surface::Surface;

/// Normals of a sheet's vertices, each the mean of its faces' by area; zero of a vertex without faces.
pub(crate) struct SheetNormals<'a> {
    points: &'a [[f64; 3]],
    of_vertices: Vec<V3>,
}

impl<'a> SheetNormals<'a> {
    pub fn new(surface: &Surface, points: &'a [[f64; 3]]) -> Self {
        let mut of_vertices = vec![V3::zeros(); points.len()];
        for face in surface.faces.iter() {
            let normal = across(points, face);
            face.iter().for_each(|vertex| of_vertices[*vertex as usize] += normal);
        }
        of_vertices.iter_mut().for_each(|normal| *normal = normal.try_normalize(f64::MIN_POSITIVE).unwrap_or_default());
        Self { points, of_vertices }
    }

    /// The direction in which a contact of a face pushes; of an edge or a vertex, the contact's own.
    pub fn direction(&self, contact: &Contact<f64>) -> V3 {
        if contact.kind != ElementKind::Face || contact.distance <= 0.0 {
            return contact.normal;
        }
        let corners = contact.vertices.iter().zip(contact.weights);
        let of_sheet: V3 = match contact.feature {
            Feature::Face(_) => across(self.points, &contact.vertices),
            _ => corners.map(|(vertex, weight)| self.of_vertices[*vertex as usize] * weight).sum(),
        };
        let Some(of_sheet) = of_sheet.try_normalize(f64::MIN_POSITIVE) else { return contact.normal };
        let lack = (1.0 - contact.slope).clamp(0.0, 1.0);
        let side = of_sheet.dot(&contact.normal).signum();
        let filled = contact.normal * (1.0 - lack) + of_sheet * (lack * side);
        filled.try_normalize(f64::MIN_POSITIVE).unwrap_or(contact.normal)
    }
}

/// Twice the area of a face, along its normal.
fn across(points: &[[f64; 3]], face: &[u32; 3]) -> V3 {
    let [a, b, c] = face.map(|vertex| V3::from(points[vertex as usize]));
    (b - a).cross(&(c - a))
}

#[cfg(test)]
mod tests {
    use sdf_core::minimize::FrankWolfe;
    use sdf_core::shapes::HalfSpace;
    use sdf_core::{Simplex, contact};

    use super::*;
    use crate::surface::Carrier;

    const POINTS: [[f64; 3]; 3] = [[0.0, 0.0, 0.1], [1.0, 0.0, 0.1], [0.0, 1.0, 0.1]];

    fn found() -> Contact<f64> {
        let floor = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
        let simplex = Simplex { corners: POINTS.map(V3::from) };
        let element = contact::Element { id: 0, vertices: [0, 1, 2], simplex };
        let contact::Outcome::Contact(contact) = contact::contact(&floor, &FrankWolfe::default(), 1.0, &element) else {
            panic!()
        };
        contact
    }

    #[test]
    fn a_short_mean_of_gradients_is_filled_up_with_the_normal_of_the_sheet() {
        let surface = Surface::of_faces(vec![[0, 1, 2]], 3, Carrier::Particles { first: 0 });
        let normals = SheetNormals::new(&surface, &POINTS);
        let normal = V3::new(0.8, 0.0, 0.6);
        for feature in [Feature::Face(0), Feature::Edge([0, 1]), Feature::Vertex(2)] {
            let smooth = Contact { feature, normal, slope: 1.0, ..found() };
            assert!((normals.direction(&smooth) - normal).norm() < 1e-15);
            let tip = Contact { slope: 0.25, ..smooth };
            // ¼ (0.8, 0, 0.6) + ¾ (0, 0, 1)
            let filled = V3::new(0.2, 0.0, 0.9).normalize();
            assert!((normals.direction(&tip) - filled).norm() < 1e-15);
            let from_above = Contact { normal: -normal, ..tip };
            assert!((normals.direction(&from_above) + filled).norm() < 1e-15);
            let inside = Contact { distance: -0.1, ..tip };
            assert_eq!(normals.direction(&inside), normal);
        }
    }
}
