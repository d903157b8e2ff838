//! Works that take turns, so that a slow phase of the machine affects all of a series.

use std::time::Instant;

use anyhow::Result;

use super::row::Row;
use crate::statistics::median;
use crate::{on_threads, progress_bar};

/// Result of one run of a work.
#[derive(Clone, Debug, Default)]
pub struct RunResult {
    pub seconds: f64,
    /// Amount of work; 0 if the row has it already.
    pub units: f64,
    pub contacts: Option<usize>,
    pub floor_seconds: Option<f64>,
    pub write_seconds: Option<f64>,
    pub peak_mib: Option<f64>,
    pub result_mib: Option<f64>,
}

impl RunResult {
    pub fn timed(seconds: f64) -> Self {
        Self { seconds, ..Self::default() }
    }
}

/// A row to be measured, and the work that fills it.
pub struct Work<'a> {
    pub row: Row,
    /// Predicted duration, relative to the other works of its series.
    pub size: f64,
    pub run: Box<dyn FnMut() -> Result<RunResult> + 'a>,
}

/// Collects the rows of all series.
pub struct RoundRobin {
    rounds: u32,
    limit: f64,
    pub rows: Vec<Row>,
    pub left_out: Vec<String>,
}

/// Total seconds below which a work is repeated beyond the number of rounds.
const ENOUGH_SECONDS: f64 = 0.3;
const MAX_ROUNDS: usize = 31;

impl RoundRobin {
    pub fn new(rounds: u32, limit: f64) -> Self {
        Self { rounds, limit, rows: vec![], left_out: vec![] }
    }

    /// Measures a series and appends a row for each work. Ratios are relative to the first work.
    ///
    /// Works stand in ascending size: from the time of one it is predicted whether the next is within the limit.
    pub fn measure(&mut self, works: Vec<Work>) -> Result<()> {
        let total = works.len() as u64 * u64::from(self.rounds);
        let bar = progress_bar("measuring", total);
        let mut series: Vec<TimedWork> = works.into_iter().map(TimedWork::new).collect();
        let mut seconds_per_size: f64 = 0.0;
        for work in &mut series {
            let predicted = seconds_per_size * work.work.size;
            let reason = if predicted > self.limit {
                Some(format!("about {predicted:.0} s, more than the limit of {} s", self.limit))
            } else {
                // Such as a grid that needs more memory than is free.
                work.run_once().err().map(|error| format!("{error:#}"))
            };
            if let Some(reason) = reason {
                let Row { group, work: name, resolution, triangles, .. } = &work.work.row;
                self.left_out
                    .push(format!("{group}: {name}, {triangles} triangles, resolution {resolution}: {reason}"));
                continue;
            }
            seconds_per_size = work.spent / work.work.size;
            bar.inc(1);
        }
        series.retain(|work| !work.times.is_empty());
        for _ in 1..self.rounds {
            for work in series.iter_mut().filter(|work| work.spent < self.limit) {
                work.run_once()?;
                bar.inc(1);
            }
        }
        for _ in self.rounds as usize..MAX_ROUNDS {
            series.iter_mut().filter(|work| work.spent < ENOUGH_SECONDS).try_for_each(TimedWork::run_once)?;
        }
        bar.finish_and_clear();
        let rows: Vec<Row> = series.into_iter().map(TimedWork::row).collect();
        let first = rows.first().map_or(f64::NAN, |row| row.seconds);
        self.rows.extend(rows.into_iter().map(|row| Row { ratio: row.seconds / first, ..row }));
        Ok(())
    }
}

struct TimedWork<'a> {
    work: Work<'a>,
    times: Vec<f64>,
    /// Sum of the times.
    spent: f64,
    last: RunResult,
}

impl<'a> TimedWork<'a> {
    fn new(work: Work<'a>) -> Self {
        Self { work, times: vec![], spent: 0.0, last: RunResult::default() }
    }

    fn run_once(&mut self) -> Result<()> {
        self.last = (self.work.run)()?;
        self.spent += self.last.seconds;
        self.times.push(self.last.seconds);
        Ok(())
    }

    fn row(self) -> Row {
        let RunResult { units, contacts, floor_seconds, write_seconds, peak_mib, result_mib, .. } = self.last;
        let row = self.work.row;
        Row {
            units: if units > 0.0 { units } else { row.units },
            contacts,
            floor_seconds,
            write_seconds,
            peak_mib,
            result_mib,
            min_seconds: self.times.iter().copied().fold(f64::INFINITY, f64::min),
            rounds: self.times.len(),
            seconds: median(self.times),
            ..row
        }
    }
}

/// Runs on a pool of `threads` threads. Returns the result and the seconds without the start of the pool.
pub fn timed<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<(T, f64)> {
    on_threads(threads, || {
        let started = Instant::now();
        let result = work();
        (result, started.elapsed().as_secs_f64())
    })
}

/// Powers of two below `cores`, then `cores`.
pub fn thread_counts(cores: usize) -> Vec<usize> {
    let mut counts: Vec<usize> =
        std::iter::successors(Some(1), |count| Some(2 * count)).take_while(|count| *count < cores).collect();
    counts.push(cores);
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_work_that_fails_is_left_out_and_the_others_go_on() {
        let work = |resolution: u32| {
            let run = move || if resolution == 2 { anyhow::bail!("too large") } else { Ok(RunResult::timed(1.0)) };
            let row = Row { group: "resolution", work: "bake".to_owned(), resolution, ..Row::default() };
            Work { row, size: 1.0, run: Box::new(run) }
        };
        let mut turns = RoundRobin::new(2, 60.0);
        turns.measure(vec![work(1), work(2), work(3)]).unwrap();
        assert_eq!(turns.rows.iter().map(|row| row.resolution).collect::<Vec<_>>(), [1, 3]);
        assert_eq!(turns.left_out, ["resolution: bake, 0 triangles, resolution 2: too large"]);
    }
}
