//! In: a chain and pictures. Out: its times in steady state.
//! Frame and unit: seconds.

use super::machine;
use sheetlight::fault::Result;
use sheetlight::raster::Image;
use sheetlight::stages::chain::batches::{Batch, Chain};
use sheetlight::stages::{ThresholdParams, Window};
use std::time::Instant;

/// OpenCV's definition, four sigmas above the scenes' background noise.
pub(super) const THRESHOLD: ThresholdParams = ThresholdParams { window: Window::Mean, size: 31, offset: 8, minimum: 0 };

/// Percentile of times in seconds, as ms.
pub(super) fn percentile(times: &mut [f64], p: f64) -> f64 {
    times.sort_by(f64::total_cmp);
    1e3 * times[((times.len() - 1) as f64 * p).round() as usize]
}

/// Results of a run in steady state.
pub(super) struct Steady {
    pub shots: usize,
    pub ms_per_shot: f64,
    pub cpu_ms_per_shot: Option<f64>,
    /// Skeleton pixels per shot.
    pub points: f64,
    pub listed: f64,
}

/// Keeps every slot of the ring busy for `seconds`.
pub(super) fn steady<'a>(
    chain: &mut Chain,
    seconds: f64,
    batch_of: &impl Fn(usize) -> Vec<&'a Image>,
    poses: &[[f32; 12]],
) -> Result<Steady> {
    let per = chain.frame.shots as usize;
    let (mut n, mut shots, mut points, mut listed) = (0usize, 0usize, 0u64, 0u64);
    let (mut per_batch, mut batch) = (Vec::new(), Batch::default());
    let cpu = machine::cpu_seconds();
    let start = Instant::now();
    let mut last = start;
    while start.elapsed().as_secs_f64() < seconds || per_batch.len() < 3 {
        while chain.has_room() {
            chain.submit_posed(n as u64, &batch_of(n), poses)?;
            n += 1;
        }
        chain.collect_into(true, &mut batch)?;
        shots += per;
        points += u64::from(batch.found);
        listed += u64::from(batch.listed_tiles);
        per_batch.push(last.elapsed().as_secs_f64());
        last = Instant::now();
    }
    while chain.collect_into(true, &mut batch)? {
        shots += per;
    }
    let batches = per_batch.len() as f64;
    Ok(Steady {
        shots,
        ms_per_shot: percentile(&mut per_batch, 0.5) / per as f64,
        cpu_ms_per_shot: cpu.and_then(|c| Some(1e3 * (machine::cpu_seconds()? - c) / shots as f64)),
        points: points as f64 / (batches * per as f64),
        listed: listed as f64 / batches,
    })
}
