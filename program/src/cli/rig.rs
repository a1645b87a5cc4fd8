//! The calculator of the hardware guide: prints the resolution of a planned rig.

use super::terminal::arguments::parse;
use super::terminal::console::Console;
use sheetlight::fault::Result;
use sheetlight::rig::{RigForecast, RigPlan};

#[derive(clap::Subcommand)]
pub enum Command {
    Plan(Args),
}

/// Compute resolution, depth range and error of a planned rig
///
/// The camera looks squarely at the parts, and the laser sheet crosses its axis at the working distance.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight rig plan 640x480 --pixel-um 8.3 --focal-mm 5.08 --distance-mm 155 --angle-deg 28
  sheetlight rig plan 1920x1200 --pixel-um 4.8 --view-mm 150 --distance-mm 300 --scatter-mm 0.01
Guide: docs/hardware.md")]
#[command(group(clap::ArgGroup::new("lens").required(true)), group(clap::ArgGroup::new("sheet").required(true)))]
pub struct Args {
    /// Picture size: pixels along the stripe x pixels across it
    #[arg(value_parser = parse::<Pixels>)]
    pixels: Pixels,
    /// Edge of a pixel, µm
    #[arg(long, value_name = "UM")]
    pixel_um: f64,
    /// Focal length of the lens, mm
    #[arg(long, value_name = "MM", group = "lens")]
    focal_mm: Option<f64>,
    /// Instead of the focal length: width that the picture must see along the stripe at this distance, mm
    #[arg(long, value_name = "MM", group = "lens")]
    view_mm: Option<f64>,
    /// Distance from the lens to the parts, mm
    #[arg(long, value_name = "MM")]
    distance_mm: f64,
    /// Angle between the camera's axis and the laser sheet, degrees
    #[arg(long, value_name = "DEG", group = "sheet")]
    angle_deg: Option<f64>,
    /// Instead of the angle: the largest scatter of a point allowed, mm (1 sigma, clean stripe)
    #[arg(long, value_name = "MM", group = "sheet")]
    scatter_mm: Option<f64>,
    /// f-number of the lens
    #[arg(long, value_name = "N", default_value_t = 8.0)]
    f_number: f64,
}

/// COLUMNSxROWS.
#[derive(Clone, Copy)]
struct Pixels([u32; 2]);

impl std::str::FromStr for Pixels {
    type Err = String;
    fn from_str(s: &str) -> std::result::Result<Pixels, String> {
        let parsed = s.split_once('x').and_then(|(a, b)| Some([a.parse().ok()?, b.parse().ok()?]));
        let sound = parsed.filter(|size: &[u32; 2]| size.iter().all(|n| (16..=65_535).contains(n)));
        sound.map(Pixels).ok_or_else(|| format!("'{s}' is not a picture size: write 640x480, each 16 to 65535"))
    }
}

pub fn run(command: &Command, console: &Console) -> Result<()> {
    let Command::Plan(a) = command;
    let pixels = a.pixels.0;
    let of_view = |view| RigPlan::focal_for(view, pixels[0], a.pixel_um, a.distance_mm);
    let plan = RigPlan {
        pixels,
        pixel_um: a.pixel_um,
        focal_mm: a.focal_mm.or(a.view_mm.map(of_view)).expect("clap requires one"),
        distance_mm: a.distance_mm,
        angle_deg: a.angle_deg.unwrap_or(45.0),
        f_number: a.f_number,
    };
    let plan = a.scatter_mm.map_or(Ok(plan), |mm| plan.with_scatter(mm))?;
    let forecast = plan.forecast()?;
    let focal = a.view_mm.map(|_| format!("focal length        {:.2} mm\n", plan.focal_mm));
    let angle = a.scatter_mm.map(|_| format!("angle               {:.1} degrees\n", plan.angle_deg));
    let chosen = [focal, angle].into_iter().flatten().collect::<String>();
    console.result(&Planned { plan, forecast: &forecast }, &(chosen + &text(&plan, &forecast)));
    Ok(())
}

/// The design with its forecast, as JSON.
#[derive(serde::Serialize)]
struct Planned<'a> {
    #[serde(flatten)]
    plan: RigPlan,
    #[serde(flatten)]
    forecast: &'a RigForecast,
}

fn text(plan: &RigPlan, f: &RigForecast) -> String {
    let range = |(near, far): (f64, Option<f64>)| match far {
        Some(far) => format!("{near:.1} to {far:.1} mm"),
        None => format!("from {near:.1} mm on"),
    };
    [
        format!("a pixel sees        {:.4} mm", f.pixel_mm),
        format!("the picture sees    {:.1} x {:.1} mm", f.view_mm[0], f.view_mm[1]),
        format!("depth per pixel     {:.4} mm", f.depth_per_pixel_mm),
        format!("scatter of a point  {:.4} to {:.4} mm (1 sigma, clean stripe)", f.scatter_mm[0], f.scatter_mm[1]),
        format!("stripe in view      {}", range(f.stripe_mm)),
        format!("sharp to a pixel    {} at f/{}", range(f.sharp_mm), plan.f_number),
        format!("works at            {}", range(f.works_mm())),
        format!("laser               {:.1} mm beside the lens, level with it", plan.distance_mm * f.shadow_mm),
        format!("shadow              {:.2} mm behind a step of 1 mm", f.shadow_mm),
    ]
    .join("\n")
}
