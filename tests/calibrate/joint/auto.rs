//! In: simulated cells that the program drives by itself: pictures of a board as each pose sees it. Out: whether it
//! calibrates them, within its box, and says what is wrong where it cannot.
//! Frame and unit: base frame, mm, degrees.

use super::stations::{Cell, rig};
use super::{rms, seeds};
use rand_pcg::Pcg64;
use sheetlight::calibrate::hand_eye::options::Mount;
use sheetlight::calibrate::joint::volume::{apart, places};
use sheetlight::calibrate::limits::Asked;
use sheetlight::camera::Readout;
use sheetlight::fault::Result;
use sheetlight::geometry::{Base, Board, Camera, Flange, Mat3, Rigid, Vec2, Vec3, exp};
use sheetlight::raster::Image;
use sheetlight::rig::{Rig, Volume};
use sheetlight::scan::{Extraction, Where};
use sheetlight::simulate::{Canvas, InScene, Scene, View, expose, reported};
use sheetlight::station::{AutoResult, AutoRun, Cell as Drives, Ended, JointRun, Light, Went, calibrate_auto};

/// A robot with the sensor over one board.
struct Simulated {
    cell: Cell,
    scene: Scene,
    pose: Rigid<Base, Flange>,
    home: Rigid<Base, Flange>,
    noise: [f64; 2],
    rng: Pcg64,
    /// Largest distance of the flange from where it began, mm, along each axis of the base.
    box_mm: f64,
    moves: Vec<Rigid<Base, Flange>>,
    pictures: u64,
    /// After so many moves the board is pushed, by 4 mm.
    pushed_after: usize,
}

impl Simulated {
    fn new(name: &str, seed: u64, size: [u32; 2], noise: [f64; 2]) -> Simulated {
        let mut cell = Cell::new(&rig(name), seed);
        cell.station = cell.station.with_size(size[0], size[1]);
        let scene = Scene::of_board(&cell.board, 0.85, 0.06).unwrap();
        let rng = cell.station.rng("auto", seed);
        // The board somewhere in the middle, a little askew, as an operator leaves it.
        let tilt = exp(&Vec3::new(0.06, -0.08, 0.0)) * exp(&(Vec3::z() * 0.2));
        let middle = cell.board.features().iter().sum::<Vec3>() / cell.board.features().len() as f64;
        let [w, h] = size.map(|n| f64::from(n) / 2.0);
        let ray = cell.station.camera.ray_from_pixel(&Vec2::new(w + 6.0, h - 8.0)).unwrap().direction;
        let z = 1.15 * cell.station.working_distance;
        let seen: Rigid<Camera, Board> = Rigid::new(tilt, ray * (z / ray.z) - tilt * middle);
        let home = cell.robot(&seen);
        let (pose, box_mm) = (home, 2.2 * z);
        Simulated { cell, scene, pose, home, noise, rng, box_mm, moves: vec![], pictures: 0, pushed_after: usize::MAX }
    }

    fn inside(&self, to: &Rigid<Base, Flange>) -> bool {
        (to.translation - self.home.translation).amax() <= self.box_mm
            && sheetlight::geometry::angle_between(&to.rotation, &self.home.rotation) < 2.6
    }
}

impl Drives for Simulated {
    fn pose(&mut self) -> Result<Rigid<Base, Flange>> {
        Ok(reported(&self.pose, self.noise[0], self.noise[1], &mut self.rng))
    }
    fn may(&mut self, to: &Rigid<Base, Flange>) -> Result<bool> {
        Ok(self.inside(to))
    }
    fn go(&mut self, to: &Rigid<Base, Flange>) -> Result<Went> {
        assert!(self.inside(to), "a move out of the box");
        self.moves.push(*to);
        if self.moves.len() == self.pushed_after {
            self.cell.base_from_board.translation += Vec3::new(4.0, 1.0, 0.0);
        }
        self.pose = *to;
        Ok(Went::There(self.pose()?))
    }
    fn readout(&self) -> Option<Readout> {
        Some(self.cell.station.camera.whole_sensor())
    }
    fn picture(&mut self, light: Light) -> Result<Image> {
        let station = &self.cell.station;
        let scene_from_board: Rigid<InScene, Board> =
            Rigid::new(Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0)), Vec3::zeros());
        let scene_from_camera =
            scene_from_board * self.cell.base_from_board.inverse() * self.pose * station.flange_from_camera;
        let view = View { station, scene: &self.scene, scene_from_camera };
        let (w, h) = (station.camera.width, station.camera.height);
        let hot = station.hot_pixels();
        let mut rng = station.rng("picture", self.pictures);
        self.pictures += 1;
        let mut canvas = Canvas::new(w, h);
        Ok(match light {
            Light::Room => {
                expose(&station.sensor, &canvas, &view.ambient(3), station.sensor.ambient_white as f32, &hot, &mut rng)
            }
            laser => {
                if laser == Light::Line {
                    view.sheet(&mut canvas);
                } else {
                    view.spot(&mut canvas);
                }
                let room = if station.sensor.ambient_leak > 0.0 { view.faint_ambient() } else { Canvas::new(w, h) };
                expose(&station.sensor, &canvas, &room, station.sensor.ambient_leak as f32, &hot, &mut rng)
            }
        })
    }
}

