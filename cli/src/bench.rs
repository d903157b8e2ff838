//! How fast this machine does our work, beside what the machine itself can do.

pub mod csv;
pub mod kernels;
pub mod page;
pub mod table;

mod bakes;
mod bodies;
mod contacts;
mod limits;
mod machine;
mod peers;
mod plots;
mod processes;
mod reading;
mod row;
mod targets;
mod turns;

use anyhow::Result;

use crate::args::{BenchArgs, BenchGroup};
use limits::Limits;
use machine::Machine;
use row::Row;
use turns::Turns;

/// All that was measured.
pub struct Bench {
    pub machine: Machine,
    pub rows: Vec<Row>,
    /// Works that were not done, and why.
    pub left_out: Vec<String>,
}

/// In the order of the table.
const GROUPS: [BenchGroup; 7] = [
    BenchGroup::Limits,
    BenchGroup::Resolution,
    BenchGroup::Triangles,
    BenchGroup::Threads,
    BenchGroup::Contacts,
    BenchGroup::Reading,
    BenchGroup::Commands,
];

pub fn run(args: &BenchArgs) -> Result<Bench> {
    let mut turns = Turns::new(args.rounds, args.limit);
    let is_wanted = |group: &BenchGroup| args.only.is_empty() || args.only.contains(group);
    // The limits of a single thread are wanted for every share, but not where one group was asked for.
    let limits = if is_wanted(&BenchGroup::Limits) { Some(limits::measure(args.quick, &mut turns)?) } else { None };
    for group in GROUPS.iter().filter(|group| is_wanted(group)) {
        measure(group, args, limits.as_ref(), &mut turns)?;
    }
    let Turns { rows, left_out, .. } = turns;
    Ok(Bench { machine: Machine::here(), rows, left_out })
}

fn measure(group: &BenchGroup, args: &BenchArgs, limits: Option<&Limits>, turns: &mut Turns) -> Result<()> {
    match group {
        BenchGroup::Limits => Ok(()),
        BenchGroup::Resolution => bakes::against_resolution(args.quick, limits, turns),
        BenchGroup::Triangles => bakes::against_triangles(args.quick, limits, turns),
        BenchGroup::Threads => {
            bakes::against_threads(args.quick, limits, turns)?;
            contacts::against_threads(args, limits, turns)
        }
        BenchGroup::Contacts => contacts::by_method(args, limits, turns),
        BenchGroup::Reading => reading::measure(args.quick, limits, turns),
        BenchGroup::Commands => processes::measure(args.quick, turns),
    }
}
