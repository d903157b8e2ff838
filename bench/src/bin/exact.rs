//! Meaning of a grid's error for contacts: every method on one scene, held against the mesh that was baked.
//!
//! `cargo run --release -p sdf-bench --bin exact -- cloth.obj dragon.obj --res 256 --margin 0.01`

use std::io::{Write, stdout};
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;
use cpu_time::ThreadTime;
use sdf_bench::exit_code;
use sdf_field::core::contact::{Contact, ContactStatus};
use sdf_field::core::grid::owned::Layout;
use sdf_field::{BakeOptions, ContactOptions, Contacts, Field, GridSize, MeshView, Method, Threads};
use sdf_formats::mesh;

/// Contacts of a mesh with the grid of another, by every method, compared with those by the triangles of that other mesh.
///
/// Truth is the exact search, each of whose contacts is certified. Missed: within the margin of the mesh, and not reported. False:
/// reported, and not within it. Shallow: inside of the mesh, and told to be outside or not reported. Times are those of one thread.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 110)]
struct Args {
    /// The mesh whose faces are searched.
    mesh: PathBuf,
    /// The mesh that is baked.
    body: PathBuf,
    /// Cells along the longest side.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..))]
    res: u32,
    /// Faces within this distance count.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    margin: f64,
    /// Bake a sparse grid.
    #[arg(long)]
    sparse: bool,
    /// Runs of each method; the shortest time counts.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
}

const EXACT: usize = 0;

fn main() -> ExitCode {
    exit_code(run(&Args::parse()))
}

fn run(args: &Args) -> Result<()> {
    let [mesh, body] = [&args.mesh, &args.body].map(|path| mesh::read(path));
    let (mesh, body) = (mesh?, body?);
    let layout = if args.sparse { Layout::Sparse } else { Layout::Dense };
    let options = BakeOptions { size: GridSize::Cells(args.res), layout, keep_mesh: true, ..BakeOptions::default() };
    let field = Field::bake(MeshView { points: &body.points, faces: &body.triangles }, &options)?.field;
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let plain = ContactOptions { margin: args.margin, threads: Threads::ONE, ..ContactOptions::default() };
    let method = |method| ContactOptions { method, ..plain };
    let searches = [
        ("exact", ContactOptions { exact: true, ..plain }),
        ("auto", plain),
        ("auto, complete", ContactOptions { complete: true, ..plain }),
        ("certified", method(Method::Certified)),
        ("Frank-Wolfe", method(Method::FrankWolfe)),
        ("corners and 64 samples", method(Method::SamplingWithCorners(64))),
        ("64 samples", method(Method::Sampling(64))),
        ("corners", method(Method::SamplingWithCorners(0))),
    ];
    let start = ThreadTime::now();
    let first = field.contacts(view, &searches[EXACT].1)?;
    let first_seconds = start.elapsed().as_secs_f64();
    let mut times = [f64::INFINITY; 8];
    let mut found: Vec<Contacts> = vec![first; searches.len()];
    for _ in 0..args.rounds {
        for (index, (_, options)) in searches.iter().enumerate() {
            let start = ThreadTime::now();
            found[index] = field.contacts(view, options)?;
            times[index] = times[index].min(start.elapsed().as_secs_f64());
        }
    }
    let truth = &found[EXACT].contacts;
    let certified = truth.iter().filter(|contact| contact.status == ContactStatus::Converged).count();
    let mut page = format!(
        "{} faces within the margin of the mesh, {certified} of them certified, {} inside; the first exact search made the tree and \
         took {first_seconds:.3} s\n\n| method | contacts | missed | false | shallow | worst error | ms | times auto |\n|{}\n",
        truth.len(),
        truth.iter().filter(|contact| contact.distance < 0.0).count(),
        "---|".repeat(8),
    );
    for (index, (name, _)) in searches.iter().enumerate() {
        let Faults { missed, wrong, shallow, worst } = faults(truth, &found[index].contacts);
        let (milliseconds, ratio) = (1e3 * times[index], times[index] / times[1]);
        let count = found[index].contacts.len();
        page += &format!(
            "| {name} | {count} | {missed} | {wrong} | {shallow} | {worst:.1e} | {milliseconds:.1} | {ratio:.2} |\n"
        );
    }
    stdout().write_all(page.as_bytes()).context("standard output")
}

struct Faults {
    missed: usize,
    wrong: usize,
    shallow: usize,
    /// Largest difference of a distance from the true one.
    worst: f64,
}

/// Both lists are in the order of the faces.
fn faults(truth: &[Contact<f64>], found: &[Contact<f64>]) -> Faults {
    let is_told = |contact: &&Contact<f64>| contact.status != ContactStatus::Possible;
    let mut others = found.iter().filter(is_told).peekable();
    let mut faults = Faults { missed: 0, wrong: 0, shallow: 0, worst: 0.0 };
    let told = found.iter().filter(is_told).count();
    let mut matched = 0;
    for contact in truth {
        while others.next_if(|other| other.element < contact.element).is_some() {}
        let other = others.next_if(|other| other.element == contact.element);
        let is_listed = found.binary_search_by_key(&contact.element, |other| other.element).is_ok();
        faults.missed += usize::from(!is_listed);
        let is_inside = contact.distance < 0.0;
        faults.shallow += usize::from(is_inside && other.is_none_or(|other| other.distance >= 0.0));
        if let Some(other) = other {
            matched += 1;
            faults.worst = faults.worst.max((other.distance - contact.distance).abs());
        }
    }
    faults.wrong = told - matched;
    faults
}
