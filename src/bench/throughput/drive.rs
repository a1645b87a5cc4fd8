//! In: entries and tasks. Out: the rounds of every entry on the same pictures, in turns, and what they returned.
//! Frame and unit: seconds; px.

use super::super::steady::percentile;
use super::child::{PATIENCE, Reply, Running};
use super::drawing;
use super::result::{EntryOf, Results, Round, RowOf, machine};
use super::scene::Task;
use super::score::Score;
use super::wire::{FORMAT, Found, Hello, Scenario, picture_bytes};
use crate::fault::{Fault, Result};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Processes of `Streams`.
const STREAMS: usize = 4;

/// A program that takes part.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its name in the results.
    pub name: String,
    /// The command; `{scene}`, `{size}`, `{bits}` and `{scenario}` are replaced, and put it into the open division.
    pub command: String,
}

/// The placeholders of a command.
const PLACES: [&str; 4] = ["{scene}", "{size}", "{bits}", "{scenario}"];

impl Entry {
    /// An entry from `NAME=COMMAND`.
    ///
    /// # Errors
    /// A text without name or command.
    pub fn parse(text: &str) -> std::result::Result<Entry, String> {
        match text.split_once('=') {
            Some((name, command)) if !name.trim().is_empty() && !command.trim().is_empty() => {
                Ok(Entry { name: name.trim().into(), command: command.trim().into() })
            }
            _ => Err(format!("'{text}' is not NAME=COMMAND")),
        }
    }

    /// Whether the command is the same for all scenes.
    pub fn closed(&self) -> bool {
        !PLACES.iter().any(|p| self.command.contains(p))
    }

    fn command(&self, task: &Task, scenario: Scenario) -> String {
        let size = format!("{}x{}", task.width, task.height);
        let values = [task.scene.name(), &size, &task.bits.to_string(), scenario.name()].map(str::to_owned);
        PLACES.iter().zip(values).fold(self.command.clone(), |c, (place, value)| c.replace(place, &value))
    }
}

/// What to run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Entries, in the order of their turns.
    pub entries: Vec<Entry>,
    /// Tasks; each runs in each scenario.
    pub tasks: Vec<Task>,
    /// Scenarios.
    pub scenarios: Vec<Scenario>,
    /// Rounds of every entry, 1..=1000.
    pub rounds: usize,
    /// Least duration of a round, s, 0.05..=600.
    pub seconds: f64,
    /// Pictures a second of `Camera`; `None`: 60 million pixels a second.
    pub rate_hz: Option<f64>,
}

/// Pixels a second of `Camera` where no rate is given.
const CAMERA_PX: f64 = 60e6;

impl Plan {
    /// Refuses numbers out of range, and entries that cannot be told apart.
    pub fn check(&self) -> Result<()> {
        let wrong = |what: String| Err(Fault::usage(what).next("correct the option"));
        if self.entries.is_empty() || self.tasks.is_empty() || self.scenarios.is_empty() {
            return wrong("0 entries, tasks or scenarios, 1 or more of each needed".into());
        }
        if !(1..=1000).contains(&self.rounds) {
            return wrong(format!("{} rounds, 1 to 1000 are possible", self.rounds));
        }
        if !(0.05..=600.0).contains(&self.seconds) {
            return wrong(format!("{} seconds a round, 0.05 to 600 are possible", self.seconds));
        }
        if self.rate_hz.is_some_and(|r| !(0.1..=10_000.0).contains(&r)) {
            return wrong(format!("{} pictures a second, 0.1 to 10000 are possible", self.rate_hz.unwrap_or(0.0)));
        }
        let mut names: Vec<&str> = self.entries.iter().map(|e| e.name.as_str()).collect();
        names.sort_unstable();
        if let Some(twice) = names.windows(2).find(|w| w[0] == w[1]) {
            return wrong(format!("two entries are called {}, names are needed once each", twice[0]));
        }
        Ok(())
    }
}

