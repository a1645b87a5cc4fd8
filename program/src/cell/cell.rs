//! In: options. Out: a simulated robot cell: time, arm, outputs, camera, ground truth. The controller and the
//! servers act on it.
//! Frame and unit: base frame, mm; s of the cell.

use super::camera::{self, Exposure, Lit};
use super::clock::Clock;
use super::component::Component;
use super::kinematics::{ArmError, Joints, Vs060};
use super::log::{Entry, Event, Insertion};
use super::options::CellOptions;
use super::world::{Places, START_DEG, World};
use rand::Rng;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Board, Camera, Flange, Mat3, Part, Rigid, Tool, Vec3, exp};
use sheetlight::raster::Image;
use sheetlight::simulate::{InScene, Scene, SceneSpec, Station, part_pose};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Position of the gripper on the flange, mm: beside the sensor, pointing in the flange's direction.
const GRIPPER_AT_MM: [f64; 3] = [72.0, 0.0, 160.0];
/// Offset of the calibration board from the scene's middle, mm.
const BOARD_BESIDE_MM: [f64; 3] = [0.0, 170.0, 0.0];
/// Thickness of the plate on the flange that carries a board, mm.
const PLATE_MM: f64 = 20.0;
/// Distance, in working distances, from which the whole board and the stripe on it are in the picture.
const BOARD_FROM: f64 = 1.5;
/// Grey values of a printed board: white, black.
const PRINT: [f64; 2] = [0.85, 0.06];

/// Target above which a person jogs the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Over {
    /// A position in the scene: x, y, mm.
    Place([f64; 2]),
    /// The calibration board beside the scene.
    Board,
}

/// A cell. Cheap to clone: all clones share the same cell.
#[derive(Clone)]
pub struct Cell(Arc<Inside>);

struct Inside {
    options: CellOptions,
    clock: Clock,
    station: Station,
    gripper: Station,
    hot: Vec<(usize, f32)>,
    scene: Mutex<Arc<Scene>>,
    base_from_board: Option<Rigid<Base, Board>>,
    /// Pose of the sensor, if it is fixed in the cell.
    base_from_camera: Option<Rigid<Base, Camera>>,
    arm_error: ArmError,
    world: Mutex<World>,
    pictures: AtomicU64,
    exposures: [Exposure; 2],
    stuck: Mutex<BTreeMap<u16, bool>>,
}

impl Cell {
    /// Builds the cell; its time starts now.
    ///
    /// # Errors
    /// Options out of range, an empty scene, or no part for the named component.
    pub fn new(options: CellOptions) -> Result<Cell> {
        options.check()?;
        let station = Station::of(&options.rig, options.seed);
        let base_from_scene = place(&station, options.tilt_deg);
        let (scene, base_from_board) = with_board(&options, Scene::new(options.scene.clone())?, &base_from_scene)?;
        let held = held(&options.scene, options.holds.as_deref())?;
        let flange_from_tool = gripper(&station);
        let flange_from_scene = options.eye_to_hand.then(on_flange);
        let places = Places {
            parts: parts(&options.scene, &base_from_scene),
            scene: scene.clone(),
            base_from_scene,
            flange_from_scene,
            flange_from_tool,
        };
        let base_from_camera =
            flange_from_scene.map(|f| stand(&options, &station, &base_from_scene, &f)).transpose()?;
        let arm_error = arm_error(&station, options.arm_error_mm, options.arm_error_deg);
        let arm = (Vs060::built(&arm_error), start(&options, &base_from_scene)?);
        let world = World::new(&options, arm, places, held, station.rng("repeatability", 0));
        let gripper = camera::gripper_station(&station, &flange_from_tool);
        Ok(Cell(Arc::new(Inside {
            clock: Clock::new(options.speed),
            hot: station.hot_pixels(),
            gripper,
            scene: Mutex::new(Arc::new(scene)),
            base_from_board: base_from_board.filter(|_| base_from_camera.is_none()),
            base_from_camera,
            arm_error,
            world: Mutex::new(world),
            pictures: AtomicU64::new(0),
            exposures: Default::default(),
            stuck: Mutex::default(),
            station,
            options,
        })))
    }

