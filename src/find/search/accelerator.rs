//! In: a level and the positions of a model's features at every turn. Out: the peaks of their sums, computed by WGSL
//! stages; the same numbers as the CPU's.
//! Frame and unit: strided places of the level; a perfect feature scores 4.

use super::level::{Level, Placed};
use crate::fault::{Fault, Result};
use crate::gpu::{Device, Pipeline, Recording, Replay};
use crate::stages::shape::frame::ShapeFrame;
use crate::stages::shape::maps::{QUANTISE, SPREAD};
use crate::stages::shape::sums::{PEAKS, Peak, SCORE};

/// A GPU with the stages of the coarse search.
#[derive(Clone)]
pub struct Accelerator {
    device: Device,
    quantise: Pipeline,
    spread: Pipeline,
    score: Pipeline,
    peaks: Pipeline,
    /// Decides whether a search runs on the GPU; `None`: every search that fits.
    pub rule: Option<Rule>,
}

/// What a search costs on the GPU and on the CPU, measured on this machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// Submissions and readback of one search, s.
    pub fixed_s: f64,
    /// One addition of a feature's response to a place's sum on the GPU, s.
    pub here_s: f64,
    /// The same addition on the CPU, s.
    pub cpu_s: f64,
}

impl Rule {
    /// Whether a search with this number of additions takes no longer on the GPU than on the CPU.
    pub fn pays(&self, additions: u64) -> bool {
        self.fixed_s + self.here_s * additions as f64 <= self.cpu_s * additions as f64
    }
}

impl std::fmt::Debug for Accelerator {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Accelerator on {}", self.device.info.name)
    }
}

/// Size of the sums of one submission, bytes: 64 MiB fits every adapter's smallest guaranteed binding of 128 MiB.
const SUMS: usize = 64 << 20;
/// Most hits of one submission.
const CAPACITY: u32 = 1 << 18;
/// Level and turns with which the rule is measured: 320 x 320 cells give 6400 places, 32 features a turn.
const TRIAL: usize = 320;
const TRIAL_FEATURES: usize = 32;
const TRIAL_TURNS: [usize; 2] = [8, 72];
const TRIAL_RUNS: usize = 3;
const TRIAL_ROUNDS: usize = 4;

impl Accelerator {
    /// The best adapter if it is a GPU, with the rule measured on this machine. A software adapter would run the sums
    /// on the same cores as the CPU's own code: it is not even measured.
    pub fn open() -> Option<Accelerator> {
        let device = Device::open().ok().filter(|d| d.info.kind != "CPU")?;
        let mut accelerator = Accelerator::on(&device).ok()?;
        accelerator.rule = Some(accelerator.measured().ok()?);
        Some(accelerator)
    }

    /// Any adapter, used for every search that fits: for tests and benches.
    pub fn on(device: &Device) -> Result<Accelerator> {
        Ok(Accelerator {
            device: device.clone(),
            quantise: QUANTISE.pipeline(device, &[])?,
            spread: SPREAD.pipeline(device, &[])?,
            score: SCORE.pipeline(device, &[])?,
            peaks: PEAKS.pipeline(device, &[])?,
            rule: None,
        })
    }

    pub(in crate::find) fn pays(&self, frame: &ShapeFrame, placed: &[Vec<Placed>]) -> bool {
        let features: usize = placed.iter().map(Vec::len).sum();
        let fits = frame.plane() * 4 <= SUMS && frame.columns < 1 << 16 && frame.rows < 1 << 16;
        fits && self.rule.is_none_or(|r| r.pays(features as u64 * u64::from(frame.columns * frame.rows)))
    }

