//! A contact row as a hard unilateral constraint: sides that are too near are pushed apart, and Coulomb's friction, at most μ times
//! all that was pushed in the step, holds against their slide. Rolling friction holds against the turn of one body on the other, by a
//! torque of at most a lever times all that was pushed. Rows of rigid bodies that have struck each other take back what they pushed too
//! much.

use sdf_core::contact::{Row, RowSide};
use sdf_core::nalgebra::UnitQuaternion;

use super::World;
use crate::row::{Rounding, Rows};
use crate::touch::{Side, Touch};
use crate::{Body, V3};

/// With equal masses a push moves no corner by more than (1 + √2)/2 ≈ 1.21 depths on an edge, and 1.37 on a face. A corner that weighs
/// 1/r of the others moves up to √r/2 depths: 16 at 1 : 1000, which folds the sheet over itself. A push that would move a corner by
/// more than this many depths moves it by no more than a share of the distance to the next corner.
const MAX_DEPTHS: f64 = 1.5;
const MAX_SHARE: f64 = 0.3;

/// Bodies that approach by more within a step than gravity makes them in this many have struck each other.
const STRUCK: f64 = 2.0;

impl World {
    /// Takes the rows that were added since the last step.
    pub(super) fn prepare(&self, rows: &mut Rows) {
        let mut corners: Vec<[u32; 4]> = vec![];
        for index in rows.touches.len()..rows.as_slice().len() {
            let row = rows.as_slice()[index];
            if matches!(row.element, RowSide::Tet(_) | RowSide::Embedded(_)) || matches!(row.field, RowSide::Tet(_)) {
                corners.resize_with(self.tets.len(), Default::default);
                corners.iter_mut().zip(&self.tets).for_each(|(corners, tet)| *corners = tet.corners);
            }
            let rounding = rows.rounding(index);
            let element = self.side(&row, &row.element, 0.0, &corners, &mut rows.terms);
            let field = self.side(&row, &row.field, rounding.radius, &corners, &mut rows.terms);
            let touch =
                Touch { turns_with: self.turns_with(&row, rounding), ..self.touch_of(&row, element, field, rows) };
            rows.touches.push(touch);
        }
        for index in 0..rows.touches.len() {
            let touch = self.begun(rows.touches[index], rows);
            rows.touches[index] = touch;
        }
    }

    /// A touch as a step begins: nothing is pushed, and sides that are round touch where they have rolled to.
    fn begun(&self, touch: Touch, rows: &Rows) -> Touch {
        let mut touch = Touch { pushed: 0.0, held: V3::zeros(), twisted: V3::zeros(), is_struck: false, ..touch };
        if let Some((id, normal)) = touch.turns_with {
            touch.normal = self.bodies[id as usize].rotation * normal;
        }
        let normal = touch.normal;
        for side in [&mut touch.element, &mut touch.field] {
            match side {
                Side::Fixed { center, radius, point } => *point = *center + normal * *radius,
                Side::Body { id, center, radius, arm } => {
                    *arm = self.bodies[*id as usize].rotation * *center + normal * *radius;
                }
                Side::Particles { .. } => {}
            }
        }
        if touch.turns_with.is_some() {
            // The face is tangent beside the field's point.
            let between = self.at(&touch.field, rows) - self.at(&touch.element, rows);
            if let Side::Body { arm, .. } = &mut touch.element {
                *arm += between - normal * normal.dot(&between);
            }
        }
        touch
    }

    /// The body of a flat element on a round field: the plane of the element is that of the contact.
    fn turns_with(&self, row: &Row<f64>, rounding: Rounding) -> Option<(u32, V3)> {
        match row.element {
            RowSide::Body { body, .. } if rounding.is_flat && rounding.radius > 0.0 => {
                Some((body, self.bodies[body as usize].rotation.inverse() * row.normal))
            }
            _ => None,
        }
    }

