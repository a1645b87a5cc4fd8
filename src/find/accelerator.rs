//! In: a level and the places of a model's features at every turn. Out: the peaks of their sums, computed by WGSL stages;
//! the same numbers as the CPU's. Frame and unit: strided places of the level; a perfect feature scores 4.

use super::coarse::{Level, Placed};
use crate::fault::Result;
use crate::gpu::{Device, Pipeline, Recording, Replay};
use crate::stages::shape_frame::ShapeFrame;
use crate::stages::shape_maps::{QUANTISE, SPREAD};
use crate::stages::shape_sums::{PEAKS, Peak, SCORE};

/// A GPU with the stages of the coarse search.
#[derive(Clone)]
pub struct Accelerator {
    device: Device,
    quantise: Pipeline,
    spread: Pipeline,
    score: Pipeline,
    peaks: Pipeline,
    /// Additions from which a search is worth its submissions.
    pub least_additions: u64,
}

impl std::fmt::Debug for Accelerator {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Accelerator on {}", self.device.info.name)
    }
}

/// Sums of one submission, bytes: 64 MiB fits every adapter's smallest promised binding of 128 MiB.
const SUMS: usize = 64 << 20;
/// Hits of one submission.
const CAPACITY: u32 = 1 << 18;
/// Estimated, not measured on a GPU: submissions and readback cost about a millisecond, in which two cores add 2e7 bytes.
const LEAST_ADDITIONS: u64 = 50_000_000;

impl Accelerator {
    /// The best adapter if it is a GPU. A software adapter runs the sums on the very cores that the CPU's own
    /// code would use, so it is not taken.
    pub fn open() -> Option<Accelerator> {
        let device = Device::open().ok().filter(|d| d.info.kind != "CPU")?;
        Accelerator::on(&device).ok()
    }

    /// Any adapter, for tests and benches.
    pub fn on(device: &Device) -> Result<Accelerator> {
        Ok(Accelerator {
            device: device.clone(),
            quantise: QUANTISE.pipeline(device, &[])?,
            spread: SPREAD.pipeline(device, &[])?,
            score: SCORE.pipeline(device, &[])?,
            peaks: PEAKS.pipeline(device, &[])?,
            least_additions: LEAST_ADDITIONS,
        })
    }

    pub(super) fn pays(&self, frame: &ShapeFrame, placed: &[Vec<Placed>]) -> bool {
        let features: usize = placed.iter().map(Vec::len).sum();
        let fits = frame.plane() * 4 <= SUMS && frame.columns < 1 << 16 && frame.rows < 1 << 16;
        fits && features as u64 * u64::from(frame.columns * frame.rows) >= self.least_additions
    }

    /// The peaks in the order of turn, row, column; `None` where there are more than the list holds.
    pub(super) fn peaks(&self, level: &Level, placed: &[Vec<Placed>], least: u8) -> Result<Option<Vec<Peak>>> {
        let device = &self.device;
        let mut frame = level.frame;
        frame.features = placed.first().map_or(0, |p| p.len() as u32);
        frame.least = u32::from(least);
        frame.capacity = CAPACITY;
        let plane = frame.plane();
        let each = (SUMS / (4 * plane)).min(4096).max(1);
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