/// One entry at one task: its processes, and what they have returned.
struct Turn {
    streams: Vec<Running>,
    rounds: Vec<Round>,
    /// Number of the next picture.
    next: u32,
    /// Passes over the pictures in a round.
    passes: u32,
    /// The first replies of the last round, with the index of their picture.
    last: Vec<(u32, Vec<Found>)>,
    memory_mb: Option<f64>,
    failed: Option<String>,
}

/// The pictures of a task as they are sent.
struct Frames {
    bytes: Vec<Arc<Vec<u8>>>,
    hash: String,
}

/// Runs the benchmark. `progress` receives a description of each row's turn.
///
/// # Errors
/// Options out of range. An entry that fails has a row with the reason, and the others run on.
pub fn run(plan: &Plan, mut progress: impl FnMut(&str)) -> Result<Results> {
    plan.check()?;
    let started = jiff::Timestamp::now().to_string();
    let machine = machine();
    let mut says: Vec<Option<Hello>> = vec![None; plan.entries.len()];
    let mut rows = Vec::new();
    for task in &plan.tasks {
        let pictures = drawing::pictures(task);
        let hash = drawing::hash(&pictures);
        let bytes = pictures.iter().map(|p| Arc::new(picture_bytes(p))).collect();
        let frames = Frames { bytes, hash };
        for &scenario in &plan.scenarios {
            rows.extend(row(plan, task, scenario, &frames, &mut says, &mut progress));
        }
    }
    let entries = plan.entries.iter().zip(says).map(|(e, says)| EntryOf {
        name: e.name.clone(),
        command: e.command.clone(),
        closed: e.closed(),
        says,
    });
    let (driver, entries) = (env!("CARGO_PKG_VERSION").to_owned(), entries.collect());
    Ok(Results { sheetlight_bench: FORMAT, driver, started, machine, entries, rows })
}

/// All entries at one task in one scenario.
fn row(
    plan: &Plan,
    task: &Task,
    scenario: Scenario,
    frames: &Frames,
    says: &mut [Option<Hello>],
    progress: &mut impl FnMut(&str),
) -> Vec<RowOf> {
    let pixels = f64::from(task.width) * f64::from(task.height);
    let rate_hz = (scenario == Scenario::Camera).then(|| plan.rate_hz.unwrap_or(CAMERA_PX / pixels));
    let mut turns: Vec<Turn> = Vec::new();
    for (entry, says) in plan.entries.iter().zip(says) {
        progress(&format!("{}, {}: {} starts", task.name(), scenario.name(), entry.name));
        let mut turn = Turn {
            streams: Vec::new(),
            rounds: Vec::new(),
            next: 0,
            passes: 1,
            last: Vec::new(),
            memory_mb: None,
            failed: None,
        };
        let begun = turn.begin(entry, task, scenario, frames, plan.seconds);
        turn.failed = begun.err().map(|fault| fault.what);
        *says = says.take().or_else(|| turn.streams.first().map(|s| s.hello.clone()));
        turns.push(turn);
    }
    for round in 0..plan.rounds {
        for (entry, turn) in plan.entries.iter().zip(&mut turns).filter(|(_, t)| t.failed.is_none()) {
            let place = format!("round {} of {}", round + 1, plan.rounds);
            progress(&format!("{}, {}: {}, {place}", task.name(), scenario.name(), entry.name));
            match turn.round(scenario, frames, rate_hz, plan.seconds) {
                Ok(round) => turn.rounds.push(round),
                Err(fault) => turn.failed = Some(fault.what),
            }
        }
    }
    let rows = plan.entries.iter().zip(turns).map(|(entry, mut turn)| {
        let ended = turn.end();
        let failed = turn.failed.take().or(ended.err().map(|fault| fault.what));
        let mut score = Score::default();
        turn.last.iter().for_each(|(n, points)| score.add(task, *n, points));
        RowOf {
            task: *task,
            pictures_sha256: frames.hash.clone(),
            scenario,
            entry: entry.name.clone(),
            rate_hz,
            rounds: turn.rounds,
            accuracy: (failed.is_none() && !turn.last.is_empty()).then(|| score.accuracy()),
            memory_mb: turn.memory_mb,
            failed,
        }
    });
    rows.collect()
}

