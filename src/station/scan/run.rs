//! In: a source of shots, a calibrated rig, an output folder. Out: the scan folder — cloud, height map, overlays,
//! figures — written so that no interruption loses finished work.
//! Frame and unit: cloud in the frame of the moving part (mostly the robot's base), height map in its grid frame;
//! mm (docs/file-formats.md).

use super::done::{Done, scanner_for};
use super::options::ScanOptions;
use super::overlays::Overlays;
use super::progress::{Calibrated, Checkpoint, fingerprint_of};
use super::refined::refine;
use super::report::{ScanReport, Spent};
use super::scan_folder::{self, CLOUD_FILE, FORMER_PROGRESS};
use super::seen::Seen;
use crate::capture::Delays;
use crate::fault::{Fault, Result};
use crate::files::Lock;
use crate::rig::Rig;
use crate::scan::{
    BadShot, CloudWriter, Processor, Profile, SHOTS_FILE, Scanner, Shots, ShotsWriter, Source, parts_for,
};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Number of shots between two checkpoints: what a crash can lose besides the shots being processed.
const CHECKPOINT_SHOTS: usize = 64;

/// [`scan_on`] at the place of the options; the device is opened while the first pictures are decoded.
pub fn scan(
    id: &str,
    label: &str,
    open: impl FnOnce(usize) -> Result<Box<dyn Source>>,
    rig: &Rig,
    options: &ScanOptions,
    progress: impl FnMut(usize, Option<usize>),
) -> Result<ScanReport> {
    scan_on(|| options.place.open(), id, label, open, rig, options, progress)
}

/// Runs a scan from the first shot to the last file. `processor` is called once the source is open. `id` identifies
/// the recording (a hash of its meta.json, poses and ambient picture), so that a resumed scan cannot continue
/// another one. `open` returns the source from a given shot on. `progress` receives (shots done, shots in all). If
/// the scan ends early, its finished shots are stored and the next run can resume there. A previous scan in the
/// folder stays until this one is complete.
pub fn scan_on(
    processor: impl FnOnce() -> Result<Processor>,
    id: &str,
    label: &str,
    open: impl FnOnce(usize) -> Result<Box<dyn Source>>,
    rig: &Rig,
    options: &ScanOptions,
    mut progress: impl FnMut(usize, Option<usize>),
) -> Result<ScanReport> {
    let begun = Instant::now();
    options.grid.check()?;
    // Calibrations that this motion does not use are ignored, even if they were made with another camera.
    let rig = &parts_for(rig, &options.motion);
    rig.belong_together()?;
    rig.reaches(options.volume.as_ref())?;
    scan_folder::make(&options.out)?;
    let _lock = Lock::take(&options.out, "scan", "scan")?;
    let folder = scan_folder::together(&options.out);
    folder.settle_locked()?;
    let state = state(id, rig, options, &folder.part())?;
    let part = if state.shots == 0 { folder.begin()? } else { folder.part() };
    scan_folder::sweep(&part)?;
    let mut source = open(state.shots - state.repeated())?;
    let mut work = Work::begin(&part, rig, options, state, source.as_ref(), processor()?)?;
    work.spent.start_s = begun.elapsed().as_secs_f64();
    let total = work.total;
    let ended = work.all(source.as_mut(), options, |done| progress(done, total));
    // If the disk itself failed, the previous checkpoint remains.
    let saved = work.save();
    ended.map_err(|fault| kept(fault, &work.state, saved.is_ok(), total))?;
    saved?;
    let report = work.finish(label, rig, options, source.as_ref())?;
    let text = serde_json::to_string_pretty(&report).expect("plain data");
    crate::files::write(&part.join("scan.json"), text.as_bytes())?;
    #[cfg(feature = "pages")]
    crate::station::judge::page::save(&part, None, &[])?;
    folder.commit()?;
    Ok(report)
}

/// The initial state: empty, or that of an interrupted scan of the same identity.
fn state(id: &str, rig: &Rig, options: &ScanOptions, part: &Path) -> Result<Checkpoint> {
    let settings = serde_json::to_string(&(&options.extraction, &options.volume, &options.motion, &options.latency))
        .expect("plain data");
    let identity = crate::rig::hash_text(format!("{id} {} {settings}", rig.fingerprint()).as_bytes());
    let former = if options.resume { Checkpoint::load(part)? } else { None };
    match former {
        Some(c) if c.identity == identity => Ok(c),
        Some(_) => Err(Fault::usage("the interrupted scan was of another recording, rig, working volume or settings")
            .cause("something was changed since")
            .next("scan again without --resume, or into another folder")),
        None if options.resume && options.out.join(FORMER_PROGRESS).exists() => {
            Err(Fault::usage(format!("{}: a former version was interrupted here", options.out.display()))
                .cause("this version stores unfinished scans in another format and cannot continue it")
                .next("scan again without --resume: the pictures are still there"))
        }
        None => Ok(Checkpoint::new(identity)),
    }
}

