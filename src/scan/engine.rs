//! In: pictures in order with their poses. Out: their peaks, each accepted or rejected, and their points, in the
//! same order. The work runs on the GPU or on this machine's processor, with the same results.
//! Frame and unit: peaks in pixels and grey levels, points in the poses' frame, mm.

use super::pieces::long_pieces;
use super::{Along, Ambient, Extraction, Format, Place, Processor, Why};
use crate::camera::Intrinsics;
use crate::fault::Result;
use crate::geometry::{Camera, Plane};
use crate::gpu::Device;
use crate::raster::{HotPixels, Image, Mask};
use crate::stages::chain::batches::{Batch, Chain};
use crate::stages::chain::config::ChainConfig;
use crate::stages::host::Host;
use crate::stages::peak::found::Peak;
use crate::stages::peak::{self, Stripe};
use crate::stages::stripe::ambient;
use crate::stages::stripe::point::{Optics, Point, plane_in_view, pose_words};
use rayon::prelude::*;
use std::borrow::Cow;

/// The peaks of one shot and their points: entry i of one belongs to entry i of the other.
pub struct Measured {
    /// Index of the shot, as submitted.
    pub shot: u32,
    /// Pose of the camera, as submitted.
    pub place: Place,
    /// All peaks, including rejected ones; px and grey levels.
    pub peaks: Vec<Peak>,
    /// Points in the cloud's frame, mm; NaN where the peak was rejected.
    pub points: Vec<Point>,
}

/// One picture to process.
struct Job {
    shot: u32,
    place: Place,
    image: Image,
}

/// What the engine needs to know of the rig: where in the picture the laser can appear, and where its points lie.
pub struct Optical {
    /// Camera at the resolution of the pictures; px.
    pub camera: Intrinsics,
    /// The sheet of light, camera frame, mm.
    pub laser: Plane<Camera>,
    /// Nearest and farthest credible camera depth, mm.
    pub depth_mm: [f64; 2],
}

/// What a batch carries through the chain for each picture: its index and the pose of the camera.
type Posed = (u32, Place);

/// What some pictures show of the stripe.
pub struct StripeSeen {
    /// Medians over the pictures.
    pub stripe: Stripe,
    /// Pixels of the sensor that are bright without light.
    pub hot: HotPixels,
    /// Whether half of the pictures show a long piece of the stripe.
    pub enough: bool,
}

impl StripeSeen {
    /// A stripe that was not measured.
    pub fn assumed(stripe: Stripe) -> StripeSeen {
        StripeSeen { stripe, hot: HotPixels::default(), enough: false }
    }
}

/// A piece of the stripe serves to measure its width if its length is at least this share of the picture's extent
/// along the stripe. Beside a part a scan sees only splinters of light at its edges.
const LONG_PIECE: f32 = 0.1;

/// The implementation that does the work. It is built when the stripe is known, because its buffer sizes depend on
/// the stripe.
enum Way {
    Gpu(Box<Chain<Vec<Posed>>>),
    Host(Box<Host>),
}

/// The per-pixel work of a scan.
pub struct Engine {
    format: Format,
    region: Mask,
    ambient: Option<Ambient>,
    optics: Optics,
    /// The settings as requested, and those adapted to the stripe.
    asked: Extraction,
    extraction: Extraction,
    width_px: f32,
    hot: HotPixels,
    pending: Vec<Job>,
    /// `None` runs on this machine's processor; `why` holds the reason.
    device: Option<Device>,
    why: Why,
    way: Option<Way>,
    /// Pictures started together, and batches in flight; `None`: chosen from the pictures' size.
    at_once: Option<(u32, usize)>,
    /// The batch that was collected last; its memory is reused.
    batch: Batch<Vec<Posed>>,
    done: Vec<Measured>,
    cut: u64,
}

/// Least number of shots that the processor works on together. It uses as many as it has threads, and enough for the
/// shots' ends to overlap.
const HOST_BATCH: usize = 4;
/// Above this size in pixels three pictures suffice to measure the stripe: each has thousands of peaks.
const LARGE_PIXELS: u32 = 2_000_000;

