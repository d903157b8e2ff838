use nalgebra::Vector3;

use super::directions::{DirectionalBounds, Directions};
use crate::grid::exact::polynomial::{MixedDerivatives, Polynomial};
use crate::number::Float;

/// The part of a cell in the triangle's box.
#[derive(Clone, Copy)]
pub(super) struct Cell<R: Float> {
    pub first: Vector3<R>,
    pub field: Polynomial<R>,
    /// Of the part, from the cell's first corner.
    pub middle: Vector3<R>,
    pub half: Vector3<R>,
}

/// How the field changes in the part of a cell: the gradient and the second derivatives in its middle, half its sides, and how
/// much more or less the gradient is elsewhere by the third derivative, each along x, y and z (of xy, yz and zx).
pub(super) struct Slopes<T> {
    pub gradient: [T; 3],
    pub bends: [T; 3],
    pub half: [T; 3],
    pub twists: [T; 3],
}

impl<R: Float> Slopes<R> {
    /// The least and the most that the field rises over one of the ways, as fast as it does anywhere in the part.
    #[inline(always)]
    pub fn over(&self, directions: &Directions<R>, way: usize) -> [R; 2] {
        let (x, y, z) = (directions.x[way % 4], directions.y[way % 4], directions.z[way % 4]);
        let ([xy, yz, zx], half, twists) = (self.bends, self.half, self.twists);
        let rise = self.gradient[0] * x + self.gradient[1] * y + self.gradient[2] * z;
        let spread = (xy * y + zx * z).abs() * half[0]
            + (xy * x + yz * z).abs() * half[1]
            + (zx * x + yz * y).abs() * half[2]
            + (x.abs() * twists[0] + y.abs() * twists[1] + z.abs() * twists[2])
            + directions.rounding[way % 4];
        [rise - spread, rise + spread]
    }
}

impl<R: Float> Cell<R> {
    /// Of any point of the part, also where the triangle does not reach.
    #[inline(always)]
    pub fn directional_bounds(&self, directions: &Directions<R>) -> DirectionalBounds<R> {
        let slopes = self.slopes();
        let mut rises = DirectionalBounds::none();
        for way in 0..4 {
            [rises.least[way], rises.most[way]] = slopes.over(directions, way);
        }
        rises
    }

    #[inline(always)]
    pub fn slopes(&self) -> Slopes<R> {
        let bends = self.field.bends(self.middle);
        let gradient = self.field.gradient(self.middle, &bends);
        let (half, twist) = (self.half, self.field.xyz.abs());
        Slopes {
            gradient: gradient.into(),
            bends: [bends.xy, bends.yz, bends.zx],
            half: half.into(),
            twists: [half.y * half.z * twist, half.z * half.x * twist, half.x * half.y * twist],
        }
    }

    /// In the middle, and how much more or less elsewhere.
    pub fn rise(&self, gradient: Vector3<R>, bends: &MixedDerivatives<R>, way: Vector3<R>) -> (R, R) {
        let (by, half) = (bends.times(way), self.half);
        let twist = way.x.abs() * half.y * half.z + way.y.abs() * half.z * half.x + way.z.abs() * half.x * half.y;
        let spread = by.x.abs() * half.x + by.y.abs() * half.y + by.z.abs() * half.z;
        (gradient.dot(&way), spread + self.field.xyz.abs() * twist)
    }

    /// The most that the field curves upwards along a way, times the square of its longest chord in the part, if no longer
    /// than the way.
    pub fn bend(&self, bends: &MixedDerivatives<R>, way: Vector3<R>) -> R {
        let curvature = bends.times(way).dot(&way) + self.more_bend(way, way);
        if curvature <= R::zero() {
            return R::zero();
        }
        let sides = way.iter().zip(&self.half);
        let chord = sides.fold(R::one(), |chord, (way, half)| {
            let (all, reached) = (way.abs(), *half * R::from_f64(2.0));
            if reached < all * chord { reached / all } else { chord }
        });
        curvature * chord * chord
    }

    /// How much more the second derivative by two ways can be anywhere in the part than in its middle.
    pub fn more_bend(&self, a: Vector3<R>, b: Vector3<R>) -> R {
        let (xy, yz, zx) = (a.x * b.y + a.y * b.x, a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z);
        let half = self.half;
        (xy.abs() * half.z + yz.abs() * half.x + zx.abs() * half.y) * self.field.xyz.abs()
    }

    pub fn holds(&self, at: Vector3<R>) -> bool {
        (at - self.middle).iter().zip(&self.half).all(|(off, half)| off.abs() <= *half)
    }
}
