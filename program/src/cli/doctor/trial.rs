//! In: the stages. Out: the result of each on this machine's adapter, tried in a separate process: a driver that
//! hangs, exhausts the memory or crashes costs one stage, not the whole check.
//! Frame and unit: processor seconds, MiB.

use crate::bench::{WayTime, way_times};
use crate::cli::terminal::console::Console;
use sheetlight::fault::{Fault, Result};
use sheetlight::gpu::{Device, Rates};
use sheetlight::stages;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// The limits of one stage.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Limit of processor time, s, if the system reports it for other processes, else of elapsed time; 1..=3600.
    pub seconds: f64,
    /// Limit of memory, MiB, 256..=1048576; only enforced on Linux.
    pub mib: u64,
}

impl Limits {
    pub fn check(&self) -> Result<()> {
        let seconds = (1.0..=3600.0).contains(&self.seconds);
        if seconds && (256..=1 << 20).contains(&self.mib) {
            return Ok(());
        }
        Err(Fault::usage(format!(
            "a stage may take {} s and {} MiB, allowed 1..=3600 and 256..=1048576",
            self.seconds, self.mib
        ))
        .next("correct the option"))
    }
}

/// The result of a stage.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct StageFinding {
    pub stage: String,
    pub cases: usize,
    pub largest_difference: f64,
    pub limit: f64,
    pub reason: String,
    /// The case with the largest difference.
    pub worst_case: String,
    /// Why there is no comparison; `None` if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[serde(default)]
    pub failed: Option<String>,
}

impl StageFinding {
    pub fn passed(&self) -> bool {
        self.failed.is_none() && self.largest_difference <= self.limit
    }
}

/// The messages of the process that tries the stages, one a line.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    Device { name: String, reads_texels: bool },
    NoDevice { why: String },
    Begin { stage: String },
    Stage(StageFinding),
    Rates(Rates),
    Ways(Vec<WayTime>),
}

/// Bytes of one transfer: a 12-megapixel shot of 8 bits.
const SHOT: u64 = 4096 * 3072;

/// The trial process: tries the stages from number `from` on, then measures the rates and the time of a shot.
pub fn run(from: usize, rates: bool, console: &Console) -> Result<()> {
    // Nobody reads the messages if the parent process has ended.
    let tell = |event: Event| console.line(&event);
    let device = match Device::open() {
        Ok(device) => device,
        Err(fault) => {
            tell(Event::NoDevice { why: fault.what });
            if rates {
                tell(Event::Ways(way_times(None)?));
            }
            return Ok(());
        }
    };
    tell(Event::Device { name: device.info.name.clone(), reads_texels: device.reads_texels });
    for entry in stages::all().into_iter().skip(from) {
        let stage = entry.stage.name.to_owned();
        if !tell(Event::Begin { stage: stage.clone() }) {
            return Ok(());
        }
        let finding = match entry.verify(&device) {
            Ok(v) => StageFinding {
                stage,
                cases: v.cases,
                largest_difference: v.largest_difference,
                limit: v.limit,
                reason: v.reason.into(),
                worst_case: v.worst_case,
                failed: None,
            },
            Err(fault) => StageFinding { stage, failed: Some(fault.what), ..StageFinding::default() },
        };
        tell(Event::Stage(finding));
    }
    if rates {
        tell(Event::Rates(device.measure_rates(SHOT)?));
        tell(Event::Ways(way_times(Some(&device))?));
    }
    Ok(())
}

/// Interval at which the trial process is checked.
const LOOK: Duration = Duration::from_millis(100);

/// Tries every stage, each within the limits; `tell` receives every event at once. After an aborted stage no rates
/// are measured, because the chain needs it.
pub fn watch(limits: &Limits, mut rates: bool, tell: &mut dyn FnMut(Event)) -> Result<()> {
    let names: Vec<&str> = stages::all().iter().map(|e| e.stage.name).collect();
    let mut next = 0;
    loop {
        let mut child = start(next, rates)?;
        let lines = lines(&mut child)?;
        let mut under_way = None;
        let ended = follow(&child, &lines, limits, &mut |event| {
            match &event {
                Event::Begin { stage } => under_way = Some(stage.clone()),
                Event::Stage(_) => {
                    next += 1;
                    under_way = None;
                }
                _ => {}
            }
            tell(event);
        });
        // The process may already have ended.
        let _ = child.kill();
        let status = child.wait().map_err(|e| failed("cannot be waited for", &e))?;
        let why = match ended {
            Ended::Beyond(why) => why,
            Ended::ByItself if status.success() => return Ok(()),
            Ended::ByItself => format!("the driver ended the program ({status})"),
        };
        let Some(stage) = under_way else {
            let at = names.get(next).map_or("the transfer rates", |name| name);
            tell(Event::NoDevice { why: format!("before {at}: {why}") });
            return Ok(());
        };
        (next, rates) = (next + 1, false);
        tell(Event::Stage(StageFinding { stage, failed: Some(why), ..StageFinding::default() }));
        if next == names.len() {
            return Ok(());
        }
    }
}

