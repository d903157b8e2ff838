use sdf_core::placed::{Placed, Similarity};
use sdf_core::shapes::{Bowl, Capsule, Cuboid, Sphere};

use super::*;

#[test]
fn every_part_of_a_union_is_sent_with_its_numbers_and_its_place() {
    let place = Similarity::new([1.0, 2.0, 3.0], [0.0, 0.6, 0.0, 0.8], 2.0).unwrap();
    let cuboid = AnyField::Cuboid(Cuboid::new([0.1, 0.2, 0.3]).unwrap());
    let union = AnyField::union(vec![
        AnyField::Sphere(Sphere::new(0.5).unwrap()),
        AnyField::Placed(Box::new(Placed { field: cuboid, placement: place })),
        AnyField::Capsule(Capsule::new([1.0, 2.0, 3.0], [4.0, 5.0, 6.0], 7.0).unwrap()),
    ]);
    let parts = shape_list(&union.unwrap(), [0.0; 3]).unwrap();
    let sphere =
        ShapeParams { kind: shape::SPHERE, numbers: [0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], ..ShapeParams::default() };
    assert_eq!(parts[0], sphere);
    let placed = ShapeParams {
        kind: shape::CUBOID,
        is_placed: 1,
        numbers: [0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 0.0],
        translation: [1.0, 2.0, 3.0],
        rotation: [0.0, 0.6, 0.0, 0.8],
        scale: 2.0,
    };
    assert_eq!(parts[1], placed);
    assert_eq!((parts[2].kind, parts[2].numbers), (shape::CAPSULE, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]));
}

#[test]
fn a_shape_that_the_kernels_do_not_know_is_refused_with_a_way_out() {
    let bowl = AnyField::Bowl(Bowl::new(1.0, 0.5, 0.1).unwrap());
    let message = shape_list(&bowl, [0.0; 3]).unwrap_err().to_string();
    assert!(message.contains("query it on the CPU"), "{message}");
}

#[test]
fn shapes_in_coordinates_from_a_point_stand_where_they_stood() {
    let origin = [1e6, -2e6, 3e6];
    let near = |offset: [f64; 3]| [0, 1, 2].map(|axis| origin[axis] + offset[axis]);
    let place = Similarity::new(near([1.0, 2.0, 3.0]), [0.0, 0.6, 0.0, 0.8], 2.0).unwrap();
    let union = AnyField::union(vec![
        AnyField::from(Sphere::new(0.5).unwrap()),
        AnyField::from(Sphere::new(0.5).unwrap()).placed(place),
        AnyField::from(Capsule::new(near([1.0, 2.0, 3.0]), near([4.0, 5.0, 6.0]), 7.0).unwrap()),
    ]);
    let parts = shape_list(&union.unwrap(), origin).unwrap();
    assert_eq!(parts.iter().map(|part| part.is_placed).collect::<Vec<_>>(), [1, 1, 0]);
    assert_eq!(
        (parts[0].translation, parts[0].rotation, parts[0].scale),
        ([-1e6, 2e6, -3e6], [0.0, 0.0, 0.0, 1.0], 1.0)
    );
    assert_eq!((parts[1].translation, parts[1].rotation, parts[1].scale), ([1.0, 2.0, 3.0], [0.0, 0.6, 0.0, 0.8], 2.0));
    assert_eq!((parts[2].kind, parts[2].numbers), (shape::CAPSULE, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]));
}
