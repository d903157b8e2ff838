//! Are the numbers of a scene such as it can be run with? Each is refused by its body and key, with what to give instead.

use sdf_core::contact::MAX_REDUCED;
use sdf_procedural::{Bowl, Pot};
use toml::Spanned;
use toml::de::DeValue;

use super::build::too_far;
use super::mesh_spec::MeshSpec;
use super::run::ElementMethod;
use super::spec::{ClothSpec, ObstacleSpec, Reach, RigidSpec, SceneSpec, SoftSpec, Start, Vary};
use super::vary::variant_count;

/// Most frames, substeps and copies of a body, so that a mistyped number ends in a message. `Budget` limits all bodies together.
const MAX_COUNT: u32 = 1_000_000;

/// Most rounds over loaded edges: each costs as much as a pass over all contacts.
const MAX_ROUNDS: u32 = 100;

/// Most combinations of a scene's lists.
const MAX_VARIANTS: f64 = 100_000.0;

impl SceneSpec {
    pub(super) fn check(&self) -> Result<(), String> {
        is_positive("rate", self.rate)?;
        is_count("frames", self.frames)?;
        is_count("substeps", self.substeps)?;
        let others = [
            ("thickness", self.thickness),
            ("friction", self.friction),
            ("rolling_friction", self.rolling_friction),
            ("recovery", self.recovery),
            ("drag", self.drag),
            ("damping", self.damping),
        ];
        others.iter().try_for_each(|(name, value)| is_not_negative(name, *value))?;
        if self.loaded_rounds > MAX_ROUNDS {
            return Err(format!("loaded_rounds = {}: give a number from 0 to {MAX_ROUNDS}", self.loaded_rounds));
        }
        if let Some(count) = self.contacts_per_pair.filter(|count| !(1..=MAX_REDUCED).contains(count)) {
            return Err(format!("contacts_per_pair = {count}: give a number from 1 to {MAX_REDUCED}"));
        }
        self.vary.check()?;
        let has_vertices = !(self.cloth.is_empty() && self.soft.is_empty());
        if !(self.vary.mass_ratio.is_empty() || has_vertices) {
            return Err(
                "vary: mass_ratio: it is that of vertices: give a cloth or a soft body, or leave it out".to_owned()
            );
        }
        check_each("cloth", &self.cloth, ClothSpec::check)?;
        check_each("rigid", &self.rigid, RigidSpec::check)?;
        check_each("soft", &self.soft, SoftSpec::check)?;
        check_each("obstacle", &self.obstacle, ObstacleSpec::check)?;
        self.check_reach()?;
        for word in self.fails.keys() {
            word.parse::<ElementMethod>().map_err(|error| format!("fails: {error}"))?;
        }
        Ok(())
    }

    /// Refuses limits of figures that the scene does not have, and those that no run can reach.
    fn check_reach(&self) -> Result<(), String> {
        let reach = &self.reach;
        let Reach { momentum_error, beyond, calm, calm_speed, .. } = reach;
        let has_region = self.beyond.is_some_and(|region| region.below.is_some() || region.nearer.is_some());
        if momentum_error.is_some() && self.cloth.iter().any(|cloth| !cloth.pins.is_empty()) {
            return Err("reach: momentum_error: what holds pins is not known: give no limit, or no pins".to_owned());
        }
        if beyond.is_some() && !has_region {
            return Err("reach: beyond: give the region as [beyond], with below or nearer".to_owned());
        }
        let at_most = [
            ("deepest", reach.deepest, 0.0),
            ("stretch", reach.stretch, 1.0),
            ("jitter", reach.jitter, 0.0),
            ("drift", reach.drift, 0.0),
            ("turn", reach.turn, 0.0),
            ("energy_gain", reach.energy_gain, 0.0),
            ("momentum_error", *momentum_error, 0.0),
            ("calm_speed", *calm_speed, 0.0),
        ];
        for (name, limit, lowest) in at_most {
            if let Some(limit) = limit.filter(|limit| *limit < lowest) {
                return Err(format!("reach: {name} = {limit}: it is never below {lowest}: give a larger limit"));
            }
        }
        if let Some(least) = reach.volume.filter(|least| *least > 1.0) {
            return Err(format!("reach: volume = {least}: it is 1 before anything moves: give a smaller limit"));
        }
        for (name, share) in [("freed", reach.freed), ("calm", *calm)] {
            if let Some(share) = share.filter(|share| !(0.0..=1.0).contains(share)) {
                return Err(format!("reach: {name} = {share}: it is a share of runs: give a number from 0 to 1"));
            }
        }
        match (calm, calm_speed) {
            (Some(_), None) => Err("reach: calm: give calm_speed, above which a run is not calm".to_owned()),
            (None, Some(_)) => {
                Err("reach: calm_speed: give calm, the share of runs that are to stay below it".to_owned())
            }
            _ => Ok(()),
        }
    }
}

