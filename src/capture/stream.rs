//! In: a feed, a way to pair. Out: shots in order, each with the position of what moves; a list of excluded
//! pictures; the account.
//! Frame and unit: as [`super::pair`].

use super::account::Account;
use super::feed::{Fate, Fed, Feed};
use super::format::{Format, Pictures};
use super::pair::{LeftOut, Paired, Pairer, PoseFeed, Way};
use crate::fault::Fault;
use std::time::{Duration, Instant};

/// Result of waiting for a shot.
#[derive(Debug)]
pub enum Streamed {
    /// The next shot. What becomes of it must be reported with [`Stream::fate`].
    Shot(Box<Paired>),
    /// The time has passed and nothing arrived.
    Quiet,
    /// Nothing will arrive any more; with the reason, unless the end was requested.
    Ended(Option<Fault>),
}

/// Most excluded pictures that are listed individually; further ones are only counted.
const LISTED: usize = 10_000;
/// Sleep interval while pictures wait for a pose.
const GLANCE: Duration = Duration::from_millis(4);

/// Pictures paired with what moves.
pub struct Stream {
    feed: Feed,
    pairer: Pairer,
    left_out: Vec<LeftOut>,
    ended: Option<Option<Fault>>,
}

impl Stream {
    /// Pairs a feed's pictures.
    pub fn new(feed: Feed, way: Way) -> Stream {
        Stream { feed, pairer: Pairer::new(way), left_out: Vec::new(), ended: None }
    }

    /// Size and depth of all pictures.
    pub fn format(&self) -> Format {
        self.feed.format()
    }

    /// Format of all pictures, and how they are read from the sensor.
    pub fn pictures(&self) -> Pictures {
        self.feed.pictures()
    }

    /// The source, with what is known about it.
    pub fn feed(&self) -> &Feed {
        &self.feed
    }

    /// Pictures that were excluded because their position is unknown, with the reason.
    pub fn left_out(&self) -> &[LeftOut] {
        &self.left_out
    }

    /// Notes what became of a shot.
    pub fn fate(&self, fate: Fate) {
        self.feed.fate(fate);
    }

    /// The account so far.
    pub fn account(&self) -> Account {
        self.feed.account()
    }

    /// Messages since the last call.
    pub fn news(&mut self) -> Vec<String> {
        let poses = self.pairer.poses().map(PoseFeed::news).unwrap_or_default();
        self.feed.news().into_iter().chain(poses).chain(self.pairer.news()).collect()
    }

    /// The next shot, waiting for at most `within`.
    pub fn next(&mut self, within: Duration) -> Streamed {
        let until = Instant::now() + within;
        loop {
            if let Some(fault) = self.pairer.poses().and_then(PoseFeed::fault) {
                self.feed.stop();
                self.ended.get_or_insert(Some(fault));
            }
            let clock = self.feed.clock();
            match self.pairer.next(&clock, self.ended.is_some()) {
                Some(Ok(paired)) => return Streamed::Shot(Box::new(paired)),
                Some(Err(left)) => {
                    self.feed.fate(Fate::Unpaired);
                    if self.left_out.len() < LISTED {
                        self.left_out.push(left);
                    }
                    continue;
                }
                None => {}
            }
            if let Some(fault) = &self.ended {
                return Streamed::Ended(fault.clone());
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Streamed::Quiet;
            }
            // An awaited pose may arrive before the next picture does.
            let wait = if self.pairer.waiting() > 0 { left.min(GLANCE) } else { left };
            match self.feed.next(wait) {
                Fed::Picture(picture, numbering) => self.pairer.push(picture, numbering),
                Fed::Quiet => {}
                Fed::Ended(fault) => self.ending(fault),
            }
        }
    }

    /// The last pictures wait a short time for the pose after them.
    fn ending(&mut self, fault: Option<Fault>) {
        let until = Instant::now() + Duration::from_millis(300);
        while self.pairer.waiting() > 0 && self.pairer.poses().is_some() && Instant::now() < until {
            let newest = self.pairer.poses().and_then(PoseFeed::newest);
            std::thread::sleep(GLANCE);
            if newest.is_some_and(|n| n > super::clock::now_ns() - 1_000_000) {
                break;
            }
        }
        self.ended = Some(fault);
    }
}
