//! In: a finished scan folder, and its errors if the truth is known. Out: index.html, one page with embedded
//! pictures and points that loads nothing else.
//! Frame and unit: base frame, mm; pixels.

use super::embed::{picture, thousands};
use super::figures::{HISTOGRAM_STEP, Judged};
use super::parts::FoundPart;
use super::view;
use crate::fault::Result;
use crate::scan::HeightMap;
use crate::simulate::CloudErrors;
use crate::station::scan::report::{ScanReport, load_report};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::path::{Path, PathBuf};

const STYLE: &str = include_str!("page.css");

/// Writes `index.html` beside the scan's other files.
pub fn save(scan: &Path, judged: Option<&Judged>, found: &[FoundPart]) -> Result<PathBuf> {
    let report = load_report(scan)?;
    let map = HeightMap::load(scan).ok();
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { "Scan of " (report.recording) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    (head(&report, judged))
                    @if let Some(map) = &map { (heights(scan, map)?) }
                    @if let Some(judged) = judged { (errors(scan, judged)?) }
                    @if !found.is_empty() { (parts(scan, found)?) }
                    (shots(scan)?)
                    (peaks(&report))
                    @if map.is_some() { (companions(scan)?) }
                    (machine(&report))
                    footer { (report.program) @if timed(&report) { " · " (report.created) } }
                }
            }
        }
    };
    let path = scan.join("index.html");
    crate::files::write(&path, (page.into_string() + "\n").as_bytes())?;
    Ok(path)
}

/// Whether it says when and where it was made; those of a batch do not.
fn timed(r: &ScanReport) -> bool {
    r.created != ScanReport::NO_TIME
}

fn head(r: &ScanReport, judged: Option<&Judged>) -> Markup {
    let size = match r.profiles {
        Some(_) => format!("profiles of up to {} places", r.image.width),
        None => format!("shots of {}×{}, full resolution", r.image.width, r.image.height),
    };
    let mut cards = vec![(thousands(r.points), "points"), (r.shots.to_string(), &size)];
    if let Some(sigma) = r.median_sigma_mm {
        cards.push((format!("{sigma:.3} mm"), "standard deviation of a point (median, as stated by the scan)"));
    }
    if let Some(j) = judged {
        cards.push((format!("{:.3} mm", j.cloud.median_mm), "true distance from the surface (median)"));
        cards.push((format!("{:.2} %", 100.0 * j.cloud.outliers_share), "points beyond 1 mm"));
    }
    if let Some(h) = &r.height_map {
        cards.push((format!("{:.1} %", 100.0 * h.coverage), "of the height map's cells measured"));
    }
    if timed(r) {
        cards.push((format!("{:.0} shots/s", r.shots_per_second), &r.ran_on));
    }
    html! {
        header {
            h1 { (r.recording) }
            p { "Sheet-of-light scan, points in the robot's base frame" }
        }
        div.cards {
            @for (value, what) in &cards { div.card { b { (value) } span { (what) } } }
        }
    }
}

fn heights(scan: &Path, map: &HeightMap) -> Result<Markup> {
    let caption = "Height above the scan's best plane; dark cells were not measured and stay missing.";
    Ok(html! {
        section {
            h2 { "Height map" }
            (picture(scan, "height_picture.png", caption)?)
            (view::of(scan, map)?)
        }
    })
}

fn companions(scan: &Path) -> Result<Markup> {
    Ok(html! {
        section {
            h2 { "Companion maps" }
            div.pair {
                (picture(scan, "intensity_picture.png", "Stripe amplitude")?)
                (picture(scan, "sigma_picture.png", "Standard deviation of the height that each cell states")?)
                (picture(scan, "coverage_picture.png", "Points per cell")?)
            }
        }
    })
}

fn errors(scan: &Path, j: &Judged) -> Result<Markup> {
    let rows = std::iter::once(("everything", &j.cloud)).chain(j.by_part.iter().map(|(name, e)| (name.as_str(), e)));
    let row = |name: &str, e: &CloudErrors| {
        html! {
            tr {
                td { (name) }
                td { (thousands(e.points as u64)) }
                @for mm in [e.median_mm, e.rms_without_outliers_mm, e.p95_mm] { td { (format!("{mm:.4}")) } }
                td { (format!("{:.3}", e.largest_mm)) }
                td { (format!("{:.3} %", 100.0 * e.outliers_share)) }
            }
        }
    };
    let map = scan.join("error_picture.png").exists();
    Ok(html! {
        section {
            h2 { "Errors against the truth" }
            p {
                "The station was simulated, so the exact surface is known: this is the distance of every point from \
                 it, "
                "not a residual of a fit."
            }
            div.pair {
                (histogram(j))
                @if map {
                    (picture(scan, "error_picture.png", "Distance of each cell of the height map from the true \
                                                         surface")?)
                }
            }
            table {
                tr {
                    @for head in ["where", "points", "median mm", "rms mm", "95 % mm", "largest mm", "beyond 1 mm"] {
                        th { (head) }
                    }
                }
                @for (name, e) in rows { (row(name, e)) }
            }
            p.small {
                "rms without the points beyond 1 mm. Exact on faces; beside the edges of holes the distance is a \
                 lower bound."
            }
        }
    })
}

