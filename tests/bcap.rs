//! In: frames captured between Denso's own client and server (reference data). Out: whether ours are the same, byte for
//! byte, and whether our client gets through the captured sessions, cut and late answers included.
//! Frame and unit: bytes; times in ms.

mod common;

use common::tries::{judged, tries};
use sheetlight::bcap::{Call, Client, ClientOptions, Frame, Network, Outcome, Splitter, Variant};
use std::io::{Read, Write};
use std::net::{TcpListener, UdpSocket};
use std::time::{Duration, Instant};

/// One captured frame.
struct Captured {
    to_server: bool,
    /// The description, written by a program that is not ours.
    words: String,
    bytes: Vec<u8>,
}

/// The captured sessions by name; `None` without reference data.
fn sessions() -> Option<Vec<(String, Vec<Captured>)>> {
    let text = std::fs::read_to_string(common::reference("bcap")?.join("bcap/frames.txt")).unwrap();
    let (mut all, mut words) = (Vec::<(String, Vec<Captured>)>::new(), String::new());
    for line in text.lines() {
        if let Some(title) = line.strip_prefix("## ") {
            all.push((title.split(':').next().unwrap().to_owned(), Vec::new()));
        } else if let Some(comment) = line.strip_prefix("# ") {
            words = comment.to_owned();
        } else if line.starts_with('0') {
            let bytes = (0..line.len()).step_by(2).map(|i| u8::from_str_radix(&line[i..i + 2], 16).unwrap()).collect();
            let to_server = words.contains("client > server");
            all.last_mut().unwrap().1.push(Captured { to_server, words: words.clone(), bytes });
        }
    }
    Some(all)
}

/// The arguments in the notation of the capture.
fn notation(v: &Variant) -> String {
    let list = |name: &str, all: Vec<String>| format!("{name}[{}]", all.join(","));
    match v {
        Variant::Empty => "EMPTY".into(),
        Variant::Text(s) => format!("\"{s}\""),
        Variant::Bool(b) => b.to_string(),
        Variant::I32(x) => format!("I4:{x}"),
        Variant::F32(x) => format!("R4:{x}"),
        Variant::F64(x) => format!("R8:{x}"),
        Variant::I32s(all) => list("I4", all.iter().map(i32::to_string).collect()),
        Variant::F32s(all) => list("R4", all.iter().map(f32::to_string).collect()),
        Variant::F64s(all) => list("R8", all.iter().map(f64::to_string).collect()),
        Variant::Variants(all) => list("V", all.iter().map(notation).collect()),
        other => panic!("{other:?} is in no captured frame"),
    }
}

/// Equal but for the digits that the capture rounds to.
fn same(a: &str, b: &str) -> bool {
    let parts = |s: &str| s.split([',', '[', ']', ':', ' ', '(', ')']).map(str::to_owned).collect::<Vec<_>>();
    let (a, b) = (parts(a), parts(b));
    a.len() == b.len()
        && a.iter().zip(&b).all(|(a, b)| {
            a == b
                || matches!((a.parse::<f64>(), b.parse::<f64>()), (Ok(a),
                    Ok(b)) if (a - b).abs() <= 1e-11 * a.abs().max(b.abs()))
        })
}

#[test]
fn every_captured_frame_is_read_and_written_back() {
    let Some(sessions) = sessions() else { return };
    let mut count = 0;
    for captured in sessions.iter().flat_map(|s| &s.1) {
        let frame = Frame::decode(&captured.bytes).unwrap_or_else(|e| panic!("{}: {e}", captured.words));
        assert_eq!(frame.encode().unwrap(), captured.bytes, "{}", captured.words);
        assert!(captured.words.contains(&format!("  serial {}", frame.serial)), "{}", captured.words);
        if !captured.to_server {
            assert!(captured.words.contains(&format!("HRESULT {:08X}", frame.number)), "{}", captured.words);
        } else {
            let call = Call::of(frame.number).expect("a call that we know");
            let name = call.name().to_uppercase();
            assert!(captured.words.contains(&name), "{} is {name}", captured.words);
        }
        let written = frame.arguments.iter().map(notation).collect::<Vec<_>>().join(" ");
        let stated = captured.words.split_once("  (").unwrap().1;
        let stated = stated.strip_suffix("  REPEATED").unwrap_or(stated).strip_suffix(')').unwrap();
        let stated = if stated == "no argument" { "" } else { stated };
        assert!(same(&written, stated), "{}\n{written}", captured.words);
        count += 1;
    }
    assert_eq!(count, 569);
}

