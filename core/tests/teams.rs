//! Eight threads that share the lanes of an exact minimum on a triangle, or on its edge, find what one thread finds, bit for bit: f32 and f64, noise and
//! balls, triangles from a fraction of a cell to a dozen. The threads exchange values as those of a card do, by waiting for each other.

use std::sync::{Condvar, Mutex};
use std::time::Duration;

use sdf_core::grid::{Dense, Grid, Lattice, Storage, TEAM_LANES, measure_slope_bound};
use sdf_core::minimize::{Certified, Minimizer, Minimum};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Float, Goal, Simplex};

const NODES: [u32; 3] = [15, 13, 17];
const SPACING: f64 = 0.125;

/// The values of a round, eight bytes for each thread, and how many threads have come.
#[derive(Default)]
struct Round {
    values: [[u8; 8]; TEAM_LANES],
    come: usize,
    number: u64,
}

/// Where threads wait for each other.
#[derive(Default)]
struct Meeting {
    round: Mutex<Round>,
    all_are_here: Condvar,
}

impl Meeting {
    /// The values of all threads. Fails if some do not come: they went another way.
    fn exchange(&self, lane: usize, value: [u8; 8]) -> [[u8; 8]; TEAM_LANES] {
        self.meet(|values| values[lane] = value);
        let values = self.round.lock().unwrap().values;
        self.meet(|_| ());
        values
    }

    fn meet(&self, change: impl FnOnce(&mut [[u8; 8]; TEAM_LANES])) {
        let mut round = self.round.lock().unwrap();
        change(&mut round.values);
        round.come += 1;
        if round.come == TEAM_LANES {
            (round.come, round.number) = (0, round.number + 1);
            self.all_are_here.notify_all();
            return;
        }
        let number = round.number;
        let waits = |round: &mut Round| round.number == number;
        let waited = self.all_are_here.wait_timeout_while(round, Duration::from_secs(30), waits).unwrap();
        assert!(!waited.1.timed_out(), "some threads of the team went another way");
    }
}

/// The samples of a grid, for one thread of a team.
struct OfTeam<'a> {
    samples: Dense<&'a [f32]>,
    lane: usize,
    meeting: &'a Meeting,
}

impl Storage for OfTeam<'_> {
    fn corners(&self, cell: [u32; 3]) -> [f32; 8] {
        self.samples.corners(cell)
    }

    const LANES_OF_THREAD: usize = 1;

    fn first_lane(&self) -> usize {
        self.lane
    }

    fn of_lane<T: Copy>(&self, computed: &[T; TEAM_LANES], lane: usize) -> T {
        let (mut bytes, length) = ([0; 8], size_of::<T>());
        assert!(length <= 8);
        // SAFETY: the value has that many bytes, and the bytes of one are read back as one.
        unsafe {
            (&raw const computed[0]).cast::<u8>().copy_to(bytes.as_mut_ptr(), length);
            let values = self.meeting.exchange(self.lane, bytes);
            values[lane].as_ptr().cast::<T>().read_unaligned()
        }
    }

    fn lanes_where(&self, computed: &[u8; TEAM_LANES]) -> u32 {
        let values = self.meeting.exchange(self.lane, [computed[0]; 8]);
        (0..TEAM_LANES).filter(|lane| values[*lane][0] != 0).map(|lane| 1 << lane).sum()
    }
}

struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

fn lattice() -> Lattice {
    Lattice::new([-0.5, 0.25, -1.0], SPACING, NODES).unwrap()
}

fn samples(random: &mut Random) -> Vec<f32> {
    let (is_noise, radius) = (random.between(0.0, 1.0) < 0.3, random.between(0.2, 1.0));
    let [x, y, z] = NODES;
    let nodes = (0..z).flat_map(|z| (0..y).flat_map(move |y| (0..x).map(move |x| [x, y, z])));
    let middle = lattice().node(NODES.map(|nodes| nodes / 2));
    let noise = if is_noise { 1.0 } else { 0.02 };
    let sample = |node| {
        let offset = Vector3::from(lattice().node(node)) - Vector3::from(middle);
        (offset.norm() - radius + random.between(-noise, noise)) as f32
    };
    nodes.map(sample).collect()
}

fn triangle(random: &mut Random) -> [Vector3<f64>; 3] {
    let bounds = lattice().bounds();
    let size = 10.0_f64.powf(random.between(-2.0, 0.3));
    let about = Vector3::from_fn(|k, _| random.between(bounds.min[k], bounds.max[k]));
    let near =
        |random: &mut Random, k: usize| (about[k] + random.between(-size, size)).clamp(bounds.min[k], bounds.max[k]);
    std::array::from_fn(|_| Vector3::from_fn(|k, _| near(random, k)))
}

/// Exact minimum on a triangle, answer of the certified search there, and that on its first edge.
type Answer<R> = (Option<[R; 5]>, Minimum<R, 3>, Minimum<R, 2>);

/// The answers on these triangles, by a grid of this storage.
fn answers<R: Float, S: Storage>(storage: S, samples: &[f32], triangles: &[[Vector3<f64>; 3]]) -> Vec<Answer<R>> {
    use sdf_core::EnclosedSdf;
    let dense = Dense::new(&lattice(), samples).unwrap();
    let grid = Grid::new(lattice(), storage, measure_slope_bound(&lattice(), &dense)).unwrap();
    let method = Certified::default();
    let one = |triangle: &[Vector3<f64>; 3]| {
        let corners = triangle.map(|corner| corner.map(R::from_f64));
        let exact = grid.exact_minimum(corners, Goal::exact());
        let numbers =
            exact.map(|found| [found.weights[0], found.weights[1], found.weights[2], found.value, found.lower_bound]);
        let edge = Simplex { corners: [corners[0], corners[1]] };
        (numbers, method.minimize(&grid, &Simplex { corners }), method.minimize(&grid, &edge))
    };
    triangles.iter().map(one).collect()
}

fn a_team_agrees_with_one_thread<R: Float + Send>(seed: u64) -> usize {
    let mut random = Random(seed);
    let samples = &samples(&mut random)[..];
    let triangles: Vec<_> = (0..12).map(|_| triangle(&mut random)).collect();
    let dense = || Dense::new(&lattice(), samples).unwrap();
    let expected = answers::<R, _>(dense(), samples, &triangles);
    let meeting = &Meeting::default();
    std::thread::scope(|scope| {
        let start = |lane| {
            let (storage, triangles) = (OfTeam { samples: dense(), lane, meeting }, &triangles);
            scope.spawn(move || answers::<R, _>(storage, samples, triangles))
        };
        let threads: Vec<_> = (0..TEAM_LANES).map(start).collect();
        for (lane, thread) in threads.into_iter().enumerate() {
            assert!(thread.join().unwrap() == expected, "seed {seed}, thread {lane}");
        }
    });
    expected.iter().filter(|(exact, ..)| exact.is_some()).count()
}

#[test]
fn eight_threads_find_what_one_finds() {
    let (mut single, mut double) = (0, 0);
    for seed in 0..5 {
        single += a_team_agrees_with_one_thread::<f32>(seed);
        double += a_team_agrees_with_one_thread::<f64>(seed);
    }
    assert!(single > 30 && double > 30, "most minima are exact ones: {single}, {double} of 60");
}
