//! In: simulated stations with known truth. Out: whether the joint calibration is as good as it says, and as it must
//! be.
//! Frame and unit: mm, rad, px.

mod accuracy;
mod arm;
mod auto;
mod budget;
mod choice;
mod derivatives;
mod stations;
mod wrong;

/// Stations a test looks at: all of what must hold with SHEETLIGHT_LONG=1, else so many.
fn seeds(short: u64) -> std::ops::RangeInclusive<u64> {
    let long = std::env::var("SHEETLIGHT_LONG").is_ok_and(|v| v == "1");
    1..=if long { 20 } else { short }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (s, n) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    f64::sqrt(s / n)
}
