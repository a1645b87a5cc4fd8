//! In: a rig's levers on a part seen from several sides, errors drawn at random or chosen. Out: whether the agreed
//! pose, its sigma, the gates and the statements about hidden errors hold.
//! Frame and unit: base frame; mm, rad.

use super::*;
use crate::find::insert::budget::Budget;
use crate::find::look::part_seen::{PartSeen, travelled};
use crate::find::look::size_check::SizeCheck;
use crate::find::measure::shape::Shape;
use crate::geometry::{Camera, Flange, Plane};
use crate::rig::{Calibration, Covariance, Kind, Quality, Rig, Verdict};
use nalgebra::{DMatrix, DVector, Matrix3};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;

const HAND_EYE_SIGMA: [f64; 6] = [0.05, 0.05, 0.05, 2e-4, 2e-4, 2e-4];
const PLANE_SIGMA: [f64; 4] = [1e-4, 1e-4, 1e-4, 0.01];
const RATIO: f64 = 3.0;

struct Setup {
    part: Rigid<Base, Part>,
    looks: Vec<Budget>,
    hand_eye: Rigid<Flange, Camera>,
}

/// A part below the robot, and cameras that pass over it, each turned and tilted relative to the first.
fn setup(sides: &[(f64, f64)]) -> Setup {
    let part = Rigid::from_vectors(&Vec3::new(0.1, -0.2, 0.7), Vec3::new(350.0, 40.0, 12.0));
    let first: Rigid<Part, Camera> =
        Rigid::from_vectors(&Vec3::new(std::f64::consts::PI, 0.0, 0.0), Vec3::new(5.0, -8.0, 150.0));
    let hand_eye = Rigid::from_vectors(&Vec3::new(0.02, 0.01, -1.6), Vec3::new(-46.0, 1.4, 93.6));
    let plane = Plane::<Camera>::new(Vec3::new(0.0, 0.8, 0.6), 90.0).unwrap();
    let rig = rig(plane, hand_eye);
    // The laser sheet meets the part's plane at y = -8 of the first camera's position.
    let stood: Vec<(u32, Rigid<Base, Camera>)> = (0..11u32)
        .map(|k| {
            (2 * k, part * Rigid::<Part, Part>::new(Mat3::identity(), Vec3::y() * (f64::from(k) * 2.0 - 2.0)) * first)
        })
        .collect();
    let places: Vec<(usize, Vec3)> =
        (0..11).flat_map(|k| (-7..=7).map(move |x| (k, Vec3::new(2.0 * f64::from(x) - 5.0, 0.0, 150.0)))).collect();
    let sides_of = |half: [f64; 2]| {
        (-5..=5).flat_map(move |i| {
            let t = f64::from(i) / 5.0;
            let (x, y) = (half[0], half[1]);
            [[x, t * y, 1.0, 0.0], [-x, t * y, -1.0, 0.0], [t * x, y, 0.0, 1.0], [t * x, -y, 0.0, -1.0]]
        })
    };
    let seen = PartSeen::of(part, travelled(&stood, &stood[0].1, &places), sides_of([15.0, 9.0]).collect()).unwrap();
    let looks = sides
        .iter()
        .map(|&(turn, tilt)| {
            let seen = seen.moved(&other_side(&part, turn, tilt));
            let own = Matrix6::from_diagonal(&Vector6::new(1e-4, 1e-4, 1e-4, 1e-8, 1e-8, 1e-8));
            Budget {
                levers: seen.levers(&rig).unwrap(),
                base_from_camera: Some(seen.base_from_camera()),
                seen: Some(seen),
                ..Budget::of_look(own)
            }
        })
        .collect();
    Setup { part, looks, hand_eye }
}

fn rig(plane: Plane<Camera>, hand_eye: Rigid<Flange, Camera>) -> Rig {
    let quality = Quality {
        verdict: Verdict::Good,
        reasons: vec![],
        advice: vec![],
        figures: Default::default(),
        per_picture: vec![],
    };
    let of = |kind: crate::rig::Kind, s: &[f64]| {
        Covariance::new(
            kind.parameters().0,
            &DMatrix::from_diagonal(&DVector::from_iterator(s.len(), s.iter().map(|x| x * x))),
        )
    };
    Rig {
        laser_plane: Some(Calibration::new(
            Kind::LaserPlane,
            plane,
            None,
            of(Kind::LaserPlane, &PLANE_SIGMA),
            quality.clone(),
        )),
        hand_eye: Some(Calibration::new(Kind::HandEye, hand_eye, None, of(Kind::HandEye, &HAND_EYE_SIGMA), quality)),
        ..Rig::default()
    }
}

