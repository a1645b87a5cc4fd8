//! In: a finished scan and the truth of its simulated station. Out: its errors, for all points and by part, a
//! histogram and a map of them.
//! Frame and unit: base frame, mm.

use super::figures::{HISTOGRAM_STEP, Judged};
use super::parts::FoundPart;
use crate::fault::Result;
use crate::scan::{CloudFile, HeightMap, PointSource};
use crate::simulate::{CloudErrors, Truth};
use std::collections::BTreeMap;
use std::path::Path;

const HISTOGRAM_BINS: usize = 21;

/// Compares a scan folder with `truth.json`. Writes `errors.json`, `error_picture.png` and with feature `pages` a new
/// page into it; the page also shows the `found` parts.
pub fn judge(scan: &Path, truth: &Path, found: &[FoundPart]) -> Result<Judged> {
    let truth = Truth::load(truth)?;
    let cloud = CloudFile::open(&scan.join("cloud.ply"))?;
    let mut parts: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let mut histogram = vec![0; HISTOGRAM_BINS];
    let mut within = [0u64; 3];
    cloud.for_each_chunk(&mut |chunk| {
        for p in chunk {
            let place = p.at();
            let d = truth.distance(&place);
            let part = truth.part_near(&place).unwrap_or("board");
            match parts.get_mut(part) {
                Some(all) => all.push(d),
                None => drop(parts.insert(part.to_owned(), vec![d])),
            }
            histogram[((d / HISTOGRAM_STEP) as usize).min(HISTOGRAM_BINS - 1)] += 1;
            for (i, n) in within.iter_mut().enumerate() {
                *n += u64::from(d <= (i + 1) as f64 * f64::from(p.sigma_mm));
            }
        }
    })?;
    let all = CloudErrors::of(parts.values().flatten().copied().collect());
    let mut judged = Judged {
        cloud: all,
        by_part: parts.into_iter().map(|(name, d)| (name, CloudErrors::of(d))).collect(),
        histogram,
        within_sigmas: within.map(|n| n as f64 / cloud.count().max(1) as f64),
        map_median_mm: f64::NAN,
    };
    if let Ok(mut map) = HeightMap::load(scan) {
        judged.map_median_mm = error_map(&mut map, &truth);
        let picture = map.picture(crate::scan::Shown::Sigma).0;
        crate::files::write(&scan.join("error_picture.png"), &picture.to_png())?;
    }
    let text = serde_json::to_string_pretty(&judged).expect("plain numbers");
    crate::files::write(&scan.join("errors.json"), text.as_bytes())?;
    #[cfg(not(feature = "pages"))]
    let _ = found;
    #[cfg(feature = "pages")]
    crate::station::judge::page::save(scan, Some(&judged), found)?;
    Ok(judged)
}

/// Replaces each cell's sigma with its distance from the true surface; returns the median distance.
fn error_map(map: &mut HeightMap, truth: &Truth) -> f64 {
    let mut all = Vec::new();
    for iy in 0..map.height {
        for ix in 0..map.width {
            if let Some(p) = map.point(ix, iy) {
                let d = truth.distance(&map.base_from_grid.point(&p));
                map.sigma[(iy * map.width + ix) as usize] = d as f32;
                all.push(d);
            }
        }
    }
    CloudErrors::of(all).median_mm
}
