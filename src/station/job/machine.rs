//! In: a job's state, a robot behind its rules, a camera, a station, a recipe, a person. Out: the job done, or
//! stopped with its phase stored. After a crash at any moment the stored state allows it to resume or back out.
//! Frame and unit: base frame; mm, mm/s, degrees, s.

use super::eye::Eye;
use super::lit::line_is_seen;
use super::operator::{Ask, Operator};
use super::record::Record;
use super::report::JobReport;
use super::shoot::{settle, shoot};
use super::state::{BACKED_OUT, JobState, Phase, Resumes};
use super::sweep::{Board, checked, sweep};
use crate::arm::rules::{Confirmation, Evidence, Guard, Plan, Proposal};
use crate::arm::{Arm, Motion, Switchboard, Way};
use crate::fault::{Fault, Gate, Kind, Result};
use crate::find::insert::picture;
use crate::find::{CutOff, LocateOptions, Recipe, Report, beyond_rim, locate};
use crate::geometry::{Base, Flange, Rigid, Vec3};
use crate::recording::{self, Beam};
use crate::rig::{Rig, hash_file, hash_text};
use crate::robot::Convention;
use crate::scan::{Where, parts_for};
use crate::station::scan::options::ScanOptions;
use crate::station::scan::recorded::scan_recording;
use crate::station::scan::report::{lit_cloud_of, load_report, shots_of};
use crate::station::settings::Settings;
use std::path::PathBuf;
use std::time::Instant;

/// Inputs and options of a job.
#[derive(Clone, Debug)]
pub struct JobOptions {
    /// Folder of the station.
    pub station: PathBuf,
    /// File of the part's recipe.
    pub recipe: PathBuf,
    /// Folder of the job: its state, recordings, scan, report.
    pub out: PathBuf,
    /// Notation of the poses that are shown.
    pub robot: Convention,
    /// Where the scan's stages run.
    pub place: Where,
    /// Speed of every motion, mm/s; `None`: the station's limit.
    pub speed_mm_s: Option<f64>,
    /// Length of the line's sweep about the picture's middle, mm, 5 to 1000. `None`: over the part plus an eighth
    /// of the field's short side on both sides, at most that short side.
    pub sweep_mm: Option<f64>,
    /// Largest angle between the part's top and the touched board, degrees, 0.1 to 20.
    pub max_tilt_deg: f64,
}

/// A job that is under way.
pub struct Job<'a> {
    pub(super) options: &'a JobOptions,
    pub(super) settings: Settings,
    pub(super) rig: Rig,
    recipe: Recipe,
    pub(super) guard: &'a mut Guard,
    pub(super) eye: Eye,
    pub(super) operator: &'a mut dyn Operator,
    pub(super) state: JobState,
    /// The kind of the fault that stopped it.
    kind: Option<Kind>,
    found: Option<Report>,
    since: Instant,
}

/// How far the tool backs away from the board in a job that knows the board but no part yet, mm.
const AWAY_MM: f64 = 30.0;
/// Shorter motions are not made: an arm reads its own pose to some hundredths of a millimetre.
const LEAST_WAY_MM: f64 = 0.05;
/// How often the sweep is repeated for a part whose pose is too uncertain, each time with half the step.
pub(super) const HALVINGS: u32 = 1;
/// How often the sweep is moved towards a part that extends beyond the scan's edge; a piece of a part gives the
/// direction only roughly.
pub(super) const MOVES: usize = 2;

