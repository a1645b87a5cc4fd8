//! In: a `Problem` (parameters on any manifold, residuals with Jacobians) and a start. Out: the
//! least-squares or robust optimum with covariance (docs/math.md, Least squares (1) to (5)).
//! Frame and unit: none; the caller's.

use super::loss::robust_scale;
use super::normal::{Blocks, Factor, Order, inverse};
use super::{Loss, Residuals};
use crate::fault::{Fault, Result};
use nalgebra::DMatrix;

/// A problem to minimise. A state may lie on any manifold (rotations included); a step is a vector of `width` numbers,
/// and Jacobians are derivatives by such a step at zero.
pub trait Problem {
    /// The estimated quantity.
    type State: Clone;
    /// Number of parameters of a step.
    fn width(&self) -> usize;
    /// The state after a step.
    fn moved(&self, state: &Self::State, step: &[f64]) -> Self::State;
    /// Hands over all residuals at `state`. `None` where the state is impossible (a point behind
    /// the camera): the step that led there is shortened.
    fn residuals(&self, state: &Self::State, out: &mut Residuals) -> Option<()>;
    /// Blocks of parameters that share no residual; they are solved block by block, with the same result.
    fn blocks(&self) -> Option<Blocks> {
        None
    }
}

/// Settings of [`lm`].
#[derive(Clone, Debug)]
pub struct LmOptions {
    /// Applied to each group of residuals.
    pub loss: Loss,
    /// True: the residuals' common sigma is unknown; it is estimated robustly, and the loss's threshold follows it.
    /// False: residuals are in units of their true sigma.
    pub estimate_scale: bool,
    /// Most steps in each round; 1..=1000.
    pub max_iterations: usize,
    /// Relative decrease of the cost at which the iteration stops; 1e-16..=1e-4.
    pub tolerance: f64,
    /// Parameters that keep their starting value; their covariance is zero.
    pub hold: Vec<usize>,
}

impl Default for LmOptions {
    fn default() -> Self {
        LmOptions {
            loss: Loss::Squares,
            estimate_scale: false,
            max_iterations: 100,
            tolerance: 1e-13,
            hold: Vec::new(),
        }
    }
}

impl LmOptions {
    /// Refuses values out of the ranges that the fields state.
    pub fn check(&self) -> Result<()> {
        let bad = |what: String| Err(Fault::usage(what).next("choose a value in that range"));
        if !(1..=1000).contains(&self.max_iterations) {
            return bad(format!("max_iterations is {}, 1 to 1000 are allowed", self.max_iterations));
        }
        if !(1e-16..=1e-4).contains(&self.tolerance) {
            return bad(format!("tolerance is {:e}, 1e-16 to 1e-4 are allowed", self.tolerance));
        }
        match self.loss {
            Loss::Huber(k) | Loss::Cauchy(k) if !(k > 0.0 && k.is_finite()) => {
                bad(format!("the loss threshold is {k}, a positive number of sigmas is needed"))
            }
            _ => Ok(()),
        }
    }
}

/// Whether the result is a minimum. The order is from good to bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum End {
    /// The cost falls by no more than the tolerance, or by less than its digits show.
    Minimum,
    /// The limit on steps was reached while the cost still fell.
    Exhausted,
    /// No step is possible, however short: every one leads to an impossible state.
    Stuck,
}

impl End {
    /// Remark for the user on a result that is no minimum.
    pub fn remark(self) -> Option<&'static str> {
        match self {
            End::Minimum => None,
            End::Exhausted => Some("the fit did not converge: the values' errors may exceed their sigmas"),
            End::Stuck => Some("the fit stopped before a minimum: its sigmas do not describe its errors"),
        }
    }
}

/// How a fit ended. A caller obtains the solution only by stating which ends it accepts.
#[derive(Clone, Debug)]
#[must_use]
pub enum Outcome<S> {
    /// A state, and whether it is a minimum.
    Found(Solution<S>, End),
    /// The start itself is impossible.
    BadStart,
}

impl<S> Outcome<S> {
    /// The solution with its end, which any report of the solution should state.
    pub fn ended(self) -> Option<(Solution<S>, End)> {
        match self {
            Outcome::Found(solution, end) => Some((solution, end)),
            Outcome::BadStart => None,
        }
    }
    /// The solution, if it is a minimum.
    pub fn minimum(self) -> Option<Solution<S>> {
        self.ended().filter(|(_, end)| *end == End::Minimum).map(|(solution, _)| solution)
    }
    /// The solution whatever its end: to start another fit, or to compare models.
    pub fn so_far(self) -> Option<Solution<S>> {
        self.ended().map(|(solution, _)| solution)
    }
}

