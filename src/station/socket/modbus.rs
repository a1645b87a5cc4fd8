//! In: a listener, a session. Out: serves PLCs over Modbus TCP: they write requests into registers and read the answers
//! from registers.
//! Frame and unit: those of registers.rs; s.

use super::frame;
use super::registers::{Asked, Registers};
use super::serve::{LOOK, Patience};
use super::session::Session;
use super::words::{self, Request};
use crate::fault::{Fault, Result};
use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};
use std::io::{ErrorKind, Read, Write};
use std::net::{IpAddr, TcpListener, TcpStream};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Instant;

/// Most connections at a time; the next one is closed. A PLC needs one, a panel another.
const MOST: usize = 16;

/// What all connections share.
struct Shared {
    registers: Mutex<Registers>,
    patience: Patience,
    open: AtomicUsize,
    over: AtomicBool,
}

/// Serves until `stop`; `told` receives every request and its answer.
///
/// # Errors
/// The session's notation has no registers, or the listener cannot be used.
pub fn serve_modbus(
    listener: &TcpListener,
    session: &mut Session,
    patience: Patience,
    stop: &AtomicBool,
    told: &mut dyn FnMut(&str),
) -> Result<()> {
    let shared = Shared {
        registers: Mutex::new(Registers::new(session.notation(), patience.idle, by_chance())?),
        patience,
        open: AtomicUsize::new(0),
        over: AtomicBool::new(false),
    };
    listener
        .set_nonblocking(true)
        .map_err(|e| Fault::device(format!("the listener cannot be used: {e}")).next("start it again"))?;
    let (asked, requests) = channel();
    std::thread::scope(|scope| {
        let shared = &shared;
        scope.spawn(move || {
            while !shared.over.load(SeqCst) {
                // An error is one client's: it closed its connection before it was accepted, or no file is free.
                let Ok((stream, from)) = listener.accept() else {
                    std::thread::sleep(LOOK);
                    continue;
                };
                if shared.open.fetch_add(1, SeqCst) >= MOST {
                    shared.open.fetch_sub(1, SeqCst);
                    continue;
                }
                let asked = asked.clone();
                scope.spawn(move || {
                    connection(&stream, from.ip(), shared, &asked);
                    shared.open.fetch_sub(1, SeqCst);
                });
            }
        });
        executed(&requests, &shared.registers, session, stop, told);
        shared.over.store(true, SeqCst);
    });
    Ok(())
}

/// A number that nobody can know.
fn by_chance() -> u16 {
    RandomState::new().build_hasher().finish() as u16
}

/// Executes requests until `stop`, while other threads read the registers.
fn executed(
    requests: &Receiver<Asked>,
    registers: &Mutex<Registers>,
    session: &mut Session,
    stop: &AtomicBool,
    told: &mut dyn FnMut(&str),
) {
    while !stop.load(SeqCst) {
        let Ok(asked) = requests.recv_timeout(LOOK) else { continue };
        if asked.by_another {
            session.afresh();
        }
        let words = format!("{:?}", asked.request).chars().take(120).collect::<String>();
        let said = asked.request.and_then(|request| session.done(request));
        let shown = match &said {
            Ok(reply) => words::yes(reply, session.notation()),
            Err(wrong) => words::no(wrong),
        };
        let state = session.done(Request::Status).expect("a state has no error");
        registers.lock().expect("no panic holds it").answer(asked.number, &said, &state);
        told(&format!("{}: {words} -> {shown}", asked.number));
    }
}

/// Serves one connection until it ends, or until nothing came for too long.
fn connection(mut stream: &TcpStream, from: IpAddr, shared: &Shared, asked: &Sender<Asked>) {
    let ready = stream.set_nonblocking(false).and_then(|()| stream.set_nodelay(true));
    let ready = ready.and_then(|()| stream.set_read_timeout(Some(LOOK)));
    if ready.and_then(|()| stream.set_write_timeout(Some(shared.patience.line))).is_err() {
        return;
    }
    let (mut kept, mut buffer, mut heard) = (Vec::new(), [0u8; 512], Instant::now());
    while !shared.over.load(SeqCst) {
        match frame::next(&mut kept) {
            Err(_) => return,
            Ok(Some(frame)) => {
                let (answer, request) = {
                    let mut registers = shared.registers.lock().expect("no panic holds it");
                    frame::answer(&frame, &mut registers, from)
                };
                // The receiver is gone only when the server ends.
                request.map(|request| asked.send(request));
                if stream.write_all(&answer).is_err() {
                    return;
                }
                heard = Instant::now();
                continue;
            }
            Ok(None) => {}
        }
        let limit = if kept.is_empty() { shared.patience.idle } else { shared.patience.line };
        if heard.elapsed() > limit {
            return;
        }
        match stream.read(&mut buffer) {
            Ok(0) => return,
            Ok(n) => {
                if kept.is_empty() {
                    heard = Instant::now();
                }
                kept.extend_from_slice(&buffer[..n]);
            }
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(_) => return,
        }
    }
}
