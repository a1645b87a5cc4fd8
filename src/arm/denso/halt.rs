//! In: a request to stop. Out: Halt over a separate connection, which no motion blocks and which does not hold the
//! arm.
//! Frame and unit: none.

use super::spare::Spare;
use crate::arm::Halt;
use crate::bcap::{Call, Variant};
use crate::fault::Result;
use std::sync::{Mutex, PoisonError};

/// Halts a Denso arm.
pub struct DensoHalt(Mutex<Spare>);

impl DensoHalt {
    pub fn open(address: &str) -> Result<DensoHalt> {
        Ok(DensoHalt(Mutex::new(Spare::open(address)?)))
    }
}

impl Halt for DensoHalt {
    fn halt(&self) -> Result<()> {
        let mut spare = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        spare.ask(|s| {
            let robot = s.robot.into();
            s.client.ask(Call::RobotHalt, vec![robot, Variant::Text(String::new())]).map(|_| ())
        })
    }
}
