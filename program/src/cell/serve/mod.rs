//! In: a cell and addresses to listen on. Out: the cell on the network: its controller on TCP and UDP, its cameras
//! on TCP.
//! Frame and unit: bytes.

mod camera;
mod faults;
mod tcp;
mod udp;

use super::cell::Cell;
use super::controller::Controller;
pub use faults::Faults;
use sheetlight::fault::{Fault, Result};
use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A cell that is served on sockets until this is dropped.
pub struct Served {
    /// The cell.
    pub cell: Cell,
    /// The cell's controller.
    pub controller: Controller,
    /// Faults on the wire.
    pub faults: Arc<Faults>,
    /// Address of the controller, TCP and UDP.
    pub robot: SocketAddr,
    /// Address of the camera.
    pub camera: SocketAddr,
    /// Address of the gripper's camera.
    pub gripper_camera: SocketAddr,
    over: Arc<AtomicBool>,
}

impl Served {
    /// Serves a cell. The system chooses a port if it is 0.
    ///
    /// # Errors
    /// A port is in use, or no thread can be started.
    pub fn start(cell: Cell, robot: &str, camera: &str, gripper_camera: &str) -> Result<Served> {
        let (listener, datagrams) = robot_sockets(robot)?;
        let cameras = [camera, gripper_camera].map(|at| TcpListener::bind(at).map_err(|e| taken(at, &e)));
        let [eye, gripper_eye] = cameras;
        let (eye, gripper_eye) = (eye?, gripper_eye?);
        let address = |l: &TcpListener| l.local_addr().map_err(|e| taken("the camera", &e));
        let served = Served {
            controller: Controller::new(cell.clone()),
            faults: Arc::default(),
            robot: listener.local_addr().map_err(|e| taken(robot, &e))?,
            camera: address(&eye)?,
            gripper_camera: address(&gripper_eye)?,
            over: Arc::default(),
            cell,
        };
        let (controller, faults, over) = (&served.controller, &served.faults, &served.over);
        let thread = |name: &str, run: Box<dyn FnOnce() + Send>| {
            std::thread::Builder::new().name(name.into()).spawn(run).map(|_| ()).map_err(|e| Fault::threads(&e))
        };
        let (c, f, o) = (controller.clone(), faults.clone(), over.clone());
        thread("b-CAP TCP", Box::new(move || tcp::serve(&listener, &c, &f, &o)))?;
        let (c, f, o) = (controller.clone(), faults.clone(), over.clone());
        thread("b-CAP UDP", Box::new(move || udp::serve(&datagrams, &c, &f, &o)))?;
        for (listener, in_gripper) in [(eye, false), (gripper_eye, true)] {
            let (cell, f, o) = (served.cell.clone(), faults.clone(), over.clone());
            thread("camera", Box::new(move || camera::serve(&listener, &cell, in_gripper, &f, &o)))?;
        }
        Ok(served)
    }

    /// Serves a cell on local ports that the system chooses.
    ///
    /// # Errors
    /// As for [`Served::start`].
    pub fn here(cell: Cell) -> Result<Served> {
        Served::start(cell, "127.0.0.1:0", "127.0.0.1:0", "127.0.0.1:0")
    }

    /// The robot as a URI.
    pub fn robot_uri(&self) -> String {
        format!("bcap://{}", self.robot)
    }
    /// The camera as a URI; pictures are requested one by one.
    pub fn camera_uri(&self) -> String {
        format!("cell://{}?rate=-1", self.camera)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
    }
}

/// The same port number for TCP and UDP.
fn robot_sockets(at: &str) -> Result<(TcpListener, UdpSocket)> {
    let mut last = None;
    // A port that the system chose for TCP may be in use for UDP: then try another one.
    for _ in 0..20 {
        let listener = TcpListener::bind(at).map_err(|e| taken(at, &e))?;
        let address = listener.local_addr().map_err(|e| taken(at, &e))?;
        match UdpSocket::bind(address) {
            Ok(socket) => return Ok((listener, socket)),
            Err(e) => last = Some(e),
        }
    }
    Err(taken(at, &last.expect("tried")))
}

fn taken(at: &str, e: &std::io::Error) -> Fault {
    Fault::device(format!("{at}: cannot be listened on: {e}"))
        .cause("another program has the port, perhaps a cell that still runs")
        .next("end it, or choose another port")
}
