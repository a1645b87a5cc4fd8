//! In: --camera, --pair and related options. Out: a stream of shots, and messages about it.
//! Frame and unit: mm, degrees, counts; s.

use super::readout::ReadoutArgs;
use crate::cli::terminal::arguments::parse;
use crate::cli::terminal::console::Console;
use indicatif::ProgressBar;
use sheetlight::capture::pair::{Counting, PoseFeed, PoseUri, Still, Table, Way};
use sheetlight::capture::record::Rows;
use sheetlight::capture::{Bracketed, CameraUri, Exposures, Feed, FeedOptions, Latency, Mode, RawFormat, Stream};
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::CountUnit;
use sheetlight::recording::{Carries, Motion, MotionKind, Sources, Stand, load_poses};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How pictures are paired with the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Pair {
    None,
    Given,
    Step,
    Count,
    Clock,
}

fn unknown(word: &str) -> String {
    sheetlight::fault::unknown::<Pair>("pairing", word)
}

/// What moves, as typed: `robot`, `robot:part`, `linear:count`, `turntable:deg:sensor`.
#[derive(Clone, Debug)]
pub struct Moves(Motion);

impl std::str::FromStr for Moves {
    type Err = String;
    fn from_str(s: &str) -> std::result::Result<Moves, String> {
        let help = || {
            format!("'{s}' is not like robot, robot:part, linear:count, linear:mm, turntable:count or turntable:deg")
        };
        let mut words = s.split(':');
        let kind = match words.next() {
            Some("robot") => MotionKind::Robot,
            Some("linear") => MotionKind::Linear,
            Some("turntable") => MotionKind::Turntable,
            _ => return Err(help()),
        };
        let robot = kind == MotionKind::Robot;
        let mut motion =
            Motion { kind, carries: if robot { Carries::Sensor } else { Carries::Part }, ..Motion::default() };
        for word in words {
            match word {
                "sensor" => motion.carries = Carries::Sensor,
                "part" => motion.carries = Carries::Part,
                "count" if !robot => motion.unit = Some(CountUnit::Count),
                "mm" if kind == MotionKind::Linear => motion.unit = Some(CountUnit::Mm),
                "deg" if kind == MotionKind::Turntable => motion.unit = Some(CountUnit::Deg),
                _ => return Err(help()),
            }
        }
        if !robot && motion.unit.is_none() {
            return Err(help());
        }
        Ok(Moves(motion))
    }
}

/// A running camera.
#[derive(Clone, clap::Args)]
pub struct Running {
    /// Camera: gige://first, ffmpeg:/dev/video0, folder:PATH, play:RECORDING, ... (docs/live.md)
    #[arg(long, value_name = "URI", value_parser = parse::<CameraUri>)]
    pub camera: Option<CameraUri>,
    /// End after this number of pictures, with --exposures of poses
    #[arg(long, requires = "camera")]
    shots: Option<u64>,
    /// End after this time, s
    #[arg(long, hide_short_help = true, requires = "camera")]
    seconds: Option<f64>,
    /// Time to wait for a camera that was disconnected, s
    #[arg(long, hide_short_help = true, default_value_t = 60.0)]
    patience: f64,
    /// Memory for pictures that are waiting, MB
    #[arg(long, hide_short_help = true, default_value_t = 256)]
    memory: usize,
    /// Write the counters into this file every second, for Prometheus' node exporter
    #[arg(long, hide_short_help = true, value_name = "FILE", requires = "camera")]
    metrics: Option<PathBuf>,
    #[command(flatten)]
    pub readout: ReadoutArgs,
}

