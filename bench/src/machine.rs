//! The machine that measures.

use std::time::{SystemTime, UNIX_EPOCH};

use serde::Serialize;

/// Machine, date and version of a measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    pub processor: String,
    pub cores: usize,
    pub instructions: &'static str,
    /// Year-month-day in UTC.
    pub date: String,
    pub version: &'static str,
}

impl Machine {
    pub fn here() -> Self {
        Self {
            processor: processor(),
            cores: cores(),
            instructions: instructions(),
            date: date(),
            version: env!("CARGO_PKG_VERSION"),
        }
    }

    /// One line without commas, for CSV.
    pub fn description(&self) -> String {
        let Self { processor, cores, instructions, .. } = self;
        format!("{processor}; {cores} cores; {instructions}").replace([',', '"', '\n'], " ")
    }
}

pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Model of the processor on Linux, its architecture elsewhere.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find(|line| line.starts_with("model name")).and_then(|line| line.split_once(": "));
    model.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, model)| model.trim().to_owned())
}

/// Widest instruction set of the processor that sdftool uses.
fn instructions() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx512f") {
            return "AVX-512";
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            return "AVX2";
        }
    }
    std::env::consts::ARCH
}

fn date() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let [year, month, day] = civil_date(seconds / 86_400);
    format!("{year:04}-{month:02}-{day:02}")
}

/// Date of a day counted from 1970-01-01 (Hinnant 2013, "chrono-compatible low-level date algorithms").
fn civil_date(days: u64) -> [u64; 3] {
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let from_march = (5 * day_of_year + 2) / 153;
    let month = if from_march < 10 { from_march + 3 } else { from_march - 9 };
    let year = 400 * era + year_of_era + u64::from(month <= 2);
    [year, month, day_of_year - (153 * from_march + 2) / 5 + 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_day_of_400_years_follows_the_one_before() {
        let is_leap = |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
        let mut expected = [1970, 1, 1];
        for day in 0..146_097 {
            assert_eq!(civil_date(day), expected);
            let lengths = [31, 28 + u64::from(is_leap(expected[0])), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
            let [year, month, day] = expected;
            expected = match (day < lengths[month as usize - 1], month < 12) {
                (true, _) => [year, month, day + 1],
                (false, true) => [year, month + 1, 1],
                (false, false) => [year + 1, 1, 1],
            };
        }
    }
}
