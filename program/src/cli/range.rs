//! In: pictures of the pointer's spot. Out: distances, points, and the normal of the surface.
//! Frame and unit: camera and base frame; mm, degrees.

use crate::cli::terminal::console::Console;
use crate::cli::terminal::surroundings::in_folder;
use crate::procedure::TouchOrder;
use sheetlight::fault::Result;
use sheetlight::robot::Convention;
use sheetlight::station::{RangeReport, Settings};
use std::path::PathBuf;

/// Measure distances with the laser pointer
///
/// Prints for each picture the distance along the beam and along the optical axis with its standard deviation. With
/// robot poses and a hand-eye calibration it also prints the point in the base frame. With --surface the shots are
/// taken as one plane: its normal and the tool pose square to it follow. If station.toml has a [tool], the tool's
/// lean at the last shot and the flange pose that makes it square follow too.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight range recordings/pointer --station cell3 --json > distances.json
Guide: docs/finding-and-inserting.md")]
pub struct Args {
    /// Station folder with camera and pointer calibrations
    #[arg(long)]
    station: PathBuf,
    #[command(flatten)]
    inputs: TouchOrder,
    /// All shots show one plane: compute its normal (needs poses and hand-eye)
    #[arg(long)]
    surface: bool,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let settings = Settings::load(&args.station)?;
    let report = in_folder(&args.station, console, |at| args.inputs.measure(at, &settings, args.surface))?;
    console.result(&report, &table(&report, settings.robot.unwrap_or(Convention::Matrix)));
    Ok(())
}

fn table(r: &RangeReport, robot: Convention) -> String {
    let mut s = String::from("picture             along beam mm      along axis mm      point in camera mm\n");
    for d in &r.distances {
        let [x, y, z] = d.point_camera_mm;
        s += &format!(
            "{:16} {:9.3} ± {:.3}  {:9.3} ± {:.3}  {x:9.3} {y:9.3} {z:9.3}",
            d.picture, d.along_beam_mm, d.along_beam_sigma_mm, d.along_axis_mm, d.along_axis_sigma_mm
        );
        if let (Some([x, y, z]), Some([a, b, c])) = (d.point_base_mm, d.point_base_sigma_mm) {
            s += &format!("  base {x:.3} {y:.3} {z:.3} ± {a:.3} {b:.3} {c:.3}");
        }
        s.push('\n');
    }
    for (name, why) in &r.missing {
        s += &format!("{name:16} no distance: {why}\n");
    }
    for remark in &r.remarks {
        s += &format!("note: {remark}\n");
    }
    if let Some(f) = &r.surface {
        let [x, y, z] = f.normal;
        s += &format!(
            "surface normal {x:.6} {y:.6} {z:.6} (base), known to {:.4} by {:.4} degrees; points within {:.4} mm rms\n",
            f.tilt_sigma_deg[0], f.tilt_sigma_deg[1], f.rms_mm
        );
        if let Some(name) = &f.left_out {
            s += &format!("{name} was excluded: its spot does not lie on the plane of the others\n");
        }
        s += &format!("tool square to it ({}): {}\n", robot.name(), written(robot, robot.write(&f.base_from_tool)));
    }
    if let Some(q) = &r.square {
        s += &format!(
            "the tool leant {:.4} ± {:.4} degrees at the last shot; square there, by turning about its origin: \
             flange {}\n",
            q.tilt_deg,
            q.tilt_sigma_deg,
            written(robot, robot.write(&q.base_from_flange))
        );
    }
    s
}

fn written(robot: Convention, numbers: Vec<f64>) -> String {
    let labelled = robot.labels().iter().zip(numbers).map(|(label, v)| format!("{label} {v:.4}"));
    labelled.collect::<Vec<_>>().join(", ")
}
