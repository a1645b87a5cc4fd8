//! In: a test device and the aravis fake camera on loopback. Out: whether every picture that was taken is received as
//! it is or accounted for, with packets lost, the cable pulled, and a second program asking for the camera.
//! Frame and unit: pictures, packets.

use super::device::{Device, Faults};
use super::{cloud_of, scan_folder, text};
use crate::common::sheetlight_fails;
use crate::common::tries::{judged, tries};
use crate::common::wait::until;
use sheetlight::capture::pair::{Counting, PoseFeed, Sample, Table, Way};
use sheetlight::capture::{
    Account, Bracketed, CameraUri, Fate, Fed, Feed, FeedOptions, PictureSource, Stream, Streamed, now_ns,
};
use sheetlight::geometry::{Base, Flange, Rigid, Vec3};
use sheetlight::raster::Image;
use sheetlight::recording::{Recording, Stand};
use std::net::{Ipv4Addr, UdpSocket};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// A camera that does not answer within half a second is taken for none, and pictures that nobody takes from the
/// network for a third of one are lost: a machine that stands still for so long spoils a trial.
const TRIES: usize = 8;

fn pictures() -> Vec<Image> {
    let recording = Recording::open(&scan_folder()).unwrap();
    let names = recording.meta.frames.iter().filter_map(|f| f.laser.clone());
    names.map(|n| recording.picture(&n).unwrap()).collect()
}

fn address(last: u8) -> Ipv4Addr {
    Ipv4Addr::new(127, 0, 77, last)
}

fn open(uri: &str) -> Result<Box<dyn PictureSource>, String> {
    uri.parse::<CameraUri>().unwrap().open(None).map_err(|e| e.what)
}

/// Runs the program; gives its stdout, or its stderr where it failed.
fn run(args: &[&str]) -> Result<String, String> {
    let done = Command::new(env!("CARGO_BIN_EXE_sheetlight")).args(args).output().expect("the program starts");
    let said = if done.status.success() { done.stdout.clone() } else { done.stderr.clone() };
    let said = String::from_utf8_lossy(&said).into_owned();
    if done.status.success() { Ok(said) } else { Err(said) }
}

/// Receives until it is enough, looks at each picture, gives the account. `enough` is told for how long nothing has
/// come.
fn receive(
    uri: &str,
    enough: impl Fn(&Account, Duration) -> bool,
    mut look: impl FnMut(u64, Image),
) -> Result<(Account, Vec<String>), String> {
    let stop = Arc::new(AtomicBool::new(false));
    let feed = Feed::start(open(uri)?, FeedOptions { stop: stop.clone(), ..FeedOptions::default() }).unwrap();
    let (mut said, mut heard) = (Vec::new(), Instant::now());
    loop {
        said.extend(feed.news());
        if enough(&feed.account(), heard.elapsed()) {
            stop.store(true, Relaxed);
        }
        match feed.next(Duration::from_millis(50)) {
            Fed::Picture(p, _) => {
                feed.fate(Fate::Used);
                look(p.id, p.image);
                heard = Instant::now();
            }
            Fed::Quiet => {}
            Fed::Ended(fault) => {
                assert!(fault.is_none(), "{fault:?}");
                break;
            }
        }
    }
    assert_eq!(feed.account().unexplained(), 0, "{} {said:?}", feed.account());
    Ok((feed.account(), said))
}

/// The device has taken all of its pictures, and all have come, or no more do.
fn all(device: &Device, count: u64) -> impl Fn(&Account, Duration) -> bool {
    let taken = device.taken.clone();
    move |a, quiet| taken.load(Relaxed) == count && (a.sent == count || quiet > Duration::from_secs(5))
}

