//! In: a recording of the pointer on the board, one of the line over the part, a recipe, a station. Out: the
//! semi-autonomous procedure step by step — normal, view pose, scan, part, approach, insertion, retract — each with
//! its numbers and, where a person has to decide, a question.
//! Frame and unit: base frame; mm, degrees.

use super::range::{RangeReport, RangeRun, SurfaceFound, measure_range};
use super::scan::options::ScanOptions;
use super::scan::recorded::scan_recording;
use super::scan::report::ScanReport;
use super::settings::Settings;
use super::volume;
use crate::fault::{Fault, Result};
use crate::find::insert::locate::Poses;
use crate::find::insert::picture;
use crate::find::{Accelerator, LocateOptions, Recipe, Report, locate};
use crate::geometry::{Base, Camera, Flange, Mat3, Rigid, Vec3};
use crate::recording::Recording;
use crate::rig::{Rig, Volume};
use crate::robot::Convention;
use crate::scan::Where;
use std::path::PathBuf;

/// Inputs and options of the procedure.
#[derive(Clone, Debug)]
pub struct GuideOptions {
    /// Folder of the station: station.toml and calibrations.
    pub station: PathBuf,
    /// Recording of the pointer's spot on three or more places of the board, with robot poses.
    pub touch: PathBuf,
    /// Name of the pose file in `touch`; `None`: the one that meta.json names.
    pub touch_poses: Option<String>,
    /// Recording of the line over the part, with robot poses.
    pub scan: PathBuf,
    /// Name of the pose file in `scan`; `None`: the one that meta.json names.
    pub scan_poses: Option<String>,
    /// File of the part's recipe.
    pub recipe: PathBuf,
    /// Folder for the scan, the report, the picture and guide.json.
    pub out: PathBuf,
    /// Notation of the poses.
    pub robot: Convention,
    /// Where the scan's stages run.
    pub place: Where,
    /// Distance of the camera from the board in the square view, mm; `None`: the middle of the rig's working
    /// volume.
    pub view_mm: Option<f64>,
    /// Largest angle between the touched board and the found part, degrees, 0.1 to 20: a part may be slightly
    /// tilted.
    pub max_tilt_deg: f64,
}

/// A step that was completed or is about to begin.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Step {
    /// One or two words, e.g. "approach".
    pub name: &'static str,
    /// What was found or will be done, one sentence a line.
    pub says: Vec<String>,
    /// The question for the operator; `None` where nothing moves.
    pub asks: Option<String>,
    /// The flange or tool pose that the step moves to, in the robot's notation.
    pub pose: Option<Vec<f64>>,
}

/// The procedure's result.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Guided {
    /// The steps in the order in which they were done.
    pub steps: Vec<Step>,
    /// True when every step was done and confirmed.
    pub finished: bool,
    /// Notation of the steps' poses, see [`Convention::name`].
    pub convention: &'static str,
    /// Unit normal of the touched board, towards the camera; base frame.
    pub normal: [f64; 3],
    /// Angle between the part's top and the touched board, degrees.
    pub tilt_to_part_deg: f64,
    /// The report on the found part.
    pub report: Report,
}

impl GuideOptions {
    /// Refuses numbers outside their ranges.
    pub fn check(&self) -> Result<()> {
        let (tilt, view) = (self.max_tilt_deg, self.view_mm.unwrap_or(1.0));
        if !(0.1..=20.0).contains(&tilt) {
            return Err(Fault::usage(format!("max_tilt_deg is {tilt}; allowed: 0.1 to 20")).next("correct the option"));
        }
        if !(view > 0.0 && view.is_finite()) {
            return Err(
                Fault::usage(format!("view_mm is {view}, a distance above 0 is needed")).next("correct the option")
            );
        }
        Ok(())
    }

    fn scan_folder(&self) -> PathBuf {
        self.out.join("scan")
    }
}

