//! In: a board that looks the same after a turn, its poses in several pictures, the robot's poses.
//! Out: which turn each picture shows, so that all agree, or a refusal.
//! Frame and unit: board frame, mm; rad.

use super::BoardView;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Board, Camera, Flange, Rigid, Vec2, Vec3, angle_between, exp};
use crate::recording::BoardSpec;

/// A turn after which the board looks the same.
#[derive(Clone, Debug)]
pub struct Turn {
    /// Maps a feature's place to the place it takes.
    pub turn: Rigid<Board, Board>,
    /// `ids[i]` is the feature that takes the place of feature i.
    pub ids: Vec<usize>,
}

/// All such turns, the identity first. One entry: every picture tells the origin by itself.
pub fn turns(board: &BoardSpec) -> Vec<Turn> {
    let features = board.features();
    let (mut low, mut high) = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
    features.iter().for_each(|f| (low, high) = (low.inf(&f.xy()), high.sup(&f.xy())));
    let middle = (low + high) / 2.0;
    let centre = Vec3::new(middle.x, middle.y, 0.0);
    (0..4)
        .filter(|quarter| *quarter == 0 || colours_agree(board, *quarter))
        .filter_map(|quarter| {
            let r = exp(&Vec3::new(0.0, 0.0, f64::from(quarter) * std::f64::consts::FRAC_PI_2));
            let turn = Rigid::new(r, centre - r * centre);
            let near = |p: Vec3| features.iter().position(|f| (f - p).norm() < 1e-6 * (1.0 + p.norm()));
            let ids = features.iter().map(|f| near(turn.point(f))).collect::<Option<Vec<usize>>>()?;
            Some(Turn { turn, ids })
        })
        .collect()
}

fn colours_agree(board: &BoardSpec, quarter: u32) -> bool {
    match board {
        BoardSpec::Chessboard { inner_corners: [nx, ny], .. } => {
            (nx + ny) % 2 == 0 && (quarter == 2 || (nx == ny && nx % 2 == 1))
        }
        BoardSpec::Charuco { .. } => false,
        BoardSpec::Circles { .. } => true,
    }
}

impl BoardView {
    /// The same view read with another of the board's turns.
    pub fn turned(&self, turn: &Turn) -> BoardView {
        let mut points = self.points.clone();
        points.iter_mut().for_each(|p| p.feature_id = turn.ids[p.feature_id]);
        points.sort_by_key(|p| p.feature_id);
        BoardView { points, ambiguous: self.ambiguous }
    }
}

/// Which of `turns` each picture has to be read with (index; the first picture's reading defines the
/// board's frame). For a camera on the flange and a board at rest, or the reverse: two pictures' board
/// poses must be rotated against each other by the angle that the robot turned.
///
/// # Errors
/// Where the second best reading of a picture fits almost as well as the best one.
pub fn resolve(
    camera_from_board: &[Rigid<Camera, Board>],
    base_from_flange: &[Rigid<Base, Flange>],
    turns: &[Turn],
) -> Result<Vec<usize>> {
    assert_eq!(camera_from_board.len(), base_from_flange.len());
    let mut chosen: Vec<usize> = Vec::with_capacity(camera_from_board.len());
    for (i, pose) in camera_from_board.iter().enumerate() {
        if i == 0 {
            chosen.push(0);
            continue;
        }
        // Mean disagreement of rotation angles with all pictures read so far.
        let mut misfits: Vec<(f64, usize)> = turns
            .iter()
            .enumerate()
            .map(|(k, turn)| {
                let read = *pose * turn.turn.inverse();
                let sum: f64 = (0..i)
                    .map(|j| {
                        let other = camera_from_board[j] * turns[chosen[j]].turn.inverse();
                        let seen = angle_between(&read.rotation, &other.rotation);
                        (seen - angle_between(&base_from_flange[i].rotation, &base_from_flange[j].rotation)).abs()
                    })
                    .sum();
                (sum / i as f64, k)
            })
            .collect();
        misfits.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let [best, second, ..] = misfits[..]
            && second.0 < 3.0 * best.0 + 0.02
        {
            return Err(Fault::refused(format!(
                "picture {i}: the board looks the same after a turn, and the robot's poses do not tell which way it is ({:.2} against {:.2} degrees)",
                best.0.to_degrees(),
                second.0.to_degrees()
            ))
            .cause("the robot hardly turned between the pictures, or poses and pictures are mispaired")
            .next("use a board with one even and one odd number of corners, or ChArUco"));
        }
        chosen.push(misfits[0].1);
    }
    Ok(chosen)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chessboard(nx: u32, ny: u32) -> BoardSpec {
        BoardSpec::Chessboard { inner_corners: [nx, ny], square_mm: 10.0, border_mm: 0.0, first_square: "black".into() }
    }
    fn circles(nx: u32, ny: u32, asymmetric: bool) -> BoardSpec {
        BoardSpec::Circles { dots: [nx, ny], pitch_mm: 10.0, diameter_mm: 5.0, asymmetric, border_mm: 0.0 }
    }

    #[test]
    fn symmetries_are_counted_as_geometry_has_them() {
        let count = |b: &BoardSpec| turns(b).len();
        assert_eq!(count(&chessboard(9, 6)), 1);
        assert_eq!((count(&chessboard(8, 6)), count(&chessboard(9, 7))), (2, 2));
        assert_eq!((count(&chessboard(7, 7)), count(&chessboard(8, 8))), (4, 2));
        assert_eq!((count(&circles(7, 5, false)), count(&circles(6, 6, false))), (2, 4));
        assert_eq!((count(&circles(4, 11, true)), count(&circles(4, 10, true))), (1, 2));
    }

    #[test]
    fn turned_readings_are_found_out_by_the_robot() {
        let board = chessboard(8, 6);
        let turns = turns(&board);
        let flange_from_camera: Rigid<Flange, Camera> =
            Rigid::from_vectors(&Vec3::new(0.1, 0.2, 1.5), Vec3::new(30.0, 5.0, 60.0));
        let base_from_board: Rigid<Base, Board> =
            Rigid::from_vectors(&Vec3::new(3.0, 0.1, 0.0), Vec3::new(400.0, 0.0, 20.0));
        let robot: Vec<Rigid<Base, Flange>> = (0..6)
            .map(|i| {
                let a = f64::from(i);
                let w = Vec3::new(3.0 + 0.3 * a.sin(), 0.25 * a.cos(), 0.2 * a);
                Rigid::from_vectors(&w, Vec3::new(380.0 + 10.0 * a, 20.0, 260.0))
            })
            .collect();
        let truth = [0, 1, 1, 0, 1, 0];
        let seen: Vec<Rigid<Camera, Board>> = robot
            .iter()
            .zip(truth)
            .map(|(r, k)| {
                let camera_from_board = (*r * flange_from_camera).inverse() * base_from_board;
                camera_from_board * turns[k].turn
            })
            .collect();
        assert_eq!(resolve(&seen, &robot, &turns).unwrap(), truth);
        // A quarter turn about the board's normal looks as far either way.
        let about_normal = base_from_board.rotation.column(2) * std::f64::consts::FRAC_PI_2;
        let quarter = Rigid::new(exp(&about_normal.into()) * robot[0].rotation, robot[0].translation);
        let two = [robot[0], quarter];
        let seen: Vec<Rigid<Camera, Board>> =
            two.iter().map(|r| (*r * flange_from_camera).inverse() * base_from_board).collect();
        assert!(resolve(&seen, &two, &turns).unwrap_err().what.contains("picture 1"));
    }
}
