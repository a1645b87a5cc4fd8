//! In: entries and tasks. Out: the rounds of every entry on the same pictures, in turns, and what they returned.
//! Frame and unit: seconds; px.

use super::super::steady::percentile;
use super::child::Running;
use super::drawing;
use super::result::{EntryOf, Results, Round, RowOf, machine};
use super::scene::Task;
use super::score::Score;
use super::wire::{FORMAT, Found, Hello, Scenario, picture_bytes};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sheetlight::fault::{Fault, Result};
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
    /// Longest wait for an entry's first line, and for the points of any picture, s, 0.1..=3600.
    pub timeout_s: f64,
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
        if !(0.1..=3600.0).contains(&self.timeout_s) {
            return wrong(format!("a timeout of {} s, 0.1 to 3600 are possible", self.timeout_s));
        }
        let mut names: Vec<&str> = self.entries.iter().map(|e| e.name.as_str()).collect();
        names.sort_unstable();
        if let Some(twice) = names.windows(2).find(|w| w[0] == w[1]) {
            return wrong(format!("two entries are called {}, names are needed once each", twice[0]));
        }
        Ok(())
    }
}

/// The pictures of a task as they are sent.
struct Frames {
    bytes: Vec<Arc<Vec<u8>>>,
    hash: String,
}

/// Which picture comes next. The order is new in every pass and in every run, so that a picture's number says nothing.
struct Order {
    chance: Pcg64Mcg,
    pass: Vec<u32>,
    at: usize,
}

impl Order {
    fn new(pictures: usize, chance: Pcg64Mcg) -> Order {
        Order { chance, pass: (0..pictures as u32).collect(), at: pictures }
    }

    fn next(&mut self) -> usize {
        if self.at == self.pass.len() {
            self.pass.shuffle(&mut self.chance);
            self.at = 0;
        }
        self.at += 1;
        self.pass[self.at - 1] as usize
    }
}

/// Some of a round's replies, each as likely as any other: which ones are scored is not known before the end.
struct Kept {
    most: usize,
    seen: usize,
    replies: Vec<(usize, Vec<Found>)>,
}

impl Kept {
    fn new(most: usize) -> Kept {
        Kept { most: most.max(1), seen: 0, replies: Vec::new() }
    }

    fn offer(&mut self, picture: usize, points: Vec<Found>, chance: &mut Pcg64Mcg) {
        self.seen += 1;
        if self.replies.len() < self.most {
            self.replies.push((picture, points));
        } else if let Some(place) = self.replies.get_mut(chance.random_range(0..self.seen)) {
            *place = (picture, points);
        }
    }
}

/// What a round gave before it is scored.
struct Ran {
    pictures: u64,
    dropped: u64,
    end: Instant,
    waits: Option<Vec<f64>>,
    kept: Vec<Kept>,
}

/// One entry at one task: its processes, and what they have returned.
struct Turn<'a> {
    plan: &'a Plan,
    frames: &'a Frames,
    streams: Vec<Running>,
    rounds: Vec<Round>,
    /// Number of the next picture.
    next: u32,
    chance: Pcg64Mcg,
    score: Score,
    memory_mb: Option<f64>,
    failed: Option<String>,
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
    let mut silent: Vec<Option<String>> = vec![None; plan.entries.len()];
    let mut rows = Vec::new();
    for task in &plan.tasks {
        let pictures = drawing::pictures(task);
        let hash = drawing::hash(&pictures);
        let bytes = pictures.iter().map(|p| Arc::new(picture_bytes(p))).collect();
        let frames = Frames { bytes, hash };
        for &scenario in &plan.scenarios {
            rows.extend(row(plan, task, scenario, &frames, (&mut says, &mut silent), &mut progress));
        }
    }
    let entries = plan.entries.iter().zip(says).map(|(e, says)| EntryOf {
        name: e.name.clone(),
        command: e.command.clone(),
        closed: e.closed(),
        says,
    });
    Ok(Results {
        sheetlight_bench: FORMAT,
        driver: env!("CARGO_PKG_VERSION").to_owned(),
        started,
        machine,
        rounds: plan.rounds,
        seconds: plan.seconds,
        entries: entries.collect(),
        rows,
    })
}

