//! In: a batch that was run. Out: batch.json and batch.csv in its folder, together.
//! Frame and unit: as the columns say; the CSV has a comma between fields, a point in numbers.

use super::rows::{Batch, BatchRow};
use crate::fault::Result;
use std::path::Path;

const COLUMNS: &str = "recording,scan,points,median_sigma_mm,coverage,seconds,passed,score,x_mm,y_mm,z_mm,\
                       sigma_x_mm,sigma_y_mm,sigma_z_mm,sigma_rx_deg,sigma_ry_deg,sigma_rz_deg,insertion,problem";

pub(super) fn write(folder: &Path, batch: &Batch) -> Result<()> {
    let json = serde_json::to_string_pretty(batch).expect("plain data");
    let csv = table(batch);
    crate::files::write_beside(
        (&folder.join("batch.json"), json.as_bytes()),
        &[(&folder.join("batch.csv"), csv.as_bytes())],
    )
}

fn table(batch: &Batch) -> String {
    let lines = batch.rows.iter().map(line);
    std::iter::once(COLUMNS.to_owned()).chain(lines).fold(String::new(), |s, l| s + &l + "\r\n")
}

fn line(r: &BatchRow) -> String {
    let number = |v: Option<f64>| v.map(|v| v.to_string()).unwrap_or_default();
    let mut cells = vec![
        text(&r.recording.display().to_string()),
        text(&r.scan),
        r.points.map(|n| n.to_string()).unwrap_or_default(),
        number(r.median_sigma_mm),
        number(r.coverage),
        number(r.seconds),
    ];
    match &r.found {
        Some(f) => {
            cells.extend([f.passed.to_string(), f.score.to_string()]);
            cells.extend([3, 7, 11].map(|k| f.part[k].to_string()));
            cells.extend(f.sigma_mm.iter().chain(&f.sigma_deg).map(f64::to_string));
            let pose = f.insertion.iter().flatten().map(f64::to_string).collect::<Vec<_>>();
            cells.push(pose.join(" "));
        }
        None => cells.extend(vec![String::new(); 12]),
    }
    cells.push(text(r.problem.as_deref().unwrap_or("")));
    cells.join(",")
}

/// Quoted where it has to be: a table program takes what begins with = + - @ for a formula.
fn text(s: &str) -> String {
    let formula = s.starts_with(['=', '+', '-', '@']);
    if formula || s.contains([',', '"', '\n', '\r']) {
        let mark = if formula { "'" } else { "" };
        return format!("\"{mark}{}\"", s.replace('"', "\"\""));
    }
    s.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_has_every_column() {
        let row = BatchRow {
            recording: "a, \"b\"".into(),
            scan: "=1+1".into(),
            problem: Some("no pose".into()),
            points: Some(5),
            median_sigma_mm: None,
            coverage: Some(0.5),
            seconds: None,
            found: None,
        };
        let batch = Batch { format: 1, recipe: None, rows: vec![row], repeats: None };
        let table = table(&batch);
        let mut lines = table.split("\r\n");
        assert_eq!(lines.next().unwrap().split(',').count(), 19);
        assert_eq!(lines.next().unwrap(), format!("\"a, \"\"b\"\"\",\"'=1+1\",5,,0.5,{},no pose", ",".repeat(12)));
    }
}
