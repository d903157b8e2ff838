use std::f64::consts::{PI, TAU};

use serde::Deserialize;

use super::Model;

/// A closed body turned around z: `around · (along − 1) · 2` triangles, whose points stand in rings between two poles.
fn turned(around: u32, along: u32, profile: impl Fn(f64) -> [f64; 2]) -> Model {
    let mut points = Vec::new();
    let pole = |share| [0.0, 0.0, profile(share)[1]];
    points.push(pole(0.0));
    for ring in 1..along {
        let [radius, z] = profile(f64::from(ring) / f64::from(along));
        for step in 0..around {
            let (sin, cos) = (TAU * f64::from(step) / f64::from(around)).sin_cos();
            points.push([radius * cos, radius * sin, z]);
        }
    }
    points.push(pole(1.0));
    let last = points.len() as u32 - 1;
    let on_ring = |ring: u32, step: u32| 1 + ring * around + step % around;
    let mut triangles = Vec::new();
    for step in 0..around {
        triangles.push([0, on_ring(0, step + 1), on_ring(0, step)]);
        for ring in 1..along - 1 {
            let (a, b) = (on_ring(ring - 1, step), on_ring(ring - 1, step + 1));
            let (c, d) = (on_ring(ring, step + 1), on_ring(ring, step));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        triangles.push([on_ring(along - 2, step), on_ring(along - 2, step + 1), last]);
    }
    Model { points, triangles, segments: Vec::new() }
}

/// Half of a hollow ball of radius 1 to the middle of its wall, open upwards, its rim round.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Bowl {
    pub around: u32,
    pub along: u32,
    pub thickness: f64,
}

impl Bowl {
    pub fn model(&self) -> Model {
        let half = 0.5 * self.thickness;
        let (outer, inner) = ((1.0 + half) * 0.5 * PI, (1.0 - half) * 0.5 * PI);
        let rim = half * PI;
        let all = outer + rim + inner;
        turned(self.around.max(3), self.along.max(3), |share| {
            let way = share * all;
            if way <= outer {
                let (sin, cos) = (way / (1.0 + half)).sin_cos();
                [(1.0 + half) * sin, -(1.0 + half) * cos]
            } else if way <= outer + rim {
                let (sin, cos) = ((way - outer) / half).sin_cos();
                [1.0 + half * cos, half * sin]
            } else {
                let (sin, cos) = ((all - way) / (1.0 - half)).sin_cos();
                [(1.0 - half) * sin, -(1.0 - half) * cos]
            }
        })
    }
}

/// A round pot of radius about 1 with a lid's knob on top, and a spout: two closed shells that pass through each other.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Pot {
    pub around: u32,
    pub along: u32,
}

impl Pot {
    pub fn model(&self) -> Model {
        let (around, along) = (self.around.max(3), self.along.max(3));
        let mut pot = turned(around, along, |share| {
            let angle = PI * share;
            let knob = 0.12 * (-((share - 0.97) / 0.03).powi(2)).exp();
            let neck = 1.0 - 0.25 * (-((share - 0.85) / 0.05).powi(2)).exp();
            [angle.sin() * neck, -0.7 * angle.cos() + knob]
        });
        let spout = turned(around, along, |share| {
            let angle = PI * share;
            [0.16 * angle.sin().sqrt() * (1.25 - 0.6 * share), 0.9 * share]
        });
        // Leaning away from the pot, rooted in its side.
        let (sin, cos) = 0.7_f64.sin_cos();
        pot.join(&spout.moved(|[x, y, z]| [cos * x + sin * z + 0.75, y, cos * z - sin * x - 0.25]));
        pot
    }
}
