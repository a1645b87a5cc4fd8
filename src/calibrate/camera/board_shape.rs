//! In: one board in several pictures of a calibrated camera. Out: the board's shape, and its poses measured with it,
//! if held-out pictures support a shape.
//! Frame and unit: camera_from_board, mm; px. docs/math.md, Hand-eye (16).

use super::bundle::State;
use super::choice::by_shape;
use super::fit::Fit;
use crate::calibrate::boards::shape::{Basis, Shape};
use crate::calibrate::measured_pose::{AboutCamera, MeasuredPose, SeenBoard, measure};
use crate::camera::{Intrinsics, PARAMETERS, ParameterMatrix, Parameters};
use crate::geometry::{Board, Camera, Rigid, Vec3};
use crate::solve::{Loss, Solution};
use nalgebra::DMatrix;

/// Loss against single wrong corners, as in a camera's calibration.
const LOSS: Loss = Loss::Huber(2.5);

/// Poses of a board that is not as drawn.
#[derive(Clone, Debug)]
pub struct ShapedPoses {
    /// The board's shape.
    pub shape: Shape,
    /// One pose for each picture, in their order.
    pub poses: Vec<MeasuredPose>,
}

/// Measures the board's poses again with its shape estimated from all pictures. `features` are the board's as drawn,
/// `poses` those measured as drawn. The camera is held: a bend moves a feature alike in all pictures, and a wrong
/// camera moves it otherwise in each.
///
/// `None` if held-out pictures do not fit better with a shape, or if there are too few of them.
pub fn as_shaped(
    features: &[Vec3],
    seen: &[SeenBoard],
    poses: &[Rigid<Camera, Board>],
    camera: &Intrinsics,
) -> Option<ShapedPoses> {
    let basis = Basis::of(features)?;
    let corners: Vec<Vec<_>> = seen
        .iter()
        .map(|s| s.points.iter().zip(&s.pixels).zip(&s.sigmas_px).map(|((x, u), sigma)| (*x, *u, *sigma)).collect())
        .collect();
    let mut fit = Fit { corners: &corners, like: camera, loss: LOSS, bent: None };
    let camera_held: Vec<usize> = (0..PARAMETERS).collect();
    let drawn = State { camera: camera.parameters(), shape: Vec::new(), poses: poses.to_vec() };
    let mut solution = fit.placed(drawn)?;
    by_shape(&mut fit, basis, &mut solution, &camera_held);
    let shape = fit.shape(&solution)?;
    let about_camera = share(&fit, &solution)?;
    let measured = |(s, pose): (&SeenBoard, &Rigid<Camera, Board>)| {
        let placed = SeenBoard { points: s.points.iter().map(|x| shape.place(x)).collect(), ..s.clone() };
        Some(MeasuredPose { about_camera, ..measure(&placed, camera, pose).ok()? })
    };
    let poses = seen.iter().zip(&solution.state.poses).map(measured).collect::<Option<_>>()?;
    Some(ShapedPoses { shape, poses })
}

/// Information of all pictures about the camera, the shape eliminated with the poses, in equal shares for each
/// picture: the shape came from the same pixels, so no picture has information of its own.
fn share(fit: &Fit<'_>, solution: &Solution<State>) -> Option<AboutCamera> {
    let told = fit.told(&[], solution)?;
    let pictures = told.len() as f64;
    let all: DMatrix<f64> = told.iter().map(|t| &t.0).sum();
    let mut shape = all.view((PARAMETERS, PARAMETERS), (Basis::LEN, Basis::LEN)).into_owned();
    for term in 0..Basis::LEN {
        shape[(term, term)] += (solution.sigma0 / fit.bent?.usual_of(term)).powi(2);
    }
    let mixed = all.view((0, PARAMETERS), (PARAMETERS, Basis::LEN));
    let camera = all.view((0, 0), (PARAMETERS, PARAMETERS)) - mixed * shape.cholesky()?.solve(&mixed.transpose());
    // At the optimum of the shape, a change of the camera has the same gradient whether the shape follows or not.
    let gradient = told.iter().map(|t| t.1.rows(0, PARAMETERS).into_owned()).sum::<nalgebra::DVector<f64>>();
    Some(AboutCamera {
        information: ParameterMatrix::from_fn(|i, j| (camera[(i, j)] + camera[(j, i)]) / (2.0 * pictures)),
        gradient: Parameters::from_fn(|i, _| gradient[i] / pictures),
    })
}
