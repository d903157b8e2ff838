//! Which elements of a mesh need no look at all? Clusters of 16 neighbours, culled together by one box; and runs of clusters likewise.
//!
//! Elements are ordered by their centroids along a Hilbert curve ([`crate::hilbert`]); each run of [`CLUSTER_SIZE`] is a cluster. The
//! order is made once for a mesh, in rest space. The boxes of a rigid body stay, too, and its pose is applied to them; those of a
//! mesh that is deformed are [`refit`].
//!
//! | step | a box is culled if the margin is below |
//! |---|---|
//! | 1 | φ(c) − slope bound · half of the diagonal, with c the centre of the box: one look at the field, whatever turns the box |
//! | 2 | the field's lower bound in the box, [`EnclosedSdf::enclose_box`] |
//! | 3 | φ(c) − slope bound in the box · half of the diagonal |
//!
//! All hold for all points of all its elements, rounding included. So what is left has the contacts of the whole mesh. Neighbours on
//! the curve are neighbours in space: runs of [`RUNS`] clusters are asked by the box around them first, and if that is far, none of
//! them.

use nalgebra::Vector3;

use crate::number::Float;
use crate::placed::{Placement, Rigid};
use crate::rounding::{BOX_COORDINATE, FieldScale, NESTED_FIELDS, POSED_COORDINATE, rounding};
use crate::vector::from_f64;
use crate::{Aabb, EnclosedSdf, hilbert};

/// Elements of a cluster; the last one may have fewer. To ask for a box costs as much as to look at one element or two, so a box that
/// saves a sixteenth of its elements is worth it.
pub const CLUSTER_SIZE: usize = 16;

/// Clusters of a run, and of a run within it. Their boxes are made of those of the clusters whenever they are asked for.
const RUNS: [usize; 2] = [32, 4];

/// The elements of a mesh in clusters of neighbours.
///
/// ```
/// use sdf_core::contact::{Clusters, ClusterKey, cluster_count};
/// use sdf_core::{Aabb, shapes::Sphere};
/// // 200 loose points along a line; the ball reaches the first.
/// let points: Vec<[f64; 3]> = (0..200).map(|k| [f64::from(k), 0.0, 0.0]).collect();
/// let elements: Vec<[u32; 1]> = (0..200).map(|k| [k]).collect();
/// let mut scratch = vec![ClusterKey::default(); 200];
/// let (mut order, mut boxes) = (vec![0; 200], vec![Aabb::EVERYWHERE; cluster_count(200)]);
/// let clusters = Clusters::build(&points, &elements, &mut scratch, &mut order, &mut boxes).unwrap();
/// let mut near = 0;
/// clusters.visit_near(&Sphere::new(1.0).unwrap(), 0.1, None, |elements| near += elements.len());
/// assert_eq!(near, 16);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clusters<'a> {
    order: &'a [u32],
    boxes: &'a [Aabb],
}

/// Scratch space of [`Clusters::build`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct ClusterKey {
    index: u64,
    element: u32,
}

/// Clusters of so many elements.
pub const fn cluster_count(element_count: usize) -> usize {
    element_count.div_ceil(CLUSTER_SIZE)
}

impl<'a> Clusters<'a> {
    /// Orders the elements, and fits the boxes. `scratch` and `order` have one entry for each element, `boxes` one for each cluster,
    /// and all are overwritten. `None` if a length is another one, an element names a vertex that is not there, or there are 2³² of
    /// them.
    pub fn build<R: Float, const N: usize>(
        points: &[[R; 3]],
        elements: &[[u32; N]],
        scratch: &mut [ClusterKey],
        order: &'a mut [u32],
        boxes: &'a mut [Aabb],
    ) -> Option<Self> {
        sort_along_curve(points, elements, scratch, order)?;
        refit(points, elements, order, boxes).then_some(Self { order, boxes })
    }

    /// Clusters that are known: `order` has every element once, and `boxes` those around each [`CLUSTER_SIZE`] of them. `None` if
    /// their numbers do not match.
    pub fn from_parts(order: &'a [u32], boxes: &'a [Aabb]) -> Option<Self> {
        (boxes.len() == cluster_count(order.len())).then_some(Self { order, boxes })
    }

    /// The elements, cluster by cluster.
    pub fn order(&self) -> &'a [u32] {
        self.order
    }

    /// The box around each cluster. [`Aabb::EVERYWHERE`] where a point is NaN, infinite or too large.
    pub fn boxes(&self) -> &'a [Aabb] {
        self.boxes
    }

    /// Visits the elements of each cluster that may come within the margin of the field, in the order of the clusters. Nothing that
    /// [`contact`](super::contact()) would report for margins up to this one is left out. `R` is the number type of the margin and of
    /// the elements, whose corners are the points of the clusters, moved by `pose`.
    pub fn visit_near<R: Float, F: EnclosedSdf>(
        &self,
        field: &F,
        margin: R,
        pose: Option<&Rigid>,
        mut visit: impl FnMut(&'a [u32]),
    ) {
        let near = NearTest { field, slope_bound: field.slope_bound(), margin, pose };
        let [large, small] = RUNS;
        for (members, boxes) in self.order.chunks(CLUSTER_SIZE * large).zip(self.boxes.chunks(large)) {
            if !near.may_any_touch(boxes) {
                continue;
            }
            for (members, boxes) in members.chunks(CLUSTER_SIZE * small).zip(boxes.chunks(small)) {
                if !near.may_any_touch(boxes) {
                    continue;
                }
                for (elements, bounds) in members.chunks(CLUSTER_SIZE).zip(boxes) {
                    if near.may_touch(*bounds) {
                        visit(elements);
                    }
                }
            }
        }
    }
}

