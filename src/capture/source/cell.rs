//! The camera of a simulated cell as a source of pictures, with the protocol of [`crate::capture::wire`].

use crate::camera::Readout;
use crate::capture::clock::{RoundTrip, now_ns};
use crate::capture::feature::{Feature, Range, Value};
use crate::capture::format::Format;
use crate::capture::picture::{Event, Picture, PictureSource};
use crate::capture::wire::{self, HEAD, Message, Sent};
use crate::fault::{Fault, Result};
use std::collections::VecDeque;
use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

/// Time to wait for a connection and for an answer.
const PATIENCE: Duration = Duration::from_secs(3);
const GLANCE: Duration = Duration::from_millis(2);
/// Number of pictures read ahead; more wait in the cell, which counts those that it has to drop.
const AHEAD: usize = 2;

/// A cell's camera at the far end of a TCP connection.
pub struct CellCamera {
    address: String,
    rate_hz: f64,
    link: Link,
    format: Format,
    sent: u64,
    /// Pictures that arrived before an awaited answer.
    pending: VecDeque<(Box<Sent>, u64)>,
}

/// One connection: a thread reads; pictures and answers come through channels.
struct Link {
    stream: TcpStream,
    pictures: Receiver<(Box<Sent>, u64)>,
    answers: Receiver<String>,
    /// The reason why the reading ended.
    end: Receiver<Fault>,
}

impl CellCamera {
    /// Connects to `HOST:PORT` and requests `rate_hz` pictures a second; 0: the cell chooses, negative: only
    /// pictures requested one by one ([`CellCamera::snap`]).
    ///
    /// # Errors
    /// Nothing answers, or something other than a cell.
    pub fn open(address: &str, rate_hz: f64) -> Result<CellCamera> {
        let mut camera = CellCamera {
            address: address.into(),
            rate_hz,
            link: Link::connect(address)?,
            format: Format { width: 1, height: 1, bits: 8 },
            sent: 0,
            pending: VecDeque::new(),
        };
        camera.begin()?;
        Ok(camera)
    }

    fn begin(&mut self) -> Result<()> {
        let said = self.ask("format")?;
        let numbers: Vec<u32> = said.split_whitespace().map_while(|w| w.parse().ok()).collect();
        let [width, height, bits @ 8..=16] = numbers[..] else {
            return Err(Fault::input(format!("{}: says its format is '{said}'", self.address))
                .cause("another version of the cell, or another program")
                .next("start the cell of this version of the program"));
        };
        self.format = Format { width, height, bits: bits as u8 };
        if self.rate_hz >= 0.0 {
            self.ask(&format!("start {}", self.rate_hz))?;
        }
        Ok(())
    }

    /// Requests one picture, taken now; it is delivered like the others.
    ///
    /// # Errors
    /// The cell does not answer, or refuses.
    pub fn snap(&mut self) -> Result<()> {
        self.ask("snap").map(|_| ())
    }

    /// Sends a line, waits for its answer and returns what follows `ok`.
    fn ask(&mut self, line: &str) -> Result<String> {
        let lost = |what: String| {
            Fault::input(format!("{}: {what}", self.address))
                .cause("the cell was stopped, or another program uses that port")
                .next("start the cell and compare the address with the one that it prints")
        };
        let sent = self.link.stream.write_all(format!("{line}\n").as_bytes());
        sent.map_err(|e| lost(format!("cannot be written to: {e}")))?;
        let until = Instant::now() + PATIENCE;
        let answer = loop {
            // An answer comes after the pictures that were sent before it.
            self.pending.extend(self.link.pictures.try_iter());
            match self.link.answers.recv_timeout(GLANCE) {
                Ok(answer) => break answer,
                Err(RecvTimeoutError::Timeout) if Instant::now() < until => {}
                Err(_) => return Err(lost(format!("no answer to '{line}' in {} s", PATIENCE.as_secs()))),
            }
        };
        if let Some(said) = answer.strip_prefix("ok") {
            return Ok(said.trim_start_matches(' ').into());
        }
        let said = answer.strip_prefix("error ").unwrap_or(&answer);
        Err(Fault::usage(format!("{}: '{line}' was refused: {said}", self.address))
            .next("see what can be set with sheetlight camera show"))
    }
}

