//! Few contacts in place of many: those that are left out sink no farther than is said, whatever small motion the others allow.

use nalgebra::{UnitQuaternion, Vector3};
use sdf_core::Float;
use sdf_core::contact::{Contact, ContactStatus, ElementKind, Feature, MAX_REDUCED, NO_VERTEX, Reduced, Reduction};
use sdf_tests::random::Random;

/// A vertex at a point, `gap` before the surface.
fn contact(element: u32, point: Vector3<f64>, normal: Vector3<f64>, gap: f64) -> Contact<f64> {
    Contact {
        kind: ElementKind::Vertex,
        element,
        vertices: [element, NO_VERTEX, NO_VERTEX],
        rank: 0,
        feature: Feature::Vertex(element),
        weights: [1.0, 0.0, 0.0],
        point,
        surface_point: point - normal * gap,
        normal,
        slope: 1.0,
        distance: gap,
        lower_bound: gap,
        error_bound: 0.0,
        shape_lower_bound: gap,
        evaluations: 1,
        status: ContactStatus::Converged,
    }
}

fn single(contact: &Contact<f64>) -> Contact<f32> {
    let Contact { kind, element, vertices, rank, feature, status, evaluations, .. } = *contact;
    let [slope, distance, lower_bound, error_bound, shape_lower_bound] =
        [contact.slope, contact.distance, contact.lower_bound, contact.error_bound, contact.shape_lower_bound]
            .map(|x| x as f32);
    let vector = |v: Vector3<f64>| v.map(|x| x as f32);
    let (point, surface_point, normal) = (vector(contact.point), vector(contact.surface_point), vector(contact.normal));
    let weights = contact.weights.map(|x| x as f32);
    Contact {
        kind,
        element,
        vertices,
        rank,
        feature,
        status,
        evaluations,
        weights,
        point,
        surface_point,
        normal,
        slope,
        distance,
        lower_bound,
        error_bound,
        shape_lower_bound,
    }
}

/// Deepest contacts of all scenes lie so deep, at most.
const DEPTH: f64 = 0.01;

/// A point and the normal there.
type Place = dyn Fn(&mut Random) -> (Vector3<f64>, Vector3<f64>);

/// Bodies that rest: on a plane, on three bumps, in a bowl, in a groove, on an edge, in a corner, and contacts that hold it from everywhere.
/// Turned and moved at random.
fn scenes(random: &mut Random) -> Vec<(&'static str, Vec<Contact<f64>>)> {
    let count = 400;
    let mut scene = |name, place: &Place| {
        let turn = UnitQuaternion::from_scaled_axis(random.in_cube(3.0));
        let (shift, noise) = (random.in_cube(5.0), random.pick(&[0.0, 0.1, 1.0]));
        let contacts = (0..count).map(|element| {
            let (point, normal) = place(random);
            let gap = DEPTH * random.between(-noise, 0.2 * noise);
            contact(element, turn * point + shift, turn * normal.normalize(), gap)
        });
        (name, contacts.collect::<Vec<_>>())
    };
    vec![
        scene("plane", &|random| {
            (Vector3::new(random.between(-1.0, 1.0), random.between(-0.4, 0.4), 0.0), Vector3::z())
        }),
        scene("bumps", &|random| {
            let center = random.pick(&[Vector3::x(), Vector3::y(), -Vector3::x()]);
            (center + random.in_cube(0.1), Vector3::z() + random.in_cube(0.3))
        }),
        scene("bowl", &|random| {
            let out = random.direction();
            let out = Vector3::new(out.x, out.y, -out.z.abs());
            (out, -out)
        }),
        scene("groove", &|random| {
            let side = random.pick(&[-1.0, 1.0]);
            (Vector3::new(random.between(-1.0, 1.0), 0.3 * side, 0.0), Vector3::new(0.0, -side, 1.0))
        }),
        scene("edge", &|random| (Vector3::new(random.between(-1.0, 1.0), 0.0, 0.0), Vector3::z())),
        scene("corner", &|random| (random.in_cube(1e-3), random.direction() + Vector3::repeat(1.0))),
        scene("everywhere", &|random| (random.in_cube(1.0), random.direction())),
    ]
}

fn reduce<R: Float>(contacts: &mut [Contact<R>], reduction: Reduction<R>) -> Reduced<R> {
    reduction.apply(contacts, &mut vec![R::from_f64(0.0); contacts.len()]).unwrap()
}

