//! In: the program as a person starts it, against cells in which one thing is not as it has to be. Out: whether it
//! ends with a clear error and its exit code, and the arm has stood still.
//! Frame and unit: mm.

use super::workplace::{Set, scene, set};
use crate::common::tries::{judged, tries};
use sheetlight::arm::rules::Space;
use sheetlight::geometry::Vec3;
use sheetlight::station::Settings;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::process::{Command, Stdio};

/// `sheetlight job` with these addresses: exit code and stderr.
fn job(set: &Set, robot: &str, camera: &str) -> (i32, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sheetlight"));
    let recipe = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/recipes/osc.toml");
    command.args(["job", "--robot", robot, "--camera", camera, "--recipe", recipe, "--on", "cpu", "--sweep", "10"]);
    command.args(["--allow-motion", "--yes"]).arg("--station").arg(&set.station);
    command.arg("--out").arg(tempfile::tempdir_in(set.dir.path()).unwrap().keep());
    let done = command.stdin(Stdio::null()).output().expect("the program starts");
    (done.status.code().expect("it was not killed"), String::from_utf8_lossy(&done.stderr).into_owned())
}

/// Somebody else's server: it says something to whoever comes or asks.
fn stranger(greets: bool, says: &'static [u8]) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let Ok(mut stream) = stream else { return };
            if !greets {
                let _ = stream.read(&mut [0; 512]);
            }
            let _ = stream.write_all(says);
            let _ = stream.read(&mut [0; 512]);
        }
    });
    at
}

#[test]
fn a_cell_that_is_not_ready_is_told_in_words_and_nothing_moves() {
    let set = set(scene("osc", 2), 2, 2.0);
    let (robot, camera) = (set.served.robot_uri(), set.served.camera_uri());
    let refused = |robot: &str, camera: &str, words: &[&str]| {
        // Half a second without an answer is an error of its own.
        tries(5, || {
            let (code, said) = job(&set, robot, camera);
            println!("exit {code}: {}", said.lines().find(|l| l.contains(words[0])).unwrap_or(&said));
            assert!(code == 1 || code == 2, "{code}: {said}");
            assert!(said.contains("next step") || said.contains("stopped:"), "{said}");
            assert!(!said.contains("panicked"), "{said}");
            judged((), words.iter().all(|word| said.contains(word)), format!("{words:?} is not in:\n{said}"))
        });
    };
    // Wrong ports: who answers there instead.
    refused("bcap://127.0.0.1:1", &camera, &["nothing listens there", "5007"]);
    let web = stranger(false, b"HTTP/1.1 400 Bad Request\r\n\r\n");
    refused(&format!("bcap://{web}"), &camera, &["HTTP"]);
    let shell = stranger(true, b"SSH-2.0-OpenSSH_9.6\r\n");
    refused(&format!("bcap://{shell}"), &camera, &["SSH"]);
    refused(&format!("bcap://{}", set.served.camera), &camera, &["b-CAP"]);
    refused(&robot, &format!("cell://{}?rate=-1", set.served.robot), &["another program uses that port"]);
    refused(&format!("ur://{}", set.served.robot), &camera, &["ur://"]);
    // The controller is not ready.
    let controller = &set.served.controller;
    controller.set_mode(2);
    refused(&robot, &camera, &["automatic mode is 0.000, limit 1.000"]);
    controller.set_mode(3);
    controller.take_by_another();
    refused(&robot, &camera, &["TakeArm", "8320F001"]);
    controller.given_by_another();
    controller.set_japanese(true);
    controller.fail(0x8320_4072);
    refused(&robot, &camera, &["未定義エラーです"]);
    controller.set_japanese(false);
    controller.clear_errors();
    // Two programs on one robot: the second is told who has it.
    let first = set.guard();
    refused(&robot, &camera, &["8320F001"]);
    drop(first);
    // Where the pointer's places are out of the box, and out of the arm's reach.
    let whole = Settings::load(&set.station).unwrap();
    let with = |to_mm: [f64; 3]| {
        let mut limits = whole.motion.clone().unwrap();
        limits.workspace = Space { from_mm: [150.0, -300.0, 500.0], to_mm };
        Settings { motion: Some(limits), ..whole.clone() }.store(&set.station).unwrap();
    };
    with([600.0, 300.0, 700.0]);
    refused(&robot, &camera, &["outside the workspace, mm is "]);
    whole.store(&set.station).unwrap();
    controller.set_fence(Some([Vec3::new(0.0, -600.0, 0.0), Vec3::new(900.0, 600.0, 560.0)]));
    refused(&robot, &camera, &["fence"]);
    controller.set_fence(None);
    // The board is out of view in the first picture.
    let mut far = scene("osc", 2);
    far.solid.clear();
    far.part[0].at_mm = [0.0, 0.0, -900.0];
    set.served.cell.lay(&far, None).unwrap();
    refused(&robot, &camera, &["spot", "not in the first picture"]);
    assert_eq!(set.served.cell.moves(), 0);
}

#[test]
fn yes_to_everything_is_taken_from_no_controller_that_does_not_say_it_is_simulated() {
    let set = set(scene("osc", 2), 2, 2.0);
    // A tunnel to a real controller begins on this machine too.
    set.served.controller.as_real();
    let (code, said) = job(&set, &set.served.robot_uri(), &set.served.camera_uri());
    assert!(code == 2 && said.contains("--yes with the robot bcap://127.0.0.1:"), "{code}: {said}");
    assert!(said.contains("does not say that it is a simulated one"), "{said}");
    assert_eq!(set.served.cell.moves(), 0);
    // The arm was not taken either.
    drop(set.guard());
}

#[test]
fn another_tool_is_put_down_by_taking_the_arm_and_one_selected_later_stops_it() {
    // TakeArm without Keep selects tool 0 and work 0; what somebody selects afterwards is a gate.
    let set = set(scene("osc", 2), 2, 2.0);
    set.served.controller.set_frames(3, 1);
    let mut guard = set.guard();
    let state = guard.link().state().unwrap();
    assert_eq!((state.tool, state.work), (Some(0), Some(0)));
    set.served.controller.set_frames(3, 0);
    let at = guard.link().pose().unwrap().base_from_flange;
    let leg = sheetlight::arm::Motion { to: at, way: sheetlight::arm::Way::Straight, speed_mm_s: 10.0 };
    let shown = guard.propose(sheetlight::arm::rules::Plan::single("test", "a test", leg)).unwrap();
    assert!(shown.missed().iter().any(|m| m.contains("number of the tool is 3.000")), "{:?}", shown.missed());
}
