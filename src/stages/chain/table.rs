//! In: the layout of a batch. Out: the chain as one table: its buffers, and its steps in order. The recording, the run
//! on the twins and the tests read it; the order is stated nowhere else. Reasons: docs/math.md, Stripe stages. Frame
//! and unit: words of 32 bits.

use crate::stages::Thinning;
use crate::stages::frame::{Frame, GAUSSIAN, HAS_ROI, PX_LOG2, px_log2};
use crate::stages::listing::{self, HEADER_WORDS};
use crate::stages::step::{Groups, Step};
use crate::stages::stripe::{ambient, lengthen, skeleton, spacing, specks, stats, thin, threshold, tiles};

/// The uniform block, a different one for each sub-iteration of thinning.
pub const FRAME: &str = "frame";

/// Sub-iterations in one round of thinning; a stripe 50 px wide needs 52. Wider stripes need further rounds.
pub const ROUND: u32 = 56;
/// Sub-iterations before which the tile list is shortened: the ends of the sections of a round. The first is early,
/// because most tiles of a noisy picture contain specks that never change. The others are at most 8 apart: within 8
/// sub-iterations a change can reach only the neighbouring tiles, which are 8 px high.
const SHORTEN: [u32; 8] = [2, 8, 16, 24, 32, 40, 48, ROUND];

/// Buffers that all batches use one after the other, and their sizes in words.
pub const BUFFERS: &[(&str, fn(&Frame) -> u32)] = &[
    ("ambient", |f| f.shot_words),
    ("stats", |f| 4 * f.tiles()),
    ("roi", |f| if f.flags & HAS_ROI != 0 { f.tiles_x * f.tiles_y * 8 } else { 4 }),
    ("weights", |f| f.size),
    ("single headers", |_| 2 * HEADER_WORDS),
    ("singles", |f| 2 * f.tiles()),
    ("run headers", |_| HEADER_WORDS),
    ("runs", |f| 2 * f.tiles()),
    ("lit headers", |_| HEADER_WORDS),
    ("lit list", |f| f.tiles()),
    ("active headers", |_| HEADER_WORDS * SHORTEN.len() as u32),
    ("active list", |f| f.tiles()),
    // The Gaussian window's lit pixels before they are gathered into words.
    ("quads", |f| if f.flags & GAUSSIAN != 0 { 8 * f.tiles() } else { 4 }),
    ("mask", Frame::mask_words),
    ("other mask", Frame::mask_words),
    ("lit", Frame::mask_words),
    ("long", Frame::mask_words),
    ("spaced", |f| if f.spacing != 0 { f.mask_words() } else { 4 }),
    ("stamps", Frame::tiles),
    ("counts", Frame::tiles),
    ("starts", Frame::tiles),
    ("rows", |f| f.tiles_y * f.shots),
    ("row starts", |f| f.tiles_y * f.shots),
    ("totals", |f| f.shots),
];

/// Headers of lists: name, buffer, and index of the first of their four words.
pub const HEADERS: &[(&str, &str, u32)] = &[
    ("single header", "single headers", 0),
    // Only its count is used: the number of all listed tiles.
    ("all header", "single headers", HEADER_WORDS),
    ("run header", "run headers", 0),
    ("lit header", "lit headers", 0),
    (SHORTENED[1], "active headers", 0),
    (SHORTENED[2], "active headers", HEADER_WORDS),
    (SHORTENED[3], "active headers", 2 * HEADER_WORDS),
    (SHORTENED[4], "active headers", 3 * HEADER_WORDS),
    (SHORTENED[5], "active headers", 4 * HEADER_WORDS),
    (SHORTENED[6], "active headers", 5 * HEADER_WORDS),
    (SHORTENED[7], "active headers", 6 * HEADER_WORDS),
    (SHORTENED[8], "active headers", 7 * HEADER_WORDS),
];
/// Number of words in a header.
pub const HEADER: u32 = 4;

/// Names of the list headers by the number of shortenings before; entry 0 is the full list.
const SHORTENED: [&str; 9] = [
    "lit header",
    "header after 1",
    "header after 2",
    "header after 3",
    "header after 4",
    "header after 5",
    "header after 6",
    "header after 7",
    "header after 8",
];

/// A step in its place in the chain: what it binds there, and the sub-iteration in its uniform block.
#[derive(Clone, Debug)]
pub struct Placed {
    /// The step's constant description; `binds` and `groups` of this place replace those in it.
    pub step: Step,
    /// Buffers by name, in the order of the stage's bindings.
    pub binds: Vec<&'static str>,
    /// Workgroups at this place.
    pub groups: Groups,
    /// [`Frame::step`] at this place: a sub-iteration of thinning, counted from 0.
    pub iteration: u32,
}

impl From<Step> for Placed {
    fn from(step: Step) -> Placed {
        Placed { binds: step.binds.to_vec(), groups: step.groups, iteration: 0, step }
    }
}

/// Condition on the layout of a batch under which a step runs.
type When = fn(&Frame) -> bool;

