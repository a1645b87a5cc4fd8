//! In: a listener, an executor of requests. Out: serves PLCs over Modbus TCP: they write requests into registers and
//! read the answers from registers.
//! Frame and unit: those of registers.rs; s.

use super::executor::Executor;
use super::frame;
use super::peers::{Pace, Peers};
use super::registers::{Asked, Registers};
use super::serve::{LOOK, Patience};
use super::words;
use crate::fault::{Fault, Result};
use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};
use std::io::{ErrorKind, Read, Write};
use std::net::{IpAddr, TcpListener, TcpStream};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::Builder;
use std::time::{Duration, Instant};

/// Pause after a connection was accepted: who opens them without pause takes no processor from a job.
const ACCEPTED: Duration = Duration::from_millis(2);

/// What all connections share.
struct Shared {
    registers: Mutex<Registers>,
    patience: Patience,
    peers: Peers,
    over: AtomicBool,
}

/// Serves until `stop`; `told` receives every request and its answer.
///
/// # Errors
/// The executor's notation has no registers, or the listener cannot be used.
pub fn serve_modbus(
    listener: &TcpListener,
    executor: &mut dyn Executor,
    patience: Patience,
    stop: &AtomicBool,
    told: &mut dyn FnMut(&str),
) -> Result<()> {
    let registers = Registers::new(executor.notation(), patience.idle, by_chance(), executor.jobs())?;
    let shared =
        Shared { registers: Mutex::new(registers), patience, peers: Peers::default(), over: AtomicBool::new(false) };
    listener
        .set_nonblocking(true)
        .map_err(|e| Fault::device(format!("the listener cannot be used: {e}")).next("start it again"))?;
    let (asked, requests) = channel();
    std::thread::scope(|scope| {
        let shared = &shared;
        let accepts = move || {
            while !shared.over.load(SeqCst) {
                // An error is one client's: it closed its connection before it was accepted, or no file is free.
                let Ok((stream, from)) = listener.accept() else {
                    std::thread::sleep(LOOK);
                    continue;
                };
                std::thread::sleep(ACCEPTED);
                let Some(place) = shared.peers.admit(from) else { continue };
                let asked = asked.clone();
                let serves = move || {
                    connection(&stream, from.ip(), shared, &asked);
                    drop(place);
                };
                if let Err(e) = Builder::new().name("modbus peer".into()).spawn_scoped(scope, serves) {
                    shared.peers.refused(from.ip(), &Fault::threads(&e).what);
                }
            }
        };
        let accepting = Builder::new().name("modbus accepts".into()).spawn_scoped(scope, accepts);
        let served = accepting.map_err(|e| Fault::threads(&e));
        if served.is_ok() {
            executed(&requests, shared, executor, stop, told);
        }
        shared.over.store(true, SeqCst);
        served.map(|_| ())
    })
}

/// A number that nobody can know.
fn by_chance() -> u16 {
    RandomState::new().build_hasher().finish() as u16
}

/// Executes requests until `stop`, while other threads read the registers.
fn executed(
    requests: &Receiver<Asked>,
    shared: &Shared,
    executor: &mut dyn Executor,
    stop: &AtomicBool,
    told: &mut dyn FnMut(&str),
) {
    let mut looked = Instant::now();
    look(shared, executor);
    while !stop.load(SeqCst) {
        let next = requests.recv_timeout(LOOK.saturating_sub(looked.elapsed()));
        let Ok(asked) = next else {
            look(shared, executor);
            looked = Instant::now();
            continue;
        };
        if asked.by_another {
            executor.afresh();
        }
        let words = format!("{:?}", asked.request).chars().take(120).collect::<String>();
        let said = asked.request.and_then(|request| executor.done(request));
        let answer = match &said {
            Ok(reply) => words::yes(reply, executor.notation()),
            Err(wrong) => words::no(wrong),
        };
        if said.is_err() {
            shared.peers.refused(asked.from, &format!("request {}: {answer}", asked.number));
        }
        let (state, shown) = (executor.state(), executor.shown());
        let mut registers = shared.registers.lock().expect("no panic holds it");
        registers.answer(asked.number, &said, &state);
        registers.show(&shown, &state);
        drop(registers);
        told(&format!("{}: {words} -> {answer}", asked.number));
    }
}

/// Shows what the executor does now, and tells it who is connected.
fn look(shared: &Shared, executor: &mut dyn Executor) {
    executor.heard(shared.peers.traffic());
    let (state, shown) = (executor.state(), executor.shown());
    shared.registers.lock().expect("no panic holds it").show(&shown, &state);
}

/// Serves one connection until it ends, or until nothing came for too long.
fn connection(mut stream: &TcpStream, from: IpAddr, shared: &Shared, asked: &Sender<Asked>) {
    let ready = stream.set_nonblocking(false).and_then(|()| stream.set_nodelay(true));
    let ready = ready.and_then(|()| stream.set_read_timeout(Some(LOOK)));
    if ready.and_then(|()| stream.set_write_timeout(Some(shared.patience.line))).is_err() {
        return;
    }
    let (mut kept, mut buffer, mut heard) = (Vec::new(), [0u8; 512], Instant::now());
    let mut pace = Pace::new(heard);
    while !shared.over.load(SeqCst) {
        match frame::next(&mut kept) {
            Err(why) => return shared.peers.refused(from, why),
            Ok(Some(frame)) => {
                std::thread::sleep(pace.frame(Instant::now()));
                let (answer, request) = {
                    let mut registers = shared.registers.lock().expect("no panic holds it");
                    frame::answer(&frame, &mut registers, from)
                };
                match frame::refusal(&answer) {
                    Some(why) => shared.peers.refused(from, why),
                    None => shared.peers.answered(),
                }
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
