//! Two fields against each other: where they touch, how deep, and in which patch. The searches are those of
//! [`core::overlap`](sdf_core::overlap), one after the other.
//!
//! | step | question | method |
//! |---|---|---|
//! | 1 | In which box can they touch? | [`Field::overlap_region`]: bounds of both fields, on cubes |
//! | 2 | Do they touch? | [`Pair::deepest`]: minimum of max(φ_A, φ_B), proven |
//! | 3 | At which points do they lie deepest in each other? | [`Pair::minima`] |
//! | 4 | On which surface do they press against each other? | [`Pair::patch`] |
//!
//! [`Field::overlap`] takes all steps. A program that reads only the needed blocks of a grid calls
//! [`Field::overlap_region`] on grids with bounds alone, reads the blocks of that box, and calls [`Field::overlap_in`].

use sdf_core::nalgebra::Vector3;
use sdf_core::overlap::{
    BoxNode, DeepestPoint, DepthSearch, LocalMinima, MortonLeaf, NoRegion, OverlapPoint, Pair, Patch, PatchPoint,
};
use sdf_core::placed::{Posed, Rigid};
use sdf_core::{Aabb, AnyField, EnclosedSdf, Sdf};

use crate::Field;

/// Where the fields stand, and how the overlap is searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverlapOptions {
    /// Where either field stands in the world; `None` where its frame is the world's.
    pub poses: [Option<Rigid>; 2],
    /// The fields touch at points where both have φ ≤ margin: a length; negative: only where both are at least so deep.
    pub margin: f64,
    /// The deepest point is proven to within this fraction of the longest side of the box in which the fields may touch.
    pub tolerance: f64,
    /// Edge of the cubes in which the patch is cut; `None` stands for 1/64 of the longest side of that box, and less than 1/4096 is
    /// refused. The search for minima takes cubes of the same edge, but of 1/128 of that side at least.
    pub resolution: Option<f64>,
    /// Largest number of evaluations of both fields in each of the three searches; a descent that has begun goes on, with up to 98 more.
    pub evaluations: u32,
}

impl Default for OverlapOptions {
    fn default() -> Self {
        Self { poses: [None; 2], margin: 0.0, tolerance: 1e-3, resolution: None, evaluations: 1 << 24 }
    }
}

/// Do two fields touch?
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum OverlapVerdict {
    /// There is a point with φ ≤ margin in both.
    Contact,
    /// It is proven that there is none.
    #[default]
    Separated,
    /// None was found within the budget and the tolerance, and one may exist.
    Undecided,
}

/// Where two fields touch. Normals point out of the other field and into the first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlap {
    /// Do they touch?
    pub verdict: OverlapVerdict,
    /// The lowest point of max(φ_A, φ_B), and its proof. `None` where bounds without a search separate the fields.
    pub deepest: Option<DeepestPoint<f64>>,
    /// Summary of the search for minima; `None` if the fields are separated.
    pub minima: Option<LocalMinima>,
    /// The minima of max(φ_A, φ_B), the deepest first, at most 256.
    pub points: Vec<OverlapPoint<f64>>,
    /// Summary of the patch; `None` if the fields are separated.
    pub patch: Option<Patch<f64>>,
    /// The surface φ_A = φ_B where both are within the margin, in pieces with an area each.
    pub pieces: Vec<PatchPoint<f64>>,
}

/// Why an overlap cannot be searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum OverlapError {
    /// The box in which the fields may touch is unbounded.
    Unbounded,
    /// The margin is NaN or infinite.
    MarginNotFinite,
    /// The box in which the fields may touch has coordinates beyond 10¹⁸.
    TooFar,
    /// The resolution is less than 1/4096 of the longest side of the box in which the fields may touch.
    TooFine,
    /// The resolution is not a positive length.
    ResolutionOutOfRange,
    /// The tolerance is not positive and finite.
    ToleranceOutOfRange,
}

impl std::fmt::Display for OverlapError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unbounded => {
                f.write_str("the box in which the fields may touch is unbounded: intersect one of them with a box")
            }
            Self::MarginNotFinite => f.write_str("the margin must be a finite length"),
            Self::TooFar => f.write_str("coordinates exceed 1e18 where the fields may touch: scale them down"),
            Self::ResolutionOutOfRange => f.write_str("the resolution of a patch must be a positive length"),
            Self::ToleranceOutOfRange => f.write_str("the tolerance must be positive and finite"),
            Self::TooFine => f.write_str(
                "the resolution is less than 1/4096 of the longest side of the box in which the fields may touch: take a larger one",
            ),
        }
    }
}

impl std::error::Error for OverlapError {}

