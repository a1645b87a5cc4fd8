//! In: a height map or cloud of another sensor. Out: a scan folder that find accepts.
//! Frame and unit: the file's own frame, called map; mm.

use crate::cli::terminal::arguments::numbers;
use crate::cli::terminal::console::Console;
use sheetlight::fault::Result;
use sheetlight::scan::Stated;
use sheetlight::station::{ScanReport, import_map};
use std::path::PathBuf;

/// Import a height map or cloud of another sensor, so that find works on it
///
/// Reads pictures whose levels are heights: TIFF and BigTIFF (whole numbers of 1 to 64 bits with or without sign,
/// floats of 16, 32 and 64 bits), PNG, PGM and BMP. It also reads clouds: PLY (text, binary) and PCD (text, binary,
/// compressed). What the file states about its levels (orientation, missing level, scale, transparency) is honoured.
/// Units, distances and the missing level are stated and never guessed. The scatter of heights is measured unless
/// stated. The result is a scan folder with cloud, height map and scan.json. Its frame is called map. The poses of
/// find are in this frame, not in a robot's base. Their error budget contains no calibration.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight import-map plate.png --unit-mm 0.02 --spacing-mm 0.216,0.209 --missing 0 \\
      --light plate_light.png --out scans/plate
  sheetlight import-map heights.tif --unit-mm 1 --spacing-mm 0.1,0.1 --out scans/heights
  sheetlight import-map cloud.pcd --unit-mm 1000 --out scans/cloud
  sheetlight import-map cloud.ply --unit-mm 1 --spacing-mm 0.2,0.2 --out scans/cloud
  sheetlight find scans/plate --recipe star.toml --out star.json
Guide: docs/match.md")]
pub struct Args {
    /// Height picture, PLY or PCD
    file: PathBuf,
    /// mm per level of a picture, or per unit of a cloud's coordinates: 1 for mm, 1000 for m
    #[arg(long, value_name = "MM")]
    unit_mm: Option<f64>,
    /// Spacing of columns and of rows, mm; for an unordered cloud, of its points
    #[arg(long, value_name = "X,Y", value_parser = numbers::<2>)]
    spacing_mm: Option<[f64; 2]>,
    /// Height of a picture's level 0, mm
    #[arg(long, value_name = "MM", default_value_t = 0.0, allow_hyphen_values = true)]
    offset_mm: f64,
    /// Level (or z of a cloud in its unit) that means "not measured", or none; NaN is always missing [default: the
    /// file's]
    #[arg(long, value_name = "LEVEL", value_parser = level, allow_hyphen_values = true)]
    missing: Option<Level>,
    /// The picture's rows run upwards, or it is seen from behind: y runs along the rows
    #[arg(long)]
    rows_up: bool,
    /// Page of a TIFF with several pages of full size, from 1
    #[arg(long)]
    page: Option<usize>,
    /// Intensity picture that belongs to a height picture, of the same size
    #[arg(long)]
    light: Option<PathBuf>,
    /// Standard deviation of a height, mm [default: measured from neighbours]
    #[arg(long, value_name = "MM")]
    sigma_mm: Option<f64>,
    /// Folder for cloud, height map and scan.json
    #[arg(long)]
    out: PathBuf,
}

/// The missing level; `None` if every level is a height.
#[derive(Clone, Copy, Debug)]
struct Level(Option<f64>);

fn level(s: &str) -> std::result::Result<Level, String> {
    let number = || s.parse().ok().filter(|v: &f64| v.is_finite());
    if s == "none" { Ok(Level(None)) } else { number().map(|v| Level(Some(v))).ok_or(format!("'{s}' is not a level")) }
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let stated = Stated {
        spacing_mm: args.spacing_mm,
        unit_mm: args.unit_mm,
        offset_mm: args.offset_mm,
        missing: args.missing.map(|m| m.0),
        rows_up: args.rows_up,
        sigma_mm: args.sigma_mm,
    };
    let report = import_map(&args.file, args.page, args.light.as_deref(), &stated, &args.out)?;
    console.result(&report, &summary(&report));
    console.say(format!("see {}", args.out.display()));
    Ok(())
}

fn summary(r: &ScanReport) -> String {
    let mut s = format!("{} points in {} lines, frame {}\n", r.points, r.shots, r.frame);
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
    r.remarks.iter().for_each(|n| s += &format!("note {n}\n"));
    s
}
