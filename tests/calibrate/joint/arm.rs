//! In: an arm whose links and joint zeros are not what its controller believes. Out: whether the joint solve says
//! that the arm limits it, and how far points are off in the calibrated volume.
//! Frame and unit: mm, degrees.

use super::stations::{Cell, Levels, QUIET, calibrate, rig};
use super::{rms, seeds};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use sheetlight::calibrate::joint::limits::systematic;
use sheetlight::calibrate::joint::options::JointOptions;
use sheetlight::calibrate::joint::shots::Shot;
use sheetlight::calibrate::joint::solve::JointFit;
use sheetlight::calibrate::joint::volume::{places, scanned};
use sheetlight::geometry::{Base, Board, Camera, Flange, Rigid, Vec3, exp, log};

/// A six-axis arm by its joint chain: origin of each joint in the frame before, mm, and its axis. The numbers are a
/// Denso VS-060's.
#[derive(Clone)]
struct Arm {
    origins: [Vec3; 6],
    /// What is added to the joints that the controller asks for, rad.
    zeros: [f64; 6],
}

impl Arm {
    fn nominal() -> Arm {
        let origins = [
            [0.0, 0.0, 181.5],
            [0.0, 0.0, 163.5],
            [0.0, 0.0, 305.0],
            [-10.0, 0.0, 164.5],
            [0.0, 0.0, 135.5],
            [0.0, 0.0, 70.0],
        ];
        Arm { origins: origins.map(Vec3::from), zeros: [0.0; 6] }
    }
    /// Links off by up to `mm`, zeros by up to `deg`.
    fn off(mm: f64, deg: f64, rng: &mut Pcg64) -> Arm {
        let mut arm = Arm::nominal();
        for k in 0..6 {
            arm.origins[k] += Vec3::new(0.0, 0.0, 0.0).map(|_: f64| rng.random_range(-mm..=mm));
            arm.zeros[k] = rng.random_range(-deg..=deg).to_radians();
        }
        arm
    }
    fn flange(&self, joints: &[f64; 6]) -> Rigid<Base, Flange> {
        const AXES: [[f64; 3]; 6] =
            [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut t = Rigid::<Base, Base>::identity();
        for k in 0..6 {
            t = t * Rigid::new(exp(&(Vec3::from(AXES[k]) * (joints[k] + self.zeros[k]))), Vec3::zeros())
                .shifted(self.origins[k]);
        }
        Rigid::new(t.rotation, t.translation)
    }
    /// Joints for a pose, by Newton's steps with numerical derivatives; `None` where there is no way.
    fn joints(&self, pose: &Rigid<Base, Flange>) -> Option<[f64; 6]> {
        let off = |q: &[f64; 6]| {
            let p = self.flange(q);
            let (d, w) = (pose.translation - p.translation, log(&(pose.rotation * p.rotation.transpose())) * 300.0);
            nalgebra::Vector6::new(d.x, d.y, d.z, w.x, w.y, w.z)
        };
        'starts: for start in 0..8 {
            let turn = f64::from(start) * std::f64::consts::FRAC_PI_4;
            let mut q = [(pose.translation.y).atan2(pose.translation.x), 0.2, 1.5, 0.0, 1.3, turn];
            for _ in 0..60 {
                let e = off(&q);
                if e.norm() < 1e-9 {
                    return Some(q);
                }
                let mut j = nalgebra::Matrix6::zeros();
                for k in 0..6 {
                    let mut moved = q;
                    moved[k] += 1e-6;
                    j.set_column(k, &((off(&moved) - e) / -1e-6));
                }
                let Some(step) =
                    (j.transpose() * j + nalgebra::Matrix6::identity() * 1e-3).lu().solve(&(j.transpose() * e))
                else {
                    continue 'starts;
                };
                let shorter = (0.4 / step.amax()).min(1.0);
                (0..6).for_each(|k| q[k] += step[k] * shorter);
            }
        }
        None
    }
}

trait Shifted {
    fn shifted(self, by: Vec3) -> Self;
}
impl Shifted for Rigid<Base, Base> {
    /// The joint's frame: first its origin, then its turn.
    fn shifted(self, by: Vec3) -> Self {
        Rigid::new(self.rotation, by)
    }
}

