//! In: sessions captured between Denso's own client and server. Out: whether our controller answers the same requests
//! alike.
//! Frame and unit: bytes; mm, degrees.

use super::{cell, common};
use sheetlight::bcap::{Frame, Outcome, Splitter, Variant};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// The requests and the last reply to each, by session.
fn sessions() -> Option<Vec<(String, Vec<(Frame, Frame)>)>> {
    let text = std::fs::read_to_string(common::reference("bcap")?.join("bcap/frames.txt")).unwrap();
    let (mut all, mut to_server) = (Vec::<(String, Vec<(Frame, Frame)>)>::new(), false);
    for line in text.lines() {
        if let Some(title) = line.strip_prefix("## ") {
            all.push((title.split(':').next().unwrap().to_owned(), Vec::new()));
        } else if line.starts_with("# ") {
            to_server = line.contains("client > server");
        } else if line.starts_with('0') {
            let bytes: Vec<u8> =
                (0..line.len()).step_by(2).map(|i| u8::from_str_radix(&line[i..i + 2], 16).unwrap()).collect();
            let frame = Frame::decode(&bytes).unwrap();
            let session = &mut all.last_mut().unwrap().1;
            if to_server {
                session.push((frame, Frame::default()));
            } else if let Some((_, reply)) = session.iter_mut().rev().find(|(q, _)| q.serial == frame.serial) {
                *reply = frame;
            }
        }
    }
    Some(all)
}

fn text(v: Option<&Variant>) -> &str {
    match v {
        Some(Variant::Text(t)) => t,
        _ => "",
    }
}

/// Equal values: numbers to 1e-6, angles up to whole turns.
fn alike(a: &Variant, b: &Variant) -> bool {
    match (a, b) {
        (Variant::F64s(a), Variant::F64s(b)) => {
            let near = |(x, y): (&f64, &f64)| {
                let d = (x - y).abs();
                d < 1e-6 || (d - 360.0).abs() < 1e-6
            };
            a.len() == b.len() && a.iter().zip(b).all(near)
        }
        _ => a == b,
    }
}

#[test]
fn captured_sessions_are_answered_as_densos_own_server_did() {
    let Some(sessions) = sessions() else { return };
    for name in ["golden", "whole", "errors", "err"] {
        let served = cell(0, 30.0);
        if name == "err" {
            served.controller.set_japanese(true);
            served.controller.fail(0x8320_4072);
        }
        let session = &sessions.iter().find(|s| s.0 == name).unwrap().1;
        let mut stream = TcpStream::connect(served.robot).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let (mut splitter, mut buffer, mut variable) = (Splitter::default(), [0; 4096], String::new());
        for (request, wanted) in session {
            stream.write_all(&request.encode().unwrap()).unwrap();
            let got = loop {
                match splitter.next().unwrap() {
                    Some(f) if f.number == Outcome::INTERIM.0 => continue,
                    Some(f) => break f,
                    None => {
                        let n = stream.read(&mut buffer).unwrap();
                        assert!(n > 0, "{name}: closed at serial {}", request.serial);
                        splitter.push(&buffer[..n]);
                    }
                }
            };
            let asked = text(request.arguments.get(1));
            if asked.starts_with('@') {
                variable = asked.to_owned();
            }
            let at = format!("{name}, serial {}: {:?}", request.serial, request.arguments);
            assert_eq!(Outcome(got.number), Outcome(wanted.number), "{at}");
            // How long motions take is each server's own, and so is whether one is still under way.
            if asked == "HighCurJntEx" || variable == "@BUSY_STATUS" && request.arguments.len() == 1 {
                continue;
            }
            assert_eq!(got.arguments.len(), wanted.arguments.len(), "{at}: {got:?}");
            assert!(got.arguments.iter().zip(&wanted.arguments).all(|(a, b)| alike(a, b)), "{at}: {got:?} {wanted:?}");
        }
    }
}
