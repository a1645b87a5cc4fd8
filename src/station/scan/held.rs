//! Scans into memory: the points and the height map of a scan folder, for programs that have their own pictures.
//! Points are in the frame of the moving part (mostly the robot's base), mm.

use super::done::{Done, scanner_for};
use super::options::ScanOptions;
use super::products::{FEWEST_OF_A_MAP, figures};
use super::progress::{Calibrated, Checkpoint, fingerprint_of};
use super::refined::Refined;
use super::report::{ScanReport, Spent};
use super::spread::Spread;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Camera, Rigid};
use crate::rig::Rig;
use crate::scan::{
    CloudPoint, Extraction, Format, GridOptions, HeightMap, Profile, Refining, Shots, Source, grid_on, parts_for,
};
use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// A scan in memory.
pub struct HeldScan {
    /// The content of scan.json; it names no files.
    pub report: ScanReport,
    /// The points of cloud.ply, in its order.
    pub points: Vec<CloudPoint>,
    /// Pose of the camera at each shot.
    pub shots: Shots,
    /// `None` if there are too few points for a map.
    pub map: Option<HeightMap>,
}

impl HeldScan {
    /// The points where the middle of the laser sheet meets the camera's rays, as in
    /// [`super::report::lit_cloud_of`].
    pub(in crate::station) fn lit(&self) -> Vec<CloudPoint> {
        let mut points = self.points.clone();
        if self.report.sheet.is_some() {
            self.shots.onto_sheet(&mut points);
        }
        points
    }
}

/// Points and camera poses, collected shot by shot.
#[derive(Default)]
struct Gathered {
    points: Vec<CloudPoint>,
    places: Vec<(u32, Rigid<Base, Camera>)>,
}

impl Gathered {
    fn take(&mut self, profile: &Profile) -> Result<()> {
        self.points.extend_from_slice(&profile.points);
        // Identical to the last bit to what a scan folder's list of shots returns: the refined points depend on it.
        let (place, _) = Rigid::from_rows(&profile.from_camera.to_rows())?;
        self.places.push((profile.shot, place));
        Ok(())
    }
}

/// Scans a source from its first shot to its last and returns the result in memory, with the points that a scan
/// into a folder writes. `label` names the scanned object. The options `out`, `overlays`, `resume` and `watch` are
/// not used. `progress` receives (shots done, shots in all).
///
/// # Errors
/// The rig is not suitable, a shot is bad and `skip_bad` is not set, or a stop was requested.
pub fn scan_held(
    label: &str,
    source: &mut dyn Source,
    rig: &Rig,
    options: &ScanOptions,
    mut progress: impl FnMut(usize, Option<usize>),
) -> Result<HeldScan> {
    let started = Instant::now();
    options.grid.check()?;
    let rig = &parts_for(rig, &options.motion);
    rig.belong_together()?;
    rig.reaches(options.volume.as_ref())?;
    let (mut scanner, mut seen) = scanner_for(rig, &*source, options, options.place.open()?)?;
    let calibrated = Calibrated::of(rig, &source.pictures())?;
    let total = source.remaining();
    let (mut state, mut gathered, mut ended) = (Checkpoint::new(String::new()), Gathered::default(), false);
    // Fingerprints of the pictures being processed, oldest first.
    let mut pictures = VecDeque::new();
    while !ended {
        let next = source.next();
        if options.stop.load(Ordering::Relaxed) {
            return Err(Fault::output("the scan was stopped before its end")
                .cause("somebody asked for it")
                .next("scan again"));
        }
        match next {
            Some(Ok(shot)) => {
                seen.look(shot.index, &shot.image);
                pictures.push_back(fingerprint_of(&shot.image));
                scanner.push(shot)?;
            }
            Some(Err(bad)) if options.skip_bad && !bad.last => state.skipped.push((bad.name, bad.fault.what)),
            Some(Err(bad)) => return Err(if bad.last { bad.fault } else { bad.fault.at(bad.name) }),
            None => ended = true,
        }
        for profile in if ended { scanner.finish()? } else { scanner.ready()? } {
            gathered.take(&profile)?;
            state.add(&profile, pictures.pop_front().expect("a picture a profile"), calibrated.as_ref());
        }
        progress(state.shots, total);
    }
    state.cut = scanner.cut();
    let stripe_px = scanner.stripe().map(|s| s.width_px);
    let mut shots = Shots::new(scanner.stripe_along(), gathered.places).with_stripe(stripe_px);
    shots.sheet = Some(rig.need_laser_plane()?.value);
    let (points, shots, refined) = refine(gathered.points, shots, source.format(), options)?;
    let seconds = started.elapsed().as_secs_f64();
    let grid = GridOptions { up: scanner.up_in_base(), ..options.grid.clone() };
    let enough = points.len() as u64 >= FEWEST_OF_A_MAP;
    let map = enough.then(|| grid_on(&points, &grid, scanner.device())).transpose()?;
    let done = Done {
        label,
        rig,
        options,
        source,
        scanner: &scanner,
        shots_of_this_run: state.shots,
        state,
        calibrated,
        seen,
        delay: None,
        seconds,
        spent: Spent::default(),
        stopped: None,
        points: points.len() as u64,
        refined,
    };
    Ok(HeldScan { report: done.report(map.as_ref().map(figures), Default::default()), points, shots, map })
}

/// The points after correction of the errors that the cloud itself shows.
fn refine(
    points: Vec<CloudPoint>,
    shots: Shots,
    format: Format,
    options: &ScanOptions,
) -> Result<(Vec<CloudPoint>, Shots, Refined)> {
    let settings: &Extraction = &options.extraction;
    let refining = Refining::of(&points, shots, format, settings)?;
    let places = refining.places;
    if !refining.changes() {
        return Ok((points, refining.shots, Refined { places, ..Refined::default() }));
    }
    let (mut out, mut spread) = (Vec::with_capacity(points.len()), Spread::default());
    let sheet = refining.apply(&points, &mut |part| {
        spread.add(part);
        out.extend_from_slice(part);
        Ok(())
    })?;
    Ok((out, refining.shots, Refined { places, sheet, median_sigma_mm: spread.median_mm() }))
}