impl<'a> Job<'a> {
    /// Begins a job in a folder, or resumes the one that is stored there.
    ///
    /// # Errors
    /// Something that the job needs is missing in the station, or options are out of range.
    pub fn open(
        options: &'a JobOptions,
        guard: &'a mut Guard,
        camera: Box<dyn crate::capture::PictureSource>,
        operator: &'a mut dyn Operator,
    ) -> Result<Job<'a>> {
        if !(0.1..=20.0).contains(&options.max_tilt_deg) {
            return Err(Fault::usage(format!("max_tilt_deg is {}; allowed: 0.1 to 20", options.max_tilt_deg))
                .next("correct the option"));
        }
        options.sweep_mm.map(checked).transpose()?;
        let (settings, rig, recipe) =
            (Settings::load(&options.station)?, Rig::load(&options.station)?, Recipe::load(&options.recipe)?);
        rig.belong_together()?;
        rig.need_hand_eye()?;
        rig.need_pointer()?;
        let format = camera.format();
        rig.need_camera()?.same_pictures([format.width, format.height], camera.readout().as_ref())?;
        if settings.tool.is_none() {
            return Err(Fault::usage("the pose of the gripper's tool on the flange is unknown")
                .cause("station.toml has no [tool]")
                .next("write [tool] with flange_from_tool = [16 numbers] (docs/robots.md)"));
        }
        crate::files::make_folder(&options.out)?;
        // A job scans with the sensor on the robot.
        let used = parts_for(&rig, &recording::Motion::default());
        let made_from = hash_text(format!("{} {}", hash_file(&options.recipe)?, used.fingerprint()).as_bytes());
        let state = match JobState::load(&options.out)? {
            Some(state) => {
                state.goes_on_with(&made_from).map_err(|e| e.at(options.out.display()))?;
                state
            }
            None => JobState { made_from, ..JobState::new(guard.link().pose()?.base_from_flange) },
        };
        // The first action switches off what a killed program left on.
        let lights = Switchboard::of(guard.link(), settings.outputs.unwrap_or_default())?;
        let eye = Eye::new(camera, lights);
        let since = Instant::now();
        Ok(Job { options, settings, rig, recipe, guard, eye, operator, state, kind: None, found: None, since })
    }

    /// Does the remaining steps. If anything stops the job, the report says why; the arm then stands still and the
    /// lasers are off.
    ///
    /// # Errors
    /// The job's own files cannot be written.
    pub fn run(mut self) -> Result<JobReport> {
        let done = self.work();
        self.eye.lights.after(done)
    }

    /// Goes back up instead of on, and ends the job there.
    ///
    /// # Errors
    /// As [`Job::run`].
    pub fn back_out(mut self) -> Result<JobReport> {
        if self.state.resumes() != Resumes::Over {
            self.state.phase = Phase::Retract;
        }
        self.run()
    }

    fn work(&mut self) -> Result<JobReport> {
        self.pick_up()?;
        while !self.state.stopped && self.state.resumes() != Resumes::Over {
            let step = self.step();
            // Before anything is written, so that a full disk does not keep a laser on.
            let step = self.eye.lights.after(step);
            self.tick();
            match step {
                Ok(next) => self.state.phase = next,
                Err(fault) => {
                    self.operator.tell(&format!("stopped: {}", fault.what));
                    self.kind = Some(fault.kind);
                    self.state.why = fault.what;
                    self.state.stopped = true;
                    self.state.moving = self.guard.unknown().is_some();
                }
            }
            self.store()?;
        }
        let report = JobReport::of(&self.state, self.kind, self.found.take());
        let text = serde_json::to_string_pretty(&report).expect("plain data");
        crate::files::write(&self.options.out.join("report.json"), text.as_bytes())?;
        Ok(report)
    }

    /// Resumes what was stopped or interrupted: before the part it measures again, at the part it goes back up.
    fn pick_up(&mut self) -> Result<()> {
        if self.state.moving {
            let cut_off = "the last motion was cut off: where the arm is was not known, look at the robot";
            if !self.operator.looked(cut_off)? {
                return Err(Fault::refused("nobody has looked at the robot since its last motion was cut off")
                    .cause("the question was answered with no")
                    .next("look at the robot, then begin again"));
            }
            self.guard.looked()?;
        }
        match self.state.resumes() {
            Resumes::On | Resumes::Over => return Ok(()),
            Resumes::Anew => self.state.measure_anew(),
            Resumes::Up => self.state.phase = Phase::Retract,
        }
        (self.state.moving, self.state.stopped) = (false, false);
        self.state.why = String::new();
        self.store()
    }

    /// Adds the time passed to the current phase.
    fn tick(&mut self) {
        let passed = std::mem::replace(&mut self.since, Instant::now()).elapsed().as_secs_f64();
        self.state.seconds += passed;
        *self.state.seconds_by_phase.entry(self.state.phase).or_default() += passed;
    }

    fn store(&mut self) -> Result<()> {
        self.tick();
        self.state.store(&self.options.out)
    }

    fn step(&mut self) -> Result<Phase> {
        match self.state.phase {
            Phase::Touch => self.touch(),
            Phase::Scan => self.scan(),
            Phase::Find => self.find(),
            Phase::Approach => self.approach(),
            Phase::Insert => self.insert(),
            Phase::Retract => self.retract(),
            over => Ok(over),
        }
    }

    fn speed(&self) -> f64 {
        let of_station = self.guard.limits().map_or(50.0, |l| l.speed_mm_s);
        self.options.speed_mm_s.unwrap_or(of_station)
    }

    pub(super) fn leg(&self, to: Rigid<Base, Flange>) -> Motion {
        Motion { to, way: Way::Straight, speed_mm_s: self.speed() }
    }

    /// Proposes a motion, asks, stores that it begins, executes it, and stores that it has ended.
    pub(super) fn go(
        &mut self,
        step: &'static str,
        says: Vec<String>,
        question: &'static str,
        plan: Plan,
        each: &mut dyn FnMut(&mut Eye, &mut dyn Arm, usize) -> Result<()>,
    ) -> Result<()> {
        finite(&plan)?;
        let (proposal, yes) = self.agreed(step, &says, question, plan)?;
        self.state.confirmations += 1;
        self.state.moving = true;
        self.store()?;
        let eye = &mut self.eye;
        let made = self.guard.make(&proposal, yes, &mut |arm, k| each(eye, arm, k));
        // What follows may take long: a person is asked, or pictures are measured.
        let made = self.eye.lights.after(made);
        self.operator.over();
        made?;
        self.state.moving = false;
        self.store()
    }

    /// Proposes until a person has answered yes or no.
    fn agreed(
        &mut self,
        step: &'static str,
        says: &[String],
        question: &'static str,
        plan: Plan,
    ) -> Result<(Proposal, Confirmation)> {
        loop {
            let proposal = self.guard.propose(plan.clone())?;
            if !proposal.passed() {
                return Err(Fault::refused(format!("{step}: {}", proposal.missed().join("; ")))
                    .next("look at what is named, then begin again"));
            }
            let ask = Ask { step, says: says.to_vec(), question, proposal: &proposal };
            if let Some(yes) = self.operator.confirm(&ask)? {
                return Ok((proposal, yes));
            }
            if !self.operator.again() {
                return Err(Fault::refused(format!("stopped at '{step}' by the operator"))
                    .next("begin again when the cell is ready"));
            }
        }
    }

    pub(super) fn plan(&self, name: &str, why: String, legs: Vec<Motion>, evidence: Evidence) -> Plan {
        Plan { name: name.into(), why, legs, evidence }
    }

    /// Moves the camera to its square view of the board and sweeps the line over it.
    fn scan(&mut self) -> Result<Phase> {
        let Some([centre, normal]) = self.state.surface else { return Ok(Phase::Touch) };
        line_is_seen(&mut self.eye, self.guard.link(), &self.rig, &self.settings, &self.options.out.join("lit"))?;
        // The view starts at the job's first pose, shifted along the board.
        let moved: Vec3 = self.state.moved_mm.iter().sum();
        let start = Rigid::new(self.state.start.rotation, self.state.start.translation + moved);
        let board = Board { start, surface: [centre, normal] };
        let planned =
            sweep(&self.settings, &self.rig, &self.recipe, self.options.sweep_mm, self.state.halvings, &board)?;
        let (says, shots, length) = (planned.figures.says(), planned.figures.shots, planned.figures.length_mm);
        let legs = [planned.square].into_iter().chain(planned.flanges).map(|p| self.leg(p)).collect();
        let evidence = Evidence { normal: Some(normal), ..Evidence::default() };
        let plan = self.plan("scan", format!("look squarely, then {shots} shots over {length:.0} mm"), legs, evidence);
        let mut record = Record::begin(&self.options.out.join("line"), "scan", Beam::Line, self.eye.pictures())?;
        self.go("scan", says, "is the path free?", plan, &mut |eye, arm, k| match k {
            0 => {
                settle();
                let at = arm.pose()?;
                record.ambient(&eye.picture(None)?, &at)
            }
            _ => shoot(eye, arm, &mut record, Some(Beam::Line)),
        })?;
        let recording = record.end()?;
        let folder = self.options.out.join("scan");
        let run =
            ScanOptions { place: self.options.place, ..ScanOptions::for_station(&self.settings, &self.rig, &folder) };
        let scanned = scan_recording(&recording, None, &self.rig, &run, |_, _| {})?;
        self.operator.tell(&format!("{} points from {} shots", scanned.points, scanned.shots));
        self.state.scanned_at = Some(now_s());
        Ok(Phase::Find)
    }

    fn find(&mut self) -> Result<Phase> {
        let Some([_, normal]) = self.state.surface else { return Ok(Phase::Touch) };
        let folder = self.options.out.join("scan");
        let (cloud, shots) = (lit_cloud_of(&folder)?, shots_of(&folder)?);
        let options = LocateOptions { up: Some(normal), robot: self.options.robot, ..LocateOptions::default() };
        let report = match locate(&cloud, &shots, &self.recipe, Some(&self.rig), &options) {
            Ok(report) => report,
            Err(fault) => {
                return match beyond_rim(&cloud, &shots, &self.recipe, &options)? {
                    Some(cut) => self.sweep_there(&cut, normal).ok_or(fault),
                    None => Err(fault),
                };
            }
        };
        self.keep(&report)?;
        let tilt = report.base_from_part.direction(&Vec3::z()).dot(&normal).clamp(-1.0, 1.0).acos().to_degrees();
        let (poses, reasons) = (report.poses.clone(), report.reasons.join("; "));
        let there = report.cut_off.as_ref().and_then(|cut| self.sweep_there(cut, normal));
        // The right part, but its pose is too uncertain: more shots give more data.
        let closer = report.gates.iter().all(|g| g.passed || g.name.starts_with("sigma"));
        self.operator.tell(&format!(
            "'{}' with score {:.3}, {tilt:.2} degrees off the board",
            report.recipe, report.found.score
        ));
        self.found = Some(report);
        let Some(poses) = poses else {
            if let Some(scan) = there {
                return Ok(scan);
            }
            if closer && self.state.halvings < HALVINGS {
                self.state.halvings += 1;
                self.operator.tell(&format!("{reasons}: once more, in steps half as long"));
                return Ok(Phase::Scan);
            }
            return Err(Fault::refused(format!("no pose: {reasons}")).next("look at found.png"));
        };
        if !(tilt <= self.options.max_tilt_deg) {
            return Err(Fault::refused(format!(
                "the part's top is {tilt:.2} degrees off the touched board, limit {}",
                self.options.max_tilt_deg
            ))
            .cause("the part is not fully seated, or it is another one")
            .next("look at the board, then begin again"));
        }
        let tool = self.settings.tool.expect("asked for").flange_from_tool.inverse();
        self.state.poses = Some([&poses.approach, &poses.insertion, &poses.retract].map(|p| p.base_from_tool * tool));
        Ok(Phase::Approach)
    }

    /// Repeats the sweep, moved along the board towards a part that extends beyond the scan's edge. The motion
    /// rules judge it like any other, and a person confirms it. `None`: it was moved often enough.
    fn sweep_there(&mut self, cut: &CutOff, normal: Vec3) -> Option<Phase> {
        if self.state.moved_mm.len() >= MOVES {
            return None;
        }
        let by = cut.sweep_by_mm - normal * cut.sweep_by_mm.dot(&normal);
        self.operator.tell(&format!("{}: once more, the sweep moved by {:.0} mm", cut.words(), by.norm()));
        self.state.moved_mm.push(by);
        Some(Phase::Scan)
    }

    /// Stores the result for viewers: the report, its picture, and the camera's picture of the part in room light.
    fn keep(&mut self, report: &Report) -> Result<()> {
        let text = serde_json::to_string_pretty(report).expect("plain data");
        let png = picture::draw(report, &self.recipe.drawing()).to_png();
        let out = &self.options.out;
        crate::files::write_beside((&out.join("found.json"), text.as_bytes()), &[(&out.join("found.png"), &png)])?;
        if let Err(fault) = self.eye.picture(None) {
            self.operator.tell(&format!("no picture of the part: {}", fault.what));
        }
        Ok(())
    }

    /// The evidence for a motion towards the part.
    fn evidence(&self) -> Result<Evidence> {
        let scan = load_report(&self.options.out.join("scan"))?;
        let mut measured: Vec<Gate> = self.found.as_ref().map_or(Vec::new(), |f| f.gates.clone());
        if let Some(f) = &self.found {
            measured.push(Gate::most(
                "3 sigma in the plane, mm",
                3.0 * f.sigma_mm[0].max(f.sigma_mm[1]),
                f.tolerance_mm,
            ));
        }
        Ok(Evidence {
            normal: self.state.surface.map(|s| s[1]),
            fingerprints: Some((scan.parts_of(&self.rig).fingerprint(), scan.rig_fingerprint)),
            scan_age_s: Some(self.state.scanned_at.map_or(f64::NAN, |t| now_s() - t)),
            measured,
        })
    }

    /// Finds the part again in the same scan, for a job that is resumed after a crash.
    fn found_again(&mut self) -> Result<()> {
        if self.found.is_some() || self.find()? == Phase::Approach {
            return Ok(());
        }
        Err(Fault::refused("the part is not found again in the scan that it was found in")
            .cause("the scan's folder was changed, or another version of the program scanned")
            .next("begin a new job in another folder"))
    }

    fn approach(&mut self) -> Result<Phase> {
        self.found_again()?;
        let [above, ..] = self.state.poses.expect("found");
        // First sideways at the present height, then down, so that the arm crosses no space that was not seen.
        let at = self.guard.link().pose()?.base_from_flange;
        let normal = self.state.surface.map_or(Vec3::z(), |s| s[1]);
        let higher = (at.translation - above.translation).dot(&normal).max(0.0);
        let over = Rigid::new(above.rotation, above.translation + normal * higher);
        let numbers = self.options.robot.write(&above);
        let says = vec![format!("above the part: {}", written(&numbers))];
        let plan = self.plan(
            "approach",
            "go above the part that was found".into(),
            vec![self.leg(over), self.leg(above)],
            self.evidence()?,
        );
        self.go("approach", says, "is the part where the picture shows it? go above it?", plan, &mut |_, _, _| Ok(()))?;
        self.store()?;
        self.state.seconds_to_position = Some(self.state.seconds);
        self.state.confirmations_to_position = Some(self.state.confirmations);
        Ok(Phase::Insert)
    }

    fn insert(&mut self) -> Result<Phase> {
        self.found_again()?;
        let [_, down, _] = self.state.poses.expect("found");
        let says = vec![format!("insertion: {}", written(&self.options.robot.write(&down)))];
        let plan = self.plan("insert", "insert the component".into(), vec![self.leg(down)], self.evidence()?);
        self.go("insert", says, "insert?", plan, &mut |_, _, _| Ok(()))?;
        self.eye.lights.grip(false)?;
        self.state.released = true;
        Ok(Phase::Retract)
    }

    /// Goes up along the insertion's path, also after an interrupted motion.
    fn retract(&mut self) -> Result<Phase> {
        let at = self.guard.link().pose()?.base_from_flange;
        let up = match (self.state.poses, self.state.surface) {
            (Some([_, down, up]), _) => way_up(&at.translation, &down.translation, &up.translation)?,
            (None, Some([_, normal])) => normal * AWAY_MM,
            // Nothing was touched yet: the arm stands where the job began, or above it.
            (None, None) => Vec3::zeros(),
        };
        let mm = up.norm();
        if !(mm <= LEAST_WAY_MM) {
            let to = Rigid::new(at.rotation, at.translation + up);
            let plan = self.plan("retract", "back up the way it came".into(), vec![self.leg(to)], Evidence::default());
            let question = if self.state.released { "is the component in? retract?" } else { "back out?" };
            self.go("retract", vec![format!("{mm:.0} mm up")], question, plan, &mut |_, _, _| Ok(()))?;
        }
        if self.state.released {
            return Ok(Phase::Done);
        }
        self.state.why = BACKED_OUT.into();
        self.operator.tell(BACKED_OUT);
        Ok(Phase::BackedOut)
    }
}

