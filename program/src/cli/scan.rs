//! In: a recording (or raw frames on standard input) and a station. Out: a scan folder: cloud, height
//! map, overlays, figures, page.
//! Frame and unit: base frame, mm.

use super::capture::options::Capture;
use super::capture::scanning::{Taken, scan_camera};
use crate::cli::terminal::console::Console;
use crate::cli::terminal::surroundings::in_folder;
use crate::procedure::scan::no_ambient;
use crate::procedure::{At, ScanOrder};
use indicatif::ProgressBar;
use sheetlight::fault::{Fault, Result};
use sheetlight::raster::{Channel, Image, Light, load_sized};
use sheetlight::recording::{Recording, load_poses};
use sheetlight::rig::Rig;
use sheetlight::scan::{Format, RawFormat, RawSource};
use sheetlight::station::judge;
use sheetlight::station::{Judged, ScanOptions, ScanReport, Settings, scan_recording};
use std::path::{Path, PathBuf};

/// Turn a recording into a point cloud and a height map
///
/// meta.json states what moved: a robot with the sensor (the default), a robot with the part, a linear axis or a
/// turntable. An axis needs its own calibration (sheetlight calibrate axis) instead of a hand-eye.
///
/// Writes into --out: cloud.ply and cloud.pcd (mm, with a standard deviation for each point), height.tif (float, mm,
/// NaN for missing cells), height.png with its scale, pictures, overlays of a few shots, scan.json and index.html.
/// The frame of the cloud is explained in docs/conventions.md.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight scan recordings/board7 --station cell3 --out scans/board7
  sheetlight calibrate axis recordings/axis --station belt1       # then, from the same belt:
  sheetlight scan recordings/parcel4 --station belt1 --out scans/parcel4
  ffmpeg -i shots.mkv -f rawvideo -pix_fmt gray - | sheetlight scan --raw 4096x3072:gray8 \\
      --poses poses.csv --station cell3 --out scans/live
  sheetlight scan --camera gige://first --pair clock --pose-stream bcap://10.0.0.2 \\
      --record recordings/board9 --station cell3 --out scans/board9
All options: sheetlight help scan
Guide: docs/scanning.md")]
pub struct Args {
    /// Station folder with the calibration
    #[arg(long)]
    station: PathBuf,
    /// Folder for the results
    #[arg(long)]
    out: PathBuf,
    #[command(flatten)]
    order: ScanOrder,
    /// Raw frames on standard input: WIDTHxHEIGHT:gray8, gray10le, gray12le or gray16le; --poses is then a path
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<RawFormat>, conflicts_with = "recording")]
    raw: Option<RawFormat>,
    #[command(flatten)]
    capture: Capture,
    /// Also store the camera's pictures as a recording in this folder
    #[arg(long, value_name = "FOLDER", requires = "camera")]
    record: Option<PathBuf>,
    /// Number of shots to draw with their peaks
    #[arg(long, hide_short_help = true, default_value_t = 6)]
    overlays: usize,
    /// Numbers of missing frames of --raw, from 0
    #[arg(long, hide_short_help = true, value_name = "N,N,...", value_delimiter = ',', requires = "raw")]
    missing: Vec<usize>,
    /// Allow pictures and poses outside the recording's folder
    #[arg(long, hide_short_help = true)]
    pictures_outside: bool,
    /// Continue an interrupted scan into the same folder
    #[arg(long)]
    resume: bool,
    /// Compare the points with this truth.json of a simulated recording
    #[arg(long)]
    truth: Option<PathBuf>,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let (settings, rig) = (Settings::load(&args.station)?, Rig::load(&args.station)?);
    let options = |at: &At| args.order.options(at, &settings, &rig, &args.out);
    let mut options = ScanOptions {
        overlays: args.overlays,
        resume: args.resume,
        stop: crate::cli::terminal::interrupt::asked_for(),
        ..in_folder(&args.station, console, options)?
    };
    if let Some(truth) = &args.truth {
        // A wrong path must be reported before the scan.
        sheetlight::files::length(truth)?;
    }
    let bar = console.bar("scanning", 0);
    let folder = Some(Path::new(&args.order.recording)).filter(|name| !name.as_os_str().is_empty());
    let report = match (folder, args.raw) {
        (None, _) if args.capture.running.camera.is_some() => from_camera(args, &rig, &options, console, &bar)?,
        (Some(_), None) => from_recording(args, &rig, &mut options, console, &bar)?,
        (None, Some(raw)) => from_pipe(args, raw, &rig, &mut options, console, &bar)?,
        _ => {
            return Err(
                Fault::usage("nothing to scan").next("give a recording folder, or --raw with frames on standard input")
            );
        }
    };
    bar.finish_and_clear();
    if let (0, Some(folder)) = (report.points, folder) {
        console.warn(format!("the scan has 0 points{}", seen(folder, args.order.channel)));
    }
    let Some(truth) = args.truth.as_ref().filter(|_| report.points > 0) else {
        console.result(&report, &summary(&report, &args.out));
        return report.has_points();
    };
    let errors = judge(&args.out, truth, &[])?;
    let e = &errors.cloud;
    let text = format!(
        "{}\ntrue distance from the surface: median {:.4} mm, rms {:.4} mm, {:.3} % beyond 1 mm",
        summary(&report, &args.out),
        e.median_mm,
        e.rms_without_outliers_mm,
        100.0 * e.outliers_share
    );
    console.result(&WithErrors { scan: report, errors }, &text);
    Ok(())
}

