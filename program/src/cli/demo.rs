//! In: only a folder. Out: a simulated station, its scan through the whole chain, the errors against the truth, and
//! one page that shows everything.
//! Frame and unit: base frame, mm.

use crate::cli::terminal::console::Console;
use sheetlight::fault::{Fault, Result};
use sheetlight::find::Recipe;
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::{RecordingSource, Where};
use sheetlight::simulate::{SimulateOptions, simulate};
use sheetlight::station::{FoundPart, Judged, ScanOptions, ScanReport, Settings};
use sheetlight::station::{judge, judge_parts};
use std::path::PathBuf;

/// Simulate a board full of parts, scan it, and show the scan's accuracy
///
/// Needs no camera, robot or GPU. Writes into --out: simulated/ (the pictures, poses and calibration of a real
/// station) and the scan: cloud, height map, overlays, errors, index.html.
#[derive(clap::Args)]
pub struct Args {
    /// Folder for everything
    #[arg(long, default_value = "demo")]
    out: PathBuf,
    /// Random seed for the station and its noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Shots of the pass over the board
    #[arg(long, default_value_t = 320)]
    shots: usize,
    /// Sensor width, px; the height is three quarters of it
    #[arg(long, default_value_t = 640)]
    width: u32,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = crate::cli::terminal::arguments::parse::<Where>)]
    on: Where,
}

/// Label of the scan; a demo replaces only scans with this label.
const LABEL: &str = "a simulated board with parts";

/// The recipes of the parts on the simulated board.
const RECIPES: [&str; 3] = [
    include_str!("../../../data/recipes/led.toml"),
    include_str!("../../../data/recipes/osc.toml"),
    include_str!("../../../data/recipes/flash.toml"),
];

#[derive(serde::Serialize)]
struct Demo {
    page: PathBuf,
    scan: ScanReport,
    errors: Judged,
    parts: Vec<FoundPart>,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    crate::cli::terminal::outputs::check_simulation(&args.out.join("simulated"))?;
    crate::cli::terminal::outputs::check_scan(&args.out, LABEL)?;
    let (station, folder) = simulated(args, console)?;
    let out = args.out.clone();
    let (settings, rig) = (Settings::load(&station)?, Rig::load(&station)?);
    let scan = ScanOptions { place: args.on, overlays: 4, ..ScanOptions::for_station(&settings, &rig, &out) };
    console.say("scanning it through the whole chain");
    let bar = console.bar("scanning", args.shots as u64);
    let recording = Recording::open(&folder)?;
    let open = |first| Ok(Box::new(RecordingSource::open(&recording, None, first)?) as Box<_>);
    let report = sheetlight::station::scan("demo", LABEL, open, &rig, &scan, |done, _| bar.set_position(done as u64))?;
    bar.finish_and_clear();
    console.say("finding the parts, comparing every point with the truth");
    let truth = folder.join("truth.json");
    let recipes = RECIPES.iter().map(|text| Recipe::parse(text)).collect::<Result<Vec<_>>>()?;
    let parts = judge_parts(&out, &station, &truth, &recipes)?;
    let errors = judge(&out, &truth, &parts)?;
    let page = out.join("index.html");
    let mut text = words(&report, &errors, &parts);
    text += &format!("open {}", page.display());
    console.result(&Demo { page, scan: report, errors, parts }, &text);
    Ok(())
}

/// Simulates the station; returns the folders of the station and its scan.
fn simulated(args: &Args, console: &Console) -> Result<(PathBuf, PathBuf)> {
    let options = SimulateOptions {
        seed: args.seed,
        shots: args.shots,
        width: args.width,
        height: args.width * 3 / 4,
        ..SimulateOptions::default()
    };
    console.say(format!("simulating a station: {} shots of {}x{}", options.shots, options.width, options.height));
    let bar = console.bar("simulating", 0);
    let made = simulate(&args.out.join("simulated"), &options, &|n, of| {
        bar.set_length(of as u64);
        bar.set_position(n as u64);
    })?;
    bar.finish_and_clear();
    Settings { name: "demo".into(), ..Settings::default() }.store(&made.station)?;
    let folder = made.recordings.first().map(|(_, folder, _)| folder.clone());
    let folder = folder.ok_or_else(|| {
        Fault::output("nothing was simulated").next("choose an --out folder that you may write to, and run it again")
    })?;
    Ok((made.station, folder))
}

/// A summary of the scan's accuracy and of the poses found in it.
fn words(report: &ScanReport, errors: &Judged, parts: &[FoundPart]) -> String {
    let e = &errors.cloud;
    let mut text = format!(
        "{} points from {} shots in {:.1} s on {}\n\
         true distance from the surface: median {:.4} mm, rms {:.4} mm, {:.3} % beyond 1 mm\n",
        report.points,
        report.shots,
        report.seconds,
        report.ran_on,
        e.median_mm,
        e.rms_without_outliers_mm,
        100.0 * e.outliers_share
    );
    for p in parts {
        text += &match (p.passed, p.error_mm, p.error_deg) {
            (true, Some([x, y, z]), Some(deg)) => format!(
                "{}: insertion pose {:.3} mm in the plane, {:.3} mm in height, {deg:.3} degrees from the truth\n",
                p.title,
                x.hypot(y),
                z.abs()
            ),
            _ => format!("{}: no pose: {}\n", p.title, p.reasons.join("; ")),
        };
    }
    text
}
