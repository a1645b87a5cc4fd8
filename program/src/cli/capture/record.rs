//! In: a running camera and what moves. Out: a recording; the account of every picture.
//! Frame and unit: docs/file-formats.md.

use super::options::Capture;
use crate::cli::terminal::arguments::parse;
use crate::cli::terminal::console::Console;
use sheetlight::capture::record::{
    RecordReport, Recorder, RecorderOptions, Shows, Store, record, record_poses, record_profiles,
};
use sheetlight::capture::{RawFormat, Stream};
use sheetlight::fault::{Fault, Result};
use sheetlight::recording::BoardSpec;
use std::path::PathBuf;

/// Record a running camera: every picture in order, with its pose
///
/// Ends after --shots, --seconds, or Ctrl-C. The recording can be opened at any moment, also after a crash. The
/// account lists every picture that the camera sent: complete, incomplete, missed, late, dropped (queue, disk) or
/// unpaired. Pictures without a pose are excluded and listed in left_out.json. Of a 3-D camera that sends heights, OUT
/// gets profiles and poses for scan-profiles.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight record --camera gige://first --out recordings/board7 --shots 400
  sheetlight record --camera gige://first --pair clock --pose-stream bcap://10.0.0.2 \\
      --station cell3 --out recordings/board8
  sheetlight record --camera gige://first --motion linear:count --pair count \\
      --counts-per-shot 20 --out recordings/parcel4
  sheetlight record --camera ffmpeg:/dev/video0 --shows room --board boards/charuco.json \\
      --shots 20 --out recordings/boards
  sheetlight record --camera gige://first --pair step --pose-stream bcap://10.0.0.2 \\
      --exposures 300,2000,12000 --out recordings/dark9
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
    /// Exposures of each pose, us, ascending: 300,2000,12000; what moves has to stand still at each
    #[arg(long, value_name = "US,US,..", value_delimiter = ',', requires = "camera")]
    exposures: Vec<f64>,
    /// Level of a dark pixel, for --exposures
    #[arg(long, hide_short_help = true, value_name = "LEVEL", requires = "exposures", default_value_t = 0.0)]
    black_level: f64,
    /// Storage: png, raw (one file of raw frames), auto (raw if PNG is too slow)
    #[arg(long, default_value = "auto", value_parser = parse::<Store>)]
    store: Store,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let board = args.board.as_deref().map(BoardSpec::load).transpose()?;
    let set = if args.shows == Shows::Room { "boards" } else { "scan" };
    if !args.exposures.is_empty() && args.shows != Shows::Line {
        return Err(Fault::usage("--exposures is for the stripe, --shows is another")
            .cause("several exposures are merged where a scan measures the stripe")
            .next("leave one of the two out"));
    }
    let capture = &args.capture;
    let (mut stream, bracket) = if args.exposures.is_empty() {
        (capture.open_to_record(args.raw, args.poses.as_deref(), args.station.as_deref())?, None)
    } else {
        let (stream, exposures, poses) = capture.open_bracketed(args.raw, &args.exposures, args.black_level)?;
        (stream, Some((exposures, poses)))
    };
    if stream.feed().coordinates().is_some() {
        return profiles(args, &mut stream, console);
    }
    let exposures_us = bracket.as_ref().map_or(Vec::new(), |(e, _)| e.us().to_vec());
    let each = exposures_us.len().max(1) as u64;
    let options = RecorderOptions {
        set: set.into(),
        motion: capture.motion(),
        shows: args.shows,
        store: args.store,
        sources: Some(capture.sources(stream.feed())),
        board,
        readout: stream.pictures().readout,
        exposures_us,
        black_level: (args.black_level != 0.0).then_some(args.black_level),
    };
    let recorder = Recorder::create(&args.out, stream.format(), options)?;
    let mut teller = capture.running.teller();
    let bar = console.bar("recording", 0);
    let say = |stream: &Stream, said: Option<String>| {
        teller.hear(stream, said);
        teller.tell(console, &bar);
        bar.set_position(stream.account().used / each);
    };
    let report = match &bracket {
        Some((exposures, poses)) => record_poses(&mut stream, recorder, exposures, *poses, say),
        None => record(&mut stream, recorder, None, say),
    };
    teller.account(&stream);
    teller.tell(console, &bar);
    bar.finish_and_clear();
    let report = report.map_err(|fault| Fault { what: format!("{}; {}", fault.what, stream.account()), ..fault })?;
    console.result(&report, &summary(&report, args, "shots"));
    if report.shots == 0 && report.exposures.is_some() {
        return Err(Fault::refused(format!("no pose was recorded: {}", report.account))
            .cause("nothing stood still for all exposures of a pose, or the poses do not come")
            .next("stand still for longer at each pose; left_out.json has the reasons"));
    }
    if report.shots == 0 {
        return Err(Fault::refused(format!("no picture was recorded: {}", report.account))
            .cause("the camera waits for a trigger, or no picture could be paired")
            .next("check the camera with: sheetlight camera show; left_out.json has the reasons"));
    }
    Ok(())
}

/// Records the profiles of a 3-D camera.
fn profiles(args: &Args, stream: &mut Stream, console: &Console) -> Result<()> {
    if args.shows != Shows::Line || args.board.is_some() || args.store != Store::Auto {
        return Err(Fault::usage("--shows, --board or --store, and a camera that sends profiles")
            .cause("there are no pictures that could show a board or be stored")
            .next("leave these options out"));
    }
    let (rows, capture) = (args.capture.rows()?, &args.capture);
    let sources = capture.sources(stream.feed());
    let mut teller = capture.running.teller();
    let bar = console.bar("recording", 0);
    let report = record_profiles(stream, &args.out, rows, &sources, |stream, said| {
        teller.hear(stream, said);
        teller.tell(console, &bar);
        bar.set_position(stream.account().used);
    });
    teller.account(stream);
    teller.tell(console, &bar);
    bar.finish_and_clear();
    let report = report.map_err(|fault| Fault { what: format!("{}; {}", fault.what, stream.account()), ..fault })?;
    console.result(&report, &summary(&report, args, "profiles"));
    if report.shots == 0 {
        return Err(Fault::refused(format!("no profile was recorded: {}", report.account))
            .cause("the camera waits for a trigger, or no picture could be paired or read")
            .next("check the camera with: sheetlight camera show; left_out.json has the reasons"));
    }
    Ok(())
}

/// `of` names what was recorded.
fn summary(r: &RecordReport, args: &Args, of: &str) -> String {
    let mut s =
        format!("{} {of}, {:.1} MB, in {}\n{}\n", r.shots, r.bytes as f64 * 1e-6, args.out.display(), r.account);
    if r.account.unexplained() != 0 {
        s += &format!("{} pictures are unexplained\n", r.account.unexplained());
    }
    if let Some(e) = &r.exposures {
        let us: Vec<String> = e.exposures_us.iter().map(f64::to_string).collect();
        s += &format!("exposures {} us, {:.2} s a pose at most\n", us.join(", "), e.longest_s);
        if e.left > 0 {
            s += &format!("{} poses were left before all their exposures were taken\n", e.left);
        }
    }
    if let Some(first) = r.left_out.first() {
        s += &format!("excluded {} pictures, the first ({}): {}\n", r.left_out.len(), first.id, first.why);
    }
    s
}
