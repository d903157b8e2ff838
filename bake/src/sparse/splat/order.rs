//! Order of triangles by their distances, near enough for a search that begins with the nearest.

/// Buckets of triangles by their squared distances, sixteen to an octave of these, and bits of a key below its bucket.
const BUCKETS: usize = 64;
const BELOW_BUCKET: u32 = 32 + 19;

/// Triangles by their squared distances from a point: near enough to sorted, in a fourth of the time.
#[derive(Default)]
pub(super) struct ByDistance {
    /// A triangle each, whose squared distance's bits are the higher half.
    keys: Vec<u64>,
    in_order: Vec<u64>,
}

impl ByDistance {
    pub fn clear(&mut self) {
        self.keys.clear();
    }

    #[inline(always)]
    pub fn push(&mut self, distance_sq: f32, triangle: usize) {
        self.keys.push(u64::from(distance_sq.to_bits()) << 32 | triangle as u64);
    }

    /// The triangles in the order of their distances, but for those of one bucket. All that are nearer than some octaves before the
    /// farthest fall into the first.
    #[inline(always)]
    pub fn in_order(&mut self) -> impl Iterator<Item = usize> {
        let Self { keys, in_order } = self;
        let last = keys.iter().fold(0, |last, key| last.max(key >> BELOW_BUCKET));
        let bucket = |key: u64| (BUCKETS - 1).saturating_sub((last - (key >> BELOW_BUCKET)) as usize);
        let mut starts = [0_u32; BUCKETS];
        keys.iter().for_each(|key| starts[bucket(*key)] += 1);
        let mut sum = 0;
        starts.iter_mut().for_each(|start| (*start, sum) = (sum, sum + *start));
        in_order.resize(keys.len(), 0);
        for key in keys.iter() {
            let start = &mut starts[bucket(*key)];
            in_order[*start as usize] = *key;
            *start += 1;
        }
        in_order.iter().map(|key| *key as u32 as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random;

    #[test]
    fn triangles_are_in_order_but_for_those_of_one_bucket() {
        let mut state = 3;
        let mut by_distance = ByDistance::default();
        for count in [100, 0, 1, 2, 1000] {
            for nearest in [0.0, 1e-6, 1.0, 1000.0] {
                let distances: Vec<f32> =
                    (0..count).map(|_| nearest + 50.0 * random(&mut state).abs() as f32).collect();
                by_distance.clear();
                (0..).zip(&distances).for_each(|(triangle, distance_sq)| by_distance.push(*distance_sq, triangle));
                let mut in_order: Vec<usize> = by_distance.in_order().collect();
                let mut farthest = 0.0_f32;
                for distance_sq in in_order.iter().map(|triangle| distances[*triangle]) {
                    // Four octaves below the farthest, all are alike.
                    assert!(distance_sq >= farthest * (1.0 - 1.0 / 16.0) || farthest < (nearest + 50.0) / 8.0);
                    farthest = farthest.max(distance_sq);
                }
                in_order.sort_unstable();
                assert_eq!(in_order, (0..count).collect::<Vec<_>>());
            }
        }
    }
}
