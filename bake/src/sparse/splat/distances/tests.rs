//! Distances, sides and caps of normals of one brick, where a small fault of an inner loop would show.

use sdf_core::nalgebra::Vector3;

use super::*;
use crate::TriangleMesh;
use crate::bvh::Bvh;
use crate::simd::LANES;
use crate::sparse::splat::frame::PlaneFrames;

/// Triangles wound outward, seen from the origin, in voxels of side one.
fn frames(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<TriangleFrame> {
    let mesh = TriangleMesh::new(points, triangles).unwrap();
    let tree = Bvh::new(&mesh);
    let orientations = vec![1.0; triangles.len()];
    let planes = PlaneFrames::new(&tree, Some(&orientations), 1.0);
    let frame = |slot: usize| {
        let slots = [slot as u32; LANES];
        planes.eight(&slots, &planes.corners(&slots), &[[0.0; LANES]; 3])[0]
    };
    (0..triangles.len()).map(frame).collect()
}

#[test]
fn a_triangle_is_measured_if_its_plane_is_nearer_than_the_nearest_so_far_and_only_then() {
    let distance = 2.0_f32;
    let all = [[distance * distance; WIDTH]; GROUPS];
    let nearest = Nearest { points: GROUP_POINTS, limits: all, all, above: all, below: all };
    for group in 0..GROUPS {
        for axis in 0..3 {
            for sign in [1.0_f32, -1.0] {
                let mut plane = [0.0; 4];
                plane[axis] = sign;
                // The plane's height over the node that is nearest to it.
                let least = GROUP_POINTS[group][axis].iter().map(|x| sign * x).fold(f32::INFINITY, lesser);
                for by in [1e-4, 1e-2, 1.0] {
                    plane[3] = distance - by - least;
                    assert!(nearest.improvable(plane) >> group & 1 == 1, "{plane:?} of group {group}");
                    plane[3] = distance + by - least;
                    assert!(nearest.improvable(plane) >> group & 1 == 0, "{plane:?} of group {group}");
                }
            }
        }
    }
}

/// A tent: z falls by 5/12 of the way from its ridge. A brick is as far below the ridge as its nodes reach from its middle.
#[test]
fn sides_are_decided_up_to_the_reach_and_not_beyond() {
    let points = [[-60.0, 0.0, 5.0], [60.0, 0.0, 5.0], [0.0, 60.0, -20.0], [0.0, -60.0, -20.0]];
    let triangles = frames(&points, &[[0, 1, 2], [1, 0, 3]]);
    let mut brick = BrickDistances::new();
    let (mut decided_count, mut far_count) = (0, 0);
    for reach in [2.0_f32, 4.0, 6.0] {
        for coarse in [None, Some([reach; 8])] {
            let query = BrickQuery {
                triangles: &triangles,
                list: &[0, 1],
                offset: [0.0; 3],
                reach,
                kept_within: reach,
                coarse,
                position_rounding: 0.0,
                certified_band: None,
            };
            brick.measure(pulp::Arch::new(), query);
            for node in 0..NODES {
                let at = [node % 8, node / 8 % 8, node / 64].map(|n| n as f64 - 3.5);
                let height = at[2] - 5.0 + at[1].abs() * 5.0 / 12.0;
                let distance = if at[1] == 0.0 { height } else { height * 12.0 / 13.0 }.abs();
                let is_decided = brick.decided[node / 64] >> (node % 64) & 1 == 1;
                let is_inside = brick.inside[node / 64] >> (node % 64) & 1 == 1;
                if distance > f64::from(reach) {
                    far_count += 1;
                    assert!(!is_decided, "{at:?}, {distance} away, of {reach}");
                    assert!(brick.distances[node] >= reach && f64::from(brick.distances[node]) <= distance + 1e-3);
                } else if is_decided {
                    decided_count += 1;
                    assert_eq!(is_inside, height < 0.0, "{at:?}");
                    assert!((f64::from(brick.distances[node]) - distance).abs() < 1e-3);
                }
            }
        }
    }
    assert!(decided_count > 200 && far_count > 1000, "{decided_count} decided, {far_count} far");
}

#[test]
fn the_sine_of_a_cap_of_normals_is_that_of_its_half_angle() {
    for half_angle in [0.05_f64, 0.3, 0.9, 1.4] {
        let (sine, cosine) = half_angle.sin_cos();
        // Two faces of a ridge along x, their normals turned by the half angle from z.
        let points = [[-5.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, -cosine, -sine]];
        let triangles = frames(&points, &[[0, 1, 2], [1, 0, 3]]);
        let mut pack = PackedTriangles::default();
        let mut indices = [1; WIDTH];
        indices[0] = 0;
        pack.load(&triangles, &indices, [0.0; 3]);
        let normal = Vector3::from(pack.normal(0));
        assert!((normal.z.abs() - cosine as f32).abs() < 1e-6, "{normal:?}");
        let found = f64::from(largest_sine(&[pack], &[0b11]));
        assert!((sine..=sine + 1e-4).contains(&found), "{found} for {sine}");
        assert!(largest_sine(&[pack], &[0b01]) < 1e-4);
    }
}
