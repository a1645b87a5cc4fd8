//! In: a station's address. Out: its registers, read and written over Modbus TCP [modbus, MODBUS Application Protocol
//! V1.1b3: functions 4 and 16]. One request at a time; an answer to another request ends the connection.
//! Frame and unit: registers; s.

use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// A station on the same network answers within milliseconds; a busy processor may delay it.
const PATIENCE: Duration = Duration::from_secs(5);
/// Bytes before those that the header's length counts.
const HEAD: usize = 6;

/// Why registers were not read or written.
#[derive(Debug)]
pub enum Trouble {
    /// The connection is of no use any more.
    Lost(String),
    /// The station answered with this exception.
    Exception(u8),
}

/// A connection to a station.
pub struct Wire {
    stream: TcpStream,
    transaction: u16,
}

fn lost(e: &std::io::Error) -> Trouble {
    Trouble::Lost(match e.kind() {
        std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut => {
            format!("no answer within {} s", PATIENCE.as_secs())
        }
        std::io::ErrorKind::UnexpectedEof => "it closed the connection".into(),
        _ => e.to_string(),
    })
}

impl Wire {
    /// Connects to HOST:PORT.
    ///
    /// # Errors
    /// There is no such host, or nothing listens there.
    pub fn open(station: &str) -> Result<Wire, Trouble> {
        let mut last = Trouble::Lost(format!("the name {station} has no address"));
        for address in station.to_socket_addrs().map_err(|e| lost(&e))? {
            match TcpStream::connect_timeout(&address, PATIENCE) {
                Ok(stream) => {
                    let ready = stream.set_nodelay(true).and_then(|()| stream.set_read_timeout(Some(PATIENCE)));
                    ready.and_then(|()| stream.set_write_timeout(Some(PATIENCE))).map_err(|e| lost(&e))?;
                    return Ok(Wire { stream, transaction: 0 });
                }
                Err(e) => last = lost(&e),
            }
        }
        Err(last)
    }

    /// Sends a request; returns the answer after its function code.
    fn ask(&mut self, pdu: &[u8]) -> Result<Vec<u8>, Trouble> {
        self.transaction = self.transaction.wrapping_add(1);
        let number = self.transaction.to_be_bytes();
        let length = (pdu.len() as u16 + 1).to_be_bytes();
        let frame = [&number[..], &[0, 0], &length, &[1], pdu].concat();
        self.stream.write_all(&frame).map_err(|e| lost(&e))?;
        let mut head = [0; HEAD + 2];
        self.stream.read_exact(&mut head).map_err(|e| lost(&e))?;
        let length = usize::from(u16::from_be_bytes([head[4], head[5]]));
        if head[..2] != number || head[2..4] != [0, 0] || !(3..=254).contains(&length) || head[7] & 0x7f != pdu[0] {
            return Err(Trouble::Lost("what answers there does not speak Modbus TCP".into()));
        }
        let mut rest = vec![0; length - 2];
        self.stream.read_exact(&mut rest).map_err(|e| lost(&e))?;
        if head[7] & 0x80 != 0 { Err(Trouble::Exception(rest[0])) } else { Ok(rest) }
    }

    /// Reads input registers.
    ///
    /// # Errors
    /// The connection is lost, or there are no such registers.
    pub fn read(&mut self, (at, count): (u16, u16)) -> Result<Vec<u16>, Trouble> {
        let ([a, b], [c, d]) = (at.to_be_bytes(), count.to_be_bytes());
        let answer = self.ask(&[4, a, b, c, d])?;
        let registers: Vec<u16> = answer[1..].chunks_exact(2).map(|w| u16::from_be_bytes([w[0], w[1]])).collect();
        match registers.len() == usize::from(count) {
            true => Ok(registers),
            false => Err(Trouble::Lost(format!("{count} registers were asked for, {} came", registers.len()))),
        }
    }

    /// Writes holding registers from 0 on.
    ///
    /// # Errors
    /// The connection is lost, or the station refuses to take them.
    pub fn write(&mut self, registers: &[u16]) -> Result<(), Trouble> {
        let count = (registers.len() as u16).to_be_bytes();
        let bytes = registers.iter().flat_map(|r| r.to_be_bytes());
        let pdu: Vec<u8> = [16, 0, 0, count[0], count[1], 2 * registers.len() as u8].into_iter().chain(bytes).collect();
        self.ask(&pdu).map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    /// A station that answers with these bytes after the transaction's number.
    fn answers(with: &'static [u8]) -> Wire {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            let mut asked = [0; 12];
            stream.read_exact(&mut asked).unwrap();
            stream.write_all(&[&asked[..2], with].concat()).unwrap();
        });
        Wire::open(&address).unwrap()
    }

    #[test]
    fn registers_are_read_and_exceptions_are_not_the_end() {
        let read = answers(&[0, 0, 0, 7, 1, 4, 4, 1, 2, 3, 4]).read((0, 2));
        assert_eq!(read.unwrap(), [0x0102, 0x0304]);
        assert!(matches!(answers(&[0, 0, 0, 3, 1, 0x84, 2]).read((0, 2)), Err(Trouble::Exception(2))));
    }

    #[test]
    fn what_is_no_answer_ends_the_connection() {
        for foreign in [
            &b"HTTP/1.1 400 Bad Request\r\n\r\n"[..],
            &[0, 0, 0, 7, 1, 3, 4, 1, 2, 3, 4],
            &[0, 0, 0, 5, 1, 4, 2, 1, 2],
            &[0, 0, 255, 255, 1, 4, 2, 1, 2],
            &[0, 0, 0, 7, 1, 4],
        ] {
            assert!(matches!(answers(foreign).read((0, 2)), Err(Trouble::Lost(_))), "{foreign:?}");
        }
    }
}
