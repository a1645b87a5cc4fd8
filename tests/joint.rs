//! In: simulated stations with known truth. Out: whether the joint calibration is as good as it says, and as it must be.
//! Frame and unit: mm, rad, px.

mod common;

#[path = "joint/accuracy.rs"]
mod accuracy;
#[path = "joint/arm.rs"]
mod arm;
#[path = "joint/auto.rs"]
mod auto;
#[path = "joint/budget.rs"]
mod budget;
#[path = "joint/choice.rs"]
mod choice;
#[path = "joint/derivatives.rs"]
mod derivatives;
#[path = "joint/recordings.rs"]
mod recordings;
#[path = "joint/stations.rs"]
mod stations;
#[path = "joint/wrong.rs"]
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
