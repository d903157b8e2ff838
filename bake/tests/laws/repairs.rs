//! Meshes with cracks and holes, welded and capped, are baked like whole ones.

use sdf_bake::error_budget::{ErrorBudget, ErrorBudgetError};
use sdf_bake::{InvalidMesh, MeshDistance, Repairs, TriangleMesh};
use sdf_procedural::CrackedNut;
use sdf_procedural::random::{Random, test_seed};

const GAP: f64 = 2e-3;

/// Cracks of 108 and of 36 edges, as those of Isaac's nuts.
fn nut() -> sdf_procedural::Mesh {
    CrackedNut { cells: 12, cracks: [54, 18], gap: GAP }.mesh()
}

fn repaired(repairs: Repairs) -> TriangleMesh {
    let mesh = nut();
    repairs.apply(&mesh.points, &mesh.triangles).unwrap()
}

fn boundary_edges(mesh: &TriangleMesh) -> usize {
    MeshDistance::new(mesh, None).topology().boundary_edges
}

#[test]
fn cracks_are_welded_or_capped_and_counted() {
    assert_eq!(boundary_edges(&repaired(Repairs::default())), 108 + 36);

    let welded = repaired(Repairs { weld: Some(2.0 * GAP), close: None });
    assert_eq!((welded.report().merged_points, boundary_edges(&welded)), (53 + 17, 0));
    assert_eq!(welded.report().welded_points, 0);

    let capped = repaired(Repairs { weld: None, close: Some(3.0) });
    let report = capped.report();
    assert_eq!((report.capped_loops, report.cap_triangles, report.open_loops), (2, 106 + 34, 0));
    assert_eq!(boundary_edges(&capped), 0);

    // The lower crack alone is short enough; then none is.
    for (size, loops, edges) in [(1.0, 1, 108), (0.1, 0, 108 + 36)] {
        let capped = repaired(Repairs { weld: None, close: Some(size) });
        assert_eq!((capped.report().capped_loops, capped.report().open_loops), (loops, 2 - loops));
        assert_eq!(boundary_edges(&capped), edges);
    }
}

/// The distance is that of the nut without cracks, but for the gap.
#[test]
fn a_cracked_nut_is_baked_to_three_thousandths() {
    let budget = |mesh: &TriangleMesh| ErrorBudget {
        max_error: 0.003 * mesh.bounds().diagonal(),
        band: 3.0,
        padding: 2,
        max_bytes: 1 << 30,
    };
    let cracked = repaired(Repairs::default());
    let refused = budget(&cracked).bake(&MeshDistance::new(&cracked, None), &|_| ()).unwrap_err();
    assert!(matches!(refused, ErrorBudgetError::SignJumps { .. }));

    let whole = CrackedNut { cells: 12, cracks: [0, 0], gap: 0.0 }.mesh();
    let whole = TriangleMesh::new(&whole.points, &whole.triangles).unwrap();
    let whole = MeshDistance::new(&whole, None);
    for repairs in [Repairs { weld: Some(2.0 * GAP), close: None }, Repairs { weld: None, close: Some(3.0) }] {
        let mesh = repaired(repairs);
        let distance = MeshDistance::new(&mesh, None);
        assert!(distance.is_continuous(), "{}", distance.sign_reason());
        let baked = budget(&mesh).bake(&distance, &|_| ()).unwrap();
        assert!(baked.error_bound <= 0.003 * mesh.bounds().diagonal());
        let seed = test_seed(5);
        let mut random = Random::new(seed);
        for _ in 0..2000 {
            let point = random.point_in_cube(1.1);
            let (own, ideal) = (distance.signed_distance(point), whole.signed_distance(point));
            assert!((own - ideal).abs() < 2.0 * GAP, "seed {seed}: {own} for {ideal} at {point:?}");
        }
    }
}

#[test]
fn the_order_of_points_and_triangles_does_not_matter() {
    let mesh = nut();
    let (mut order, mut triangles) = ((0..mesh.points.len() as u32).collect::<Vec<_>>(), mesh.triangles.clone());
    let seed = test_seed(6);
    let mut random = Random::new(seed);
    random.shuffle(&mut order);
    random.shuffle(&mut triangles);
    let mut points = mesh.points.clone();
    (0..).zip(&order).for_each(|(from, to): (usize, &u32)| points[*to as usize] = mesh.points[from]);
    let triangles: Vec<[u32; 3]> =
        triangles.iter().map(|corners| corners.map(|corner| order[corner as usize])).collect();
    let repairs = Repairs { weld: Some(2.0 * GAP), close: Some(3.0) };
    let [a, b] = [repaired(repairs), repairs.apply(&points, &triangles).unwrap()];
    let corners = |mesh: &TriangleMesh| {
        let mut all: Vec<_> = (0..mesh.triangle_count())
            .map(|triangle| {
                let mut corners = mesh.corners(triangle);
                corners.sort_by(|a, b| a.partial_cmp(b).unwrap());
                corners
            })
            .collect();
        all.sort_by(|a, b| a.partial_cmp(b).unwrap());
        all
    };
    assert_eq!(corners(&a), corners(&b), "seed {seed}");
}

#[test]
fn a_bad_mesh_is_refused_and_a_weld_of_everything_says_so() {
    let repairs = Repairs { weld: Some(1.0), close: None };
    let bad = repairs.apply(&[[0.0; 3]], &[[0, 0, 7]]);
    assert!(matches!(bad, Err(InvalidMesh::IndexOutOfRange { .. })));
    let mesh = nut();
    let all = Repairs { weld: Some(100.0), close: None }.apply(&mesh.points, &mesh.triangles);
    assert!(
        matches!(&all, Err(error @ InvalidMesh::WeldedAway { .. }) if error.to_string().contains("use a smaller weld")),
        "{all:?}"
    );
    // A mesh that had none before has not lost it.
    let none = repairs.apply(&[[0.0; 3], [0.5, 0.0, 0.0], [2.0, 0.0, 0.0]], &[[0, 1, 2]]);
    assert_eq!(none.unwrap_err(), InvalidMesh::NoArea);
}
