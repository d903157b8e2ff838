use super::World;

/// Keeps two particles at a distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// The particles.
    pub ends: [u32; 2],
    /// The distance.
    pub rest: f64,
    /// Inverse stiffness, length / force; 0 is rigid.
    pub compliance: f64,
}

impl World {
    /// One constraint C = |b − a| − rest: Δλ = −(C + α̃λ) / (w_a + w_b + α̃), with α̃ = compliance / dt².
    pub(super) fn stretch(&mut self, index: usize, inv_dt_sq: f64) {
        let Stretch { ends, rest, compliance } = self.stretches[index];
        let [a, b] = ends.map(|end| end as usize);
        let (weight_a, weight_b) = (self.inv_mass[a], self.inv_mass[b]);
        let between = self.x[b] - self.x[a];
        let length = between.norm_squared().sqrt();
        let softness = compliance * inv_dt_sq;
        let weight = weight_a + weight_b + softness;
        if length <= 0.0 || weight <= 0.0 {
            return;
        }
        let multiplier = &mut self.stretch_multipliers[index];
        let step = (length - rest - softness * *multiplier) / weight;
        *multiplier += step;
        let push = between * (step / length);
        self.x[a] += push * weight_a;
        self.x[b] -= push * weight_b;
    }

    /// A dashpot beside a distance, implicit: it takes the share τ dt w / (compliance + τ dt w) of the relative speed along it, with w
    /// the sum of the inverse masses. No impulse of it adds kinetic energy.
    pub(super) fn damp(&mut self, index: usize, dt: f64) {
        let Stretch { ends, compliance, .. } = self.stretches[index];
        let [a, b] = ends.map(|end| end as usize);
        let (weight_a, weight_b) = (self.inv_mass[a], self.inv_mass[b]);
        let between = self.x[b] - self.x[a];
        let weight = weight_a + weight_b;
        let (dashpot, scale) = (self.damping * dt, between.norm_squared());
        let resistance = (compliance + dashpot * weight) * scale;
        if resistance <= 0.0 {
            return;
        }
        let push = between * (dashpot * between.dot(&(self.v[b] - self.v[a])) / resistance);
        self.v[a] += push * weight_a;
        self.v[b] -= push * weight_b;
    }
}