fn run(cell: &mut Simulated, target_mm: f64, rig: &Rig) -> Result<(AutoResult, f64)> {
    let dir = tempfile::tempdir().unwrap();
    let working = cell.cell.working();
    let asked = Asked { working: Some(Volume::new(working[0], working[1], "stated")), tolerance_mm: None };
    let auto = AutoRun {
        joint: JointRun::new(Mount::EyeInHand, asked, &Extraction::default(), Where::Cpu),
        board: cell.cell.board.clone(),
        out: dir.path().join("pictures"),
        target_mm,
        most: 40,
        working: Some(working),
        candidates: 40,
        seed: 1,
    };
    let result = calibrate_auto(cell, rig, &auto, &|_, _| {})?;
    let truth = cell.cell.truth(&[]);
    let off = apart(&result.joint.fit.state, &truth, &places(&truth, working));
    Ok((result, off))
}

#[test]
fn a_cell_calibrates_itself() {
    let long = std::env::var("SHEETLIGHT_LONG").is_ok_and(|v| v == "1");
    // The short form has a quarter of the pixels and is content with twice the error.
    let (size, target) = if long { ([640, 480], 0.02) } else { ([320, 240], 0.05) };
    let mut all = Vec::new();
    for seed in seeds(1) {
        let mut cell = Simulated::new("paper", seed, size, [0.02, 0.004]);
        let (result, off) = run(&mut cell, target, &Rig::default()).unwrap_or_else(|e| panic!("{e}"));
        let expected = result.joint.expected_mm();
        println!(
            "station {seed}: {} stops, {:?}, off {off:.4} mm, expected {expected:.4}, {:?}\n  {}",
            result.stops,
            result.ended,
            result.check,
            result.joint.quality.reasons.join("\n  ")
        );
        assert!(cell.moves.len() <= 60 && result.stops + 5 <= 40, "{} moves", cell.moves.len());
        let check = result.check.expect("five more poses");
        assert!(check.stops == 5 && check.off_mm < 2.0 * check.expected_mm, "{check:?}");
        assert!(result.ended == Ended::Target || long, "{:?}: {:?}", result.ended, result.expected_mm);
        all.push([off, off / expected]);
    }
    let (off, ratio) = (rms(all.iter().map(|a| a[0])), rms(all.iter().map(|a| a[1])));
    println!("{} stations: off {off:.4} mm rms, over sigma {ratio:.2}", all.len());
    assert!(off <= if long { 0.025 } else { 2.0 * target }, "{all:?}");
    assert!(!long || (0.8..=1.25).contains(&ratio), "{all:?}");
}

#[test]
fn what_is_wrong_with_the_board_is_said() {
    let mut away = Simulated::new("paper", 4, [320, 240], [0.02, 0.004]);
    away.pose.translation.x += 400.0;
    let said = run(&mut away, 0.05, &Rig::default()).err().unwrap().to_string();
    assert!(said.contains("not in the first picture") && away.moves.is_empty(), "{said}");

    let mut edge = Simulated::new("paper", 4, [320, 240], [0.02, 0.004]);
    edge.box_mm = 0.5;
    let said = run(&mut edge, 0.05, &Rig::default()).err().unwrap().to_string();
    assert!(said.contains("small moves"), "{said}");

    let mut pushed = Simulated::new("paper", 4, [320, 240], [0.02, 0.004]);
    pushed.pushed_after = 5;
    let said = run(&mut pushed, 0.05, &Rig::default()).err().unwrap().to_string();
    assert!(said.contains("the board was moved by 4.") && said.contains("ambient_0005"), "{said}");
}
