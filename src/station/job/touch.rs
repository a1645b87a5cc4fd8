//! In: a job's arm, camera and pointer. Out: the board's plane, from touches around the picture's middle; if these
//! meet several surfaces, from further touches around those that lie on one.
//! Frame and unit: base frame; mm, degrees.

use super::machine::Job;
use super::places;
use super::record::Record;
use super::shoot::shoot;
use super::state::Phase;
use crate::arm::rules::Evidence;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Camera, Flange, Rigid, Vec3};
use crate::recording::{Beam, Recording};
use crate::station::range::{RangeReport, RangeRun, measure_range};
use crate::station::volume;

/// Touches of one board scatter about its plane by less than this share of the view's distance; a board's thickness
/// is more.
const ONE_PLANE: f64 = 0.002;
/// Largest scatter of the points about their plane, as a share of the view's distance; beyond it they are not one
/// board.
const FLAT: f64 = 0.01;
/// Spread of the repeated touches, as a share of the first ones' spread.
const AGAIN: f64 = 0.5;

/// Where touches are placed.
struct Around {
    /// In the camera's frame at its first pose, mm.
    middle: Vec3,
    /// Spread of the touches as a share of the first ones' spread.
    spread: f64,
    /// Name of the plan and of the folder of the pictures.
    name: &'static str,
}

