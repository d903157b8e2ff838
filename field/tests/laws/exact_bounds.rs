//! Distances and bounds of contacts by the kept mesh hold for the mesh, whatever rounding does: where edges are nearly parallel, where
//! many triangles are about as near, and where faces are thin. All true distances follow from coordinates without rounding.

use sdf_field::core::contact::Contact;
use sdf_field::{BakeOptions, ContactOptions, Elements, Field, GridSize, MeshView};
use sdf_procedural::random::{Random, test_seed};

/// The field of a mesh that it keeps.
fn baked(points: &[[f64; 3]], faces: &[[u32; 3]]) -> Field {
    let options = BakeOptions { size: GridSize::Cells(16), keep_mesh: true, ..BakeOptions::default() };
    Field::bake(MeshView { points, faces }, &options).unwrap().field
}

fn contacts(field: &Field, points: &[[f64; 3]], margin: f64, elements: Elements) -> Vec<Contact<f64>> {
    let options = ContactOptions { margin, exact: true, elements, ..ContactOptions::default() };
    field.contacts(MeshView { points, faces: &[[0, 1, 2]] }, &options).unwrap().contacts
}

/// Distance and bounds hold for the true distance.
fn assert_true(contact: &Contact<f64>, truth: f64, context: &str) {
    let Contact { distance, error_bound, lower_bound, shape_lower_bound, .. } = *contact;
    assert!((distance - truth).abs() <= error_bound, "{context}: {truth}, {contact:?}");
    assert!(lower_bound <= truth && shape_lower_bound <= truth, "{context}: {truth}, {contact:?}");
}

/// The ridge of a roof, and edges across it in a plane above: their distance is the height. Coordinates have few binary digits, so that
/// the turns are exact, three times an orthogonal matrix each.
#[test]
fn edges_that_are_nearly_parallel_are_as_near_as_they_are() {
    let roof =
        [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, -0.5, -1.0], [1.0, -0.5, -1.0], [-1.0, 0.5, -1.0], [1.0, 0.5, -1.0]];
    let faces = [[0, 2, 4], [1, 5, 3], [0, 1, 3], [0, 3, 2], [0, 4, 5], [0, 5, 1], [2, 3, 5], [2, 5, 4]];
    let turns = [
        [[3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]],
        [[1.0, 2.0, 2.0], [2.0, 1.0, -2.0], [-2.0, 2.0, -1.0]],
        [[2.0, -1.0, 2.0], [2.0, 2.0, -1.0], [-1.0, 2.0, 2.0]],
    ];
    let mut count = 0;
    for turn in turns {
        let turned = |point: [f64; 3]| turn.map(|row: [f64; 3]| (0..3).map(|axis| row[axis] * point[axis]).sum());
        let field = baked(&roof.map(turned), &faces);
        for power in 4..=40 {
            let angle = 0.5_f64.powi(power);
            for (gap, step) in [0.5_f64.powi(40), 0.5_f64.powi(30), 0.25]
                .into_iter()
                .flat_map(|gap| (1..16).map(move |step| (gap, step)))
            {
                let (middle, share) = (f64::from(step - 8) / 16.0, f64::from(step) / 16.0);
                let corners = [
                    [middle - 0.5, -share * angle, gap],
                    [middle + 0.5, (1.0 - share) * angle, gap],
                    [middle, 0.0, 2.0],
                ];
                let found = contacts(&field, &corners.map(turned), 6.0 * gap, Elements::Faces);
                let context = format!("turned by {turn:?}, angle {angle}, gap {gap}, step {step}");
                assert_eq!(found.len(), 1, "{context}");
                assert_true(&found[0], 3.0 * gap, &context);
                assert!(found[0].error_bound < 1e-11, "{context}: {:?}", found[0]);
                count += 1;
            }
        }
    }
    assert_eq!(count, 3 * 37 * 45);
}

/// A block whose top has bumps up to 8.5e-13, and a level face over all of it at height 1: the highest bump is the nearest.
#[test]
fn pairs_that_are_nearer_by_a_trifle_are_within_the_bounds() {
    const SIZE: u32 = 9;
    let seed = test_seed(20_261_128);
    println!("to repeat: SDF_SEED={seed}");
    let mut random = Random::new(seed);
    let vertex = |x: u32, y: u32| x + SIZE * y;
    let (last, below) = (SIZE - 1, SIZE * SIZE);
    let side = f64::from(last);
    let mut faces: Vec<[u32; 3]> = vec![[below, below + 2, below + 1], [below, below + 3, below + 2]];
    for step in 0..last {
        for x in 0..last {
            let [a, b, c, d] = [vertex(x, step), vertex(x + 1, step), vertex(x + 1, step + 1), vertex(x, step + 1)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
        faces.extend([
            [vertex(step + 1, 0), vertex(step, 0), below],
            [vertex(last, step + 1), vertex(last, step), below + 1],
            [vertex(step, last), vertex(step + 1, last), below + 3],
            [vertex(0, step), vertex(0, step + 1), below],
        ]);
    }
    faces.extend([
        [vertex(last, 0), below, below + 1],
        [vertex(last, last), below + 1, below + 2],
        [vertex(last, last), below + 2, below + 3],
        [vertex(0, last), below + 3, below],
    ]);
    for round in 0..30 {
        let bumps: Vec<u32> = (0..below).map(|_| random.below(16) as u32).collect();
        let bump = |index: u32| f64::from(bumps[index as usize]) * 0.5_f64.powi(44);
        let mut points: Vec<[f64; 3]> =
            (0..below).map(|index| [f64::from(index % SIZE), f64::from(index / SIZE), bump(index)]).collect();
        points.extend([[0.0, 0.0, -2.0], [side, 0.0, -2.0], [side, side, -2.0], [0.0, side, -2.0]]);
        let highest = (0..below).map(bump).fold(0.0, f64::max);
        let corners = [[-20.0, -20.0, 1.0], [40.0, -20.0, 1.0], [4.0, 60.0, 1.0]];
        let found = contacts(&baked(&points, &faces), &corners, 1.5, Elements::Faces);
        assert_eq!(found.len(), 1, "seed {seed}, round {round}");
        assert_true(&found[0], 1.0 - highest, &format!("seed {seed}, round {round}"));
    }
}
