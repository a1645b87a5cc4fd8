//! Limits the rate of password tries: tries of one machine are made one after the other, without delaying those of
//! other machines.

use super::password::verify;
use sheetlight::fault::{Fault, Result};
use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::oneshot;

/// Time between two tries of one machine; a wrong try is answered no sooner than this.
const SLOWLY: Duration = Duration::from_millis(700);
/// A try that would have to wait longer than this is rejected.
const LONGEST: Duration = Duration::from_millis(2100);
/// Most machines whose tries are counted at a time.
const MACHINES: usize = 1024;
/// Most passwords that wait for the one hashing thread; a hash takes about 30 ms and 19 MiB.
const WAITING: usize = 32;

struct Try {
    password: String,
    known: oneshot::Sender<Result<bool>>,
}

/// Checks passwords at a limited rate.
pub struct Tries {
    /// Earliest start of each machine's next try.
    next: Mutex<HashMap<IpAddr, Instant>>,
    hashing: SyncSender<Try>,
}

/// Result of a try.
#[derive(Debug)]
pub enum Tried {
    /// The password is right.
    Right,
    /// The password is wrong.
    Wrong,
    /// Too many tries: another one may be made after this time.
    TooMany(Duration),
}

impl Tries {
    /// Checks tries against this hash, on a separate thread.
    ///
    /// # Errors
    /// No thread can be started.
    pub fn against(hash: String) -> Result<Tries> {
        let (hashing, asked) = sync_channel(WAITING);
        let work = move || hash_each(&asked, &hash);
        std::thread::Builder::new().name("passwords".into()).spawn(work).map_err(|e| Fault::threads(&e))?;
        Ok(Tries { next: Mutex::default(), hashing })
    }

    /// Checks one password; `from` is the machine that sends it.
    ///
    /// # Errors
    /// The hash is invalid, or the thread panicked.
    pub async fn one(&self, from: IpAddr, password: String) -> Result<Tried> {
        let wait = match self.book(from, Instant::now()) {
            Ok(wait) => wait,
            Err(after) => return Ok(Tried::TooMany(after)),
        };
        tokio::time::sleep(wait).await;
        let begun = Instant::now();
        let (known, answer) = oneshot::channel();
        if self.hashing.try_send(Try { password, known }).is_err() {
            return Ok(Tried::TooMany(SLOWLY));
        }
        let tried = answer.await.unwrap_or_else(|_| {
            Err(Fault::device("the password could not be tried").next("start the server again and report this"))
        });
        if tried? {
            self.next.lock().unwrap_or_else(PoisonError::into_inner).remove(&from);
            return Ok(Tried::Right);
        }
        tokio::time::sleep(SLOWLY.saturating_sub(begun.elapsed())).await;
        Ok(Tried::Wrong)
    }

    /// How long a machine's try must wait. The time is reserved, so a client that disconnects before its answer
    /// gains nothing. If the wait would be too long, the error is the time after which to try again.
    fn book(&self, from: IpAddr, now: Instant) -> std::result::Result<Duration, Duration> {
        let mut next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
        let wait = next.get(&from).map_or(Duration::ZERO, |free| free.saturating_duration_since(now));
        if wait > LONGEST {
            return Err(wait - LONGEST);
        }
        if next.len() >= MACHINES {
            next.retain(|_, free| *free > now);
        }
        if next.len() >= MACHINES && !next.contains_key(&from) {
            return Err(SLOWLY);
        }
        next.insert(from, now + wait + SLOWLY);
        Ok(wait)
    }
}

/// Hashes until all senders are gone.
fn hash_each(asked: &Receiver<Try>, hash: &str) {
    for Try { password, known } in asked {
        // The client may have disconnected.
        let _ = known.send(verify(&password, hash));
    }
}

#[cfg(test)]
mod tests {
    use super::super::password::hashed;
    use super::*;

    fn ip(k: u8) -> IpAddr {
        IpAddr::from([10, 0, 0, k])
    }

    #[test]
    fn a_machine_waits_for_its_own_tries_alone_and_not_for_ever() {
        let tries = Tries::against(String::new()).unwrap();
        let now = Instant::now();
        let waits: Vec<_> = (0..6).map(|_| tries.book(ip(1), now)).collect();
        assert_eq!(waits[..4], [0, 1, 2, 3].map(|k| Ok(SLOWLY * k)));
        assert_eq!(waits[4..], [Err(SLOWLY); 2], "what is refused books nothing");
        assert_eq!(tries.book(ip(2), now), Ok(Duration::ZERO), "another machine waits for none of them");
        assert_eq!(tries.book(ip(1), now + SLOWLY), Ok(LONGEST), "and this one as soon as one of them is over");
    }

    #[test]
    fn machines_are_counted_up_to_a_bound() {
        let tries = Tries::against(String::new()).unwrap();
        let now = Instant::now();
        for k in 0..MACHINES as u32 {
            assert_eq!(tries.book(IpAddr::from(k.to_be_bytes()), now), Ok(Duration::ZERO));
        }
        assert_eq!(tries.book(ip(1), now), Err(SLOWLY));
        assert_eq!(tries.book(ip(1), now + SLOWLY), Ok(Duration::ZERO), "they are forgotten when their time is over");
    }

    /// One machine sends wrong passwords without end and disconnects before the answers: the right one of another
    /// machine does not wait for them.
    #[test]
    fn wrong_passwords_keep_no_other_machine_waiting() {
        const WRONG: u32 = 50;
        let tries = Tries::against(hashed("correct horse battery").unwrap()).unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        runtime.block_on(async {
            for _ in 0..WRONG {
                let one = tries.one(ip(1), "wrong horse battery".into());
                let _ = tokio::time::timeout(Duration::from_millis(1), one).await;
            }
            assert!(matches!(tries.one(ip(1), "correct horse battery".into()).await, Ok(Tried::TooMany(_))));
            let begun = Instant::now();
            assert!(matches!(tries.one(ip(2), "correct horse battery".into()).await, Ok(Tried::Right)));
            // One after the other, the wrong tries would take this long; a right one takes as long as a hash.
            println!("the right password was known after {:?}", begun.elapsed());
            assert!(begun.elapsed() < SLOWLY * WRONG / 2, "{:?}", begun.elapsed());
            let begun = Instant::now();
            assert!(matches!(tries.one(ip(2), "wrong horse battery".into()).await, Ok(Tried::Wrong)));
            assert!(begun.elapsed() >= SLOWLY, "wrong ones are answered slowly");
        });
    }
}
