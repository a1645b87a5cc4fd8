//! In: a camera solved from a board as drawn. Out: the same with the board's shape estimated too, if held-out
//! pictures support it.
//! Frame and unit: board frame, mm; px. docs/math.md, Camera calibration (12), (13).

use super::held_out::{WORTH, held_out, surely_lower};
use crate::calibrate::boards::shape::Basis;
use crate::calibrate::camera::bundle::{Bent, State};
use crate::calibrate::camera::fit::Fit;
use crate::camera::PARAMETERS;
use crate::solve::Solution;

/// Fewer pictures can hardly be held out against each other; with six, the camera's error is up to 1.7 times the
/// stated one.
const MIN_PICTURES: usize = 8;
/// Usual size of a coefficient before the pictures determine it, as a share of half of the board's length. It exceeds
/// any real deviation of print and plate.
const FIRST: f64 = 0.01;
/// Lower limit of this share, below which a coefficient is effectively held at zero.
const LEAST: f64 = 1e-7;
/// Largest number of rounds in which sizes and coefficients settle, and the factor by which settled sizes may still
/// change.
const ROUNDS: usize = 8;
const SETTLED: f64 = 1.1;

/// Adds the board's shape if the pictures support it.
pub(in crate::calibrate::camera) fn by_shape(
    fit: &mut Fit<'_>,
    basis: Basis,
    solution: &mut Solution<State>,
    held: &[usize],
) {
    if fit.corners.len() < MIN_PICTURES {
        return;
    }
    let (mut bent, start) = bending(fit, basis, solution);
    let Some(first) = bent.rough(held, start) else { return };
    // By chance, as many squared residuals vanish as there are coefficients.
    let left = first.sigma0.powi(2) * first.freedom / (first.freedom - Basis::LEN as f64).max(1e-9);
    if !(left < (1.0 - WORTH) * solution.sigma0.powi(2)) {
        return;
    }
    let Some(shaped) = settled(&mut bent, first, held) else { return };
    let scores = |fit: &Fit<'_>, s: &Solution<State>| held_out(fit, s, held, solution.sigma0);
    if surely_lower(&scores(fit, solution), &scores(&bent, &shaped)) {
        (*fit, *solution) = (bent, shaped);
    }
}

/// Adds the board's shape regardless of the pictures' support, unless they do not determine it.
pub(in crate::calibrate::camera) fn shaped(
    fit: &mut Fit<'_>,
    basis: Basis,
    solution: &mut Solution<State>,
    held: &[usize],
) {
    let (mut bent, start) = bending(fit, basis, solution);
    let first = bent.rough(held, start);
    if let Some(shaped) = first.and_then(|first| settled(&mut bent, first, held)) {
        (*fit, *solution) = (bent, shaped);
    }
}

/// The same fit with a board of unknown shape.
fn bending<'a>(fit: &Fit<'a>, basis: Basis, solution: &Solution<State>) -> (Fit<'a>, State) {
    let bent = Fit { bent: Some(Bent { basis, usual: [FIRST * basis.size(); 2] }), ..*fit };
    (bent, State { shape: vec![0.0; Basis::LEN], ..solution.state.clone() })
}

/// Repeats the optimum with the sizes of the coefficients adapted to another lens.
pub(in crate::calibrate::camera) fn resized(fit: &mut Fit<'_>, solution: &mut Solution<State>, held: &[usize]) {
    if fit.bent.is_some()
        && let Some(again) = settled(fit, solution.clone(), held)
    {
        *solution = again;
    }
}

/// Alternates between the sizes given the coefficients and the coefficients given the sizes \[mackay92\]. `None` if
/// the pictures do not determine the camera.
fn settled(fit: &mut Fit<'_>, mut solution: Solution<State>, held: &[usize]) -> Option<Solution<State>> {
    for _ in 0..ROUNDS {
        let bent = fit.bent.as_mut()?;
        let before = bent.usual;
        bent.usual = sizes(bent, &solution)?;
        let still = before.iter().zip(bent.usual).all(|(a, b)| (a / b).max(b / a) < SETTLED);
        solution = fit.rough(held, solution.state)?;
        if still {
            break;
        }
    }
    fit.fine(held, solution.state).so_far()
}

/// Usual size of the coefficients in the plane and out of it: their squares divided by the number of coefficients
/// that the pictures determine.
fn sizes(bent: &Bent, solution: &Solution<State>) -> Option<[f64; 2]> {
    let covariance = solution.covariance.as_ref()?;
    let of = |lifts: bool| {
        let terms = (0..Basis::LEN).filter(|&i| Basis::lifts(i) == lifts);
        let (squares, determined) = terms.fold((0.0, 0.0), |(s, d): (f64, f64), i| {
            let left = covariance[(PARAMETERS + i, PARAMETERS + i)] * solution.sigma0.powi(2);
            (s + solution.state.shape[i].powi(2), d + (1.0 - left / bent.usual_of(i).powi(2)).max(0.0))
        });
        (squares / determined.max(1e-9)).sqrt().clamp(LEAST * bent.basis.size(), FIRST * bent.basis.size())
    };
    Some([of(false), of(true)])
}