/// Result of [`lm`].
#[derive(Clone, Debug)]
pub struct Solution<S> {
    /// The final state.
    pub state: S,
    /// Number of steps, all rounds together.
    pub iterations: usize,
    /// Root mean square of all measured residuals, unweighted, in the residuals' unit.
    pub rms: f64,
    /// Sigma of one residual: sqrt(sum w r² / (n - p)) robustly corrected; 1 when the residuals'
    /// sigmas were right.
    pub sigma0: f64,
    /// Degrees of freedom, residuals minus free parameters (priors counted as residuals).
    pub freedom: f64,
    /// Covariance of a step at the solution, for residuals whose sigma is 1; multiply with
    /// `sigma0²` where the residuals' sigma is unknown ([`Solution::scaled_covariance`]).
    /// `None` where the data does not determine every free parameter.
    pub covariance: Option<DMatrix<f64>>,
    /// Robust weight (0..=1) of each group, priors included, in the order they were handed over.
    pub weights: Vec<f64>,
    /// Length of each group's residual vector, same order.
    pub lengths: Vec<f64>,
    /// Reciprocal condition number of the normal equations with unit diagonal: below 1e-12 some
    /// combination of parameters is not determined.
    pub condition: f64,
}

impl<S> Solution<S> {
    /// Covariance scaled by the residuals' own sigma, estimated from the residuals.
    pub fn scaled_covariance(&self) -> Option<DMatrix<f64>> {
        self.covariance.as_ref().map(|c| c * (self.sigma0 * self.sigma0))
    }
}

/// Levenberg-Marquardt with Marquardt's scaling and Nielsen's damping [madsen04, alg. 3.16];
/// robust losses by iterated weights.
pub fn lm<P: Problem>(problem: &P, start: P::State, options: &LmOptions) -> Outcome<P::State> {
    // An unknown scale and the robust weights depend on each other: a few rounds make both converge.
    let rounds = if options.estimate_scale && options.loss != Loss::Squares { 4 } else { 1 };
    let (mut state, mut iterations, mut end) = (start, 0, End::Minimum);
    let mut scale = if rounds > 1 { scale_at(problem, &state) } else { 1.0 };
    for round in 0..rounds {
        let Some((next, n, how)) = minimise(problem, state, options, scale) else { return Outcome::BadStart };
        (state, end) = (next, how);
        iterations += n;
        if round + 1 < rounds {
            let next = scale_at(problem, &state);
            let settled = (next - scale).abs() < 1e-3 * scale;
            scale = next;
            if settled {
                break;
            }
        }
    }
    finish(problem, state, options, scale, iterations).map_or(Outcome::BadStart, |found| Outcome::Found(found, end))
}

fn scale_at<P: Problem>(problem: &P, state: &P::State) -> f64 {
    let mut r = Residuals::new(problem.width(), Loss::Squares, 1.0, false);
    let _ = problem.residuals(state, &mut r);
    let size = r.groups.iter().find(|g| !g.prior).map_or(1, |g| g.size);
    let mut lengths: Vec<f64> = r.groups.iter().filter(|g| !g.prior && g.size == size).map(|g| g.length).collect();
    robust_scale(&mut lengths, size).max(1e-12)
}

/// The final state, the number of steps and how it ended; `None` where the start is impossible.
fn minimise<P: Problem>(problem: &P, start: P::State, o: &LmOptions, scale: f64) -> Option<(P::State, usize, End)> {
    let n = problem.width();
    let order = Order::new(n, &o.hold, problem.blocks());
    let free = order.free();
    let evaluate = |state: &P::State, jacobian: bool| {
        let mut r = Residuals::new(n, o.loss, scale, jacobian);
        problem.residuals(state, &mut r)?;
        r.settle();
        r.cost.is_finite().then_some(r)
    };
    let mut state = start;
    let mut here = evaluate(&state, true)?;
    let (mut damping, mut growth) = (1e-4, 2.0);
    for iteration in 0..o.max_iterations {
        let (h, g) = (&here.hessian, &here.gradient);
        let floor = 1e-14 * free.iter().map(|&i| h[(i, i)]).fold(0.0, f64::max);
        let mut possible = false;
        let (next, gain, predicted) = loop {
            let extra = |i: usize| damping * h[(i, i)].max(floor);
            let factor = Factor::new(&order, |i, j| if i == j { h[(i, i)] + extra(i) } else { h[(i, j)] });
            let tried = factor.and_then(|f| {
                let full: Vec<f64> = f.solve(g).iter().map(|s| -s).collect();
                let next = problem.moved(&state, &full);
                let cost = evaluate(&next, false)?.cost;
                let predicted: f64 = free.iter().map(|&i| full[i] * (extra(i) * full[i] - g[i])).sum();
                Some((next, here.cost - cost, predicted))
            });
            possible |= tried.is_some();
            match tried {
                Some(t) if t.1 >= 0.0 => break t,
                // No improvement within the digits of the cost: this is the minimum.
                Some((_, _, predicted)) if predicted.abs() <= 1e-15 * here.cost => {
                    return Some((state, iteration, End::Minimum));
                }
                // Even the shortest steps that the digits resolve gain nothing, or all are impossible.
                _ if damping > 1e15 => {
                    return Some((state, iteration, if possible { End::Minimum } else { End::Stuck }));
                }
                _ => {
                    damping *= growth;
                    growth *= 2.0;
                }
            }
        };
        let ratio = gain / predicted.max(1e-300);
        damping = (damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-12);
        growth = 2.0;
        let done = gain <= o.tolerance * here.cost && predicted <= o.tolerance * here.cost.max(1e-300);
        state = next;
        here = evaluate(&state, true)?;
        if done || here.cost <= 1e-28 {
            return Some((state, iteration + 1, End::Minimum));
        }
    }
    Some((state, o.max_iterations, End::Exhausted))
}

