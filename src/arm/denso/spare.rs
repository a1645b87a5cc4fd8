//! A second connection to a Denso controller besides the one that moves; a request that fails is repeated over a
//! new one.

use super::session::Session;
use crate::arm::Switch;
use crate::bcap::{Call, ClientOptions, Variant};
use crate::fault::Result;
use std::time::Duration;

/// A controller that has not answered within this time is asked again over a new connection.
const PATIENCE: Duration = Duration::from_millis(500);

/// Such a connection, over TCP: over UDP Denso's service answers calls one after the other, and would answer these
/// only after a motion.
pub struct Spare {
    address: String,
    session: Option<Session>,
}

impl Spare {
    pub fn open(address: &str) -> Result<Spare> {
        Ok(Spare { address: address.to_owned(), session: Some(connect(address)?) })
    }

    /// Asks; the request must be safe to execute twice.
    pub fn ask<T>(&mut self, question: impl Fn(&mut Session) -> Result<T>) -> Result<T> {
        if let Some(session) = self.session.as_mut()
            && let Ok(answer) = question(session)
        {
            return Ok(answer);
        }
        self.session = None;
        let mut fresh = connect(&self.address)?;
        let answer = question(&mut fresh)?;
        self.session = Some(fresh);
        Ok(answer)
    }
}

fn connect(address: &str) -> Result<Session> {
    Session::with(address, ClientOptions { patience: PATIENCE, watchdog_ms: None, ..ClientOptions::default() })
}

impl Switch for Spare {
    fn put(&mut self, number: u16, on: bool) -> Result<()> {
        let name = format!("IO{number}");
        self.ask(|s| s.client.write(Call::ControllerGetVariable, s.controller, &name, Variant::Bool(on)))
    }

    fn is_on(&mut self, number: u16) -> Result<bool> {
        self.ask(|s| s.signal(number))
    }
}
