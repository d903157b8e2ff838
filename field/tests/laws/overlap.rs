//! Two fields against each other, as a program asks: closed forms, a baked grid, poses, and what is refused.

use sdf_field::core::Aabb;
use sdf_field::core::placed::Rigid;
use sdf_field::core::shapes::{Bowl, Cuboid, HalfSpace, Octahedron, Sphere, Torus};
use sdf_field::{BakeOptions, Field, MeshView, Overlap, OverlapError, OverlapOptions, OverlapVerdict};

const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

fn sphere() -> Field {
    Field::new(Sphere::new(1.0).unwrap())
}

fn raised(z: f64) -> OverlapOptions {
    OverlapOptions { poses: [Rigid::new([0.0, 0.0, z], UPRIGHT), None], ..OverlapOptions::default() }
}

#[test]
fn two_balls_share_a_lens() {
    let found = sphere().overlap(&sphere(), &raised(1.5)).unwrap();
    let deepest = found.deepest.unwrap();
    assert_eq!(found.verdict, OverlapVerdict::Contact);
    assert!(deepest.converged && deepest.lower_bound <= -0.25 && deepest.point == Some(found.points[0]));
    assert!((found.points[0].separation() + 0.5).abs() < 1e-2 && found.minima.unwrap().count == 1);
    // The disc at half height.
    let (patch, area) = (found.patch.unwrap(), std::f64::consts::PI * (1.0 - 0.75 * 0.75));
    assert!((patch.area / area - 1.0).abs() < 0.05 && patch.point_count as usize == found.pieces.len());
    let is_on_disc = |z: f64| (z - 0.75).abs() < 1e-6;
    assert!(found.pieces.iter().all(|piece| is_on_disc(piece.point.point.z) && piece.point.normal.z > 0.999));
}

#[test]
fn a_resolution_that_is_no_length_is_refused() {
    for resolution in [f64::NAN, f64::INFINITY, 0.0, -0.1] {
        let options = OverlapOptions { resolution: Some(resolution), ..raised(1.5) };
        assert_eq!(
            sphere().overlap(&sphere(), &options).unwrap_err(),
            OverlapError::ResolutionOutOfRange,
            "{resolution}"
        );
    }
}

#[test]
fn a_pose_moves_a_field_and_moving_both_moves_the_answer() {
    let (body, ball) = (Field::new(Octahedron::new(1.0).unwrap()), sphere());
    let find = |a: [f64; 3], b: [f64; 3]| {
        let poses = [Rigid::new(a, UPRIGHT), Rigid::new(b, [0.0, 0.0, 1.0, 2.0])];
        body.overlap(&ball, &OverlapOptions { poses, ..OverlapOptions::default() }).unwrap()
    };
    let (here, there) = (find([0.0; 3], [1.7, 0.0, 0.0]), find([3.0, -2.0, 1.0], [4.7, -2.0, 1.0]));
    assert_eq!([here.verdict, there.verdict], [OverlapVerdict::Contact; 2]);
    let [a, b] = [&here, &there].map(|found| found.points[0]);
    assert!((a.value - b.value).abs() < 1e-2 && (b.point - a.point).norm() > 3.0);
    assert_eq!(find([0.0; 3], [2.1, 0.0, 0.0]).verdict, OverlapVerdict::Separated);
}

#[test]
fn the_margin_reaches_over_the_gap() {
    let with_margin = |margin| sphere().overlap(&sphere(), &OverlapOptions { margin, ..raised(2.2) }).unwrap();
    let apart = with_margin(0.0);
    assert_eq!((apart.verdict, apart.points.len(), apart.pieces.len()), (OverlapVerdict::Separated, 0, 0));
    assert_eq!(
        [0.09, 0.11].map(|margin| with_margin(margin).verdict),
        [OverlapVerdict::Separated, OverlapVerdict::Contact]
    );
    // Far apart, bounds are enough.
    assert_eq!(sphere().overlap(&sphere(), &raised(9.0)).unwrap(), Overlap::default());
}

