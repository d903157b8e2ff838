use std::cell::Cell;
use std::vec::Vec;

use nalgebra::Vector3;

use super::*;
use crate::combine::Compound;
use crate::minimize::{FrankWolfe, Minimizer, Minimum, Newton, ProjectedGradient};
use crate::placed::{Placed, Posed, Rigid, Similarity};
use crate::shapes::{Cuboid, Sphere, Torus};
use crate::{Aabb, EnclosedSdf, Lanes, Sample, Sdf, Simplex, delegate_sdf};

#[derive(Clone)]
enum Shape {
    Ball(Sphere),
    Block(Cuboid),
    Ring(Torus),
}

delegate_sdf!(Shape { Ball, Block, Ring });

/// A field without what it knows of its parts.
struct Whole<F>(F);

impl<F: Sdf> Sdf for Whole<F> {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.0.evaluate(point)
    }
    fn bounds(&self, level: f64) -> Aabb {
        self.0.bounds(level)
    }
    fn slope_bound(&self) -> f64 {
        self.0.slope_bound()
    }
    fn magnitude<R: Real>(&self) -> R {
        self.0.magnitude()
    }
    fn extent<R: Real>(&self) -> R {
        self.0.extent()
    }
}

impl<F: Sdf> EnclosedSdf for Whole<F> {}

/// A true distance that knows the box around its surface, and counts its evaluations.
struct Boxed<F> {
    field: F,
    evaluations: Cell<u32>,
}

impl<F: Sdf> Sdf for Boxed<F> {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.evaluations.set(self.evaluations.get() + 1);
        self.field.evaluate(point)
    }
    fn bounds(&self, level: f64) -> Aabb {
        self.field.bounds(level)
    }
    fn slope_bound(&self) -> f64 {
        self.field.slope_bound()
    }
    fn magnitude<R: Real>(&self) -> R {
        self.field.magnitude()
    }
    fn extent<R: Real>(&self) -> R {
        self.field.extent()
    }
    fn lowest_about<R: Real>(&self, point: Vector3<R>) -> R {
        let Aabb { min, max } = self.bounds(0.0);
        let [x, y, z] = [0, 1, 2].map(|k| (R::from_f64(min[k]) - point[k]).max(point[k] - R::from_f64(max[k])));
        x.max(y).max(z)
    }
}

impl<F: EnclosedSdf> EnclosedSdf for Boxed<F> {}

fn boxed<F>(parts: Vec<F>) -> Vec<Boxed<F>> {
    parts.into_iter().map(|field| Boxed { field, evaluations: Cell::new(0) }).collect()
}

/// Numbers from −1 to 1 (Marsaglia 2003, "Xorshift RNGs").
struct Random(u32);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        f64::from(self.0) / f64::from(u32::MAX) * 2.0 - 1.0
    }

    fn point(&mut self, size: f64) -> [f64; 3] {
        [0; 3].map(|_| self.next() * size)
    }

    /// Shapes about `center`. Some are there twice, so that they are equal everywhere.
    fn parts(&mut self, count: usize, center: [f64; 3]) -> Vec<Placed<Shape, Similarity>> {
        let part = |index: usize, random: &mut Self| {
            let size = 0.3 + 0.1 * random.next();
            let field = match index % 3 {
                0 => Shape::Ball(Sphere::new(size).unwrap()),
                1 => Shape::Block(Cuboid::new([size, 0.5 * size, 2.0 * size]).unwrap()),
                _ => Shape::Ring(Torus::new(size, 0.3 * size).unwrap()),
            };
            let translation = Vector3::from(random.point(2.0)) + Vector3::from(center);
            let rotation = [random.next(), random.next(), random.next(), 1.1];
            (field, Similarity::new(translation.into(), rotation, 1.0 + 0.5 * random.next()).unwrap())
        };
        let seed = self.0;
        let mut parts = Vec::new();
        for index in 0..count {
            if index % 7 == 6 {
                *self = Self(seed);
            }
            let (field, placement) = part(index % 6, self);
            parts.push(Placed { field, placement });
        }
        parts
    }

    fn triangle(&mut self, size: f64, center: [f64; 3]) -> Simplex<f32, 3> {
        let middle = Vector3::from(self.point(3.0)) + Vector3::from(center);
        Simplex { corners: [0; 3].map(|_| (middle + Vector3::from(self.point(size))).map(|x| x as f32)) }
    }
}

fn search<F: EnclosedSdf, R: Real>(field: &F, simplex: &Simplex<R, 3>) -> [Minimum<R, 3>; 3] {
    [
        FrankWolfe::default().minimize(field, simplex),
        ProjectedGradient::default().minimize(field, simplex),
        Newton::default().minimize(field, simplex),
    ]
}

/// Searches of triangles of several sizes about `center`, with what is known of the parts and without.
fn check<F: EnclosedSdf>(field: &F, center: [f64; 3], random: &mut Random) {
    check_against(field, &Whole(field), center, random);
}

