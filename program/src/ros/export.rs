//! In: a finished scan, and if given its recording, its station and the parts found in it. Out: `scan.mcap`, either
//! complete or absent.
//! Frame and unit: the cloud's frame, which messages name; mm are converted to metres here.

use super::bag::{Bag, Topic};
use super::clock::{Clock, Source};
use super::figures::status;
use super::frames::{Frames, camera_from_laser};
use super::messages::{Link, MOST_POINTS, Points, Stamp, camera_info, diagnostics, image, lens, pose, transforms};
use super::part::FoundPart;
use super::recorded::Recorded;
use sheetlight::camera::Intrinsics;
use sheetlight::fault::{Fault, Result};
use sheetlight::files::Aside;
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::{CloudFile, CloudPoint, PointSource, Shots};
use sheetlight::station::{ScanReport, rig_that_scanned, whole_scan};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Options of an export.
pub struct Export<'a> {
    /// Folder of the finished scan.
    pub scan: &'a Path,
    /// File to be written; it must not exist.
    pub out: &'a Path,
    /// The recording that was scanned: times, flange poses, pictures.
    pub recording: Option<&'a Recording>,
    /// Name of its pose file if meta.json names several.
    pub poses: Option<&'a str>,
    /// The station that scanned; it provides the pose of the camera on the flange, and the camera of the pictures.
    pub station: Option<&'a Path>,
    /// Whether the recording's pictures are written into the file.
    pub pictures: bool,
    /// Reports of parts found in the scan.
    pub parts: &'a [PathBuf],
    /// Names of frames.
    pub frames: &'a Frames,
    /// Shots per second if no recording states times.
    pub rate_hz: f64,
    /// Whether all points are also written as one message.
    pub cloud: bool,
}

/// Messages of one topic.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Written {
    /// Name of the topic.
    pub topic: &'static str,
    /// Type of its messages.
    pub kind: &'static str,
    /// Number of messages.
    pub messages: u32,
}

/// Result of an export.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Exported {
    /// The written file.
    pub out: PathBuf,
    /// Size of the file, bytes.
    pub bytes: u64,
    /// Number of points in all profiles.
    pub points: u64,
    /// Name of the cloud's frame in messages.
    pub frame: String,
    /// Origin of the times.
    pub times: Source,
    /// Origin of the times in words.
    pub times_from: String,
    /// First and last time, ns since 1970.
    pub span_ns: [u64; 2],
    /// Messages by topic.
    pub topics: Vec<Written>,
    /// Requested contents that the file lacks, one sentence each.
    pub notes: Vec<String>,
}

/// Name of the metadata record that states the file's origin.
const RECORD: &str = "sheetlight";

/// All inputs, read before the first byte is written.
struct Input<'a> {
    report: ScanReport,
    shots: Shots,
    cloud: CloudFile,
    rig: Option<Rig>,
    recorded: Option<Recorded<'a>>,
    clock: Clock,
    /// The camera of the recording's pictures.
    camera: Option<Intrinsics>,
    parts: Vec<FoundPart>,
    /// The shot whose time is the end of the scan.
    last: u32,
}

/// Writes the file. `progress` is called with (points done, all points).
///
/// # Errors
/// An existing output file, or one that cannot be written; a scan without points, or with files other than those
/// that it wrote. Also a recording, a station or a part of another scan, and a lens that ROS cannot describe.
pub fn export(e: &Export, progress: &mut dyn FnMut(u64, u64)) -> Result<Exported> {
    if e.out.symlink_metadata().is_ok() {
        return Err(Fault::usage(format!("{}: is there already", e.out.display()))
            .cause("an earlier file, which is not replaced")
            .next("remove it, or give another --out"));
    }
    let input = Input::read(e)?;
    let aside = Aside::create(e.out)?;
    let bag = Bag::new(aside.file(), e.out)?;
    let frame = e.frames.name(&input.report.frame);
    let first = input.shots.places().next().map_or(0, |(shot, _)| shot);
    let span = [input.clock.at(first)?, input.clock.at(input.last)?];
    let counts = fill(bag, e, &input, span, progress)?;
    let bytes = aside.file().metadata().map_err(|error| Fault::write(e.out, error))?.len();
    aside.keep()?;
    let topics = counts.iter().map(|(t, n)| Written { topic: t.name(), kind: t.kind().name(), messages: *n });
    let lacks = e.pictures && input.camera.is_none();
    Ok(Exported {
        out: e.out.to_owned(),
        bytes,
        points: input.cloud.count(),
        frame: frame.to_owned(),
        times: input.clock.source,
        times_from: input.clock.words.clone(),
        span_ns: span.map(|at| at.0),
        topics: topics.collect(),
        notes: lacks
            .then(|| "the pictures have no camera_info: --station names the camera".to_owned())
            .into_iter()
            .collect(),
    })
}

