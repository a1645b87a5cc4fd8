//! In: a public address, the address of a server. Out: its clients' bytes there and back. Connections are counted,
//! messages are paced, and what is not OPC UA ends before it reaches the server: the crate async-opcua-server has no
//! limit for any of these.
//! Frame and unit: bytes [opc-6, OPC 10000-6, 7.1.2: message header]; s.

use std::collections::HashMap;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

/// Most connections at a time, and of one machine.
pub const MOST: usize = 16;
pub const MOST_OF_ONE: usize = 8;
/// Messages of a connection that pass at once, and how many a second after those.
const AT_ONCE: f64 = 300.0;
const A_SECOND: f64 = 300.0;
/// Largest message, as the server has it too.
pub const MOST_BYTES: usize = 327_675;
/// Time until the first message. A connection with a session sends more often: its channel is renewed.
const HELLO: Duration = Duration::from_secs(5);
const SILENT: Duration = Duration::from_secs(600);
const HEAD: usize = 8;
/// Pause after a connection that was refused, or that could not be accepted.
const REFUSED: Duration = Duration::from_millis(2);

/// Reads where messages begin in a stream of bytes.
#[derive(Default)]
struct Messages {
    head: Vec<u8>,
    /// Bytes of the present message that are still to come.
    left: usize,
    first: bool,
}

impl Messages {
    fn new() -> Messages {
        Messages { first: true, ..Messages::default() }
    }

    /// Follows the next bytes; returns how many messages began in them.
    ///
    /// # Errors
    /// They are no messages of OPC UA.
    fn follow(&mut self, mut bytes: &[u8]) -> Result<usize, &'static str> {
        let mut begun = 0;
        while !bytes.is_empty() {
            if self.left > 0 {
                let n = self.left.min(bytes.len());
                (self.left, bytes) = (self.left - n, &bytes[n..]);
                continue;
            }
            let n = (HEAD - self.head.len()).min(bytes.len());
            self.head.extend_from_slice(&bytes[..n]);
            bytes = &bytes[n..];
            if self.head.len() < HEAD {
                break;
            }
            let known: &[&[u8]] = if self.first { &[b"HEL"] } else { &[b"OPN", b"MSG", b"CLO"] };
            let size = u32::from_le_bytes([self.head[4], self.head[5], self.head[6], self.head[7]]) as usize;
            if !known.contains(&&self.head[..3]) || !matches!(self.head[3], b'F' | b'C' | b'A') {
                return Err("no message of OPC UA");
            }
            if !(HEAD..=MOST_BYTES).contains(&size) {
                return Err("a message of a size that none has");
            }
            (self.left, self.first, begun) = (size - HEAD, false, begun + 1);
            self.head.clear();
        }
        Ok(begun)
    }
}

/// The pace of one connection.
struct Pace {
    left: f64,
    at: Instant,
}

impl Pace {
    /// Counts messages; how long they have to wait.
    fn messages(&mut self, count: usize, now: Instant) -> Duration {
        let passed = now.saturating_duration_since(self.at).as_secs_f64();
        (self.left, self.at) = ((self.left + passed * A_SECOND).min(AT_ONCE) - count as f64, now);
        Duration::from_secs_f64((-self.left).max(0.0) / A_SECOND)
    }
}

/// Who is connected.
#[derive(Clone, Default)]
struct Open(Arc<Mutex<HashMap<IpAddr, usize>>>);

/// The place of a connection, until it is dropped.
struct Place(Open, IpAddr);

impl Open {
    fn admit(&self, from: IpAddr) -> Option<Place> {
        let mut open = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if open.values().sum::<usize>() >= MOST || open.get(&from).is_some_and(|n| *n >= MOST_OF_ONE) {
            return None;
        }
        *open.entry(from).or_default() += 1;
        Some(Place(self.clone(), from))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut open = self.0.0.lock().unwrap_or_else(PoisonError::into_inner);
        match open.get_mut(&self.1) {
            Some(n) if *n > 1 => *n -= 1,
            _ => {
                open.remove(&self.1);
            }
        }
    }
}

/// An error message of the protocol: Bad_TcpNotEnoughResources with a reason.
fn refusal() -> Vec<u8> {
    let reason = format!("{MOST} connections are open, or {MOST_OF_ONE} of this machine");
    let size = (HEAD + 8 + reason.len()) as u32;
    let code = 0x8081_0000u32;
    let parts: [&[u8]; 5] =
        [b"ERRF", &size.to_le_bytes(), &code.to_le_bytes(), &(reason.len() as u32).to_le_bytes(), reason.as_bytes()];
    parts.concat()
}

/// Serves for ever.
pub async fn serve(public: TcpListener, server: SocketAddr) {
    let open = Open::default();
    loop {
        // An error is one client's: it closed its connection before it was accepted, or no file is free.
        let Ok((client, from)) = public.accept().await else {
            tokio::time::sleep(REFUSED).await;
            continue;
        };
        let Some(place) = open.admit(from.ip()) else {
            let _ = client.try_write(&refusal());
            tokio::time::sleep(REFUSED).await;
            continue;
        };
        tokio::spawn(async move {
            // The end of either side ends both; there is nobody to tell.
            let _ = between(client, server).await;
            drop(place);
        });
    }
}

