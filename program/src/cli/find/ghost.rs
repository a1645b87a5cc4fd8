//! In: a report of find, its recipe, a recording with robot poses. Out: the part's outlines over one of its
//! pictures.
//! Frame and unit: base frame, mm; px of the picture.

use crate::cli::terminal::console::Console;
use crate::cli::terminal::outputs;
use crate::cli::terminal::outputs::Inputs;
use sheetlight::fault::{Fault, Result};
use sheetlight::find::Recipe;
use sheetlight::raster::RgbImage;
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::station::{Lies, ghost};
use std::path::PathBuf;

const COLOUR: [u8; 3] = [0, 230, 255];

/// Draw a found part into a picture of the robot's camera
///
/// The outlines lie where found pose, hand-eye and camera place them. If they lie beside the part, one of these is
/// wrong. Any picture of the same station with a robot pose can be used; a picture from another side than the scan is
/// an independent check.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight ghost led.json --recipe data/recipes/led.toml --recording recordings/board7 \\
      --station cell3 --out ghost.png
Guide: docs/operator.md")]
pub struct Args {
    /// Report from sheetlight find --out
    found: PathBuf,
    /// Recipe of the found part
    #[arg(long)]
    recipe: PathBuf,
    /// Recording with the robot's poses
    #[arg(long)]
    recording: PathBuf,
    /// Frame of the recording, from 0 [default: the one with the part closest to the picture's middle]
    #[arg(long)]
    frame: Option<usize>,
    /// Pose file of the recording, if it has several
    #[arg(long)]
    poses: Option<String>,
    /// Station folder
    #[arg(long)]
    station: PathBuf,
    /// File for the picture (PNG)
    #[arg(long)]
    out: PathBuf,
}

/// The output of --json.
#[derive(serde::Serialize)]
struct Drawn {
    frame: usize,
    picture: String,
    /// Share of the outlines' points that lie in the picture.
    inside: f64,
    lines_px: Vec<Vec<[f64; 2]>>,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let files = [args.found.as_path(), args.recipe.as_path()];
    outputs::check(&[&args.out], &Inputs { files: &files, station: Some(&args.station), ..Inputs::default() })?;
    let (lies, recipe, rig) = (Lies::load(&args.found)?, Recipe::load(&args.recipe)?, Rig::load(&args.station)?);
    if lies.recipe != recipe.name {
        return Err(Fault::usage(format!(
            "{}: found '{}', the recipe is '{}'",
            args.found.display(),
            lies.recipe,
            recipe.name
        ))
        .next("give the recipe that was looked for"));
    }
    let (recording, drawing) = (Recording::open(&args.recording)?, recipe.drawing());
    let poses = recording.poses(args.poses.as_deref())?;
    let size = [recording.meta.image.width, recording.meta.image.height].map(f64::from);
    let seen = |k: usize| ghost(&lies, &drawing, &rig, recording.pose_of(k, &poses)?);
    let frames = recording.meta.frames.len();
    let frame = match args.frame {
        Some(k) => k,
        None => {
            let aside = (0..frames).map(|k| Ok((k, aside(&seen(k)?, size)))).collect::<Result<Vec<_>>>()?;
            aside.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(k, _)| k)
        }
    };
    let Some(picture) = recording.meta.frames.get(frame).and_then(|f| f.ambient.as_ref().or(f.laser.as_ref())) else {
        return Err(Fault::usage(format!("frame {frame} of {frames} has no picture")).next("choose another --frame"));
    };
    let lines_px = seen(frame)?;
    let mut image = RgbImage::from_grey(&recording.picture(picture)?);
    for pair in lines_px.iter().flat_map(|l| l.windows(2)) {
        image.line((pair[0][0], pair[0][1]), (pair[1][0], pair[1][1]), COLOUR);
    }
    image.save_png(&args.out)?;
    let all: Vec<_> = lines_px.iter().flatten().collect();
    let within = |p: &&&[f64; 2]| (0.0..size[0]).contains(&p[0]) && (0.0..size[1]).contains(&p[1]);
    let inside = all.iter().filter(within).count() as f64 / all.len().max(1) as f64;
    let said =
        format!("'{}' over {picture} (frame {frame}): {:.0} % of it in the picture", lies.recipe, 100.0 * inside);
    console.result(&Drawn { frame, picture: picture.clone(), inside, lines_px }, &said);
    console.say(format!("see {}", args.out.display()));
    Ok(())
}

/// Distance of the outlines' middle from the picture's middle, px; infinite if nothing is visible.
fn aside(lines: &[Vec<[f64; 2]>], size: [f64; 2]) -> f64 {
    let n = lines.iter().map(Vec::len).sum::<usize>() as f64;
    let middle = [0, 1].map(|i| lines.iter().flatten().map(|p| p[i]).sum::<f64>() / n);
    if n > 0.0 { (middle[0] - size[0] / 2.0).hypot(middle[1] - size[1] / 2.0) } else { f64::INFINITY }
}