fn finish<P: Problem>(
    problem: &P,
    state: P::State,
    o: &LmOptions,
    scale: f64,
    iterations: usize,
) -> Option<Solution<P::State>> {
    let n = problem.width();
    let order = Order::new(n, &o.hold, problem.blocks());
    let mut r = Residuals::new(n, o.loss, scale, true);
    problem.residuals(&state, &mut r)?;
    r.settle();
    let measured =
        |f: &dyn Fn(&super::system::Group) -> f64| -> f64 { r.groups.iter().filter(|g| !g.prior).map(f).sum() };
    let count = measured(&|g| g.size as f64);
    let all: f64 = r.groups.iter().map(|g| g.size as f64).sum();
    let rms = (measured(&|g| g.length * g.length) / count.max(1.0)).sqrt();
    let freedom = (all - order.free().len() as f64).max(0.0);
    // Huber's covariance of an M-estimate, corrected for the mean of the weights, so that rejected measurements carry
    // no information: docs/math.md, Least squares (5).
    let p = r.psi;
    let measured_freedom = (p.residuals * freedom / all.max(1.0)).max(1e-300);
    let (mean_slope, mean_weight) = (p.slope / p.residuals.max(1.0), p.weight / p.residuals.max(1.0));
    let variance = p.squared / measured_freedom * mean_weight / (mean_slope * mean_slope).max(1e-300);
    let sigma0 = if freedom > 0.0 { scale * variance.sqrt() } else { f64::NAN };
    // The hessian was built with residuals in units of `scale`.
    let (covariance, condition) = inverse(&order, &r.hessian);
    let covariance = covariance.map(|c| c / (scale * scale));
    Some(Solution {
        state,
        iterations,
        rms,
        sigma0,
        freedom,
        covariance,
        weights: r.groups.iter().map(|g| g.weight).collect(),
        lengths: r.groups.iter().map(|g| g.length).collect(),
        condition,
    })
}

