//! At which margins does a field leave out no contact? [`Field::check_margin`].
//!
//! Deeper than its band, a sparse grid has coarse depths, too high or too low; farther out, lower bounds. A [`Reach`] follows these levels
//! through combinations and placements, as [`ErrorBound`](sdf_core::ErrorBound) does. A margin is refused where φ may be too high, for an
//! element would be left out without a word. Where φ is too low, contacts say so by their status: outside of a grid's box φ is a lower
//! bound there, and contacts are `OutsideGrid`. A level set needs distances on both sides: levels above the lowest sample on the box of
//! a grid are no distances outside of it, nor is −φ of a grid that is taken away.

use sdf_core::combine::{Difference, Intersection};
use sdf_core::grid::owned::OwnedGrid;
use sdf_core::placed::Placement;
use sdf_core::{AnyField, Interval};

use crate::{Field, MarginOutOfReach};

impl Field {
    /// Refuses a margin at which contacts or an overlap could leave out what is within it: below the band of a sparse grid, also where it
    /// is moved or part of a combination, or deeper than the box of a grid that is taken away. Of a grid alone, also one above
    /// [`GridInfo::max_margin`](crate::GridInfo::max_margin), where contacts would be false; those of a combination have the status
    /// [`OutsideGrid`](sdf_core::contact::ContactStatus::OutsideGrid) or [`BeyondBand`](sdf_core::contact::ContactStatus::BeyondBand)
    /// there. For contacts ask [`ContactOptions::check_margin`](crate::ContactOptions::check_margin).
    pub fn check_margin(&self, margin: f64) -> Result<(), MarginOutOfReach> {
        match self.info() {
            Some(info) => info.check_margin(margin),
            None => {
                let Interval { lower, upper } = self.reach().not_above;
                let limit = if margin < lower { lower } else { upper };
                MarginOutOfReach::check(margin, lower..=upper, limit)
            }
        }
    }

    /// The largest margin that [`check_margin`](Self::check_margin) takes; `None` where it takes any.
    pub fn max_margin(&self) -> Option<f64> {
        let of_any = || self.reach().not_above.upper;
        Some(self.info().map_or_else(of_any, |info| info.max_margin())).filter(|margin| margin.is_finite())
    }

    /// Levels at which φ is the distance everywhere, up to error bounds: of a grid those within its band and below all samples on its box,
    /// also where it is moved or part of a combination; all of shapes. The lower end is above the upper one where there are none.
    pub fn known_levels(&self) -> Interval<f64> {
        Reach::of(self.as_any(), Boxes::All).known()
    }

    /// Is φ = 0 the surface everywhere? Not of an offset of a grid beyond its band or its box.
    pub fn knows_surface(&self) -> bool {
        let Interval { lower, upper } = self.known_levels();
        self.grid().is_some() || (lower..=upper).contains(&0.0)
    }

    /// Is it a grid, or made of one?
    pub fn has_grid(&self) -> bool {
        has_grid(self.as_any())
    }
}

fn has_grid(field: &AnyField) -> bool {
    matches!(field, AnyField::Grid(_)) || parts(field).into_iter().any(has_grid)
}

/// The lowest sample on the box of a grid; infinite of one whose inside reaches the box, of which more is not known.
fn lowest_level_at_box(grid: &OwnedGrid) -> f64 {
    let lowest = grid.lowest_boundary_sample();
    if lowest < 0.0 { f64::INFINITY } else { lowest }
}

/// Fields that a combination or a placement is made of; none of a shape or a grid.
pub(crate) fn parts(field: &AnyField) -> Vec<&AnyField> {
    match field {
        AnyField::Union(union) => union.parts().iter().collect(),
        AnyField::Intersection(both) => vec![&both.0, &both.1],
        AnyField::Difference(both) => vec![&both.0, &both.1],
        AnyField::SmoothUnion(both) => {
            let (a, b) = both.parts();
            vec![a, b]
        }
        AnyField::Offset(offset) => vec![offset.field()],
        AnyField::Shell(shell) => vec![shell.field()],
        AnyField::Placed(placed) => vec![&placed.field],
        AnyField::Stretched(placed) => vec![&placed.field],
        _ => vec![],
    }
}

