use std::ops::RangeInclusive;

use sdf_core::grid::owned::ErrorRegions;

/// How inside and outside were told apart when a grid was baked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SignMethod {
    /// Angle-weighted pseudo-normals: for one closed surface.
    PseudoNormal,
    /// Generalized winding numbers: also for open, doubled and self-intersecting meshes.
    Winding,
    /// Taken over from another program: see [`Field::import`](crate::Field::import).
    Given,
}

impl SignMethod {
    /// `pseudo-normal`, `winding` or `given`, as files and the command line have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::PseudoNormal => "pseudo-normal",
            Self::Winding => "winding",
            Self::Given => "given",
        }
    }
}

#[cfg(feature = "bake")]
impl SignMethod {
    /// The baker's name of it; `None` of signs that were given.
    pub(crate) fn for_mesh(self) -> Option<sdf_bake::SignMethod> {
        match self {
            Self::PseudoNormal => Some(sdf_bake::SignMethod::PseudoNormal),
            Self::Winding => Some(sdf_bake::SignMethod::Winding),
            Self::Given => None,
        }
    }
}

/// Facts about a baked grid beside its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct GridInfo {
    /// How inside and outside were told apart.
    pub sign_method: SignMethod,
    /// Why that method, in words.
    pub sign_reason: String,
    /// Certified bound on |interpolated value − true distance|: in the whole box of a dense grid, in the band of a sparse one.
    /// Infinite of imported grids: nothing is certified.
    pub error_bound: f64,
    /// Where the error of an open mesh's grid is large, and how many cells are as good as a closed mesh's. `None` where `error_bound` is
    /// all that is known.
    pub error_regions: Option<ErrorRegions>,
    /// Least distance from the mesh to the faces of the grid's box.
    pub padding: f64,
    /// Half width of a sparse grid's band: within it values are distances, beyond it coarse ones inside and lower bounds outside. `None` of a dense grid.
    pub band: Option<f64>,
    /// The mesh that was baked.
    pub source: Source,
    /// The program that baked it and its version, such as `sdftool 0.2.0`.
    pub tool: String,
    /// The options that shaped the result, such as `--res 256 --padding 4 --sign auto`.
    pub options: String,
}

impl GridInfo {
    /// The largest margin at which the grid's values are distances, and not lower bounds.
    pub fn max_margin(&self) -> f64 {
        self.band.map_or(self.padding, |band| band.min(self.padding))
    }

    /// Refuses a margin above [`max_margin`](Self::max_margin), up to rounding: contacts beyond would be false. Refuses one deeper than a
    /// sparse grid's band: there it would leave contacts out, as depths are coarse. Complete and exact searches allow for that:
    /// [`ContactOptions::check_margin`](crate::ContactOptions::check_margin).
    pub fn check_margin(&self, margin: f64) -> Result<(), MarginOutOfReach> {
        let (highest, lowest) = (self.max_margin(), self.band.map_or(f64::NEG_INFINITY, |band| -band));
        let limit = if margin < 0.0 { lowest } else { highest };
        MarginOutOfReach::check(margin, lowest..=highest, limit)
    }
}

/// Relative rounding of band and padding, which are multiples of the spacing.
const MARGIN_ROUNDING: f64 = 1e-12;

/// A margin so large, or so deep, that a grid has only lower bounds of distances there, or coarse ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarginOutOfReach {
    /// The margin asked for.
    pub margin: f64,
    /// The largest one that is answered, or the least.
    pub limit: f64,
}

impl MarginOutOfReach {
    /// Refuses a margin outside of an interval, up to rounding. `limit`: the end of it to name.
    pub(crate) fn check(margin: f64, margins: RangeInclusive<f64>, limit: f64) -> Result<(), Self> {
        let rounding = |end: f64| end.abs() * MARGIN_ROUNDING;
        let (lowest, highest) = (*margins.start(), *margins.end());
        let is_within = margin >= lowest - rounding(lowest) && margin <= highest + rounding(highest);
        if is_within { Ok(()) } else { Err(Self { margin, limit }) }
    }

    /// Does it lie below the limit, so that contacts would be left out? A complete search finds them.
    pub fn is_too_deep(&self) -> bool {
        self.margin < self.limit
    }
}

impl std::fmt::Display for MarginOutOfReach {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { margin, limit } = self;
        if margin.is_nan() {
            return f.write_str("the margin is NaN: give a length");
        }
        let reach = limit.abs();
        write!(f, "a margin of {margin} is ")?;
        match self.is_too_deep() {
            true if *limit > 0.0 => {
                write!(f, "less than the {reach} from which on a grid in this combination has distances")?;
            }
            true => write!(f, "deeper than the {reach} around the surface in which the grid has distances")?,
            false if *limit < 0.0 => {
                write!(f, "more than the {limit} up to which a grid in this combination has distances")?;
            }
            false => write!(f, "more than the {reach} around the surface in which the grid has distances")?,
        }
        f.write_str(match self.is_too_deep() {
            true => ": bake it with a wider band, or dense; one that is taken away with more padding, too",
            false => ": bake it with more padding, a sparse grid with a wider band, too",
        })
    }
}

impl std::error::Error for MarginOutOfReach {}

/// The mesh that a grid was baked from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// The file's name; empty where there was none.
    pub name: String,
    /// SHA-256 of the file's bytes; zero where there was none.
    pub sha256: [u8; 32],
    /// How many triangles it has.
    pub triangles: u64,
}
