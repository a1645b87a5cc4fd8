//! In: nothing. Out: what stands behind the registers of a Modbus server: a scan by a robot's own motions, or a
//! station that runs jobs.
//! Frame and unit: poses in its notation.

use super::peers::Traffic;
use super::shown::Shown;
use super::words::{Reply, Request, Wrong};
use crate::robot::Convention;

/// Executes requests, and knows what the registers show.
pub trait Executor {
    /// Notation of all poses.
    fn notation(&self) -> Convention;
    /// Whether it runs jobs: the table then has their registers.
    fn jobs(&self) -> bool {
        false
    }
    /// Another PLC makes the requests from now on; it knows nothing of those before.
    fn afresh(&mut self);
    /// Executes a request.
    ///
    /// # Errors
    /// The reason in words, with its code.
    fn done(&mut self, request: Request) -> Result<Reply, Wrong>;
    /// The present state.
    fn state(&mut self) -> Reply;
    /// What the registers show of its jobs; asked at short intervals.
    fn shown(&mut self) -> Shown {
        Shown::default()
    }
    /// What comes over the wire; told at short intervals.
    fn heard(&mut self, _traffic: Traffic) {}
}
