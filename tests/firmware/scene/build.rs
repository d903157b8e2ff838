//! Bakes the grid: a rounded box, sampled in f64 and stored in f32, as a table of bits.

use std::fmt::Write;
use std::{env, fs};

const NODES: u32 = 17;
const SPACING: f64 = 0.0625;
const ORIGIN: [f64; 3] = [-0.5; 3];

const HALF_EXTENTS: [f64; 3] = [0.3, 0.2, 0.1];
const RADIUS: f64 = 0.1;

fn main() {
    let mut table = format!(
        "const NODES: u32 = {NODES};\n\
         const SPACING: f64 = {SPACING:?};\n\
         const ORIGIN: [f64; 3] = {ORIGIN:?};\n\
         static SAMPLES: [f32; {}] = [\n",
        NODES.pow(3)
    );
    for node in 0..NODES.pow(3) {
        let index = [node % NODES, node / NODES % NODES, node / NODES / NODES];
        let point = std::array::from_fn(|axis| ORIGIN[axis] + SPACING * f64::from(index[axis]));
        writeln!(table, "f32::from_bits({:#010x}),", (rounded_box(point) as f32).to_bits()).unwrap();
    }
    table += "];\n";
    fs::write(env::var("OUT_DIR").unwrap() + "/grid.rs", table).unwrap();
    println!("cargo::rerun-if-changed=build.rs");
}

fn rounded_box(point: [f64; 3]) -> f64 {
    let beyond: [f64; 3] = std::array::from_fn(|axis| point[axis].abs() - HALF_EXTENTS[axis]);
    let outside_sq: f64 = beyond.iter().map(|x| x.max(0.0) * x.max(0.0)).sum();
    let inside = beyond.iter().fold(f64::NEG_INFINITY, |max, x| max.max(*x)).min(0.0);
    outside_sq.sqrt() + inside - RADIUS
}
