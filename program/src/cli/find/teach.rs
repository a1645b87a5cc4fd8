//! In: a scan folder and the part's outline, windows and holes in its height map, or a region of a map or a picture.
//! Out: a recipe, tested on that scan, and a picture of the result; or a template for `match` and a picture of its
//! edges.
//! Frame and unit: height map's grid frame, mm from its corner; pixels of the picture.

use super::matching::{Pictured, taught_map, whole_region};
use crate::cli::insertion::InsertionArgs;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::outputs;
use crate::cli::terminal::outputs::Inputs;
use sheetlight::fault::{Fault, Result};
use sheetlight::find::insert::teach::TeachOptions;
use sheetlight::find::search::picture::draw_model;
use sheetlight::find::{Accelerator, Example, ModelOptions, Template, teach_examples};
use sheetlight::raster::{Channel, Image};
use sheetlight::station::teach_part;
use std::path::{Path, PathBuf};

/// Make a recipe from a scan and a few numbers
///
/// The numbers are millimetres in the height map that scan.json and height.png show (from its corner, x along
/// columns, y along rows). Half a millimetre is close enough; the points give the exact dimensions.
///
/// With --region a part is taught by example: the region of a picture, or of a scan's height map, becomes a template.
/// sheetlight match then finds it in other pictures or in other scans. Of several pictures the first shows the region;
/// edges and grey levels that vary in the others do not count.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight teach board.png --name relay --region 210,90,64,40 --out relay.json
  sheetlight teach a.png b.png c.png --name relay --region 210,90,64,40 --out relay.json
  sheetlight teach scans/plate --name star --region 300,220,180,180 --out star.json
  sheetlight teach scans/board7 --name relay --outline 84,20,104.4,32.8 --window 89,24,99.4,28.4 \\
      --hole 86.5,22.5,0.72 --hole 101.7,30.2,0.72 --out relay.toml
Guide: docs/finding-and-inserting.md")]
pub struct Args {
    /// Folder from sheetlight scan --out; with --region also a picture, or several pictures of the part
    #[arg(required = true, value_name = "SCAN")]
    scans: Vec<PathBuf>,
    /// Name of the part
    #[arg(long)]
    name: String,
    /// Part in the picture or map, px: x,y of the top left pixel, width, height
    #[arg(long, value_name = "X,Y,W,H", value_parser = crate::cli::terminal::arguments::numbers::<4>,
        conflicts_with_all = ["outline", "angle_deg", "windows", "holes"])]
    region: Option<[f64; 4]>,
    /// With --region: white or opaque where it counts; of the picture's or the region's size
    #[arg(long, value_name = "PICTURE", requires = "region")]
    mask: Option<PathBuf>,
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
    let [scan] = &args.scans[..] else {
        return Err(Fault::usage(format!("{} scans for an outline; allowed: 1", args.scans.len()))
            .cause("several examples of a part are taught from pictures")
            .next("give one scan, or pictures with --region"));
    };
    outputs::check(&[&args.out, &image], &Inputs { scans: &[scan], ..Inputs::default() })?;
    let options = TeachOptions {
        name: args.name.clone(),
        outline,
        angle_deg: args.angle_deg,
        windows: args.windows.clone(),
        holes: args.holes.clone(),
        insertion: args.insertion.spec(),
    };
    let (recipe, proof, picture) = teach_part(scan, &options)?;
    let text = toml::to_string(&recipe).expect("plain data");
    sheetlight::files::write_beside((&args.out, text.as_bytes()), &[(&image, &picture.to_png())])?;
    if !proof.passed {
        console.warn(format!("the taught part misses a gate on its own scan: {}", proof.reasons.join("; ")));
    }
    console.result(&recipe, &format!("{text}\n{}", crate::cli::find::locate::summary(&proof)));
    console.say(format!("see {} and {}", args.out.display(), image.display()));
    Ok(())
}

/// Teaches a template from the picture's region, or from several pictures.
fn template(args: &Args, picture: &Path, console: &Console) -> Result<()> {
    let inputs = args.scans.iter().chain(&args.mask).map(PathBuf::as_path);
    let (scans, files): (Vec<&Path>, Vec<&Path>) = inputs.partition(|path| path.is_dir());
    outputs::check(&[&args.out, picture], &Inputs { files: &files, scans: &scans, ..Inputs::default() })?;
    let (template, image) = taught(args)?;
    let [x, y, w, h] = template.region_px.map(f64::from);
    let drawn = draw_model(&image, &template.model, [x + 0.5 * (w - 1.0), y + 0.5 * (h - 1.0)]);
    let text = serde_json::to_string_pretty(&template).expect("plain data");
    sheetlight::files::write_beside((&args.out, text.as_bytes()), &[(picture, &drawn.to_png())])?;
    console.result(&template, &summary(&template));
    console.say(format!("see {} and {}", args.out.display(), picture.display()));
    Ok(())
}

/// The template and the picture that shows its region.
fn taught(args: &Args) -> Result<(Template, Image)> {
    let options = ModelOptions { contrast: args.contrast, ..ModelOptions::default() };
    let region = whole_region(args.region)?;
    let mask = args.mask.as_deref();
    if let Some(scan) = args.scans.iter().find(|path| path.is_dir()) {
        if args.scans.len() > 1 {
            return Err(Fault::usage(format!("{} is a scan among several examples", scan.display()))
                .cause("several examples of a part are taught from pictures")
                .next("give pictures, or one scan"));
        }
        return taught_map(scan, &args.name, region, mask, &options);
    }
    let load = |(k, path): (usize, &PathBuf)| {
        let (mask, region) = if k == 0 { (mask, region) } else { (None, None) };
        Pictured::load(path, (args.channel, args.bits), mask, region)
    };
    let mut pictures: Vec<Pictured> = args.scans.iter().enumerate().map(load).collect::<Result<_>>()?;
    let examples: Vec<Example> = pictures.iter().map(Pictured::example).collect();
    let accelerator = if examples.len() > 1 { Accelerator::open() } else { None };
    let template = teach_examples(&args.name, &examples, region, &options, accelerator.as_ref());
    let template = template.map_err(|e| e.at(args.scans[0].display()))?;
    Ok((template, pictures.swap_remove(0).image))
}

fn summary(t: &Template) -> String {
    let (edges, levels) = (t.model.levels[0].len(), t.model.levels.len());
    let mut said = format!("{}: {edges} edges on {levels} levels, radius {:.1} px", t.name, t.model.radius);
    for e in &t.examples {
        let correlation = e.correlation.map_or("none".into(), |c| format!("{c:.3}"));
        said += &format!(
            "\n{}: at {:.2} {:.2} px, {:.2} degrees, score {:.3}, correlation {correlation}",
            e.picture, e.x_px, e.y_px, e.angle_deg, e.score
        );
    }
    if let Some([stayed, all]) = t.confirmed {
        let share = t
            .levels
            .as_ref()
            .map_or(0.0, |l| l.values.iter().filter(|v| **v > 0).count() as f64 / l.values.len() as f64);
        said += &format!(
            "\n{stayed} of {all} edge points of the first example stayed, and {:.1} % of its pixels",
            100.0 * share
        );
    }
    said
}
