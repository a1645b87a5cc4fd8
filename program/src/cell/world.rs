//! In: motions and output switches from the controller, the cell's time. Out: the true pose of everything at any
//! recent moment, the controller's view of it, and the event log.
//! Frame and unit: base frame, mm; joints rad; s of the cell.

use super::component::Component;
use super::judge;
use super::kinematics::{Joints, Vs060};
use super::log::{Entry, Event};
use super::options::CellOptions;
use super::trajectory::Trajectory;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use sheetlight::arm::Outputs;
use sheetlight::geometry::{Base, Flange, Part, Rigid, Tool, Vec3, exp};
use sheetlight::simulate::{InScene, Scene};
use std::collections::{BTreeMap, VecDeque};

/// The arm's joints when the cell is started, degrees: the tool points straight down.
pub const START_DEG: Joints = [0.0, 0.0, 90.0, 0.0, 90.0, 0.0];
/// Number of motions and switches that are remembered, for pictures of past moments.
const REMEMBERED: usize = 64;
/// Points per mm of a motion at which collisions are checked.
const LOOKS_PER_MM: f64 = 1.0;

/// A motion and its start time; `off`: the true deviation of the arm before and after it, mm and rad.
struct Segment {
    start: f64,
    trajectory: Trajectory,
    off: [[f64; 6]; 2],
    straight: bool,
}

/// Poses of all objects.
pub struct Places {
    /// The scene before the robot.
    pub scene: Scene,
    /// Pose of the scene; has no meaning if the scene is on the flange.
    pub base_from_scene: Rigid<Base, InScene>,
    /// Pose of the scene on the flange, if it is mounted there.
    pub flange_from_scene: Option<Rigid<Flange, InScene>>,
    /// Poses of the scene's sockets by name.
    pub parts: BTreeMap<String, Rigid<Base, Part>>,
    /// Pose of the gripper on the flange.
    pub flange_from_tool: Rigid<Flange, Tool>,
}

/// The state of the cell that changes.
pub struct World {
    drawn: Vs060,
    built: Vs060,
    segments: VecDeque<Segment>,
    rest: (Joints, [f64; 6]),
    /// States of the outputs, each with the time from which it holds.
    switched: VecDeque<(f64, BTreeMap<u16, bool>)>,
    outputs: Outputs,
    noise: [f64; 2],
    rng: Pcg64,
    places: Places,
    /// The component in the gripper.
    pub held: Option<Component>,
    hull: Vec<Vec3>,
    /// All events, in order.
    pub log: Vec<Entry>,
}

impl World {
    pub fn new(
        options: &CellOptions,
        (built, start): (Vs060, Joints),
        places: Places,
        held: Option<Component>,
        rng: Pcg64,
    ) -> World {
        let rest = (start, [0.0; 6]);
        let hull = held.as_ref().map_or(Vec::new(), |c| c.hull.clone());
        let mut switched = VecDeque::new();
        switched.push_back((0.0, BTreeMap::from([(options.outputs.room, true), (options.outputs.gripper, true)])));
        World {
            drawn: Vs060::drawn(),
            built,
            segments: VecDeque::new(),
            rest,
            switched,
            outputs: options.outputs,
            noise: [options.noise_mm, options.noise_deg.to_radians()],
            rng,
            places,
            held,
            hull,
            log: Vec::new(),
        }
    }

    /// The arm's geometry as the controller assumes it.
    pub fn drawn(&self) -> &Vs060 {
        &self.drawn
    }

    /// Appends to the log.
    pub fn note(&mut self, t: f64, event: Event) {
        self.log.push(Entry { t_s: t, event });
    }

    fn at(&self, t: f64) -> (Joints, [f64; 6]) {
        let Some(s) = self.segments.iter().rev().find(|s| s.start <= t) else {
            return self.segments.front().map_or(self.rest, |s| (s.trajectory.joints(0.0), s.off[0]));
        };
        let (dt, u) = (t - s.start, s.trajectory.done(t - s.start));
        (s.trajectory.joints(dt), std::array::from_fn(|k| s.off[0][k] + u * (s.off[1][k] - s.off[0][k])))
    }

    /// The joints that the encoders measure.
    pub fn joints(&self, t: f64) -> Joints {
        self.at(t).0
    }

    /// Pose of the flange as the controller reports it.
    pub fn reported(&self, t: f64) -> Rigid<Base, Flange> {
        self.drawn.forward(&self.joints(t))
    }

    /// True pose of the flange.
    pub fn true_flange(&self, t: f64) -> Rigid<Base, Flange> {
        let (joints, off) = self.at(t);
        let pose = self.built.forward(&joints);
        let turn = exp(&Vec3::new(off[3], off[4], off[5]));
        Rigid::new(turn * pose.rotation, pose.translation + Vec3::new(off[0], off[1], off[2]))
    }

