//! In: a job's folder. Out: whether something of it was kept that it can go on with, or back out of.
//! Frame and unit: none.

use crate::station::job::{JobState, Resumes};
use crate::web::message::Order;
use std::path::Path;

/// Where an insertion keeps its state, recordings, scan and report, in the job's folder.
pub(super) const INSERTION: &str = "insertion";

/// Whether a job that ended early can be resumed.
pub(super) fn resumes(folder: &Path, order: &Order, stopped: bool) -> bool {
    match order {
        Order::Scan(_) => true,
        // Before the part it measures anew, at the part it goes back up; what has backed out is over.
        Order::Insert(_) => {
            JobState::load(&folder.join(INSERTION)).is_ok_and(|s| s.is_none_or(|s| s.resumes() != Resumes::Over))
        }
        // Its pictures are kept; it begins anew in another folder.
        Order::Auto(_) => true,
        _ => stopped,
    }
}