    /// A side of a row, which is round with a radius.
    fn side(
        &self,
        row: &Row<f64>,
        side: &RowSide<f64>,
        radius: f64,
        tets: &[[u32; 4]],
        terms: &mut Vec<(u32, f64)>,
    ) -> Side {
        match side {
            RowSide::Fixed if radius > 0.0 => {
                let point = row.surface_point;
                Side::Fixed { center: point - row.normal * radius, radius, point }
            }
            RowSide::Fixed => Side::Fixed { center: V3::zeros(), radius, point: V3::zeros() },
            RowSide::Body { body, arm } => {
                let center = self.bodies[*body as usize].rotation.inverse() * (arm - row.normal * radius);
                Side::Body { id: *body, center, radius, arm: *arm }
            }
            _ => {
                let first = terms.len();
                side.visit_particles(tets, |particle, weight| terms.push((particle, weight)));
                Side::Particles { first: first as u32, count: (terms.len() - first) as u32 }
            }
        }
    }

    fn touch_of(&self, row: &Row<f64>, element: Side, field: Side, rows: &Rows) -> Touch {
        let between = self.at(&element, rows) - self.at(&field, rows);
        let (mut particle_weight, mut farthest, mut reach) = (0.0, 0.0_f64, f64::INFINITY);
        for side in [&element, &field] {
            let terms = terms_of(side, rows);
            for (index, (id, weight)) in terms.iter().enumerate() {
                let inv_mass = self.inv_mass[*id as usize];
                particle_weight += inv_mass * weight * weight;
                farthest = farthest.max(inv_mass * weight.abs());
                let others = &terms[index + 1..];
                reach = others
                    .iter()
                    .map(|(other, _)| (self.x[*other as usize] - self.x[*id as usize]).norm())
                    .fold(reach, f64::min);
            }
        }
        Touch {
            element,
            field,
            normal: row.normal,
            turns_with: None,
            velocity: row.surface_velocity,
            offset: row.gap - row.normal.dot(&between),
            friction: row.friction,
            particle_weight,
            farthest,
            reach,
            pushed: 0.0,
            held: V3::zeros(),
            twisted: V3::zeros(),
            is_struck: false,
        }
    }

    /// Goes over one row; depth from before is undone at no more than `recovery_speed`.
    pub(super) fn touch(&mut self, rows: &mut Rows, index: usize, dt: f64, recovery_speed: f64) {
        let mut touch = rows.touches[index];
        let Touch { element, field, normal, friction, pushed, held, .. } = touch;
        let way = touch.velocity * rows.age;
        let gap = normal.dot(&(self.at(&element, rows) - self.at(&field, rows) - way)) + touch.offset;
        let takes_back = gap > 0.0 && touch.is_struck && pushed > 0.0;
        if gap >= 0.0 && !takes_back {
            return;
        }
        let weight = self.inv_mass_of(&touch, &normal);
        if weight <= 0.0 {
            return;
        }
        let push = if takes_back {
            let back = (gap / weight).min(pushed);
            self.push_apart(&touch, rows, normal * -back, dt);
            -back
        } else {
            self.part(&mut touch, rows, gap, weight, dt, recovery_speed)
        };
        let pushed = pushed + push;
        (rows.touches[index].pushed, rows.touches[index].is_struck) = (pushed, touch.is_struck);
        self.hold_roll(&touch, pushed, rows, index, dt);
        if friction <= 0.0 || pushed <= 0.0 && held == V3::zeros() {
            return;
        }
        let touch = self.at_one_point(&touch, rows);
        let Touch { element, field, .. } = touch;
        let from = self.was_at(&element, rows) - self.was_at(&field, rows) + touch.velocity * dt;
        let slid = self.at(&element, rows) - self.at(&field, rows) - from;
        let across = slid - normal * normal.dot(&slid);
        let length = across.norm();
        let wanted = match length > 0.0 {
            true => held - across / self.inv_mass_of(&touch, &(across / length)),
            false => held,
        };
        let limit = friction * pushed;
        let allowed = if wanted.norm() > limit { wanted * (limit / wanted.norm()) } else { wanted };
        rows.touches[index].held = allowed;
        self.push_apart(&touch, rows, allowed - held, dt);
    }

