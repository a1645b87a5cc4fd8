//! In: the robot link and the camera's client of the product, against the cell. Out: one motion for one order
//! whatever the wire does, halts in time, pictures of where the arm stands.
//! Frame and unit: mm, degrees; ms.

use super::cell;
use crate::common::tries::{judged, tries};
use sheetlight::arm::{Mode, Reach};
use sheetlight::bcap::{Call, Client, ClientOptions, Network, Variant};
use sheetlight::capture::{CameraUri, Event};
use sheetlight::geometry::{Rigid, Vec3};
use sheetlight_program::cell::Event as Happened;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::time::Duration;

fn moved(served: &sheetlight_program::cell::Served) -> usize {
    served.cell.moves()
}

/// A client that may move the arm, and the handle of the robot.
fn mover(at: &str, network: Network) -> (Client, sheetlight::bcap::Handle) {
    let options = ClientOptions { network, patience: Duration::from_secs(30), ..ClientOptions::default() };
    let mut client = Client::connect(at, options).unwrap();
    let controller = client.controller().unwrap();
    let robot = client.robot(controller).unwrap();
    client.execute(robot, "TakeArm", Variant::I32s(vec![0, 0])).unwrap();
    client.execute(robot, "Motor", Variant::I32s(vec![1, 0])).unwrap();
    (client, robot)
}

fn order(x: f64, option: &str) -> Vec<Variant> {
    let pose = Variant::F64s(vec![x, 0.0, 560.0, 180.0, 0.0, 180.0, -1.0]);
    let text = |s: &str| Variant::Text(s.into());
    vec![Variant::I32(2), Variant::Variants(vec![pose, text("P"), text("@E")]), text(option)]
}

#[test]
fn a_lost_answer_over_udp_is_one_motion() {
    let served = cell(3, 20.0);
    let (mut client, robot) = mover(&served.robot.to_string(), Network::Udp);
    for (k, lost) in [0, 1, 3].into_iter().enumerate() {
        served.faults.lose.store(lost, SeqCst);
        let arguments = [vec![robot.into()], order(310.0 + 10.0 * k as f64, "")].concat();
        client.call(Call::RobotMove, arguments).unwrap().unwrap();
        assert_eq!(moved(&served), k + 1, "{lost} answers lost");
    }
    served.faults.foreign.store(true, SeqCst);
    client.execute(robot, "CurPos", Variant::Empty).unwrap();
}

#[test]
fn the_link_reads_asks_and_gets_through_what_a_wire_does() {
    let served = cell(3, 20.0);
    let mut arm = sheetlight::arm::open(&served.robot_uri()).unwrap();
    let whole = arm.pose().unwrap();
    assert!((whole.base_from_flange.translation - Vec3::new(300.0, 0.0, 590.0)).norm() < 1e-6);
    let state = arm.state().unwrap();
    assert_eq!((state.mode, state.motor, state.tool, state.work), (Mode::Automatic, Some(false), Some(0), Some(0)));
    let at = |x: f64| Rigid::new(whole.base_from_flange.rotation, Vec3::new(x, 0.0, 500.0));
    assert_eq!(arm.reach(&at(350.0)).unwrap(), Reach::Free);
    assert!(matches!(arm.reach(&at(1400.0)).unwrap(), Reach::Refused(why) if why.contains("reach")));
    served.controller.set_fence(Some([Vec3::new(340.0, -50.0, 400.0), Vec3::new(360.0, 50.0, 600.0)]));
    assert!(matches!(arm.reach(&at(350.0)).unwrap(), Reach::Refused(why) if why.contains("fence")));
    arm.switch().unwrap().put(24, true).unwrap();
    assert!(arm.signal(24).unwrap() && !arm.signal(25).unwrap());
    // Interim replies, foreign serials, pieces of one byte, two answers at once, delay.
    let faults = &served.faults;
    let wires: [fn(&sheetlight_program::cell::Faults); 5] = [
        |f| f.piece.store(1, SeqCst),
        |f| f.foreign.store(true, SeqCst),
        |f| f.interim.store(3, SeqCst),
        |f| f.merge.store(true, SeqCst),
        |f| f.delay_ms.store(60, SeqCst),
    ];
    for set in wires {
        faults.clear();
        set(faults);
        assert_eq!(arm.pose().unwrap().base_from_flange, whole.base_from_flange);
    }
    faults.clear();
    served.controller.set_japanese(true);
    served.controller.fail(0x8320_4072);
    let refused = arm.take().unwrap_err().what;
    assert!(refused.contains("81501025") && refused.contains("未定義"), "{refused}");
    assert_eq!(arm.state().unwrap().errors[0].code, 0x8320_4072);
}

