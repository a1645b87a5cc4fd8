//! In: the pose of a found part, its drawing, a rig whose camera is on the robot, the flange's pose. Out: the
//! part's outlines in that camera's picture. If they do not lie on the pictured part, the calibration, the pose or
//! the part differs from what was assumed.
//! Frame and unit: base frame, mm; pixels of the camera's picture, an integer pixel is a pixel's centre.

use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::find::Drawing;
use crate::geometry::{Base, Camera, Flange, Part, Rigid, Vec2, Vec3};
use crate::rig::{Rig, hash_text};
use std::path::Path;

/// Length of an outline's pieces as a share of the distance to the camera: a lens bends straight lines.
const PIECE: f64 = 0.01;
/// Most pieces of one edge.
const MOST_PIECES: f64 = 400.0;

/// The fields of a `find` report that are needed to draw the part.
#[derive(Clone, Debug, serde::Deserialize)]
pub struct Lies {
    /// Name of the recipe of the search.
    pub recipe: String,
    /// Frame of the pose.
    pub frame: String,
    /// The part as measured, mm.
    pub base_from_part: Rigid<Base, Part>,
}

impl Lies {
    /// Reads a report of `find`.
    ///
    /// # Errors
    /// There is no such file, or it is not a report of `find`.
    pub fn load(path: &Path) -> Result<Lies> {
        Lies::parse(&crate::files::read_text(path)?).map_err(|e| e.at(path.display()))
    }

    /// Reads the text of a report of `find`.
    ///
    /// # Errors
    /// The text is not such a report.
    pub fn parse(text: &str) -> Result<Lies> {
        serde_json::from_str(text).map_err(|e| {
            Fault::input(format!("is not a report of a part that was found: {e}"))
                .cause(format!("another file (SHA-256 {:.12})", hash_text(text.as_bytes())))
                .next("give the JSON that sheetlight find --out wrote")
        })
    }

    /// The drawing's outlines at the part's pose, in the report's frame, mm; closed ones end where they begin.
    pub fn outlines(&self, drawing: &Drawing) -> Vec<Vec<Vec3>> {
        let place = |line: Vec<Vec3>| line.iter().map(|p| self.base_from_part.point(p)).collect();
        drawing.outlines().into_iter().map(place).collect()
    }
}

/// Those outlines in the picture of the camera on the flange, px; a line ends where it leaves the range of the
/// lens.
///
/// # Errors
/// The pose is in a frame other than the robot's base, or the rig lacks camera or hand-eye.
pub fn ghost(lies: &Lies, drawing: &Drawing, rig: &Rig, flange: &Rigid<Base, Flange>) -> Result<Vec<Vec<[f64; 2]>>> {
    if lies.frame != "base" {
        return Err(Fault::refused(format!("the part lies in the frame '{}', not in the robot's base", lies.frame))
            .cause("its scan was made on an axis, or came from another sensor")
            .next("look at it in three dimensions instead"));
    }
    rig.belong_together()?;
    let (camera, hand_eye) = (rig.need_camera()?.value, rig.need_hand_eye()?.value);
    let camera_from_base: Rigid<Camera, Base> = (*flange * hand_eye).inverse();
    let seen = |line: &Vec<Vec3>| {
        let line: Vec<Vec3> = line.iter().map(|p| camera_from_base.point(p)).collect();
        pictured(&camera, &line)
    };
    Ok(lies.outlines(drawing).iter().flat_map(seen).collect())
}

/// Projects a line of the camera's frame into the picture, split into its visible pieces.
fn pictured(camera: &Intrinsics, line: &[Vec3]) -> Vec<Vec<[f64; 2]>> {
    let mut out = vec![Vec::new()];
    let mut add = |p: Vec3| match pixel(camera, &p) {
        Some(px) => out.last_mut().expect("begun").push([px.x, px.y]),
        None if out.last().is_some_and(|l| !l.is_empty()) => out.push(Vec::new()),
        None => {}
    };
    for pair in line.windows(2) {
        let length = (pair[1] - pair[0]).norm();
        let pieces = (length / (PIECE * pair[0].z.abs().max(1.0))).ceil().clamp(1.0, MOST_PIECES);
        (0..pieces as usize).for_each(|k| add(pair[0] + (pair[1] - pair[0]) * (k as f64 / pieces)));
    }
    line.last().into_iter().for_each(|p| add(*p));
    out.retain(|l| l.len() > 1);
    out
}

/// The pixel of a point; `None` beyond the range of the lens polynomial, where it folds back.
fn pixel(camera: &Intrinsics, p: &Vec3) -> Option<Vec2> {
    let connected = p.z > 0.0 && camera.distortion.connected(&Vec2::new(p.x / p.z, p.y / p.z));
    camera.pixel_from_point(p).filter(|_| connected)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Intrinsics {
        let distortion = crate::camera::Distortion::from_opencv(&[-0.2, 0.05, 0.0, 0.0, 0.0]).unwrap();
        Intrinsics { fx: 700.0, fy: 700.0, cx: 320.0, cy: 240.0, skew: 0.0, distortion, width: 640, height: 480 }
    }

    /// Each point of the drawn line lies on the picture of the straight edge, which the lens has bent.
    #[test]
    fn a_straight_edge_is_drawn_as_the_lens_bends_it() {
        let (camera, a, b) = (camera(), Vec3::new(-60.0, -50.0, 200.0), Vec3::new(70.0, -52.0, 230.0));
        let lines = pictured(&camera, &[a, b]);
        assert_eq!(lines.len(), 1);
        let chord = |t: f64| camera.pixel_from_point(&(a + (b - a) * t)).unwrap();
        let (first, last, middle) = (chord(0.0), chord(1.0), chord(0.5));
        let sag = (middle - (first + last) * 0.5).norm();
        assert!(sag > 2.0, "the lens bends by {sag} px");
        // Between its points the line is straight: they are dense enough for a tenth of a pixel.
        let off = (0..=1000).map(|k| {
            let p = chord(f64::from(k) / 1000.0);
            let to = |w: &[[f64; 2]]| {
                let (q, d) = (Vec2::from(w[0]), Vec2::from(w[1]) - Vec2::from(w[0]));
                (p - q - d * ((p - q).dot(&d) / d.norm_squared()).clamp(0.0, 1.0)).norm()
            };
            lines[0].windows(2).map(to).fold(f64::INFINITY, f64::min)
        });
        assert!(off.fold(0.0, f64::max) < 0.1);
    }

    #[test]
    fn what_lies_behind_the_camera_is_not_drawn() {
        let through = [Vec3::new(0.0, 0.0, 100.0), Vec3::new(10.0, 0.0, -100.0), Vec3::new(20.0, 0.0, 100.0)];
        let lines = pictured(&camera(), &through);
        assert_eq!(lines.len(), 2, "one line before it, one after it: {lines:?}");
        assert!(lines.iter().flatten().flatten().all(|v| v.is_finite()));
    }

    #[test]
    fn another_frame_is_refused() {
        let text = r#"{"recipe":"a","frame":"axis","base_from_part":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"more":1}"#;
        let lies = Lies::parse(text).unwrap();
        let no = ghost(&lies, &Drawing { shape: vec![] }, &Rig::default(), &Rigid::identity()).unwrap_err();
        assert!(no.what.contains("'axis'"), "{no}");
        assert!(Lies::parse("{}").is_err());
    }
}
