//! In: a stream of a camera that exposes with several exposures in turn, while what moves stands still from pose to
//! pose. Out: a recording in which each pose has a picture of every exposure.
//! Frame and unit: docs/file-formats.md.

use super::super::exposure::Exposures;
use super::super::feed::Fate;
use super::super::pair::{LeftOut, Paired};
use super::super::stream::{Stream, Streamed};
use super::gather::{Gather, Gathered};
use super::recorder::Recorder;
use super::run::{Exposed, GLANCE, ROOM, Recording, ended_so};
use super::space::Space;
use crate::fault::{Fault, Result};
use crate::raster::{Bracket, Image};

/// Most poses that were left early, or pictures that disagree, that are reported one by one.
const TOLD: u64 = 5;
/// Number of poses in a row whose pictures disagree, after which the recording ends.
const DISAGREE: u64 = 12;
/// Most excluded pictures that are listed.
const LISTED: usize = 10_000;

/// A recording of poses while it runs.
struct Run<'a> {
    recorder: Recorder,
    exposures: &'a Exposures,
    bracket: Bracket,
    gather: Gather,
    left_out: Vec<LeftOut>,
    exposed: Exposed,
    /// Poses in a row whose pictures disagree.
    disagree: u64,
}

/// Records until the stream ends, or until `poses` are recorded. `say` receives messages for the user.
///
/// # Errors
/// As [`record`](super::record); pictures of a pose whose light never is in the ratio of their exposures.
pub fn record_poses(
    stream: &mut Stream,
    recorder: Recorder,
    exposures: &Exposures,
    poses: Option<u64>,
    mut say: impl FnMut(&Stream, Option<String>),
) -> Result<Recording> {
    let us = exposures.us().to_vec();
    let black = recorder.meta().black_level.unwrap_or(0.0);
    let bracket = Bracket::new(&us, stream.format().bits, black)?;
    let gather = Gather::new(us.len());
    let exposed = Exposed { exposures_us: us, longest_s: 0.0, left: 0 };
    let mut run = Run { recorder, exposures, bracket, gather, left_out: Vec::new(), exposed, disagree: 0 };
    let mut space = Space::of(run.recorder.folder());
    let mut over: Option<Fault> = None;
    let ended = loop {
        news(stream, exposures, &mut say);
        let shot = match stream.next(GLANCE) {
            Streamed::Shot(shot) => shot,
            Streamed::Quiet => {
                say(stream, None);
                continue;
            }
            Streamed::Ended(fault) => break fault,
        };
        say(stream, None);
        let enough = poses.is_some_and(|n| run.recorder.count() as u64 >= n);
        if over.is_some() || enough {
            stream.fate(Fate::Spare);
        } else {
            match run.take(stream, shot) {
                Ok(said) => said.into_iter().for_each(|s| say(stream, Some(s))),
                Err(fault) => over = Some(fault),
            }
        }
        if over.is_some() || poses.is_some_and(|n| run.recorder.count() as u64 >= n) {
            stream.feed().stop();
        }
        if let Some(said) = space.warn(run.recorder.folder(), run.recorder.bytes()) {
            say(stream, Some(said));
        }
    };
    // Pictures of a pose that is not complete.
    (0..run.gather.kept()).for_each(|_| stream.fate(Fate::Spare));
    let rest = run.gather.leave("the recording ended");
    run.list(rest);
    news(stream, exposures, &mut say);
    let Run { recorder, left_out, exposed, .. } = run;
    let done = ended_so(stream, recorder, left_out, over.or(ended))?;
    Ok(Recording { exposures: Some(exposed), ..done })
}

fn news(stream: &mut Stream, exposures: &Exposures, say: &mut impl FnMut(&Stream, Option<String>)) {
    let all = stream.news().into_iter().chain(exposures.news());
    all.for_each(|said| say(stream, Some(said)));
}

impl Run<'_> {
    /// Takes a picture; gives what is to be told. `Err` ends the recording.
    fn take(&mut self, stream: &Stream, shot: Box<Paired>) -> Result<Option<String>> {
        let index = self.exposures.index(shot.picture.exposure_ns.unwrap_or(0));
        match self.gather.take(*shot, index) {
            Gathered::Waits(left) if left.is_empty() => Ok(None),
            Gathered::Waits(left) => {
                left.iter().for_each(|_| stream.fate(Fate::Spare));
                self.exposed.left += 1;
                let said = (self.exposed.left <= TOLD).then(|| {
                    let takes = match self.exposed.longest_s {
                        0.0 => "no pose is complete yet".into(),
                        s => format!("a complete one took up to {s:.2} s"),
                    };
                    let (kept, all) = (left.len(), self.exposed.exposures_us.len());
                    format!("a pose was left after {kept} of {all} exposures: stand still for longer; {takes}")
                });
                self.list(left);
                Ok(said)
            }
            Gathered::Spare => {
                stream.fate(Fate::Spare);
                Ok(None)
            }
            Gathered::Unknown(left) => {
                stream.fate(Fate::Unpaired);
                self.list(vec![left]);
                Ok(None)
            }
            Gathered::Pose(pictures) => self.pose(stream, &pictures),
        }
    }

    /// Records a complete pose.
    fn pose(&mut self, stream: &Stream, pictures: &[Paired]) -> Result<Option<String>> {
        let images: Vec<Image> = pictures.iter().map(|p| p.picture.image.clone()).collect();
        if let Err(fault) = self.bracket.merge(&images) {
            pictures.iter().for_each(|_| stream.fate(Fate::Spare));
            return self.disagree(pictures, fault);
        }
        let first = &pictures[0];
        let all: Vec<&Image> = images.iter().collect();
        let added = self.recorder.add_all(&all, first.stand.as_ref(), first.taken.clone(), stream.feed().waiting());
        let fate = if added.is_ok() { Fate::Used } else { Fate::Disk };
        pictures.iter().for_each(|_| stream.fate(fate));
        added.map_err(|fault| fault.next(ROOM))?;
        self.gather.recorded();
        self.disagree = 0;
        let arrived = pictures.iter().map(|p| p.picture.host_ns);
        let took = arrived.clone().max().zip(arrived.min()).map_or(0, |(last, first)| last - first);
        self.exposed.longest_s = self.exposed.longest_s.max(1e-9 * took as f64);
        Ok(None)
    }

    /// Pictures of a pose whose light is not in the ratio of their exposures: a camera may need more pictures until a
    /// new exposure is in effect. The pose is taken again.
    fn disagree(&mut self, pictures: &[Paired], fault: Fault) -> Result<Option<String>> {
        self.disagree += 1;
        let why = format!("its exposures disagree: {}", fault.what);
        let left = |p: &Paired| LeftOut { id: p.picture.id, host_ns: p.picture.host_ns, why: why.clone() };
        self.list(pictures.iter().map(left).collect());
        let _ = self.gather.leave("its exposures disagree");
        if self.disagree >= DISAGREE {
            return Err(Fault { what: format!("{DISAGREE} poses in a row: {}", fault.what), ..fault });
        }
        let more = self.exposures.wait_longer().map_or(String::new(), |n| {
            format!("; from now on {n} more pictures are excluded after each setting of the exposure")
        });
        Ok((self.disagree <= TOLD).then(|| format!("{}; the pose is taken again{more}", fault.what)))
    }

    fn list(&mut self, left: Vec<LeftOut>) {
        let room = LISTED.saturating_sub(self.left_out.len());
        self.left_out.extend(left.into_iter().take(room));
    }
}
