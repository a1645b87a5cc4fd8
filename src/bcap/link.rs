//! In: an address and frames to send. Out: frames received over TCP or UDP; each wait has a time limit.
//! Frame and unit: bytes; times are instants.

use super::{Frame, Splitter};
use crate::fault::{Fault, Result};
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs, UdpSocket};
use std::time::{Duration, Instant};

/// Transport of the frames. Use TCP unless the controller is set to UDP: with UDP, all clients of Denso's library
/// share one thread, so that a Halt waits for the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Network {
    /// A stream; frames of any length.
    Tcp,
    /// Datagrams; a request has at most 503 bytes and is sent again if no answer comes.
    Udp,
}

/// Longest datagram: Denso's UDP service stops for good when it receives a longer one.
const LONGEST_DATAGRAM: usize = 503;
/// Shortest timeout that a socket accepts; 0 would wait without limit.
const SHORTEST_WAIT: Duration = Duration::from_millis(1);

enum Socket {
    Tcp(TcpStream, Splitter),
    Udp(UdpSocket),
}

/// A connection to a controller.
pub struct Link {
    address: SocketAddr,
    socket: Socket,
}

impl Link {
    /// Opens `host:port`. TCP fails here if nothing listens; UDP fails at the first call.
    pub fn open(address: &str, network: Network, patience: Duration) -> Result<Link> {
        let mut last = None;
        let all = address.to_socket_addrs().map_err(|e| {
            Fault::input(format!("{address}: is not an address: {e}"))
                .cause("a misspelt name, or the port is missing")
                .next("write HOST:PORT, for example 192.168.0.1:5007")
        })?;
        for at in all {
            match Link::to(at, network, patience) {
                Ok(link) => return Ok(link),
                Err(e) => last = Some((at, e)),
            }
        }
        Err(match last {
            Some((at, e)) => closed(at, &e),
            None => Fault::input(format!("{address}: no such host")).next("write the controller's address as numbers"),
        })
    }

    fn to(at: SocketAddr, network: Network, patience: Duration) -> std::io::Result<Link> {
        let socket = match network {
            Network::Tcp => {
                let stream = TcpStream::connect_timeout(&at, patience)?;
                stream.set_nodelay(true)?;
                stream.set_write_timeout(Some(patience))?;
                Socket::Tcp(stream, Splitter::default())
            }
            Network::Udp => {
                let any: SocketAddr = if at.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0u16; 8], 0).into() };
                let socket = UdpSocket::bind(any)?;
                socket.connect(at)?;
                Socket::Udp(socket)
            }
        };
        Ok(Link { address: at, socket })
    }

    /// The controller's address, as resolved.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sends the bytes of one frame. Over UDP, more than 503 bytes are an error.
    pub fn send(&mut self, bytes: &[u8]) -> Result<()> {
        let sent = match &mut self.socket {
            Socket::Tcp(stream, _) => stream.write_all(bytes),
            Socket::Udp(_) if bytes.len() > LONGEST_DATAGRAM => {
                return Err(Fault::usage(format!(
                    "a call of {} bytes does not fit a datagram, {LONGEST_DATAGRAM} do",
                    bytes.len()
                ))
                .cause("UDP carries short calls only")
                .next("connect over TCP"));
            }
            Socket::Udp(socket) => socket.send(bytes).map(|_| ()),
        };
        sent.map_err(|e| closed(self.address, &e))
    }

    /// The next frame; `None` once `until` has passed. A damaged datagram is skipped. A damaged stream is an error,
    /// because the frame boundaries are lost.
    pub fn receive(&mut self, until: Instant) -> Result<Option<Frame>> {
        let mut buffer = [0; 4096];
        loop {
            if let Socket::Tcp(_, splitter) = &mut self.socket
                && let Some(frame) = splitter.next().map_err(|e| e.at(self.address))?
            {
                return Ok(Some(frame));
            }
            let Some(left) = until.checked_duration_since(Instant::now()) else { return Ok(None) };
            let wait = Some(left.max(SHORTEST_WAIT));
            let read = match &mut self.socket {
                Socket::Tcp(stream, _) => stream.set_read_timeout(wait).and_then(|()| stream.read(&mut buffer)),
                Socket::Udp(socket) => socket.set_read_timeout(wait).and_then(|()| socket.recv(&mut buffer)),
            };
            match (read, &mut self.socket) {
                (Ok(0), Socket::Tcp(..)) => return Err(closed(self.address, &ErrorKind::UnexpectedEof.into())),
                (Ok(n), Socket::Tcp(_, splitter)) => splitter.push(&buffer[..n]),
                (Ok(n), Socket::Udp(_)) => {
                    if let Ok(frame) = Frame::decode(&buffer[..n]) {
                        return Ok(Some(frame));
                    }
                }
                (Err(e), _)
                    if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
                (Err(e), _) => return Err(closed(self.address, &e)),
            }
        }
    }
}

fn closed(at: SocketAddr, e: &std::io::Error) -> Fault {
    let (what, cause, next) = match e.kind() {
        ErrorKind::ConnectionRefused => (
            "nothing listens there".to_owned(),
            "another port, or b-CAP is off on the controller",
            "switch the b-CAP server on (its port is 5007), or correct the address",
        ),
        ErrorKind::TimedOut | ErrorKind::WouldBlock => (
            "does not answer".to_owned(),
            "another address or subnet, or a firewall",
            "ping the controller, then check the address",
        ),
        ErrorKind::UnexpectedEof
        | ErrorKind::ConnectionReset
        | ErrorKind::BrokenPipe
        | ErrorKind::ConnectionAborted => (
            "the connection was closed".to_owned(),
            "the controller restarted or stopped the service, or the cable is out",
            "look at the robot: what it does now is not known; then connect again",
        ),
        _ => (format!("cannot be reached: {e}"), "the network", "check cable and address"),
    };
    Fault::device(format!("{at}: {what}")).cause(cause).next(next)
}