#[test]
fn a_baked_grid_touches_where_its_shape_does() {
    let points =
        [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    let baked = Field::bake(MeshView { points: &points, faces: &faces }, &BakeOptions::default()).unwrap().field;
    let exact = Field::new(Octahedron::new(1.0).unwrap());
    let error = baked.info().unwrap().error_bound;
    let [of_grid, of_shape] = [baked, exact].map(|field| field.overlap(&sphere(), &raised(1.6)).unwrap());
    let [a, b] = [&of_grid, &of_shape].map(|found| found.deepest.unwrap().point.unwrap().value);
    assert!((a - b).abs() <= error + 2e-3, "{a} {b}, error bound {error}");
}

#[test]
fn a_search_in_the_region_of_a_pair_is_the_search() {
    let (a, b, options) = (Field::new(Octahedron::new(1.0).unwrap()), sphere(), raised(1.4));
    let region = a.overlap_region(&b, &options, [true; 2]).unwrap().unwrap();
    assert_eq!(a.overlap_in(&b, &options, &region), a.overlap(&b, &options));
    // By bounds alone the box is no smaller.
    let by_bounds = a.overlap_region(&b, &options, [false; 2]).unwrap().unwrap();
    assert!((0..3).all(|axis| by_bounds.min[axis] <= region.min[axis] && region.max[axis] <= by_bounds.max[axis]));
}

/// A ball of radius 0.92 in a bowl whose wall begins at 0.925.
fn ball_in_bowl(options: OverlapOptions) -> Overlap {
    let bowl = Field::new(Bowl::new(1.0, 0.5, 0.15).unwrap());
    Field::new(Sphere::new(0.92).unwrap()).overlap(&bowl, &options).unwrap()
}

/// A ball within a bowl: tangents tell nothing of a bowl, and the nearest points are a whole sheet. There is no room for all open boxes, and yet
/// the default tolerance is reached, and a smaller one has no lower bound that is worse.
#[test]
fn more_boxes_than_there_is_room_for_are_searched_to_the_end() {
    let mut highest = f64::NEG_INFINITY;
    for tolerance in [3e-3, 1e-3] {
        let found = ball_in_bowl(OverlapOptions { tolerance, ..OverlapOptions::default() });
        let deepest = found.deepest.unwrap();
        println!("{tolerance}: {deepest:?}");
        assert!(deepest.converged && deepest.lower_bound >= highest, "{tolerance}: {deepest:?} after {highest}");
        highest = deepest.lower_bound;
    }
}

#[test]
fn a_tolerance_that_is_no_fraction_is_refused() {
    for tolerance in [f64::NAN, f64::INFINITY, 0.0, -1e-3] {
        let options = OverlapOptions { tolerance, ..raised(1.5) };
        assert_eq!(
            sphere().overlap(&sphere(), &options).unwrap_err(),
            OverlapError::ToleranceOutOfRange,
            "{tolerance}"
        );
    }
}

#[test]
fn few_evaluations_are_undecided_and_honest() {
    let few = |options| OverlapOptions { evaluations: 2, ..options };
    let found = sphere().overlap(&sphere(), &few(OverlapOptions { margin: -0.2499, ..raised(1.5) })).unwrap();
    assert!(found.deepest.is_some_and(|deepest| deepest.lower_bound <= -0.25) && !found.patch.unwrap().is_complete);
    let found = ball_in_bowl(few(OverlapOptions::default()));
    // The gap is 0.005.
    assert!(found.verdict == OverlapVerdict::Undecided && found.deepest.unwrap().lower_bound <= 0.005);
}

#[test]
fn two_unbounded_fields_are_refused() {
    let ground = Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    let error = ground.overlap(&ground, &OverlapOptions::default()).unwrap_err();
    assert_eq!(error, OverlapError::Unbounded);
    assert!(error.to_string().contains("intersect one of them with a box"));
    assert_eq!(ground.overlap(&sphere(), &OverlapOptions::default()).unwrap().verdict, OverlapVerdict::Contact);
}

/// Half-spaces that share a slab: within a box they touch, although neither they nor the slab are bounded.
#[test]
fn two_unbounded_fields_are_searched_within_a_box() {
    let [up, down] = [1.0, -1.0].map(|z| Field::new(HalfSpace::new([0.0, 0.0, z], 0.5).unwrap()));
    let found = |limits| up.overlap_in(&down, &OverlapOptions::default(), &limits).unwrap();
    let here = found(Aabb::centered([1.0; 3]));
    assert_eq!(here.verdict, OverlapVerdict::Contact);
    assert!((here.points[0].value + 0.5).abs() < 1e-2 && here.points[0].point.z.abs() < 1e-2);
    assert_eq!(found(Aabb { min: [-1.0, -1.0, 2.0], max: [1.0, 1.0, 3.0] }).verdict, OverlapVerdict::Separated);
    let everywhere = up.overlap_in(&down, &OverlapOptions::default(), &Aabb::EVERYWHERE);
    assert_eq!(everywhere.unwrap_err(), OverlapError::Unbounded);
}

#[test]
fn a_search_in_a_box_refuses_what_a_search_everywhere_refuses() {
    let (here, everywhere) = (Aabb::centered([1.0; 3]), Aabb::EVERYWHERE);
    let far = Field::new(Sphere::new(1e20).unwrap());
    assert_eq!(far.overlap_in(&far, &OverlapOptions::default(), &everywhere).unwrap_err(), OverlapError::TooFar);
    assert_eq!(far.overlap_in(&far, &OverlapOptions::default(), &here).unwrap().verdict, OverlapVerdict::Contact);
    let refused = [
        (OverlapOptions { margin: f64::NAN, ..raised(1.5) }, OverlapError::MarginNotFinite),
        (OverlapOptions { margin: f64::INFINITY, ..raised(1.5) }, OverlapError::MarginNotFinite),
        (OverlapOptions { resolution: Some(f64::NAN), ..raised(1.5) }, OverlapError::ResolutionOutOfRange),
        (OverlapOptions { resolution: Some(-1.0), ..raised(1.5) }, OverlapError::ResolutionOutOfRange),
        (OverlapOptions { resolution: Some(1e-9), ..raised(1.5) }, OverlapError::TooFine),
    ];
    for (options, error) in refused {
        assert_eq!(sphere().overlap(&sphere(), &options).unwrap_err(), error);
        assert_eq!(sphere().overlap_in(&sphere(), &options, &here).unwrap_err(), error);
    }
}

/// Two fields that hardly touch: what any of the three searches found within the margin is a contact, whatever the tolerance.
#[test]
fn fields_with_a_point_within_the_margin_are_in_contact() {
    let octahedron = Field::new(Octahedron::new(0.8).unwrap());
    let torus = Field::new(Torus::new(1.0, 0.3).unwrap());
    let bowl = Field::new(Bowl::new(1.0, 0.0, 0.2).unwrap());
    let cuboid = Field::new(Cuboid::new([0.5, 0.6, 0.7]).unwrap());
    let cases = [
        (&octahedron, &torus, [0.91938, 0.15163, 1.00008], [0.14, -0.55, -0.84, -0.47], 1e-3),
        (&octahedron, &torus, [0.91933, 0.15162, 1.00002], [0.14, -0.55, -0.84, -0.47], 0.01),
        (&bowl, &cuboid, [0.51917, -0.94192, -1.61253], [0.33, -0.22, 0.26, 0.94], 0.01),
    ];
    for (a, b, translate, rotate, tolerance) in cases {
        let poses = [None, Rigid::new(translate, rotate)];
        let found = a.overlap(b, &OverlapOptions { poses, tolerance, ..OverlapOptions::default() }).unwrap();
        let lowest = found.points.iter().chain(found.pieces.iter().map(|piece| &piece.point));
        let lowest = lowest.map(|point| point.value).fold(f64::INFINITY, f64::min);
        assert!(lowest <= 0.0 && found.verdict == OverlapVerdict::Contact, "{lowest}: {:?}", found.verdict);
        assert_eq!(found.deepest.unwrap().point.unwrap().value, lowest);
        assert_eq!(found.points[0].value, lowest);
    }
}

/// A plate that clears a floor by less than a cube, on two pins of unlike depth: the deepest point does not take the place of the other
/// pin's. On a ring, where one is as deep as the other, it does.
#[test]
fn the_deepest_point_is_added_beside_that_of_another_part() {
    let floor = Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    let pins = br#"[field]
        shape = "union"
        of = [
            { shape = "box", half_extents = [1.0, 1.0, 0.1], pose = { translation = [0.0, 0.0, 0.1005] } },
            { shape = "sphere", radius = 0.01, pose = { translation = [0.7, 0.7, 0.0] } },
            { shape = "sphere", radius = 0.012, pose = { translation = [-0.7, -0.6, 0.0] } },
        ]"#;
    let pins = Field::from_bytes(pins, "pins").unwrap();
    let found = pins.overlap(&floor, &OverlapOptions::default()).unwrap();
    let mut places: Vec<f64> = found.points.iter().map(|point| point.point.x).collect();
    places.sort_by(f64::total_cmp);
    assert!(places.len() == 2 && (places[0] + 0.7).abs() < 0.02 && (places[1] - 0.7).abs() < 0.02, "{places:?}");
    let ring = Field::new(Torus::new(1.0, 0.1).unwrap());
    let found = ring.overlap(&floor, &raised(0.09)).unwrap();
    assert_eq!(found.points.len(), 1);
}

/// A hundred balls on a floor: the minima take no more evaluations than they may, and say what that leaves out.
#[test]
fn no_search_takes_more_evaluations_than_its_budget() {
    let floor = Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    let ball = |index: usize| {
        format!(
            "{{ shape = \"sphere\", radius = 0.04, pose = {{ translation = [{:?}, {:?}, 0.0] }} }},",
            (index % 10) as f64 * 0.1,
            (index / 10) as f64 * 0.1
        )
    };
    let balls: String = (0..100).map(ball).collect();
    let balls = Field::from_bytes(format!("[field]\nshape = \"union\"\nof = [{balls}]\n").as_bytes(), "balls").unwrap();
    for evaluations in [0, 1, 100, 4096, 16_384, 1 << 16] {
        let found = balls.overlap(&floor, &OverlapOptions { evaluations, ..OverlapOptions::default() }).unwrap();
        let minima = found.minima.unwrap();
        assert!(minima.evaluations <= evaluations, "{evaluations}: {minima:?}");
        assert!(found.deepest.unwrap().evaluations <= evaluations + 98);
        assert!(found.patch.unwrap().evaluations <= evaluations + 98);
        assert_eq!(minima.is_complete, evaluations == 1 << 16, "{evaluations}: {minima:?}");
    }
}
