//! In: options of a simulation. Out: recording folders, truth and a station with the true calibration.
//! Frame and unit: as in the recording format; mm, degrees, pixels.

use crate::cli::terminal::console::Console;
use sheetlight::fault::Result;
use sheetlight::geometry::AxisKind;
use sheetlight::recording::{BoardSpec, load_poses};
use sheetlight::simulate::{RigSpec, Set, SimulateOptions, simulate};
use sheetlight::station::{Settings, WorkingVolume};
use std::path::PathBuf;

/// Makes recordings of a station whose every number is known: to try a command, to train people, to
/// measure errors. The same options give the same files, byte for byte.
///
/// With --rig the station, its boards and what it scans follow from a design; notched.toml in --out is the recipe of
/// the part that lies there.
///
/// Example: sheetlight simulate --out try --set all --seed 3
///          sheetlight scan try/scan --station try/station --out try/result
///          sheetlight simulate --rig data/rigs/webcam.toml --set all --out webcam
///          sheetlight simulate --motion linear --set axis,scan --out belt
///          sheetlight simulate --out again --seed 3 --poses second.json
#[derive(clap::Args)]
pub struct Args {
    /// Folder for the recordings (one per set) and the station
    #[arg(long)]
    out: PathBuf,
    /// What to record, separated by commas: scan, intrinsics, handeye, laserplane, pointer_cal, pointer, surface,
    /// axis, all
    #[arg(long = "set", value_delimiter = ',', default_value = "scan")]
    sets: Vec<String>,
    /// Design of the station (TOML; see data/rigs) [default: paper.toml]
    #[arg(long)]
    rig: Option<PathBuf>,
    /// Scene file (TOML, docs/file-formats.md) [default: a circuit board; with --rig a stepped block and a notched
    /// plate]
    #[arg(long)]
    scene: Option<PathBuf>,
    /// Calibration board (JSON from sheetlight board) [default: built in]
    #[arg(long)]
    board: Option<PathBuf>,
    /// Random seed for station, scene pose and noise; 0 is the design itself
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Sensor width, px; lens and field of view stay [default: the rig's, 640]
    #[arg(long)]
    width: Option<u32>,
    /// Sensor height, px [default: in proportion to the width]
    #[arg(long)]
    height: Option<u32>,
    /// What moves: robot (the sensor), linear or turntable (the parts)
    #[arg(long, default_value = "robot", value_parser = crate::cli::terminal::arguments::parse::<Moved>)]
    motion: Moved,
    /// Bits per pixel, 8 to 16 [default: the rig's, 8]
    #[arg(long)]
    bits: Option<u8>,
    /// Shots of a scan; fewer are farther apart [default: 200; with --rig one per 1.5 pixel footprints; turntable 2000]
    #[arg(long)]
    shots: Option<usize>,
    /// Flange poses for the set scan or surface, one per shot, as second-look writes them
    #[arg(long, value_name = "FILE", conflicts_with = "shots")]
    poses: Option<PathBuf>,
    /// Factor on shot noise, read noise, speckle and hot pixels; 0: no noise
    #[arg(long, default_value_t = 1.0)]
    noise: f64,
    /// Speckle contrast per pixel, 0 to 0.6 [default: the rig's, 0.12]
    #[arg(long)]
    speckle: Option<f64>,
    /// Peak of the stripe on white as share of full scale, 0.02 to 20 [default: the rig's, 0.95]
    #[arg(long)]
    exposure: Option<f64>,
    /// Several pictures of each pose of a scan, as --exposure, from the shortest: 0.5,2,8
    #[arg(long, value_delimiter = ',', value_name = "N,N,...", conflicts_with = "exposure")]
    exposures: Vec<f64>,
    /// Error of the reported robot poses, 1 sigma per axis, mm
    #[arg(long, value_name = "MM", default_value_t = 0.0)]
    pose_noise_mm: f64,
    /// Error of the reported rotations, 1 sigma per axis, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0)]
    pose_noise_deg: f64,
}

/// A value of `--motion`.
#[derive(Clone, Copy, Debug)]
struct Moved(Option<AxisKind>);

impl std::str::FromStr for Moved {
    type Err = String;
    fn from_str(s: &str) -> std::result::Result<Moved, String> {
        match s {
            "robot" => Ok(Moved(None)),
            "linear" => Ok(Moved(Some(AxisKind::Linear))),
            "turntable" => Ok(Moved(Some(AxisKind::Turntable))),
            _ => Err(format!("unknown motion '{s}': robot, linear or turntable")),
        }
    }
}

/// At the scene's ends a turn is this many times as long as a pass over the scene.
const TURN_OVER_PASS: usize = 10;

pub fn run(args: &Args, console: &Console) -> Result<()> {
    crate::cli::terminal::outputs::check_simulation(&args.out)?;
    let mut sets = Vec::new();
    for name in &args.sets {
        match name.as_str() {
            "all" => {
                sets.extend(Set::ALL);
                sets.extend(args.motion.0.map(|_| Set::Axis));
            }
            name => sets.push(name.parse().map_err(|e: String| sheetlight::fault::Fault::usage(e).next("name a set"))?),
        }
    }
    let mut options = match &args.rig {
        Some(path) => SimulateOptions::of(RigSpec::load(path)?),
        None => SimulateOptions::default(),
    };
    let (w, h) = (options.width, options.height);
    options.width = args.width.unwrap_or(w);
    options.height = args.height.unwrap_or((u64::from(options.width) * u64::from(h) / u64::from(w)) as u32);
    options.sets = sets;
    options.scene = args.scene.clone();
    options.board = args.board.as_deref().map(BoardSpec::load).transpose()?;
    options.seed = args.seed;
    options.motion = args.motion.0;
    let usual =
        if options.motion == Some(AxisKind::Turntable) { TURN_OVER_PASS * options.shots } else { options.shots };
    options.shots = args.shots.unwrap_or(usual);
    options.poses = args.poses.as_deref().map(|path| load_poses(path).map(|read| read.poses)).transpose()?;
    options.sensor.bits = args.bits.unwrap_or(options.sensor.bits);
    options.sensor.laser_white = args.exposure.unwrap_or(options.sensor.laser_white);
    options.exposures = args.exposures.clone();
    (options.pose_noise_mm, options.pose_noise_deg) = (args.pose_noise_mm, args.pose_noise_deg);
    options = options.with_noise(args.noise);
    options.sensor.speckle = args.speckle.unwrap_or(options.sensor.speckle);
    let bar = console.bar("simulating", 0);
    let done = simulate(&args.out, &options, &|n, of| {
        bar.set_length(of as u64);
        bar.set_position(n as u64);
    })?;
    bar.finish_and_clear();
    let volume = |r: &RigSpec| WorkingVolume { near_mm: r.working.near_mm, far_mm: r.working.far_mm };
    let working_volume = options.rig.as_ref().map(volume);
    let name = format!("simulated {}", args.seed);
    Settings { name, working_volume, ..Settings::default() }.store(&done.station)?;
    let mut text = format!("{}: station with the true calibration\n", done.station.display());
    for (set, folder, pictures) in &done.recordings {
        text += &format!("{}: {set}, {pictures} pictures\n", folder.display());
    }
    console.result(&done, &text);
    Ok(())
}