    /// The touch as friction takes it, between two points that are one: what pushes two bodies along a plane at points a thickness apart
    /// also turns them. An obstacle that is fixed takes any turn.
    fn at_one_point(&self, touch: &Touch, rows: &Rows) -> Touch {
        let mut touch = *touch;
        let between = self.at(&touch.element, rows) - self.at(&touch.field, rows);
        match (&mut touch.element, &mut touch.field) {
            (Side::Body { arm: a, .. }, Side::Body { arm: b, .. }) => {
                *a -= between * 0.5;
                *b += between * 0.5;
            }
            (Side::Body { arm, .. }, Side::Particles { .. }) => *arm -= between,
            (Side::Particles { .. }, Side::Body { arm, .. }) => *arm += between,
            _ => {}
        }
        touch
    }

    /// Parts sides that are too near, by a force as far as they have approached in this step. Returns the push.
    fn part(&mut self, touch: &mut Touch, rows: &Rows, gap: f64, weight: f64, dt: f64, recovery_speed: f64) -> f64 {
        let Touch { element, field, normal, .. } = *touch;
        let from = self.was_at(&element, rows) - self.was_at(&field, rows) + touch.velocity * dt;
        let slid = self.at(&element, rows) - self.at(&field, rows) - from;
        let is_uneven = touch.farthest > MAX_DEPTHS * weight;
        let most = if is_uneven { MAX_SHARE * touch.reach / touch.farthest } else { f64::INFINITY };
        // What undoes the approach of this step is a force. The depth from before is undone without a velocity, and only as far as the sides
        // have not parted. Of bodies that counts since the step began, whatever parted them: contacts that share a body push it once, not
        // each. A sheet rests where what undid depth does not count: what lifts a corner stretches the edges beside it.
        let approach = -normal.dot(&slid);
        let push = ((-gap).min(approach.max(0.0)) / weight).min(most);
        self.push_apart(touch, rows, normal * push, dt);
        let parted = match self.started_at(&element).zip(self.started_at(&field)) {
            Some((a, b)) => {
                touch.is_struck |= approach > STRUCK * self.gravity.norm() * dt * dt;
                normal.dot(&(self.at(&element, rows) - self.at(&field, rows) - (a - b + touch.velocity * dt)))
            }
            None => -approach,
        };
        let depth = (-gap - approach.max(0.0)).min(recovery_speed * dt - parted.max(0.0));
        if depth > 0.0 {
            self.shift_apart(touch, rows, normal * (depth / weight).min(most));
        }
        push
    }

    /// Rolling friction: a twist against the turn of the sides against each other, of at most lever · push. It takes no more of the turn
    /// than there is about any axis, and keeps the angular momentum of a pair.
    fn hold_roll(&mut self, touch: &Touch, pushed: f64, rows: &mut Rows, index: usize, dt: f64) {
        let limit = self.rolling_friction * pushed;
        if limit <= 0.0 && touch.twisted == V3::zeros() {
            return;
        }
        let body_of = |side: &Side| match side {
            Side::Body { id, .. } => Some(*id as usize),
            _ => None,
        };
        let sides = [(body_of(&touch.element), 1.0), (body_of(&touch.field), -1.0)];
        let (mut turn, mut weight) = (V3::zeros(), 0.0);
        for (id, sign) in sides {
            if let Some(body) = id.map(|id| &self.bodies[id]) {
                turn += body.angular_velocity() * (sign * dt);
                // No less than about any axis.
                weight += body.inv_inertia.trace();
            }
        }
        if weight <= 0.0 {
            return;
        }
        let wanted = touch.twisted - turn / weight;
        let allowed = if wanted.norm() > limit { wanted * (limit / wanted.norm()) } else { wanted };
        rows.touches[index].twisted = allowed;
        for (id, sign) in sides {
            if let Some(id) = id {
                self.bodies[id].twist(&((allowed - touch.twisted) * sign), dt);
            }
        }
    }

