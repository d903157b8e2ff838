//! Which loops run on all threads of the rayon pool? These, each compiled once. Within [`on_this_thread`] they ask for no pool.
//!
//! rayon compiles its parallel iterators anew for every closure, about 5 kB each time: a tenth of the program once. Here it
//! gets one closure behind a pointer, which is called once for each of at most 512 chunks of indices. Results come
//! in the order of the indices, so that they do not depend on the number of threads.

use std::cell::Cell;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

/// Most chunks that a loop is cut into: many more than threads, so that none waits long for the last.
const CHUNKS: usize = 512;

thread_local! {
    /// Do loops that are called from this thread stay on it?
    static IS_ALONE: Cell<bool> = const { Cell::new(false) };
}

/// Runs `work`, whose loops stay on the calling thread. No pool is started for them: rayon's is one of all cores, whose threads do not
/// end, and a process that was forked waits for them forever.
pub fn on_this_thread<T>(work: impl FnOnce() -> T) -> T {
    /// Makes so again what was so before, after a panic too.
    struct Restore(bool);
    impl Drop for Restore {
        fn drop(&mut self) {
            IS_ALONE.set(self.0);
        }
    }
    let _restore = Restore(IS_ALONE.replace(true));
    work()
}

/// Two calls, each on a thread of its own if one is free.
pub fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    if IS_ALONE.get() { (a(), b()) } else { rayon::join(a, b) }
}

/// Calls `work` with each index below `count`, in any order.
pub fn for_each_index(count: usize, work: &(dyn Fn(usize) + Sync)) {
    if IS_ALONE.get() {
        return (0..count).for_each(work);
    }
    // One by one: an index may stand for much work.
    (0..count).into_par_iter().with_max_len(1).for_each(work);
}

/// Calls `work` with each of a few items, such as rows of nodes to write to, in any order.
pub fn for_each<T: Send>(items: Vec<T>, work: impl Fn(T) + Sync) {
    map_items(items, || (), |(), item| work(item));
}

/// The results of `map` for each of a few items, in order. A thread lends it a state that `init` makes, such as buffers, and other items
/// get the same afterwards.
pub fn map_items<I: Send, S: Send, T: Send>(
    items: Vec<I>,
    init: impl Fn() -> S + Sync,
    map: impl Fn(&mut S, I) -> T + Sync,
) -> Vec<T> {
    let states = Mutex::new(vec![]);
    let items: Vec<_> = items.into_iter().map(|item| Mutex::new(Some(item))).collect();
    let results = map_each(items.len(), &|index| {
        let item = lock(&items[index]).take()?;
        let state = lock(&states).pop();
        let mut state = state.unwrap_or_else(&init);
        let result = map(&mut state, item);
        lock(&states).push(state);
        Some(result)
    });
    results.into_iter().flatten().collect()
}

/// The results of `map` for each index below `count`, in order. An index may stand for much work. Compiled once for a type of results.
pub fn map_each<T: Send>(count: usize, map: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    let results: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    for_each_index(count, &|index| {
        let result = map(index);
        *lock(&results[index]) = Some(result);
    });
    results.into_iter().filter_map(into_inner).collect()
}

/// Threads that loops called from here run on.
pub fn thread_count() -> usize {
    if IS_ALONE.get() { 1 } else { rayon::current_num_threads() }
}

