//! In: the same part found from several sides, each look with its own uncertainty and the levers of the calibrations that all
//! looks share. Out: one pose from all, what the looks disagree about beside what they may, and which calibration would
//! explain it. Frame and unit: base frame; differences along the part's axes, mm and degrees. docs/math.md, Second look.

use super::budget::Budget;
use super::gate::Gate;
use super::recipe::Gates;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Camera, Mat3, Part, Rigid, Vec3, exp, log};
use nalgebra::{DMatrix, DVector, Matrix6, SVector};

type Vector6 = SVector<f64, 6>;

/// One look at the part.
#[derive(Clone, Copy)]
pub struct Look<'a> {
    pub base_from_part: Rigid<Base, Part>,
    pub budget: &'a Budget,
}

/// How much of the disagreement one calibration would explain, if it were free to be wrong, and what it could hide.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Explanation {
    pub name: &'static str,
    /// Share of the squared disagreement that goes away, 0 to 1.
    pub share: f64,
    /// By how much it would have to be wrong, in its own sigmas (root mean square over its parameters).
    pub off_by_sigmas: f64,
    /// Three standard deviations of the agreed pose if this calibration is not believed at all and the others are: how far off
    /// it can make the pose without the looks showing it. Along the part's axes.
    pub unseen_mm: [f64; 3],
    pub unseen_deg: [f64; 3],
}

/// What the looks disagree about.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Disagreement {
    pub looks: usize,
    /// The two looks that disagree most, counted from 1.
    pub between: [usize; 2],
    /// Second less first, along the part's axes, and what all covariances make expect (one standard deviation).
    pub difference_mm: [f64; 3],
    pub difference_deg: [f64; 3],
    pub expected_mm: [f64; 3],
    pub expected_deg: [f64; 3],
    /// The largest of the six differences over its expected value.
    pub ratio: f64,
    /// Largest turn about the part's normal and largest tilt against it between two looks, degrees; 0 where the stations are
    /// not known.
    pub turn_deg: f64,
    pub tilt_deg: f64,
    /// Which calibration explains it best comes first; empty where none has a covariance.
    pub explained_by: Vec<Explanation>,
    /// A calibration without covariance takes part: more disagreement than expected may be its share.
    pub complete: bool,
}

/// What several looks say together.
#[derive(Clone, Debug)]
pub struct Agreed {
    pub base_from_part: Rigid<Base, Part>,
    /// Over x y z rx ry rz about the part's own axes.
    pub covariance: Matrix6<f64>,
    pub disagreement: Disagreement,
}

impl Disagreement {
    /// The gates that several looks have to pass.
    pub fn gates(&self, g: &Gates) -> Vec<Gate> {
        vec![
            Gate::most("looks' ratio", self.ratio, g.max_look_ratio),
            Gate::least("looks' turn_deg", self.turn_deg, g.min_look_turn_deg),
            Gate::least("looks' tilt_deg", self.tilt_deg, g.min_look_tilt_deg),
        ]
    }
}

/// What was measured, stacked look by look: motions against the first look (base axes), and their joint covariance.
struct Stack {
    motions: DVector<f64>,
    covariance: DMatrix<f64>,
}

/// Motion from the first look's pose to another's: shift of the part's origin, then turn; base axes.
fn motion(from: &Rigid<Base, Part>, to: &Rigid<Base, Part>) -> Vector6 {
    let turn = log(&(to.rotation * from.rotation.transpose()));
    let shift = to.translation - from.translation;
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// Both blocks of a covariance or motion turned: base axes from part axes.
fn both(r: &Mat3) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(r);
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(r);
    out
}