fn check_against(field: &impl EnclosedSdf, whole: &impl EnclosedSdf, center: [f64; 3], random: &mut Random) {
    for round in 0..60 {
        let size = [0.02, 0.2, 2.0][round % 3];
        let simplices = [0; 4].map(|_| random.triangle(size, center));
        for simplex in &simplices {
            assert_eq!(search(field, simplex), search(whole, simplex));
            let double = Simplex { corners: simplex.corners.map(|corner| corner.map(f64::from)) };
            assert_eq!(search(field, &double), search(whole, &double));
        }
        let lanes = |k: usize, axis: usize| Lanes(simplices.map(|simplex| simplex.corners[k][axis]));
        let corners = [0, 1, 2].map(|k| Vector3::new(lanes(k, 0), lanes(k, 1), lanes(k, 2)));
        assert_eq!(search(field, &Simplex { corners }), search(whole, &Simplex { corners }));
    }
}

#[test]
fn a_search_has_the_same_bits_without_the_parts_that_cannot_be_the_minimum() {
    let mut random = Random(7);
    for count in [1, 2, 5, 32, 33, 70] {
        check(&Compound::new(random.parts(count, [0.0; 3])).unwrap(), [0.0; 3], &mut random);
    }
}

#[test]
fn so_it_has_where_the_union_is_placed_far_from_its_own_frame() {
    let mut random = Random(11);
    for far in [0.0, 1e3, 1e5] {
        let center = [far, -far, 0.5 * far];
        let pose = Rigid::new(center, [0.5, -0.1, 0.2, 0.9]).unwrap();
        let union = Compound::new(random.parts(9, [0.0; 3])).unwrap();
        check(&Posed { field: &union, pose: Some(pose) }, center, &mut random);
        check(&Posed { field: &union, pose: None::<Rigid> }, [0.0; 3], &mut random);
        let placement = Similarity::new(center, [0.0, 0.3, 0.2, 0.9], 0.25).unwrap();
        check(&Placed { field: &union, placement }, center, &mut random);
        check(&Compound::new(random.parts(9, center)).unwrap(), center, &mut random);
    }
}

/// Near a part and far from all, in the frame of the union and far from its origin.
#[test]
fn parts_that_know_their_box_are_passed_over_without_another_bit() {
    let mut random = Random(17);
    for (count, far) in [(2, 0.0), (9, 0.0), (33, 0.0), (70, 0.0), (9, 1e3), (9, 1e5)] {
        let center = [far, -far, 0.5 * far];
        let parts = random.parts(count, center);
        let (plain, knowing) = (Compound::new(parts.clone()).unwrap(), Compound::new(boxed(parts)).unwrap());
        check_against(&knowing, &Whole(&plain), center, &mut random);
        for size in [1.0, 3.0, 30.0] {
            for _ in 0..300 {
                let point = Vector3::from(random.point(size)) + Vector3::from(center);
                assert_eq!(knowing.evaluate(point), plain.evaluate(point));
                assert_eq!(knowing.value(point), plain.value(point));
                let point = point.map(|x| x as f32);
                assert_eq!(knowing.evaluate(point), plain.evaluate(point));
            }
        }
    }
}

#[test]
fn few_parts_that_know_their_box_are_evaluated() {
    let mut random = Random(19);
    let union = Compound::new(boxed(random.parts(30, [0.0; 3]))).unwrap();
    let rounds = 100;
    for _ in 0..rounds {
        union.value(Vector3::from(random.point(2.0)));
    }
    let evaluated: u32 = union.parts().iter().map(|part| part.evaluations.get()).sum();
    assert!(evaluated < 10 * rounds, "{evaluated} of {}", 30 * rounds);
}

#[test]
fn few_parts_are_left_on_a_small_element() {
    let mut random = Random(13);
    let union = Compound::new(random.parts(30, [0.0; 3])).unwrap();
    let (mut left, rounds) = (0, 100);
    for _ in 0..rounds {
        let simplex = random.triangle(0.01, [0.0; 3]);
        let mut near = NearParts::default();
        for corner in simplex.corners {
            union.narrow(corner, simplex.longest_edge(), &mut near);
        }
        left += near.parts.0.count_ones();
    }
    assert!(left < 4 * rounds, "{left} of {}", 30 * rounds);
}

/// Twice as steep as it says.
struct Steep;

impl Sdf for Steep {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        Sample::new(point.x * R::from_f64(2.0), Vector3::x() * R::from_f64(2.0))
    }
    fn bounds(&self, _level: f64) -> Aabb {
        Aabb::EVERYWHERE
    }
    fn slope_bound(&self) -> f64 {
        1.0
    }
}

impl EnclosedSdf for Steep {}

#[test]
fn a_part_is_left_of_fields_that_are_steeper_than_they_say() {
    let union = Compound::new([Steep, Steep].as_slice()).unwrap();
    let mut near = NearParts::default();
    for x in [1.0_f32, 9.0] {
        assert_eq!(union.narrow(Vector3::new(x, 0.0, 0.0), 1.0, &mut near).value, 2.0 * x);
    }
    assert_eq!(union.evaluate_near(Vector3::new(5.0_f32, 0.0, 0.0), &near).value, 10.0);
}

#[test]
fn a_value_that_is_not_finite_excludes_nothing() {
    let balls = [1.0, 0.5].map(|radius| Sphere::new(radius).unwrap());
    let union = Compound::new(&balls[..]).unwrap();
    let (mut near, radius) = (NearParts::default(), 0.1_f32);
    union.narrow(Vector3::new(f32::NAN, 0.0, 0.0), radius, &mut near);
    assert_eq!(near, NearParts::default());
    union.narrow(Vector3::new(3.0, 0.0, 0.0), radius, &mut near);
    assert_eq!(near.parts, PartSet(1));
}