/// Adds to the fault that ended a scan what is stored of it and how to resume.
fn kept(fault: Fault, state: &Checkpoint, saved: bool, total: Option<usize>) -> Fault {
    let of = total.map_or(String::new(), |n| format!(" of {n}"));
    let done = format!("the first {}{of} shots with {} points are kept", state.shots, state.points);
    let what = if saved && state.shots > 0 { format!("{}; {done}", fault.what) } else { fault.what };
    Fault { what, ..fault }
}

/// A running scan.
struct Work<'a> {
    part: &'a Path,
    started: Instant,
    /// Number of shots that an earlier run finished, and how many of them this run reads again.
    first: usize,
    repeated: usize,
    /// Total number of shots, if known.
    total: Option<usize>,
    /// Number of pixels that exceeded the list in earlier runs.
    cut_before: u64,
    cloud: CloudWriter,
    shots: ShotsWriter,
    state: Checkpoint,
    /// What the points' depths are compared with.
    calibrated: Option<Calibrated>,
    scanner: Scanner,
    overlays: Overlays,
    seen: Seen,
    /// Fingerprints of the pictures being processed, and their arrival times, oldest first.
    pictures: VecDeque<(u32, u32, Option<u64>)>,
    delays: Delays,
    spent: Spent,
    /// A remark for the report if a stream was ended early.
    stopped: Option<String>,
}