impl Engine {
    /// `ambient` is subtracted from every picture.
    pub fn new(
        format: Format,
        optical: &Optical,
        extraction: &Extraction,
        ambient: Option<Ambient>,
        processor: Processor,
    ) -> Engine {
        let (device, why) = match processor {
            Processor::Host(why) => (None, why),
            Processor::Gpu(device) => (Some(device), Why::Asked),
        };
        Engine {
            format,
            region: believed(format, optical, extraction),
            ambient,
            optics: Optics::new(&optical.camera, &optical.laser),
            width_px: extraction.peak.width_px,
            asked: extraction.clone(),
            extraction: extraction.clone(),
            hot: HotPixels::default(),
            pending: Vec::new(),
            device,
            why,
            way: None,
            at_once: None,
            batch: Batch::default(),
            done: Vec::new(),
            cut: 0,
        }
    }

    /// Starts every picture alone, and the next when it is done: least delay instead of the highest rate of shots.
    pub fn one_at_a_time(mut self) -> Engine {
        self.at_once = Some((1, 1));
        self
    }

    /// The pictures' longer side, px. It does not depend on how the camera is turned.
    pub fn longer_side(&self) -> u32 {
        self.format.width.max(self.format.height)
    }

    /// Skeleton pixels that did not fit into the GPU's list, which holds a twentieth of the pictures' pixels.
    pub fn cut(&self) -> u64 {
        self.cut
    }

    /// Adapter and driver, or this machine's processor with the reason for it.
    pub fn ran_on(&self) -> String {
        match &self.device {
            Some(d) => format!("{}, {}", d.info.name, d.info.driver),
            None => format!("CPU, {} threads ({})", rayon::current_num_threads(), self.why),
        }
    }

    /// The GPU, if the stages run on one.
    pub fn device(&self) -> Option<&Device> {
        self.device.as_ref()
    }

    /// Noise, width and speckle of the stripe, the median over some pictures; `None` if no picture shows enough of
    /// it. If some pictures show a long piece, only those count: light that falls over an edge is narrower than the
    /// stripe.
    pub fn measure(&self, images: &[&Image]) -> Option<StripeSeen> {
        let few = self.format.width * self.format.height > LARGE_PIXELS && images.len() > 3;
        let step = if few { images.len() / 3 } else { 1 };
        let images: Vec<_> = images.iter().step_by(step).collect();
        let images: Vec<_> = images.par_iter().map(|image| self.lit(image)).collect();
        // Levels of one exposure, as all settings are.
        let span = self.asked.peak.levels.span;
        let mut noise: Vec<f32> = images.par_iter().map(|image| span * peak::noise(image)).collect();
        noise.sort_by(f32::total_cmp);
        let noise = *noise.get(noise.len() / 2)?;
        let seen = self.asked.clone().in_noise(noise);
        let host = Host::new(&ChainConfig { ambient: None, measure: None, ..self.config(&seen) }).ok()?;
        let long = LONG_PIECE * self.along_px();
        let across = self.optics.across();
        let skeleton = |image: &Cow<Image>| host.run(0, image, &[0.0; 12]).ok().map(|found| found.pixels);
        let skeletons: Vec<Option<Vec<u32>>> = images.par_iter().map(skeleton).collect();
        let stripe = |(image, pixels): (&Cow<Image>, &Option<Vec<u32>>)| {
            let pixels = pixels.as_ref()?;
            let stripe = |pixels: &[u32]| peak::measure(image, pixels, &seen.peak, across, peak::CLEAR);
            let lines = || brightest(image, long_pieces(pixels, across.perp(), long));
            Some((pixels.len() as f32 >= long, of_the_line(pixels, lines, stripe)?))
        };
        let mut found: Vec<(bool, Stripe)> = images.par_iter().zip(&skeletons).filter_map(stripe).collect();
        if found.is_empty() {
            // All pictures are dim. Noise has no long pieces.
            let dim = |(image, pixels): (&Cow<Image>, &Option<Vec<u32>>)| {
                let lines = long_pieces(pixels.as_ref()?, across.perp(), long);
                Some((true, peak::measure(image, &lines, &seen.peak, across, peak::DIM)?))
            };
            found = images.par_iter().zip(&skeletons).filter_map(dim).collect();
        }
        let telling = found.iter().filter(|f| f.0).count();
        let mut found: Vec<Stripe> = found.into_iter().filter(|f| f.0 || telling == 0).map(|f| f.1).collect();
        let middle = found.len() / 2;
        let mut median = |of: fn(&Stripe) -> f32| {
            found.sort_by(|a, b| of(a).total_cmp(&of(b)));
            found.get(middle).map(of)
        };
        let width_px = median(|s| s.width_px)?;
        let speckle = median(|s| s.speckle)?;
        let [read_noise, gain] = [median(|s| s.read_noise.unwrap_or(0.0)), median(|s| s.gain.unwrap_or(0.0))];
        let [grain_px, grain_factor] = [median(|s| s.grain_px)?, median(|s| s.grain_factor)?];
        let stripe = Stripe { width_px, speckle, grain_px, grain_factor, noise, read_noise, gain };
        let hot = HotPixels::find(&images.iter().map(|i| &**i).collect::<Vec<_>>(), noise, span);
        Some(StripeSeen { stripe, hot, enough: 2 * telling >= images.len() })
    }