#[test]
fn a_session_cut_at_any_place_is_the_same_session() {
    let Some(sessions) = sessions() else { return };
    for (name, session) in sessions.iter().filter(|s| ["golden", "errors", "err", "estop"].contains(&s.0.as_str())) {
        let bytes: Vec<u8> = session.iter().filter(|c| !c.to_server).flat_map(|c| c.bytes.clone()).collect();
        let read = |pieces: &[&[u8]]| {
            let (mut splitter, mut frames) = (Splitter::default(), Vec::new());
            for piece in pieces {
                splitter.push(piece);
                while let Some(frame) = splitter.next().unwrap() {
                    frames.push(frame);
                }
            }
            frames
        };
        let whole = read(&[&bytes]);
        assert_eq!(whole.len(), session.iter().filter(|c| !c.to_server).count());
        for cut in 0..=bytes.len() {
            assert_eq!(read(&[&bytes[..cut], &bytes[cut..]]), whole, "{name} cut at {cut}");
        }
    }
}

/// Plays the server of a captured session: each request must be the captured one; then come its captured replies, in
/// pieces of `chop` bytes.
fn play_tcp(session: Vec<(bool, Vec<u8>)>, chop: usize) -> (String, std::thread::JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let thread = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        stream.set_nodelay(true).unwrap();
        for (to_server, bytes) in session {
            if to_server {
                let mut got = vec![0; bytes.len()];
                stream.read_exact(&mut got).unwrap();
                assert_eq!(got, bytes, "our client's bytes are not those of Denso's client");
            } else {
                bytes.chunks(chop).for_each(|piece| stream.write_all(piece).unwrap());
            }
        }
    });
    (address, thread)
}

/// The answer that a captured request got in the end.
fn answers(session: &[Captured]) -> Vec<(Frame, Frame)> {
    let frames: Vec<(bool, Frame)> = session.iter().map(|c| (c.to_server, Frame::decode(&c.bytes).unwrap())).collect();
    let requests = frames.iter().filter(|f| f.0 && [0, f.1.serial].contains(&f.1.first_serial));
    requests
        .map(|(_, request)| {
            let answer = frames.iter().find(|(to_server, f)| {
                !to_server && f.serial == request.serial && Outcome(f.number) != Outcome::INTERIM
            });
            (request.clone(), answer.unwrap().1.clone())
        })
        .collect()
}

/// Makes the calls; `Err` where one is not answered at all.
fn check(client: &mut Client, calls: &[(Frame, Frame)]) -> Result<(), String> {
    for (request, answer) in calls {
        let got = client.call(Call::of(request.number).unwrap(), request.arguments.clone()).map_err(|e| e.what)?;
        let outcome = Outcome(answer.number);
        let want = if outcome.failed() {
            Err(outcome)
        } else {
            Ok(answer.arguments.first().cloned().unwrap_or(Variant::Empty))
        };
        assert_eq!(got, want, "serial {}", request.serial);
    }
    Ok(())
}

#[test]
fn our_client_sends_the_captured_bytes_and_reads_the_captured_answers() {
    let Some(sessions) = sessions() else { return };
    for (name, session) in &sessions {
        if ["halt", "udp", "slowudp"].contains(&name.as_str()) {
            continue;
        }
        let bytes: Vec<_> = session.iter().map(|c| (c.to_server, c.bytes.clone())).collect();
        for chop in [1, 7, usize::MAX] {
            let (address, server) = play_tcp(bytes.clone(), chop.min(1 << 20));
            let options = ClientOptions { patience: Duration::from_secs(60), ..Default::default() };
            let mut client = Client::open(&address, options).unwrap();
            check(&mut client, &answers(session)).unwrap();
            server.join().unwrap_or_else(|_| panic!("session {name}"));
        }
    }
}

