//! In: a scan folder and where the part's outline, windows and holes lie in its height map. Out: a
//! recipe, proven on that scan, and a picture of the proof.
//! Frame and unit: height map's grid frame, mm from its corner.

use crate::cli::insertion::InsertionArgs;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::outputs;
use crate::cli::terminal::outputs::Inputs;
use crate::fault::Result;
use crate::find::insert::teach::TeachOptions;
use crate::station::teach_part;
use std::path::PathBuf;

/// Teach a new part: from one scan and a few numbers to a recipe
///
/// The numbers are millimetres in the height map that scan.json and height.png show (from its corner,
/// x along columns, y along rows), to half a millimetre; the points give the exact dimensions.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight teach scans/board7 --name relay --outline 84,20,104.4,32.8 --window 89,24,99.4,28.4 \\
      --hole 86.5,22.5,0.72 --hole 101.7,30.2,0.72 --out relay.toml")]
pub struct Args {
    /// Folder that sheetlight scan --out wrote
    scan: PathBuf,
    /// A name for the part
    #[arg(long)]
    name: String,
    /// Corners of the body before it is turned, mm: x0,y0,x1,y1
    #[arg(long, value_parser = crate::cli::terminal::arguments::numbers::<4>)]
    outline: [f64; 4],
    /// Turn of the body about its centre from x towards y, degrees
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    angle_deg: f64,
    /// Corners of a window in the body, mm, several times: x0,y0,x1,y1
    #[arg(long = "window", value_parser = crate::cli::terminal::arguments::numbers::<4>)]
    windows: Vec<[f64; 4]>,
    /// A round hole, mm, several times: x,y,radius
    #[arg(long = "hole", value_parser = crate::cli::terminal::arguments::numbers::<3>)]
    holes: Vec<[f64; 3]>,
    #[command(flatten)]
    insertion: InsertionArgs,
    /// File for the recipe (TOML); the picture goes beside it with .png
    #[arg(long)]
    out: PathBuf,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let image = args.out.with_extension("png");
    outputs::check(&[&args.out, &image], &Inputs { scans: &[&args.scan], ..Inputs::default() })?;
    let options = TeachOptions {
        name: args.name.clone(),
        outline: args.outline,
        angle_deg: args.angle_deg,
        windows: args.windows.clone(),
        holes: args.holes.clone(),
        insertion: args.insertion.spec(),
    };
    let (recipe, proof, picture) = teach_part(&args.scan, &options)?;
    let text = toml::to_string(&recipe).expect("plain data");
    crate::files::write_beside((&args.out, text.as_bytes()), &[(&image, &picture.to_png())])?;
    if !proof.passed {
        console.warn(format!("the taught part misses a gate on its own scan: {}", proof.reasons.join("; ")));
    }
    console.result(&recipe, &format!("{text}\n{}", crate::cli::find::locate::summary(&proof)));
    console.say(format!("see {} and {}", args.out.display(), image.display()));
    Ok(())
}
