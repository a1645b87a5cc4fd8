//! In: a folder of pictures of a stripe on a moving bed, three numbers of the rig. Out: heights: cloud,
//! height map, the height of the level surface on it.
//! Frame and unit: x along the stripe, y along the travel, z up from the bed; mm.

use crate::cli::terminal::console::Console;
use sheetlight::fault::{Fault, Result};
use sheetlight::files::{Lock, Together, remove};
use sheetlight::geometry::{Base, Grid, Rigid, Vec3};
use sheetlight::raster::Channel;
use sheetlight::scan::grid;
use sheetlight::scan::{GridOptions, MAP_FILES, ShiftReport, ShiftRig, Side, shift_scan, write_cloud};
use std::path::{Path, PathBuf};

/// Heights from the stripe's sideways shift, without a calibrated camera
///
/// The stripe runs along image columns; the bed moves between pictures. With s = shift / pixels-per-mm the height is
/// D s / (d + s). D is the camera's height above the bed, d the laser's distance from the camera. Rows that always
/// show the bare bed give the zero of each picture. Each picture counts as one step of the travel. Pictures of another
/// size, copies, and pictures that are turned among the others are refused by name.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight shift-scan photos/cube --pixels-per-mm 10.6277 --camera-height-mm 80 \\
      --baseline-mm 37.3 --raises left --travel-mm 1 \\
      --bed-rows 5..40,440..475 --channel red --reference photos/empty \
      --out scans/cube
Guide: docs/math.md, Shift")]
pub struct Args {
    /// Folder with the pictures, in the order of their names (frame2 before frame10)
    pictures: PathBuf,
    /// Pixels per mm on the bed
    #[arg(long, value_name = "MM")]
    pixels_per_mm: f64,
    /// Camera above the bed, mm
    #[arg(long, value_name = "MM")]
    camera_height_mm: f64,
    /// Distance of the laser from the camera, mm
    #[arg(long, value_name = "MM")]
    baseline_mm: f64,
    /// Side to which a raised surface moves the stripe: left or right
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<Side>)]
    raises: Side,
    /// Travel of the bed from picture to picture, mm
    #[arg(long, value_name = "MM")]
    travel_mm: f64,
    /// Rows that always show the bare bed: first..last; repeat or separate by commas
    #[arg(long, value_delimiter = ',', required = true)]
    bed_rows: Vec<String>,
    /// Channel of a colour picture: red, green, blue or luma
    #[arg(long, default_value = "luma", value_parser = crate::cli::terminal::arguments::parse::<Channel>)]
    channel: Channel,
    /// Folder with pictures of the empty bed, to correct the bend of the stripe
    #[arg(long)]
    reference: Option<PathBuf>,
    /// Points below this height do not count for the level surface, mm
    #[arg(long, value_name = "MM", default_value_t = 1.0)]
    min_height_mm: f64,
    /// Folder for cloud, height map and report
    #[arg(long)]
    out: PathBuf,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let rig = ShiftRig {
        pixels_per_mm: args.pixels_per_mm,
        camera_height_mm: args.camera_height_mm,
        baseline_mm: args.baseline_mm,
        raises: args.raises,
        travel_mm: args.travel_mm,
        bed_rows: args.bed_rows.iter().map(|r| rows(r)).collect::<Result<_>>()?,
        channel: args.channel,
    };
    if args.out.join("scan.json").exists() {
        return Err(sheetlight::fault::Fault::usage(format!("{}: holds a scan", args.out.display()))
            .cause("a shift scan would replace its points")
            .next("give another --out"));
    }
    let bar = console.bar("measuring shifts", 0);
    let (report, cloud) =
        shift_scan(&args.pictures, args.reference.as_deref(), &rig, args.min_height_mm, &mut |done, of| {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
        })?;
    bar.finish_and_clear();
    sheetlight::files::make_folder(&args.out)?;
    let _lock = Lock::take(&args.out, "shift", "shift scan")?;
    let set = Together::new(&args.out, "shift", clear);
    set.settle_locked()?;
    let part = set.begin()?;
    write_cloud(&part.join("cloud.ply"), &cloud)?;
    let text = serde_json::to_string_pretty(&report).expect("plain numbers");
    sheetlight::files::write(&part.join("shift.json"), text.as_bytes())?;
    if cloud.len() >= 100 {
        let far = cloud.iter().fold([0f32; 2], |m, p| [m[0].max(p.position[0]), m[1].max(p.position[1])]);
        // A cell is not smaller than the travel: otherwise rows without points would lie between the pictures.
        let cell = args.travel_mm.max(2.0 / args.pixels_per_mm);
        let cells = far.map(|x| (f64::from(x) / cell).ceil() as u32 + 1);
        let frame: Rigid<Base, Grid> = Rigid::new(nalgebra::Matrix3::identity(), Vec3::new(0.0, -0.5 * cell, 0.0));
        let options =
            GridOptions { cell: Some(cell), base_from_grid: Some(frame), cells: Some(cells), ..GridOptions::default() };
        grid(&cloud, &options)?.save(&part)?;
    }
    set.commit()?;
    report.remarks.iter().for_each(|said| console.warn(said));
    console.result(&report, &summary(&report));
    Ok(())
}

/// Removes the previous scan's files when the new ones are complete.
fn clear(out: &Path, _: &Path) -> std::io::Result<()> {
    ["cloud.ply", "shift.json"].into_iter().chain(MAP_FILES).try_for_each(|name| remove(&out.join(name)))
}

fn rows(text: &str) -> Result<[u32; 2]> {
    let parsed = text.split_once("..").and_then(|(a, b)| Some([a.parse().ok()?, b.parse().ok()?]));
    parsed.ok_or_else(|| Fault::usage(format!("bed rows '{text}' are not like 5..40")).next("give first..last"))
}

fn summary(r: &ShiftReport) -> String {
    let mut s =
        format!("{} points from {} pictures, bed even to {:.3} mm (1 sigma)\n", r.points, r.pictures, r.bed_noise_mm);
    if !r.without_bed.is_empty() {
        s += &format!("{} pictures do not show the bed in the given rows\n", r.without_bed.len());
    }
    s + &match r.plateau {
        None => "no level surface stands on the bed\n".into(),
        Some(p) => format!(
            "level surface {:.3} mm above the bed ({} points in {} pictures, noise {:.3} mm, between pictures {:.3} \
             mm)\n",
            p.height_mm, p.points, p.shots, p.noise_mm, p.between_shots_mm
        ),
    }
}
