//! In: a scan folder, optionally its recording, station and found parts. Out: an MCAP file with ROS 2 messages.
//! Frame and unit: the scan's frame, under the name from the options; metres in the file.

use crate::cli::terminal::console::Console;
use crate::cli::terminal::outputs;
use crate::cli::terminal::outputs::Inputs;
use crate::ros::{Export, Exported, Frames, Renamed, export};
use sheetlight::fault::{Fault, Result};
use sheetlight::recording::Recording;
use std::path::{Path, PathBuf};

/// Write a scan as an MCAP file with ROS 2 messages
///
/// Foxglove, ros2 bag and Python readers open the file. ROS is not needed to write it. Each shot's points are a message
/// on /sheetlight/profile; /tf has the camera's pose. Lengths are metres. Times come from the recording if it states
/// them; otherwise they are synthetic, and the file reports that.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight mcap scans/board7 --out board7.mcap
  sheetlight mcap scans/board7 --recording recordings/board7 --station cell3 --pictures \\
      --part led.json --frame base=base_link --frame flange=tool0 --out board7.mcap
Guide: docs/connections.md")]
pub struct Args {
    /// Folder from sheetlight scan --out
    scan: PathBuf,
    /// The recording that was scanned: times, and the flange's poses
    #[arg(long)]
    recording: Option<PathBuf>,
    /// Name of the recording's pose file, if meta.json names several
    #[arg(long, requires = "recording")]
    poses: Option<String>,
    /// The station that scanned: the camera's place on the flange, the camera of the pictures
    #[arg(long)]
    station: Option<PathBuf>,
    /// Write the recording's pictures, and with --station their camera_info
    #[arg(long, requires = "recording")]
    pictures: bool,
    /// Report of a part found in the scan (sheetlight find --out); may be repeated
    #[arg(long = "part", value_name = "FILE")]
    parts: Vec<PathBuf>,
    /// Name of a frame in the file, e.g. base=base_link; may be repeated
    #[arg(long = "frame", value_name = "FRAME=NAME",
        value_parser = crate::cli::terminal::arguments::parse::<Renamed>)]
    frames: Vec<Renamed>,
    /// Shots per second of synthetic times
    #[arg(long, value_name = "HZ", default_value_t = 10.0)]
    rate: f64,
    /// Exclude the message with all points, which is as large as all profiles together
    #[arg(long)]
    no_cloud: bool,
    /// File to be written (.mcap); an existing one is not replaced
    #[arg(long)]
    out: PathBuf,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let parts: Vec<&Path> = args.parts.iter().map(PathBuf::as_path).collect();
    let inputs = Inputs { files: &parts, scans: &[&args.scan], station: args.station.as_deref() };
    outputs::check(&[&args.out], &inputs)?;
    let twice =
        |what| Fault::usage(what).cause("two frames of one name cannot be distinguished").next("correct --frame");
    let frames = Frames::new(&args.frames).map_err(twice)?;
    let recording = args.recording.as_deref().map(Recording::open).transpose()?;
    let asked = Export {
        scan: &args.scan,
        out: &args.out,
        recording: recording.as_ref(),
        poses: args.poses.as_deref(),
        station: args.station.as_deref(),
        pictures: args.pictures,
        parts: &args.parts,
        frames: &frames,
        rate_hz: args.rate,
        cloud: !args.no_cloud,
    };
    let bar = console.bar("writing points", 0);
    let written = export(&asked, &mut |done, all| {
        bar.set_length(all);
        bar.set_position(done);
    })?;
    bar.finish_and_clear();
    written.notes.iter().for_each(|note| console.warn(note));
    console.result(&written, &summary(&written));
    Ok(())
}

fn summary(w: &Exported) -> String {
    let mut s = String::new();
    for t in &w.topics {
        s += &format!("{:24} {:6}  {}\n", t.topic, t.messages, t.kind);
    }
    s += &format!("{} points in frame {}, {:.1} MB\n", w.points, w.frame, w.bytes as f64 / 1e6);
    s + &format!("times {}\n", w.times_from)
}
