//! In: a camera in memory with in-flight pictures, settings that take effect late, rounded exposures and outages.
//! Out: whether each recorded pose has a picture of every exposure, taken with it and where the robot stood; whether
//! the exposure is set back; the exposures that are proposed for a scene.
//! Frame and unit: us; mm; levels.

use sheetlight::capture::pair::Way;
use sheetlight::capture::record::{RecordReport, Recorder, RecorderOptions, record_poses};
use sheetlight::capture::{
    Bracketed, Event, Exposures, Feature, Feed, FeedOptions, Format, Picture, PictureSource, Range, RoundTrip, Stream,
    Value, propose,
};
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Flange, Rigid, Vec3};
use sheetlight::raster::Image;
use sheetlight::recording::{Motion, Recording, Stand};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

const SIZE: [u32; 2] = [192, 48];
/// Time between two pictures, ns.
const PERIOD: u64 = 10_000_000;
/// Light of the stripe in three bands of columns, levels per us: bright, medium, dark.
const LIGHT: [f64; 3] = [0.3, 0.02, 0.0025];
const THREE: [f64; 3] = [500.0, 2000.0, 8000.0];

/// A camera over a scene, on a robot that goes from pose to pose.
#[derive(Clone)]
struct Camera {
    light: [f64; 3],
    /// What is set, and what exposes: a setting takes effect after `lag` more pictures.
    set_us: f64,
    us: f64,
    lag: u64,
    pending: u64,
    /// Pictures that were exposed and not delivered yet: their numbers and exposures.
    waiting: VecDeque<(u64, f64)>,
    in_flight: usize,
    /// Whether pictures have times, and whether they state their exposure.
    dated: bool,
    states: bool,
    next: u64,
    /// Exposures are rounded down to multiples of this, us.
    step_us: f64,
    range: [f64; 2],
    more: Vec<(&'static str, &'static str)>,
    /// It stands at pose k for so many pictures, the numbers repeat; between two poses one picture is in motion.
    holds: Vec<u64>,
    /// The picture at which it is lost once; it comes back with its usual exposure.
    lost_at: Option<u64>,
    /// Number of settings after which it refuses.
    refuses_after: Option<usize>,
    /// Whether it takes pictures only when they are asked for, and the number that are asked for.
    on_request: bool,
    requested: u64,
    /// All settings.
    log: Arc<Mutex<Vec<f64>>>,
}

impl Camera {
    fn new() -> Camera {
        Camera {
            light: LIGHT,
            set_us: 1000.0,
            us: 1000.0,
            lag: 0,
            pending: 0,
            waiting: VecDeque::new(),
            in_flight: 0,
            dated: true,
            states: false,
            next: 0,
            step_us: 0.0,
            range: [10.0, 100_000.0],
            more: vec![],
            holds: vec![60],
            lost_at: None,
            refuses_after: None,
            on_request: false,
            requested: 0,
            log: Arc::default(),
        }
    }

    /// The pose at a picture, and the share of the way to the next one.
    fn place(&self, id: u64) -> (u64, f64) {
        let round: u64 = self.holds.iter().map(|n| n + 1).sum();
        let (mut pose, mut left) = (id / round * self.holds.len() as u64, id % round);
        for hold in &self.holds {
            if left <= *hold {
                return (pose, if left == *hold { 0.5 } else { 0.0 });
            }
            (pose, left) = (pose + 1, left - hold - 1);
        }
        unreachable!("a round has all of them")
    }

    fn expose(&mut self) {
        self.waiting.push_back((self.next, self.us));
        self.next += 1;
        self.pending = self.pending.saturating_sub(1);
        if self.pending == 0 {
            self.us = self.set_us;
        }
    }
}

/// The corner shows the number of the pose, whatever the exposure.
fn level(light: &[f64; 3], us: f64, pose: u64, x: u32, y: u32) -> u8 {
    if (x, y) == (0, 0) {
        return (pose % 100) as u8;
    }
    let across = f64::from(y) - 24.0;
    (light[(x * 3 / SIZE[0]) as usize] * us * (-0.5 * across * across / 2.25).exp()).min(255.0).round() as u8
}

impl PictureSource for Camera {
    fn format(&self) -> Format {
        Format { width: SIZE[0], height: SIZE[1], bits: 8 }
    }

