//! In: SIGINT, SIGTERM, SIGHUP. Out: a flag that a long command checks, so that it ends with its results so far; a
//! second signal ends the process at once.
//! Frame and unit: none.

use signal_hook::consts::{SIGINT, SIGTERM};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

/// The stop flag; from the first call on, signals set it instead of ending the process.
pub fn asked_for() -> Arc<AtomicBool> {
    static STOP: OnceLock<Arc<AtomicBool>> = OnceLock::new();
    let stop = STOP.get_or_init(|| {
        let stop = Arc::new(AtomicBool::new(false));
        for signal in signals() {
            // The order matters: the first signal finds the flag unset and sets it, the second finds it set and
            // ends the process. A signal that cannot be caught ends the process as usual, and the last checkpoint
            // remains.
            let _ = signal_hook::flag::register_conditional_shutdown(signal, 128 + signal, stop.clone());
            let _ = signal_hook::flag::register(signal, stop.clone());
        }
        stop
    });
    stop.clone()
}

fn signals() -> Vec<i32> {
    let mut all = vec![SIGINT, SIGTERM];
    #[cfg(unix)]
    if !hangup_is_ignored() {
        all.push(signal_hook::consts::SIGHUP);
    }
    all
}

/// Under nohup the end of the session (SIGHUP) has to be ignored.
#[cfg(unix)]
fn hangup_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask =
        status.lines().find_map(|l| l.strip_prefix("SigIgn:")).and_then(|m| u64::from_str_radix(m.trim(), 16).ok());
    mask.is_some_and(|m| m & 1 != 0)
}
