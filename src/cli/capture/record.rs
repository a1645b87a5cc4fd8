//! In: a running camera and what moves. Out: a recording; the account of every picture.
//! Frame and unit: docs/file-formats.md.

use super::options::Capture;
use crate::capture::record::{RecordReport, Recorder, RecorderOptions, Shows, Store, record};
use crate::capture::{Mode, RawFormat};
use crate::cli::terminal::arguments::parse;
use crate::cli::terminal::console::Console;
use crate::fault::{Fault, Result};
use crate::recording::BoardSpec;
use std::path::PathBuf;

/// Record a running camera: every picture in order, with its pose
///
/// Ends after --shots, --seconds, or Ctrl-C. The recording can be opened at any moment, also after a crash. The
/// account lists every picture that the camera sent: complete, incomplete, missed, late, dropped (queue, disk) or
/// unpaired. Pictures without a pose are excluded and listed in left_out.json.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight record --camera gige://first --out recordings/board7 --shots 400
  sheetlight record --camera gige://first --pair clock --pose-stream bcap://10.0.0.2 \\
      --station cell3 --out recordings/board8
  sheetlight record --camera gige://first --motion linear:count --pair count \\
      --counts-per-shot 20 --out recordings/parcel4
  sheetlight record --camera ffmpeg:/dev/video0 --shows room --board boards/charuco.json \\
      --shots 20 --out recordings/boards
  sheetlight record --camera sim:1?rate=10 --pair given --shots 50 --out try/scan
All options: sheetlight help record
Guide: docs/live.md")]
pub struct Args {
    #[command(flatten)]
    capture: Capture,
    /// Raw frames on standard input, with --camera -: WIDTHxHEIGHT:gray8, gray10le, ...
    #[arg(long, value_parser = parse::<RawFormat>)]
    raw: Option<RawFormat>,
    /// Poses by number (JSON or CSV), for --pair count
    #[arg(long)]
    poses: Option<PathBuf>,
    /// Station folder, for its latency
    #[arg(long)]
    station: Option<PathBuf>,
    /// Folder for the recording; must not contain a recording
    #[arg(long)]
    out: PathBuf,
    /// Pictures of: line (the stripe), pointer (its spot) or room (a board, lasers off)
    #[arg(long, default_value = "line", value_parser = parse::<Shows>)]
    shows: Shows,
    /// Board in the pictures (JSON from sheetlight board)
    #[arg(long)]
    board: Option<PathBuf>,
    /// Storage: png, raw (one file of raw frames), auto (raw if PNG is too slow)
    #[arg(long, default_value = "auto", value_parser = parse::<Store>)]
    store: Store,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let board = args.board.as_deref().map(BoardSpec::load).transpose()?;
    let set = if args.shows == Shows::Room { "boards" } else { "scan" };
    let mut stream = args.capture.open(args.raw, args.poses.as_deref(), args.station.as_deref(), Mode::All)?;
    let options = RecorderOptions {
        set: set.into(),
        motion: args.capture.motion(),
        shows: args.shows,
        store: args.store,
        sources: Some(args.capture.sources(stream.feed())),
        board,
        readout: stream.pictures().readout,
    };
    let recorder = Recorder::create(&args.out, stream.format(), options)?;
    let mut teller = args.capture.running.teller();
    let bar = console.bar("recording", 0);
    let report = record(&mut stream, recorder, None, |stream, said| {
        teller.hear(stream, said);
        teller.tell(console, &bar);
        bar.set_position(stream.account().used);
    });
    teller.account(&stream);
    teller.tell(console, &bar);
    bar.finish_and_clear();
    let report = report.map_err(|fault| Fault { what: format!("{}; {}", fault.what, stream.account()), ..fault })?;
    console.result(&report, &summary(&report, args));
    if report.shots == 0 {
        return Err(Fault::refused(format!("no picture was recorded: {}", report.account))
            .cause("the camera waits for a trigger, or no picture could be paired")
            .next("check the camera with: sheetlight camera show; left_out.json has the reasons"));
    }
    Ok(())
}

fn summary(r: &RecordReport, args: &Args) -> String {
    let mut s =
        format!("{} shots, {:.1} MB, in {}\n{}\n", r.shots, r.bytes as f64 * 1e-6, args.out.display(), r.account);
    if r.account.unexplained() != 0 {
        s += &format!("{} pictures are unexplained\n", r.account.unexplained());
    }
    if let Some(first) = r.left_out.first() {
        s += &format!("excluded {} pictures, the first ({}): {}\n", r.account.unpaired, first.id, first.why);
    }
    s
}
