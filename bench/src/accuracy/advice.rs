//! Which method misses the fewest contacts within a budget?

use serde::Serialize;

use super::curves::{CurvePoint, SetReport};

/// The method that misses fewest contacts within a budget.
#[derive(Debug, Serialize)]
pub struct Advice {
    pub set: &'static str,
    pub elements: &'static str,
    pub cost: Cost,
    /// Largest mean cost of an element.
    pub limit: f64,
    pub method: &'static str,
    pub budget: u32,
    pub unit: &'static str,
    pub p95: f64,
    pub missed: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Cost {
    Evaluations,
    Nanoseconds,
}

impl Cost {
    pub fn mean(self, point: &CurvePoint) -> f64 {
        match self {
            Self::Evaluations => point.evaluations,
            Self::Nanoseconds => point.nanoseconds,
        }
    }

    pub fn limits(self) -> &'static [f64] {
        match self {
            Self::Evaluations => &[4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0],
            Self::Nanoseconds => &[500.0, 1e3, 2e3, 5e3, 1e4, 2e4, 5e4],
        }
    }
}

/// For each limit, the affordable method and budget with the fewest missed contacts. Ties are decided by the 95th
/// percentile of errors, then by cost.
pub fn advise(set: &SetReport, cost: Cost) -> Vec<Advice> {
    let best = |limit: &f64| {
        let points = set.curves.iter().flat_map(|curve| curve.points.iter().map(move |point| (curve, point)));
        let affordable = points.filter(|(_, point)| cost.mean(point) <= *limit);
        let (curve, point) = affordable.min_by(|(_, a), (_, b)| {
            let by_error = a.missed.total_cmp(&b.missed).then(a.errors.p95.total_cmp(&b.errors.p95));
            by_error.then(cost.mean(a).total_cmp(&cost.mean(b)))
        })?;
        Some(Advice {
            set: set.set,
            elements: set.elements,
            cost,
            limit: *limit,
            method: curve.method,
            budget: point.budget,
            unit: curve.unit,
            p95: point.errors.p95,
            missed: point.missed,
        })
    };
    cost.limits().iter().filter_map(best).collect()
}
