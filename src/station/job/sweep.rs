//! In: a station, a recipe, the pose from which the board was seen. Out: the path of the line over the part before
//! anything is scanned: one pose per shot, and the margins to part, picture, working volume and box. The job moves
//! along it; page and command line show the same.
//! Frame and unit: base frame; the board in the camera's square view, from the foot of its axis (x right, y down);
//! mm.

use super::places;
use crate::arm::rules::Space;
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::find::Recipe;
use crate::geometry::{Base, Camera, Flange, Mat3, Plane, Rigid, Vec2, Vec3};
use crate::rig::{Rig, Volume};
use crate::station::settings::Settings;
use crate::station::volume;

/// Largest distance of a known part from the picture's middle, as a share of the field's short side.
pub(super) const ASIDE: f64 = 1.0 / 8.0;
/// Step as a share of the cell of the recipe's map: about two shots a cell.
const STEP: f64 = 0.6;
/// Number of pieces in which a side is drawn.
const PIECES: usize = 8;
/// Allowed length of a stated sweep, mm.
const STATED: std::ops::RangeInclusive<f64> = 5.0..=1000.0;

/// The board, and the pose from which it was seen.
#[derive(Clone, Debug)]
pub struct Board {
    /// Pose of the flange.
    pub start: Rigid<Base, Flange>,
    /// A point of the board, and its unit normal towards the camera.
    pub surface: [Vec3; 2],
}

impl Board {
    /// The assumed board before anything was touched: squarely in front of the camera, at the rig's working
    /// distance or at the stated one. Without a robot pose the camera's own frame replaces the base.
    ///
    /// # Errors
    /// A rig without hand-eye; a distance that is not positive and finite; an unknown working distance.
    pub fn presumed(
        settings: &Settings,
        rig: &Rig,
        start: Option<Rigid<Base, Flange>>,
        distance_mm: Option<f64>,
    ) -> Result<Board> {
        let hand_eye = rig.need_hand_eye()?.value;
        let start = start.unwrap_or_else(|| {
            let base_from_camera: Rigid<Base, Camera> = Rigid::identity();
            base_from_camera * hand_eye.inverse()
        });
        let distance = distance_mm.map_or_else(|| volume::view(settings, rig).map(|v| v.middle()), Ok)?;
        if !(distance > 0.0 && distance.is_finite()) {
            return Err(Fault::usage(format!("the board is {distance} mm before the camera, more than 0 is needed"))
                .next("give the distance along the camera's axis, mm"));
        }
        let camera = start * hand_eye;
        let axis = camera.direction(&Vec3::z());
        Ok(Board { start, surface: [camera.translation + axis * distance, -axis] })
    }
}

/// The sweep of the line over a part.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// Flange pose of the square view of the board.
    pub square: Rigid<Base, Flange>,
    /// One flange pose per shot.
    pub flanges: Vec<Rigid<Base, Flange>>,
    /// The sweep's figures for display.
    pub figures: SweepFigures,
}

/// The figures of a sweep.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct SweepFigures {
    /// Distance from the board to the camera, mm.
    pub depth_mm: f64,
    /// Distance from the first shot's stripe to the last one's, mm.
    pub length_mm: f64,
    /// Distance between shots, mm.
    pub step_mm: f64,
    /// Number of pictures.
    pub shots: usize,
    /// The diagonal of the part's drawing, mm: its extent however it is turned.
    pub part_mm: f64,
    /// Area of the board in the square view: x0 y0 x1 y1, mm.
    pub field_mm: [f64; 4],
    /// The ends of the first shot's stripe, then those of the last one's, in order around the swept area, mm.
    pub swept_mm: [[f64; 2]; 4],
    /// How far the part may be off the picture's middle along the sweep and still be swept completely, mm;
    /// negative: never.
    pub along_mm: f64,
    /// The same along the stripe, whose ends are at the picture's edges.
    pub across_mm: f64,
    /// How far the working volume extends above the board and below it, mm; `None`: unknown.
    pub volume_mm: Option<[f64; 2]>,
    /// Smallest distance of the flange to the sides of the box of `[motion]`, mm; negative: outside; `None`: no box
    /// is stated.
    pub box_mm: Option<f64>,
}