/// One calibration's lever over all looks, 6 N x n; `None` where a look lacks it.
fn stacked_lever(looks: &[Look], name: &str) -> Option<(DMatrix<f64>, Option<DMatrix<f64>>)> {
    let all: Vec<_> =
        looks.iter().map(|l| l.budget.levers.iter().find(|v| v.name == name)).collect::<Option<Vec<_>>>()?;
    let n = all[0].jacobian.ncols();
    let mut out = DMatrix::zeros(6 * looks.len(), n);
    for (i, lever) in all.iter().enumerate() {
        out.view_mut((6 * i, 0), (6, n)).copy_from(&lever.jacobian);
    }
    Some((out, all[0].covariance.clone()))
}

fn names(looks: &[Look]) -> Vec<&'static str> {
    looks[0].budget.levers.iter().map(|l| l.name).collect()
}

impl Stack {
    /// `free`: a calibration whose uncertainty is taken a thousand times as large, which lets it explain what it can.
    fn new(looks: &[Look], free: Option<&str>) -> Stack {
        let n = 6 * looks.len();
        let mut motions = DVector::zeros(n);
        let mut covariance = DMatrix::zeros(n, n);
        for (i, look) in looks.iter().enumerate() {
            motions.rows_mut(6 * i, 6).copy_from(&motion(&looks[0].base_from_part, &look.base_from_part));
            let turn = both(&look.base_from_part.rotation);
            covariance.view_mut((6 * i, 6 * i), (6, 6)).copy_from(&(turn * look.budget.own * turn.transpose()));
        }
        for name in names(looks) {
            if let Some((lever, Some(c))) = stacked_lever(looks, name) {
                let more = if free == Some(name) { 1e6 } else { 1.0 };
                covariance += &lever * (c * more) * lever.transpose();
            }
        }
        Stack { motions, covariance }
    }

    /// The motion of least variance that all looks share, and its covariance.
    fn agreed(&self) -> Result<(Vector6, Matrix6<f64>)> {
        let weights = self.covariance.clone().cholesky().ok_or_else(singular)?;
        let mut each = DMatrix::zeros(self.motions.len(), 6);
        for i in 0..self.motions.len() / 6 {
            each.view_mut((6 * i, 0), (6, 6)).fill_with_identity();
        }
        let covariance = (each.transpose() * weights.solve(&each)).cholesky().ok_or_else(singular)?.inverse();
        let step = &covariance * each.transpose() * weights.solve(&self.motions);
        Ok((Vector6::from_iterator(step.iter().copied()), Matrix6::from_iterator(covariance.iter().copied())))
    }

    /// Motions and covariance of the looks' differences from the first look.
    fn differences(&self) -> (DVector<f64>, DMatrix<f64>) {
        let n = self.motions.len() - 6;
        let mut d = DMatrix::zeros(n, n + 6);
        d.view_mut((0, 6), (n, n)).fill_with_identity();
        for i in 0..n / 6 {
            d.view_mut((6 * i, 0), (6, 6)).copy_from(&-DMatrix::identity(6, 6));
        }
        (&d * &self.motions, &d * &self.covariance * d.transpose())
    }
}

fn singular() -> Fault {
    Fault::refused("the looks' covariances cannot be combined: a standard deviation is zero")
        .cause("a calibration or recipe whose uncertainty is stated as nothing")
        .next("calibrate with uncertainty, or give the recipe's robot its repeatability")
}

/// Brings two or more looks together. The pose is the one of least variance under the joint covariance, in which what the
/// calibrations got wrong is one error seen from several sides (generalised least squares; docs/math.md, Second look).
/// Errors: fewer than two looks, or covariances that cannot be inverted.
pub fn agree(looks: &[Look]) -> Result<Agreed> {
    if looks.len() < 2 {
        return Err(Fault::usage(format!("{} look given, two or more can be compared", looks.len()))
            .next("name the second scan's folder behind the first"));
    }
    let stack = Stack::new(looks, None);
    let (step, covariance) = stack.agreed()?;
    let first = looks[0].base_from_part;
    let base_from_part = Rigid::new(
        exp(&Vec3::new(step[3], step[4], step[5])) * first.rotation,
        first.translation + Vec3::new(step[0], step[1], step[2]),
    );
    let into_part = both(&base_from_part.rotation.transpose());
    let covariance = into_part * covariance * into_part.transpose();
    Ok(Agreed { base_from_part, covariance, disagreement: disagreement(looks, &stack, &into_part)? })
}

