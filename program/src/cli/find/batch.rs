//! In: a manifest or recordings, a station, a recipe. Out: results of each recording, a line of JSON each on standard
//! output; tables, and how the poses repeat.
//! Frame and unit: the scans' frame; mm, degrees.

use crate::cli::terminal::arguments::{changes, parse};
use crate::cli::terminal::console::Console;
use crate::cli::terminal::interrupt;
use crate::cli::terminal::outputs::{self, Inputs};
use sheetlight::fault::{Fault, Result};
use sheetlight::find::{Accelerator, LocateOptions};
use sheetlight::robot::Convention;
use sheetlight::scan::Where;
use sheetlight::station::{
    BatchLine, BatchOptions, Manifest, Merged, Repeats, Settings, Shard, Spread, State, batch, manifest_of, merge, plan,
};
use std::path::{Path, PathBuf};

/// Scan an archive of recordings, find a part in each, write tables of all
///
/// The results of a recording go into a folder in OUT/results. Its name is a hash of the recording, station, recipe and
/// settings: a recording with results is not scanned again, and equal inputs give equal bytes. Each recording is a line
/// of JSON on stdout. Exit code 0: all done; 1: some failed, the others continue; 2: wrong use.
///
/// A whole run also writes the tables: recordings, shots, matches and figures (Parquet), recordings.csv, and
/// repeats.json with the scatter of the poses. Runs with --shard leave that to `sheetlight batch merge OUT`.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = "Example:
  sheetlight batch manifest archive --out archive/manifest.txt
  sheetlight batch archive/manifest.txt --station cell3 --out batch1 --shard 1/2
  sheetlight batch archive/manifest.txt --station cell3 --out batch1 --shard 2/2
  sheetlight batch merge batch1
  sheetlight batch recordings/a recordings/b --station cell3 --out batch2 \\
      --recipe data/recipes/led.toml --set threshold.minimum=14
Guide: docs/archives.md")]
pub struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    /// A manifest, or the folders of recordings, scanned in this order
    #[arg(required = true, value_name = "MANIFEST|RECORDING")]
    inputs: Vec<PathBuf>,
    /// Station folder with the calibration
    #[arg(long, required = true)]
    station: Option<PathBuf>,
    /// Recipe (TOML) of the part; without it the recordings are only scanned
    #[arg(long)]
    recipe: Option<PathBuf>,
    /// Change a setting of [extraction]; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<String>,
    /// Folder for results and tables
    #[arg(long, required = true)]
    out: Option<PathBuf>,
    /// Exclude pictures that cannot be read; figures.parquet counts them as skipped_shots
    #[arg(long)]
    skip_bad: bool,
    /// Scan the i-th of n shares of the manifest
    #[arg(long, value_name = "i/n", value_parser = parse::<Shard>)]
    shard: Option<Shard>,
    /// Check manifest, station and OUT, and scan nothing
    #[arg(long, conflicts_with = "shard")]
    plan: bool,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = parse::<Where>)]
    on: Where,
    /// Notation of the poses (docs/conventions.md) [default: the station's, else matrix]
    #[arg(long, value_parser = parse::<Convention>)]
    robot: Option<Convention>,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Write the tables of a batch from its results
    Merge {
        /// Folder that the batch was written into
        out: PathBuf,
    },
    /// List recordings with their hashes
    Manifest {
        /// Recordings, or folders above them
        #[arg(required = true)]
        folders: Vec<PathBuf>,
        /// File for the list; recordings are named from its folder
        #[arg(long)]
        out: PathBuf,
    },
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    match (&args.command, &args.station, &args.out) {
        (Some(Command::Merge { out }), ..) => merged(out, console),
        (Some(Command::Manifest { folders, out }), ..) => listed(folders, out, console),
        (None, Some(station), Some(out)) => scanned(args, station, out, console),
        _ => Err(Fault::usage("a station and a folder for results are needed").next("give --station and --out")),
    }
}

fn listed(folders: &[PathBuf], out: &Path, console: &Console) -> Result<()> {
    let root = out.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let text = manifest_of(folders, root)?;
    sheetlight::files::write(out, text.as_bytes())?;
    console.say(format!("{}: {} recordings", out.display(), text.lines().count()));
    Ok(())
}