#[test]
fn a_recording_streamed_over_gige_vision_scans_to_the_same_bytes() {
    let recorded = tries(TRIES, || {
        let dir = tempfile::tempdir().unwrap();
        let device = Device::start(address(1), pictures(), 25.0, 24, Faults::default());
        let (out, poses) = (text(&dir.path().join("rec")), text(&scan_folder().join("poses.json")));
        let camera = format!("gige://{}", address(1));
        let args = ["record", "--camera", &camera, "--pair", "count", "--poses", &poses, "--shots", "24"];
        // Where one is lost the 24th never comes.
        let report = run(&[&args[..], &["--seconds", "10", "--json", "--out", &out]].concat())?;
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        let a: Account = serde_json::from_value(report["account"].clone()).unwrap();
        assert_eq!(a.unexplained(), 0, "{a}");
        judged(dir, (a.sent, a.used) == (device.unplug(), 24), a)
    });
    let (at, out) = (recorded.path(), recorded.path().join("rec"));
    let recording = Recording::open(&out).unwrap();
    let names: Vec<_> = recording.meta.frames.iter().map(|f| f.laser.clone().unwrap()).collect();
    assert!(names.iter().map(|n| recording.picture(n).unwrap()).eq(pictures()), "pictures differ");
    assert!(recording.meta.frames.iter().all(|f| f.taken.as_ref().unwrap().device_ns.is_some()));
    let want = cloud_of(&scan_folder(), &at.join("file"));
    assert!(cloud_of(&out, &at.join("streamed")) == want, "another cloud");
}

#[test]
fn lost_packets_cost_pictures_that_are_counted_and_never_torn() {
    let (sent, count) = (pictures(), 100);
    for (last, faults) in [
        (2, Faults { lost_per_mille: 5, resends: true, ..Faults::default() }),
        (3, Faults { lost_per_mille: 2, skips: 17, ..Faults::default() }),
    ] {
        tries(TRIES, || {
            let device = Device::start(address(last), sent.clone(), 50.0, count, faults);
            let (a, _) = receive(&format!("gige://{}", address(last)), all(&device, count), |id, image| {
                assert!(image == sent[(id as usize - 1) % sent.len()], "picture {id} is torn");
            })?;
            let lost = device.lost.load(Relaxed);
            let taken = device.unplug();
            println!("{lost} packets lost, resend {}: {a}", faults.resends);
            assert!(lost > 0, "nothing was lost");
            assert!(a.sent <= taken, "{taken} taken: {a}");
            let as_it_should = if faults.resends {
                a.resent > 0 && a.incomplete + a.missed <= 2
            } else {
                a.incomplete > 0 && a.missed > 0 && a.used < taken
            };
            // What is lost at the very end leaves no number behind.
            judged((), as_it_should && taken - a.sent <= 1, format!("{taken} taken: {a}"))
        });
    }
}

/// Its numbers have 16 bits: after 65535 comes 1.
#[test]
fn numbers_that_begin_anew_after_sixteen_bits_go_on() {
    let (count, sent) = (60, pictures());
    let faults = Faults { first: 65_510, skips: 9, ..Faults::default() };
    tries(TRIES, || {
        let device = Device::start(address(6), sent.clone(), 50.0, count, faults);
        let mut ids = Vec::new();
        let (a, said) = receive(&format!("gige://{}", address(6)), all(&device, count), |id, _| ids.push(id))?;
        println!("across the end of 16 bits: {a}");
        assert!(ids.is_sorted() && a.late == 0, "{a} {ids:?}");
        // The last of all is one that it skips, or is not.
        let missed = (count / 9 - 1..=count / 9 + 2).contains(&a.missed) && a.used + a.missed + 1 >= count;
        let on = a.outages == 0 && said.is_empty() && ids.last().is_some_and(|id| *id > 65_560);
        judged((), missed && on, format!("{a} {said:?} {ids:?}"))
    });
}