    fn push_apart(&mut self, touch: &Touch, rows: &Rows, push: V3, dt: f64) {
        self.push(&touch.element, rows, &push, dt);
        self.push(&touch.field, rows, &-push, dt);
        if matches!(touch.field, Side::Fixed { .. }) {
            self.outer.add(&(push / dt));
        }
    }

    fn shift_apart(&mut self, touch: &Touch, rows: &Rows, push: V3) {
        self.shift(&touch.element, rows, &push);
        self.shift(&touch.field, rows, &-push);
    }

    /// Where a side is now. A body's point moves by its turn since the step began × arm, without the second order of a turn: a ball
    /// neither sinks nor rises where it rolls.
    fn at(&self, side: &Side, rows: &Rows) -> V3 {
        match side {
            Side::Fixed { point, .. } => *point,
            Side::Body { id, arm, .. } => {
                let Body { position, rotation, .. } = &self.bodies[*id as usize];
                self.carried(*id, position, rotation, arm)
            }
            _ => mean(&self.x, terms_of(side, rows)),
        }
    }

    fn carried(&self, id: u32, position: &V3, rotation: &UnitQuaternion<f64>, arm: &V3) -> V3 {
        let turn = (rotation * self.start_poses[id as usize].1.inverse()).imag() * 2.0;
        position + arm + turn.cross(arm)
    }

    /// Where a side was when the step began; `None` of particles.
    fn started_at(&self, side: &Side) -> Option<V3> {
        match side {
            Side::Fixed { point, .. } => Some(*point),
            Side::Body { id, arm, .. } => Some(self.start_poses[*id as usize].0 + arm),
            Side::Particles { .. } => None,
        }
    }

    /// Where a side was when the step began, shifted as it was since.
    fn was_at(&self, side: &Side, rows: &Rows) -> V3 {
        match side {
            Side::Fixed { point, .. } => *point,
            Side::Body { id, arm, .. } => {
                let (position, rotation) = &self.previous_poses[*id as usize];
                self.carried(*id, position, rotation, arm)
            }
            _ => mean(&self.previous, terms_of(side, rows)),
        }
    }

    fn inv_mass_of(&self, touch: &Touch, direction: &V3) -> f64 {
        let of_body = |side: &Side| match side {
            Side::Body { id, arm, .. } => self.bodies[*id as usize].inv_mass_at(arm, direction),
            _ => 0.0,
        };
        touch.particle_weight + of_body(&touch.element) + of_body(&touch.field)
    }

    fn push(&mut self, side: &Side, rows: &Rows, push: &V3, dt: f64) {
        if let Side::Body { id, arm, .. } = side {
            self.bodies[*id as usize].push(arm, push, dt);
        }
        for (id, weight) in terms_of(side, rows) {
            let id = *id as usize;
            self.x[id] += push * (self.inv_mass[id] * weight);
        }
    }

    /// A push that leaves velocities as they are: where a side was at the beginning of the step moves too.
    fn shift(&mut self, side: &Side, rows: &Rows, push: &V3) {
        if let Side::Body { id, arm, .. } = side {
            let id = *id as usize;
            let twist = arm.cross(push);
            let (position, rotation) = &mut self.previous_poses[id];
            self.bodies[id].shift(push, &twist, position, rotation);
        }
        for (id, weight) in terms_of(side, rows) {
            let id = *id as usize;
            let way = push * (self.inv_mass[id] * weight);
            self.x[id] += way;
            self.previous[id] += way;
        }
    }
}

fn terms_of<'a>(side: &Side, rows: &'a Rows) -> &'a [(u32, f64)] {
    match side {
        Side::Particles { first, count } => &rows.terms[*first as usize..(first + count) as usize],
        _ => &[],
    }
}

/// The weighted mean of particles; the origin without any.
fn mean(x: &[V3], terms: &[(u32, f64)]) -> V3 {
    terms.iter().map(|(id, weight)| x[*id as usize] * *weight).sum()
}
