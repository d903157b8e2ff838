//! Runs a scene, or all scenes of a folder, and prints what was measured.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use sdf_formats::atomic_write;
use sdf_sim::record::{self, Recording};
use sdf_sim::scene::{self, Figures, Outcome, SceneSpec, Stage};
use serde_json::{Value, json};

use crate::args::{MethodWord, SimulateArgs};
use crate::failure::misuse;
use crate::mesh_input::{is_standard_input, with_path};
use crate::report::{Report, complain, number, print_json};
use crate::standard_output::{Prints, print_bytes};
use crate::{failure, memory, output, progress, signals};

pub fn run(args: &SimulateArgs) -> Result<()> {
    if args.scene.as_deref().is_some_and(is_standard_input) {
        misuse!("a scene names files beside it, and cannot be standard input: name its file");
    }
    if args.suite {
        return suite(args);
    }
    let (Some(path), [method]) = (&args.scene, &args.methods[..]) else { misuse!("give a scene and one method") };
    let spec = scene::read(path)?;
    let mut target = args.output.as_deref().map(|output| Target::new(output, path)).transpose()?;
    let outcome = run_one(args, &spec, path, method, target.as_mut())?;
    if signals::status().is_some() {
        return Ok(());
    }
    let json = object(path, &spec, method, &outcome);
    Report { rows: rows(&spec, &outcome), json }.print(args.json)
}

fn run_one(
    args: &SimulateArgs,
    spec: &SceneSpec,
    path: &Path,
    method: &MethodWord,
    mut target: Option<&mut Target>,
) -> Result<Outcome> {
    let mut spec = spec.clone();
    if args.small {
        spec.shrink();
    }
    spec.frames = args.frames.unwrap_or(spec.frames);
    let stride = if args.small { 8 } else { 1 };
    let total = scene::variants(&spec).step_by(stride).map(|spec| u64::from(spec.frames)).sum();
    // Of several runs the first is recorded.
    let first = scene::variants(&spec).next().unwrap_or_else(|| spec.clone());
    let bar = progress::bar("simulating", total);
    let folder = path.parent().unwrap_or(Path::new("."));
    let threads = sdf_field::Threads::new(args.threads.count.map_or(0, usize::from));
    let mut failure = None;
    let outcome = scene::run_all(&spec, folder, method.method, threads, stride, |run, frame, stage| {
        bar.inc(u64::from(frame > 0));
        let recorded = match target.as_deref_mut().filter(|_| run == 0) {
            Some(target) => target.add(&first, frame, stage),
            None => Ok(()),
        };
        match recorded {
            Ok(()) if signals::status().is_some() => ControlFlow::Break(()),
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                failure = Some(error);
                ControlFlow::Break(())
            }
        }
    });
    bar.finish_and_clear();
    if let Some(error) = failure {
        return Err(error);
    }
    let mut outcome = outcome?;
    if let Some(target) = target {
        target.write()?;
        outcome.warnings.extend(target.recording.warnings.iter().cloned());
        if signals::status().is_some() {
            let told = target.frames();
            match outcome.runs {
                1 => complain(&format!("ended by a signal after {told}")),
                runs => complain(&format!("ended by a signal in run {runs}; the first has {told}")),
            }
        }
    }
    Ok(outcome)
}

/// Where a recording is written to, and the frames so far.
struct Target {
    path: PathBuf,
    form: Form,
    recording: Recording,
    /// When it was written last, and how long that took.
    written: Option<(Instant, Duration)>,
    /// Frames that were written then.
    kept: usize,
}

/// Form of a recording.
#[derive(Clone, Copy)]
enum Form {
    Page,
    /// A PNG of frames one after the other.
    Animation,
    /// A PNG of frames side by side.
    Sheet,
    VtkHdf,
    Folder,
}

/// While it runs, the file is written again after so long: what kills the program leaves a recording that opens.
const BETWEEN_WRITES: Duration = Duration::from_secs(10);

/// Writing takes at most one part in so many of the time.
const MAX_SHARE: u32 = 20;

