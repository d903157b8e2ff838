//! A mesh against a few shapes: `contact::batch` culls and searches eight triangles side by side, with the same bits as
//! one at a time.

use sdf_core::combine::Compound;
use sdf_core::contact::{Element, Outcome, batch, contact};
use sdf_core::minimize::FrankWolfe;
use sdf_core::nalgebra::Vector3;
use sdf_core::shapes::{HalfSpace, Sphere, Torus};
use sdf_core::{DynSdf, Simplex};

/// Cells along either side of the cloth, of two triangles each.
const CELLS: u32 = 40;

pub fn main() {
    // Shapes of several types make one field by pointers.
    let ball = Sphere::new(0.5).expect("a length");
    let ring = Torus::new(1.0, 0.2).expect("lengths, the tube the thinner");
    let ground = HalfSpace::new([0.0, 0.0, 1.0], -0.4).expect("a normal");
    let parts: [&dyn DynSdf; 3] = [&ball, &ring, &ground];
    let scene = Compound::new(&parts[..]).expect("at least one part");

    let cloth = cloth();
    let (search, margin) = (FrankWolfe::default(), 0.01);
    let mut outcomes = vec![Outcome::Culled; cloth.len()];
    // Three corners, eight lanes; the other types follow from the arguments.
    batch::contacts::<_, _, _, _, 3, 8>(&scene, &search, margin, &cloth, |index, outcome| outcomes[index] = outcome);

    let culled = outcomes.iter().filter(|outcome| matches!(outcome, Outcome::Culled)).count();
    let separated = outcomes.iter().filter(|outcome| matches!(outcome, Outcome::Separated(_))).count();
    let contacts: Vec<_> = outcomes
        .iter()
        .filter_map(|outcome| match outcome {
            Outcome::Contact(contact) => Some(contact),
            _ => None,
        })
        .collect();
    println!("{} triangles: {culled} culled, {separated} separated, {} contacts", cloth.len(), contacts.len());
    let deepest = contacts.iter().min_by(|a, b| a.distance.total_cmp(&b.distance)).expect("the cloth cuts the ball");
    println!("deepest: {:.4} on triangle {} at {:.3?}", deepest.distance, deepest.element, deepest.point.as_slice());

    for (element, outcome) in cloth.iter().zip(&outcomes) {
        assert_eq!(*outcome, contact(&scene, &search, margin, element));
    }
    assert!(culled > contacts.len() && contacts.len() > 100);
}

/// A square cloth that hangs from z = 0.45 in the middle.
fn cloth() -> Vec<Element<f64, 3>> {
    let point = |vertex: u32| {
        let [x, y] =
            [vertex % (CELLS + 1), vertex / (CELLS + 1)].map(|step| 3.0 * f64::from(step) / f64::from(CELLS) - 1.5);
        Vector3::new(x, y, 0.45 - 0.2 * (x * x + y * y))
    };
    let mut elements = vec![];
    for cell in 0..CELLS * CELLS {
        let corner = cell / CELLS * (CELLS + 1) + cell % CELLS;
        let above = corner + CELLS + 1;
        for vertices in [[corner, corner + 1, above + 1], [corner, above + 1, above]] {
            let id = elements.len() as u32;
            elements.push(Element { id, vertices, simplex: Simplex { corners: vertices.map(point) } });
        }
    }
    elements
}
