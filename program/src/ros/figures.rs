//! In: the report of a scan. Out: its figures as a status.
//! Frame and unit: the unit is in each figure's name.

use super::messages::Status;
use sheetlight::station::ScanReport;

/// The figures of scan.json that describe a scan's quality; a warning if shots were skipped or there are remarks.
pub fn status(report: &ScanReport) -> Status {
    let mut values: Vec<(String, String)> = Vec::new();
    let mut add = |key: &str, value: String| values.push((key.to_owned(), value));
    add("program", report.program.clone());
    add("created", report.created.clone());
    add("frame", report.frame.clone());
    add("recording", report.recording.clone());
    add("ran_on", report.ran_on.clone());
    add("points", report.points.to_string());
    add("shots", report.shots.to_string());
    add("dark_shots", report.dark_shots.len().to_string());
    add("skipped_shots", report.skipped.len().to_string());
    report.peaks.iter().for_each(|(fate, n)| add(&format!("peaks.{fate}"), n.to_string()));
    report.median_sigma_mm.iter().for_each(|s| add("median_sigma_mm", s.to_string()));
    if let Some(stripe) = &report.stripe {
        add("stripe.width_px", stripe.width_px.to_string());
        add("stripe.speckle", stripe.speckle.to_string());
    }
    if let Some(map) = &report.height_map {
        add("height_map.cell_mm", map.cell_mm.to_string());
        add("height_map.coverage", map.coverage.to_string());
        add("height_map.z_low_mm", map.z_low_mm.to_string());
        add("height_map.z_high_mm", map.z_high_mm.to_string());
    }
    add("hot_pixels", report.hot_pixels.to_string());
    add("seconds", report.seconds.to_string());
    add("shots_per_second", report.shots_per_second.to_string());
    let said = report.skipped.iter().map(|(name, why)| format!("skipped {name}: {why}"));
    let said: Vec<String> = said.chain(report.remarks.iter().cloned()).collect();
    said.iter().enumerate().for_each(|(i, remark)| add(&format!("remark.{i}"), remark.clone()));
    Status {
        warn: !said.is_empty(),
        name: "sheetlight: scan".to_owned(),
        message: format!("{} points in {} shots", report.points, report.shots),
        hardware: report.rig_fingerprint.clone(),
        values,
    }
}
