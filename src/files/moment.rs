//! In: the environment of a test run. Out: a process that dies, or a disk that is full, at the n-th file operation.
//! Release builds do not contain this.
//! Frame and unit: operations, counted from 1.

use std::io::Result;

/// Called before every file operation that a result depends on. Under `SHEETLIGHT_DIE_AT=n` the n-th call ends the
/// process as a kill would, without unwinding. Under `SHEETLIGHT_FULL_AT=n` the n-th call and all later ones fail
/// as on a full disk.
#[cfg(debug_assertions)]
pub fn moment() -> Result<()> {
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicU64, Ordering};
    static COUNT: AtomicU64 = AtomicU64::new(0);
    static AT: OnceLock<[Option<u64>; 2]> = OnceLock::new();
    let [die, full] = *AT.get_or_init(|| {
        ["SHEETLIGHT_DIE_AT", "SHEETLIGHT_FULL_AT"].map(|name| std::env::var(name).ok().and_then(|n| n.parse().ok()))
    });
    let now = COUNT.fetch_add(1, Ordering::Relaxed) + 1;
    if die == Some(now) {
        std::process::abort();
    }
    if full.is_some_and(|n| now >= n) {
        return Err(std::io::ErrorKind::StorageFull.into());
    }
    Ok(())
}

/// Does nothing: release builds are not stopped.
///
/// # Errors
/// None.
#[cfg(not(debug_assertions))]
#[inline(always)]
pub fn moment() -> Result<()> {
    Ok(())
}
