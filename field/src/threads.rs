use std::num::NonZeroUsize;

/// How many threads work. Results do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Threads {
    /// `None` stands for as many as the machine, or what the caller is in, has.
    count: Option<NonZeroUsize>,
}

impl Threads {
    /// As many as the machine has; in a rayon pool, that pool's; in [`install`](Self::install), those. The machine's are started once
    /// and do not end: a process that is forked afterwards has none of them, and must not ask for all.
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
        let all = sdf_parallel::thread_count;
        #[cfg(not(feature = "threads"))]
        let all = || 1;
        // Only asked when wanted: to count the machine's starts them.
        self.count.map_or_else(all, NonZeroUsize::get)
    }

    /// Runs `work` where [`ALL`](Self::ALL) are so many, and so are those of calls that take no `Threads`, such as
    /// [`open`](crate::Field::open) and [`save`](crate::Field::save).
    #[cfg(feature = "threads")]
    pub fn install<T: Send>(self, work: impl FnOnce() -> T + Send) -> T {
        let (mut work, mut result) = (Some(work), None);
        self.run(&mut || result = work.take().map(|work| work()));
        result.expect("`run` calls its work")
    }

    /// [`install`](Self::install), compiled once.
    #[cfg(feature = "threads")]
    fn run(self, work: &mut (dyn FnMut() + Send)) {
        if self == Self::ONE {
            return sdf_parallel::on_this_thread(work);
        }
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
        let one_by_one = || items.chunks(size).enumerate().map(|(chunk, items)| map(chunk * size, items)).collect();
        // A search may need what is made when first asked for, by loops.
        #[cfg(feature = "threads")]
        if self != Self::ALL {
            return sdf_parallel::on_this_thread(one_by_one);
        }
        one_by_one()
    }
}