fn histogram(j: &Judged) -> Markup {
    let top = j.histogram.iter().copied().max().unwrap_or(1).max(1) as f64;
    let left = |i: usize| 30 + 20 * i;
    let height = |n: u64| 150.0 * n as f64 / top;
    let [one, two, three] = j.within_sigmas.map(|share| format!("{:.1}", 100.0 * share));
    let last = (j.histogram.len() - 1) as f64 * HISTOGRAM_STEP;
    html! {
        figure {
            svg viewBox="0 0 480 200" {
                @for (i, &n) in j.histogram.iter().enumerate() {
                    rect x=(left(i)) y=(format!("{:.1}", 160.0 - height(n))) width="17" height=(format!("{:.1}",
                        height(n))) {}
                }
                @for i in (0..j.histogram.len()).step_by(5) {
                    text x=(left(i)) y="178" { (format!("{:.2}", i as f64 * HISTOGRAM_STEP)) }
                }
                text x="200" y="196" { "distance from the surface, mm" }
            }
            figcaption {
                "Points by distance; the last bar takes all beyond " (format!("{last:.2}")) " mm. Within 1, 2, 3 of \
                    their own "
                "stated standard deviations: " (one) ", " (two) ", " (three) " % (a normal distribution: 68.3, 95.4, \
                    99.7)."
            }
        }
    }
}

fn parts(scan: &Path, found: &[FoundPart]) -> Result<Markup> {
    let heads = ["part", "pose", "error x mm", "error y mm", "error z mm", "error degrees", "stated sigma x y z mm"];
    let pose = |f: &FoundPart| if f.passed { "given".into() } else { format!("refused: {}", f.reasons.join("; ")) };
    let error = |f: &FoundPart| f.error_mm.map_or(["-"; 3].map(String::from), |e| e.map(|x| format!("{x:+.3}")));
    let degrees = |f: &FoundPart| f.error_deg.map_or("-".into(), |d| format!("{d:.3}"));
    Ok(html! {
        section {
            h2 { "Parts found, and where the robot inserts" }
            table {
                tr { @for head in heads { th { (head) } } }
                @for f in found {
                    tr {
                        td { (f.title) }
                        td.left { (pose(f)) }
                        @for mm in error(f) { td { (mm) } }
                        td { (degrees(f)) }
                        td { (format!("{:.3} {:.3} {:.3}", f.sigma_mm[0], f.sigma_mm[1], f.sigma_mm[2])) }
                    }
                }
            }
            @for f in found.iter().filter(|f| !f.picture.is_empty()) { (picture(scan, &f.picture, &f.title)?) }
        }
    })
}

fn shots(scan: &Path) -> Result<Markup> {
    let folder = scan.join("overlays");
    let mut names: Vec<String> = std::fs::read_dir(&folder)
        .map(|entries| entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect())
        .unwrap_or_default();
    names.retain(|n| n.ends_with(".png"));
    names.sort_by_key(|n| crate::files::natural(n));
    if names.is_empty() {
        return Ok(html! {});
    }
    Ok(html! {
        section {
            h2 { "Shots with their peaks" }
            p {
                "Every peak that was found, in the colour of what became of it. Rejected peaks are kept with their \
                 reason."
            }
            @for name in &names { (picture(&folder, name, &name.replace(".png", "").replace('_', " "))?) }
        }
    })
}

fn peaks(r: &ScanReport) -> Markup {
    let (all, of_profiles): (u64, bool) = (r.peaks.values().sum(), r.profiles.is_some());
    let mut rows: Vec<_> = r.peaks.iter().collect();
    rows.sort_by_key(|(_, n)| std::cmp::Reverse(**n));
    html! {
        section {
            h2 { @if of_profiles { "Places of the profiles" } @else { "What became of the peaks" } }
            table {
                tr { th { "result" } th { @if of_profiles { "places" } @else { "peaks" } } th { "share" } }
                @for (fate, &n) in rows {
                    tr { td { (fate) } td { (thousands(n)) } td { (format!("{:.3} \
                        %", 100.0 * n as f64 / all.max(1) as f64)) } }
                }
            }
            @if !of_profiles { p { (r.seen.words()) "." } }
            @if !r.dark_shots.is_empty() { p { (r.dark_shots.len()) " shots without a point." } }
            @for remark in &r.remarks { p { "Note: " (remark) } }
            @for (name, why) in &r.skipped { p { "Excluded " (name) ": " (why) } }
        }
    }
}

fn machine(r: &ScanReport) -> Markup {
    let print: String = r.rig_fingerprint.chars().take(16).collect();
    let time = format!("{:.2} s, {:.1} shots/s", r.seconds, r.shots_per_second);
    let mut rows = if timed(r) { vec![("ran on", r.ran_on.clone()), ("time", time)] } else { Vec::new() };
    rows.push(match &r.profiles {
        Some(p) => ("sensor", format!("standard deviation along z, as stated: {} mm", p.sigma_mm)),
        None => ("pictures", format!("{}×{}, {} bits", r.image.width, r.image.height, r.image.bits)),
    });
    rows.push(("calibration", format!("rig {print}")));
    if let Some(p) = &r.places {
        rows.push(("reported places", p.to_string()));
    }
    if let Some(s) = &r.sheet {
        rows.push(("sheet", s.to_string()));
    }
    if let Some(s) = &r.stripe {
        rows.push(("stripe", format!("{:.2} px wide (1 sigma), speckle contrast {:.2}", s.width_px, s.speckle)));
    }
    if let Some(h) = &r.height_map {
        rows.push(("height map", format!("{}×{} cells of {:.3} mm", h.width, h.height, h.cell_mm)));
    }
    html! {
        section {
            h2 { "Machine and settings" }
            table { @for (what, value) in &rows { tr { td { (what) } td.left { (value) } } } }
            p.small {
                "Beside this page: cloud.ply, cloud.pcd (points), height.tif, height.png + height.json (heights), "
                "scan.json (every figure)."
            }
        }
    }
}