/// The pose at which each scan finds the part: moved by errors of the calibrations and by its own noise.
fn found(s: &Setup, errors: &[DVector<f64>], rng: &mut rand_pcg::Pcg64) -> Vec<Rigid<Base, Part>> {
    s.looks
        .iter()
        .map(|b| {
            let mut m: Vector6 = Vector6::zeros();
            for (lever, e) in b.levers.iter().zip(errors) {
                m += Vector6::from_iterator((&lever.jacobian * e).iter().copied());
            }
            let own = Vector6::from_fn(|k, _| b.own[(k, k)].sqrt() * rng.sample::<f64, _>(StandardNormal));
            m += both(&s.part.rotation) * own;
            Rigid::new(
                exp(&Vec3::new(m[3], m[4], m[5])) * s.part.rotation,
                s.part.translation + Vec3::new(m[0], m[1], m[2]),
            )
        })
        .collect()
}

fn agreed(s: &Setup, poses: &[Rigid<Base, Part>]) -> Agreed {
    let looks: Vec<Look> =
        poses.iter().zip(&s.looks).map(|(&base_from_part, budget)| Look { base_from_part, budget }).collect();
    agree(&looks, None, 0.0015, RATIO).unwrap()
}

#[test]
fn errors_as_stated_pass_and_the_pose_is_as_good_as_it_says() {
    let s = setup(&[(0.0, 0.0), (180.0, 20.0)]);
    let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
    let (mut squares, mut passed) = ([0f64; 6], 0);
    let trials = 600;
    for _ in 0..trials {
        let errors: Vec<DVector<f64>> = s.looks[0]
            .levers
            .iter()
            .map(|l| {
                let c = l.covariance.as_ref().unwrap();
                if l.supposed {
                    return DVector::zeros(c.nrows());
                }
                DVector::from_fn(c.nrows(), |k, _| c[(k, k)].sqrt() * rng.sample::<f64, _>(StandardNormal))
            })
            .collect();
        let a = agreed(&s, &found(&s, &errors, &mut rng));
        let d = both(&s.part.rotation.transpose()) * motion(&s.part, &a.base_from_part);
        for k in 0..6 {
            squares[k] += d[k].powi(2) / a.covariance[(k, k)];
        }
        passed += usize::from(a.disagreement.ratio <= 3.0);
    }
    for (k, sum) in squares.iter().enumerate() {
        let honest = (sum / f64::from(trials)).sqrt();
        assert!((0.9..1.1).contains(&honest), "axis {k}: error over stated sigma {honest}");
    }
    assert!(passed >= trials as usize * 98 / 100, "{passed} of {trials} right ones pass");
}

#[test]
fn a_turn_and_a_tilt_show_an_error_that_looks_from_one_side_hide() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(7);
    // Along the stripe: an error along the sweep would look like a delay.
    let wrong = vec![DVector::zeros(4), DVector::from_vec(vec![0.0, 1.5, 0.0, 0.0, 0.0, 0.0])];
    let same = setup(&[(0.0, 0.0), (0.0, 0.0)]);
    let hidden = agreed(&same, &found(&same, &wrong, &mut rng)).disagreement;
    assert!(hidden.ratio < 4.0 && hidden.turn_deg < 0.1 && hidden.tilt_deg < 0.1, "{hidden:?}");
    assert!(hidden.gates(&led()).iter().any(|g| !g.passed && g.name.contains("turn_deg")));
    let turned = setup(&[(0.0, 0.0), (180.0, 20.0)]);
    let shown = agreed(&turned, &found(&turned, &wrong, &mut rng)).disagreement;
    assert!(shown.ratio > 10.0, "{shown:?}");
    assert_eq!(shown.explained_by[0].name, "hand-eye", "{:?}", shown.explained_by);
    assert!((shown.turn_deg - 180.0).abs() < 0.1 && (shown.tilt_deg - 20.0).abs() < 0.1, "{shown:?}");
    // For an error along the approach, a turn alone shows nothing.
    let along = turned.hand_eye.rotation * turned.looks[0].base_from_camera.unwrap().rotation.transpose();
    let along = along * turned.part.rotation * Vec3::z();
    let wrong = vec![DVector::zeros(4), DVector::from_vec(vec![along.x, along.y, along.z, 0.0, 0.0, 0.0])];
    let only_turned = setup(&[(0.0, 0.0), (180.0, 0.0)]);
    assert!(agreed(&only_turned, &found(&only_turned, &wrong, &mut rng)).disagreement.ratio < 4.0);
    assert!(agreed(&turned, &found(&turned, &wrong, &mut rng)).disagreement.ratio > 3.0);
}