/// Frames of a PNG side by side, and their side in pixels.
const SHEET: [usize; 2] = [4, 320];

/// Most frames of an animated PNG, and their side in pixels.
const ANIMATION: [usize; 2] = [60, 320];

/// Cells of the lattice by which obstacles are drawn.
const OUTLINE_CELLS: u32 = 72;

impl Target {
    fn new(path: &Path, scene: &Path) -> Result<Self> {
        let form = match kind(path) {
            Some("html") => Form::Page,
            Some("png") => Form::Animation,
            Some("vtkhdf") => Form::VtkHdf,
            Some(other) => misuse!(
                "{}: a recording is OUT.vtkhdf, OUT.html, OUT.png or a folder of OBJ files, not .{other}: take one of these",
                path.display()
            ),
            None => Form::Folder,
        };
        match form {
            Form::Folder => {
                std::fs::create_dir_all(path).with_context(|| path.display().to_string())?;
                output::ensure_all_writable(&record::files_of_folder(path)?, &[scene])?;
            }
            _ => output::ensure_writable(path, &[scene])?,
        }
        if let Form::VtkHdf = form {
            output::ensure_writable(&record::still_path(path), &[scene])?;
        }
        Ok(Self { path: path.to_owned(), form, recording: Recording::default(), written: None, kept: 0 })
    }

    fn add(&mut self, spec: &SceneSpec, frame: u32, stage: &Stage) -> Result<()> {
        if frame == 0 {
            self.recording = Recording::new(&spec.title, spec.rate, stage, OUTLINE_CELLS);
        }
        self.recording.push(stage);
        if frame == 0 {
            // Where VTKHDF is written, all points are copied.
            let copies = if let Form::VtkHdf = self.form { 2.0 } else { 1.0 };
            let bytes = copies * size_of_val(&self.recording.frames[0][..]) as f64 * (f64::from(spec.frames) + 1.0);
            let smaller = "use fewer --frames or coarser meshes, or leave out --output";
            memory::require(bytes, &format!("a recording of {} frames", spec.frames), smaller)?;
            signals::defer();
        }
        let is_due = |(at, took): (Instant, Duration)| at.elapsed() > BETWEEN_WRITES.max(MAX_SHARE * took);
        if frame > 0 && self.written.is_none_or(is_due) {
            self.write()?;
        }
        Ok(())
    }

    /// Frames that ran, and those of them that the file holds; the start is not counted.
    fn frames(&self) -> String {
        let (all, path) = (self.recording.frames.len(), self.path.display());
        let kept = match self.form {
            Form::Page => record::page_frames(&self.recording).count(),
            Form::Animation => record::thinned(all, ANIMATION[0]).count(),
            Form::Sheet => all.min(SHEET[0]),
            Form::VtkHdf | Form::Folder => all,
        };
        let [all, kept] = [all, kept].map(|count| count.saturating_sub(1));
        match kept < all {
            true => format!("{all} frames, of which {path} holds {kept}, evenly over the run"),
            false => format!("{all} frames, which {path} holds"),
        }
    }

    fn write(&mut self) -> Result<()> {
        let start = Instant::now();
        let recording = &self.recording;
        let written = match self.form {
            Form::Page => write(&self.path, record::page(recording).as_bytes()),
            Form::Animation => write(&self.path, &record::animation(recording, ANIMATION[0], ANIMATION[1])),
            Form::Sheet => write(&self.path, &record::contact_sheet(recording, SHEET[0], SHEET[1])),
            Form::VtkHdf => record::write_vtkhdf(recording, &self.path),
            Form::Folder => record::write_folder(recording, self.kept, &self.path),
        };
        // What an earlier write of this run left stays.
        let written = match self.kept {
            0 => written.map_err(anyhow::Error::new),
            kept => written.with_context(|| format!("the first {kept} frames were kept, and no more")),
        };
        written.with_context(|| self.path.display().to_string())?;
        self.written = Some((Instant::now(), start.elapsed()));
        self.kept = recording.frames.len();
        Ok(())
    }
}

fn write(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    atomic_write(path, |temporary| std::fs::write(temporary, bytes))
}

