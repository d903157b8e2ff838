//! Grids to write, and random numbers with a seed that is told.

use sdf_core::grid::Lattice;
use sdf_formats::grid_file::{About, Source};

/// The distance to a lumpy sphere of radius 1.5, in a box around it.
pub fn lumpy_sphere(nodes: [u32; 3]) -> (Lattice, Vec<f32>) {
    let spacing = 4.0 / f64::from(nodes.into_iter().max().unwrap() - 1);
    let lattice = Lattice::new([-2.0, -2.1, -1.9], spacing, nodes).unwrap();
    let mut distances = Vec::with_capacity(lattice.node_count());
    for k in 0..nodes[2] {
        for j in 0..nodes[1] {
            for i in 0..nodes[0] {
                let [x, y, z] = lattice.node([i, j, k]);
                let lumps = 0.05 * (7.0 * x).sin() * (5.0 * y).cos() * (6.0 * z + 1.0).sin();
                distances.push(((x * x + y * y + z * z).sqrt() - 1.5 + lumps) as f32);
            }
        }
    }
    (lattice, distances)
}

pub fn about() -> About {
    About {
        sign_method: "winding".into(),
        sign_verdict: "2 open edges, so the winding number decides; größer als ½".into(),
        slope_bound: 1.25,
        error_bound: 0.0625 + 1e-9,
        source: Source {
            name: "lumpy sphere.obj".into(),
            sha256: std::array::from_fn(|i| i as u8 * 7),
            triangles: 69451,
        },
        tool: "sdftool 0.1.0".into(),
        options: String::new(),
    }
}

/// SplitMix64.
#[allow(dead_code)]
pub struct Random(u64);

#[allow(dead_code)]
impl Random {
    /// From SEED, else from the clock.
    pub fn told() -> Self {
        let clock = || std::time::UNIX_EPOCH.elapsed().unwrap().as_nanos() as u64;
        let seed = std::env::var("SEED").map_or_else(|_| clock(), |seed| seed.parse().unwrap());
        println!("to see this again: SEED={seed}");
        Self(seed)
    }

    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % end as u64) as usize
    }
}
