//! In: a file or standard input. Out: its MCAP records one by one, as soon as their chunk is there. Only one chunk is
//! in memory.

use super::fault::{Fault, fault};
use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

/// Most bytes of a record and of a chunk: what Zenoh's receivers take by default.
pub const MOST_BYTES: usize = 1 << 30;
/// Bytes of a read, and the number of reads that wait for their use.
const PIECE: usize = 1 << 16;
const WAITING: usize = 4;
/// Time between two looks at whether to end.
const TICK: Duration = Duration::from_millis(100);

/// A reader of records.
pub struct Stream {
    name: String,
    pieces: Receiver<std::io::Result<Vec<u8>>>,
    reader: LinearReader,
    /// Bytes that are read and not used yet.
    rest: Vec<u8>,
    /// Bytes that were used.
    used: u64,
    ended: bool,
}

impl Stream {
    /// Opens a file; `-` is standard input.
    pub fn open(path: &Path) -> Result<Stream, Fault> {
        let (name, source): (String, Box<dyn Read + Send>) = if path.as_os_str() == "-" {
            ("standard input".into(), Box::new(std::io::stdin()))
        } else {
            let name = path.display().to_string();
            let file = File::open(path).and_then(|file| match file.metadata()?.is_dir() {
                true => Err(std::io::ErrorKind::IsADirectory.into()),
                false => Ok(file),
            });
            let file = file.map_err(|e| {
                fault(format!("{name}: {e}"), "the path is wrong, or the file may not be read", "name an MCAP file")
            })?;
            (name, Box::new(file))
        };
        Stream::of(name, source)
    }

    /// Reads a source that is open.
    pub fn of(name: String, mut source: Box<dyn Read + Send>) -> Result<Stream, Fault> {
        let (sender, pieces) = sync_channel(WAITING);
        // A read waits for its source, so it has a thread of its own. It ends with the source or the program.
        let thread = std::thread::Builder::new().name("input".into()).spawn(move || {
            loop {
                let mut piece = vec![0; PIECE];
                let read = match source.read(&mut piece) {
                    Err(e) if e.kind() == std::io::ErrorKind::Interrupted => continue,
                    read => read,
                };
                let last = !matches!(read, Ok(n) if n > 0);
                let sent = sender.send(read.map(|n| {
                    piece.truncate(n);
                    piece
                }));
                if last || sent.is_err() {
                    return;
                }
            }
        });
        thread
            .map_err(|e| fault(format!("no thread: {e}"), "the system has no thread left", "close other programs"))?;
        let options = LinearReaderOptions::default().with_emit_chunks(true).with_record_length_limit(MOST_BYTES);
        let reader = LinearReader::new_with_options(options);
        Ok(Stream { name, pieces, reader, rest: Vec::new(), used: 0, ended: false })
    }

    /// Name of the source, for errors.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Hands the next record, or those of the next chunk, to `take`. False at the end, or as soon as `stop` says so.
    ///
    /// # Errors
    /// Bytes that are no MCAP, an end in the middle, a source that fails; and what `take` returns.
    pub fn next(
        &mut self,
        stop: &dyn Fn() -> bool,
        take: &mut dyn FnMut(Record) -> Result<(), Fault>,
    ) -> Result<bool, Fault> {
        loop {
            if stop() {
                return Ok(false);
            }
            let wanted = match self.reader.next_event() {
                None => return Ok(false),
                Some(Err(e)) => return Err(unread(&self.name, self.used, self.ended, &e)),
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => wanted,
                Some(Ok(LinearReadEvent::Record { opcode: op::CHUNK, data })) => {
                    let broken = |e: McapError| unread(&self.name, self.used, false, &e);
                    let mut rest = whole(data).map_err(broken)?;
                    while let Some((opcode, data, behind)) = split(rest) {
                        take(mcap::parse_record(opcode, data).map_err(broken)?)?;
                        rest = behind;
                    }
                    return Ok(true);
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    let record = mcap::parse_record(opcode, data);
                    let record = record.map_err(|e| unread(&self.name, self.used, false, &e))?;
                    take(record)?;
                    return Ok(true);
                }
            };
            if !self.filled(stop)? {
                return Ok(false);
            }
            // A length that is wrong asks for much: what there is decides how much memory is taken.
            let n = wanted.min(self.rest.len());
            self.reader.insert(n).copy_from_slice(&self.rest[..n]);
            self.reader.notify_read(n);
            self.rest.drain(..n);
            self.used += n as u64;
        }
    }

    /// Waits until there are bytes, or the source has ended. False if it is to stop.
    fn filled(&mut self, stop: &dyn Fn() -> bool) -> Result<bool, Fault> {
        while self.rest.is_empty() && !self.ended {
            match self.pieces.recv_timeout(TICK) {
                Ok(Ok(piece)) if piece.is_empty() => self.ended = true,
                Ok(Ok(piece)) => self.rest = piece,
                Ok(Err(e)) => {
                    let what = format!("{}: {e} behind byte {}", self.name, self.used);
                    return Err(fault(what, "the disk or the connection to it failed", "read the file again"));
                }
                Err(RecvTimeoutError::Timeout) if stop() => return Ok(false),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => self.ended = true,
            }
        }
        Ok(true)
    }
}

/// The records of a chunk as they stand there, after checksum and lengths were compared. The crate's own reading of a
/// chunk is not used: it takes a record that is longer than its chunk.
fn whole(chunk: &[u8]) -> Result<&[u8], McapError> {
    let Record::Chunk { header, data: Cow::Borrowed(records) } = mcap::parse_record(op::CHUNK, chunk)? else {
        return Err(McapError::UnexpectedEoc);
    };
    if !header.compression.is_empty() {
        return Err(McapError::UnsupportedCompression(header.compression));
    }
    let (saved, calculated) = (header.uncompressed_crc, crc32fast::hash(records));
    if saved != 0 && saved != calculated {
        return Err(McapError::BadChunkCrc { saved, calculated });
    }
    let mut rest = records;
    while !rest.is_empty() {
        rest = split(rest).ok_or(McapError::UnexpectedEoc)?.2;
    }
    Ok(records)
}

/// The first record: its kind, its content, and what stands behind it.
fn split(records: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let (head, body) = records.split_first_chunk::<9>()?;
    let length = u64::from_le_bytes(head[1..].try_into().expect("eight bytes"));
    let (data, rest) = body.split_at_checked(usize::try_from(length).ok()?)?;
    Some((head[0], data, rest))
}

/// A text of a file, for people: short, and without control characters.
pub fn shown(text: &str) -> String {
    text.chars().take(160).map(|c| if c.is_control() { '?' } else { c }).collect()
}

/// Why records end.
fn unread(name: &str, at: u64, ended: bool, error: &McapError) -> Fault {
    // A text of the file may be in it.
    let place = format!("{name}: near byte {at}: {}", shown(&error.to_string()));
    match error {
        McapError::UnsupportedCompression(_) => {
            fault(place, "the file has compressed chunks", "write it without compression: mcap decompress")
        }
        McapError::BadMagic => fault(place, "another kind of file, or a file that was cut", "give an MCAP file"),
        McapError::UnexpectedEof if ended => fault(
            format!("{name}: ends in the middle of a record, behind byte {at}"),
            "its writer was stopped, or the file was cut",
            "what stands before the end was sent; repair the file with mcap recover",
        ),
        _ => fault(place, "the file is damaged", "what stands before was sent; repair the file with mcap recover"),
    }
}
