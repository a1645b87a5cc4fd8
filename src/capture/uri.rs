//! In: a word that names a source of pictures. Out: its meaning, and the opened source.
//! Frame and unit: none.

use super::format::RawFormat;
use super::picture::PictureSource;
use super::source::cell::CellCamera;
use super::source::ffmpeg::Ffmpeg;
#[cfg(feature = "folder")]
use super::source::folder::FolderCamera;
use super::source::pipe::Pipe;
use super::source::play::Player;
use super::source::sim::{SimCamera, SimSpec};
use crate::fault::{Fault, Result};
use crate::geometry::AxisKind;
use std::path::PathBuf;
#[cfg(feature = "folder")]
use std::time::Duration;

/// A source of pictures, as named on the command line.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraUri {
    /// `-`: raw frames on standard input; a separate option states their format.
    Input,
    /// `cell://HOST:PORT?rate=FPS`: a cell's camera.
    Cell {
        /// `HOST:PORT`
        address: String,
        /// Pictures a second; 0: the cell chooses, negative: on request only.
        rate_hz: f64,
    },
    /// `gige://SERIAL`, `gige://IP` or `gige://first`, `?packet=1500`: a GigE Vision camera.
    #[cfg(feature = "gige")]
    Gige {
        /// Serial number, address, name, or `first`.
        word: String,
        /// Packet size in bytes; none: as large as the network carries.
        packet: Option<u32>,
    },
    /// `ffmpeg:ARGUMENTS?bits=8`: what ffmpeg opens with these arguments.
    Ffmpeg {
        /// Arguments of ffmpeg, separated by blanks.
        arguments: Vec<String>,
        /// Requested depth, bits.
        bits: u8,
    },
    /// `folder:PATH?bits=8&wait=60`: a folder that another program fills.
    #[cfg(feature = "folder")]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The sensor's depth for 16-bit files.
        bits: u8,
        /// Time to wait for the first picture, s.
        wait_s: f64,
    },
    /// `play:RECORDING?rate=FPS&loops=N`: a recording, played as if taken now.
    Play {
        /// The recording.
        path: PathBuf,
        /// Pictures a second; 0: as fast as they are requested.
        rate_hz: f64,
        /// Number of repetitions.
        loops: u64,
    },
    /// `sim:SEED?rate=FPS&speed=MM_S&...`: a simulated station that moves.
    Sim(SimSpec),
}

/// Known sources, for messages.
const KNOWN: &str =
    "gige://first, cell://HOST:PORT, ffmpeg:ARGUMENTS, folder:PATH, play:RECORDING, sim:SEED, - (with --raw)";

type Said<T> = std::result::Result<T, String>;

impl std::str::FromStr for CameraUri {
    type Err = String;
    fn from_str(s: &str) -> Said<CameraUri> {
        if s == "-" {
            return Ok(CameraUri::Input);
        }
        let (kind, rest) = s.split_once(':').ok_or_else(|| format!("'{s}' names no camera; known are {KNOWN}"))?;
        // In an ffmpeg address, options of ours begin at the last question mark followed by `bits=`.
        let ours = if kind == "ffmpeg" { rest.rfind("?bits=") } else { rest.find('?') };
        let (place, query) = ours.map_or((rest, ""), |at| (&rest[..at], &rest[at + 1..]));
        match kind {
            "cell" => {
                let [rate] = options(query, ["rate"])?;
                let address = place.trim_start_matches('/').to_owned();
                if !address.contains(':') {
                    return Err(format!("'{s}' names no port: cell://HOST:PORT"));
                }
                Ok(CameraUri::Cell { address, rate_hz: number("rate", rate, 0.0)? })
            }
            #[cfg(feature = "gige")]
            "gige" => {
                let [packet] = options(query, ["packet"])?;
                let word = place.trim_start_matches('/').to_owned();
                if word.is_empty() {
                    return Err(format!("'{s}' names no camera: gige://first, gige://SERIAL or gige://IP"));
                }
                let packet = packet.map(|p| number("packet", Some(p), 0.0)).transpose()?;
                match packet {
                    Some(p) if !(576.0..=16_000.0).contains(&p) => Err(format!("packet={p}: 576 to 16000 bytes")),
                    packet => Ok(CameraUri::Gige { word, packet: packet.map(|p| p as u32) }),
                }
            }
            "ffmpeg" => {
                let [bits] = options(query, ["bits"])?;
                let mut arguments: Vec<String> = place.split_whitespace().map(str::to_owned).collect();
                if let [one] = &arguments[..] {
                    arguments = vec!["-i".into(), one.clone()];
                }
                if !arguments.iter().any(|a| a == "-i") {
                    return Err(format!("'{s}' says not what ffmpeg is to open: ffmpeg:-f v4l2 -i /dev/video0"));
                }
                Ok(CameraUri::Ffmpeg { arguments, bits: depth(bits)? })
            }
            "folder" | "play" if place.is_empty() => Err(format!("'{s}' names no folder: folder:PATH, play:RECORDING")),
            #[cfg(feature = "folder")]
            "folder" => {
                let [bits, wait] = options(query, ["bits", "wait"])?;
                let (bits, wait_s) = (depth(bits)?, number("wait", wait, 60.0)?.clamp(0.0, 1e6));
                Ok(CameraUri::Folder { path: place.into(), bits, wait_s })
            }
            "play" => {
                let [rate, loops] = options(query, ["rate", "loops"])?;
                let loops = number("loops", loops, 1.0)?.clamp(1.0, 1e9) as u64;
                Ok(CameraUri::Play { path: place.into(), rate_hz: number("rate", rate, 0.0)?.max(0.0), loops })
            }
            "sim" => sim(place, query).map(CameraUri::Sim),
            _ => Err(format!("'{s}' names no camera; known are {KNOWN}")),
        }
    }
}