/// Cubes along the longest side of the box in which the fields may touch, when it is shrunk.
const SHRINK_CELLS: u32 = 64;

/// Cubes along the longest side of the shrunk box, in the search for minima and patch.
const DEFAULT_CELLS: f64 = 64.0;

/// The finest resolution: so many cubes along the longest side. A patch of so many squared, and more, takes all evaluations.
const MAX_CELLS: f64 = 4096.0;

/// Most cubes along the longest side in the search for minima: the time grows with the cube of this.
const MAX_CELLS_OF_MINIMA: f64 = 128.0;

/// Open boxes in the search for the deepest point.
const MAX_OPEN_BOXES: usize = 1 << 16;

/// Minima that are reported.
const MAX_MINIMA: usize = 256;

/// How far a minimum lies above the bottom of its basin at most, where its search has converged: a part of a cube's edge.
const BOTTOM_ERROR: f64 = 0.01;

impl Field {
    /// Where this field (A) and another (B) touch, without a mesh on either side: their deepest points and the patch
    /// between them. Two fields that share the points with φ ≤ margin have a gap of at most twice the margin.
    ///
    /// ```
    /// use sdf_field::core::{placed::Rigid, shapes::Sphere};
    /// use sdf_field::{Field, OverlapOptions, OverlapVerdict};
    /// let ball = Field::new(Sphere::new(1.0).unwrap());
    /// let raised = Rigid::new([0.0, 0.0, 1.5], [0.0, 0.0, 0.0, 1.0]);
    /// let found = ball.overlap(&ball, &OverlapOptions { poses: [raised, None], ..OverlapOptions::default() }).unwrap();
    /// assert_eq!(found.verdict, OverlapVerdict::Contact);
    /// // The balls are half a unit deep in each other; the upper one comes free along z.
    /// let deepest = found.points[0];
    /// assert!((deepest.separation() + 0.5).abs() < 1e-2 && deepest.normal.z > 0.99);
    /// // They share a disc of radius √(1 − 0.75²).
    /// assert!((found.patch.unwrap().area - 1.374).abs() < 0.05);
    /// ```
    pub fn overlap(&self, other: &Field, options: &OverlapOptions) -> Result<Overlap, OverlapError> {
        match self.overlap_region(other, options, [true; 2])? {
            Some(region) => self.overlap_in(other, options, &region),
            None => Ok(Overlap::default()),
        }
    }

    /// The box outside of which the fields do not touch; `None` if they are separated. `may_evaluate` is false for a field
    /// whose samples are still to be read: only its bounds are used.
    pub fn overlap_region(
        &self,
        other: &Field,
        options: &OverlapOptions,
        may_evaluate: [bool; 2],
    ) -> Result<Option<Aabb>, OverlapError> {
        options.check()?;
        let (a, b) = posed(self, other, options);
        let pair =
            Pair::new(&a, &b, options.margin).and_then(|pair| pair.shrink_evaluating(SHRINK_CELLS, may_evaluate));
        Ok(searchable(pair, options)?.map(|pair| pair.region()))
    }

    /// [`overlap`](Self::overlap) in a box of the world: nothing is evaluated or found outside. The verdict is that of
    /// the fields if the box is an [`overlap_region`](Self::overlap_region), and a statement about the box alone if not. Both fields may
    /// be unbounded if the box is not.
    pub fn overlap_in(&self, other: &Field, options: &OverlapOptions, limits: &Aabb) -> Result<Overlap, OverlapError> {
        options.check()?;
        let (a, b) = posed(self, other, options);
        let pair = Pair::within(&a, &b, options.margin, limits).and_then(|pair| pair.shrink::<f64>(SHRINK_CELLS));
        Ok(searchable(pair, options)?.map_or(Overlap::default(), |pair| search(&pair, [&a, &b], options)))
    }
}

impl OverlapOptions {
    fn check(&self) -> Result<(), OverlapError> {
        match self.resolution {
            _ if !self.margin.is_finite() => Err(OverlapError::MarginNotFinite),
            _ if !(self.tolerance > 0.0 && self.tolerance.is_finite()) => Err(OverlapError::ToleranceOutOfRange),
            Some(resolution) if !(resolution > 0.0 && resolution.is_finite()) => {
                Err(OverlapError::ResolutionOutOfRange)
            }
            _ => Ok(()),
        }
    }
}