impl ClothSpec {
    fn check(&self) -> Result<(), String> {
        is_positive("mass", self.mass)?;
        is_not_negative("stretch", self.stretch)?;
        is_not_negative("bend", self.bend)?;
        check_spinless(&self.start)?;
        check_mesh(&self.mesh)
    }
}

impl RigidSpec {
    fn check(&self) -> Result<(), String> {
        is_positive("mass", self.mass)?;
        let copies: u128 = self.count.iter().map(|count| u128::from(*count)).product();
        if !(1..=u128::from(MAX_COUNT)).contains(&copies) {
            return Err(format!("count = {:?}: that is {copies}: give a number from 1 to {MAX_COUNT}", self.count));
        }
        let coincide = |axis: &usize| self.count[*axis] > 1 && self.apart[*axis] == 0.0;
        if let (None, Some(axis)) = (self.start.random, (0..3).find(coincide)) {
            let (count, axis) = (self.count[axis], ["x", "y", "z"][axis]);
            return Err(format!("apart: {count} bodies along {axis} would be at one place: give their distance"));
        }
        is_count("cells", self.cells)?;
        check_mesh(&self.mesh)
    }
}

impl SoftSpec {
    fn check(&self) -> Result<(), String> {
        is_positive("cell", self.cell)?;
        is_positive("density", self.density)?;
        is_positive("young", self.young)?;
        is_not_negative("padding", self.padding)?;
        is_count("cells", self.cells)?;
        if !(self.poisson > 0.0 && self.poisson < 0.5) {
            return Err(format!("poisson = {}: give a number between 0 and 0.5", self.poisson));
        }
        check_spinless(&self.start)?;
        check_mesh(&self.mesh)
    }
}

impl ObstacleSpec {
    fn check(&self) -> Result<(), String> {
        let Self { mesh, shape, becomes, period, file, cells, translate } = self;
        if let Some(cells) = cells {
            is_count("cells", *cells)?;
            if mesh.is_none() {
                return Err("cells: only an obstacle that is baked from mesh has them: leave them out".to_owned());
            }
        }
        if let Some(period) = period {
            is_positive("period", *period)?;
            if becomes.is_none() {
                return Err("period: only an obstacle with becomes has one: leave it out, or give becomes".to_owned());
            }
        }
        if let Some(x) = translate.iter().find(|x| x.abs() > f64::from(f32::MAX)) {
            return Err(too_far(*x));
        }
        if becomes.is_some() && shape.is_none() {
            return Err("becomes: give the shape to begin with as shape".to_owned());
        }
        if [mesh.is_some(), shape.is_some(), file.is_some()].iter().filter(|is_given| **is_given).count() != 1 {
            return Err("an obstacle is one of mesh, shape and file: give one of them".to_owned());
        }
        mesh.as_ref().map_or(Ok(()), check_mesh)
    }
}

/// Checks bodies; an error begins with the one that it is about, counted from 1 as in other messages.
fn check_each<T>(name: &str, bodies: &[T], check: impl Fn(&T) -> Result<(), String>) -> Result<(), String> {
    (1..)
        .zip(bodies)
        .try_for_each(|(number, body)| check(body).map_err(|message| format!("{name} {number}: {message}")))
}

fn check_spinless(start: &Start) -> Result<(), String> {
    match start.spin == [0.0; 3] {
        true => Ok(()),
        false => Err("spin: rigid bodies alone take one: give cloths and soft bodies a velocity".to_owned()),
    }
}

impl Vary {
    /// Checks the values as those of the scene are checked.
    fn check(&self) -> Result<(), String> {
        let positive = [("rate", &self.rate), ("mass_ratio", &self.mass_ratio), ("speed", &self.speed)];
        let told = |message| format!("vary: {message}");
        for (name, values) in positive {
            values.iter().try_for_each(|value| is_positive(name, *value)).map_err(told)?;
        }
        self.substeps.iter().try_for_each(|substeps| is_count("substeps", *substeps)).map_err(told)?;
        let others = [("friction", &self.friction), ("thickness", &self.thickness), ("recovery", &self.recovery)];
        for (name, values) in others {
            values.iter().try_for_each(|value| is_not_negative(name, *value)).map_err(told)?;
        }
        match variant_count(self) {
            0.0..=MAX_VARIANTS => Ok(()),
            count => Err(format!("vary: {count} combinations: list fewer values, for at most {MAX_VARIANTS}")),
        }
    }
}