impl Job<'_> {
    /// Touches the board with the pointer: once from the arm's pose, then at positions around it.
    pub(super) fn touch(&mut self) -> Result<Phase> {
        let (first, at) = self.first_touch()?;
        let base_from_camera = at * self.rig.need_hand_eye()?.value;
        let then = volume::view(&self.settings, &self.rig)?.middle();
        let around = Around { middle: Vec3::new(0.0, 0.0, first), spread: 1.0, name: "touch" };
        let touches = self.touch_around(&base_from_camera, &around, then)?;
        let (points, on) = self.on_one_plane(&touches, then)?;
        let touched = match on.len() {
            // The board ends in the picture, or parts stand on it: touches that met one surface indicate where to
            // touch again.
            0 => {
                let camera: Vec<Vec3> = points.iter().map(|p| base_from_camera.inverse().point(&p.1)).collect();
                let middle = places::most_on_one_plane(&camera, ONE_PLANE * then);
                self.operator.tell(&format!(
                    "the {} touches met several surfaces; once more, around {}",
                    points.len(),
                    if middle.is_some() { "those that met the same one" } else { "the picture's middle" }
                ));
                let again = Around { middle: middle.unwrap_or(around.middle), spread: AGAIN, name: "touch-again" };
                self.touch_around(&base_from_camera, &again, then)?
            }
            _ => touches,
        };
        let touched = self.board(touched, then)?;
        let surface = touched.surface.as_ref().expect("asked for");
        if !(surface.rms_mm <= FLAT * then) {
            return Err(Fault::refused(format!(
                "the touched points lie {:.2} mm about their plane, limit {:.2}",
                surface.rms_mm,
                FLAT * then
            ))
            .cause("the pointer met parts or the table instead of the board")
            .next("jog the arm so that more of the bare board is in view, then begin again"));
        }
        let [normal, centre] = [surface.normal, surface.centre_mm].map(Vec3::from);
        self.operator.tell(&format!(
            "normal {:.4} {:.4} {:.4}, good to {:.3} degrees; points to {:.3} mm",
            normal.x, normal.y, normal.z, surface.tilt_sigma_deg[0], surface.rms_mm
        ));
        self.state.surface = Some([centre, normal]);
        Ok(Phase::Scan)
    }

    /// Goes to positions around a middle and takes a picture of the pointer's spot at each.
    fn touch_around(
        &mut self,
        base_from_camera: &Rigid<Base, Camera>,
        around: &Around,
        then: f64,
    ) -> Result<Recording> {
        let camera = self.rig.need_camera()?.value;
        let half = [f64::from(camera.width) / camera.fx, f64::from(camera.height) / camera.fy]
            .map(|share| 0.28 * share * then * around.spread);
        let (hand_eye, pointer) = (self.rig.need_hand_eye()?.value, self.rig.need_pointer()?.value);
        let poses = places::touches(base_from_camera, &hand_eye, &pointer, &around.middle, then, half);
        let count = poses.len();
        let legs = poses.into_iter().map(|p| self.leg(p)).collect();
        let says = vec![format!(
            "the board is {:.1} mm from the camera; the pointer touches it at {count} places, from {then:.0} mm",
            around.middle.z
        )];
        let plan = self.plan(around.name, format!("touch the board at {count} places"), legs, Evidence::default());
        let folder = self.options.out.join(around.name);
        let mut record = Record::begin(&folder, around.name, Beam::Pointer, self.eye.pictures())?;
        self.go(around.name, says, "is the way free?", plan, &mut |eye, arm, _| {
            shoot(eye, arm, &mut record, Some(Beam::Pointer))
        })?;
        record.end()
    }

    /// The touched points by their pictures, and the indices of those that lie on one plane; empty if that is not
    /// more than half.
    fn on_one_plane(&self, touches: &Recording, distance: f64) -> Result<(Vec<(String, Vec3)>, Vec<usize>)> {
        let all = measure_range(touches, &self.rig, &RangeRun::default())?;
        let points: Vec<(String, Vec3)> =
            all.distances.into_iter().filter_map(|d| Some((d.picture, Vec3::from(d.point_base_mm?)))).collect();
        let at: Vec<Vec3> = points.iter().map(|p| p.1).collect();
        let on = places::on_one_plane(&at, ONE_PLANE * distance);
        // Three always lie on one plane.
        Ok((points, if on.len() < 4 { Vec::new() } else { on }))
    }

    /// The plane of the touches that lie on one; the others met a part, or something beside the board.
    fn board(&self, mut touches: Recording, distance: f64) -> Result<RangeReport> {
        let (points, on) = self.on_one_plane(&touches, distance)?;
        if on.is_empty() {
            return Err(Fault::refused(format!(
                "at most half of {} touches lie on one plane within {:.2} mm",
                points.len(),
                ONE_PLANE * distance
            ))
            .cause("the pointer met parts or the table instead of the board")
            .next("jog the arm so that more of the bare board is in view, then begin again"));
        }
        let counted: Vec<&str> = on.iter().map(|&i| points[i].0.as_str()).collect();
        touches.meta.frames.retain(|f| f.laser.as_deref().is_some_and(|name| counted.contains(&name)));
        measure_range(&touches, &self.rig, &RangeRun { one_surface: true, ..RangeRun::default() })
    }

    /// Measures the distance of the board and the flange pose; nothing moves.
    fn first_touch(&mut self) -> Result<(f64, Rigid<Base, Flange>)> {
        let mut record =
            Record::begin(&self.options.out.join("first"), "first touch", Beam::Pointer, self.eye.pictures())?;
        let link = self.guard.link();
        let shot = shoot(&mut self.eye, link, &mut record, Some(Beam::Pointer));
        self.eye.lights.after(shot)?;
        let at = link.pose()?.base_from_flange;
        // The operator chose this position, and an edge may be there. The touches around it are on the board and
        // count fully.
        let seen = measure_range(&record.end()?, &self.rig, &RangeRun { coarse: true, ..RangeRun::default() });
        let missing = |what: String| {
            Fault::refused(format!("the pointer's spot is not in the first picture: {what}"))
                .cause(
                    "the board is out of view or out of the pointer's range, or the pointer is not switched by \
                        its output",
                )
                .next("jog the arm until the board is in view, check that the pointer is on, then begin again")
        };
        let seen = seen.map_err(|e| missing(e.what))?;
        let first = seen
            .distances
            .first()
            .ok_or_else(|| missing(seen.missing.first().map_or_else(String::new, |m| m.1.clone())))?;
        Ok((first.along_axis_mm, at))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{lit, machine, places, sweep};

    #[test]
    fn the_document_states_the_numbers_of_a_job() {
        let document = include_str!("../../../docs/robots.md").split_whitespace().collect::<Vec<_>>().join(" ");
        for (says, is) in [
            ("Then it touches eight points around the picture's middle", places::TOUCHES.len() == 8),
            ("eight more points are touched, half as far apart", super::AGAIN == 0.5),
            ("If its stripe covers less than a tenth of the picture", lit::LEAST_SHARE == 0.1),
            ("an eighth of the field's short side at both ends", sweep::ASIDE == 1.0 / 8.0),
            ("the line sweeps once more in steps half as long", machine::HALVINGS == 1),
            ("the sweep moves there, at most twice", machine::MOVES == 2),
        ] {
            assert!(document.contains(says) && is, "docs/robots.md: {says}");
        }
    }
}