/// A way v and a turn ω about the center of the points.
#[derive(Clone, Copy)]
struct Motion {
    way: Vector3<f64>,
    turn: Vector3<f64>,
}

/// Center and arm of the box around the points, as the documentation of `Reduction::movement` has them.
fn center_and_arm(contacts: &[Contact<f64>]) -> (Vector3<f64>, f64) {
    let fold = |f: fn(f64, f64) -> f64, start: f64| {
        contacts.iter().fold(Vector3::repeat(start), |a, contact| a.zip_map(&contact.point, f))
    };
    let (min, max) = (fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY));
    ((min + max) / 2.0, (max - min).norm() / 2.0)
}

/// The gap of a contact after a motion, to first order, and its change by the way and the turn.
fn gap_after(contact: &Contact<f64>, center: Vector3<f64>, motion: &Motion) -> (f64, Motion) {
    let row = Motion { way: contact.normal, turn: (contact.point - center).cross(&contact.normal) };
    let gap = contact.normal.dot(&(contact.point - contact.surface_point));
    (gap + row.way.dot(&motion.way) + row.turn.dot(&motion.turn), row)
}

/// The motion that lets a contact sink far while those that are kept hold, by projection onto their half-spaces again and again.
fn sink(
    contact: &Contact<f64>,
    kept: &[Contact<f64>],
    center: Vector3<f64>,
    arm: f64,
    movement: f64,
) -> Option<Motion> {
    let (_, row) = gap_after(contact, center, &Motion { way: Vector3::zeros(), turn: Vector3::zeros() });
    let mut motion = Motion { way: -row.way * movement * 0.5, turn: -row.turn * (0.5 * movement / (arm * arm)) };
    for _ in 0..400 {
        for held in kept {
            let (gap, row) = gap_after(held, center, &motion);
            if gap < 0.0 {
                // In the metric in which a turn counts as its way at the arm.
                let length = row.way.norm_squared() + row.turn.norm_squared() / (arm * arm);
                motion.way -= row.way * (gap / length);
                motion.turn -= row.turn * (gap / (length * arm * arm));
            }
        }
    }
    let holds = kept.iter().all(|held| gap_after(held, center, &motion).0 > -1e-7);
    let is_small = motion.way.norm() + motion.turn.norm() * arm <= movement;
    (holds && is_small).then_some(motion)
}

#[test]
fn what_is_left_out_sinks_no_farther_than_the_shortfall() {
    let mut random = Random::seeded();
    let (mut tried, mut nearest) = (0, 0.0_f64);
    for round in 0..6 {
        for (name, mut contacts) in scenes(&mut random) {
            let movement = 4.0 * DEPTH;
            let count = [1, 3, 4, 6, 8, 16][round];
            let (center, arm) = center_and_arm(&contacts);
            let reduced = reduce(&mut contacts, Reduction { count, movement, thickness: 0.0 });
            let (kept, others) = contacts.split_at(reduced.count);
            let (mut motions, mut farthest) = (0, 0.0_f64);
            for other in others {
                if let Some(motion) = sink(other, kept, center, arm, movement) {
                    motions += 1;
                    farthest = others.iter().map(|other| -gap_after(other, center, &motion).0).fold(farthest, f64::max);
                }
            }
            nearest = nearest.max(farthest / reduced.shortfall);
            assert!(
                farthest <= reduced.shortfall + 1e-6,
                "{name}, {count}: {farthest} deep, not {}",
                reduced.shortfall
            );
            tried += motions;
        }
    }
    // The bound is no empty one: motions come near it.
    assert!(tried > 5000 && nearest > 0.5, "{tried} motions, {nearest} of the shortfall");
}

/// Names of what is kept.
fn names<R: Float>(kept: &[Contact<R>]) -> Vec<u32> {
    kept.iter().map(|contact| contact.element).collect()
}

