//! In: pictures in order, with their data. Out: a recording folder. meta.json is written at once, then each picture
//! before its line in frames.jsonl, so that a program stopped at any moment leaves a valid recording of all written
//! pictures.
//! Frame and unit: docs/file-formats.md; raw frames in the layout of `RawFormat`.

use super::super::format::{Format, raw_bytes};
use super::super::pair::LeftOut;
use crate::camera::Readout;
use crate::fault::{Fault, Result};
use crate::files::{Append, Lock};
use crate::raster::{Image, Response};
use crate::recording::{Beam, BoardSpec, FrameRef, ImageSpec, Meta, Motion, Sources, Stand, Taken, raw_name};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Storage format of pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = no_store)]
pub enum Store {
    /// PNG, or raw frames when PNG is too slow.
    #[default]
    Auto,
    /// PNG.
    Png,
    /// One file of raw frames.
    Raw,
}

fn no_store(word: &str) -> String {
    crate::fault::unknown::<Store>("way to store", word)
}

/// Content of the pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = shows_nothing)]
pub enum Shows {
    /// The stripe.
    #[default]
    Line,
    /// The pointer's spot.
    Pointer,
    /// A board in room light, the lasers off.
    Room,
}

fn shows_nothing(word: &str) -> String {
    crate::fault::unknown::<Shows>("thing to show", word)
}

/// Options of a recorder.
#[derive(Clone, Debug, Default)]
pub struct RecorderOptions {
    /// Name of what is recorded.
    pub set: String,
    /// What moves; none if nothing moves.
    pub motion: Option<Motion>,
    /// Content of the pictures.
    pub shows: Shows,
    /// Storage format of the pictures.
    pub store: Store,
    /// The recorded devices; none: not stated.
    pub sources: Option<Sources>,
    /// The board that the pictures show, if any.
    pub board: Option<BoardSpec>,
    /// How pictures are read from the sensor, if known.
    pub readout: Option<Readout>,
    /// Exposures of each pose, us, ascending; empty if each has one picture.
    pub exposures_us: Vec<f64>,
    /// Level without light, for several exposures; none: 0.
    pub black_level: Option<f64>,
}

/// Interval of syncs to the disk: the most that a power cut may cost.
const SYNC: Duration = Duration::from_secs(1);
/// Number of waiting pictures from which PNG counts as too slow.
const HURRY: usize = 4;
const FRAMES: &str = "frames.jsonl";
const RAW: &str = "pictures.raw";
/// Name of the lock that a recorder holds on its folder.
const LOCK: &str = "record";

/// Where a picture was stored.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    /// Name in the recording.
    pub name: String,
    /// Index in the recording, from 0.
    pub index: usize,
}

/// Whether a recorder writes into this folder now.
pub fn is_recorded_into(folder: &Path) -> bool {
    Lock::is_held(folder, LOCK)
}

/// A recording that is being written.
pub struct Recorder {
    folder: PathBuf,
    format: Format,
    options: RecorderOptions,
    frames: Append,
    raw: Option<Append>,
    raws: u64,
    count: usize,
    bytes: u64,
    synced: Instant,
    _lock: Lock,
}

impl Recorder {
    /// Creates the folder and its meta.json.
    ///
    /// # Errors
    /// A folder that holds a recording, that another recorder writes into, or that cannot be written.
    pub fn create(folder: &Path, format: Format, options: RecorderOptions) -> Result<Recorder> {
        crate::files::make_folder(folder)?;
        let lock = Lock::take(folder, LOCK, "recorder")?;
        let meta_path = folder.join("meta.json");
        if meta_path.exists() || folder.join(FRAMES).exists() {
            return Err(Fault::output(format!("{}: holds a recording", folder.display()))
                .cause("the same --out was given before")
                .next("record into another folder"));
        }
        let meta = meta(format, &options);
        let text = serde_json::to_string_pretty(&meta).expect("plain data");
        let frames = Append::create(&folder.join(FRAMES))?;
        crate::files::write(&meta_path, text.as_bytes())?;
        let (raw, raws, count, bytes) = (None, 0, 0, 0);
        let synced = Instant::now();
        Ok(Recorder {
            folder: folder.to_owned(),
            format,
            options,
            frames,
            raw,
            raws,
            count,
            bytes,
            synced,
            _lock: lock,
        })
    }

    /// Adds a picture; `waiting` is the number of pictures that wait behind it. When this returns, other programs
    /// can read it.
    ///
    /// # Errors
    /// The picture cannot be written: it is not part of the recording, which stays valid.
    pub fn add(&mut self, image: &Image, stand: Option<&Stand>, taken: Taken, waiting: usize) -> Result<Kept> {
        self.add_all(&[image], stand, taken, waiting)
    }

