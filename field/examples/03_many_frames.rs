//! A body that moves under a cloth: it is baked once, and each frame is one query with another pose.
//!
//! `Contact::key` names a contact from frame to frame, so that a solver can start from what it knew.

use std::collections::BTreeSet;

use sdf_field::core::placed::Rigid;
use sdf_field::{BakeOptions, ContactOptions, Field, GridSize, MeshView};

const FRAMES: u32 = 12;

/// Cells along either side of the cloth, of two triangles each.
const CELLS: u32 = 30;

/// A box, its faces counter-clockwise from outside.
const BOX_FACES: [[u32; 3]; 12] = [
    [0, 2, 1],
    [1, 2, 3],
    [4, 5, 6],
    [5, 7, 6],
    [0, 1, 4],
    [1, 5, 4],
    [2, 6, 3],
    [3, 6, 7],
    [0, 4, 2],
    [2, 4, 6],
    [1, 3, 5],
    [3, 7, 5],
];

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let corner = |index: u32, axis: u32, half: f64| if index >> axis & 1 == 0 { -half } else { half };
    let points: Vec<[f64; 3]> =
        (0..8).map(|index| [corner(index, 0, 0.6), corner(index, 1, 0.4), corner(index, 2, 0.3)]).collect();
    let options = BakeOptions { size: GridSize::Cells(40), ..BakeOptions::default() };
    let body = Field::bake(MeshView { points: &points, faces: &BOX_FACES }, &options)?.field;

    let (points, faces) = cloth();
    let cloth = MeshView { points: &points, faces: &faces };
    let mut known = BTreeSet::new();
    let mut deepest_of_frames = vec![];
    println!("frame  contacts  known before  depth");
    for frame in 0..FRAMES {
        // It rises by 0.02 and turns by 3° a frame.
        let half_turn = 0.5 * 3.0_f64.to_radians() * f64::from(frame);
        let translation = [0.0, 0.0, -0.4 + 0.02 * f64::from(frame)];
        let pose = Rigid::new(translation, [half_turn.sin(), 0.0, 0.0, half_turn.cos()]);
        let found = body.contacts(cloth, &ContactOptions { pose, ..ContactOptions::fast() })?;

        let keys: BTreeSet<u64> = found.contacts.iter().map(|contact| contact.key()).collect();
        let depth = found.contacts.iter().map(|contact| -contact.distance).fold(0.0, f64::max);
        println!("{frame:5}  {:8}  {:12}  {depth:.4}", keys.len(), keys.intersection(&known).count());
        known = keys;
        deepest_of_frames.push(depth);
    }

    // The body comes up through the cloth at z = 0, which it leaves as deep as its top is above.
    assert_eq!(deepest_of_frames[0], 0.0);
    assert!(deepest_of_frames.is_sorted() && deepest_of_frames[FRAMES as usize - 1] > 0.1);
    Ok(())
}

/// A flat square cloth at z = 0.
fn cloth() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let step = |index: u32| 2.0 * f64::from(index) / f64::from(CELLS) - 1.0;
    let points =
        (0..(CELLS + 1) * (CELLS + 1)).map(|vertex| [step(vertex % (CELLS + 1)), step(vertex / (CELLS + 1)), 0.0]);
    let faces = (0..CELLS * CELLS).flat_map(|cell| {
        let corner = cell / CELLS * (CELLS + 1) + cell % CELLS;
        let above = corner + CELLS + 1;
        [[corner, corner + 1, above + 1], [corner, above + 1, above]]
    });
    (points.collect(), faces.collect())
}