/// Pictures carry the device's time, which jumps by 120 ms after forty: those around it have no pose, all others the
/// right one.
#[test]
fn a_clock_that_jumps_costs_what_came_around_it_and_pairs_nothing_wrongly() {
    const SPEED: f64 = 200.0;
    let count = 120;
    let faults = Faults { jump: Some((40, 120_000_000)), ..Faults::default() };
    tries(TRIES, || {
        let device = Device::start(address(7), pictures(), 40.0, count, faults);
        let start = now_ns();
        let at = |ns: u64| (ns - start) as f64 * 1e-9 * SPEED;
        let sample = |k: u64| {
            let ns = start + k * 8_000_000;
            let pose = Rigid::<Base, Flange>::from_vectors(&Vec3::new(3.1, 0.0, 0.0), Vec3::new(at(ns), 0.0, 300.0));
            Sample { ns, sigma_ns: 0.0, stand: Stand::Robot(pose) }
        };
        // For a minute: longer than the pictures come, whatever the machine does.
        let poses = PoseFeed::of((0..7500).map(sample));
        let stop = Arc::new(AtomicBool::new(false));
        let options = FeedOptions { stop: stop.clone(), ..FeedOptions::default() };
        let feed = Feed::start(open(&format!("gige://{}", address(7)))?, options).unwrap();
        let mut stream = Stream::new(feed, Way::Clock { poses, delay_ns: 0.0, delay_sigma_ns: 0.0 });
        let (mut ahead, mut unsure_ns, mut said): (f64, f64, Vec<String>) = (f64::MIN, 0.0, Vec::new());
        let mut heard = Instant::now();
        loop {
            said.extend(stream.news());
            if device.taken.load(Relaxed) == count && heard.elapsed() > Duration::from_millis(600) {
                stop.store(true, Relaxed);
            }
            match stream.next(Duration::from_millis(50)) {
                Streamed::Shot(shot) => {
                    stream.fate(Fate::Used);
                    heard = Instant::now();
                    let Some(Stand::Robot(pose)) = shot.stand else { panic!("no pose") };
                    // It comes after it was taken, how long after is the machine's load: a pose of after it came is
                    // of a wrong time.
                    ahead = ahead.max((pose.translation.x - at(shot.picture.host_ns)) / SPEED);
                    unsure_ns = unsure_ns.max(shot.taken.time_sigma_ns.unwrap());
                }
                Streamed::Quiet => {}
                Streamed::Ended(fault) => break assert!(fault.is_none(), "{fault:?}"),
            }
        }
        let a = stream.account();
        let told = format!(
            "a clock that jumps by 120 ms: {a}; poses at most {:.1} ms after a picture came, times to {:.2} ms, \
             {said:?}",
            1e3 * ahead,
            1e-6 * unsure_ns
        );
        println!("{told}");
        assert_eq!(a.unexplained(), 0, "{a}");
        // Where the clock's answers took as long as it jumped nobody can see that it did.
        judged((), unsure_ns < 2e6, &told)?;
        assert!(ahead < 0.01, "{ahead} s");
        let listed = stream.left_out().iter().all(|l| l.why.contains("clock jumped"));
        let jumped = listed && said.iter().any(|s| s.contains("clock jumped"));
        judged((), jumped && (1..=20).contains(&a.unpaired) && a.used >= 90, told)
    });
}

#[test]
fn a_colour_camera_and_one_that_is_not_there_are_answered() {
    let _device = Device::start(address(8), pictures(), 50.0, 5, Faults { colour: true, ..Faults::default() });
    tries(TRIES, || {
        let said = sheetlight_fails(&["record", "--camera", &format!("gige://{}", address(8)), "--out", "x"]).1;
        judged((), said.contains("pixel format is BayerRG8") && said.contains("set PixelFormat Mono8"), said)
    });
    let said = sheetlight_fails(&["camera", "show", "--camera", "gige://NOSUCH"]).1;
    assert!(said.contains("no camera found") && said.contains("firewall"), "{said}");
}

#[test]
fn twelve_bits_come_as_they_are() {
    let deep = Image::from_u16(64, 16, 12, (0..1024).map(|i| (i * 4 % 4096) as u16).collect());
    tries(TRIES, || {
        let device = Device::start(address(4), vec![deep.clone()], 50.0, 5, Faults::default());
        let look = |_, image| assert!(image == deep);
        let (a, _) = receive(&format!("gige://{}", address(4)), all(&device, 5), look)?;
        judged((), a.used == 5, a)
    });
}

