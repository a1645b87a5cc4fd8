//! In: the layout of a batch. Out: the chain's dispatches as recordings, and the buffers they share.
//! Frame and unit: bytes, words. Order and reasons: docs/math.md, Stripe stages.

use super::config::ChainConfig;
use super::part::{Part, whole};
use crate::fault::Result;
use crate::gpu::{Buffer, Device, Pipeline, Recording};
use crate::stages::frame::{PX_LOG2, px_log2};
use crate::stages::stripe::{ambient, lengthen, skeleton, specks, stats, thin, threshold, tiles};
use crate::stages::{Frame, Window, listing};

/// Sub-iterations in one round; a stripe 50 px wide takes 52. Wider ones go further rounds.
const STEPS: u32 = 56;
/// Sub-iterations before which the tile list is shortened: the ends of the sections of a round. The first time soon: most tiles of a noisy picture hold specks
/// that never change. Then at most 8 apart: what a change can travel in them stays within the neighbouring tiles,
/// which are 8 px high.
const SHORTEN: [u32; 8] = [2, 8, 16, 24, 32, 40, 48, STEPS];
/// Bytes from one uniform block, or one list's header, to the next; every adapter can bind there.
const STEP_BYTES: u64 = 256;

/// Buffers that all batches use one after the other.
pub struct Shared {
    uniforms: Buffer,
    stats: Buffer,
    roi: Buffer,
    /// The header of the list of tiles that stand alone, and the count of all that are listed; headers of other lists.
    first: Buffer,
    runs_first: Buffer,
    lit_first: Buffer,
    active: Buffer,
    singles: Buffer,
    runs: Buffer,
    lit_list: Buffer,
    active_list: Buffer,
    weights: Buffer,
    /// The Gaussian window's lit pixels before they are gathered into words.
    quads: Buffer,
    pub mask: Buffer,
    other_mask: Buffer,
    pub lit: Buffer,
    long: Buffer,
    stamps: Buffer,
    counts: Buffer,
    starts: Buffer,
    rows: Buffer,
    row_starts: Buffer,
    totals: Buffer,
    ambient: Option<Buffer>,
}

/// The chain's stages, compiled.
pub struct Pipelines {
    clear: Pipeline,
    reset: Pipeline,
    ambient: Pipeline,
    stats: Pipeline,
    tiles: Pipeline,
    specks: Pipeline,
    threshold: Pipeline,
    /// After the Gaussian window's threshold: the words of the mask.
    gather: Option<Pipeline>,
    thin: Pipeline,
    compact: Pipeline,
    rebase: Pipeline,
    copy: Pipeline,
    lengthen: Pipeline,
    count: Pipeline,
    scan_rows: Pipeline,
    scan_shots: Pipeline,
    head: Pipeline,
    skeleton: Pipeline,
}

impl Pipelines {
    pub fn new(device: &Device, config: &ChainConfig) -> Result<Pipelines> {
        let all = [
            (PX_LOG2, f64::from(px_log2(config.bits))),
            (threshold::RADIUS, f64::from(config.threshold.size / 2)),
            (tiles::WEIGHTED, f64::from(u8::from(config.threshold.window == Window::Gaussian))),
            (thin::RULE, f64::from(config.thinning.number())),
        ];
        let build = |stage: &crate::gpu::Stage| {
            let overrides: Vec<_> = all.into_iter().filter(|o| stage.overrides.contains(&o.0)).collect();
            stage.pipeline(device, &overrides)
        };
        Ok(Pipelines {
            clear: build(&listing::CLEAR)?,
            reset: build(&listing::RESET)?,
            ambient: build(&ambient::STAGE)?,
            stats: build(&stats::STAGE)?,
            tiles: build(&tiles::STAGE)?,
            specks: build(&specks::STAGE)?,
            threshold: build(match config.threshold.window {
                Window::Mean => &threshold::MEAN,
                Window::Gaussian => &threshold::GAUSSIAN,
            })?,
            gather: match config.threshold.window {
                Window::Mean => None,
                Window::Gaussian => Some(build(&threshold::GATHER)?),
            },
            thin: build(&thin::STAGE)?,
            compact: build(&listing::COMPACT)?,
            rebase: build(&listing::REBASE)?,
            copy: build(&lengthen::COPY)?,
            lengthen: build(&lengthen::STAGE)?,
            count: build(&skeleton::COUNT)?,
            scan_rows: build(&skeleton::SCAN_ROWS)?,
            scan_shots: build(&skeleton::SCAN_SHOTS)?,
            head: build(&skeleton::HEAD)?,
            skeleton: build(&skeleton::STAGE)?,
        })
    }
}

