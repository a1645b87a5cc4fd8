//! In: a board's description. Out: the rotations after which it looks the same. Which of them applies to a picture is
//! resolved by the entire set (`hand_eye::turns`), never by the picture.
//! Frame and unit: board frame, mm.

use crate::calibrate::boards::BoardView;
use crate::geometry::{Board, Rigid, Vec2, Vec3, exp};
use crate::recording::BoardSpec;

/// A rotation after which the board looks the same.
#[derive(Clone, Debug)]
pub struct Turn {
    /// Maps the position of a feature to the position that it moves to.
    pub turn: Rigid<Board, Board>,
    /// `ids[i]` is the feature at the new position of feature i.
    pub ids: Vec<usize>,
}

/// All such rotations, the identity first. With one entry, every single picture determines the origin.
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
            // An odd number of inner corners means an even number of squares: a quarter turn swaps their colours.
            (nx + ny) % 2 == 0 && (quarter == 2 || (nx == ny && nx % 2 == 0))
        }
        BoardSpec::Charuco { .. } | BoardSpec::MarkerGrid { .. } => false,
        // A mark at the first dot leaves one reading.
        BoardSpec::Circles { origin, .. } => origin.is_none(),
    }
}

impl BoardView {
    /// The same view read with another of the board's rotations.
    pub fn turned(&self, turn: &Turn) -> BoardView {
        let mut points = self.points.clone();
        points.iter_mut().for_each(|p| p.feature_id = turn.ids[p.feature_id]);
        points.sort_by_key(|p| p.feature_id);
        BoardView { points, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::OriginMark;

    fn chessboard(nx: u32, ny: u32) -> BoardSpec {
        BoardSpec::Chessboard { inner_corners: [nx, ny], square_mm: 10.0, border_mm: 0.0, first_square: "black".into() }
    }
    fn circles(nx: u32, ny: u32, asymmetric: bool) -> BoardSpec {
        BoardSpec::Circles {
            dots: [nx, ny],
            pitch_mm: 10.0,
            diameter_mm: Some(5.0),
            asymmetric,
            origin: None,
            border_mm: 0.0,
        }
    }

    #[test]
    fn symmetries_are_counted_as_geometry_has_them() {
        let count = |b: &BoardSpec| turns(b).len();
        assert_eq!(count(&chessboard(9, 6)), 1);
        assert_eq!((count(&chessboard(8, 6)), count(&chessboard(9, 7))), (2, 2));
        assert_eq!((count(&chessboard(7, 7)), count(&chessboard(8, 8))), (2, 4));
        assert_eq!((count(&circles(7, 5, false)), count(&circles(6, 6, false))), (2, 4));
        let mut marked = circles(7, 7, false);
        if let BoardSpec::Circles { origin, .. } = &mut marked {
            *origin = Some(OriginMark::LargerDot { diameter_mm: None });
        }
        assert_eq!((count(&circles(7, 7, false)), count(&marked)), (4, 1));
        assert_eq!((count(&circles(4, 11, true)), count(&circles(4, 10, true))), (1, 2));
    }
}