enum Ended {
    ByItself,
    /// A limit was exceeded; the used amount against the limit.
    Beyond(String),
}

fn failed(what: &str, e: &std::io::Error) -> Fault {
    Fault::device(format!("the process that tries the stages {what}: {e}"))
        .cause("the memory ran out, or the program's file was moved")
        .next("run it again, or scan with --on cpu")
}

fn start(from: usize, rates: bool) -> Result<Child> {
    let program = std::env::current_exe().map_err(|e| failed("cannot be found", &e))?;
    let mut command = Command::new(program);
    command.args(["doctor", "--from-stage", &from.to_string()]);
    if !rates {
        command.arg("--no-rates");
    }
    command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().map_err(|e| failed("cannot be started", &e))
}

/// The lines of the process, read on a thread because it may be silent for minutes.
fn lines(child: &mut Child) -> Result<Receiver<Event>> {
    let out = BufReader::new(child.stdout.take().expect("piped"));
    let (give, take) = channel();
    let read = move || {
        let events = out.lines().map_while(|l| l.ok()).filter_map(|l| serde_json::from_str(&l).ok());
        // After a limit was exceeded nobody receives the lines.
        events.map(|e| give.send(e)).take_while(|sent| sent.is_ok()).for_each(drop);
    };
    let spawned = std::thread::Builder::new().spawn(read);
    spawned.map_err(|e| failed("cannot be listened to", &e))?;
    Ok(take)
}

/// Receives lines until the process ends or exceeds a limit since its last line.
fn follow(child: &Child, lines: &Receiver<Event>, limits: &Limits, tell: &mut dyn FnMut(Event)) -> Ended {
    let mut since = (Instant::now(), 0.0);
    loop {
        let now = taken(child.id());
        match lines.recv_timeout(LOOK) {
            Ok(event) => {
                since = (Instant::now(), now.map_or(0.0, |t| t.0));
                tell(event);
                continue;
            }
            Err(RecvTimeoutError::Disconnected) => return Ended::ByItself,
            Err(RecvTimeoutError::Timeout) => {}
        }
        let seconds = now.map_or_else(|| since.0.elapsed().as_secs_f64(), |t| t.0 - since.1);
        if seconds > limits.seconds {
            return Ended::Beyond(format!("{seconds:.0} s without a result, limit {} s", limits.seconds));
        }
        if let Some(mib) = now.map(|t| t.1).filter(|mib| *mib > limits.mib) {
            return Ended::Beyond(format!("{mib} MiB of memory, limit {} MiB", limits.mib));
        }
    }
}

/// Processor time of a process, s, and its memory, MiB; [proc(5)].
fn taken(id: u32) -> Option<(f64, u64)> {
    /// Ticks per second and bytes per page on every supported Linux.
    const TICKS: f64 = 100.0;
    const PAGE: u64 = 4096;
    let text = std::fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
    // The name before it may contain blanks.
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let number = |field: usize| fields.get(field - 3)?.parse::<u64>().ok();
    Some(((number(14)? + number(15)?) as f64 / TICKS, (number(24)? * PAGE) >> 20))
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    /// Replaces the trial process: prints a line, then uses time or memory.
    fn followed(script: &str, limits: Limits) -> (Ended, usize) {
        let mut child = Command::new("bash").args(["-c", script]).stdout(Stdio::piped()).spawn().unwrap();
        let lines = lines(&mut child).unwrap();
        let mut told = 0;
        let ended = follow(&child, &lines, &limits, &mut |_| told += 1);
        child.kill().unwrap();
        child.wait().unwrap();
        (ended, told)
    }

    #[test]
    fn what_takes_too_much_is_ended_and_what_ends_is_heard() {
        let begin = r#"echo '{"begin":{"stage":"peak"}}'; "#;
        let limits = Limits { seconds: 1.0, mib: 300 };
        let (ended, told) = followed(&format!("{begin} while :; do :; done"), limits);
        assert!(matches!(ended, Ended::Beyond(why) if why.contains("limit 1 s")) && told == 1);
        let (ended, told) = followed(
            &format!("{begin} x=$(head -c 400M /dev/zero | tr '\\0' a); sleep 60"),
            Limits { seconds: 600.0, ..limits },
        );
        assert!(matches!(ended, Ended::Beyond(why) if why.contains("limit 300 MiB")) && told == 1);
        let (ended, told) = followed(&format!("{begin} {begin} exit 3"), limits);
        assert!(matches!(ended, Ended::ByItself) && told == 2);
    }
}