    /// The options that the cell was built with.
    pub fn options(&self) -> &CellOptions {
        &self.0.options
    }
    /// The cell's clock.
    pub fn clock(&self) -> &Clock {
        &self.0.clock
    }
    pub(super) fn world(&self) -> MutexGuard<'_, World> {
        self.0.world.lock().unwrap_or_else(PoisonError::into_inner)
    }
    fn scene(&self) -> Arc<Scene> {
        self.0.scene.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The picture of a past moment, with the lights that were on then, seen from the flange's true pose.
    pub fn picture(&self, t: f64) -> Image {
        let (lit, scene_from_camera) = self.seen(t, &self.0.station);
        let number = self.0.pictures.fetch_add(1, Ordering::Relaxed);
        let (station, hot) = camera::exposed(&self.0.station, &self.0.hot, self.exposure(false));
        camera::picture(&station, &self.scene(), &hot, scene_from_camera, lit, number)
    }

    /// The picture of the small camera in the gripper, in room light.
    pub fn gripper_picture(&self, t: f64) -> Image {
        let (lit, scene_from_camera) = self.seen(t, &self.0.gripper);
        let lit = Lit { line: false, pointer: false, ..lit };
        // The gripper's camera has no hot pixels.
        let (station, _) = camera::exposed(&self.0.gripper, &[], self.exposure(true));
        let view = sheetlight::simulate::View { station: &station, scene: &self.scene(), scene_from_camera };
        let (w, h) = (station.camera.width, station.camera.height);
        let (room, sensor) = (view.ambient(1), &station.sensor);
        let gain = if lit.room { sensor.ambient_white } else { sensor.ambient_leak };
        let mut rng = self.0.gripper.rng("gripper picture", self.0.pictures.fetch_add(1, Ordering::Relaxed));
        sheetlight::simulate::expose(
            sensor,
            &sheetlight::simulate::Canvas::new(w, h),
            &room,
            gain as f32,
            &[],
            &mut rng,
        )
    }

    /// Exposure setting of the sensor's camera, or of the one in the gripper.
    pub(super) fn exposure(&self, in_gripper: bool) -> &Exposure {
        &self.0.exposures[usize::from(in_gripper)]
    }

    /// Width and height of the gripper's pictures, px.
    pub fn gripper_format(&self) -> [u32; 2] {
        [self.0.gripper.camera.width, self.0.gripper.camera.height]
    }

    fn seen(&self, t: f64, station: &Station) -> (Lit, Rigid<InScene, Camera>) {
        let world = self.world();
        let stuck = self.0.stuck.lock().unwrap_or_else(PoisonError::into_inner);
        let on = |number: u16| stuck.get(&number).copied().unwrap_or_else(|| world.output(number, t));
        let outputs = self.0.options.outputs;
        let lit = Lit { line: on(outputs.line), pointer: on(outputs.pointer), room: on(outputs.room) };
        let base_from_camera = match self.0.base_from_camera {
            Some(still) if std::ptr::eq(station, &self.0.station) => still,
            _ => world.true_flange(t) * station.flange_from_camera,
        };
        (lit, world.true_scene(t).inverse() * base_from_camera)
    }

    /// Disconnects lasers and lamp from their outputs, as a blown fuse does; `false` connects them again.
    pub fn set_dark(&self, dark: bool) {
        let outputs = self.0.options.outputs;
        for number in [outputs.line, outputs.pointer, outputs.room] {
            self.stick(number, dark.then_some(false));
        }
    }

    /// Keeps the device on an output on or off, whatever the output's state: a broken wire is off, a welded relay
    /// is on. `None`: the device follows the output again.
    pub fn stick(&self, number: u16, at: Option<bool>) {
        let mut stuck = self.0.stuck.lock().unwrap_or_else(PoisonError::into_inner);
        match at {
            Some(on) => stuck.insert(number, on),
            None => stuck.remove(&number),
        };
    }

    /// All events so far.
    pub fn log(&self) -> Vec<Entry> {
        self.log_after(0)
    }

    /// The log without the first `known` entries. A reader that follows the log does not block others while all of
    /// it is copied.
    pub fn log_after(&self, known: usize) -> Vec<Entry> {
        self.world().log.get(known..).unwrap_or_default().to_vec()
    }

    /// How the component was released; `None` while it is held.
    pub fn insertion(&self) -> Option<Insertion> {
        self.world().log.iter().rev().find_map(|e| match e.event {
            Event::Released(insertion) => Some(insertion),
            _ => None,
        })
    }

    /// Number of collisions so far.
    pub fn collisions(&self) -> usize {
        self.world().log.iter().filter(|e| matches!(e.event, Event::Collision { .. })).count()
    }

    /// Number of motions begun so far.
    pub fn moves(&self) -> usize {
        self.world().log.iter().filter(|e| matches!(e.event, Event::Move { .. })).count()
    }

    /// Puts another scene before the robot, at the same pose; the gripper gets the component that belongs to it.
    pub fn lay(&self, spec: &SceneSpec, holds: Option<&str>) -> Result<()> {
        let held = held(spec, holds)?;
        let Places { base_from_scene, flange_from_scene, .. } = *self.world().places();
        let (scene, _) = with_board(&self.0.options, Scene::new(spec.clone())?, &base_from_scene)?;
        let flange_from_tool = self.flange_from_tool();
        *self.0.scene.lock().unwrap_or_else(PoisonError::into_inner) = Arc::new(scene.clone());
        let parts = parts(spec, &base_from_scene);
        let places = Places { scene, base_from_scene, flange_from_scene, parts, flange_from_tool };
        // The old scene is large: it is freed after the world's lock is released, because a Halt waits for that
        // lock.
        let _former = self.world().replace(places, held);
        let gripper = self.0.options.outputs.gripper;
        let now = self.0.clock.now();
        self.world().switch(now, gripper, true);
        Ok(())
    }

    /// A person moves the arm with the pendant until the sensor looks at a position of the scene, or at the
    /// calibration board.
    ///
    /// # Errors
    /// The arm is moving, there is no calibration board, or the pose is out of reach.
    pub fn jog(&self, over: Over) -> Result<()> {
        let t = self.0.clock.now();
        let mut world = self.world();
        if world.moving_until(t).is_some() {
            return Err(Fault::refused("the arm moves").next("wait until it stands, or stop it"));
        }
        let base_from_scene = world.places().base_from_scene;
        let in_scene = match over {
            Over::Place([x, y]) => Vec3::new(x, y, 0.0),
            Over::Board if self.0.base_from_board.is_some() => Vec3::from(BOARD_BESIDE_MM),
            Over::Board => {
                return Err(Fault::usage("there is no calibration board in this cell").next("start it with one"));
            }
        };
        // Sideways from the start pose; over the board also down, until the stripe and the pointer's spot are on
        // it.
        let start = START_DEG.map(f64::to_radians);
        let mut flange = world.drawn().forward(&start);
        let camera = flange * self.0.station.flange_from_camera;
        let seen = base_from_scene.inverse() * camera;
        let axis = seen.rotation.column(2).into_owned();
        let foot = seen.translation - axis * (seen.translation.z / axis.z);
        flange.translation += base_from_scene.rotation * (in_scene - foot);
        if over == Over::Board {
            let depth = -seen.translation.z / axis.z;
            let down = depth - BOARD_FROM * self.0.station.working_distance;
            flange.translation += camera.rotation.column(2) * down;
        }
        let joints = world.drawn().inverse(&flange, &start).map_err(|_| {
            Fault::refused("the arm cannot stand there").cause("it lies beyond its reach").next("take another place")
        })?;
        world.stand(t, joints);
        Ok(())
    }

    /// A person moves the arm with the pendant until the sensor looks at the part of the gripper's component. The
    /// arm stays if the gripper holds nothing, or if the sensor is fixed in the cell.
    ///
    /// # Errors
    /// As for [`Cell::jog`].
    pub fn jog_over_its_part(&self) -> Result<()> {
        let held = self.world().held.as_ref().map(|c| c.part.clone());
        let part = self.0.options.scene.part.iter().find(|p| Some(&p.name) == held.as_ref());
        match part {
            Some(part) if self.0.base_from_camera.is_none() => self.jog(Over::Place([part.at_mm[0], part.at_mm[1]])),
            _ => Ok(()),
        }
    }

    // Ground truth; only tests may read it.

    /// The specimen of the sensor on the flange.
    pub fn station(&self) -> &Station {
        &self.0.station
    }
    /// Pose of the scene.
    pub fn base_from_scene(&self) -> Rigid<Base, InScene> {
        self.world().places().base_from_scene
    }
    /// Pose of the sensor, if it is fixed in the cell.
    pub fn base_from_camera(&self) -> Option<Rigid<Base, Camera>> {
        self.0.base_from_camera
    }
    /// Pose of the calibration board, if it is fixed in the cell.
    pub fn base_from_board(&self) -> Option<Rigid<Base, Board>> {
        self.0.base_from_board
    }
    /// Pose of a part.
    pub fn base_from_part(&self, name: &str) -> Option<Rigid<Base, Part>> {
        self.world().places().parts.get(name).copied()
    }
    /// Pose of the gripper on the flange.
    pub fn flange_from_tool(&self) -> Rigid<Flange, Tool> {
        self.world().places().flange_from_tool
    }
    /// Deviation of the arm's geometry from its nominal values.
    pub fn arm_error(&self) -> ArmError {
        self.0.arm_error
    }
    /// Pose of the flange at `t`, as the controller computes it.
    pub fn reported(&self, t: f64) -> Rigid<Base, Flange> {
        self.world().reported(t)
    }
    /// True pose of the flange at `t`.
    pub fn true_flange(&self, t: f64) -> Rigid<Base, Flange> {
        self.world().true_flange(t)
    }
}