/// The motion from the arm's position up to the height of the retract pose, along the line from the insertion pose
/// to it; zero if the arm is already that high.
fn way_up(at: &Vec3, down: &Vec3, up: &Vec3) -> Result<Vec3> {
    let way = up - down;
    if !(way.norm() > LEAST_WAY_MM && way.norm().is_finite()) {
        return Err(Fault::input(format!(
            "the job's retract pose is {:.3} mm from its insertion pose, more than {LEAST_WAY_MM} is needed to know \
             the direction up",
            way.norm()
        ))
        .cause("its recipe had retract_mm = 0, or the pose is not finite")
        .next(
            "take the tool up with the pendant, set retract_mm in the recipe, then begin a new job in another \
               folder",
        ));
    }
    let axis = way.normalize();
    let mm = (up - at).dot(&axis);
    // A NaN height does not count as reached.
    Ok(if mm <= 0.0 { Vec3::zeros() } else { axis * mm })
}

/// Refuses a plan with a leg that is not a finite pose: such a leg is neither executed nor skipped.
fn finite(plan: &Plan) -> Result<()> {
    let numbers = |leg: &Motion| leg.to.to_rows().iter().all(|x| x.is_finite()) && leg.speed_mm_s.is_finite();
    match plan.legs.iter().position(|leg| !numbers(leg)) {
        None => Ok(()),
        Some(k) => Err(Fault::refused(format!(
            "{}: motion {} of {} leads to {:?} mm, which is not a place",
            plan.name,
            k + 1,
            plan.legs.len(),
            plan.legs[k].to.translation.as_slice()
        ))
        .cause("a number of the recipe, the calibration or the scan is not finite")
        .next(
            "look at the robot, take it away from the part with the pendant, then begin a new job in another folder",
        )),
    }
}