/// Largest difference between a problem's gradient and central differences of its cost, relative
/// to the gradient's largest entry: for tests of Jacobians. Use it away from the optimum.
pub fn worst_jacobian_error<P: Problem>(problem: &P, state: &P::State, step: f64) -> f64 {
    let n = problem.width();
    let cost = |s: &P::State| {
        let mut r = Residuals::new(n, Loss::Squares, 1.0, false);
        problem.residuals(s, &mut r).expect("a state near a possible one is possible");
        r.cost
    };
    let mut here = Residuals::new(n, Loss::Squares, 1.0, true);
    problem.residuals(state, &mut here).expect("a possible state");
    here.settle();
    let mut worst: f64 = 0.0;
    for i in 0..n {
        let mut e = vec![0.0; n];
        e[i] = step;
        let up = cost(&problem.moved(state, &e));
        e[i] = -step;
        let down = cost(&problem.moved(state, &e));
        let numeric = (up - down) / (4.0 * step);
        let size = here.gradient[i].abs().max(1e-6 * here.gradient.amax());
        worst = worst.max((numeric - here.gradient[i]).abs() / size);
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_distr::{Distribution, Normal};

    /// y = a exp(b x) + c; some of the data are wrong.
    struct Decay {
        data: Vec<(f64, f64)>,
    }

    impl Problem for Decay {
        type State = [f64; 3];
        fn width(&self) -> usize {
            3
        }
        fn moved(&self, s: &[f64; 3], d: &[f64]) -> [f64; 3] {
            std::array::from_fn(|i| s[i] + d[i])
        }
        fn residuals(&self, s: &[f64; 3], out: &mut Residuals) -> Option<()> {
            for &(x, y) in &self.data {
                let e = (s[1] * x).exp();
                out.group(&[(s[0] * e + s[2] - y) / 0.02], &[0, 1, 2], &[e / 0.02, s[0] * x * e / 0.02, 1.0 / 0.02]);
            }
            Some(())
        }
    }

    fn decay(seed: u64, wrong: f64) -> Decay {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let noise = Normal::new(0.0, 0.02).unwrap();
        let data = (0..200)
            .map(|i| {
                let x = f64::from(i) * 0.02;
                let y = 2.0 * (-0.7 * x).exp() + 0.3 + noise.sample(&mut rng);
                (x, if rng.random::<f64>() < wrong { y + 3.0 * rng.random::<f64>() } else { y })
            })
            .collect();
        Decay { data }
    }

    #[test]
    fn jacobians_are_checked() {
        assert!(worst_jacobian_error(&decay(1, 0.0), &[1.5, -0.5, 0.1], 1e-6) < 1e-6);
    }

    #[test]
    fn reported_sigmas_are_the_true_ones() {
        // 300 repetitions: the rms of 900 normalised errors is 1 within 2.4 % (1 sigma).
        for (loss, estimate_scale) in [(Loss::Squares, false), (Loss::Huber(1.5), true), (Loss::Cauchy(2.4), true)] {
            let options = LmOptions { loss, estimate_scale, ..LmOptions::default() };
            let mut sum = 0.0;
            for seed in 0..300 {
                let s = lm(&decay(seed, 0.0), [1.0, -1.0, 0.0], &options).minimum().unwrap();
                let c = s.scaled_covariance().unwrap();
                let truth = [2.0, -0.7, 0.3];
                sum += (0..3).map(|i| (s.state[i] - truth[i]).powi(2) / c[(i, i)]).sum::<f64>();
            }
            let rms = (sum / 900.0).sqrt();
            assert!((0.9..1.1).contains(&rms), "{loss:?}: {rms}");
        }
    }

    #[test]
    fn a_fifth_of_wrong_data_does_not_matter_to_cauchy() {
        let options = LmOptions { loss: Loss::Cauchy(2.4), estimate_scale: true, ..LmOptions::default() };
        let robust = lm(&decay(5, 0.2), [1.0, -1.0, 0.0], &options).minimum().unwrap();
        let plain = lm(&decay(5, 0.2), [1.0, -1.0, 0.0], &LmOptions::default()).minimum().unwrap();
        assert!((robust.state[0] - 2.0).abs() < 0.05, "{:?}", robust.state);
        assert!((plain.state[2] - 0.3).abs() > 0.1, "plain least squares must suffer: {:?}", plain.state);
        assert!(robust.weights.iter().filter(|w| **w < 0.1).count() > 20);
    }

    #[test]
    fn held_and_undetermined_parameters_are_told_apart() {
        let d = decay(3, 0.0);
        let options = LmOptions { hold: vec![2], ..LmOptions::default() };
        let held = lm(&d, [2.0, -0.7, 0.25], &options).minimum().unwrap();
        assert!(held.state[2] == 0.25 && held.covariance.unwrap()[(2, 2)] == 0.0);
        let flat = Decay { data: vec![(1.0, 1.0); 50] };
        assert!(lm(&flat, [2.0, -0.7, 0.25], &LmOptions::default()).so_far().unwrap().covariance.is_none());
    }

    #[test]
    fn a_fit_that_runs_out_of_steps_says_so() {
        let few = LmOptions { max_iterations: 2, ..LmOptions::default() };
        let outcome = lm(&decay(1, 0.0), [1.0, -1.0, 0.0], &few);
        assert!(matches!(outcome, Outcome::Found(_, End::Exhausted)), "{outcome:?}");
        assert!(outcome.clone().minimum().is_none() && outcome.so_far().is_some());
    }

    /// Its cost falls to the right; states beyond `wall` are impossible.
    struct Walled {
        wall: f64,
    }

    impl Problem for Walled {
        type State = f64;
        fn width(&self) -> usize {
            1
        }
        fn moved(&self, s: &f64, d: &[f64]) -> f64 {
            s + d[0]
        }
        fn residuals(&self, s: &f64, out: &mut Residuals) -> Option<()> {
            (*s <= self.wall).then(|| out.group(&[s - 3.0], &[0], &[1.0]))
        }
    }

    #[test]
    fn a_fit_whose_every_step_is_impossible_is_stuck_and_no_minimum() {
        let at = |start: f64, wall: f64| lm(&Walled { wall }, start, &LmOptions::default());
        assert!(matches!(at(1.0, 1.0), Outcome::Found(_, End::Stuck)), "{:?}", at(1.0, 1.0));
        assert!(matches!(at(2.0, 1.0), Outcome::BadStart));
        assert!((at(1.0, 5.0).minimum().unwrap().state - 3.0).abs() < 1e-9);
    }
}
