//! Contacts several at a time equal contacts one at a time, bit for bit.

use nalgebra::Vector3;
use pulp::{Arch, NullaryFnOnce};
use sdf_core::contact::batch::{CullReason, Survivor};
use sdf_core::contact::{Contact, Element, Outcome, batch, contact, lean_contact_at};
use sdf_core::grid::PlainNormals;
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer, Minimum, PointSampling, ProjectedGradient};
use sdf_core::placed::{Posed, Rigid};
use sdf_core::shapes::Cuboid;
use sdf_core::{EnclosedSdf, Float, Real, Simplex};
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::{cast, element, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{cube_lattice, sampled, scenes, with_block_bounds};

/// A method that runs in lanes, even where that does not pay.
#[derive(Debug)]
struct InLanes(Method);

macro_rules! in_lanes {
    ($($corners:literal),*) => {$(
        impl Minimizer<$corners> for InLanes {
            const LOCKSTEP: bool = true;
            fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, $corners>) -> Minimum<R, $corners> {
                self.0.minimize(field, simplex)
            }

            fn quick_pass(&self) -> Option<Self> {
                Minimizer::<$corners>::quick_pass(&self.0).map(Self)
            }

            fn minimize_below<R: Real, F: EnclosedSdf>(
                &self,
                field: &F,
                simplex: &Simplex<R, $corners>,
                level: R,
            ) -> Minimum<R, $corners> {
                self.0.minimize_below(field, simplex, level)
            }
        }
    )*};
}

in_lanes!(1, 2, 3);

/// Everything that an outcome reports, numbers as bits.
fn bits<R: Float, const N: usize>(outcome: &Outcome<R, N>) -> String {
    let bits = |numbers: &[R]| numbers.iter().map(|x| x.to_f64().to_bits()).collect::<Vec<_>>();
    match outcome {
        Outcome::NotFinite => "not finite".to_owned(),
        Outcome::Culled => "culled".to_owned(),
        Outcome::Separated(Minimum { weights, point, sample, lower_bound, evaluations, converged }) => {
            let numbers = [&weights[..], point.as_slice(), sample.gradient.as_slice()].map(bits);
            format!(
                "{numbers:?} {:?} {:?} {converged}",
                bits(&[sample.value, *lower_bound, *evaluations]),
                sample.status
            )
        }
        Outcome::Contact(contact) => {
            let Contact { kind, element, rank, feature, evaluations, status, .. } = contact;
            let Contact { weights, point, surface_point, normal, distance, lower_bound, .. } = contact;
            let vectors = [point.as_slice(), surface_point.as_slice(), normal.as_slice(), &weights[..]].map(bits);
            let names = format!("{kind:?} {element} {rank} {feature:?} {evaluations} {status:?}");
            format!("{names} {vectors:?} {:?}", bits(&[*distance, *lower_bound]))
        }
    }
}

/// Random elements, among them degenerate, remote and invalid ones.
fn elements<R: Float, const N: usize>(random: &mut Random, size: f64, count: usize) -> Vec<Element<R, N>> {
    let random_element = |id: usize| {
        let mut simplex: Simplex<f64, N> = random_simplex(random, size);
        match id % 11 {
            3 => simplex.corners[id % N].x = f64::NAN,
            5 => simplex.corners[id % N].y = f64::INFINITY,
            6 => simplex.corners = [simplex.corners[0]; N],
            7 => simplex.corners.iter_mut().for_each(|corner| *corner += Vector3::repeat(1e3 * size)),
            8 => simplex.corners[id % N].z = 1e30,
            _ => {}
        }
        element(id as u32, cast(&simplex))
    };
    (0..count).map(random_element).collect()
}

