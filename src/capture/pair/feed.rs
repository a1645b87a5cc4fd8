//! In: a source of poses. Out: a track of them that grows while a thread listens or polls.
//! Frame and unit: base_from_flange, mm, or counts; the host's time in ns.

use super::lines::{LONGEST, LineClock, Lines};
use super::track::{Between, Sample, Track};
use super::uri::PoseUri;
use crate::arm::{PoseSource, TimedPose};
use crate::capture::clock::{ClockMap, RoundTrip, now_ns, ns_of};
use crate::capture::source::sim::{SimMotion, SimSpec};
use crate::fault::{Fault, Kind, Result};
use crate::recording::Stand;
use std::io::{BufRead, BufReader, Read};
use std::net::TcpStream;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Interval of queries to a robot: as often as most controllers answer.
const ASK: Duration = Duration::from_millis(8);
/// Uncertainty of the shortest transmission delay of a pose with the sender's time, 1 sigma, ns.
const WAY: f64 = 2e5;
/// Interval of attempts to reach a server again.
const RETRY: Duration = Duration::from_millis(500);

#[derive(Default)]
struct State {
    track: Track,
    fault: Option<Fault>,
    said: Vec<String>,
    came: u64,
}

/// A running source of poses.
pub struct PoseFeed {
    state: Arc<Mutex<State>>,
    stop: Arc<AtomicBool>,
}

type Shared = (Arc<Mutex<State>>, Arc<AtomicBool>);

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

impl PoseFeed {
    /// Starts listening or polling. `sim` states what a simulated camera moves, if there is one.
    ///
    /// # Errors
    /// No server or robot answers; the file does not exist.
    pub fn start(uri: &PoseUri, sim: Option<&SimSpec>) -> Result<PoseFeed> {
        let shared: Shared = Default::default();
        let theirs = (shared.0.clone(), shared.1.clone());
        let thread = |work: Box<dyn FnOnce(Shared) + Send>| {
            let name = std::thread::Builder::new().name("poses".into());
            let last = Last(theirs.clone());
            name.spawn(move || {
                let _last = last;
                work(theirs);
            })
            .map(|_| ())
            .map_err(|e| Fault::threads(&e))
        };
        match uri {
            PoseUri::Tcp(address) => {
                let (stream, address) = (connect(address)?, address.clone());
                thread(Box::new(move |s| listen_again(stream, &address, &s)))?;
            }
            PoseUri::Lines(path) => {
                let file = open(path)?;
                // A named pipe opens, and is read, only once a program writes to it.
                let paced = !path.is_file();
                thread(Box::new(move |s| match file() {
                    Ok(file) => drop(listen(file, &s, paced)),
                    Err(fault) => lock(&s.0).fault = Some(fault),
                }))?;
            }
            PoseUri::Sim(word) => {
                let spec = sim.ok_or_else(|| {
                    Fault::usage(format!(
                        "{word}: these poses belong to a simulated station, but the camera is \
                                          another"
                    ))
                    .next("give the same URI as --camera")
                })?;
                let motion = SimMotion::new(spec)?;
                thread(Box::new(move |s| simulate(&motion, &s)))?;
            }
            PoseUri::Robot(uri) => {
                let arm = crate::arm::open(uri)?;
                let poses = arm.watch()?;
                thread(Box::new(move |s| ask(poses, || arm.watch(), &s)))?;
            }
        }
        Ok(PoseFeed { state: shared.0, stop: shared.1 })
    }

    /// A feed of given poses, for tests and for programs that supply the poses themselves.
    pub fn of(samples: impl IntoIterator<Item = Sample>) -> PoseFeed {
        let feed = PoseFeed { state: Arc::default(), stop: Arc::default() };
        {
            let mut state = lock(&feed.state);
            samples.into_iter().for_each(|s| state.track.add(s));
            state.track.end();
        }
        feed
    }

    /// Position at a host's time; as [`Track::at`].
    pub fn at(&self, ns: u64) -> Option<std::result::Result<Between, String>> {
        lock(&self.state).track.at(ns)
    }

    /// Time of the last pose.
    pub fn newest(&self) -> Option<u64> {
        lock(&self.state).track.newest()
    }

    /// The reason why poses are no longer reliable; it ends the run.
    pub fn fault(&self) -> Option<Fault> {
        lock(&self.state).fault.clone()
    }

    /// Messages since the last call.
    pub fn news(&self) -> Vec<String> {
        std::mem::take(&mut lock(&self.state).said)
    }

    /// Number of poses received.
    pub fn came(&self) -> u64 {
        lock(&self.state).came
    }
}