#[test]
fn a_camera_that_is_unplugged_and_comes_back_goes_on() {
    let (sent, rate) = (pictures(), 40.0);
    let out = if std::env::var("SHEETLIGHT_LONG").is_ok() { 10.0 } else { 2.5 };
    tries(TRIES, || {
        let start = || Device::start(address(5), sent.clone(), rate, 1_000_000, Faults::default());
        let (device, over) = (start(), AtomicBool::new(false));
        let wait = |device: &Device, count| until(|| device.taken.load(Relaxed) >= count || over.load(Relaxed));
        let (received, not_taken) = std::thread::scope(|threads| {
            let pull = threads.spawn(|| {
                wait(&device, 1);
                let begun = Instant::now();
                wait(&device, 61);
                // As fast as it truly was.
                let (rate, gone) = (60.0 / begun.elapsed().as_secs_f64(), Instant::now());
                device.unplug();
                std::thread::sleep(Duration::from_secs_f64(out));
                let again = start();
                wait(&again, 1);
                let not_taken = gone.elapsed().as_secs_f64() * rate;
                wait(&again, 100);
                over.store(true, Relaxed);
                not_taken
            });
            let received = receive(&format!("gige://{}", address(5)), |_, _| over.load(Relaxed), |_, _| {});
            over.store(true, Relaxed);
            (received, pull.join().unwrap())
        });
        let (a, said) = received?;
        println!("out for {out} s and until it was taken again, {not_taken:.0} pictures: {a}; {said:?}");
        // What was out, and until it was noticed and taken again.
        let missed = a.missed as f64 / not_taken;
        let back = said.iter().any(|s| s.contains("gone")) && said.iter().any(|s| s.contains("back after"));
        judged((), a.outages == 1 && back && (0.9..1.1).contains(&missed), format!("{missed} of it: {a} {said:?}"))
    });
}

/// Its block ids begin at 1 again when it is back: poses of the scan's start are paired with none of these pictures.
#[test]
fn after_an_outage_no_picture_is_paired_by_number_with_a_pose_of_before() {
    const BEFORE: u64 = 20;
    tries(TRIES, || {
        let start = || Device::start(address(9), pictures(), 40.0, 1_000_000, Faults::default());
        let (mut device, stop) = (Some(start()), Arc::new(AtomicBool::new(false)));
        let options = FeedOptions { stop: stop.clone(), ..FeedOptions::default() };
        let feed = Feed::start(open(&format!("gige://{}", address(9)))?, options).unwrap();
        let at = |row: u64| Stand::Count(row as f64);
        let table = Table::Rows((0..100_000).map(|row| Some(at(row))).collect());
        let mut stream = Stream::new(feed, Way::Count(Counting::new(table)));
        let (mut used, mut said, mut left): (Vec<(u64, Option<Stand>)>, Vec<String>, u64) = Default::default();
        loop {
            said.extend(stream.news());
            if used.len() as u64 >= BEFORE
                && let Some(running) = device.take_if(|_| stream.account().outages == 0 && left == 0)
            {
                left = running.unplug();
                device = Some(start());
            }
            if stream.account().unpaired >= BEFORE {
                stop.store(true, Relaxed);
            }
            match stream.next(Duration::from_millis(50)) {
                Streamed::Shot(shot) => {
                    stream.fate(Fate::Used);
                    used.push((shot.picture.id, shot.stand));
                }
                Streamed::Quiet => {}
                Streamed::Ended(fault) => break assert!(fault.is_none(), "{fault:?}"),
            }
        }
        let a = stream.account();
        println!("out after {left} pictures: {a}; {said:?}");
        assert_eq!(a.unexplained(), 0, "{a}");
        let first = used[0].0;
        assert!(used.iter().all(|(id, stand)| *stand == Some(at(id - first))), "{used:?}");
        let rising = used.windows(2).all(|w| w[0].0 < w[1].0);
        assert!(rising && used.iter().all(|(id, _)| *id <= left), "{used:?}");
        let told =
            said.iter().any(|s| s.contains("are excluded")) && stream.left_out()[0].why.contains("camera was lost");
        judged((), told && a.outages == 1 && a.unpaired >= BEFORE, format!("{a} {said:?}"))
    });
}

/// aravis' fake camera, killed when it goes; none, said loudly, where it is not installed.
struct Fake(Child);