    fn next(&mut self, within: Duration) -> Event {
        if (within.is_zero() && self.waiting.is_empty()) || (self.on_request && self.requested == 0) {
            return Event::Quiet;
        }
        self.requested = self.requested.saturating_sub(1);
        if self.lost_at.is_some_and(|at| self.next >= at) {
            self.lost_at = None;
            return Event::Lost(Fault::input("its cable is out").next("plug it in"));
        }
        if self.waiting.is_empty() {
            self.expose();
        }
        let (id, us) = self.waiting.pop_front().expect("one was exposed");
        let (pose, way) = self.place(id);
        let at: Rigid<Base, Flange> =
            Rigid::new(Rigid::<Base, Flange>::identity().rotation, Vec3::new(pose as f64 + way, 0.0, 0.0));
        let levels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
        Event::Picture(Box::new(Picture {
            image: Image::from_u8(SIZE[0], SIZE[1], levels.map(|(x, y)| level(&self.light, us, pose, x, y)).collect()),
            id,
            device_ns: self.dated.then_some(1 + id * PERIOD),
            host_ns: 1_000_000_000 + id * PERIOD,
            exposure_ns: self.states.then_some((1e3 * us) as u64),
            count: None,
            stand: Some(Stand::Robot(at)),
            profiles: None,
        }))
    }

    fn trigger(&mut self) -> Result<bool> {
        self.requested += 1;
        Ok(self.on_request)
    }

    fn clock(&mut self) -> Result<Option<RoundTrip>> {
        let ns = self.next * PERIOD;
        Ok(self.dated.then_some(RoundTrip { before_ns: ns, there_ns: ns, after_ns: ns }))
    }

    /// Its pictures come when they are asked for.
    fn waits(&self) -> bool {
        true
    }

    fn reopens(&self) -> bool {
        true
    }

    fn reopen(&mut self) -> Result<()> {
        (self.us, self.set_us, self.pending) = (1000.0, 1000.0, 0);
        self.waiting.clear();
        Ok(())
    }

    fn features(&mut self) -> Result<Vec<Feature>> {
        let feature = |name: &str, value, range| Feature {
            name: name.into(),
            value: Some(value),
            unit: String::new(),
            range,
            writable: true,
        };
        let [low, high] = self.range;
        let mut all = vec![feature("ExposureTime", Value::Float(self.set_us), Range::Between(low, high))];
        all.extend(self.more.iter().map(|(name, word)| feature(name, Value::Word((*word).into()), Range::Any)));
        Ok(all)
    }

    fn set(&mut self, name: &str, value: &str) -> Result<()> {
        assert_eq!(name, "ExposureTime");
        let us: f64 = value.parse().expect("a number");
        let mut log = self.log.lock().unwrap();
        if self.refuses_after.is_some_and(|n| log.len() >= n && us != 1000.0) {
            return Err(Fault::usage(format!("ExposureTime {us} is refused")).next("read its manual"));
        }
        log.push(us);
        drop(log);
        // Pictures in flight were exposed before the setting.
        while self.waiting.len() < self.in_flight {
            self.expose();
        }
        self.set_us = if self.step_us > 0.0 { (us / self.step_us).floor() * self.step_us } else { us };
        self.pending = self.lag;
        if self.lag == 0 {
            self.us = self.set_us;
        }
        Ok(())
    }

    fn name(&self) -> String {
        "camera".into()
    }
}

/// Records poses; gives the recording, the report, and what was told.
fn recorded(
    camera: &Camera,
    out: &Path,
    exposures: &[f64],
    poses: u64,
) -> (std::result::Result<RecordReport, Fault>, Vec<String>, Exposures) {
    let source = Bracketed::new(Box::new(camera.clone()), exposures, 0.0).unwrap();
    let known = source.exposures();
    let feed = Feed::start(Box::new(source), FeedOptions { memory: 1, ..FeedOptions::default() }).unwrap();
    let mut stream = Stream::new(feed, Way::Given);
    let options = RecorderOptions {
        set: "scan".into(),
        motion: Some(Motion::default()),
        exposures_us: known.us().to_vec(),
        ..RecorderOptions::default()
    };
    let recorder = Recorder::create(out, stream.format(), options).unwrap();
    let mut said = Vec::new();
    let report = record_poses(&mut stream, recorder, &known, Some(poses), |_, s| said.extend(s));
    assert_eq!(stream.account().unexplained(), 0, "{}", stream.account());
    drop(stream);
    (report, said, known)
}