/// A running camera and what moves.
#[derive(clap::Args)]
pub struct Capture {
    #[command(flatten)]
    pub running: Running,
    /// Pairing of pictures and poses: none, given (by the source), step (standing still), count (by number) or clock
    /// (by time)
    #[arg(long, value_parser = parse::<Pair>, requires = "camera")]
    pub pair: Option<Pair>,
    /// What moves: robot, robot:part, linear:count, linear:mm, turntable:count or turntable:deg
    #[arg(long, default_value = "robot", value_parser = parse::<Moves>)]
    motion: Moves,
    /// Source of poses or counts for --pair step and clock: bcap://HOST, tcp://HOST:PORT, lines:PATH, sim:SEED
    #[arg(long, value_name = "URI", value_parser = parse::<PoseUri>, requires = "camera")]
    pose_stream: Option<PoseUri>,
    /// Counts from one trigger pulse to the next, for --pair count
    #[arg(long, value_name = "N", requires = "camera")]
    counts_per_shot: Option<f64>,
}

impl Running {
    /// Opens the camera.
    pub fn open(&self, raw: Option<RawFormat>, mode: Mode) -> Result<Feed> {
        let options = self.feed_options(mode)?;
        Feed::start(self.named()?.open(raw)?, options)
    }

    /// Opens the camera, also one that sends profiles.
    fn open_any(&self, raw: Option<RawFormat>, mode: Mode) -> Result<Feed> {
        let options = self.feed_options(mode)?;
        Feed::start(self.named()?.open_any(raw)?, options)
    }

    fn feed_options(&self, mode: Mode) -> Result<FeedOptions> {
        Ok(FeedOptions {
            mode,
            memory: self.memory.clamp(1, 1 << 20) << 20,
            patience: seconds("--patience", self.patience)?,
            shots: self.shots,
            seconds: self.seconds.map(|s| seconds("--seconds", s)).transpose()?.map(|d| d.as_secs_f64()),
            stop: crate::cli::terminal::interrupt::asked_for(),
            readout: self.readout.stated(),
        })
    }

    /// The camera of the options.
    pub fn named(&self) -> Result<&CameraUri> {
        self.camera.as_ref().ok_or_else(|| {
            Fault::usage("no camera is named")
                .next("name one: --camera URI (docs/live.md), or look for one: sheetlight camera list")
        })
    }

    /// Reports events to a person and to the metrics file.
    pub fn teller(&self) -> Teller {
        Teller { news: Arc::default(), metrics: self.metrics.clone(), last: Instant::now(), line: Arc::default() }
    }
}

fn seconds(option: &str, value: f64) -> Result<Duration> {
    Duration::try_from_secs_f64(value)
        .map_err(|_| Fault::usage(format!("{option} is {value}")).next("give seconds, 0 or more"))
}

impl Capture {
    /// What moves; `None` if pictures are not paired.
    pub fn motion(&self) -> Option<Motion> {
        let mut motion = self.motion.0.clone();
        if self.pair() == Pair::None {
            return None;
        }
        // A played recording or a simulated station states its motion itself.
        match (&self.running.camera, self.pair()) {
            (Some(CameraUri::Play { path, .. }), Pair::Given) => {
                motion = sheetlight::recording::Recording::open(path).ok()?.meta.motion();
                (motion.counts_per_shot, motion.counts_file, motion.zero) = (None, None, None);
            }
            (Some(CameraUri::Sim(spec)), _) => {
                if let Some(kind) = spec.axis {
                    let kind = match kind {
                        sheetlight::geometry::AxisKind::Linear => MotionKind::Linear,
                        sheetlight::geometry::AxisKind::Turntable => MotionKind::Turntable,
                    };
                    motion = Motion { kind, carries: Carries::Part, unit: Some(CountUnit::Count), ..Motion::default() };
                }
            }
            _ => {}
        }
        Some(motion)
    }

    fn pair(&self) -> Pair {
        self.pair.unwrap_or(Pair::None)
    }

    /// Opens camera and poses. `poses` is a pose file, paired by number; `station` gives the latency.
    pub fn open(
        &self,
        raw: Option<RawFormat>,
        poses: Option<&Path>,
        station: Option<&Path>,
        mode: Mode,
    ) -> Result<Stream> {
        self.opened(poses, station, || self.running.open(raw, mode))
    }