fn disagreement(looks: &[Look], stack: &Stack, into_part: &Matrix6<f64>) -> Result<Disagreement> {
    let mut worst: Option<([usize; 2], Vector6, Vector6, f64)> = None;
    for i in 0..looks.len() {
        for j in i + 1..looks.len() {
            let block = |a: usize, b: usize| stack.covariance.view((6 * a, 6 * b), (6, 6)).clone_owned();
            let c = block(j, j) + block(i, i) - block(i, j) - block(j, i);
            let c = into_part * Matrix6::from_iterator(c.iter().copied()) * into_part.transpose();
            let d = into_part * motion(&looks[i].base_from_part, &looks[j].base_from_part);
            let expected = c.diagonal().map(|v| v.max(0.0).sqrt());
            let ratio = (0..6).map(|k| d[k].abs() / expected[k].max(1e-12)).fold(0.0, f64::max);
            if worst.as_ref().is_none_or(|w| ratio > w.3) {
                worst = Some(([i + 1, j + 1], d, expected, ratio));
            }
        }
    }
    let (between, d, expected, ratio) = worst.expect("two looks at least");
    let mm = |v: &Vector6| [v[0], v[1], v[2]];
    let deg = |v: &Vector6| [v[3], v[4], v[5]].map(f64::to_degrees);
    let (turn_deg, tilt_deg) = sides(looks);
    Ok(Disagreement {
        looks: looks.len(),
        between,
        difference_mm: mm(&d),
        difference_deg: deg(&d),
        expected_mm: mm(&expected),
        expected_deg: deg(&expected),
        ratio,
        turn_deg,
        tilt_deg,
        explained_by: explanations(looks, stack, into_part)?,
        complete: looks.iter().all(|l| l.budget.complete),
    })
}

/// For each calibration: the disagreement that is left when it may be wrong by anything, against that of all as stated.
fn explanations(looks: &[Look], stack: &Stack, into_part: &Matrix6<f64>) -> Result<Vec<Explanation>> {
    let (d, c) = stack.differences();
    let all = d.dot(&c.cholesky().ok_or_else(singular)?.solve(&d));
    let mut out = Vec::new();
    for name in names(looks) {
        let Some((lever, Some(own))) = stacked_lever(looks, name) else { continue };
        let freed = Stack::new(looks, Some(name));
        let (d, c) = freed.differences();
        let whitened = c.cholesky().ok_or_else(singular)?.solve(&d);
        let left = d.dot(&whitened);
        // The error that the freed calibration takes on: C Lᵀ S⁻¹ d, in units of its own sigmas.
        let n = lever.nrows() - 6;
        let mut shown = DMatrix::zeros(n, lever.ncols());
        for i in 0..n / 6 {
            let step = lever.rows(6 * (i + 1), 6) - lever.rows(0, 6);
            shown.rows_mut(6 * i, 6).copy_from(&step);
        }
        let error = (&own * 1e6) * shown.transpose() * whitened;
        let sigmas: f64 =
            (0..error.len()).filter(|&k| own[(k, k)] > 0.0).map(|k| error[k].powi(2) / own[(k, k)]).sum::<f64>();
        let unseen = into_part * freed.agreed()?.1 * into_part.transpose();
        let unseen = unseen.diagonal().map(|v| 3.0 * v.max(0.0).sqrt());
        out.push(Explanation {
            name,
            unseen_mm: [unseen[0], unseen[1], unseen[2]],
            unseen_deg: [unseen[3], unseen[4], unseen[5]].map(f64::to_degrees),
            share: if all > 0.0 { (1.0 - left / all).clamp(0.0, 1.0) } else { 0.0 },
            off_by_sigmas: (sigmas / error.len() as f64).sqrt(),
        });
    }
    out.sort_by(|a, b| b.share.total_cmp(&a.share));
    Ok(out)
}