impl Drop for PoseFeed {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Ends the track when the thread that fills it ends for any reason: otherwise pictures would wait for poses that
/// never come.
struct Last(Shared);

impl Drop for Last {
    fn drop(&mut self) {
        let mut state = lock(&self.0.0);
        state.track.end();
        if std::thread::panicking() {
            let what = "the part of this program that takes in poses broke down";
            state.fault = Some(Fault::device(what).cause("a mistake in this program").next("report what stands above"));
        }
    }
}

fn add(shared: &Shared, sample: Sample) {
    let mut state = lock(&shared.0);
    state.track.add(sample);
    state.came += 1;
}

fn connect(address: &str) -> Result<TcpStream> {
    TcpStream::connect(address).map_err(|e| {
        Fault::input(format!("{address}: no pose server answers there: {e}"))
            .cause("the sender is not running, or the port is another")
            .next("start it first; it has to listen, and to write a line for each pose (docs/live.md)")
    })
}

/// Checks a file now; the thread opens it later.
fn open(path: &Path) -> Result<impl FnOnce() -> Result<std::fs::File> + Send + 'static> {
    std::fs::metadata(path).map_err(|e| Fault::read(path, e))?;
    let path = path.to_owned();
    Ok(move || std::fs::File::open(&path).map_err(|e| Fault::read(&path, e)))
}

fn listen_again(stream: TcpStream, address: &str, shared: &Shared) {
    let mut stream = Some(stream);
    while !shared.1.load(Ordering::Relaxed) && lock(&shared.0).fault.is_none() {
        if let Some(stream) = stream.take() {
            let why = listen(stream, shared, true);
            let mut state = lock(&shared.0);
            state.track.cut();
            state.said.push(format!("{address}: the stream of poses ended ({why}); asking again"));
        }
        std::thread::sleep(RETRY);
        stream = connect(address).ok();
    }
}

/// Reads lines to the end; returns how the stream ended.
fn listen(stream: impl Read, shared: &Shared, paced: bool) -> String {
    let (mut reader, mut lines, mut clock) = (BufReader::new(stream), Lines::default(), ClockMap::default());
    let mut line = Vec::new();
    loop {
        line.clear();
        if shared.1.load(Ordering::Relaxed) {
            return "stopped".into();
        }
        match (&mut reader).take(LONGEST as u64).read_until(b'\n', &mut line) {
            Err(e) => return e.to_string(),
            Ok(0) => return "closed".into(),
            // An incomplete line is no pose: its last number may have lost digits.
            Ok(n) if line.last() != Some(&b'\n') => {
                let what = if n == LONGEST {
                    "a line without an end"
                } else {
                    "closed in the middle of a line, which is ignored"
                };
                return what.into();
            }
            Ok(_) => {}
        }
        let here = now_ns();
        let told = match lines.read(&String::from_utf8_lossy(&line), here, paced) {
            Ok(Some(told)) => told,
            Ok(None) => continue,
            Err(fault) => {
                let said = fault.what.clone();
                let mut state = lock(&shared.0);
                state.fault = Some(fault);
                state.track.end();
                return said;
            }
        };
        let (ns, sigma_ns) = match lines.clock() {
            LineClock::Unix => (told.t_ns, 0.0),
            LineClock::Own => {
                let before = clock.jumps();
                clock.one_way(told.t_ns, here);
                if clock.jumps() > before {
                    let mut state = lock(&shared.0);
                    state.track.cut();
                    state.said.push("the clock of the poses jumped: no pose is interpolated across the jump".into());
                }
                let moment = clock.host(told.t_ns).expect("a reading was taken in");
                (moment.ns as u64, moment.sigma_ns.max(WAY))
            }
        };
        add(shared, Sample { ns, sigma_ns, stand: told.stand });
    }
}

fn simulate(motion: &SimMotion, shared: &Shared) {
    while !shared.1.load(Ordering::Relaxed) {
        let ns = now_ns();
        add(shared, Sample { ns, sigma_ns: 0.0, stand: motion.stand(ns) });
        std::thread::sleep(ASK / 2);
    }
}

/// Resolution of a controller's time, ns: most count whole milliseconds.
const RESOLUTION: u64 = 1_000_000;

/// A pose with its time. A controller's own time is converted by round trips, widened by half its resolution at both
/// ends.
fn sample(pose: &TimedPose, clock: &mut ClockMap) -> Sample {
    let (before_ns, after_ns) = (ns_of(pose.asked), ns_of(pose.here));
    let plain = || (before_ns + (after_ns - before_ns) / 2, 0.5 * (after_ns - before_ns) as f64 / 3f64.sqrt());
    let (ns, sigma_ns) = match pose.device.map(|d| d.as_nanos() as u64) {
        Some(there_ns) => {
            let (before_ns, after_ns) = (before_ns - RESOLUTION / 2, after_ns + RESOLUTION / 2);
            clock.round_trip(RoundTrip { before_ns, there_ns, after_ns });
            clock.host(there_ns).map_or_else(plain, |m| (m.ns as u64, m.sigma_ns))
        }
        None => plain(),
    };
    Sample { ns, sigma_ns, stand: Stand::Robot(pose.base_from_flange) }
}

