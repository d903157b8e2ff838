//! A contact row as a hard unilateral constraint: sides that are too near are pushed apart, and Coulomb's friction, at most μ times
//! all that was pushed in the step, holds against their slide.

use super::World;
use crate::V3;
use crate::row::{Row, Rows, Side};

impl World {
    pub(super) fn touch(&mut self, rows: &mut Rows, index: usize, dt: f64) {
        let row = rows.rows[index];
        let Row { a, b, normal, offset, friction } = &row;
        let [at_a, at_b] = [a, b].map(|side| self.at(side, rows));
        let gap = normal.dot(&(at_a - at_b)) + offset;
        if gap >= 0.0 {
            return;
        }
        let weight = self.inv_mass_of(a, rows, normal) + self.inv_mass_of(b, rows, normal);
        if weight <= 0.0 {
            return;
        }
        let [from_a, from_b] = [a, b].map(|side| self.was_at(side, rows, dt));
        let slid = (at_a - from_a) - (at_b - from_b);
        // What undoes the approach of this step is a force. The depth from before is undone without a velocity, no faster than the sides
        // part: contacts that share a vertex push it once, not each.
        let approach = -normal.dot(&slid);
        let push = (-gap).min(approach.max(0.0)) / weight;
        self.push_apart(&row, rows, normal * push, dt);
        let depth = (-gap - approach.max(0.0)).min(self.recovery_speed * dt + approach.min(0.0));
        if depth > 0.0 {
            self.shift_apart(&row, rows, normal * (depth / weight));
        }
        let (pushed, held) = rows.pushes[index];
        let pushed = pushed + push;
        rows.pushes[index].0 = pushed;
        if *friction <= 0.0 || pushed <= 0.0 {
            return;
        }
        let [at_a, at_b] = [a, b].map(|side| self.at(side, rows));
        let slid = (at_a - from_a) - (at_b - from_b);
        let across = slid - normal * normal.dot(&slid);
        let length = across.norm();
        if length <= 0.0 {
            return;
        }
        let direction = across / length;
        let weight = self.inv_mass_of(a, rows, &direction) + self.inv_mass_of(b, rows, &direction);
        let wanted = held - across / weight;
        let limit = friction * pushed;
        let allowed = if wanted.norm() > limit { wanted * (limit / wanted.norm()) } else { wanted };
        rows.pushes[index].1 = allowed;
        self.push_apart(&row, rows, allowed - held, dt);
    }

    fn push_apart(&mut self, row: &Row, rows: &Rows, push: V3, dt: f64) {
        self.push(&row.a, rows, &push, dt);
        self.push(&row.b, rows, &-push, dt);
    }

    fn shift_apart(&mut self, row: &Row, rows: &Rows, push: V3) {
        self.shift(&row.a, rows, &push);
        self.shift(&row.b, rows, &-push);
    }

    fn at(&self, side: &Side, rows: &Rows) -> V3 {
        match side {
            Side::Fixed(velocity) => velocity * rows.age,
            Side::Particles { first, count } => self.mean(rows.terms_of(*first, *count)),
            Side::Body { id, arm } => self.bodies[*id as usize].world_point(arm),
        }
    }

    /// Where a side was when the step began.
    fn was_at(&self, side: &Side, rows: &Rows, dt: f64) -> V3 {
        match side {
            Side::Fixed(velocity) => velocity * (rows.age - dt),
            Side::Particles { first, count } => {
                let terms = rows.terms_of(*first, *count);
                terms.iter().map(|(id, weight)| self.previous[*id as usize] * *weight).sum()
            }
            Side::Body { id, arm } => {
                let (position, rotation) = &self.previous_poses[*id as usize];
                position + rotation * arm
            }
        }
    }

    fn inv_mass_of(&self, side: &Side, rows: &Rows, direction: &V3) -> f64 {
        match side {
            Side::Fixed(_) => 0.0,
            Side::Particles { first, count } => {
                let terms = rows.terms_of(*first, *count);
                terms.iter().map(|(id, weight)| self.inv_mass[*id as usize] * weight * weight).sum()
            }
            Side::Body { id, arm } => self.bodies[*id as usize].inv_mass_at(arm, direction),
        }
    }

    fn push(&mut self, side: &Side, rows: &Rows, push: &V3, dt: f64) {
        match side {
            Side::Fixed(_) => {}
            Side::Particles { first, count } => {
                for (id, weight) in rows.terms_of(*first, *count) {
                    let id = *id as usize;
                    self.x[id] += push * (self.inv_mass[id] * weight);
                }
            }
            Side::Body { id, arm } => self.bodies[*id as usize].push(arm, push, dt),
        }
    }

    /// A push that leaves velocities as they are: where a side was at the beginning of the step moves too.
    fn shift(&mut self, side: &Side, rows: &Rows, push: &V3) {
        match side {
            Side::Fixed(_) => {}
            Side::Particles { first, count } => {
                for (id, weight) in rows.terms_of(*first, *count) {
                    let id = *id as usize;
                    let way = push * (self.inv_mass[id] * weight);
                    self.x[id] += way;
                    self.previous[id] += way;
                }
            }
            Side::Body { id, arm } => {
                let id = *id as usize;
                let twist = (self.bodies[id].rotation * arm).cross(push);
                let (position, rotation) = &mut self.previous_poses[id];
                self.bodies[id].shift(push, &twist, position, rotation);
            }
        }
    }
}
