//! In: the camera's pose, the distance of the board, the beams in the camera's frame. Out: flange poses for
//! touching the board with the pointer around the picture's middle, and for sweeping the line over it; which
//! touches lie on the board. Pure.
//! Frame and unit: base_from_flange, mm.

use crate::geometry::{Base, Camera, Flange, Plane, Ray, Rigid, Vec2, Vec3};

/// Positions of the touches around the field's middle, as shares of the field, on eight sides. If one side of the
/// picture is beside the board or covered by a part, six remain on the board, and no other plane has more than four
/// (two rows of three would have six).
pub(super) const TOUCHES: [[f64; 2]; 8] =
    [[-1.0, -0.5], [-0.5, -1.0], [0.5, -1.0], [1.0, -0.5], [1.0, 0.5], [0.5, 1.0], [-0.5, 1.0], [-1.0, 0.5]];

/// Flange poses that place the pointer's spots around `middle`, `half` mm to each side. `middle` is a point of the
/// board in the camera's present frame. The camera's distance from the board becomes `then`.
pub fn touches(
    base_from_camera: &Rigid<Base, Camera>,
    flange_from_camera: &Rigid<Flange, Camera>,
    pointer: &Ray<Camera>,
    middle: &Vec3,
    then: f64,
    half: [f64; 2],
) -> Vec<Rigid<Base, Flange>> {
    let spot = pointer.at((then - pointer.origin.z) / pointer.direction.z);
    let place = |[x, y]: &[f64; 2]| {
        let shift = middle + Vec3::new(x * half[0] - spot.x, y * half[1] - spot.y, -then);
        *base_from_camera * Rigid::<Camera, Camera>::from_vectors(&Vec3::zeros(), shift) * flange_from_camera.inverse()
    };
    TOUCHES.iter().map(place).collect()
}

/// Indices of the largest set of touches within `gate` mm of one plane; empty if that is not more than half of
/// them.
pub fn on_one_plane(points: &[Vec3], gate: f64) -> Vec<usize> {
    let most = planes(points, gate).max_by(|a, b| a.0.len().cmp(&b.0.len()).then(b.1.total_cmp(&a.1)));
    most.map(|m| m.0).filter(|on| 2 * on.len() > points.len()).unwrap_or_default()
}

/// Mean, in the camera's frame, of the largest set of touches within `gate` mm of one plane. Of equal sets the one
/// nearest to the camera is used, because a board lies on a table. `None` if no four touches fit: three always lie
/// on a plane.
pub fn most_on_one_plane(points: &[Vec3], gate: f64) -> Option<Vec3> {
    let middle = |on: &[usize]| on.iter().map(|&i| points[i]).sum::<Vec3>() / on.len() as f64;
    let four = planes(points, gate).filter(|p| p.0.len() >= 4).map(|p| (p.0.len(), middle(&p.0)));
    four.max_by(|a, b| a.0.cmp(&b.0).then(b.1.z.total_cmp(&a.1.z))).map(|m| m.1)
}

/// The planes through three touches each: the touches within `gate` mm of each plane, and the sum of their squared
/// distances.
fn planes(points: &[Vec3], gate: f64) -> impl Iterator<Item = (Vec<usize>, f64)> {
    let n = points.len();
    let through = move |(i, j, k): (usize, usize, usize)| {
        let normal = (points[j] - points[i]).cross(&(points[k] - points[i]));
        let size = (points[j] - points[i]).norm() * (points[k] - points[i]).norm();
        // Three touches in a row define no plane.
        (normal.norm() > 0.1 * size).then(|| (normal.normalize(), points[i]))
    };
    let three = (0..n).flat_map(|i| (0..i).flat_map(move |j| (0..j).map(move |k| (i, j, k))));
    three.filter_map(through).map(move |(normal, at)| {
        let off = |p: &Vec3| normal.dot(&(p - at)).abs();
        let on: Vec<usize> = (0..n).filter(|&m| off(&points[m]) <= gate).collect();
        let rest = on.iter().map(|&m| off(&points[m]).powi(2)).sum::<f64>();
        (on, rest)
    })
}