fn batch_equals_alone<R: Float, M: Minimizer<N> + std::fmt::Debug, const N: usize, const L: usize>(
    field: &impl EnclosedSdf,
    method: &M,
    margin: f64,
    elements: &[Element<R, N>],
    name: &str,
) {
    let mut batched = vec![None; elements.len()];
    batch::contacts::<_, _, _, _, N, L>(field, method, R::from_f64(margin), elements, |index, outcome| {
        assert!(batched[index].replace(outcome).is_none(), "{name}: two outcomes of element {index}");
    });
    let (mut in_two_steps, mut survivors, mut minima) = (vec![], vec![], 0);
    batch::cull::<_, _, _, N, L>(field, R::from_f64(margin), elements, |place, culled| match culled {
        Ok(lower_bound) => survivors.push(Survivor { index: place, lower_bound }),
        Err(CullReason::Culled) => in_two_steps.push((place, Outcome::Culled)),
        Err(CullReason::NotFinite) => in_two_steps.push((place, Outcome::NotFinite)),
    });
    batch::search::<_, _, _, _, N, L>(field, method, R::from_f64(margin), elements, &survivors, |index, outcome| {
        in_two_steps.push((survivors[index].index, outcome));
    });
    batch::minima::<_, _, _, _, N, L>(field, method, R::from_f64(margin), elements, &survivors, |index, minimum| {
        let Survivor { index, lower_bound } = survivors[index];
        let alone = method.minimize_below(field, &elements[index].simplex, R::from_f64(margin));
        let [lean, alone] = [minimum, &alone].map(|minimum| {
            lean_contact_at(&PlainNormals(field), R::from_f64(margin), &elements[index], minimum, lower_bound)
        });
        assert_eq!(bits(&lean), bits(&alone), "{name} by {method:?}: lean contacts");
        minima += 1;
    });
    assert_eq!(minima, survivors.len());
    in_two_steps.sort_by_key(|(place, _)| *place);
    assert!(in_two_steps.iter().map(|(place, _)| *place).eq(0..elements.len()), "{name}: not one outcome each");
    for ((_, outcome), batched) in in_two_steps.iter().zip(&batched) {
        assert_eq!(batched.as_ref().map(bits), Some(bits(outcome)), "{name} by {method:?}, cull and search apart");
    }
    for (element, outcome) in elements.iter().zip(batched) {
        let outcome = outcome.unwrap_or_else(|| panic!("{name}: no outcome of {element:?}"));
        let alone = contact(field, method, R::from_f64(margin), element);
        assert_eq!(bits(&alone), bits(&outcome), "{name} by {method:?}, margin {margin}: {element:?}");
    }
}

fn every_field_and_method<R: Float, const N: usize, const L: usize>()
where
    Method: Minimizer<N>,
    InLanes: Minimizer<N>,
{
    let mut random = Random::seeded();
    for scene in scenes(1.0) {
        for (index, method) in methods(N, 12).into_iter().enumerate() {
            for margin in [0.3 * scene.size, -0.1 * scene.size, if index == 0 { f64::NAN } else { 0.0 }] {
                let elements = elements::<R, N>(&mut random, scene.size, 4 * L + 3 + index);
                batch_equals_alone::<R, _, N, L>(&scene.field, &InLanes(method), margin, &elements, scene.name);
                batch_equals_alone::<R, _, N, L>(&scene.field, &method, margin, &elements, scene.name);
            }
        }
    }
}

#[test]
fn contacts_in_lanes_are_those_of_one_at_a_time_bit_for_bit_in_f32() {
    every_field_and_method::<f32, 1, 8>();
    every_field_and_method::<f32, 2, 8>();
    every_field_and_method::<f32, 3, 8>();
}

#[test]
fn contacts_in_lanes_are_those_of_one_at_a_time_bit_for_bit_in_f64() {
    every_field_and_method::<f64, 1, 4>();
    every_field_and_method::<f64, 2, 4>();
    every_field_and_method::<f64, 3, 4>();
}

#[test]
fn any_number_of_lanes_and_elements_gives_the_same_contacts() {
    let mut random = Random::seeded();
    let body = Cuboid::new([0.5, 0.4, 0.3]).unwrap();
    let grid = with_block_bounds(sampled(&body, cube_lattice(1.0, 20), 1.0));
    let fixed = FrankWolfe { tolerance: -1.0, ..FrankWolfe::default() };
    for count in [0, 1, 2, 7, 8, 9, 31, 64, 128, 129, 400] {
        let elements = elements::<f64, 3>(&mut random, 1.0, count);
        // Few are within the smaller margin, and nearly all within the larger one.
        for (method, margin) in [(FrankWolfe::default(), 0.1), (fixed, 0.1), (FrankWolfe::default(), 10.0)] {
            batch_equals_alone::<_, _, 3, 1>(&grid, &method, margin, &elements, "1 lane");
            batch_equals_alone::<_, _, 3, 3>(&grid, &method, margin, &elements, "3 lanes");
            batch_equals_alone::<_, _, 3, 8>(&grid, &method, margin, &elements, "8 lanes");
            batch_equals_alone::<_, _, 3, 16>(&grid, &method, margin, &elements, "16 lanes");
        }
    }
}