fn sim(seed: &str, query: &str) -> Said<SimSpec> {
    let keys = ["rate", "speed", "still", "size", "axis", "scene", "delay_ms", "exposure_us", "shows", "stops", "rest"];
    let [rate, speed, still, size, axis, scene, delay, exposure, shows, stops, rest] = options(query, keys)?;
    let usual = SimSpec::default();
    let seed = seed.parse().map_err(|_| format!("sim:{seed} names no seed, a whole number"))?;
    let size = size.map_or(Ok(usual.size), |s| {
        let (w, h) = s.split_once('x').ok_or_else(|| format!("size={s} is not like 640x480"))?;
        let px = |t: &str| t.parse::<u32>().map_err(|_| format!("size={s} is not like 640x480"));
        Ok::<_, String>([px(w)?, px(h)?])
    })?;
    let axis = match axis {
        None | Some("robot") => None,
        Some("linear") => Some(AxisKind::Linear),
        Some("turntable") => Some(AxisKind::Turntable),
        Some(other) => return Err(format!("axis={other}: robot, linear or turntable")),
    };
    let board = match shows {
        None | Some("scene") => false,
        Some("board") => true,
        Some(other) => return Err(format!("shows={other}: scene or board")),
    };
    Ok(SimSpec {
        seed,
        board,
        rate_hz: number("rate", rate, usual.rate_hz)?,
        speed: number("speed", speed, usual.speed)?,
        still: still.map(|s| number("still", Some(s), 0.0)).transpose()?,
        stops: stops.map(|s| s.parse().map_err(|_| format!("stops={s} is not a whole number"))).transpose()?,
        rest_s: number("rest", rest, usual.rest_s)?,
        size,
        axis,
        scene: scene.map(PathBuf::from),
        delay_ms: number("delay_ms", delay, usual.delay_ms)?,
        exposure_us: number("exposure_us", exposure, usual.exposure_us)?,
    })
}

/// The values of `KEY=VALUE&KEY=VALUE`, in the order of the keys; unknown keys are refused.
fn options<'a, const N: usize>(query: &'a str, keys: [&str; N]) -> Said<[Option<&'a str>; N]> {
    let mut out = [None; N];
    for pair in query.split('&').filter(|p| !p.is_empty()) {
        let (key, value) = pair.split_once('=').ok_or_else(|| format!("'{pair}' is not like KEY=VALUE"))?;
        let place = keys.iter().position(|k| *k == key);
        let place = place.ok_or_else(|| format!("unknown option '{key}': {}", keys.join(", ")))?;
        out[place] = Some(value);
    }
    Ok(out)
}

fn number(key: &str, text: Option<&str>, usual: f64) -> Said<f64> {
    let Some(text) = text else { return Ok(usual) };
    text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| format!("{key}={text} is not a number"))
}

fn depth(text: Option<&str>) -> Said<u8> {
    let bits = number("bits", text, 8.0)?;
    if (8.0..=16.0).contains(&bits) && bits.fract() == 0.0 {
        Ok(bits as u8)
    } else {
        Err(format!("bits={bits}, 8 to 16 are read"))
    }
}

