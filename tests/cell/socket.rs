//! In: a simulated cell, lines as a controller's own program sends them. Out: whether the answers are those that
//! docs/robots states, the poses lead to the part, and nothing that comes over the wire is left without a clear answer.
//! Frame and unit: mm, degrees; metres and radians where the notation is UR's.

use super::workplace::{Set, scene, set};
use crate::common::tries::{judged, tries};
use rand::{Rng, SeedableRng};
use sheetlight::bcap::{Call, Client, ClientOptions, Handle, Variant};
use sheetlight::capture::source::cell::CellCamera;
use sheetlight::geometry::{Base, Camera, Flange, Rigid, Tool, Vec2, Vec3};
use sheetlight::robot::Convention;
use sheetlight::scan::Where;
use sheetlight::station::socket::words::{Request, read};
use sheetlight::station::socket::{Patience, Session, SocketOptions, serve};
use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::time::{Duration, Instant};

/// `sheetlight robot serve` within the test.
struct Server {
    at: SocketAddr,
    stop: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Server {
    fn start(set: &Set, notation: Convention, patience: Patience) -> Server {
        let recipes = set.dir.path().join("recipes");
        std::fs::create_dir_all(&recipes).unwrap();
        let coarse = include_str!("../../data/recipes/osc.toml").replace("cell_mm = 0.5", "cell_mm = 0.8");
        std::fs::write(recipes.join("osc.toml"), coarse).unwrap();
        let out = set.dir.path().join(notation.name());
        let options = SocketOptions { station: set.station.clone(), recipes, out, notation, place: Where::Cpu };
        let camera = CellCamera::open(&set.served.camera.to_string(), -1.0).unwrap();
        let mut session = Session::new(options, Box::new(camera)).unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (at, stop) = (listener.local_addr().unwrap(), Arc::new(AtomicBool::new(false)));
        let over = stop.clone();
        let thread = std::thread::spawn(move || serve(&listener, &mut session, patience, &over, &mut |_| {}).unwrap());
        Server { at, stop, thread: Some(thread) }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop.store(true, SeqCst);
        let ended = self.thread.take().unwrap().join();
        assert!(ended.is_ok() || std::thread::panicking());
    }
}

/// A controller's side of the socket.
struct Program(BufReader<TcpStream>);

impl Program {
    fn connect(at: SocketAddr) -> Program {
        let stream = TcpStream::connect(at).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        Program(BufReader::new(stream))
    }
    fn hears(&mut self) -> String {
        let mut line = String::new();
        self.0.read_line(&mut line).unwrap();
        line.trim_end().to_owned()
    }
    fn says(&mut self, line: &str) -> String {
        self.0.get_mut().write_all(format!("{line}\r\n").as_bytes()).unwrap();
        self.hears()
    }
}

/// The arm, moved by its own program: nothing of sheetlight is between.
struct Mover(Client, Handle);

impl Mover {
    fn open(set: &Set) -> Mover {
        let options = ClientOptions { patience: Duration::from_secs(30), ..ClientOptions::default() };
        let mut client = Client::connect(&set.served.robot.to_string(), options).unwrap();
        let controller = client.controller().unwrap();
        let robot = client.robot(controller).unwrap();
        client.execute(robot, "TakeArm", Variant::I32s(vec![0, 0])).unwrap();
        Mover(client, robot)
    }
    fn go(&mut self, to: &Rigid<Base, Flange>) {
        let mut numbers = Convention::Denso.write(to);
        numbers.push(-1.0);
        let text = |s: &str| Variant::Text(s.into());
        let pose = Variant::Variants(vec![Variant::F64s(numbers), text("P"), text("@E")]);
        let order = vec![self.1.into(), Variant::I32(2), pose, text("SPEED=30")];
        self.0.call(Call::RobotMove, order).unwrap().unwrap();
    }
}

/// A sweep as a robot's programmer teaches it: straight over the part, across the stripe.
fn sweep(set: &Set, shots: usize, length: f64) -> Vec<Rigid<Base, Flange>> {
    let (cell, station) = (&set.served.cell, set.served.cell.station());
    let to_scene = cell.base_from_scene();
    let (up, origin) = (to_scene.direction(&Vec3::z()), to_scene.translation);
    let hand_eye = station.flange_from_camera;
    let camera: Rigid<Base, Camera> = cell.true_flange(0.0) * hand_eye;
    let axis = camera.rotation.column(2).into_owned();
    let foot = camera.translation + axis * ((origin - camera.translation).dot(&up) / axis.dot(&up));
    let depth = station.working_distance;
    let above: Rigid<Base, Camera> = Rigid::new(camera.rotation, foot - axis * depth);
    let sheet = &station.laser;
    let across = Vec2::new(sheet.normal.x, sheet.normal.y);
    let d = across / across.norm();
    let stripe = (sheet.normal.dot(&sheet.source) - sheet.normal.z * depth) / across.norm();
    let at = |k: usize| {
        let along = length * (k as f64 / (shots - 1) as f64 - 0.5) - stripe;
        above
            * Rigid::<Camera, Camera>::from_vectors(&Vec3::zeros(), Vec3::new(d.x, d.y, 0.0) * along)
            * hand_eye.inverse()
    };
    (0..shots).map(at).collect()
}

/// The whole of what docs/robots shows, in one notation: how far the insertion pose is from the part, mm.
fn played(notation: Convention, seed: u64) -> f64 {
    let set = set(scene("osc", seed), seed, 2.0);
    let server = Server::start(&set, notation, Patience::default());
    let (mut program, mut arm) = (Program::connect(server.at), Mover::open(&set));
    arm.0.execute(arm.1, "ExtSpeed", Variant::F32s(vec![100.0])).unwrap();
    assert_eq!(program.says("HELLO"), format!("OK sheetlight 1 {}", notation.name()));
    assert_eq!(program.says("STATUS"), "OK idle");
    assert!(program.says("POSE 1 2 3 4 5 6").starts_with("ERROR 3 no scan was begun"));
    assert_eq!(program.says("SCAN"), "OK 0");
    set.served.controller.set_motor(true);
    for (number, on) in [(24, true), (25, false), (26, false)] {
        let controller = arm.0.controller().unwrap();
        arm.0.write(Call::ControllerGetVariable, controller, &format!("IO{number}"), Variant::Bool(on)).unwrap();
    }
    let path = sweep(&set, 61, 30.0);
    for (k, pose) in path.iter().enumerate() {
        arm.go(pose);
        let numbers: Vec<String> = notation.write(pose).iter().map(|x| format!("{x:.7}")).collect();
        let line = match notation {
            Convention::Ur => format!("POSE p[{}]", numbers.join(", ")),
            Convention::Abb => format!("POSE [{}],[{}]", numbers[..3].join(","), numbers[3..].join(",")),
            _ => format!("pose {}", numbers.join(" ")),
        };
        assert_eq!(program.says(&line), format!("OK {}", k + 1));
        // An answer that was lost is asked for again: no second picture.
        if k == 3 {
            assert_eq!(program.says(&line), "OK 4");
        }
    }
    assert_eq!(program.says("STATUS"), "OK scanning 61");
    assert!(program.says("FIND led").starts_with("ERROR 4 there is no recipe"));
    let found = program.says("FIND osc");
    assert!(found.strip_prefix("OK ").and_then(|s| s.parse::<f64>().ok()).is_some_and(|s| s > 0.5), "{found}");
    assert_eq!(program.says("STATUS"), "OK found osc");
    let mut pose = |line: &str| {
        let said = program.says(line);
        let numbers: Vec<f64> = said.strip_prefix("OK ").unwrap().split(' ').map(|n| n.parse().unwrap()).collect();
        notation.read::<Base, Tool>(&numbers).unwrap()
    };
    let (tool, flange) = (pose("GIVE insertion"), pose("GIVE insertion flange"));
    let up = pose("GIVE approach").translation - tool.translation;
    assert!((up.norm() - 30.0).abs() < 1e-3 && up.z > 29.0, "{up:?}");
    let again = Rigid::<Base, Flange>::new(flange.rotation, flange.translation) * set.served.cell.flange_from_tool();
    let (angle, mm) = again.difference(&tool);
    assert!(angle < 1e-5 && mm < 1e-2, "{angle} {mm}");
    assert_eq!(program.says("BYE"), "OK bye");
    (tool.translation - set.served.cell.base_from_part("osc").unwrap().translation).norm()
}

#[test]
fn a_controllers_own_program_scans_asks_and_gets_the_part() {
    let long = std::env::var_os("SHEETLIGHT_LONG").is_some();
    let all = [Convention::Ur, Convention::Kuka, Convention::Fanuc, Convention::Abb, Convention::Denso];
    for (k, notation) in all.into_iter().enumerate().take(if long { 5 } else { 1 }) {
        let off = played(notation, 1 + k as u64);
        println!("{}: the insertion is given {off:.3} mm from the part", notation.name());
        assert!(off < 0.3, "{off}");
    }
}

#[test]
fn whatever_comes_over_the_socket_gets_one_clear_line() {
    let set = set(scene("osc", 1), 1, 2.0);
    let server = Server::start(&set, Convention::Denso, Patience::default());
    let mut first = Program::connect(server.at);
    assert_eq!(first.says("HELLO"), "OK sheetlight 1 denso");
    assert_eq!(Program::connect(server.at).hears(), "ERROR 6 another robot is connected");
    let mut says = |line: &str, answer: &str| {
        let said = first.says(line);
        assert!(said.starts_with(answer), "{line} -> {said}");
    };
    says("FIND osc", "ERROR 3 0 shots were taken");
    says("GIVE approach", "ERROR 3 nothing was found yet");
    says("SCAN", "OK 0");
    says("POSE 300 0 590 180 0", "ERROR 2 a denso pose has 6 numbers");
    says("POSE 300,0 590 180 0 180", "OK 1");
    says("POSE 0.3 0 0.59 3.14 0 3.14", "ERROR 2 the flange would be 0.662 mm from its base");
    says("POSE 1e9 0 590 180 0 180", "ERROR 2 ");
    says("GET / HTTP/1.1", "ERROR 1 'GET' is not a word");
    let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
    for _ in 0..300 {
        // An end within it would make two lines of it, and an empty one is passed over.
        let any = (0..rng.random_range(0..90)).map(|_| rng.random::<u8>()).filter(|b| !matches!(b, b'\n' | b'\r'));
        let bytes: Vec<u8> = [b'#'].into_iter().chain(any).collect();
        first.0.get_mut().write_all(&[&bytes[..], b"\n"].concat()).unwrap();
        let said = first.hears();
        assert!(said.starts_with("ERROR ") && said.is_ascii(), "{bytes:?} -> {said}");
    }
    // Lines may end as controllers end them, and empty ones are passed over; two requests in one packet, one in two.
    first.0.get_mut().write_all(b"\r\n\nSTATUS\r").unwrap();
    assert_eq!(first.hears(), "OK scanning 1");
    first.0.get_mut().write_all(b"STATUS\nSTA").unwrap();
    assert_eq!(first.hears(), "OK scanning 1");
    first.0.get_mut().write_all(b"TUS\n").unwrap();
    assert_eq!(first.hears(), "OK scanning 1");
    first.0.get_mut().write_all(&[b'7'; 2000]).unwrap();
    assert_eq!(first.hears(), "ERROR 7 a line of more than 512 bytes");
    assert_eq!(first.hears(), "", "the connection ends");
    // The next one begins anew. No picture: the camera has gone.
    let mut second = Program::connect(server.at);
    assert_eq!(second.says("STATUS"), "OK idle");
    assert_eq!(second.says("SCAN"), "OK 0");
    set.served.faults.camera_gone.store(true, SeqCst);
    let said = second.says("POSE 300 0 590 180 0 180");
    assert!(said.starts_with("ERROR 5 "), "{said}");
    assert_eq!(second.says("STATUS"), "OK scanning 0");
}

#[test]
fn who_says_nothing_more_is_told_so_and_left() {
    let set = set(scene("osc", 1), 1, 2.0);
    let patience = Patience { idle: Duration::from_secs(2), line: Duration::from_millis(400) };
    let server = Server::start(&set, Convention::Denso, patience);
    tries(10, || {
        let mut program = Program::connect(server.at);
        let begun = Instant::now();
        program.0.get_mut().write_all(b"STAT").map_err(|e| e.to_string())?;
        let (said, took) = (program.hears(), begun.elapsed().as_millis());
        let told = said.starts_with("ERROR 8 a line was begun and not ended for 0 s");
        judged((), told && (400..900).contains(&took), format!("{said} after {took} ms"))
    });
    let begun = Instant::now();
    assert!(Program::connect(server.at).hears().starts_with("ERROR 8 nothing came for 2 s"));
    assert!(begun.elapsed() >= patience.idle, "{:?}", begun.elapsed());
}

/// What the programs in docs/robots send is understood, and each sends all that a scan needs.
#[test]
fn the_programs_in_the_documents_speak_the_protocol() {
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("docs/robots");
    let (mut programs, mut answers) = (0, 0);
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        if path.extension().is_some_and(|e| e == "md") {
            // The transcript: each line that is sent is understood, each answer is one.
            for line in text.lines().filter_map(|l| l.strip_prefix("    > ")) {
                read(line).unwrap_or_else(|e| panic!("{line}: {e:?}"));
            }
            let said: Vec<&str> = text.lines().filter_map(|l| l.strip_prefix("    < ")).collect();
            assert!(said.iter().all(|l| l.starts_with("OK") || l.starts_with("ERROR ")), "{said:?}");
            answers += said.len();
            continue;
        }
        assert!(text.to_lowercase().contains("never tried"), "{}: what was never tried is not said", path.display());
        // A KUKA program's channel: where it listens, no words.
        if path.extension().is_some_and(|e| e == "xml") {
            continue;
        }
        programs += 1;
        // Texts in the language's quotes that begin with a word of the protocol.
        let quoted = text.split(['"', '\'']).skip(1).map(str::trim_end);
        let words = ["HELLO", "STATUS", "SCAN", "POSE", "FIND", "GIVE", "BYE"];
        let sent: Vec<&str> =
            quoted.filter(|q| words.iter().any(|w| *q == *w || q.starts_with(&format!("{w} ")))).collect();
        for line in &sent {
            let line = line.split(['\\', '%']).next().unwrap().trim();
            assert!(read(line).is_ok(), "{}: {line}", path.display());
        }
        for word in ["SCAN", "POSE", "FIND", "GIVE", "BYE"] {
            assert!(sent.iter().any(|s| s.starts_with(word)), "{}: {word} is not sent: {sent:?}", path.display());
        }
        assert!(matches!(read("POSE 1 2 3"), Ok(Request::Pose(n)) if n.len() == 3));
    }
    assert!(programs >= 5 && answers >= 8, "{programs} programs, {answers} answers");
}
