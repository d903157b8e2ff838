//! Sets that are joined, each named by its lowest member (union-find with path halving: Tarjan and van Leeuwen 1984, "Worst-case
//! analysis of set union algorithms").

/// Disjoint sets of the numbers from 0 on.
#[derive(Default)]
pub(crate) struct UnionFind {
    /// For each number a lower one of its set, or itself.
    parents: Vec<u32>,
}

impl UnionFind {
    /// Sets of one number each.
    pub fn new(count: usize) -> Self {
        Self { parents: (0..count as u32).collect() }
    }

    /// Adds a set of the next number alone.
    pub fn push(&mut self) {
        self.parents.push(self.parents.len() as u32);
    }

    /// Lowest number of a set.
    pub fn root(&mut self, mut number: u32) -> u32 {
        while !self.is_root(number) {
            let parent = self.parents[number as usize];
            self.parents[number as usize] = self.parents[parent as usize];
            number = parent;
        }
        number
    }

    pub fn is_root(&self, number: u32) -> bool {
        self.parents[number as usize] == number
    }

    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random;

    #[test]
    fn sets_are_those_of_a_search_and_named_by_their_lowest_number() {
        let mut state = 17;
        println!("seed {state}");
        for count in [1_usize, 2, 10, 300] {
            let mut sets = UnionFind::default();
            (0..count).for_each(|_| sets.push());
            let mut names: Vec<u32> = (0..count as u32).collect();
            for _ in 0..count {
                let mut any = || ((random(&mut state) + 1.0) * 0.5 * count as f64) as usize % count;
                let (a, b) = (any(), any());
                sets.join(a as u32, b as u32);
                let (from, to) = (names[a].max(names[b]), names[a].min(names[b]));
                names.iter_mut().filter(|name| **name == from).for_each(|name| *name = to);
                for (number, name) in (0..).zip(&names) {
                    assert_eq!((sets.root(number), sets.is_root(number)), (*name, *name == number));
                }
            }
        }
    }
}
