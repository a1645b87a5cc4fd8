//! In: recordings, a station, a recipe. Out: a scan of each and the part found in it, one after the other; a table,
//! and the repeatability of the poses.
//! Frame and unit: the scans' frame; mm, degrees.

use crate::cli::terminal::arguments::{changes, parse};
use crate::cli::terminal::console::Console;
use crate::cli::terminal::interrupt;
use crate::cli::terminal::outputs::{self, Inputs};
use crate::fault::{Fault, Result};
use crate::find::{Accelerator, LocateOptions, Recipe};
use crate::robot::Convention;
use crate::scan::Where;
use crate::station::{Batch, BatchOptions, BatchRow, Settings, Spread, batch};
use std::path::PathBuf;

/// Scan several recordings, find a part in each, report how the poses repeat
///
/// Writes a scan folder for each recording, found.json and found.png beside it, and batch.json and batch.csv for all.
/// If the part stood still between the recordings, the scatter of its poses stands beside the stated sigmas. A
/// recording that fails is named with its reason, the others continue, and the exit code is 1.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight batch recordings/a recordings/b recordings/c --station cell3 \\
      --recipe data/recipes/led.toml --set threshold.minimum=14 --out batch1
Guide: docs/finding-and-inserting.md")]
pub struct Args {
    /// Recording folders, scanned in this order
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// Station folder with the calibration
    #[arg(long)]
    station: PathBuf,
    /// Recipe (TOML) of the part; without it the recordings are only scanned
    #[arg(long)]
    recipe: Option<PathBuf>,
    /// Change a setting of [extraction]; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<String>,
    /// Folder for scans and tables
    #[arg(long)]
    out: PathBuf,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = parse::<Where>)]
    on: Where,
    /// Notation of the poses (docs/conventions.md) [default: the station's, else matrix]
    #[arg(long, value_parser = parse::<Convention>)]
    robot: Option<Convention>,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let files: Vec<_> = args.recipe.iter().map(PathBuf::as_path).collect();
    outputs::check(&[&args.out], &Inputs { files: &files, station: Some(&args.station), ..Inputs::default() })?;
    let of_station = Settings::load(&args.station)?.robot;
    let robot = args.robot.or(of_station).unwrap_or(Convention::Matrix);
    let options = BatchOptions {
        station: args.station.clone(),
        recordings: args.recordings.clone(),
        recipe: args.recipe.as_deref().map(Recipe::load).transpose()?,
        out: args.out.clone(),
        settings: changes(&args.settings)?,
        place: args.on,
        locate: LocateOptions { robot, accelerator: Accelerator::open(), ..LocateOptions::default() },
        stop: interrupt::asked_for(),
    };
    let done = batch(&options, |row| console.say(line(row)))?;
    console.result(&done, &text(&done));
    console.say(format!("see {}", args.out.join("batch.csv").display()));
    let failed = done.rows.iter().filter(|r| r.problem.is_some()).count();
    if failed == 0 {
        return Ok(());
    }
    Err(Fault::refused(format!("{failed} of {} recordings gave no pose", done.rows.len()))
        .cause("the reason beside each of them")
        .next("look at the table; their scans are stored"))
}

fn line(r: &BatchRow) -> String {
    let mut s = r.scan.clone();
    if let Some(n) = r.points {
        s += &format!(": {n} points");
    }
    s += &r.median_sigma_mm.map_or(String::new(), |mm| format!(", sigma {mm:.4} mm"));
    if let Some(f) = &r.found {
        let [x, y, z] = [3, 7, 11].map(|k| f.part[k]);
        s += &format!("; at {x:.3} {y:.3} {z:.3} mm, score {:.3}", f.score);
    }
    s + &r.problem.as_ref().map_or(String::new(), |why| format!("; {why}"))
}

fn text(b: &Batch) -> String {
    let mut lines: Vec<String> = b.rows.iter().map(line).collect();
    if let Some(r) = &b.repeats {
        lines.push(format!("{} places; 1 sigma of them, what they state, from the first to the last", r.places));
        lines.extend(r.along.iter().map(spread));
    }
    lines.join("\n")
}

/// Figures and a small histogram.
fn spread(s: &Spread) -> String {
    const HEIGHTS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let most = s.bars.iter().max().copied().unwrap_or(1).max(1);
    let bars: String = s.bars.iter().map(|n| HEIGHTS[(n * 8).div_ceil(most) as usize]).collect();
    format!(
        "{:5} {:8.4} {:8.4} {:8.4} {:7}  -{:.4} |{bars}| +{:.4}",
        s.name, s.scatter, s.stated, s.apart, s.unit, s.half, s.half
    )
}
