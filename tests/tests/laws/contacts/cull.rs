//! The cull: it drops distant elements, and none with a value within the margin.

use nalgebra::Vector3;
use sdf_core::contact::{Outcome, centroid_bound, contact, lean_contact, lean_cull};
use sdf_core::grid::{Dense, Grid, Storage};
use sdf_core::minimize::FrankWolfe;
use sdf_core::placed::{Placed, Rigid};
use sdf_core::shapes::{HalfSpace, Sphere, Torus};
use sdf_core::{EnclosedSdf, Float, Lanes, Sdf, Simplex};
use sdf_tests::lanes::pack_simplices;
use sdf_tests::oracle::{cast, element, lattice_minimum, random_simplex, random_triangle};
use sdf_tests::random::Random;
use sdf_tests::scene_field::SceneField;
use sdf_tests::scenes::{Meaning, Scene, Steep, cube_lattice, sampled, sampled_in_bricks, scenes, with_block_bounds};
use sdf_tests::stability::answer::Number;

/// Checks that no element with a value within the margin is culled, and that the cull's lower bound holds.
fn check_cull<R: Float, const N: usize>(field: &SceneField, name: &str, size: f64, rounds: usize, random: &mut Random) {
    for _ in 0..rounds {
        let simplex = cast::<R, N>(&random_simplex(random, 2.0 * size));
        let lowest = lattice_minimum(field, &simplex, 12);
        // Margins just above and below the minimum are those that a cull can get wrong.
        let near = R::from_f64(lowest.to_f64() + random.pick(&[0.0, 1e-7, -1e-7, 1e-3, 0.1]) * size);
        for margin in [near, lowest, R::from_f64(random.between(-0.5, 0.5) * size)] {
            let cull = centroid_bound(field, &simplex, margin);
            let context = || format!("{name}: {cull:?} with {margin:?}, but {lowest:?} on {simplex:?}");
            assert!(cull.may_touch || margin < lowest, "{}", context());
            assert!(cull.lower_bound <= lowest, "{}", context());
            // The cull of a contact also uses the enclosure of the element's box.
            match contact(field, &FrankWolfe::default(), margin, &element(0, simplex)) {
                Outcome::Culled => {
                    assert!(margin < lowest, "{name}: culled with {margin:?}, but {lowest:?} on {simplex:?}")
                }
                Outcome::Contact(contact) => {
                    assert!(contact.lower_bound <= lowest, "{name}: {contact:?}, but {lowest:?}")
                }
                Outcome::Separated(_) | Outcome::NotFinite => {}
            }
        }
    }
}

#[test]
fn a_culled_element_has_no_value_within_the_margin() {
    let mut random = Random::seeded();
    for scene in scenes(1.0) {
        check_cull::<f64, 1>(&scene.field, scene.name, scene.size, 100, &mut random);
        check_cull::<f64, 2>(&scene.field, scene.name, scene.size, 200, &mut random);
        check_cull::<f64, 3>(&scene.field, scene.name, scene.size, 200, &mut random);
        check_cull::<f32, 1>(&scene.field, scene.name, scene.size, 100, &mut random);
        check_cull::<f32, 2>(&scene.field, scene.name, scene.size, 200, &mut random);
        check_cull::<f32, 3>(&scene.field, scene.name, scene.size, 200, &mut random);
    }
}

/// A field rounds by its own lengths too: a surface through the world's origin that is far from the origin of its own frame, or
/// from that of its grid, has values there that are less certain than the coordinates of the element.
#[test]
fn a_small_element_on_a_large_field_is_not_culled_by_rounding() {
    let mut random = Random::seeded();
    let mut culled = 0;
    for Scene { name, field, size, .. } in scenes(1.0) {
        for _ in 0..200 {
            let Some(on_surface) = surface_point(&field, size, &mut random) else { continue };
            let pose = Rigid::new((-on_surface).into(), [0.0, 0.0, 0.0, 1.0]).unwrap();
            let field = Placed { field: &field, placement: pose };
            culled += check_small_element(&field, name, 1e-5 * size, &mut random);
        }
    }
    for _ in 0..2000 {
        let plane = HalfSpace::new(random.direction().into(), 0.0).unwrap();
        let grid = sampled(&plane, cube_lattice(random.between(0.5, 1.0), 5), 1.0);
        culled += check_small_element(&grid, "a grid", 1e-5, &mut random);
    }
    assert!(culled > 1000, "the cull dropped {culled} elements: it can do better");
}