/// The scene's axes relative to the nominal camera that looks straight down: x along the picture's rows, z up.
fn scene_in(design: &Station) -> Mat3 {
    design.flange_from_camera.rotation * Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0))
}

/// Pose of the scene: below the sensor at the arm's start pose, at twice the working distance. It is shifted,
/// turned and tilted slightly, differently for each seed; not at all for seed 0.
fn place(station: &Station, tilt_deg: f64) -> Rigid<Base, InScene> {
    let mut rng = station.rng("cell place", 0);
    let mut within = |by: f64| if station.seed == 0 { 0.0 } else { rng.random_range(-by..=by) };
    let turn = exp(&(Vec3::z() * within(0.26)));
    let azimuth = within(std::f64::consts::PI);
    let tilt = exp(&(Vec3::new(azimuth.cos(), azimuth.sin(), 0.0) * within(tilt_deg.to_radians())));
    let (start, design) = (Vs060::drawn().forward(&START_DEG.map(f64::to_radians)), Station::of(&station.rig, 0));
    let (aside, up) = (0.06 * design.working_distance, 0.1 * design.working_distance);
    let middle = start * design.flange_from_camera;
    let below = middle.translation + middle.rotation.column(2) * (2.0 * design.working_distance);
    Rigid::new(
        tilt * turn * start.rotation * scene_in(&design),
        below + Vec3::new(within(aside), within(aside), within(up)),
    )
}