fn from_camera(
    args: &Args,
    rig: &Rig,
    options: &ScanOptions,
    console: &Console,
    bar: &ProgressBar,
) -> Result<ScanReport> {
    let taken = Taken {
        capture: &args.capture,
        raw: args.raw,
        poses: args.order.poses.as_deref().map(Path::new),
        station: &args.station,
        keep: args.record.as_deref(),
        ambient: &|format| ambient_beside(args, format),
    };
    scan_camera(&taken, rig, options, console, bar)
}

fn from_recording(
    args: &Args,
    rig: &Rig,
    options: &mut ScanOptions,
    console: &Console,
    bar: &ProgressBar,
) -> Result<ScanReport> {
    let open = |at: &At| {
        let mut recording = args.order.open(at)?;
        recording.outside = args.pictures_outside;
        recording.read_out_as(args.capture.running.readout.stated())?;
        let ambient = args.order.dark(at, &recording)?;
        Ok((recording, ambient))
    };
    let (recording, ambient) = in_folder(&args.station, console, open)?;
    options.ambient = ambient;
    scan_recording(&recording, args.order.poses.as_deref(), rig, options, shown_by(bar))
}

/// Scans frames from standard input.
fn from_pipe(
    args: &Args,
    raw: RawFormat,
    rig: &Rig,
    options: &mut ScanOptions,
    console: &Console,
    bar: &ProgressBar,
) -> Result<ScanReport> {
    let poses = args.order.poses.as_deref().ok_or_else(|| {
        Fault::usage("frames on standard input, and no poses").next("give their poses in order: --poses FILE")
    })?;
    let file = load_poses(Path::new(poses))?;
    file.warnings.iter().for_each(|w| console.warn(w));
    if args.resume {
        return Err(Fault::usage("a pipe cannot be resumed").next("record the frames to a folder to be able to resume"));
    }
    options.ambient = ambient_beside(args, raw.format)?;
    let missing = args.missing.iter().copied().collect();
    let readout = args.capture.running.readout.stated();
    let open = |_| {
        let frames = RawSource::new(raw, std::io::stdin().lock(), file.poses, missing)?;
        Ok(Box::new(frames.read_out_as(readout)) as Box<_>)
    };
    sheetlight::station::scan("pipe", "standard input", open, rig, options, shown_by(bar))
}

/// Updates a bar with the number of finished shots and their total.
fn shown_by(bar: &ProgressBar) -> impl Fn(usize, Option<usize>) + Sync {
    |done, total| {
        bar.set_length(total.unwrap_or(done) as u64);
        bar.set_position(done as u64);
    }
}