/// Runs the procedure. `confirm` is shown every step and answers its question; a "no" ends the procedure with a
/// refusal that names the step. Nothing is moved here: the poses are for the robot's own program.
pub fn guide(options: &GuideOptions, confirm: &mut dyn FnMut(&Step) -> Result<bool>) -> Result<Guided> {
    options.check()?;
    let recipe = Recipe::load(&options.recipe)?;
    let (settings, rig) = (Settings::load(&options.station)?, Rig::load(&options.station)?);
    rig.belong_together()?;
    let hand_eye = rig.need_hand_eye()?.value;
    let mut run = Run { options, recipe, settings, rig, confirm, steps: Vec::new() };
    let surface = run.touch()?;
    let normal = Vec3::from(surface.normal);
    run.look_squarely(&surface, &hand_eye)?;
    let scanned = run.scan()?;
    let (report, tilt) = run.find(&normal)?;
    let poses = run.poses(&report, tilt)?;
    run.ask_found(&report, &scanned, tilt)?;
    run.insert(&poses)?;
    let guided = Guided {
        steps: run.steps,
        finished: true,
        convention: options.robot.name(),
        normal: surface.normal,
        tilt_to_part_deg: tilt,
        report,
    };
    let text = serde_json::to_string_pretty(&guided).expect("plain data");
    crate::files::write(&options.out.join("guide.json"), text.as_bytes())?;
    Ok(guided)
}

/// The procedure under way.
struct Run<'a> {
    options: &'a GuideOptions,
    recipe: Recipe,
    settings: Settings,
    rig: Rig,
    confirm: &'a mut dyn FnMut(&Step) -> Result<bool>,
    steps: Vec<Step>,
}

impl Run<'_> {
    /// Shows a step; refuses if the operator says no.
    fn pass(&mut self, step: Step) -> Result<()> {
        let go = (self.confirm)(&step)?;
        let name = step.name;
        self.steps.push(step);
        if go {
            return Ok(());
        }
        Err(Fault::refused(format!("stopped at '{name}' by the operator")).next("start again when the cell is ready"))
    }

    /// Measures the board from the pointer's spots on it.
    fn touch(&mut self) -> Result<SurfaceFound> {
        let touched = measure_range(
            &Recording::open(&self.options.touch)?,
            &self.rig,
            &RangeRun { poses: self.options.touch_poses.clone(), one_surface: true, ..RangeRun::default() },
        )?;
        self.pass(Step { name: "touch", says: touched_words(&touched), asks: None, pose: None })?;
        Ok(touched.surface.expect("asked for"))
    }

    /// Computes the flange pose from which the camera views the board squarely.
    fn look_squarely(&mut self, surface: &SurfaceFound, hand_eye: &Rigid<Flange, Camera>) -> Result<()> {
        let far = match self.options.view_mm {
            Some(mm) => Volume::new(mm, mm, "stated"),
            None => volume::view(&self.settings, &self.rig)?,
        };
        let centre = Vec3::from(surface.centre_mm);
        let view = square_view(&surface.base_from_tool.rotation, &centre, far.middle(), hand_eye);
        self.pass(Step {
            name: "look squarely",
            says: vec![format!(
                "the camera {} mm above the board ({}), its axis along the normal",
                far.depth(far.middle()),
                far.from
            )],
            asks: Some("move the flange to this pose?".into()),
            pose: Some(self.options.robot.write(&view)),
        })
    }

    /// Scans the part with the line.
    fn scan(&mut self) -> Result<ScanReport> {
        let options = self.options;
        self.pass(Step {
            name: "scan",
            says: vec![format!("the line sweeps over the part: {}", options.scan.display())],
            asks: Some("is the path free?".into()),
            pose: None,
        })?;
        let recording = Recording::open(&options.scan)?;
        let poses = options.scan_poses.as_deref();
        let settings = ScanOptions::for_station(&self.settings, &self.rig, &options.scan_folder());
        scan_recording(&recording, poses, &self.rig, &ScanOptions { place: options.place, ..settings }, |_, _| {})
    }

    /// Finds the part in the scan and draws it for the operator; also returns the angle between its top and the
    /// board, degrees.
    fn find(&self, normal: &Vec3) -> Result<(Report, f64)> {
        let (options, folder) = (self.options, self.options.scan_folder());
        let (cloud, shots) = (super::lit_cloud_of(&folder)?, super::shots_of(&folder)?);
        let accelerator = (options.place != Where::Cpu).then(Accelerator::open).flatten();
        let locate_options =
            LocateOptions { up: Some(*normal), robot: options.robot, accelerator, ..LocateOptions::default() };
        let report = locate(&cloud, &shots, &self.recipe, Some(&self.rig), &locate_options)?;
        picture::draw(&report, &self.recipe.drawing()).save_png(&options.out.join("found.png"))?;
        let tilt = report.base_from_part.direction(&Vec3::z()).dot(normal).clamp(-1.0, 1.0).acos().to_degrees();
        Ok((report, tilt))
    }

    /// The tool's poses; refuses if a gate failed or the part is tilted against the board.
    fn poses(&self, report: &Report, tilt: f64) -> Result<Poses> {
        let Some(poses) = report.poses.clone() else {
            return Err(Fault::refused(format!("no pose: {}", report.reasons.join("; ")))
                .cause("the part is hidden in part, another one, or too badly seen")
                .next(format!("look at {}", self.options.out.join("found.png").display())));
        };
        if tilt > self.options.max_tilt_deg {
            return Err(Fault::refused(format!(
                "the part's top is {tilt:.2} degrees off the touched board, limit {}",
                self.options.max_tilt_deg
            ))
            .cause("the part is not fully seated, or the pointer touched something else than the board")
            .next("look at the board, then start again"));
        }
        Ok(poses)
    }

    fn ask_found(&mut self, report: &Report, scanned: &ScanReport, tilt: f64) -> Result<()> {
        let ([x, y, z], [rx, ry, rz]) = (report.sigma_mm, report.sigma_deg);
        let mut says = vec![
            format!("{} points from {} shots", scanned.points, scanned.shots),
            format!("'{}' found with score {:.3}; {} edges", report.recipe, report.found.score, report.edges),
            format!("sigma {x:.3} {y:.3} {z:.3} mm, {rx:.3} {ry:.3} {rz:.3} degrees"),
            format!("the part's top and the touched board differ by {tilt:.2} degrees"),
        ];
        says.extend(report.notes.iter().chain(&scanned.remarks).cloned());
        self.pass(Step { name: "find", says, asks: Some("is the part where the picture shows it?".into()), pose: None })
    }

    fn insert(&mut self, poses: &Poses) -> Result<()> {
        for (name, pose, question) in [
            ("approach", &poses.approach, "move the tool to the approach pose?"),
            ("insert", &poses.insertion, "insert?"),
            ("retract", &poses.retract, "is the part in? retract?"),
        ] {
            let says = vec![format!("{}: {}", pose.convention, pose.labels.join(", "))];
            self.pass(Step { name, says, asks: Some(question.into()), pose: Some(pose.numbers.clone()) })?;
        }
        Ok(())
    }
}

