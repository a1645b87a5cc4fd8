//! In: a running camera, a station. Out: one line per measured picture with its points, its latency and the number
//! of skipped pictures, or messages of ROS 2 instead; the account. Frame and unit: camera frame, mm; milliseconds.

use super::capture::options::Running;
use super::terminal::console::Console;
use super::terminal::outputs::{self, Inputs};
use crate::ros::LiveBag;
use sheetlight::capture::{CameraUri, Delays, Fate, Fed, Mode, Pictures, RawFormat, now_ns};
use sheetlight::fault::{Fault, Result};
use sheetlight::files::Aside;
use sheetlight::raster::Light;
use sheetlight::rig::Rig;
use sheetlight::scan::{Live, Where};
use sheetlight::stages::stripe::point::Point;
use sheetlight::station::Settings;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Measure the stripe in the newest picture of a running camera
///
/// Pictures that arrive during a measurement are skipped, except the newest, and counted. Prints one JSON object per
/// picture on stdout, one line each; rate, delay and drops on a line of the terminal; a summary at the end. For
/// recordings use scan, which measures every shot.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight live --camera gige://first --station cell3
  sheetlight live --camera ffmpeg:/dev/video0 --station cell3 --points > profiles.jsonl
  camera-tool --raw | \\
      sheetlight live --raw 4096x3072:gray12le --station cell3 --points > profiles.jsonl
  sheetlight live --camera gige://first --station cell3 --mcap profiles.mcap
All options: sheetlight help live
Guide: docs/live.md")]
pub struct Args {
    #[command(flatten)]
    running: Running,
    /// Raw frames on standard input: WIDTHxHEIGHT:gray8, gray10le, ...
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<RawFormat>)]
    raw: Option<RawFormat>,
    /// Station folder with camera and laser plane calibrated
    #[arg(long)]
    station: PathBuf,
    /// Also print the points: [x, y, z, sigma] in the camera frame, mm
    #[arg(long)]
    points: bool,
    /// Write the points as messages of ROS 2 into a new MCAP file; - is standard output, in place of the lines
    #[arg(long, value_name = "FILE|-")]
    mcap: Option<PathBuf>,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = crate::cli::terminal::arguments::parse::<Where>)]
    on: Where,
}

/// One measured frame.
#[derive(serde::Serialize)]
struct Line {
    frame: u64,
    /// Delay from the frame's last byte to its points, ms.
    latency_ms: f64,
    points: usize,
    /// Number of frames skipped so far.
    passed_over: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    xyz_sigma_mm: Option<Vec<[f32; 4]>>,
}

const GLANCE: Duration = Duration::from_millis(200);