impl Shared {
    pub fn new(device: &Device, f: &Frame, config: &ChainConfig) -> Result<Shared> {
        let words = |label: &str, n: u32| device.storage(label, 4 * u64::from(n));
        let uniforms = device.storage("uniforms", STEP_BYTES * u64::from(STEPS + 1))?;
        for step in 0..=STEPS {
            device.write(&uniforms, STEP_BYTES * u64::from(step), bytemuck::bytes_of(&Frame { step, ..*f }));
        }
        let roi = words("region", config.region.as_ref().map_or(4, |_| f.tiles_x * f.tiles_y * 8))?;
        if let Some(region) = &config.region {
            device.write(&roi, 0, bytemuck::cast_slice(&f.pack_mask(region)));
        }
        let weights = words("weights", f.size)?;
        device.write(&weights, 0, bytemuck::cast_slice(&threshold::gaussian_weights(f.size)));
        let ambient = match &config.ambient {
            None => None,
            Some(image) => {
                let buffer = words("ambient", f.shot_words)?;
                let mut bytes = vec![0; f.image_bytes()];
                f.pack_image(image, &mut bytes).map_err(|e| e.at("ambient picture"))?;
                device.write(&buffer, 0, &bytes);
                Some(buffer)
            }
        };
        let rows = f.tiles_y * f.shots;
        let gaussian = config.threshold.window == Window::Gaussian;
        Ok(Shared {
            uniforms,
            stats: words("stats", 4 * f.tiles())?,
            roi,
            first: words("first list's header", 2 * listing::HEADER_WORDS)?,
            lit_first: words("lit list's header", listing::HEADER_WORDS)?,
            active: words("other lists' headers", listing::HEADER_WORDS * SHORTEN.len() as u32)?,
            runs_first: words("runs' header", listing::HEADER_WORDS)?,
            singles: words("singles", 2 * f.tiles())?,
            runs: words("runs", 2 * f.tiles())?,
            lit_list: words("lit list", f.tiles())?,
            active_list: words("active list", f.tiles())?,
            weights,
            quads: words("quads", if gaussian { 8 * f.tiles() } else { 4 })?,
            mask: words("mask", f.mask_words())?,
            other_mask: words("other mask", f.mask_words())?,
            lit: words("lit", f.mask_words())?,
            long: words("long", f.mask_words())?,
            stamps: words("stamps", f.tiles())?,
            counts: words("counts", f.tiles())?,
            starts: words("starts", f.tiles())?,
            rows: words("rows", rows)?,
            row_starts: words("row starts", rows)?,
            totals: words("totals", f.shots)?,
            ambient,
        })
    }

