//! Two cameras solved together: the camera of most pictures, and that of the others, which differs by a change of one
//! kind. The board and its shape are the same for both.

use super::change::Kind;
use super::pictures::{Look, Set, Stand};
use super::search::{beforehand, is_smaller_part};
use crate::calibrate::camera::repeat::Told;
use crate::camera::{PARAMETERS, Parameters};
use nalgebra::{DMatrix, DVector};

/// Largest number of steps, and number of times that the pictures are reassigned.
const STEPS: usize = 16;
const SORTED: usize = 3;
/// Squared length of a step, in its own sigmas, below which the solve has converged.
const SETTLED: f64 = 0.01;
/// Relative floor of the weights in the scatter's estimate, for the case that one picture alone determines a
/// parameter.
const LEAST_SHARE: f64 = 1e-6;

/// The set in two parts: the pictures marked in `other` belong to the second, which may be empty.
pub struct Two {
    pub kind: Kind,
    pub other: Vec<bool>,
    pub stand: Stand,
    pub change: DVector<f64>,
    looks: [Option<Look>; 2],
}

impl Two {
    /// Starts from the solution for all pictures together, and reassigns the pictures during the solve.
    pub fn solved(set: &Set, from: &Stand, kind: Kind, other: Vec<bool>) -> Option<Two> {
        let numbers = kind.directions(&set.like).ncols();
        let (stand, change, looks) = (from.clone(), DVector::zeros(numbers), [None, None]);
        let mut two = Two { kind, other, stand, change, looks };
        let mut sorted = 0;
        for step in 0..STEPS {
            two.look(set)?;
            let length = two.step(set)?;
            if length > SETTLED && step + 1 < STEPS {
                continue;
            }
            two.look(set)?;
            if kind == Kind::Same {
                break;
            }
            let next = two.sorted(set)?;
            if next == two.other || !is_smaller_part(&next) || sorted == SORTED {
                break;
            }
            (two.other, sorted) = (next, sorted + 1);
        }
        two.look(set)?;
        two.looks.iter().flatten().all(|l| l.scale().is_finite()).then_some(two)
    }

    fn part(&self, second: bool) -> Vec<usize> {
        (0..self.other.len()).filter(|&i| self.other[i] == second).collect()
    }

    /// The cameras of both parts.
    pub fn cameras(&self, set: &Set) -> [Parameters; 2] {
        let first = set.like.with_parameters(&self.stand.camera);
        [self.stand.camera, self.kind.camera(&first, &self.change).parameters()]
    }

    fn look(&mut self, set: &Set) -> Option<()> {
        let cameras = self.cameras(set);
        for second in [false, true] {
            let which = self.part(second);
            let camera = &cameras[usize::from(second)];
            let look = if which.is_empty() {
                None
            } else {
                let look = set.look(&which, camera, &self.stand.shape, &self.stand.poses)?;
                which.iter().zip(&look.poses).for_each(|(&i, pose)| self.stand.poses[i] = *pose);
                Some(look)
            };
            self.looks[usize::from(second)] = look;
        }
        Some(())
    }

    /// Typical residual of each part over the corners' sigmas.
    pub fn scales(&self) -> [f64; 2] {
        [0, 1].map(|i| self.looks[i].as_ref().map_or(0.0, Look::scale))
    }

    /// Derivatives of each picture's free parameters by the joint ones: the shared parameters, then those of the
    /// change.
    fn design(&self, set: &Set, second: bool) -> DMatrix<f64> {
        let free = set.free();
        let directions = free_rows(set, &self.kind.directions(&set.like));
        let signs = self.kind.signs(&set.like);
        let (p, q) = (free.len(), directions.ncols());
        let mut design = DMatrix::zeros(p, p + q);
        for (row, &i) in free.iter().enumerate() {
            design[(row, row)] = if second && i < PARAMETERS { signs[i] } else { 1.0 };
        }
        if second {
            design.view_mut((0, p), (p, q)).copy_from(&directions);
        }
        design
    }

