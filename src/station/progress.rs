//! In: finished profiles of a running scan. Out: a checkpoint file to resume from, and running figures
//! in memory that does not grow with the scan.
//! Frame and unit: counts; sigma in mm.

use crate::fault::{Fault, Result};
use crate::scan::{CloudWriter, Profile};
use crate::stages::peak::{Reject, Stripe};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Where an interrupted scan stands. Everything in it belongs to points that are on the disk.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// Hash of recording, rig and settings.
    pub identity: String,
    /// Shots done, the skipped ones included.
    pub shots: usize,
    pub points: u64,
    pub peaks: BTreeMap<String, u64>,
    pub dark: Vec<u32>,
    pub skipped: Vec<(String, String)>,
    /// What the first shots said of the stripe.
    pub stripe: Option<Stripe>,
    /// Histogram of log10(sigma / mm) from -5 to 1 in 240 steps of 0.025 (6 % a step).
    sigma: Vec<u64>,
}

const SIGMA_BINS: usize = 240;

fn path_of(out: &Path) -> PathBuf {
    out.join("scan.progress.json")
}

impl Checkpoint {
    pub fn new(identity: String) -> Checkpoint {
        Checkpoint {
            identity,
            shots: 0,
            points: 0,
            peaks: BTreeMap::new(),
            dark: Vec::new(),
            skipped: Vec::new(),
            stripe: None,
            sigma: vec![0; SIGMA_BINS],
        }
    }

    /// The checkpoint in a folder, if a scan was interrupted there.
    pub fn load(out: &Path) -> Result<Option<Checkpoint>> {
        let path = path_of(out);
        match std::fs::read_to_string(&path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(Fault::read(&path, e)),
            Ok(text) => serde_json::from_str(&text).map(Some).map_err(|e| {
                Fault::input(format!("{}: is no checkpoint: {e}", path.display()))
                    .cause("damaged, or of another version")
                    .next("delete it and scan again")
            }),
        }
    }

    /// Puts the cloud on the disk, then says how far it got.
    pub fn save(&mut self, out: &Path, cloud: &mut CloudWriter) -> Result<()> {
        self.points = cloud.checkpoint()?;
        let text = serde_json::to_string(self).expect("plain data");
        crate::files::write(&path_of(out), text.as_bytes())
    }

    /// A finished scan needs none.
    pub fn remove(out: &Path) -> Result<()> {
        match std::fs::remove_file(path_of(out)) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Fault::write(&path_of(out), e)),
            _ => Ok(()),
        }
    }

    /// Counts a finished profile.
    pub fn add(&mut self, profile: &Profile) {
        // A skipped shot leaves a gap in the indices; resuming goes on behind the last one done.
        self.shots = profile.shot as usize + 1;
        let mut fates = [0; Reject::ALL.len()];
        profile.peaks.iter().for_each(|peak| fates[peak.reject() as usize] += 1);
        for (fate, n) in Reject::ALL.into_iter().zip(fates).filter(|&(_, n)| n > 0) {
            *self.peaks.entry(fate.words().to_owned()).or_default() += n;
        }
        if profile.points.is_empty() {
            self.dark.push(profile.shot);
        }
        for p in &profile.points {
            let bin = ((f64::from(p.sigma_mm).max(1e-30).log10() + 5.0) * 40.0).clamp(0.0, SIGMA_BINS as f64 - 1.0);
            self.sigma[bin as usize] += 1;
        }
    }

    /// Median standard deviation of the points, mm, to 3 %; NaN without points.
    pub fn median_sigma(&self) -> f64 {
        let half = self.sigma.iter().sum::<u64>().div_ceil(2);
        let mut sum = 0;
        let bin = self.sigma.iter().position(|n| {
            sum += n;
            half > 0 && sum >= half
        });
        bin.map_or(f64::NAN, |b| 10f64.powf((b as f64 + 0.5) / 40.0 - 5.0))
    }
}

/// One scan at a time may write into a folder. The lock is a file that goes with the value.
pub struct Lock {
    path: PathBuf,
}

impl Lock {
    pub fn take(out: &Path) -> Result<Lock> {
        let path = out.join("scan.lock");
        // A lock left by a process that is gone is taken over.
        if let Some(pid) = std::fs::read_to_string(&path).ok().and_then(|t| t.trim().parse::<u32>().ok()) {
            if pid != std::process::id() && Path::new("/proc").join(pid.to_string()).exists() {
                return Err(Fault::output(format!("{}: another scan (process {pid}) writes here", out.display()))
                    .cause("two scans were started into one folder")
                    .next("wait for it, or choose another --out"));
            }
        }
        std::fs::write(&path, std::process::id().to_string()).map_err(|e| Fault::write(&path, e))?;
        Ok(Lock { path })
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Best effort: a stale lock is recognised by its process being gone.
        let _ = std::fs::remove_file(&self.path);
    }
}
