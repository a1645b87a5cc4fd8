//! In: boards' features in pictures. Out: the least-squares problem of camera and boards' poses.
//! Frame and unit: camera_from_board, mm, rad; px (docs/math.md, Camera calibration).

use super::lens::RATIONAL;
use crate::calibrate::projection::project;
use crate::camera::{Intrinsics, PARAMETERS, Parameters};
use crate::geometry::{Board, Camera, LeftStep, Rigid, Vec2, Vec3};
use crate::solve::{Blocks, Problem, Residuals};
use nalgebra::Matrix2x6;

pub(in crate::calibrate) type State = (Parameters, Vec<Rigid<Camera, Board>>);

/// One corner: board frame, pixel, sigma.
pub(in crate::calibrate) type Corner = (Vec3, Vec2, f64);

/// Usual size of the rational terms. Numerator and denominator bend nearly alike: without it a solve walks along what they cancel
/// until a pole stands at the picture's rim.
const RATIONAL_SIGMA: f64 = 2.0;

pub(in crate::calibrate) struct Bundle<'a> {
    pub pictures: &'a [Vec<Corner>],
    pub like: &'a Intrinsics,
    /// Intrinsic parameters that are estimated.
    pub free: Vec<usize>,
}

impl Bundle<'_> {
    /// Derivatives of a corner's residuals by the free parameters and by its pose's step, row by row.
    pub fn row(
        &self,
        camera: &Intrinsics,
        pose: &Rigid<Camera, Board>,
        corner: &Corner,
    ) -> Option<(Vec2, [Vec<f64>; 2])> {
        let (x, pixel, sigma) = corner;
        let rotated = pose.rotation * x;
        let q = project(camera, &(rotated + pose.translation))?;
        let by_pose: Matrix2x6<f64> = q.by_point * LeftStep::lever(&rotated);
        let of = |r: usize| {
            let own = self.free.iter().map(|&i| q.by_intrinsics[(r, i)] / sigma);
            own.chain(by_pose.row(r).iter().map(|d| d / sigma)).collect()
        };
        Some(((q.pixel - pixel) / *sigma, [of(0), of(1)]))
    }
}

impl Problem for Bundle<'_> {
    type State = State;
    fn width(&self) -> usize {
        PARAMETERS + 6 * self.pictures.len()
    }
    fn blocks(&self) -> Option<Blocks> {
        Some(Blocks { first: PARAMETERS, size: 6 })
    }
    fn moved(&self, (k, poses): &State, step: &[f64]) -> State {
        let k = k + Parameters::from_column_slice(&step[..PARAMETERS]);
        let poses =
            poses.iter().zip(step[PARAMETERS..].chunks_exact(6)).map(|(p, s)| LeftStep::new(s).moved(p)).collect();
        (k, poses)
    }
    fn residuals(&self, (k, poses): &State, out: &mut Residuals) -> Option<()> {
        let camera = self.like.with_parameters(k);
        if camera.fx <= 0.0 || camera.fy <= 0.0 {
            return None;
        }
        for (picture, (points, pose)) in self.pictures.iter().zip(poses).enumerate() {
            let first = PARAMETERS + 6 * picture;
            let columns: Vec<usize> = self.free.iter().copied().chain(first..first + 6).collect();
            for corner in points {
                if !out.wants_jacobian() {
                    let r = (camera.pixel_from_point(&pose.point(&corner.0))? - corner.1) / corner.2;
                    out.group(&[r.x, r.y], &columns, &[]);
                    continue;
                }
                let (r, [across, down]) = self.row(&camera, pose, corner)?;
                out.group(&[r.x, r.y], &columns, &[across, down].concat());
            }
        }
        for &i in self.free.iter().filter(|i| RATIONAL.contains(i)) {
            out.prior(&[k[i] / RATIONAL_SIGMA], &[i], &[1.0 / RATIONAL_SIGMA]);
        }
        Some(())
    }
}