impl Turn {
    /// Starts the processes, sends all pictures twice, and chooses the passes of a round from the second time.
    fn begin(&mut self, entry: &Entry, task: &Task, scenario: Scenario, frames: &Frames, seconds: f64) -> Result<()> {
        let count = if scenario == Scenario::Streams { STREAMS } else { 1 };
        let header = task.header(scenario);
        for _ in 0..count {
            self.streams.push(Running::start(&entry.name, &entry.command(task, scenario), &header)?);
        }
        let mut wall = 0.0;
        for _ in 0..2 {
            let warm = if scenario == Scenario::Camera { Scenario::Single } else { scenario };
            wall = self.round(warm, frames, None, seconds)?.wall_s;
        }
        self.passes = (seconds / wall.max(1e-6)).ceil().clamp(1.0, 1e5) as u32;
        Ok(())
    }

    /// One round.
    fn round(&mut self, scenario: Scenario, frames: &Frames, rate_hz: Option<f64>, seconds: f64) -> Result<Round> {
        self.last.clear();
        let cpu = self.cpu_s();
        let start = Instant::now();
        let (pictures, dropped, end, waits) = match rate_hz {
            Some(rate) => self.paced(frames, rate, seconds)?,
            None if scenario == Scenario::Single => self.singly(frames)?,
            None => self.offline(frames)?,
        };
        let cpu_s = cpu.and_then(|before| Some(self.cpu_s()? - before));
        let latency_ms = waits.map(|mut w| [0.5, 0.9, 0.99].map(|p| percentile(&mut w, p)));
        Ok(Round { pictures, dropped, wall_s: (end - start).as_secs_f64(), cpu_s, latency_ms })
    }

    fn cpu_s(&self) -> Option<f64> {
        self.streams.iter().map(Running::cpu_s).sum()
    }

    /// Keeps the reply for the score if its picture is one of the round's first pass.
    fn keep(&mut self, frames: &Frames, of_round: usize, reply: Reply) {
        if of_round < frames.bytes.len() {
            self.last.push((reply.number % frames.bytes.len() as u32, reply.points));
        }
    }

    /// The pictures one after the other.
    fn singly(&mut self, frames: &Frames) -> Result<(u64, u64, Instant, Option<Vec<f64>>)> {
        let count = frames.bytes.len();
        let all = count * self.passes as usize;
        let mut waits = Vec::with_capacity(all);
        let mut end = Instant::now();
        for i in 0..all {
            let number = self.next;
            self.next = self.next.wrapping_add(1);
            let sent = Instant::now();
            self.streams[0].send(number, &frames.bytes[number as usize % count])?;
            let reply = self.streams[0].reply_to(number, PATIENCE)?.expect("patience ends in a fault");
            end = reply.at;
            waits.push((end - sent).as_secs_f64());
            self.keep(frames, i, reply);
        }
        Ok((all as u64, 0, end, Some(waits)))
    }