/// Steps on the pictures in place, once per batch: a batch that starts over must not repeat them.
const PREPARE: &[Step] = &[ambient::STEP];

/// Steps from the pictures to the mask, in order. A new stage is one line here or in [`BACK`].
const FRONT: &[(When, Step)] = &[
    (always, listing::CLEARING),
    (always, listing::RESETTING),
    (always, stats::STEP),
    (always, tiles::STEP),
    (by_mean, specks::STEP),
    (by_mean, threshold::BY_MEAN),
    (by_gaussian, threshold::BY_GAUSSIAN),
    (by_gaussian, threshold::GATHERING),
];

/// Steps that thinning and its restarts repeat.
const THINNING: &[Step] = &[thin::STEP, listing::COMPACTING, listing::REBASING];

/// Steps from the thinned mask to the pixel list, in order.
const BACK: &[(When, Step)] = &[
    (lengthened, lengthen::COPYING),
    (lengthened, lengthen::STEP),
    (spaced, spacing::STEP),
    (always, skeleton::COUNTING),
    (always, skeleton::SCANNING_ROWS),
    (always, skeleton::SCANNING_SHOTS),
    (always, skeleton::HEADING),
    (always, skeleton::STEP),
];

fn always(_: &Frame) -> bool {
    true
}
fn by_gaussian(f: &Frame) -> bool {
    f.flags & GAUSSIAN != 0
}
fn by_mean(f: &Frame) -> bool {
    !by_gaussian(f)
}
fn lengthened(f: &Frame) -> bool {
    f.lengthen != 0
}
fn spaced(f: &Frame) -> bool {
    f.spacing != 0
}

/// Every step of the chain, each once.
pub fn steps() -> impl Iterator<Item = &'static Step> {
    let of = |part: &'static [(When, Step)]| part.iter().map(|(_, s)| s);
    PREPARE.iter().chain(of(FRONT)).chain(THINNING).chain(of(BACK))
}

fn running(part: &[(When, Step)], f: &Frame) -> Vec<Placed> {
    part.iter().filter(|(when, _)| when(f)).map(|(_, s)| (*s).into()).collect()
}

/// Steps on the pictures in place.
pub fn prepare(has_ambient: bool) -> Vec<Placed> {
    PREPARE.iter().filter(|_| has_ambient).map(|s| (*s).into()).collect()
}

/// Steps from the pictures to the mask.
pub fn front(f: &Frame) -> Vec<Placed> {
    running(FRONT, f)
}

/// One round of thinning, in sections that end with a shortened list.
pub fn thinning() -> Vec<Vec<Placed>> {
    let begins = std::iter::once(0).chain(SHORTEN);
    let section = |(n, (begin, end)): (usize, (u32, u32))| {
        let (header, list) = (SHORTENED[n], if n == 0 { "lit list" } else { "active list" });
        let thinned = (begin..end).map(|iteration| {
            let (from, to) = if iteration % 2 == 0 { ("mask", "other mask") } else { ("other mask", "mask") };
            let binds = vec![FRAME, header, list, from, to, "stamps"];
            Placed { binds, groups: Groups::Listed(header), iteration, step: thin::STEP }
        });
        let binds = vec![FRAME, "lit header", "lit list", "stamps", SHORTENED[n + 1], "active list"];
        let shortened = Placed { binds, iteration: end, ..listing::COMPACTING.into() };
        thinned.chain([shortened]).collect()
    };
    begins.zip(SHORTEN).enumerate().map(section).collect()
}

/// Steps between two rounds of thinning.
pub fn restart() -> Vec<Placed> {
    vec![
        Placed { iteration: ROUND, ..listing::REBASING.into() },
        // With an iteration above 0 it keeps the lists that the front made.
        Placed { iteration: 1, ..listing::RESETTING.into() },
    ]
}

/// Steps from the thinned mask to the pixel list.
pub fn back(f: &Frame) -> Vec<Placed> {
    let mut steps = running(BACK, f);
    // The same stages read the thinned mask, the mask with lengthened lines, or the pixels chosen from it.
    let long = if lengthened(f) { "long" } else { "mask" };
    let last = if spaced(f) { "spaced" } else { long };
    for s in &mut steps {
        let mask = match s.step.stage.name {
            name if name == spacing::STAGE.name => long,
            name if [skeleton::COUNT.name, skeleton::STAGE.name].contains(&name) => last,
            _ => continue,
        };
        s.binds.iter_mut().filter(|b| **b == "long").for_each(|b| *b = mask);
    }
    steps
}

/// The override constants of a stage.
pub fn overrides(step: &Step, f: &Frame, bits: u8, thinning: Thinning) -> Vec<(&'static str, f64)> {
    let all = [
        (PX_LOG2, f64::from(px_log2(bits))),
        (threshold::RADIUS, f64::from(f.size / 2)),
        (tiles::WEIGHTED, f64::from(u8::from(f.flags & GAUSSIAN != 0))),
        (thin::RULE, f64::from(thinning.number())),
    ];
    all.into_iter().filter(|o| step.stage.overrides.contains(&o.0)).collect()
}