/// Largest turn about the part's normal and largest tilt against it between two looks, degrees.
fn sides(looks: &[Look]) -> (f64, f64) {
    let views: Vec<Mat3> = looks
        .iter()
        .filter_map(|l| Some(l.base_from_part.rotation.transpose() * l.budget.base_from_camera?.rotation))
        .collect();
    let mut most = (0f64, 0f64);
    for (i, a) in views.iter().enumerate() {
        for b in &views[i + 1..] {
            let (turn, tilt) = turn_and_tilt(&(b * a.transpose()));
            most = (most.0.max(turn), most.1.max(tilt));
        }
    }
    most
}

/// A rotation in the part's axes as a turn about z and a tilt of z, degrees.
pub(in crate::find) fn turn_and_tilt(r: &Mat3) -> (f64, f64) {
    let q = nalgebra::UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(*r));
    let turn = 2.0 * q.k.abs().atan2(q.w.abs());
    (turn.to_degrees(), r[(2, 2)].clamp(-1.0, 1.0).acos().to_degrees())
}

/// The camera's motion that turns a look about the part's normal and tilts it about the part's x: base from base.
pub fn other_side(base_from_part: &Rigid<Base, Part>, turn_deg: f64, tilt_deg: f64) -> Rigid<Base, Base> {
    let turn = exp(&(Vec3::z() * turn_deg.to_radians()));
    let tilt = exp(&(Vec3::x() * tilt_deg.to_radians()));
    let part: Rigid<Part, Part> = Rigid::new(tilt * turn, Vec3::zeros());
    *base_from_part * part * base_from_part.inverse()
}