    /// Length of a stripe that crosses the searched region, px.
    pub fn along_px(&self) -> f32 {
        let [x, y] = self.optics.across().to_array();
        let [left, top, right, bottom] = self.asked.region_px(self.format);
        (right - left) as f32 * y.abs() + (bottom - top) as f32 * x.abs()
    }

    /// Adopts a stripe: sets the sizes of the fit, the least window of the threshold and the limits above the noise.
    /// Builds the GPU's chain or the processor's. Batches in flight are collected before.
    pub fn set_stripe(&mut self, stripe: &Stripe) -> Result<()> {
        self.width_px = stripe.width_px;
        self.extraction = self.asked.clone().for_stripe(stripe);
        self.extraction.peak.check()?;
        self.build()
    }

    /// In pictures submitted from now on, each of these pixels is replaced by its neighbours along the stripe.
    pub fn set_hot(&mut self, hot: HotPixels) {
        self.hot = hot;
    }

    /// The chain's settings for an extraction; they are the same with and without a GPU.
    fn config(&self, e: &Extraction) -> ChainConfig {
        ChainConfig {
            region: Some(self.region.clone()),
            ambient: self.ambient.as_ref().map(|a| a.image.clone()),
            ..e.chain(self.format, self.optics, self.width_px)
        }
    }

    /// Builds the chain for the present settings.
    fn build(&mut self) -> Result<()> {
        let config = self.config(&self.extraction);
        self.way = Some(match &self.device {
            None => Way::Host(Box::new(Host::new(&config)?)),
            Some(device) => {
                let usual = config.on(device);
                let (shots, slots) = self.at_once.unwrap_or((usual.shots, usual.slots));
                Way::Gpu(Box::new(Chain::new(device, &ChainConfig { shots, slots, ..usual })?))
            }
        });
        Ok(())
    }

    /// Takes a picture and the pose of the camera.
    pub fn submit(&mut self, shot: u32, mut image: Image, place: Place) -> Result<()> {
        self.hot.fill(&mut image, Along::crossed(self.optics.across()).step());
        self.pending.push(Job { shot, place, image });
        let usual = match &self.way {
            Some(Way::Gpu(chain)) => chain.frame.shots as usize,
            _ => rayon::current_num_threads().max(HOST_BATCH),
        };
        let full = self.at_once.map_or(usual, |(shots, _)| shots as usize);
        if self.pending.len() >= full { self.start() } else { Ok(()) }
    }

    /// Shots that are done, in order; with `all` it waits for everything in flight.
    pub fn collect(&mut self, all: bool) -> Result<Vec<Measured>> {
        if all && !self.pending.is_empty() {
            self.start()?;
        }
        while let Some(Way::Gpu(chain)) = &mut self.way
            && chain.collect_into(all, &mut self.batch)?
        {
            self.take();
        }
        Ok(std::mem::take(&mut self.done))
    }