#[test]
fn over_udp_calls_are_repeated_under_their_first_name_and_late_answers_are_passed_over() {
    let Some(sessions) = sessions() else { return };
    for (name, session) in sessions.iter().filter(|s| ["udp", "slowudp"].contains(&s.0.as_str())) {
        // The last call of the slow session was repeated while its answers were under way: it ends at its first answer.
        let stop = session.iter().rposition(|c| !c.to_server && c.words.contains("HRESULT 00000000")).unwrap();
        let play: Vec<_> = session[..=stop].iter().map(|c| (c.to_server, c.bytes.clone())).collect();
        // A server that stands still is asked once more than the captured one was.
        tries(5, || {
            let server = UdpSocket::bind("127.0.0.1:0").unwrap();
            let (address, play) = (server.local_addr().unwrap().to_string(), play.clone());
            let thread = std::thread::spawn(move || {
                let (mut buffer, mut from) = ([0; 2048], None);
                for (to_server, bytes) in play {
                    if to_server {
                        let (n, at) = server.recv_from(&mut buffer).unwrap();
                        judged((), buffer[..n] == bytes, format!("not as captured: {:02x?}", &buffer[..n]))?;
                        // Noise on the way is no answer.
                        server.send_to(b"noise", at).unwrap();
                        from = Some(at);
                    } else {
                        server.send_to(&bytes, from.unwrap()).unwrap();
                    }
                }
                Ok::<(), String>(())
            });
            let repeat = Duration::from_millis(if name == "udp" { 2_000 } else { 100 });
            let options = ClientOptions { network: Network::Udp, repeat, ..Default::default() };
            let mut client = Client::open(&address, options).unwrap();
            let checked = check(&mut client, &answers(session));
            if checked.is_err() {
                // It may wait for a call that does not come: a frame that was not captured ends it.
                let _ = UdpSocket::bind("127.0.0.1:0").unwrap().send_to(b"end", &address);
            }
            thread.join().unwrap().and(checked)
        });
    }
}

/// A server that answers the first request with `frames`, `every` ms apart, for `serial` 1.
fn answering(frames: Vec<Frame>, every: Duration) -> (String, std::thread::JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let thread = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let _ = stream.read(&mut [0; 1024]).unwrap();
        for frame in frames {
            std::thread::sleep(every);
            // The client may have given up.
            let _ = stream.write_all(&frame.encode().unwrap());
        }
        let _ = stream.read(&mut [0; 1]);
    });
    (address, thread)
}

fn reply(serial: u16, outcome: Outcome) -> Frame {
    Frame { serial, number: outcome.0, ..Default::default() }
}

#[test]
fn silence_ends_in_time_whatever_else_comes() {
    let patience = Duration::from_millis(300);
    let options = ClientOptions { patience, ..Default::default() };
    let try_with = |frames: Vec<Frame>| {
        let (address, thread) = answering(frames, Duration::from_millis(100));
        let mut client = Client::open(&address, options).unwrap();
        let begin = Instant::now();
        let answer = client.call(Call::RobotHalt, vec![]);
        let took = begin.elapsed();
        drop(client);
        thread.join().unwrap();
        (answer, took)
    };
    // Frames of other calls do not lengthen the wait; nor does a frame that never ends.
    tries(5, || {
        let (answer, took) = try_with((50..60).map(|serial| reply(serial, Outcome::OK)).collect());
        assert!(answer.unwrap_err().what.contains("no answer") && took >= patience, "{took:?}");
        judged((), took < patience + Duration::from_millis(150), format!("{took:?}"))
    });
    // Interim replies do: the call is at work.
    tries(5, || {
        let working = (0..6).map(|_| reply(1, Outcome::INTERIM)).chain([reply(1, Outcome::OK)]).collect();
        let (answer, took) = try_with(working);
        let answer = answer.map_err(|e| e.what)?;
        assert_eq!(answer, Ok(Variant::Empty));
        assert!(took > 2 * patience, "{took:?}");
        Ok(())
    });
}

#[test]
fn what_answers_there_is_named() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let thread = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let _ = stream.read(&mut [0; 256]).unwrap();
        stream.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n").unwrap();
    });
    let fault = Client::connect(&address, ClientOptions::default()).err().unwrap();
    assert!(fault.what.contains("HTTP/1.1"), "{fault}");
    assert!(fault.next.contains("5007"), "{fault}");
    thread.join().unwrap();
    let nobody = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let fault = Client::connect(&nobody, ClientOptions::default()).err().unwrap();
    assert!(fault.what.contains("nothing listens"), "{fault}");
}