/// What the camera sees of the board, and where the controller says the flange is, when it is sent to see the board so.
fn sent(cell: &Cell, arm: &Arm, view: &Rigid<Camera, Board>) -> Option<(Rigid<Camera, Board>, Rigid<Base, Flange>)> {
    let asked = cell.robot(view);
    let truly = arm.flange(&Arm::nominal().joints(&asked)?);
    Some(((truly * cell.station.flange_from_camera).inverse() * cell.base_from_board, asked))
}

/// Points of new poses, relative to the board as everybody finds it: what a part found and gripped by the same arm is
/// off by.
fn points_off(cell: &Cell, arm: &Arm, fit: &JointFit) -> f64 {
    let truth = cell.truth(&[]);
    let lit = places(&truth, cell.working());
    let w = fit.state.far_from_board[0];
    let found: Rigid<Base, Board> = Rigid::new(w.rotation, w.translation);
    let mut off = Vec::new();
    for view in cell.views(25, 35.0, "excluded") {
        let Some((seen, asked)) = sent(cell, arm, &view) else { continue };
        for pixel in lit.iter().step_by(7) {
            let (Some(p), Some(q)) = (scanned(&fit.state, pixel), scanned(&truth, pixel)) else { continue };
            let truly = seen.inverse().point(&cell.station.flange_from_camera.inverse().point(&q));
            off.push((found.inverse().point(&asked.point(&p)) - truly).norm());
        }
    }
    assert!(off.len() > 100);
    rms(off.into_iter())
}

#[test]
fn an_arm_that_errs_by_its_own_shape_is_named_as_what_limits() {
    let found: Vec<(f64, bool, bool)> = seeds(2)
        .into_par_iter()
        .map(|seed| {
            let cell = Cell::new(&rig("paper"), seed);
            let run = |arm: &Arm| -> JointFit {
                let mut rng = Pcg64::seed_from_u64(seed + 70);
                let exact = Levels { robot_mm: 0.0, robot_deg: 0.0, ..QUIET };
                let stops = cell
                    .views(64, 40.0, "arm")
                    .iter()
                    .enumerate()
                    .filter_map(|(i, view)| {
                        let (seen, asked) = sent(&cell, arm, view)?;
                        let mut shot: Shot = cell.shot(i, &seen, &exact, &mut rng);
                        let noisy = sheetlight::simulate::reported(&asked, QUIET.robot_mm, QUIET.robot_deg, &mut rng);
                        shot.robot.as_mut().unwrap().pose = noisy;
                        Some(shot)
                    })
                    .take(40)
                    .collect::<Vec<_>>();
                assert!(stops.len() > 30, "{} poses are within reach", stops.len());
                calibrate(&cell, &stops, &JointOptions::default()).unwrap()
            };
            let o = JointOptions::default();
            let arm = Arm::off(0.1, 0.01, &mut Pcg64::seed_from_u64(seed + 9));
            let (straight, bent) = (run(&Arm::nominal()), run(&arm));
            let [a, b] = [&straight, &bent].map(|f| systematic(f, &o).unwrap());
            let off = points_off(&cell, &arm, &bent);
            println!(
                "station {seed}: points off {off:.4} mm; the arm {:.4} mm {:.4} degrees, predicts {:.2} of a pose \
                 left out (by chance {:.2}); \
                 without the error {:.4} mm {:.4} degrees, {:.2} ({:.2}), points off {:.4}",
                bent.noise.robot_mm,
                bent.noise.robot_rad.to_degrees(),
                b.predicted,
                b.by_chance,
                straight.noise.robot_mm,
                straight.noise.robot_rad.to_degrees(),
                a.predicted,
                a.by_chance,
                points_off(&cell, &Arm::nominal(), &straight)
            );
            (off, b.found(), a.found())
        })
        .collect();
    let off = rms(found.iter().map(|f| f.0));
    println!("points off {off:.4} mm rms with an arm that is off by up to 0.1 mm and 0.01 degrees");
    assert!(off <= 0.10, "{found:?}");
    assert!(found.iter().all(|f| f.1), "{found:?}");
    assert!(found.iter().filter(|f| f.2).count() * 10 <= found.len(), "noise taken for the arm's shape: {found:?}");
}