/// Checks that an f32 element with a value at the margin in f64 is not culled. Was it, with a margin below by a thousandth of
/// the field's lengths?
fn check_small_element<F: EnclosedSdf>(field: &F, name: &str, size: f64, random: &mut Random) -> usize {
    let simplex = cast::<f32, 3>(&random_simplex(random, size));
    let exact = Simplex { corners: simplex.corners.map(|corner| corner.map(f64::from)) };
    let lowest = lattice_minimum(field, &exact, 4);
    let margin = Number::Single.round_up(lowest) as f32;
    let cull = centroid_bound(field, &simplex, margin);
    let context = || format!("{name}: {cull:?} with {margin:e}, but {lowest:e} on {simplex:?}");
    assert!(cull.may_touch, "{}", context());
    assert!(f64::from(cull.lower_bound) <= lowest, "{}", context());
    let contact = contact(field, &FrankWolfe::default(), margin, &element(0, simplex));
    assert!(!matches!(contact, Outcome::Culled), "{}", context());
    usize::from(!centroid_bound(field, &simplex, margin - 100.0 * size as f32).may_touch)
}

/// A point with φ ≈ 0 by Newton steps along the gradient, if they arrive.
fn surface_point(field: &SceneField, size: f64, random: &mut Random) -> Option<Vector3<f64>> {
    let mut point = random.in_cube(size);
    for _ in 0..20 {
        let sample = field.sample(point);
        point -= sample.gradient * (sample.value / sample.gradient.norm_squared().max(1e-3));
    }
    (point.amax() < 2.0 * size && field.sample(point).value.abs() < 1e-9 * size).then_some(point)
}

/// §3.3 of the paper compares the value with the radius alone, as if every slope bound were 1.
#[test]
fn the_cull_respects_slope_bounds_above_one() {
    let mut random = Random::seeded();
    for scene in scenes(1.0) {
        let size = scene.size;
        let name = format!("{}, three times as steep", scene.name);
        let steep = SceneField::new(Steep { field: scene.field, steepness: 3.0 });
        check_cull::<f64, 2>(&steep, &name, size, 100, &mut random);
        check_cull::<f64, 3>(&steep, &name, size, 100, &mut random);
        check_cull::<f32, 3>(&steep, &name, size, 100, &mut random);
    }
    // By hand: φ = 0.9 at the edge's middle, three times as steep, with its lower end on the surface.
    let plane = Steep { field: HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap(), steepness: 3.0 };
    let edge = Simplex::<f64, 2> { corners: [Vector3::zeros(), Vector3::new(0.0, 0.0, 0.6)] };
    assert!(centroid_bound(&plane, &edge, 0.0).may_touch);
    let steep_grid = SceneField::new(sampled(&Sphere::new(0.5).unwrap(), cube_lattice(0.75, 24), 3.0));
    check_cull::<f64, 3>(&steep_grid, "a steep grid", 0.6, 2000, &mut random);
}

/// The radius is the distance from the centroid to the farthest corner. An obtuse sliver's circumradius is 12 times that.
#[test]
fn the_cull_radius_of_a_sliver_reaches_its_farthest_corner() {
    let sliver = Simplex::<f64, 3> { corners: [Vector3::zeros(), Vector3::x(), Vector3::new(0.5, 0.01, 0.0)] };
    let centroid = sliver.centroid();
    assert_eq!(sliver.max_distance_from(centroid), (sliver.corners[0] - centroid).norm());
    // Perpendicular to the sliver just beyond the radius, along it just within.
    let above = HalfSpace::new([0.0, 1.0, 0.0], -0.51).unwrap();
    assert!(!centroid_bound(&above, &sliver, 0.0).may_touch);
    let beside = HalfSpace::new([1.0, 0.0, 0.0], 0.001).unwrap();
    assert!(centroid_bound(&beside, &sliver, 0.0).may_touch);
}

