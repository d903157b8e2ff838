use super::bounds::Asked;
use super::leaves::Leaves;
use crate::number::{Float, Real};
use crate::{Aabb, EnclosedSdf};

/// Two fields, how near they must come to touch, and where that can be: outside of `region` one φ is above the margin
/// everywhere. Both are asked within the region alone.
#[derive(Debug)]
pub struct Pair<'a, A, B> {
    pub(super) a: &'a A,
    pub(super) b: &'a B,
    pub(super) margin: f64,
    pub(super) region: Aabb,
}

/// Why there is nothing to search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoRegion {
    /// It is certain that at every point one φ is above the margin.
    Separated,
    /// Both fields go on for ever, or a number is not finite or beyond [`Real::MAX_COORDINATE`] of f32.
    Unbounded,
}

/// More than the corners of a box are off by, in roundings of the largest of them.
const ROUNDINGS: f64 = 64.0;

impl<'a, A: EnclosedSdf, B: EnclosedSdf> Pair<'a, A, B> {
    /// `margin` is a distance to either field; less than 0 wants so much depth in both.
    pub fn new(a: &'a A, b: &'a B, margin: f64) -> Result<Self, NoRegion> {
        let [of_a, of_b] = [a.bounds(margin), b.bounds(margin)].map(outward);
        let region = of_a.intersection(&of_b).ok_or(NoRegion::Separated)?;
        let in_reach = |x: &f64| x.abs() <= <f32 as Real>::MAX_COORDINATE;
        let is_valid = margin.is_finite() && [region.min, region.max].iter().flatten().all(in_reach);
        if is_valid { Ok(Self { a, b, margin, region }) } else { Err(NoRegion::Unbounded) }
    }

    /// Searched in a box alone, outside of which nothing is asked and nothing found.
    pub fn within(self, bounds: &Aabb) -> Result<Self, NoRegion> {
        let region = self.region.intersection(bounds).ok_or(NoRegion::Separated)?;
        Ok(Self { region, ..self })
    }

    pub fn margin(&self) -> f64 {
        self.margin
    }

    pub fn region(&self) -> Aabb {
        self.region
    }

    /// Less of the region: a box around all pieces, of which `cells` reach along its longest side, that may hold a point in
    /// which the fields touch. Each field is asked at the middle of each piece.
    pub fn shrink<R: Float>(&self, cells: u32) -> Result<Self, NoRegion> {
        let asked = Asked::<R, A, B>::of(self);
        self.around(cells, |piece| asked.look(piece).may_touch())
    }

    /// The same, but of a field that is not to be asked, because its samples are still to be read, by what it knows of each
    /// piece without ([`EnclosedSdf::enclose_box`]).
    pub fn shrink_asking(&self, cells: u32, is_asked: [bool; 2]) -> Result<Self, NoRegion> {
        let asked = Asked::<f64, A, B>::of_some(self, is_asked);
        self.around(cells, |piece| asked.may_touch(piece, is_asked))
    }

    fn around(&self, cells: u32, may_touch: impl Fn(&Aabb) -> bool) -> Result<Self, NoRegion> {
        let mut leaves = Leaves::of(&self.region, self.region.longest_side() / f64::from(cells.max(1)));
        let mut held: Option<Aabb> = None;
        while let Some(block) = leaves.next_block() {
            let is_held = held.is_some_and(|held| held.encloses(&block.region));
            if is_held || !may_touch(&block.region) {
                continue;
            }
            if block.is_leaf() {
                held = Some(held.map_or(block.region, |held| held.union(&block.region)));
            } else {
                leaves.split(&block);
            }
        }
        held.map(|region| Self { a: self.a, b: self.b, margin: self.margin, region }).ok_or(NoRegion::Separated)
    }
}

fn outward(bounds: Aabb) -> Aabb {
    let numbers = [bounds.min, bounds.max];
    let largest = numbers.iter().flatten().filter(|x| x.is_finite()).fold(0.0_f64, |most, x| most.max(x.abs()));
    bounds.inflate(largest * ROUNDINGS * f64::EPSILON)
}
