//! Tiny, huge and remote scenes, elements much smaller or larger than the body, and stretched axes.

use nalgebra::Vector3;
use sdf_core::Sdf;

use super::{all_with, random};
use crate::random::Random;
use crate::stability::bodies::{Body, all_bodies};

pub fn micrometres() -> Vec<Body> {
    all_bodies(1e-6, 3, &mut random())
}

pub fn megametres() -> Vec<Body> {
    all_bodies(1e6, 3, &mut random())
}

fn away(distance: f64) -> Vec<Body> {
    let direction = Vector3::new(1.0, -1.0, 1.0);
    all_bodies(1.0, 3, &mut random()).into_iter().map(|body| body.moved(direction * distance)).collect()
}

pub fn thousand_diagonals_away() -> Vec<Body> {
    away(2e3)
}

pub fn ten_million_diagonals_away() -> Vec<Body> {
    away(2e7)
}

pub fn small_elements() -> Vec<Body> {
    let mut random = random();
    let on_surface = |body: Body, random: &mut Random| {
        let mut elements = vec![];
        while elements.len() < 3 {
            // Newton steps along the gradient towards the surface.
            let mut point = random.in_cube(body.largest_length);
            for _ in 0..20 {
                let sample = body.field.evaluate(point);
                point -= sample.gradient * (sample.value / sample.gradient.norm_squared().max(1e-3));
            }
            if point.iter().all(|x| x.abs() < 2.0 * body.largest_length) {
                elements.push([(); 3].map(|()| point + random.in_cube(0.5e-5 * body.largest_length)));
            }
        }
        body.with(elements)
    };
    all_bodies(1.0, 1, &mut random).into_iter().map(|body| on_surface(body, &mut random)).collect()
}

/// The same, moved so that the element's coordinates are far smaller than the field's.
pub fn small_elements_at_the_origin() -> Vec<Body> {
    let to_origin = |body: Body| {
        let first = body.elements[0][0];
        body.moved(-first)
    };
    small_elements().into_iter().map(to_origin).collect()
}

pub fn large_elements() -> Vec<Body> {
    all_with(1.0, |corners, random| {
        // Corners in three directions from the origin, so that the interior of the element covers the body.
        let turn = random.between(0.0, 2.0);
        for (k, corner) in (0_u8..).zip(corners) {
            let angle = turn + f64::from(k) * 2.1;
            *corner = Vector3::new(angle.cos(), angle.sin(), random.between(-3e-4, 3e-4)) * 1e3;
        }
    })
}

pub fn stretched() -> Vec<Body> {
    all_bodies(1.0, 3, &mut random()).into_iter().map(|body| body.stretched([0.1, 1.0, 7.0])).collect()
}

pub fn mirrored() -> Vec<Body> {
    all_bodies(1.0, 3, &mut random()).into_iter().map(|body| body.stretched([-1.0, 1.0, -2.0])).collect()
}
