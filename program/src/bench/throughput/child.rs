//! In: the command of an entry. Out: its running process, with pictures going in and points coming out on threads of
//! their own. Frame and unit: none.

use super::super::machine;
use super::wire::{Found, Header, Hello, astray, read_points};
use sheetlight::fault::{Fault, Result};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, Instant};

/// Pictures that wait in the driver while one is being sent.
const QUEUE: usize = 2;
/// Replies that may wait in the driver.
const REPLIES: usize = 1 << 16;
/// Bytes of standard error that are read; a program that writes more says nothing in a message.
const MOST_ERRORS: u64 = 1 << 24;
/// Characters of standard error that a message repeats.
const TAIL: usize = 400;

/// Counts what is read.
struct Counted<R> {
    inner: R,
    bytes: Arc<AtomicU64>,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, to: &mut [u8]) -> std::io::Result<usize> {
        let n = self.inner.read(to)?;
        self.bytes.fetch_add(n as u64, Ordering::Relaxed);
        Ok(n)
    }
}

/// The points of one picture.
pub(super) struct Reply {
    pub number: u32,
    pub points: Vec<Found>,
    pub at: Instant,
}

/// What is sent: the number of a picture and its bytes.
type Sent = (u32, Arc<Vec<u8>>);

/// A running entry.
pub(super) struct Running {
    child: Child,
    /// `None` once the input is closed.
    pictures: Option<SyncSender<Sent>>,
    replies: Receiver<std::result::Result<Reply, String>>,
    /// Bytes that came, and those of them that belong to replies and to the first line.
    bytes: Arc<AtomicU64>,
    replied: u64,
    hello_bytes: u64,
    /// Longest wait for the first line, and for the points of any picture.
    patience: Duration,
    errors: tempfile::NamedTempFile,
    /// What the program says of itself.
    pub hello: Hello,
}

/// Runs through a shell, which is replaced by the program: its process is the program's.
fn shell(command: &str) -> Command {
    let mut shell;
    if cfg!(windows) {
        shell = Command::new("cmd");
        shell.args(["/C", command]);
    } else {
        shell = Command::new("sh");
        shell.args(["-c", &format!("exec {command}")]);
    }
    shell
}