    /// All pictures to every process, as fast as they take them.
    fn offline(&mut self, frames: &Frames) -> Result<(u64, u64, Instant, Option<Vec<f64>>)> {
        let count = frames.bytes.len();
        let all = count * self.passes as usize;
        let first = self.next;
        self.next = self.next.wrapping_add(all as u32);
        let streams = std::mem::take(&mut self.streams);
        // Every process has a thread of its own, so that a slow one does not hold up the others.
        let one = |mut running: Running| -> (Running, Result<(Vec<Reply>, Instant)>) {
            let mut replies = Vec::new();
            let mut end = Instant::now();
            let mut answered = 0;
            let mut take = |running: &mut Running, answered: &mut usize, wait: Duration| -> Result<bool> {
                let number = first.wrapping_add(*answered as u32);
                let Some(reply) = running.reply_to(number, wait)? else { return Ok(false) };
                end = reply.at;
                if *answered < count {
                    replies.push(reply);
                }
                *answered += 1;
                Ok(true)
            };
            let mut pass = || -> Result<()> {
                for i in 0..all {
                    let number = first.wrapping_add(i as u32);
                    running.send(number, &frames.bytes[number as usize % count])?;
                    while take(&mut running, &mut answered, Duration::ZERO)? {}
                }
                while answered < all {
                    take(&mut running, &mut answered, PATIENCE)?;
                }
                Ok(())
            };
            let done = pass();
            (running, done.map(|()| (replies, end)))
        };
        let results: Vec<_> = std::thread::scope(|scope| {
            let started: Vec<_> = streams.into_iter().map(|running| scope.spawn(|| one(running))).collect();
            started.into_iter().map(|t| t.join().expect("it does not panic")).collect()
        });
        let (mut end, mut fault) = (None::<Instant>, None);
        let processes = results.len() as u64;
        for (running, result) in results {
            self.streams.push(running);
            match result {
                Ok((replies, at)) => {
                    end = Some(end.map_or(at, |e| e.max(at)));
                    // One process is scored: all get the same pictures.
                    if self.last.is_empty() {
                        replies.into_iter().enumerate().for_each(|(i, reply)| self.keep(frames, i, reply));
                    }
                }
                Err(f) => fault = fault.or(Some(f)),
            }
        }
        match (fault, end) {
            (Some(fault), _) => Err(fault),
            (None, end) => Ok((processes * all as u64, 0, end.unwrap_or_else(Instant::now), None)),
        }
    }

    /// Pictures at a fixed rate for some seconds; latency counts from the moment a picture is due.
    fn paced(&mut self, frames: &Frames, rate_hz: f64, seconds: f64) -> Result<(u64, u64, Instant, Option<Vec<f64>>)> {
        let count = frames.bytes.len();
        let all = ((seconds * rate_hz).ceil() as usize).max(4);
        let period = Duration::from_secs_f64(1.0 / rate_hz);
        let start = Instant::now();
        let mut due_of = std::collections::VecDeque::new();
        let (mut waits, mut dropped, mut end) = (Vec::new(), 0, start);
        for i in 0..=all {
            let due = start + period * i as u32;
            // Between pictures the replies are taken.
            loop {
                let left = due.saturating_duration_since(Instant::now());
                let wait = if i == all { PATIENCE } else { left };
                if (i == all && due_of.is_empty()) || (i < all && left.is_zero()) {
                    break;
                }
                // Without a picture on its way there is no reply to wait for.
                let Some(&(number, sent)) = due_of.front() else {
                    std::thread::sleep(left);
                    break;
                };
                let Some(reply) = self.streams[0].reply_to(number, wait)? else { break };
                due_of.pop_front();
                end = reply.at;
                waits.push(end.saturating_duration_since(sent).as_secs_f64());
                let of_round = waits.len() - 1;
                self.keep(frames, of_round, reply);
            }
            if i == all {
                break;
            }
            let number = self.next;
            self.next = self.next.wrapping_add(1);
            if self.streams[0].offer(number, &frames.bytes[number as usize % count])? {
                due_of.push_back((number, due));
            } else {
                dropped += 1;
            }
        }
        if waits.is_empty() {
            return Err(self.streams[0].fault("it answered no picture"));
        }
        Ok((waits.len() as u64, dropped, end, Some(waits)))
    }

    /// Reads the memory and ends the processes.
    fn end(&mut self) -> Result<()> {
        let memory: Option<Vec<f64>> = self.streams.iter().map(Running::memory_mb).collect();
        self.memory_mb = memory.filter(|m| !m.is_empty()).map(|m| m.iter().sum());
        let streams = std::mem::take(&mut self.streams);
        if self.failed.is_some() {
            return Ok(());
        }
        streams.into_iter().try_for_each(Running::finish)
    }
}
