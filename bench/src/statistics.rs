use serde::Serialize;

/// Quantiles of a list of numbers, each of them a number of the list.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Quantiles {
    pub q1: f64,
    pub median: f64,
    pub q3: f64,
    pub p95: f64,
    #[serde(rename = "worst")]
    pub max: f64,
}

impl Quantiles {
    /// NaN if there are no numbers.
    pub fn new(mut numbers: Vec<f64>) -> Self {
        numbers.sort_unstable_by(f64::total_cmp);
        let quantile = |fraction| quantile(&numbers, fraction);
        Self { q1: quantile(0.25), median: quantile(0.5), q3: quantile(0.75), p95: quantile(0.95), max: quantile(1.0) }
    }
}

pub fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_unstable_by(f64::total_cmp);
    quantile(&numbers, 0.5)
}

/// Smallest number x of an ascending list with at least this fraction of the list ≤ x.
fn quantile(ascending: &[f64], fraction: f64) -> f64 {
    let rank = (fraction * ascending.len() as f64).ceil() as usize;
    ascending.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}
