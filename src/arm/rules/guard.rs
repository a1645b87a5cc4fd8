//! In: plans and confirmations. Out: motions, each allowed, watched and logged. After a motion that was stopped
//! nothing moves until a person has looked at the robot.
//! Frame and unit: base_from_flange, mm, degrees, mm/s.

use super::super::{Allowed, Arm, Halt, Motion, PoseSource, Reach, TimedPose, Way};
use super::carried::Carried;
use super::gates::{Situation, free, gates, of_the_state};
use super::limits::Limits;
use super::log::MotionLog;
use super::pace::pace;
use super::plan::{Confirmation, Plan, Proposal, hash};
use super::stop::StopButton;
use super::straight::Straight;
use super::tolerances::{ARRIVED, MOVED, STILL};
use super::watch::{Confirmed, Watch};
use crate::fault::{Fault, Gate, Kind, Result};
use crate::geometry::{Base, Flange, Rigid};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Instant;

/// A robot behind its rules. Read-only until it is armed.
pub struct Guard {
    link: Box<dyn Arm>,
    limits: Option<Limits>,
    carried: Carried,
    log: MotionLog,
    armed: Option<Armed>,
    /// Why the arm's pose is unknown.
    unknown: Option<String>,
    used: BTreeSet<String>,
    proposed: u64,
    stop: StopButton,
}

/// What an armed robot has: a way to stop it and a way to watch it, each over a separate connection.
struct Armed {
    halt: Arc<dyn Halt>,
    poses: Box<dyn PoseSource>,
    /// The link reports that the controller is simulated: its clock does not follow this machine's.
    simulated: bool,
}

impl Guard {
    /// A read-only guard. Without limits it cannot be armed. The carried points are judged in every motion.
    pub fn new(link: Box<dyn Arm>, limits: Option<Limits>, carried: Carried, log: MotionLog) -> Guard {
        Guard {
            link,
            limits,
            carried,
            log,
            armed: None,
            unknown: None,
            used: BTreeSet::new(),
            proposed: 0,
            stop: StopButton::default(),
        }
    }

    /// The link, for reading. It cannot move the arm: a motion needs an [`Allowed`], which only this guard makes.
    pub fn link(&mut self) -> &mut dyn Arm {
        &mut *self.link
    }

    /// The button that stops the arm from any thread.
    pub fn stop_button(&self) -> StopButton {
        self.stop.clone()
    }

    /// Whether motions may be proposed.
    pub fn is_armed(&self) -> bool {
        self.armed.is_some()
    }

    /// The limits of every motion.
    pub fn limits(&self) -> Option<&Limits> {
        self.limits.as_ref()
    }

    /// Takes control of the arm for motions and opens the connections that stop it and watch it. `allowed` is the
    /// operator's --allow-motion.
    ///
    /// # Errors
    /// Motion was not allowed, no limits are stated, the link only reads, or another program holds the arm.
    pub fn arm(&mut self, allowed: bool) -> Result<()> {
        if !allowed {
            return Err(Fault::refused(format!("{}: read-only", self.link.name()))
                .cause("motion was not allowed")
                .next("give --allow-motion when somebody stands at the emergency stop"));
        }
        let Some(limits) = &self.limits else {
            return Err(Fault::refused("no workspace is stated: the limits of the arm are unknown")
                .cause("station.toml has no [motion]")
                .next("write [motion] with workspace = { from_mm = [...], to_mm = [...] } (docs/robots.md)"));
        };
        limits.check()?;
        let (halt, poses, simulated) = (self.link.stop()?, self.link.watch()?, self.link.simulated()?);
        self.link.take()?;
        self.armed = Some(Armed { halt, poses, simulated });
        Ok(())
    }

    /// Returns control of the arm.
    pub fn disarm(&mut self) -> Result<()> {
        self.armed = None;
        self.link.give()
    }

    /// Whether a straight path stays inside the workspace and out of the keep-outs, with all that the flange
    /// carries. The robot is not asked. Without limits the answer is false.
    pub fn keeps_clear(&self, from: &Rigid<Base, Flange>, to: &Rigid<Base, Flange>) -> bool {
        self.limits.as_ref().is_some_and(|limits| free(&self.carried, limits, from, to))
    }

    /// Reports that a person has looked at the robot after a stopped motion; no program may report it on its own.
    /// Reads the pose again.
    pub fn looked(&mut self) -> Result<TimedPose> {
        let pose = self.link.pose()?;
        self.unknown = None;
        Ok(pose)
    }

