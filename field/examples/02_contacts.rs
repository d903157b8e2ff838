//! Contacts of a cloth with a body: which triangles touch, where, how deep, and which way is out.

use sdf_field::core::AnyField;
use sdf_field::core::contact::ContactStatus;
use sdf_field::core::placed::Similarity;
use sdf_field::core::shapes::{Cone, Sphere};
use sdf_field::{ContactOptions, Elements, Field, MeshView};

/// Cells along either side of the cloth, of two triangles each.
const CELLS: u32 = 24;

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A ball with a thin spike on top. `Field::open` and `Field::bake` make fields, too.
    let ball = Sphere::new(0.5).ok_or("a length")?;
    let spike = Cone::new(0.03, 2.0).ok_or("an angle and a height")?;
    let raised = Similarity::new([0.02, 0.05, 1.0], [0.0, 0.0, 0.0, 1.0], 1.0).ok_or("a placement")?;
    let parts = vec![ball.into(), AnyField::from(spike).placed(raised)];
    let body = Field::new(AnyField::union(parts).ok_or("at least one part")?);

    let (points, faces) = cloth(0.6);
    let mesh = MeshView { points: &points, faces: &faces };

    // The vertices see nothing: the spike pokes through between them.
    let by_vertices =
        body.contacts(mesh, &ContactOptions { elements: Elements::Vertices, ..ContactOptions::default() })?;
    let by_faces = body.contacts(mesh, &ContactOptions::default())?;
    // A margin reports everything that comes so near.
    let nearby = body.contacts(mesh, &ContactOptions { margin: 0.02, ..ContactOptions::default() })?;
    println!("contacts of vertices: {}", by_vertices.contacts.len());
    println!("contacts of faces:    {}, {} within 0.02", by_faces.contacts.len(), nearby.contacts.len());

    for contact in &by_faces.contacts {
        println!(
            "face {}: {:.4} deep at {:.3?}, push along {:.2?}; no point of it is below {:.4}",
            contact.element,
            -contact.distance,
            contact.point.as_slice(),
            contact.normal.as_slice(),
            contact.lower_bound
        );
    }
    assert!(by_vertices.contacts.is_empty() && !by_faces.contacts.is_empty());
    assert!(by_faces.contacts.iter().all(|contact| contact.status != ContactStatus::BudgetSpent));
    assert!(nearby.contacts.len() >= by_faces.contacts.len());
    Ok(())
}

/// A flat square cloth at a height.
pub fn cloth(height: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let step = |index: u32| 2.0 * f64::from(index) / f64::from(CELLS) - 1.0;
    let points =
        (0..(CELLS + 1) * (CELLS + 1)).map(|vertex| [step(vertex % (CELLS + 1)), step(vertex / (CELLS + 1)), height]);
    let faces = (0..CELLS * CELLS).flat_map(|cell| {
        let corner = cell / CELLS * (CELLS + 1) + cell % CELLS;
        let above = corner + CELLS + 1;
        [[corner, corner + 1, above + 1], [corner, above + 1, above]]
    });
    (points.collect(), faces.collect())
}