/// A camera that looks from another side.
pub(in crate::find) fn seen_from(
    base_from_camera: &Rigid<Base, Camera>,
    base_from_part: &Rigid<Base, Part>,
    turn_deg: f64,
    tilt_deg: f64,
) -> Rigid<Base, Camera> {
    other_side(base_from_part, turn_deg, tilt_deg) * *base_from_camera
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::find::insert::budget::{Lever, hand_eye_lever, plane_lever};
    use crate::geometry::{Flange, Plane};
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;

    const HAND_EYE_SIGMA: [f64; 6] = [0.05, 0.05, 0.05, 2e-4, 2e-4, 2e-4];

    struct Setup {
        part: Rigid<Base, Part>,
        looks: Vec<Budget>,
        hand_eye: Rigid<Flange, Camera>,
    }

    /// A part below the robot and cameras that look at it, each turned and tilted against the first.
    fn setup(sides: &[(f64, f64)]) -> Setup {
        let part = Rigid::from_vectors(&Vec3::new(0.1, -0.2, 0.7), Vec3::new(350.0, 40.0, 12.0));
        let first: Rigid<Part, Camera> =
            Rigid::from_vectors(&Vec3::new(std::f64::consts::PI, 0.0, 0.0), Vec3::new(5.0, -8.0, 150.0));
        let hand_eye = Rigid::from_vectors(&Vec3::new(0.02, 0.01, -1.6), Vec3::new(-46.0, 1.4, 93.6));
        let plane = Plane::<Camera>::new(Vec3::new(0.0, 0.8, 0.6), 90.0).unwrap();
        let looks = sides
            .iter()
            .map(|&(turn, tilt)| {
                let camera = seen_from(&(part * first), &part, turn, tilt);
                let target = camera.inverse().point(&part.translation);
                let diagonal =
                    |s: &[f64]| DMatrix::from_diagonal(&DVector::from_iterator(s.len(), s.iter().map(|x| x * x)));
                let levers = vec![
                    Lever {
                        covariance: Some(diagonal(&[1e-4, 1e-4, 1e-4, 0.01])),
                        ..plane_lever(&camera, &target, &plane)
                    },
                    Lever {
                        covariance: Some(diagonal(&HAND_EYE_SIGMA)),
                        ..hand_eye_lever(&camera, &target, &hand_eye)
                    },
                ];
                let own = Matrix6::from_diagonal(&Vector6::new(1e-4, 1e-4, 1e-4, 1e-8, 1e-8, 1e-8));
                Budget {
                    terms: Vec::new(),
                    sigma_mm: [0.0; 3],
                    sigma_deg: [0.0; 3],
                    complete: true,
                    covariance: own,
                    own,
                    levers,
                    base_from_camera: Some(camera),
                }
            })
            .collect();
        Setup { part, looks, hand_eye }
    }

    /// Where a look finds the part: moved by errors of the calibrations and by its own.
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
        agree(&looks).unwrap()
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
        let wrong = vec![DVector::zeros(4), DVector::from_vec(vec![1.5, 0.0, 0.0, 0.0, 0.0, 0.0])];
        let same = setup(&[(0.0, 0.0), (0.0, 0.0)]);
        let hidden = agreed(&same, &found(&same, &wrong, &mut rng)).disagreement;
        assert!(hidden.ratio < 4.0 && hidden.turn_deg < 0.1 && hidden.tilt_deg < 0.1, "{hidden:?}");
        assert!(hidden.gates(&Gates::default()).iter().any(|g| !g.passed));
        let turned = setup(&[(0.0, 0.0), (180.0, 20.0)]);
        let shown = agreed(&turned, &found(&turned, &wrong, &mut rng)).disagreement;
        assert!(shown.ratio > 10.0, "{shown:?}");
        assert_eq!(shown.explained_by[0].name, "hand-eye");
        assert!((shown.turn_deg - 180.0).abs() < 0.1 && (shown.tilt_deg - 20.0).abs() < 0.1, "{shown:?}");
        // Along the approach a turn alone shows nothing.
        let along = turned.hand_eye.rotation * turned.looks[0].base_from_camera.unwrap().rotation.transpose();
        let along = along * turned.part.rotation * Vec3::z();
        let wrong = vec![DVector::zeros(4), DVector::from_vec(vec![along.x, along.y, along.z, 0.0, 0.0, 0.0])];
        let only_turned = setup(&[(0.0, 0.0), (180.0, 0.0)]);
        assert!(agreed(&only_turned, &found(&only_turned, &wrong, &mut rng)).disagreement.ratio < 4.0);
        assert!(agreed(&turned, &found(&turned, &wrong, &mut rng)).disagreement.ratio > 3.0);
    }

    /// Two looks cannot show a hand-eye's error along the axis of the turn between them; a third one about another axis can.
    #[test]
    fn a_third_look_shows_what_two_leave_open() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(9);
        let right = vec![DVector::zeros(4), DVector::zeros(6)];
        let mut hides = |sides: &[(f64, f64)]| {
            let s = setup(sides);
            let looks = agreed(&s, &found(&s, &right, &mut rng)).disagreement;
            let by_hand_eye = looks.explained_by.iter().find(|e| e.name == "hand-eye").unwrap();
            by_hand_eye.unseen_mm.into_iter().fold(0.0, f64::max)
        };
        let (two, three) = (hides(&[(0.0, 0.0), (180.0, 20.0)]), hides(&[(0.0, 0.0), (180.0, 20.0), (90.0, -25.0)]));
        assert!(two > 10.0 && three < 1.0, "{two} and {three} mm");
    }

    #[test]
    fn one_look_cannot_be_compared() {
        let s = setup(&[(0.0, 0.0)]);
        assert!(agree(&[Look { base_from_part: s.part, budget: &s.looks[0] }]).is_err());
    }
}