impl Running {
    /// Starts an entry, sends the header and waits for its first line.
    pub fn start(command: &str, header: &Header, patience: Duration) -> Result<Running> {
        let failed = |e: std::io::Error| {
            Fault::input(format!("{command}: cannot be run ({e})"))
                .cause("the command names no program")
                .next("try the command in a shell")
        };
        let errors = tempfile::NamedTempFile::new().map_err(failed)?;
        let to_file = errors.reopen().map_err(failed)?;
        let mut process = shell(command);
        process.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(to_file);
        let mut child = process.spawn().map_err(failed)?;
        let mut input = child.stdin.take().expect("it is piped");
        let output = child.stdout.take().expect("it is piped");
        let first = serde_json::to_string(header).expect("plain data") + "\n";
        let (send, pictures) = sync_channel::<Sent>(QUEUE);
        // A closed pipe shows in the replies, which say more.
        let write = move || {
            let mut write = |bytes: &[u8]| input.write_all(bytes).and_then(|()| input.flush());
            if write(first.as_bytes()).is_err() {
                return;
            }
            for (number, bytes) in pictures {
                if write(&number.to_le_bytes()).and_then(|()| write(&bytes)).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("to entry".into()).spawn(write).map_err(failed)?;
        let (say, hellos) = sync_channel::<std::result::Result<(Hello, usize), String>>(1);
        let (reply, replies) = sync_channel(REPLIES);
        let bytes = Arc::new(AtomicU64::new(0));
        let counted = Counted { inner: output, bytes: bytes.clone() };
        let read = move || {
            let mut output = BufReader::with_capacity(1 << 16, counted);
            let mut line = String::new();
            let read = output.by_ref().take(65_536).read_line(&mut line);
            let hello = read.map_err(|e| e.to_string()).and_then(|n| match serde_json::from_str::<Hello>(&line) {
                Ok(hello) => Ok((hello, n)),
                Err(_) if n == 0 => Err("it wrote no first line".into()),
                Err(e) => Err(format!("its first line {line:?} is not JSON ({e})")),
            });
            let good = hello.is_ok();
            if say.send(hello).is_err() || !good {
                return;
            }
            loop {
                let next = match read_points(&mut output) {
                    Ok(None) => return,
                    Ok(Some((number, points))) => Ok(Reply { number, points, at: Instant::now() }),
                    Err(what) => Err(what),
                };
                let end = next.is_err();
                if reply.send(next).is_err() || end {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("from entry".into()).spawn(read).map_err(failed)?;
        let hello = hellos.recv_timeout(patience);
        let mut running = Running {
            child,
            pictures: Some(send),
            replies,
            bytes,
            replied: 0,
            hello_bytes: 0,
            patience,
            errors,
            hello: Hello::default(),
        };
        (running.hello, running.hello_bytes) = match hello {
            Ok(Ok((hello, bytes))) => (hello, bytes as u64),
            Ok(Err(what)) => return Err(running.fault(&what)),
            Err(_) => return Err(running.fault(&format!("no first line in {} s", patience.as_secs_f64()))),
        };
        Ok(running)
    }

    /// What went wrong, with the end of what the program wrote to standard error.
    pub fn fault(&mut self, what: &str) -> Fault {
        // A program that has closed its output ends soon; its exit code belongs to the message.
        let until = Instant::now() + Duration::from_millis(500);
        let mut ended = self.child.try_wait().ok().flatten();
        while ended.is_none() && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(10));
            ended = self.child.try_wait().ok().flatten();
        }
        let ended = ended.map_or_else(String::new, |status| format!("; it ended with {status}"));
        let errors = sheetlight::files::read(self.errors.path(), MOST_ERRORS).unwrap_or_default();
        let errors = String::from_utf8_lossy(&errors);
        let errors = errors.trim();
        let from = errors.char_indices().rev().nth(TAIL - 1).map_or(0, |(i, _)| i);
        let errors = if errors.is_empty() { String::new() } else { format!("; stderr: {}", &errors[from..]) };
        Fault::input(format!("{what}{ended}{errors}"))
            .cause("the program stopped, or its replies are not in the format of docs/benchmark.md")
            .next("compare what it reads and writes with that document")
    }

    /// Sends a picture, and waits until there is room for it.
    pub fn send(&mut self, number: u32, bytes: &Arc<Vec<u8>>) -> Result<()> {
        let sent = self.pictures.as_ref().is_some_and(|p| p.send((number, bytes.clone())).is_ok());
        if sent { Ok(()) } else { Err(self.closed()) }
    }

    /// Sends a picture if there is room for it.
    pub fn offer(&mut self, number: u32, bytes: &Arc<Vec<u8>>) -> Result<bool> {
        match self.pictures.as_ref().map(|p| p.try_send((number, bytes.clone()))) {
            Some(Ok(())) => Ok(true),
            Some(Err(TrySendError::Full(_))) => Ok(false),
            _ => Err(self.closed()),
        }
    }

    /// The program stopped reading: what its output says, if it says something.
    fn closed(&mut self) -> Fault {
        while let Ok(reply) = self.replies.recv_timeout(Duration::from_millis(200)) {
            if let Err(what) = reply {
                return self.fault(&what);
            }
        }
        self.fault("it stopped reading pictures")
    }

    /// The next reply; `None` if no reply came within `wait`.
    fn reply(&mut self, wait: Duration) -> Result<Option<Reply>> {
        match self.replies.recv_timeout(wait) {
            Ok(Ok(reply)) => {
                self.replied += 8 + 24 * reply.points.len() as u64;
                Ok(Some(reply))
            }
            Ok(Err(what)) => Err(self.fault(&what)),
            Err(RecvTimeoutError::Timeout) if wait >= self.patience => {
                let came = self.bytes.load(Ordering::Relaxed).saturating_sub(self.hello_bytes + self.replied);
                let why = if came == 0 { ": is its output flushed?" } else { " of a reply that is too short" };
                let seconds = self.patience.as_secs_f64();
                Err(self.fault(&format!("no reply in {seconds} s, {came} bytes came{why}")))
            }
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => {
                Err(self.fault("it closed its output before all pictures were answered"))
            }
        }
    }

    /// The next reply, which must be to picture `number`; `None` if no reply came within `wait`.
    pub fn reply_to(&mut self, number: u32, wait: Duration) -> Result<Option<Reply>> {
        match self.reply(wait)? {
            Some(reply) if reply.number != number => Err(self.fault(&astray(reply.number, number))),
            other => Ok(other),
        }
    }

    /// CPU time so far, s.
    pub fn cpu_s(&self) -> Option<f64> {
        machine::cpu_seconds_of(self.child.id())
    }

    /// Most memory so far, MB.
    pub fn memory_mb(&self) -> Option<f64> {
        machine::peak_memory_of(self.child.id()).map(|b| b as f64 / 1e6)
    }

    /// Closes the input and waits for the end of the program.
    pub fn finish(mut self) -> Result<()> {
        self.pictures = None;
        let until = Instant::now() + Duration::from_secs(10);
        loop {
            match self.child.try_wait() {
                Ok(Some(status)) if status.success() => return Ok(()),
                Ok(Some(_)) => return Err(self.fault("it failed at the end of its input")),
                _ if Instant::now() > until => return Err(self.fault("it did not end within 10 s of its input's end")),
                _ => std::thread::sleep(Duration::from_millis(2)),
            }
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.pictures = None;
        if !matches!(self.child.try_wait(), Ok(Some(_))) {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}
