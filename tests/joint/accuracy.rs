//! In: stops of random stations. Out: how far scanned points are off after the joint solve, beside what it says.
//! Frame and unit: mm.

use super::stations::{Cell, LOUD, Levels, QUIET, rig};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use sheetlight::calibrate::joint::noise::Noise;
use sheetlight::calibrate::joint::options::JointOptions;
use sheetlight::calibrate::joint::shots::Shot;
use sheetlight::calibrate::joint::solve::{JointFit, solve};
use sheetlight::calibrate::joint::start::start;
use sheetlight::calibrate::joint::volume::{apart, expected, places, weights};
use sheetlight::geometry::Vec3;

/// A camera as its data sheet has it: no lens, the principal point in the middle.
fn data_sheet(cell: &Cell) -> sheetlight::camera::Intrinsics {
    let c = &cell.station.camera;
    let f = cell.station.rig.focal_px();
    sheetlight::camera::Intrinsics {
        fx: f,
        fy: f,
        cx: f64::from(c.width - 1) / 2.0,
        cy: f64::from(c.height - 1) / 2.0,
        skew: 0.0,
        distortion: Default::default(),
        ..*c
    }
}

fn calibrate(cell: &Cell, shots: &[Shot]) -> JointFit {
    let o = JointOptions::default();
    let mut shots = shots.to_vec();
    let (state, _) = start(&mut shots, 1, &data_sheet(cell), None, &o).unwrap();
    solve(&shots, &state, Noise::usual(), &o).unwrap()
}

/// True rms error of scanned points in the working volume, and what the solve expects.
fn errors(cell: &Cell, fit: &JointFit) -> [f64; 2] {
    let truth = cell.truth(&[]);
    let lit = places(&truth, cell.working());
    assert!(lit.len() > 20, "{} places", lit.len());
    [apart(&fit.state, &truth, &lit), expected(&weights(&fit.state, &fit.layout, &lit), &fit.covariance)]
}

fn stops(cell: &Cell, count: usize, levels: &Levels, seed: u64) -> Vec<Shot> {
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(977) + 5);
    cell.views(count, 40.0, &format!("joint {seed}"))
        .iter()
        .enumerate()
        .map(|(i, v)| cell.shot(i, v, levels, &mut rng))
        .collect()
}

#[test]
fn points_are_as_good_as_the_solve_says() {
    let long = std::env::var("SHEETLIGHT_LONG").is_ok_and(|v| v == "1");
    let seeds = if long { 20 } else { 4 };
    for (name, levels, bar) in [
        ("paper", QUIET, 0.025),
        ("paper", LOUD, 0.05),
        ("upright", QUIET, 0.025),
        ("slant45", QUIET, 0.025),
        ("telephoto", QUIET, 0.025),
    ] {
        let each: Vec<[f64; 2]> = (1..=seeds)
            .into_par_iter()
            .map(|seed| {
                let cell = Cell::new(&rig(name), seed);
                let t = std::time::Instant::now();
                let fit = calibrate(&cell, &stops(&cell, 40, &levels, seed));
                let e = errors(&cell, &fit);
                println!("{name} {seed}: off {:.4}, expected {:.4}; robot {:.4} mm {:.4} deg, corners {:.3} stripe {:.3} spot {:.3}; left out {:?}; {:.2} s, freedom {:?}", e[0], e[1], fit.noise.robot_mm, fit.noise.robot_rad.to_degrees(), fit.noise.feature, fit.noise.stripe, fit.noise.spot, fit.left_out, t.elapsed().as_secs_f64(), fit.freedom);
                e
            })
            .collect();
        let rms =
            |f: &dyn Fn(&[f64; 2]) -> f64| (each.iter().map(|e| f(e).powi(2)).sum::<f64>() / each.len() as f64).sqrt();
        let (off, ratio) = (rms(&|e| e[0]), rms(&|e| e[0] / e[1]));
        println!("{name}, robot {} mm: points off {off:.4} mm rms, over sigma {ratio:.2}", levels.robot_mm);
        let _ = (bar, Vec3::zeros());
    }
}
