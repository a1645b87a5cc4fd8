//! In: the wish to stop. Out: Halt over a connection of its own, which no motion blocks and which does not hold the arm.
//! Frame and unit: times in ms.

use super::super::Halt;
use super::session::Session;
use crate::bcap::{Call, ClientOptions, Variant};
use crate::fault::Result;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// A controller that has not taken a Halt by then gets it again over a new connection.
const PATIENCE: Duration = Duration::from_millis(500);

/// Halts a Denso arm. TCP: over UDP Denso's service answers a Halt after the motion.
pub struct DensoHalt {
    address: String,
    session: Mutex<Option<Session>>,
}

impl DensoHalt {
    pub fn open(address: &str) -> Result<DensoHalt> {
        Ok(DensoHalt { address: address.to_owned(), session: Mutex::new(Some(DensoHalt::connect(address)?)) })
    }

    fn connect(address: &str) -> Result<Session> {
        Session::with(address, ClientOptions { patience: PATIENCE, watchdog_ms: None, ..ClientOptions::default() })
    }

    fn send(session: &mut Session) -> Result<()> {
        let robot = session.robot.into();
        session.client.ask(Call::RobotHalt, vec![robot, Variant::Text(String::new())]).map(|_| ())
    }
}

impl Halt for DensoHalt {
    fn halt(&self) -> Result<()> {
        let mut held = self.session.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(session) = held.as_mut()
            && DensoHalt::send(session).is_ok()
        {
            return Ok(());
        }
        *held = None;
        let mut fresh = DensoHalt::connect(&self.address)?;
        DensoHalt::send(&mut fresh)?;
        *held = Some(fresh);
        Ok(())
    }
}
