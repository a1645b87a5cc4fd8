//! In: a recording, a station. Out: its scan, with the station's own settings; the identity by which a resumed scan
//! recognizes the recording.
//! Frame and unit: cloud in the base frame, mm.

use super::options::ScanOptions;
use super::report::ScanReport;
use super::run::scan;
use crate::fault::Result;
use crate::raster::{Image, Pixels};
use crate::recording::{Motion, Recording};
use crate::rig::{Rig, hash_file, hash_text};
use crate::scan::{GridOptions, RecordingSource, Where};
use crate::station::settings::Settings;
use crate::station::volume::believed;
use std::path::Path;

impl ScanOptions {
    /// Options from a station's settings, into the folder `out`: at the fastest place, no overlays, no ambient
    /// picture, nothing skipped, not resumed. `rig` is the station's calibration, which gives the accepted depths
    /// if the settings do not state them.
    pub fn for_station(settings: &Settings, rig: &Rig, out: &Path) -> ScanOptions {
        ScanOptions {
            out: out.to_owned(),
            place: Where::default(),
            extraction: settings.extraction.clone(),
            grid: GridOptions::default(),
            motion: Motion::default(),
            volume: believed(settings, rig),
            ambient: None,
            overlays: 0,
            skip_bad: false,
            latency: None,
            resume: false,
            stop: Default::default(),
            watch: Default::default(),
        }
    }
}

/// Scans a recording by the motion that it states. For a robot, `poses` names the pose file; `None` is the one that
/// meta.json names. `progress` receives (shots done, shots in all).
///
/// # Errors
/// Those of [`scan`], and of the recording's poses or counts.
pub fn scan_recording(
    recording: &Recording,
    poses: Option<&str>,
    rig: &Rig,
    options: &ScanOptions,
    progress: impl FnMut(usize, Option<usize>),
) -> Result<ScanReport> {
    let options = &ScanOptions { motion: recording.meta.motion(), ..options.clone() };
    let id = identity(recording, poses, options.ambient.as_ref())?;
    let open =
        |first| Ok(Box::new(RecordingSource::late(recording, poses, first, options.latency.as_ref())?) as Box<_>);
    scan(&id, &recording.folder.display().to_string(), open, rig, options, progress)
}

/// Identity that a resumed scan must share with the interrupted one: a hash of meta.json, of the poses or counts,
/// of the channel and of the ambient picture.
fn identity(recording: &Recording, poses: Option<&str>, ambient: Option<&Image>) -> Result<String> {
    let mut meta = hash_file(&recording.folder.join("meta.json"))?;
    if let Some(name) = &recording.meta.frames_file {
        meta += &hash_file(&recording.inside(name)?)?;
    }
    // One exposure of a bracket is another recording than all of them.
    meta += &recording.exposure.map_or(String::new(), |n| format!("exposure {n}"));
    // The readout may also be stated by a person.
    meta += &recording.meta.image.readout.map_or(String::new(), |r| r.to_string());
    let ambient = ambient.map(|image| match &image.pixels {
        Pixels::U8(px) => hash_text(px),
        Pixels::U16(px) => hash_text(bytemuck::cast_slice(px)),
    });
    let text = if recording.meta.motion().axis().is_some() {
        serde_json::to_string(&(meta, recording.counts()?, recording.channel, ambient))
    } else {
        let poses: Vec<[f64; 16]> = recording.poses(poses)?.iter().map(|p| p.to_rows()).collect();
        serde_json::to_string(&(meta, poses, recording.channel, ambient))
    };
    Ok(hash_text(text.expect("plain data").as_bytes()))
}