    /// The same for recording: also a 3-D camera that sends profiles.
    pub fn open_to_record(
        &self,
        raw: Option<RawFormat>,
        poses: Option<&Path>,
        station: Option<&Path>,
    ) -> Result<Stream> {
        self.opened(poses, station, || self.running.open_any(raw, Mode::All))
    }

    /// Whether a profile of a camera that sends several in a picture has a pose.
    ///
    /// # Errors
    /// Something else moves than a robot that carries the camera.
    pub fn rows(&self) -> Result<Rows> {
        match self.pair() {
            Pair::None => return Ok(Rows::Unposed),
            _ if self.motion.0 != Motion::default() => {}
            Pair::Step => return Ok(Rows::Standing),
            Pair::Count | Pair::Clock | Pair::Given => return Ok(Rows::Moving),
        }
        Err(Fault::usage("--motion names something else than a robot that carries the camera")
            .cause("profiles are scanned with the pose of a sensor on the flange")
            .next("leave --motion out; profiles without poses are recorded without --pair"))
    }

    fn opened(
        &self,
        poses: Option<&Path>,
        station: Option<&Path>,
        open: impl FnOnce() -> Result<Feed>,
    ) -> Result<Stream> {
        let clocked = station.filter(|_| self.pair() == Pair::Clock);
        let latency = clocked.map(Latency::load).transpose()?.flatten();
        let way = self.way(self.running.named()?, poses, latency.as_ref())?;
        let feed = open()?;
        latency.map_or(Ok(()), |l| l.of(Some(&self.sources(&feed))))?;
        Ok(Stream::new(feed, way))
    }

    /// Opens the camera with several exposures for each pose, and the poses. The number of shots is not the feed's.
    ///
    /// # Errors
    /// A pairing with a motion that does not stop; as [`Bracketed::new`].
    pub fn open_bracketed(
        &self,
        raw: Option<RawFormat>,
        exposures_us: &[f64],
        black_level: f64,
    ) -> Result<(Stream, Exposures, Option<u64>)> {
        let stands = |what: &str, next: &str| {
            Err(Fault::usage(format!("--exposures and {what}"))
                .cause("several exposures of a pose need a robot, an axis or parts that stand still at each pose")
                .next(next))
        };
        match self.pair() {
            Pair::Step | Pair::Given => {}
            Pair::None => return stands("no pairing", "stop at each pose, and name its source: --pair step"),
            Pair::Count => return stands("--pair count", "stop at each pose instead of triggering: --pair step"),
            Pair::Clock => return stands("--pair clock", "stop at each pose: --pair step"),
        }
        if let CameraUri::Sim(spec) = self.running.named()?
            && spec.still.is_none()
            && spec.stops.is_none()
        {
            return stands("a simulated station that never stops", "let it stop: sim:SEED?stops=40");
        }
        let options = FeedOptions { shots: None, ..self.running.feed_options(Mode::All)? };
        let source = Bracketed::new(self.running.named()?.open(raw)?, exposures_us, black_level)?;
        let exposures = source.exposures();
        let way = self.way(self.running.named()?, None, None)?;
        let feed = Feed::start(Box::new(source), options)?;
        Ok((Stream::new(feed, way), exposures, self.running.shots))
    }

    /// The source of the pictures, and that of their poses.
    pub fn sources(&self, feed: &Feed) -> Sources {
        Sources { camera: feed.device().into(), poses: self.pose_stream.as_ref().map(PoseUri::to_string) }
    }

