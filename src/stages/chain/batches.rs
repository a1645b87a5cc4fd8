//! In: pictures, a batch at a time. Out: the skeleton pixels of each, from the GPU, in order; peaks and points if they
//! are measured. Frame and unit: pixels. The pruned chain: statistics, tile list, threshold, thinning, list.

use super::config::ChainConfig;
use super::measured::{Measuring, POSE_BYTES};
use super::recorded::Recorded;
use crate::fault::{Fault, Result};
use crate::gpu::{Device, PART, Recording, Replay, Ring, RingSizes, StageTime};
use crate::raster::{Image, Mask};
use crate::stages::Frame;
use crate::stages::frame::{ALL_TILES, HAS_ROI};
use crate::stages::peak::found::Peak;
use crate::stages::stripe::point::Point;
use crate::stages::stripe::skeleton;

/// The chain on one GPU for one size and depth of pictures. `T` is returned to the caller with each batch.
pub struct Chain<T = u64> {
    /// Layout and settings of a batch.
    pub frame: Frame,
    device: Device,
    ring: Ring<InFlight<T>>,
    replay: Replay,
    runs: Runs,
    /// Sections of thinning that were needed so far; 0 before the first batch, which gets a whole round.
    needed: usize,
    /// Further whole rounds that every batch gets; grows if stripes are wider than these reach.
    rounds: usize,
    /// The header of the batch that was collected last.
    header: Vec<u32>,
    recorded: Recorded,
    /// Byte offset of the poses in the input, if points are measured.
    poses: Option<usize>,
    /// Rows of a picture that are written at a time, and the sizes in bytes of all such parts of the input.
    band: u32,
    parts: Vec<usize>,
}

/// A batch in flight.
struct InFlight<T> {
    tag: T,
    shots: u32,
    /// Sections of the first round of thinning that were recorded for it.
    sections: usize,
}

/// The chain's work as separate recordings.
struct Runs {
    /// Work that is done once per batch, work up to its mask, and work from the thinned mask on; one recording each per
    /// slot.
    prepare: Vec<Recording>,
    front: Vec<Recording>,
    back: Vec<Recording>,
    /// A round of thinning in sections, and the work before a further round.
    thinning: Vec<Recording>,
    restart: Recording,
}

impl Runs {
    /// Records all work. `measuring` has the stages that measure points, and the offset of the poses, if points are
    /// measured.
    fn record<T>(
        device: &Device,
        frame: &Frame,
        recorded: &Recorded,
        ring: &Ring<InFlight<T>>,
        measuring: Option<(&Measuring, u64)>,
    ) -> Runs {
        let mut runs = Runs {
            prepare: Vec::new(),
            front: Vec::new(),
            thinning: recorded.thinning(device, frame),
            restart: recorded.restart(device, frame),
            back: Vec::new(),
        };
        for slot in &ring.slots {
            let pixels = measuring.map_or(&slot.outputs[0].buffer, |(m, _)| &m.pixels);
            let own = [("image", &slot.input), ("header", &slot.header), ("pixels", pixels)];
            runs.prepare.push(recorded.prepare(device, frame, &own));
            runs.front.push(recorded.front(device, frame, &own));
            let mut back = recorded.back(device, frame, &own);
            if let Some((m, poses)) = measuring {
                let poses = (&slot.input, poses, POSE_BYTES * u64::from(frame.shots));
                let [peaks, points] = [0, 1].map(|i| &slot.outputs[i].buffer);
                back.append(&m.record(device, &slot.input, poses, &slot.header, peaks, points));
            }
            runs.back.push(back);
        }
        runs
    }

    /// The work of one batch: this many sections of thinning, then further whole rounds.
    fn of(&self, at: usize, upload: bool, sections: usize, rounds: usize) -> Vec<&Recording> {
        let mut work = Vec::new();
        work.extend(upload.then_some(&self.prepare[at]));
        work.push(&self.front[at]);
        work.extend(&self.thinning[..sections]);
        for _ in 0..rounds {
            work.push(&self.restart);
            work.extend(&self.thinning);
        }
        work.push(&self.back[at]);
        work
    }
}

/// The result of one batch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch<T = u64> {
    /// The value given at submission.
    pub tag: T,
    /// Skeleton pixels x | y << 16, and the shot within the batch; empty if peaks are measured.
    pub pixels: Vec<[u32; 2]>,
    /// One peak for each skeleton pixel, if peaks are measured.
    pub peaks: Vec<Peak>,
    /// One point for each peak, mm in the poses' frame; NaN if the peak was rejected.
    pub points: Vec<Point>,
    /// Index of the first skeleton pixel of every shot, and the end; its peak and point have the same index.
    pub starts: Vec<u32>,
    /// Number of skeleton pixels found; more than `pixels` or `peaks` contains if the list was full.
    pub found: u32,
    /// Number of tiles that could not be proven dark.
    pub listed_tiles: u32,
}

