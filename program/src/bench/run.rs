//! In: options. Out: one row for each size and scene: time a shot, throughput, shares of the bandwidth limits,
//! latency, memory, stage times. Frame and unit: stated at the fields.

use super::machine::{self, Ceilings};
use super::rows::{Latency, Row, Soak, Stage};
use super::scaling::{self, Scaling};
use super::scenes::{Scene, pictures};
use super::steady::{THRESHOLD, percentile, steady};
use sheetlight::fault::{Fault, Result};
use sheetlight::gpu::{AdapterInfo, Device};
use sheetlight::raster::Image;
use sheetlight::scan::{Extraction, Format};
use sheetlight::stages::cases;
use sheetlight::stages::chain::batches::{Batch, Chain};
use sheetlight::stages::chain::config::ChainConfig;
use sheetlight::stages::peak::params::PeakParams;
use sheetlight::stages::peak::{self, Stripe};
use std::collections::VecDeque;
use std::time::Instant;

/// Options of a bench run.
#[derive(Clone, Debug)]
pub struct BenchOptions {
    /// Picture sizes, px.
    pub sizes: Vec<(u32, u32)>,
    /// Scenes; each is measured at every size.
    pub scenes: Vec<Scene>,
    /// Seconds per row, 0.1..=600; longer runs give steadier results.
    pub seconds: f64,
    /// Shots per row of a long run of the full chain that is checked for growing memory; 0: no such run.
    pub soak: usize,
    /// Also measure pictures of one size with an increasing share of bright pixels.
    pub lit_shares: bool,
}

impl Default for BenchOptions {
    fn default() -> Self {
        BenchOptions {
            sizes: vec![(640, 480), (1280, 960), (4096, 3072), (5120, 5120)],
            scenes: Scene::ALL.to_vec(),
            seconds: 2.0,
            soak: 0,
            lit_shares: true,
        }
    }
}

impl BenchOptions {
    /// Refuses `seconds` out of range, and empty lists of sizes or scenes.
    pub fn check(&self) -> Result<()> {
        if !(0.1..=600.0).contains(&self.seconds) {
            return Err(Fault::usage(format!("{} seconds a row, 0.1 to 600 are possible", self.seconds))
                .next("correct the option"));
        }
        if self.sizes.is_empty() || self.scenes.is_empty() {
            return Err(
                Fault::usage("0 sizes or 0 scenes to measure, 1 or more needed").next("give at least one of each")
            );
        }
        Ok(())
    }
}

/// Results of one bench run.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Report {
    /// Version of this program.
    pub version: &'static str,
    /// The device that was measured.
    pub adapter: AdapterInfo,
    /// Number of threads that this machine offers.
    pub threads: usize,
    /// Bandwidth limits of memory and upload.
    pub ceilings: Ceilings,
    /// One row for each size and scene.
    pub rows: Vec<Row>,
    /// Growth of the time per shot with the number of pixels, for scenes measured at two or more sizes.
    pub with_pixels: Vec<Scaling>,
    /// Growth of the time per shot with the share of bright pixels, if requested.
    pub with_light: Option<Scaling>,
}

/// Measures on the given device. `progress` receives a description of each row when it begins.
pub fn run(device: &Device, options: &BenchOptions, mut progress: impl FnMut(&str)) -> Result<Report> {
    options.check()?;
    let ceilings = Ceilings::measure(Some(device))?;
    let mut rows = Vec::new();
    for &(width, height) in &options.sizes {
        for &scene in &options.scenes {
            progress(&format!("{width}x{height}, {}", scene.name()));
            rows.push(row(device, width, height, scene, options, &ceilings)?);
        }
    }
    let with_pixels = scaling::with_pixels(&rows);
    let with_light = if options.lit_shares {
        progress("more and more light");
        Some(scaling::with_light(device, options.seconds / 2.0)?)
    } else {
        None
    };
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let (version, adapter) = (env!("CARGO_PKG_VERSION"), device.info.clone());
    Ok(Report { version, adapter, threads, ceilings, rows, with_pixels, with_light })
}

