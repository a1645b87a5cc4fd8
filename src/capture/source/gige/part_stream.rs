//! In: the address of a camera that sends multi-part payloads. Out: its blocks as they end.
//! Frame and unit: bytes as the camera sent them; its clock in ticks.

use super::parts::{Again, Block, Blocks};
use std::io::ErrorKind;
use std::net::{IpAddr, Ipv4Addr, UdpSocket};
use std::time::{Duration, Instant};
use viva_genicam::gige::{GVCP_PORT, encode_packet_resend, set_recv_buffer};

/// The stream channel that is used.
const CHANNEL: u16 = 0;
/// The longest wait for a single packet.
const TICK: Duration = Duration::from_millis(20);
/// Receive buffer that is asked of the system, bytes.
const BUFFER: usize = 16 << 20;

/// Blocks from a camera.
pub struct PartStream {
    socket: UdpSocket,
    /// The only address that is listened to.
    camera: Ipv4Addr,
    blocks: Blocks,
    buffer: Vec<u8>,
    /// Number of the last request for lost packets; 0 before the first.
    requests: u16,
}

impl PartStream {
    /// Opens a socket at this address of this machine for packets of the camera.
    ///
    /// # Errors
    /// The system gives none.
    pub fn open(here: Ipv4Addr, camera: Ipv4Addr) -> std::io::Result<PartStream> {
        let socket = UdpSocket::bind((here, 0))?;
        set_recv_buffer(&socket, BUFFER)?;
        Ok(PartStream { socket, camera, blocks: Blocks::default(), buffer: vec![0; 1 << 16], requests: 0 })
    }

    /// The port that the camera has to send to.
    ///
    /// # Errors
    /// The system does not tell.
    pub fn port(&self) -> std::io::Result<u16> {
        self.socket.local_addr().map(|at| at.port())
    }

    /// Number of packets of other payload types.
    pub fn foreign(&self) -> u64 {
        self.blocks.foreign
    }

    /// Packets that were lost and came when they were asked for.
    pub fn resent(&self) -> u64 {
        self.blocks.resent
    }

    /// Asks the camera for lost packets. It does not acknowledge this; it sends them.
    fn ask(&mut self) -> std::io::Result<()> {
        while let Some(Again { block, packets: [first, last], extended }) = self.blocks.lost.pop_front() {
            self.requests = self.requests.wrapping_add(1).max(1);
            let bytes = encode_packet_resend(self.requests, CHANNEL, block, first, last, extended);
            self.socket.send_to(&bytes, (self.camera, GVCP_PORT))?;
        }
        Ok(())
    }

    /// The next block that ends; nothing if none does within this time.
    ///
    /// # Errors
    /// The socket fails.
    pub fn next(&mut self, within: Duration) -> std::io::Result<Option<Block>> {
        let until = Instant::now() + within;
        loop {
            let now = Instant::now();
            if let Some(block) = self.blocks.ended(now) {
                return Ok(Some(block));
            }
            let left = until.saturating_duration_since(now);
            if left.is_zero() {
                return Ok(None);
            }
            self.socket.set_read_timeout(Some(left.min(TICK)))?;
            match self.socket.recv_from(&mut self.buffer) {
                Ok((n, from)) if from.ip() == IpAddr::V4(self.camera) => {
                    self.blocks.take(&self.buffer[..n], Instant::now());
                    self.ask()?;
                }
                Ok(_) => {}
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
                Err(e) => return Err(e),
            }
        }
    }
}
