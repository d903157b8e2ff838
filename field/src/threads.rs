use std::num::NonZeroUsize;

/// How many threads work. Results do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Threads {
    /// `None` stands for as many as the machine, or the rayon pool that the caller is in, has.
    count: Option<NonZeroUsize>,
}

impl Threads {
    /// As many as the machine has; in a rayon pool, that pool's.
    pub const ALL: Self = Self { count: None };

    /// The caller's alone: none is started.
    pub const ONE: Self = Self { count: NonZeroUsize::new(1) };

    /// The most that the program and the doors to other languages take: more than that starve a machine.
    pub const MOST: usize = 1024;

    /// So many; 0 stands for [`ALL`](Self::ALL).
    pub fn new(count: usize) -> Self {
        Self { count: NonZeroUsize::new(count) }
    }

    /// How many work, at least one.
    pub(crate) fn count(self) -> usize {
        #[cfg(feature = "threads")]
        let all = rayon::current_num_threads();
        #[cfg(not(feature = "threads"))]
        let all = 1;
        self.count.map_or(all, NonZeroUsize::get)
    }

    /// Runs `work` where rayon's parallel iterators use so many threads.
    #[cfg(feature = "threads")]
    pub(crate) fn install<T: Send>(self, work: impl FnOnce() -> T + Send) -> T {
        let (mut work, mut result) = (Some(work), None);
        self.run(&mut || result = work.take().map(|work| work()));
        result.expect("`run` calls its work")
    }

    /// [`install`](Self::install), compiled once.
    #[cfg(feature = "threads")]
    fn run(self, work: &mut (dyn FnMut() + Send)) {
        let pool = self.count.map(|count| rayon::ThreadPoolBuilder::new().num_threads(count.get()).build());
        match pool {
            Some(Ok(pool)) => pool.install(work),
            // The system starts no more threads: what there is must do.
            Some(Err(_)) | None => work(),
        }
    }

    /// The results of `map(index, chunk)` for each chunk of `size` items, in order. `index` is that of the chunk's first item.
    pub(crate) fn map_chunks<T, U, F>(self, items: &[T], size: usize, map: F) -> Vec<U>
    where
        T: Sync,
        U: Send,
        F: Fn(usize, &[T]) -> U + Sync,
    {
        #[cfg(feature = "threads")]
        if self != Self::ONE && items.len() > size {
            let map = |chunk: usize| {
                let first = chunk * size;
                map(first, &items[first..items.len().min(first + size)])
            };
            return self.install(|| sdf_parallel::map_each(items.len().div_ceil(size), &map));
        }
        items.chunks(size).enumerate().map(|(chunk, items)| map(chunk * size, items)).collect()
    }
}