    fn way(&self, uri: &CameraUri, poses: Option<&Path>, latency: Option<&Latency>) -> Result<Way> {
        let stream = || {
            let uri_of = self.pose_stream.as_ref().ok_or_else(|| {
                Fault::usage("--pair step and clock need a stream of poses")
                    .next("name it: --pose-stream bcap://HOST, tcp://HOST:PORT or lines:PATH")
            })?;
            let sim = if let CameraUri::Sim(spec) = uri { Some(spec) } else { None };
            PoseFeed::start(uri_of, sim)
        };
        Ok(match self.pair() {
            Pair::None => Way::Nothing,
            Pair::Given => Way::Given,
            Pair::Step => Way::Step(stream()?, Still::default()),
            Pair::Clock => {
                let [delay_ns, delay_sigma_ns] = latency.map_or([0.0; 2], |l| [1e6 * l.delay_ms, 1e6 * l.sigma_ms]);
                Way::Clock { poses: stream()?, delay_ns, delay_sigma_ns }
            }
            Pair::Count => Way::Count(Counting::new(match (poses, self.counts_per_shot) {
                (Some(path), None) => {
                    Table::Rows(load_poses(path)?.poses.into_iter().map(|p| Some(Stand::Robot(p))).collect())
                }
                (None, Some(step)) if self.motion.0.axis().is_some() => Table::Pulses(step),
                (None, None) if self.motion.0.axis().is_some() => Table::Chunk,
                _ => {
                    return Err(Fault::usage("--pair count needs one table of poses or counts")
                        .cause(
                            "a robot's poses by number, or an axis that triggers the camera or counts into its \
                                pictures",
                        )
                        .next(
                            "give --poses FILE, or --motion linear:count with --counts-per-shot N or a camera that \
                               sends its count",
                        ));
                }
            })),
        })
    }
}

/// Collects messages on any thread; the thread that owns the console prints them.
#[derive(Clone)]
pub struct Teller {
    news: Arc<Mutex<Vec<String>>>,
    line: Arc<Mutex<String>>,
    metrics: Option<PathBuf>,
    last: Instant,
}

const EVERY: Duration = Duration::from_secs(1);

impl Teller {
    /// Takes in a message of the stream, and the account once a second.
    pub fn hear(&mut self, stream: &Stream, said: Option<String>) {
        if let Some(said) = said {
            self.news.lock().unwrap_or_else(PoisonError::into_inner).push(said);
        }
        if self.last.elapsed() < EVERY {
            return;
        }
        self.last = Instant::now();
        self.account(stream);
    }

    /// Takes in the present account.
    pub fn account(&mut self, stream: &Stream) {
        self.show(stream.feed(), "");
    }

    /// Reports the account of a feed once a second, preceded by `with`.
    pub fn watch(&mut self, feed: &Feed, with: impl FnOnce() -> String) {
        if self.last.elapsed() >= EVERY {
            self.last = Instant::now();
            self.show(feed, &with());
        }
    }

    /// Reports the final account of a feed.
    pub fn last_word(&mut self, feed: &Feed) {
        self.show(feed, "");
    }

    fn show(&mut self, feed: &Feed, with: &str) {
        let account = feed.account();
        let rate = feed.rate_hz().map_or(String::new(), |r| format!("{r:.1} a second; "));
        *self.line.lock().unwrap_or_else(PoisonError::into_inner) = format!("{with}{rate}{account}");
        if let Some(path) = &self.metrics
            && let Err(fault) = sheetlight::files::write(path, account.prometheus(feed.name()).as_bytes())
        {
            self.news.lock().unwrap_or_else(PoisonError::into_inner).push(fault.what);
            self.metrics = None;
        }
    }

    /// Prints what was collected.
    pub fn tell(&self, console: &Console, bar: &ProgressBar) {
        let news = std::mem::take(&mut *self.news.lock().unwrap_or_else(PoisonError::into_inner));
        news.iter().for_each(|n| bar.suspend(|| console.warn(n)));
        let line = std::mem::take(&mut *self.line.lock().unwrap_or_else(PoisonError::into_inner));
        if !line.is_empty() {
            bar.set_message(line);
        }
    }
}