/// What the middle shot of a recording shows, compared with the requirements; empty if it cannot be read.
fn seen(folder: &Path, channel: Channel) -> String {
    let read = || {
        let mut recording = Recording::open(folder).ok()?;
        recording.channel = channel;
        let names: Vec<&String> = recording.meta.frames.iter().filter_map(|f| f.laser.as_ref()).collect();
        let name = names.get(names.len() / 2)?;
        Some(format!(
            "; {name}: {}. Asked for is a stripe that stands out from its surroundings and crosses the working volume: \
             compare exposure, laser and volume with docs/file-formats.md, station.toml",
            Light::of(&recording.picture(name).ok()?)
        ))
    };
    read().unwrap_or_default()
}

/// The picture with the laser off that --ambient names; it must have the frames' size.
fn ambient_beside(args: &Args, f: Format) -> Result<Option<Image>> {
    let ScanOrder { ambient, channel, .. } = &args.order;
    let load = |path: &String| load_sized(Path::new(path), *channel, f.bits, [f.width, f.height]).map_err(no_ambient);
    if ambient.len() > 1 {
        return Err(Fault::usage(format!("{} ambient pictures, the shots have one exposure", ambient.len()))
            .next("give one --ambient"));
    }
    ambient.first().map(load).transpose()
}

/// The output of `--json` with `--truth`.
#[derive(serde::Serialize)]
struct WithErrors {
    #[serde(flatten)]
    scan: ScanReport,
    errors: Judged,
}

fn summary(r: &ScanReport, out: &Path) -> String {
    let shots = match r.skipped.len() {
        0 => r.shots.to_string(),
        bad => format!("{} of {}", r.shots.saturating_sub(bad), r.shots),
    };
    let mut s = format!(
        "{} points from {shots} shots of {}x{} in {:.1} s ({:.1} shots/s, {})\n",
        r.points, r.image.width, r.image.height, r.seconds, r.shots_per_second, r.ran_on
    );
    if let Some(sigma) = r.median_sigma_mm {
        s += &format!("each point good to {sigma:.3} mm (median standard deviation)\n");
    }
    let all: u64 = r.peaks.values().sum();
    for (fate, n) in &r.peaks {
        s += &format!("  {:>9} peaks {fate} ({:.2} %)\n", n, 100.0 * *n as f64 / all.max(1) as f64);
    }
    if r.hot_pixels > 0 {
        s += &format!("{} hot pixels were replaced by their neighbours\n", r.hot_pixels);
    }
    if let Some(exposures) = &r.exposures {
        s += &format!("{exposures}\n");
    }
    if let Some(p) = &r.places {
        s += &format!("{p}\n");
    }
    if let Some(sheet) = &r.sheet {
        s += &format!("{sheet}\n");
    }
    if let Some(v) = &r.working_volume {
        s += &format!("points were believed at depths of {v}\n");
    }
    if !r.dark_shots.is_empty() {
        s += &format!(
            "  {} shots without a stripe: {:?}\n",
            r.dark_shots.len(),
            &r.dark_shots[..r.dark_shots.len().min(12)]
        );
    }
    for remark in &r.remarks {
        s += &format!("  note: {remark}\n");
    }
    for (name, why) in &r.skipped {
        s += &format!("  excluded {name}: {why}\n");
    }
    if let Some(account) = &r.camera {
        s += &format!("the camera: {account}\n");
    }
    if let Some(delay) = &r.delay {
        s += &format!("from a picture's last byte to its points: {delay}\n");
    }
    if let Some(h) = &r.height_map {
        s += &format!(
            "height map {}x{} cells of {:.3} mm, {:.1} % covered, z {:.2} to {:.2} mm\n",
            h.width,
            h.height,
            h.cell_mm,
            100.0 * h.coverage,
            h.z_low_mm,
            h.z_high_mm
        );
    }
    let t = &r.spent;
    s += &format!(
        "time: start {:.2} s, first profile after {:.2} s; waited {:.2} s for pictures, {:.2} s for the stages; \
         writing {:.2} s; height map and pictures {:.2} s\n",
        t.start_s, t.first_profile_s, t.pictures_s, t.stages_s, t.writing_s, t.products_s
    );
    s + &format!("see {}", out.join("index.html").display())
}
