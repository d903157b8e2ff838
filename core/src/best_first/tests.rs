//! Order of the nodes of a queue, and its lower bound when nodes are fathomed or dropped.

use std::vec;
use std::vec::Vec;

use super::{BestFirstQueue, Node};

#[derive(Clone, Copy, Debug, PartialEq)]
struct Region {
    lower_bound: f64,
    depth: u32,
}

impl Node for Region {
    type Bound = f64;
    fn lower_bound(&self) -> f64 {
        self.lower_bound
    }
}

/// Regions with bounds in an order without pattern, some equal: 37 generates the numbers modulo 101.
fn regions(count: u32) -> Vec<Region> {
    let number = |index: u32| (index * 37 + 11) % 101;
    (0..count).map(|index| Region { lower_bound: f64::from(number(index) / 2), depth: number(index * 7) }).collect()
}

fn bounds(mut queue: BestFirstQueue<Region, Vec<Region>>) -> Vec<f64> {
    std::iter::from_fn(|| queue.pop()).map(|node| node.lower_bound).collect()
}

fn queue(room: usize) -> BestFirstQueue<Region, Vec<Region>> {
    BestFirstQueue::new(vec![Region { lower_bound: -1e9, depth: 0 }; room])
}

fn sorted(regions: &[Region]) -> Vec<f64> {
    let mut bounds: Vec<f64> = regions.iter().map(|region| region.lower_bound).collect();
    bounds.sort_by(f64::total_cmp);
    bounds
}

#[test]
fn nodes_leave_in_the_order_of_their_bounds() {
    for count in 0..101 {
        let mut queue = queue(101);
        regions(count).into_iter().for_each(|node| queue.push(node));
        assert_eq!(queue.count(), count as usize);
        assert_eq!(bounds(queue), sorted(&regions(count)));
    }
}

#[test]
fn the_lower_bound_holds_for_open_fathomed_and_dropped_nodes() {
    let least = sorted(&regions(101))[0];
    for room in [0, 1, 2, 7, 64] {
        for evicts in [false, true] {
            let mut queue = queue(room);
            for node in regions(101) {
                if evicts { queue.push_evicting(node) } else { queue.push(node) }
            }
            assert_eq!(queue.lower_bound(), least, "{room} {evicts}");
            while let Some(node) = queue.pop() {
                queue.fathom(node.lower_bound);
                assert_eq!(queue.lower_bound(), least, "{room} {evicts}");
            }
        }
    }
}

#[test]
fn a_full_queue_drops_the_new_node_or_the_one_with_the_highest_bound() {
    let all = regions(101);
    for room in [1, 2, 7, 64] {
        let mut dropping = queue(room);
        all.iter().for_each(|node| dropping.push(*node));
        assert_eq!(dropping.overflow_bound(), sorted(&all[room..])[0], "{room}");
        assert_eq!(bounds(dropping), sorted(&all[..room]), "{room}");

        let mut evicting = queue(room);
        all.iter().for_each(|node| evicting.push_evicting(*node));
        assert_eq!(evicting.overflow_bound(), sorted(&all)[room], "{room}");
        assert_eq!(bounds(evicting), sorted(&all)[..room], "{room}");
    }
}

#[test]
fn the_deepest_node_leaves_first_where_that_is_wanted_and_the_rest_stay_in_order() {
    let mut queue = queue(101);
    let mut left = regions(60);
    left.iter().for_each(|node| queue.push(*node));
    for _ in 0..30 {
        let deepest = queue.pop_deepest(|node| node.depth).unwrap();
        assert_eq!(deepest.depth, left.iter().map(|node| node.depth).max().unwrap());
        left.remove(left.iter().position(|node| *node == deepest).unwrap());
    }
    assert_eq!(bounds(queue), sorted(&left));
}
