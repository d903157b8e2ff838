use super::*;
use crate::TriangleMesh;
use crate::sign::winding::{BETAS, MeshBoundary, solid_angle};
use crate::testing::{random, random_vector};
use crate::triangle::area_vector;

#[test]
fn atan2_agrees_with_the_library() {
    let mut state = 31;
    for _ in 0..100_000 {
        let [x, y] = [0, 1].map(|_| random(&mut state) * 10.0_f64.powf(3.0 * random(&mut state)));
        assert!((atan2(y, x) - y.atan2(x)).abs() < 1e-14, "{y} {x}");
    }
    for [y, x] in [[0.0, 1.0], [0.0, -1.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 1.0], [-1.0, -1.0]] {
        assert!((atan2(y, x) - y.atan2(x)).abs() < 1e-14, "{y} {x}");
    }
    assert_eq!(atan2(0.0, 0.0), 0.0);
}

/// Stacked thin layers too, all seen from one side, so that errors add up.
#[test]
fn no_sum_is_off_by_more_than_its_error() {
    let mut state = 37;
    println!("seed {state}");
    let mut tightest = 0.0_f64;
    for (triangles, thickness) in [(1, 1.0), (7, 1.0), (9, 1.0), (64, 1.0), (65, 0.1), (700, 1.0), (700, 1e-3)] {
        let points: Vec<[f64; 3]> = (0..triangles)
            .flat_map(|_| {
                let flatten = Vector3::new(1.0, 1.0, thickness);
                let first = random_vector(&mut state).component_mul(&flatten);
                [0.0, 0.2, 0.2].map(|size| (first + random_vector(&mut state).component_mul(&flatten) * size).into())
            })
            .collect();
        let corners: Vec<[u32; 3]> = (0..triangles).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = TriangleMesh::new(&points, &corners).unwrap();
        let tree = Bvh::new(&mesh);
        // Thin layers all face upward.
        let upward = |t: usize| area_vector(tree.corners[t]).z.signum();
        let orientation = |t: usize| if thickness < 1.0 { upward(t) } else { (t % 3) as f64 - 1.0 };
        let orientations: Vec<f64> = (0..triangles as usize).map(orientation).collect();
        let windings = WindingNumbers::new(orientations.clone(), MeshBoundary::new(&[], std::iter::empty()));
        for _ in 0..300 {
            let point = random_vector(&mut state) * 2.0;
            let angles = tree.corners.iter().map(|corners| solid_angle(corners.map(|corner| corner - point)));
            let exact =
                angles.zip(&orientations).map(|(angle, orientation)| angle * orientation).sum::<f64>() / (4.0 * PI);
            for beta in BETAS.into_iter().chain([1.1]) {
                let Estimate { value, error } = windings.sum(&tree, point, beta);
                assert!((value - exact).abs() <= error, "{value} for {exact}, {error} at {point}");
                tightest = tightest.max((value - exact).abs() / error);
            }
        }
    }
    assert!(tightest > 0.1, "{tightest}: the error bound is too wide");
}