impl SweepFigures {
    /// The figures as sentences, one a line.
    pub fn says(&self) -> Vec<String> {
        let mut says = vec![format!(
            "the camera {:.0} mm above the board, then {} shots over {:.0} mm",
            self.depth_mm, self.shots, self.length_mm
        )];
        let mut left = vec![
            format!("{:.0} mm along the sweep", self.along_mm),
            format!("{:.0} mm at the stripe's ends", self.across_mm),
        ];
        left.extend(self.volume_mm.map(|[up, down]| format!("{up:.0} mm above the board, {down:.0} mm below it")));
        left.extend(self.box_mm.map(|mm| format!("{mm:.0} mm to the box's sides")));
        says.push(format!("left beside a part of {:.0} mm across: {}", self.part_mm, left.join(", ")));
        says
    }
}

impl Sweep {
    /// Outlines of the swept area and of a part in its middle in the picture of the camera on the flange, px. The
    /// lines are closed; integer coordinates are pixel centres. `None`: some of it lies where the lens shows
    /// nothing.
    pub fn seen(&self, rig: &Rig, flange: &Rigid<Base, Flange>) -> Option<[Vec<[f64; 2]>; 2]> {
        let (camera, hand_eye) = (rig.camera.as_ref()?.value, rig.hand_eye.as_ref()?.value);
        let from_square = (*flange * hand_eye).inverse() * (self.square * hand_eye);
        let pixel = |[x, y]: [f64; 2]| {
            let px = camera.pixel_from_point(&from_square.point(&Vec3::new(x, y, self.figures.depth_mm)))?;
            Some([px.x, px.y])
        };
        // Lenses bend straight lines: each side is drawn in pieces.
        let corners = &self.figures.swept_mm;
        let side = |k: usize, i: usize| {
            let (a, b, u) = (corners[k], corners[(k + 1) % 4], i as f64 / PIECES as f64);
            [a[0] + (b[0] - a[0]) * u, a[1] + (b[1] - a[1]) * u]
        };
        let swept = (0..=4 * PIECES).map(|n| side(n / PIECES % 4, n % PIECES));
        let round = (0..=4 * PIECES).map(|n| {
            let (y, x) = (n as f64 / (4 * PIECES) as f64 * std::f64::consts::TAU).sin_cos();
            [x, y].map(|v| v * self.figures.part_mm / 2.0)
        });
        Some([swept.map(pixel).collect::<Option<_>>()?, round.map(pixel).collect::<Option<_>>()?])
    }
}

/// The sweep over a part near the foot of the camera's axis. `halvings`: how often its step is halved, 0 to 3. A
/// step below a pixel's footprint averages the arm's scatter.
///
/// # Errors
/// A calibration is missing, a length is out of range, or the line lies outside the picture at that distance.
pub fn sweep(
    settings: &Settings,
    rig: &Rig,
    recipe: &Recipe,
    stated: Option<f64>,
    halvings: u32,
    board: &Board,
) -> Result<Sweep> {
    let (camera, hand_eye) = (rig.need_camera()?.value, rig.need_hand_eye()?.value);
    let plane = rig.need_laser_plane()?.value;
    let depth = volume::view(settings, rig)?.middle();
    let square = squarely(board, &hand_eye, depth);
    let field = field(&camera, depth);
    let short = (field[2] - field[0]).min(field[3] - field[1]);
    // Covers the part in any orientation, as far off the picture's middle as an operator leaves it.
    let [x0, y0, x1, y1] = recipe.drawing().bounds();
    let part = (x1 - x0).hypot(y1 - y0);
    let length = stated.map_or(Ok((part + 2.0 * ASIDE * short).min(short)), checked)?;
    // No finer than a pixel's footprint.
    let step = (STEP * recipe.cell_mm).max(depth / camera.fx) * 0.5f64.powi(halvings.min(3) as i32);
    let flanges = places::sweep(&square, &hand_eye, &plane, depth, length, step);
    let [low, high] = stripe(&plane, depth, &field)?;
    let along = Vec2::new(plane.normal.x, plane.normal.y).normalize();
    let across = Vec2::new(-along.y, along.x);
    let at = |far: f64, t: f64| (along * far + across * t).into();
    let ends = length / 2.0;
    let figures = SweepFigures {
        depth_mm: depth,
        length_mm: length,
        step_mm: length / (flanges.len() - 1) as f64,
        shots: flanges.len(),
        part_mm: part,
        field_mm: field,
        swept_mm: [at(-ends, low), at(-ends, high), at(ends, high), at(ends, low)],
        along_mm: ends - part / 2.0,
        across_mm: high.min(-low) - part / 2.0,
        volume_mm: volume::believed(settings, rig).map(|v| beside(&v, depth)),
        box_mm: settings.motion.as_ref().map(|l| inside(&l.workspace, [&square].into_iter().chain(&flanges))),
    };
    Ok(Sweep { square, flanges, figures })
}

