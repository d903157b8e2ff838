use super::*;

#[test]
fn a_pose_of_the_card_maps_points_as_that_of_the_core() {
    let pose = Rigid::new([1e3, -2.5, 0.125], [0.3, -0.2, 0.9, 0.4]).unwrap();
    let moved = params(&pose);
    for step in 0..100_u8 {
        let point = [0.37, -0.81, 1.93].map(|stride: f32| 100.0 * (stride * f32::from(step)).sin());
        let world = Vector3::from(point).map(f64::from);
        let expected = pose.pull(world).point.map(|x| x as f32);
        assert_eq!(Vector3::from(moved.pull(point)), expected);
        let back = pose.push(world).map(|x| x as f32);
        assert!((Vector3::from(moved.push(point)) - back).norm() <= 1e-3, "{back}");
        let turned = Vector3::from(moved.turned(point));
        assert!((turned - (pose.push(world) - Vector3::from(pose.translation())).cast()).norm() <= 1e-4);
    }
}
