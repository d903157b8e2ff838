use super::*;
use crate::error::normal_cones::cone_error_bound;
use crate::error::normal_cones::tests::collected;
use crate::testing::{instruction_sets, random, random_vector};

#[test]
fn bounds_of_eight_sets_at_once_are_no_less_than_those_of_each_by_itself() {
    let mut state = 19;
    println!("seed {state}");
    let mut tight = 0;
    for (round, arch) in (0..3000).zip(instruction_sets().into_iter().cycle()) {
        let spread = [1.5, 0.3, 1e-3, 0.0][round % 4] * random(&mut state).abs();
        let middle = random_vector(&mut state).normalize();
        let mut normal = || (middle + random_vector(&mut state) * spread).normalize();
        let mut normals: Vec<_> = (0..round % 23).map(|_| normal()).collect();
        if round % 5 == 0 {
            // Several normals have equal components, among them zeros of either sign.
            normals.iter_mut().for_each(|normal| *normal = normal.map(f64::round).try_normalize(0.5).unwrap_or(middle));
        }
        if round % 7 == 0 && !normals.is_empty() {
            normals[round % 11 % (round % 23)] = Vector3::zeros();
        }
        let is_member = |state: &mut u64| u64::from(random(state) > [0.5, -0.5, -1.1][round % 3]);
        let memberships: Vec<Lanes<u64>> =
            normals.iter().map(|_| std::array::from_fn(|_| is_member(&mut state))).collect();
        let sets: [Vec<u32>; LANES] = std::array::from_fn(|set| {
            (0..normals.len() as u32).filter(|index| memberships[*index as usize][set] == 1).collect()
        });
        let bounds = cone_error_bounds_x8(arch, &normals, std::array::from_fn(|set| &sets[set][..]), &memberships);
        for (set, bound) in sets.iter().zip(bounds) {
            let members: Vec<_> = set.iter().map(|index| normals[*index as usize]).collect();
            let error = cone_error_bound(&[collected(&members)]);
            assert!(error <= bound && bound <= MAX_ERROR, "{error} {bound} {members:?} by {arch:?}");
            tight += usize::from(error == bound && error < MAX_ERROR);
        }
    }
    assert!(tight > 3000, "{tight}");
}