    /// True pose of the scene.
    pub fn true_scene(&self, t: f64) -> Rigid<Base, InScene> {
        self.places.flange_from_scene.map_or(self.places.base_from_scene, |f| self.true_flange(t) * f)
    }

    /// True pose of the gripper's tool.
    pub fn true_tool(&self, t: f64) -> Rigid<Base, Tool> {
        self.true_flange(t) * self.places.flange_from_tool
    }

    /// Time until which the arm moves, s; `None` if it stands still.
    pub fn moving_until(&self, t: f64) -> Option<f64> {
        let end = self.segments.back().map(|s| s.start + s.trajectory.duration())?;
        (end > t).then_some(end)
    }

    /// Begins a motion from the arm's current pose; returns the length of the log after it.
    pub fn begin(&mut self, t: f64, trajectory: Trajectory, straight: bool, connection: u64) -> usize {
        let (_, off) = self.at(t);
        let [mm, rad] = self.noise;
        let mut normal = |sigma: f64| sigma * Distribution::<f64>::sample(&StandardNormal, &mut self.rng);
        let next = std::array::from_fn(|k| normal(if k < 3 { mm } else { rad }));
        let (to, lasts_s) = (self.drawn.forward(&trajectory.joints(trajectory.duration())), trajectory.duration());
        self.segments.push_back(Segment { start: t, trajectory, off: [off, next], straight });
        if self.segments.len() > REMEMBERED {
            self.segments.pop_front();
        }
        self.note(t, Event::Move { connection, to, straight, lasts_s });
        self.log.len()
    }

    /// Sets the joints after a person moved the arm with the pendant.
    pub fn stand(&mut self, t: f64, joints: Joints) {
        self.segments.clear();
        self.rest = (joints, [0.0; 6]);
        self.note(t, Event::Jogged { to: self.drawn.forward(&joints) });
    }

    /// Stops any motion; returns whether one was under way.
    pub fn halt(&mut self, t: f64, connection: Option<u64>) -> bool {
        let moving = self.moving_until(t).is_some();
        if let Some(s) = self.segments.back_mut().filter(|_| moving) {
            s.trajectory.halt(t - s.start);
        }
        self.note(t, Event::Halt { connection, moving });
        moving
    }

    /// Logs that the last motion has ended, and the first collision on its path.
    pub fn arrived(&mut self, t: f64) {
        let Some(s) = self.segments.back() else { return };
        let (start, end) = (s.start, s.start + s.trajectory.duration());
        let (from, to) = (self.true_tool(start), self.true_tool(end));
        let looks =
            ((from.difference(&to).1 * LOOKS_PER_MM).ceil() as usize).clamp(1, if s.straight { 400 } else { 200 });
        let near = |pose: &Rigid<Base, Tool>| {
            judge::collision(self.held.as_ref(), &self.hull, pose, &self.places.scene, &self.places.base_from_scene)
        };
        // Collisions with a scene on the flange are not checked.
        let looks = if self.places.flange_from_scene.is_some() { 0 } else { looks };
        let times = (1..=looks).map(|k| start + (end - start) * k as f64 / looks as f64);
        let hit = times.filter_map(|at| near(&self.true_tool(at)).map(|event| (at, event))).next();
        self.note(t, Event::Arrived);
        if let Some((at, event)) = hit {
            self.note(at, event);
        }
    }

    /// States of the outputs at `t`.
    pub fn outputs(&self, t: f64) -> &BTreeMap<u16, bool> {
        let then = self.switched.iter().rev().find(|(since, _)| *since <= t).or(self.switched.front());
        &then.expect("starts with one").1
    }

    /// Whether an output was on at `t`.
    pub fn output(&self, number: u16, t: f64) -> bool {
        self.outputs(t).get(&number).copied().unwrap_or(false)
    }

    /// Switches an output; a gripper that opens releases its component.
    pub fn switch(&mut self, t: f64, number: u16, on: bool) {
        let before = self.output(number, t);
        let mut all = self.outputs(t).clone();
        all.insert(number, on);
        self.switched.push_back((t, all));
        if self.switched.len() > REMEMBERED {
            self.switched.pop_front();
        }
        self.note(t, Event::Output { number, on });
        if number == self.outputs.gripper && before && !on {
            self.release(t);
        }
    }

    fn release(&mut self, t: f64) {
        let Some(component) = self.held.take() else { return };
        let tool = self.true_tool(t);
        let Some(socket) = self.places.parts.get(&component.part) else { return };
        let insertion = judge::insertion(&component, &tool, socket);
        self.note(t, Event::Released(insertion));
    }

    /// Poses of all objects.
    pub fn places(&self) -> &Places {
        &self.places
    }

    /// Replaces the objects before the robot; returns the old ones.
    pub fn replace(&mut self, places: Places, held: Option<Component>) -> Places {
        self.hull = held.as_ref().map_or(Vec::new(), |c| c.hull.clone());
        self.held = held;
        std::mem::replace(&mut self.places, places)
    }
}