    /// Processes the pending pictures: the GPU starts them, the processor completes them.
    fn start(&mut self) -> Result<()> {
        if self.way.is_none() {
            self.build()?;
        }
        let jobs = std::mem::take(&mut self.pending);
        match self.way.as_mut().expect("it was built") {
            Way::Host(host) => {
                let one = |job: &Job| -> Result<Measured> {
                    let found = host.run(job.shot, &job.image, &pose_words(&job.place.from_camera))?;
                    Ok(Measured { shot: job.shot, place: job.place, peaks: found.peaks, points: found.points })
                };
                let done: Result<Vec<_>> = jobs.par_iter().map(one).collect();
                self.done.extend(done?);
            }
            Way::Gpu(chain) => {
                let waited = !chain.has_room() && chain.collect_into(true, &mut self.batch)?;
                let images: Vec<_> = jobs.iter().map(|j| &j.image).collect();
                let poses: Vec<_> = jobs.iter().map(|j| pose_words(&j.place.from_camera)).collect();
                let posed = jobs.iter().map(|j| (j.shot, j.place)).collect();
                chain.submit_posed(posed, &images, &poses)?;
                if waited {
                    self.take();
                }
            }
        }
        Ok(())
    }

    /// Splits the batch that was collected last into its shots.
    fn take(&mut self) {
        let batch = &self.batch;
        self.cut += u64::from(batch.found) - batch.peaks.len() as u64;
        for (i, &(shot, place)) in batch.tag.iter().enumerate() {
            let part = batch.starts[i] as usize..batch.starts[i + 1] as usize;
            let mut peaks = batch.peaks[part.clone()].to_vec();
            // The GPU numbers the shots within the batch.
            peaks.iter_mut().for_each(|k| k.shot = shot);
            self.done.push(Measured { shot, place, peaks, points: batch.points[part].to_vec() });
        }
    }

    /// The picture with the ambient light subtracted.
    fn lit<'a>(&self, image: &'a Image) -> Cow<'a, Image> {
        self.ambient.as_ref().map_or(Cow::Borrowed(image), |a| Cow::Owned(ambient::without(image, &a.image)))
    }
}

/// Widths of all pieces and of the lines that differ by more than this factor are not of the same light.
const OTHER_WIDTH: f32 = 1.5;
/// A line's pixels have at least this share of the level that a tenth of them exceeds. Scattered light is weaker.
const BRIGHT: f32 = 0.5;

/// The stripe that `measure` finds in the skeleton; in its lines alone, if it finds another width there. Spots and
/// scattered light of a shiny part can have more skeleton pixels than the stripe: their skeletons branch.
fn of_the_line(
    pixels: &[u32],
    lines: impl Fn() -> Vec<u32>,
    measure: impl Fn(&[u32]) -> Option<Stripe>,
) -> Option<Stripe> {
    let all = measure(pixels)?;
    let lines = lines();
    // Another width needs other light: at least a quarter of the pixels.
    if 4 * lines.len() > 3 * pixels.len() {
        return Some(all);
    }
    let ratio = |of_lines: &Stripe| (of_lines.width_px / all.width_px).max(all.width_px / of_lines.width_px);
    Some(measure(&lines).filter(|of_lines| ratio(of_lines) > OTHER_WIDTH).unwrap_or(all))
}

/// The bright ones of these pixels.
fn brightest(image: &Image, mut pixels: Vec<u32>) -> Vec<u32> {
    let level = |p: &u32| image.get(p & 0xffff, p >> 16);
    let mut levels: Vec<u16> = pixels.iter().map(level).collect();
    levels.sort_unstable();
    if let Some(&bright) = levels.get(levels.len() * 9 / 10) {
        pixels.retain(|p| f32::from(level(p)) >= BRIGHT * f32::from(bright));
    }
    pixels
}

/// Size in pixels of a block whose corners are examined first: as wide as a word of a mask.
const BLOCK: (u32, u32) = (32, 16);
/// Least distance of the corners' depths from a limit, as a share of the limit, for the whole block to lie on their
/// side of it. Inverse depth is linear over the picture except for lens distortion, which within a block is far
/// smaller than this.
const CLEAR: f64 = 1e-3;

