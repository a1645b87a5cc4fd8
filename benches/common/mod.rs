//! In: some work, figures of its rounds. Out: what the work cost; a figure's median.
//! Frame and unit: seconds; the caller's.

use sheetlight::fault::Result;
use std::time::Instant;

/// Wall time, and what a clock of CPU time counts, s.
pub fn cost(cpu: impl Fn() -> f64, work: impl FnOnce() -> Result<()>) -> Result<[f64; 2]> {
    let (before, start) = (cpu(), Instant::now());
    work()?;
    Ok([start.elapsed().as_secs_f64(), cpu() - before])
}

/// Of a figure of every round.
pub fn median<T>(rounds: &[T], of: impl Fn(&T) -> f64) -> f64 {
    let mut values: Vec<f64> = rounds.iter().map(of).collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