/// A true distance culls everything beyond margin + radius.
#[test]
fn the_cull_drops_distant_elements() {
    let mut random = Random::seeded();
    for scene in scenes(1.0).iter().filter(|scene| scene.meaning == Meaning::Exact) {
        for _ in 0..300 {
            let simplex = random_simplex::<3>(&mut random, 3.0 * scene.size);
            let radius = simplex.max_distance_from(simplex.centroid());
            let value = scene.value(simplex.centroid());
            let margin = 0.1 * scene.size;
            assert_eq!(
                centroid_bound(&scene.field, &simplex, margin).may_touch,
                value <= margin + radius + 1e-12,
                "{}",
                scene.name
            );
        }
    }
}

/// A grid with bounds of its blocks culls by them first. That drops no element within the margin, and its contacts are those of the
/// grid without bounds.
#[test]
fn a_block_that_is_far_off_culls_only_elements_beyond_the_margin() {
    fn check<A: Storage, B: Storage>(bounded: &Grid<A>, plain: Option<&Grid<B>>, random: &mut Random) -> [usize; 2] {
        let [mut by_block, mut contacts] = [0; 2];
        for _ in 0..3000 {
            let first = random.in_cube(1.1);
            let corners = random_triangle(first, random.pick(&[0.02, 0.1, 0.4]), random);
            let element = element(0, cast::<f32, 3>(&Simplex { corners }));
            let centroid = element.simplex.centroid();
            let lowest = lattice_minimum(bounded, &element.simplex, 12);
            let margin = lowest + random.pick(&[0.0, 1e-6, -1e-6, 0.1, -0.1, -0.3, -0.6]);
            let radius = element.simplex.max_distance_from(centroid);
            by_block +=
                usize::from(bounded.lowest_about(centroid) - radius * bounded.slope_bound() as f32 > margin + 1e-4);
            if let Err(Outcome::Culled) = lean_cull(bounded, margin, &element) {
                assert!(margin < lowest, "culled with {margin}, but {lowest} on {element:?}");
            }
            let Some(plain) = plain else { continue };
            let [found, expected] = [
                lean_contact(bounded, &FrankWolfe::default(), margin, &element),
                lean_contact(plain, &FrankWolfe::default(), margin, &element),
            ];
            if let Outcome::Contact(expected) = expected {
                contacts += 1;
                assert_eq!(found, Outcome::Contact(expected));
            }
        }
        [by_block, contacts]
    }
    let mut random = Random::seeded();
    for field in [SceneField::new(Sphere::new(0.6).unwrap()), SceneField::new(Torus::new(0.6, 0.2).unwrap())] {
        let plain = sampled(&field, cube_lattice(1.0, 40), 1.0);
        let [by_block, contacts] = check(&with_block_bounds(plain.clone()), Some(&plain), &mut random);
        assert!(by_block > 20 && contacts > 500, "{by_block} by their blocks, {contacts} contacts");
        let bricks = sampled_in_bricks::<u16>(&field, cube_lattice(1.0, 40), 0.3);
        let [by_block, _] = check(&bricks, None::<&Grid<Dense<Vec<f32>>>>, &mut random);
        assert!(by_block > 20, "{by_block} by their bricks");
    }
}

#[test]
fn one_lane_of_the_cull_equals_the_scalar_bit_for_bit() {
    fn check<R: Float, const L: usize, const N: usize>() {
        let mut random = Random::seeded();
        for scene in scenes(1.0) {
            for _ in 0..40 {
                let scalar: [Simplex<R, N>; L] =
                    std::array::from_fn(|_| cast(&random_simplex(&mut random, scene.size)));
                let margins: [R; L] = std::array::from_fn(|_| R::from_f64(random.between(-0.3, 0.5)));
                let packed = centroid_bound(&scene.field, &pack_simplices(&scalar), Lanes(margins));
                for lane in 0..L {
                    let cull = centroid_bound(&scene.field, &scalar[lane], margins[lane]);
                    assert_eq!(cull.may_touch, packed.may_touch.0[lane], "{} on {:?}", scene.name, scalar[lane]);
                    let bounds = [cull.lower_bound, packed.lower_bound.0[lane]].map(|bound| bound.to_f64().to_bits());
                    assert_eq!(bounds[0], bounds[1], "{} on {:?}", scene.name, scalar[lane]);
                }
            }
        }
    }
    check::<f32, 8, 1>();
    check::<f32, 8, 2>();
    check::<f32, 8, 3>();
    check::<f64, 4, 1>();
    check::<f64, 4, 2>();
    check::<f64, 4, 3>();
}
