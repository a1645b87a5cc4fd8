//! Runs ffmpeg as a camera. It opens what its own arguments name, and delivers grey frames with the levels as sent.

use super::pipe::Pipe;
use crate::capture::format::{Format, RawFormat};
use crate::capture::picture::{Event, PictureSource};
use crate::fault::{Fault, Result};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// A running ffmpeg process and its frames.
pub struct Ffmpeg {
    arguments: Vec<String>,
    bits: u8,
    child: Child,
    pipe: Pipe,
    /// Lines of its error output; the last ones are kept.
    said: Receiver<String>,
    last: Vec<String>,
    live: bool,
}

/// Words in its command line that mean a device or a network, which does not wait for a reader.
const LIVE: [&str; 9] = ["v4l2", "dshow", "avfoundation", "rtsp:", "rtp:", "udp:", "srt:", "tcp:", "-re"];

impl Ffmpeg {
    /// Starts ffmpeg with `arguments`, followed by those for raw grey output of depth `bits`. A first run determines
    /// the size of the pictures.
    ///
    /// # Errors
    /// ffmpeg is missing, or cannot open the source.
    pub fn open(arguments: &[String], bits: u8) -> Result<Ffmpeg> {
        let format = size(arguments, bits)?;
        let (child, pipe, said) = start(arguments, format)?;
        let live = arguments.iter().any(|a| LIVE.iter().any(|l| a.starts_with(l)));
        Ok(Ffmpeg { arguments: arguments.to_vec(), bits, child, pipe, said, last: Vec::new(), live })
    }

    fn words(&mut self) -> String {
        self.last.extend(self.said.try_iter());
        let keep = self.last.len().saturating_sub(3);
        self.last.drain(..keep);
        self.last.join("; ")
    }
}

fn missing(e: std::io::Error) -> Fault {
    Fault::input(format!("ffmpeg cannot be started: {e}"))
        .cause("it is not installed, or not on the PATH")
        .next("install it (apt install ffmpeg, brew install ffmpeg), or pipe frames in with --raw")
}

fn command(arguments: &[String]) -> Command {
    let mut command = Command::new("ffmpeg");
    command.args(["-hide_banner", "-nostdin", "-loglevel", "error"]).args(arguments);
    command
}

fn layout(bits: u8) -> &'static str {
    match bits {
        8 => "gray",
        9..=10 => "gray10le",
        11..=12 => "gray12le",
        _ => "gray16le",
    }
}

/// Determines the size from one frame in PGM format.
fn size(arguments: &[String], bits: u8) -> Result<Format> {
    let one = ["-map", "0:v:0", "-frames:v", "1", "-f", "image2pipe", "-c:v", "pgm", "-pix_fmt", "gray", "-"];
    let output = command(arguments).args(one).output().map_err(missing)?;
    let header = String::from_utf8_lossy(&output.stdout[..output.stdout.len().min(64)]).into_owned();
    let mut words = header.split_ascii_whitespace();
    let numbers = (words.next(), words.next().and_then(|w| w.parse().ok()), words.next().and_then(|w| w.parse().ok()));
    if let (Some("P5"), Some(width), Some(height)) = numbers {
        return Ok(Format { width, height, bits });
    }
    let errors = String::from_utf8_lossy(&output.stderr).trim().replace('\n', "; ");
    Err(Fault::input(format!("ffmpeg gives no picture: {errors}"))
        .cause("the device or file is missing or in use, or ffmpeg does not know these options")
        .next(format!("try it alone: ffmpeg {} -f null -", arguments.join(" "))))
}

/// Keeps levels as the camera sends them. Without it ffmpeg takes untagged luma for 16 to 235 and stretches it to 0
/// to 255. It is applied after the user's filters.
const AS_SENT: &str = "scale=in_range=full:out_range=full";

/// The arguments with that filter appended to the last `-vf`, which is the one that ffmpeg uses.
fn as_sent(arguments: &[String]) -> Vec<String> {
    let mut all = arguments.to_vec();
    let filters = |a: &String| ["-vf", "-filter:v", "-filter:v:0"].contains(&a.as_str());
    match all.iter().rposition(filters).and_then(|i| all.get_mut(i + 1)) {
        Some(chain) => *chain = format!("{chain},{AS_SENT}"),
        None => all.extend(["-vf", AS_SENT].map(str::to_owned)),
    }
    all
}

fn start(arguments: &[String], format: Format) -> Result<(Child, Pipe, Receiver<String>)> {
    let out = ["-map", "0:v:0", "-fps_mode", "passthrough", "-f", "rawvideo", "-pix_fmt", layout(format.bits), "-"];
    let mut child = command(&as_sent(arguments))
        .args(out)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(missing)?;
    let (stdout, stderr) = (child.stdout.take().expect("piped"), child.stderr.take().expect("piped"));
    let (send, said) = channel();
    let listen = move || {
        for line in BufReader::new(stderr).lines().map_while(|l| l.ok()) {
            if send.send(line).is_err() {
                return;
            }
        }
    };
    std::thread::Builder::new().name("ffmpeg".into()).spawn(listen).map_err(|e| Fault::threads(&e))?;
    let pipe = Pipe::new(RawFormat { format }, "ffmpeg", stdout)?;
    Ok((child, pipe, said))
}

impl PictureSource for Ffmpeg {
    fn format(&self) -> Format {
        self.pipe.format()
    }

    fn next(&mut self, within: Duration) -> Event {
        let event = self.pipe.next(within);
        if !matches!(event, Event::Ended | Event::Lost(_)) {
            return event;
        }
        // The pipe is closed: ffmpeg has ended or is ending.
        let status = self.child.wait();
        let words = self.words();
        match status {
            Ok(s) if s.success() && !self.live => event,
            status => {
                let how = status.map_or_else(|e| e.to_string(), |s| s.to_string());
                Event::Lost(
                    Fault::input(format!("ffmpeg ended ({how}): {words}"))
                        .cause("the device was unplugged, the network failed, or the file is damaged")
                        .next("plug it in again and run the command again; the finished part is stored"),
                )
            }
        }
    }

    fn sent(&self) -> Option<u64> {
        self.pipe.sent()
    }

    fn waits(&self) -> bool {
        !self.live
    }

    fn reopens(&self) -> bool {
        self.live
    }

    fn reopen(&mut self) -> Result<()> {
        let format = size(&self.arguments, self.bits)?;
        if format != self.format() {
            return Err(Fault::input(format!("is {format} now, was {}", self.format())).next("start again"));
        }
        (self.child, self.pipe, self.said) = start(&self.arguments, format)?;
        Ok(())
    }

    fn name(&self) -> String {
        format!("ffmpeg:{}", self.arguments.join(" "))
    }
}

impl Drop for Ffmpeg {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
