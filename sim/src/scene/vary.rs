//! Many runs of one scene: every combination of the values that it lists.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use sdf_field::Threads;

use super::build::Stage;
use super::figures::Figures;
use super::run::{ElementMethod, run};
use super::spec::{SceneSpec, Vary};
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
    /// Reasons why the other figures may say little, a line each: those of the stage, then those of the worst figures.
    pub warnings: Vec<String>,
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

/// Number of combinations of the values that a scene lists; infinite if it cannot be counted.
pub(super) fn variant_count(vary: &Vary) -> f64 {
    lengths(vary).into_iter().map(|length| length as f64).product()
}

/// How many values each list offers; an empty one keeps the scene's own.
fn lengths(vary: &Vary) -> [usize; 8] {
    let Vary { rate, substeps, friction, thickness, recovery, mass_ratio, speed, seeds } = vary;
    let lists = [rate, friction, thickness, recovery, mass_ratio, speed].map(Vec::len);
    let [rate, friction, thickness, recovery, mass_ratio, speed] = lists;
    [rate, substeps.len(), friction, thickness, recovery, mass_ratio, speed, *seeds as usize]
        .map(|length| length.max(1))
}

/// The scene with each combination of the values that it lists, or the scene alone. The last list changes fastest.
pub fn variants(spec: &SceneSpec) -> impl ExactSizeIterator<Item = SceneSpec> {
    let lengths = lengths(&spec.vary);
    (0..lengths.iter().product()).map(move |mut number: usize| {
        let mut indices = lengths;
        for (index, length) in indices.iter_mut().zip(lengths).rev() {
            *index = number % length;
            number /= length;
        }
        variant(spec, indices)
    })
}

fn variant(spec: &SceneSpec, indices: [usize; 8]) -> SceneSpec {
    let [rate, substeps, friction, thickness, recovery, mass_ratio, speed, seed] = indices;
    let (mut new, vary) = (spec.clone(), &spec.vary);
    let set = |value: &mut f64, list: &[f64], index: usize| *value = list.get(index).copied().unwrap_or(*value);
    set(&mut new.rate, &vary.rate, rate);
    new.substeps = vary.substeps.get(substeps).copied().unwrap_or(spec.substeps);
    set(&mut new.friction, &vary.friction, friction);
    set(&mut new.thickness, &vary.thickness, thickness);
    set(&mut new.recovery, &vary.recovery, recovery);
    new.vary.mass_ratio = vary.mass_ratio.get(mass_ratio).copied().into_iter().collect();
    if let Some(factor) = vary.speed.get(speed) {
        let cloths = new.cloth.iter_mut().map(|cloth| &mut cloth.start);
        let rigid = new.rigid.iter_mut().map(|rigid| &mut rigid.start);
        for start in cloths.chain(rigid).chain(new.soft.iter_mut().map(|soft| &mut soft.start)) {
            start.velocity = start.velocity.map(|v| v * factor);
            start.spin = start.spin.map(|v| v * factor);
        }
        new.obstacle.iter_mut().for_each(|obstacle| obstacle.period = Some(obstacle.period.unwrap_or(1.0) / factor));
        // What is slow needs as long to arrive.
        new.frames = (f64::from(spec.frames) / factor.min(1.0)).min(f64::from(spec.frames) * 20.0) as u32;
    }
    new.seed = spec.seed.wrapping_add(seed as u64);
    new
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
    let (mut all, mut warnings): (Option<Outcome>, _) = (None, vec![]);
    for (index, variant) in variants(spec).step_by(stride.max(1)).enumerate() {
        let mut stage = Stage::with_obstacles(&variant, folder, threads, obstacles.clone())?;
        if let [ratio] = variant.vary.mass_ratio[..] {
            stage.world.inv_mass.iter_mut().step_by(2).for_each(|inv_mass| *inv_mass /= ratio);
        }
        let mut is_ended = false;
        let figures = run(&variant, &mut stage, method, threads, |frame, stage| {
            let flow = on_frame(index, frame, stage);
            is_ended |= flow.is_break();
            flow
        });
        let figures = figures.map_err(|error| invalid(&spec.name, error))?;
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
            warnings: vec![],
        });
        // Those of every variant: its bodies are the same.
        warnings = stage.warnings;
        if is_ended {
            break;
        }
    }
    let mut all = all.ok_or_else(|| invalid(&spec.name, "a list of values to vary has no runs"))?;
    all.missed = all.worst.missed(&spec.reach);
    all.warnings = [warnings, all.worst.warnings()].concat();
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
