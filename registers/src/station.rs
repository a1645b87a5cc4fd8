//! In: a station's address, requests. Out: their answers, and what the station shows, read again and again on a thread
//! of its own. A lost station is tried again; a request is never sent twice.
//! Frame and unit: s.

use crate::modbus::{Trouble, Wire};
use crate::table::{self, ANSWERS, Answer, Ask, JOBS, MADE, Seen, TABLE, WORDS};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::Builder;
use std::time::{Duration, Instant};
use tokio::sync::oneshot;

/// Five reads each time at most: half of what a station answers without delay.
const LOOK: Duration = Duration::from_millis(50);
/// Pause before a lost station is tried again.
const AGAIN: Duration = Duration::from_secs(1);
/// Pause between two looks for an answer.
const SOON: Duration = Duration::from_millis(15);
/// A search takes a minute on a slow processor.
const ANSWERED: Duration = Duration::from_secs(120);
/// Most requests that wait: each client has one at a time.
const MOST: usize = 16;

/// Exceptions of the registers.
const NO_SUCH: u8 = 2;
const BUSY: u8 = 6;

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Unanswered {
    /// The station was not reached; nothing was asked.
    NotReached(String),
    /// The request was sent and its answer is lost: whether it was executed is unknown.
    Lost(String),
    /// Another machine makes the requests, or too many wait.
    Busy(String),
    /// The station refuses registers that it should have, or has not those of this request.
    Refused(String),
}

type Reply = oneshot::Sender<Result<Answer, Unanswered>>;

/// A station as requests see it.
#[derive(Clone)]
pub struct Station(SyncSender<(Ask, Reply)>);

impl Station {
    /// Begins to talk to a station; `told` gets what it shows, or why it is not reached.
    ///
    /// # Errors
    /// The system has no thread left.
    pub fn begin(address: String, told: impl FnMut(Result<Seen, String>) + Send + 'static) -> std::io::Result<Station> {
        let (asked, asks) = sync_channel(MOST);
        Builder::new().name("station".into()).spawn(move || talks(&address, &asks, told))?;
        Ok(Station(asked))
    }

    /// Asks the station.
    ///
    /// # Errors
    /// There is no answer.
    pub async fn ask(&self, ask: Ask) -> Result<Answer, Unanswered> {
        self.send(ask)?.await.unwrap_or_else(|_| Err(ends()))
    }

    /// Asks the station, and waits on this thread, which serves no asynchronous tasks.
    ///
    /// # Errors
    /// There is no answer.
    pub fn ask_here(&self, ask: Ask) -> Result<Answer, Unanswered> {
        self.send(ask)?.blocking_recv().unwrap_or_else(|_| Err(ends()))
    }

    fn send(&self, ask: Ask) -> Result<oneshot::Receiver<Result<Answer, Unanswered>>, Unanswered> {
        let (reply, answer) = oneshot::channel();
        match self.0.try_send((ask, reply)) {
            Ok(()) => Ok(answer),
            Err(TrySendError::Full(_)) => Err(Unanswered::Busy(format!("{MOST} requests wait"))),
            Err(TrySendError::Disconnected(_)) => Err(Unanswered::NotReached("the program ends".into())),
        }
    }
}

/// The program ends while an answer is waited for.
fn ends() -> Unanswered {
    Unanswered::Lost("the program ends".into())
}

/// A connection that has shown the table.
struct Talk {
    wire: Wire,
    /// The station runs jobs.
    jobs: bool,
    /// It has the registers of scans and calibrations.
    makes: bool,
}

impl Talk {
    fn open(address: &str) -> Result<Talk, String> {
        let words = |trouble| match trouble {
            Trouble::Lost(why) => why,
            Trouble::Exception(code) => format!("exception {code}: it has other registers"),
        };
        let mut wire = Wire::open(address).map_err(words)?;
        let table = wire.read((0, 1)).map_err(words)?[0];
        if table != TABLE {
            return Err(format!("its registers are of table {table}, this program knows table {TABLE}"));
        }
        let mut has = |registers| match wire.read(registers) {
            Ok(_) => Ok(true),
            Err(Trouble::Exception(NO_SUCH)) => Ok(false),
            Err(trouble) => Err(words(trouble)),
        };
        let (jobs, makes) = (has(JOBS)?, has(MADE)?);
        Ok(Talk { wire, jobs, makes })
    }