    /// Why the arm's pose is unknown; `None` if it is known.
    pub fn unknown(&self) -> Option<&str> {
        self.unknown.as_deref()
    }

    fn situation(&mut self) -> Result<Situation> {
        let (state, pose) = (self.link.state()?, self.link.pose()?);
        let (at, figure) = (pose.base_from_flange, pose.figure);
        Ok(Situation { state, at, figure, armed: self.armed.is_some(), unknown: self.unknown.is_some() })
    }

    /// Examines a plan from the arm's current pose. The proposal shows every gate, met or not.
    ///
    /// # Errors
    /// The robot cannot be asked, or no limits are stated.
    pub fn propose(&mut self, plan: Plan) -> Result<Proposal> {
        self.proposed += 1;
        let number = self.proposed;
        let now = self.situation()?;
        let hash = hash(&plan, &self.carried, &now.at, number);
        let (from, figure, shown) = (now.at, now.figure, Instant::now());
        let Judged { gates, reasons, unjudged } = self.judge(&plan, &now)?;
        let proposal = Proposal { plan, from, figure, gates, reasons, unjudged, hash, shown };
        self.log.note("asked", &proposal, proposal.missed())?;
        Ok(proposal)
    }

    fn judge(&mut self, plan: &Plan, now: &Situation) -> Result<Judged> {
        let Some(limits) = &self.limits else {
            return Err(
                Fault::refused("no workspace is stated").next("write [motion] into station.toml (docs/robots.md)")
            );
        };
        let gates = gates(plan, limits, &self.carried, now);
        let mut unjudged = self.carried.unknown().to_vec();
        unjudged.extend(self.link.unsaid().map(str::to_owned));
        let mut reasons: Vec<String> =
            now.state.errors.iter().map(|e| format!("on the controller stands {:08X} {}", e.code, e.text)).collect();
        reasons.extend(self.unknown.clone());
        reasons.extend(self.stop.why());
        // A plan that fails a gate is not shown to the controller. On a straight row the ends, and some legs
        // between, are checked.
        if gates.iter().all(|g| g.passed) {
            let mut answered = 0;
            for leg in ends(&now.at, &plan.legs) {
                match self.link.reach(&leg.to)? {
                    Reach::Refused(why) => reasons.push(why),
                    Reach::Free => answered += 1,
                    Reach::Unasked => {}
                }
            }
            let legs = plan.legs.len();
            if reasons.is_empty() && answered < legs {
                unjudged.push(format!("reach: the controller answered for {answered} of {legs} poses"));
            }
        }
        reasons.dedup();
        Ok(Judged { gates, reasons, unjudged })
    }

    /// Executes a confirmed plan, once. `each` is called after each leg with the leg's number while the arm stands
    /// still; its error ends the plan there.
    ///
    /// # Errors
    /// A gate is not met (any more); the confirmation is of another proposal, was used or is too old; the
    /// controller refused to begin a leg; or the motion was stopped. In the last case the arm stands wherever it
    /// was stopped.
    pub fn make(
        &mut self,
        proposal: &Proposal,
        confirmation: Confirmation,
        each: &mut dyn FnMut(&mut dyn Arm, usize) -> Result<()>,
    ) -> Result<()> {
        self.attempt(proposal, confirmation, each)?.map_or(Ok(()), Err)
    }

    /// The same for callers that have an alternative: if the controller refuses to begin a leg, its refusal is
    /// returned. The arm then stands where that leg was to begin, its pose is known, and another motion may be
    /// proposed.
    ///
    /// # Errors
    /// All other errors of [`Guard::make`].
    pub fn attempt(
        &mut self,
        proposal: &Proposal,
        confirmation: Confirmation,
        each: &mut dyn FnMut(&mut dyn Arm, usize) -> Result<()>,
    ) -> Result<Option<Fault>> {
        if let Err(fault) = self.may(proposal, &confirmation) {
            self.log.note("refused", proposal, vec![fault.what.clone()])?;
            return Err(fault);
        }
        self.used.insert(confirmation.hash);
        // The log states what is begun before it begins.
        self.log.note("begun", proposal, vec![])?;
        let made = self.run(proposal, each);
        match &made {
            Ok(None) => self.log.note("done", proposal, vec![])?,
            Ok(Some(refusal)) => self.log.note("not begun", proposal, vec![refusal.what.clone()])?,
            Err(e) => self.log.note("stopped", proposal, vec![e.what.clone()])?,
        }
        made
    }

