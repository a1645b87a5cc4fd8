//! In: an address. Out: Modbus served there on threads of its own until this is dropped.
//! Frame and unit: s.

use super::executor::{MODBUS, Plc};
use crate::web::guard::IDLE;
use crate::web::screen::Screen;
use sheetlight::fault::{Fault, Result};
use sheetlight::robot::Convention;
use sheetlight::station::Settings;
use sheetlight::station::socket::{Patience, has_registers, serve_modbus};
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

/// A silent PLC loses the requests to another one as a screen loses its lease. The rest of a frame comes at once.
const PATIENCE: Patience = Patience { idle: IDLE, line: Duration::from_secs(5) };

/// The open door.
pub struct Door {
    /// The address that is listened on.
    pub address: SocketAddr,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Door {
    /// Opens the door.
    ///
    /// # Errors
    /// The address is not available; the station's notation has no registers.
    pub fn open(address: SocketAddr, screen: Arc<Screen>) -> Result<Door> {
        let notation = Settings::load(&screen.place.station)?.robot.unwrap_or(Convention::Denso);
        has_registers(notation)?;
        let bound = TcpListener::bind(address).and_then(|listener| listener.local_addr().map(|at| (listener, at)));
        let (listener, address) = bound.map_err(|e| {
            Fault::device(format!("--modbus {address}: cannot be listened on: {e}"))
                .cause("another program has the port, the address is not this machine's, or the port needs rights")
                .next("choose another address or port; ports from 1024 on need no rights")
        })?;
        screen.hub.link(MODBUS, |link| link.address = address.to_string());
        let over = Arc::new(AtomicBool::new(false));
        let stop = over.clone();
        let serves = move || {
            let mut plc = Plc::new(screen.clone(), notation);
            if let Err(fault) = serve_modbus(&listener, &mut plc, PATIENCE, &stop, &mut |_| {}) {
                screen.hub.link(MODBUS, |link| link.problem = Some(format!("modbus: {}", fault.what)));
            }
        };
        let thread = Builder::new().name("modbus".into()).spawn(serves).map_err(|e| Fault::threads(&e))?;
        Ok(Door { address, over, thread: Some(thread) })
    }
}

impl Drop for Door {
    fn drop(&mut self) {
        self.over.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