/// All entries at one task in one scenario. `silent`: entries that gave no reply in time do not run again, because
/// every row would take as long.
fn row(
    plan: &Plan,
    task: &Task,
    scenario: Scenario,
    frames: &Frames,
    (says, silent): (&mut [Option<Hello>], &mut [Option<String>]),
    progress: &mut impl FnMut(&str),
) -> Vec<RowOf> {
    let pixels = f64::from(task.width) * f64::from(task.height);
    let rate_hz = (scenario == Scenario::Camera).then(|| plan.rate_hz.unwrap_or(CAMERA_PX / pixels));
    let mut turns: Vec<Turn> = Vec::new();
    for ((entry, says), silent) in plan.entries.iter().zip(says).zip(silent.iter()) {
        progress(&format!("{}, {}: {} starts", task.name(), scenario.name(), entry.name));
        let mut turn = Turn {
            plan,
            frames,
            streams: Vec::new(),
            rounds: Vec::new(),
            next: 0,
            chance: Pcg64Mcg::from_rng(&mut rand::rng()),
            score: Score::default(),
            memory_mb: None,
            failed: silent.clone(),
        };
        if turn.failed.is_none() {
            turn.failed = turn.begin(entry, task, scenario).err().map(|fault| fault.what);
        }
        *says = says.take().or_else(|| turn.streams.first().map(|s| s.hello.clone()));
        turns.push(turn);
    }
    for round in 0..plan.rounds {
        for (entry, turn) in plan.entries.iter().zip(&mut turns).filter(|(_, t)| t.failed.is_none()) {
            let place = format!("round {} of {}", round + 1, plan.rounds);
            progress(&format!("{}, {}: {}, {place}", task.name(), scenario.name(), entry.name));
            match turn.round(task, scenario, rate_hz, plan.seconds) {
                Ok(round) => turn.rounds.push(round),
                Err(fault) => turn.failed = Some(fault.what),
            }
        }
    }
    let rows = plan.entries.iter().zip(turns).zip(silent).map(|((entry, mut turn), silent)| {
        let ended = turn.end();
        let failed = turn.failed.take().or(ended.err().map(|fault| fault.what));
        if let Some(what) =
            failed.as_ref().filter(|what| what.starts_with("no reply in") || what.starts_with("no first"))
        {
            *silent = Some(format!("not run after {}: {what}", task.name()));
        }
        let scored = failed.is_none() && !turn.rounds.is_empty();
        RowOf {
            task: *task,
            pictures_sha256: frames.hash.clone(),
            scenario,
            entry: entry.name.clone(),
            rate_hz,
            rounds: turn.rounds,
            accuracy: scored.then(|| turn.score.accuracy()),
            memory_mb: turn.memory_mb,
            failed,
        }
    });
    rows.collect()
}