impl Link {
    fn connect(address: &str) -> Result<Link> {
        let nobody = |e: std::io::Error| {
            Fault::input(format!("{address}: no cell answers: {e}"))
                .cause("it is not running, the port is another, or a firewall is between")
                .next("start it (sheetlight cell simulate) and give the address that it prints")
        };
        let mut found = address.to_socket_addrs().map_err(nobody)?;
        let first = found.next().ok_or_else(|| nobody(std::io::ErrorKind::NotFound.into()))?;
        let stream = TcpStream::connect_timeout(&first, PATIENCE).map_err(nobody)?;
        let _ = stream.set_nodelay(true);
        let mut reader = stream.try_clone().map_err(nobody)?;
        let (to_pictures, pictures) = sync_channel(AHEAD);
        // Only one question is open at a time.
        let (to_answers, answers) = sync_channel(1);
        let (to_end, end) = sync_channel(1);
        let read = move || {
            loop {
                let kept = match message(&mut reader) {
                    Ok(Message::Picture(p)) => to_pictures.send((p, now_ns())).is_ok(),
                    Ok(Message::Text(text)) => to_answers.try_send(text).is_ok(),
                    Err(fault) => {
                        let _ = to_end.send(fault);
                        false
                    }
                };
                if !kept {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("cell".into()).spawn(read).map_err(|e| Fault::threads(&e))?;
        Ok(Link { stream, pictures, answers, end })
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        let _ = self.stream.shutdown(std::net::Shutdown::Both);
    }
}

fn message(reader: &mut TcpStream) -> Result<Message> {
    let ended = |e: std::io::Error| {
        Fault::input(format!("the cell closed the connection: {e}"))
            .cause("it was stopped, or the network failed")
            .next("start it again")
    };
    let mut head = [0; HEAD];
    reader.read_exact(&mut head).map_err(ended)?;
    let head = wire::read_head(&head)?;
    let mut content = Vec::new();
    reader.take(head.length as u64).read_to_end(&mut content).map_err(ended)?;
    wire::read(head, content)
}

impl PictureSource for CellCamera {
    fn format(&self) -> Format {
        self.format
    }

    fn readout(&self) -> Option<Readout> {
        Some(Readout { sensor_px: Some([self.format.width, self.format.height]), ..Readout::default() })
    }

    fn next(&mut self, within: Duration) -> Event {
        let next = self.pending.pop_front().map_or_else(|| self.link.pictures.recv_timeout(within), Ok);
        match next {
            Ok((sent, host_ns)) => {
                self.sent = sent.sent;
                let Sent { image, id, device_ns, exposure_ns, count, .. } = *sent;
                let (device_ns, exposure_ns) = (Some(device_ns), Some(exposure_ns));
                Event::Picture(Box::new(Picture {
                    image,
                    id,
                    device_ns,
                    host_ns,
                    exposure_ns,
                    count,
                    stand: None,
                    profiles: None,
                }))
            }
            Err(RecvTimeoutError::Timeout) => Event::Quiet,
            Err(RecvTimeoutError::Disconnected) => {
                let why = self.link.end.try_recv();
                let gone = |_| {
                    Fault::input(format!("{}: is gone", self.address))
                        .next("see whether the cell still runs; it is waited for")
                };
                Event::Lost(why.unwrap_or_else(gone))
            }
        }
    }

    fn trigger(&mut self) -> Result<bool> {
        if self.rate_hz < 0.0 {
            self.snap()?;
        }
        Ok(self.rate_hz < 0.0)
    }

    fn sent(&self) -> Option<u64> {
        Some(self.sent)
    }

    fn clock(&mut self) -> Result<Option<RoundTrip>> {
        let before_ns = now_ns();
        let said = self.ask("time")?;
        let after_ns = now_ns();
        let there_ns = said.trim().parse().map_err(|_| {
            Fault::input(format!("{}: says its time is '{said}'", self.address)).next("start the cell again")
        })?;
        Ok(Some(RoundTrip { before_ns, there_ns, after_ns }))
    }

    fn reopens(&self) -> bool {
        true
    }

    fn reopen(&mut self) -> Result<()> {
        self.link = Link::connect(&self.address)?;
        self.sent = 0;
        self.pending.clear();
        self.begin()
    }

    fn features(&mut self) -> Result<Vec<Feature>> {
        let said = self.ask("features")?;
        let number = |w: &str| w.trim().parse::<f64>().ok();
        let feature = |line: &str| {
            let mut cells = line.split('\t');
            let (name, value, unit) = (cells.next()?, cells.next()?, cells.next()?);
            let range = match (cells.next().and_then(number), cells.next().and_then(number)) {
                (Some(low), Some(high)) => Range::Between(low, high),
                _ => Range::Any,
            };
            let value = number(value).map_or_else(|| Value::Word(value.into()), Value::Float);
            Some(Feature { name: name.into(), value: Some(value), unit: unit.into(), range, writable: true })
        };
        Ok(said.lines().filter(|l| !l.is_empty()).filter_map(feature).collect())
    }

    fn set(&mut self, name: &str, value: &str) -> Result<()> {
        self.ask(&format!("set {name} {value}"))?;
        Ok(())
    }

    fn name(&self) -> String {
        format!("cell://{}", self.address)
    }
}