    /// Times the same small searches on the GPU and on the CPU. On the GPU, the slope is an addition's cost and the
    /// rest is fixed; on the CPU nothing is fixed.
    pub fn measured(&self) -> Result<Rule> {
        let level = Level::trial(TRIAL);
        let placed = TRIAL_TURNS.map(|turns| Level::trial_turns(turns, TRIAL_FEATURES));
        // No sum reaches this: only the additions are timed, not the peaks of a pattern.
        const LEAST: u8 = u8::MAX;
        self.peaks(&level, &placed[0], LEAST)?;
        let best = |work: &dyn Fn() -> Result<()>| -> Result<f64> {
            let mut least = f64::MAX;
            for _ in 0..TRIAL_RUNS {
                let start = std::time::Instant::now();
                work()?;
                least = least.min(start.elapsed().as_secs_f64());
            }
            Ok(least)
        };
        let places = f64::from(level.frame.columns * level.frame.rows);
        let additions = TRIAL_TURNS.map(|t| (t * TRIAL_FEATURES) as f64 * places);
        let cpu_s = best(&|| {
            drop(level.peaks(&placed[1], LEAST));
            Ok(())
        })? / additions[1];
        // If more work took no longer, or so much longer that no fixed cost remains, something else occupied the
        // processors.
        for _ in 0..TRIAL_ROUNDS {
            let few = best(&|| self.peaks(&level, &placed[0], LEAST).map(drop))?;
            let many = best(&|| self.peaks(&level, &placed[1], LEAST).map(drop))?;
            let here_s = (many - few) / (additions[1] - additions[0]);
            let fixed_s = few - here_s * additions[0];
            if here_s > 0.0 && fixed_s > 0.0 {
                return Ok(Rule { fixed_s, here_s, cpu_s });
            }
        }
        let times = additions[1] / additions[0];
        Err(Fault::device(format!("what {times} times the work costs makes no sense, {TRIAL_ROUNDS} times in turn"))
            .cause("other programs keep the GPU busy")
            .next("search on the CPU, or wait until the GPU is free"))
    }

    /// The peaks in the order of turn, row, column; `None` where there are more than the list holds.
    pub(in crate::find) fn peaks(&self, level: &Level, placed: &[Vec<Placed>], least: u8) -> Result<Option<Vec<Peak>>> {
        let device = &self.device;
        let mut frame = level.frame;
        frame.features = placed.first().map_or(0, |p| p.len() as u32);
        frame.least = u32::from(least);
        frame.capacity = CAPACITY;
        let plane = frame.plane();
        let each = (SUMS / (4 * plane)).clamp(1, 4096);
        frame.turns = each.min(placed.len()) as u32;
        let cells = (frame.width * frame.height) as usize;
        let (layers, words) = (level.slopes.len(), frame.layer_words());
        let responses = device.storage("responses", 4 * (layers * words) as u64)?;
        let mut maps = Recording::default();
        for (k, slopes) in level.slopes.iter().enumerate() {
            let uniform = device.storage("frame", size_of::<ShapeFrame>() as u64)?;
            frame.first = (k * words) as u32;
            device.write(&uniform, 0, bytemuck::bytes_of(&frame));
            let input = device.storage("slopes", 4 * cells as u64)?;
            device.write(&input, 0, bytemuck::cast_slice(slopes));
            let bits = device.storage("bits", 4 * cells as u64)?;
            let groups = |n: usize, y: u32| [n.div_ceil(64) as u32, y, 1];
            maps.dispatch(device, &self.quantise, &[&uniform, &input, &bits], groups(cells, 1));
            maps.dispatch(device, &self.spread, &[&uniform, &bits, &responses], groups(plane, 16));
        }
        let mut replay = Replay::new(device, false)?;
        replay.run(&[&maps])?;
        let uniform = device.storage("frame", size_of::<ShapeFrame>() as u64)?;
        let features = device.storage("features", u64::from(frame.turns * frame.features) * 16)?;
        let sums = device.storage("sums", 4 * (plane * frame.turns as usize) as u64)?;
        let header = device.storage("header", 16)?;
        let hits = device.storage("hits", 8 * u64::from(CAPACITY))?;
        let mut found = Vec::new();
        for (chunk, turns) in placed.chunks(each).enumerate() {
            frame.turns = turns.len() as u32;
            let list: Vec<[i32; 4]> =
                turns.iter().flatten().map(|p| frame.feature(p.layer, p.want, p.dx, p.dy)).collect();
            device.write(&uniform, 0, bytemuck::bytes_of(&frame));
            device.write(&features, 0, bytemuck::cast_slice(&list));
            device.write(&header, 0, &[0; 16]);
            let groups = [plane.div_ceil(64) as u32, frame.turns, 1];
            let mut sweep = Recording::default();
            sweep.dispatch(device, &self.score, &[&uniform, &responses, &features, &sums], groups);
            sweep.dispatch(device, &self.peaks, &[&uniform, &sums, &header, &hits], groups);
            replay.run(&[&sweep])?;
            let head: Vec<u32> = bytemuck::pod_collect_to_vec(&device.read(&header)?);
            if head[3] > CAPACITY {
                return Ok(None);
            }
            let words: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&device.read(&hits)?);
            let first = (chunk * each) as u32;
            found.extend(words[..head[3] as usize].iter().map(|&w| {
                let peak = Peak::unpack(w);
                Peak { turn: peak.turn + first, ..peak }
            }));
        }
        found.sort_unstable();
        Ok(Some(found))
    }
}
