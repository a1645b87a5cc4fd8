//! In: a report. Out: a readable table of it.
//! Frame and unit: stated in the columns.

use super::rows::Row;
use super::run::Report;

/// The report as a readable table.
pub fn table(report: &Report) -> String {
    use std::fmt::Write;
    let mut out = machine(report);
    out += &columns();
    for r in &report.rows {
        out += &row(r);
    }
    for s in report.with_pixels.iter().chain(&report.with_light) {
        let _ = writeln!(
            out,
            "{}: {:.3} ms a shot + {:.4} ms a {}, {:.3} to {:.3}; measured {:.2} to {:.2} times that",
            s.what, s.intercept_ms, s.slope_ms, s.unit, s.from, s.to, s.lowest, s.highest
        );
    }
    for (r, s) in report.rows.iter().filter_map(|r| Some((r, r.soak?))) {
        let _ = writeln!(
            out,
            "{}x{} {}: {} shots of the full chain: {:.1} MB after a tenth, {:.1} MB at the end",
            r.width,
            r.height,
            r.scene.name(),
            s.shots,
            s.early_mb,
            s.late_mb
        );
    }
    for r in &report.rows {
        let _ = write!(out, "{}x{} {}: GPU ms a shot:", r.width, r.height, r.scene.name());
        for s in &r.stages {
            let _ = write!(out, " {} {:.3}", s.name, s.ms_per_shot);
        }
        let _ = writeln!(out);
    }
    out
}

/// The machine and its bandwidth limits.
fn machine(report: &Report) -> String {
    let (a, c) = (&report.adapter, &report.ceilings);
    format!(
        "{} ({}), {}, {} threads\n\
         plain read {:.1} GB/s on one thread, {:.1} on all; upload {:.1}, readback {:.1} GB/s{}\n",
        a.name,
        a.kind,
        a.driver,
        report.threads,
        c.read_gb_s,
        c.read_all_gb_s,
        c.upload_gb_s.unwrap_or(f64::NAN),
        c.readback_gb_s.unwrap_or(f64::NAN),
        c.device_gb_s.map_or(String::new(), |own| format!("; within the device {own:.0} GB/s"))
    )
}

/// The heads of the columns of [`row`].
fn columns() -> String {
    format!(
        "{:11} {:16} {:>5} {:>8} {:>8} {:>6} {:>8} {:>8} {:>8} {:>8} {:>8} {:>7} {:>7} {:>7} {:>7} {:>8} {:>8}\n",
        "size",
        "scene",
        "batch",
        "ms/shot",
        "full ms",
        "ratio",
        "shots/s",
        "Mpx/s",
        "resident",
        "and full",
        "CPU ms",
        "x read",
        "memory",
        "upload",
        "tiles",
        "p50 ms",
        "p99 ms"
    )
}

fn row(r: &Row) -> String {
    // Mpx/s.
    let rate = |ms: f64| f64::from(r.width) * f64::from(r.height) / (1e3 * ms);
    format!(
        "{:11} {:16} {:>5} {:>8.3} {:>8.3} {:>6.2} {:>8.1} {:>8.0} {:>8.0} {:>8.0} {:>8.2} {:>7.1} {:>6.1}% {:>6.1}% \
         {:>6.1}% {:>8.2} {:>8.2}\n",
        format!("{}x{}", r.width, r.height),
        r.scene.name(),
        r.shots_per_batch,
        r.ms_per_shot,
        r.full_ms_per_shot.unwrap_or(f64::NAN),
        r.full_over_skeleton.unwrap_or(f64::NAN),
        r.shots_per_s,
        r.mpx_per_s,
        rate(r.device_ms_per_shot),
        r.full_device_ms_per_shot.map_or(f64::NAN, rate),
        r.cpu_ms_per_shot.unwrap_or(f64::NAN),
        r.cpu_over_plain_read.unwrap_or(f64::NAN),
        100.0 * r.share_of_memory,
        100.0 * r.share_of_upload.unwrap_or(f64::NAN),
        100.0 * r.listed,
        r.latency.p50_ms,
        r.latency.p99_ms
    )
}