/// The ending; `None` of a folder.
fn kind(path: &Path) -> Option<&str> {
    let is_folder = path.is_dir() || path.to_string_lossy().ends_with('/');
    path.extension().and_then(|ending| ending.to_str()).filter(|_| !is_folder)
}

fn name(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn object(path: &Path, spec: &SceneSpec, method: &MethodWord, outcome: &Outcome) -> Value {
    let mut object = json!({
        "schema": "sdftool.simulate/1",
        "scene": name(path),
        "title": spec.title,
        "method": method.word,
        "runs": outcome.runs,
        "freed": outcome.freed,
        "calm": outcome.calm,
        "worse": outcome.worse,
        "must_fail": spec.fails.get(&method.word),
        "missed": outcome.missed,
        "warnings": outcome.warnings,
    });
    if let (Value::Object(all), Ok(Value::Object(figures))) = (&mut object, serde_json::to_value(&outcome.worst)) {
        all.extend(figures);
    }
    object
}

/// Figures that are whole numbers.
const COUNTS: [&str; 3] = ["deep_faces", "beyond", "worse"];

fn rows(spec: &SceneSpec, outcome: &Outcome) -> Vec<(&'static str, String)> {
    let figures = &outcome.worst;
    let missed = outcome.missed.iter().map(|(name, [value, limit])| match value.is_nan() {
        true => format!("{name}: not known"),
        false if COUNTS.contains(name) => format!("{name}: {value} and not {limit}"),
        false => format!("{name}: {} and not {}", number(*value), number(*limit)),
    });
    let missed: Vec<String> = missed.collect();
    let mut rows = vec![
        ("scene", spec.title.clone()),
        ("frames", format!("{}{}", figures.frames, if figures.finite { "" } else { ", then not finite" })),
        ("deep faces", format!("{}, deepest {}", figures.deep_faces, number(figures.deepest))),
        ("stretch", number(figures.stretch)),
        ("at rest", at_rest(figures)),
        ("energy gain", number(figures.energy_gain)),
        (
            "contacts",
            format!("{} of {} elements, {} searched", figures.contacts, figures.elements[0], figures.elements[1]),
        ),
        ("seconds", format!("search {}, steps {}", number(figures.seconds.detect), number(figures.seconds.solve))),
    ];
    if outcome.runs > 1 {
        rows.insert(1, ("runs", format!("{}: {} free at the end, {} calm", outcome.runs, outcome.freed, outcome.calm)));
    }
    rows.extend(outcome.warnings.iter().map(|line| ("warning", line.clone())));
    rows.push(("missed", if missed.is_empty() { "nothing".to_owned() } else { missed.join("; ") }));
    rows
}

/// Movement at the end; it takes two frames.
fn at_rest(figures: &Figures) -> String {
    match (figures.jitter, figures.drift) {
        (Some(jitter), Some(drift)) => format!("speed {}, moved by {}", number(jitter), number(drift)),
        _ => "not known: fewer than two frames at the end".to_owned(),
    }
}

/// All scenes of a folder, by name.
fn suite(args: &SimulateArgs) -> Result<()> {
    let folder = args.scene.clone().unwrap_or_else(|| PathBuf::from("scenes"));
    let entries =
        std::fs::read_dir(&folder).with_context(|| format!("{}: give a folder of scenes", folder.display()))?;
    let files = entries.filter_map(|entry| Some(entry.ok()?.path()));
    // Fields in closed form lie beside the scenes that name them.
    let is_field = |path: &Path| path.to_str().is_some_and(|path| path.ends_with(".sdf.toml"));
    let mut scenes: Vec<PathBuf> = files.filter(|path| kind(path) == Some("toml") && !is_field(path)).collect();
    scenes.sort();
    if scenes.is_empty() {
        bail!("{}: has no scenes: give a folder with TOML files", folder.display());
    }
    if let Some(output) = &args.output {
        std::fs::create_dir_all(output).with_context(|| output.display().to_string())?;
    }
    let mut report = String::from(
        "# Scenes\n\n| scene | method | missed | deep faces | deepest | stretch | seconds |\n|---|---|---|---|---|---|---|\n",
    );
    let mut pictures = String::new();
    let (mut faults, mut prints) = (vec![], Prints::default());
    'scenes: for path in &scenes {
        let spec = match scene::read(path) {
            Ok(spec) => spec,
            Err(error) => {
                tell_unrun(path, "", &error.into(), &mut report, &mut faults);
                continue;
            }
        };
        let must_fail = spec.fails.keys().filter(|word| !args.methods.iter().any(|method| method.word == **word));
        let must_fail = must_fail.map(|word| word.parse()).collect::<Result<Vec<MethodWord>, _>>();
        let must_fail = must_fail.map_err(|error| anyhow!("{}: fails: {error}", path.display()))?;
        for (index, method) in args.methods.iter().chain(&must_fail).enumerate() {
            let picture =
                args.output.as_ref().filter(|_| index == 0).map(|folder| folder.join(format!("{}.png", name(path))));
            let mut target = picture.as_deref().map(|picture| Target::new(picture, path)).transpose()?;
            target.iter_mut().for_each(|target| target.form = Form::Sheet);
            let outcome = match run_one(args, &spec, path, method, target.as_mut()) {
                Ok(outcome) => outcome,
                Err(error) => {
                    tell_unrun(path, &method.word, &error, &mut report, &mut faults);
                    continue 'scenes;
                }
            };
            if signals::status().is_some() {
                break 'scenes;
            }
            prints.print(|| match args.json.wanted {
                true => print_json(&object(path, &spec, method, &outcome)),
                false => Report { rows: rows(&spec, &outcome), json: Value::Null }
                    .print(args.json)
                    .and_then(|()| print_bytes(b"\n")),
            });
            // A smaller scene is another one: what holds of the whole need not hold of it.
            let fault = fault(&spec, method, index == 0, &outcome).filter(|_| !args.small);
            faults.extend(fault.map(|fault| format!("{}: {fault}", name(path))));
            let figures = &outcome.worst;
            let missed: Vec<&str> = outcome.missed.keys().copied().collect();
            report += &format!(
                "| {} | {} | {} | {} | {} | {} | {} |\n",
                name(path),
                method.word,
                missed.join(", "),
                figures.deep_faces,
                number(figures.deepest),
                number(figures.stretch),
                number(figures.seconds.detect + figures.seconds.solve)
            );
            if index == 0 {
                pictures +=
                    &format!("\n## {}\n\n{}\n\n![{}]({}.png)\n", name(path), spec.title, name(path), name(path));
            }
        }
    }
    if let Some(output) = &args.output {
        with_path(&output.join("report.md"), write(&output.join("report.md"), (report + &pictures).as_bytes()))?;
    }
    // Where a signal ended it, the status says that.
    match faults.is_empty() || signals::status().is_some() {
        true => prints.end(),
        false => bail!("scenes that are not as they say: {}", faults.join("; ")),
    }
}

/// Says why a scene of a suite cannot be run: on standard error and in the report.
fn tell_unrun(path: &Path, method: &str, error: &anyhow::Error, report: &mut String, faults: &mut Vec<String>) {
    failure::report(error);
    let why = failure::sentence(error).replace('|', "\\|");
    *report += &format!("| {} | {method} | cannot be run: {why} | | | | |\n", name(path));
    faults.push(format!("{}: cannot be run", name(path)));
}

/// A scene that misses what it asks for by the first method, or a method that must fail and does not.
fn fault(spec: &SceneSpec, method: &MethodWord, is_first: bool, outcome: &Outcome) -> Option<String> {
    match spec.fails.get(&method.word) {
        Some(least) => {
            let failures = outcome.failures(spec);
            (failures < *least).then(|| format!("{} must fail by {least}, and fails by {failures}", method.word))
        }
        None if outcome.is_reached() || !is_first => None,
        None => {
            Some(format!("{} misses {}", method.word, outcome.missed.keys().copied().collect::<Vec<_>>().join(", ")))
        }
    }
}
