//! In: a calibration and its page. Out: both stored in the station, or refused if badly determined; a summary.
//! Frame and unit: none.

use crate::cli::terminal::console::Console;
use crate::procedure::calibrate::Solved;
use sheetlight::fault::{Fault, Result};
use sheetlight::rig::{Kind, Quality, Rig, Verdict};
use std::path::Path;

/// What happens to a result that is badly determined.
#[derive(clap::Args)]
pub struct Keep {
    /// Store the result even if it is badly determined
    #[arg(long)]
    keep_badly_determined: bool,
}

impl Keep {
    /// Whether a badly determined result is stored too.
    pub fn badly_determined(&self) -> bool {
        self.keep_badly_determined
    }
}

/// Stores a calibration and its page and reports the result. A badly determined one is refused: the station keeps
/// its present calibration, and the page shows the result.
pub fn finish(station: &Path, solved: &Solved, keep: &Keep, console: &Console) -> Result<()> {
    let Solved { record, page, value, .. } = solved;
    let (q, kind) = (record.quality(), record.kind());
    if q.verdict >= Verdict::BadlyDetermined && !keep.keep_badly_determined {
        let folder = station.join("calibration");
        sheetlight::files::make_folder(&folder)?;
        let html = folder.join(format!("{}.refused.html", kind.name()));
        page.save(&html)?;
        console.say(format!("{value}\n{}not stored; {}: what was found", figures(q), html.display()));
        let what = format!("the {} is {}: {}", kind.words(), q.verdict.words(), q.reasons.join("; "));
        return Err(Fault::refused(what)
            .cause("too few, too similar or contradicting pictures; the station keeps its former calibration")
            .next(q.advice.first().map_or("take more pictures", String::as_str)));
    }
    let path = Rig::store(station, record.as_ref(), Some(&page.html()))?;
    let html = path.with_extension("html");
    let mut text = format!("{value}\nverdict: {}\n", q.verdict.words());
    for r in &q.reasons {
        text += &format!("  {r}\n");
    }
    for a in &q.advice {
        text += &format!("  next: {a}\n");
    }
    text += &figures(q);
    text += &format!("stored {}\nreport {}", path.display(), html.display());
    console.result(&record.json(), &text);
    if q.verdict >= Verdict::BadlyDetermined {
        console.warn("badly determined: see the reasons before using it");
    }
    if kind == Kind::Camera {
        stale(station, console);
    }
    Ok(())
}

/// Reports which of a station's calibrations are invalid because it has another camera.
pub(in crate::cli) fn stale(station: &Path, console: &Console) {
    match Rig::load(station).and_then(|rig| rig.belong_together()) {
        Ok(()) => {}
        Err(fault) => console.warn(format!(
            "the station has another camera than before: scans are refused until these are repeated\n{fault}"
        )),
    }
}

/// Residuals of the fit, errors on excluded data and expected errors, one a line.
pub fn figures(q: &Quality) -> String {
    let mut text = String::new();
    for (head, keys) in [
        ("boards:", &["board_rms_px"][..]),
        ("fit:", &["rms_px", "rms_mm"]),
        ("verification:", &["holdout_rms_px", "holdout_rms_mm"]),
        ("sigma:", &["translation_sigma_mm", "rotation_sigma_deg"]),
    ] {
        let found: Vec<String> = keys.iter().filter_map(|k| q.figures.get(*k).map(|v| format!("{k} {v:.4}"))).collect();
        if !found.is_empty() {
            text += &format!("{head:13} {}\n", found.join(", "));
        }
    }
    text
}