/// Flange poses of a sweep. The camera keeps the orientation of `square`, `depth` from the board. It moves across
/// its stripe, so that the stripe passes over `length` mm about the foot of the axis, in steps.
pub fn sweep(
    square: &Rigid<Base, Flange>,
    flange_from_camera: &Rigid<Flange, Camera>,
    plane: &Plane<Camera>,
    depth: f64,
    length: f64,
    step: f64,
) -> Vec<Rigid<Base, Flange>> {
    let across = Vec2::new(plane.normal.x, plane.normal.y);
    let d = across / across.norm();
    // Position of the stripe on the board along that direction.
    let stripe = (plane.offset - plane.normal.z * depth) / across.norm();
    let shots = (length / step).ceil().max(1.0) as usize + 1;
    (0..shots)
        .map(|k| {
            let along = -length / 2.0 + length * k as f64 / (shots - 1) as f64 - stripe;
            let shift = Rigid::<Camera, Camera>::from_vectors(&Vec3::zeros(), Vec3::new(d.x, d.y, 0.0) * along);
            *square * *flange_from_camera * shift * flange_from_camera.inverse()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touches_beside_the_board_and_on_parts_do_not_count() {
        let tilted =
            |x: f64, y: f64| Vec3::new(50.0 * x, 40.0 * y, 3.0 * x - 5.0 * y + 0.02 * (7.0 * x + 3.0 * y).sin());
        let board: Vec<Vec3> = TOUCHES.iter().map(|&[x, y]| tilted(x, y)).collect();
        assert_eq!(on_one_plane(&board, 0.3).len(), 8);
        // One side of the picture is beside the board.
        let mut low = board.clone();
        (5..7).for_each(|i| low[i].z -= 6.0);
        assert_eq!(on_one_plane(&low, 0.3), [0, 1, 2, 3, 4, 7]);
        // Half of the picture is beside it: two planes of four, and the board cannot be identified.
        [4, 7].into_iter().for_each(|i| low[i].z -= 6.0);
        assert!(on_one_plane(&low, 0.3).is_empty());
        // From a camera 300 mm above, the nearer plane indicates where to touch again.
        let from_camera = |p: &Vec3| Vec3::new(p.x, -p.y, 300.0 - p.z);
        let seen: Vec<Vec3> = low.iter().map(from_camera).collect();
        let near = from_camera(&(board[..4].iter().sum::<Vec3>() / 4.0));
        assert!((most_on_one_plane(&seen, 0.3).unwrap() - near).norm() < 1e-9);
        assert!(most_on_one_plane(&seen[1..4], 0.3).is_none());
        // Two sides have a part on them, one touch each.
        let mut part = board.clone();
        [3, 7].into_iter().for_each(|i| part[i].z += 8.0);
        assert_eq!(on_one_plane(&part, 0.3), [0, 1, 2, 4, 5, 6]);
        let mut rubble = board;
        (0..8).for_each(|i| rubble[i].z += 2.0 * f64::from(i as u32 % 5) * f64::from(i as u32));
        assert!(on_one_plane(&rubble, 0.3).is_empty());
    }

    #[test]
    fn spots_and_stripe_lie_where_they_are_wanted() {
        let hand_eye: Rigid<Flange, Camera> =
            Rigid::from_vectors(&Vec3::new(0.02, -0.01, -1.5), Vec3::new(-46.0, 1.4, 93.0));
        let camera: Rigid<Base, Camera> = Rigid::new(
            crate::geometry::Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0)),
            Vec3::new(300.0, 20.0, 310.0),
        );
        let pointer = Ray::new(Vec3::new(41.0, 9.0, 12.0), Vec3::new(-41.0, -6.0, 178.0)).unwrap();
        let floor = Plane::<Base>::new(Vec3::z(), 0.0).unwrap();
        for (flange, [x, y]) in
            touches(&camera, &hand_eye, &pointer, &Vec3::new(0.0, 0.0, 310.0), 155.0, [45.0, 34.0]).iter().zip(TOUCHES)
        {
            let at = *flange * hand_eye;
            let spot =
                Ray::new(at.point(&pointer.origin), at.direction(&pointer.direction)).unwrap().meet(&floor).unwrap();
            assert!((spot - Vec3::new(300.0 + 45.0 * x, 20.0 - 34.0 * y, 0.0)).norm() < 1e-9, "{spot:?}");
            assert!((at.translation.z - 155.0).abs() < 1e-9);
        }
        let plane = Plane::<Camera>::new(Vec3::new(0.05, 0.85, 0.5).normalize(), 60.0).unwrap();
        let square = camera * hand_eye.inverse();
        let path = sweep(&square, &hand_eye, &plane, 310.0, 50.0, 0.5);
        assert_eq!(path.len(), 101);
        // Where the sheet meets the floor, nearest to the axis' foot: from -25 to 25 mm across the stripe.
        let at = |flange: &Rigid<Base, Flange>| {
            let sheet = (*flange * hand_eye).plane(&plane);
            let n = Vec2::new(sheet.normal.x, sheet.normal.y);
            (n.dot(&Vec2::new(300.0, 20.0)) - sheet.offset) / n.norm()
        };
        assert!((at(&path[0]) - at(&path[100])).abs() - 50.0 < 1e-9 && (at(&path[0]) + at(&path[100])).abs() < 1e-9);
    }
}
