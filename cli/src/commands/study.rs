use std::path::Path;

use anyhow::{Context, Result};
use sdf_formats::atomic_write;
use serde_json::json;

use crate::args::StudyArgs;
use crate::mesh_input::at;
use crate::report::{Report, seconds};
use crate::study::{self, Page};
use crate::{output, progress};

pub fn run(args: &StudyArgs) -> Result<()> {
    let scenes = study::read_scenes(&args.scenes)?;
    let folders = [Some(&args.output), args.docs.as_ref()];
    folders.into_iter().flatten().try_for_each(|folder| prepare(folder))?;
    let bar = progress::bar("studying", PARTS + 2 * scenes.len() as u64);
    let done = || bar.inc(1);
    let study = progress::on_threads(args.threads, || study::run(&scenes, args.short, &done))??;
    bar.finish_and_clear();
    let pages = study::folder(&study)?;
    pages.iter().try_for_each(|page| write(&args.output, page))?;
    if let Some(docs) = &args.docs {
        study::docs(&study)?.iter().try_for_each(|page| write(docs, page))?;
    }
    let shown = args.output.join("index.html");
    Report {
        rows: vec![
            ("report", shown.display().to_string()),
            ("sets", format!("{} of {} problems", study.sets.len(), study.apexes.problems)),
            ("scenes", study.scenes.len().to_string()),
            ("time", seconds(study.seconds)),
        ],
        json: json!({
            "schema": "sdftool.study/1",
            "folder": args.output.display().to_string(),
            "report": shown.display().to_string(),
            "short": args.short,
            "seconds": study.seconds,
        }),
    }
    .print(args.json)
}

/// Sets of problems, apexes among them.
const PARTS: u64 = 8;

/// Makes a folder, and makes sure that it takes files, before minutes are spent on them.
fn prepare(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let probe = folder.join(format!(".sdftool-{}.probe", std::process::id()));
    at(folder, std::fs::create_dir(&probe).and_then(|()| std::fs::remove_dir(&probe)))
}

fn write(folder: &Path, page: &Page) -> Result<()> {
    let path = folder.join(&page.name);
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent).with_context(|| parent.display().to_string())?;
    }
    output::require(&path, &[])?;
    at(&path, atomic_write(&path, |temporary| std::fs::write(temporary, &page.content)))
}
