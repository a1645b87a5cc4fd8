//! In: a job's folder. Out: whether the job can be resumed or backed out from what is stored there.
//! Frame and unit: none.

use crate::web::message::Order;
use sheetlight::station::job::{JobState, Resumes};
use std::path::Path;

/// Name of the folder in the job's folder in which an insertion stores its state, recordings, scan and report.
pub(super) const INSERTION: &str = "insertion";

/// Whether a job that ended early can be resumed.
pub(super) fn resumes(folder: &Path, order: &Order, stopped: bool) -> bool {
    match order {
        Order::Scan(_) => true,
        // Away from the part it measures again; at the part it retracts. After it has backed out it cannot be
        // resumed.
        Order::Insert(_) => {
            JobState::load(&folder.join(INSERTION)).is_ok_and(|s| s.is_none_or(|s| s.resumes() != Resumes::Over))
        }
        // Its pictures are kept; it starts again in another folder.
        Order::Auto(_) => true,
        _ => stopped,
    }
}
