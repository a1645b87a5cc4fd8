//! In: a listener, a session. Out: serves PLCs over Modbus TCP [modbus, MODBUS Application Protocol 1.1b3]: they write
//! requests into registers and read the answers from registers.
//! Frame and unit: those of registers.rs; s.

use super::registers::{Asked, Refused, Registers};
use super::serve::{LOOK, Patience};
use super::session::Session;
use super::words::{self, Request as Word};
use crate::fault::{Fault, Result};
use std::future::{Ready, ready};
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tokio_modbus::server::{Service, tcp::Server};
use tokio_modbus::{ExceptionCode, Request, Response};

/// Most connections at a time; the next one is closed. A PLC needs one, a panel another.
const MOST: usize = 16;
/// A connection without traffic is asked after this time whether it still exists.
const SILENT: Duration = Duration::from_secs(30);

/// One connection.
struct Connection {
    registers: Arc<Mutex<Registers>>,
    from: IpAddr,
    asked: Sender<Asked>,
    _counted: Arc<()>,
}

impl Service for Connection {
    type Request = Request<'static>;
    type Response = Response;
    type Exception = ExceptionCode;
    type Future = Ready<std::result::Result<Response, ExceptionCode>>;

    fn call(&self, request: Request<'static>) -> Self::Future {
        ready(self.answer(request).map_err(|refused| match refused {
            Some(Refused::Address) => ExceptionCode::IllegalDataAddress,
            Some(Refused::Busy) => ExceptionCode::ServerDeviceBusy,
            None => ExceptionCode::IllegalFunction,
        }))
    }
}

impl Connection {
    /// `None`: a function that does not exist here.
    fn answer(&self, request: Request<'static>) -> std::result::Result<Response, Option<Refused>> {
        let mut registers = self.registers.lock().expect("no panic holds it");
        let write = |registers: &mut Registers, address: u16, values: &[u16]| {
            if let Some(asked) = registers.write(address, values, self.from, Instant::now())? {
                // The receiver is gone only when the server ends.
                let _ = self.asked.send(asked);
            }
            Ok::<(), Refused>(())
        };
        Ok(match request {
            Request::ReadInputRegisters(at, count) => Response::ReadInputRegisters(registers.read(at, count)?),
            Request::ReadHoldingRegisters(at, count) => Response::ReadHoldingRegisters(registers.written(at, count)?),
            Request::WriteSingleRegister(at, value) => {
                write(&mut registers, at, &[value])?;
                Response::WriteSingleRegister(at, value)
            }
            Request::WriteMultipleRegisters(at, values) => {
                write(&mut registers, at, &values)?;
                Response::WriteMultipleRegisters(at, values.len() as u16)
            }
            Request::ReadWriteMultipleRegisters(at, count, to, values) => {
                // It writes before it reads [modbus 6.17], so both are checked first.
                registers.written(at, count)?;
                write(&mut registers, to, &values)?;
                Response::ReadWriteMultipleRegisters(registers.written(at, count)?)
            }
            _ => return Err(None),
        })
    }
}

/// Serves until `stop`; `told` receives every request and its answer.
///
/// # Errors
/// The session's notation has no registers, or the listener cannot be used.
pub fn serve_modbus(
    listener: TcpListener,
    session: &mut Session,
    patience: Patience,
    stop: &AtomicBool,
    told: &mut dyn FnMut(&str),
) -> Result<()> {
    let registers = Arc::new(Mutex::new(Registers::new(session.notation(), patience.idle)?));
    let failed = |e: std::io::Error| Fault::device(format!("the listener cannot be used: {e}")).next("start it again");
    listener.set_nonblocking(true).map_err(failed)?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
    let listener = runtime.block_on(async { tokio::net::TcpListener::from_std(listener) }).map_err(failed)?;
    let (send, requests) = channel();
    let (over, ended) = tokio::sync::oneshot::channel::<()>();
    std::thread::scope(|scope| {
        let shared = registers.clone();
        scope.spawn(move || {
            let server = Server::new(listener);
            runtime.block_on(async {
                tokio::select! {
                    () = connections(&server, &shared, &send) => {}
                    _ = ended => {}
                }
            });
        });
        answered(&requests, &registers, session, stop, told);
        drop(over);
    });
    Ok(())
}

/// Executes requests until `stop`, while other threads read the registers.
fn answered(
    requests: &Receiver<Asked>,
    registers: &Mutex<Registers>,
    session: &mut Session,
    stop: &AtomicBool,
    told: &mut dyn FnMut(&str),
) {
    while !stop.load(Ordering::SeqCst) {
        let asked = match requests.recv_timeout(LOOK) {
            Ok(asked) => asked,
            Err(RecvTimeoutError::Timeout) => continue,
            Err(RecvTimeoutError::Disconnected) => return,
        };
        if asked.by_another {
            session.afresh();
        }
        let words = format!("{:?}", asked.request).chars().take(120).collect::<String>();
        let said = asked.request.and_then(|request| session.done(request));
        let shown = match &said {
            Ok(reply) => words::yes(reply, session.notation()),
            Err(wrong) => words::no(wrong),
        };
        let state = session.done(Word::Status).expect("a state has no error");
        registers.lock().expect("no panic holds it").answer(asked.number, &said, &state);
        told(&format!("{}: {words} -> {shown}", asked.number));
    }
}

/// Accepts connections; ends never.
async fn connections(server: &Server, registers: &Arc<Mutex<Registers>>, asked: &Sender<Asked>) {
    let counted = Arc::new(());
    let accept = |stream: tokio::net::TcpStream, from: SocketAddr| {
        let connection = (Arc::strong_count(&counted) <= MOST).then(|| Connection {
            registers: registers.clone(),
            from: from.ip(),
            asked: asked.clone(),
            _counted: counted.clone(),
        });
        // A PLC that was switched off says nothing more, and its connection would count for ever.
        let alive = socket2::TcpKeepalive::new().with_time(SILENT).with_interval(SILENT / 3);
        let kept = socket2::SockRef::from(&stream).set_tcp_keepalive(&alive);
        let accepted = connection.filter(|_| kept.is_ok()).map(|connection| (connection, stream));
        ready(Ok::<_, std::io::Error>(accepted))
    };
    loop {
        // An error here is one client's: it closed its connection before it was accepted, or no file is free.
        if server.serve(&accept, |_| {}).await.is_err() {
            tokio::time::sleep(LOOK).await;
        }
    }
}
