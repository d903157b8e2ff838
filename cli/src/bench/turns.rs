use std::time::Instant;

use anyhow::Result;

use super::row::Row;
use crate::args::Threads;
use crate::progress;
use crate::study::statistics::median;

/// What one run of a work did. The row's numbers that are known before need not be told.
#[derive(Clone, Debug, Default)]
pub struct Done {
    pub seconds: f64,
    /// 0 where the row has them.
    pub units: f64,
    pub found: Option<usize>,
    pub floor: Option<f64>,
    pub peak_mib: Option<f64>,
    pub result_mib: Option<f64>,
}

impl Done {
    pub fn in_seconds(seconds: f64) -> Self {
        Self { seconds, ..Self::default() }
    }
}

/// A row that is to be measured, and how to.
pub struct Work<'a> {
    pub row: Row,
    /// About how much work it is, in proportion to the others of its series.
    pub size: f64,
    pub run: Box<dyn FnMut() -> Result<Done> + 'a>,
}

/// Has the works of a series take turns, so that what else the machine does meets all of them.
pub struct Turns {
    rounds: u32,
    limit: f64,
    pub rows: Vec<Row>,
    pub left_out: Vec<String>,
}

/// A work that is done sooner is done more often than asked, in seconds.
const ENOUGH: f64 = 0.3;
const MAX_ROUNDS: usize = 31;

impl Turns {
    pub fn new(rounds: u32, limit: f64) -> Self {
        Self { rounds, limit, rows: vec![], left_out: vec![] }
    }

    /// Adds a row for each work, the first what the ratios refer to. Smaller works come first: from what they take it is
    /// foreseen whether a larger one is within the limit.
    pub fn take(&mut self, works: Vec<Work>) -> Result<()> {
        let total = works.len() as u64 * u64::from(self.rounds);
        let bar = progress::bar("measuring", total);
        let mut under_way: Vec<UnderWay> = works.into_iter().map(UnderWay::new).collect();
        let mut pace: f64 = 0.0;
        for work in &mut under_way {
            let foreseen = pace * work.work.size;
            let why = if foreseen > self.limit {
                Some(format!("about {foreseen:.0} s, more than the limit of {} s", self.limit))
            } else {
                // Such as more memory than there is.
                work.once().err().map(|error| format!("{error:#}"))
            };
            if let Some(why) = why {
                let Row { group, work: what, resolution, triangles, .. } = &work.work.row;
                self.left_out.push(format!("{group}: {what}, {triangles} triangles, resolution {resolution}: {why}"));
                continue;
            }
            pace = work.spent / work.work.size;
            bar.inc(1);
        }
        under_way.retain(|work| !work.times.is_empty());
        for _ in 1..self.rounds {
            for work in under_way.iter_mut().filter(|work| work.spent < self.limit) {
                work.once()?;
                bar.inc(1);
            }
        }
        for _ in self.rounds as usize..MAX_ROUNDS {
            under_way.iter_mut().filter(|work| work.spent < ENOUGH).try_for_each(UnderWay::once)?;
        }
        bar.finish_and_clear();
        let rows: Vec<Row> = under_way.into_iter().map(UnderWay::row).collect();
        let first = rows.first().map_or(f64::NAN, |row| row.seconds);
        self.rows.extend(rows.into_iter().map(|row| Row { ratio: row.seconds / first, ..row }));
        Ok(())
    }
}

struct UnderWay<'a> {
    work: Work<'a>,
    times: Vec<f64>,
    spent: f64,
    last: Done,
}

impl<'a> UnderWay<'a> {
    fn new(work: Work<'a>) -> Self {
        Self { work, times: vec![], spent: 0.0, last: Done::default() }
    }

    fn once(&mut self) -> Result<()> {
        self.last = (self.work.run)()?;
        self.spent += self.last.seconds;
        self.times.push(self.last.seconds);
        Ok(())
    }

    fn row(self) -> Row {
        let Done { units, found, floor, peak_mib, result_mib, .. } = self.last;
        let row = self.work.row;
        Row {
            units: if units > 0.0 { units } else { row.units },
            found,
            floor,
            peak_mib,
            result_mib,
            least: self.times.iter().copied().fold(f64::INFINITY, f64::min),
            rounds: self.times.len(),
            seconds: median(self.times),
            ..row
        }
    }
}

/// Runs on so many threads, and says how long that took, starting them aside.
pub fn timed<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<(T, f64)> {
    progress::on_threads(Threads { count: Some(threads as u16) }, || {
        let started = Instant::now();
        let result = work();
        (result, started.elapsed().as_secs_f64())
    })
}

/// 1, 2, 4 and so on, and all that the machine has.
pub fn thread_counts(most: usize) -> Vec<usize> {
    let mut counts: Vec<usize> =
        std::iter::successors(Some(1), |count| Some(2 * count)).take_while(|count| *count < most).collect();
    counts.push(most);
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_work_that_fails_is_left_out_and_the_others_go_on() {
        let work = |resolution: u32| {
            let run = move || if resolution == 2 { anyhow::bail!("too large") } else { Ok(Done::in_seconds(1.0)) };
            let row = Row { group: "resolution", work: "bake".to_owned(), resolution, ..Row::default() };
            Work { row, size: 1.0, run: Box::new(run) }
        };
        let mut turns = Turns::new(2, 60.0);
        turns.take(vec![work(1), work(2), work(3)]).unwrap();
        assert_eq!(turns.rows.iter().map(|row| row.resolution).collect::<Vec<_>>(), [1, 3]);
        assert_eq!(turns.left_out, ["resolution: bake, 0 triangles, resolution 2: too large"]);
    }
}