impl<T> Batch<T> {
    /// Skeleton pixels of one shot.
    pub fn pixels_of(&self, shot: usize) -> impl Iterator<Item = u32> {
        self.pixels[self.starts[shot] as usize..self.starts[shot + 1] as usize].iter().map(|p| p[0])
    }
}

impl<T> Chain<T> {
    /// Compiles the stages and makes every buffer. `Err` if settings are out of range or too large for the device.
    pub fn new(device: &Device, config: &ChainConfig) -> Result<Chain<T>> {
        if !(1..=64).contains(&config.shots) || !(1..=8).contains(&config.slots) {
            return Err(Fault::usage(format!(
                "{} shots a batch and {} batches in flight; 1 to 64 and 1 to 8 are possible",
                config.shots, config.slots
            ))
            .next("correct the number of shots and batches"));
        }
        let mut frame = Frame::new(config.width, config.height, config.bits, config.shots, &config.threshold)?;
        frame.flags |= if config.prune { 0 } else { ALL_TILES };
        frame.lengthen = config.lengthen;
        frame.spacing = config.spacing;
        frame.flags |= if config.region.is_some() { HAS_ROI } else { 0 };
        let recorded = Recorded::new(device, &frame, config)?;
        let measuring = match &config.measure {
            Some(m) => Some(Measuring::new(device, &frame, config.bits, m)?),
            None => None,
        };
        // The poses follow the pictures, at an offset at which every adapter can bind.
        let poses = (frame.image_bytes() as u64 * u64::from(frame.shots)).next_multiple_of(256);
        let input = poses + measuring.as_ref().map_or(0, |_| POSE_BYTES * u64::from(frame.shots));
        let ring = Ring::new(
            device,
            RingSizes {
                slots: config.slots,
                input,
                header: 4 * (skeleton::HEADER as u64 + u64::from(frame.shots) + 1),
                outputs: match &measuring {
                    Some(_) => Measuring::output_bytes(&frame),
                    None => vec![u64::from(frame.capacity) * 8],
                },
            },
        )?;
        let (band, parts) = parts(&frame, input);
        let runs = Runs::record(device, &frame, &recorded, &ring, measuring.as_ref().map(|m| (m, poses)));
        Ok(Chain {
            frame,
            device: device.clone(),
            replay: Replay::new(device, config.timed)?,
            ring,
            runs,
            needed: 0,
            rounds: 0,
            header: vec![0; skeleton::HEADER + frame.shots as usize + 1],
            recorded,
            poses: measuring.is_some().then_some(poses as usize),
            band,
            parts,
        })
    }

    /// The GPU that the chain runs on.
    pub fn device(&self) -> &Device {
        &self.device
    }
    /// Whether a batch can be submitted without waiting for one to finish.
    pub fn has_room(&self) -> bool {
        self.ring.has_room()
    }
    /// Number of batches that were submitted and not yet collected.
    pub fn in_flight(&self) -> usize {
        self.ring.in_flight()
    }
    /// Starts a batch of 1 to `shots` pictures. Panics if there is no room: call `collect` first.
    pub fn submit(&mut self, tag: T, images: &[&Image]) -> Result<()> {
        self.submit_posed(tag, images, &[])
    }

    /// Like `submit`, with the shots' poses ([`crate::stages::stripe::point::pose_words`]), which a chain that measures
    /// needs.
    pub fn submit_posed(&mut self, tag: T, images: &[&Image], poses: &[[f32; 12]]) -> Result<()> {
        assert!(self.poses.is_none() || poses.len() == images.len(), "one pose a picture");
        assert!((1..=self.frame.shots as usize).contains(&images.len()), "1 to {} pictures a batch", self.frame.shots);
        let (frame, band, parts) = (self.frame, self.band, &self.parts);
        // Bytes between the last picture's end and the poses.
        let gap = self.poses.map(|at| at - frame.image_bytes() * frame.shots as usize);
        let bands = frame.height.div_ceil(band) as usize;
        let fill = |i: usize, put: &mut dyn FnMut(usize, &[u8])| {
            let top = (i % bands) as u32 * band;
            match images.get(i / bands) {
                _ if i == parts.len() - 1 => {
                    if let Some(gap) = gap {
                        put(gap, bytemuck::cast_slice(poses));
                    }
                }
                Some(image) => frame.put_rows(image, top..(top + band).min(frame.height), put)?,
                // A picture left from an earlier batch must not be evaluated again.
                None => {
                    let dark = [0u8; 4096];
                    for from in (0..parts[i]).step_by(dark.len()) {
                        put(from, &dark[..dark.len().min(parts[i] - from)]);
                    }
                }
            }
            Ok(())
        };
        let flight = InFlight { tag, shots: images.len() as u32, sections: self.sections() };
        let sections = flight.sections;
        let at = self.ring.fill(parts, &fill, flight)?;
        self.run(at, true, sections)
    }