/// Writes the elements in the order of their centroids along a Hilbert curve. `None` if a length is another one, an element names a
/// vertex that is not there, or there are 2³² of them.
pub(crate) fn sort_along_curve<R: Float, const N: usize>(
    points: &[[R; 3]],
    elements: &[[u32; N]],
    scratch: &mut [ClusterKey],
    order: &mut [u32],
) -> Option<()> {
    let count = elements.len();
    let fits = u32::try_from(count).is_ok() && scratch.len() == count && order.len() == count;
    let bounds = finite_bounds(points);
    let cells_per_length = f64::from((1_u32 << hilbert::BITS) - 1) / bounds.longest_side();
    for ((key, element), corners) in scratch.iter_mut().zip(0..).zip(elements) {
        let mut centroid = Vector3::zeros();
        for corner in corners {
            centroid += point(points, *corner)?.map(Float::to_f64) / N as f64;
        }
        // `as` makes 0 of NaN and of what is below 0, and the largest number of infinity.
        let cell = (centroid - Vector3::from(bounds.min)) * cells_per_length;
        let cell = cell.map(|x| (x as u32).min((1 << hilbert::BITS) - 1));
        *key = ClusterKey { index: hilbert::hilbert_index(cell.into()), element };
    }
    if !fits {
        return None;
    }
    scratch.sort_unstable();
    order.iter_mut().zip(scratch.iter()).for_each(|(place, key)| *place = key.element);
    Some(())
}

/// Fits the boxes to the points of a mesh that was deformed; `order` stays that of the rest shape. Costs one look at each corner.
/// `false` if the numbers of elements, their order and boxes do not match, or a vertex is not there: the boxes are then no good.
pub fn refit<R: Float, const N: usize>(
    points: &[[R; 3]],
    elements: &[[u32; N]],
    order: &[u32],
    boxes: &mut [Aabb],
) -> bool {
    let mut is_complete = order.len() == elements.len() && boxes.len() == cluster_count(order.len());
    for (bounds, members) in boxes.iter_mut().zip(order.chunks(CLUSTER_SIZE)) {
        let mut around = Aabb { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };
        let mut is_representable = true;
        for member in members {
            let vertices = elements.get(*member as usize);
            is_complete &= vertices.is_some();
            for corner in vertices.into_iter().flatten() {
                let Some(point) = point(points, *corner) else {
                    is_complete = false;
                    continue;
                };
                is_representable &= point.iter().all(|x| x.is_representable());
                around = around.union(&Aabb::from_corners(&[point]));
            }
        }
        *bounds = if is_representable { around } else { Aabb::EVERYWHERE };
    }
    is_complete
}

/// The question whether elements in a box may come within the margin.
struct NearTest<'a, R, F> {
    field: &'a F,
    slope_bound: f64,
    margin: R,
    pose: Option<&'a Rigid>,
}

impl<R: Float, F: EnclosedSdf> NearTest<'_, R, F> {
    /// [`may_touch`](Self::may_touch) of the box around several.
    fn may_any_touch(&self, boxes: &[Aabb]) -> bool {
        boxes
            .iter()
            .copied()
            .reduce(|around, bounds| around.union(&bounds))
            .is_some_and(|around| self.may_touch(around))
    }

    /// `false` only if φ is above the margin at all points of elements whose corners are in the box, in their own frame.
    fn may_touch(&self, local: Aabb) -> bool {
        let centre = Vector3::from(core::array::from_fn(|axis| 0.5 * (local.min[axis] + local.max[axis])));
        // A pose turns the box, and the box around that is larger. The ball around it is not.
        let radius = 0.5 * local.diagonal();
        let (centre, bounds) = self.pose.map_or((centre, local), |pose| (pose.push(centre), pose.push_bounds(local)));
        let coordinates = bounds.min.iter().chain(&bounds.max).chain(&local.min).chain(&local.max);
        let largest = coordinates.fold(0.0_f64, |largest, x| largest.max(x.abs()));
        // Corners are computed in R, and may lie beyond the box by their rounding.
        let rounded = largest * R::EPSILON * if self.pose.is_some() { POSED_COORDINATE } else { BOX_COORDINATE };
        largest > R::MAX_COORDINATE || !self.is_far(&bounds.inflate(rounded), centre, radius + 2.0 * rounded)
    }

    /// Is φ certainly above the margin where the box and the ball overlap?
    fn is_far(&self, bounds: &Aabb, centre: Vector3<f64>, radius: f64) -> bool {
        let Self { field, slope_bound, margin, .. } = *self;
        let (centre, radius): (Vector3<R>, R) = (from_f64(centre.into()), R::from_f64(radius));
        let slack = |value| rounding(FieldScale::new(field), centre, radius, value) * R::from_f64(NESTED_FIELDS);
        let value = field.value(centre);
        let around_centre = value - slack(value);
        if margin < around_centre - radius * R::from_f64(slope_bound) {
            return true;
        }
        let local = field.enclose_box(bounds);
        margin < R::from_f64(local.range.lower) - slack(margin)
            || margin < around_centre - radius * R::from_f64(local.slope_bound)
    }
}

fn point<R: Float>(points: &[[R; 3]], index: u32) -> Option<Vector3<R>> {
    points.get(index as usize).map(|point| Vector3::from(*point))
}

/// The box around the points that are finite.
fn finite_bounds<R: Float>(points: &[[R; 3]]) -> Aabb {
    let finite = points.iter().filter(|point| point.iter().all(|x| x.is_representable()));
    let bounds = Aabb::from_points(finite.map(|point| point.map(Float::to_f64)));
    bounds.unwrap_or(Aabb { min: [0.0; 3], max: [0.0; 3] })
}