impl<'a> Work<'a> {
    /// Opens all outputs for shots; for the `state` of an interrupted run it continues that run's files.
    fn begin(
        part: &'a Path,
        rig: &Rig,
        options: &ScanOptions,
        state: Checkpoint,
        source: &dyn Source,
        processor: Processor,
    ) -> Result<Work<'a>> {
        let (resumed, first, repeated) = (state.shots > 0, state.shots, state.repeated());
        let cloud_path = part.join(CLOUD_FILE);
        let cloud = if resumed {
            CloudWriter::resume(&cloud_path, state.points)?
        } else {
            CloudWriter::create_in(&cloud_path, options.motion.frame())?
        };
        let total = source.remaining().map(|n| n + first - repeated);
        let (scanner, seen) = scanner_for(rig, source, options, processor)?;
        let scanner = scanner.resumed(state.stripe, state.hot.clone(), state.first_place());
        let print = rig.fingerprint();
        let shots = if resumed {
            ShotsWriter::resume(part, first, options.motion.frame(), &print)?
        } else {
            let sheet = &rig.need_laser_plane()?.value;
            ShotsWriter::create(part, options.motion.frame(), scanner.stripe_along(), &print, Some(sheet))?
        };
        Ok(Work {
            part,
            started: Instant::now(),
            first,
            repeated,
            total,
            cut_before: state.cut,
            cloud,
            shots,
            state,
            calibrated: Calibrated::of(rig, &source.pictures())?,
            scanner,
            overlays: Overlays::new(part, options.overlays, total)?,
            seen,
            pictures: VecDeque::new(),
            delays: Delays::default(),
            spent: Spent::default(),
            stopped: None,
        })
    }

    /// Processes every shot of the source to points in the cloud.
    fn all(&mut self, source: &mut dyn Source, options: &ScanOptions, mut progress: impl FnMut(usize)) -> Result<()> {
        let mut ended = false;
        let started = Instant::now();
        while !ended {
            let mut next = clocked(&mut self.spent.pictures_s, || source.next());
            if options.stop.load(Ordering::Relaxed) {
                if source.resumable() {
                    let ready = self.scanner.ready()?;
                    self.take(&ready)?;
                    return Err(Fault::output("stopped by a signal")
                        .cause("Ctrl-C, or the session or the machine was closed")
                        .next("run the same command with --resume to go on"));
                }
                // A stream cannot be repeated: the shots so far are made a scan.
                self.stopped = Some("the stream was stopped by a signal before its end".into());
                next = None;
            }
            match next {
                Some(Ok(shot)) => {
                    self.same_recording(&shot)?;
                    self.overlays.keep(&shot);
                    self.seen.look(shot.index, &shot.image);
                    clocked(&mut self.spent.stages_s, || self.scanner.push(shot))?;
                    self.scanner.first().iter().for_each(|place| self.state.begin_at(place));
                }
                // A resumed scan may meet a bad shot that the earlier run has listed.
                Some(Err(bad)) if options.skip_bad && self.state.skipped.iter().any(|(name, _)| *name == bad.name) => {}
                Some(Err(bad)) if options.skip_bad && !bad.last => self.state.skipped.push((bad.name, bad.fault.what)),
                Some(Err(BadShot { name, fault, last, .. })) => {
                    // The last good shot is not taken: its points are not yet judged by their neighbours.
                    let ready = self.scanner.ready()?;
                    self.take(&ready)?;
                    let again = "copy the shot again and run with --resume, or exclude it with --skip-bad";
                    let named = fault.what.contains(&name);
                    return Err(match (last, named) {
                        (true, _) => fault,
                        (false, true) => fault.next(again),
                        (false, false) => fault.at(name).next(again),
                    });
                }
                None => ended = true,
            }
            let scanner = &mut self.scanner;
            let ready = clocked(&mut self.spent.stages_s, || if ended { scanner.finish() } else { scanner.ready() })?;
            if self.spent.first_profile_s == 0.0 && !ready.is_empty() {
                self.spent.first_profile_s = started.elapsed().as_secs_f64();
            }
            let from = Instant::now();
            self.take(&ready)?;
            ready.iter().for_each(|p| options.watch.show(p, &self.scanner.up_in_base()));
            self.spent.writing_s += from.elapsed().as_secs_f64();
            progress(self.state.shots);
        }
        Ok(())
    }

    /// The first shot of a resumed scan is the last finished one: its picture must be the same as before.
    fn same_recording(&mut self, shot: &crate::scan::Shot) -> Result<()> {
        let is = fingerprint_of(&shot.image);
        if self.repeated > 0 && self.pictures.is_empty() && self.state.last_picture != Some(is) {
            return Err(Fault::usage(format!("{}: is not the picture that the interrupted scan saw", shot.name))
                .cause("the interrupted scan was of another recording, or its pictures were replaced")
                .next("scan again without --resume, or into another folder"));
        }
        self.pictures.push_back((shot.index, is, shot.here_ns));
        Ok(())
    }

    fn take(&mut self, ready: &[Profile]) -> Result<()> {
        for profile in ready {
            let (index, picture, here_ns) = self.pictures.pop_front().expect("a picture a profile");
            assert_eq!(index, profile.shot, "profiles come in the order of their pictures");
            here_ns.into_iter().for_each(|ns| self.delays.since(ns));
            if self.repeated > 0 {
                self.repeated -= 1;
                continue;
            }
            self.overlays.draw(profile)?;
            // Points and state are updated together: what is counted here is what a resumed scan has stored.
            self.cloud.append(&profile.points)?;
            self.shots.add(profile.shot, profile.from_camera);
            self.state.add(profile, picture, self.calibrated.as_ref());
            if self.state.shots.is_multiple_of(CHECKPOINT_SHOTS) {
                self.save()?;
            }
        }
        Ok(())
    }

    fn save(&mut self) -> Result<()> {
        self.state.stripe = self.scanner.stripe();
        self.state.hot = self.scanner.hot().clone();
        self.state.cut = self.cut_before + self.scanner.cut();
        self.shots.checkpoint()?;
        self.state.save(self.part, &mut self.cloud)
    }

    /// Makes everything that is derived from the whole cloud, and the report.
    fn finish(self, label: &str, rig: &Rig, options: &ScanOptions, source: &dyn Source) -> Result<ScanReport> {
        let Work { part, cloud, state, scanner, mut spent, .. } = self;
        let points = cloud.finish()?;
        let frame = options.motion.frame();
        let shots = Shots::load(part, frame, &rig.fingerprint())?.with_stripe(scanner.stripe().map(|s| s.width_px));
        let refined = refine(part, frame, shots, source.format(), &options.extraction)?;
        let seconds = self.started.elapsed().as_secs_f64();
        let products = Instant::now();
        let (cloud_path, up) = (part.join(CLOUD_FILE), scanner.up_in_base());
        let (height_map, mut files) =
            super::products::write(part, &cloud_path, points, &options.grid, up, scanner.device())?;
        files.extend([super::products::hash(part, SHOTS_FILE)?]);
        spent.products_s = products.elapsed().as_secs_f64();
        let done = Done {
            label,
            rig,
            options,
            source,
            scanner: &scanner,
            shots_of_this_run: state.shots - self.first,
            state,
            calibrated: self.calibrated,
            seen: self.seen,
            delay: self.delays.so_far(),
            seconds,
            spent,
            stopped: self.stopped,
            points,
            refined,
        };
        Ok(done.report(height_map, files))
    }
}

/// Adds the duration of a call to a sum of seconds.
fn clocked<T>(seconds: &mut f64, what: impl FnOnce() -> T) -> T {
    let from = Instant::now();
    let result = what();
    *seconds += from.elapsed().as_secs_f64();
    result
}
