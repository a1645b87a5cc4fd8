//! In: a folder that another program fills with pictures. Out: each picture once it is complete, that is, its size
//! has settled and it decodes.
//! Frame and unit: the host's time at which the picture was seen complete, ns.

use crate::capture::clock::now_ns;
use crate::capture::format::Format;
use crate::capture::picture::{Event, Picture, PictureSource};
use crate::fault::{Fault, Result};
use crate::raster::{Channel, Depth, load, pictures_in};
use notify::Watcher;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// A picture whose size did not change for this time is complete, or spoilt.
const SETTLED: Duration = Duration::from_millis(60);
/// A picture that does not decode is given up after this time.
const SPOILT: Duration = Duration::from_secs(2);

/// A folder as a camera.
pub struct FolderCamera {
    folder: PathBuf,
    bits: u8,
    format: Format,
    _watcher: notify::RecommendedWatcher,
    changes: Receiver<notify::Result<notify::Event>>,
    /// Files that were there before, or that were already delivered.
    done: BTreeSet<PathBuf>,
    /// Size at the last check, time of its last change, time when the file was first seen.
    growing: BTreeMap<PathBuf, (u64, Instant, Instant)>,
    next: u64,
    looked: Instant,
    /// The first picture, which determined the format.
    first: Option<Box<Picture>>,
    /// Why the last picture was given up.
    spoilt: Option<Fault>,
}

impl FolderCamera {
    /// Waits up to `patience` for the first new picture, which determines the format. `bits` is the sensor's depth
    /// for 16-bit files.
    ///
    /// # Errors
    /// A missing folder, no picture within the time, or one that is no grey picture of that depth.
    pub fn open(folder: &Path, bits: u8, patience: Duration) -> Result<FolderCamera> {
        let (send, changes) = channel();
        let cannot = |e: &dyn std::fmt::Display| {
            Fault::input(format!("{}: cannot be watched: {e}", folder.display()))
                .cause("the folder is missing, or the limit of watched folders is reached")
                .next("make the folder before the other program fills it")
        };
        let mut watcher = notify::recommended_watcher(send).map_err(|e| cannot(&e))?;
        watcher.watch(folder, notify::RecursiveMode::NonRecursive).map_err(|e| cannot(&e))?;
        let done = pictures_in(folder)?.into_iter().map(|n| n.path).collect();
        let mut camera = FolderCamera {
            folder: folder.to_owned(),
            bits,
            format: Format { width: 1, height: 1, bits },
            _watcher: watcher,
            changes,
            done,
            growing: BTreeMap::new(),
            next: 0,
            looked: Instant::now(),
            first: None,
            spoilt: None,
        };
        match camera.wait(patience) {
            Event::Picture(first) => {
                camera.format = Format::of(&first.image);
                camera.first = Some(first);
                Ok(camera)
            }
            Event::Incomplete { why, .. } => Err(camera.spoilt.unwrap_or_else(|| {
                Fault::input(why)
                    .cause("the other program writes another format, or was stopped while it wrote")
                    .next("let it write PNG, TIFF, PGM, BMP or JPEG, or take the file out of the folder")
            })),
            _ => Err(Fault::input(format!("{}: no new picture within {} s", folder.display(), patience.as_secs()))
                .cause("the other program writes elsewhere, or is not running")
                .next("start it, or give the folder that it fills")),
        }
    }

    /// The next complete picture by name, or one that is given up.
    fn wait(&mut self, within: Duration) -> Event {
        let until = Instant::now() + within;
        loop {
            if self.looked.elapsed() > SETTLED / 2
                && let Some(event) = self.look()
            {
                return event;
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Event::Quiet;
            }
            // Wakes up at a change of the folder, and after the time in which a size settles.
            let _ = self.changes.recv_timeout(left.min(SETTLED / 2));
            while self.changes.try_recv().is_ok() {}
        }
    }

    fn look(&mut self) -> Option<Event> {
        self.looked = Instant::now();
        let names = match pictures_in(&self.folder) {
            Ok(names) => names,
            Err(fault) => return Some(Event::Lost(fault)),
        };
        let named = names.into_iter().find(|n| !self.done.contains(&n.path))?;
        let path = named.path.clone();
        let size = std::fs::metadata(&path).map_or(0, |m| m.len());
        let now = Instant::now();
        let seen = self.growing.entry(path.clone()).or_insert((size, now, now));
        if seen.0 != size {
            (seen.0, seen.1) = (size, now);
        }
        // Pictures are delivered in the order of their names: one that is still being written holds back later ones.
        if seen.1.elapsed() < SETTLED {
            return None;
        }
        let given_up = seen.2.elapsed() > SPOILT;
        if !named.read {
            // The same picture may still come in a format that is read. Until then this one holds its place.
            return given_up.then(|| self.give_up(path, named.unread()));
        }
        let depth = Depth {
            bits: self.bits,
            declared: "the camera's name says",
            correct: "state the sensor's depth: folder:PATH?bits=12",
            saturates: true,
        };
        match load(&path, Channel::default(), depth) {
            Ok(image) if self.next == 0 || Format::of(&image) == self.format => {
                let host_ns = now_ns();
                let id = self.over(path);
                let picture = Picture::arrived(image, id, host_ns);
                Some(Event::Picture(Box::new(picture)))
            }
            Ok(image) => {
                let why = format!("{}: is {}, the first one was {}", path.display(), Format::of(&image), self.format);
                Some(Event::Incomplete { id: self.over(path), why })
            }
            Err(fault) if given_up => Some(self.give_up(path, fault)),
            Err(_) => None,
        }
    }

    fn give_up(&mut self, path: PathBuf, fault: Fault) -> Event {
        let why = fault.what.clone();
        self.spoilt = Some(fault);
        Event::Incomplete { id: self.over(path), why }
    }

    fn over(&mut self, path: PathBuf) -> u64 {
        self.growing.remove(&path);
        self.done.insert(path);
        self.next += 1;
        self.next - 1
    }
}

impl PictureSource for FolderCamera {
    fn format(&self) -> Format {
        self.format
    }

    fn next(&mut self, within: Duration) -> Event {
        match self.first.take() {
            Some(first) => Event::Picture(first),
            None => self.wait(within),
        }
    }

    fn sent(&self) -> Option<u64> {
        Some(self.next)
    }

    fn waits(&self) -> bool {
        true
    }

    fn name(&self) -> String {
        format!("folder:{}", self.folder.display())
    }
}