    /// What the station shows; the registers of answers beside it.
    fn look(&mut self) -> Result<(Seen, Vec<u16>), String> {
        let read = |wire: &mut Wire, which| match wire.read(which) {
            Ok(registers) => Ok(registers),
            Err(Trouble::Lost(why)) => Err(why),
            Err(Trouble::Exception(code)) => Err(format!("exception {code} where registers were read before")),
        };
        let answers = read(&mut self.wire, ANSWERS)?;
        if !self.jobs {
            return Ok((Seen::default(), answers));
        }
        // What is read beside the job is of that job only if it is the same before and after.
        loop {
            let jobs = read(&mut self.wire, JOBS)?;
            let words = if jobs[7] == 0 { vec![] } else { read(&mut self.wire, WORDS)? };
            let made = if self.makes && table::makes(&jobs) { read(&mut self.wire, MADE)? } else { vec![] };
            let alone = words.is_empty() && made.is_empty();
            if alone || read(&mut self.wire, JOBS)?[4..8] == jobs[4..8] {
                return Ok((table::seen(&answers, &jobs, &words, &made), answers));
            }
        }
    }

    /// Makes a request and waits for its answer; `told` gets what is shown meanwhile.
    fn ask(
        &mut self,
        ask: &Ask,
        told: &mut impl FnMut(Result<Seen, String>),
    ) -> Result<Result<Answer, Unanswered>, String> {
        if self.jobs && !self.makes && ask.makes() {
            let what = "the program of this station is older: it has no registers for scans and calibrations";
            return Ok(Err(Unanswered::Refused(what.into())));
        }
        let begun = Instant::now();
        let (_, before) = self.look()?;
        let number = before[3].checked_add(1).unwrap_or(1);
        let registers: Vec<u16> = std::iter::once(number).chain(ask.registers()).collect();
        match self.wire.write(&registers) {
            Ok(()) => {}
            Err(Trouble::Exception(BUSY)) => {
                return Ok(Err(Unanswered::Busy("another machine makes the station's requests".into())));
            }
            // Another request came between the look and this one.
            Err(Trouble::Exception(code)) => {
                return Ok(Err(Unanswered::Refused(format!("the station refused the registers: exception {code}"))));
            }
            Err(Trouble::Lost(why)) => return Err(why),
        }
        loop {
            let (seen, answers) = self.look()?;
            if answers[2] == 0 && answers[3] == number {
                let answer = table::answer(&answers);
                told(Ok(seen));
                return Ok(Ok(answer));
            }
            told(Ok(seen));
            if begun.elapsed() > ANSWERED {
                return Err(format!("no answer to a request within {} s", ANSWERED.as_secs()));
            }
            std::thread::sleep(SOON);
        }
    }
}

