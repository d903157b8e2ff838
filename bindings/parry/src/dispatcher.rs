//! The answers of a query dispatcher for pairs with an [`SdfShape`](crate::SdfShape); all other pairs are `Unsupported`, so that the
//! next dispatcher of a chain gets them.

use std::sync::Arc;

use parry3d::math::{Pose, Vector};
use parry3d::query::details::{NormalConstraints, ShapeCastOptions};
use parry3d::query::{
    ClosestPoints, Contact, ContactManifold, ContactManifoldsWorkspace, NonlinearRigidMotion,
    PersistentQueryDispatcher, QueryDispatcher, ShapeCastHit, ShapeDistance, ShapeIntersection, TypedWorkspaceData,
    Unsupported, WorkspaceData,
};
use parry3d::shape::Shape;

use crate::cast::Cast;
use crate::convert::to_parry;
use crate::manifolds;
use crate::pair::Pair;
use crate::search::Search;
use crate::surface::Surface;
use crate::touch::Touch;

/// Answers for pairs with a field. Chain it before parry's own: `SdfDispatcher::default().chain(DefaultQueryDispatcher)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SdfDispatcher {
    /// How contacts are searched.
    pub search: Search,
}

impl SdfDispatcher {
    /// The nearest touch, and whether the shapes intersect. A field that is wholly inside of the other shape gets its way out of it.
    fn nearest(
        &self,
        pos12: &Pose,
        g1: &dyn Shape,
        g2: &dyn Shape,
    ) -> Result<(Pair, Option<Touch>, bool), Unsupported> {
        let pair = Pair::nearest_parts(g1, g2, pos12).ok_or(Unsupported)?;
        let pose = pair.pose(pos12);
        let (touch, intersects) = pair.nearest_or_way_out([g1, g2], &pose, self.search);
        let touch = if intersects { touch } else { touch.map(|touch| pair.apart([g1, g2], &pose, touch)) };
        Ok((pair, touch, intersects))
    }
}

impl QueryDispatcher for SdfDispatcher {
    fn intersection_test(
        &self,
        pos12: &Pose,
        g1: &dyn Shape,
        g2: &dyn Shape,
    ) -> Result<ShapeIntersection, Unsupported> {
        let pair = Pair::near_at(g1, g2, pos12, 0.0).ok_or(Unsupported)?;
        let pose = pair.pose(pos12);
        let touches = !pair.touches(&pose, 0.0, self.search).is_empty() || pair.swallowed([g1, g2], &pose).is_some();
        Ok(touches.into())
    }

    fn distance(&self, pos12: &Pose, g1: &dyn Shape, g2: &dyn Shape) -> Result<ShapeDistance, Unsupported> {
        let (_, touch, intersects) = self.nearest(pos12, g1, g2)?;
        let gap = touch.map_or(f32::MAX, |touch| touch.gap as f32);
        Ok(ShapeDistance::new(if intersects { 0.0 } else { gap }))
    }

    fn contact(
        &self,
        pos12: &Pose,
        g1: &dyn Shape,
        g2: &dyn Shape,
        prediction: f32,
    ) -> Result<Option<Contact>, Unsupported> {
        let (pair, touch, _) = self.nearest(pos12, g1, g2)?;
        let pose = pair.pose(pos12);
        let contact = touch.filter(|touch| touch.gap <= f64::from(prediction)).map(|touch| {
            let normal = to_parry(touch.normal);
            let on_other = pose.inverse_transform_point(to_parry(touch.point));
            let other_normal = pose.rotation.inverse() * -normal;
            let contact = Contact::new(to_parry(touch.field_point), on_other, normal, other_normal, touch.gap as f32);
            if pair.flipped { contact.flipped() } else { contact }
        });
        Ok(contact)
    }

    fn closest_points(
        &self,
        pos12: &Pose,
        g1: &dyn Shape,
        g2: &dyn Shape,
        max_distance: f32,
    ) -> Result<ClosestPoints, Unsupported> {
        Ok(match self.contact(pos12, g1, g2, max_distance)? {
            Some(contact) if contact.dist <= 0.0 => ClosestPoints::Intersecting,
            Some(contact) => ClosestPoints::WithinMargin(contact.point1, contact.point2),
            None => ClosestPoints::Disjoint,
        })
    }

    fn cast_shapes(
        &self,
        pos12: &Pose,
        velocity: Vector,
        g1: &dyn Shape,
        g2: &dyn Shape,
        options: ShapeCastOptions,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        let still = NonlinearRigidMotion::identity();
        let moving = NonlinearRigidMotion::new(*pos12, Vector::ZERO, velocity, Vector::ZERO);
        let cast = Cast::new([g1, g2], self.search, [&still, &moving], 0.0, options).ok_or(Unsupported)?;
        Ok(cast.run())
    }

    fn cast_shapes_nonlinear(
        &self,
        motion1: &NonlinearRigidMotion,
        g1: &dyn Shape,
        motion2: &NonlinearRigidMotion,
        g2: &dyn Shape,
        start_time: f32,
        end_time: f32,
        stop_at_penetration: bool,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        let options = ShapeCastOptions { max_time_of_impact: end_time, stop_at_penetration, ..Default::default() };
        let cast = Cast::new([g1, g2], self.search, [motion1, motion2], start_time, options).ok_or(Unsupported)?;
        Ok(cast.run())
    }
}

/// What a pair keeps from step to step: the triangles of its surface, in clusters.
#[derive(Clone)]
struct SdfWorkspace(Arc<Surface>);

impl WorkspaceData for SdfWorkspace {
    fn as_typed_workspace_data(&self) -> TypedWorkspaceData<'_> {
        TypedWorkspaceData::Custom
    }

    fn clone_dyn(&self) -> Box<dyn WorkspaceData> {
        Box::new(self.clone())
    }
}

impl<M, C> PersistentQueryDispatcher<M, C> for SdfDispatcher
where
    M: Default + Clone + Send + Sync,
    C: Default + Copy + Send + Sync,
{
    fn contact_manifolds(
        &self,
        pos12: &Pose,
        g1: &dyn Shape,
        g2: &dyn Shape,
        prediction: f32,
        manifolds: &mut Vec<ContactManifold<M, C>>,
        workspace: &mut Option<ContactManifoldsWorkspace>,
    ) -> Result<(), Unsupported> {
        let known = workspace.as_ref().and_then(|known| known.0.downcast_ref::<SdfWorkspace>());
        let pair = match known {
            Some(SdfWorkspace(surface)) => Pair::with_surface(g1, g2, surface.clone()),
            None => Pair::new(g1, g2).map(|pair| Pair { surface: Surface::shared_with_clusters(pair.surface), ..pair }),
        };
        let pair = pair.ok_or(Unsupported)?;
        let pose = pair.pose(pos12);
        let touches = pair.touches_or_way_out([g1, g2], &pose, f64::from(prediction), self.search);
        manifolds::update(manifolds, touches, &pose, pair.flipped, f64::from(prediction));
        *workspace = Some(SdfWorkspace(pair.surface).into());
        Ok(())
    }

    /// Never: a field is not convex.
    fn contact_manifold_convex_convex(
        &self,
        _: &Pose,
        _: &dyn Shape,
        _: &dyn Shape,
        _: Option<&dyn NormalConstraints>,
        _: Option<&dyn NormalConstraints>,
        _: f32,
        _: &mut ContactManifold<M, C>,
    ) -> Result<(), Unsupported> {
        Err(Unsupported)
    }
}
