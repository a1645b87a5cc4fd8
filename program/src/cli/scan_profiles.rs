//! In: profiles of a line-profile sensor, poses or counts, a station. Out: a scan folder.
//! Frame and unit: profiles in the sensor's plane, cloud in the base frame or in the axis'; mm.

use super::terminal::arguments::numbers;
use super::terminal::console::Console;
use super::terminal::outputs::{self, Inputs};
use sheetlight::calibrate::profile_sensor::missing::Heights;
use sheetlight::fault::Result;
use sheetlight::rig::Rig;
use sheetlight::scan::GridOptions;
use sheetlight::station::{Moved, ProfileScan, ScanReport, Settings, scan_profiles};
use std::path::PathBuf;

/// Make a scan of profiles that a sensor measured itself
///
/// The sensor gives x along its line and z away from it, both mm, so nothing is extracted. On a robot, the station has
/// its pose on the flange (calibrate profile-hand-eye). Over a conveyor, you state the way of the parts during a count.
/// Profile i belongs to pose or count i. The result is a scan folder as of pictures: find, teach, verify, filter and
/// mcap open it. A point's sigma is what you state of the sensor; the error of its pose on the flange is part of the
/// budget of find.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight scan-profiles profiles.csv --poses poses.csv --station cell3 \\
      --sigma-mm 0.02 --out scans/board7
  sheetlight scan-profiles profiles/ --poses SCAN.LS --station cell3 \\
      --sigma-mm 0.012 --sigma-x-mm 0.02 --missing -32.768 --out scans/board8
  sheetlight scan-profiles profiles.csv --counts counts.csv --travel-mm 0,0.05,0 \\
      --sigma-mm 0.02 --out scans/parcel4
  sheetlight find scans/board7 --recipe led.toml --station cell3 --out pose.json
Guide: docs/connections.md (3-D cameras and profile sensors), docs/file-formats.md")]
pub struct Args {
    /// Folder with one profile per file, or one file with all: CSV (x, z), OpenCV YAML, or plain numbers
    profiles: PathBuf,
    /// Poses in the profiles' order: CSV or JSON as in a recording, or a FANUC listing (.LS)
    #[arg(long, required_unless_present = "counts")]
    poses: Option<PathBuf>,
    /// Counts of a conveyor in the profiles' order: CSV with the header frame,count
    #[arg(long, requires = "travel_mm", conflicts_with_all = ["poses", "station"])]
    counts: Option<PathBuf>,
    /// Way of the parts during one count, mm along x, y and z of the sensor
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, requires = "counts", allow_hyphen_values = true)]
    travel_mm: Option<[f64; 3]>,
    /// Station folder with calibration/profile_hand_eye.json, for poses
    #[arg(long, required_unless_present = "counts")]
    station: Option<PathBuf>,
    /// Standard deviation of a point along the sensor's z, mm: from its data sheet, or measured on a flat part
    #[arg(long, value_name = "MM")]
    sigma_mm: f64,
    /// Standard deviation of a point along the sensor's x, mm [default: not known, counts as 0]
    #[arg(long, value_name = "MM")]
    sigma_x_mm: Option<f64>,
    /// z that means "not measured", mm; values that are not finite are always skipped
    #[arg(long, value_name = "Z", allow_negative_numbers = true)]
    missing: Option<f64>,
    /// z of the profiles grows towards the sensor: it is negated, as for calibrate profile-hand-eye
    #[arg(long)]
    z_up: bool,
    /// Edge of a height map's cell, mm [default: about 1.5 points a cell]
    #[arg(long, value_name = "MM")]
    cell_mm: Option<f64>,
    /// Folder for cloud, height map, shots and report
    #[arg(long)]
    out: PathBuf,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let moved = match (&args.poses, &args.counts) {
        (_, Some(counts)) => Moved::Axis { counts, travel_mm: args.travel_mm.expect("clap: required with counts") },
        (poses, None) => Moved::Robot(poses.as_deref().expect("clap: required without counts")),
    };
    let (Moved::Robot(file) | Moved::Axis { counts: file, .. }) = moved;
    let inputs = Inputs { files: &[&args.profiles, file], station: args.station.as_deref(), ..Inputs::default() };
    outputs::check(&[&args.out], &inputs)?;
    let (settings, rig) = match &args.station {
        Some(station) => (Settings::load(station)?, Rig::load(station)?),
        None => (Settings::default(), Rig::default()),
    };
    let options = ProfileScan {
        sigma_mm: args.sigma_mm,
        sigma_x_mm: args.sigma_x_mm,
        heights: Heights { missing: args.missing, up: args.z_up },
        extraction: settings.extraction,
        grid: GridOptions { cell: args.cell_mm, ..GridOptions::default() },
        out: args.out.clone(),
    };
    let report = scan_profiles(&args.profiles, &moved, &rig, &options)?;
    console.result(&report, &summary(&report));
    console.say(format!("see {}", args.out.join("index.html").display()));
    Ok(())
}

fn summary(r: &ScanReport) -> String {
    let mut s = format!("{} points from {} profiles of up to {} places\n", r.points, r.shots, r.image.width);
    if let Some(sigma) = r.median_sigma_mm {
        s += &format!("each point good to {sigma:.4} mm (as stated of the sensor)\n");
    }
    if let Some(p) = &r.places {
        s += &format!("reported places {p}\n");
    }
    if let Some(m) = &r.height_map {
        s += &format!(
            "height map {} x {} cells of {:.4} mm, {:.1} % seen, heights {:.3} to {:.3} mm above its plane\n",
            m.width,
            m.height,
            m.cell_mm,
            100.0 * m.coverage,
            m.z_low_mm,
            m.z_high_mm
        );
    }
    if !r.dark_shots.is_empty() {
        s += &format!("{} profiles have no measured place\n", r.dark_shots.len());
    }
    r.remarks.iter().for_each(|n| s += &format!("note {n}\n"));
    s
}
