//! In: a recording of a part that was passed back and forth, paired by clock. Out: the delay of pictures relative
//! to poses, stored in the station.
//! Frame and unit: ms.

use crate::cli::terminal::console::Console;
use sheetlight::fault::Result;
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::Where;
use sheetlight::station::{Settings, calibrate_latency};
use std::path::PathBuf;

/// Find the delay between picture times and pose times
///
/// A part with slopes, or with edges slanted to the stripe, is passed back and forth at a steady speed and recorded
/// with --pair clock. A delay shifts the part one way on the way there and the other way on the way back. The delay
/// that brings both together is stored as calibration/latency.json of the station. record and scan apply it to
/// pictures that are paired by clock.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight record --camera gige://first --pair clock --pose-stream bcap://10.0.0.2 \\
      --out recordings/back-and-forth
  sheetlight calibrate latency recordings/back-and-forth --station cell3
Guide: docs/live.md")]
pub struct Args {
    /// Recording folder
    recording: PathBuf,
    /// Station folder
    #[arg(long)]
    station: PathBuf,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = crate::cli::terminal::arguments::parse::<Where>)]
    on: Where,
    /// Print the result and store nothing
    #[arg(long)]
    dry_run: bool,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let recording = Recording::open(&args.recording)?;
    let (settings, rig) = (Settings::load(&args.station)?, Rig::load(&args.station)?);
    let bar = console.bar("shots", 0);
    let found = calibrate_latency(&recording, &rig, &settings, args.on, |done, of| {
        bar.set_length(of.unwrap_or(done) as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    if !args.dry_run {
        found.latency.store(&args.station)?;
    }
    let (l, b) = (&found.latency, &found.beyond);
    let speeds: Vec<String> = b.speeds.iter().map(|v| format!("{v:.1}")).collect();
    let text = format!(
        "the pictures are {:.3} ms late, sigma {:.3} ms ({:+.3} ms against the delay assumed so far)\n\
         {} shots in {} passes at {} mm/s; their heights differed by {:.4} mm before the correction, and by {:.4} mm \
         after it",
        l.delay_ms,
        l.sigma_ms,
        1e3 * b.seconds,
        found.shots,
        b.speeds.len(),
        speeds.join(", "),
        b.apart_mm[0],
        b.apart_mm[1]
    );
    console.result(&found, &text);
    Ok(())
}
