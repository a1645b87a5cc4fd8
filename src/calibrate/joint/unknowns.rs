//! In: the unknowns of the joint solve. Out: their state, the effect of a step, and the position of each unknown in
//! the equations.
//! Frame and unit: camera, its carrier (near: flange or base) and the board's carrier (far: base or flange); mm, rad,
//! px.

use crate::calibrate::hand_eye::closed::{Far, Near};
use crate::calibrate::laser_plane::terms::stepped;
use crate::calibrate::pointer::beam::moved_beam;
use crate::camera::{Intrinsics, Parameters};
use crate::geometry::{Board, Camera, LeftStep, Plane, Ray, Rigid, Twist, Vec3};

/// All unknowns of the joint solve.
#[derive(Clone, Debug)]
pub struct State {
    /// Camera and lens.
    pub camera: Intrinsics,
    /// The hand-eye transform, mm; stays at its start value without robot data.
    pub near_from_camera: Rigid<Near, Camera>,
    /// Pose of each board on its carrier, mm.
    pub far_from_board: Vec<Rigid<Far, Board>>,
    /// The laser plane, mm; stays at its start value without stripe data.
    pub plane: Plane<Camera>,
    /// The pointer's beam, mm; stays at its start value without spot data.
    pub beam: Ray<Camera>,
    /// The board's pose in the camera frame at each stop, mm.
    pub boards: Vec<Rigid<Camera, Board>>,
}

/// Positions of the unknowns in a step: the camera's free parameters, hand-eye, boards' poses, laser plane, beam;
/// then six per stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Indices of the camera's free parameters into [`crate::camera::NAMES`].
    pub camera: Vec<usize>,
    /// Number of boards' poses.
    pub places: usize,
    /// Number of stops.
    pub shots: usize,
}

impl Layout {
    /// Position of the hand-eye transform's six parameters: translation, left rotation in the near frame.
    pub fn hand_eye(&self) -> usize {
        self.camera.len()
    }
    /// Position of the six parameters of a board's pose on its carrier: translation, left rotation in the far frame.
    pub fn place(&self, i: usize) -> usize {
        self.hand_eye() + 6 + 6 * i
    }
    /// Position of the laser plane's two tilts and its offset.
    pub fn plane(&self) -> usize {
        self.place(self.places)
    }
    /// Position of the beam's two shifts and two tilts.
    pub fn beam(&self) -> usize {
        self.plane() + 3
    }
    /// Number of unknowns that all stops share; those of the first stop follow.
    pub fn shared(&self) -> usize {
        self.beam() + 4
    }
    /// Position of the six parameters of the board's pose at a stop ([`Twist`]).
    pub fn shot(&self, i: usize) -> usize {
        self.shared() + 6 * i
    }
    /// Number of all unknowns.
    pub fn width(&self) -> usize {
        self.shot(self.shots)
    }
}

impl State {
    /// The state after a step of all unknowns, or of only the shared ones.
    pub fn moved(&self, l: &Layout, s: &[f64]) -> State {
        let mut change = Parameters::zeros();
        l.camera.iter().zip(s).for_each(|(&i, d)| change[i] = *d);
        let at = |i: usize, n: usize| &s[i..i + n];
        let places = self.far_from_board.iter().enumerate();
        let boards = self.boards.iter().enumerate();
        State {
            camera: self.camera.changed(&change),
            near_from_camera: LeftStep::new(at(l.hand_eye(), 6)).moved(&self.near_from_camera),
            far_from_board: places.map(|(i, w)| LeftStep::new(at(l.place(i), 6)).moved(w)).collect(),
            plane: stepped(&self.plane, &Vec3::new(s[l.plane()], s[l.plane() + 1], s[l.plane() + 2]))
                .unwrap_or(self.plane),
            beam: moved_beam(&self.beam, at(l.beam(), 4)),
            boards: boards
                .map(|(i, t)| if s.len() > l.shot(i) { Twist::new(at(l.shot(i), 6)).moved(t) } else { *t })
                .collect(),
        }
    }
}