/// Sorts keys, each with the index of what it belongs to.
pub fn sort(keyed: &mut [(u64, u32)]) {
    if IS_ALONE.get() {
        keyed.sort_unstable();
    } else {
        keyed.par_sort_unstable();
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn into_inner<T>(mutex: Mutex<T>) -> T {
    mutex.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// The results of `map` for all indices below `count`, in order.
pub fn map<T: Send>(count: usize, map: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let map_chunk = |chunk: Range<usize>| chunk.map(&map).collect::<Vec<T>>();
    // One thread writes the results where they stay: no copy, and half of the new memory.
    if thread_count() == 1 { map_chunk(0..count) } else { concat(map_chunks(count, map_chunk)) }
}

/// [`map`] to plain values, which are written where they stay: a large list is never in memory twice.
pub fn map_plain<T: Copy + Default + Send>(count: usize, map: impl Fn(usize) -> T + Sync) -> Vec<T> {
    if thread_count() == 1 {
        return (0..count).map(map).collect();
    }
    let mut all = vec![T::default(); count];
    let size = chunk_size(count);
    for_each(all.chunks_mut(size).enumerate().collect(), |(chunk, results)| {
        (chunk * size..).zip(results).for_each(|(index, result)| *result = map(index));
    });
    all
}

/// The indices below `count` that pass a test, in order.
pub fn filter(count: usize, test: impl Fn(usize) -> bool + Sync) -> Vec<usize> {
    concat(map_chunks(count, |chunk| chunk.filter(|index| test(*index)).collect()))
}

/// The results of `map` for chunks of the indices below `count`, in order. The chunks depend on `count` alone.
pub fn map_chunks<T: Send>(count: usize, map: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    let size = chunk_size(count);
    map_each(count.div_ceil(size), &|chunk| map(chunk * size..count.min((chunk + 1) * size)))
}

/// Length of the chunks that indices below `count` are cut into.
fn chunk_size(count: usize) -> usize {
    count.div_ceil(CHUNKS).max(1)
}

/// All items of all chunks, in order.
fn concat<T>(chunks: Vec<Vec<T>>) -> Vec<T> {
    let count = chunks.iter().map(Vec::len).sum();
    let mut all = Vec::with_capacity(count);
    chunks.into_iter().for_each(|mut chunk| all.append(&mut chunk));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_those_of_a_loop_for_any_count_and_number_of_threads() {
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(results_are_those_of_a_loop);
        }
        on_this_thread(results_are_those_of_a_loop);
    }

    #[test]
    fn loops_on_this_thread_stay_on_it_until_its_end() {
        let here = std::thread::current().id();
        let stays = || assert_eq!(std::thread::current().id(), here);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        on_this_thread(|| {
            assert_eq!(thread_count(), 1);
            for_each_index(100, &|_| stays());
            join(stays, stays);
            // `install` runs on the threads of its pool, and loops after it stay on this thread again.
            assert_eq!(pool.install(thread_count), 3);
            on_this_thread(stays);
            assert_eq!(thread_count(), 1);
        });
        pool.install(|| {
            let panicked = std::panic::catch_unwind(|| on_this_thread(|| panic!("on purpose")));
            assert!(panicked.is_err());
            assert_eq!(thread_count(), 3);
        });
    }

    fn results_are_those_of_a_loop() {
        for count in [0, 1, 2, CHUNKS - 1, CHUNKS, CHUNKS + 1, 10 * CHUNKS + 7] {
            assert_eq!(map(count, |index| 3 * index), (0..count).map(|index| 3 * index).collect::<Vec<_>>());
            assert_eq!(map_plain(count, |index| 3 * index), map(count, |index| 3 * index));
            assert_eq!(filter(count, |index| index % 3 == 1), (0..count).filter(|i| i % 3 == 1).collect::<Vec<_>>());
            let chunks = map_chunks(count, |chunk| chunk);
            assert_eq!(chunks.into_iter().flatten().collect::<Vec<_>>(), (0..count).collect::<Vec<_>>());
            assert_eq!(map_each(count, &|index| 3 * index), map(count, |index| 3 * index));
            let mut items = vec![0; count];
            for_each(items.iter_mut().enumerate().collect(), |(index, item)| *item += index);
            assert_eq!(items, (0..count).collect::<Vec<_>>());
            let doubled = map_items(items, Vec::new, |seen, item| {
                seen.push(item);
                2 * item
            });
            assert_eq!(doubled, (0..count).map(|index| 2 * index).collect::<Vec<_>>());
            let mut keyed: Vec<_> = (0..count as u32).map(|index| (u64::from(index * 7 % 11), index)).collect();
            let mut expected = keyed.clone();
            expected.sort_unstable();
            sort(&mut keyed);
            assert_eq!(keyed, expected);
        }
    }
}