fn row(
    device: &Device,
    width: u32,
    height: u32,
    scene: Scene,
    options: &BenchOptions,
    ceilings: &Ceilings,
) -> Result<Row> {
    let before = device.allocated_bytes();
    let config = ChainConfig { threshold: THRESHOLD, ..ChainConfig::new(width, height, 8).on(device) };
    let images = pictures(scene, width, height, (2 * config.shots).clamp(3, 16));
    let refs: Vec<&Image> = images.iter().collect();
    let batch_of =
        |n: usize| -> Vec<&Image> { (0..config.shots as usize).map(|i| refs[(n + i) % refs.len()]).collect() };
    let mut chain = Chain::new(device, &config)?;
    let gpu_memory = device.allocated_bytes() - before;
    // Compiles every pipeline and touches every memory page.
    for n in 0..3 {
        chain.submit(n, &batch_of(n as usize))?;
    }
    while chain.collect(true)?.is_some() {}

    let steady = steady(&mut chain, options.seconds, &batch_of, &[])?;
    let (cpu_ms, ms_per_shot) = (steady.cpu_ms_per_shot, steady.ms_per_shot);
    let device_ms_per_shot = resident(&mut chain, options.seconds / 4.0)?;

    // The full chain runs in turns with the skeleton alone, so that both see the same machine conditions. It is
    // skipped for the noise-heavy scene, where every speck would be measured, unlike in a scan.
    let full = if scene == Scene::NoiseHeavy {
        None
    } else {
        Some(full_chain(device, &config, scene, &mut chain, &batch_of, options)?)
    };

    let latency = latency(device, &config, &refs, options.seconds / 2.0)?;
    let soak = if options.soak == 0 { None } else { soak(device, &config, scene, &batch_of, options.soak)? };

    let px = f64::from(width) * f64::from(height);
    let tiles = f64::from(chain.frame.tiles());
    let listed = steady.listed / tiles;
    let bytes_per_px = bytes_per_px(listed);
    let mpx = px / (ms_per_shot * 1e3);
    let share_of_memory = match ceilings.device_gb_s {
        None => 1e-3 * mpx * bytes_per_px / ceilings.read_all_gb_s,
        // One byte per pixel is written by the upload, not by the stages.
        Some(own) => 1e-6 * px / device_ms_per_shot * (bytes_per_px - 1.0) / own,
    };
    Ok(Row {
        width,
        height,
        scene,
        shots_per_batch: config.shots,
        shots: steady.shots,
        ms_per_shot,
        full_ms_per_shot: full.map(|f| f.ms_per_shot),
        full_over_skeleton: full.map(|f| f.over_skeleton),
        device_ms_per_shot,
        full_device_ms_per_shot: full.map(|f| f.device_ms_per_shot),
        shots_per_s: 1e3 / ms_per_shot,
        mpx_per_s: mpx,
        cpu_ms_per_shot: cpu_ms,
        cpu_over_plain_read: cpu_ms.map(|ms| ms * 1e-3 / (px / (ceilings.read_gb_s * 1e9))),
        bytes_per_px,
        share_of_memory,
        share_of_upload: ceilings.upload_gb_s.map(|u| mpx * 1e6 / 1e9 / u),
        points_per_shot: steady.points,
        listed,
        latency,
        gpu_memory_mb: gpu_memory as f64 / 1e6,
        soak,
        host_peak_mb: machine::peak_memory_bytes().map(|b| b as f64 / 1e6),
        stages: stage_times(device, &config, &batch_of(0))?,
    })
}

/// Latency of single shots with nothing else in flight, measured for `seconds`.
fn latency(device: &Device, config: &ChainConfig, images: &[&Image], seconds: f64) -> Result<Latency> {
    let mut single = Chain::new(device, &ChainConfig { shots: 1, slots: 1, ..config.clone() })?;
    single.submit(0, &images[..1])?;
    single.collect(true)?;
    let (mut waits, mut batch) = (Vec::new(), Batch::default());
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < seconds || waits.len() < 5 {
        let one = Instant::now();
        single.submit(0, &images[waits.len() % images.len()..][..1])?;
        single.collect_into(true, &mut batch)?;
        waits.push(one.elapsed().as_secs_f64());
    }
    Ok(Latency { p50_ms: percentile(&mut waits.clone(), 0.5), p99_ms: percentile(&mut waits, 0.99) })
}

/// Bytes per pixel that the stages move through memory if this share of the tiles is listed.
fn bytes_per_px(listed: f64) -> f64 {
    // Per pixel: written at upload, read once by the statistics. Per tile: 32 bytes of statistics, written, and read
    // by 3 x 5 blocks from the cache. Per listed tile: its surroundings and masks.
    2.0 + 64.0 / 256.0 + listed * (62.0 * 38.0 / 256.0 + 1.0)
}

/// Time per shot, ms, for pictures that are in the ring's slots from an earlier run, with every slot busy.
fn resident(chain: &mut Chain, seconds: f64) -> Result<f64> {
    let shots = chain.frame.shots;
    let (mut per_batch, mut batch) = (Vec::new(), Batch::default());
    let start = Instant::now();
    let mut last = start;
    while start.elapsed().as_secs_f64() < seconds || per_batch.len() < 3 {
        while chain.has_room() {
            chain.submit_again(0, shots)?;
        }
        chain.collect_into(true, &mut batch)?;
        per_batch.push(last.elapsed().as_secs_f64());
        last = Instant::now();
    }
    while chain.collect_into(true, &mut batch)? {}
    Ok(percentile(&mut per_batch, 0.5) / f64::from(shots))
}