    fn may(&mut self, proposal: &Proposal, confirmation: &Confirmation) -> Result<()> {
        let refused = |what: String, cause: &str| {
            Err(Fault::refused(what)
                .cause(cause)
                .next("look at the robot and at the pose, then confirm the pose that is shown"))
        };
        if confirmation.hash != proposal.hash {
            let short = |h: &str| h.chars().take(12).collect::<String>();
            let what = format!(
                "the confirmation belongs to motion {}, but this is motion {}",
                short(&confirmation.hash),
                short(&proposal.hash)
            );
            return refused(what, "another pose was shown when it was given");
        }
        if self.used.contains(&proposal.hash) {
            return refused("this confirmation was already used for 1 motion, limit 1".into(), "it was sent twice");
        }
        let (age, most) = (proposal.shown.elapsed().as_secs_f64(), self.limits.as_ref().map_or(0.0, |l| l.max_shown_s));
        if age > most {
            return refused(
                format!("the pose was shown {age:.0} s ago, limit {most:.0} s"),
                "the cell may have changed since",
            );
        }
        let now = self.situation()?;
        let (angle, mm) = proposal.from.difference(&now.at);
        if !(mm <= MOVED.0 && angle.to_degrees() <= MOVED.1) {
            let what = format!(
                "the arm moved by {mm:.2} mm and {:.3} degrees since the pose was shown, limit {} and {}",
                angle.to_degrees(),
                MOVED.0,
                MOVED.1
            );
            return refused(what, "somebody jogged it, or another program has it");
        }
        if let (Some(shown), Some(figure)) = (proposal.figure, now.figure)
            && shown != figure
        {
            return refused(
                format!("the arm configuration is {figure}; it was {shown} when the pose was shown"),
                "somebody moved the arm to the same pose with other joint angles",
            );
        }
        let judged = self.judge(&proposal.plan, &now)?;
        let missed: Vec<String> =
            judged.gates.iter().filter(|g| !g.passed).map(|g| g.words()).chain(judged.reasons).collect();
        if missed.is_empty() {
            return Ok(());
        }
        refused(missed.join("; "), "a condition named above is not met")
    }

    /// Executes the legs. Returns the controller's refusal if it did not begin a leg.
    fn run(
        &mut self,
        proposal: &Proposal,
        each: &mut dyn FnMut(&mut dyn Arm, usize) -> Result<()>,
    ) -> Result<Option<Fault>> {
        let plan = &proposal.plan;
        let (Some(limits), Some(armed)) = (&self.limits, &mut self.armed) else { unreachable!("gates ask for both") };
        let speed_mm_s = plan.legs.iter().map(|leg| leg.speed_mm_s).fold(0.0, f64::max);
        let mut from = proposal.from;
        let turns = plan
            .legs
            .iter()
            .map(|leg| pace(&std::mem::replace(&mut from, leg.to), leg, &self.carried, limits).turn_deg_s);
        let turn_deg_s = turns.fold(0.0, f64::max);
        let straight = plan.legs.iter().all(|leg| leg.way == Way::Straight);
        let figure = proposal.figure.filter(|_| straight);
        let confirmed = Confirmed { speed_mm_s, turn_deg_s, figure, simulated: armed.simulated };
        let watch = Watch::new(limits, &self.carried, &self.stop, &*armed.halt, confirmed);
        let link = &mut *self.link;
        let poses = &mut *armed.poses;
        let made = std::thread::scope(|threads| {
            let _ended = Ended(&watch);
            let named = |name: &str| std::thread::Builder::new().name(name.into());
            let guarding = named("halt").spawn_scoped(threads, || watch.guard());
            let following = named("poses").spawn_scoped(threads, || watch.follow(poses));
            if let Err(e) = guarding.and(following) {
                return Err(unwatched(e));
            }
            let made = all(link, plan, &watch, each);
            if let Err(e) = &made {
                watch.halt(e.what.clone());
            }
            made
        });
        match watch.halted() {
            // Every error halts, except that of a watch that could not start.
            None => made,
            Some(why) => {
                self.unknown = Some(format!("the last motion was stopped: {why}"));
                Err(made.err().filter(|e| e.what == why).unwrap_or_else(|| stopped(why)))
            }
        }
    }
}

/// Ends the watch with the motion, also if a panic ends it: otherwise its threads would be joined forever with a
/// laser on.
struct Ended<'w, 'a>(&'w Watch<'a>);

impl Drop for Ended<'_, '_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.halt("a bug ended the motion".into());
        }
        self.0.end();
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        let _ = self.disarm();
    }
}