impl Drop for Fake {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// It takes the address of an interface only: one at a time.
const FAKE: &str = "gige://127.0.0.1";

fn fake(lost_per_mille: &str) -> Option<Fake> {
    let args = ["-i", "127.0.0.1", "-s", "SN1", "-r", lost_per_mille];
    let started = Command::new("arv-fake-gv-camera-0.8").args(args).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    match started {
        Ok(child) => {
            let camera = Fake(child);
            assert!(until(answers), "arv-fake-gv-camera-0.8 does not answer");
            Some(camera)
        }
        Err(e) => {
            assert!(std::env::var("CI").is_err(), "arv-fake-gv-camera-0.8: {e}");
            eprintln!("SKIPPED: arv-fake-gv-camera-0.8 (Debian aravis-tools) is not installed: {e}");
            None
        }
    }
}

/// Whether somebody answers the standard's first question: who is there.
fn answers() -> bool {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
    socket.send_to(&[0x42, 1, 0, 2, 0, 0, 0, 1], "127.0.0.1:3956").is_ok() && socket.recv(&mut [0; 1024]).is_ok()
}

fn set(features: [(&str, &str); 3]) -> Result<(), String> {
    features.iter().try_for_each(|(name, value)| run(&["camera", "set", name, value, "--camera", FAKE]).map(drop))
}

#[test]
fn the_fake_cameras_pictures_are_all_explained_and_its_features_kept_to() {
    let long = std::env::var("SHEETLIGHT_LONG").is_ok();
    let (count, losses) = if long { (2400, &["0", "1", "5"][..]) } else { (120, &["0", "5"][..]) };
    for loss in losses {
        tries(TRIES, || {
            let Some(_camera) = fake(loss) else { return Ok(()) };
            set([("Width", "1024"), ("Height", "256"), ("AcquisitionFrameRate", "50")])?;
            let (mut torn, mut came) = (0, 0u64);
            let begun = Instant::now();
            let enough = |a: &Account, quiet| a.sent >= count || quiet > Duration::from_secs(20);
            let (a, _) = receive(FAKE, enough, |_, image| {
                came += 1;
                // A ramp along both sides that begins anew at 255.
                let want = |x: u32, y: u32| (u32::from(image.get(0, 0)) + x + y) % 255;
                torn += u64::from(
                    (0..256).any(|y| (0..1024).step_by(97).any(|x| u32::from(image.get(x, y)) != want(x, y))),
                );
            })?;
            println!("fake camera, {loss} per mille lost, {:.1} s: {a}", begun.elapsed().as_secs_f64());
            assert_eq!((torn, a.late, a.used), (0, 0, came), "{a}");
            judged((), a.sent >= count, a)
        });
    }
    tries(TRIES, shown_and_kept_to);
    tries(TRIES, comes_back_as_it_was_set);
    tries(TRIES, exposes_in_turn);
}

/// Its levels rise with the exposure, though not in proportion. It runs by itself, waits for a wire, or takes pictures
/// that the program asks for.
fn exposes_in_turn() -> Result<(), String> {
    let Some(_camera) = fake("0") else { return Ok(()) };
    set([("Width", "256"), ("Height", "128"), ("AcquisitionFrameRate", "50")])?;
    set([("ExposureTime", "700"), ("TriggerMode", "Off"), ("TriggerSource", "Line0")])?;
    let exposures = [2000.0, 4000.0, 8000.0];
    for asked in [false, true] {
        if asked {
            run(&["camera", "set", "TriggerMode", "On", "--camera", FAKE])?;
            let fault = Bracketed::new(open(FAKE)?, &exposures, 0.0).err().map(|e| e.what).unwrap_or_default();
            judged((), fault.contains("it is triggered by Line0"), fault)?;
            run(&["camera", "set", "TriggerSource", "Software", "--camera", FAKE])?;
            let dir = tempfile::tempdir().unwrap();
            run(&["camera", "snap", &text(&dir.path().join("one.png")), "--camera", FAKE])?;
        }
        let source = Bracketed::new(open(FAKE)?, &exposures, 0.0).map_err(|e| e.to_string())?;
        let known = source.exposures();
        judged((), known.us() == exposures, format!("{:?}", known.us()))?;
        let feed = Feed::start(Box::new(source), FeedOptions::default()).unwrap();
        let mut light = [0.0; 3];
        for k in 0..12 {
            let Fed::Picture(picture, _) = feed.next(Duration::from_secs(10)) else { return Err("none comes".into()) };
            feed.fate(Fate::Used);
            let index = known.index(picture.exposure_ns.expect("stated"));
            judged((), index == k % 3, format!("picture {k}: {:?}", picture.exposure_ns))?;
            light[index] += picture.image.to_f32().iter().map(|l| f64::from(*l)).sum::<f64>();
        }
        let account = feed.account();
        drop(feed);
        let shown = run(&["camera", "show", "--camera", FAKE])?;
        let now = shown.lines().find(|l| l.starts_with("ExposureTime")).unwrap_or_default();
        println!("asked {asked}: light of {exposures:?} us: {light:?}; {account}; afterwards {now}");
        assert!(light.is_sorted_by(|a, b| 1.1 * a < *b), "{light:?}");
        assert!((account.spare == 0) == asked && now.contains(" 700 "), "{account} {now}");
    }
    Ok(())
}

/// Its power is out for a while: it comes back without its settings, and gets them again.
fn comes_back_as_it_was_set() -> Result<(), String> {
    let Some(camera) = fake("0") else { return Ok(()) };
    set([("Width", "256"), ("Height", "128"), ("AcquisitionFrameRate", "40")])?;
    let out = if std::env::var("SHEETLIGHT_LONG").is_ok() { 10.0 } else { 1.5 };
    let (came, over, mut last) = (AtomicU64::new(0), AtomicBool::new(false), None);
    let wait = |count| until(|| came.load(Relaxed) >= count || over.load(Relaxed));
    let (received, rate) = std::thread::scope(|threads| {
        let pull = threads.spawn(|| {
            wait(20);
            let (begun, since) = (came.load(Relaxed), Instant::now());
            wait(60);
            let rate = (came.load(Relaxed) - begun) as f64 / since.elapsed().as_secs_f64();
            drop(camera);
            std::thread::sleep(Duration::from_secs_f64(out));
            let again = fake("0");
            wait(came.load(Relaxed) + 60);
            over.store(true, Relaxed);
            drop(again);
            rate
        });
        let received = receive(
            FAKE,
            |_, _| over.load(Relaxed),
            |_, image| {
                last = Some((image.width, image.height));
                came.fetch_add(1, Relaxed);
            },
        );
        over.store(true, Relaxed);
        (received, pull.join().unwrap())
    });
    let (a, said) = received?;
    println!("without power for {out} s at {rate:.1} a second: {a}; {said:?}");
    assert!(last == Some((256, 128)) && a.late == 0, "{last:?} {a} {said:?}");
    judged((), a.outages == 1 && a.missed as f64 > 0.8 * rate * out, format!("{a} {said:?}"))
}

/// What a camera can be set to.
fn shown_and_kept_to() -> Result<(), String> {
    let Some(_camera) = fake("0") else { return Ok(()) };
    let shown = run(&["camera", "show", "--camera", FAKE])?;
    for name in ["Width", "ExposureTime", "PixelFormat"] {
        assert!(shown.contains(name), "{name}\n{shown}");
    }
    let refused = |feature: &[&str], says: &[&str]| {
        let (code, said) = sheetlight_fails(&[&["camera"], feature].concat());
        judged(code, says.iter().all(|w| said.contains(w)), said)
    };
    assert_eq!(refused(&["set", "ExposureTime", "1e12", "--camera", FAKE], &["allowed is"])?, 2);
    refused(&["set", "ExposureTme", "5", "--camera", FAKE], &["no feature", "camera show"])?;
    refused(&["show", "--camera", "gige://127.0.77.99"], &["no camera found", "firewall"])?;
    let dir = tempfile::tempdir().unwrap();
    let picture = text(&dir.path().join("one.png"));
    let told = run(&["camera", "snap", &picture, "--camera", FAKE])?;
    assert!(told.contains("median") && std::path::Path::new(&picture).is_file(), "{told}");
    // In use: the one who has it goes on.
    let _other = open(FAKE)?;
    refused(&["snap", &picture, "--camera", FAKE], &["in use"]).map(drop)
}