/// Every picture of every frame was taken with its exposure, at the pose that the frame states; the poses' numbers.
fn checked(out: &Path, light: &[f64; 3]) -> Vec<u64> {
    let recording = Recording::open(out).unwrap();
    let poses = recording.poses(None).unwrap();
    let mut numbers = Vec::new();
    for (i, frame) in recording.meta.frames.iter().enumerate() {
        let pose = poses[frame.pose.unwrap()].translation.x;
        for (name, us) in frame.lasers().iter().zip(&recording.meta.exposures_us) {
            let image = recording.picture(name).unwrap();
            for (x, y) in [(0, 0), (5, 24), (100, 24), (100, 22), (180, 24), (180, 25)] {
                let want = level(light, *us, pose as u64, x, y);
                assert_eq!(image.get(x, y), u16::from(want), "frame {i}, {name}, {us} us at {x}, {y}");
            }
        }
        let stated = frame.taken.as_ref().unwrap().exposure_ns.unwrap();
        assert!((1e-3 * stated as f64 / recording.meta.exposures_us[0] - 1.0).abs() < 1e-6, "{stated}");
        numbers.push(pose as u64);
    }
    numbers
}

/// A camera that is asked for each picture loses none, unless its setting takes effect late.
#[test]
fn pictures_that_are_triggered_are_all_used() {
    for lag in [0, 2] {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("rec");
        let holds = vec![if lag == 0 { 4 } else { 60 }];
        let camera = Camera { on_request: true, lag, holds, ..Camera::new() };
        let (report, said, _) = recorded(&camera, &out, &THREE, 3);
        let report = report.unwrap();
        println!("lag {lag}: {} {said:?}", report.account);
        assert_eq!((checked(&out, &LIGHT).len(), report.account.used), (3, 9));
        assert!(lag > 0 || said.iter().all(|s| !s.contains("excluded after each")), "{said:?}");
        set_back(&camera);
    }
}

fn set_back(camera: &Camera) {
    let log = camera.log.lock().unwrap();
    assert_eq!(log.last(), Some(&1000.0), "the exposure of before: {log:?}");
}

#[test]
fn each_pose_has_a_picture_of_every_exposure_that_was_in_effect() {
    for (dated, states, lag, in_flight) in [
        (true, false, 0, 0),
        (true, false, 1, 5),
        (false, false, 2, 7),
        (true, true, 3, 4),
        // Only the light shows that a setting takes three pictures: it learns to wait for them.
        (true, false, 3, 2),
        (false, false, 4, 0),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("rec");
        let camera = Camera { dated, states, lag, in_flight, holds: vec![150], ..Camera::new() };
        let (report, said, _) = recorded(&camera, &out, &THREE, 6);
        let report = report.unwrap();
        let numbers = checked(&out, &LIGHT);
        println!("dated {dated}, states {states}, lag {lag}, {in_flight} in flight: {} {said:?}", report.account);
        assert_eq!(numbers, [0, 1, 2, 3, 4, 5], "one frame a pose");
        assert_eq!((report.shots, report.account.used), (6, 18));
        assert!(report.account.spare > 0 && report.account.dropped() == 0, "{}", report.account);
        assert_eq!(report.exposures.unwrap().exposures_us, THREE);
        let learns = !states && lag > if dated { 1 } else { 2 };
        assert_eq!(said.iter().any(|s| s.contains("pictures are excluded after each setting")), learns, "{said:?}");
        set_back(&camera);
    }
}