/// The settings that `scan` would use for pictures of a scene whose dark pixels scatter by `noise` grey levels.
pub fn scan_chain(width: u32, height: u32, scene: Scene, noise: f32) -> ChainConfig {
    let width_px = scene.width_px();
    let stripe = Stripe { width_px, speckle: PeakParams::default().speckle, noise, ..Stripe::default() };
    let optics = scene.optics(width, height);
    Extraction::default().for_stripe(&stripe).chain(Format { width, height, bits: 8 }, optics, width_px)
}

/// The chain with peaks, their selection and points, with the settings of a scan; and poses for a batch.
fn full(device: &Device, config: &ChainConfig, scene: Scene, image: &Image) -> Result<(Chain, Vec<[f32; 12]>)> {
    let scan = scan_chain(config.width, config.height, scene, peak::noise(image));
    let chain = Chain::new(device, &ChainConfig { shots: config.shots, slots: config.slots, ..scan })?;
    Ok((chain, (0..config.shots).map(cases::pose).collect()))
}

/// Times of the full chain.
#[derive(Clone, Copy)]
struct Full {
    ms_per_shot: f64,
    over_skeleton: f64,
    device_ms_per_shot: f64,
}

/// Time per shot of the full chain, and its ratio to the skeleton alone, in five turns.
fn full_chain<'a>(
    device: &Device,
    config: &ChainConfig,
    scene: Scene,
    skeleton: &mut Chain,
    batch_of: &impl Fn(usize) -> Vec<&'a Image>,
    options: &BenchOptions,
) -> Result<Full> {
    let (mut full, poses) = full(device, config, scene, batch_of(0)[0])?;
    steady(&mut full, 0.0, batch_of, &poses)?;
    let (mut times, mut ratios) = (Vec::new(), Vec::new());
    for _ in 0..5 {
        let with = steady(&mut full, options.seconds / 10.0, batch_of, &poses)?.ms_per_shot;
        let without = steady(skeleton, options.seconds / 10.0, batch_of, &[])?.ms_per_shot;
        times.push(with * 1e-3);
        ratios.push(with / without * 1e-3);
    }
    Ok(Full {
        ms_per_shot: percentile(&mut times, 0.5),
        over_skeleton: percentile(&mut ratios, 0.5),
        device_ms_per_shot: resident(&mut full, options.seconds / 4.0)?,
    })
}

/// Runs the full chain for this many shots and reads the memory of the process.
fn soak<'a>(
    device: &Device,
    config: &ChainConfig,
    scene: Scene,
    batch_of: &impl Fn(usize) -> Vec<&'a Image>,
    shots: usize,
) -> Result<Option<Soak>> {
    let (mut chain, poses) = full(device, config, scene, batch_of(0)[0])?;
    let mut batch = Batch::default();
    let batches = shots.div_ceil(config.shots as usize).max(10);
    let mut early = None;
    for n in 0..batches {
        if !chain.has_room() {
            chain.collect_into(true, &mut batch)?;
        }
        chain.submit_posed(n as u64, &batch_of(n), &poses)?;
        if n == batches / 10 {
            early = machine::resident_bytes();
        }
    }
    while chain.collect_into(true, &mut batch)? {}
    let mb = |bytes: u64| bytes as f64 / 1e6;
    Ok(early.zip(machine::resident_bytes()).map(|(early, late)| Soak {
        shots: batches * config.shots as usize,
        early_mb: mb(early),
        late_mb: mb(late),
    }))
}

/// GPU timestamps of one batch, the median of five, summed over the dispatches of a stage.
fn stage_times(device: &Device, config: &ChainConfig, batch: &[&Image]) -> Result<Vec<Stage>> {
    let mut chain = Chain::new(device, &ChainConfig { timed: true, ..config.clone() })?;
    let mut runs = VecDeque::new();
    for _ in 0..6 {
        chain.submit(0, batch)?;
        chain.collect(true)?;
        runs.push_back(chain.times()?);
    }
    runs.pop_front();
    let mut stages: Vec<Stage> = Vec::new();
    for i in 0..runs[0].len() {
        let mut times: Vec<f64> = runs.iter().map(|r| r[i].seconds).collect();
        let ms = percentile(&mut times, 0.5) / f64::from(config.shots);
        let name = runs[0][i].label;
        match stages.iter_mut().find(|s| s.name == name) {
            Some(s) => {
                s.ms_per_shot += ms;
                s.dispatches += 1;
            }
            None => stages.push(Stage { name: name.into(), ms_per_shot: ms, dispatches: 1 }),
        }
    }
    Ok(stages)
}