    /// The uniform block of a sub-iteration.
    fn step(&self, step: u32) -> Part<'_> {
        (&self.uniforms, STEP_BYTES * u64::from(step), size_of::<Frame>() as u64)
    }
    /// How many tiles are listed, where a header counts.
    fn all(&self) -> Part<'_> {
        (&self.first, STEP_BYTES, 16)
    }
    /// The header of the list of tiles that stand alone.
    fn alone(&self) -> Part<'_> {
        (&self.first, 0, 16)
    }
    /// The header of the list of tiles that are.
    fn lit(&self) -> Part<'_> {
        (&self.lit_first, 0, 16)
    }
    /// All headers, to be emptied.
    fn headers(&self) -> [Part<'_>; 4] {
        [whole(&self.first), whole(&self.lit_first), whole(&self.runs_first), whole(&self.active)]
    }
    /// The header of the list of runs of tiles.
    fn run(&self) -> Part<'_> {
        (&self.runs_first, 0, 16)
    }
    /// The header of the list after `n` shortenings, n >= 1.
    fn shortened(&self, n: u32) -> Part<'_> {
        (&self.active, STEP_BYTES * u64::from(n - 1), 16)
    }

    /// What is done to the pictures where they lie, once: a batch that starts over must not do it again.
    pub fn prepare(&self, device: &Device, f: &Frame, p: &Pipelines, image: &Buffer) -> Recording {
        let mut r = Recording::default();
        if let Some(a) = &self.ambient {
            r.dispatch_parts(device, &p.ambient, &[self.step(0), whole(image), whole(a)], ambient::groups(f));
        }
        r
    }

    /// From the pictures to the mask.
    pub fn front(&self, device: &Device, f: &Frame, p: &Pipelines, image: &Buffer) -> Recording {
        let mut r = Recording::default();
        let zero = self.step(0);
        let masks = [whole(&self.mask), whole(&self.other_mask), whole(&self.lit)];
        let [mask, other, lit] = masks;
        let clear =
            [zero, self.lit(), whole(&self.lit_list), mask, other, lit, whole(&self.stamps), whole(&self.counts)];
        r.indirect(device, &p.clear, &clear, (&self.lit_first, 0));
        let [first, lit_first, runs, active] = self.headers();
        r.dispatch_parts(device, &p.reset, &[zero, first, lit_first, runs, active], [1, 1, 1]);
        r.dispatch_parts(device, &p.stats, &[zero, whole(image), whole(&self.stats)], stats::groups(f));
        let (image, roi) = (whole(image), whole(&self.roi));
        let (singles, runs) = (whole(&self.singles), whole(&self.runs));
        let tiles = [zero, whole(&self.stats), roi, self.all(), self.alone(), singles, self.run(), runs];
        r.dispatch_parts(device, &p.tiles, &tiles, tiles::groups(f));
        let (lit_header, lit_list) = (self.lit(), whole(&self.lit_list));
        match &p.gather {
            None => {
                let out = [roi, mask, lit, lit_header, lit_list];
                let bindings = [&[zero, image, self.alone(), singles], &out[..], &[self.run(), runs]].concat();
                r.indirect(device, &p.specks, &bindings, (&self.first, 0));
                let bindings = [&[zero, image, self.run(), runs], &out[..]].concat();
                r.indirect(device, &p.threshold, &bindings, (&self.runs_first, 0));
            }
            Some(gather) => {
                let quads = whole(&self.quads);
                let weights = whole(&self.weights);
                let (header, args) = (self.alone(), (&self.first, 0));
                r.indirect(device, &p.threshold, &[zero, image, header, singles, weights, quads], args);
                let bindings = [zero, header, singles, quads, roi, mask, lit, lit_header, lit_list];
                r.indirect(device, gather, &bindings, args);
            }
        }
        r
    }

    /// One round of thinning, in sections that end with a shortened list.
    pub fn thinning(&self, device: &Device, p: &Pipelines) -> Vec<Recording> {
        let stamps = whole(&self.stamps);
        let begins = std::iter::once(0).chain(SHORTEN);
        (0..)
            .zip(begins.zip(SHORTEN))
            .map(|(n, (begin, end))| {
                let mut r = Recording::default();
                let (header, list, args) = match n {
                    0 => (self.lit(), &self.lit_list, (&self.lit_first, 0)),
                    n => (self.shortened(n), &self.active_list, (&self.active, self.shortened(n).1)),
                };
                for step in begin..end {
                    let (from, to) =
                        if step % 2 == 0 { (&self.mask, &self.other_mask) } else { (&self.other_mask, &self.mask) };
                    let bindings = [self.step(step), header, whole(list), whole(from), whole(to), stamps];
                    r.indirect(device, &p.thin, &bindings, args);
                }
                let list = whole(&self.lit_list);
                let bindings =
                    [self.step(end), self.lit(), list, stamps, self.shortened(n + 1), whole(&self.active_list)];
                r.indirect(device, &p.compact, &bindings, (&self.lit_first, 0));
                r
            })
            .collect()
    }

    /// Between two rounds of thinning.
    pub fn restart(&self, device: &Device, p: &Pipelines) -> Recording {
        let mut r = Recording::default();
        let rebase = [self.step(STEPS), self.lit(), whole(&self.lit_list), whole(&self.stamps)];
        r.indirect(device, &p.rebase, &rebase, (&self.lit_first, 0));
        let [first, lit_first, runs, active] = self.headers();
        r.dispatch_parts(device, &p.reset, &[self.step(1), first, lit_first, runs, active], [1, 1, 1]);
        r
    }

    /// From the thinned mask to the list of points.
    pub fn back(
        &self,
        device: &Device,
        f: &Frame,
        p: &Pipelines,
        image: &Buffer,
        header: &Buffer,
        points: &Buffer,
    ) -> Recording {
        let mut r = Recording::default();
        let (zero, lit, list) = (self.step(0), self.lit(), whole(&self.lit_list));
        let all = (&self.lit_first, 0);
        let mask = if f.lengthen == 0 {
            whole(&self.mask)
        } else {
            let (thin, long) = (whole(&self.mask), whole(&self.long));
            r.indirect(device, &p.copy, &[zero, lit, list, thin, long], all);
            let bindings = [zero, whole(image), lit, list, thin, whole(&self.lit), long];
            r.indirect(device, &p.lengthen, &bindings, all);
            long
        };
        r.indirect(device, &p.count, &[zero, lit, list, mask, whole(&self.counts)], all);
        let (starts, rows) = (whole(&self.starts), whole(&self.rows));
        r.dispatch_parts(device, &p.scan_rows, &[zero, whole(&self.counts), starts, rows], skeleton::rows_groups(f));
        let (row_starts, totals, header) = (whole(&self.row_starts), whole(&self.totals), whole(header));
        let shots = skeleton::shots_groups(f);
        r.dispatch_parts(device, &p.scan_shots, &[zero, rows, row_starts, totals], shots);
        r.dispatch_parts(device, &p.head, &[zero, totals, self.all(), whole(&self.active), header], shots);
        r.indirect(device, &p.skeleton, &[zero, lit, list, mask, starts, row_starts, header, whole(points)], all);
        r
    }
}
