//! One type for every field of this crate, [`AnyField`]: shapes, grids, combinations and placements, chosen at run
//! time.

use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::combine::{Compound, Difference, Intersection, Offset, Shell, SmoothUnion};
use crate::delegate_sdf;
use crate::grid::owned::OwnedGrid;
use crate::placed::{Placed, Similarity, Stretch};
use crate::shapes::{
    Bowl, Capsule, Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Horseshoe, Octahedron, RoundedBox, Sphere, Torus,
};

/// A field whose type is known only at run time: any shape, any grid in memory, and combinations and placements of them.
///
/// A clone shares its grids. A program with a short list of shapes is smaller with an enum of its own: see
/// [`delegate_sdf!`](crate::delegate_sdf).
#[derive(Clone, Debug)]
#[expect(missing_docs, reason = "a variant is named as the type that it holds")]
pub enum AnyField {
    Sphere(Sphere),
    HalfSpace(HalfSpace),
    Cuboid(Cuboid),
    RoundedBox(RoundedBox),
    Capsule(Capsule),
    Cylinder(Cylinder),
    Cone(Cone),
    Torus(Torus),
    Octahedron(Octahedron),
    Ellipsoid(Ellipsoid),
    Bowl(Bowl),
    Horseshoe(Horseshoe),
    Grid(Arc<OwnedGrid>),
    Union(Compound<Vec<AnyField>>),
    Intersection(Box<Intersection<AnyField, AnyField>>),
    Difference(Box<Difference<AnyField, AnyField>>),
    SmoothUnion(Box<SmoothUnion<AnyField, AnyField>>),
    Offset(Box<Offset<AnyField>>),
    Shell(Box<Shell<AnyField>>),
    Placed(Box<Placed<AnyField, Similarity>>),
    Stretched(Box<Placed<AnyField, Stretch>>),
}

delegate_sdf!(AnyField {
    Sphere,
    HalfSpace,
    Cuboid,
    RoundedBox,
    Capsule,
    Cylinder,
    Cone,
    Torus,
    Octahedron,
    Ellipsoid,
    Bowl,
    Horseshoe,
    Grid,
    Union,
    Intersection,
    Difference,
    SmoothUnion,
    Offset,
    Shell,
    Placed,
    Stretched,
} unions { Union });

/// A shape is a field, and so is a grid.
macro_rules! from_shape {
    ($($shape:ident),+ $(,)?) => {$(
        impl From<$shape> for AnyField {
            fn from(shape: $shape) -> Self {
                Self::$shape(shape)
            }
        }
    )+};
}

from_shape!(
    Sphere, HalfSpace, Cuboid, RoundedBox, Capsule, Cylinder, Cone, Torus, Octahedron, Ellipsoid, Bowl, Horseshoe
);

impl From<Arc<OwnedGrid>> for AnyField {
    fn from(grid: Arc<OwnedGrid>) -> Self {
        Self::Grid(grid)
    }
}

impl From<OwnedGrid> for AnyField {
    fn from(grid: OwnedGrid) -> Self {
        Self::Grid(Arc::new(grid))
    }
}

impl AnyField {
    /// The union of several fields; `None` of none.
    pub fn union(parts: Vec<AnyField>) -> Option<Self> {
        Compound::new(parts).map(Self::Union)
    }

    /// The field put into the world.
    pub fn placed(self, placement: Similarity) -> Self {
        Self::Placed(Box::new(Placed { field: self, placement }))
    }
}
