//! Speed of bakes, contact searches, reading and writing, beside the limits of the machine.
//!
//! | part | file |
//! |---|---|
//! | works of each group | `limits`, `bakes`, `contacts`, `lanes`, `reading`, `commands`; bodies in `bodies` |
//! | works in turns, and their medians | `round_robin`, `row` |
//! | output | `table` (terminal), `csv`, `page` (docs/performance.md) with `peers` and `plot` |
//! | fixed works for instruction counts | `kernels` |

pub mod csv;
pub mod kernels;
pub mod page;
pub mod table;

mod bakes;
mod bodies;
mod commands;
mod contacts;
mod lanes;
mod limits;
mod peers;
mod plot;
mod reading;
mod round_robin;
mod row;

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use sdf_field::Method;

use crate::machine::Machine;
use limits::MachineLimits;
use round_robin::RoundRobin;
use row::Row;

#[derive(Debug, Args)]
pub struct Options {
    /// Run a short version of every measurement.
    #[arg(long)]
    pub quick: bool,
    /// Groups of measurements, separated by commas [default: all].
    #[arg(long, value_enum, value_delimiter = ',', value_name = "GROUP")]
    pub only: Vec<Group>,
    /// With --field: a mesh whose contacts with the field are measured instead of the built-in cloth's.
    #[arg(long, requires = "field")]
    pub mesh: Option<PathBuf>,
    /// With --mesh: the field, a baked grid or shapes in TOML.
    #[arg(long, requires = "mesh")]
    pub field: Option<PathBuf>,
    /// Margin of contacts, in the unit of the mesh.
    #[arg(long, value_name = "D", default_value_t = 0.01, allow_negative_numbers = true)]
    pub margin: f64,
    /// Measure contacts by this method only [default: several].
    #[arg(long)]
    pub method: Option<Method>,
    /// Smallest number of runs of each work.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: u32,
    /// Longest run of a work in seconds; works that are predicted to take longer are left out and listed.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    pub limit: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Group {
    /// Limits of the machine: copying, interpolating, distances of points from triangles.
    Limits,
    /// Baking against resolution.
    Resolution,
    /// Baking against the number of triangles.
    Triangles,
    /// Contacts against the number of faces.
    Elements,
    /// Baking and contacts against the number of threads.
    Threads,
    /// Contacts by several methods.
    Contacts,
    /// Contacts in f32 beside f64, several side by side.
    Lanes,
    /// The set-up of a mesh: what a bake does before its first node.
    SetUp,
    /// Reading an OBJ file.
    Reading,
    /// Whole commands as processes, with their peak memory, on grids that are packed and that are not. Needs sdftool: `cargo build --release -p sdftool`.
    Commands,
}

/// Everything that was measured.
pub struct SpeedReport {
    pub machine: Machine,
    pub rows: Vec<Row>,
    /// Works that were left out, each with the reason.
    pub left_out: Vec<String>,
}

/// All groups, in the order of the table.
const GROUPS: [Group; 10] = [
    Group::Limits,
    Group::Resolution,
    Group::Triangles,
    Group::Elements,
    Group::Threads,
    Group::Contacts,
    Group::Lanes,
    Group::SetUp,
    Group::Reading,
    Group::Commands,
];

pub fn run(options: &Options) -> Result<SpeedReport> {
    let mut turns = RoundRobin::new(options.rounds, options.limit);
    let is_wanted = |group: &Group| options.only.is_empty() || options.only.contains(group);
    let limits = if is_wanted(&Group::Limits) { Some(limits::measure(options.quick, &mut turns)?) } else { None };
    for group in GROUPS.iter().filter(|group| is_wanted(group)) {
        measure(group, options, limits.as_ref(), &mut turns)?;
    }
    let RoundRobin { rows, left_out, .. } = turns;
    Ok(SpeedReport { machine: Machine::here(), rows, left_out })
}

fn measure(group: &Group, options: &Options, limits: Option<&MachineLimits>, turns: &mut RoundRobin) -> Result<()> {
    match group {
        Group::Limits => Ok(()),
        Group::Resolution => bakes::against_resolution(options.quick, limits, turns),
        Group::Triangles => bakes::against_triangles(options.quick, limits, turns),
        Group::Elements => contacts::against_elements(options, limits, turns),
        Group::Threads => {
            bakes::against_threads(options.quick, limits, turns)?;
            contacts::against_threads(options, limits, turns)
        }
        Group::Contacts => contacts::against_methods(options, limits, turns),
        Group::Lanes => lanes::measure(options.quick, turns),
        Group::SetUp => bakes::set_up(options.quick, turns),
        Group::Reading => reading::measure(options.quick, limits, turns),
        Group::Commands => commands::measure(options.quick, turns),
    }
}