/// Carries the bytes of one connection. Nothing is read from a client that does not take what it was sent: so the
/// server's answers to it do not heap up.
async fn between(mut client: TcpStream, server: SocketAddr) -> std::io::Result<()> {
    let mut server = TcpStream::connect(server).await?;
    client.set_nodelay(true)?;
    server.set_nodelay(true)?;
    let ((mut from_client, mut to_client), (mut from_server, mut to_server)) = (client.split(), server.split());
    let (mut up, mut down) = (Vec::<u8>::new(), Vec::<u8>::new());
    let (mut a, mut b) = (vec![0; 16 * 1024], vec![0; 16 * 1024]);
    let mut messages = Messages::new();
    let mut pace = Pace { left: AT_ONCE, at: Instant::now() };
    let (mut patience, mut heard) = (HELLO, tokio::time::Instant::now());
    let (mut ended, mut passed_on) = (false, false);
    loop {
        if ended && up.is_empty() && !passed_on {
            // The client sends no more and may still read.
            to_server.shutdown().await?;
            (passed_on, patience) = (true, HELLO);
        }
        tokio::select! {
            () = tokio::time::sleep_until(heard + patience) => return Ok(()),
            n = from_client.read(&mut a), if !ended && up.is_empty() && down.is_empty() => {
                let n = n?;
                ended = n == 0;
                let Ok(begun) = messages.follow(&a[..n]) else { return Ok(()) };
                if begun > 0 {
                    (patience, heard) = (SILENT, tokio::time::Instant::now());
                }
                up.extend_from_slice(&a[..n]);
                tokio::time::sleep(pace.messages(begun, Instant::now())).await;
            }
            n = from_server.read(&mut b), if down.is_empty() => {
                let n = n?;
                if n == 0 {
                    return Ok(());
                }
                down.extend_from_slice(&b[..n]);
            }
            n = to_server.write(&up), if !up.is_empty() => {
                up.drain(..n?);
            }
            n = to_client.write(&down), if !down.is_empty() => {
                down.drain(..n?);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(kind: &[u8; 4], body: usize) -> Vec<u8> {
        [&kind[..], &((HEAD + body) as u32).to_le_bytes(), &vec![7; body]].concat()
    }

    #[test]
    fn messages_are_followed_however_they_are_cut() {
        let all = [message(b"HELF", 30), message(b"OPNF", 0), message(b"MSGC", 1), message(b"MSGF", 500)].concat();
        for size in [1, 2, 7, 8, 9, 37, 1000] {
            let mut messages = Messages::new();
            let begun: usize = all.chunks(size).map(|part| messages.follow(part).unwrap()).sum();
            assert_eq!(begun, 4, "{size}");
        }
    }

    #[test]
    fn foreign_bytes_end_the_connection() {
        for foreign in [&b"GET / HTTP/1.1\r\n"[..], &message(b"MSGF", 3), &message(b"HELX", 3), b"HELF\0\0\0\0"] {
            assert!(Messages::new().follow(foreign).is_err(), "{foreign:?}");
        }
        let mut messages = Messages::new();
        messages.follow(&message(b"HELF", 30)).unwrap();
        assert!(messages.follow(&message(b"HELF", 30)).is_err(), "a second hello");
        assert!(messages.follow(b"MSGF\xff\xff\xff\x7f").is_err());
    }

    #[test]
    fn one_machine_leaves_places_for_others_and_a_flood_waits() {
        let (open, of) = (Open::default(), |machine: u8| IpAddr::from([10, 0, 0, machine]));
        let mut first: Vec<_> = (0..10).filter_map(|_| open.admit(of(1))).collect();
        let second: Vec<_> = (0..10).filter_map(|_| open.admit(of(2))).collect();
        assert_eq!((first.len(), second.len()), (MOST_OF_ONE, MOST - MOST_OF_ONE));
        assert!(open.admit(of(3)).is_none());
        first.pop();
        assert!(open.admit(of(3)).is_some() && open.admit(of(1)).is_some());
        drop((first, second));
        assert!(open.0.lock().unwrap().is_empty());
        let begun = Instant::now();
        let mut pace = Pace { left: AT_ONCE, at: begun };
        let mut now = begun;
        for _ in 0..900 {
            now += pace.messages(1, now);
        }
        assert!((now - begun).as_secs_f64() > 1.9, "{:?}", now - begun);
    }

    #[test]
    fn a_refusal_is_a_message_of_the_protocol() {
        let said = refusal();
        assert_eq!(
            (&said[..4], u32::from_le_bytes(said[4..8].try_into().unwrap()) as usize),
            (&b"ERRF"[..], said.len())
        );
    }
}
