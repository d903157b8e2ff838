//! Solids of revolution: a profile curve (radius, z) of t in 0 … 1, turned around the z axis.

use std::f64::consts::{PI, TAU};

use serde::Deserialize;

use crate::Mesh;

/// A closed surface of `2 · slices · (stacks − 1)` triangles, its points on rings between two poles.
fn revolve(slices: u32, stacks: u32, profile: impl Fn(f64) -> [f64; 2]) -> Mesh {
    let mut points = Vec::new();
    let pole = |t| [0.0, 0.0, profile(t)[1]];
    points.push(pole(0.0));
    for ring in 1..stacks {
        let [radius, z] = profile(f64::from(ring) / f64::from(stacks));
        for step in 0..slices {
            let (sin, cos) = (TAU * f64::from(step) / f64::from(slices)).sin_cos();
            points.push([radius * cos, radius * sin, z]);
        }
    }
    points.push(pole(1.0));
    let last = points.len() as u32 - 1;
    let on_ring = |ring: u32, step: u32| 1 + ring * slices + step % slices;
    let mut triangles = Vec::new();
    for step in 0..slices {
        triangles.push([0, on_ring(0, step + 1), on_ring(0, step)]);
        for ring in 1..stacks - 1 {
            let (a, b) = (on_ring(ring - 1, step), on_ring(ring - 1, step + 1));
            let (c, d) = (on_ring(ring, step + 1), on_ring(ring, step));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        triangles.push([on_ring(stacks - 2, step), on_ring(stacks - 2, step + 1), last]);
    }
    Mesh { points, triangles, segments: Vec::new() }
}

/// Half of a hollow ball, open upwards, with a rounded edge. Radius 1, measured to the middle of the wall.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Bowl {
    /// Points on a ring.
    #[serde(rename = "around")]
    pub slices: u32,
    /// Steps along the profile.
    #[serde(rename = "along")]
    pub stacks: u32,
    pub thickness: f64,
}

impl Bowl {
    pub fn mesh(&self) -> Mesh {
        let half = 0.5 * self.thickness;
        let (outer, inner) = ((1.0 + half) * 0.5 * PI, (1.0 - half) * 0.5 * PI);
        let edge = half * PI;
        let all = outer + edge + inner;
        revolve(self.slices.max(3), self.stacks.max(3), |t| {
            let arc = t * all;
            if arc <= outer {
                let (sin, cos) = (arc / (1.0 + half)).sin_cos();
                [(1.0 + half) * sin, -(1.0 + half) * cos]
            } else if arc <= outer + edge {
                let (sin, cos) = ((arc - outer) / half).sin_cos();
                [1.0 + half * cos, half * sin]
            } else {
                let (sin, cos) = ((all - arc) / (1.0 - half)).sin_cos();
                [(1.0 - half) * sin, -(1.0 - half) * cos]
            }
        })
    }
}

/// A round pot of radius about 1 with a knob on its lid, and a spout: two closed shells that intersect.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Pot {
    /// Points on a ring.
    #[serde(rename = "around")]
    pub slices: u32,
    /// Steps along the profile.
    #[serde(rename = "along")]
    pub stacks: u32,
}

impl Pot {
    pub fn mesh(&self) -> Mesh {
        let (slices, stacks) = (self.slices.max(3), self.stacks.max(3));
        let mut pot = revolve(slices, stacks, |t| {
            let angle = PI * t;
            let knob = 0.12 * (-((t - 0.97) / 0.03).powi(2)).exp();
            let neck = 1.0 - 0.25 * (-((t - 0.85) / 0.05).powi(2)).exp();
            [angle.sin() * neck, -0.7 * angle.cos() + knob]
        });
        let spout = revolve(slices, stacks, |t| {
            let angle = PI * t;
            [0.16 * angle.sin().sqrt() * (1.25 - 0.6 * t), 0.9 * t]
        });
        // The spout leans away from the pot and begins inside its wall.
        let (sin, cos) = 0.7_f64.sin_cos();
        pot.append(&spout.transformed(|[x, y, z]| [cos * x + sin * z + 0.75, y, cos * z - sin * x - 0.25]));
        pot
    }
}
