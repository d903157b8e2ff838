//! Figures of a run, and whether they reach what the scene asks for.

use std::collections::BTreeMap;

use serde::Serialize;

use super::spec::Reach;

/// Figures of a run. Lengths and speeds are in the scene's units.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Frames that were run.
    pub frames: u32,
    /// Is every coordinate finite, and within f32, which recordings hold? A run ends with the first frame that is not.
    pub finite: bool,
    /// Faces, or edges of strings, deeper than a quarter of the thickness, and than what f32 tells apart there, at the end, or at the worst frame
    /// where the scene asks for every frame; by the certified search.
    pub deep_faces: usize,
    /// Depth of the deepest of them; 0 if nothing is inside.
    pub deepest: f64,
    /// Longest edge of a sheet, a net or strings at the end over its length at rest; at least 1.
    pub stretch: f64,
    /// Root mean square of displacement · rate of all vertices in the last half unit of time, or between the last two frames where there
    /// are fewer in it; `None` if the run has no two frames there.
    pub jitter: Option<f64>,
    /// Largest displacement of a vertex in the same time.
    pub drift: Option<f64>,
    /// Largest turn of the normal of a contact that presses, within a frame of the same time, in degrees.
    pub turn: Option<f64>,
    /// Deep faces at the start, where the scene varies seeds.
    pub deep_at_start: usize,
    /// Most that the energy exceeds the start, over the largest loss of energy, and not less than a hundredth of the work of gravity along
    /// the size of what moves.
    pub energy_gain: f64,
    /// Change of momentum less what gravity, drag and fixed obstacles gave, over the sum of all |m v| at the start and of the lengths of
    /// all that was given; 0 where nothing but rounding moves; `None` with pins.
    pub momentum_error: Option<f64>,
    /// The first frame since which nothing is deep; `None` if something is at the end.
    pub recovered_frame: Option<u32>,
    /// Vertices that end in the region where none may.
    pub beyond: usize,
    /// The smallest det F of all frames; 1 without soft bodies.
    pub volume: f64,
    /// The largest speed of all frames; of a rigid body that of its fastest point, at most: |v| + |ω| · (farthest vertex).
    pub max_speed: f64,
    /// Contacts of the last frame.
    pub contacts: usize,
    /// Pairs of things that touch in the last frame: a surface, and an obstacle or another body.
    pub pairs: usize,
    /// Elements of the last frame, and those that passed the cull.
    pub elements: [usize; 2],
    /// Did something get farther in a substep than the field of a soft body reaches? It may have passed through it.
    #[serde(skip)]
    pub outruns_soft: bool,
    /// Time that was spent.
    pub seconds: Seconds,
}

/// Processor time, or the wall's: it depends on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// Search for contacts.
    pub detect: f64,
    /// Steps.
    pub solve: f64,
}

/// Rounding of energies, and of momenta, as a fraction of them: some million operations.
const ROUNDING: f64 = 1e-9;

/// Share of the work of gravity along the size of what moves, below which no loss of energy counts as one: what rests rocks by as little as its
/// contacts are known.
const LEAST_FALL: f64 = 1e-2;