fn written(numbers: &[f64]) -> String {
    numbers.iter().map(|x| format!("{x:.3}")).collect::<Vec<_>>().join(" ")
}

fn now_s() -> f64 {
    jiff::Timestamp::now().as_millisecond() as f64 * 1e-3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_up_is_known_or_a_fault() {
        let (down, up) = (Vec3::new(400.0, -100.0, 60.0), Vec3::new(400.0, -100.0, 120.0));
        let from = |z: f64| way_up(&Vec3::new(401.0, -100.0, z), &down, &up).unwrap().z;
        assert_eq!((from(60.0), from(90.0), from(120.0), from(150.0)), (60.0, 30.0, 0.0, 0.0));
        for wrong in [down, down + Vec3::z() * 0.04, Vec3::new(f64::NAN, 0.0, 0.0), Vec3::new(0.0, f64::INFINITY, 0.0)]
        {
            let fault = way_up(&down, &down, &wrong).unwrap_err();
            assert!(fault.what.contains("from its insertion pose") && fault.next.contains("pendant"), "{fault}");
        }
        assert!(way_up(&Vec3::new(0.0, f64::NAN, 0.0), &down, &up).unwrap().norm().is_nan());
    }

    #[test]
    fn a_leg_that_is_no_pose_is_a_fault() {
        let leg = |z: f64, speed_mm_s: f64| Motion {
            to: Rigid::from_vectors(&Vec3::zeros(), Vec3::new(1.0, 2.0, z)),
            way: Way::Straight,
            speed_mm_s,
        };
        assert!(finite(&Plan::single("up", "", leg(3.0, 50.0))).is_ok());
        for wrong in [leg(f64::NAN, 50.0), leg(f64::INFINITY, 50.0), leg(3.0, f64::NAN)] {
            let plan = Plan { legs: vec![leg(3.0, 50.0), wrong], ..Plan::single("up", "", wrong) };
            assert!(finite(&plan).unwrap_err().what.contains("motion 2 of 2"));
        }
    }
}