/// Polls a robot until it is stopped; `again` reconnects after a broken connection. A list of poses that has ended
/// is not started again.
fn ask(poses: Box<dyn PoseSource>, again: impl Fn() -> Result<Box<dyn PoseSource>>, shared: &Shared) {
    let (mut clock, mut poses, mut answers) = (ClockMap::default(), Some(poses), true);
    while !shared.1.load(Ordering::Relaxed) {
        let told = match &mut poses {
            Some(source) => source.pose(),
            None => again().and_then(|source| poses.insert(source).pose()),
        };
        match told {
            Ok(pose) => {
                let jumps = clock.jumps();
                let sample = sample(&pose, &mut clock);
                let mut state = lock(&shared.0);
                if clock.jumps() > jumps {
                    state.track.cut();
                    state.said.push("the controller's clock jumped: no pose is interpolated across the jump".into());
                }
                if !std::mem::replace(&mut answers, true) {
                    state.said.push("the robot tells its pose again".into());
                }
                drop(state);
                add(shared, sample);
                std::thread::sleep(ASK / 2);
            }
            Err(fault) => {
                let comes_back = matches!(fault.kind, Kind::Device | Kind::Refused);
                let mut state = lock(&shared.0);
                state.track.cut();
                if std::mem::replace(&mut answers, false) {
                    state.said.push(if comes_back { format!("{}; asking again", fault.what) } else { fault.what });
                }
                drop(state);
                if !comes_back {
                    return;
                }
                poses = None;
                std::thread::sleep(RETRY);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rigid;
    use std::collections::VecDeque;
    use std::time::Instant;

    fn pose(asked: Instant, way: Duration, device: Option<Duration>) -> TimedPose {
        TimedPose { base_from_flange: Rigid::identity(), figure: None, asked, here: asked + way, device }
    }

    /// Round trips far shorter than the controller's resolution of a millisecond.
    #[test]
    fn a_controller_that_counts_whole_milliseconds_does_not_jump() {
        let (begun, mut clock) = (Instant::now() + Duration::from_secs(1), ClockMap::default());
        for k in 0..2000u64 {
            let (asked, way) = (Duration::from_micros(k * 4_321), Duration::from_micros(40 + k % 90));
            let there = Duration::from_secs(77) + asked + way / 2;
            let told = pose(begun + asked, way, Some(Duration::from_millis(there.as_millis() as u64)));
            let sample = sample(&told, &mut clock);
            let truth = ns_of(begun + asked + way / 2) as f64;
            assert!((sample.ns as f64 - truth).abs() < 1.2e6, "{k}: {} ns off", sample.ns as f64 - truth);
            assert!((sample.ns as f64 - truth).abs() < 4.0 * sample.sigma_ns, "{k}: sigma {}", sample.sigma_ns);
        }
        assert_eq!(clock.jumps(), 0);
    }

    struct Spells(VecDeque<Option<Fault>>);

    impl PoseSource for Spells {
        fn pose(&mut self) -> Result<TimedPose> {
            match self.0.pop_front().expect("asked no more after the end") {
                None => Ok(pose(Instant::now(), Duration::ZERO, None)),
                Some(fault) => Err(fault),
            }
        }
    }

    #[test]
    fn a_robot_that_was_cut_off_is_asked_again_and_a_list_ends_with_its_last_pose() {
        let shared: Shared = Default::default();
        let spells = |s: &[Option<Fault>]| -> Box<dyn PoseSource> { Box::new(Spells(s.iter().cloned().collect())) };
        let cut = || Some(Fault::device("cut"));
        let later = Mutex::new(VecDeque::from([
            Err(Fault::device("no way yet")),
            Ok(spells(&[None, None, Some(Fault::input("asked for more than there is"))])),
        ]));
        ask(spells(&[None, cut()]), || later.lock().unwrap().pop_front().unwrap(), &shared);
        let state = lock(&shared.0);
        assert_eq!(state.came, 3);
        assert_eq!(state.said, ["cut; asking again", "the robot tells its pose again", "asked for more than there is"]);
    }

    #[test]
    fn pictures_do_not_wait_for_a_thread_that_broke_down() {
        let shared: Shared = Default::default();
        let last = Last(shared.clone());
        let thread = std::thread::spawn(move || {
            let _last = last;
            panic!("on purpose");
        });
        assert!(thread.join().is_err());
        assert!(lock(&shared.0).fault.is_some());
        assert!(lock(&shared.0).track.at(1).unwrap().is_err());
    }
}
