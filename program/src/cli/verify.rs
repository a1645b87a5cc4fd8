//! In: a station, scans of a flat surface, touched points. Out: results of fit and verification, separately.
//! Frame and unit: base frame; mm, px, degrees.

use crate::cli::terminal::console::Console;
use sheetlight::fault::Result;
use sheetlight::rig::Rig;
use sheetlight::station::{Settings, VerifyReport, VerifyRun, verify};
use std::path::PathBuf;

/// Check a station with data that its calibrations did not use
///
/// A small residual does not prove a small error. The report shows, apart from each fit, how well excluded data is
/// predicted. With --flat it shows how well a flat plate scanned from several poses agrees with itself. With --object
/// it shows how well scans of any object from several sides agree, and which calibration would explain a
/// disagreement. With --touch it shows how far touched points are from where the system put them.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight verify --station cell3
  sheetlight verify --station cell3 --flat scans/plate --shots-per-view 16 --touch touches.csv
  sheetlight verify --station cell3 --object scans/casting --object scans/casting-turned
Guide: docs/calibration.md")]
pub struct Args {
    /// Station folder
    #[arg(long)]
    station: PathBuf,
    /// Scan folder of a flat surface; may be repeated
    #[arg(long)]
    flat: Vec<PathBuf>,
    /// Shots per pose, if a flat scan holds several poses; 0: each scan is one view
    #[arg(long, value_name = "N", default_value_t = 0)]
    shots_per_view: u32,
    /// Scan folder of an object; give two or three scans from several sides
    #[arg(long)]
    object: Vec<PathBuf>,
    /// Touch test: a file with predicted x y z and touched x y z (base frame, mm) per line
    #[arg(long)]
    touch: Option<PathBuf>,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let run = VerifyRun {
        flats: args.flat.clone(),
        shots_per_view: args.shots_per_view,
        object: args.object.clone(),
        touches: args.touch.clone(),
    };
    // Settings that other commands refuse are refused here too.
    Settings::load(&args.station)?;
    let rig = Rig::load(&args.station)?;
    let report = verify(&rig, &run)?;
    console.result(&report, &text(&report));
    rig.belong_together()
}

fn text(r: &VerifyReport) -> String {
    let mut s = String::from("Fit (residuals of the data that was fitted)\n");
    let figures = |m: &std::collections::BTreeMap<String, f64>| -> String {
        let all: Vec<String> = m.iter().map(|(k, v)| format!("{k} {v:.4}")).collect();
        if all.is_empty() { "nothing recorded".into() } else { all.join(", ") }
    };
    for (name, c) in &r.calibrations {
        s += &format!("  {name:12} {}\n", figures(&c.fit));
    }
    s += "Verification (excluded data, and the expected errors)\n";
    for (name, c) in &r.calibrations {
        s += &format!("  {name:12} {} ({})\n", figures(&c.verification), c.verdict);
    }
    if let Some(f) = &r.flat {
        s += &format!(
            "Flat surface, {} views: heights spread by {:.4} mm (range {:.4}), tilts up to {:.4} degrees, points \
             {:.4} mm rms about their own planes and {:.4} about the common one\n",
            f.views.len(),
            f.height_spread_mm,
            f.height_range_mm,
            f.largest_tilt_deg,
            f.own_rms_mm,
            f.common_rms_mm
        );
        for v in &f.views {
            s += &format!(
                "  {:24} height {:+.4} mm, tilt {:.4} degrees, {:.4} mm rms, {} points\n",
                v.name, v.height_mm, v.tilt_deg, v.own_rms_mm, v.points
            );
        }
    }
    if let Some(o) = &r.object {
        s += &format!("Object from {} sides\n", o.scans.len());
        for (name, overlap, rms) in &o.scans {
            s += &format!(
                "  {name:24} {:.0} % on the first scan's surfaces, {rms:.4} mm rms from them\n",
                100.0 * overlap
            );
        }
        s += &super::find::locate::looks(&o.looks);
    }
    for remark in &r.remarks {
        s += &format!("note: {remark}\n");
    }
    if let Some(t) = &r.touch {
        let [x, y, z] = t.mean_mm;
        s += &format!(
            "Touch test, {} points: {:.3} mm rms, worst {:.3} mm (number {}), mean {x:+.3} {y:+.3} {z:+.3} mm, {:.3} \
             mm about the mean\n",
            t.points, t.rms_mm, t.worst_mm, t.worst, t.scatter_mm
        );
    }
    s
}