#[test]
fn a_pose_that_is_left_early_is_left_out_and_never_mixed_with_the_next() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("rec");
    // Three exposures need six pictures: every other pose has four.
    let camera = Camera { holds: vec![4, 30], ..Camera::new() };
    let (report, said, _) = recorded(&camera, &out, &THREE, 5);
    let report = report.unwrap();
    let numbers = checked(&out, &LIGHT);
    assert_eq!(numbers, [1, 3, 5, 7, 9], "{said:?}");
    let left = report.exposures.as_ref().unwrap().left;
    let listed = report.left_out.iter().filter(|l| l.why.contains("it moved on after")).count();
    println!("{left} poses left, {listed} of their pictures listed: {}", report.account);
    assert!(left >= 4 && listed as u64 >= left, "{report:?}");
    assert!(said.iter().any(|s| s.contains("stand still for longer")), "{said:?}");
    let text = std::fs::read_to_string(out.join("left_out.json")).unwrap();
    assert!(text.contains("of 3 exposures"), "{text}");
    set_back(&camera);
    // One that never stands still for long enough: nothing is recorded, and the reason is listed.
    let camera = Camera { holds: vec![3], lost_at: Some(400), ..Camera::new() };
    let feed = |camera: &Camera| {
        let source = Bracketed::new(Box::new(camera.clone()), &THREE, 0.0).unwrap();
        let known = source.exposures();
        let options = FeedOptions { memory: 1, patience: Duration::ZERO, ..FeedOptions::default() };
        (Stream::new(Feed::start(Box::new(source), options).unwrap(), Way::Given), known)
    };
    let (mut stream, known) = feed(&camera);
    let options = RecorderOptions { exposures_us: known.us().to_vec(), ..RecorderOptions::default() };
    let recorder = Recorder::create(&dir.path().join("none"), stream.format(), options).unwrap();
    let fault = record_poses(&mut stream, recorder, &known, None, |_, _| {}).unwrap_err();
    assert!(fault.what.contains("cable is out") && fault.what.contains("holds 0 shots"), "{fault}");
    set_back(&camera);
}

#[test]
fn a_camera_that_comes_back_gets_its_exposure_again_and_one_that_refuses_ends_the_recording() {
    let dir = tempfile::tempdir().unwrap();
    let camera = Camera { lost_at: Some(100), in_flight: 3, ..Camera::new() };
    let out = dir.path().join("lost");
    let (report, said, _) = recorded(&camera, &out, &THREE, 4);
    assert_eq!((report.unwrap().account.outages, checked(&out, &LIGHT).len()), (1, 4), "{said:?}");
    assert!(said.iter().any(|s| s.contains("back after")), "{said:?}");
    set_back(&camera);
    // Three settings to look, then some that work.
    let camera = Camera { refuses_after: Some(14), holds: vec![12], ..Camera::new() };
    let out = dir.path().join("refused");
    let (report, ..) = recorded(&camera, &out, &THREE, 40);
    let fault = report.unwrap_err();
    assert!(fault.what.contains("is refused") && fault.what.contains("shots, whole"), "{fault}");
    assert!(!checked(&out, &LIGHT).is_empty());
    set_back(&camera);
}

#[test]
fn what_is_no_bracket_of_a_camera_is_refused_and_its_exposure_is_set_back() {
    let refused = |camera: &Camera, exposures: &[f64], words: &[&str]| {
        let fault = Bracketed::new(Box::new(camera.clone()), exposures, 0.0).err().expect("refused");
        let said = fault.to_string();
        assert!(words.iter().all(|w| said.contains(w)), "{exposures:?}: {said}");
        assert!(!fault.next.is_empty() && fault.kind == sheetlight::fault::Kind::Usage, "{said}");
        if !camera.log.lock().unwrap().is_empty() {
            set_back(camera);
        }
    };
    let plain = Camera::new();
    refused(&plain, &[500.0], &["a bracket has 1 exposures", "two to four"]);
    refused(&plain, &[500.0, 700.0, 900.0, 1200.0, 1600.0], &["a bracket has 5 exposures"]);
    refused(&plain, &[2000.0, 500.0], &["500 us after one of 2000 us", "shortest to the longest"]);
    refused(&plain, &[500.0, 500.0], &["500 us after one of 500 us"]);
    refused(&plain, &[20.0, 8000.0], &["400 times the shortest, limit 256"]);
    refused(&plain, &[f64::NAN, 8000.0], &["NaN us"]);
    refused(&plain, &[5.0, 500.0], &["an exposure of 5 us, it can do 10 to 100000 us"]);
    assert!(plain.log.lock().unwrap().is_empty(), "nothing was set");
    // 1000 and 1300 become 1000.
    let rounds = Camera { step_us: 1000.0, ..Camera::new() };
    refused(
        &rounds,
        &[1000.0, 1300.0, 8000.0],
        &["was set to 1000, 1300, 8000 us and says 1000, 1000, 8000 us", "rounds"],
    );
    refused(&Camera { refuses_after: Some(1), ..Camera::new() }, &THREE, &["ExposureTime 2000 is refused"]);
    let auto = |name, word| Camera { more: vec![(name, word)], ..Camera::new() };
    refused(
        &auto("ExposureAuto", "Continuous"),
        &THREE,
        &["ExposureAuto is Continuous", "camera set ExposureAuto Off"],
    );
    refused(&auto("GainAuto", "Once"), &THREE, &["GainAuto is Once"]);
    let wired = Camera { more: vec![("TriggerMode", "On"), ("TriggerSource", "Line0")], ..Camera::new() };
    refused(&wired, &THREE, &["it is triggered by Line0", "camera set TriggerMode Off"]);
    // Its pictures are triggered by whoever asks for them.
    let asked = Camera { more: vec![("TriggerMode", "On"), ("TriggerSource", "Software")], ..Camera::new() };
    assert_eq!(Bracketed::new(Box::new(asked), &THREE, 0.0).unwrap().exposures().us(), THREE);
    let off = Camera { more: vec![("TriggerMode", "Off"), ("ExposureAuto", "Off")], ..Camera::new() };
    assert_eq!(Bracketed::new(Box::new(off), &THREE, 0.0).unwrap().exposures().us(), THREE);
    // What the camera made of it is what counts.
    let rounds = Camera { step_us: 300.0, ..Camera::new() };
    let known = Bracketed::new(Box::new(rounds.clone()), &THREE, 0.0).unwrap().exposures();
    assert_eq!(known.us(), [300.0, 1800.0, 7800.0]);
    set_back(&rounds);
}