impl Figures {
    /// Figures that are wanted and missed: name, value and limit. A value that is not known is missed, as NaN.
    pub fn missed(&self, reach: &Reach) -> BTreeMap<&'static str, [f64; 2]> {
        let at_most = [
            ("deep_faces", self.deep_faces as f64, reach.deep_faces.map(|count| count as f64)),
            ("deepest", self.deepest, reach.deepest),
            ("stretch", self.stretch, reach.stretch),
            ("jitter", self.jitter.unwrap_or(f64::NAN), reach.jitter),
            ("drift", self.drift.unwrap_or(f64::NAN), reach.drift),
            ("turn", self.turn.unwrap_or(f64::NAN), reach.turn),
            ("energy_gain", self.energy_gain, reach.energy_gain),
            ("momentum_error", self.momentum_error.unwrap_or(0.0), reach.momentum_error),
            ("beyond", self.beyond as f64, reach.beyond.map(|count| count as f64)),
            ("finite", if self.finite { 0.0 } else { 1.0 }, Some(0.0)),
        ];
        let missed = at_most.into_iter().filter_map(|(name, value, limit)| {
            limit.filter(|limit| value.is_nan() || value > *limit).map(|limit| (name, [value, limit]))
        });
        let least = reach.volume.filter(|least| self.volume.is_nan() || self.volume < *least);
        missed.chain(least.map(|least| ("volume", [self.volume, least]))).collect()
    }

    /// Reasons why the other figures may say little, a line each.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = vec![];
        if self.deep_at_start > 0 {
            warnings.push(format!(
                "{} faces are deep at the start: sheets may leave fast, and soft bodies, or rigid ones far inside of an obstacle, may stay",
                self.deep_at_start
            ));
        }
        if !self.finite {
            let what = "the last frame has coordinates beyond f32, in which recordings hold them: the run ends there";
            warnings.push(what.to_owned());
        }
        if self.outruns_soft {
            let what = "something moves farther in a substep than the field of a soft body reaches beyond its mesh, and may pass through it: give \
                        a higher rate, more substeps, or the body a larger cell or padding";
            warnings.push(what.to_owned());
        }
        // NaN too.
        if !matches!(self.volume.partial_cmp(&0.0), Some(std::cmp::Ordering::Greater)) {
            warnings
                .push(format!("a tetrahedron of a soft body is flat or inside out: its det F is {:.3}", self.volume));
        }
        warnings
    }

    /// Most that the energy exceeded the start, over the most that it fell, or the kinetic energy at the start, as in free flight, or the least
    /// fall that counts: the largest of these. Without any, a gain is 1 that is more than rounding. `work` is that of gravity along the size of
    /// what moves.
    pub(super) fn energy_gain([start, highest, lowest]: [f64; 3], kinetic_at_start: f64, work: f64) -> f64 {
        let (gain, scale) = (highest - start, (start - lowest).max(kinetic_at_start).max(LEAST_FALL * work));
        let rounding = ROUNDING * start.abs().max(highest.abs());
        if scale > rounding { gain / scale } else { f64::from(u8::from(gain > rounding)) }
    }

    /// The change of momentum over all that there was. `largest` is that of everything that goes its own size in a frame: what rounds.
    pub(super) fn momentum_error(change: f64, all: f64, largest: f64) -> f64 {
        let rounding = ROUNDING * largest;
        if change <= rounding && all <= rounding { 0.0 } else { change / all.max(rounding) }
    }

    /// Counts deep faces, if there are more of them or a deeper one than before.
    pub(super) fn add_deep(&mut self, count: usize, depth: f64) {
        self.deep_faces = self.deep_faces.max(count);
        self.deepest = self.deepest.max(depth);
    }

    /// The worse of each figure.
    pub fn worst(&self, other: &Self) -> Self {
        let max = f64::max;
        Self {
            frames: self.frames + other.frames,
            finite: self.finite && other.finite,
            deep_faces: self.deep_faces.max(other.deep_faces),
            deepest: max(self.deepest, other.deepest),
            stretch: max(self.stretch, other.stretch),
            jitter: self.jitter.zip(other.jitter).map(|(a, b)| max(a, b)),
            drift: self.drift.zip(other.drift).map(|(a, b)| max(a, b)),
            turn: self.turn.zip(other.turn).map(|(a, b)| max(a, b)),
            deep_at_start: self.deep_at_start.max(other.deep_at_start),
            energy_gain: max(self.energy_gain, other.energy_gain),
            momentum_error: self.momentum_error.zip(other.momentum_error).map(|(a, b)| max(a, b)),
            recovered_frame: self.recovered_frame.zip(other.recovered_frame).map(|(a, b)| a.max(b)),
            beyond: self.beyond.max(other.beyond),
            volume: self.volume.min(other.volume),
            max_speed: max(self.max_speed, other.max_speed),
            contacts: self.contacts.max(other.contacts),
            pairs: self.pairs.max(other.pairs),
            elements: [0, 1].map(|k| self.elements[k].max(other.elements[k])),
            outruns_soft: self.outruns_soft || other.outruns_soft,
            seconds: Seconds {
                detect: self.seconds.detect + other.seconds.detect,
                solve: self.seconds.solve + other.seconds.solve,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_that_is_missed_has_its_sign() {
        let reach = Reach { volume: Some(-0.25), energy_gain: Some(0.5), ..Reach::default() };
        let figures = |volume| Figures { finite: true, volume, energy_gain: 1.0, ..Figures::default() };
        let missed = BTreeMap::from([("energy_gain", [1.0, 0.5])]);
        assert_eq!(figures(-0.125).missed(&reach), missed);
        assert_eq!(figures(-0.5).missed(&reach)["volume"], [-0.5, -0.25]);
        assert!(figures(f64::NAN).missed(&reach)["volume"][0].is_nan());
    }

    #[test]
    fn energy_from_nothing_is_a_gain_of_one() {
        for (energy, kinetic, work, gain) in [
            ([5.0, 6.0, 1.0], 2.0, 1.0, 0.25),
            ([5.0, 6.0, 5.0], 2.0, 1.0, 0.5),
            ([5.0, 6.0, 5.0], 0.0, 0.0, 1.0),
            ([5.0, 5.0, 5.0], 0.0, 0.0, 0.0),
            ([5.0, 5.0 + 1e-12, 5.0], 1e-13, 0.0, 0.0),
            ([5.0, 5.25, 5.0], 0.0, 100.0, 0.25),
        ] {
            assert_eq!(Figures::energy_gain(energy, kinetic, work), gain, "{energy:?}");
        }
    }

    #[test]
    fn momentum_of_what_rests_is_rounding() {
        for (change, all, error) in
            [(1e-16, 0.0, 0.0), (1e-16, 1e-15, 0.0), (1.0, 4.0, 0.25), (1e-7, 0.0, 1e2), (1e-16, 1.0, 1e-16)]
        {
            let found = Figures::momentum_error(change, all, 1.0);
            assert!((found - error).abs() <= 1e-12 * error, "{found} of {change} and {all}");
        }
    }
}