/// Two scans cannot show a hand-eye error along the axis of the turn between them; a third scan about another axis can.
#[test]
fn a_third_look_shows_what_two_leave_open() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(9);
    let right = vec![DVector::zeros(4), DVector::zeros(6)];
    let mut hides = |sides: &[(f64, f64)]| {
        let s = setup(sides);
        let looks = agreed(&s, &found(&s, &right, &mut rng)).disagreement;
        println!("{:?}", looks.explained_by);
        let by_hand_eye = looks.explained_by.iter().find(|e| e.name == "hand-eye").unwrap();
        (by_hand_eye.unseen_mm[2], looks.unseen_height_mm)
    };
    let (two, three) = (hides(&[(0.0, 0.0), (180.0, 20.0)]), hides(&[(0.0, 0.0), (180.0, 20.0), (90.0, -25.0)]));
    println!("{two:?} {three:?}");
    assert!(two.0 > 1.5 * three.0 && two.1 > 1.5 * three.1, "{two:?} and {three:?} mm");
}

fn led() -> crate::find::insert::recipe::Recipe {
    crate::find::insert::recipe::Recipe::parse(include_str!("../../../data/recipes/led.toml")).unwrap()
}

/// An error of 0.3 mm in the laser plane's offset lifts the part and shows little between two scans. The part's sizes
/// along the stripe show it, because the plane lengthens them and the robot's steps do not. A height that something
/// else measured shows it too.
#[test]
fn sizes_and_a_witness_of_the_height_show_what_two_looks_hide() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
    let mut s = setup(&[(0.0, 0.0), (180.0, 15.0)]);
    let wrong = vec![DVector::from_vec(vec![0.0, 0.0, 0.0, -0.3]), DVector::zeros(6)];
    let poses = found(&s, &wrong, &mut rng);
    let alone = agreed(&s, &poses).disagreement;
    let witness = Witness {
        values: DVector::from_element(3, (s.part.rotation.transpose() * (s.part.translation - poses[0].translation)).z),
        own: DMatrix::identity(3, 3) * 4e-4,
        by_pose: DMatrix::from_fn(3, 6, |_, k| if k < 3 { s.part.rotation[(k, 2)] } else { 0.0 }),
        levers: vec![],
    };
    let looks: Vec<Look> =
        poses.iter().zip(&s.looks).map(|(&base_from_part, budget)| Look { base_from_part, budget }).collect();
    let seen = agree(&looks, Some(&witness), 0.0015, RATIO).unwrap().disagreement;
    println!("alone {:.2} {:.2}, witness {:?}", alone.ratio, alone.misfit_sigmas, seen.witness);
    assert!(seen.witness.unwrap().ratio > 5.0, "{:?}", seen.witness);
    let of_plane = |d: &Disagreement| d.explained_by.iter().find(|e| e.name == "laser plane").unwrap().unseen_mm[2];
    assert!(of_plane(&alone) > 0.5, "two looks alone would not miss it: {}", of_plane(&alone));
    assert!(of_plane(&seen) < 0.4 * of_plane(&alone), "{} {}", of_plane(&seen), of_plane(&alone));
    for b in &mut s.looks {
        let plane = b.levers.iter().find(|l| l.name == "laser plane").unwrap();
        let strain = plane.jacobian.rows(6, 3) * &wrong[0];
        let covariance = Matrix3::identity() * 3e-4f64.powi(2);
        b.shape = Some(Shape { strain: nalgebra::Vector3::new(strain[0], strain[1], strain[2]), covariance });
    }
    let sized = agreed(&s, &poses).disagreement;
    println!("sized {:.2}, {:?}", sized.misfit_sigmas, sized.explained_by[0]);
    assert!(of_plane(&sized) < 0.8 * of_plane(&alone), "{} {}", of_plane(&sized), of_plane(&alone));
    let look = &s.looks[0];
    let axes = look.seen.as_ref().unwrap().scan_axes();
    let check = SizeCheck::new(&look.shape.unwrap(), &look.levers, &axes, 0.0015);
    println!("{check:?}");
    assert!(check.ratio > 3.0 && sized.misfit_sigmas > alone.misfit_sigmas, "{check:?} {}", sized.misfit_sigmas);
    let plane = sized.explained_by.iter().find(|e| e.name == "laser plane").unwrap();
    // Offset and tilt cannot be separated where the plane's covariance has no pivot.
    assert!(plane.share > 0.7, "{plane:?}");
}

#[test]
fn one_look_cannot_be_compared() {
    let s = setup(&[(0.0, 0.0)]);
    assert!(agree(&[Look { base_from_part: s.part, budget: &s.looks[0] }], None, 0.0015, RATIO).is_err());
}
