//! In: TCP clients of the controller. Out: their answers, each client on a separate thread. A frame that cannot be
//! read closes its connection without an answer, as Denso's service does.
//! Frame and unit: bytes; ms.

use super::Faults;
use crate::cell::controller::{Answer, Connection, Controller};
use sheetlight::bcap::{Frame, Outcome, Splitter};
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Interval at which a server checks whether it must end, and whether a motion has ended.
const LOOK: Duration = Duration::from_millis(2);
/// Largest number of clients at once, as in Denso's service.
const MOST_CLIENTS: usize = 20;
/// Longest wait for bytes; after it an answer that waits to be merged is sent alone.
const PATIENCE: Duration = Duration::from_millis(100);

pub(super) fn serve(listener: &TcpListener, controller: &Controller, faults: &Arc<Faults>, over: &Arc<AtomicBool>) {
    if listener.set_nonblocking(true).is_err() {
        return;
    }
    let clients = Arc::new(());
    while !over.load(Ordering::Relaxed) {
        let Ok((stream, _)) = listener.accept() else {
            std::thread::sleep(LOOK);
            continue;
        };
        if Faults::on(&faults.gone) || Arc::strong_count(&clients) > MOST_CLIENTS {
            continue;
        }
        let (connection, faults, over, counted) = (controller.connect(), faults.clone(), over.clone(), clients.clone());
        let run = move || {
            let _counted = counted;
            let _ = client(stream, connection, &faults, &over);
        };
        let _ = std::thread::Builder::new().name("b-CAP client".into()).spawn(run);
    }
}

/// Serves one client until it disconnects or sends bytes that cannot be read.
fn client(
    mut stream: TcpStream,
    mut connection: Connection,
    faults: &Faults,
    over: &AtomicBool,
) -> std::io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(Duration::from_secs(5)))?;
    let (mut splitter, mut buffer, mut kept) = (Splitter::default(), [0; 4096], Vec::new());
    while !over.load(Ordering::Relaxed) && !Faults::on(&faults.gone) {
        match splitter.next() {
            Ok(Some(frame)) => {
                if Faults::take(&faults.cut) {
                    connection.answer(frame.number, &frame.arguments);
                    return stream.shutdown(std::net::Shutdown::Both);
                }
                answer(&mut stream, &mut connection, &frame, faults, over, &mut kept)?;
                continue;
            }
            Ok(None) => {}
            Err(_) => return Ok(()),
        }
        match stream.read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(n) => splitter.push(&buffer[..n]),
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {
                if !kept.is_empty() {
                    // No later answer came with which it could be merged.
                    stream.write_all(&std::mem::take(&mut kept))?;
                }
            }
            Err(e) => return Err(e),
        }
    }
    Ok(())
}

/// Waits until a call is complete; sends interim replies meanwhile.
pub(super) fn outcome(
    connection: &mut Connection,
    controller: &Controller,
    frame: &Frame,
    faults: &Faults,
    over: &AtomicBool,
    mut interim: impl FnMut(Frame) -> std::io::Result<()>,
) -> std::io::Result<Frame> {
    let reply = |number: u32, arguments| Frame { serial: frame.serial, first_serial: 0, number, arguments };
    let begun = connection.answer(frame.number, &frame.arguments);
    for _ in 0..faults.interim.load(Ordering::Relaxed) {
        interim(reply(Outcome::INTERIM.0, vec![]))?;
    }
    let ready_at = Instant::now() + Duration::from_millis(faults.delay_ms.load(Ordering::Relaxed));
    let every = connection.watchdog_ms.map(Duration::from_millis);
    let mut next = every.map(|e| Instant::now() + e);
    loop {
        let done = match &begun {
            Answer::Done(outcome, value) => Some((*outcome, value.clone())),
            Answer::Moving(ticket) => controller.motion(*ticket).map(|outcome| (outcome, None)),
        };
        match done {
            Some((outcome, value)) if Instant::now() >= ready_at => {
                return Ok(reply(outcome.0, value.into_iter().collect()));
            }
            _ if over.load(Ordering::Relaxed) => return Err(ErrorKind::ConnectionAborted.into()),
            _ => std::thread::sleep(LOOK),
        }
        if let (Some(at), Some(every)) = (next, every)
            && Instant::now() >= at
        {
            interim(reply(Outcome::INTERIM.0, vec![]))?;
            next = Some(at + every);
        }
    }
}

fn answer(
    stream: &mut TcpStream,
    connection: &mut Connection,
    frame: &Frame,
    faults: &Faults,
    over: &AtomicBool,
    kept: &mut Vec<u8>,
) -> std::io::Result<()> {
    let controller = connection.controller();
    let mut lost = false;
    let reply = outcome(connection, &controller, frame, faults, over, |interim| {
        // A client that disconnects does not stop its motion.
        lost |= stream.write_all(&bytes(&interim)).is_err();
        Ok(())
    })?;
    if Faults::take(&faults.lose) {
        return Ok(());
    }
    let waits = Faults::on(&faults.merge) && kept.is_empty();
    let mut out = std::mem::take(kept);
    if Faults::on(&faults.foreign) {
        out.extend(bytes(&Frame { serial: reply.serial.wrapping_add(9000).max(1), ..reply.clone() }));
    }
    out.extend(bytes(&reply));
    if waits {
        // Until the next answer is sent, or nothing has arrived for a while.
        *kept = out;
        return Ok(());
    }
    match faults.piece.load(Ordering::Relaxed) as usize {
        0 => stream.write_all(&out),
        n => out.chunks(n).try_for_each(|piece| {
            stream.write_all(piece)?;
            std::thread::sleep(Duration::from_micros(200));
            Ok(())
        }),
    }
}

fn bytes(frame: &Frame) -> Vec<u8> {
    frame.encode().unwrap_or_default()
}
