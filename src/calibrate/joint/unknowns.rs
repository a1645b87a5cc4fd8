//! In: what is solved for. Out: the state, which step moves what, and where each unknown stands in the equations.
//! Frame and unit: camera, its carrier (near: flange or base) and the board's (far: base or flange); mm, rad, px.

use crate::calibrate::hand_eye::closed::{Far, Near};
use crate::calibrate::laser_plane::terms::stepped;
use crate::calibrate::pointer::beam::moved_beam;
use crate::camera::{Intrinsics, Parameters};
use crate::geometry::{Board, Camera, LeftStep, Plane, Ray, Rigid, Twist, Vec3};

/// Everything that is solved for.
#[derive(Clone, Debug)]
pub struct State {
    /// Camera and lens.
    pub camera: Intrinsics,
    /// The hand-eye transform, mm; as it came where no robot is in the data.
    pub near_from_camera: Rigid<Near, Camera>,
    /// Where each board is fixed, mm.
    pub far_from_board: Vec<Rigid<Far, Board>>,
    /// The sheet of light, mm; as it came where no stripe is in the data.
    pub plane: Plane<Camera>,
    /// The pointer's beam, mm; as it came where no spot is in the data.
    pub beam: Ray<Camera>,
    /// The board before the camera at each stop, mm.
    pub boards: Vec<Rigid<Camera, Board>>,
}

/// Where unknowns stand in a step: the camera's free numbers, hand-eye, boards' places, sheet, beam; then six a stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Indices of the camera's free parameters into [`crate::camera::NAMES`].
    pub camera: Vec<usize>,
    /// How many places of boards there are.
    pub places: usize,
    /// How many stops.
    pub shots: usize,
}

impl Layout {
    /// Of the hand-eye transform's six: translation, left rotation in the near frame.
    pub fn hand_eye(&self) -> usize {
        self.camera.len()
    }
    /// Of a board's place, six: translation, left rotation in the far frame.
    pub fn place(&self, i: usize) -> usize {
        self.hand_eye() + 6 + 6 * i
    }
    /// Of the sheet's two tilts and its offset.
    pub fn plane(&self) -> usize {
        self.place(self.places)
    }
    /// Of the beam's two shifts and two tilts.
    pub fn beam(&self) -> usize {
        self.plane() + 3
    }
    /// How many unknowns all stops share; the first stop's come next.
    pub fn shared(&self) -> usize {
        self.beam() + 4
    }
    /// Of the board's pose at a stop, six ([`Twist`]).
    pub fn shot(&self, i: usize) -> usize {
        self.shared() + 6 * i
    }
    /// All.
    pub fn width(&self) -> usize {
        self.shot(self.shots)
    }
}

impl State {
    /// After a step of all unknowns, or of the shared ones alone.
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
