//! In: a scan folder and the part's outline, windows and holes in its height map, or a region of a map or a picture.
//! Out: a recipe, tested on that scan, and a picture of the result; or a template for `match` and a picture of its
//! edges.
//! Frame and unit: height map's grid frame, mm from its corner; pixels of the picture.

use super::matching::taught;
use crate::cli::insertion::InsertionArgs;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::outputs;
use crate::cli::terminal::outputs::Inputs;
use sheetlight::fault::Result;
use sheetlight::find::ModelOptions;
use sheetlight::find::insert::teach::TeachOptions;
use sheetlight::find::search::picture::draw_model;
use sheetlight::raster::Channel;
use sheetlight::station::teach_part;
use std::path::{Path, PathBuf};

/// Make a recipe from a scan and a few numbers
///
/// The numbers are millimetres in the height map that scan.json and height.png show (from its corner, x along
/// columns, y along rows). Half a millimetre is close enough; the points give the exact dimensions.
///
/// With --region a part is taught by example: the region of a picture, or of a scan's height map, becomes a template.
/// sheetlight match then finds it in other pictures or in other scans.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight teach board.png --name relay --region 210,90,64,40 --out relay.json
  sheetlight teach scans/plate --name star --region 300,220,180,180 --out star.json
  sheetlight teach scans/board7 --name relay --outline 84,20,104.4,32.8 --window 89,24,99.4,28.4 \\
      --hole 86.5,22.5,0.72 --hole 101.7,30.2,0.72 --out relay.toml
Guide: docs/finding-and-inserting.md")]
pub struct Args {
    /// Folder from sheetlight scan --out; with --region a picture too
    scan: PathBuf,
    /// Name of the part
    #[arg(long)]
    name: String,
    /// Part in the picture or map, px: x,y of the top left pixel, width, height
    #[arg(long, value_name = "X,Y,W,H", value_parser = crate::cli::terminal::arguments::numbers::<4>,
        conflicts_with_all = ["outline", "angle_deg", "windows", "holes"])]
    region: Option<[f64; 4]>,
    /// With --region: weakest edge as a share of the strong ones
    #[arg(long, requires = "region", default_value_t = ModelOptions::default().contrast)]
    contrast: f64,
    /// With --region: channel of a colour picture: red, green, blue or luma
    #[arg(long, requires = "region", default_value = "luma",
        value_parser = crate::cli::terminal::arguments::parse::<Channel>)]
    channel: Channel,
    /// With --region: depth of the picture, 8 to 16 bits
    #[arg(long, requires = "region", default_value_t = 8, value_parser = clap::value_parser!(u8).range(8..=16))]
    bits: u8,
    /// Corners of the unturned body, mm: x0,y0,x1,y1
    #[arg(long, value_parser = crate::cli::terminal::arguments::numbers::<4>, required_unless_present = "region")]
    outline: Option<[f64; 4]>,
    /// Turn of the body about its centre, x towards y, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    angle_deg: f64,
    /// Corners of a window in the body, mm: x0,y0,x1,y1; may be repeated
    #[arg(long = "window", value_parser = crate::cli::terminal::arguments::numbers::<4>)]
    windows: Vec<[f64; 4]>,
    /// Round hole, mm: x,y,radius; may be repeated
    #[arg(long = "hole", value_parser = crate::cli::terminal::arguments::numbers::<3>)]
    holes: Vec<[f64; 3]>,
    #[command(flatten)]
    insertion: InsertionArgs,
    /// File for the recipe (TOML) or template (JSON); a picture (.png) is written beside it
    #[arg(long)]
    out: PathBuf,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let image = args.out.with_extension("png");
    let Some(outline) = args.outline else { return template(args, &image, console) };
    outputs::check(&[&args.out, &image], &Inputs { scans: &[&args.scan], ..Inputs::default() })?;
    let options = TeachOptions {
        name: args.name.clone(),
        outline,
        angle_deg: args.angle_deg,
        windows: args.windows.clone(),
        holes: args.holes.clone(),
        insertion: args.insertion.spec(),
    };
    let (recipe, proof, picture) = teach_part(&args.scan, &options)?;
    let text = toml::to_string(&recipe).expect("plain data");
    sheetlight::files::write_beside((&args.out, text.as_bytes()), &[(&image, &picture.to_png())])?;
    if !proof.passed {
        console.warn(format!("the taught part misses a gate on its own scan: {}", proof.reasons.join("; ")));
    }
    console.result(&recipe, &format!("{text}\n{}", crate::cli::find::locate::summary(&proof)));
    console.say(format!("see {} and {}", args.out.display(), image.display()));
    Ok(())
}

/// Teaches a template from the picture's region.
fn template(args: &Args, picture: &Path, console: &Console) -> Result<()> {
    let source: &[&Path] = &[&args.scan];
    let (files, scans) = if args.scan.is_dir() { (&[][..], source) } else { (source, &[][..]) };
    outputs::check(&[&args.out, picture], &Inputs { files, scans, ..Inputs::default() })?;
    let options = ModelOptions { contrast: args.contrast, ..ModelOptions::default() };
    let (template, image) = taught(&args.scan, &args.name, args.region, (args.channel, args.bits), &options)?;
    let [x, y, w, h] = template.region_px.map(f64::from);
    let drawn = draw_model(&image, &template.model, [x + 0.5 * (w - 1.0), y + 0.5 * (h - 1.0)]);
    let text = serde_json::to_string_pretty(&template).expect("plain data");
    sheetlight::files::write_beside((&args.out, text.as_bytes()), &[(picture, &drawn.to_png())])?;
    let edges = template.model.levels[0].len();
    let said = format!(
        "{}: {edges} edges on {} levels, radius {:.1} px",
        template.name,
        template.model.levels.len(),
        template.model.radius
    );
    console.result(&template, &said);
    console.say(format!("see {} and {}", args.out.display(), picture.display()));
    Ok(())
}
