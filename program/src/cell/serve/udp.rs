//! In: UDP clients of the controller. Out: their answers, one call after the other for all clients, as Denso's
//! service does. A repeated request is answered from memory and executed once.
//! Frame and unit: bytes; ms.

use super::Faults;
use super::tcp::outcome;
use crate::cell::controller::{Connection, Controller};
use sheetlight::bcap::Frame;
use std::collections::BTreeMap;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Largest number of clients that are remembered.
const MOST_CLIENTS: usize = 20;

/// A client, with its last call and the answer to it.
struct Client {
    connection: Connection,
    last: Option<(u16, Frame)>,
    /// Number of its newest datagram, counted over all clients.
    heard: u64,
}

pub(super) fn serve(socket: &UdpSocket, controller: &Controller, faults: &Faults, over: &AtomicBool) {
    let mut clients = BTreeMap::<SocketAddr, Client>::new();
    let (mut buffer, mut heard) = ([0; 2048], 0);
    if socket.set_read_timeout(Some(Duration::from_millis(20))).is_err() {
        return;
    }
    while !over.load(Ordering::Relaxed) {
        let Ok((n, from)) = socket.recv_from(&mut buffer) else { continue };
        // A datagram that cannot be read is skipped.
        let Ok(frame) = Frame::decode(&buffer[..n]) else { continue };
        if Faults::on(&faults.gone) {
            continue;
        }
        if !clients.contains_key(&from) && clients.len() >= MOST_CLIENTS {
            let silent = clients.iter().min_by_key(|(_, client)| client.heard).map(|(address, _)| *address);
            silent.and_then(|address| clients.remove(&address));
        }
        let new = || Client { connection: controller.connect(), last: None, heard: 0 };
        let client = clients.entry(from).or_insert_with(new);
        heard += 1;
        client.heard = heard;
        let reply = match &client.last {
            Some((first, reply)) if *first == frame.first_serial && frame.first_serial != 0 => {
                Frame { serial: frame.serial, ..reply.clone() }
            }
            _ => {
                let send = |interim: Frame| send(socket, &interim, from);
                let Ok(reply) = outcome(&mut client.connection, controller, &frame, faults, over, send) else {
                    continue;
                };
                client.last = Some((frame.first_serial, reply.clone()));
                reply
            }
        };
        if !Faults::take(&faults.lose) {
            if Faults::on(&faults.foreign) {
                let _ = send(socket, &Frame { serial: reply.serial.wrapping_add(9000).max(1), ..reply.clone() }, from);
            }
            let _ = send(socket, &reply, from);
        }
    }
}

fn send(socket: &UdpSocket, frame: &Frame, to: SocketAddr) -> std::io::Result<()> {
    socket.send_to(&frame.encode().unwrap_or_default(), to).map(|_| ())
}
