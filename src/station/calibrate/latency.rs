//! In: a recording of a part that was passed back and forth, paired by clock; a station. Out: the delay of its
//! pictures relative to its poses.
//! Frame and unit: the cloud's frame, mm; ms.

use crate::calibrate::latency::{Delay, Passing, delay};
use crate::capture::Latency;
use crate::fault::{Fault, Result};
use crate::geometry::Vec3;
use crate::recording::{Recording, Slip, Stand};
use crate::rig::Rig;
use crate::scan::{Carrier, RecordingSource, Scanner, Source, Where, parts_for};
use crate::station::settings::Settings;
use crate::station::volume::believed;
use std::collections::BTreeMap;

/// Result of a calibration of the latency.
#[derive(Clone, Debug, serde::Serialize)]
pub struct LatencyFound {
    /// The total latency: the one assumed in the recording plus the one found beyond it.
    pub latency: Latency,
    /// The part found beyond the assumed latency.
    pub beyond: Delay,
    /// Number of shots used.
    pub shots: usize,
}

/// Largest accepted sigma of the delay, ms.
const WORST: f64 = 1.0;

/// Finds the delay.
///
/// # Errors
/// The recording was not paired by clock, or its passes do not determine the delay.
pub fn calibrate_latency(
    recording: &Recording,
    rig: &Rig,
    settings: &Settings,
    place: Where,
    mut progress: impl FnMut(usize, Option<usize>),
) -> Result<LatencyFound> {
    let motion = recording.meta.motion();
    let rig = &parts_for(rig, &motion);
    let carrier = Carrier::new(rig, &motion)?;
    let (rates, former_ns) = pairing(recording)?;
    let mut source = RecordingSource::open(recording, None, 0)?;
    let (volume, total) = (believed(settings, rig), source.remaining());
    let mut extraction = settings.extraction.clone();
    extraction.peak.levels = source.levels();
    let mut scanner =
        Scanner::new(rig, carrier.clone(), source.pictures(), &extraction, volume.as_ref(), None, place.open()?)?;
    let mut stands: BTreeMap<u32, Stand> = BTreeMap::new();
    let mut shots = Vec::new();
    let mut add = |profiles: Vec<crate::scan::Profile>, stands: &BTreeMap<u32, Stand>| -> Result<()> {
        for profile in profiles {
            let points = profile.points.iter().map(|p| p.at());
            shots.push(passing(&carrier, &stands[&profile.shot], rates[profile.shot as usize].as_ref(), points)?);
        }
        Ok(())
    };
    while let Some(shot) = source.next() {
        let shot = shot.map_err(|bad| bad.fault.at(bad.name))?;
        stands.insert(shot.index, shot.stand);
        scanner.push(shot)?;
        add(scanner.ready()?, &stands)?;
        progress(stands.len(), total);
    }
    add(scanner.finish()?, &stands)?;
    let beyond = delay(&shots, &scanner.up_in_base())?;
    let sigma_ms = 1e3 * beyond.sigma_s;
    if !(sigma_ms < WORST) {
        return Err(Fault::refused(format!("the delay is known to {sigma_ms:.2} ms only, limit {WORST}"))
            .cause("too little of the part is slanted, or the passes overlap little")
            .next("pass back and forth, several times, over a part with slopes or with edges slanted to the stripe"));
    }
    let latency = Latency {
        delay_ms: 1e-6 * former_ns + 1e3 * beyond.seconds,
        sigma_ms,
        created: jiff::Timestamp::now().to_string(),
        recordings: vec![recording.folder.display().to_string()],
        sources: recording.meta.sources.clone(),
    };
    Ok(LatencyFound { latency, beyond, shots: shots.len() })
}

/// Points with their velocity per second, from the motion in a thousandth of a second.
fn passing(
    carrier: &Carrier,
    stand: &Stand,
    rate: Option<&Slip>,
    points: impl Iterator<Item = Vec3>,
) -> Result<Vec<Passing>> {
    const PART: f64 = 1e-3;
    let Some(rate) = rate else { return Ok(Vec::new()) };
    let from_camera = carrier.place(stand, None, &Vec3::zeros())?.from_camera;
    let later = carrier.place(&rate.times(PART).moves(stand), None, &Vec3::zeros())?.from_camera;
    let moves = later * from_camera.inverse();
    Ok(points.map(|at| Passing { at, velocity: (moves.point(&at) - at) / PART }).collect())
}

/// The motion rate of each shot by its clock, and the delay with which all shots were taken, ns.
fn pairing(recording: &Recording) -> Result<(Vec<Option<Slip>>, f64)> {
    let taken: Vec<_> = recording.meta.frames.iter().filter(|f| f.laser.is_some()).map(|f| f.taken.as_ref()).collect();
    let rates: Vec<Option<Slip>> = taken.iter().map(|t| t.and_then(|t| t.rate)).collect();
    if rates.iter().all(Option::is_none) {
        return Err(Fault::refused(format!("{}: no shot was paired by clock", recording.folder.display()))
            .cause("it was recorded standing still, or by number: then no delay matters")
            .next("record with --pair clock --pose-stream URI while the part is passed back and forth"));
    }
    let former: Vec<f64> = taken.iter().filter_map(|t| t.and_then(|t| t.delay_ns)).collect();
    if former.iter().any(|d| *d != former[0]) {
        return Err(Fault::input("its shots were recorded with different delays")
            .next("record all passes again with one delay"));
    }
    Ok((rates, former.first().copied().unwrap_or(0.0)))
}