/// The result of judging a plan.
struct Judged {
    gates: Vec<Gate>,
    reasons: Vec<String>,
    unjudged: Vec<String>,
}

/// Number of legs within a row whose reach the controller is asked about, besides the row's two ends.
const ASKED: usize = 8;

/// The poses for which the controller is asked: those where a plan's path bends, and some within a straight row.
fn ends<'a>(from: &Rigid<Base, Flange>, legs: &'a [Motion]) -> impl Iterator<Item = &'a Motion> {
    let stride = (legs.len() / ASKED).max(1);
    let from = *from;
    let bends = move |k: usize| {
        let before = if k == 0 { from } else { legs[k - 1].to };
        let Some(next) = legs.get(k + 1) else { return true };
        let ways = [Straight::new(&before, &legs[k].to), Straight::new(&legs[k].to, &next.to)];
        let turns = ways.iter().any(|w| w.turn.norm().to_degrees() > STILL.1);
        turns || ways[0].shift.cross(&ways[1].shift).norm() > STILL.0 * ways[1].shift.norm()
    };
    legs.iter().enumerate().filter(move |(k, _)| k % stride == 0 || bends(*k)).map(|(_, leg)| leg)
}

/// Executes a plan's legs up to one that the controller refuses to begin; returns that refusal.
fn all(
    link: &mut dyn Arm,
    plan: &Plan,
    watch: &Watch,
    each: &mut dyn FnMut(&mut dyn Arm, usize) -> Result<()>,
) -> Result<Option<Fault>> {
    for (k, leg) in plan.legs.iter().enumerate() {
        if let Some(why) = watch.stop.why().or_else(|| watch.halted()) {
            return Err(stopped(why));
        }
        let before = link.pose()?;
        let pace = pace(&before.base_from_flange, leg, watch.carried, watch.limits);
        watch.begin(leg.to);
        let made = link.make(Allowed::new(*leg, pace));
        watch.arrived();
        if let Err(fault) = made {
            return not_begun(link, &before, fault).map(Some);
        }
        arrived(link, leg, &before)?;
        each(link, k)?;
        if let Some(why) = watch.halted() {
            return Err(stopped(why));
        }
    }
    Ok(None)
}

/// Checks an order that was answered with an error. If the arm is ready as before and has not moved, nothing was
/// begun and the refusal is returned. In every other case the arm's action is unknown, which is an error.
fn not_begun(link: &mut dyn Arm, before: &TimedPose, fault: Fault) -> Result<Fault> {
    if fault.kind != Kind::Refused {
        return Err(fault);
    }
    // The state is read first: an arm that starts after that is detected by its pose.
    let ready = of_the_state(&link.state()?).iter().all(|gate| gate.passed);
    let (angle, mm) = before.base_from_flange.difference(&link.pose()?.base_from_flange);
    if !(ready && mm <= STILL.0 && angle.to_degrees() <= STILL.1) {
        return Err(fault);
    }
    Ok(fault
        .cause("the controller would not begin this motion; the arm has not moved")
        .next("reach the pose from another start, or in several motions"))
}

/// Checks where the arm has arrived.
fn arrived(link: &mut dyn Arm, leg: &Motion, before: &TimedPose) -> Result<()> {
    let after = link.pose()?;
    let (angle, mm) = after.base_from_flange.difference(&leg.to);
    if !(mm <= ARRIVED.0 && angle.to_degrees() <= ARRIVED.1) {
        return Err(Fault::device(format!(
            "the arm stands {mm:.2} mm and {:.3} degrees from where it was sent, limit {} and {}",
            angle.to_degrees(),
            ARRIVED.0,
            ARRIVED.1
        ))
        .cause("it was halted, or it moves with another tool or work frame")
        .next("look at the robot"));
    }
    match (before.figure, after.figure) {
        (Some(a), Some(b)) if a != b && leg.way == Way::Straight => {
            Err(Fault::device(format!("the arm configuration changed on the way, from {a} to {b}"))
                .cause("the controller chose other joint angles")
                .next("look at the robot, and approach from another side"))
        }
        _ => Ok(()),
    }
}

fn unwatched(e: std::io::Error) -> Fault {
    Fault::device(format!("cannot start the thread that watches the motion: {e}"))
        .cause("too many threads or too little memory; nothing was moved")
        .next("end other programs, then try again")
}

fn stopped(why: String) -> Fault {
    Fault::device(why)
        .cause("the motion was stopped; the arm's pose is unknown")
        .next("look at the robot, then continue")
}