fn touched_words(r: &RangeReport) -> Vec<String> {
    let mut out: Vec<String> = r
        .distances
        .iter()
        .map(|d| {
            format!(
                "{}: {:.3} mm from the camera along its axis, sigma {:.3}",
                d.picture, d.along_axis_mm, d.along_axis_sigma_mm
            )
        })
        .collect();
    out.extend(r.missing.iter().map(|(name, why)| format!("{name}: no distance: {why}")));
    if let Some(s) = &r.surface {
        out.push(format!(
            "normal {:.4} {:.4} {:.4}, good to {:.3} degrees; points to {:.3} mm",
            s.normal[0], s.normal[1], s.normal[2], s.tilt_sigma_deg[0], s.rms_mm
        ));
        out.extend(
            s.left_out.iter().map(|n| format!("{n} was excluded: its spot does not lie on the plane of the others")),
        );
    }
    out
}

/// The flange pose for a camera view along the surface's normal at its centre. `tool` has z out of the surface; the
/// camera's z points into it, its x along the tool's x.
fn square_view(
    tool: &Mat3,
    centre: &Vec3,
    distance: f64,
    flange_from_camera: &Rigid<Flange, Camera>,
) -> Rigid<Base, Flange> {
    let (x, y, z) = (tool.column(0).into_owned(), tool.column(1).into_owned(), tool.column(2).into_owned());
    let base_from_camera: Rigid<Base, Camera> = Rigid::new(Mat3::from_columns(&[x, -y, -z]), centre + z * distance);
    base_from_camera * flange_from_camera.inverse()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_view_looks_at_the_centre_along_the_normal() {
        let tool = crate::geometry::exp(&Vec3::new(0.2, -0.1, 0.7));
        let hand_eye: Rigid<Flange, Camera> =
            Rigid::from_vectors(&Vec3::new(0.02, -0.01, -1.5), Vec3::new(-46.0, 1.4, 93.0));
        let centre = Vec3::new(400.0, -30.0, 60.0);
        let base_from_camera = square_view(&tool, &centre, 150.0, &hand_eye) * hand_eye;
        let seen = base_from_camera.inverse().point(&centre);
        assert!((seen - Vec3::new(0.0, 0.0, 150.0)).norm() < 1e-9);
        assert!((base_from_camera.direction(&Vec3::z()) + tool.column(2)).norm() < 1e-12);
    }
}