/// A camera whose levels are not linear, or whose setting has no effect, is found out by its light.
#[test]
fn light_that_never_follows_the_exposure_ends_the_recording() {
    let dir = tempfile::tempdir().unwrap();
    let camera = Camera { lag: 1_000_000, holds: vec![100_000], ..Camera::new() };
    let (report, said, _) = recorded(&camera, &dir.path().join("rec"), &THREE, 3);
    let fault = report.unwrap_err();
    assert!(fault.what.contains("poses in a row") && fault.what.contains("holds 0 shots"), "{fault}");
    assert!(said.iter().any(|s| s.contains("the pose is taken again")), "{said:?}");
    set_back(&camera);
}

#[test]
fn exposures_are_proposed_from_what_was_measured_where_one_cannot_hold_the_scene() {
    for (dated, from) in [(true, 300.0), (false, 40.0), (true, 20_000.0)] {
        let mut camera = Camera { dated, in_flight: 3, set_us: from, us: from, ..Camera::new() };
        let found = propose(&mut camera, |_, _| {}).unwrap().expect("bright and dark");
        println!("from {from} us: {found}");
        // Bright bands at 85 % of full scale, dark ones at 20 %; no noise but rounding, of 0.3 levels.
        let [first, last] = [found.exposures_us[0], found.exposures_us[found.exposures_us.len() - 1]];
        assert!((first / (0.85 * 255.0 / LIGHT[0]) - 1.0).abs() < 0.02, "{first}");
        assert!((last / (0.2 * 255.0 / LIGHT[2]) - 1.0).abs() < 0.06, "{last}");
        assert_eq!(found.exposures_us.len(), 3, "a ratio of 28");
        assert!((found.measurable_us / (10.0 * 0.3 / LIGHT[2]) - 1.0).abs() < 0.06, "{}", found.measurable_us);
        // At that exposure a third of the stripe is saturated.
        assert!((found.saturated - 1.0 / 3.0).abs() < 0.02 && found.noise == 0.3, "{found:?}");
        assert!((found.darkest - LIGHT[2] * first).abs() < 0.2, "{found:?}");
        let said = found.to_string();
        assert!(said.contains("33.3 % of the stripe is saturated") && said.contains(&found.option()), "{said}");
        // What is proposed is a bracket, and the exposure is as it was.
        assert_eq!(camera.set_us, from);
        Bracketed::new(Box::new(camera), &found.exposures_us, 0.0).unwrap();
    }
    // The dark band is measurable where the bright one is not saturated: one exposure holds both.
    let mut camera = Camera { light: [0.3, 0.1, 0.02], set_us: 700.0, us: 700.0, ..Camera::new() };
    assert_eq!(propose(&mut camera, |_, _| {}).unwrap(), None);
    // No stripe.
    let mut camera = Camera { light: [0.0; 3], ..Camera::new() };
    assert_eq!(propose(&mut camera, |_, _| {}).unwrap(), None);
    // The longest exposure ends before the dark band is at a fifth of full scale.
    let mut camera = Camera { range: [10.0, 5000.0], ..Camera::new() };
    assert_eq!(*propose(&mut camera, |_, _| {}).unwrap().unwrap().exposures_us.last().unwrap(), 5000.0);
}