/// Refuses a length outside [`STATED`].
///
/// # Errors
/// The length is not 5 to 1000 mm.
pub(super) fn checked(mm: f64) -> Result<f64> {
    if STATED.contains(&mm) {
        return Ok(mm);
    }
    Err(Fault::usage(format!("the sweep is {mm} mm; allowed: {} to {}", STATED.start(), STATED.end()))
        .next("correct the option"))
}

/// The flange pose from which the camera views the board along its normal; the turn about the normal is retained.
fn squarely(board: &Board, hand_eye: &Rigid<Flange, Camera>, depth: f64) -> Rigid<Base, Flange> {
    let [centre, normal] = board.surface;
    let start = board.start * *hand_eye;
    let x = start.rotation.column(0).into_owned();
    let x = (x - normal * x.dot(&normal)).normalize();
    let z = -normal;
    let rotation = Mat3::from_columns(&[x, z.cross(&x), z]);
    // The axis still meets the board where the operator aimed it.
    let axis = start.rotation.column(2).into_owned();
    let foot = start.translation + axis * ((centre - start.translation).dot(&normal) / axis.dot(&normal));
    let camera: Rigid<Base, Camera> = Rigid::new(rotation, foot + normal * depth);
    camera * hand_eye.inverse()
}

/// The area of the board that the picture's edges enclose, without lens distortion.
fn field(camera: &Intrinsics, depth: f64) -> [f64; 4] {
    let at = |px: f64, middle: f64, focal: f64| (px - middle) / focal * depth;
    // Edges, not centres, of the first and the last pixel.
    let (w, h) = (f64::from(camera.width) - 0.5, f64::from(camera.height) - 0.5);
    [
        at(-0.5, camera.cx, camera.fx),
        at(-0.5, camera.cy, camera.fy),
        at(w, camera.cx, camera.fx),
        at(h, camera.cy, camera.fy),
    ]
}

/// Start and end of the line on the board, along itself, from its point nearest to the foot of the axis.
fn stripe(plane: &Plane<Camera>, depth: f64, field: &[f64; 4]) -> Result<[f64; 2]> {
    let n = Vec2::new(plane.normal.x, plane.normal.y);
    let (from, along) = (n * ((plane.offset - plane.normal.z * depth) / n.norm_squared()), n.normalize());
    let way = Vec2::new(-along.y, along.x);
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for k in 0..2 {
        if way[k].abs() < 1e-12 {
            if from[k] < field[k] || from[k] > field[k + 2] {
                high = f64::NEG_INFINITY;
            }
            continue;
        }
        let (a, b) = ((field[k] - from[k]) / way[k], (field[k + 2] - from[k]) / way[k]);
        (low, high) = (low.max(a.min(b)), high.min(a.max(b)));
    }
    if low < high {
        return Ok([low, high]);
    }
    Err(Fault::refused(format!(
        "at {depth:.0} mm the line lies {:.1} mm beside the picture's middle, out of the picture",
        from.norm()
    ))
    .cause("in the working volume the laser plane is outside the picture, or it belongs to another rig")
    .next("state [working_volume] in station.toml where the line is seen, or calibrate the laser plane"))
}

/// How far the working volume extends in front of the board and behind it.
fn beside(v: &Volume, depth: f64) -> [f64; 2] {
    [depth - v.near_mm, v.far_mm - depth]
}