/// Pixels that are searched: where the laser plane lies within the credible depths, inside the region that the user
/// chose.
fn believed(format: Format, o: &Optical, extraction: &Extraction) -> Mask {
    let mut mask = region(format, o);
    let [left, top, right, bottom] = extraction.region_px(format);
    if [left, top, right, bottom] != [0, 0, format.width, format.height] {
        let inside = |x: u32, y: u32| (left..right).contains(&x) && (top..bottom).contains(&y);
        mask.intersect(&Mask::from_fn(format.width, format.height, inside));
    }
    mask
}

/// Pixels at which the laser plane lies within the credible depths. Other pixels are not processed.
fn region(format: Format, o: &Optical) -> Mask {
    let (w, h) = (format.width, format.height);
    let [near, far] = o.depth_mm;
    let depth = |x: u32, y: u32| plane_in_view(&o.camera, &o.laser, x, y);
    let inside = |x: u32, y: u32| depth(x, y).is_some_and(|z| (near..=far).contains(&z));
    // Inverting the lens distortion takes a microsecond a pixel, and nearly all blocks lie wholly inside or outside.
    let block = |x: u32, y: u32| -> Option<bool> {
        let (right, below) = ((x + BLOCK.0 - 1).min(w - 1), (y + BLOCK.1 - 1).min(h - 1));
        let corners = [depth(x, y)?, depth(right, y)?, depth(x, below)?, depth(right, below)?];
        let all = |test: &dyn Fn(f64) -> bool| corners.iter().all(|&z| z > 0.0 && test(z));
        if all(&|z| z > near * (1.0 + CLEAR) && z < far * (1.0 - CLEAR)) {
            Some(true)
        } else if all(&|z| z < near * (1.0 - CLEAR)) || all(&|z| z > far * (1.0 + CLEAR)) {
            Some(false)
        } else {
            None
        }
    };
    let rows = |band: u32| {
        let (top, bottom) = (band * BLOCK.1, ((band + 1) * BLOCK.1).min(h));
        let blocks: Vec<Option<bool>> = (0..w.div_ceil(BLOCK.0)).map(|i| block(i * BLOCK.0, top)).collect();
        let word = move |y: u32, left: u32, of_block: Option<bool>| {
            let bits = (left..(left + BLOCK.0).min(w)).enumerate();
            bits.fold(0, |word, (bit, x)| word | u32::from(of_block.unwrap_or_else(|| inside(x, y))) << bit)
        };
        (top..bottom).flat_map(move |y| {
            let words = (0..).step_by(BLOCK.0 as usize).zip(blocks.clone());
            words.map(move |(left, of_block)| word(y, left, of_block))
        })
    };
    Mask { width: w, height: h, words: (0..h.div_ceil(BLOCK.1)).into_par_iter().flat_map_iter(rows).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn the_region_is_the_same_block_by_block_and_pixel_by_pixel() {
        // A common lens and one with strong distortion, a sheet across the picture and one along a diagonal; a size
        // that is no multiple of the block.
        for (k, normal) in [(-0.118, [-0.019, 0.883, 0.469]), (-0.31, [0.55, 0.6, 0.58])] {
            let camera = Intrinsics {
                fx: 611.6,
                fy: 611.6,
                cx: 314.9,
                cy: 232.3,
                skew: 0.0,
                distortion: [k, 0.086, 0.00062, -0.00041, -0.017].into(),
                width: 641,
                height: 479,
            };
            let laser = Plane::new(Vec3::from(normal), 72.15).unwrap();
            let o = Optical { camera, laser, depth_mm: [110.0, 190.0] };
            let found = region(Format { width: 641, height: 479, bits: 8 }, &o);
            let exact = Mask::from_fn(641, 479, |x, y| {
                plane_in_view(&camera, &laser, x, y).is_some_and(|z| (110.0..=190.0).contains(&z))
            });
            let lit = exact.words.iter().map(|w| w.count_ones()).sum::<u32>();
            assert!((10_000..300_000).contains(&lit), "{lit} pixels: not both sides are seen");
            assert!(found == exact);
        }
    }
}