/// Eight far elements of a grid are culled by one look at the box around them, unless one of them is near or not finite.
#[test]
fn far_elements_side_by_side_are_culled_and_what_is_among_them_is_not() {
    let body = Cuboid::new([0.5, 0.4, 0.3]).unwrap();
    let grid = with_block_bounds(sampled(&body, cube_lattice(1.0, 20), 1.0));
    let pose = Rigid::new([0.3, -0.2, 0.1], [0.1, 0.2, -0.3, 0.9]).unwrap();
    let around = |center: Vector3<f64>| {
        let corners = [0, 1, 2].map(|axis| center + Vector3::ith(axis, 0.02));
        move |id: u32| element(id, Simplex { corners })
    };
    let (far, outside) = (around(Vector3::repeat(0.9)), around(Vector3::repeat(1.5)));
    let (near, unknown) = (around(Vector3::new(0.5, 0.1, 0.1)), around(Vector3::new(0.9, f64::NAN, 0.9)));
    for stranger in [near, unknown, outside] {
        // In each of the eight lanes, then in none of the last group.
        let elements: Vec<_> = (0..72).map(|id| if id % 9 == 0 { stranger(id) } else { far(id) }).collect();
        for pose in [None, Some(pose)] {
            let field = Posed { field: &grid, pose };
            batch_equals_alone::<_, _, 3, 8>(&field, &FrankWolfe::default(), 0.0, &elements, "far elements");
            batch_equals_alone::<_, _, 3, 8>(&field, &FrankWolfe::default(), f64::NAN, &elements, "no margin");
        }
    }
}

/// Certified search stops as soon as it is certain that no value is within the margin.
#[test]
fn a_search_that_may_stop_at_the_margin_stops_at_the_same_point_in_lanes() {
    let mut random = Random::seeded();
    let body = Cuboid::new([0.5, 0.4, 0.3]).unwrap();
    let grid = with_block_bounds(sampled(&body, cube_lattice(1.0, 20), 1.0));
    for margin in [-0.2, -0.05, 0.0, 0.1] {
        let elements = elements::<f64, 3>(&mut random, 0.3, 500);
        batch_equals_alone::<_, _, 3, 8>(&grid, &Certified::default(), margin, &elements, "at the margin");
    }
}

/// Contacts of a batch, compiled for an instruction set.
struct Batch<'a, F, M> {
    field: &'a F,
    method: &'a M,
    elements: &'a [Element<f64, 3>],
}

impl<F: EnclosedSdf, M: Minimizer<3>> NullaryFnOnce for Batch<'_, F, M> {
    type Output = Vec<(usize, Outcome<f64, 3>)>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let mut outcomes = vec![];
        let visit = |index, outcome| outcomes.push((index, outcome));
        batch::contacts::<_, _, _, _, 3, 8>(self.field, self.method, MARGIN, self.elements, visit);
        outcomes
    }
}

const MARGIN: f64 = 0.1;

/// Every instruction set of this processor.
fn instruction_sets() -> Vec<Arch> {
    let mut sets = vec![Arch::Scalar, Arch::new()];
    #[cfg(target_arch = "x86_64")]
    sets.extend(pulp::x86::V3::try_new().map(Arch::V3));
    sets
}

fn every_instruction_set_equals_alone<F: EnclosedSdf, M: Minimizer<3> + std::fmt::Debug>(field: &F, method: &M) {
    let elements = elements::<f64, 3>(&mut Random::seeded(), 0.5, 400);
    for set in instruction_sets() {
        let outcomes = set.dispatch(Batch { field, method, elements: &elements });
        assert_eq!(outcomes.len(), elements.len());
        for (index, outcome) in outcomes {
            let alone = contact(field, method, MARGIN, &elements[index]);
            assert_eq!(bits(&alone), bits(&outcome), "{set:?} by {method:?}: {:?}", elements[index]);
        }
    }
}

#[test]
fn every_instruction_set_gives_the_same_contacts() {
    let body = Cuboid::new([0.5, 0.4, 0.3]).unwrap();
    let grid = with_block_bounds(sampled(&body, cube_lattice(1.0, 20), 1.0));
    every_instruction_set_equals_alone(&grid, &FrankWolfe::default());
    every_instruction_set_equals_alone(&grid, &FrankWolfe { tolerance: -1.0, ..FrankWolfe::default() });
    every_instruction_set_equals_alone(&grid, &ProjectedGradient::default());
    every_instruction_set_equals_alone(&grid, &PointSampling::default());
    every_instruction_set_equals_alone(&grid, &Certified::default());
}