/// Joints at the start: with the sensor over the scene, or moved parallel to the scene until it is over the board.
fn start(options: &CellOptions, base_from_scene: &Rigid<Base, InScene>) -> Result<Joints> {
    let (arm, over_scene) = (Vs060::drawn(), START_DEG.map(f64::to_radians));
    if !options.over_board {
        return Ok(over_scene);
    }
    let mut flange = arm.forward(&over_scene);
    flange.translation += base_from_scene.rotation * Vec3::from(BOARD_BESIDE_MM);
    arm.inverse(&flange, &over_scene).map_err(|_| {
        Fault::refused("the arm cannot stand over the board")
            .cause("the board lies beyond its reach")
            .next("take another seed")
    })
}

/// Pose of the scene on the flange: a plate with the scene on its far side, the calibration board in its middle.
fn on_flange() -> Rigid<Flange, InScene> {
    Rigid::new(Mat3::identity(), Vec3::z() * PLATE_MM - Vec3::from(BOARD_BESIDE_MM))
}

/// Pose of a sensor fixed in the cell. At the arm's start pose it sees the board on the flange as a sensor on the
/// flange would see the board below it.
fn stand(
    options: &CellOptions,
    station: &Station,
    base_from_scene: &Rigid<Base, InScene>,
    flange_from_scene: &Rigid<Flange, InScene>,
) -> Result<Rigid<Base, Camera>> {
    let arm = Vs060::drawn();
    let over = arm.forward(&start(&CellOptions { over_board: true, ..options.clone() }, base_from_scene)?);
    let scene_from_camera = base_from_scene.inverse() * over * station.flange_from_camera;
    Ok(arm.forward(&START_DEG.map(f64::to_radians)) * *flange_from_scene * scene_from_camera)
}

