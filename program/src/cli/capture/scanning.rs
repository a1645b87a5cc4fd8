//! In: a running camera, a station. Out: its scan, with or without a recording.
//! Frame and unit: as `sheetlight scan`.

use super::options::{Capture, Teller};
use crate::cli::terminal::console::Console;
use indicatif::ProgressBar;
use sheetlight::capture::record::{Backlog, RecordReport, Recorder, RecorderOptions, record};
use sheetlight::capture::{Format, Mode, RawFormat, Stream};
use sheetlight::fault::{Fault, Result};
use sheetlight::raster::Image;
use sheetlight::recording::{Motion, Sources};
use sheetlight::rig::Rig;
use sheetlight::scan::{RecordedSource, Source, StreamSource};
use sheetlight::station::{ScanOptions, ScanReport};
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Options for a running camera and its motion.
pub struct Taken<'a> {
    pub capture: &'a Capture,
    /// Frames on standard input.
    pub raw: Option<RawFormat>,
    pub poses: Option<&'a Path>,
    pub station: &'a Path,
    /// Folder of the recording, if it is recorded too.
    pub keep: Option<&'a Path>,
    /// The picture with the laser off; it must have the camera's size.
    pub ambient: &'a dyn Fn(Format) -> Result<Option<Image>>,
}

/// Scans a camera while it runs. With `keep` the pictures are recorded there, and those that cannot be scanned in
/// time wait on disk.
pub fn scan_camera(
    &Taken { capture, raw, poses, station, keep, ambient }: &Taken<'_>,
    rig: &Rig,
    options: &ScanOptions,
    console: &Console,
    bar: &ProgressBar,
) -> Result<ScanReport> {
    let motion = capture.motion().ok_or_else(|| {
        Fault::usage("a scan needs a pose for each picture, but --pair none gives no poses")
            .next("say how pictures are paired: --pair given, step, count or clock (docs/live.md)")
    })?;
    if options.resume {
        return Err(Fault::usage("a camera cannot be resumed").next("record it (--record FOLDER): recordings can"));
    }
    // Ctrl-C ends the camera's stream; the scan of the pictures so far continues to its end.
    let mut stream = capture.open(raw, poses, Some(station), Mode::All)?;
    let options = &ScanOptions {
        motion: motion.clone(),
        stop: Default::default(),
        ambient: ambient(stream.format())?,
        ..options.clone()
    };
    let name = stream.feed().name().to_owned();
    let teller = capture.running.teller();
    let progress = |done: usize, _: Option<usize>| {
        teller.tell(console, bar);
        bar.set_position(done as u64);
    };
    let Some(keep) = keep else {
        let mut hear = teller.clone();
        let open = move |_| {
            let say = Box::new(move |s: &sheetlight::capture::Stream, said| hear.hear(s, said));
            Ok(Box::new(StreamSource::new(stream, say)) as Box<dyn Source>)
        };
        return sheetlight::station::scan("camera", &name, open, rig, options, progress);
    };
    let recorder =
        Recorder::create(keep, stream.format(), options_of(motion, capture.sources(stream.feed()), &stream))?;
    let meta = recorder.meta();
    let (handing, backlog) = Backlog::new();
    let report: Arc<Mutex<Option<Result<RecordReport>>>> = Arc::default();
    let (theirs, mut hear): (_, Teller) = (report.clone(), teller.clone());
    let recording = move || {
        let done = record(&mut stream, recorder, Some(&handing), |s, said| hear.hear(s, said));
        hear.account(&stream);
        *theirs.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(done);
        drop(handing);
    };
    let thread = std::thread::Builder::new().name("recorder".into()).spawn(recording);
    let thread = thread.map_err(|e| Fault::threads(&e))?;
    let source = RecordedSource::new(keep.to_owned(), meta, backlog, report.clone());
    let scanned =
        sheetlight::station::scan("camera", &name, |_| Ok(Box::new(source) as Box<dyn Source>), rig, options, progress);
    // If the scan failed, recording continues until the stream ends: the pictures cannot be taken again.
    thread.join().map_err(|_| Fault::device("the recorder ended in a panic").next("report it as a bug"))?;
    teller.tell(console, bar);
    let recorded = report.lock().unwrap_or_else(std::sync::PoisonError::into_inner).take();
    let scanned = scanned?;
    recorded.expect("the recorder has ended")?;
    Ok(scanned)
}

fn options_of(motion: Motion, sources: Sources, stream: &Stream) -> RecorderOptions {
    let (motion, sources) = (Some(motion), Some(sources));
    RecorderOptions {
        set: "scan".into(),
        motion,
        sources,
        readout: stream.pictures().readout,
        ..RecorderOptions::default()
    }
}