/// Refuses lists of values to vary that are there and empty. An error has its place in the text.
pub(super) fn check_lists(vary: &Spanned<DeValue>) -> Result<(), (usize, String)> {
    let DeValue::Table(lists) = vary.get_ref() else { return Ok(()) };
    lists.iter().try_for_each(|(key, value)| {
        let key = key.get_ref();
        let why = match value.get_ref() {
            DeValue::Array(values) if values.is_empty() => {
                format!("{key}: an empty list: give values, or leave it out")
            }
            DeValue::Integer(count) if count.as_str() == "0" && key == "seeds" => {
                "seeds = 0: give at least 1, or leave it out".to_owned()
            }
            _ => return Ok(()),
        };
        Err((value.span().start, format!("vary: {why}")))
    })
}

/// Refuses formulas that make no surface, or one that is turned inside out, and counts that they would have to change.
fn check_mesh(mesh: &MeshSpec) -> Result<(), String> {
    match mesh {
        MeshSpec::Sheet(sheet) => {
            sheet.size.iter().try_for_each(|size| is_positive("size", *size))?;
            sheet.holes.map_or(Ok(()), |holes| is_at_least("period", holes.period, 1))
        }
        // All spikes of a ball that is turned inside out cross each other, and take long to tell apart.
        MeshSpec::SpikedBall(ball) => is_positive("radius", ball.radius),
        MeshSpec::Serpent(serpent) => {
            is_at_least("rings", serpent.rings, 4)?;
            is_at_least("slices", serpent.slices, 4)?;
            is_at_least("every", serpent.every, 2)?;
            is_not_negative("spine", serpent.spine)
        }
        // The radius of a bowl is 1, in the middle of its wall.
        MeshSpec::Bowl(Bowl { thickness, .. }) if !(*thickness > 0.0 && *thickness < 2.0) => {
            Err(format!("thickness = {thickness}: give a number between 0 and 2 for a bowl"))
        }
        MeshSpec::Bowl(Bowl { slices, stacks, .. }) | MeshSpec::Pot(Pot { slices, stacks }) => {
            is_at_least("around", *slices, 3)?;
            is_at_least("along", *stacks, 3)
        }
        MeshSpec::Cuboid(cuboid) => cuboid.half.iter().try_for_each(|half| is_positive("half", *half)),
        MeshSpec::Rope(rope) => {
            is_positive("length", rope.length)?;
            is_not_negative("radius", rope.radius)
        }
        MeshSpec::File(_) => Ok(()),
    }
}

fn is_count(name: &str, value: u32) -> Result<(), String> {
    match value {
        1..=MAX_COUNT => Ok(()),
        _ => Err(format!("{name} = {value}: give a number from 1 to {MAX_COUNT}")),
    }
}

fn is_at_least(name: &str, count: u32, least: u32) -> Result<(), String> {
    match count >= least {
        true => Ok(()),
        false => Err(format!("{name} = {count}: give a whole number of at least {least}")),
    }
}

fn is_positive(name: &str, value: f64) -> Result<(), String> {
    match value > 0.0 && value.is_finite() {
        true if value.recip().is_finite() => Ok(()),
        true => Err(format!("{name} = {value:e}: it is too small to divide by: give a larger number")),
        false => Err(format!("{name} = {value}: give a positive number")),
    }
}

/// Largest of the numbers that may be 0.
const MAX_FACTOR: f64 = 1e9;

fn is_not_negative(name: &str, value: f64) -> Result<(), String> {
    match value {
        0.0..=MAX_FACTOR => Ok(()),
        _ => Err(format!("{name} = {value}: give a number from 0 to {MAX_FACTOR:e}")),
    }
}

/// Largest number of a scene: sums and squares of such numbers are finite.
const MAX_NUMBER: f64 = 1e100;

/// Refuses `nan`, `inf` and what is beyond all measure, which TOML allows. An error has its place in the text.
pub(super) fn check_numbers(key: &str, value: &Spanned<DeValue>) -> Result<(), (usize, String)> {
    match value.get_ref() {
        DeValue::Float(number) => {
            let number: f64 = number.as_str().parse().unwrap_or(f64::NAN);
            match number.abs() <= MAX_NUMBER {
                true => Ok(()),
                false => {
                    let message = format!("{key} = {number}: give a number of at most {MAX_NUMBER:e}");
                    Err((value.span().start, message))
                }
            }
        }
        DeValue::Array(values) => values.iter().try_for_each(|value| check_numbers(key, value)),
        DeValue::Table(table) => table.iter().try_for_each(|(key, value)| check_numbers(key.get_ref(), value)),
        _ => Ok(()),
    }
}