/// Pose of the gripper. Its axes are parallel to the scene's while the sensor looks at it, so that little rotation
/// is needed.
fn gripper(station: &Station) -> Rigid<Flange, Tool> {
    let mut rng = station.rng("cell gripper", 0);
    let mut within = |by: f64| if station.seed == 0 { 0.0 } else { rng.random_range(-by..=by) };
    let off = Vec3::new(within(1.0), within(1.0), within(1.0));
    let turn = exp(&(Vec3::z() * within(0.02)));
    Rigid::new(turn * scene_in(&Station::of(&station.rig, 0)), Vec3::from(GRIPPER_AT_MM) + off)
}

fn arm_error(station: &Station, mm: f64, deg: f64) -> ArmError {
    let mut rng = station.rng("arm error", 0);
    let mut within = |by: f64| rng.random_range(-1.0..=1.0) * by;
    let lengths_mm = std::array::from_fn(|_| within(mm));
    ArmError { lengths_mm, zeros_deg: std::array::from_fn(|_| within(deg)) }
}

fn parts(spec: &SceneSpec, base_from_scene: &Rigid<Base, InScene>) -> BTreeMap<String, Rigid<Base, Part>> {
    spec.part.iter().map(|p| (p.name.clone(), *base_from_scene * part_pose::<InScene>(p))).collect()
}

fn with_board(
    options: &CellOptions,
    scene: Scene,
    base_from_scene: &Rigid<Base, InScene>,
) -> Result<(Scene, Option<Rigid<Base, Board>>)> {
    let Some(board) = &options.board else { return Ok((scene, None)) };
    // The board's z axis points into the board; its middle lies beside the scene's middle.
    let down = Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0));
    let [x0, y0, x1, y1] = board.outline();
    let at = Vec3::from(BOARD_BESIDE_MM) - down * Vec3::new((x0 + x1) / 2.0, (y0 + y1) / 2.0, 0.0);
    let scene_from_board: Rigid<InScene, Board> = Rigid::new(down, at);
    Ok((scene.with_board(board, &down, &at, PRINT[0], PRINT[1])?, Some(*base_from_scene * scene_from_board)))
}

fn held(spec: &SceneSpec, name: Option<&str>) -> Result<Option<Component>> {
    let Some(name) = name else {
        return Ok(spec.part.iter().find_map(|p| Component::of(p).ok()));
    };
    let part = spec.part.iter().find(|p| p.name == name).ok_or_else(|| {
        let names: Vec<&str> = spec.part.iter().map(|p| p.name.as_str()).collect();
        Fault::usage(format!("the scene has no part '{name}'")).next(format!("name one of: {}", names.join(", ")))
    })?;
    Component::of(part).map(Some)
}
