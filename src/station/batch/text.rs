//! In: what came of each recording. Out: lines of recordings.csv, for table programs.
//! Frame and unit: as the columns say; a comma between fields, a point in numbers.

use super::manifest::Entry;
use super::rows::BatchRow;

/// The columns, and the line that names them.
pub(super) const COLUMNS: &str = "recording,results,points,median_sigma_mm,coverage,passed,score,x_mm,y_mm,z_mm,\
                                  sigma_x_mm,sigma_y_mm,sigma_z_mm,sigma_rx_deg,sigma_ry_deg,sigma_rz_deg,insertion,\
                                  problem\r\n";

/// The line of a recording; `row` is what came of it, where it has results.
pub(super) fn line(entry: &Entry, results: &str, row: Option<&BatchRow>) -> String {
    let number = |v: Option<f64>| v.map(|v| v.to_string()).unwrap_or_default();
    let mut cells = vec![
        text(&entry.name),
        row.map(|_| text(results)).unwrap_or_default(),
        row.and_then(|r| r.points).map(|n| n.to_string()).unwrap_or_default(),
        number(row.and_then(|r| r.median_sigma_mm)),
        number(row.and_then(|r| r.coverage)),
    ];
    match row.and_then(|r| r.found.as_ref()) {
        Some(f) => {
            cells.extend([f.passed.to_string(), f.score.to_string()]);
            cells.extend([3, 7, 11].map(|k| f.part[k].to_string()));
            cells.extend(f.sigma_mm.iter().chain(&f.sigma_deg).map(f64::to_string));
            let pose = f.insertion.iter().flatten().map(f64::to_string).collect::<Vec<_>>();
            cells.push(pose.join(" "));
        }
        None => cells.extend(vec![String::new(); 12]),
    }
    let problem = |r: &BatchRow| r.problem.as_ref().map_or(String::new(), |p| p.what.clone());
    cells.push(text(&row.map_or("no results".into(), problem)));
    cells.join(",") + "\r\n"
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
    use super::super::rows::Problem;
    use super::*;

    #[test]
    fn every_line_has_every_column() {
        let problem = Problem { what: "no pose".into(), cause: String::new(), next: String::new() };
        let row = BatchRow {
            format: 1,
            result: String::new(),
            input: String::new(),
            problem: Some(problem),
            frame: None,
            shots: None,
            points: Some(5),
            median_sigma_mm: None,
            coverage: Some(0.5),
            figures: Default::default(),
            recipe: None,
            found: None,
            shot_rows: Vec::new(),
        };
        let entry = |name: &str| Entry { input: String::new(), name: name.into() };
        let columns = COLUMNS.split(',').count();
        let said = line(&entry("a, \"b\""), "=1+1", Some(&row));
        assert_eq!(said, format!("\"a, \"\"b\"\"\",\"'=1+1\",5,,0.5,{},no pose\r\n", ",".repeat(11)));
        assert_eq!(line(&entry("a"), "r", None), format!("a{}no results\r\n", ",".repeat(columns - 1)));
    }
}