/// Talks to the station until nobody asks any more.
fn talks(address: &str, asks: &Receiver<(Ask, Reply)>, mut told: impl FnMut(Result<Seen, String>)) {
    loop {
        match Talk::open(address) {
            Ok(mut talk) => match follows(&mut talk, asks, &mut told) {
                Some(why) => told(Err(why)),
                None => return,
            },
            Err(why) => told(Err(why)),
        }
        // What is asked of a station that is not reached is refused at once.
        let end = Instant::now() + AGAIN;
        loop {
            match asks.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok((_, reply)) => {
                    let _ = reply.send(Err(Unanswered::NotReached(format!("the station {address} is not reached"))));
                }
                Err(RecvTimeoutError::Timeout) => break,
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }
}

/// Follows a connected station; returns why it is lost, or nothing if the program ends.
fn follows(
    talk: &mut Talk,
    asks: &Receiver<(Ask, Reply)>,
    told: &mut impl FnMut(Result<Seen, String>),
) -> Option<String> {
    loop {
        match talk.look() {
            Ok((seen, _)) => told(Ok(seen)),
            Err(why) => return Some(why),
        }
        match asks.recv_timeout(LOOK) {
            Ok((ask, reply)) => match talk.ask(&ask, told) {
                Ok(said) => {
                    let _ = reply.send(said);
                }
                Err(why) => {
                    let _ = reply.send(Err(Unanswered::Lost(why.clone())));
                    return Some(why);
                }
            },
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Target;
    use std::io::{Read, Write};
    use std::net::{TcpListener, TcpStream};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

    /// Answers reads as a station does that has `count` registers; counts a request and drops the connection instead of
    /// answering it.
    fn serves(mut stream: TcpStream, requests: &AtomicUsize, count: u16) -> std::io::Result<()> {
        loop {
            let mut head = [0; 8];
            stream.read_exact(&mut head)?;
            let mut rest = vec![0; usize::from(head[5]) - 2];
            stream.read_exact(&mut rest)?;
            if head[7] != 4 {
                requests.fetch_add(1, SeqCst);
                return Ok(());
            }
            let [at, asked] = [0, 2].map(|k| u16::from_be_bytes([rest[k], rest[k + 1]]));
            let pdu = if at + asked > count {
                vec![0x84, NO_SUCH]
            } else {
                let mut registers = vec![0; 2 * usize::from(asked)];
                if at == 0 {
                    registers[1] = TABLE as u8;
                }
                [vec![4, 2 * asked as u8], registers].concat()
            };
            stream.write_all(&[&head[..4], &[0, pdu.len() as u8 + 1, head[6]], &pdu].concat())?;
        }
    }

    #[tokio::test]
    async fn a_request_whose_answer_is_lost_is_not_sent_again() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let (requests, connections) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
        let counts = (requests.clone(), connections.clone());
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                counts.1.fetch_add(1, SeqCst);
                // The client ends the connection.
                let _ = serves(stream.unwrap(), &counts.0, 121);
            }
        });
        let (tell, mut told) = tokio::sync::mpsc::unbounded_channel();
        let tells = move |what: Result<Seen, String>| {
            let _ = tell.send(what.is_ok());
        };
        let station = Station::begin(address, tells).unwrap();
        assert_eq!(told.recv().await, Some(true));
        assert!(matches!(station.ask(Ask::Scan(None)).await, Err(Unanswered::Lost(_))));
        // Lost, and back.
        while told.recv().await == Some(true) {}
        while told.recv().await == Some(false) {}
        assert_eq!(told.recv().await, Some(true));
        assert_eq!((requests.load(SeqCst), connections.load(SeqCst)), (1, 2));
    }

    /// An older program of a station refuses SCAN and has no registers behind the error's words. Nothing is sent to it.
    #[tokio::test]
    async fn a_station_without_registers_for_scans_is_not_asked_for_one() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let requests = Arc::new(AtomicUsize::new(0));
        let counted = requests.clone();
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                let _ = serves(stream.unwrap(), &counted, 255);
            }
        });
        let (tell, mut told) = tokio::sync::mpsc::unbounded_channel();
        let station = Station::begin(address, move |seen| drop(tell.send(seen.map(|s| s.jobs)))).unwrap();
        assert_eq!(told.recv().await, Some(Ok(true)));
        for ask in [Ask::Scan(None), Ask::Calibrate(Target::Camera, Some("a".into()))] {
            let Err(Unanswered::Refused(why)) = station.ask(ask).await else { panic!("it was asked") };
            assert!(why.contains("is older"), "{why}");
        }
        assert_eq!(requests.load(SeqCst), 0);
        assert!(matches!(station.ask(Ask::Stop).await, Err(Unanswered::Lost(_))));
        assert_eq!(requests.load(SeqCst), 1);
    }
}
