//! In: what to simulate. Out: recording folders, truth and a station with the true calibration.
//! Frame and unit: as in the recording format; mm, degrees, pixels.

use super::Console;
use crate::fault::Result;
use crate::recording::BoardSpec;
use crate::simulate::{Sensor, Set, SimulateOptions, simulate};
use crate::station::Settings;
use std::path::PathBuf;

/// Makes recordings of a station whose every number is known: to try a command, to train people, to
/// measure errors. The same options give the same files, byte for byte.
///
/// Example: sheetlight simulate --out try --set all --seed 3
///          sheetlight scan try/scan --station try/station --out try/result
#[derive(clap::Args)]
pub struct Args {
    /// Folder for the recordings (one a set) and the station
    #[arg(long)]
    out: PathBuf,
    /// What to record, several times or separated by commas: scan, intrinsics, handeye, laserplane,
    /// pointer_cal, pointer, surface, all
    #[arg(long = "set", value_delimiter = ',', default_value = "scan")]
    sets: Vec<String>,
    /// Scene file (TOML, see docs/file-formats.md) [default: a circuit board with parts]
    #[arg(long)]
    scene: Option<PathBuf>,
    /// Description of the calibration board (JSON as sheetlight board writes it) for the sets
    /// that show one [default: the station's own]
    #[arg(long)]
    board: Option<PathBuf>,
    /// Another specimen of the station, scene pose and noise for every seed; 0 is the design itself
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Sensor width, px
    #[arg(long, default_value_t = 640)]
    width: u32,
    /// Sensor height, px [default: three quarters of the width]
    #[arg(long)]
    height: Option<u32>,
    /// Bits per pixel, 8 to 16
    #[arg(long, default_value_t = 8)]
    bits: u8,
    /// Shots of a scan
    #[arg(long, default_value_t = 200)]
    shots: usize,
    /// Scales shot noise, read noise, speckle and hot pixels; 0 is a noiseless sensor
    #[arg(long, default_value_t = 1.0)]
    noise: f64,
    /// Speckle contrast per pixel, 0 to 0.6 [default: 0.12]
    #[arg(long)]
    speckle: Option<f64>,
    /// Peak of the stripe on white as share of full scale, 0.02 to 20 [default: 0.95]
    #[arg(long)]
    exposure: Option<f64>,
    /// Error of the reported robot poses, 1 sigma per axis, mm
    #[arg(long, default_value_t = 0.0)]
    pose_noise_mm: f64,
    /// The same for the rotation, degrees
    #[arg(long, default_value_t = 0.0)]
    pose_noise_deg: f64,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    super::outputs::check_simulation(&args.out)?;
    let mut sets = Vec::new();
    for name in &args.sets {
        match name.as_str() {
            "all" => sets.extend(Set::ALL),
            name => sets.push(name.parse().map_err(|e: String| crate::fault::Fault::usage(e).next("name a set"))?),
        }
    }
    let mut sensor = Sensor { bits: args.bits, ..Sensor::default() };
    sensor.laser_white = args.exposure.unwrap_or(sensor.laser_white);
    let mut options = SimulateOptions {
        sets,
        scene: args.scene.clone(),
        board: args.board.as_deref().map(BoardSpec::load).transpose()?,
        seed: args.seed,
        width: args.width,
        height: args.height.unwrap_or(args.width * 3 / 4),
        sensor,
        shots: args.shots,
        pose_noise_mm: args.pose_noise_mm,
        pose_noise_deg: args.pose_noise_deg,
    }
    .with_noise(args.noise);
    options.sensor.speckle = args.speckle.unwrap_or(options.sensor.speckle);
    let bar = console.bar("simulating", 0);
    let done = simulate(&args.out, &options, &|n, of| {
        bar.set_length(of as u64);
        bar.set_position(n as u64);
    })?;
    bar.finish_and_clear();
    Settings { name: format!("simulated {}", args.seed), ..Settings::default() }.store(&done.station)?;
    let mut text = format!("{}: station with the true calibration\n", done.station.display());
    for (set, folder, pictures) in &done.recordings {
        text += &format!("{}: {set}, {pictures} pictures\n", folder.display());
    }
    console.result(&done, &text);
    Ok(())
}