impl Turn<'_> {
    fn patience(&self) -> Duration {
        Duration::from_secs_f64(self.plan.timeout_s)
    }

    /// Starts the processes and sends all pictures twice.
    fn begin(&mut self, entry: &Entry, task: &Task, scenario: Scenario) -> Result<()> {
        let count = if scenario == Scenario::Streams { STREAMS } else { 1 };
        let header = task.header(scenario);
        for _ in 0..count {
            let running = Running::start(&entry.command(task, scenario), &header, self.patience())?;
            self.streams.push(running);
        }
        let warm = if scenario == Scenario::Camera { Scenario::Single } else { scenario };
        for _ in 0..2 {
            self.round(task, warm, None, 0.0)?;
        }
        self.score = Score::default();
        Ok(())
    }

    /// One round, scored.
    fn round(&mut self, task: &Task, scenario: Scenario, rate_hz: Option<f64>, seconds: f64) -> Result<Round> {
        let cpu = self.cpu_s();
        let start = Instant::now();
        let ran = match rate_hz {
            Some(rate) => self.paced(rate, seconds)?,
            None if scenario == Scenario::Single => self.singly(seconds)?,
            None => self.offline(seconds)?,
        };
        let cpu_s = cpu.and_then(|before| Some(self.cpu_s()? - before));
        let latency_ms = ran.waits.map(|mut w| [0.5, 0.9, 0.99].map(|p| percentile(&mut w, p)));
        let kept = ran.kept.iter().flat_map(|k| &k.replies);
        kept.for_each(|(picture, points)| self.score.add(task, *picture as u32, points));
        let wall_s = (ran.end - start).as_secs_f64();
        Ok(Round { pictures: ran.pictures, dropped: ran.dropped, wall_s, cpu_s, latency_ms })
    }

    fn cpu_s(&self) -> Option<f64> {
        self.streams.iter().map(Running::cpu_s).sum()
    }

    fn order(&mut self) -> Order {
        Order::new(self.frames.bytes.len(), Pcg64Mcg::from_rng(&mut self.chance))
    }

    /// The pictures one after the other, whole passes until the time is over.
    fn singly(&mut self, seconds: f64) -> Result<Ran> {
        let (count, patience) = (self.frames.bytes.len(), self.patience());
        let (mut order, mut kept, mut waits) = (self.order(), Kept::new(count), Vec::new());
        let start = Instant::now();
        let mut end = start;
        while waits.is_empty() || start.elapsed().as_secs_f64() < seconds {
            for _ in 0..count {
                let (picture, number) = (order.next(), self.next);
                self.next = self.next.wrapping_add(1);
                let sent = Instant::now();
                self.streams[0].send(number, &self.frames.bytes[picture])?;
                let reply = self.streams[0].reply_to(number, patience)?.expect("patience ends in a fault");
                end = reply.at;
                waits.push((end - sent).as_secs_f64());
                kept.offer(picture, reply.points, &mut self.chance);
            }
        }
        Ok(Ran { pictures: waits.len() as u64, dropped: 0, end, waits: Some(waits), kept: vec![kept] })
    }

    /// All pictures to every process as fast as they take them, whole passes until the time is over.
    fn offline(&mut self, seconds: f64) -> Result<Ran> {
        let (first, patience, frames) = (self.next, self.patience(), self.frames);
        let orders: Vec<Order> = (0..self.streams.len()).map(|_| self.order()).collect();
        let share = frames.bytes.len().div_ceil(self.streams.len());
        // Every process has a thread of its own, so that a slow one does not hold up the others.
        let one =
            |running: &mut Running, order: Order| stream(running, order, frames, (first, share), seconds, patience);
        let results: Vec<Result<(u32, Instant, Kept)>> = std::thread::scope(|scope| {
            let start = |(running, order)| {
                let work = move || one(running, order);
                std::thread::Builder::new().name("stream".into()).spawn_scoped(scope, work).map_err(super::wire::lost)
            };
            let started: Vec<_> = self.streams.iter_mut().zip(orders).map(start).collect();
            started.into_iter().map(|t| t?.join().expect("it does not panic")).collect()
        });
        let done = results.into_iter().collect::<Result<Vec<_>>>()?;
        let most = done.iter().map(|d| d.0).max().unwrap_or(0);
        self.next = first.wrapping_add(most);
        let end = done.iter().map(|d| d.1).max().unwrap_or_else(Instant::now);
        let pictures = done.iter().map(|d| u64::from(d.0)).sum();
        Ok(Ran { pictures, dropped: 0, end, waits: None, kept: done.into_iter().map(|d| d.2).collect() })
    }

    /// Pictures at a fixed rate for some seconds; latency counts from the moment a picture is due.
    fn paced(&mut self, rate_hz: f64, seconds: f64) -> Result<Ran> {
        let (mut order, mut kept) = (self.order(), Kept::new(self.frames.bytes.len()));
        let all = ((seconds * rate_hz).ceil() as usize).max(4);
        let period = Duration::from_secs_f64(1.0 / rate_hz);
        let start = Instant::now();
        let mut on_its_way = std::collections::VecDeque::new();
        let (mut waits, mut dropped, mut end) = (Vec::new(), 0, start);
        for i in 0..=all {
            let due = start + period * i as u32;
            // Between pictures the replies are taken.
            loop {
                let left = due.saturating_duration_since(Instant::now());
                let wait = if i == all { self.patience() } else { left };
                if (i == all && on_its_way.is_empty()) || (i < all && left.is_zero()) {
                    break;
                }
                // Without a picture on its way there is no reply to wait for.
                let Some(&(number, picture, sent)) = on_its_way.front() else {
                    std::thread::sleep(left);
                    break;
                };
                let Some(reply) = self.streams[0].reply_to(number, wait)? else { break };
                on_its_way.pop_front();
                end = reply.at;
                waits.push(end.saturating_duration_since(sent).as_secs_f64());
                kept.offer(picture, reply.points, &mut self.chance);
            }
            if i == all {
                break;
            }
            let (picture, number) = (order.next(), self.next);
            self.next = self.next.wrapping_add(1);
            if self.streams[0].offer(number, &self.frames.bytes[picture])? {
                on_its_way.push_back((number, picture, due));
            } else {
                dropped += 1;
            }
        }
        if waits.is_empty() {
            return Err(self.streams[0].fault("it answered no picture"));
        }
        Ok(Ran { pictures: waits.len() as u64, dropped, end, waits: Some(waits), kept: vec![kept] })
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

/// Whole passes to one process: number of pictures, arrival of the last points, and some of the replies.
fn stream(
    running: &mut Running,
    mut order: Order,
    frames: &Frames,
    (first, most): (u32, usize),
    seconds: f64,
    patience: Duration,
) -> Result<(u32, Instant, Kept)> {
    let mut chance = Pcg64Mcg::from_rng(&mut order.chance);
    let mut kept = Kept::new(most);
    let mut sent = std::collections::VecDeque::new();
    let (mut count, mut answered) = (0u32, 0u32);
    let start = Instant::now();
    let mut end = start;
    let mut take =
        |running: &mut Running, sent: &mut std::collections::VecDeque<usize>, wait: Duration| -> Result<bool> {
            if sent.is_empty() {
                return Ok(false);
            }
            let Some(reply) = running.reply_to(first.wrapping_add(answered), wait)? else { return Ok(false) };
            end = reply.at;
            answered += 1;
            kept.offer(sent.pop_front().expect("it is not empty"), reply.points, &mut chance);
            Ok(true)
        };
    while count == 0 || start.elapsed().as_secs_f64() < seconds {
        for _ in 0..frames.bytes.len() {
            let picture = order.next();
            running.send(first.wrapping_add(count), &frames.bytes[picture])?;
            count += 1;
            sent.push_back(picture);
            while take(running, &mut sent, Duration::ZERO)? {}
        }
    }
    while take(running, &mut sent, patience)? {}
    Ok((count, end, kept))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pass_has_all_pictures_in_another_order() {
        let mut order = Order::new(8, Pcg64Mcg::seed_from_u64(1));
        let passes: Vec<Vec<usize>> = (0..4).map(|_| (0..8).map(|_| order.next()).collect()).collect();
        for pass in &passes {
            let mut sorted = pass.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3, 4, 5, 6, 7]);
        }
        assert!(passes[0] != passes[1] && passes[1] != passes[2]);
    }

    #[test]
    fn replies_of_the_whole_round_are_kept_alike() {
        let mut chance = Pcg64Mcg::seed_from_u64(2);
        let mut late = 0;
        for _ in 0..200 {
            let mut kept = Kept::new(10);
            (0..100).for_each(|i| kept.offer(i, vec![], &mut chance));
            assert_eq!(kept.replies.len(), 10);
            late += kept.replies.iter().filter(|(i, _)| *i >= 50).count();
        }
        // 1000 of 2000 on average; 5 sigma are 112.
        assert!((888..1112).contains(&late), "{late}");
    }
}
