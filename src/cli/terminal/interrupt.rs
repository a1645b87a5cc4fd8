//! In: SIGINT, SIGTERM, SIGHUP. Out: a flag that a long command looks at, so that it ends with what it has; a second
//! signal ends the process at once.
//! Frame and unit: none.

use signal_hook::consts::{SIGINT, SIGTERM};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

/// The flag; from the first call on, signals set it instead of ending the process.
pub fn asked_for() -> Arc<AtomicBool> {
    static STOP: OnceLock<Arc<AtomicBool>> = OnceLock::new();
    let stop = STOP.get_or_init(|| {
        let stop = Arc::new(AtomicBool::new(false));
        for signal in signals() {
            // In this order: the first signal finds the flag down and raises it, the second finds it up. A signal that
            // cannot be caught ends the process as ever, and the last checkpoint stands.
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

/// Under nohup the end of the session is to be ignored.
#[cfg(unix)]
fn hangup_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask =
        status.lines().find_map(|l| l.strip_prefix("SigIgn:")).and_then(|m| u64::from_str_radix(m.trim(), 16).ok());
    mask.is_some_and(|m| m & 1 != 0)
}