/// Boxes of grids outside of which levels count. To find the lowest level on a box takes all of its samples there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Boxes {
    /// Points in the boxes alone.
    #[cfg(feature = "exchange")]
    None,
    /// Boxes of grids that are taken away, as margins need it: −φ is too high outside.
    TakenAway,
    /// All.
    All,
}

/// Levels at which φ is the distance d to the shape, up to the error bound in the band.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// φ is not above d, but where both are below this interval or both above it.
    not_above: Interval<f64>,
    /// φ is not below d, likewise.
    not_below: Interval<f64>,
}

impl Reach {
    const EVERYTHING: Self = Self { not_above: Interval::EVERYTHING, not_below: Interval::EVERYTHING };

    /// The recursion is as deep as the field.
    pub(crate) fn of(field: &AnyField, boxes: Boxes) -> Self {
        let of = |field: &AnyField| Self::of(field, boxes);
        match field {
            AnyField::Grid(grid) => {
                let band = grid.band();
                let inside = Interval { lower: -band, upper: f64::INFINITY };
                let known = if boxes == Boxes::All { band.min(lowest_level_at_box(grid)) } else { band };
                Self { not_above: inside, not_below: Interval { lower: -band, upper: known } }
            }
            AnyField::Union(union) => union.parts().iter().map(of).fold(Self::EVERYTHING, Self::and),
            AnyField::Intersection(both) => {
                let Intersection(a, b) = both.as_ref();
                of(a).and(of(b))
            }
            AnyField::Difference(both) => {
                let Difference(a, b) = both.as_ref();
                let boxes_of_b = if boxes == Boxes::TakenAway { Boxes::All } else { boxes };
                of(a).and(Self::of(b, boxes_of_b).negate())
            }
            AnyField::SmoothUnion(both) => {
                let (a, b) = both.parts();
                // A part counts where it is less than k above the other, and lowers the union by up to k/4 more.
                let blend = 1.25 * both.blend();
                of(a).and(of(b)).map(|Interval { lower, upper }| Interval { lower, upper: upper - blend })
            }
            AnyField::Offset(offset) => of(offset.field()).map(|levels| levels.shift(-offset.distance())),
            AnyField::Shell(shell) => {
                let field = of(shell.field());
                // Deep inside and far outside the field alike, |φ| and |d| are above both levels.
                let above_all = |Interval { upper, .. }| Interval { lower: f64::NEG_INFINITY, upper };
                field.and(field.negate()).map(above_all).map(|levels| levels.shift(-0.5 * shell.thickness()))
            }
            AnyField::Placed(placed) => of(&placed.field).scale(&placed.placement),
            AnyField::Stretched(placed) => of(&placed.field).scale(&placed.placement),
            _ => Self::EVERYTHING,
        }
    }

    pub(crate) fn known(self) -> Interval<f64> {
        let Self { not_above, not_below } = self;
        Interval { lower: not_above.lower.max(not_below.lower), upper: not_above.upper.min(not_below.upper) }
    }

    fn map(self, change: impl Fn(Interval<f64>) -> Interval<f64>) -> Self {
        Self { not_above: change(self.not_above), not_below: change(self.not_below) }
    }

    /// Levels of the minimum or the maximum of both.
    fn and(self, other: Self) -> Self {
        let both =
            |a: Interval<f64>, b: Interval<f64>| Interval { lower: a.lower.max(b.lower), upper: a.upper.min(b.upper) };
        Self { not_above: both(self.not_above, other.not_above), not_below: both(self.not_below, other.not_below) }
    }

    /// Levels of −φ.
    fn negate(self) -> Self {
        Self { not_above: self.not_below.negate(), not_below: self.not_above.negate() }
    }

    /// A stretched shape has distances of at least the scale and at most the largest scale times those of the shape.
    fn scale(self, placement: &impl Placement) -> Self {
        let (least, largest) = (placement.scale(), placement.largest_scale());
        self.map(|Interval { lower, upper }| Interval {
            lower: lower * if lower > 0.0 { largest } else { least },
            upper: upper * if upper < 0.0 { largest } else { least },
        })
    }
}
