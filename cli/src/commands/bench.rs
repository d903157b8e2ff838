use anyhow::{Context, Result};
use serde_json::json;

use crate::args::BenchArgs;
use crate::bench::{self, Bench, page};
use crate::mesh_input::at;
use crate::output;
use crate::report::print_json;

pub fn run(args: &BenchArgs) -> Result<()> {
    if let Some(kernel) = &args.kernel {
        return bench::kernels::run(kernel, args.times);
    }
    if let Some(docs) = &args.docs {
        let folder = docs.join(page::FOLDER);
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    if let Some(path) = &args.csv {
        output::require(path, &[])?;
    }
    if !args.rewrite {
        let bench = bench::run(args)?;
        print(args, &bench)?;
        if let Some(path) = &args.csv {
            at(path, std::fs::write(path, bench::csv::text(&bench)))?;
        }
        if let Some(docs) = &args.docs {
            page::keep(docs, &bench)?;
        }
    }
    args.docs.as_ref().map_or(Ok(()), |docs| page::write(docs))
}

fn print(args: &BenchArgs, bench: &Bench) -> Result<()> {
    if args.json.wanted {
        return print_json(&json!({
            "schema": "sdftool.bench/1",
            "machine": bench.machine,
            "rows": bench.rows,
            "left_out": bench.left_out,
        }));
    }
    bench::table::print(bench)
}
