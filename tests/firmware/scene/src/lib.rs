//! One contact of a triangle with a grid in read-only memory, found in f32 by two methods, and the lines that report it.
//!
//! Host and board must print the same bytes. The lines are written without `core::fmt`, which can panic: so a panic in the board's
//! program comes from the contact.

#![no_std]
#![forbid(unsafe_code)]

pub mod page;

use core::hint::black_box;

use page::Page;
use sdf_core::Simplex;
use sdf_core::contact::{Contact, ContactStatus, Element, Feature, Outcome, contact};
use sdf_core::grid::{Dense, Grid, Lattice};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer};
use sdf_core::nalgebra::Vector3;

include!(concat!(env!("OUT_DIR"), "/grid.rs"));

/// √3, rounded up. A true distance changes by at most the spacing from node to node along each axis, so each partial derivative of
/// its interpolant is at most 1.
const SLOPE_BOUND: f64 = 1.7321;

/// One corner is outside the grid, two are near the shape, and the deepest point is inside the face.
const TRIANGLE: [[f32; 3]; 3] = [[0.7, 0.05, 0.3], [-0.35, 0.45, 0.1], [-0.2, -0.4, 0.15]];

/// Writes the outcome of both searches, byte by byte.
pub fn report(out: impl FnMut(u8)) {
    let mut page = Page(out);
    report_one(&mut page, triangle_contact(&FrankWolfe::default()));
    page.text("certified: ");
    report_one(&mut page, triangle_contact(&Certified { evaluations: 128, ..Certified::default() }));
}

fn report_one(page: &mut Page<impl FnMut(u8)>, outcome: Option<Outcome<f32, 3>>) {
    match outcome {
        None => page.text("the grid was refused\n"),
        Some(Outcome::NotFinite) => page.text("not finite\n"),
        Some(Outcome::Culled) => page.text("culled\n"),
        Some(Outcome::Separated(minimum)) => page.numbers("separated", &[minimum.sample.value]),
        Some(Outcome::Contact(contact)) => write_contact(page, &contact),
    }
}

fn triangle_contact(minimizer: &impl Minimizer<3>) -> Option<Outcome<f32, 3>> {
    let lattice = Lattice::new(ORIGIN, SPACING, [NODES; 3])?;
    let grid = Grid::new(lattice, Dense::new(&lattice, &SAMPLES)?, SLOPE_BOUND)?;
    // With known corners the compiler could compute the contact itself.
    let corners = black_box(TRIANGLE).map(Vector3::from);
    let element = Element { id: 17, vertices: [3, 5, 8], simplex: Simplex { corners } };
    Some(contact(&grid, minimizer, 0.0, &element))
}

fn write_contact(page: &mut Page<impl FnMut(u8)>, contact: &Contact<f32>) {
    page.text(match contact.status {
        ContactStatus::Converged => "converged",
        ContactStatus::BudgetSpent => "budget spent",
        ContactStatus::OutsideGrid => "outside the grid",
        ContactStatus::BeyondBand => "beyond the band",
        ContactStatus::Possible => "possible",
        ContactStatus::DegenerateGradient => "degenerate gradient",
    });
    page.integer(" after", contact.evaluations);
    page.text(" evaluations\n");
    match contact.feature {
        Feature::Vertex(vertex) => page.integer("vertex", vertex),
        Feature::Edge([a, b]) => {
            page.integer("edge", a);
            page.integer("", b);
        }
        Feature::Face(face) => page.integer("face", face),
    }
    page.integer(" of element", contact.element);
    page.text(" key ");
    page.bits((contact.key() >> 32) as u32);
    page.bits(contact.key() as u32);
    page.text("\n");
    page.numbers("distance", &[contact.distance]);
    page.numbers("lower bound", &[contact.lower_bound]);
    page.numbers("weights", &contact.weights);
    page.numbers("point", contact.point.as_slice());
    page.numbers("surface point", contact.surface_point.as_slice());
    page.numbers("normal", contact.normal.as_slice());
}
