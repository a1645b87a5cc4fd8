//! In: raw frames of a stated size from a reader (standard input, a child's output). Out: a source that counts them.
//! Frame and unit: the host's time of a frame's last byte, ns.

use crate::capture::clock::now_ns;
use crate::capture::format::{Format, RawFormat, RawFrames};
use crate::capture::picture::{Event, Picture, PictureSource};
use crate::fault::{Fault, Result};
use crate::raster::Image;
use std::io::Read;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

/// Number of frames read ahead; a faster sender waits at its end of the pipe.
const AHEAD: usize = 2;

/// A reader of raw frames as a source.
pub struct Pipe {
    format: Format,
    name: String,
    frames: Receiver<Result<Option<(Image, u64)>>>,
    came: u64,
    ended: bool,
}

impl Pipe {
    /// Reads on a separate thread, which ends with the reader.
    ///
    /// # Errors
    /// No thread can be started.
    pub fn new(raw: RawFormat, name: &str, reader: impl Read + Send + 'static) -> Result<Pipe> {
        let (send, frames) = sync_channel(AHEAD);
        let mut raw_frames = RawFrames::new(raw, reader);
        let read = move || {
            loop {
                let frame = raw_frames.read().map(|image| image.map(|i| (i, now_ns())));
                let more = matches!(frame, Ok(Some(_)));
                if send.send(frame).is_err() || !more {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("frames".into()).spawn(read).map_err(|e| Fault::threads(&e))?;
        Ok(Pipe { format: raw.format, name: name.into(), frames, came: 0, ended: false })
    }
}

impl PictureSource for Pipe {
    fn format(&self) -> Format {
        self.format
    }

    fn next(&mut self, within: Duration) -> Event {
        if self.ended {
            return Event::Ended;
        }
        match self.frames.recv_timeout(within) {
            Ok(Ok(Some((image, host_ns)))) => {
                let id = self.came;
                self.came += 1;
                let picture = Picture::arrived(image, id, host_ns);
                Event::Picture(Box::new(picture))
            }
            Err(RecvTimeoutError::Timeout) => Event::Quiet,
            Ok(Err(fault)) => {
                self.ended = true;
                Event::Lost(fault)
            }
            Ok(Ok(None)) | Err(RecvTimeoutError::Disconnected) => {
                self.ended = true;
                Event::Ended
            }
        }
    }

    fn sent(&self) -> Option<u64> {
        Some(self.came)
    }

    fn waits(&self) -> bool {
        true
    }

    fn name(&self) -> String {
        self.name.clone()
    }
}
