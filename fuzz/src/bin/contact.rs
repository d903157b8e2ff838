#![no_main]

use std::sync::Arc;

use sdf_core::combine::{Compound, Difference, Intersection, Offset, Shell, SmoothUnion};
use sdf_core::contact::{Contact, Element, Outcome, all_contacts, contact};
use sdf_core::grid::owned::{OwnedGrid, OwnedStorage};
use sdf_core::grid::{BlockBounds, Lattice};
use sdf_core::minimize::{
    AllMinima, Certified, FrankWolfe, Minimizer, Minimum, Newton, PointSampling, ProjectedGradient, SimplexCell,
};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placed, Similarity, Stretch};
use sdf_core::shapes::{
    Bowl, Capsule, Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Horseshoe, Octahedron, RoundedBox, Sphere, Torus,
};
use sdf_core::{AnyField, Interval, Simplex};
use sdf_fuzz::Numbers;

/// Levels of combinations.
const MAX_DEPTH: u32 = 3;

fn field(bytes: &mut Numbers, depth: u32) -> Option<AnyField> {
    let kind = bytes.byte() % if depth < MAX_DEPTH { 21 } else { 13 };
    let part = |bytes: &mut Numbers| field(bytes, depth + 1);
    Some(match kind {
        0 => Sphere::new(bytes.number())?.into(),
        1 => HalfSpace::new(bytes.numbers(), bytes.number())?.into(),
        2 => Cuboid::new(bytes.numbers())?.into(),
        3 => RoundedBox::new(bytes.numbers(), bytes.number())?.into(),
        4 => Capsule::new(bytes.numbers(), bytes.numbers(), bytes.number())?.into(),
        5 => Cylinder::new(bytes.number(), bytes.number())?.into(),
        6 => Cone::new(bytes.number(), bytes.number())?.into(),
        7 => Torus::new(bytes.number(), bytes.number())?.into(),
        8 => Octahedron::new(bytes.number())?.into(),
        9 => Ellipsoid::new(bytes.numbers())?.into(),
        10 => Bowl::new(bytes.number(), bytes.number(), bytes.number())?.into(),
        11 => {
            let [radius, thickness, bend, leg, depth] = bytes.numbers();
            Horseshoe::new(radius, thickness, bend, leg, depth)?.into()
        }
        12 => grid(bytes)?,
        13 => AnyField::Union(Compound::new(vec![part(bytes)?, part(bytes)?])?),
        14 => AnyField::Intersection(Box::new(Intersection(part(bytes)?, part(bytes)?))),
        15 => AnyField::Difference(Box::new(Difference(part(bytes)?, part(bytes)?))),
        16 => AnyField::SmoothUnion(Box::new(SmoothUnion::new(part(bytes)?, part(bytes)?, bytes.number())?)),
        17 => AnyField::Offset(Box::new(Offset::new(part(bytes)?, bytes.number())?)),
        18 => AnyField::Shell(Box::new(Shell::new(part(bytes)?, bytes.number())?)),
        19 => {
            let placement = Similarity::new(bytes.numbers(), bytes.numbers(), bytes.number())?;
            AnyField::Placed(Box::new(Placed { field: part(bytes)?, placement }))
        }
        _ => {
            let placement = Stretch::new(bytes.numbers())?;
            AnyField::Stretched(Box::new(Placed { field: part(bytes)?, placement }))
        }
    })
}

/// A dense grid of 27 samples, with bounds that hold.
fn grid(bytes: &mut Numbers) -> Option<AnyField> {
    let lattice = Lattice::new(bytes.numbers(), bytes.number(), [3, 3, 3])?;
    let samples: Vec<f32> = (0..27).map(|_| bytes.number() as f32).collect();
    if samples.iter().any(|sample| !sample.is_finite()) {
        return None;
    }
    let lower = samples.iter().copied().fold(f32::INFINITY, f32::min);
    let upper = samples.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let slope_bound = (2.0 * (f64::from(upper) - f64::from(lower)) / lattice.spacing()).max(1.0);
    let bounds = BlockBounds { range: Interval { lower, upper }, slope_bound: (slope_bound as f32).next_up() };
    if !bounds.slope_bound.is_finite() {
        return None;
    }
    let storage = OwnedStorage::dense(&lattice, samples, vec![bounds])?;
    Some(AnyField::Grid(Arc::new(OwnedGrid::new(lattice, storage, slope_bound)?)))
}

fn check(found: &Contact<f64>, margin: f64) {
    let vectors = [found.point, found.surface_point, found.normal];
    let numbers = [found.distance, found.slope];
    assert!(vectors.iter().flatten().chain(&numbers).all(|x| x.is_finite()), "{found:?}");
    assert!(
        !found.lower_bound.is_nan() && !found.error_bound.is_nan() && !found.shape_lower_bound.is_nan(),
        "{found:?}"
    );
    assert!(found.weights.iter().all(|weight| *weight >= 0.0), "{found:?}");
    assert!((found.weights.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{found:?}");
    assert!(found.distance <= margin, "{found:?}");
}

fn search<M: Minimizer<N>, const N: usize>(field: &AnyField, method: &M, margin: f64, element: &Element<f64, N>) {
    if let Outcome::Contact(found) = contact(field, method, margin, element) {
        check(&found, margin);
    }
}

fn search_element<const N: usize>(field: &AnyField, method: u8, margin: f64, corners: [[f64; 3]; N])
where
    PointSampling: Minimizer<N>,
{
    let element = Element {
        id: 0,
        vertices: std::array::from_fn(|i| i as u32),
        simplex: Simplex { corners: corners.map(Vector3::from) },
    };
    let certified = Certified { evaluations: 64, ..Certified::default() };
    match method % 6 {
        0 => search(field, &FrankWolfe::default(), margin, &element),
        1 => search(field, &ProjectedGradient::default(), margin, &element),
        2 => search(field, &Newton::default(), margin, &element),
        3 => search(field, &PointSampling { samples: 16, corners: true }, margin, &element),
        4 => search(field, &certified, margin, &element),
        _ => {
            let search = AllMinima { search: certified, max_cells: 256, ..AllMinima::default() };
            let (mut cells, mut minima) = (vec![SimplexCell::default(); 256], vec![Minimum::default(); 16]);
            all_contacts(field, &search, margin, &element, &mut cells, &mut minima, |found| check(found, margin));
        }
    }
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    sdf_fuzz::limited(bytes, || {
        let mut numbers = Numbers(bytes);
        let [kind, method] = [numbers.byte(), numbers.byte()];
        let margin = numbers.number();
        let corners: [[f64; 3]; 3] = std::array::from_fn(|_| numbers.numbers());
        let Some(field) = field(&mut numbers, 0) else { return };
        let [a, b, c] = corners;
        match kind % 3 {
            0 => search_element(&field, method, margin, [a]),
            1 => search_element(&field, method, margin, [a, b]),
            _ => search_element(&field, method, margin, [a, b, c]),
        }
    });
});
