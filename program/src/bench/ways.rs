//! In: a device, if there is one. Out: the time of a shot through the whole chain, as `scan` runs it, measured in
//! turns on this machine's processor and on the device. Frame and unit: ms a shot, median of the turns.

use super::machine;
use super::run::scan_chain;
use super::scenes::{Scene, pictures};
use super::steady::percentile;
use rayon::prelude::*;
use sheetlight::fault::Result;
use sheetlight::gpu::Device;
use sheetlight::raster::Image;
use sheetlight::stages::cases;
use sheetlight::stages::chain::batches::{Batch, Chain};
use sheetlight::stages::chain::config::ChainConfig;
use sheetlight::stages::host::Host;
use std::time::Instant;

/// The time of the chain on one processor or device.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct WayTime {
    /// The processor with its number of threads, or the device's name.
    pub on: String,
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Wall time, median of the turns.
    pub ms_per_shot: f64,
    /// CPU time of all threads; on a software adapter it includes the GPU's work.
    pub cpu_ms_per_shot: Option<f64>,
}

/// A picture size, the same view at twice the resolution, and a large one.
pub(super) const SIZES: [(u32, u32); 3] = [(640, 480), (1280, 960), (2048, 1536)];
const TURNS: usize = 5;

/// Times of both at three sizes, one clean stripe.
pub fn way_times(device: Option<&Device>) -> Result<Vec<WayTime>> {
    let mut found = Vec::new();
    for (width, height) in SIZES {
        let config = scan_chain(width, height, Scene::OneStripe, 2.0);
        let config = device.map_or(config.clone(), |d| config.on(d));
        let images = pictures(Scene::OneStripe, width, height, config.shots.min(8));
        let batch: Vec<&Image> = (0..config.shots as usize).map(|i| &images[i % images.len()]).collect();
        let poses: Vec<_> = (0..config.shots).map(cases::pose).collect();
        let host = Host::new(&config)?;
        let mut chain = device.map(|d| Chain::new(d, &ChainConfig { slots: 1, ..config.clone() })).transpose()?;
        let mut out = Batch::default();
        let name = format!("CPU, {} threads", rayon::current_num_threads());
        let names = std::iter::once(name).chain(device.map(|d| d.info.name.clone()));
        for (way, on) in names.enumerate() {
            let (mut walls, mut cpus) = (Vec::new(), Vec::new());
            // The first turn compiles and touches all memory.
            for turn in 0..=TURNS {
                let (cpu, start) = (machine::cpu_seconds(), Instant::now());
                match &mut chain {
                    Some(chain) if way == 1 => {
                        chain.submit_posed(0, &batch, &poses)?;
                        chain.collect_into(true, &mut out)?;
                    }
                    _ => {
                        let done: Result<Vec<_>> =
                            batch.par_iter().zip(&poses).map(|(image, pose)| host.run(0, image, pose)).collect();
                        done?;
                    }
                }
                if turn > 0 {
                    walls.push(start.elapsed().as_secs_f64());
                    cpus.extend(cpu.and_then(|c| Some(machine::cpu_seconds()? - c)));
                }
            }
            let shots = f64::from(config.shots);
            let cpu_ms_per_shot = (!cpus.is_empty()).then(|| percentile(&mut cpus, 0.5) / shots);
            found.push(WayTime {
                on,
                width,
                height,
                ms_per_shot: percentile(&mut walls, 0.5) / shots,
                cpu_ms_per_shot,
            });
        }
    }
    Ok(found)
}
