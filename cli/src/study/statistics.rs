use serde::Serialize;

/// How numbers spread: each of them is one of the numbers.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Spread {
    pub q1: f64,
    pub median: f64,
    pub q3: f64,
    pub p95: f64,
    pub worst: f64,
}

impl Spread {
    /// Of at least one number.
    pub fn of(mut numbers: Vec<f64>) -> Self {
        numbers.sort_unstable_by(f64::total_cmp);
        let at = |share| quantile(&numbers, share);
        Self { q1: at(0.25), median: at(0.5), q3: at(0.75), p95: at(0.95), worst: at(1.0) }
    }
}

pub fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_unstable_by(f64::total_cmp);
    quantile(&numbers, 0.5)
}

/// The least of the numbers, which are in rising order, that this share of them does not exceed.
fn quantile(rising: &[f64], share: f64) -> f64 {
    let rank = (share * rising.len() as f64).ceil() as usize;
    rising.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}