    /// Adds the pictures of a pose, one for each exposure, the shortest first; `taken` is of the first.
    ///
    /// # Errors
    /// As [`Recorder::add`].
    pub fn add_all(&mut self, images: &[&Image], stand: Option<&Stand>, taken: Taken, waiting: usize) -> Result<Kept> {
        let raw = match self.options.store {
            Store::Raw => true,
            Store::Png => false,
            Store::Auto => waiting >= HURRY,
        };
        let mut names = Vec::with_capacity(images.len());
        for (k, image) in images.iter().enumerate() {
            names.push(if raw { self.add_raw(image)? } else { self.add_png(image, k)? });
        }
        let longer = names.split_off(1);
        let name = names.remove(0);
        let (laser, ambient) =
            if self.options.shows == Shows::Room { (None, Some(name.clone())) } else { (Some(name.clone()), None) };
        let count = stand.and_then(|s| if let Stand::Count(c) = s { Some(*c) } else { None });
        let frame = FrameRef { laser, longer, ambient, count, taken: Some(taken), ..FrameRef::default() };
        let mut line = serde_json::to_string(&frame).expect("plain data");
        line.push('\n');
        self.frames.add(line.as_bytes())?;
        self.bytes += line.len() as u64;
        self.count += 1;
        if self.synced.elapsed() > SYNC {
            self.sync()?;
        }
        Ok(Kept { name, index: self.count - 1 })
    }

    fn add_raw(&mut self, image: &Image) -> Result<String> {
        if self.raw.is_none() {
            self.raw = Some(Append::create(&self.folder.join(RAW))?);
        }
        let bytes = raw_bytes(image);
        let raw = self.raw.as_mut().expect("made above");
        raw.add(&bytes)?;
        self.bytes += bytes.len() as u64;
        self.raws += 1;
        Ok(raw_name(RAW, self.raws - 1))
    }

    /// `exposure` is counted from 0.
    fn add_png(&mut self, image: &Image, exposure: usize) -> Result<String> {
        let kind = if self.options.shows == Shows::Room { "ambient" } else { "laser" };
        let of = if exposure == 0 { String::new() } else { format!("_{}", exposure + 1) };
        let name = format!("{kind}_{:06}{of}.png", self.count);
        let path = self.folder.join(&name);
        let bytes = crate::raster::png(image);
        crate::files::write_unsynced(&path, &bytes)?;
        self.bytes += bytes.len() as u64;
        Ok(name)
    }

    fn sync(&mut self) -> Result<()> {
        self.synced = Instant::now();
        self.raw.as_ref().map_or(Ok(()), Append::sync)?;
        self.frames.sync()
    }

    /// Number of pictures so far.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Number of bytes so far.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Size and depth of its pictures.
    pub fn format(&self) -> Format {
        self.format
    }

    /// The folder of the recording.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Content of its meta.json.
    pub fn meta(&self) -> Meta {
        meta(self.format, &self.options)
    }

    /// Syncs everything to the disk, and writes the list of excluded pictures.
    ///
    /// # Errors
    /// The disk cannot be written; what was stored before stays.
    pub fn finish(mut self, left_out: &[LeftOut]) -> Result<usize> {
        self.sync()?;
        if !left_out.is_empty() {
            let text = serde_json::to_string_pretty(left_out).expect("plain data");
            crate::files::write(&self.folder.join("left_out.json"), text.as_bytes())?;
        }
        Ok(self.count)
    }
}

fn meta(format: Format, options: &RecorderOptions) -> Meta {
    let beam = match options.shows {
        Shows::Line => Some(Beam::Line),
        Shows::Pointer => Some(Beam::Pointer),
        Shows::Room => None,
    };
    let response = Response::Linear;
    let pixel_centre = "integer coordinates".into();
    let Format { width, height, bits } = format;
    Meta {
        format: 1,
        set: options.set.clone(),
        units: "mm".into(),
        image: ImageSpec { width, height, bits, channels: 1, response, pixel_centre, readout: options.readout },
        beam,
        board: options.board.clone(),
        boards: vec![],
        ambient: None,
        frames: vec![],
        exposures_us: options.exposures_us.clone(),
        black_level: options.black_level.filter(|_| !options.exposures_us.is_empty()),
        frames_file: Some(FRAMES.into()),
        sources: options.sources.clone(),
        motion: options.motion.clone(),
        pose_file: None,
        pose_files: Default::default(),
        part: None,
        model: None,
        target: None,
        distance_definition: None,
    }
}
