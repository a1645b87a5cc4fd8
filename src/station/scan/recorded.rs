//! In: a recording, a station. Out: its scan, with the station's own settings; by what a resumed scan knows the
//! recording.
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
    /// What a station's settings ask for, into the folder `out`: wherever it is fastest, no overlays, no ambient
    /// picture, nothing skipped, not resumed. `rig` is the station's calibration, which knows the believed depths
    /// where the settings leave them open.
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

/// Scans a recording by the motion that it states, a robot's with the poses of that name (the one that meta.json
/// names, where it is `None`). `progress` is told (shots done, shots in all).
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

/// What a resumed scan must have in common with the interrupted one: a hash of meta.json, of the poses or counts, of
/// the channel and of the ambient picture.
fn identity(recording: &Recording, poses: Option<&str>, ambient: Option<&Image>) -> Result<String> {
    let mut meta = hash_file(&recording.folder.join("meta.json"))?;
    if let Some(name) = &recording.meta.frames_file {
        meta += &hash_file(&recording.inside(name)?)?;
    }
    // Also by a person's word.
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
