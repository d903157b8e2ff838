//! Many runs of one scene: every combination of the values that it lists.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use sdf_field::Threads;

use super::build::Stage;
use super::figures::Figures;
use super::run::{ElementMethod, run};
use super::spec::SceneSpec;
use super::{SceneError, invalid};

/// Figures of all runs of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The worst of each.
    pub worst: Figures,
    /// How many runs there were.
    pub runs: usize,
    /// Runs that ended without deep faces.
    pub freed: usize,
    /// Runs whose speed stayed below the scene's `calm_speed`, and finite.
    pub calm: usize,
    /// Runs that ended with more deep faces than they began with.
    pub worse: usize,
    /// Wanted figures that were missed: value and limit.
    pub missed: BTreeMap<&'static str, [f64; 2]>,
}

impl Outcome {
    /// Is everything reached?
    pub fn is_reached(&self) -> bool {
        self.missed.is_empty()
    }

    /// How badly a method failed, to compare with the scene's `fails`: runs that were not freed or not calm where the scene wants that,
    /// else the largest number of deep faces or of vertices beyond.
    pub fn failures(&self, spec: &SceneSpec) -> usize {
        match (spec.reach.freed, spec.reach.calm) {
            (Some(_), _) => self.runs - self.freed,
            (_, Some(_)) => self.runs - self.calm,
            _ if !self.worst.finite => usize::MAX,
            _ => self.worst.deep_faces.max(self.worst.beyond),
        }
    }
}

/// The scene with each combination of the values that it lists, or the scene alone.
pub fn variants(spec: &SceneSpec) -> Vec<SceneSpec> {
    let mut all = vec![spec.clone()];
    let vary = &spec.vary;
    multiply(&mut all, &vary.rate, |spec, value| spec.rate = *value);
    multiply(&mut all, &vary.substeps, |spec, value| spec.substeps = *value);
    multiply(&mut all, &vary.friction, |spec, value| spec.friction = *value);
    multiply(&mut all, &vary.thickness, |spec, value| spec.thickness = *value);
    multiply(&mut all, &vary.recovery, |spec, value| spec.recovery = *value);
    multiply(&mut all, &vary.mass_ratio, |spec, value| spec.vary.mass_ratio = vec![*value]);
    multiply(&mut all, &vary.speed, |spec, factor| {
        let cloths = spec.cloth.iter_mut().map(|cloth| &mut cloth.start);
        for start in cloths.chain(spec.rigid.iter_mut().map(|rigid| &mut rigid.start)) {
            start.velocity = start.velocity.map(|v| v * factor);
        }
        spec.obstacle.iter_mut().for_each(|obstacle| obstacle.period /= factor);
        // What is slow needs as long to arrive.
        spec.frames = (f64::from(spec.frames) / factor.min(1.0)).min(f64::from(spec.frames) * 20.0) as u32;
    });
    let seeds: Vec<u64> = (0..u64::from(vary.seeds)).map(|index| spec.seed + index).collect();
    multiply(&mut all, &seeds, |spec, seed| spec.seed = *seed);
    all
}

fn multiply<T>(all: &mut Vec<SceneSpec>, values: &[T], set: impl Fn(&mut SceneSpec, &T)) {
    if values.is_empty() {
        return;
    }
    let with = |spec: &SceneSpec, value| {
        let mut spec = spec.clone();
        set(&mut spec, value);
        spec
    };
    *all = all.iter().flat_map(|spec| values.iter().map(|value| with(spec, value)).collect::<Vec<_>>()).collect();
}

/// Runs all variants of a scene, or every `stride`th. `on_frame` sees the frames of the first run: it may record them.
pub fn run_all(
    spec: &SceneSpec,
    folder: &Path,
    method: ElementMethod,
    threads: Threads,
    stride: usize,
    mut on_frame: impl FnMut(usize, u32, &Stage) -> ControlFlow<()>,
) -> Result<Outcome, SceneError> {
    let obstacles = Stage::obstacles(spec, folder, threads)?;
    let mut all: Option<Outcome> = None;
    for (index, variant) in variants(spec).iter().step_by(stride.max(1)).enumerate() {
        let mut stage = Stage::with_obstacles(variant, folder, threads, obstacles.clone())?;
        if let [ratio] = variant.vary.mass_ratio[..] {
            stage.world.inv_mass.iter_mut().step_by(2).for_each(|inv_mass| *inv_mass /= ratio);
        }
        let mut is_ended = false;
        let figures = run(variant, &mut stage, method, threads, |frame, stage| {
            let flow = on_frame(index, frame, stage);
            is_ended |= flow.is_break();
            flow
        });
        let figures = figures.map_err(|error| invalid(&spec.title, error))?;
        let is_calm = figures.finite && figures.max_speed <= spec.reach.calm_speed.unwrap_or(f64::INFINITY);
        let is_free = figures.finite && figures.deep_faces == 0;
        let is_worse = figures.deep_faces > figures.deep_at_start;
        let so_far = all.take();
        all = Some(Outcome {
            worst: so_far.as_ref().map_or(figures.clone(), |so_far| so_far.worst.worst(&figures)),
            runs: so_far.as_ref().map_or(0, |so_far| so_far.runs) + 1,
            freed: so_far.as_ref().map_or(0, |so_far| so_far.freed) + usize::from(is_free),
            calm: so_far.as_ref().map_or(0, |so_far| so_far.calm) + usize::from(is_calm),
            worse: so_far.as_ref().map_or(0, |so_far| so_far.worse) + usize::from(is_worse),
            missed: BTreeMap::new(),
        });
        if is_ended {
            break;
        }
    }
    let mut all = all.ok_or_else(|| invalid(&spec.title, "a list of values to vary has no runs"))?;
    all.missed = all.worst.missed(&spec.reach);
    for (name, count, least) in [("freed", all.freed, spec.reach.freed), ("calm", all.calm, spec.reach.calm)] {
        let share = count as f64 / all.runs as f64;
        if let Some(least) = least.filter(|least| share < *least) {
            all.missed.insert(name, [share, least]);
        }
    }
    if let Some(most) = spec.reach.worse.filter(|most| all.worse > *most) {
        all.missed.insert("worse", [all.worse as f64, most as f64]);
    }
    Ok(all)
}
