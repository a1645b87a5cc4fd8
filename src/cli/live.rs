//! In: raw frames on standard input, a station. Out: one line a measured frame: its points, how long it took, how many
//! frames were passed over meanwhile. Frame and unit: camera frame, mm; milliseconds.

use super::terminal::console::Console;
use crate::fault::{Fault, Result};
use crate::raster::Light;
use crate::rig::Rig;
use crate::scan::{Live, Newest, RawFormat, RawFrames, Where};
use crate::stages::stripe::point::Point;
use crate::station::Settings;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Measure the stripe in the newest picture of a running camera, with the least delay
///
/// Frames that arrive while one is measured are passed over, but for the newest, and counted. Prints one JSON object a
/// line and frame on stdout; a summary when the pipe ends. For recordings use scan, which measures every shot.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  ffmpeg -f v4l2 -i /dev/video0 -f rawvideo -pix_fmt gray - | \\
      sheetlight live --raw 640x480:gray8 --station cell3
  camera-tool --raw | \\
      sheetlight live --raw 4096x3072:gray12le --station cell3 --points > profiles.jsonl")]
pub struct Args {
    /// Frames on standard input: WIDTHxHEIGHT:gray8, gray10le, gray12le or gray16le
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<RawFormat>)]
    raw: RawFormat,
    /// Station folder with the calibration of camera and laser plane
    #[arg(long)]
    station: PathBuf,
    /// Print the points too: [x, y, z, sigma] in the camera frame, mm
    #[arg(long)]
    points: bool,
    /// Where the stages run: auto (a GPU with processors of its own, else this machine's), gpu, or cpu
    #[arg(long, default_value = "auto", value_parser = crate::cli::terminal::arguments::parse::<Where>)]
    on: Where,
}

/// One measured frame.
#[derive(serde::Serialize)]
struct Line {
    frame: u32,
    /// From the frame's last byte to its points.
    latency_ms: f64,
    points: usize,
    /// Frames passed over so far.
    passed_over: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    xyz_sigma_mm: Option<Vec<[f32; 4]>>,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let (settings, rig) = (Settings::load(&args.station)?, Rig::load(&args.station)?);
    let volume = crate::station::volume::believed(&settings, &rig);
    let mut live = Live::new(&rig, args.raw.format, &settings.extraction, volume.as_ref(), args.on)?;
    let newest = Arc::new(Newest::default());
    let (raw, filled) = (args.raw, newest.clone());
    // Not joined where measuring fails: it may wait for a camera that sends nothing.
    let reader = std::thread::Builder::new().name("frames".into()).spawn(move || {
        let mut frames = RawFrames::new(raw, std::io::stdin().lock());
        let mut n = 0u32;
        let end = loop {
            match frames.read() {
                Ok(Some(image)) => filled.put((n, image, Instant::now())),
                Ok(None) => break Ok(n),
                Err(fault) => break Err(fault),
            }
            n += 1;
        };
        filled.close();
        end
    });
    let reader = reader.map_err(|e| Fault::threads(&e))?;
    let (mut waits, mut without_stripe, mut unlit) = (Vec::new(), 0, None);
    while let Some((frame, image, arrived)) = newest.take() {
        // Looked at only while nothing was seen: it takes as long as a stage.
        let light = waits.is_empty().then(|| Light::of(&image));
        let Some(measured) = live.measure(frame, image)? else {
            without_stripe += 1;
            unlit = light.or(unlit);
            continue;
        };
        let latency_ms = 1e3 * arrived.elapsed().as_secs_f64();
        waits.push(latency_ms);
        let there = measured.points.iter().filter(|p| p.sigma_mm.is_finite());
        let list = |p: &Point| [p.position[0], p.position[1], p.position[2], p.sigma_mm];
        let line = Line {
            frame,
            latency_ms,
            points: there.clone().count(),
            passed_over: newest.passed_over(),
            xyz_sigma_mm: args.points.then(|| there.map(list).collect()),
        };
        if !console.line(&line) {
            return Ok(());
        }
    }
    let frames = reader.join().expect("reading does not panic")?;
    waits.sort_by(f64::total_cmp);
    let percentile = |p: f64| waits.get((waits.len().saturating_sub(1) as f64 * p).round() as usize);
    let ms = |p: f64| percentile(p).map_or("none".into(), |v| format!("{v:.1} ms"));
    console.say(format!(
        "{frames} frames: {} measured, {} passed over, {without_stripe} without a stripe; latency {} (median), {} (99 %); {}",
        waits.len(),
        newest.passed_over(),
        ms(0.5),
        ms(0.99),
        live.ran_on()
    ));
    if let Some(light) = unlit.filter(|_| waits.is_empty()) {
        console.warn(format!("no frame showed a stripe; the last one: {light}"));
    }
    Ok(())
}