/// Writes all messages and the index. Returns the number of messages by topic.
fn fill(
    mut bag: Bag,
    e: &Export,
    input: &Input,
    [first, end]: [Stamp; 2],
    progress: &mut dyn FnMut(u64, u64),
) -> Result<BTreeMap<Topic, u32>> {
    bag.metadata(RECORD, input.told(e))?;
    let fixed = input.fixed(e.frames);
    if !fixed.is_empty() {
        bag.write(Topic::Static, first, &transforms(first, &fixed))?;
    }
    let frame = e.frames.name(&input.report.frame);
    let whole = e.cloud.then(|| Points::new(end, frame, input.cloud.count())).transpose()?;
    let mut flow = Flow { e, input, bag, places: input.places(), whole, profile: Vec::new(), done: 0 };
    flow.run(progress)?;
    let Flow { mut bag, whole, .. } = flow;
    if let Some(whole) = whole {
        bag.write(Topic::Cloud, end, &whole.finish())?;
    }
    for part in &input.parts {
        bag.write(Topic::Part, end, &pose(end, frame, &part.base_from_part))?;
    }
    bag.write(Topic::Diagnostics, end, &diagnostics(end, &status(&input.report)))?;
    bag.finish()
}

impl<'a> Input<'a> {
    fn read(e: &Export<'a>) -> Result<Input<'a>> {
        let (report, shots, cloud) = whole_scan(e.scan)?;
        if e.cloud && cloud.count() > MOST_POINTS {
            // Refused before anything is written.
            Points::new(Stamp(0), "", cloud.count())?;
        }
        let rig = e.station.map(|station| rig_that_scanned(station, e.scan, &report)).transpose()?;
        let recorded = e.recording.map(|r| Recorded::new(r, e.poses, (&report, &shots), rig.as_ref())).transpose()?;
        let listed: Vec<u32> = shots.places().map(|(shot, _)| shot).collect();
        let found = recorded.as_ref().map(|r| r.clock(&listed)).transpose()?;
        let clock = match found.unwrap_or_else(|| Err("no recording was given".into())) {
            Ok(clock) => clock,
            Err(why) => Clock::synthetic(&report.created, e.rate_hz, &why)?,
        };
        let camera = match (&rig, e.recording.filter(|_| e.pictures)) {
            (Some(rig), Some(recording)) => {
                let spec = &recording.meta.image;
                let camera = rig.need_camera()?.for_pictures(spec.size(), spec.readout.as_ref())?;
                lens(&camera)?;
                Some(camera)
            }
            _ => None,
        };
        let parts = e.parts.iter().map(|path| FoundPart::load(path, &report.frame)).collect::<Result<_>>()?;
        let last = listed.last().copied().unwrap_or(report.shots.saturating_sub(1) as u32);
        Ok(Input { report, shots, cloud, rig, recorded, clock, camera, parts, last })
    }

    /// Metadata that the file contains about itself.
    fn told(&self, e: &Export) -> BTreeMap<String, String> {
        let r = &self.report;
        let name = e.scan.canonicalize().ok().and_then(|p| Some(p.file_name()?.to_string_lossy().into_owned()));
        let mut told: BTreeMap<String, String> = [
            ("program", format!("sheetlight {}", env!("CARGO_PKG_VERSION"))),
            ("scan", name.unwrap_or_default()),
            ("scan_program", r.program.clone()),
            ("scan_created", r.created.clone()),
            ("recording", r.recording.clone()),
            ("frame", e.frames.name(&r.frame).to_owned()),
            ("units", if r.profiles.is_some() { "m; u in places of a profile" } else { "m; u and v in px" }.to_owned()),
            ("times", self.clock.source.to_string()),
            ("times_from", self.clock.words.clone()),
            ("rig_fingerprint", r.rig_fingerprint.clone()),
            ("cloud_sha256", r.files.get("cloud.ply").cloned().unwrap_or_default()),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .into();
        told.extend(self.parts.iter().enumerate().map(|(i, p)| (format!("part.{i}"), p.recipe.clone())));
        told
    }

    /// The shots with known poses, in order.
    fn places(&self) -> std::vec::IntoIter<u32> {
        self.shots.places().map(|(shot, _)| shot).collect::<Vec<_>>().into_iter()
    }

    /// Transforms that never change.
    fn fixed(&self, frames: &Frames) -> Vec<Link> {
        let mut links = Vec::new();
        if let Some(sheet) = &self.shots.sheet {
            let place = camera_from_laser(sheet, self.shots.along);
            links.push(Link::new(frames.name("camera"), frames.name("laser"), &place));
        }
        let Some(rig) = &self.rig else { return links };
        let reported = frames.name("camera_reported");
        links.extend(rig.hand_eye.as_ref().map(|c| Link::new(frames.name("flange"), reported, &c.value)));
        links.extend(rig.profile_hand_eye.as_ref().map(|c| Link::new(frames.name("flange"), reported, &c.value)));
        links.extend(rig.base_camera.as_ref().map(|c| Link::new(frames.name("base"), reported, &c.value)));
        links
    }
}

/// State of the transfer from the cloud's file into the bag, shot by shot.
struct Flow<'a, 'b> {
    e: &'b Export<'a>,
    input: &'b Input<'a>,
    bag: Bag<'b>,
    /// Shots whose transforms and pictures are not yet written, in order.
    places: std::vec::IntoIter<u32>,
    whole: Option<Points>,
    /// Points read so far of the current shot.
    profile: Vec<CloudPoint>,
    done: u64,
}

impl Flow<'_, '_> {
    fn run(&mut self, progress: &mut dyn FnMut(u64, u64)) -> Result<()> {
        let (mut went, all) = (Ok(()), self.input.cloud.count());
        self.input.cloud.for_each_chunk(&mut |chunk| {
            if went.is_ok() {
                went = self.take(chunk);
                progress(self.done, all);
            }
        })?;
        went?;
        self.profile()?;
        self.up_to(u32::MAX)
    }

    fn take(&mut self, chunk: &[CloudPoint]) -> Result<()> {
        for points in chunk.chunk_by(|a, b| a.shot == b.shot) {
            if let Some(bad) = points.iter().find(|p| !p.position.is_finite()) {
                return Err(self.strange(format!("a point of shot {} is at {}", bad.shot, bad.position)));
            }
            let (shot, before) = (points[0].shot, self.profile.first().map(|p| p.shot));
            if before.is_some_and(|before| before > shot) {
                return Err(self.strange(format!("shot {shot} stands behind shot {}", before.unwrap_or(0))));
            }
            if before.is_some_and(|before| before != shot) {
                self.profile()?;
            }
            self.profile.extend_from_slice(points);
        }
        if let Some(whole) = &mut self.whole {
            whole.add(chunk);
        }
        self.done += chunk.len() as u64;
        Ok(())
    }

    fn strange(&self, what: String) -> Fault {
        Fault::input(format!("{}: {what}", self.e.scan.join("cloud.ply").display()))
            .cause("written by another program, or damaged")
            .next("scan again")
    }

    /// Writes the points of the current shot, after the transforms and pictures of this shot and of those before it.
    fn profile(&mut self) -> Result<()> {
        let points = std::mem::take(&mut self.profile);
        let Some(shot) = points.first().map(|p| p.shot) else { return Ok(()) };
        if self.input.report.imported.is_none() && self.input.shots.place(shot).is_none() {
            return Err(self.strange(format!("has points of shot {shot}, which shots.jsonl does not list")));
        }
        self.up_to(shot)?;
        let at = self.input.clock.at(shot)?;
        let mut message = Points::new(at, self.e.frames.name(&self.input.report.frame), points.len() as u64)?;
        message.add(&points);
        self.bag.write(Topic::Profile, at, &message.finish())?;
        // Reuse its memory for the next shot.
        self.profile = points;
        self.profile.clear();
        Ok(())
    }

    /// Writes transforms and pictures of the shots up to this one.
    fn up_to(&mut self, shot: u32) -> Result<()> {
        while self.places.as_slice().first().is_some_and(|next| *next <= shot) {
            let next = self.places.next().expect("just seen");
            self.stood(next)?;
        }
        Ok(())
    }

    fn stood(&mut self, shot: u32) -> Result<()> {
        let (frames, at) = (self.e.frames, self.input.clock.at(shot)?);
        let camera = frames.name("camera");
        let place = self.input.shots.place(shot).expect("it is listed");
        let mut links = vec![Link::new(frames.name(&self.input.report.frame), camera, place)];
        let recorded = self.input.recorded.as_ref();
        if let Some(flange) = recorded.and_then(|r| r.flange(shot)) {
            links.push(Link::new(frames.name("base"), frames.name("flange"), flange));
        }
        self.bag.write(Topic::Transforms, at, &transforms(at, &links))?;
        let Some(picture) = recorded.filter(|_| self.e.pictures).map(|r| r.picture(shot)).transpose()?.flatten() else {
            return Ok(());
        };
        self.bag.write(Topic::Picture, at, &image(at, camera, &picture))?;
        match &self.input.camera {
            Some(model) => self.bag.write(Topic::CameraInfo, at, &camera_info(at, camera, model)?),
            None => Ok(()),
        }
    }
}
