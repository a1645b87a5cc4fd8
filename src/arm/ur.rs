//! In: the address of a Universal Robots controller. Out: its poses, read from the stream of its real-time
//! interface (port 30003); nothing is sent.
//! Frame and unit: metres and rotation vector on the wire, base_from_flange in mm here: the tool centre point must
//! be the flange.

use super::state::stamp;
use super::{Arm, Mode, PoseSource, State, TimedPose};
use crate::fault::{Fault, Result};
use crate::robot::Convention;
use std::io::Read;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Longest silence of a stream that sends 125 or 500 packets a second.
const PATIENCE: Duration = Duration::from_secs(1);
/// Byte offsets of time and tool vector in a packet (big-endian doubles), and the limits of its length, bytes.
/// Packets of all controllers since version 3 begin alike and are at least `SHORTEST` long.
const TIME: usize = 4;
const TOOL: usize = 444;
const SHORTEST: usize = 812;
const LONGEST: usize = 4096;

/// The numbers of a packet that are used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Packet {
    /// The controller's clock, s.
    pub time_s: f64,
    /// X Y Z, m, and rotation vector, rad.
    pub tool: [f64; 6],
}

/// Reads one packet, its length field included. Errors: the packet is shorter than `SHORTEST`.
pub fn packet(bytes: &[u8]) -> Result<Packet> {
    if bytes.len() < SHORTEST {
        return Err(Fault::input(format!("a packet of {} bytes, {SHORTEST} or more are expected", bytes.len()))
            .cause("another port than the real-time interface, or a controller before version 3")
            .next("use port 30003"));
    }
    let number = |at: usize| f64::from_be_bytes(bytes[at..at + 8].try_into().expect("eight bytes"));
    Ok(Packet { time_s: number(TIME), tool: std::array::from_fn(|k| number(TOOL + 8 * k)) })
}

#[derive(Default)]
struct Newest {
    /// Number of packets so far, the newest one with the time of its arrival, and the fault that ended the stream.
    packet: Mutex<(u64, Option<(Packet, Instant)>, Option<Fault>)>,
    came: Condvar,
}

/// A stream of poses.
pub(super) struct UrPoses {
    name: String,
    address: String,
    newest: Arc<Newest>,
    stream: TcpStream,
}

impl UrPoses {
    pub fn open(name: &str, address: &str) -> Result<UrPoses> {
        let nobody = |e: std::io::Error| {
            Fault::device(format!("{address}: no controller answers: {e}"))
                .cause("another address, a firewall, or the controller is off")
                .next("ping the controller; its real-time interface is port 30003")
        };
        let at = address.to_socket_addrs().map_err(nobody)?.next();
        let at = at.ok_or_else(|| nobody(std::io::ErrorKind::NotFound.into()))?;
        let stream = TcpStream::connect_timeout(&at, PATIENCE).map_err(nobody)?;
        stream.set_read_timeout(Some(PATIENCE)).map_err(nobody)?;
        let (mut reader, newest) = (stream.try_clone().map_err(nobody)?, Arc::new(Newest::default()));
        let shared = newest.clone();
        let run = move || {
            loop {
                let next = read(&mut reader);
                let mut held = shared.packet.lock().unwrap_or_else(PoisonError::into_inner);
                let ended = next.is_err();
                match next {
                    Ok(packet) => (held.0, held.1) = (held.0 + 1, Some((packet, Instant::now()))),
                    Err(fault) => held.2 = Some(fault),
                }
                shared.came.notify_all();
                if ended {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("ur".into()).spawn(run).map_err(|e| Fault::threads(&e))?;
        Ok(UrPoses { name: name.to_owned(), address: address.to_owned(), newest, stream })
    }
}

fn read(stream: &mut TcpStream) -> Result<Packet> {
    let lost = |e: std::io::Error| {
        Fault::device(format!("the stream of poses ended: {e}"))
            .cause("the controller was switched off, or the cable is out")
            .next("connect again")
    };
    let mut length = [0; 4];
    stream.read_exact(&mut length).map_err(lost)?;
    let size = u32::from_be_bytes(length) as usize;
    if !(SHORTEST..=LONGEST).contains(&size) {
        return Err(Fault::input(format!("a packet says that it has {size} bytes, {SHORTEST} to {LONGEST} are read"))
            .cause("another port than the real-time interface")
            .next("use port 30003"));
    }
    let mut bytes = vec![0; size];
    bytes[..4].copy_from_slice(&length);
    stream.read_exact(&mut bytes[4..]).map_err(lost)?;
    packet(&bytes)
}

impl PoseSource for UrPoses {
    /// The first pose that arrives after the request.
    fn pose(&mut self) -> Result<TimedPose> {
        let asked = Instant::now();
        let mut held = self.newest.packet.lock().unwrap_or_else(PoisonError::into_inner);
        let before = held.0;
        while held.0 == before {
            if let Some(fault) = &held.2 {
                return Err(fault.clone().at(&self.name));
            }
            let (again, late) = self.newest.came.wait_timeout(held, PATIENCE).unwrap_or_else(PoisonError::into_inner);
            held = again;
            if late.timed_out() && held.0 == before {
                return Err(Fault::device(format!("{}: no pose for {} ms", self.name, PATIENCE.as_millis()))
                    .cause("the cable is out, or the controller hangs")
                    .next("look at the robot, then connect again"));
            }
        }
        let (packet, here) = held.1.expect("one came");
        let base_from_flange = Convention::Ur.read(&packet.tool).map_err(|e| e.at(&self.name))?;
        let device = Some(stamp(packet.time_s).map_err(|e| e.at(&self.name))?);
        Ok(TimedPose { base_from_flange, figure: None, asked, here, device })
    }
}

impl Arm for UrPoses {
    fn name(&self) -> &str {
        &self.name
    }
    fn state(&mut self) -> Result<State> {
        let model = "Universal Robots, poses only".into();
        let (motor, busy, emergency_stop) = (None, None, None);
        Ok(State { model, mode: Mode::Unknown, motor, busy, emergency_stop, errors: vec![], tool: None, work: None })
    }
    fn unsaid(&self) -> Option<&'static str> {
        Some("the flange: the controller does not say whether its tool centre point is the flange, as it has to be")
    }
    fn watch(&self) -> Result<Box<dyn PoseSource>> {
        Ok(Box::new(UrPoses::open(&self.name, &self.address)?))
    }
}

impl Drop for UrPoses {
    fn drop(&mut self) {
        let _ = self.stream.shutdown(std::net::Shutdown::Both);
    }
}
