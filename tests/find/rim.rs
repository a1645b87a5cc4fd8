//! In: scans of parts at random poses by specimens of the station, cut through the part on each of the four sides.
//! Out: whether the program says that the part goes on there, how far, and where the sweep has to go; of parts that
//! were scanned whole and refused for another reason it says nothing of the kind.
//! Frame and unit: base frame, mm.

use super::recipes::{PARTS, Scanned, recipe, scan};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use sheetlight::find::{CutOff, LocateOptions, Recipe, beyond_rim, locate};
use sheetlight::geometry::{Vec2, Vec3};
use sheetlight::scan::CloudPoint;

/// The middle of the part is in the scan: nearly half of it may be missing.
const MISSING: std::ops::Range<f64> = 0.1..0.45;

/// A side of a scan: the number that grows towards it, and its name.
type Side = (fn(&CloudPoint) -> f64, f64, &'static str);
const SIDES: [Side; 4] = [
    (|p| f64::from(p.shot), 1.0, "the last shot"),
    (|p| f64::from(p.shot), -1.0, "the first shot"),
    (|p| f64::from(p.u), 1.0, "the picture's right edge"),
    (|p| f64::from(p.u), -1.0, "the picture's left edge"),
];

/// The scan without what lies past a side of it, so that a share of the part's points is missing, and the direction
/// to that side with how far the part goes on there, mm.
fn cut(s: &Scanned, (number, sign, _): Side, missing: f64) -> (Vec<CloudPoint>, Vec3) {
    let part_from_base = s.truth.inverse();
    let b = s.recipe.drawing().bounds();
    let on = |p: &&CloudPoint| {
        let q = part_from_base.point(&p.at());
        q.x > b[0] && q.x < b[2] && q.y > b[1] && q.y < b[3] && q.z.abs() < 1.0
    };
    let mut numbers: Vec<f64> = s.cloud.iter().filter(on).map(|p| sign * number(p)).collect();
    numbers.sort_by(f64::total_cmp);
    let limit = numbers[((1.0 - missing) * numbers.len() as f64) as usize];
    let kept: Vec<CloudPoint> = s.cloud.iter().filter(|p| sign * number(p) <= limit).copied().collect();
    // How a millimetre on the board changes the number: a plane through the numbers of all points.
    let mean = |f: &dyn Fn(&CloudPoint) -> f64| s.cloud.iter().map(f).sum::<f64>() / s.cloud.len() as f64;
    let at = |p: &CloudPoint| part_from_base.point(&p.at());
    let (mx, my, mn) = (mean(&|p| at(p).x), mean(&|p| at(p).y), mean(&|p| sign * number(p)));
    let mut a = nalgebra::Matrix2::zeros();
    let mut g = Vec2::zeros();
    for p in &s.cloud {
        let d = Vec2::new(at(p).x - mx, at(p).y - my);
        a += d * d.transpose();
        g += d * (sign * number(p) - mn);
    }
    let slope = a.try_inverse().unwrap() * g;
    let corners = [[b[0], b[1]], [b[2], b[1]], [b[2], b[3]], [b[0], b[3]]];
    let far =
        corners.map(|c| slope.dot(&(Vec2::from(c) - Vec2::new(mx, my))) + mn).into_iter().fold(f64::MIN, f64::max);
    let by = slope.normalize() * (far - limit) / slope.norm();
    (kept, s.truth.direction(&Vec3::new(by.x, by.y, 0.0)))
}

enum Said {
    /// Measured well enough: whether a little of it is missing matters to nobody.
    Passed,
    /// Refused for another reason.
    Other,
    CutOff(CutOff),
}

fn said(s: &Scanned, recipe: &Recipe, cloud: &[CloudPoint]) -> Said {
    let options = LocateOptions::default();
    let found = locate(cloud, &s.shots, recipe, Some(&s.rig), &options);
    if found.as_ref().is_ok_and(|r| r.passed) {
        return Said::Passed;
    }
    let cut = beyond_rim(cloud, &s.shots, recipe, &options).unwrap();
    // Who asks and who reads see the same.
    match (&found, &cut) {
        (Err(fault), Some(_)) => assert!(fault.what.contains("beyond the rim"), "{fault}"),
        (Err(fault), None) => assert!(!fault.what.contains("beyond the rim"), "{fault}"),
        (Ok(report), cut) => assert_eq!(report.cut_off, *cut),
    }
    cut.map_or(Said::Other, Said::CutOff)
}

#[test]
fn a_part_that_goes_on_beyond_the_rim_is_said_to() {
    let scans = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 12 } else { 1 };
    let all: Vec<(&'static str, u64)> = PARTS.iter().flat_map(|p| (101..101 + scans).map(move |s| (*p, s))).collect();
    let judged: Vec<(usize, Vec<String>)> = all
        .into_par_iter()
        .map(|(part, seed)| {
            let s = scan(part, seed);
            let mut rng = Pcg64::seed_from_u64(seed);
            let (mut asked, mut wrong) = (0, Vec::new());
            for side in SIDES {
                let missing = rng.random_range(MISSING);
                let (cloud, by) = cut(&s, side, missing);
                let about =
                    format!("{}, {:.0} % missing past {}, {:.1} mm", s.about, 100.0 * missing, side.2, by.norm());
                let cut = match said(&s, &s.recipe, &cloud) {
                    Said::Passed => continue,
                    Said::Other => {
                        wrong.push(format!("{about}: not said"));
                        continue;
                    }
                    Said::CutOff(cut) => cut,
                };
                asked += 1;
                // The cut scan may be smaller than the part: then its middle goes to the part's.
                let along = cut.sweep_by_mm.dot(&by.normalize()) / by.norm();
                let far = (cut.by_mm - by.norm()).abs() < 1.0 + 0.2 * by.norm();
                if cut.side != side.2 || !far || !(0.4..2.0 + 5.0 / by.norm()).contains(&along) {
                    wrong.push(format!("{about}: {}, sweep by {along:.2} of it", cut.words()));
                }
            }
            // Scanned whole, and refused for what it is.
            for other in PARTS.iter().filter(|p| **p != part) {
                asked += 1;
                if let Said::CutOff(cut) = said(&s, &recipe(other), &s.cloud) {
                    wrong.push(format!("{}, searched for {other}: {}", s.about, cut.words()));
                }
            }
            (asked + wrong.iter().filter(|w: &&String| w.ends_with("not said")).count(), wrong)
        })
        .collect();
    let of: usize = judged.iter().map(|j| j.0).sum();
    let wrong: Vec<&String> = judged.iter().flat_map(|j| &j.1).collect();
    println!("{} of {of} right\n{wrong:#?}", of - wrong.len());
    assert!(20 * wrong.len() <= of, "{wrong:#?}");
}