    /// The information of every picture, with the design of its part, in the order of the parts.
    fn told<'a>(&'a self, designs: &'a [DMatrix<f64>; 2]) -> impl Iterator<Item = (&'a Told, &'a DMatrix<f64>)> {
        self.looks.iter().zip(designs).flat_map(|(l, d)| l.iter().flat_map(move |l| l.told.iter().map(move |t| (t, d))))
    }

    fn designs(&self, set: &Set) -> [DMatrix<f64>; 2] {
        [false, true].map(|second| self.design(set, second))
    }

    fn information(&self, set: &Set, designs: &[DMatrix<f64>; 2]) -> DMatrix<f64> {
        let prior = beforehand(set, self.scales()[0].powi(2));
        let (p, size) = (prior.nrows(), designs[0].ncols());
        let mut all = DMatrix::zeros(size, size);
        all.view_mut((0, 0), (p, p)).copy_from(&prior);
        self.told(designs).fold(all, |sum, (t, d)| sum + d.transpose() * &t.0 * d)
    }

    /// One Gauss-Newton step; returns its squared length in its own sigmas.
    fn step(&mut self, set: &Set) -> Option<f64> {
        let designs = self.designs(set);
        let variance = self.scales()[0].powi(2);
        let information = self.information(set, &designs);
        let free = set.free();
        let mut pull = DVector::zeros(information.nrows());
        for (row, &i) in free.iter().enumerate() {
            if let Some(usual) = set.usual(i) {
                pull[row] = variance * self.stand.shape[i - PARAMETERS] / (usual * usual);
            }
        }
        for (t, d) in self.told(&designs) {
            pull += d.transpose() * &t.1;
        }
        let step = -information.clone().cholesky()?.solve(&pull);
        for (row, &i) in free.iter().enumerate() {
            match i.checked_sub(PARAMETERS) {
                None => self.stand.camera[i] += step[row],
                Some(term) => self.stand.shape[term] += step[row],
            }
        }
        self.change += step.rows(free.len(), self.change.len());
        let possible = self.cameras(set).iter().all(|k| k[0] > 0.0 && k[1] > 0.0);
        possible.then(|| step.dot(&(information * &step)) / variance)
    }

    /// The pictures that fit the second camera better.
    fn sorted(&self, set: &Set) -> Option<Vec<bool>> {
        let all: Vec<usize> = (0..set.len()).collect();
        let scale = self.scales()[0];
        let cost = |camera: &Parameters| {
            set.look(&all, camera, &self.stand.shape, &self.stand.poses).map(|l| set.costs(&l, scale))
        };
        let [first, second] = self.cameras(set);
        Some(cost(&first)?.iter().zip(cost(&second)?).map(|(a, b)| b < *a).collect())
    }

    /// Sum of the pictures' costs at a scale, plus the cost of the shape's prior.
    pub fn cost(&self, set: &Set, scale: f64) -> f64 {
        let seen: f64 = self.looks.iter().flatten().flat_map(|l| set.costs(l, scale)).sum();
        let shape = self.stand.shape.iter().enumerate();
        let usual = shape.filter_map(|(i, c)| Some((c / set.usual(PARAMETERS + i)?).powi(2)));
        seen + usual.sum::<f64>()
    }

    /// The factor, 1 or more, by which the pictures' pulls on the change scatter beyond independent errors of the
    /// corners (a ratio of variances), and the number of squares that it is estimated from. It is the larger of two
    /// estimates: from the change's own parameters, and from all three of a camera's.
    pub fn scatter(&self, set: &Set) -> Option<(f64, f64)> {
        let designs = self.designs(set);
        let inverse = self.information(set, &designs).cholesky()?.inverse();
        let of = |kind: Kind| -> Option<(f64, f64)> {
            let directions = free_rows(set, &kind.directions(&set.like));
            let variance = self.scales()[0].powi(2);
            // Each picture's pull along the change, and the variance of that pull with all other parameters fitted.
            let pulls: Vec<(DVector<f64>, DMatrix<f64>)> = self
                .told(&designs)
                .map(|(t, d)| {
                    let along = &t.0 * &directions;
                    let fixed = d.transpose() * &along;
                    let left = directions.transpose() * &along - fixed.transpose() * &inverse * &fixed;
                    (directions.transpose() * &t.1, left)
                })
                .collect();
            let whole: DMatrix<f64> = pulls.iter().map(|p| &p.1).sum();
            let floor = DMatrix::from_diagonal(&(whole.diagonal() * LEAST_SHARE));
            let weigh = (whole + floor).try_inverse()?;
            let seen: f64 = pulls.iter().map(|(s, _)| s.dot(&(&weigh * s))).sum();
            let shares: Vec<f64> = pulls.iter().map(|(_, v)| (&weigh * v).trace().max(0.0)).collect();
            let expected: f64 = shares.iter().sum();
            let count = expected * expected / shares.iter().map(|s| s * s).sum::<f64>();
            Some((seen / expected / variance, count * directions.ncols() as f64))
        };
        let (own, _) = of(self.kind.compared())?;
        let (alike, count) = of(Kind::Camera)?;
        Some((own.max(alike).max(1.0), count))
    }
}

/// Rows of the free parameters of the camera; those of the shape are zero.
pub fn free_rows(set: &Set, of_camera: &DMatrix<f64>) -> DMatrix<f64> {
    let free = set.free();
    DMatrix::from_fn(free.len(), of_camera.ncols(), |row, c| {
        if free[row] < PARAMETERS { of_camera[(free[row], c)] } else { 0.0 }
    })
}