impl CameraUri {
    /// Opens the source; it delivers pictures of light from then on. `raw` states the format of frames on a pipe.
    ///
    /// # Errors
    /// Nothing is there, it is in use, it needs `raw`, or it is a 3-D camera that sends coordinates.
    pub fn open(&self, raw: Option<RawFormat>) -> Result<Box<dyn PictureSource>> {
        let source = self.open_any(raw)?;
        match source.coordinates() {
            Ok(None) => Ok(source),
            _ => Err(Fault::input(format!("{}: sends coordinates, pictures of the light are wanted", source.name()))
                .cause("a 3-D camera that measures its profiles itself")
                .next(
                    "record its profiles with sheetlight record and scan them with sheetlight scan-profiles, or let \
                     it send pictures: sheetlight camera set PixelFormat Mono8",
                )),
        }
    }

    /// The same, and 3-D cameras that send coordinates.
    ///
    /// # Errors
    /// As [`CameraUri::open`].
    pub fn open_any(&self, raw: Option<RawFormat>) -> Result<Box<dyn PictureSource>> {
        Ok(match self {
            CameraUri::Input => {
                let raw = raw.ok_or_else(|| {
                    Fault::usage("frames on standard input, but --raw does not state their format")
                        .next("state it: --raw 640x480:gray8")
                })?;
                Box::new(Pipe::new(raw, "standard input", std::io::stdin())?)
            }
            CameraUri::Cell { address, rate_hz } => Box::new(CellCamera::open(address, *rate_hz)?),
            #[cfg(feature = "gige")]
            CameraUri::Gige { word, packet } => Box::new(super::source::gige::GigeCamera::open(word, *packet)?),
            CameraUri::Ffmpeg { arguments, bits } => Box::new(Ffmpeg::open(arguments, *bits)?),
            #[cfg(feature = "folder")]
            CameraUri::Folder { path, bits, wait_s } => {
                Box::new(FolderCamera::open(path, *bits, Duration::from_secs_f64(*wait_s))?)
            }
            CameraUri::Play { path, rate_hz, loops } => Box::new(Player::open(path, *rate_hz, *loops)?),
            CameraUri::Sim(spec) => Box::new(SimCamera::open(spec)?),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_name_sources_or_are_answered() {
        let cell = CameraUri::Cell { address: "cell3:5020".into(), rate_hz: 25.0 };
        assert_eq!("cell://cell3:5020?rate=25".parse(), Ok(cell));
        assert_eq!("-".parse(), Ok(CameraUri::Input));
        let arguments = ["-f", "v4l2", "-i", "/dev/video0"].map(str::to_owned).to_vec();
        let webcam = CameraUri::Ffmpeg { arguments, bits: 8 };
        assert_eq!("ffmpeg:-f v4l2 -i /dev/video0".parse(), Ok(webcam));
        let arguments = vec!["-i".into(), "rtsp://c/1?a=b".into()];
        assert_eq!("ffmpeg:rtsp://c/1?a=b?bits=12".parse(), Ok(CameraUri::Ffmpeg { arguments, bits: 12 }));
        let sim =
            SimSpec { seed: 3, rate_hz: 5.0, size: [320, 240], axis: Some(AxisKind::Linear), ..SimSpec::default() };
        assert_eq!("sim:3?rate=5&size=320x240&axis=linear".parse(), Ok(CameraUri::Sim(sim)));
        let still = SimSpec { seed: 3, still: Some(0.25), ..SimSpec::default() };
        assert_eq!("sim:3?still=0.25".parse(), Ok(CameraUri::Sim(still)));
        for (wrong, says) in [
            ("cell://cell3", "no port"),
            ("cell://c:1?fps=3", "unknown option 'fps': rate"),
            ("play:a?rate=fast", "not a number"),
            ("usb0", "names no camera"),
            ("folder:", "names no folder"),
            ("play:?rate=2", "names no folder"),
            ("ffmpeg:-f v4l2", "what ffmpeg is to open"),
            ("folder:a?bits=7", "8 to 16"),
            ("sim:one", "no seed"),
            ("sim:1?still=here", "not a number"),
        ] {
            let said = wrong.parse::<CameraUri>().unwrap_err();
            assert!(said.contains(says), "{wrong}: {said}");
        }
    }
}