fn scanned(args: &Args, station: &Path, out: &Path, console: &Console) -> Result<()> {
    let files: Vec<_> = args.recipe.iter().chain(&args.inputs).map(PathBuf::as_path).collect();
    outputs::check(&[out], &Inputs { files: &files, station: Some(station), ..Inputs::default() })?;
    let robot = args.robot.or(Settings::load(station)?.robot).unwrap_or(Convention::Matrix);
    let options = BatchOptions {
        station: station.to_owned(),
        recipe: args.recipe.clone(),
        out: out.to_owned(),
        settings: changes(&args.settings)?,
        place: args.on,
        skip_bad: args.skip_bad,
        locate: LocateOptions { robot, accelerator: accelerator(args), ..LocateOptions::default() },
        stop: interrupt::asked_for(),
    };
    let mut unreadable = 0;
    let manifest = manifest(&args.inputs, |folder, fault| {
        unreadable += 1;
        show(&BatchLine::failed(&folder.to_string_lossy(), &fault), console);
    })?;
    if args.plan {
        console.line(&plan(&manifest, &options)?);
        return Ok(());
    }
    let tally = batch(&manifest, args.shard.unwrap_or(Shard::WHOLE), &options, |line| show(line, console))?;
    if args.shard.is_none() {
        tables(&merge(out)?, out, console);
    }
    let bad = tally.refused + tally.failed + unreadable;
    if bad == 0 {
        return Ok(());
    }
    Err(Fault::refused(format!(
        "{bad} of {} recordings have no result to use: {}",
        tally.recordings() + unreadable,
        words(&tally)
    ))
    .cause("the reason stands beside each of them")
    .next(
        "look at those lines; the next run scans missing and changed recordings again, refused ones only with other \
             settings, station or recipe",
    ))
}

/// A GPU where one may be used and something is looked for.
fn accelerator(args: &Args) -> Option<Accelerator> {
    let wanted = args.on != Where::Cpu && args.recipe.is_some() && !args.plan;
    if wanted { Accelerator::open() } else { None }
}

fn words(tally: &sheetlight::station::Tally) -> String {
    format!("{} refused (no cloud or no pose), {} missing or changed", tally.refused, tally.failed)
}

fn manifest(inputs: &[PathBuf], failed: impl FnMut(&Path, Fault)) -> Result<Manifest> {
    match inputs.iter().find(|p| p.is_file()) {
        None => Manifest::of(inputs, failed),
        Some(file) if inputs.len() == 1 => Manifest::open(file),
        Some(file) => Err(Fault::usage(format!("{}: a file among {} inputs", file.display(), inputs.len()))
            .cause("a manifest stands alone, recordings are folders")
            .next("give one manifest, or folders only")),
    }
}

fn merged(out: &Path, console: &Console) -> Result<()> {
    let merged = merge(out)?;
    console.line(&serde_json::json!({
        "recordings": merged.recordings, "refused": merged.refused, "missing": merged.missing,
        "shots": merged.rows[0], "matches": merged.rows[1], "figures": merged.rows[2],
    }));
    tables(&merged, out, console);
    match &merged.first_missing {
        None => Ok(()),
        Some(first) => {
            let (missing, all) = (merged.missing, merged.recordings);
            Err(Fault::refused(format!("{missing} of {all} recordings have no results; the first is {first}"))
                .cause("a shard was not run or was stopped, or these recordings are missing or changed")
                .next("run the shards again, then merge again; the tables have what is there"))
        }
    }
}

fn tables(merged: &Merged, out: &Path, console: &Console) {
    if let Some(r) = &merged.repeats {
        console.say(repeated(r));
    }
    console.say(format!("see {}", out.join("recordings.csv").display()));
}

/// The line as data, and as talk. False where nobody reads the data.
fn show(line: &BatchLine, console: &Console) -> bool {
    let read = console.line(line);
    console.say(talk(line));
    read
}

fn talk(line: &BatchLine) -> String {
    let mut s = line.recording.clone();
    if let Some(n) = line.points {
        s += &format!(": {n} points");
    }
    s += &line.median_sigma_mm.map_or(String::new(), |mm| format!(", sigma {mm:.4} mm"));
    if let Some(f) = &line.found {
        let [x, y, z] = [3, 7, 11].map(|k| f.part[k]);
        s += &format!("; at {x:.3} {y:.3} {z:.3} mm, score {:.3}", f.score);
    }
    if line.state != State::Failed && !line.made {
        s += "; it was there";
    }
    s + &line.problem.as_ref().map_or(String::new(), |p| format!("; {}", p.what))
}

fn repeated(r: &Repeats) -> String {
    let head = format!("{} poses that passed; their 1 sigma, what they state, between the two extremes", r.places);
    std::iter::once(head).chain(r.along.iter().map(spread)).collect::<Vec<_>>().join("\n")
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