/// The pair, if its box can be searched; `None` if the fields are separated.
fn searchable<'a, A: EnclosedSdf, B: EnclosedSdf>(
    pair: Result<Pair<'a, A, B>, NoRegion>,
    options: &OverlapOptions,
) -> Result<Option<Pair<'a, A, B>>, OverlapError> {
    match pair {
        Ok(pair) => {
            let least = pair.region().longest_side() / MAX_CELLS;
            let is_too_fine = options.resolution.is_some_and(|resolution| resolution < least);
            if is_too_fine { Err(OverlapError::TooFine) } else { Ok(Some(pair)) }
        }
        Err(NoRegion::Separated) => Ok(None),
        Err(NoRegion::Unbounded) => Err(OverlapError::Unbounded),
        Err(NoRegion::TooFar) => Err(OverlapError::TooFar),
    }
}

fn posed<'a>(a: &'a Field, b: &'a Field, options: &OverlapOptions) -> (PosedField<'a>, PosedField<'a>) {
    let [pose_a, pose_b] = options.poses;
    (Posed { field: a.as_any(), pose: pose_a }, Posed { field: b.as_any(), pose: pose_b })
}

type PosedField<'a> = Posed<&'a AnyField>;

fn search(pair: &Pair<PosedField, PosedField>, fields: [&PosedField; 2], options: &OverlapOptions) -> Overlap {
    let search = DepthSearch { evaluations: options.evaluations, tolerance: options.tolerance };
    let deepest = pair.deepest::<f64>(&search, &mut vec![BoxNode::EMPTY; MAX_OPEN_BOXES]);
    if options.margin < deepest.lower_bound {
        let verdict = OverlapVerdict::Separated;
        return Overlap { verdict, deepest: Some(deepest), ..Overlap::default() };
    }
    let side = pair.region().longest_side();
    let resolution = options.resolution.unwrap_or(side / DEFAULT_CELLS);
    let edge = resolution.max(side / MAX_CELLS_OF_MINIMA);
    let (minima, mut points) = minima(pair, edge, options.evaluations);
    let mut pieces = vec![];
    let patch = pair.patch(resolution, options.evaluations, |piece| pieces.push(piece));
    let found = pieces.iter().map(|piece| piece.point).chain(deepest.point);
    if let Some(lowest) = found.min_by(|a, b| a.value.total_cmp(&b.value)) {
        insert_lowest(&mut points, lowest, edge, |from, to| {
            let count = ((to - from).norm() / edge).ceil().max(1.0);
            let mut way = (0..=count as u32).map(|step| from + (to - from) * (f64::from(step) / count));
            way.any(|point| fields.iter().any(|field| options.margin < field.value(point)))
        });
    }
    let deepest = DeepestPoint { point: points.first().copied(), ..deepest };
    let verdict = match deepest.point {
        Some(at) if at.value <= options.margin => OverlapVerdict::Contact,
        _ => OverlapVerdict::Undecided,
    };
    Overlap { verdict, deepest: Some(deepest), minima: Some(minima), points, patch: Some(patch), pieces }
}

/// All minima; the scratch buffer grows until it holds every cube in which the fields may touch, if the budget allows as much again.
fn minima<A: EnclosedSdf, B: EnclosedSdf>(
    pair: &Pair<A, B>,
    edge: f64,
    evaluations: u32,
) -> (LocalMinima, Vec<OverlapPoint<f64>>) {
    let (mut room, mut spent) = (1 << 16, 0);
    loop {
        let (mut cubes, mut points) = (vec![MortonLeaf::empty(); room], vec![None; MAX_MINIMA]);
        let minima = pair.minima(edge, evaluations - spent, &mut cubes, &mut points);
        spent += minima.evaluations;
        if minima.leaf_count <= room || evaluations - spent < spent {
            return (LocalMinima { evaluations: spent, ..minima }, points.into_iter().flatten().collect());
        }
        room = minima.leaf_count;
    }
}

/// Adds the lowest point that another search found. It takes the place of the minimum nearest to it, unless that is lower, or is of another
/// part of the contact: higher by more than bottoms are off, and the way straight to it leaves the contact.
fn insert_lowest(
    minima: &mut Vec<OverlapPoint<f64>>,
    lowest: OverlapPoint<f64>,
    edge: f64,
    leaves_contact: impl Fn(Vector3<f64>, Vector3<f64>) -> bool,
) {
    let distance = |other: &OverlapPoint<f64>| (other.point - lowest.point).norm();
    let nearest = minima.iter_mut().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    match nearest {
        Some(nearest) if nearest.value < lowest.value => {}
        Some(nearest) if nearest.value - lowest.value <= BOTTOM_ERROR * edge => *nearest = lowest,
        Some(nearest) if !leaves_contact(nearest.point, lowest.point) => *nearest = lowest,
        _ => minima.push(lowest),
    }
    minima.sort_by(|a, b| a.value.total_cmp(&b.value));
    minima.truncate(MAX_MINIMA);
}
