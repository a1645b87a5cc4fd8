//! In: a listener, a session. Out: serves one robot's program at a time, one answer for each line; other clients
//! are turned away meanwhile.
//! Frame and unit: bytes, lines end with LF, CR or both, answers with LF; s.

use super::session::Session;
use super::words::{Code, MOST_BYTES, Wrong, no};
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How often new connections and the end of the server are checked.
pub(super) const LOOK: Duration = Duration::from_millis(50);

/// How long the server waits for a program.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// Time until the next line.
    pub idle: Duration,
    /// Time for the rest of a line that was begun.
    pub line: Duration,
}

impl Default for Patience {
    /// Ten minutes between two lines, because a person may have stopped the arm; ten seconds within a line.
    fn default() -> Patience {
        Patience { idle: Duration::from_secs(600), line: Duration::from_secs(10) }
    }
}

/// Serves until `stop`; `told` receives every line and every answer.
///
/// # Errors
/// Those of the listener.
pub fn serve(
    listener: &TcpListener,
    session: &mut Session,
    patience: Patience,
    stop: &AtomicBool,
    told: &mut dyn FnMut(&str),
) -> std::io::Result<()> {
    listener.set_nonblocking(true)?;
    while !stop.load(Ordering::SeqCst) {
        match listener.accept() {
            Ok((stream, from)) => {
                told(&format!("{from} is here"));
                session.afresh();
                let why = one(listener, &stream, session, patience, stop, told);
                told(&format!("{from} has gone: {why}"));
            }
            Err(e) if e.kind() == ErrorKind::WouldBlock => std::thread::sleep(LOOK),
            // The client closed the connection before it was accepted.
            Err(_) => std::thread::sleep(LOOK),
        }
    }
    Ok(())
}

/// Serves one program from its first line to its last; returns why it ended.
fn one(
    listener: &TcpListener,
    mut stream: &TcpStream,
    session: &mut Session,
    patience: Patience,
    stop: &AtomicBool,
    told: &mut dyn FnMut(&str),
) -> String {
    let ready = stream.set_nonblocking(false).and_then(|()| stream.set_nodelay(true));
    let ready = ready.and_then(|()| stream.set_read_timeout(Some(LOOK)));
    if let Err(e) = ready.and_then(|()| stream.set_write_timeout(Some(patience.line))) {
        return e.to_string();
    }
    let (mut kept, mut buffer, mut heard) = (Vec::<u8>::new(), [0u8; 1024], Instant::now());
    loop {
        while let Some(end) = kept.iter().position(|b| matches!(b, b'\n' | b'\r')) {
            let line = String::from_utf8_lossy(&kept[..end]).into_owned();
            kept.drain(..=end);
            if line.trim().is_empty() {
                continue;
            }
            let answer = if end > MOST_BYTES { no(&too_long()) } else { session.answer(&line) };
            told(&format!(
                "{} -> {answer}",
                line.trim().escape_debug().to_string().chars().take(120).collect::<String>()
            ));
            if let Err(e) = stream.write_all(format!("{answer}\n").as_bytes()) {
                return format!("it does not take its answer: {e}");
            }
            if answer == "OK bye" {
                return "it said BYE".into();
            }
            heard = Instant::now();
        }
        if kept.len() > MOST_BYTES {
            return ended(stream, &too_long());
        }
        if stop.load(Ordering::SeqCst) {
            return "the server was told to end".into();
        }
        turn_away(listener);
        let limit = if kept.is_empty() { patience.idle } else { patience.line };
        if heard.elapsed() > limit {
            let what = if kept.is_empty() { "nothing came" } else { "a line was begun and not ended" };
            return ended(stream, &Wrong::new(Code::Late, format!("{what} for {:.0} s", limit.as_secs_f64())));
        }
        match stream.read(&mut buffer) {
            Ok(0) => return "it closed the connection".into(),
            Ok(n) => {
                if kept.is_empty() {
                    heard = Instant::now();
                }
                kept.extend_from_slice(&buffer[..n]);
            }
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(e) => return e.to_string(),
        }
    }
}

fn too_long() -> Wrong {
    Wrong::new(Code::Long, format!("a line of more than {MOST_BYTES} bytes"))
}

fn ended(mut stream: &TcpStream, wrong: &Wrong) -> String {
    let answer = no(wrong);
    let _ = stream.write_all(format!("{answer}\n").as_bytes());
    let_it_be_read(stream);
    answer
}

/// Reads the rest for a moment. Closing a connection with unread bytes resets it, and the reset can discard the
/// answer before it is read [rfc1122 4.2.2.13].
fn let_it_be_read(mut stream: &TcpStream) {
    let (begun, mut rest) = (Instant::now(), [0u8; 1024]);
    let _ = stream.shutdown(Shutdown::Write);
    let _ = stream.set_read_timeout(Some(LOOK));
    while begun.elapsed() < 2 * LOOK && stream.read(&mut rest).is_ok_and(|n| n > 0) {}
}

/// Turns away a client that connects while another is served, so that it does not wait.
fn turn_away(listener: &TcpListener) {
    if let Ok((mut stream, _)) = listener.accept() {
        let _ = stream.set_write_timeout(Some(LOOK));
        let _ = stream.write_all(format!("{}\n", no(&Wrong::new(Code::Busy, "another robot is connected"))).as_bytes());
        let_it_be_read(&stream);
    }
}
