//! Relaxations: affine bounds of a field on the hull of a few points.

use sdf_core::combine::{Offset, Shell, SmoothUnion};
use sdf_core::minimize::{Certified, Minimizer};
use sdf_core::placed::{Placed, Rigid};
use sdf_core::shapes::Sphere;
use sdf_core::{EnclosedSdf, Float, Sdf, Simplex};
use sdf_tests::oracle::{cast, lattice_weights, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, scenes};

/// Interpolates both bounds at the points of a lattice. The tangent planes stand at any point of the hull.
#[test]
fn an_affine_bound_lies_on_its_side_of_the_field() {
    fn check<R: Float, const N: usize>(random: &mut Random) {
        let lattice = lattice_weights::<N>(if N == 4 { 6 } else { 12 });
        for scene in scenes(1.0) {
            for _ in 0..150 {
                let simplex = cast::<R, N>(&random_simplex(random, 1.5 * scene.size));
                let about = simplex.point(random.pick(&lattice).map(R::from_f64));
                let relaxation = scene.relaxation(about, &simplex.corners);
                let context = || format!("{}: {relaxation:?} about {about:?} of {simplex:?}", scene.name);
                assert_eq!(relaxation.enclosure.value.to_f64(), scene.value(about).to_f64(), "{}", context());
                for weights in &lattice {
                    let value = scene.value(simplex.point(weights.map(R::from_f64))).to_f64();
                    let interpolate = |at: [R; 4]| weights.iter().zip(at).map(|(w, at)| w * at.to_f64()).sum::<f64>();
                    let (lower, upper) = (interpolate(relaxation.lower), interpolate(relaxation.upper));
                    // The weights sum to one up to rounding.
                    let rounding = 4.0 * f64::EPSILON * (lower.abs() + upper.abs());
                    let is_between = lower - rounding <= value && value <= upper + rounding;
                    assert!(is_between, "{value} at {weights:?}, {}", context());
                    let range = relaxation.enclosure.range;
                    let is_within = range.lower.to_f64() <= value && value <= range.upper.to_f64();
                    assert!(is_within, "{value} at {weights:?}, {}", context());
                }
            }
        }
    }
    let mut random = Random::seeded();
    check::<f64, 1>(&mut random);
    check::<f64, 2>(&mut random);
    check::<f64, 3>(&mut random);
    check::<f64, 4>(&mut random);
    check::<f32, 2>(&mut random);
    check::<f32, 3>(&mut random);
}

/// A tenth of the hull has a hundredth of the error, away from creases.
#[test]
fn enclosures_of_closed_forms_shrink_with_the_square_of_the_hull() {
    let mut random = Random::seeded();
    for scene in scenes(1.0).iter().filter(|scene| scene.meaning != Meaning::Samples) {
        let mut ratios: Vec<f64> = vec![];
        for _ in 0..200 {
            let corners = [0, 1, 2].map(|_| random.in_cube(1.0));
            let middle = random.in_cube(scene.size);
            let scaled = |size: f64| Simplex { corners: corners.map(|corner| middle + corner * size * scene.size) };
            let [large, small] = [scaled(1e-2), scaled(1e-3)].map(|simplex| {
                let lattice = lattice_weights::<3>(8).into_iter().map(|w| scene.value(simplex.point(w)));
                let enclosure = scene.enclosure(simplex.centroid(), &simplex.corners);
                lattice.fold(f64::INFINITY, f64::min) - enclosure.range.lower
            });
            ratios.push(small / large.max(1e-12));
        }
        ratios.sort_by(f64::total_cmp);
        assert!(ratios[ratios.len() / 2] < 0.05, "{}: {}", scene.name, ratios[ratios.len() / 2]);
    }
}

/// φ is then a thousand times as large as the parts, and rounds so much: no bound leaves that out.
#[test]
fn bounds_hold_where_a_blend_or_an_offset_is_much_longer_than_the_parts() {
    fn check<R: Float, F: EnclosedSdf>(random: &mut Random, name: &str, field: &F) {
        let lattice = lattice_weights::<3>(12);
        for _ in 0..2000 {
            let middle = random.in_cube(1.2);
            let corners = [0; 3].map(|_| middle + random.in_cube(1e-4));
            let simplex = cast::<R, 3>(&Simplex { corners });
            let relaxation = field.relaxation(simplex.point(random.pick(&lattice).map(R::from_f64)), &simplex.corners);
            let found = Certified { evaluations: 64, ..Certified::default() }.minimize(field, &simplex);
            let range = relaxation.enclosure.range;
            for weights in &lattice {
                let value = field.value(simplex.point(weights.map(R::from_f64)));
                let interpolate = |at: [R; 4]| weights.iter().zip(at).map(|(w, at)| w * at.to_f64()).sum::<f64>();
                let (lower, upper) = (interpolate(relaxation.lower), interpolate(relaxation.upper));
                let is_between = lower <= value.to_f64() && value.to_f64() <= upper;
                assert!(is_between, "{name}: {value:?} at {weights:?}: {relaxation:?} of {simplex:?}");
                let is_within = range.lower <= value && value <= range.upper;
                assert!(is_within, "{name}: {value:?} at {weights:?}: {relaxation:?} of {simplex:?}");
                assert!(found.lower_bound <= value, "{name}: {value:?} at {weights:?}: {found:?} of {simplex:?}");
            }
        }
    }
    let mut random = Random::seeded();
    let ball = |x| Placed {
        field: Sphere::new(1.0).unwrap(),
        placement: Rigid::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap(),
    };
    for length in [1e3, 1e4] {
        let [left, right] = [-0.6, 0.6].map(ball);
        let blended = SmoothUnion::new(left, right, length).unwrap();
        let offset = Offset::new(Sphere::new(1.0).unwrap(), length).unwrap();
        let shell = Shell::new(Sphere::new(1.0).unwrap(), length).unwrap();
        check::<f32, _>(&mut random, "smooth union", &blended);
        check::<f64, _>(&mut random, "smooth union", &blended);
        check::<f32, _>(&mut random, "offset", &offset);
        check::<f32, _>(&mut random, "shell", &shell);
    }
}