    /// Like `submit_posed`, with the pictures and poses that the next slot was last filled with: work without an
    /// upload, to measure the device alone. The ambient light is not subtracted a second time.
    pub fn submit_again(&mut self, tag: T, shots: u32) -> Result<()> {
        let sections = self.sections();
        let at = self.ring.keep(InFlight { tag, shots, sections })?;
        self.run(at, false, sections)
    }

    /// The oldest batch if it is done; waits for it if `wait` is set. `None` if no batch is in flight, or it is not
    /// done.
    pub fn collect(&mut self, wait: bool) -> Result<Option<Batch<T>>>
    where
        T: Default,
    {
        let mut batch = Batch::default();
        Ok(self.collect_into(wait, &mut batch)?.then_some(batch))
    }

    /// Like `collect`, into a batch whose memory is reused: in the steady state nothing is allocated. False if there is
    /// no batch.
    pub fn collect_into(&mut self, wait: bool, batch: &mut Batch<T>) -> Result<bool> {
        let shots = loop {
            let Some((at, flight)) = self.ring.oldest(wait, &mut self.header)? else { return Ok(false) };
            let (left, given) = (self.header[skeleton::LEFT] as usize, flight.sections);
            if left < given {
                self.needed = self.needed.max(left + 1);
                break flight.shots as usize;
            }
            // Some stripe needs more sub-iterations than were done. Another batch may have used the masks since then,
            // so this batch starts over with more of them. All later batches also get more.
            self.needed = self.runs.thinning.len();
            flight.sections = self.needed;
            if given == self.runs.thinning.len() {
                self.rounds = 2 * self.rounds + 1;
            }
            self.run(at, false, self.needed)?;
        };
        let header = &self.header;
        batch.starts.clear();
        batch.starts.extend_from_slice(&header[skeleton::HEADER..=skeleton::HEADER + shots]);
        (batch.found, batch.listed_tiles) = (header[skeleton::FOUND], header[skeleton::LISTED]);
        let n = u64::from(header[skeleton::HEADER + shots]);
        let flight = if self.poses.is_some() {
            batch.pixels.clear();
            let bytes = [n * size_of::<Peak>() as u64, n * size_of::<Point>() as u64];
            self.ring.finish(&bytes, |i, bytes| match i {
                0 => bytes.refill(&mut batch.peaks),
                _ => bytes.refill(&mut batch.points),
            })?
        } else {
            batch.peaks.clear();
            batch.points.clear();
            self.ring.finish(&[8 * n], |_, bytes| bytes.refill(&mut batch.pixels))?
        };
        batch.tag = flight.tag;
        Ok(true)
    }

    /// Sections of the first round for the next batch: as many as any batch needed so far. Empty dispatches cost 10 us
    /// each on a software adapter. It costs less to start one batch over than to give all others more sections.
    fn sections(&self) -> usize {
        match (self.needed, self.rounds) {
            (0, _) | (_, 1..) => self.runs.thinning.len(),
            (needed, _) => needed,
        }
    }

    fn run(&mut self, at: usize, upload: bool, sections: usize) -> Result<()> {
        let work = self.runs.of(at, upload, sections, self.rounds);
        self.ring.run(at, &mut self.replay, &work, upload)
    }

    /// The thinned mask of a shot of the batch that ran last; for tests and pictures, not for scanning.
    pub fn mask(&self, shot: u32) -> Result<Mask> {
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&self.device.read(self.recorded.buffer("mask"))?);
        Ok(self.frame.unpack_mask(&words, shot))
    }
    /// Like `mask`, before thinning.
    pub fn lit(&self, shot: u32) -> Result<Mask> {
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&self.device.read(self.recorded.buffer("lit"))?);
        Ok(self.frame.unpack_mask(&words, shot))
    }

    /// GPU time of every step of the last submitted batch; empty unless `timed` is set and the adapter has timestamps.
    pub fn times(&self) -> Result<Vec<StageTime>> {
        self.replay.times()
    }
}

/// Rows of a picture that are written at a time, and the sizes in bytes of all such parts of the input. The last part
/// contains the poses.
fn parts(f: &Frame, input: u64) -> (u32, Vec<usize>) {
    let row = 4 * f.pitch as usize;
    let band = (PART / row).clamp(1, f.height as usize);
    let bands = (0..f.height as usize).step_by(band).map(|top| row * band.min(f.height as usize - top));
    let mut parts: Vec<usize> = (0..f.shots).flat_map(|_| bands.clone()).collect();
    parts.push(input as usize - parts.iter().sum::<usize>());
    (band as u32, parts)
}
