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

/// A prism of length 1 whose top is so wide: a face of two long triangles at height 0 between slopes of 45°.
fn prism(width: f64) -> Field {
    let half = 0.5 * width;
    let top = [[0.0, -half, 0.0], [1.0, -half, 0.0], [1.0, half, 0.0], [0.0, half, 0.0]];
    let bottom = [[0.0, -0.5, -0.5], [1.0, -0.5, -0.5], [1.0, 0.5, -0.5], [0.0, 0.5, -0.5]];
    let points = [top, bottom].concat();
    let faces = [
        [0, 1, 2],
        [0, 2, 3],
        [4, 6, 5],
        [4, 7, 6],
        [0, 5, 1],
        [0, 4, 5],
        [1, 6, 2],
        [1, 5, 6],
        [2, 7, 3],
        [2, 6, 7],
        [3, 4, 0],
        [3, 7, 4],
    ];
    baked(&points, &faces)
}

/// Slivers are measured by their edges alone, and normals of other thin faces have lost digits: at any width the bound says so. Away from
/// them it stays near rounding.
#[test]
fn distances_to_thin_faces_are_within_their_bounds() {
    let seed = test_seed(20_261_129);
    println!("to repeat: SDF_SEED={seed}");
    let mut random = Random::new(seed);
    for width in [0.1, 1e-3, 1e-5, 1e-6, 2e-7, 1.2e-7, 1e-7, 5e-8, 1e-8, 1e-10, 1e-13] {
        let field = prism(width);
        for round in 0..300 {
            let height = [0.0, 1e-12, 1e-9, 1e-3, -1e-3 * width][round % 5];
            let mut at = || [random.between(0.05, 0.95), width * random.between(-0.45, 0.45), height];
            let corners = [0; 3].map(|_| at());
            for contact in contacts(&field, &corners, 0.01, Elements::Vertices) {
                let context = format!("seed {seed}, width {width}, round {round}");
                assert_true(&contact, height, &context);
                let wanted = if width > 0.01 { 1e-13 } else { (0.6 * width).max(2e-9) };
                assert!(contact.error_bound < wanted, "{context}: {contact:?}");
            }
        }
        // An edge through the top ends 0.1 below it, seven tenths of that from either slope.
        let corners = [[0.5, 0.0, 0.4], [0.5, 0.0, -0.1], [0.5, 0.0, -0.1]];
        let found = contacts(&field, &corners, 0.01, Elements::Edges);
        let truth = -(0.1 + 0.5 * width) * 0.5_f64.sqrt();
        let deepest = found.iter().map(|contact| contact.distance).fold(0.0, f64::min);
        assert!((deepest - truth.max(-0.1)).abs() < 1e-3, "width {width}: {found:?}");
    }
}

/// A face over the apex of a pyramid, which is below its inside.
#[test]
fn thin_elements_are_within_their_bounds() {
    let points = [[0.0; 3], [1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [-1.0, 0.0, -1.0], [0.0, -1.0, -1.0]];
    let faces = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1], [1, 4, 3], [1, 3, 2]];
    let field = baked(&points, &faces);
    for width in [0.1, 1e-3, 1e-5, 1e-6, 2e-7, 1e-7, 1e-8, 1e-10, 1e-13] {
        for height in [1e-12, 1e-9, 1e-3] {
            for shift in [-0.2, 0.0, 0.13] {
                let corners =
                    [[shift - 0.5, -0.5 * width, height], [shift + 0.5, -0.5 * width, height], [shift, width, height]];
                let found = contacts(&field, &corners, 0.01, Elements::Faces);
                assert_eq!(found.len(), 1, "width {width}, height {height}");
                assert_true(&found[0], height, &format!("width {width}, height {height}"));
            }
        }
    }
}

/// A rod so thin that the product of its width and a normal's length, its square, underflows: a face beside it does not cross it.
#[test]
fn a_rod_is_as_near_however_thin_it_is() {
    let corners = [
        [-0.17302860, -0.15890733, 0.32085742],
        [0.04285509, -0.34097240, 0.36837190],
        [-0.09672608, -0.24482436, -0.06860776],
    ];
    for width in [1e-20, 1e-107, 1e-108, 1e-110, 1e-150] {
        let rod = sdf_procedural::Cuboid { half: [0.5, width, width] }.mesh();
        let points: Vec<_> = rod.points.iter().map(|[x, y, z]| [x + 0.5, *y, *z]).collect();
        let found = contacts(&baked(&points, &rod.triangles), &corners, 0.5, Elements::Faces);
        assert_eq!(found.len(), 1, "{width}");
        // The way to the rod's end, the origin, from the nearest point of the edge beside it.
        let [a, b] = [corners[2], corners[0]].map(sdf_field::core::nalgebra::Vector3::from);
        let truth = (a - (b - a) * (a.dot(&(b - a)) / (b - a).norm_squared())).norm();
        assert!((found[0].distance - truth).abs() < 1e-12, "{width}: {truth}, {:?}", found[0]);
    }
}