/// Halts a motion of 80 mm at 40 mm/s on its way; when the Halt was at the controller and how far the arm went from
/// then, ms and mm of a cell in real time.
fn halted() -> Result<[f64; 2], String> {
    let served = cell(1, 1.0);
    let uri = served.robot_uri();
    let arm = sheetlight::arm::open(&uri).unwrap();
    let stop = arm.stop().unwrap();
    let (mut client, robot) = mover(&served.robot.to_string(), Network::Tcp);
    let moving = std::thread::spawn(move || {
        let arguments = [vec![robot.into()], order(380.0, "SPEED=4")].concat();
        client.call(Call::RobotMove, arguments).unwrap()
    });
    while moved(&served) == 0 {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(Duration::from_millis(300));
    let asked = served.cell.clock().now();
    stop.halt().unwrap();
    let done = moving.join().unwrap();
    let log = served.cell.log();
    let halted = log.iter().find(|e| matches!(e.event, Happened::Halt { moving: true, .. }));
    let halted = halted.ok_or("the arm had arrived before it was halted")?.t_s;
    assert!(done.is_err(), "a halted motion is not done");
    let at = |t: f64| served.cell.true_flange(t).translation;
    let (ms, mm) = ((halted - asked) * 1e3, (at(served.cell.clock().now()) - at(halted)).norm());
    judged([ms, mm], ms < 50.0, format!("{ms} ms"))
}

#[test]
fn a_halt_is_at_the_controller_within_50_ms_and_stops_the_arm() {
    let [ms, mm] = tries(10, halted);
    println!("halt at the controller after {ms:.1} ms, the arm went {mm:.2} mm from then");
    assert!(mm < 5.0, "{mm}");
}

/// A packet as the real-time interface lays it out: length, time, ..., tool vector at byte 444; big-endian doubles.
fn packet(k: u32) -> Vec<u8> {
    let mut bytes = vec![0u8; 1108];
    bytes[..4].copy_from_slice(&1108u32.to_be_bytes());
    bytes[4..12].copy_from_slice(&(100.0 + 0.008 * f64::from(k)).to_be_bytes());
    for (i, x) in [0.3, -0.02, 0.59, 0.0, 3.0, f64::from(k) * 1e-6].into_iter().enumerate() {
        bytes[444 + 8 * i..452 + 8 * i].copy_from_slice(&f64::to_be_bytes(x));
    }
    bytes
}

#[test]
fn a_universal_robot_is_read_from_its_stream() {
    // Its reader gives up after a second of silence.
    tries(5, || {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let enough = Arc::new(AtomicBool::new(false));
        let over = enough.clone();
        let controller = std::thread::spawn(move || {
            use std::io::Write;
            let (mut stream, _) = listener.accept().unwrap();
            for k in 0.. {
                if over.load(SeqCst) || stream.write_all(&packet(k)).is_err() {
                    break;
                }
                std::thread::sleep(Duration::from_millis(8));
            }
            let _ = stream.write_all(b"HTTP/1.1 400");
        });
        let mut arm = sheetlight::arm::open(&format!("ur://{address}")).unwrap();
        let mut last = None;
        for _ in 0..3 {
            let pose = arm.pose().map_err(|e| e.what)?;
            assert!((pose.base_from_flange.translation - Vec3::new(300.0, -20.0, 590.0)).norm() < 1e-9);
            // Time and rotation are of one packet, and each pose of a later one.
            let device = pose.device.unwrap().as_secs_f64();
            let sent = packet(((device - 100.0) / 0.008).round() as u32);
            let turn: Vec<f64> = sent[468..492].chunks(8).map(|b| f64::from_be_bytes(b.try_into().unwrap())).collect();
            let is = sheetlight::geometry::log(&pose.base_from_flange.rotation);
            assert!((is - Vec3::from_row_slice(&turn)).norm() < 1e-9, "{is} {turn:?}");
            assert!(device >= 100.0 && last.is_none_or(|l| device > l), "{device} after {last:?}");
            last = Some(device);
        }
        enough.store(true, SeqCst);
        controller.join().unwrap();
        let said = std::iter::repeat_with(|| arm.pose()).find_map(Result::err).unwrap().what;
        assert!(arm.take().unwrap_err().what.contains("only reads"));
        judged((), said.contains("packet says"), format!("what is no packet is refused: {said}"))
    });
}

#[test]
fn the_camera_sees_what_is_lit_from_where_the_arm_stands() {
    let served = cell(2, 20.0);
    let (mut switch, mut camera) = (
        sheetlight::arm::open(&served.robot_uri()).unwrap().switch().unwrap(),
        sheetlight::capture::source::cell::CellCamera::open(&served.camera.to_string(), -1.0).unwrap(),
    );
    assert!(matches!(served.camera_uri().parse(), Ok(CameraUri::Cell { rate_hz, .. }) if rate_hz < 0.0));
    let mut mean = |line: bool, pointer: bool, room: bool| {
        for (number, on) in [(24, line), (25, pointer), (26, room)] {
            switch.put(number, on).unwrap();
        }
        camera.snap().unwrap();
        use sheetlight::capture::PictureSource;
        let Event::Picture(p) = camera.next(Duration::from_secs(20)) else { panic!("no picture") };
        let grey = p.image.to_f32();
        (grey.iter().sum::<f32>() / grey.len() as f32, grey.iter().copied().fold(0.0, f32::max))
    };
    let (room, dark) = (mean(false, false, true), mean(false, false, false));
    assert!(room.0 > 10.0 * dark.0, "{room:?} {dark:?}");
    let line = mean(true, false, false);
    assert!(line.1 > 60.0 && line.0 < 0.3 * room.0, "{line:?}");
    served.cell.set_dark(true);
    assert!(mean(true, true, true).0 < 2.0 * dark.0 + 1.0);
}