#[test]
fn a_reduction_keeps_the_deepest_and_loses_none_in_any_order() {
    let mut random = Random::seeded();
    for (name, contacts) in scenes(&mut random) {
        let mut before: Vec<u32> = vec![];
        let mut last = f64::INFINITY;
        for count in [1, 2, 5, 9, 20, MAX_REDUCED] {
            let reduction = Reduction { count, movement: 2.0 * DEPTH, thickness: 1e-3 };
            let mut some = contacts.clone();
            let reduced = reduce(&mut some, reduction);
            let kept = names(&some[..reduced.count]);
            assert!(reduced.count <= count && kept.windows(2).all(|pair| pair[0] < pair[1]), "{name}: {kept:?}");
            let deepest = contacts.iter().min_by(|a, b| a.distance.total_cmp(&b.distance)).unwrap();
            assert!(some[..reduced.count].iter().any(|contact| contact.distance <= deepest.distance), "{name}");
            // More contacts are fewer ones and some more, and hold no worse: the least shortfall of a rest falls, and this is at most twice that.
            assert!(
                before.iter().all(|name| kept.contains(name)) && reduced.shortfall <= 2.0 * last,
                "{name}: {kept:?}"
            );
            (before, last) = (kept.clone(), reduced.shortfall);
            let mut all = names(&some);
            all.sort_unstable();
            assert_eq!(all, names(&contacts), "{name}: contacts are lost from the slice");
            random.shuffle(&mut some);
            let again = reduce(&mut some, reduction);
            assert_eq!((names(&some[..again.count]), again), (kept, reduced), "{name}: the order of contacts matters");
        }
    }
}

#[test]
fn few_contacts_hold_a_flat_face_whatever_its_scale_and_number_type() {
    let mut random = Random::seeded();
    for scale in [-400, -20, 0, 20, 400].map(|power| 2.0_f64.powi(power)) {
        let turn = UnitQuaternion::from_scaled_axis(random.in_cube(3.0));
        let place = |i: u32, j: u32| turn * Vector3::new(f64::from(i), f64::from(j), 0.0) * scale;
        let mut contacts: Vec<_> =
            (0..300).map(|id| contact(id, place(id % 20, id / 20), turn * Vector3::z(), -1e-3 * scale)).collect();
        let reduction = Reduction { count: 16, movement: 1e-2 * scale, thickness: 0.0 };
        // By rounding alone, any of the contacts is the deepest.
        let deepest = contacts.iter_mut().find(|contact| contact.element == 19).unwrap();
        deepest.distance *= 1.0 + 1e-6;
        let reduced = reduce(&mut contacts, reduction);
        assert_eq!(names(&contacts[..reduced.count]), [0, 19, 280, 299], "at {scale}");
        assert!(reduced.shortfall <= 1e-14 * scale, "{} at {scale}", reduced.shortfall / scale);
        if (-100.0..100.0).contains(&scale.log2()) {
            let mut contacts: Vec<_> = contacts.iter().map(single).collect();
            let Reduction { count, movement, .. } = reduction;
            let reduced = reduce(&mut contacts, Reduction { count, movement: movement as f32, thickness: 0.0 });
            let kept = names(&contacts[..reduced.count]);
            assert_eq!(kept, [0, 19, 280, 299], "in f32 at {scale}");
            // Rounding of points: 2⁻²⁴ of coordinates of 24, of normals and gaps; a movement is a hundredth.
            assert!(f64::from(reduced.shortfall) <= 1e-5 * scale, "{} in f32", reduced.shortfall);
        }
    }
}

#[test]
fn a_reduction_that_makes_no_sense_is_refused() {
    let point = |id: u32| contact(id, Vector3::new(f64::from(id), 0.0, 0.0), Vector3::z(), -0.1);
    let contacts: Vec<_> = (0..5).map(point).collect();
    let valid = Reduction { count: 2, movement: 0.1, thickness: 0.0 };
    let apply =
        |reduction: Reduction<f64>, scratch: usize| reduction.apply(&mut contacts.clone(), &mut vec![0.0; scratch]);
    assert!(apply(valid, 5).is_some());
    assert_eq!(apply(valid, 4), None);
    for count in [0, MAX_REDUCED + 1] {
        assert_eq!(apply(Reduction { count, ..valid }, 5), None);
    }
    for movement in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-310] {
        assert_eq!(apply(Reduction { movement, ..valid }, 5), None, "{movement}");
    }
    // Nothing is kept of nothing, nor of contacts without a normal.
    let none = Some(Reduced { count: 0, shortfall: 0.0 });
    assert_eq!(valid.apply(&mut [], &mut []), none);
    let mut free = [Contact { normal: Vector3::zeros(), ..point(0) }];
    assert_eq!(valid.apply(&mut free, &mut [0.0]), none);
}