/// The file of --mcap, none for standard output.
fn mcap_file<'a>(args: &'a Args, console: &Console) -> Result<Option<&'a Path>> {
    let Some(path) = args.mcap.as_deref() else { return Ok(None) };
    if path.as_os_str() == "-" {
        let other = if args.points { Some("--points") } else { console.json.then_some("--json") };
        return other.map_or(Ok(None), |other| {
            Err(Fault::usage(format!("--mcap - and {other}: both would write to standard output"))
                .cause("a stream of MCAP has no room for lines of JSON")
                .next("give --mcap a file, or exclude one of the two"))
        });
    }
    outputs::check(&[path], &Inputs { files: &[], scans: &[], station: Some(&args.station) })?;
    if path.symlink_metadata().is_ok() {
        return Err(Fault::usage(format!("{}: is there already", path.display()))
            .cause("an earlier file, which is not replaced")
            .next("remove it, or give another --mcap"));
    }
    Ok(Some(path))
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let path = mcap_file(args, console)?;
    let (settings, rig) = (Settings::load(&args.station)?, Rig::load(&args.station)?);
    let volume = sheetlight::station::volume::believed(&settings, &rig);
    let mut running = args.running.clone();
    if args.raw.is_some() {
        running.camera.get_or_insert(CameraUri::Input);
    }
    let begin = |pictures: Pictures| Live::new(&rig, pictures, &settings.extraction, volume.as_ref(), args.on);
    // A stated format is checked, and the GPU opened, before pictures arrive.
    let early =
        args.raw.map(|raw| begin(Pictures { format: raw.format, readout: running.readout.stated() })).transpose()?;
    let feed = running.open(args.raw, Mode::Newest)?;
    let mut live = early.map_or_else(|| begin(feed.pictures()), Ok)?;
    let sheet = rig.need_laser_plane()?.value;
    let aside = path.map(Aside::create).transpose()?;
    let mut bag = match (&aside, &args.mcap) {
        (Some(aside), Some(path)) => Some(LiveBag::file(aside.file(), path, sheet, live.stripe_along())?),
        (None, Some(_)) => Some(LiveBag::stream(std::io::stdout(), sheet, live.stripe_along())?),
        _ => None,
    };
    let lines = bag.is_none() || path.is_some();
    let (mut teller, bar) = (running.teller(), console.bar("live", 0));
    let (mut waits, mut measured_count) = (Delays::default(), 0usize);
    let (mut without_stripe, mut unlit) = (0, None);
    let ended = loop {
        feed.news().into_iter().for_each(|n| console.warn(n));
        let picture = match feed.next(GLANCE) {
            Fed::Picture(picture, _) => picture,
            Fed::Quiet => continue,
            Fed::Ended(fault) => break fault,
        };
        // Only examined until something was measured, because it takes as long as a stage.
        let light = (measured_count == 0).then(|| Light::of(&picture.image));
        let frame = picture.id;
        let at = bag.as_mut().map(|bag| bag.time(&picture));
        let measured = live.measure(frame as u32, picture.image)?;
        feed.fate(Fate::Used);
        let Some(measured) = measured else {
            without_stripe += 1;
            unlit = light.or(unlit);
            continue;
        };
        let latency_ms = now_ns().saturating_sub(picture.host_ns) as f64 * 1e-6;
        measured_count += 1;
        waits.add(latency_ms);
        teller.watch(&feed, || format!("{} ", delays(&waits)));
        teller.tell(console, &bar);
        if let (Some(bag), Some(at)) = (&mut bag, at)
            && !bag.profile(at, &live.cloud(&measured))?
        {
            return Ok(());
        }
        if !lines {
            continue;
        }
        let there = measured.points.iter().filter(|p| p.sigma_mm.is_finite());
        let list = |p: &Point| [p.position[0], p.position[1], p.position[2], p.sigma_mm];
        let line = Line {
            frame,
            latency_ms,
            points: there.clone().count(),
            passed_over: feed.account().dropped_processing,
            xyz_sigma_mm: args.points.then(|| there.map(list).collect()),
        };
        if !console.line(&line) {
            break None;
        }
    };
    bar.finish_and_clear();
    teller.last_word(&feed);
    let a = feed.account();
    let summary = format!(
        "{} frames: {measured_count} measured, {} skipped, {without_stripe} without a stripe; latency {}",
        a.complete,
        a.dropped_processing,
        delays(&waits),
    );
    let values = [
        ("frames", a.complete.to_string()),
        ("measured", measured_count.to_string()),
        ("skipped", a.dropped_processing.to_string()),
        ("without_stripe", without_stripe.to_string()),
        ("latency", delays(&waits)),
        ("ran_on", live.ran_on()),
    ];
    let values = values.map(|(key, value)| (key.to_owned(), value)).into();
    bag.map(|bag| bag.finish(&summary, ended.is_some(), values)).transpose()?;
    aside.map(Aside::keep).transpose()?;
    console.say(format!("{summary}; {}", live.ran_on()));
    if a.sent != a.complete {
        console.say(format!("the camera: {a}"));
    }
    if let Some(light) = unlit.filter(|_| measured_count == 0) {
        console.warn(format!("no frame showed a stripe; the last one: {light}"));
    }
    ended.map_or(Ok(()), Err::<(), Fault>)
}

/// Median and 99th percentile of the delays.
fn delays(waits: &Delays) -> String {
    waits.so_far().map_or("none".into(), |d| d.to_string())
}