/// Smallest distance of the poses to a side of the box, positive inside.
fn inside<'a>(space: &Space, poses: impl Iterator<Item = &'a Rigid<Base, Flange>>) -> f64 {
    let side = |p: &Vec3| (0..3).map(|k| (p[k] - space.from_mm[k]).min(space.to_mm[k] - p[k])).fold(f64::MAX, f64::min);
    poses.map(|p| side(&p.translation)).fold(f64::MAX, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::Station;

    #[test]
    fn what_is_left_beside_a_sweep_is_what_its_poses_leave() {
        let rig = Station::random(3).calibrations(None);
        let recipe = Recipe::parse(include_str!("../../../data/recipes/led.toml")).unwrap();
        let mut settings = Settings::default();
        let depth = volume::view(&settings, &rig).unwrap().middle();
        let board = Board::presumed(&settings, &rig, None, Some(1.3 * depth)).unwrap();
        let s = sweep(&settings, &rig, &recipe, Some(60.0), 0, &board).unwrap();
        let f = &s.figures;
        assert_eq!((f.shots, f.length_mm), (s.flanges.len(), 60.0));
        // The sheet, moved along, meets the board at the stated corners, and there the camera sees it at its
        // picture's edge.
        let (hand_eye, plane) = (rig.hand_eye.as_ref().unwrap().value, rig.laser_plane.as_ref().unwrap().value);
        let camera = rig.camera.as_ref().unwrap().value;
        let base_from_square = s.square * hand_eye;
        for (flange, ends) in [(&s.flanges[0], [0, 1]), (s.flanges.last().unwrap(), [2, 3])] {
            let at = *flange * hand_eye;
            for k in ends {
                let [x, y] = f.swept_mm[k];
                let place = base_from_square.point(&Vec3::new(x, y, depth));
                assert!(at.plane(&plane).distance(&place).abs() < 1e-9);
                assert!((board.surface[1].dot(&(place - board.surface[0]))).abs() < 1e-9, "on the board");
                let seen = at.inverse().point(&place);
                let px = [camera.fx * seen.x / seen.z + camera.cx, camera.fy * seen.y / seen.z + camera.cy];
                let edge = [
                    px[0] + 0.5,
                    px[1] + 0.5,
                    f64::from(camera.width) - 0.5 - px[0],
                    f64::from(camera.height) - 0.5 - px[1],
                ];
                assert!(edge.iter().any(|e| e.abs() < 1e-6) && edge.iter().all(|e| *e > -1e-6), "{edge:?}");
            }
        }
        assert!((f.along_mm - (30.0 - f.part_mm / 2.0)).abs() < 1e-12 && f.across_mm > 0.0, "{f:?}");
        assert!(sweep(&settings, &rig, &recipe, Some(4.0), 0, &board).is_err());
        // From the square pose itself the first and last stripe end at the picture's edges, except for lens
        // distortion.
        let [swept, round] = s.seen(&rig, &s.square).unwrap();
        assert!(swept.len() == 33 && swept[0] == swept[32] && round[0][0] - round[16][0] > 100.0, "{swept:?}");
        let wide = camera.fx * f.part_mm / depth;
        assert!(((round[0][0] - round[16][0]) / wide - 1.0).abs() < 0.05, "{round:?}");
        // The box ends 7 mm beyond the last shot.
        let last = s.flanges.last().unwrap().translation;
        let far = Vec3::repeat(1e4);
        let space = |to: Vec3| Space { from_mm: (-far).into(), to_mm: to.into() };
        settings.motion = Some(crate::arm::rules::Limits::within(space(far)));
        let wide = sweep(&settings, &rig, &recipe, Some(60.0), 0, &board).unwrap().figures.box_mm.unwrap();
        assert!(wide > 5e3, "{wide}");
        let way = last - s.flanges[0].translation;
        let k = (0..3).max_by(|a, b| way[*a].abs().total_cmp(&way[*b].abs())).unwrap();
        let mut box_ = space(far);
        if way[k] > 0.0 {
            box_.to_mm[k] = last[k] + 7.0;
        } else {
            box_.from_mm[k] = last[k] - 7.0;
        }
        settings.motion = Some(crate::arm::rules::Limits::within(box_));
        let near = sweep(&settings, &rig, &recipe, Some(60.0), 0, &board).unwrap().figures.box_mm.unwrap();
        assert!((near - 7.0).abs() < 1e-9, "{near}");
    }
}
